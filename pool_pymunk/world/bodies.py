"""This module reads and writes places and velocities of all bodies of a space by calls of pymunk.

A call for each body takes a hundred times as long as one for all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies, set_space_bodies

from pool_pymunk.model.problems import LARGEST
from pool_pymunk.world.ball import TableBall

MOTION = BodyFields.POSITION | BodyFields.VELOCITY
ALL = BodyFields.BODY_ID | MOTION
FORCES = BodyFields.FORCE | BodyFields.TORQUE | BodyFields.ANGULAR_VELOCITY
ROW = 4  # numbers of a body: its place (m) and its velocity (m/s)
Rows = npt.NDArray[np.float64]


class Bodies:
    """The bodies of a space are ``rows`` of numbers; ``at`` are the rows of balls.

    ``numbers`` are those of the balls in these rows. Each table has a buffer of its own, so that
    tables in two threads do not share one.
    """

    def __init__(self, space: pymunk.Space) -> None:
        self._space, self._buffer, self._forces = space, Buffer(), Buffer()
        self._ids, self._shapes = b"", -1
        self.rows: Rows = np.zeros((0, ROW))
        self.at = self.numbers = np.zeros(0, np.intp)
        self._seen: set[pymunk.Body] = set()
        self._odd: list[pymunk.Body] = []  # Their middles are not at their places.
        self._is_plain = False  # All may be written at once.

    def read(self) -> bool:
        """Read all bodies; tell whether they, and as many shapes, are those that are known."""
        self._buffer.clear()
        get_space_bodies(self._space, ALL, self._buffer)
        self.rows = np.frombuffer(self._buffer.float_buf()).reshape(-1, ROW)
        ids = bytes(self._buffer.int_buf())
        return ids == self._ids and len(self._space.shapes) == self._shapes

    def know(self, balls: Mapping[int, TableBall]) -> None:
        """Find the rows of balls, given by the ids of their bodies, after bodies came or went.

        To write a body wakes it up, and rounds its place if its middle is elsewhere. Then only
        balls are written.
        """
        self._ids, self._shapes = bytes(self._buffer.int_buf()), len(self._space.shapes)
        ids = memoryview(self._ids).cast("P").tolist()
        at = [k for k, body in enumerate(ids) if body in balls]
        self.at = np.array(at, np.intp)
        self.numbers = np.array([balls[ids[k]].core.number for k in at], np.intp)
        bodies = set(self._space.bodies)
        new = bodies - self._seen
        self._odd = [body for body in (*self._odd, *new) if body.center_of_gravity != (0.0, 0.0)]
        self._seen = bodies
        self._is_plain = self._space.sleep_time_threshold == math.inf and not self._odd

    @property
    def are_known(self) -> bool:
        """Tell whether the rows of the balls are known."""
        return self._shapes >= 0

    def has_odd_forces(self) -> bool:
        """Tell whether a force, a torque or an angular velocity is not finite, or very large."""
        self._forces.clear()
        get_space_bodies(self._space, FORCES, self._forces)
        return not float(np.abs(np.frombuffer(self._forces.float_buf())).sum()) <= LARGEST

    def forget(self) -> None:
        """Know no bodies any more, as other balls are on the table."""
        self._ids, self._shapes = b"", -1

    @property
    def of_balls(self) -> Rows:
        """The rows of the balls, as last read or written."""
        return self.rows[self.at]

    def write(self, motions: Rows, balls: Sequence[TableBall]) -> Rows:
        """Write places and velocities of all balls, and return these rows as bodies show them."""
        motions = motions[self.numbers]
        if self._is_plain:
            self.rows[self.at] = motions
            set_space_bodies(self._space, MOTION, self._buffer)
            return motions
        for k in np.flatnonzero((self.of_balls != motions).any(axis=1)).tolist():
            body, (x, y, vx, vy) = balls[self.numbers[k]].body, motions[k].tolist()
            body.position, body.velocity = (x, y), (vx, vy)
        self.read()
        return self.of_balls
