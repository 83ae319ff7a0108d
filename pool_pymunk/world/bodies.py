"""This module reads how all bodies of a pymunk space move, by one call.

Three calls a body would cost more than a step of pymunk does.
"""

from __future__ import annotations

from struct import iter_unpack

import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies

# This is how a body moves: its position (m), velocity (m/s) and force (N).
Moves = tuple[float, float, float, float, float, float]


class Bodies:
    """This reads the bodies of a space as a step begins, when pymunk moves its ``clock``.

    pymunk has moved the bodies before the clock already; their way in this step is taken back.
    """

    _fields = BodyFields.BODY_ID | BodyFields.POSITION | BodyFields.VELOCITY | BodyFields.FORCE

    def __init__(self, space: pymunk.Space, clock: pymunk.Body) -> None:
        self._space = space
        self._clock = clock.id
        self._buffer = Buffer()
        self._order = b""  # the ids of the bodies, in pymunk's order
        self._ids: list[int] = []

    def read(self, dt: float) -> dict[int, Moves]:
        """Return how the bodies move as this step of ``dt`` (s) begins, by their ids."""
        buffer = self._buffer
        buffer.clear()
        get_space_bodies(self._space, self._fields, buffer)
        order = bytes(buffer.int_buf())
        if order != self._order:
            self._order, self._ids = order, memoryview(order).cast("P").tolist()
        moves = dict(zip(self._ids, iter_unpack("6d", buffer.float_buf()), strict=True))
        for body in self._ids:
            if body == self._clock:
                break
            x, y, vx, vy, fx, fy = moves[body]
            moves[body] = (x - vx * dt, y - vy * dt, vx, vy, fx, fy)
        return moves
