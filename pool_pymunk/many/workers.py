"""Many shots are shared out among processes here, of this machine or of others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from itertools import islice
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
POLL = 0.1  # s; after this time an interrupt is looked for


def results(
    executor: Executor, work: Callable[[Item], Result], items: Iterable[Item], room: int
) -> Iterator[Result]:
    """Let an executor work on at most ``room`` items at once, and yield results as they come."""
    waiting, running = iter(items), set[Future[Result]]()
    try:
        while True:
            free = room - len(running)
            running |= {executor.submit(work, item) for item in islice(waiting, free)}
            if not running:
                return
            finished, running = wait(running, POLL, FIRST_COMPLETED)
            yield from (each.result() for each in finished)
    finally:
        for each in running:
            each.cancel()
