"""Between breakpoints balls move with constant acceleration: here are many balls at many times."""

from __future__ import annotations

import numpy as np

from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.model.arrays import Array


@np.errstate(invalid="ignore")  # A run may end where a velocity is infinite.
def free_motions(breakpoints: Array, times: Array) -> tuple[Array, Array]:
    """Return positions (..., 2) in m and velocities (..., 2) in m/s at many ``times`` (...) (s).

    ``breakpoints`` (..., 7) holds t, x, y, vx, vy, ax, ay of the last breakpoint before each of
    them. :class:`~pool_pymunk.core.motion.path.Path` does the same for one path.
    """
    place, velocity, acceleration = np.split(breakpoints[..., 1:7], 3, axis=-1)
    time = (times - breakpoints[..., 0])[..., np.newaxis]
    position = place + time * (velocity + time * acceleration / 2.0)
    return position, velocity + time * acceleration


def bent_motions(breakpoints: Array, times: Array) -> tuple[Array, Array]:
    """Return the same where ``breakpoints`` (..., 9) have rates of accelerations (m/s^3), too."""
    position, velocity = free_motions(breakpoints, times)
    time = (times - breakpoints[..., 0])[..., np.newaxis]
    rate = breakpoints[..., 7:9]
    return position + time**3 * rate / 6.0, velocity + time**2 * rate / 2.0


def roll_rates(breakpoints: Array) -> Array:
    """Return how fast (..., 2) in m/s^2 rolls change after breakpoints (..., 9).

    A ball whose velocity is its roll rolls on; the roll of another one grows against its slip.
    """
    rolls = (breakpoints[..., 7:9] == breakpoints[..., 3:5]).all(axis=-1, keepdims=True)
    return np.asarray(breakpoints[..., 5:7] * np.where(rolls, 1.0, -1.0 / GYRATION))
