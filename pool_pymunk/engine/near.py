"""This module finds the balls whose paths may cross that of a ball, by boxes around paths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from pool_pymunk.engine.decisions import NEARLY_NOW
from pool_pymunk.physics.path import Path, motion_at, speed_of

MANY = 200  # From this many balls on, one array is faster than a loop.
FEW = 40  # From this many balls on, paths are looked at in pieces.
AHEAD = 1.5  # of the balls' mean distance; so long are the pieces.


class Near(Protocol):
    """A Near tells the engine which balls and walls a ball may meet on its path.

    It may name some more than the ball meets, but never fewer. The engine first calls ``walls``,
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
    x, y, vx, vy = path.x, path.y, path.vx, path.vy
    if since > path.t and path.end > path.t:
        x, y, vx, vy = motion_at(path, since)
    last = end if end < path.end else path.end
    ex, ey, ux, uy = x, y, vx, vy
    if path.end > path.t and last < math.inf:
        ex, ey, ux, uy = motion_at(path, last)
    elif path.end > path.t:
        ex, ux = _without_end(x, vx, path.ax)
        ey, uy = _without_end(y, vy, path.ay)
    r = radius + 2.0 * NEARLY_NOW * radius + 1e-9 * (abs(x) + abs(y))
    x0, x1 = (x, ex) if x < ex else (ex, x)
    y0, y1 = (y, ey) if y < ey else (ey, y)
    if vx * ux < 0.0:
        turn = x - vx * vx / (2.0 * path.ax)
        x0, x1 = min(x0, turn), max(x1, turn)
    if vy * uy < 0.0:
        turn = y - vy * vy / (2.0 * path.ay)
        y0, y1 = min(y0, turn), max(y1, turn)
    return x0 - r, y0 - r, x1 + r, y1 + r


def _without_end(x: float, v: float, a: float) -> tuple[float, float]:
    """Return where motion without end leads along one axis (m), and how fast (m/s)."""
    last = math.copysign(math.inf, a if a else v) if a or v else 0.0
    return (last if last else x), last


def piece(balls: int, width: float, height: float) -> float:
    """Return how far (m) a path is looked at at once, for balls that cover so much (m)."""
    if balls < FEW or width * height == 0.0:
        return math.inf
    return AHEAD * math.sqrt(width * height / balls)


def horizon(path: Path, now: float, ahead: float) -> float:
    """Return the time (s) at which a ball has travelled ``ahead`` (m), were it not slowed down."""
    speed = speed_of(path) if ahead < math.inf else 0.0
    return now + ahead / speed if speed > 0.0 else math.inf


class Boxes:
    """There is a box around each ball's path; these few boxes are looked through one by one."""

    def __init__(self, balls: int, walls: int) -> None:
        self.boxes: Any = [NOWHERE] * balls
        self.every_wall = range(walls)
        self.ahead = math.inf  # m; so far is a path looked at

    def walls(self, i: int) -> Iterable[int]:
        """Return all walls, because there are few."""
        return self.every_wall

    def horizon(self, path: Path, now: float) -> float:
        """Return the time (s) until which the ball travels no farther than its neighbours."""
        return horizon(path, now, self.ahead) if self.ahead < math.inf else math.inf

    def measure(self, paths: Sequence[Path]) -> None:
        """Take note of how far the balls lie apart, so that paths are looked at in good pieces."""
        x, y = [path.x for path in paths], [path.y for path in paths]
        self.ahead = piece(len(paths), max(x) - min(x), max(y) - min(y)) if paths else math.inf

    def begin(self, i: int, path: Path, radius: float, since: float, end: float) -> None:
        """Put a box around this part of ball ``i``'s path."""
        self.boxes[i] = box(path, radius, since, end)

    def remove(self, i: int) -> None:
        """Leave ball ``i`` out from now on."""
        self.boxes[i] = NOWHERE

    def touching(self, i: int, now: float) -> Iterable[int]:
        """Return the balls whose boxes overlap that of ball ``i``, and all walls."""
        return [*self.balls(i, now), *(-1 - wall for wall in self.every_wall)]

    def balls(self, i: int, now: float) -> Iterable[int]:
        """Return the balls whose boxes overlap that of ball ``i``."""
        x0, y0, x1, y1 = self.boxes[i]
        return [
            j
            for j, (u0, v0, u1, v1) in enumerate(self.boxes)
            if u0 <= x1 and u1 >= x0 and v0 <= y1 and v1 >= y0 and j != i
        ]


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
