"""This module linearises motion and contacts: how a small change before becomes one after.

A change is that of a ball's state (x, y, vx, vy) at a fixed time, so it lives on while the ball
slides (:func:`slide_jacobian`). A change moves the time of a contact, too. The ball then slides on
from another place and with another velocity, but a little earlier or later, and both count. What
comes of it at a fixed time is the saltation matrix

    S = R + (f_after - R f_before) G / (G f_before)

with the Jacobian R of what the contact does to the state, the rates of change f of the state before
and after it, and the gradient G of the gap (Kong, Payne, Zhu and Johnson, Saltation Matrices: The
Essential Tool for Linearizing Hybrid Dynamical Systems, Proceedings of the IEEE 112, 2024, 585).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import Array

State4 = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)


def slide_jacobian(vx: float, vy: float, deceleration: float, time: float) -> tuple[Array, Array]:
    """Linearise :func:`~pool_pymunk.physics.motion.slide` after ``time`` (s).

    Return the derivatives of position and velocity by those at the start (4, 4), and by the
    deceleration (4,). The time is at most that until the stop. A ball that rests goes on to rest.

    >>> by_state, by_deceleration = slide_jacobian(2.0, 0.0, 0.5, 2.0)
    >>> by_state[0].tolist(), by_deceleration.tolist()
    ([1.0, 0.0, 2.0, 0.0], [-2.0, -0.0, -2.0, -0.0])
    """
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        free = time if deceleration == 0.0 else 0.0
        return _blocks(free, 0.0, float(deceleration == 0.0), 0.0, vx, vy), np.zeros(4)
    lost = deceleration * time / speed
    reach = time * (1.0 - lost / 2.0)
    turn = lost / (speed * speed)  # A faster ball loses a smaller share of its speed.
    by_state = _blocks(reach, turn * time / 2.0, 1.0 - lost, turn, vx, vy)
    share = time / speed
    by_deceleration = np.array(
        [-vx * share * time / 2.0, -vy * share * time / 2.0, -vx * share, -vy * share]
    )
    return by_state, by_deceleration


def _blocks(reach: float, way: float, left: float, turn: float, vx: float, vy: float) -> Array:
    """Return the matrix of the blocks (1, reach + way v v^T) and (0, left + turn v v^T)."""
    xx, xy, yy = vx * vx, vx * vy, vy * vy
    return np.array(
        [
            [1.0, 0.0, reach + way * xx, way * xy],
            [0.0, 1.0, way * xy, reach + way * yy],
            [0.0, 0.0, left + turn * xx, turn * xy],
            [0.0, 0.0, turn * xy, left + turn * yy],
        ]
    )


def rate(v: Vector, deceleration: float) -> State4:
    """Return how fast the state of a ball with velocity ``v`` changes: velocity, acceleration."""
    speed = math.sqrt(v[0] * v[0] + v[1] * v[1])
    drag = deceleration / speed if speed > 0.0 else 0.0
    return (v[0], v[1], -drag * v[0], -drag * v[1])


class Contact4(NamedTuple):
    """A linearised contact says what becomes of changes of state, of the gap and of coefficients.

    ``reset`` is R, of one ball (4, 4) or of two (8, 8); ``by_law`` has the derivatives of the
    state after the contact by what the law was told of masses and coefficients. ``guard`` is the
    gradient G of the gap, ``closing`` (m/s) how fast the gap shrinks, -G f_before, and ``shift``
    is R f_before - f_after: what a later contact does to the state.
    """

    reset: Array
    by_law: Array
    guard: Array
    closing: float
    shift: Array

    def times(self, change: Array, gap: Array | float = 0.0) -> Array:
        """Return the change (P,) of the contact's time, by changes of states and of the gap."""
        return np.asarray((self.guard @ change + gap) / self.closing)

    def after(self, change: Array, times: Array, law: Array | None) -> Array:
        """Return the changes of the states after the contact, at a fixed time."""
        found = self.reset @ change
        found += self.shift[:, np.newaxis] * times
        if law is not None:
            found += self.by_law @ law
        return found


def hit(
    a: State4, b: State4, after: tuple[Vector, Vector], law: Array, deceleration: float
) -> Contact4:
    """Linearise a hit of two balls, with their states before it and velocities after it.

    ``law`` is the law's Jacobian (:func:`~pool_pymunk.physics.dual.hit_jacobian`).
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    tx, ty = -ny, nx
    turning = np.array([-tx, -ty, 0.0, 0.0, tx, ty, 0.0, 0.0]) / distance
    (_, _, ax, ay), (_, _, bx, by) = a, b
    split = np.zeros((4, 8))  # the changes of a_n, a_t, b_n, b_t
    split[0, 2:4] = split[2, 6:8] = nx, ny
    split[1, 2:4] = split[3, 6:8] = tx, ty
    normal_parts = (ax * nx + ay * ny, bx * nx + by * ny)
    tangent_parts = (ax * tx + ay * ty, bx * tx + by * ty)
    split += np.outer(
        [tangent_parts[0], -normal_parts[0], tangent_parts[1], -normal_parts[1]], turning
    )
    joined = np.zeros((8, 4))  # from a_n, a_t, b_n, b_t to velocities
    joined[2:4, 0] = joined[6:8, 2] = nx, ny
    joined[2:4, 1] = joined[6:8, 3] = tx, ty
    (cx, cy), (ex, ey) = after
    reset = joined @ (law[:, :4] @ split)
    # A normal that turns takes the velocities after the hit with it.
    reset += np.outer([0.0, 0.0, -cy, cx, 0.0, 0.0, -ey, ex], turning)
    reset[0, 0] = reset[1, 1] = reset[4, 4] = reset[5, 5] = 1.0
    guard = np.array([-nx, -ny, 0.0, 0.0, nx, ny, 0.0, 0.0])
    before = np.array([*rate((ax, ay), deceleration), *rate((bx, by), deceleration)])
    later = np.array([*rate((cx, cy), deceleration), *rate((ex, ey), deceleration)])
    closing = normal_parts[0] - normal_parts[1]
    return Contact4(reset, joined @ law[:, 4:], guard, closing, reset @ before - later)


def bounce(
    a: State4, after: Vector, normal: Vector, curvature: float, law: Array, deceleration: float
) -> Contact4:
    """Linearise a hit on a cushion; ``normal`` points into the table.

    ``curvature`` (1/m) says how fast the normal turns as the ball moves along the side: 0 at a
    straight side, and one over the distance of the centres at a corner. ``law`` is the law's
    Jacobian (:func:`~pool_pymunk.physics.dual.cushion_jacobian`).
    """
    nx, ny = normal
    tx, ty = -ny, nx
    vx, vy = a[2:]
    turning = curvature * np.array([tx, ty, 0.0, 0.0])
    split = np.array([[0.0, 0.0, nx, ny], [0.0, 0.0, tx, ty]])
    split += np.outer([vx * tx + vy * ty, -(vx * nx + vy * ny)], turning)
    joined = np.array([[0.0, 0.0], [0.0, 0.0], [nx, tx], [ny, ty]])
    cx, cy = after
    reset = joined @ (law[:, :2] @ split) + np.outer([0.0, 0.0, -cy, cx], turning)
    reset[0, 0] = reset[1, 1] = 1.0
    guard = np.array([nx, ny, 0.0, 0.0])
    shift = reset @ rate((vx, vy), deceleration) - rate(after, deceleration)
    return Contact4(reset, joined @ law[:, 2:], guard, -(vx * nx + vy * ny), shift)
