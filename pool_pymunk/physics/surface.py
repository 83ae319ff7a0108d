"""A surface says how balls move between contacts, and how a small change of their start goes on.

A scene chooses its surface. What moves or compares balls asks it, and knows nothing of friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from pool_pymunk.physics.motion import EPSILON, Array, Vector
from pool_pymunk.physics.path import Path, motion_at, set_off, standing

Push = tuple[Vector, float]  # a cushion's normal, and mu times its change of speed (m/s)
NO_ROLL = (0.0, 0.0)
GYRATION = 2.0 / 5.0  # I / (m r^2) of a solid sphere
NO_SLIP = 8.0 * EPSILON  # A slip of this share of the speeds is none: rounding leaves as much.


class Surface(Protocol):
    """A surface gives a ball the ``path`` on which it sets off at a time (s), or rests there.

    ``pull`` (m/s^2) is the largest acceleration of a ball; without friction it is 0. ``then`` is
    the path that follows at the end of one; it is None if the ball rests there. ``rolls`` tells
    whether balls have a roll (m/s): the velocity at which they would roll. ``roll`` is that of a
    ball on a path at a time (s), after cushions have pushed it. ``jacobian`` and ``end_slopes`` are
    linear in small changes of the state and of ``pull``.
    """

    @property
    def pull(self) -> float: ...

    @property
    def rolls(self) -> bool: ...

    def path(
        self, t: float, position: Vector, velocity: Vector, roll: Vector = NO_ROLL
    ) -> Path: ...

    def then(self, path: Path) -> Path | None: ...

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector: ...

    def jacobian(self, velocity: Array, time: Array) -> tuple[Array, Array]: ...

    def end_slopes(self, velocity: Vector) -> tuple[Vector, float]: ...


class Sliding(NamedTuple):
    """On this surface balls slide straight on, and lose speed at ``pull`` (m/s^2) until they rest.

    >>> Sliding(0.5).path(1.0, (0.0, 0.0), (2.0, 0.0)).at(5.0)
    ((4.0, 0.0), (0.0, 0.0))
    """

    pull: float = 0.0

    @property
    def rolls(self) -> bool:
        return False

    def path(self, t: float, position: Vector, velocity: Vector, roll: Vector = NO_ROLL) -> Path:
        return set_off(t, position, velocity, self.pull)

    def then(self, path: Path) -> None:
        return

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector:
        return NO_ROLL

    def jacobian(self, velocity: Array, time: Array) -> tuple[Array, Array]:
        """Linearise the motion of balls with these velocities (..., 2) after a ``time`` (...) (s).

        Return the derivatives of position and velocity by those at the start (..., 4, 4), and by
        ``pull`` (..., 4); after the stop, those at the stop. Friction keeps a ball that rests at
        rest, whatever small velocity it is given, but not in no time at all.

        >>> by_state, by_pull = Sliding(0.5).jacobian(np.array([2.0, 0.0]), np.array(2.0))
        >>> by_state[0].tolist(), by_pull.tolist()
        ([1.0, 0.0, 2.0, 0.0], [-2.0, -0.0, -2.0, -0.0])
        """
        speed = np.sqrt((velocity**2).sum(axis=-1))
        moves, is_free = speed > 0.0, (time == 0.0) | (self.pull == 0.0)
        ux = velocity / np.where(moves, speed, 1.0)[..., np.newaxis]
        if self.pull > 0.0:
            time = np.minimum(time, speed / self.pull)
        lost = self.pull * time / np.where(moves, speed, 1.0)
        left = np.where(moves, 1.0 - lost, is_free)
        along = ux[..., :, np.newaxis] * ux[..., np.newaxis, :]
        by_state = np.zeros((*speed.shape, 4, 4))
        by_state[..., :2, :2] = np.eye(2)
        by_state[..., :2, 2:] = _grid(time * (1.0 - lost / 2.0)) * np.eye(2)
        by_state[..., :2, 2:] += _grid(time * lost / 2.0) * along
        by_state[..., 2:, 2:] = _grid(left) * np.eye(2) + _grid(lost) * along
        by_pull = -np.concatenate((_row(time**2 / 2.0) * ux, _row(time) * ux), axis=-1)
        return by_state, by_pull

    def end_slopes(self, velocity: Vector) -> tuple[Vector, float]:
        """Return how much later (s) a path ends, by the velocity at its start and by ``pull``."""
        speed = math.hypot(*velocity)
        by_velocity = velocity[0] / speed / self.pull, velocity[1] / speed / self.pull
        return by_velocity, -speed / self.pull**2


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
        (x, y), (vx, vy), (wx, wy) = position, velocity, roll
        ux, uy = vx - wx, vy - wy
        slip = math.sqrt(ux * ux + uy * uy)
        if slip <= NO_SLIP * (abs(vx) + abs(vy) + abs(wx) + abs(wy)):
            return set_off(t, position, velocity, self.drag)._replace(wx=vx, wy=vy)
        if self.pull == 0.0:
            return Path(t, x, y, vx, vy, 0.0, 0.0, math.inf, False, wx, wy)
        pull, time = self.pull / slip, 2.0 * slip / (7.0 * self.pull)
        return Path(t, x, y, vx, vy, -pull * ux, -pull * uy, t + time, False, wx, wy)

    def then(self, path: Path) -> Path | None:
        """Return the path on which a ball rolls; it rests if only rounding is left of its speed."""
        if path.slows:
            return None
        x, y, vx, vy = motion_at(path, path.end)
        least = NO_SLIP * (abs(path.vx) + abs(path.vy) + abs(path.wx) + abs(path.wy))
        if abs(vx) + abs(vy) <= least:
            return standing(path.end, x, y)
        return self.path(path.end, (x, y), (vx, vy), (vx, vy))

    def roll(self, path: Path, t: float, pushes: Sequence[Push] = ()) -> Vector:
        """Return the roll (m/s); the surface of the ball slips over a cushion up or down.

        Friction at a cushion takes (5/2) mu |v_n' - v_n| off the part along its normal, which does
        not change its sign. Two cushions at once take no more energy than there is.
        """
        if path.slows:
            wx, wy = motion_at(path, t)[2:]
        else:
            time = min(t, path.end) - path.t
            wx, wy = path.wx - time * path.ax / GYRATION, path.wy - time * path.ay / GYRATION
        dx = dy = 0.0
        for (nx, ny), slows in pushes:
            n = wx * nx + wy * ny
            change = -math.copysign(min(slows / GYRATION, abs(n)), n)
            dx, dy = dx + change * nx, dy + change * ny
        along, square = wx * dx + wy * dy, dx * dx + dy * dy
        share = min(1.0, -2.0 * along / square) if square > 0.0 else 0.0
        return wx + share * dx, wy + share * dy

    def jacobian(self, velocity: Array, time: Array) -> tuple[Array, Array]:
        raise NotImplementedError

    def end_slopes(self, velocity: Vector) -> tuple[Vector, float]:
        raise NotImplementedError


def rolls_of(breakpoints: Array, times: Array) -> Array:
    """Return the rolls (T, 2) in m/s at ``times`` (T,) after these breakpoints (T, 9).

    A ball whose velocity is its roll rolls on; the roll of another one grows against its slip.
    """
    acceleration, roll = breakpoints[:, 5:7], breakpoints[:, 7:9]
    is_rolling = (roll == breakpoints[:, 3:5]).all(axis=1, keepdims=True)
    time = (times - breakpoints[:, 0])[:, np.newaxis]
    return roll + time * acceleration * np.where(is_rolling, 1.0, -1.0 / GYRATION)


def _row(numbers: Array) -> Array:
    return np.asarray(numbers)[..., np.newaxis]


def _grid(numbers: Array) -> Array:
    return np.asarray(numbers)[..., np.newaxis, np.newaxis]
