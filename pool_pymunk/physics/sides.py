"""What balls bounce off: straight faces and round posts, and walls made of them.

A side answers three questions: how wide the ``gap`` to a ball is, which ``normal`` a contact has,
and after which ``length_along`` its path a ball meets it. Whoever asks need not know its kind.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from pool_pymunk.physics.motion import EPSILON, Vector, path_to_disc
from pool_pymunk.physics.path import Path

GRAZING = 1e-12  # a ball that touches a face and moves along it sinks by less than this share


class Side(Protocol):
    """What a ball can bounce off."""

    def gap(self, x: float, y: float, r: float) -> float:
        """Distance (m) from a ball of radius ``r`` at (x, y); infinite if it is not beside."""
        ...

    def normal(self, x: float, y: float) -> Vector:
        """The unit vector from the side to a ball at (x, y)."""
        ...

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) after which a ball of radius ``r`` meets it; infinite if it does not."""
        ...


class Face(NamedTuple):
    """One side of a straight cushion, from ``start`` along ``tangent``, facing ``outward``.

    ``start`` (m) lies on the cushion's middle line; ``radius`` (m) is half its thickness.
    """

    start: Vector
    tangent: Vector
    outward: Vector
    length: float
    radius: float = 0.0

    def height(self, x: float, y: float) -> float:
        """Distance (m) of a point from the middle line, on this side positive."""
        return (x - self.start[0]) * self.outward[0] + (y - self.start[1]) * self.outward[1]

    def spans(self, x: float, y: float) -> bool:
        """Tell whether the foot of a point lies on the face, its ends included to rounding."""
        foot = (x - self.start[0]) * self.tangent[0] + (y - self.start[1]) * self.tangent[1]
        slack = GRAZING * self.length
        return -slack <= foot <= self.length + slack

    def gap(self, x: float, y: float, r: float) -> float:
        """Distance (m) from a ball of radius ``r`` at (x, y); infinite if it is not beside."""
        return self.height(x, y) - self.radius - r if self.spans(x, y) else math.inf

    def normal(self, x: float, y: float) -> Vector:
        """The unit vector from the face to a ball at (x, y)."""
        return self.outward

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) after which a ball of radius ``r`` meets it; infinite if it does not."""
        return face_length(path, r, self)


class Post(NamedTuple):
    """A round wall, or with radius 0 a corner."""

    center: Vector
    radius: float = 0.0

    def gap(self, x: float, y: float, r: float) -> float:
        """Distance (m) from a ball of radius ``r`` at (x, y)."""
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius - r

    def normal(self, x: float, y: float) -> Vector:
        """The unit vector from the post's centre to a ball at (x, y)."""
        return unit(x - self.center[0], y - self.center[1])

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) after which a ball of radius ``r`` meets it; infinite if it does not."""
        return post_length(path, r, self)


class Wall(NamedTuple):
    """What bounces balls as one: its sides, its coefficients, and the number it is reported by."""

    sides: tuple[Side, ...]
    restitution: float
    friction: float
    number: int

    def nearest(self, x: float, y: float, r: float) -> Side:
        """The side whose surface is nearest to that of a ball of radius ``r`` at (x, y)."""
        if len(self.sides) == 1:
            return self.sides[0]
        return min(self.sides, key=lambda side: abs(side.gap(x, y, r)))

    def length_along(self, path: Path, r: float) -> float:
        """Path length (m) after which a ball of radius ``r`` meets it; infinite if it does not."""
        if len(self.sides) == 1:
            return self.sides[0].length_along(path, r)
        return min([side.length_along(path, r) for side in self.sides])


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """The face on the left of the way from ``start`` to ``end`` (m)."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.sqrt(dx * dx + dy * dy)
    tangent = (dx / length, dy / length)
    return Face(start, tangent, (-tangent[1], tangent[0]), length, radius)


def unit(x: float, y: float) -> Vector:
    """The unit vector along (x, y); of nothing, along x."""
    length = math.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)


def face_length(path: Path, r: float, face: Face) -> float:
    """Path length (m) after which a ball of radius ``r`` meets a face; infinite if it does not."""
    start, tangent, (nx, ny), width, radius = face
    ux, uy = path.ux, path.uy
    sink = -(ux * nx + uy * ny)
    if sink <= 0.0 or path.speed == 0.0:
        return math.inf
    x, y = path.x - start[0], path.y - start[1]
    height = x * nx + y * ny
    gap = height - r - radius
    if height < 0.0 or (sink < GRAZING and gap <= EPSILON * (abs(path.x) + abs(path.y) + r)):
        return math.inf
    length = gap / sink if gap > 0.0 else 0.0
    foot = (x + ux * length) * tangent[0] + (y + uy * length) * tangent[1]
    slack = GRAZING * width
    return length if -slack <= foot <= width + slack else math.inf


def post_length(path: Path, r: float, post: Post) -> float:
    """Path length (m) after which a ball of radius ``r`` meets a post; infinite if it does not.

    A path that is tangent to rounding does not: a ball that slides along a cushion goes past its
    end.
    """
    if path.speed == 0.0:
        return math.inf
    dx, dy = post.center[0] - path.x, post.center[1] - path.y
    rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
    reach = r + post.radius - rounding
    along, distance = dx * path.ux + dy * path.uy, math.sqrt(dx * dx + dy * dy)
    if along <= GRAZING * reach and distance <= reach + 2.0 * rounding:
        return math.inf
    return path_to_disc((dx, dy), (path.ux, path.uy), reach)
