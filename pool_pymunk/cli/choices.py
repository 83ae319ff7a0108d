"""This module has the words that options take, for --help and for the shell's completion.

Nothing slow is imported for them, because --help must come at once: of the library only the laws.
tests/test_cli_manners.py holds the other words to what the library has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from pool_pymunk.cli import lib
from pool_pymunk.physics.laws import LAWS

SOLVERS = ("pymunk", "pymunk-discrete", "pymunk-builtin", "event-driven", "time-slice")
FRICTION = ("joint", "callback")
SHOWS = ("end", "first-hit", "hits", "pocket", "duration")
UNITS = {"length": ("m", "cm", "mm", "in"), "mass": ("kg", "g"), "speed": ("m/s", "in/s")}


def among(words: Iterable[str]) -> Callable[[str], list[str]]:
    """Return the function that finds those of the words that begin as typed."""

    def begin(incomplete: str) -> list[str]:
        return [word for word in words if word.startswith(incomplete)]

    return begin


solver_names, law_names, friction_names = among(SOLVERS), among(LAWS), among(FRICTION)


def solver_lists(incomplete: str) -> list[str]:
    """Return what a list of solvers, such as ``pymunk,ev``, may go on with.

    >>> solver_lists("pymunk,ev")
    ['pymunk,event-driven']
    """
    before, comma, last = incomplete.rpartition(",")
    return [before + comma + name for name in solver_names(last)]


def scenario_names(incomplete: str) -> list[str]:
    """Return the bundled scenarios that begin as typed; where none does, shells offer files."""
    return among(lib.scenario.bundled())(incomplete)
