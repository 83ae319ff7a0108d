"""Patches are regions of the table with other friction, whose borders balls cross.

A path meets a border at the root of a polynomial: of degree two for a line, four for a circle. So
the borders cut a path into stretches. The patch of a stretch is asked for in its middle, where
rounding does not matter, and a ball crosses where two stretches have different patches. A ball that
grazes a corner, or turns back along a border, therefore needs no rule of its own.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.motion.times import EPSILON, INF, Vector, length_of, unit

OPEN: Final = -1  # stands for no patch
# of the coordinates; a stretch that is shorter is none. Rounding of a place and of a root is 1e-15,
# and the friction on 1e-12 m of sand is not seen in an end.
SHORT: Final = 1e-12
BESIDE: Final = 1e-9  # of a line's length; a path also meets the line so far beyond its ends
# Newton's method needs some six iterations, and halving an interval 53; more change nothing.
MOST_ITERATIONS: Final = 100

Quartic = tuple[float, float, float, float, float]  # k0, k1 ... of k0 + k1 t + ... + k4 t^4
Crossing = tuple[float, int]  # when (s) a ball crosses into which patch


class Border:
    """A border is one side of a patch, or its circle; it answers when a path meets it."""

    def __init__(self, patch: int) -> None:
        self.patch = patch

    def encloses(self, x: float, y: float) -> bool:
        """Tell whether it counts for a place (m) that a circle holds, or a ray to x = inf meets."""
        raise NotImplementedError

    def time_after(self, path: Path, since: float) -> float:
        """Return when (s) after another time a path meets the border, or infinity."""
        raise NotImplementedError

    def distance(self, x: float, y: float) -> float:
        """Return how far (m) a place is from the border, on either side of it."""
        raise NotImplementedError

    def normal(self, x: float, y: float) -> Vector:
        """Return the normal of the border at the point that is nearest to a place (m)."""
        raise NotImplementedError


@final
class Line(Border):
    """A line is a side of a polygon, from one corner (m) to the next one."""

    def __init__(self, patch: int, start: Vector, end: Vector) -> None:
        super().__init__(patch)
        self.px, self.py = start
        self.qx, self.qy = end

    def encloses(self, x: float, y: float) -> bool:
        px, py, qx, qy = self.px, self.py, self.qx, self.qy
        return (py > y) != (qy > y) and x < px + (y - py) / (qy - py) * (qx - px)

    def time_after(self, path: Path, since: float) -> float:
        px, py = self.px, self.py
        dx, dy = self.qx - px, self.qy - py
        away = (path.x - px) * dy - (path.y - py) * dx
        rate, bend = path.vx * dy - path.vy * dx, 0.5 * (path.ax * dy - path.ay * dx)
        size = abs(px) + abs(py) + abs(self.qx) + abs(self.qy)
        soonest = INF
        first, second = roots(away, rate, bend)
        for time in [first, second]:
            t = path.t + time
            if t < soonest and has_moved(path, since, t, size):
                x, y = path.place(t)
                share = ((x - px) * dx + (y - py) * dy) / (dx * dx + dy * dy)
                if -BESIDE <= share <= 1.0 + BESIDE:
                    soonest = t
        return soonest

    def distance(self, x: float, y: float) -> float:
        dx, dy, ex, ey = x - self.px, y - self.py, self.qx - self.px, self.qy - self.py
        share = max(0.0, min(1.0, (dx * ex + dy * ey) / (ex * ex + ey * ey)))
        return length_of(dx - share * ex, dy - share * ey)

    def normal(self, x: float, y: float) -> Vector:
        return unit(self.qy - self.py, self.px - self.qx)


@final
class Circle(Border):
    """A circle is the border of a round patch, with its centre and its radius (m)."""

    def __init__(self, patch: int, center: Vector, radius: float) -> None:
        super().__init__(patch)
        self.cx, self.cy = center
        self.radius = radius

    def encloses(self, x: float, y: float) -> bool:
        dx, dy = x - self.cx, y - self.cy
        return dx * dx + dy * dy < self.radius * self.radius

    def distance(self, x: float, y: float) -> float:
        return abs(length_of(x - self.cx, y - self.cy) - self.radius)

    def normal(self, x: float, y: float) -> Vector:
        return unit(x - self.cx, y - self.cy)

    def time_after(self, path: Path, since: float) -> float:
        x, y, r = path.x - self.cx, path.y - self.cy, self.radius
        vx, vy, ax, ay = path.vx, path.vy, path.ax, path.ay
        far, size = math.sqrt(x * x + y * y), abs(self.cx) + abs(self.cy) + abs(r)
        k0, k1 = (far - r) * (far + r), 2.0 * (x * vx + y * vy)
        k2 = vx * vx + vy * vy + x * ax + y * ay
        k3, k4 = vx * ax + vy * ay, 0.25 * (ax * ax + ay * ay)
        if k4 == 0.0:
            first, second = roots(k0, k1, k2)
            for time in [first, second]:
                if has_moved(path, since, path.t + time, size):
                    return path.t + time
            return INF
        distance, low = (k0, k1, k2, k3, k4), 0.0
        # A root has the same bits whenever it is asked for. Between two turns the distance only
        # grows, or only falls.
        for turn in turns(distance, path.end - path.t):
            if turn < INF:
                t = path.t + root_between(distance, low, turn)
                if has_moved(path, since, t, size):
                    return t
                low = turn
        return INF


@final
class Patches:
    """These are the patches of a table by their numbers: their surfaces, and all their borders.

    The borders of a patch stand side by side. The engine asks in which patch a place is, and when a
    ball crosses into another one.

    >>> sand = Patches([Circle(0, (2.0, 0.0), 0.5)], [])
    >>> sand.at(2.25, 0.0), sand.at(1.0, 0.0)
    (0, -1)
    >>> from pool_pymunk.core.motion.path import sliding
    >>> t, patch = sand.crossing(sliding(0.0, (0.0, 0.0), (2.0, 0.0), 1.0), OPEN, 0.0)
    >>> round(t, 12), patch
    (1.0, 0)
    """

    def __init__(self, borders: list[Border], surfaces: list[Surface]) -> None:
        self.borders = borders
        self.surfaces = surfaces

    def at(self, x: float, y: float) -> int:
        """Return the number of the last patch that holds a place (m), or -1.

        A line to the right of a place that a polygon holds meets its borders an odd number of
        times.
        """
        found, patch, is_in = OPEN, OPEN, False
        for border in self.borders:
            if border.patch != patch:
                found = patch if is_in else found
                patch, is_in = border.patch, False
            if border.encloses(x, y):
                is_in = not is_in
        return patch if is_in else found

    def crossing(self, path: Path, patch: int, now: float) -> Crossing:
        """Return when (s) a ball that is in a patch crosses into another one, and its number.

        It is now if the path leads into the other one from now on. The time is infinite if the ball
        crosses no border until the path ends.
        """
        since = now
        while since < path.end:
            t = INF
            for border in self.borders:
                t = min(t, border.time_after(path, since))
            until = min(t, path.end)
            x, y = path.place(since + (0.5 * (until - since) if until < INF else 1.0))
            found = self.at(x, y)
            if found != patch:
                return since, found
            since = t
        return INF, patch

    def normal(self, x: float, y: float) -> Vector:
        """Return the normal of the border that is nearest to a place (m)."""
        nearest, found = INF, (1.0, 0.0)
        for border in self.borders:
            away = border.distance(x, y)
            if away < nearest:
                nearest, found = away, border.normal(x, y)
        return found


def has_moved(path: Path, since: float, t: float, size: float) -> bool:
    """Tell whether a ball has moved visibly from one time (s) to a later one.

    It may be back where it was, and was elsewhere in the middle of that time. ``size`` (m) is that
    of the border's coordinates.
    """
    if not since < t < path.end:
        return False
    x, y = path.place(since)
    u, v = path.place(t)
    p, q = path.place(0.5 * (since + t))
    far = max(abs(u - x) + abs(v - y), abs(p - x) + abs(q - y))
    return far > SHORT * (abs(x) + abs(y) + size)


def roots(k0: float, k1: float, k2: float) -> Vector:
    """Return the roots of k0 + k1 t + k2 t^2, the lower one first; those that are not are inf.

    >>> roots(6.0, -5.0, 1.0), roots(-1.0, 2.0, 0.0), roots(1.0, 0.0, 1.0)
    ((2.0, 3.0), (0.5, inf), (inf, inf))
    """
    square = k1 * k1 - 4.0 * k0 * k2
    if square < 0.0:
        return INF, INF
    q = -0.5 * (k1 + math.copysign(math.sqrt(square), k1))
    one = k0 / q if q != 0.0 else INF
    other = q / k2 if k2 != 0.0 else INF
    return min(one, other), max(one, other)


def turns(k: Quartic, high: float) -> list[float]:
    """Return the times between 0 and ``high`` at which a polynomial turns, and ``high`` itself."""
    slope = slope_of(k)
    first, second = roots(slope[1], 2.0 * slope[2], 3.0 * slope[3])
    first, second = max(0.0, min(first, high)), max(0.0, min(second, high))
    return [
        root_between(slope, 0.0, first),
        root_between(slope, first, second),
        root_between(slope, second, high),
        high,
    ]


def value_of(k: Quartic, t: float) -> float:
    """Return k0 + k1 t + k2 t^2 + k3 t^3 + k4 t^4."""
    return k[0] + t * (k[1] + t * (k[2] + t * (k[3] + t * k[4])))


def slope_of(k: Quartic) -> Quartic:
    """Return the derivative of a polynomial."""
    return k[1], 2.0 * k[2], 3.0 * k[3], 4.0 * k[4], 0.0


def root_between(k: Quartic, low: float, high: float) -> float:
    """Return the root of a polynomial that only grows or only falls there, or infinity.

    Newton's method stays in an interval, which is halved where the method leads out of it.

    >>> round(root_between((-8.0, 0.0, 0.0, 1.0, 0.0), 0.0, 10.0), 12)
    2.0
    """
    at_low, at_high = value_of(k, low), value_of(k, high)
    if at_low == 0.0:
        return low
    if not (low < high and (at_low > 0.0) != (at_high > 0.0)):
        return INF
    t, derivative = 0.5 * (low + high), slope_of(k)
    for _ in range(MOST_ITERATIONS):
        value, slope = value_of(k, t), value_of(derivative, t)
        if (value > 0.0) == (at_low > 0.0):
            low = t
        else:
            high = t
        step = t - value / slope if slope != 0.0 else low
        step = step if low < step < high else 0.5 * (low + high)
        if abs(step - t) <= EPSILON * abs(t):
            return step
        t = step
    return t
