"""This module has what every command prints, and needs nothing that is slow to import."""

from __future__ import annotations

from collections.abc import Iterable

from pool_pymunk.core import compiled

CORE = f"core: {'compiled' if compiled else 'plain Python'}"


class InputError(ValueError):
    """This error is bad input; its text has one line a problem, and the exit code is 2."""


def say(lines: Iterable[str]) -> None:
    """Print lines, above a bar if there is one."""
    for line in lines:
        print(line)
