"""This module answers in a process of its own, which ends if an answer takes too long."""

from __future__ import annotations

import multiprocessing
import signal
import threading
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection

from pool_pymunk.many.workers import end_with_parent
from pool_pymunk.model import Scene
from pool_pymunk.page.live.answers import Answers, Reply, refusal
from pool_pymunk.safety.interrupts import block_sigint

READY = "ready"
# s; a question waits as long for its turn, and for a process that begins: compiling the shots of a
# scene with arcs took 103 s on two cores with a load of 8.
WAIT = 300.0

BUSY = refusal(503, "the server is busy with another shot: try again")
BEGINS = refusal(503, "the server is getting ready: try again in some seconds")
DIED = refusal(500, "the process that plays the shots ended, and was started again: try again")


class Worker:
    """A worker is a process that answers one question after another, each in ``timeout`` (s)."""

    def __init__(self, scene: Scene, timeout: float) -> None:
        self.scene, self.timeout = scene, timeout
        self.turn, self.is_over = threading.Lock(), False
        self._begin()

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, its = context.Pipe()
        given = (its, self.scene)
        self.process = context.Process(target=work, args=given, daemon=True)
        if hasattr(signal, "pthread_sigmask"):
            resource_tracker.ensure_running()  # Its start below would let Ctrl-C through.
        with block_sigint():
            self.process.start()
        its.close()
        self.is_ready = False

    def ask(self, name: str, text: bytes) -> Reply:
        """Return the answer to a question, or say why there is none."""
        if not self.turn.acquire(timeout=WAIT):
            return BUSY
        try:
            if not self.is_ready:
                if not self.pipe.poll(WAIT):
                    return BEGINS
                self.is_ready = self.pipe.recv() == READY
            self.pipe.send((name, text))
            if self.pipe.poll(self.timeout):
                answer: Reply = self.pipe.recv()
                return answer
            self._begin_anew()
            why = f"this takes longer than {self.timeout:g} s, so it was cut"
            return refusal(400, f"{why}: choose a longer step or a slower shot")
        except (EOFError, OSError):
            self._begin_anew()
            return DIED
        finally:
            self.turn.release()

    def _begin_anew(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()
        if not self.is_over:
            self._begin()

    def end(self) -> None:
        """End the process, whatever it does."""
        self.is_over = True
        self.process.kill()
        self.process.join()


def work(pipe: Connection, scene: Scene) -> None:
    """Answer questions until nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    answers = Answers(scene)
    pipe.send(READY)
    while True:
        try:
            name, text = pipe.recv()
        except (EOFError, OSError):
            return
        pipe.send(answers.to(name, text))
