"""This module reads how all bodies of a space move, in one call of pymunk."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from struct import iter_unpack
from typing import NamedTuple

import numpy as np
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies, set_space_bodies

from pool_pymunk.world.ball import TableBall

FIELDS = (
    BodyFields.BODY_ID | BodyFields.POSITION | BodyFields.VELOCITY
    | BodyFields.ANGULAR_VELOCITY | BodyFields.FORCE | BodyFields.TORQUE
)  # fmt: skip
NUMBERS = 8  # of each body; a number is as long (bytes) as an id
MOTION = BodyFields.POSITION | BodyFields.VELOCITY

Four = tuple[float, float, float, float]


class Moves(NamedTuple):
    """This is how a body moves: place (m), velocity (m/s, rad/s), force (N) and torque (N m)."""

    x: float
    y: float
    vx: float
    vy: float
    turns: float = 0.0
    fx: float = 0.0
    fy: float = 0.0
    torque: float = 0.0


class Snapshot:
    """A snapshot has the bodies of a space, how they move, and the shapes, in pymunk's order."""

    def __init__(
        self, ids: bytes = b"", numbers: bytes = b"", shapes: tuple[pymunk.Shape, ...] = ()
    ) -> None:
        self.ids, self.numbers, self.shapes = ids, numbers, shapes

    @cached_property
    def moves(self) -> dict[int, Moves]:
        """This is how each body moves, by its id."""
        return dict(self._between(0, len(self.ids)))

    @property
    def is_plain(self) -> bool:
        """Tell whether no force acts, and all numbers are finite and not too large to be added."""
        rows = np.frombuffer(self.numbers).reshape(-1, NUMBERS)
        return bool(np.isfinite(rows.sum())) and not rows[:, 5:].any()

    def _between(self, start: int, end: int) -> Iterator[tuple[int, Moves]]:
        """Return ids and moves of the bodies whose ids are these bytes."""
        ids, numbers = self.ids[start:end], self.numbers[NUMBERS * start : NUMBERS * end]
        rows = map(Moves._make, iter_unpack(f"{NUMBERS}d", numbers))
        return zip(memoryview(ids).cast("P"), rows, strict=True)

    def within(self, box: tuple[float, float, float, float]) -> list[int]:
        """Return the ids of the bodies in a box (m): left, bottom, right, top."""
        rows, (left, bottom, right, top) = np.frombuffer(self.numbers).reshape(-1, NUMBERS), box
        x, y = rows[:, 0], rows[:, 1]
        found = np.flatnonzero((x >= left) & (x <= right) & (y >= bottom) & (y <= top))
        ids = memoryview(self.ids).cast("P")
        return [ids[k] for k in found.tolist()]

    def is_same(self, other: Snapshot) -> bool:
        """Tell whether another snapshot has the same bodies and shapes, and they move alike."""
        are_same = self.numbers == other.numbers and self.ids == other.ids
        return are_same and self.shapes == other.shapes

    def _new(self, since: Snapshot) -> tuple[int, int] | None:
        """Return which bytes of the ids are new; None if not only new bodies have come.

        pymunk lists new dynamic bodies after the others like them, and static ones last.
        """
        more = len(self.ids) - len(since.ids)
        if more < 0:
            return None
        ids, known = (np.frombuffer(each.ids, np.intp) for each in (self, since))
        differ = np.flatnonzero(ids[: len(known)] != known)
        start = known.itemsize * int(differ[0]) if len(differ) else len(since.ids)
        is_all = self.ids[start + more :] == since.ids[start:]
        return (start, start + more) if is_all else None

    def has_all_of(self, earlier: Snapshot) -> bool:
        """Tell whether this snapshot has the bodies and shapes of an earlier one, and new ones."""
        if self.shapes[: len(earlier.shapes)] != earlier.shapes:
            return False
        return self.ids == earlier.ids or self._new(earlier) is not None

    def changes(self, since: Snapshot) -> Iterator[tuple[int, Moves]]:
        """Return the bodies that are new or move otherwise than they did, with their ids."""
        new = self._new(since) if len(self.ids) > len(since.ids) else None
        if new is not None:
            start, end = (NUMBERS * byte for byte in new)
            if self.numbers[:start] + self.numbers[end:] == since.numbers:
                return self._between(*new)
        was = since.moves
        return ((body, move) for body, move in self.moves.items() if move != was.get(body))


class Bodies:
    """The bodies of a space are read by one call; three calls for each cost more than a step.

    The same holds for their motions where the table is ``alone``: a call for all is a hundred times
    as fast. It would wake bodies that sleep, and round places of others that have their center of
    gravity elsewhere. Each table has a buffer of its own, so that tables in two threads do not
    share one.
    """

    def __init__(self, space: pymunk.Space, alone: bool) -> None:
        self._space, self._buffer, self._alone = space, Buffer(), alone
        self._ids = b""
        self._row: dict[int, int] = {}  # of each body in the buffer, by its id
        self._is_plain = False  # All may be put at once.

    def read(self) -> Snapshot:
        """Return how the bodies move now."""
        self._fill(FIELDS)
        ids, numbers = self._buffer.int_buf(), self._buffer.float_buf()
        return Snapshot(bytes(ids), bytes(numbers), tuple(self._space.shapes))

    def put(self, moves: Mapping[TableBall, Four]) -> list[Four]:
        """Give balls in the space places (m) and velocities (m/s); return those that they had."""
        if not moves:
            return []
        self._fill(BodyFields.BODY_ID | MOTION)
        self._know(bytes(self._buffer.int_buf()))
        if not self._is_plain:
            had = [(*ball.body.position, *ball.body.velocity) for ball in moves]
            for ball, (x, y, vx, vy) in moves.items():
                ball.body.position, ball.body.velocity = (x, y), (vx, vy)
            return had
        rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, 4)
        its = [self._row[ball.body_id] for ball in moves]
        had = list(map(tuple, rows[its].tolist()))
        rows[its] = list(moves.values())
        set_space_bodies(self._space, MOTION, self._buffer)
        return had

    def _fill(self, fields: BodyFields) -> None:
        self._buffer.clear()
        get_space_bodies(self._space, fields, self._buffer)

    def _know(self, ids: bytes) -> None:
        """Know which bodies there are, and whether all may be put at once."""
        if ids == self._ids:
            return
        self._ids = ids
        self._row = {body: k for k, body in enumerate(memoryview(ids).cast("P"))}
        self._is_plain = (
            self._alone
            and self._space.sleep_time_threshold == math.inf
            and all(body.center_of_gravity == (0.0, 0.0) for body in self._space.bodies)
        )
