"""Walls bounce balls off, or take them in: a wall consists of sides, a pocket has only a rim."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import i64, mypyc_attr

from pool_pymunk.core.ball import EVERYTHING
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import Rim
from pool_pymunk.core.walls.side import Side, nearest_of

# How a wall moves where a ball is: its velocity (m/s), its angular velocity (rad/s), and the
# centrifugal acceleration (m/s^2) that lifts the ball off it.
Sweep = tuple[float, float, float, float]


@mypyc_attr(allow_interpreted_subclasses=True)
class Wall:
    """A wall bounces balls off its sides, with its own coefficients.

    ``number`` is how it is reported, and ``only`` its side if it has just one. If that is a
    ``face``, as mostly, the engine may ask the face alone when a ball meets it. A wall that kicks
    adds its ``kick`` (m/s) to the velocity of a ball along the normal. The bits of ``categories``
    and ``mask`` say whom it may meet. The engine asks it when a ball meets it, and which side is
    nearest.
    """

    def __init__(
        self, sides: list[Side], restitution: float, friction: float, number: int, kick: float = 0.0
    ) -> None:
        self.sides = sides
        self.only: Final[Side | None] = sides[0] if len(sides) == 1 else None
        self.face: Face | None = None
        self.restitution = restitution
        self.friction = friction
        self.number = number
        self.kick = kick
        self.place = number  # among the walls of a table, pockets included
        self.categories: i64 = EVERYTHING
        self.mask: i64 = EVERYTHING
        self.is_pocket = False
        self.moves = False
        if type(self) is Wall and isinstance(self.only, Face):
            self.face = self.only

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s), not before now, a ball meets one of the sides, or infinity."""
        only = self.only
        if only is not None:
            return only.time_of_contact(path, r, now)
        first = INF
        for side in self.sides:
            first = min(first, side.time_of_contact(path, r, now))
        return first

    @property
    def until(self) -> float:
        """The time (s) until which the wall moves as it does now, or stands."""
        return INF

    def nearest(self, x: float, y: float, r: float, now: float) -> Side:
        """Return the side whose surface is nearest to a ball of radius ``r`` at (x, y), now (s)."""
        only = self.only
        return nearest_of(self.sides, x, y, r) if only is None else only

    def side_beside(self, x: float, y: float, r: float, now: float) -> Side:
        """Return the nearest side for a contact that persists: if the wall moves, the side does."""
        return self.nearest(x, y, r, now)

    def drift(self, x: float, y: float, r: float, now: float) -> Vector:
        """Return the velocity (m/s) of the wall where a ball at (x, y) touches it: it stands."""
        return 0.0, 0.0

    def sweep(self, x: float, y: float, now: float) -> Sweep:
        """Return how the wall moves at (x, y): it stands."""
        return 0.0, 0.0, 0.0, 0.0


@final
class Pocket(Wall):
    """A pocket takes balls in whose centres come within its radius (m), and keeps them."""

    def __init__(self, center: Vector, radius: float, number: int) -> None:
        super().__init__([Rim(center, radius)], 0.0, 0.0, number)
        self.center = center
        self.radius = radius
        self.is_pocket = True

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        cx, cy = self.center
        return path.time_to_disc(cx, cy, self.radius, now)
