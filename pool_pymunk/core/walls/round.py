"""Curved sides are circles, such as posts, corners and the rims of pockets, or parts of one."""

from __future__ import annotations

import math
from typing import final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, unit
from pool_pymunk.core.walls.side import Box, Side, is_tangent, room_in_sector

AROUND: Vector = (0.0, 0.0)  # stands for the first and the last direction of a whole circle


class Curved(Side):
    """A curved side is a circle with a ``center`` and a ``radius`` (m), or a part of it.

    A part runs counter-clockwise from direction ``first`` to ``last``, which are unit vectors; a
    whole circle has (0, 0). ``facing`` is 1 if balls are outside of the circle, and -1 if inside.
    """

    def __init__(
        self, center: Vector, radius: float, first: Vector, last: Vector, facing: float, core: float
    ) -> None:
        super().__init__(core)
        self.center = center
        self.radius = radius
        self.first = first
        self.last = last
        self.facing = facing

    @property
    def extent(self) -> Box:
        """A box (m) around the whole circle."""
        (x, y), r = self.center, self.radius
        return x - r, y - r, x + r, y + r

    def reach(self, r: float) -> float:
        """Return how far (m) from the centre a ball of radius ``r`` touches the side."""
        return self.radius + self.facing * r

    def is_beside(self, x: float, y: float) -> bool:
        """Tell whether a ball at a place (m) that touches the circle touches the side."""
        return True

    def gap(self, x: float, y: float, r: float) -> float:
        cx, cy = self.center
        dx, dy = x - cx, y - cy
        return self.facing * (math.sqrt(dx * dx + dy * dy) - self.radius) - r

    def normal(self, x: float, y: float) -> Vector:
        cx, cy = self.center
        nx, ny = unit(x - cx, y - cy)
        return self.facing * nx, self.facing * ny

    def curvature(self, x: float, y: float) -> float:
        cx, cy = self.center
        dx, dy = x - cx, y - cy
        return self.facing / math.sqrt(dx * dx + dy * dy)

    def room(self, x: float, y: float) -> float:
        if self.first == AROUND:
            return INF
        cx, cy = self.center
        return room_in_sector(x - cx, y - cy, self.first, self.last)


@final
class RoundSide(Curved):
    """A round side is a circle that balls hit from all around; with radius 0 it is a corner.

    Where other sides begin, a persistent contact with it ends: at ``first`` and at ``last``.

    >>> RoundSide((0.0, 0.0), 0.5).gap(2.0, 0.0, 0.25)
    1.25
    """

    def __init__(
        self, center: Vector, radius: float = 0.0, first: Vector = AROUND, last: Vector = AROUND
    ) -> None:
        super().__init__(center, radius, first, last, 1.0, radius)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the circle; never if its path is tangent, to rounding."""
        cx, cy = self.center
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        touching = r + self.radius - rounding
        if is_tangent(path, cx, cy, touching, rounding):
            return INF
        return path.time_to_disc(cx, cy, touching, now)


@final
class Rim(Curved):
    """A rim is the circle on which a ball's centre is when a pocket takes it in."""

    def __init__(self, center: Vector, radius: float) -> None:
        super().__init__(center, radius, AROUND, AROUND, 1.0, radius)

    def reach(self, r: float) -> float:
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball's centre to the rim; negative within it."""
        return super().gap(x, y, 0.0)

    def curvature(self, x: float, y: float) -> float:
        return 1.0 / self.radius

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball's centre comes to the rim."""
        cx, cy = self.center
        return path.time_to_disc(cx, cy, self.radius, now)
