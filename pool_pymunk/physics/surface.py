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


def slowing(vx: float, vy: float, time: float, pull: float) -> tuple[Any, Any]:
    """Linearise motion that slows to rest, after a ``time`` (s).

    Return the derivatives of place and velocity by those at the start, as four rows, and by the
    ``pull`` (m/s^2). Friction stops any small velocity of a ball that rests, but not at the time 0.

    >>> by_state, by_pull = slowing(2.0, 0.0, 2.0, 0.5)
    >>> by_state[:2], by_pull[::2]
    (((1.0, 0.0, 2.0, 0.0), (0.0, 1.0, 0.0, 1.5)), (-2.0, -2.0))
    """
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        kept = 1.0 if time == 0.0 or pull == 0.0 else 0.0
        place = kept * time
        return (
            (1.0, 0.0, place, 0.0), (0.0, 1.0, 0.0, place), (0.0, 0.0, kept, 0.0),
            (0.0, 0.0, 0.0, kept),
        ), (0.0, 0.0, 0.0, 0.0)  # fmt: skip
    if pull > 0.0:
        time = min(time, speed / pull)
    lost, ux, uy = pull * time / speed, vx / speed, vy / speed
    kept, place, along = 1.0 - lost, time * (1.0 - lost / 2.0), time * lost / 2.0
    xx, xy, yy, far = ux * ux, ux * uy, uy * uy, time * time / 2.0
    return (
        (1.0, 0.0, place + along * xx, along * xy),
        (0.0, 1.0, along * xy, place + along * yy),
        (0.0, 0.0, kept + lost * xx, lost * xy),
        (0.0, 0.0, lost * xy, kept + lost * yy),
    ), (-far * ux, -far * uy, -time * ux, -time * uy)


def rolling_on(vx: float, vy: float, time: float, drag: float) -> tuple[Any, Any]:
    """Linearise motion of a ball that rolls, as :func:`slowing`, with six rows.

    A slip that is given to the ball is gone at once: it goes on with 5/7 of the change of its
    velocity and 2/7 of that of its roll.
    """
    (x, y, u, v), (by_x, by_y, by_u, by_v) = slowing(vx, vy, time, drag)
    k = 1.0 - SHARE
    fast_u = 0.0, 0.0, k * u[2], k * u[3], SHARE * u[2], SHARE * u[3]
    fast_v = 0.0, 0.0, k * v[2], k * v[3], SHARE * v[2], SHARE * v[3]
    return (
        (1.0, 0.0, k * x[2], k * x[3], SHARE * x[2], SHARE * x[3]),
        (0.0, 1.0, k * y[2], k * y[3], SHARE * y[2], SHARE * y[3]),
        fast_u, fast_v, fast_u, fast_v,
    ), (by_x, by_y, by_u, by_v, by_u, by_v)  # fmt: skip


def slipping(slip: Vector, time: float, pull: float) -> tuple[Any, Any]:
    """Linearise motion that slips until it rolls, as :func:`slowing`, with six rows.

    A change of the ``slip`` (m/s) across itself turns the acceleration.

    >>> [round(part, 9) for part in slipping((7.0, 0.0), 1.0, 2.0)[1][::2]]
    [-0.5, -1.0, 2.5]
    """
    ux, uy = slip
    speed = math.sqrt(ux * ux + uy * uy)
    if pull > 0.0:
        time = min(time, SHARE * speed / pull)
    ux, uy, turn = ux / speed, uy / speed, pull / speed
    xx, xy, yy = turn * ux * ux, turn * ux * uy, turn * uy * uy
    far, spun = time * time / 2.0, time / GYRATION
    return (
        (1.0, 0.0, time - far * yy, far * xy, far * yy, -far * xy),
        (0.0, 1.0, far * xy, time - far * xx, -far * xy, far * xx),
        (0.0, 0.0, 1.0 - time * yy, time * xy, time * yy, -time * xy),
        (0.0, 0.0, time * xy, 1.0 - time * xx, -time * xy, time * xx),
        (0.0, 0.0, spun * yy, -spun * xy, 1.0 - spun * yy, spun * xy),
        (0.0, 0.0, -spun * xy, spun * xx, spun * xy, 1.0 - spun * xx),
    ), (-far * ux, -far * uy, -time * ux, -time * uy, spun * ux, spun * uy)


def stops_later(vx: float, vy: float, pull: float, by_x: Any, by_y: Any, by_pull: Any) -> Any:
    """Return how much later (s) motion at (``vx``, ``vy``) comes to rest, by the changes of all."""
    speed = math.sqrt(vx * vx + vy * vy)
    rate = speed * pull
    return vx / rate * by_x + vy / rate * by_y - speed / pull / pull * by_pull


def longer(ux: float, uy: float, pull: float, by_x: Any, by_y: Any, by_pull: Any) -> Any:
    """Return how much longer (s) a slip of (``ux``, ``uy``) m/s lasts, by the changes of all."""
    slip = math.sqrt(ux * ux + uy * uy)
    return SHARE / pull * ((ux * by_x + uy * by_y) / slip - slip / pull * by_pull)
