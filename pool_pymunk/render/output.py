"""This module writes whole files or none, and one clear line if it cannot be done."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pool_pymunk.safety.files import RenderError, whole

__all__ = ["RenderError", "written"]


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to, which becomes ``path`` when the block succeeds.

    A RenderError in the block gets the path in front. Raises OSError, with the path as its file
    name, for a folder or disk that cannot be written to.
    """
    try:
        with whole(path) as part:
            yield part
    except RenderError as error:
        raise RenderError(f"{path}: {error}") from error
