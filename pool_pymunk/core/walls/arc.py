"""An arc is a side that is part of a circle; balls are inside of the circle or outside."""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, path_out_of_disc, path_to_disc
from pool_pymunk.core.walls.round import Curved
from pool_pymunk.core.walls.side import ALONG, BEFORE, GRAZING, is_tangent, within_sector

# A parabola crosses a circle four times at most, so it comes in twice and leaves twice.
MOST_CROSSINGS: Final = 2


@final
class Arc(Curved):
    """An arc is a part of a circle that bulges into the table (``facing`` 1) or outwards (-1)."""

    def __init__(
        self, center: Vector, radius: float, first: Vector, last: Vector, facing: float
    ) -> None:
        super().__init__(center, radius, first, last, facing, 0.0)

    def is_beside(self, x: float, y: float) -> bool:
        cx, cy = self.center
        return within_sector(x - cx, y - cy, self.first, self.last)

    def gap(self, x: float, y: float, r: float) -> float:
        return super().gap(x, y, r) if self.is_beside(x, y) else INF

    def gap_beyond(self, x: float, y: float, r: float) -> float:
        return super().gap(x, y, r)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the arc: as it comes into the circle, or as it leaves it.

        It has the same bits whenever it is asked for: it is looked for from the path's beginning.
        """
        if path.slows:
            return self._on_straight_path(path, r, now)
        t = self._on_bent_path(path, r, path.t)
        return t if t >= now or path.t >= now else self._on_bent_path(path, r, now)

    def _on_straight_path(self, path: Path, r: float, now: float) -> float:
        cx, cy = self.center
        x, y, speed = path.x - cx, path.y - cy, path.speed
        if speed == 0.0 or self._leads_past(x, y, path):
            return INF
        ux, uy, touching = path.vx / speed, path.vy / speed, self.radius + self.facing * r
        if self.facing > 0.0:
            rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
            touching -= rounding
            is_behind = x * x + y * y < self.radius * self.radius
            if is_behind or is_tangent(path, cx, cy, touching, rounding):
                return INF
            length = path_to_disc((-x, -y), (ux, uy), touching)
        else:
            time, within = (path.end - path.t) / 2.0, touching * (1.0 - ALONG)
            rest_x, rest_y = x + time * path.vx, y + time * path.vy
            if rest_x * rest_x + rest_y * rest_y < within * within:
                return INF
            length = path_out_of_disc((-x, -y), (ux, uy), touching, self.radius, GRAZING)
        if length == INF:
            return INF
        if not within_sector(x + length * ux, y + length * uy, self.first, self.last):
            return INF
        return path.arrival(length, now)

    def _leads_past(self, x: float, y: float, path: Path) -> bool:
        """Tell whether a straight path keeps beside the sector, as it leads away from it."""
        fx, fy = self.first
        lx, ly = self.last
        margin = 2.0 * GRAZING * self.radius
        if fx * y - fy * x >= -margin or x * ly - y * lx >= -margin:
            return False
        return fx * path.vy - fy * path.vx <= 0.0 and path.vx * ly - path.vy * lx <= 0.0

    def _on_bent_path(self, path: Path, r: float, now: float) -> float:
        cx, cy = self.center
        radius = self.radius
        since, touching = max(path.t, now), radius + self.facing * r
        if self._is_too_far(path, r, since):
            return INF
        if self.facing > 0.0:
            touching -= 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
            x, y = path.place(since)
            dx, dy = x - cx, y - cy
            if dx * dx + dy * dy < radius * radius:  # The ball is behind the arc.
                since = path.time_out(cx, cy, touching, radius, since)
        else:
            since = self._after_setting_off(path, touching, r, since)
        for _ in range(MOST_CROSSINGS if since < INF else 0):
            if self.facing > 0.0:
                t = path.time_in(cx, cy, touching, since)
            else:
                t = path.time_out(cx, cy, touching, radius, since)
            if t == INF:
                return t
            x, y, vx, vy = path.at(t)
            x, y, speed = x - cx, y - cy, math.sqrt(vx * vx + vy * vy)
            if within_sector(x, y, self.first, self.last):
                return max(t, now)
            ahead = BEFORE * r / speed if speed > 0.0 else 0.0
            if within_sector(x + ahead * vx, y + ahead * vy, self.first, self.last):
                return max(t + ahead, now)  # It is beside the arc, and runs on along it.
            if self.facing > 0.0:
                since = path.time_out(cx, cy, touching, touching, t)
            else:
                since = path.time_in(cx, cy, touching, t)
            if since == INF:
                return since
        return INF

    def _is_too_far(self, path: Path, r: float, since: float) -> bool:
        """Tell whether a bent path is too short to come into the sector after a time (s)."""
        cx, cy = self.center
        fx, fy = self.first
        lx, ly = self.last
        x, y = path.place(since)
        x, y = x - cx, y - cy
        far = path.fastest * (path.end - since) + 2.0 * BEFORE * r
        after, before = far + fx * y - fy * x, far + x * ly - y * lx
        if fx * ly - fy * lx > 0.0:
            return after < 0.0 or before < 0.0
        return after < 0.0 and before < 0.0

    def _after_setting_off(self, path: Path, touching: float, r: float, since: float) -> float:
        """Return from when on (s) a ball within the circle may meet it.

        A ball at rest that sets off along the circle stays on it until it is off by more than
        rounding.
        """
        if path.vx != 0.0 or path.vy != 0.0:
            return since
        cx, cy = self.center
        dx, dy, ax, ay = path.x - cx, path.y - cy, path.ax, path.ay
        across, along, near = ax * dx + ay * dy, ay * dx - ax * dy, touching * (1.0 - ALONG)
        if abs(across) >= ALONG * abs(along) or dx * dx + dy * dy < near * near:
            return since
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        time = math.sqrt(math.sqrt(8.0 * rounding * touching / (ax * ax + ay * ay)))
        since = max(since, path.t + time)
        return since if since < path.end else INF
