"""The middle of a table is a box in which a ball meets no wall."""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.walls.side import OVERLAP, Box
from pool_pymunk.core.walls.wall import Pocket, Wall

NOTHING: Final = (INF, INF, -INF, -INF)  # a box that holds no place


@final
class Middle:
    """The middle is a box that no side of a wall and no pocket's rim reaches into.

    The engine asks it whether a path stays there, and then asks no wall. A table with a wall that
    moves, or is of a user's own kind, has none.

    >>> from pool_pymunk.core.motion.path import sliding
    >>> from pool_pymunk.core.walls.face import face_between
    >>> corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)]
    >>> faces = [face_between(corners[k - 1], corners[k]) for k in range(4)]
    >>> middle = Middle([Wall([face], 1.0, 0.0, 0) for face in faces])
    >>> [middle.holds(sliding(0.0, (1.0, 1.0), (v, 0.0), 0.5), 0.25) for v in (1.0, 2.0)]
    [True, False]
    """

    def __init__(self, walls: list[Wall]) -> None:
        extents = [side.extent for wall in walls for side in wall.sides]
        if not all(type(wall) is Wall or isinstance(wall, Pocket) for wall in walls):
            extents = []
        low_x, low_y, high_x, high_y = NOTHING
        for x, y, end_x, end_y in extents:
            low_x, low_y = min(low_x, x), min(low_y, y)
            high_x, high_y = max(high_x, end_x), max(high_y, end_y)
        box = low_x, low_y, high_x, high_y
        for extent in extents:
            box = largest_beside(box, extent)
        self.low_x, self.low_y, self.high_x, self.high_y = box

    def holds(self, path: Path, r: float) -> bool:
        """Tell whether a ball of radius ``r`` (m) stays in the middle on its path.

        A path is a parabola, so it stays within the triangle of its two ends and of the place to
        which the ball would go without acceleration in half of the time.
        """
        x, y, half = path.x, path.y, (path.end - path.t) / 2.0
        r *= 1.0 + 2.0 * OVERLAP
        if not self._has(x, y, r):
            return False
        mid_x, mid_y = x + half * path.vx, y + half * path.vy
        if not (path.slows or self._has(mid_x, mid_y, r)):
            return False
        end_x = mid_x + half * (path.vx + 2.0 * half * path.ax)
        end_y = mid_y + half * (path.vy + 2.0 * half * path.ay)
        return self._has(end_x, end_y, r)

    def _has(self, x: float, y: float, r: float) -> bool:
        """Tell whether a ball at a place (m) lies in the middle."""
        return (
            x - r > self.low_x
            and x + r < self.high_x
            and y - r > self.low_y
            and y + r < self.high_y
        )


def largest_beside(box: Box, other: Box) -> Box:
    """Return the largest part of a box that is a box and lies beside another one."""
    low_x, low_y, high_x, high_y = box
    x, y, end_x, end_y = other
    if end_x <= low_x or x >= high_x or end_y <= low_y or y >= high_y:
        return box
    parts = [
        (low_x, low_y, min(x, high_x), high_y),
        (max(end_x, low_x), low_y, high_x, high_y),
        (low_x, low_y, high_x, min(y, high_y)),
        (low_x, max(end_y, low_y), high_x, high_y),
    ]
    best = parts[0]
    for part in parts:
        if area(part) > area(best):
            best = part
    return best


def area(box: Box) -> float:
    """Return the area (m^2) of a box; 0 if it holds nothing."""
    low_x, low_y, high_x, high_y = box
    return max(high_x - low_x, 0.0) * max(high_y - low_y, 0.0)
