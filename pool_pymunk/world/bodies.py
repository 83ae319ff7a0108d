"""This module reads how all bodies of a pymunk space move, by one call.

Three calls a body would cost more than a step of pymunk does.
"""

from __future__ import annotations

from struct import iter_unpack
from typing import Any, NamedTuple

import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies

# This is how a body moves: its position (m), velocity (m/s) and force (N).
Moves = tuple[float, float, float, float, float, float]
FIELDS = BodyFields.BODY_ID | BodyFields.POSITION | BodyFields.VELOCITY | BodyFields.FORCE


class Snapshot(NamedTuple):
    """A snapshot has the bodies of a space, how they move, and the shapes, in pymunk's order.

    Two snapshots are equal if nobody has come, gone, or been moved between them.
    """

    ids: bytes = b""
    numbers: bytes = b""
    shapes: tuple[pymunk.Shape, ...] = ()

    @property
    def members(self) -> tuple[bytes, tuple[pymunk.Shape, ...]]:
        """The bodies and shapes that are in the space."""
        return self.ids, self.shapes

    @property
    def body_ids(self) -> list[int]:
        """The ids of the bodies."""
        return memoryview(self.ids).cast("P").tolist()

    def rows(self) -> list[Moves]:
        """Return how the bodies move, in their order."""
        rows: list[Any] = list(iter_unpack("6d", self.numbers))
        return rows

    def moves(self) -> dict[int, Moves]:
        """Return how each body moves, by its id."""
        return dict(zip(self.body_ids, self.rows(), strict=True))


class Bodies:
    """This reads the bodies of a space."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._buffer = Buffer()

    def read(self) -> Snapshot:
        """Return how the bodies move now."""
        buffer = self._buffer
        buffer.clear()
        get_space_bodies(self._space, FIELDS, buffer)
        shapes = tuple(self._space.shapes)
        return Snapshot(bytes(buffer.int_buf()), bytes(buffer.float_buf()), shapes)
