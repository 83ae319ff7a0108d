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
the forces once it is known what presses, slips and rolls: the mode, which :func:`decide` finds. The
functions are loops over the numbers of a :class:`Press`, of which Python has lists. A state is a
row of six numbers a ball: x, y (m), vx, vy, wx, wy (m/s).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from pool_pymunk.physics.surface import GYRATION, SHARE, Rolling, Sliding

REST, SLIP, ROLL = 0, 1, 2  # phases of a ball
FLAT, ROUND, BALL = 0, 1, 2  # what a ball touches
NORMAL, ALONG, INTO = 0, 1, 2  # kinds of unknown forces: N, that holds a slip, that holds a roll

# of the largest speed and acceleration of a group: smaller ones are none
SLOW, WEAK = 1e-13, 1e-12
TINY = 1e-8  # of the largest speed; slower slips at the beginning are none
NEAR = 1e-9  # of a contact's size; sides that are nearer touch
REDUNDANT = 1e-11  # A force is redundant if less than this share of its response is independent.
EXCHANGES = 20  # This many changes of what presses, slips and rolls are tried for each contact.

# A press has a surface of a user's `own`, or None, which tells how balls without contacts are
# accelerated; else `pull` and `drag` tell it, and whether it `rolls` balls. `small` has the speed
# and the acceleration below which there is none, and a factor of all tolerances. Each ball has its
# `mass` (kg), `radius` (m), `phase`, and as `push` its f and c (m/s^2); `rate` is the change of the
# state. A ball is `stuck` that other balls and walls hold at rest, because it came back to rest as
# soon as it was let go. Each contact has its balls `one` and `other` (-1 for a wall), `what` is
# touched, its friction `mu`, and its `shape`: of two balls the sum of their radii (m); of a flat
# wall its normal, the height of a touching ball's centre along it, and its ends along the tangent
# (m); of a round one its center, 1 or -1 for balls that are outside or inside, the distance of the
# centres (m), and the directions of its ends, if it has any, counter-clockwise. `unit` (kg) is that
# of its forces, in which its own response is about 1. `over` tells whether its side has ended, and
# `on` whether it presses; `slides` and `into` have the signs of its slip and of the roll into a
# cushion, 0 where friction holds them. `force` (N) has N, the friction along the tangent, and what
# slows the roll. `normal`, `bend` (1/m) and `slip` (m/s) are those of the present state. `unknown`
# and `matrix` are the linear system.
Press = namedtuple(
    "Press",
    "own pull drag rolls small mass radius phase stuck push rate one other what mu shape unit over "
    "on slides into force normal bend slip unknown matrix",
)


def press_of(surface: Any, mass: Any, radius: Any, contacts: Any) -> Press:
    """Return the press of balls of these masses (kg) and radii (m) on a surface.

    ``contacts`` has (one, other, what, mu, shape) of each contact.
    """
    n, count = len(mass), len(contacts)
    one, other, what, mu, shape = (list(part) for part in zip(*contacts, strict=True))
    most = 3 * count
    own, drag = None, surface.drag if surface.rolls else surface.pull
    if not isinstance(surface, Sliding | Rolling):
        own = surface.own if isinstance(surface, Press) else surface
    unit = [
        mass[i] if j < 0 else mass[i] * mass[j] / (mass[i] + mass[j])
        for i, j in zip(one, other, strict=True)
    ]
    rows = [[0.0] * (most + 1) for _ in range(most)]
    return Press(
        own, surface.pull, drag, surface.rolls, [0.0, 0.0, 1.0], list(mass), list(radius),
        [REST] * n, [False] * n, [[0.0] * 4 for _ in range(n)], [0.0] * (6 * n),
        one, other, what, mu, shape, unit, [False] * count, [True] * count,
        [0] * count, [0] * count, [[0.0] * 3 for _ in range(count)],
        [[0.0] * 2 for _ in range(count)], [0.0] * count, [0.0] * count,
        [[0] * 2 for _ in range(most)], rows,
    )  # fmt: skip


def part_of(g: Any, balls: Any, contacts: Any) -> Press:
    """Return the press of some of the balls and contacts, in the same mode."""
    number = {i: k for k, i in enumerate(balls)}
    rows = [
        (number[g.one[k]], number.get(g.other[k], -1), g.what[k], g.mu[k], g.shape[k])
        for k in contacts
    ]
    part = press_of(g, [g.mass[i] for i in balls], [g.radius[i] for i in balls], rows)
    for m, k in enumerate(contacts):
        part.on[m], part.over[m] = g.on[k], g.over[k]
        part.slides[m], part.into[m] = g.slides[k], g.into[k]
    part.phase[:] = [g.phase[i] for i in balls]
    part.stuck[:] = [g.stuck[i] for i in balls]
    part.small[:] = g.small
    return part


# -- geometry ----------------------------------------------------------------------------------


def gap_of(g: Any, s: Any, k: int) -> float:
    """Return the gap (m) of a contact."""
    i, shape = 6 * g.one[k], g.shape[k]
    if g.what[k] == FLAT:
        return float(s[i] * shape[0] + s[i + 1] * shape[1] - shape[2])
    if g.what[k] == BALL:
        j = 6 * g.other[k]
        dx, dy = s[j] - s[i], s[j + 1] - s[i + 1]
        return math.sqrt(dx * dx + dy * dy) - float(shape[0])
    dx, dy = s[i] - shape[0], s[i + 1] - shape[1]
    return float(shape[2]) * (math.sqrt(dx * dx + dy * dy) - float(shape[3]))


def look(g: Any, s: Any) -> None:
    """Find the normal, the bend and the slip of each contact."""
    for k in range(len(g.one)):
        i, shape, n = 6 * g.one[k], g.shape[k], g.normal[k]
        u, v = s[i + 2], s[i + 3]
        if g.what[k] == FLAT:
            n[0], n[1], g.bend[k] = shape[0], shape[1], 0.0
            g.slip[k] = v * n[0] - u * n[1]
            continue
        if g.what[k] == BALL:
            j = 6 * g.other[k]
            x, y, facing = s[j] - s[i], s[j + 1] - s[i + 1], 1.0
            u, v = s[j + 2] - u, s[j + 3] - v
        else:
            x, y, facing = s[i] - shape[0], s[i + 1] - shape[1], shape[2]
        distance = math.sqrt(x * x + y * y)
        n[0], n[1], g.bend[k] = facing * x / distance, facing * y / distance, facing / distance
        g.slip[k] = v * n[0] - u * n[1]


def opening(g: Any, s: Any, k: int) -> float:
    """Return the speed (m/s) at which the two sides part."""
    i, n = 6 * g.one[k], g.normal[k]
    along = float(s[i + 2] * n[0] + s[i + 3] * n[1])
    if g.other[k] < 0:
        return along
    j = 6 * g.other[k]
    return float(s[j + 2] * n[0] + s[j + 3] * n[1]) - along


def roll_into(g: Any, s: Any, k: int) -> float:
    """Return the part of the roll (m/s) along the normal of a wall."""
    i, n = 6 * g.one[k], g.normal[k]
    return float(s[i + 4] * n[0] + s[i + 5] * n[1])


def wrings(g: Any, k: int) -> bool:
    """Tell whether a contact's friction slows a roll."""
    return bool(g.rolls) and g.other[k] < 0 and g.mu[k] > 0.0


# -- forces ------------------------------------------------------------------------------------


def find_forces(g: Any, s: Any) -> float:
    """Find the forces and the rates of a state; return how badly (m/s^2) they fit."""
    look(g, s)
    count = number_unknowns(g)
    for k in range(len(g.one)):
        g.force[k][0] = g.force[k][1] = g.force[k][2] = 0.0
    find_rates(g, s)
    misfit = 0.0
    if count:
        for p in range(count):
            g.matrix[p][count] = -residual(g, s, p)
        for q in range(count):
            fill_column(g, q, count)
        misfit = solve(g.matrix, count)
        for q in range(count):
            k, kind = g.unknown[q]
            g.force[k][kind] = g.matrix[q][count] * g.unit[k]
        for k in range(len(g.one)):
            if g.on[k]:
                if g.slides[k]:
                    g.force[k][1] = -g.slides[k] * g.mu[k] * g.force[k][0]
                if g.into[k]:
                    g.force[k][2] = -g.into[k] * g.mu[k] * g.force[k][0] / GYRATION
        find_rates(g, s)
    return misfit


def number_unknowns(g: Any) -> int:
    """List the unknown forces, and return their number."""
    count = 0
    for k in range(len(g.one)):
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
    for i in range(len(g.mass)):
        f = g.push[i]
        f[0] = f[1] = f[2] = f[3] = 0.0
    for k in range(len(g.one)):
        if g.on[k]:
            normal, along, into = g.force[k]
            nx, ny = g.normal[k]
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
    for i in range(len(g.mass)):
        find_rate(g, s, i)


def find_rate(g: Any, s: Any, i: int) -> None:
    """Find the rate of one ball's state."""
    p, (fx, fy, cx, cy), d = 6 * i, g.push[i], g.rate
    vx, vy = s[p + 2], s[p + 3]
    if g.phase[i] == REST:
        d[p] = d[p + 1] = d[p + 2] = d[p + 3] = d[p + 4] = d[p + 5] = 0.0
        return
    d[p], d[p + 1] = vx, vy
    if g.own is not None:
        path = g.own.path(0.0, (s[p], s[p + 1]), (vx, vy), (s[p + 4], s[p + 5]))
        d[p + 2], d[p + 3] = fx + path.ax, fy + path.ay
        d[p + 4], d[p + 5] = cx, cy
        return
    if g.phase[i] == SLIP:
        ux, uy = vx - s[p + 4], vy - s[p + 5]
        share = holding(g.pull, ux, uy)
        d[p + 2], d[p + 3] = fx - share * ux, fy - share * uy
        spun = share / GYRATION if g.rolls else 0.0
        d[p + 4], d[p + 5] = cx + spun * ux, cy + spun * uy
        return
    share = holding(g.drag, vx, vy)
    d[p + 2] = d[p + 4] = (1.0 - SHARE) * fx + SHARE * cx - share * vx
    d[p + 3] = d[p + 5] = (1.0 - SHARE) * fy + SHARE * cy - share * vy


def holding(most: float, x: float, y: float) -> float:
    """Return what share (1/s) of a velocity friction of this size (m/s^2) takes off; 0 of none."""
    speed = math.sqrt(x * x + y * y)
    return most / speed if speed > 0.0 else 0.0


def opening_rate(g: Any, k: int) -> float:
    """Return the acceleration (m/s^2) at which a gap opens."""
    turns = float(g.bend[k] * g.slip[k] * g.slip[k])
    return rate_along(g, k, g.normal[k][0], g.normal[k][1]) + turns


def rate_along(g: Any, k: int, x: float, y: float) -> float:
    """Return the relative acceleration (m/s^2) of two sides along a direction."""
    i, d = 6 * g.one[k], g.rate
    along = float(d[i + 2] * x + d[i + 3] * y)
    if g.other[k] < 0:
        return along
    j = 6 * g.other[k]
    return float(d[j + 2] * x + d[j + 3] * y) - along


def residual(g: Any, s: Any, p: int) -> float:
    """Return what an unknown force must bring to 0 (m/s^2), at the present rates."""
    k, kind = g.unknown[p]
    nx, ny = g.normal[k]
    if kind == NORMAL:
        return opening_rate(g, k)
    if kind == ALONG:
        return rate_along(g, k, -ny, nx)
    i = g.one[k]
    if g.phase[i] == ROLL:
        fx, fy, cx, cy = g.push[i]
        return float((cx - fx) * nx + (cy - fy) * ny)
    b = 6 * i
    turning = g.bend[k] * g.slip[k] * (s[b + 5] * nx - s[b + 4] * ny)
    return float(g.rate[b + 4] * nx + g.rate[b + 5] * ny + turning)


def fill_column(g: Any, q: int, count: int) -> None:
    """Fill in what an unknown force of unit size adds to each residual."""
    k, kind = g.unknown[q]
    nx, ny = g.normal[k]
    unit, mu = g.unit[k], g.mu[k]
    normal, along, into = float(kind == NORMAL), float(kind == ALONG), float(kind == INTO)
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


def reply(g: Any, p: int, i: int, sign: float, push: Any) -> float:
    """Return what a push on ball i adds to a residual, in which the ball has this sign."""
    fx, fy, cx, cy = push
    k, kind = g.unknown[p]
    nx, ny = g.normal[k]
    phase = g.phase[i]
    if phase == REST:
        return 0.0
    if kind == INTO:
        if phase == ROLL:
            return float((cx - fx) * nx + (cy - fy) * ny)
        return float(cx * nx + cy * ny)
    if phase == ROLL:
        fx, fy = (1.0 - SHARE) * fx + SHARE * cx, (1.0 - SHARE) * fy + SHARE * cy
    if kind == ALONG:
        return float(sign * (fy * nx - fx * ny))
    return float(sign * (fx * nx + fy * ny))


def solve(matrix: Any, count: int) -> float:
    """Solve a linear system in place; its last column becomes the solution of least norm.

    Return the largest number that redundant rows leave, which is 0 where the system has a solution.
    """
    column = [-1] * count  # the pivot's column of each row
    rank = eliminate(matrix, count, column)
    found, misfit = [0.0] * count, 0.0
    for p in range(count):
        if p < rank:
            found[column[p]] = matrix[p][count]
        else:
            misfit = max(misfit, abs(matrix[p][count]))
    if rank < count:
        least_norm(matrix, count, rank, column, found)
    for q in range(count):
        matrix[q][count] = found[q]
    return misfit


def eliminate(matrix: Any, count: int, column: Any) -> int:
    """Eliminate forces row by row (Gauss and Jordan); return the number of independent ones."""
    rank = 0
    for q in range(count):
        best, size = -1, REDUNDANT
        for p in range(rank, count):
            if abs(matrix[p][q]) > size:
                best, size = p, abs(matrix[p][q])
        if best < 0:
            continue
        matrix[rank], matrix[best] = matrix[best], matrix[rank]
        row, pivot = matrix[rank], matrix[rank][q]
        for m in range(q, count + 1):
            row[m] /= pivot
        for p in range(count):
            if p != rank and matrix[p][q] != 0.0:
                take_off(matrix[p], row, matrix[p][q], q, count)
        column[rank] = q
        rank += 1
    return rank


def take_off(other: Any, row: Any, part: float, first: int, last: int) -> None:
    """Take a part of a row off another one, between two columns."""
    for m in range(first, last + 1):
        if row[m] != 0.0:
            other[m] -= part * row[m]


def least_norm(matrix: Any, count: int, rank: int, column: Any, found: Any) -> None:
    """Take from a solution what lies along forces that change nothing."""
    kept: list[list[float]] = []
    for q in range(count):
        if q in column[:rank]:
            continue
        free = [0.0] * count
        free[q] = 1.0
        for p in range(rank):
            free[column[p]] = -matrix[p][q]
        for other in kept:
            take_away(free, other, count)
        kept.append(free)
        take_away(found, free, count)


def take_away(found: Any, other: Any, count: int) -> None:
    """Take the part along another vector from one."""
    along = square = 0.0
    for q in range(count):
        along += found[q] * other[q]
        square += other[q] * other[q]
    for q in range(count):
        found[q] -= along / square * other[q]


# -- what presses, slips and rolls ---------------------------------------------------------------


def begin(g: Any, s: Any) -> None:
    """Guess the mode of a state: everything that could be held is held."""
    set_phases(g, s)
    look(g, s)
    for k in range(len(g.one)):
        freshen(g, s, k)


def set_scale(g: Any, s: Any) -> None:
    """Set the speed and the acceleration below which there is none."""
    fastest = 0.0
    strongest = max(g.pull, g.drag)
    for number in range(len(g.mass)):
        p = 6 * number
        fastest = max(fastest, size_of(s[p + 2], s[p + 3]), size_of(s[p + 4], s[p + 5]))
    look(g, s)
    for k in range(len(g.one)):
        strongest = max(strongest, abs(g.bend[k]) * g.slip[k] * g.slip[k])
    fastest = max(fastest, math.sqrt(strongest * min(g.radius)))
    g.small[0], g.small[1] = SLOW * fastest, WEAK * strongest


def set_phases(g: Any, s: Any) -> None:
    """Set the phases of balls; tiny slips and speeds are none."""
    fastest = g.small[0] / SLOW
    for i in range(len(g.mass)):
        p, g.phase[i] = 6 * i, phase_of(g, s, i, TINY * g.small[2] * fastest)
        if g.phase[i] == ROLL:
            for q in (p + 2, p + 3):
                s[q] = s[q + 2] = (1.0 - SHARE) * s[q] + SHARE * s[q + 2]
        elif g.phase[i] == REST:
            s[p + 2] = s[p + 3] = s[p + 4] = s[p + 5] = 0.0


def phase_of(g: Any, s: Any, i: int, least: float) -> int:
    """Return the phase of a ball; slower slips and speeds than ``least`` (m/s) are none."""
    p = 6 * i
    vx, vy, wx, wy = s[p + 2], s[p + 3], s[p + 4], s[p + 5]
    if g.own is not None:
        return SLIP
    if size_of(vx, vy) <= least and size_of(wx, wy) <= least:
        return REST
    return ROLL if g.rolls and size_of(vx - wx, vy - wy) <= least else SLIP


def freshen(g: Any, s: Any, k: int) -> None:
    """Let a contact press, with the signs of its slip and of the roll into it."""
    g.on[k] = True
    g.slides[k] = sign(g.slip[k], g.small[0]) if g.mu[k] > 0.0 else 0
    g.into[k] = sign(roll_into(g, s, k), g.small[0]) if wrings(g, k) else 0


def size_of(x: float, y: float) -> float:
    """Return the length of a vector; a square root has the same bits on every machine."""
    return math.sqrt(x * x + y * y)


def sign(x: float, least: float) -> int:
    """Return the sign of a number, or 0 if it is not larger than ``least``."""
    return 0 if abs(x) <= least else (1 if x > 0.0 else -1)


def touches(g: Any, s: Any, k: int) -> bool:
    """Tell whether two sides touch and do not part."""
    if g.over[k] or gap_of(g, s, k) > NEAR * g.radius[g.one[k]] or leaves(g, s, k):
        return False
    return bool(opening(g, s, k) <= 10.0 * g.small[0])


def room(g: Any, s: Any, k: int) -> float:
    """Return how far (m) a ball is from the nearer end of the side that it touches."""
    i, shape = 6 * g.one[k], g.shape[k]
    if g.what[k] == BALL:
        return math.inf
    if g.what[k] == FLAT:
        foot = s[i + 1] * shape[0] - s[i] * shape[1]
        return float(min(foot - shape[3], shape[4] - foot))
    if len(shape) == 4:
        return math.inf
    x, y = s[i] - shape[0], s[i + 1] - shape[1]
    fx, fy, lx, ly = shape[4:]
    after, before = fx * y - fy * x, x * ly - y * lx
    is_short = fx * ly - fy * lx >= 0.0  # at most half a turn
    return float(min(after, before) if is_short else max(after, before))


def leaves(g: Any, s: Any, k: int) -> bool:
    """Tell whether a ball at the end of a side moves on beyond it."""
    p, near = 6 * g.one[k], NEAR * g.radius[g.one[k]]
    left, speed = room(g, s, k), size_of(s[p + 2], s[p + 3])
    if left > near or speed == 0.0:
        return False
    ahead = list(s)
    ahead[p] += near / speed * s[p + 2]
    ahead[p + 1] += near / speed * s[p + 3]
    return room(g, ahead, k) < left


def decide(g: Any, s: Any) -> bool:
    """Find what presses, slips and rolls, from a guess; tell whether all fits then."""
    count = len(g.one)
    look(g, s)
    closed = [touches(g, s, k) for k in range(count)]
    for k in range(count):
        g.on[k] = g.on[k] and closed[k]
    for exchange in range(EXCHANGES * (count + len(g.mass))):
        misfit = find_forces(g, s)
        if not mend(g, s, misfit, closed, exchange < count + 3):
            return True
    return False


def mend(g: Any, s: Any, misfit: float, closed: Any, all_at_once: bool) -> bool:
    """Change what does not fit, all of a kind or the worst of it; tell whether anything did."""
    if misfit > 1e3 * g.small[1]:
        return open_widest(g)
    return (
        open_pulling(g, all_at_once)
        or let_slip(g, all_at_once)
        or close_closing(g, s, closed, all_at_once)
        or let_go(g, s)
    )


def open_widest(g: Any) -> bool:
    """Open the contact whose sides part fastest, where no forces fit."""
    widest, which = -math.inf, -1
    for k in range(len(g.one)):
        if g.on[k] and opening_rate(g, k) > widest:
            widest, which = opening_rate(g, k), k
    if which >= 0:
        g.on[which] = False
    return which >= 0


def open_pulling(g: Any, all_at_once: bool) -> bool:
    """Open contacts that would pull."""
    least, which = -g.small[1], -1
    for k in range(len(g.one)):
        if g.on[k]:
            press = g.force[k][0] / g.unit[k]
            if press < (-g.small[1] if all_at_once else least):
                least, which = press, k
                if all_at_once:
                    g.on[k] = False
    if which >= 0:
        g.on[which] = False
    return which >= 0


def let_slip(g: Any, all_at_once: bool) -> bool:
    """Let sides slip that friction cannot hold."""
    found = False
    for k in range(len(g.one)):
        if g.on[k] and (all_at_once or not found):
            most, slack = g.mu[k] * g.force[k][0], g.small[1] * g.unit[k]
            if g.slides[k] == 0 and abs(g.force[k][1]) > most + slack:
                g.slides[k], found = (-1 if g.force[k][1] > 0.0 else 1), True
            if g.into[k] == 0 and abs(g.force[k][2]) > most / GYRATION + slack:
                g.into[k], found = (-1 if g.force[k][2] > 0.0 else 1), True
    return found


def close_closing(g: Any, s: Any, closed: Any, all_at_once: bool) -> bool:
    """Let contacts press that would close."""
    least, which = -4.0 * g.small[1], -1
    for k in range(len(g.one)):
        if closed[k] and not g.on[k]:
            rate = opening_rate(g, k)
            if rate < (-4.0 * g.small[1] if all_at_once else least):
                least, which = rate, k
                if all_at_once:
                    freshen(g, s, k)
    if which >= 0:
        freshen(g, s, which)
    return which >= 0


def drive(g: Any, i: int) -> tuple[float, float]:
    """Return what surface friction has to hold of the pushes on a ball (m/s^2).

    That is what would move a ball at rest, without what walls and their friction take, or what
    would make one slip that rolls.
    """
    fx, fy, cx, cy = g.push[i]
    if g.phase[i] == ROLL:
        return SHARE * (fx - cx), SHARE * (fy - cy)
    if g.rolls:
        fx, fy = (1.0 - SHARE) * fx + SHARE * cx, (1.0 - SHARE) * fy + SHARE * cy
    for k in range(len(g.one)):
        if g.on[k] and g.one[k] == i and g.other[k] < 0:
            nx, ny = g.normal[k]
            into, along = min(fx * nx + fy * ny, 0.0), fy * nx - fx * ny
            held = min(max(along, g.mu[k] * into), -g.mu[k] * into)
            fx, fy = fx - into * nx + held * ny, fy - into * ny - held * nx
    return fx, fy


def spare_hold(g: Any, i: int) -> float:
    """Return how much more (m/s^2) the surface friction that holds a ball could hold."""
    if g.phase[i] == SLIP or g.stuck[i]:
        return math.inf
    x, y = drive(g, i)
    most = g.drag if g.rolls and g.phase[i] == REST else g.pull
    return float(most - math.sqrt(x * x + y * y))


def let_go(g: Any, s: Any) -> bool:
    """Let a ball slip that cannot roll on, or move that cannot rest."""
    for i in range(len(g.mass)):
        if spare_hold(g, i) < -g.small[1]:
            set_free(g, s, i)
            return True
    return False


def set_free(g: Any, s: Any, i: int) -> None:
    """Let a ball slip that rolls, or move that rests, with a small speed along its drive."""
    p, (x, y) = 6 * i, drive(g, i)
    least = g.small[0] / math.sqrt(x * x + y * y)
    x, y = least * x, least * y
    if g.phase[i] == ROLL:
        s[p + 4], s[p + 5] = s[p + 2] - x, s[p + 3] - y
        g.phase[i] = SLIP
        return
    s[p + 2], s[p + 3] = x, y
    s[p + 4], s[p + 5] = (x, y) if g.rolls else (0.0, 0.0)
    g.phase[i] = ROLL if g.rolls else SLIP
