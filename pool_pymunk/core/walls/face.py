"""A face is a straight side."""

from __future__ import annotations

import math
from typing import final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, time_to_return, unit
from pool_pymunk.core.walls.side import BEFORE, GRAZING, OVERLAP, Box, Side


@final
class Face(Side):
    """A face runs from ``start`` along ``tangent`` for a ``length`` (m), and faces ``outward``.

    ``start`` (m) lies on the cushion's middle line; ``core`` (m) is half the cushion's thickness.

    >>> from pool_pymunk.core.motion.path import sliding
    >>> floor = face_between((0.0, 0.0), (2.0, 0.0))
    >>> floor.gap(1.0, 0.5, 0.25), floor.height(1.0, 0.5)
    (0.25, 0.5)
    >>> floor.time_of_contact(sliding(0.0, (1.0, 0.5), (0.0, -0.5), 0.0), 0.25, 0.0)
    0.5
    """

    def __init__(
        self, start: Vector, tangent: Vector, outward: Vector, length: float, core: float = 0.0
    ) -> None:
        super().__init__(core)
        self.start = start
        self.tangent = tangent
        self.outward = outward
        self.length = length

    @property
    def extent(self) -> Box:
        (x, y), (tx, ty), core = self.start, self.tangent, self.core
        end_x, end_y = x + self.length * tx, y + self.length * ty
        return (
            min(x, end_x) - core, min(y, end_y) - core, max(x, end_x) + core, max(y, end_y) + core
        )  # fmt: skip

    def gap(self, x: float, y: float, r: float) -> float:
        x0, y0 = self.start
        tx, ty = self.tangent
        nx, ny = self.outward
        if not self._has_foot((x - x0) * tx + (y - y0) * ty):
            return INF
        return (x - x0) * nx + (y - y0) * ny - self.core - r

    def gap_beyond(self, x: float, y: float, r: float) -> float:
        return self.height(x, y) - self.core - r

    def normal(self, x: float, y: float) -> Vector:
        return self.outward

    def height(self, x: float, y: float) -> float:
        """Return how far (m) a place is before the middle line."""
        x0, y0 = self.start
        nx, ny = self.outward
        return (x - x0) * nx + (y - y0) * ny

    def room(self, x: float, y: float) -> float:
        x0, y0 = self.start
        tx, ty = self.tangent
        foot = (x - x0) * tx + (y - y0) * ty
        return min(foot, self.length - foot)

    def _has_foot(self, foot: float) -> bool:
        """Tell whether a place so far (m) along the tangent lies beside the face, to rounding."""
        slack = GRAZING * self.length
        return not (foot < -slack or foot > self.length + slack)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the face; never if it moves along it, to rounding."""
        nx, ny = self.outward
        closing = -(path.vx * nx + path.vy * ny)
        if closing <= 0.0 and path.slows:
            return INF
        pull = -(path.ax * nx + path.ay * ny)
        if closing <= 0.0 and pull <= 0.0:
            return INF
        x0, y0 = self.start
        x, y = path.x - x0, path.y - y0
        height = x * nx + y * ny
        if height < 0.0:
            return INF
        gap = height - r - self.core
        rounding = EPSILON * (abs(path.x) + abs(path.y) + r)
        if gap <= rounding and closing <= GRAZING * path.speed:
            if path.slows:
                return INF
            gap, closing = (0.0 if gap > -OVERLAP * r else gap), min(closing, 0.0)
        time = time_to_close(gap, closing, pull)
        if time == INF or (not path.slows and time > path.end - path.t):
            return INF
        t = path.t + time + self._until_beside(path, r, x, y, time)
        return t if t > now else now

    def _until_beside(self, path: Path, r: float, x: float, y: float, time: float) -> float:
        """Return how long (s) after a ball has come to the line it is beside the face.

        Mostly that is at once, or never. A ball that runs along the wall may come to the face just
        after that.
        """
        tx, ty = self.tangent
        u, pull = path.vx * tx + path.vy * ty, path.ax * tx + path.ay * ty
        foot, u = x * tx + y * ty + time * (u + time * pull / 2.0), u + time * pull
        if self._has_foot(foot):
            return 0.0
        ahead = BEFORE * r / abs(u) if u != 0.0 and not path.slows else 0.0
        return ahead if ahead > 0.0 and self._has_foot(foot + ahead * u) else INF


def time_to_close(gap: float, closing: float, pull: float) -> float:
    """Return when (s) a gap (m) is closed that closes at a speed (m/s), which grows by ``pull``."""
    if closing <= 0.0:
        return time_to_return(gap, -closing, pull)
    if gap <= 0.0:
        return 0.0
    square = closing * closing + 2.0 * gap * pull
    return 2.0 * gap / (closing + math.sqrt(square)) if square > 0.0 else INF


def face_between(start: Vector, end: Vector, core: float = 0.0) -> Face:
    """Return the face that a traveller from ``start`` to ``end`` (m) has on the left."""
    x0, y0 = start
    x1, y1 = end
    dx, dy = x1 - x0, y1 - y0
    tx, ty = unit(dx, dy)
    return Face(start, (tx, ty), (-ty, tx), math.sqrt(dx * dx + dy * dy), core)
