"""Ctrl-C, raised where it does no harm.

Python raises KeyboardInterrupt wherever the program happens to be. In a callback from C or in a
destructor it is printed and lost; in the middle of a library it may come out as another error;
between starting a process and noting that it was started, nobody is left to end it. The command
line has it wait, for moments, until our own code is at work.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

PAUSE = 0.01  # s between attempts to raise a Ctrl-C that waits
OWN, CALLS_BACK = "pool_pymunk", "pymunk"  # packages: ours, and the one that swallows


class _Waiting:
    """Whether a Ctrl-C waits, and how many blocks are at work that it must not split."""

    asked = False
    held = 0


@contextmanager
def patient_interrupts() -> Iterator[None]:
    """In this block Ctrl-C waits for a place where it does no harm; a second one does not."""
    if (
        not hasattr(signal, "setitimer")
        or threading.current_thread() is not threading.main_thread()
    ):
        yield
        return
    usual = signal.signal(signal.SIGINT, _asked)
    usual_alarm = signal.signal(signal.SIGALRM, _raise_if_harmless)
    try:
        yield
        raise_pending()
    finally:
        _done_waiting()
        signal.signal(signal.SIGINT, usual)
        signal.signal(signal.SIGALRM, usual_alarm)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Ctrl-C waits until the block is done, so that what it starts is known to who must end it."""
    _Waiting.held += 1
    try:
        yield
    finally:
        _Waiting.held -= 1


@contextmanager
def block_sigint() -> Iterator[None]:
    """Processes that start in this block never hear of Ctrl-C: it is for the one that asked."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    usual = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, usual)


def raise_pending() -> None:
    """Raise the Ctrl-C that waits, if one does: for places where libraries do all the work."""
    if _Waiting.asked:
        _done_waiting()
        raise KeyboardInterrupt


def _asked(number: int, frame: FrameType | None) -> None:
    if _Waiting.asked:
        raise_pending()
    _Waiting.asked = True
    _raise_if_harmless(number, frame)


def _raise_if_harmless(_number: int, frame: FrameType | None) -> None:
    if _harmless(frame):
        raise_pending()
    elif _Waiting.asked:
        signal.setitimer(signal.ITIMER_REAL, PAUSE)


def _harmless(frame: FrameType | None) -> bool:
    """Whether the code at work is ours, is not called back by pymunk, and may be split here."""
    if _Waiting.held or frame is None or _package(frame) != OWN:
        return False
    below = frame.f_back
    while below is not None and _package(below) != CALLS_BACK:
        below = below.f_back
    return below is None


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0]


def _done_waiting() -> None:
    _Waiting.asked = False
    signal.setitimer(signal.ITIMER_REAL, 0.0)
