"""Round sides are whole circles: posts, corners, and the rims of pockets."""

from __future__ import annotations

import math
from typing import final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, unit
from pool_pymunk.core.walls.side import Side, is_tangent, room_in_sector

AROUND: Vector = (0.0, 0.0)  # stands for the first and the last direction of a whole circle


@final
class RoundSide(Side):
    """A round side is a circle that balls hit from all around; with radius 0 it is a corner.

    Where other sides begin, a persistent contact with it ends: it is between the directions
    ``first`` and ``last``, counter-clockwise. A whole circle has (0, 0) for both.

    >>> RoundSide((0.0, 0.0), 0.5).gap(2.0, 0.0, 0.25)
    1.25
    """

    def __init__(
        self, center: Vector, radius: float = 0.0, first: Vector = AROUND, last: Vector = AROUND
    ) -> None:
        super().__init__(radius)
        self.center = center
        self.radius = radius
        self.first = first
        self.last = last

    def gap(self, x: float, y: float, r: float) -> float:
        cx, cy = self.center
        dx, dy = x - cx, y - cy
        return math.sqrt(dx * dx + dy * dy) - self.radius - r

    def normal(self, x: float, y: float) -> Vector:
        cx, cy = self.center
        return unit(x - cx, y - cy)

    def curvature(self, x: float, y: float) -> float:
        cx, cy = self.center
        dx, dy = x - cx, y - cy
        return 1.0 / math.sqrt(dx * dx + dy * dy)

    def room(self, x: float, y: float) -> float:
        if self.first == AROUND:
            return INF
        cx, cy = self.center
        return room_in_sector(x - cx, y - cy, self.first, self.last)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the circle; never if its path is tangent, to rounding."""
        cx, cy = self.center
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        touching = r + self.radius - rounding
        if is_tangent(path, cx, cy, touching, rounding):
            return INF
        return path.time_to_disc(cx, cy, touching, now)


@final
class Rim(Side):
    """A rim is the circle on which a ball's centre is when a pocket takes it in."""

    def __init__(self, center: Vector, radius: float) -> None:
        super().__init__(radius)
        self.center = center
        self.radius = radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball's centre to the rim; negative within it."""
        cx, cy = self.center
        dx, dy = x - cx, y - cy
        return math.sqrt(dx * dx + dy * dy) - self.radius

    def normal(self, x: float, y: float) -> Vector:
        cx, cy = self.center
        return unit(x - cx, y - cy)

    def curvature(self, x: float, y: float) -> float:
        return 1.0 / self.radius

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball's centre comes to the rim."""
        cx, cy = self.center
        return path.time_to_disc(cx, cy, self.radius, now)
