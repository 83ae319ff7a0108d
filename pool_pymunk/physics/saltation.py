"""This module linearises motion and contacts: how a small change before becomes one after.

A change is that of a ball's state (x, y, vx, vy) at a fixed time, so it lives on while the ball
moves on (:class:`~pool_pymunk.physics.surface.Surface`). A :class:`Saltation` takes changes
through a contact, in four steps. The contact comes at another time. At that time the states are
changed by more, because they went on changing until then. The law answers other velocities, along a
normal that has turned. And the balls have been on their new paths for more or less time. The four
together are the saltation matrix

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

# x, y (m), vx, vy (m/s), ax, ay (m/s^2)
Motion6 = tuple[float, float, float, float, float, float]


class Saltation(NamedTuple):
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
        self, moved: Array, times: Array, parts: Array, rates: Sequence[Sequence[float]]
    ) -> Array:
        """Return the changes of the states after the contact, at a fixed time again.

        ``parts`` (M, P) are the changes of the velocities along normal and tangent after it, and
        ``rates`` the velocities and accelerations that the balls have then.
        """
        found = self.join @ parts
        turned = [part for vx, vy, _, _ in rates for part in (0.0, 0.0, -vy, vx)]
        found += np.array(turned)[:, np.newaxis] * (self.turning @ moved)
        for row in range(0, len(moved), 4):
            found[row : row + 2] = moved[row : row + 2]
        return np.asarray(found - np.array(rates).ravel()[:, np.newaxis] * times)


def hit(a: Motion6, b: Motion6) -> Saltation:
    """Return the meeting of two balls that move like this."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    turning = np.array([ny, -nx, 0.0, 0.0, -ny, nx, 0.0, 0.0]) / distance
    guard = np.array([-nx, -ny, 0.0, 0.0, nx, ny, 0.0, 0.0])
    closing = (a[2] - b[2]) * nx + (a[3] - b[3]) * ny
    return _meeting((a, b), (nx, ny), guard, closing, turning)


def bounce(a: Motion6, normal: Vector, curvature: float) -> Saltation:
    """Return the meeting of a ball with a cushion; ``normal`` points into the table.

    ``curvature`` (1/m) says how fast the normal turns as the ball moves along the side: 0 at a
    straight side, and one over the distance of the centres at a corner.
    """
    nx, ny = normal
    turning = curvature * np.array([-ny, nx, 0.0, 0.0])
    guard = np.array([nx, ny, 0.0, 0.0])
    return _meeting((a,), normal, guard, -(a[2] * nx + a[3] * ny), turning)


def _meeting(
    motions: Sequence[Motion6], normal: Vector, guard: Array, closing: float, turning: Array
) -> Saltation:
    nx, ny = normal
    count = len(motions)
    split, join = np.zeros((2 * count, 4 * count)), np.zeros((4 * count, 2 * count))
    spun: list[float] = []
    for k, (_, _, vx, vy, _, _) in enumerate(motions):
        split[2 * k, 4 * k + 2 : 4 * k + 4] = join[4 * k + 2 : 4 * k + 4, 2 * k] = normal
        split[2 * k + 1, 4 * k + 2 : 4 * k + 4] = join[4 * k + 2 : 4 * k + 4, 2 * k + 1] = (-ny, nx)
        spun += [vy * nx - vx * ny, -(vx * nx + vy * ny)]
    split += np.array(spun)[:, np.newaxis] * turning
    return Saltation(guard, closing, np.array(motions)[:, 2:].ravel(), turning, split, join)
