"""Ctrl-C is raised where it does no harm, and it is never lost."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import nullcontext
from typing import Any

import pymunk
import pytest

from pool_pymunk import load, simulate
from pool_pymunk.safety.interrupts import (
    PAUSE,
    interrupted_code,
    patient_interrupts,
    raise_pending,
    uninterrupted,
)


@pytest.fixture(autouse=True)
def at_a_terminal() -> Iterator[None]:
    """Let Ctrl-C count, even where the tests were started in the background and ignore it."""
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, usual)


def ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def wait() -> None:
    """Be busy for longer than a pending Ctrl-C needs to be raised, where it can be."""
    time.sleep(10.0 * PAUSE)


def test_our_own_code_is_interrupted_at_once() -> None:
    soon = threading.Timer(0.2, ctrl_c)
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        soon.start()
        simulate(load("report"), solver="time-slice", dt=1e-9)  # This would take minutes.


def test_it_is_not_lost_in_a_callback_of_pymunk(capfd: pytest.CaptureFixture[str]) -> None:
    """cffi prints an error that is raised in a callback, and goes on."""
    space, body = pymunk.Space(), pymunk.Body(1.0, 1.0)

    def interrupted(body: pymunk.Body, *_: object) -> None:
        ctrl_c()
        wait()
        body.velocity = (1.0, 0.0)

    body.velocity_func = interrupted
    space.add(body)
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        space.step(0.1)
        assert body.velocity == (1.0, 0.0)  # The callback came to its end.
        raise_pending()
    assert capfd.readouterr().err == ""


def test_it_is_not_lost_in_a_destructor() -> None:
    class Dies:
        def __del__(self) -> None:
            ctrl_c()
            wait()

    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        Dies()
        raise_pending()


def test_the_end_of_the_block_is_the_last_place_to_hear_of_it() -> None:
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        ctrl_c()  # This is not the package's own code.
        wait()


@pytest.mark.parametrize("within", [nullcontext, uninterrupted])
def test_a_block_that_must_not_be_split_comes_to_its_end(within: Any) -> None:
    """A block within such a block does not end it."""
    done = []
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        with uninterrupted():
            with within():
                ctrl_c()
            simulate(load("report"), "Simulation 3", solver="time-slice", dt=1e-5)
            done.append("all of it")
        raise_pending()
        done.append("more")
    assert done == ["all of it"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_what_other_programs_send_is_heard_alike(number: int, code: int) -> None:
    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        os.kill(os.getpid(), number)
        wait()
        raise_pending()
    assert (signal.getsignal(number), interrupted_code()) == (before, code)


def test_a_second_one_does_not_wait() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), patient_interrupts():
        ctrl_c()
        done.append("first")
        ctrl_c()
        done.append("second")
    assert done == ["first"]


def test_handlers_are_as_they_were() -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM)
    with patient_interrupts():
        assert signal.getsignal(signal.SIGINT) != before[0]
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGALRM)) == before
    with pytest.raises(KeyboardInterrupt):
        ctrl_c()
        wait()


def test_what_ignores_ctrl_c_goes_on_to_ignore_it() -> None:
    """A shell's job in the background ignores it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with patient_interrupts():
        ctrl_c()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        raise_pending()
