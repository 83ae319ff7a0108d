"""Balls bounce off walls; a wall consists of sides, which are straight faces and round posts.

A pocket is a wall of another kind, which takes balls in. Its only side is its rim.

A side answers three questions. How wide is the ``gap`` to a ball? Which ``normal`` has a contact?
After which ``length_along`` its path does a ball meet the side? A caller need not know what kind of
side it asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

from pool_pymunk.physics.motion import EPSILON, Vector, path_to_disc
from pool_pymunk.physics.path import Path

GRAZING = 1e-12  # A ball that touches a face and sinks by less than this share moves along it.


class Side(Protocol):
    """A side is a part of a wall that a ball can bounce off.

    ``gap`` is the distance (m) from a ball of radius ``r`` at (x, y); it is infinite if the ball is
    not beside the side. ``normal`` is the unit vector from the side to a ball there.
    ``length_along`` is the path length (m) after which a ball of radius ``r`` meets the side; it is
    infinite if the ball does not.

    A side may have a ``core``: how far (m) it is solid below its surface, 0 if it does not say. A
    ball whose centre is deeper lies behind the side, and not in it.
    """

    def gap(self, x: float, y: float, r: float) -> float: ...

    def normal(self, x: float, y: float) -> Vector: ...

    def length_along(self, path: Path, r: float) -> float: ...


class Face(NamedTuple):
    """A face is one side of a straight cushion.

    It runs from ``start`` along ``tangent`` and faces ``outward``. ``start`` (m) lies on the
    cushion's middle line; ``radius`` (m) is half the cushion's thickness.
    """

    start: Vector
    tangent: Vector
    outward: Vector
    length: float
    radius: float = 0.0

    @property
    def core(self) -> float:
        """Return half the cushion's thickness."""
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball.

        It is infinite if the foot of the perpendicular from the ball is not on the face, ends
        included.
        """
        (x0, y0), (tx, ty), (nx, ny), length, radius = self
        foot = (x - x0) * tx + (y - y0) * ty
        slack = GRAZING * length
        if foot < -slack or foot > length + slack:
            return math.inf
        return (x - x0) * nx + (y - y0) * ny - radius - r

    def normal(self, x: float, y: float) -> Vector:
        """Return the unit vector from the face to a ball."""
        return self.outward

    def curvature(self, x: float, y: float) -> float:
        """Return 0: the normal is the same all along the face."""
        return 0.0

    def length_along(self, path: Path, r: float) -> float:
        """Return the path length (m) until a ball meets the face.

        A ball that touches the face and moves along it, to rounding, does not meet it.
        """
        (x0, y0), (tx, ty), (nx, ny), width, radius = self
        ux, uy = path.ux, path.uy
        sink = -(ux * nx + uy * ny)
        if sink <= 0.0 or path.speed == 0.0:
            return math.inf
        x, y = path.x - x0, path.y - y0
        height = x * nx + y * ny
        gap = height - r - radius
        if height < 0.0 or (sink < GRAZING and gap <= EPSILON * (abs(path.x) + abs(path.y) + r)):
            return math.inf
        length = gap / sink if gap > 0.0 else 0.0
        foot = (x + ux * length) * tx + (y + uy * length) * ty
        slack = GRAZING * width
        return length if -slack <= foot <= width + slack else math.inf


class Post(NamedTuple):
    """A post is a round wall, or with radius 0 a corner."""

    center: Vector
    radius: float = 0.0

    @property
    def core(self) -> float:
        """Return the radius: all of the post is solid."""
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball."""
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius - r

    def normal(self, x: float, y: float) -> Vector:
        """Return the unit vector from the post's centre to a ball."""
        return unit(x - self.center[0], y - self.center[1])

    def curvature(self, x: float, y: float) -> float:
        """Return how fast (1/m) the normal turns as a ball moves around the post."""
        dx, dy = x - self.center[0], y - self.center[1]
        return 1.0 / math.sqrt(dx * dx + dy * dy)

    def length_along(self, path: Path, r: float) -> float:
        """Return the path length (m) until a ball meets the post.

        A path that is tangent to rounding does not meet the post, so a ball that slides along a
        cushion goes past its end.
        """
        if path.speed == 0.0:
            return math.inf
        dx, dy = self.center[0] - path.x, self.center[1] - path.y
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        reach = r + self.radius - rounding
        along, distance = dx * path.ux + dy * path.uy, math.sqrt(dx * dx + dy * dy)
        if along <= GRAZING * reach and distance <= reach + 2.0 * rounding:
            return math.inf
        return path_to_disc((dx, dy), (path.ux, path.uy), reach)


class Rim(NamedTuple):
    """A rim is the circle on which the centre of a ball is when a pocket takes it in.

    The ball's radius does not matter.
    """

    center: Vector
    radius: float

    @property
    def core(self) -> float:
        """Return the radius: a ball lies in the pocket up to its centre."""
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball's centre to the rim; negative within it."""
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius

    def normal(self, x: float, y: float) -> Vector:
        """Return the unit vector from the pocket's centre to the ball's."""
        return unit(x - self.center[0], y - self.center[1])

    def length_along(self, path: Path, r: float) -> float:
        """Return the path length (m) until the ball's centre comes to the rim.

        The distance of the pocket's centre from the path decides whether a ball that grazes the rim
        is pocketed.
        """
        if path.speed == 0.0:
            return math.inf
        offset = (self.center[0] - path.x, self.center[1] - path.y)
        return path_to_disc(offset, (path.ux, path.uy), self.radius)


class Nothing:
    """This side is where a wall was that has been taken away: nothing meets it."""

    def gap(self, x: float, y: float, r: float) -> float:
        """Return infinity."""
        return math.inf

    def normal(self, x: float, y: float) -> Vector:
        """Return any unit vector."""
        return (1.0, 0.0)

    def length_along(self, path: Path, r: float) -> float:
        """Return infinity."""
        return math.inf


class Wall:
    """A wall bounces balls off, or takes them in if it is a pocket; it consists of sides.

    It has its coefficients and the number by which it is reported. ``center`` (m) is where a pocket
    keeps the balls that it has taken in; it is None for a wall that bounces balls off.
    ``length_along`` is that of the side that a ball meets first.
    """

    __slots__ = ("center", "friction", "length_along", "number", "restitution", "sides")

    length_along: Callable[[Path, float], float]

    def __init__(
        self, sides: tuple[Side, ...], restitution: float, friction: float, number: int
    ) -> None:
        self.sides = sides
        self.restitution = restitution
        self.friction = friction
        self.number = number
        self.center: Vector | None = None
        self.length_along = sides[0].length_along if len(sides) == 1 else self._to_the_first

    @property
    def is_pocket(self) -> bool:
        """Tell whether the wall takes balls in."""
        return self.center is not None

    def _to_the_first(self, path: Path, r: float) -> float:
        return min([side.length_along(path, r) for side in self.sides])

    def nearest(self, x: float, y: float, r: float) -> Side:
        """Return the side whose surface is nearest to a ball of radius ``r`` at (x, y)."""
        if len(self.sides) == 1:
            return self.sides[0]
        return min(self.sides, key=lambda side: abs(side.gap(x, y, r)))


def pocket(center: Vector, radius: float, number: int) -> Wall:
    """Return a wall that takes balls in whose centres come within ``radius`` (m)."""
    wall = Wall((Rim(center, radius),), 0.0, 0.0, number)
    wall.center = center
    return wall


def core_of(side: Side) -> float:
    """Return how far (m) a side is solid below its surface."""
    return float(getattr(side, "core", 0.0))


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """Return the face that a traveller from ``start`` to ``end`` (m) has on the left."""
    tx, ty = unit(end[0] - start[0], end[1] - start[1])
    return Face(start, (tx, ty), (-ty, tx), math.dist(start, end), radius)


def unit(x: float, y: float) -> Vector:
    """Return the unit vector along (x, y), or the x axis if both are zero."""
    length = math.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
