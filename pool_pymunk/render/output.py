"""This module writes whole files or none, and one clear line if it cannot be done."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import av
from av.codec.codec import UnknownCodecError

from pool_pymunk.safety.files import DEVICE_ERRORS, RenderError, whole

__all__ = ["RenderError", "written"]


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to, which becomes ``path`` when the block succeeds.

    A RenderError in the block gets the path in front. Raises OSError, with the path as its file
    name, for a folder or disk that cannot be written to.
    """
    try:
        with whole(path) as part, _ffmpeg_in_one_line():
            yield part
    except RenderError as error:
        raise RenderError(f"{path}: {error}") from error


@contextmanager
def _ffmpeg_in_one_line() -> Iterator[None]:
    """Raise OSError if the disk failed ffmpeg, otherwise RenderError with its words."""
    try:
        yield
    except UnknownCodecError as error:
        raise RenderError(f"ffmpeg: there is no codec {error}") from error
    except av.FFmpegError as error:
        if error.errno in DEVICE_ERRORS:
            raise OSError(error.errno, os.strerror(error.errno)) from error
        raise RenderError(f"{error.filename or 'ffmpeg'}: {error.strerror}") from error
