"""A surface says how balls move between contacts, and how small changes of their starts evolve.

A scene chooses its surface. Code that moves or compares balls asks the surface about friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from pool_pymunk.physics.motion import EPSILON, Array, Vector
from pool_pymunk.physics.path import Path, motion_at, set_off, standing

Push = tuple[Vector, float]  # a cushion's normal, and mu times its change of speed (m/s)
NO_ROLL = (0.0, 0.0)
GYRATION = 2.0 / 5.0  # I / (m r^2) of a solid sphere
SHARE = 2.0 / 7.0  # k / (1 + k), k = GYRATION: this share of a slip is taken off the velocity
# A slip of this share of the speeds is none: rounding leaves as much. Half or twice of it moves no
# end of tests.halved.
NO_SLIP = 8.0 * EPSILON
SLIPS = 1e-9  # of the speeds; a ball that slides until it rolls slips less than this at the end


class Surface(Protocol):
    """A surface gives a ball the ``path`` on which it sets off at a time (s), or rests there.

    ``pull`` (m/s^2) is the largest acceleration of a ball; without friction it is 0. ``drag``
    (m/s^2) is the deceleration of a ball that slows straight to rest. ``then`` is the path that
    follows at the end of one; it is None if the ball rests there. ``rolls`` tells whether balls
    have a roll (m/s): the velocity at which they would roll. ``roll`` is that of a ball on a path
    at a time (s), after cushions have pushed it.
    """

    @property
    def pull(self) -> float: ...

    @property
    def drag(self) -> float: ...

    @property
    def rolls(self) -> bool: ...

    def path(
        self, t: float, position: Vector, velocity: Vector, roll: Vector = NO_ROLL
    ) -> Path: ...

    def then(self, path: Path) -> Path | None: ...

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector: ...


class Sliding(NamedTuple):
    """On this surface balls slide straight on, and lose speed at ``pull`` (m/s^2) until they rest.

    >>> Sliding(0.5).path(1.0, (0.0, 0.0), (2.0, 0.0)).at(5.0)
    ((4.0, 0.0), (0.0, 0.0))
    """

    pull: float = 0.0

    @property
    def drag(self) -> float:
        return self.pull

    @property
    def rolls(self) -> bool:
        return False

    def path(self, t: float, position: Vector, velocity: Vector, roll: Vector = NO_ROLL) -> Path:
        return set_off(t, position, velocity, self.pull)

    def then(self, path: Path) -> None:
        return

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector:
        return NO_ROLL


class Rolling(NamedTuple):
    """On this surface balls slide until they roll, and roll until they rest; they are spheres.

    ``pull`` and ``drag`` (m/s^2) are the decelerations of sliding and of rolling. With the velocity
    v and the roll w, the slip is u = v - w. While a ball slides, dv/dt = -pull u/|u| and
    dw/dt = +(5/2) pull u/|u|: the slip keeps its direction, and is 0 after 2 |u| / (7 pull). Then
    the ball rolls: w = v, and dv/dt = -drag v/|v|.

    A ball that slides at 7 m/s without roll rolls at 5 m/s:

    >>> surface = Rolling(2.0, 0.1)
    >>> slides = surface.path(0.0, (0.0, 0.0), (7.0, 0.0))
    >>> surface.then(slides)[:8]
    (1.0, 6.0, 0.0, 5.0, 0.0, -0.1, -0.0, 51.0)
    """

    pull: float
    drag: float

    @property
    def rolls(self) -> bool:
        return True

    def path(self, t: float, position: Vector, velocity: Vector, roll: Vector = NO_ROLL) -> Path:
        return slide_or_roll(t, position, velocity, roll, self.pull, self.drag)

    def then(self, path: Path) -> Path | None:
        return None if path.slows else roll_on(path, self.drag)

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector:
        roll, change = roll_at(path, t), NO_ROLL
        for push in pushes:
            change = slowed_by(push, roll, change)
        return changed_by(change, roll)


def slide_or_roll(
    t: float, position: Vector, velocity: Vector, roll: Vector, pull: float, drag: float
) -> Path:
    """Return the path of a ball that slides from ``t`` (s) on until it rolls, or rolls already."""
    (x, y), (vx, vy), (wx, wy) = position, velocity, roll
    ux, uy = vx - wx, vy - wy
    slip = math.sqrt(ux * ux + uy * uy)
    if slip <= NO_SLIP * (abs(vx) + abs(vy) + abs(wx) + abs(wy)):
        return _rolling(t, position, velocity, drag)
    if pull == 0.0:
        return Path(t, x, y, vx, vy, 0.0, 0.0, math.inf, False, wx, wy)
    share, time = pull / slip, 2.0 * slip / (7.0 * pull)
    return Path(t, x, y, vx, vy, -share * ux, -share * uy, t + time, False, wx, wy)


def roll_on(path: Path, drag: float) -> Path:
    """Return the path on which a ball rolls; it rests if its speed is only rounding."""
    x, y, vx, vy = motion_at(path, path.end)
    least = NO_SLIP * (abs(path.vx) + abs(path.vy) + abs(path.wx) + abs(path.wy))
    if abs(vx) + abs(vy) <= least:
        return standing(path.end, x, y)
    return _rolling(path.end, (x, y), (vx, vy), drag)


def _rolling(t: float, position: Vector, velocity: Vector, drag: float) -> Path:
    t, x, y, vx, vy, ax, ay, end, _, _, _ = set_off(t, position, velocity, drag)
    return Path(t, x, y, vx, vy, ax, ay, end, True, vx, vy)


def roll_at(path: Path, t: float) -> Vector:
    """Return the roll (m/s) of a ball on a path at ``t`` (s)."""
    if path.slows:
        _, _, vx, vy = motion_at(path, t)
        return vx, vy
    time = min(t, path.end) - path.t
    return path.wx - time * path.ax / GYRATION, path.wy - time * path.ay / GYRATION


def is_piece(path: Path) -> bool:
    """Tell whether a path is a piece of a motion in persistent contact, and ends while it slips.

    >>> is_piece(slide_or_roll(0.0, (0.0, 0.0), (7.0, 0.0), (0.0, 0.0), 2.0, 0.1))
    False
    """
    if path.slows:
        return False
    _, _, vx, vy = motion_at(path, path.end)
    wx, wy = roll_at(path, path.end)
    sizes = abs(path.vx) + abs(path.vy) + abs(path.wx) + abs(path.wy)
    return abs(vx - wx) + abs(vy - wy) > SLIPS * sizes


def slowed_by(push: Push, roll: Vector, change: Vector) -> Vector:
    """Add what a cushion takes off a ball's roll (m/s) to a ``change`` of this roll.

    The surface of the ball slips over the cushion up or down. Friction takes (5/2) mu |v_n' - v_n|
    off the part of the roll along the normal, which does not change its sign.
    """
    (nx, ny), slows = push
    n = roll[0] * nx + roll[1] * ny
    less = -math.copysign(min(slows / GYRATION, abs(n)), n)
    return change[0] + less * nx, change[1] + less * ny


def changed_by(change: Vector, roll: Vector) -> Vector:
    """Return the roll (m/s) after cushions; two at once take no more energy than there is."""
    (dx, dy), (wx, wy) = change, roll
    along, square = wx * dx + wy * dy, dx * dx + dy * dy
    share = min(1.0, -2.0 * along / square) if square > 0.0 else 0.0
    return wx + share * dx, wy + share * dy


def roll_rate(row: Any) -> Vector:
    """Return how fast (m/s^2) a roll changes after a breakpoint: i, t, x, y, and so on."""
    ax, ay = row[6], row[7]
    return (ax, ay) if row[4] == row[8] and row[5] == row[9] else (-ax / GYRATION, -ay / GYRATION)


def roll_rates(breakpoints: Array) -> Array:
    """Return how fast (..., 2) in m/s^2 rolls change after breakpoints (..., 9).

    A ball whose velocity is its roll rolls on; the roll of another one grows against its slip.
    """
    rolls = (breakpoints[..., 7:9] == breakpoints[..., 3:5]).all(axis=-1, keepdims=True)
    return np.asarray(breakpoints[..., 5:7] * np.where(rolls, 1.0, -1.0 / GYRATION))
