"""This module finds the balls whose paths may cross that of a ball, by boxes around paths."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.engine.decisions import NEARLY_NOW
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.path import Path, motion_at

MANY = 40  # From so many balls on, arrays are faster than a loop.
CROWD = 24  # From so many balls nearby on, they are sifted all at once.
LEAPS = 3  # A sifting makes so many leaps.
X, Y, VX, VY, AX, AY, T, R, STOP, END = range(10)  # the rows of ``lines``

Indices = NDArray[np.intp]


class Near(Protocol):
    """A Near tells the engine which balls and walls a ball may meet on its path.

    It may name some more than the ball meets, but never fewer. The engine first calls ``walls``,
    then ``begin`` with the ball's new path, which meets a wall at ``end`` (s; infinite if at none).
    It calls ``remove`` when the ball is taken off the table.
    """

    def walls(self, i: int) -> Iterable[int]: ...

    def begin(self, i: int, path: Path, radius: float, end: float) -> None: ...

    def balls(self, i: int, now: float) -> Iterable[int]: ...

    def remove(self, i: int) -> None: ...


Box = tuple[float, float, float, float]  # lowest x and y, highest x and y (m)

NOWHERE: Box = (math.inf, math.inf, -math.inf, -math.inf)


def box(path: Path, radius: float, end: float) -> Box:
    """Return the box of a disc on its path, up to the time ``end`` (s) when it meets a wall."""
    x, y = path.x, path.y
    if end < math.inf:
        ex, ey, _, _ = motion_at(path, end)
    elif path.reach < math.inf:
        ex, ey = path.rest_x, path.rest_y
    else:
        ex = math.copysign(math.inf, path.vx) if path.vx else x
        ey = math.copysign(math.inf, path.vy) if path.vy else y
    r = radius + 2.0 * NEARLY_NOW * radius + 1e-9 * (abs(x) + abs(y))
    x0, x1 = (x, ex) if x < ex else (ex, x)
    y0, y1 = (y, ey) if y < ey else (ey, y)
    return x0 - r, y0 - r, x1 + r, y1 + r


class Boxes:
    """There is a box around each ball's path; these few boxes are looked through one by one."""

    def __init__(self, balls: int, walls: int) -> None:
        self.boxes: list[Box] = [NOWHERE] * balls
        self.every_wall = range(walls)

    def walls(self, i: int) -> Iterable[int]:
        """Return all walls, because there are few."""
        return self.every_wall

    def begin(self, i: int, path: Path, radius: float, end: float) -> None:
        """Put a box around ball ``i``'s new path."""
        self.boxes[i] = box(path, radius, end)

    def remove(self, i: int) -> None:
        """Leave ball ``i`` out from now on."""
        self.boxes[i] = NOWHERE

    def balls(self, i: int, now: float) -> Iterable[int]:
        """Return the balls whose boxes overlap that of ball ``i``."""
        x0, y0, x1, y1 = self.boxes[i]
        return [
            j
            for j, (u0, v0, u1, v1) in enumerate(self.boxes)
            if u0 <= x1 and u1 >= x0 and v0 <= y1 and v1 >= y0 and j != i
        ]


class ManyBoxes(Boxes):
    """The boxes of many balls are in one array; if many are near, their motion sifts them."""

    def __init__(self, balls: int, walls: int) -> None:
        super().__init__(balls, walls)
        self.bounds = np.array([NOWHERE] * balls).T.copy()
        self.lines = np.zeros((10, balls))

    def begin(self, i: int, path: Path, radius: float, end: float) -> None:
        """Put a box around ball ``i``'s new path, and keep the path for sifting."""
        a = path.deceleration
        self.bounds[:, i] = box(path, radius, end)
        self.lines[:, i] = (
            path.x, path.y, path.vx, path.vy, a * path.ux, a * path.uy,
            path.t, radius, path.stop, end,
        )  # fmt: skip

    def remove(self, i: int) -> None:
        """Leave ball ``i`` out from now on."""
        self.bounds[:, i] = NOWHERE

    def balls(self, i: int, now: float) -> Iterable[int]:
        """Return the balls whose boxes overlap that of ball ``i``, or fewer."""
        x0, y0, x1, y1 = self.bounds[:, i].tolist()
        low_x, low_y, high_x, high_y = self.bounds
        near = (low_x <= x1) & (high_x >= x0) & (low_y <= y1) & (high_y >= y0)
        if self.lines[STOP, i] <= now:
            near &= self.lines[STOP] > now
        near[i] = False
        others = np.flatnonzero(near)
        found: list[int] = (others if len(others) < CROWD else self._sift(i, others, now)).tolist()
        return found

    def _sift(self, i: int, others: Indices, now: float) -> Indices:
        """Return those of the others that ball ``i`` may meet.

        Time leaps forward as in :func:`~pool_pymunk.physics.motion.time_of_impact`, never past a
        contact, but for all others at once. A pair meets nothing if it leaps beyond the end of one
        of its paths, or beyond both stops.
        """
        own, lines = self.lines[:, [i]], self.lines[:, others]
        until = np.minimum(np.minimum(own[END], lines[END]), np.maximum(own[STOP], lines[STOP]))
        t = np.full(len(others), now)
        for _ in range(LEAPS):
            t = t + _leap(own, lines, t)
            left = t <= until
            others, lines, until, t = others[left], lines[:, left], until[left], t[left]
        return others


def _leap(own: Array, lines: Array, t: Array) -> Array:
    """Return for how long (s) after the times ``t`` there is provably no contact."""
    ax, ay, avx, avy = _slid(own, t)
    bx, by, bvx, bvy = _slid(lines, t)
    x, y = bx - ax, by - ay
    distance = np.hypot(x, y)
    rate = (x * (bvx - avx) + y * (bvy - avy)) / distance
    reach = own[R] + lines[R]
    gap = np.maximum(distance - reach * (1.0 + 1e-9), 0.0)
    pull = np.hypot(own[AX], own[AY]) + np.hypot(lines[AX], lines[AY])
    root = np.sqrt(rate * rate + 2.0 * pull * gap)
    with np.errstate(divide="ignore", invalid="ignore"):
        leap: Array = np.where(rate < 0.0, 2.0 * gap / (root - rate), (rate + root) / pull)
    return leap


def _slid(lines: Array, t: Array) -> tuple[Array, Array, Array, Array]:
    """Return where the balls are (m) and how they move (m/s) at the times ``t``."""
    dt = np.minimum(t, lines[STOP]) - lines[T]
    vx, vy = lines[VX] - lines[AX] * dt, lines[VY] - lines[AY] * dt
    x = lines[X] + (lines[VX] + vx) * (0.5 * dt)
    return x, lines[Y] + (lines[VY] + vy) * (0.5 * dt), vx, vy
