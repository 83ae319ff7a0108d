"""A queue keeps predictions: a hit of two balls or on a wall, a stop, or a look ahead.

The earliest one is first. A prediction is void once one of its balls has a new path.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from heapq import heappop, heappush
from typing import Literal, NamedTuple

from pool_pymunk.physics.path import Path

# Ends of paths come before the hits of the same time, and these come in the order of their balls.
ENDS_FIRST = 2**62
SHORT = 1000  # A shorter queue is not searched for void predictions: that takes 0.5 ms for 1,000.


class What(NamedTuple):
    """A prediction has a kind and a ball ``i``; ``j`` > ``i`` is a hit's other ball, or the wall.

    At a "stop" the ball comes to its path's end, at a "look" to the horizon, at a "patch" to a
    border (:mod:`pool_pymunk.engine.borders`), at a "piece" to the end of a half of one
    (:mod:`pool_pymunk.engine.modes`). At a "press" its contacts persist from now on, if nothing
    else comes at this instant.
    """

    kind: Literal["pair", "wall", "stop", "look", "patch", "piece", "press"]
    i: int
    j: int = -1

    @property
    def balls(self) -> tuple[int, ...]:
        """The numbers of the balls, one or two."""
        return self[1:] if self.kind == "pair" else self[1:2]


Hit = What  # one of two balls, or on a wall
Due = tuple[float, int, What, Path, Path]  # when (s), in which order, what, on which paths


def hit_of(i: int, j: int) -> Hit:
    """Return the hit of a ball on another one, or on the wall of number -1 - ``j``."""
    return What("wall", i, -1 - j) if j < 0 else What("pair", min(i, j), max(i, j))


def ends_of(hit: Hit) -> tuple[int, int]:
    """Return the ball of a hit, and the other one, or -1 - the number of the wall."""
    return (hit.i, -1 - hit.j) if hit.kind == "wall" else (hit.i, hit.j)


class Queue(list[Due]):
    """A queue is a heap of what is due on the present ``paths`` of the balls."""

    def __init__(self, paths: Sequence[Path]) -> None:
        super().__init__()
        self.paths = paths
        self.pushed = 0
        self.presses: dict[tuple[int, float], Path] = {}  # A ball is to press once at a time.
        self.full = SHORT  # From this length on, what is void leaves the queue.

    def push(self, t: float, what: What) -> None:
        """Put in what is due at ``t`` (s)."""
        self.pushed += 1
        kind, i, j = what
        path = other = self.paths[i]
        order = i
        if kind == "pair":
            other = self.paths[j]
        elif kind == "stop":
            order = self.pushed - ENDS_FIRST
        elif kind in ("patch", "piece"):
            order = i - ENDS_FIRST
        elif kind == "press":
            if self.presses.get((i, t)) is path:
                return
            self.presses[i, t], order = path, i + ENDS_FIRST
        heappush(self, (t, order, what, path, other))
        if len(self) > self.full:
            self._leave_out_void()

    def take_until(self, latest: float) -> Iterator[Due]:
        """Take out what is due up to ``latest`` (s) and not void."""
        while self.upcoming() <= latest and self:
            yield heappop(self)

    def upcoming(self) -> float:
        """Return the time (s) at which something is due next; infinite if nothing is."""
        paths = self.paths
        while self:
            t, _, (kind, i, j), path, other = self[0]
            if paths[i] is path and (kind != "pair" or paths[j] is other):
                return t
            heappop(self)
        return math.inf

    def _leave_out_void(self) -> None:
        """Leave out void and double predictions; then the queue may double its length."""
        first = dict[tuple[float, What], Due]()
        self.presses = {
            key: path for key, path in self.presses.items() if self.paths[key[0]] is path
        }
        for due in self.take_until(math.inf):
            first.setdefault((due[0], due[2]), due)
        self[:] = first.values()  # What is sorted is a heap.
        self.full = max(SHORT, 2 * len(self))
