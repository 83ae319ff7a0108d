"""The program in a process of its own, which may be interrupted, or have a full disk."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import pytest

from tests.shared.commands import without_remarks
from tests.shared.scenes import at_a_terminal

TIMEOUT = 240.0  # s; another process may compile beside
MOST_BYTES = 20_000  # A file on the full disk can have this many bytes.


def start(*arguments: object, limited: bool = False) -> subprocess.Popen[str]:
    """Start ``pool-pymunk`` with these arguments, in a process and group of its own."""
    if sys.platform == "win32":
        pytest.skip("Windows has no groups of processes that a Ctrl-C reaches")
    return subprocess.Popen(
        [sys.executable, "-m", "pool_pymunk", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=_on_a_full_disk if limited else at_a_terminal,
    )


def _on_a_full_disk() -> None:
    """Limit the size of files, so that writing more fails as it does on a full disk."""
    import resource  # Windows has none.

    at_a_terminal()
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_BYTES, MOST_BYTES))


def wait_until(so: Callable[[], bool]) -> None:
    """Wait until it is so."""
    latest = time.monotonic() + TIMEOUT
    while not so():
        assert time.monotonic() < latest, "it never came to be"
        time.sleep(0.01)


def interrupt(process: subprocess.Popen[str], number: int = signal.SIGINT, code: int = 130) -> str:
    """Send Ctrl-C to the whole group, as a terminal does, and return what else stderr says.

    Another signal may have another ``number``, and the program ends with an exit ``code``.
    """
    os.killpg(process.pid, number)
    _, stderr = process.communicate(timeout=TIMEOUT)
    assert process.returncode == code, stderr
    return without_remarks(stderr)


def is_alive(group: int) -> bool:
    """Tell whether the group has a process left."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
