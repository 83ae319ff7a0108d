"""This module linearises contacts: how a small change before a contact becomes one after it.

A change is that of the balls' states at a fixed time, so it lives on while the balls move on. A
contact does four things to changes. It comes at another time. At that time the states are changed
by more, because they went on changing until then. The law answers other velocities, along a normal
that has turned. And the balls have been on their new paths for more or less time. The four together
are the saltation matrix

    S = R + (f_after - R f_before) G / (G f_before)

with the Jacobian R of what the contact does to the state, the rates of change f of the state before
and after it, and the gradient G of the gap (Kong, Payne, Zhu and Johnson, Saltation Matrices: The
Essential Tool for Linearizing Hybrid Dynamical Systems, Proceedings of the IEEE 112, 2024, 585).

A state has K numbers: place, velocity, and the roll if balls roll. The matrix of C balls has C K
rows. Its columns are those of the states, and then of a gap that is closed too late (m), of a
normal that is turned (rad), and of the numbers that the law is asked with.
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

NUMBERS = 4  # The law is asked with so many at most: two masses, restitution and friction.
GAP, TURN, LAW, MORE = 0, 1, 2, 2 + NUMBERS  # the columns after those of the states

# x, y (m), vx, vy (m/s), ax, ay (m/s^2)
Motion6 = tuple[float, float, float, float, float, float]


class Geometry(NamedTuple):
    """This is the geometry of a ball's contact with a cushion, or with another ball.

    ``normal`` points to the ball, from the cushion or from the other ball. ``curvature`` (1/m) says
    how fast it turns as the ball moves along. ``closing`` (m/s) is how fast the gap shrinks, and
    ``slip`` how fast the ball moves along. Without a hit the two would sink into each other by
    ``depth`` (m) before they part again.
    """

    normal: Vector
    curvature: float
    closing: float
    slip: float
    depth: float


def meeting(a: Motion6, b: Motion6) -> Geometry:
    """Return the geometry of a hit of two balls with these motions; its normal points to B."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.sqrt(dx * dx + dy * dy)
    relative = (dx, dy, b[2] - a[2], b[3] - a[3], b[4] - a[4], b[5] - a[5])
    return touching(relative, (dx / distance, dy / distance), 1.0 / distance)


def touching(motion: Motion6, normal: Vector, curvature: float) -> Geometry:
    """Return the geometry of a ball's contact, by its motion relative to what it meets.

    ``curvature`` (1/m) is 0 at a straight side, and one over the distance of the centres at a
    corner.
    """
    (_, _, vx, vy, ax, ay), (nx, ny) = motion, normal
    closing, slip = -(vx * nx + vy * ny), vy * nx - vx * ny
    out = ax * nx + ay * ny + curvature * slip * slip
    depth = closing * closing / (2.0 * out) if out > 0.0 else math.inf
    return Geometry(normal, curvature, closing, slip, depth)


def saltation_matrix(g: Any, geometry: Geometry, balls: int, roll: Vector) -> list[list[float]]:
    """Return the saltation matrix of a contact; ``roll`` (m/s) is that of a ball at a cushion.

    ``g.one.before`` and ``g.one.after`` (C K) are the rates of change of the states.
    """
    size, ((nx, ny), curvature, closing, slip, _) = len(g.change[0]), geometry
    rows = balls * size
    m = [[0.0] * (rows + MORE) for _ in range(rows)]
    respond(g, m, geometry, balls)
    if size > 4 and balls == 1:
        slow_roll(g, m, geometry, roll)
    for row, after in zip(m, g.one.after, strict=False):
        turn = row[rows + TURN] * curvature
        kept = sum([a * b for a, b in zip(row[:rows], g.one.before, strict=False)])
        late = (kept + turn * slip - after) / closing  # G f_before is -closing.
        x, y = late * nx - turn * ny, late * ny + turn * nx
        row[rows + GAP] = late
        row[rows - size] += x
        row[rows - size + 1] += y
        if balls == 2:
            row[0] -= x
            row[1] -= y
    return m


def respond(g: Any, m: Any, geometry: Geometry, balls: int) -> None:
    """Write the Jacobian R of what a contact does to the states into a matrix of zeros.

    ``g.one.slopes[0]`` (2 C, 2 C + 4) are the derivatives of the law's answer.
    """
    rows, size, law, (nx, ny) = len(m), len(m) // balls, g.one.slopes[0], geometry.normal
    for k in range(rows):
        if k % size < 2 or k % size >= 4:
            m[k][k] = 1.0
    for c in range(balls):
        n, t = law[2 * c], law[2 * c + 1]
        x, y = m[c * size + 2], m[c * size + 3]
        turned_n = turned_t = 0.0
        for d in range(balls):
            j, vx, vy = d * size + 2, g.one.before[d * size], g.one.before[d * size + 1]
            xn, xt = nx * n[2 * d] - ny * t[2 * d], nx * n[2 * d + 1] - ny * t[2 * d + 1]
            yn, yt = ny * n[2 * d] + nx * t[2 * d], ny * n[2 * d + 1] + nx * t[2 * d + 1]
            x[j], x[j + 1], y[j], y[j + 1] = (
                xn * nx - xt * ny, xn * ny + xt * nx, yn * nx - yt * ny, yn * ny + yt * nx
            )  # fmt: skip
            along, across = vx * nx + vy * ny, vy * nx - vx * ny
            turned_n += n[2 * d] * across - n[2 * d + 1] * along
            turned_t += t[2 * d] * across - t[2 * d + 1] * along
        x[rows + TURN] = nx * turned_n - ny * turned_t - g.one.after[c * size + 1]
        y[rows + TURN] = ny * turned_n + nx * turned_t + g.one.after[c * size]
        for k in range(2 * balls):
            j = rows + LAW + k
            by_n, by_t = n[2 * balls + k], t[2 * balls + k]
            x[j], y[j] = nx * by_n - ny * by_t, ny * by_n + nx * by_t


def slow_roll(g: Any, m: Any, geometry: Geometry, roll: Vector) -> None:
    """Write into R how a cushion slows down a roll."""
    rows, law, (nx, ny), (wx, wy) = len(m), g.one.slopes[0], geometry.normal, roll
    taken, of_roll, of_push, of_mu = taken_off(g, geometry, roll)
    by_n, by_t, (vx, vy) = of_push * (law[0][0] - 1.0), of_push * law[0][1], g.one.before[:2]
    put_slower(m, geometry, rows - 2, of_roll * nx, of_roll * ny)
    put_slower(m, geometry, 2, nx * by_n - ny * by_t, ny * by_n + nx * by_t)
    put_slower(m, geometry, rows + LAW, of_push * law[0][2], of_mu + of_push * law[0][3])
    turn = of_roll * (wy * nx - wx * ny) + by_n * (vy * nx - vx * ny) - by_t * (vx * nx + vy * ny)
    m[4][rows + TURN], m[5][rows + TURN] = ny * taken - nx * turn, -nx * taken - ny * turn


def taken_off(g: Any, geometry: Geometry, roll: Vector) -> tuple[float, float, float, float]:
    """Return what (m/s) a cushion takes off the part of a roll along its normal.

    It takes (5/2) mu |v_n' - v_n|, but does not change the sign of this part. The other numbers are
    the derivatives by this part, by v_n' - v_n, and by mu.
    """
    (nx, ny), before, after, mu = geometry.normal, g.one.before, g.one.after, g.one.asked[3]
    push = (after[0] - before[0]) * nx + (after[1] - before[1]) * ny
    part = roll[0] * nx + roll[1] * ny
    most, sign = mu * push / GYRATION, math.copysign(1.0 / GYRATION, part)
    if most > abs(part):  # All of it goes.
        return part, 1.0, 0.0, 0.0
    return math.copysign(most, part), 0.0, sign * mu, sign * push


def put_slower(m: Any, geometry: Geometry, column: int, one: float, other: float) -> None:
    """Take a part along the normal off a roll: it is so many times these two columns."""
    nx, ny = geometry.normal
    m[4][column] -= nx * one
    m[4][column + 1] -= nx * other
    m[5][column] -= ny * one
    m[5][column + 1] -= ny * other


def is_now(t: float, now: float, fastest: float, size: float, blur: float = BLUR) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of balls.

    ``fastest`` (m/s) is the largest part of a velocity, and ``size`` (m) that of a place.
    """
    return t == now or abs(t - now) * fastest < blur * (size * (fastest > 0.0) + now * fastest)
