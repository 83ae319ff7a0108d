"""A surface says how balls move between contacts, and how a small change of their start goes on.

A scene chooses its surface. What moves or compares balls asks it, and knows nothing of friction.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from pool_pymunk.physics.motion import Array, Vector
from pool_pymunk.physics.path import Path, set_off


class Surface(Protocol):
    """A surface gives a ball the ``path`` on which it sets off at a time (s), or rests there.

    ``pull`` (m/s^2) is the largest acceleration of a ball; without friction it is 0. ``then`` is
    the path that follows at the end of one; it is None if the ball rests there. ``jacobian`` and
    ``end_slopes`` are linear in small changes of the state and of ``pull``.
    """

    @property
    def pull(self) -> float: ...

    def path(self, t: float, position: Vector, velocity: Vector) -> Path: ...

    def then(self, path: Path) -> Path | None: ...

    def jacobian(self, velocity: Array, time: Array) -> tuple[Array, Array]: ...

    def end_slopes(self, velocity: Vector) -> tuple[Vector, float]: ...


class Sliding(NamedTuple):
    """On this surface balls slide straight on, and lose speed at ``pull`` (m/s^2) until they rest.

    >>> Sliding(0.5).path(1.0, (0.0, 0.0), (2.0, 0.0)).at(5.0)
    ((4.0, 0.0), (0.0, 0.0))
    """

    pull: float = 0.0

    def path(self, t: float, position: Vector, velocity: Vector) -> Path:
        return set_off(t, position, velocity, self.pull)

    def then(self, path: Path) -> None:
        return

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


def _row(numbers: Array) -> Array:
    return np.asarray(numbers)[..., np.newaxis]


def _grid(numbers: Array) -> Array:
    return np.asarray(numbers)[..., np.newaxis, np.newaxis]
