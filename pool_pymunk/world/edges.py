"""This module has the lines and circles on which the centre of a touching ball lies."""

from __future__ import annotations

import math

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.sides import Round, Straight

Edge = Round | Straight


def crossings(one: Edge, other: Edge) -> list[Vector]:
    """Return the points that two edges share, if there are any and not too many.

    >>> crossings(Round((0.0, 0.0), 5.0), Straight((3.0, 0.0), (1.0, 0.0)))
    [(3.0, 4.0), (3.0, -4.0)]
    >>> crossings(Straight((3.0, 0.0), (1.0, 0.0)), Straight((0.0, 2.0), (0.0, 1.0)))
    [(3.0, 2.0)]
    >>> crossings(Round((0.0, 0.0), 5.0), Round((6.0, 0.0), 5.0))
    [(3.0, 4.0), (3.0, -4.0)]
    """
    if isinstance(one, Straight):
        return _on_line(one, other)
    if isinstance(other, Straight):
        return _on_line(other, one)
    # The points lie on a line, too: that of equal power to both circles.
    (x, y), (u, v) = one.center, other.center
    apart = math.dist((x, y), (u, v))
    if apart == 0.0:
        return []
    nx, ny = (u - x) / apart, (v - y) / apart
    far = (apart + (one.radius - other.radius) * (one.radius + other.radius) / apart) / 2.0
    return _on_line(Straight((x + far * nx, y + far * ny), (nx, ny)), one)


def _on_line(line: Straight, other: Edge) -> list[Vector]:
    nx, ny = line.normal
    if isinstance(other, Straight):
        (x, y), (mx, my) = line.point, other.normal
        slope = my * nx - mx * ny
        if slope == 0.0:
            return []
        along = -other.height((x, y)) / slope
        return [(x - along * ny, y + along * nx)]
    height = line.height(other.center)
    if abs(height) > other.radius:
        return []
    half = math.sqrt((other.radius - height) * (other.radius + height))
    x, y = other.center[0] - height * nx, other.center[1] - height * ny
    return [(x - half * ny, y + half * nx), (x + half * ny, y - half * nx)]
