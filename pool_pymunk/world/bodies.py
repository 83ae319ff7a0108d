"""This module reads and writes places and velocities of all bodies of a space by calls of pymunk.

A call for each body takes a hundred times as long as one for all.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from struct import calcsize

import numpy as np
import numpy.typing as npt
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies, set_space_bodies

from pool_pymunk.core.motion.path import Motion
from pool_pymunk.model.problems import LARGEST
from pool_pymunk.world.ball import TableBall

MOTION = BodyFields.POSITION | BodyFields.VELOCITY
ALL = MOTION | BodyFields.ANGULAR_VELOCITY | BodyFields.FORCE | BodyFields.TORQUE
NAMED = ALL | BodyFields.BODY_ID
ROW = 4  # numbers of a motion: a place (m) and a velocity (m/s)
ID = "Q" if calcsize("P") == 8 else "I"  # as an array calls numbers of this many bytes
WIDTH = 8  # numbers of a body: its motion first, then its turning and the forces on it
Index = slice | npt.NDArray[np.intp]
Rows = npt.NDArray[np.float64]


def rows_of(motions: bytes) -> Rows:
    """Return motions (m, m/s) as rows."""
    return np.frombuffer(motions).reshape(-1, ROW).copy()


def in_a_row(numbers: Sequence[int]) -> Index:
    """Return numbers as a slice if each is one above the last, because that is quicker to take.

    >>> in_a_row([3, 4, 5]), in_a_row([])
    (slice(3, 6, None), slice(0, 0, None))
    """
    first, count = (numbers[0] if numbers else 0), len(numbers)
    if list(numbers) == [*range(first, first + count)]:
        return slice(first, first + count)
    return np.array(numbers, np.intp)


class Bodies:
    """The bodies of a space are rows of numbers; ``at`` are the rows of balls.

    ``numbers`` are those of the balls in these rows. Each table has a buffer of its own, so that
    tables in two threads do not share one. What was seen last is kept as it came: one comparison
    tells that nothing has changed.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space, self._buffer = space, Buffer()
        self._ids, self._shapes, self._seen = array(ID), -1, array("d")
        self._row_of: dict[int, int] = {}  # the rows of balls, by the ids of their bodies
        self.at: Index = slice(0, 0)
        self.numbers: Index = slice(0, 0)
        self._bodies: set[pymunk.Body] = set()
        self._odd: list[pymunk.Body] = []  # Their middles are not at their places.
        self._is_plain = False  # All may be written at once.

    def read(self) -> bool:
        """Read all bodies; tell whether they, and as many shapes, are those that are known."""
        self._buffer.clear()
        get_space_bodies(self._space, NAMED, self._buffer)
        is_known: bool = self._buffer.int_buf() == self._ids
        return is_known and len(self._space.shapes) == self._shapes

    def know(self, balls: Mapping[int, TableBall]) -> None:
        """Find the rows of balls, given by the ids of their bodies, after bodies came or went.

        To write a body wakes it up, and rounds its place if its middle is elsewhere. Then only
        balls are written.
        """
        self._ids, self._shapes = array(ID, bytes(self._buffer.int_buf())), len(self._space.shapes)
        ids = self._ids.tolist()
        self._row_of = {body: k for k, body in enumerate(ids) if body in balls}
        self.at = in_a_row([*self._row_of.values()])
        self.numbers = in_a_row([balls[body].number for body in self._row_of])
        bodies = set(self._space.bodies)
        new = bodies - self._bodies
        self._odd = [body for body in (*self._odd, *new) if body.center_of_gravity != (0.0, 0.0)]
        self._bodies = bodies
        self._is_plain = self._space.sleep_time_threshold == math.inf and not self._odd

    def come(self, ball: TableBall) -> None:
        """Expect that a new ball stands behind all others; the next reading tells if it does."""
        at, numbers, shapes, body = self.at, self.numbers, self._shapes, ball.body
        self.forget()
        if shapes < 0 or body.center_of_gravity != (0.0, 0.0):
            return
        if isinstance(at, slice) and isinstance(numbers, slice) and ball.number == numbers.stop:
            k, self._shapes = at.stop, shapes + 1
            self.at, self.numbers = slice(at.start, k + 1), slice(numbers.start, ball.number + 1)
            self._bodies.add(body)
            its = *body.position, *body.velocity, body.angular_velocity, *body.force, body.torque
            is_sound = sum(map(abs, its)) <= LARGEST
            self._ids.insert(k, ball.body_id)
            self._row_of[ball.body_id] = k
            self._seen[k * WIDTH : k * WIDTH] = array("d", its if is_sound else ())

    @property
    def are_known(self) -> bool:
        """Tell whether the rows of the balls are known."""
        return self._shapes >= 0

    @property
    def are_as_seen(self) -> bool:
        """Tell whether all numbers of all bodies are those that were seen last."""
        are_same: bool = self._buffer.float_buf() == self._seen
        return are_same

    def see(self) -> None:
        """Keep the numbers in mind, unless one of them is not finite, or very large."""
        is_sound = float(np.abs(self._rows).sum()) <= LARGEST
        self._seen = array("d", bytes(self._buffer.float_buf()) if is_sound else b"")

    def show(self, ball: TableBall, motion: Motion) -> Motion:
        """Let one body show a motion (m, m/s), and return how it shows it; keep that in mind."""
        body, (x, y, vx, vy) = ball.body, motion
        body.position, body.velocity = (x, y), (vx, vy)
        row = self._row_of.get(ball.body_id)
        if self._is_plain and self.are_known and row is not None and len(self._seen) > 0:
            self._seen[row * WIDTH : row * WIDTH + ROW] = array("d", motion)
            return motion
        return *body.position, *body.velocity

    def forget(self) -> None:
        """Know no bodies any more, as other balls are on the table."""
        self._shapes = -1

    @property
    def _rows(self) -> Rows:
        return np.frombuffer(self._buffer.float_buf()).reshape(-1, WIDTH)

    def shown(self, motions: Rows) -> Rows:
        """Return the motions of all balls as bodies show them; others stay as given."""
        found = motions.copy()
        found[self.numbers] = self._rows[self.at, :ROW]
        return found

    def write(self, motions: Rows, balls: Sequence[TableBall]) -> None:
        """Write places and velocities of all balls, and let the rows be as bodies show them."""
        if self._is_plain:
            self._rows[self.at, :ROW] = motions[self.numbers]
            set_space_bodies(self._space, ALL, self._buffer)
            return
        for k in np.flatnonzero((self.shown(motions) != motions).any(axis=1)).tolist():
            body, (x, y, vx, vy) = balls[k].body, motions[k].tolist()
            body.position, body.velocity = (x, y), (vx, vy)
        self.read()
        motions[:] = self.shown(motions)
