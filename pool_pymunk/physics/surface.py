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


def as_rolling(mass: float, rolls: bool) -> float:
    """Return the mass (kg) by which a ball resists an impulse in the plane.

    A ball that rolls on is heavier: static friction changes its roll as its velocity.
    """
    return (1.0 + GYRATION) * mass if rolls else mass


def turns_in_time(before: Vector, after: Vector, time: float, pull: float) -> bool:
    """Tell whether friction can change a roll by this change of velocity (m/s) in a time (s)."""
    x, y, most = after[0] - before[0], after[1] - before[1], pull * time / GYRATION
    return x * x + y * y <= most * most


def roll_rate(row: Any) -> Vector:
    """Return how fast (m/s^2) a roll changes after a breakpoint: i, t, x, y, and so on."""
    ax, ay = row[6], row[7]
    return (ax, ay) if row[4] == row[8] and row[5] == row[9] else (-ax / GYRATION, -ay / GYRATION)


def rolls_of(breakpoints: Array, times: Array) -> Array:
    """Return the rolls (..., 2) in m/s at ``times`` (...) after these breakpoints (..., 9).

    A ball whose velocity is its roll rolls on; the roll of another one grows against its slip.
    """
    time = (times - breakpoints[..., 0])[..., np.newaxis]
    return breakpoints[..., 7:9] + time * roll_rates(breakpoints)


def roll_rates(breakpoints: Array) -> Array:
    """Return how fast (..., 2) in m/s^2 rolls change after breakpoints (..., 9)."""
    rolls = (breakpoints[..., 7:9] == breakpoints[..., 3:5]).all(axis=-1, keepdims=True)
    return np.asarray(breakpoints[..., 5:7] * np.where(rolls, 1.0, -1.0 / GYRATION))


class Slowing(NamedTuple):
    """These numbers tell how small changes evolve in motion that slows to rest.

    It runs along (``ux``, ``uy``) for a ``time`` (s). A change of velocity moves the ball by
    ``place`` (s) times itself, and its part along the motion by ``along`` (s) times itself more.
    ``kept`` and ``lost`` are these shares for the velocity.
    """

    ux: float
    uy: float
    time: float
    place: float
    along: float
    kept: float
    lost: float


def slowing(vx: float, vy: float, time: float, pull: float) -> Slowing:
    """Linearise motion that slows to rest, after a ``time`` (s); numba can compile it."""
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        is_free = time == 0.0 or pull == 0.0
        return Slowing(0.0, 0.0, 0.0, time if is_free else 0.0, 0.0, 1.0 if is_free else 0.0, 0.0)
    if pull > 0.0:
        time = min(time, speed / pull)
    lost = pull * time / speed
    place, along = time * (1.0 - lost / 2.0), time * lost / 2.0
    return Slowing(vx / speed, vy / speed, time, place, along, 1.0 - lost, lost)


def slowed(s: Slowing, x: Any, y: Any, u: Any, v: Any, pull: Any) -> Any:
    """Return the change of a ball's state, by that at the start and by that of the pull.

    Each part of a change is one number, or an array.
    """
    speed = s.ux * u + s.uy * v
    far = s.along * speed - s.time * s.time / 2.0 * pull
    fast = s.lost * speed - s.time * pull
    return (
        x + s.place * u + far * s.ux,
        y + s.place * v + far * s.uy,
        s.kept * u + fast * s.ux,
        s.kept * v + fast * s.uy,
    )


class Slipping(NamedTuple):
    """These numbers tell how small changes evolve in motion that slips until it rolls.

    The slip runs along (``ux``, ``uy``) for a ``time`` (s). A change of the slip across this turns
    the acceleration ``turn`` (1/s) times as fast.
    """

    ux: float
    uy: float
    time: float
    turn: float


def slipping(vx: float, vy: float, wx: float, wy: float, time: float, pull: float) -> Slipping:
    """Linearise motion that slips, after a ``time`` (s); numba can compile it."""
    ux, uy = vx - wx, vy - wy
    slip = math.sqrt(ux * ux + uy * uy)
    if slip == 0.0:
        return Slipping(0.0, 0.0, 0.0, 0.0)
    if pull > 0.0:
        time = min(time, SHARE * slip / pull)
    return Slipping(ux / slip, uy / slip, time, pull / slip)


def slipped(s: Slipping, x: Any, y: Any, u: Any, v: Any, w: Any, z: Any, pull: Any) -> Any:
    """Return the change of a ball's state, as :func:`slowed`; (``w``, ``z``) is that of its roll.

    >>> slides = slipping(7.0, 0.0, 0.0, 0.0, 1.0, 2.0)
    >>> [round(part, 9) for part in slipped(slides, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)[::2]]
    [-0.5, -1.0, 2.5]
    """
    across = s.turn * (s.ux * (v - z) - s.uy * (u - w))
    ax, ay = s.uy * across - s.ux * pull, -s.ux * across - s.uy * pull
    far, spun = s.time * s.time / 2.0, s.time / GYRATION
    return (
        x + s.time * u + far * ax,
        y + s.time * v + far * ay,
        u + s.time * ax,
        v + s.time * ay,
        w - spun * ax,
        z - spun * ay,
    )


def without_slip(velocity: Any, roll: Any) -> Any:
    """Return the change of a rolling ball's velocity and roll, once the slip of both is gone."""
    return (1.0 - SHARE) * velocity + SHARE * roll


def stops_later(vx: float, vy: float, pull: float, by_x: Any, by_y: Any, by_pull: Any) -> Any:
    """Return how much later (s) motion at (``vx``, ``vy``) comes to rest, by the changes of all."""
    speed = math.sqrt(vx * vx + vy * vy)
    return ((vx * by_x + vy * by_y) / speed - speed / pull * by_pull) / pull


def longer(ux: float, uy: float, pull: float, by_x: Any, by_y: Any, by_pull: Any) -> Any:
    """Return how much longer (s) a slip of (``ux``, ``uy``) m/s lasts, by the changes of all."""
    slip = math.sqrt(ux * ux + uy * uy)
    return SHARE / pull * ((ux * by_x + uy * by_y) / slip - slip / pull * by_pull)
