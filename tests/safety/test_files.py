"""Written files are for everybody to read, and places where none can be written say why."""

from __future__ import annotations

import errno
import os
import stat
import sys
import tempfile
from pathlib import Path

import pytest

from pool_pymunk.safety.files import check_place, whole


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other rights")
def test_a_written_file_may_be_read_by_all(tmp_path: Path) -> None:
    """Temporary files are for their owner alone."""
    for name in ("new.txt", "new.txt", "folder/other.txt"):
        with whole(tmp_path / name) as part:
            part.write_text("all of it")
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o644


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOSPC, errno.ENOSPC),
        (errno.EROFS, errno.EROFS),
        (errno.EACCES, errno.EACCES),
        (errno.ENOENT, errno.EACCES),  # Some folders take no files, and say that there is none.
    ],
)
@pytest.mark.parametrize("is_folder", [False, True])
def test_a_place_that_takes_no_files_says_why(
    number: int, said: int, is_folder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(**_: object) -> None:
        raise OSError(number, os.strerror(number), "a name that nobody knows")

    path = tmp_path / "new" / "a.txt"
    check_place(path, is_folder)
    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    with pytest.raises(OSError, match=os.strerror(said)) as caught:
        check_place(path, is_folder)
    assert (caught.value.errno, caught.value.filename) == (said, str(path))
    assert [*tmp_path.iterdir()] == []


def test_a_place_below_a_file_is_no_place(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError):
        check_place(tmp_path / "file" / "a.txt")
    with pytest.raises(IsADirectoryError):
        check_place(tmp_path)
    check_place(tmp_path, is_folder=True)
