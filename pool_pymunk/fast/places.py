"""This module has the rules of places as numba compiles them: those of ``core/floor.py``."""

from __future__ import annotations

from typing import Any

from pool_pymunk.model.places import room_beside_ball
from pool_pymunk.model.problems import COORDINATE_ROUNDING


def is_beside(gap: float, r: float, core: float) -> bool:
    """Tell whether a ball lies beside a side or in it, and not behind it.

    ``gap`` (m) is that of the side to a ball of radius ``r``, ``core`` (m) how far the side is
    solid below its surface.
    """
    return gap >= -(r + core)


def sinks(room: float, size: float, x: float, y: float, share: float) -> bool:
    """Tell whether a ball at (x, y) overlaps something by more than if it touched.

    A ball that touches may overlap by a ``share`` of ``size`` (m) and the rounding of coordinates.
    """
    return room < 0.0 and room < -(share * size + COORDINATE_ROUNDING * max(abs(x), abs(y)))


def overlap(x: float, y: float, r: float, u: float, v: float, q: float, share: float) -> bool:
    """Tell whether a ball of radius ``r`` at (x, y) lies in one of radius ``q`` at (u, v)."""
    room = room_beside_ball(x, y, r, u, v, q)
    return room < 0.0 and (sinks(room, min(r, q), max(abs(x), abs(u)), max(abs(y), abs(v)), share))


def contains(xs: Any, ys: Any, arcs: Any, x: float, y: float) -> bool:
    """Tell whether a point is within an outline, by its corners and arcs; numba can compile it.

    The areas are the polygon of the corners, and that between each arc and its chord. A point is
    within the outline if it is within an odd number of these areas.
    """
    inside = False
    for k in range(len(xs)):
        inside ^= crosses(xs[k - 1], ys[k - 1], xs[k], ys[k], x, y)
    for k in range(len(arcs)):
        inside ^= lies_between(arcs[k], x, y)
    return inside


def lies_between(arc: Any, x: float, y: float) -> bool:
    """Tell whether a point lies between an arc and its chord.

    Near the chord, rounding puts the point on the same side as it does in ``crosses``.
    """
    ax, ay, bx, by, dx, dy = arc[0], arc[1], arc[2], arc[3], x - arc[4], y - arc[5]
    if dx * dx + dy * dy >= arc[6] * arc[6]:
        return False
    if (ay > y) != (by > y):
        is_left = crosses(ax, ay, bx, by, x, y) == (by > ay)
    elif ay == by:
        is_left = (y >= ay) == (bx > ax)
    else:
        is_left = (bx - ax) * (y - ay) > (by - ay) * (x - ax)
    return bool(is_left != (arc[7] > 0.0))


def crosses(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Tell whether a ray from (x, y) along +x crosses the line from a to b."""
    return (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax)
