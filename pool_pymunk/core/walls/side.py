"""A side is a part of a wall's surface. A new kind of side is one class."""

from __future__ import annotations

import math
from typing import Final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF, Vector

# radii; a ball that overlaps a face by no more than this touches it. Scenes allow this overlap at a
# start, because coordinates may be rounded.
OVERLAP: Final = 1e-6
# A ball that touches a side and sinks by less than this share of its speed moves along it. This is
# far above rounding, 1e-16, and far below the angles of shots; so are half and twice of it.
GRAZING: Final = 1e-12
# A ball sets off along a circle if a smaller share of its acceleration points across. This is far
# above the rounding of directions, 1e-15, and so are half and twice of it.
ALONG: Final = 1e-9
Box = tuple[float, float, float, float]  # the least x and y (m), and the largest ones
EVERYWHERE: Box = (-INF, -INF, INF, INF)
BEFORE: Final = 2e-8  # radii; a ball that runs along a side passes to the next one so much before


@mypyc_attr(allow_interpreted_subclasses=True)
class Side:
    """A side answers when a ball meets it, how wide the gap is, and which normal a contact has.

    ``core`` (m) is how far it is solid below its surface. A ball whose centre is deeper lies behind
    the side, and not in it. Walls ask it, and need not know what kind of side it is.
    """

    core: float = 0.0

    def __init__(self, core: float = 0.0) -> None:
        self.core = core

    @property
    def extent(self) -> Box:
        """A box (m) around the surface of the side: a side of a user's own may be anywhere."""
        return EVERYWHERE

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s), not before now, a ball of radius ``r`` meets the side, or infinity."""
        raise NotImplementedError

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from a ball; infinite if the ball is not beside the side."""
        raise NotImplementedError

    def gap_beyond(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from a ball of the side, or of what would prolong it."""
        return self.gap(x, y, r)

    def normal(self, x: float, y: float) -> Vector:
        """Return the unit vector from the side to a ball at a place (m)."""
        raise NotImplementedError

    def curvature(self, x: float, y: float) -> float:
        """Return how fast (1/m) the normal turns as a ball moves along the side.

        It is 0 at a straight side, and one over the distance of the centres at a round one.
        """
        return 0.0

    def room(self, x: float, y: float) -> float:
        """Return how far (m) a ball that touches the side is from its nearer end.

        It is negative beyond the end, and infinite where a side has none.
        """
        return INF


def nearest_of(sides: list[Side], x: float, y: float, r: float) -> Side:
    """Return the side whose surface is nearest to a ball of radius ``r`` (m) at (x, y).

    That is the one with the least gap, which is negative where the ball has sunk in by rounding. So
    the face next to a corner wins, in whose circle the ball has sunk less deep.
    """
    best, least = sides[0], INF
    if len(sides) == 1:
        return best
    for side in sides:
        gap = side.gap(x, y, r)
        away = gap if gap >= -side.core - r else -gap  # Deeper, the ball is behind it.
        if away < least:
            best, least = side, away
    return best


def is_tangent(path: Path, cx: float, cy: float, touching: float, rounding: float) -> bool:
    """Tell whether a straight path begins along a circle, as after a dull hit, to ``rounding``."""
    dx, dy = cx - path.x, cy - path.y
    along, near = dx * path.vx + dy * path.vy, touching + 2.0 * rounding
    begins_along = path.slows and along <= GRAZING * touching * path.speed
    return begins_along and dx * dx + dy * dy <= near * near


def room_in_sector(x: float, y: float, first: Vector, last: Vector) -> float:
    """Return how far a place is from the nearer end of a sector, along a circle around its tip.

    It is a chord's share, good near the ends, and negative beyond them.
    """
    fx, fy = first
    lx, ly = last
    after, before = fx * y - fy * x, x * ly - y * lx
    is_short = fx * ly - fy * lx >= 0.0  # at most half a turn
    return min(after, before) if is_short else max(after, before)


def within_sector(x: float, y: float, first: Vector, last: Vector) -> bool:
    """Tell whether a direction lies between two others, counter-clockwise, to rounding.

    >>> [within_sector(x, 1.0, (1.0, 0.0), (0.0, 1.0)) for x in (1.0, -1.0)]
    [True, False]
    """
    fx, fy = first
    lx, ly = last
    after, before = fx * y - fy * x, x * ly - y * lx
    if after >= 0.0 and before >= 0.0:
        return True
    slack = GRAZING * math.sqrt(x * x + y * y)
    if fx * ly - fy * lx > 0.0:  # They are less than half a turn apart.
        return after >= -slack and before >= -slack
    return after >= -slack or before >= -slack
