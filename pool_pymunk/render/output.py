"""Whole files or none, and one clear line where a file cannot be written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pool_pymunk.files import RenderError, whole

__all__ = ["RenderError", "written"]


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A temporary name to write to; it becomes ``path`` when the block succeeds.

    Raises RenderError with the path in front for a folder or disk that will not do, and for what
    goes wrong in the block.
    """
    try:
        with whole(path) as part:
            yield part
    except RenderError as error:
        raise RenderError(f"{path}: {error}") from error
    except OSError as error:
        raise RenderError(f"{path}: {error.strerror or error}") from error
