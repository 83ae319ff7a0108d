"""This module linearises contacts: how a small change before a contact becomes one after it.

A change is that of a ball's state (x, y, vx, vy) at a fixed time, so it lives on while the ball
moves on (:class:`~pool_pymunk.physics.surface.Surface`). A contact does four things to changes. It
comes at another time. At that time the states are changed by more, because they went on changing
until then. The law answers other velocities, along a normal that has turned. And the balls have
been on their new paths for more or less time. The four together are the saltation matrix

    S = R + (f_after - R f_before) G / (G f_before)

with the Jacobian R of what the contact does to the state, the rates of change f of the state before
and after it, and the gradient G of the gap (Kong, Payne, Zhu and Johnson, Saltation Matrices: The
Essential Tool for Linearizing Hybrid Dynamical Systems, Proceedings of the IEEE 112, 2024, 585).

The functions take each part of a change as one number, as numba compiles them, or as an array of
what P inputs do, as numpy has it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.surface import GYRATION

# Rounding moves a place by less than this share of its coordinates. An instant of the engine has
# the same bound (:func:`~pool_pymunk.engine.decisions.instant`).
BLUR = 256.0 * EPSILON
# A contact that closes more slowly than this share of the speeds is a graze. It sinks in by half
# the square of it, 5e-13 radii, so rounding may decide whether it comes at all.
GRAZE = 1e-6
# of the speeds (the root of rounding); a velocity farther off the law's answer is a policy's
AGREE = 1e-8
# A derivative (SI) beyond this means nothing in floating-point numbers. It is near the root of the
# largest number, so a square of it, or its product with what one contact does, does not overflow.
MOST = 1e150

# x, y (m), vx, vy (m/s), ax, ay (m/s^2)
Motion6 = tuple[float, float, float, float, float, float]
Part = Any  # of a change: a number, or an array (P,)
Change = Any  # four parts: of x, y, vx and vy


class Geometry(NamedTuple):
    """This is the geometry of a ball's contact with a cushion, or with another ball.

    ``normal`` points to the ball, from the cushion or from the other ball. ``curvature`` (1/m) says
    how fast it turns as the ball moves along. ``closing`` (m/s) is how fast the gap shrinks.
    Without a hit the two would sink into each other by ``depth`` (m) before they part again.
    """

    normal: Vector
    curvature: float
    closing: float
    depth: float


def hit(a: Motion6, b: Motion6) -> Geometry:
    """Return the geometry of a hit of two balls with these motions; its normal points to B."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.sqrt(dx * dx + dy * dy)
    relative = (dx, dy, b[2] - a[2], b[3] - a[3], b[4] - a[4], b[5] - a[5])
    return bounce(relative, (dx / distance, dy / distance), 1.0 / distance)


def bounce(motion: Motion6, normal: Vector, curvature: float) -> Geometry:
    """Return the geometry of a ball's contact, by its motion relative to what it meets.

    ``curvature`` (1/m) is 0 at a straight side, and one over the distance of the centres at a
    corner.
    """
    (_, _, vx, vy, ax, ay), (nx, ny) = motion, normal
    closing, across = -(vx * nx + vy * ny), vy * nx - vx * ny
    out = ax * nx + ay * ny + curvature * across * across
    depth = closing * closing / (2.0 * out) if out > 0.0 else math.inf
    return Geometry(normal, curvature, closing, depth)


def lateness(geometry: Geometry, x: Part, y: Part, gap: Part) -> Part:
    """Return how much later (s) the contact comes, by changes of the offset (m) and of the gap."""
    nx, ny = geometry.normal
    return (nx * x + ny * y + gap) / geometry.closing


def turning(geometry: Geometry, x: Part, y: Part) -> Part:
    """Return how far the normal turns (rad), by changes of the offset (m) at the contact."""
    nx, ny = geometry.normal
    return geometry.curvature * (nx * y - ny * x)


def at_contact(motion: Motion6, change: Change, late: Part) -> Change:
    """Return the change of a ball's state at the contact, which comes ``late`` (s)."""
    (_, _, vx, vy, ax, ay), (x, y, u, v) = motion, change
    return x + vx * late, y + vy * late, u + ax * late, v + ay * late


def parts_before(geometry: Geometry, velocity: Vector, u: Part, v: Part, turn: Part) -> Any:
    """Return the changes of a ball's velocity along the normal and along the tangent."""
    (nx, ny), (vx, vy) = geometry.normal, velocity
    n, t = vx * nx + vy * ny, vy * nx - vx * ny
    return nx * u + ny * v + t * turn, nx * v - ny * u - n * turn


def after(geometry: Geometry, rate: Any, place: Any, parts: Any, turn: Part, late: Part) -> Change:
    """Return the change of a ball's state after the contact, at a fixed time again.

    ``rate`` is the velocity and the acceleration that the ball has then. ``place`` is the change of
    its place at the contact, and ``parts`` that of its new velocity along normal and tangent.
    """
    (nx, ny), (vx, vy, ax, ay) = geometry.normal, rate
    (x, y), (n, t) = place, parts
    return (
        x - vx * late,
        y - vy * late,
        nx * n - ny * t - vy * turn - ax * late,
        ny * n + nx * t + vx * turn - ay * late,
    )


def begins_to_roll(before: Vector, after: Vector, u: Part, v: Part, late: Part) -> Any:
    """Return the change of the velocity, and so of the roll, of a ball that begins to roll.

    It does so ``late`` (s), and its acceleration changes then.
    """
    return u + (before[0] - after[0]) * late, v + (before[1] - after[1]) * late


def slowed_roll(
    geometry: Geometry, roll: Vector, w: Part, z: Part, turn: Part, most: float, of_most: Part
) -> Any:
    """Return the change of a ball's roll that a cushion slows, from that just before.

    The cushion takes ``most`` (m/s) off the part of the roll along its normal, which does not
    change its sign; ``of_most`` is the change of ``most``.
    """
    (nx, ny), (wx, wy) = geometry.normal, roll
    less, across = wx * nx + wy * ny, wy * nx - wx * ny
    of_less = nx * w + ny * z + across * turn
    if most <= abs(less):
        sign = 1.0 if less > 0.0 else -1.0
        less, of_less = sign * most, sign * of_most
    return w - nx * of_less + ny * less * turn, z - ny * of_less - nx * less * turn


def most_of_roll(mu: float, push: float, of_mu: Part, of_push: Part) -> Any:
    """Return how much of a roll (m/s) a ``push`` (m/s) of a cushion takes, and its change."""
    return mu * push / GYRATION, (mu * of_push + of_mu * push) / GYRATION


# -- what rounding decides -------------------------------------------------------------------------


def is_now(t: float, now: float, fastest: float, size: float, blur: float = BLUR) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of balls.

    ``fastest`` (m/s) is the largest part of a velocity, and ``size`` (m) that of a place.
    """
    return t == now or abs(t - now) * fastest < blur * (size * (fastest > 0.0) + now * fastest)
