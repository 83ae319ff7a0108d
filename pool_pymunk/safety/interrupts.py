"""This module raises Ctrl-C where it does no harm, and SIGTERM as Ctrl-C.

Python raises KeyboardInterrupt at any point of the program. In a callback from C or in a destructor
it is printed and lost, and in a library it may become another error. If it comes between the
start of a process and the note of it, nobody ends that process. So the command line delays Ctrl-C,
for moments, until the package's own code is at work.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

PAUSE = 0.01  # s between attempts to raise a pending Ctrl-C
# Our package, and those that must not be left halfway: pymunk swallows errors in its callbacks, and
# after an interrupted import of a dataclass Python aborts at its end.
OWN, CALLS_BACK = "pool_pymunk", ("pymunk", "importlib")


class _Waiting:
    """This class notes whether a Ctrl-C is pending, and how many blocks must not be split by it.

    ``last`` is the signal that was heard last.
    """

    asked = False
    held = 0
    last: int = signal.SIGINT


@contextmanager
def patient_interrupts() -> Iterator[None]:
    """Delay a Ctrl-C in this block until it does no harm; a second one is raised at once.

    Where Ctrl-C is ignored, as in a job that a shell started in the background, it stays ignored.
    SIGTERM, with which other programs end this one, is heard alike.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not hasattr(signal, "setitimer") or not is_main:
        yield
        return
    known = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    usual = {number: handler for number, handler in known.items() if handler != signal.SIG_IGN}
    usual[signal.SIGALRM] = signal.getsignal(signal.SIGALRM)
    for number in usual:
        signal.signal(number, _hear)
    try:
        yield
        raise_pending()
    finally:
        _done_waiting()
        for number, handler in usual.items():
            signal.signal(number, handler)


def interrupted_code() -> int:
    """Return the exit code of an interrupted command: 130 after Ctrl-C, 143 after SIGTERM."""
    return 128 + _Waiting.last


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C until the block is done, so that its code can note what it must end later."""
    _Waiting.held += 1
    try:
        yield
    finally:
        _Waiting.held -= 1


@contextmanager
def block_sigint() -> Iterator[None]:
    """Keep Ctrl-C from processes that start in this block: their parent handles it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)


def raise_pending() -> None:
    """Raise a pending Ctrl-C, if there is one; call this where libraries do all the work."""
    if _Waiting.asked:
        _done_waiting()
        raise KeyboardInterrupt


def _hear(number: int, frame: FrameType | None) -> None:
    """Raise a Ctrl-C if it is the second or does no harm, and otherwise look again in a moment."""
    is_new, was_asked = number != signal.SIGALRM, _Waiting.asked
    if is_new:
        _Waiting.asked, _Waiting.last = True, number
    if (is_new and was_asked) or _harmless(frame):
        raise_pending()
    elif _Waiting.asked:
        signal.setitimer(signal.ITIMER_REAL, PAUSE)


def _harmless(frame: FrameType | None) -> bool:
    """Tell whether the running code is ours, and neither pymunk nor an import has called it."""
    if _Waiting.held or frame is None or _package(frame) != OWN:
        return False
    below = frame.f_back
    while below is not None and _package(below) not in CALLS_BACK:
        below = below.f_back
    return below is None


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _done_waiting() -> None:
    _Waiting.asked = False
    signal.setitimer(signal.ITIMER_REAL, 0.0)
