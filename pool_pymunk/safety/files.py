"""Whole files or none: what is written appears under its name only when it is complete."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pool_pymunk.safety.interrupts import raise_pending, uninterrupted

# What a device says that fails: EIO, EFBIG, ENOSPC, EDQUOT (other OSErrors are about the place).
DEVICE_ERRORS = (errno.EIO, errno.EFBIG, errno.ENOSPC, errno.EDQUOT)


class RenderError(RuntimeError):
    """A picture or film that cannot be made; the message is one line."""


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path`` to write to; it becomes ``path`` when the block succeeds.

    The folder is made if it is not there. The temporary name keeps the suffix. Whatever ends the
    block early (an error, a full disk, Ctrl-C) leaves ``path`` as it was; an OSError names it.

    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "new" / "a.txt"
    >>> with whole(target) as part:
    ...     _ = part.write_text("all of it")
    >>> target.read_text(), len(list(target.parent.iterdir()))
    ('all of it', 1)
    """
    raise_pending()
    path.parent.mkdir(parents=True, exist_ok=True)
    part = None
    try:
        with uninterrupted():
            part = _temporary(path)
        yield part
        part.chmod(0o644)
        part.replace(path)
    except OSError as error:
        if error.filename in (None, str(part)):
            error.filename = str(path)  # the name that the user knows
        raise
    finally:
        if part is not None:
            part.unlink(missing_ok=True)


def _temporary(path: Path) -> Path:
    """A new, empty file beside ``path`` with the same suffix."""
    handle, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    return Path(name)
