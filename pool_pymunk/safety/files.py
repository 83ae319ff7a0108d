"""This module writes whole files or none, and knows which files come with the package."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pool_pymunk.safety.interrupts import raise_pending, uninterrupted

# A device that fails says one of EIO, EFBIG, ENOSPC, EDQUOT; other OSErrors are about the place.
DEVICE_ERRORS = (errno.EIO, errno.EFBIG, errno.ENOSPC, errno.EDQUOT)


class RenderError(RuntimeError):
    """This error says in one line why a picture or film cannot be made."""


def check_place(path: Path, is_folder: bool = False) -> None:
    """Raise OSError if no file can be made at ``path``, or in it if it is to be a folder.

    A file without a name is made in the nearest folder that is there, and is gone at once.
    """
    if not is_folder and is_stream(path):
        return
    if not is_folder and path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    places = (path, *path.absolute().parents) if is_folder else path.absolute().parents
    there = next(place for place in places if place.exists())
    if not there.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    import tempfile  # Only who writes waits for it.

    try:
        tempfile.TemporaryFile(dir=there).close()
    except OSError as error:  # Rights do not tell: root has all, and some folders take no files.
        number = errno.EACCES if error.errno in (None, errno.ENOENT) else error.errno
        raise OSError(number, os.strerror(number), str(path)) from None


def is_stream(path: Path) -> bool:
    """Tell whether a device or a pipe is there, which takes what is written, and is no file."""
    return path.exists() and not path.is_file() and not path.is_dir()


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path``, which becomes ``path`` when the block succeeds.

    The folder is made, and the name keeps the suffix. If an error, a full disk or Ctrl-C ends the
    block early, ``path`` stays as it was; an OSError names ``path``. A link stays, and what it
    leads to is written. A device or a pipe is given itself: nothing takes its place.

    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "new" / "a.txt"
    >>> with whole(target) as part:
    ...     _ = part.write_text("all of it")
    >>> target.read_text(), len(list(target.parent.iterdir()))
    ('all of it', 1)
    """
    import tempfile

    raise_pending()
    named, path = path, path.resolve()
    path.parent.mkdir(parents=True, exist_ok=True)
    part = None
    try:
        if is_stream(named):
            yield named
            return
        with uninterrupted():
            handle, name = tempfile.mkstemp(named.suffix, f".{path.stem}-", path.parent)
            os.close(handle)
            part = Path(name)
        yield part
        part.chmod(0o644)
        part.replace(path)
    except OSError as error:
        if error.filename is None or f".{path.stem}-" in str(error.filename):
            error.filename = str(named)  # the name that the user knows
        raise
    finally:
        if part is not None:
            part.unlink(missing_ok=True)


def folder_of(name: str, in_sources: str) -> Path:
    """Return a folder of files that come with the package, which sources have elsewhere."""
    here = Path(__file__).parent.parent
    own = here / name
    return own if own.is_dir() else here.parent / in_sources


def bundled() -> dict[str, Path]:
    """Return the scenarios that come with the package, by name."""
    found = sorted(folder_of("scenarios", "scenarios").glob("*.toml"))
    return {path.stem: path for path in found}
