"""This module finds the sides of pymunk shapes: static segments, circles and polygons."""

from __future__ import annotations

import pymunk

from pool_pymunk.physics.sides import Post, Side, face_between


def sides_of(shape: pymunk.Shape) -> tuple[Side, ...]:
    """Return the faces and corners of a static segment, circle or polygon."""
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
    # The faces are those of a polygon's outside.
    faces = [face_between(b, a, shape.radius) for a, b in outline]
    return (*faces, *(Post(corner, shape.radius) for corner in corners))
