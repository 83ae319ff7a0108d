"""Motion between contacts, in closed form (Eq. 10).

A moving disc loses speed at a = mu_s g along its own velocity until it stops, so its path is a
straight line: p(t) = p0 + u (v t - a t^2 / 2) for t <= v / a, with u = v / |v|.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def stopping_time(speed: float, deceleration: float) -> float:
    """How long (s) a disc at ``speed`` (m/s) keeps moving; infinite without friction.

    >>> stopping_time(2.0, 0.5), stopping_time(2.0, 0.0), stopping_time(0.0, 0.0)
    (4.0, inf, 0.0)
    """
    if speed == 0.0:
        return 0.0
    return speed / deceleration if deceleration > 0.0 else math.inf


def slide(x: float, y: float, vx: float, vy: float, deceleration: float, time: float) -> tuple[
    float, float, float, float
]:  # fmt: skip
    """Position (m) and velocity (m/s) of a free disc after ``time`` (s) >= 0.

    >>> slide(0.0, 0.0, 2.0, 0.0, 0.5, 4.0)
    (4.0, 0.0, 0.0, 0.0)
    """
    speed = math.hypot(vx, vy)
    if speed == 0.0:
        return x, y, 0.0, 0.0
    if deceleration * time >= speed:
        reach = speed / (2.0 * deceleration)
        return x + vx * reach, y + vy * reach, 0.0, 0.0
    lost = deceleration * time / speed
    reach = time * (1.0 - lost / 2.0)
    return x + vx * reach, y + vy * reach, vx * (1.0 - lost), vy * (1.0 - lost)


def slide_many(knot: Array, deceleration: float, times: Array) -> tuple[Array, Array]:
    """:func:`slide` for many times at once.

    ``knot`` (T, 5) holds t, x, y, vx, vy of the knot that each of the ``times`` (T,) belongs to.
    Returns positions (T, 2) and velocities (T, 2).
    """
    elapsed = times - knot[:, 0]
    velocity = knot[:, 3:5]
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        stop = np.where(speed > 0.0, speed / deceleration, 0.0) if deceleration > 0 else np.inf
        moving = np.minimum(elapsed, stop)
        lost = np.where(speed > 0.0, deceleration * moving / speed, 0.0)
    position = knot[:, 1:3] + velocity * (moving * (1.0 - lost / 2.0))[:, None]
    left = np.where(elapsed >= stop, 0.0, 1.0 - lost)
    return position, velocity * left[:, None]


def kinetic_energy(mass: float, vx: float, vy: float) -> float:
    """m v^2 / 2 (J)."""
    return 0.5 * mass * (vx * vx + vy * vy)
