"""This module linearises motion and contacts: how a small change before becomes one after.

A change is that of a ball's state (x, y, vx, vy) at a fixed time, so it lives on while the ball
slides (:func:`slide_jacobian`). A :class:`Meeting` takes changes through a contact, in four steps.
The contact comes at another time. At that time the states are changed by more, because they went on
changing until then. The law answers other velocities, along a normal that has turned. And the
balls have been on their new paths for more or less time. The four together are the saltation matrix

    S = R + (f_after - R f_before) G / (G f_before)

with the Jacobian R of what the contact does to the state, the rates of change f of the state before
and after it, and the gradient G of the gap (Kong, Payne, Zhu and Johnson, Saltation Matrices: The
Essential Tool for Linearizing Hybrid Dynamical Systems, Proceedings of the IEEE 112, 2024, 585).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import Array

State4 = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)


def slide_jacobian(vx: float, vy: float, deceleration: float, time: float) -> tuple[Array, Array]:
    """Linearise :func:`~pool_pymunk.physics.motion.slide` after ``time`` (s).

    Return the derivatives of position and velocity by those at the start (4, 4), and by the
    deceleration (4,); after the stop, those at the stop. Friction keeps a ball that rests at rest,
    whatever small velocity it is given, but not in no time at all.

    >>> by_state, by_deceleration = slide_jacobian(2.0, 0.0, 0.5, 2.0)
    >>> by_state[0].tolist(), by_deceleration.tolist()
    ([1.0, 0.0, 2.0, 0.0], [-2.0, -0.0, -2.0, -0.0])
    """
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        is_free = deceleration == 0.0 or time == 0.0
        return _blocks(time * is_free, 0.0, float(is_free), 0.0, vx, vy), np.zeros(4)
    if deceleration > 0.0:
        time = min(time, speed / deceleration)
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


class Meeting(NamedTuple):
    """A meeting takes changes of a ball's state (K = 4), or of two (K = 8), through their contact.

    ``guard`` (K,) is the gradient of the gap, ``closing`` (m/s) how fast the gap shrinks, ``rate``
    (K,) how fast the states change before the contact. ``turning`` (K,) says how far the normal
    turns (rad). ``split`` (M, K) gives the changes of the velocities along normal and tangent, and
    ``join`` (K, M) takes them back to those along x and y.
    """

    guard: Array
    closing: float
    rate: Array
    turning: Array
    split: Array
    join: Array

    def times(self, change: Array, gap: Array | float = 0.0) -> Array:
        """Return how much later (P,) the contact comes, by changes of the states and of the gap."""
        return np.asarray((self.guard @ change + gap) / self.closing)

    def moved(self, change: Array, times: Array) -> Array:
        """Return the changes of the states (K, P) at the contact, whenever it comes."""
        return np.asarray(change + self.rate[:, np.newaxis] * times)

    def after(
        self,
        moved: Array,
        times: Array,
        parts: Array,
        velocities: Sequence[Vector],
        deceleration: float,
    ) -> Array:
        """Return the changes of the states after the contact, at a fixed time again.

        ``parts`` (M, P) are the changes of the velocities along normal and tangent after it, and
        ``velocities`` those that the balls have then.
        """
        found = self.join @ parts
        turned = [part for vx, vy in velocities for part in (0.0, 0.0, -vy, vx)]
        found += np.array(turned)[:, np.newaxis] * (self.turning @ moved)
        for row in range(0, len(moved), 4):
            found[row : row + 2] = moved[row : row + 2]
        later = [part for v in velocities for part in rate(v, deceleration)]
        return np.asarray(found - np.array(later)[:, np.newaxis] * times)


def hit(a: State4, b: State4, deceleration: float) -> Meeting:
    """Return the meeting of two balls in these states."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    turning = np.array([ny, -nx, 0.0, 0.0, -ny, nx, 0.0, 0.0]) / distance
    guard = np.array([-nx, -ny, 0.0, 0.0, nx, ny, 0.0, 0.0])
    closing = (a[2] - b[2]) * nx + (a[3] - b[3]) * ny
    return _meeting((a, b), (nx, ny), guard, closing, turning, deceleration)


def bounce(a: State4, normal: Vector, curvature: float, deceleration: float) -> Meeting:
    """Return the meeting of a ball with a cushion; ``normal`` points into the table.

    ``curvature`` (1/m) says how fast the normal turns as the ball moves along the side: 0 at a
    straight side, and one over the distance of the centres at a corner.
    """
    nx, ny = normal
    turning = curvature * np.array([-ny, nx, 0.0, 0.0])
    guard = np.array([nx, ny, 0.0, 0.0])
    return _meeting((a,), normal, guard, -(a[2] * nx + a[3] * ny), turning, deceleration)


def _meeting(
    states: Sequence[State4],
    normal: Vector,
    guard: Array,
    closing: float,
    turning: Array,
    deceleration: float,
) -> Meeting:
    nx, ny = normal
    count = len(states)
    split, join = np.zeros((2 * count, 4 * count)), np.zeros((4 * count, 2 * count))
    spun: list[float] = []
    rates: list[float] = []
    for k, (_, _, vx, vy) in enumerate(states):
        split[2 * k, 4 * k + 2 : 4 * k + 4] = join[4 * k + 2 : 4 * k + 4, 2 * k] = normal
        split[2 * k + 1, 4 * k + 2 : 4 * k + 4] = join[4 * k + 2 : 4 * k + 4, 2 * k + 1] = (-ny, nx)
        spun += [vy * nx - vx * ny, -(vx * nx + vy * ny)]
        rates += rate((vx, vy), deceleration)
    split += np.array(spun)[:, np.newaxis] * turning
    return Meeting(guard, closing, np.array(rates), turning, split, join)
