"""Many shots are shared out among processes here, of this machine or of others.

``workers`` is a number of processes of this machine, or any ``concurrent.futures.Executor``, such
as a process pool or ``dask.distributed.Client(...).get_executor()``. By default this process plays.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.synchronize import Event
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import Any, TypeVar

from pool_pymunk.model.plain import argument, whole
from pool_pymunk.safety.interrupts import block_sigint, raise_pending

Common = TypeVar("Common")
Item = TypeVar("Item")
Result = TypeVar("Result")

POLL = 0.1  # s; after this time an interrupt is looked for
START, SEND = 2.0, 0.05  # s; work that takes less is not worth new processes, or those there are
ROOM = 64  # so many items wait for an executor whose number of workers is not known
EACH = 3  # items wait for each worker, so that none is idle
NOT_SENT = "this process plays alone, because no other one can have the law, the scene or the " \
    "surface ({})"  # fmt: skip
NO_GUARD = "no process can start from this script: what it does must stand below the line " \
    "`if __name__ == '__main__':`"  # fmt: skip
NO_FILE = "no process can start from a script that is read from the standard input: it must be " \
    "a file"  # fmt: skip
ENDED = "a process ended while it played; is there memory enough?"


class NotSentError(Exception):
    """This is raised in a worker that cannot read what it is to work on."""


class Workers:
    """Workers are processes of this machine, or those of an executor; or this process plays alone.

    Processes start when there is work that is worth it, and end with the ``with`` block.
    """

    def __init__(self, asked: object) -> None:
        self.executor = asked if isinstance(asked, Executor) else None
        self.pool: ProcessPoolExecutor | None = None
        self.began = time.perf_counter()
        self.halt: Event | None = None  # It ends what the processes are at.
        self.count = 0  # so many processes; not known of an executor
        if self.executor is None:
            self.count = 1 if asked is None else argument("workers", asked, whole(1))
        if self.count > 1 and getattr(multiprocessing.current_process(), "_inheriting", False):
            sys.exit(1)  # A script starts itself again; the first process says what is missing.

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self.end(kind is not None)

    def end(self, halts: bool = False) -> None:
        """End the processes, and if it ``halts``, what they are at, too; others may start later."""
        if self.pool is None:
            return
        if halts and self.halt is not None:
            self.halt.set()
        self.pool.shutdown(wait=True, cancel_futures=True)
        self.pool = None

    def are_worth(self, seconds: float) -> bool:
        """Tell whether work that would take this process so long (s) is to be shared out.

        Much work that comes in small parts is worth it, too.
        """
        if self.executor is not None:
            return True
        spent = time.perf_counter() - self.began if self.pool is None else START
        return self.count > 1 and seconds > SEND and spent + seconds > START

    def share(
        self, work: Callable[[Common, Item], Result], common: Common, items: Iterable[Item]
    ) -> Iterator[Result]:
        """Yield ``work(common, item)`` of all items, as they come.

        Where the workers cannot read what is common, this process works, and a warning says so.
        """
        try:
            data = pickle.dumps(common)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            return self._alone(work, common, items, error)
        said, executor = why_none() if self.pool is None else ENDED, self.executor or self._start()
        try:
            with block_sigint():  # Processes that start now leave Ctrl-C to this one.
                trials = [executor.submit(_read, data) for _ in range(self.count or 1)]
            for each in trials:
                each.result()
        except NotSentError as error:
            return self._alone(work, common, items, error)
        except BrokenExecutor:
            raise_pending()  # What ends this process may have ended the others, too.
            if self.executor is not None:
                raise
            raise RuntimeError(f"workers = {self.count}: {said}") from None
        return self._shared(executor, partial(_work, work, data), items)

    def _start(self) -> ProcessPoolExecutor:
        """Return the processes of this machine; they start as they are needed."""
        if self.pool is None:
            if hasattr(signal, "pthread_sigmask"):
                resource_tracker.ensure_running()  # Its start would let Ctrl-C through.
            context = multiprocessing.get_context("spawn")
            self.halt = context.Event()
            given = (self.halt,)
            self.pool = ProcessPoolExecutor(self.count, context, _begin, given)
        return self.pool

    def _shared(
        self, executor: Executor, work: Callable[[Item], Result], items: Iterable[Item]
    ) -> Iterator[Result]:
        """Let an executor work on a few items at once, and yield results as they come."""
        waiting, running, room = iter(items), set[Future[Result]](), EACH * self.count or ROOM
        try:
            while True:
                some = islice(waiting, room - len(running))
                running |= {executor.submit(work, item) for item in some}
                if not running:
                    return
                finished, running = wait(running, POLL, FIRST_COMPLETED)
                raise_pending()
                yield from (each.result() for each in finished)
        except BrokenExecutor:
            raise_pending()
            if self.executor is not None:
                raise
            raise RuntimeError(f"workers = {self.count}: {ENDED}") from None
        finally:
            for each in running:
                each.cancel()

    def _alone(
        self, work: Callable[[Common, Item], Result], common: Common, items: Iterable[Item],
        error: Exception,
    ) -> Iterator[Result]:  # fmt: skip
        """Say why this process works alone, and do so."""
        said = NOT_SENT.format(str(error).splitlines()[0] if str(error) else type(error).__name__)
        warnings.warn(f"workers: {said}", stacklevel=4)
        self.executor, self.count = None, 1
        return (work(common, item) for item in items)


@contextmanager
def workers_of(asked: object) -> Iterator[Workers]:
    """Yield the workers that somebody asks for; those that are there already stay."""
    if isinstance(asked, Workers):
        yield asked
    else:
        with Workers(asked) as found:
            yield found


def renamed(workers: object, **old: object) -> Any:
    """Return the workers, which an argument of an old name may stand for; it warns."""
    for name, value in old.items():
        if value is not None:
            warnings.warn(f"{name}= is now workers=", DeprecationWarning, stacklevel=3)
            workers = value if workers is None else workers
    return workers


def why_none() -> str:
    """Return why new processes cannot start, if they cannot: they read the script, too."""
    script = getattr(sys.modules["__main__"], "__file__", None)
    return NO_GUARD if script is None or Path(script).exists() else NO_FILE


def cores() -> int:
    """Return how many cores this process may use."""
    has_affinity = hasattr(os, "sched_getaffinity")
    return len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1


# -- in a worker -----------------------------------------------------------------------------------


class HaltedError(Exception):
    """This is raised in a worker whose work nobody waits for any more."""


HALT: list[Event] = []  # the one that ends the work of this process, if it is a worker


def _begin(halt: Event) -> None:
    """Leave warnings and Ctrl-C to the process that has started this one."""
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    HALT.append(halt)
    Thread(target=end_with_parent, daemon=True).start()


def end_with_parent() -> None:
    """End this process when the one that has started it is gone, however that ended."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def check_halt() -> None:
    """Raise HaltedError in a worker whose work nobody waits for any more."""
    for halt in HALT:
        if halt.is_set():
            raise HaltedError


def _read(data: bytes) -> None:
    """Raise NotSentError where this process cannot read what is common to all items."""
    try:
        pickle.loads(data)
    except Exception as error:
        raise NotSentError(str(error)) from None


def _work(work: Callable[[Any, Item], Result], data: bytes, item: Item) -> Result:
    check_halt()
    return work(pickle.loads(data), item)
