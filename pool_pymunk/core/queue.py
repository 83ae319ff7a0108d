"""A queue keeps what is due, the earliest first. It is void once a ball of it has a new path."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import i64, mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.walls.wall import Wall

# What may be due, in the order of one time: ends of paths and borders come before all hits, and
# these come in the order of their balls.
BORDER: Final = 0  # A ball crosses into another patch.
PIECE: Final = 1  # The piece of a group ends, whose balls are in persistent contact.
STOP: Final = 2  # A path ends.
LOOK: Final = 3  # The path of a ball was looked at until here.
HIT: Final = 4  # Two balls meet, or a ball and a wall.

# A shorter rest is not searched for what is void.
SHORT: Final = 32
# A line begins with so many that are never due. So it is never empty, and keeps its memory.
NEVER: Final = 32
# This share of the mean time from the next one on is soon. With half of it breaks that slide take
# up to 2 % longer.
SOON: Final = 0.5
# A longer line is cut, and what is due later becomes part of the rest. At 40 such breaks take 3 %
# longer, and at 16 shots of twenty events 1 %.
LONG: Final = NEVER + 24


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Due:
    """This is due at ``t`` (s): a ball hits another one, or a wall, or something else.

    A hit of two balls has the lower number first. The engine and instants ask it.
    """

    def __init__(self, t: float, kind: i64, a: Ball, b: Ball | None, wall: Wall | None) -> None:
        self.t = t
        self.kind: i64 = kind
        self.a, self.b = a, b
        self.wall = wall
        # The numbers of its balls' paths, which are quicker to compare than the paths themselves.
        self.path_of_a: i64 = a.paths
        self.path_of_b: i64 = a.paths if b is None else b.paths

    def serve_again(self, t: float, kind: i64, a: Ball, b: Ball | None, wall: Wall | None) -> None:
        """Be what is due some other time."""
        self.t = t
        self.kind = kind
        self.a, self.b = a, b
        self.wall = wall
        self.path_of_a = a.paths
        self.path_of_b = a.paths if b is None else b.paths

    @property
    def is_void(self) -> bool:
        """This tells whether one of its balls has another path by now."""
        if self.a.paths != self.path_of_a:
            return True
        return self.b is not None and self.b.paths != self.path_of_b

    @property
    def balls(self) -> list[Ball]:
        """Its balls."""
        return [self.a] if self.b is None else [self.a, self.b]

    @property
    def is_on_table(self) -> bool:
        """This tells whether no pocket has taken in one of its balls."""
        return not (self.a.is_off or (self.b is not None and self.b.is_off))

    @property
    def key(self) -> tuple[bool, int, int]:
        """The order of hits of one instant: pairs by their balls' numbers, then walls."""
        b, wall = self.b, self.wall
        if b is not None:
            return False, self.a.number, b.number
        return True, self.a.number, -1 if wall is None else wall.place

    def is_same(self, other: Due) -> bool:
        """Tell whether another one is of the same two sides."""
        return self.a is other.a and self.b is other.b and self.wall is other.wall

    def comes_before(self, other: Due) -> bool:
        """Tell whether it is due before another one; of two stops the first one to be put in is."""
        if self.t != other.t:
            return self.t < other.t
        if self.kind < LOOK or other.kind < LOOK:
            return self.kind < other.kind or (
                self.kind == other.kind != STOP and self.a.number < other.a.number
            )
        if self.a is not other.a:
            return self.a.number < other.a.number
        return self.kind < other.kind or (self.kind == other.kind and self.key < other.key)


def key_of(due: Due) -> tuple[bool, int, int]:
    """Return the key by which hits of one instant are sorted."""
    return due.key


def hit_at(t: float, a: Ball, b: Ball | None, wall: Wall | None) -> Due:
    """Return the hit of a ball on another one, or on a wall, at a time (s)."""
    if b is not None and b.number < a.number:
        return Due(t, HIT, b, a, None)
    return Due(t, HIT, a, b, wall)


@final
class Dues:
    """These are the first ``count`` of ``all``, a list that keeps its memory as they become fewer.

    The others are over, and not yet forgotten.
    """

    def __init__(self) -> None:
        self.all: Final = list[Due]()
        self.count: i64 = 0

    def add(self, due: Due) -> None:
        """Let something be the last one."""
        if self.count < len(self.all):
            self.all[self.count] = due
        else:
            self.all.append(due)
        self.count += 1


@final
class Queue:
    """A queue has a line of what is due soon, the earliest last, and the rest as it came.

    Mostly a new path makes what is due later void before it is due, so that it is never sorted. The
    engine owns the queue. What is over or void is kept, and serves again.
    """

    def __init__(self) -> None:
        nobody = Ball(-1, 0.0, 0.0, standing(0.0, 0.0, 0.0))
        self.line: Final = [Due(INF, LOOK, nobody, None, None)] * NEVER
        self.rest: Final = Dues()
        self.kept: Final = Dues()
        self.soon = INF  # s; what is due by then is in the line
        self.full = SHORT  # The rest is searched for what is void once it is longer.

    def clear(self) -> None:
        """Forget all that is due."""
        while len(self.line) > NEVER:
            self.keep(self.line.pop())
        for k in range(self.rest.count):
            self.keep(self.rest.all[k])
        self.rest.count = 0
        self.soon = INF
        self.full = SHORT

    def keep(self, due: Due) -> None:
        """Keep what is due no more, and what nobody else knows."""
        self.kept.add(due)

    def due(self, t: float, kind: i64, a: Ball, b: Ball | None, wall: Wall | None) -> Due:
        """Return what is due at a time (s), to be put in."""
        kept = self.kept
        if kept.count == 0:
            return Due(t, kind, a, b, wall)
        kept.count -= 1
        due = kept.all[kept.count]
        due.serve_again(t, kind, a, b, wall)
        return due

    def put(self, t: float, kind: i64, ball: Ball) -> None:
        """Put in what is due for one ball alone."""
        self.push(self.due(t, kind, ball, None, None))

    def push(self, due: Due) -> None:
        """Put in what is due."""
        if due.t <= self.soon:
            self._line_up(due)
            if len(self.line) > LONG:
                self._cut()
            return
        self.rest.add(due)
        if self.rest.count > self.full:
            self._leave_out_void()
            self.full = max(SHORT, 2 * self.rest.count)

    def _line_up(self, due: Due) -> None:
        """Put in what is due soon, before all that comes before it or is due at the same time."""
        line = self.line
        low: i64 = NEVER
        high: i64 = len(line)
        while low < high:
            middle = (low + high) >> 1
            if due.comes_before(line[middle]):
                low = middle + 1
            else:
                high = middle
        line.insert(low, due)

    def _cut(self) -> None:
        """Put off the later half of the line, in the order in which it came."""
        line, middle = self.line, (NEVER + LONG) // 2
        self.soon = line[middle].t
        while middle > NEVER and line[middle - 1].t == self.soon:
            middle -= 1
        for k in range(middle - 1, NEVER - 1, -1):
            self.rest.add(line[k])
        del line[NEVER:middle]

    def pop(self) -> Due:
        """Take out what is due first; its time was asked for."""
        return self.line.pop()

    def upcoming(self) -> float:
        """Return the time (s) at which something is due next; infinite if nothing is."""
        line = self.line
        due = line[-1]
        while due.is_void:
            self.keep(line.pop())
            due = line[-1]
        if due.t == INF and self.rest.count > 0:
            self._look_further()
            return line[-1].t
        return due.t

    def _look_further(self) -> None:
        """Let the line have the first of the rest, which are not void."""
        rest, first, mean = self.rest, INF, self._leave_out_void()
        for k in range(rest.count):
            first = min(first, rest.all[k].t)
        are_few = rest.count <= LONG - NEVER
        self.soon = INF if are_few else max(first, first + SOON * (mean - first))
        count, rest.count = rest.count, 0
        for k in range(count):
            due = rest.all[k]
            if due.t <= self.soon:
                self._line_up(due)
            else:
                rest.add(due)

    def _leave_out_void(self) -> float:
        """Leave out what is void of the rest, and return the mean time (s) of the others."""
        rest, count, total = self.rest, self.rest.count, 0.0
        rest.count = 0
        for k in range(count):
            due = rest.all[k]
            if due.is_void:
                self.keep(due)
            else:
                total += due.t
                rest.add(due)
        return total / float(rest.count) if rest.count > 0 else INF
