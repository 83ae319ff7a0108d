"""What balls bounce off: straight faces and round posts, and walls made of them.

A side answers three questions: how wide the ``gap`` to a ball is, which ``normal`` a contact has,
and after which ``length_along`` its path a ball meets it. Whoever asks need not know its kind.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

from pool_pymunk.physics.motion import EPSILON, Vector, path_to_disc
from pool_pymunk.physics.path import Path

GRAZING = 1e-12  # a ball that touches a face and moves along it sinks by less than this share


class Side(Protocol):
    """What a ball can bounce off.

    ``gap`` is the distance (m) from a ball of radius ``r`` at (x, y), infinite if the ball is not
    beside the side; ``normal`` is the unit vector from the side to a ball there; ``length_along``
    is the path length (m) after which a ball of radius ``r`` meets it, infinite if it does not.
    """

    def gap(self, x: float, y: float, r: float) -> float: ...

    def normal(self, x: float, y: float) -> Vector: ...

    def length_along(self, path: Path, r: float) -> float: ...


class Face(NamedTuple):
    """One side of a straight cushion, from ``start`` along ``tangent``, facing ``outward``.

    ``start`` (m) lies on the cushion's middle line; ``radius`` (m) is half its thickness.
    """

    start: Vector
    tangent: Vector
    outward: Vector
    length: float
    radius: float = 0.0

    def gap(self, x: float, y: float, r: float) -> float:
        """Distance (m) from the ball; infinite if its foot is not on the face, ends included."""
        (x0, y0), (tx, ty), (nx, ny), length, radius = self
        foot = (x - x0) * tx + (y - y0) * ty
        slack = GRAZING * length
        if foot < -slack or foot > length + slack:
            return math.inf
        return (x - x0) * nx + (y - y0) * ny - radius - r

    def normal(self, x: float, y: float) -> Vector:
        """The unit vector from the face to a ball."""
        return self.outward

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) until a ball meets the face.

        A ball that touches it and moves along it, to rounding, does not.
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
    """A round wall, or with radius 0 a corner."""

    center: Vector
    radius: float = 0.0

    def gap(self, x: float, y: float, r: float) -> float:
        """Distance (m) from the ball."""
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius - r

    def normal(self, x: float, y: float) -> Vector:
        """The unit vector from the post's centre to a ball."""
        return unit(x - self.center[0], y - self.center[1])

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) until a ball meets the post.

        A path that is tangent to rounding does not meet it: a ball that slides along a cushion goes
        past its end.
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


class Wall:
    """What bounces balls as one: its sides, its coefficients, and the number it is reported by.

    ``length_along`` is that of the side which a ball meets first.
    """

    __slots__ = ("friction", "length_along", "number", "restitution", "sides")

    length_along: Callable[[Path, float], float]

    def __init__(
        self, sides: tuple[Side, ...], restitution: float, friction: float, number: int
    ) -> None:
        self.sides = sides
        self.restitution = restitution
        self.friction = friction
        self.number = number
        self.length_along = sides[0].length_along if len(sides) == 1 else self._to_the_first

    def _to_the_first(self, path: Path, r: float) -> float:
        return min([side.length_along(path, r) for side in self.sides])

    def nearest(self, x: float, y: float, r: float) -> Side:
        """The side whose surface is nearest to that of a ball of radius ``r`` at (x, y)."""
        if len(self.sides) == 1:
            return self.sides[0]
        return min(self.sides, key=lambda side: abs(side.gap(x, y, r)))


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """The face on the left of the way from ``start`` to ``end`` (m)."""
    tx, ty = unit(end[0] - start[0], end[1] - start[1])
    return Face(start, (tx, ty), (-ty, tx), math.dist(start, end), radius)


def unit(x: float, y: float) -> Vector:
    """The unit vector along (x, y); of nothing, along x."""
    length = math.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
