"""A small tagged event is due: a hit of two balls or on a wall, a stop, or a look ahead.

A queue keeps the earliest one first. What is due is void if a ball in it has a new path by then.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from heapq import heapify, heappop, heappush
from typing import Literal, NamedTuple

from pool_pymunk.physics.path import Path

SHORT = 1000  # A shorter queue is not looked through for void predictions: that takes 0.1 ms.


class PairHit(NamedTuple):
    """Two balls meet; ``i`` is the lower number."""

    i: int
    j: int
    kind: Literal["pair"] = "pair"

    @property
    def balls(self) -> tuple[int, ...]:
        """The numbers of the balls."""
        return self[:2]


class WallHit(NamedTuple):
    """A ball meets a wall, or comes to a pocket."""

    i: int
    wall: int
    kind: Literal["wall"] = "wall"

    @property
    def balls(self) -> tuple[int, ...]:
        """The number of the ball, alone in a tuple."""
        return self[:1]


class Stop(NamedTuple):
    """A ball comes to rest."""

    i: int
    kind: Literal["stop"] = "stop"


class Look(NamedTuple):
    """A ball comes to where its path was last looked at."""

    i: int
    kind: Literal["look"] = "look"


Hit = PairHit | WallHit
What = PairHit | WallHit | Stop | Look
Due = tuple[float, int, What, Path, Path]  # when (s), in which order, what, on which paths


def hit_of(i: int, j: int) -> Hit:
    """Return the hit of a ball on another one, or on the wall of number -1 - ``j``.

    >>> hit_of(2, 1).balls, hit_of(2, -1)
    ((1, 2), WallHit(i=2, wall=0, kind='wall'))
    """
    if j < 0:
        return WallHit(i, -1 - j)
    return PairHit(i, j) if i < j else PairHit(j, i)


class Queue(list[Due]):
    """A queue is a heap of what is due on the present ``paths`` of the balls."""

    def __init__(self, paths: Sequence[Path]) -> None:
        super().__init__()
        self.paths = paths
        self.pushed = 0
        self.full = SHORT  # From this length on, what is void leaves the queue.

    def push(self, t: float, what: What) -> None:
        """Put in what is due at ``t`` (s)."""
        self.pushed += 1
        path = self.paths[what.i]
        other = self.paths[what.j] if what.kind == "pair" else path
        heappush(self, (t, self.pushed, what, path, other))
        if len(self) > self.full:
            self._leave_out_void()

    def take_until(self, latest: float) -> Iterator[Due]:
        """Take out what is due up to ``latest`` (s) and not void."""
        while self and self[0][0] <= latest:
            due = heappop(self)
            if self._is_current(due):
                yield due

    def upcoming(self) -> float:
        """Return the time (s) at which something is due next; infinite if nothing is."""
        paths = self.paths
        while self:
            t, _, what, path, other = self[0]
            if paths[what.i] is path and (what.kind != "pair" or paths[what.j] is other):
                return t
            heappop(self)
        return math.inf

    def _is_current(self, due: Due) -> bool:
        _, _, what, path, other = due
        paths = self.paths
        return paths[what.i] is path and (what.kind != "pair" or paths[what.j] is other)

    def _leave_out_void(self) -> None:
        """Leave out what is void or twice there; then the queue may double its length."""
        current = [due for due in self if self._is_current(due)]
        self[:] = {(due[0], due[2]): due for due in sorted(current, reverse=True)}.values()
        heapify(self)
        self.full = max(SHORT, 2 * len(self))
