"""Patches are regions of the table with other friction: here is when a ball crosses a border.

The functions are loops over the ``borders`` of :class:`Patches`, in tuples or in an array, of which
``count`` are used. A border is a row of six numbers: that of its patch, 0 for a line or 1 for a
circle, and the ends of the line, or the circle's centre and radius (m). The borders of a patch
stand side by side.

A path meets a border at the root of a polynomial: of degree two for a line, four for a circle. So
the borders cut a path into stretches. The patch of a stretch is asked for in its middle, where
rounding does not matter, and a ball crosses where two stretches have different patches. A ball that
grazes a corner, or turns back along a border, therefore needs no rule of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.surface import Rolling, Sliding, Surface

OPEN = -1  # stands for no patch
# of the coordinates; a stretch that is shorter is none. Rounding of a place and of a root is 1e-15,
# and the friction on 1e-12 m of sand is not seen in an end.
SHORT = 1e-12
BESIDE = 1e-9  # of a line's length; a path also meets the line so far beyond its ends
# Newton's method needs some six iterations, and halving an interval 53; more change nothing.
MOST_ITERATIONS = 100

Border = tuple[float, float, float, float, float, float]
Row = tuple[float, float, float, float, float]  # k0, k1 ... of k0 + k1 t + ... + k4 t^4


class Patches(NamedTuple):
    """These are the patches of a table, by their numbers.

    ``surfaces`` say how balls move there. ``own`` has the decelerations (m/s^2) of sliding and of
    rolling that a patch has of its own; they are negative where they are those of the table.

    >>> sand = Patches(((0.0, 1.0, 2.0, 0.0, 0.5, 0.0),))
    >>> sand.at(2.25, 0.0), sand.at(1.0, 0.0)
    (0, -1)
    """

    borders: tuple[Border, ...] = ()
    surfaces: tuple[Surface, ...] = ()
    own: tuple[tuple[float, float], ...] = ()

    def at(self, x: float, y: float) -> int:
        """Return the number of the last patch that holds a place (m), or -1."""
        return patch_at(self.borders, len(self.borders), x, y)


NO_PATCHES = Patches()


Form = tuple[tuple[Vector, ...], Vector | None, float | None]  # corners, or centre and radius (m)
Own = tuple[float | None, float | None]  # of sliding and of rolling; None where it is the table's


def patches_of(forms: Sequence[Form], own: Sequence[Own], unit: float, table: Surface) -> Patches:
    """Return patches of these forms, with some decelerations of their own in a unit (m/s^2)."""
    borders = [border for k, form in enumerate(forms) for border in borders_of(k, form)]
    rates = [tuple([-1.0 if each is None else each * unit for each in pair]) for pair in own]
    surfaces = []
    for pull, drag in rates:
        pull, drag = pull if pull >= 0.0 else table.pull, drag if drag >= 0.0 else table.drag
        surfaces.append(Rolling(pull, drag) if table.rolls else Sliding(pull))
    return Patches(tuple(borders), tuple(surfaces), tuple([(pull, drag) for pull, drag in rates]))


def borders_of(patch: int, form: Form) -> list[Border]:
    """Return the borders of a patch, which has this number.

    >>> borders_of(3, ((), (2.0, 1.0), 0.5))
    [(3.0, 1.0, 2.0, 1.0, 0.5, 0.0)]
    """
    corners, center, radius = form
    if center is not None and radius is not None:
        return [(float(patch), 1.0, *center, radius, 0.0)]
    ends = zip(corners, (*corners[1:], *corners[:1]), strict=True)
    return [(float(patch), 0.0, *start, *end) for start, end in ends]


def patch_at(borders: Any, count: int, x: float, y: float) -> int:
    """Return the number of the last patch that holds a place (m), or -1.

    A line to the right of a place that a patch holds meets its borders an odd number of times.
    """
    found, patch, is_in = OPEN, OPEN, False
    for k in range(count):
        b = borders[k]
        if int(b[0]) != patch:
            found = patch if is_in else found
            patch, is_in = int(b[0]), False
        if b[1] != 0.0:
            dx, dy = x - b[2], y - b[3]
            is_in = dx * dx + dy * dy < b[4] * b[4]
        elif (b[3] > y) != (b[5] > y) and x < b[2] + (y - b[3]) / (b[5] - b[3]) * (b[4] - b[2]):
            is_in = not is_in
    return patch if is_in else found


def crossing(borders: Any, count: int, path: Path, patch: int, now: float) -> tuple[float, int]:
    """Return when (s) a ball that is in a patch crosses into another one, and its number.

    It is now if the path leads into the other one from now on. The time is infinite if the ball
    crosses no border until the path ends.

    >>> from pool_pymunk.physics.path import set_off
    >>> path = set_off(0.0, (0.0, 0.0), (2.0, 0.0), 1.0)
    >>> t, patch = crossing(borders_of(0, ((), (2.0, 0.0), 0.5)), 1, path, -1, 0.0)
    >>> round(t, 12), patch
    (1.0, 0)
    """
    since = now
    while since < path.end:
        t = next_border(borders, count, path, since)
        found = patch_of(borders, count, path, since, t)
        if found != patch:
            return since, found
        since = t
    return math.inf, patch


def patch_of(borders: Any, count: int, path: Path, since: float, until: float) -> int:
    """Return the patch of a stretch of a path between two times (s); the last one may be inf."""
    until = min(until, path.end)
    middle = since + (0.5 * (until - since) if until < math.inf else 1.0)
    x, y, _, _ = motion_at(path, middle)
    return patch_at(borders, count, x, y)


def next_border(borders: Any, count: int, path: Path, since: float) -> float:
    """Return when (s) after another time, and before its end, a path meets a border, or infinity.

    It has moved on visibly since then.
    """
    soonest = math.inf
    for k in range(count):
        if borders[k][1] != 0.0:
            t = time_at_circle(borders[k], path, since)
        else:
            t = time_at_line(borders[k], path, since)
        soonest = min(soonest, t)
    return soonest


def has_moved(border: Any, path: Path, since: float, t: float) -> bool:
    """Tell whether a ball has moved visibly from one time (s) to a later one.

    It may be back where it was, and was elsewhere in the middle of that time.
    """
    if not since < t < path.end:
        return False
    x, y, _, _ = motion_at(path, since)
    u, v, _, _ = motion_at(path, t)
    p, q, _, _ = motion_at(path, 0.5 * (since + t))
    size = abs(x) + abs(y) + abs(border[2]) + abs(border[3]) + abs(border[4]) + abs(border[5])
    return bool(max(abs(u - x) + abs(v - y), abs(p - x) + abs(q - y)) > SHORT * size)


def time_at_line(border: Any, path: Path, since: float) -> float:
    """Return when (s) after another time a path meets the line of a border, or infinity."""
    px, py = border[2], border[3]
    dx, dy = border[4] - px, border[5] - py
    away = (path.x - px) * dy - (path.y - py) * dx
    rate, bend = path.vx * dy - path.vy * dx, 0.5 * (path.ax * dy - path.ay * dx)
    soonest = math.inf
    for time in roots(away, rate, bend):
        t = path.t + time
        if t < soonest and has_moved(border, path, since, t):
            x, y, _, _ = motion_at(path, t)
            share = ((x - px) * dx + (y - py) * dy) / (dx * dx + dy * dy)
            if -BESIDE <= share <= 1.0 + BESIDE:
                soonest = t
    return soonest


def time_at_circle(border: Any, path: Path, since: float) -> float:
    """Return when (s) after another time a path meets the circle of a border, or infinity."""
    x, y, r = path.x - border[2], path.y - border[3], border[4]
    vx, vy, ax, ay = path.vx, path.vy, path.ax, path.ay
    far = math.sqrt(x * x + y * y)
    k = (
        (far - r) * (far + r), 2.0 * (x * vx + y * vy), vx * vx + vy * vy + x * ax + y * ay,
        vx * ax + vy * ay, 0.25 * (ax * ax + ay * ay),
    )  # fmt: skip
    if k[4] == 0.0:
        for time in roots(k[0], k[1], k[2]):
            if has_moved(border, path, since, path.t + time):
                return path.t + time
        return math.inf
    low, high = 0.0, path.end - path.t  # A root has the same bits whenever it is asked for.
    slope = k[1], 2.0 * k[2], 3.0 * k[3], 4.0 * k[4], 0.0
    first, second = roots(slope[1], 2.0 * slope[2], 3.0 * slope[3])
    first, second = max(low, min(first, high)), max(low, min(second, high))
    turns = (
        root_between(slope, low, first), root_between(slope, first, second),
        root_between(slope, second, high), high,
    )  # fmt: skip
    for turn in turns:  # Between two of them the distance only grows, or only falls.
        if turn < math.inf:
            t = path.t + root_between(k, low, turn)
            if has_moved(border, path, since, t):
                return t
            low = turn
    return math.inf


def roots(k0: float, k1: float, k2: float) -> Vector:
    """Return the roots of k0 + k1 t + k2 t^2, the lower one first; those that are not are inf.

    >>> roots(6.0, -5.0, 1.0), roots(-1.0, 2.0, 0.0), roots(1.0, 0.0, 1.0)
    ((2.0, 3.0), (0.5, inf), (inf, inf))
    """
    square = k1 * k1 - 4.0 * k0 * k2
    if square < 0.0:
        return math.inf, math.inf
    q = -0.5 * (k1 + math.copysign(math.sqrt(square), k1))
    one = k0 / q if q != 0.0 else math.inf
    other = q / k2 if k2 != 0.0 else math.inf
    return min(one, other), max(one, other)


def value_of(k: Row, t: float) -> float:
    """Return k0 + k1 t + k2 t^2 + k3 t^3 + k4 t^4."""
    return k[0] + t * (k[1] + t * (k[2] + t * (k[3] + t * k[4])))


def slope_of(k: Row, t: float) -> float:
    """Return the derivative of a polynomial."""
    return k[1] + t * (2.0 * k[2] + t * (3.0 * k[3] + t * 4.0 * k[4]))


def root_between(k: Row, low: float, high: float) -> float:
    """Return the root of a polynomial that only grows or only falls there, or infinity.

    Newton's method stays in an interval, which is halved where the method leads out of it.

    >>> round(root_between((-8.0, 0.0, 0.0, 1.0, 0.0), 0.0, 10.0), 12)
    2.0
    """
    at_low, at_high = value_of(k, low), value_of(k, high)
    if at_low == 0.0:
        return low
    if not (low < high and (at_low > 0.0) != (at_high > 0.0)):
        return math.inf
    t = 0.5 * (low + high)
    for _ in range(MOST_ITERATIONS):
        value, slope = value_of(k, t), slope_of(k, t)
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


def normal_at(borders: Any, count: int, x: float, y: float) -> Vector:
    """Return the normal of the border that is nearest to a place (m), on either side of it."""
    nearest, found = math.inf, (1.0, 0.0)
    for k in range(count):
        b = borders[k]
        dx, dy = x - b[2], y - b[3]
        if b[1] != 0.0:
            size = math.sqrt(dx * dx + dy * dy)
            away, normal = abs(size - b[4]), (dx / size, dy / size) if size > 0.0 else (1.0, 0.0)
        else:
            ex, ey = b[4] - b[2], b[5] - b[3]
            size = math.sqrt(ex * ex + ey * ey)
            share = max(0.0, min(1.0, (dx * ex + dy * ey) / (size * size)))
            px, py = dx - share * ex, dy - share * ey
            away, normal = math.sqrt(px * px + py * py), (ey / size, -ex / size)
        if away < nearest:
            nearest, found = away, normal
    return found
