"""This module reads how all bodies of a pymunk space move, by one call.

Three calls a body would cost more than a step of pymunk does.
"""

from __future__ import annotations

from struct import iter_unpack
from typing import Any

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
        self._order = b""
        self.ids: list[int] = []  # of the bodies, in pymunk's order
        self.place: dict[int, int] = {}  # the places of the bodies in that order
        self.has_new_order = False  # Some body has come or gone, fallen asleep or woken up.

    def read(self, dt: float) -> list[Moves]:
        """Return how the bodies move as this step of ``dt`` (s) begins, in the order of ``ids``."""
        buffer = self._buffer
        buffer.clear()
        get_space_bodies(self._space, self._fields, buffer)
        order = bytes(buffer.int_buf())
        self.has_new_order = order != self._order
        if self.has_new_order:
            self._order, self.ids = order, memoryview(order).cast("P").tolist()
            self.place = {body: k for k, body in enumerate(self.ids)}
        numbers: Any = buffer.float_buf()
        moves: list[Any] = list(iter_unpack("6d", numbers))
        for k, body in enumerate(self.ids):
            if body == self._clock:
                break
            x, y, vx, vy, fx, fy = moves[k]
            moves[k] = (x - vx * dt, y - vy * dt, vx, vy, fx, fy)
        return moves
