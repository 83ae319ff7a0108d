"""What balls bounce off in a pymunk space: static segments, circles and polygons, side by side."""

from __future__ import annotations

import math
from typing import NamedTuple

import pymunk

from pool_pymunk.motion import Vector
from pool_pymunk.path import Face, Path, Post, face_length, post_length


class Wall(NamedTuple):
    """What a ball can bounce off: the sides of a shape, its coefficients, and its number."""

    sides: tuple[Face | Post, ...]
    restitution: float
    friction: float
    number: int

    def nearest(self, point: Vector) -> tuple[float, Vector]:
        """Distance (m) of a point from the wall's surface, and the normal there."""
        found: list[tuple[float, Vector]] = []
        for side in self.sides:
            if isinstance(side, Post):
                dx, dy = point[0] - side.center[0], point[1] - side.center[1]
                found.append((math.hypot(dx, dy) - side.radius, unit(dx, dy)))
            elif 0.0 <= side.along(point) <= side.length:
                found.append((side.height(point) - side.radius, side.normal))
        return min(found, key=lambda item: abs(item[0])) if found else (math.inf, (1.0, 0.0))


def length_to(side: Face | Post, path: Path, r: float) -> float:
    """Path length (m) after which a ball of radius ``r`` meets a side; infinite if it does not."""
    return face_length(path, r, side) if isinstance(side, Face) else post_length(path, r, side)


def sides_of(shape: pymunk.Shape) -> tuple[Face | Post, ...]:
    """The faces and corners of a static segment, circle or polygon."""
    body = shape.body
    assert body is not None
    if isinstance(shape, pymunk.Circle):
        center = body.local_to_world(shape.offset)
        return (Post((center[0], center[1]), shape.radius),)
    if isinstance(shape, pymunk.Segment):
        ends = [body.local_to_world(end) for end in (shape.a, shape.b)]
    else:
        assert isinstance(shape, pymunk.Poly), "walls are segments, circles or polygons"
        ends = [body.local_to_world(corner) for corner in shape.get_vertices()]
    corners = [(x, y) for x, y in ends]
    outline = zip(corners, corners[1:] + corners[:1], strict=True)
    faces = [face_between(b, a, shape.radius) for a, b in outline]  # a polygon's outside
    return (*faces, *(Post(corner, shape.radius) for corner in corners))


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """The face on the left of the way from ``start`` to ``end``."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    tangent = (dx / length, dy / length)
    return Face(start, tangent, (-tangent[1], tangent[0]), length, radius)


def unit(x: float, y: float) -> Vector:
    """The unit vector along (x, y); of nothing, along x."""
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
