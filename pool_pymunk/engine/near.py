"""This module finds the balls whose paths may cross that of a ball, by boxes around paths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from pool_pymunk.engine.decisions import NEARLY_NOW
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, motion_at, speed_of

# From this many balls on, one array is faster than a loop: to find what is near one of 100, 200 or
# 400 balls takes the loop 3.3, 5.9 or 12 us, and the array 4.3 us.
MANY = 200
# From FEW balls on, paths are looked at in pieces of AHEAD times the balls' mean distance: 60 balls
# that all move (``tests.scenes.gas``) then take 0.66 of the bytecodes, with pieces of half the
# length 0.59, of twice the length 0.80.
FEW, AHEAD = 40, 1.5


class Near(Protocol):
    """A Near tells the engine which balls and walls a ball may meet on its path.

    It may name more than the ball meets, but never fewer. The engine first calls ``walls``,
    then ``horizon``, which tells how far (s) to look at most, then ``begin``: it looks at the path
    from ``since`` until ``end`` (s; infinite if nothing ends it). ``touching`` names the balls, and
    as -1 - their number the walls, that the ball may touch now.
    """

    def walls(self, i: int) -> Iterable[int]: ...

    def horizon(self, path: Path, now: float) -> float: ...

    def begin(self, i: int, path: Path, radius: float, since: float, end: float) -> None: ...

    def balls(self, i: int, now: float) -> Iterable[int]: ...

    def touching(self, i: int, now: float) -> Iterable[int]: ...

    def remove(self, i: int) -> None: ...


Box = tuple[float, float, float, float]  # lowest x and y, highest x and y (m)

NOWHERE: Box = (math.inf, math.inf, -math.inf, -math.inf)


def box(path: Path, radius: float, since: float, end: float) -> Box:
    """Return the box of a disc on its path, from ``since`` until ``end`` (s)."""
    began, x, y, vx, vy, ax, ay, path_end, slows, _, _ = path
    last = end if end < path_end else path_end
    ex, ey = x, y
    if last == math.inf:
        ex = math.copysign(math.inf, ax or vx) if ax or vx else x
        ey = math.copysign(math.inf, ay or vy) if ay or vy else y
    elif path_end > began:
        time = last - began
        ex, ey = x + time * (vx + time * ax / 2.0), y + time * (vy + time * ay / 2.0)
    if since > began and path_end > began:
        x, y, _, _ = motion_at(path, since)
    r = radius + 2.0 * NEARLY_NOW * radius + 1e-9 * (abs(x) + abs(y))
    x0, x1 = (x, ex) if x < ex else (ex, x)
    y0, y1 = (y, ey) if y < ey else (ey, y)
    if not slows:
        x, y = turning(path, since, last)
        x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return x0 - r, y0 - r, x1 + r, y1 + r


def turning(path: Path, since: float, last: float) -> Vector:
    """Return the x and the y (m) at which a bent path turns back; where it begins if it does not.

    Look between ``since`` and ``last`` (s).
    """
    x, y, vx, vy = motion_at(path, since)
    time = last - since
    if vx * path.ax < 0.0 and abs(vx) < abs(path.ax) * time:
        x -= vx * vx / (2.0 * path.ax)
    if vy * path.ay < 0.0 and abs(vy) < abs(path.ay) * time:
        y -= vy * vy / (2.0 * path.ay)
    return x, y


def piece(balls: int, width: float, height: float) -> float:
    """Return the length (m) of the pieces of paths, for balls in a region of this size (m)."""
    if balls < FEW or width * height == 0.0:
        return math.inf
    return AHEAD * math.sqrt(width * height / balls)


def horizon(path: Path, now: float, ahead: float) -> float:
    """Return the time (s) at which a ball would have gone ``ahead`` (m) at its present speed."""
    speed = speed_of(path) if ahead < math.inf else 0.0
    return now + ahead / speed if speed > 0.0 else math.inf


class Boxes:
    """There is a box around each ball's path; these few boxes are looked through one by one."""

    def __init__(self, balls: int, walls: int) -> None:
        self.boxes: Any = [NOWHERE] * balls
        self.every_wall = range(walls)
        self.ahead = math.inf  # m; the length of a path that is looked at

    def walls(self, i: int) -> Iterable[int]:
        return self.every_wall

    def horizon(self, path: Path, now: float) -> float:
        return horizon(path, now, self.ahead) if self.ahead < math.inf else math.inf

    def measure(self, paths: Sequence[Path]) -> None:
        """Take note of how far the balls lie apart, so that paths are looked at in good pieces."""
        if len(paths) >= FEW:
            x, y = [path.x for path in paths], [path.y for path in paths]
            self.ahead = piece(len(paths), max(x) - min(x), max(y) - min(y))

    def begin(self, i: int, path: Path, radius: float, since: float, end: float) -> None:
        self.boxes[i] = box(path, radius, since, end)

    def remove(self, i: int) -> None:
        self.boxes[i] = NOWHERE

    def touching(self, i: int, now: float) -> Iterable[int]:
        return [*self.balls(i, now), *(-1 - wall for wall in self.every_wall)]

    def balls(self, i: int, now: float) -> Iterable[int]:
        """Return the balls whose boxes overlap that of ball ``i``."""
        x0, y0, x1, y1 = self.boxes[i]
        return [
            j
            for j, (u0, v0, u1, v1) in enumerate(self.boxes)
            if u0 <= x1 and u1 >= x0 and v0 <= y1 and v1 >= y0 and j != i
        ]


def boxes_around(paths: Sequence[Path], radii: Sequence[float], walls: int) -> Boxes:
    """Return the boxes around balls on these paths."""
    found = (Boxes if len(paths) < MANY else ManyBoxes)(len(paths), walls)
    found.measure(paths)
    for i, path in enumerate(paths):
        found.begin(i, path, radii[i], path.t, math.inf)
    return found


class ManyBoxes(Boxes):
    """The boxes of many balls are in one array, so that numpy looks through all at once."""

    def __init__(self, balls: int, walls: int) -> None:
        super().__init__(balls, walls)
        self.boxes = np.array([NOWHERE] * balls).reshape(-1, 4).T.copy().T

    def balls(self, i: int, now: float) -> Iterable[int]:
        x0, y0, x1, y1 = self.boxes[i].tolist()
        low_x, low_y, high_x, high_y = self.boxes.T
        near = (low_x <= x1) & (high_x >= x0) & (low_y <= y1) & (high_y >= y0)
        near[i] = False
        return np.flatnonzero(near).tolist()
