"""The floor is where balls may lie: on the table, beside walls, pockets and other balls."""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.motion.patches import OPEN, Line
from pool_pymunk.core.motion.times import EPSILON, INF
from pool_pymunk.core.walls.wall import Wall

# A ball that overlaps by at most this share of its radius (of the smaller radius of two balls, of a
# pocket's radius) touches: a user may have rounded the coordinates of a frozen rack.
TOUCHING: Final = 1e-6
COORDINATES: Final = 4.0 * EPSILON  # of a coordinate; its rounding
# both ends, the centre and the radius (m), and the tangent of a quarter of the angle
Bow = tuple[float, float, float, float, float, float, float, float]


@final
class Floor:
    """A floor has the corners (m) and the arcs of a table's outline, or none, and its walls.

    Batches and layouts ask it.

    >>> floor = Floor([0.0, 2.0, 2.0, 0.0], [0.0, 0.0, 1.0, 1.0], [], [])
    >>> floor.holds(1.0, 0.5, 0.125, TOUCHING), floor.holds(3.0, 0.5, 0.125, TOUCHING)
    (True, False)
    """

    def __init__(
        self, xs: list[float], ys: list[float], bows: list[Bow], walls: list[Wall]
    ) -> None:
        corners = list(zip(xs, ys))
        self.edges = [Line(OPEN, corners[k - 1], corners[k]) for k in range(len(xs))]
        self.bows = bows
        self.walls = walls

    def holds(self, x: float, y: float, r: float, share: float) -> bool:
        """Tell whether a ball of radius ``r`` (m) lies on the table, and in no wall or pocket.

        It may overlap by a ``share`` of its radius.
        """
        if len(self.edges) > 0 and not self._contains(x, y):
            return False
        for wall in self.walls:
            room = INF
            for side in wall.sides:
                gap = side.gap(x, y, r)
                if gap >= -(r + side.core):  # Deeper, the ball is behind it.
                    room = min(room, gap)
            if room < 0.0:
                size, most = (wall.sides[0].core, TOUCHING) if wall.is_pocket else (r, share)
                if sinks(room, size, x, y, most):
                    return False
        return True

    def _contains(self, x: float, y: float) -> bool:
        """Tell whether a place is within the outline (even-odd rule).

        The areas are the polygon of the corners, and that between each arc and its chord.
        """
        inside = False
        for edge in self.edges:
            if edge.encloses(x, y):
                inside = not inside
        for bow in self.bows:
            if lies_between(bow, x, y):
                inside = not inside
        return inside


def lies_between(bow: Bow, x: float, y: float) -> bool:
    """Tell whether a place lies between an arc and its chord.

    Near the chord, rounding puts it on the same side as it does for an edge.
    """
    ax, ay, bx, by, cx, cy, radius, bulge = bow
    dx, dy = x - cx, y - cy
    if dx * dx + dy * dy >= radius * radius:
        return False
    if (ay > y) != (by > y):
        is_left = Line(OPEN, (ax, ay), (bx, by)).encloses(x, y) == (by > ay)
    elif ay == by:
        is_left = (y >= ay) == (bx > ax)
    else:
        is_left = (bx - ax) * (y - ay) > (by - ay) * (x - ax)
    return is_left != (bulge > 0.0)


def sinks(room: float, size: float, x: float, y: float, share: float) -> bool:
    """Tell whether a ball at (x, y) overlaps something by more than if it touched.

    A ball that touches may overlap by a ``share`` of ``size`` (m) and the rounding of coordinates.
    """
    return room < 0.0 and room < -(share * size + COORDINATES * max(abs(x), abs(y)))


def overlap(
    place: tuple[float, float], r: float, other: tuple[float, float], q: float, share: float
) -> bool:
    """Tell whether a ball of radius ``r`` (m) at a place lies in one of radius ``q``."""
    x, y = place
    u, v = other
    dx, dy = x - u, y - v
    if abs(dx) >= r + q or abs(dy) >= r + q:
        return False
    room = math.sqrt(dx * dx + dy * dy) - q - r
    return sinks(room, min(r, q), max(abs(x), abs(u)), max(abs(y), abs(v)), share)
