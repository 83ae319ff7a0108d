"""A group of balls whose contacts persist moves by the forces that keep its gaps closed.

A contact that presses has a normal force N >= 0 and friction, up to mu N against its slip. A ball
rests, slips, or rolls. With f the push of a ball's contacts and c what cushions do to its roll,
both as accelerations, u = v - w its slip, and mu_s g and mu_r g the decelerations of its surface:

- A ball that slips: dv/dt = f - mu_s g u/|u|, dw/dt = c + (5/2) mu_s g u/|u|. A disc has w = 0.
- One that rolls: dv/dt = dw/dt = (5/7) f + (2/7) c - mu_r g v/|v| while (2/7) |f - c| <= mu_s g.
- One at rest stays while |(5/7) f + (2/7) c| <= mu_r g; a disc stays while |f| <= mu_s g.
- Two sides: N >= 0, the gap's acceleration is >= 0, and one of both is 0. The friction of a cushion
  also slows the roll into it by up to (5/2) mu N / m.

Where a slip is 0, friction holds it there as long as it can. All of these are one linear system for
the forces once it is known what presses, slips and rolls: the mode
(:mod:`pool_pymunk.physics.complementarity`).
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.physics.motion import Vector
from pool_pymunk.physics.pressed import REST, ROLL, SLIP, along_wall, look, size_of, wrings
from pool_pymunk.physics.surface import GYRATION, SHARE

NORMAL, ALONG, INTO = 0, 1, 2  # kinds of unknown forces: N, that holds a slip, that holds a roll
REDUNDANT = 1e-11  # A force is redundant if less than this share of its response is independent.


def find_forces(g: Any, s: Any) -> float:
    """Find the forces and the rates of a state; return how badly (m/s^2) they fit."""
    count, misfit = number_unknowns(g), 0.0
    fill_system(g, s, count)
    if count:
        misfit = solve(g, count, count)
        take_forces(g, s, count)
    return misfit


def fill_system(g: Any, s: Any, count: int) -> None:
    """Fill in the linear system for so many unknown forces, which are the last column."""
    look(g, s)
    for k in range(g.contacts):
        g.force[k][0] = g.force[k][1] = g.force[k][2] = 0.0
    find_rates(g, s)
    for p in range(count):
        g.matrix[p][count] = -residual(g, s, p)
    for q in range(count):
        fill_column(g, q, count)


def take_forces(g: Any, s: Any, count: int) -> None:
    """Take the forces from the last column of the system, and find the rates by them."""
    for q in range(count):
        k, kind = g.unknown[q]
        g.force[k][kind] = g.matrix[q][count] * g.unit[k]
    for k in range(g.contacts):
        if g.on[k]:
            if g.slides[k]:
                g.force[k][1] = -g.slides[k] * g.mu[k] * g.force[k][0]
            if g.into[k]:
                g.force[k][2] = -g.into[k] * g.mu[k] * g.force[k][0] / GYRATION
    find_rates(g, s)


def number_unknowns(g: Any) -> int:
    """List the unknown forces, and return their number."""
    count = 0
    for k in range(g.contacts):
        if not g.on[k]:
            continue
        for kind in (NORMAL, ALONG, INTO):
            is_held = kind == NORMAL
            if kind == ALONG:
                is_held = g.mu[k] > 0.0 and g.slides[k] == 0
            elif kind == INTO:
                is_held = wrings(g, k) and g.into[k] == 0 and g.phase[g.one[k]] != REST
            if is_held:
                g.unknown[count][0], g.unknown[count][1] = k, kind
                count += 1
    return count


def find_rates(g: Any, s: Any) -> None:
    """Find the pushes and the rates of all balls by the contacts' forces."""
    for i in range(g.balls):
        f = g.push[i]
        f[0] = f[1] = f[2] = f[3] = 0.0
    for k in range(g.contacts):
        if g.on[k]:
            normal, along, into = g.force[k][0], g.force[k][1], g.force[k][2]
            nx, ny = g.normal[k][0], g.normal[k][1]
            x, y = normal * nx - along * ny, normal * ny + along * nx
            i, j = g.one[k], g.other[k]
            f, m = g.push[i], g.mass[i]
            if j >= 0:
                f[0] -= x / m
                f[1] -= y / m
                f, m = g.push[j], g.mass[j]
                f[0] += x / m
                f[1] += y / m
            else:
                f[0] += x / m
                f[1] += y / m
                f[2] += into / m * nx
                f[3] += into / m * ny
    for i in range(g.balls):
        find_rate(g, s, i)


def find_rate(g: Any, s: Any, i: int) -> None:
    """Find the rate of one ball's state."""
    p, d, f = 6 * i, g.rate, g.push[i]
    fx, fy, cx, cy = f[0], f[1], f[2], f[3]
    vx, vy = s[p + 2], s[p + 3]
    if g.phase[i] == REST:
        d[p] = d[p + 1] = d[p + 2] = d[p + 3] = d[p + 4] = d[p + 5] = 0.0
        return
    d[p], d[p + 1] = vx, vy
    if is_own(g):
        ax, ay = own_pull(g, s, p)
        d[p + 2], d[p + 3] = fx + ax, fy + ay
        d[p + 4], d[p + 5] = cx, cy
        return
    if g.phase[i] == SLIP:
        ux, uy = vx - s[p + 4], vy - s[p + 5]
        share = holding(g.pull[i], ux, uy)
        d[p + 2], d[p + 3] = fx - share * ux, fy - share * uy
        spun = share / GYRATION if g.rolls else 0.0
        d[p + 4], d[p + 5] = cx + spun * ux, cy + spun * uy
        return
    share = holding(g.drag[i], vx, vy)
    d[p + 2] = d[p + 4] = (1.0 - SHARE) * fx + SHARE * cx - share * vx
    d[p + 3] = d[p + 5] = (1.0 - SHARE) * fy + SHARE * cy - share * vy


def is_own(g: Any) -> bool:
    """Tell whether the surface is a user's own."""
    return g.own is not None


def own_pull(g: Any, s: Any, p: int) -> Vector:
    """Return the acceleration (m/s^2) that a user's own surface gives a ball without contacts."""
    path = g.own.path(0.0, (s[p], s[p + 1]), (s[p + 2], s[p + 3]), (s[p + 4], s[p + 5]))
    return path.ax, path.ay


def holding(most: Any, x: Any, y: Any) -> Any:
    """Return what share (1/s) of a velocity friction of this size (m/s^2) takes off, if any."""
    speed = size_of(x, y)
    return most / (speed + (speed == 0.0))


def opening_rate(g: Any, k: int) -> Any:
    """Return the acceleration (m/s^2) at which a gap opens."""
    along = along_wall(g, k)
    turns = g.bend[k] * along * along + g.spin[k][0]
    return rate_along(g, k, g.normal[k][0], g.normal[k][1]) + turns


def rate_along(g: Any, k: int, x: Any, y: Any) -> Any:
    """Return the relative acceleration (m/s^2) of two sides along a direction."""
    i, d = 6 * g.one[k], g.rate
    along = d[i + 2] * x + d[i + 3] * y
    if g.other[k] < 0:
        return along
    j = 6 * g.other[k]
    return d[j + 2] * x + d[j + 3] * y - along


def residual(g: Any, s: Any, p: int) -> Any:
    """Return what an unknown force must bring to 0 (m/s^2), at the present rates."""
    k, kind = g.unknown[p]
    nx, ny = g.normal[k][0], g.normal[k][1]
    if kind == NORMAL:
        return opening_rate(g, k)
    if kind == ALONG:
        return rate_along(g, k, -ny, nx) + g.spin[k][1]
    i = g.one[k]
    if g.phase[i] == ROLL:
        f = g.push[i]
        fx, fy, cx, cy = f[0], f[1], f[2], f[3]
        return (cx - fx) * nx + (cy - fy) * ny
    b = 6 * i
    turning = g.bend[k] * along_wall(g, k) + g.drift[k][3]
    turning *= s[b + 5] * nx - s[b + 4] * ny
    return g.rate[b + 4] * nx + g.rate[b + 5] * ny + turning


def fill_column(g: Any, q: int, count: int) -> None:
    """Fill in what an unknown force of unit size adds to each residual."""
    k, kind = g.unknown[q]
    nx, ny = g.normal[k][0], g.normal[k][1]
    unit, mu = g.unit[k], g.mu[k]
    normal, along, into = 1.0 * (kind == NORMAL), 1.0 * (kind == ALONG), 1.0 * (kind == INTO)
    if kind == NORMAL:
        along, into = -g.slides[k] * mu, -g.into[k] * mu / GYRATION
    x, y = unit * (normal * nx - along * ny), unit * (normal * ny + along * nx)
    i, j = g.one[k], g.other[k]
    m = g.mass[i] if j < 0 else -g.mass[i]
    fx, fy, cx, cy = x / m, y / m, unit * into / g.mass[i] * nx, unit * into / g.mass[i] * ny
    for p in range(count):
        g.matrix[p][q] = 0.0
        one, other = g.one[g.unknown[p][0]], g.other[g.unknown[p][0]]
        if one == i:
            g.matrix[p][q] += reply(g, p, i, -1.0 if other >= 0 else 1.0, (fx, fy, cx, cy))
        elif other == i:
            g.matrix[p][q] += reply(g, p, i, 1.0, (fx, fy, cx, cy))
        if j >= 0 and (one == j or other == j):
            sign = 1.0 if other == j else (-1.0 if other >= 0 else 1.0)
            m_j = g.mass[j]
            g.matrix[p][q] += reply(g, p, j, sign, (x / m_j, y / m_j, 0.0, 0.0))


def reply(g: Any, p: int, i: int, sign: float, push: Any) -> Any:
    """Return what a push on ball i adds to a residual, in which the ball has this sign."""
    fx, fy, cx, cy = push
    k, kind = g.unknown[p]
    nx, ny = g.normal[k][0], g.normal[k][1]
    phase = g.phase[i]
    if phase == REST:
        return 0.0
    if kind == INTO:
        if phase == ROLL:
            return (cx - fx) * nx + (cy - fy) * ny
        return cx * nx + cy * ny
    if phase == ROLL:
        fx, fy = (1.0 - SHARE) * fx + SHARE * cx, (1.0 - SHARE) * fy + SHARE * cy
    if kind == ALONG:
        return sign * (fy * nx - fx * ny)
    return sign * (fx * nx + fy * ny)


def solve(g: Any, count: int, last: int) -> float:
    """Solve linear systems of one matrix in place, for the columns from ``count`` to ``last``.

    Each of them becomes the solution of least norm. Return the largest number that redundant rows
    leave, which is 0 where the systems have solutions.
    """
    rank, misfit = eliminate(g, count, last), 0.0
    for side in range(count, last + 1):
        for q in range(count):
            g.found[q] = 0.0
        for p in range(count):
            if p < rank:
                g.found[g.column[p]] = g.matrix[p][side]
            else:
                misfit = max(misfit, abs(g.matrix[p][side]))
        if rank < count:
            least_norm(g, count, rank)
        for q in range(count):
            g.matrix[q][side] = g.found[q]
    return misfit


def eliminate(g: Any, count: int, last: int) -> int:
    """Eliminate forces row by row (Gauss and Jordan); return the number of independent ones.

    ``column`` becomes the pivot's column of each row, and ``last`` is the last column of all.
    """
    rank = 0
    for q in range(count):
        best, size = -1, REDUNDANT
        for p in range(rank, count):
            if abs(g.matrix[p][q]) > size:
                best, size = p, abs(g.matrix[p][q])
        if best < 0:
            continue
        row = g.matrix[rank]
        if best != rank:
            exchange(row, g.matrix[best], q, last)
        pivot = row[q]
        for m in range(q, last + 1):
            row[m] /= pivot
        for p in range(count):
            if p != rank and g.matrix[p][q] != 0.0:
                take_off(g.matrix[p], row, g.matrix[p][q], q, last)
        g.column[rank] = q
        rank += 1
    return rank


def exchange(one: Any, other: Any, first: int, last: int) -> None:
    """Exchange the numbers of two rows between two columns."""
    for m in range(first, last + 1):
        kept = one[m]
        one[m] = other[m]
        other[m] = kept


def take_off(other: Any, row: Any, part: float, first: int, last: int) -> None:
    """Take a part of a row off another one, between two columns."""
    for m in range(first, last + 1):
        if row[m] != 0.0:
            other[m] -= part * row[m]


def least_norm(g: Any, count: int, rank: int) -> None:
    """Take from a solution what lies along forces that change nothing."""
    kept = 0
    for q in range(count):
        is_pivot = False
        for p in range(rank):
            is_pivot |= g.column[p] == q
        if is_pivot:
            continue
        free = g.free[kept]
        for p in range(count):
            free[p] = 0.0
        free[q] = 1.0
        for p in range(rank):
            free[g.column[p]] = -g.matrix[p][q]
        for other in range(kept):
            take_away(free, g.free[other], count)
        kept += 1
        take_away(g.found, free, count)


def take_away(found: Any, other: Any, count: int) -> None:
    """Take the part along another vector from one."""
    along = square = 0.0
    for q in range(count):
        along += found[q] * other[q]
        square += other[q] * other[q]
    for q in range(count):
        found[q] -= along / square * other[q]
