"""A group of balls whose contacts persist moves by the forces that keep its gaps closed.

A contact that presses has a normal force N >= 0 and friction, up to mu N against its slip. A ball
rests, slips, or rolls. With f the push of a ball's contacts and c what cushions do to its roll, both
as accelerations, u = v - w its slip, and mu_s g and mu_r g the decelerations of its surface:

- A ball that slips: dv/dt = f - mu_s g u/|u|, dw/dt = c + (5/2) mu_s g u/|u|. A disc has w = 0.
- One that rolls: dv/dt = dw/dt = (5/7) f + (2/7) c - mu_r g v/|v| while (2/7) |f - c| <= mu_s g.
- One at rest stays while |(5/7) f + (2/7) c| <= mu_r g; a disc stays while |f| <= mu_s g.
- Two sides: N >= 0, the gap's acceleration is >= 0, and one of both is 0. The friction of a cushion
  also slows the roll into it by up to (5/2) mu N / m.

Where a slip is 0, friction holds it there as long as it can. All of these are one linear system for
the forces once it is known what presses, slips and rolls; :func:`decide` finds that, and
:func:`measure` tells when it is over. Functions are loops over the numbers of a :class:`Press`, of
which Python has lists; numba can compile them for arrays. A state is a row of six numbers a ball:
x, y (m), vx, vy, wx, wy (m/s).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from pool_pymunk.physics.surface import GYRATION, SHARE

REST, SLIP, ROLL = 0, 1, 2  # phases of a ball
FLAT, ROUND, BALL = 0, 1, 2  # what a ball touches
NORMAL, ALONG, INTO = 0, 1, 2  # kinds of unknown forces: N, that holds a slip, that holds a roll

# of the largest speed and acceleration of a group: smaller ones are none
SLOW, WEAK = 1e-13, 1e-12
TINY = 1e-7  # of the largest speed; slower slips that are left at the beginning are none
NEAR = 1e-9  # of a contact's size; sides that are nearer touch
REDUNDANT = 1e-11  # A force is redundant if less than this share of its response is independent.
# the method of Dormand and Prince, of order five, and its difference to that of order four (J. Comp.
# Appl. Math. 6, 1980, 19): its last stage is its end
STAGES = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
SPREAD = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
# A piece is short enough that two parabolas deviate from it by less than this share of a radius.
DEVIATION = 1e-8
BRIEF = 1e-12  # radii; in a brief piece no acceleration moves a ball farther
ERROR = 1e-8  # of the largest speed at the beginning; a step errs by less, by its estimate of third order
FADED = 1e5  # A slip has faded that is not larger than this many times what is none.
EXCHANGES = 20  # This many changes of what presses, slips and rolls are tried for each contact.

# A press has `mass` (kg) and `phase` of each ball, and whether it is `stuck`: other balls and walls
# hold it at rest, because it came back to rest as soon as it was let go. Each contact has its balls `one` and `other` (-1
# for a wall), `what` is touched, its friction `mu`, and the numbers of its `shape`: of two balls the
# sum of their radii (m); of a flat wall its normal, the height of a touching ball's centre along
# it, and its ends along the tangent (m); of a round one its center, 1 or -1 for balls that are
# outside or inside, the distance of the centres (m), its middle direction, and half its angle.
# `small` has the speed and the acceleration below which there is none. `on` tells whether it presses; `slides` and `into` have the signs of its slip and of the
# roll into a cushion, 0 where friction holds them. `force` (N) has N, the friction along the
# tangent, and what slows the roll. `normal`, `bend` (1/m) and `slip` (m/s) are those of the present
# state, `rate` its change, `push` (m/s^2) has f and c of each ball.
Press = namedtuple(
    "Press",
    "pull drag rolls small mass radius phase stuck one other what mu shape on slides into force normal "
    "bend slip rate push unknown matrix",
)


def press_of(surface: Any, mass: Any, radius: Any, contacts: Any) -> Press:
    """Return the press of balls of these masses (kg) and radii (m) on a surface.

    ``contacts`` has (one, other, what, mu, shape) of each contact.
    """
    n, count = len(mass), len(contacts)
    one, other, what, mu, shape = (list(part) for part in zip(*contacts, strict=True))
    most = 3 * count
    return Press(
        surface.pull, surface.drag, surface.rolls, [0.0, 0.0], list(mass), list(radius),
        [REST] * n, [False] * n, one, other, what, mu, shape, [True] * count, [0] * count, [0] * count, [[0.0] * 3 for _ in range(count)],
        [[0.0] * 2 for _ in range(count)], [0.0] * count, [0.0] * count, [0.0] * (6 * n),
        [[0.0] * 4 for _ in range(n)], [[0] * 2 for _ in range(most)],
        [[0.0] * (most + 1) for _ in range(most)],
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
        part.on[m], part.slides[m], part.into[m] = g.on[k], g.slides[k], g.into[k]
    part.phase[:], part.stuck[:] = [g.phase[i] for i in balls], [g.stuck[i] for i in balls]
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
            g.force[k][kind] = g.matrix[q][count] * unit_of(g, k)
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


def unit_of(g: Any, k: int) -> float:
    """Return the unit of a contact's forces (kg), in which its own response is about 1."""
    m = float(g.mass[g.one[k]])
    if g.other[k] < 0:
        return m
    return m * float(g.mass[g.other[k]]) / (m + float(g.mass[g.other[k]]))


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
    return rate_along(g, k, g.normal[k][0], g.normal[k][1]) + g.bend[k] * g.slip[k] * g.slip[k]


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
    unit, mu = unit_of(g, k), g.mu[k]
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
    is_free = [True] * count
    misfit = 0.0
    rank = 0
    for q in range(count):
        best, size = -1, REDUNDANT
        for p in range(rank, count):
            if abs(matrix[p][q]) > size:
                best, size = p, abs(matrix[p][q])
        if best < 0:
            continue
        matrix[rank], matrix[best] = matrix[best], matrix[rank]
        row = matrix[rank]
        pivot = row[q]
        for m in range(q, count + 1):
            row[m] /= pivot
        for p in range(count):
            part = matrix[p][q]
            if p != rank and part != 0.0:
                other = matrix[p]
                for m in range(q, count + 1):
                    if row[m] != 0.0:
                        other[m] -= part * row[m]
        column[rank], is_free[q] = q, False
        rank += 1
    for p in range(rank, count):
        misfit = max(misfit, abs(matrix[p][count]))
    found = [0.0] * count
    for p in range(rank):
        found[column[p]] = matrix[p][count]
    if rank < count:
        least_norm(matrix, count, rank, column, is_free, found)
    for q in range(count):
        matrix[q][count] = found[q]
    return misfit


def least_norm(
    matrix: Any, count: int, rank: int, column: Any, is_free: Any, found: Any
) -> None:
    """Take from a solution what lies along forces that change nothing."""
    kept: list[list[float]] = []
    for q in range(count):
        if not is_free[q]:
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
    close(g, s)


def set_scale(g: Any, s: Any) -> None:
    """Set the speed and the acceleration below which there is none."""
    fastest = 0.0
    strongest = max(g.pull, g.drag)
    for number in range(len(g.mass)):
        p = 6 * number
        fastest = max(fastest, math.hypot(s[p + 2], s[p + 3]), math.hypot(s[p + 4], s[p + 5]))
    look(g, s)
    for k in range(len(g.one)):
        strongest = max(strongest, abs(g.bend[k]) * g.slip[k] * g.slip[k])
    fastest = max(fastest, math.sqrt(strongest * min(g.radius)))
    g.small[0], g.small[1] = SLOW * fastest, WEAK * strongest


def set_phases(g: Any, s: Any) -> None:
    """Set the phases of balls; tiny slips and speeds are none."""
    fastest = g.small[0] / SLOW
    for i in range(len(g.mass)):
        p, g.phase[i] = 6 * i, phase_of(g, s, i, TINY * fastest)
        if g.phase[i] == ROLL:
            for q in (p + 2, p + 3):
                s[q] = s[q + 2] = (1.0 - SHARE) * s[q] + SHARE * s[q + 2]
        elif g.phase[i] == REST:
            s[p + 2] = s[p + 3] = s[p + 4] = s[p + 5] = 0.0


def phase_of(g: Any, s: Any, i: int, least: float) -> int:
    """Return the phase of a ball; slower slips and speeds than ``least`` (m/s) are none."""
    p = 6 * i
    vx, vy, wx, wy = s[p + 2], s[p + 3], s[p + 4], s[p + 5]
    if math.hypot(vx, vy) <= least and math.hypot(wx, wy) <= least:
        return REST
    return ROLL if g.rolls and math.hypot(vx - wx, vy - wy) <= least else SLIP


def freshen(g: Any, s: Any, k: int) -> None:
    """Let a contact press, with the signs of its slip and of the roll into it."""
    g.on[k] = True
    g.slides[k] = sign(g.slip[k], g.small[0]) if g.mu[k] > 0.0 else 0
    g.into[k] = sign(roll_into(g, s, k), g.small[0]) if wrings(g, k) else 0


def sign(x: float, least: float) -> int:
    """Return the sign of a number, or 0 if it is not larger than ``least``."""
    return 0 if abs(x) <= least else (1 if x > 0.0 else -1)


def touches(g: Any, s: Any, k: int) -> bool:
    """Tell whether two sides touch and do not part."""
    return gap_of(g, s, k) <= NEAR * g.radius[g.one[k]] and opening(g, s, k) <= 10.0 * g.small[0]


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
            press = g.force[k][0] / unit_of(g, k)
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
            most, slack = g.mu[k] * g.force[k][0], g.small[1] * unit_of(g, k)
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


# -- a piece of the motion -------------------------------------------------------------------------


def step(g: Any, s: Any, h: float, total: Any) -> tuple[Any, float]:
    """Return the state a time h (s) later, in the same mode, and its error (m, m/s).

    ``g`` has the forces of the state first, and those of the end at last. ``total`` (N s) becomes
    the impulses of the forces.
    """
    size, count, rates, forces = len(s), len(g.one), [list(g.rate)], [copy_of(g.force)]
    for weights in STAGES:
        state = list(s)
        for weight, rate in zip(weights, rates, strict=True):
            if weight != 0.0:
                for p in range(size):
                    state[p] += h * weight * rate[p]
        if len(rates) == len(STAGES):
            close(g, state)
        find_forces(g, state)
        rates.append(list(g.rate))
        forces.append(copy_of(g.force))
    for c in range(count):
        for kind in range(3):
            total[c][kind] = 0.0
            for weight, force in zip(STAGES[-1], forces, strict=False):
                total[c][kind] += h * weight * force[c][kind]
    error = 0.0
    for p in range(size):
        wrong = 0.0
        for weight, rate in zip(SPREAD, rates, strict=True):
            wrong += weight * rate[p]
        error = max(error, abs(h * wrong))
    return state, error


def copy_of(rows: Any) -> Any:
    """Return a copy of rows of numbers."""
    return [list(row) for row in rows]


def close(g: Any, s: Any) -> None:
    """Close the gaps that a step has left open by its error, and keep rolling balls rolling."""
    look(g, s)
    for i in range(len(g.mass)):
        if g.phase[i] == ROLL:
            s[6 * i + 4], s[6 * i + 5] = s[6 * i + 2], s[6 * i + 3]
    chosen = [k for k in range(len(g.one)) if g.on[k] and moves(g, k)]
    count = len(chosen)
    for first in (0, 2):
        for p in range(count):
            k = chosen[p]
            wrong = opening(g, s, k) if first else gap_of(g, s, k)
            g.matrix[p][count] = -wrong
            for q in range(count):
                g.matrix[p][q] = unit_of(g, chosen[q]) * shared(g, k, chosen[q])
        solve(g.matrix, count)
        for p in range(count):
            shift(g, s, chosen[p], unit_of(g, chosen[p]) * g.matrix[p][count], (first, 0))


def join(g: Any, s: Any, least: float, total: Any) -> None:
    """Let all sides move together that part or close; ``total`` becomes the impulses (N s).

    With the hit before, this is a hit of restitution 0: it gives the friction back, too, of what
    the hit has pushed too much. Slips are none that are not larger than ``least`` (m/s).
    """
    set_phases(g, s)
    look(g, s)
    push_together(g, s, total)
    for k in range(len(g.one)):
        i, much = g.one[k], g.mu[k] * total[k][0]
        if abs(g.slip[k]) > least:
            rub = -math.copysign(much, g.slip[k])
            total[k][1] += rub
            shift(g, s, k, rub, (2, 1))
        if wrings(g, k):
            into = roll_into(g, s, k)
            part = -math.copysign(min(much / (GYRATION * g.mass[i]), abs(into)), into)
            s[6 * i + 4] += part * g.normal[k][0]
            s[6 * i + 5] += part * g.normal[k][1]
    push_together(g, s, total)


def push_together(g: Any, s: Any, total: Any) -> None:
    """Take away the speeds at which sides part, by impulses along the normals."""
    count = len(g.one)
    for p in range(count):
        g.matrix[p][count] = -opening(g, s, p)
        for q in range(count):
            g.matrix[p][q] = unit_of(g, q) * shared(g, p, q)
    solve(g.matrix, count)
    for p in range(count):
        much = unit_of(g, p) * g.matrix[p][count]
        total[p][0] += much
        shift(g, s, p, much, (2, 0))


def moves(g: Any, k: int) -> bool:
    """Tell whether a ball of a contact moves."""
    return g.phase[g.one[k]] != REST or (g.other[k] >= 0 and g.phase[g.other[k]] != REST)


def sign_in(g: Any, k: int, i: int) -> float:
    """Return the sign with which a contact pushes a moving ball along its normal, or 0."""
    if g.phase[i] == REST:
        return 0.0
    if i == g.other[k]:
        return 1.0
    if i != g.one[k]:
        return 0.0
    return 1.0 if g.other[k] < 0 else -1.0


def lightness(g: Any, i: int) -> float:
    """Return how much (1/kg) a weak push moves a ball; one that rolls goes on rolling."""
    return float((1.0 - SHARE if g.phase[i] == ROLL else 1.0) / g.mass[i])


def shared(g: Any, k: int, m: int) -> float:
    """Return by how much (1/kg) a push along one contact opens another one."""
    i, j = g.one[k], g.other[k]
    part = sign_in(g, k, i) * sign_in(g, m, i) * lightness(g, i)
    if j >= 0:
        part += sign_in(g, k, j) * sign_in(g, m, j) * lightness(g, j)
    if part == 0.0:
        return 0.0
    return float(part * (g.normal[k][0] * g.normal[m][0] + g.normal[k][1] * g.normal[m][1]))


def shift(g: Any, s: Any, k: int, much: float, how: tuple[int, int]) -> None:
    """Move the balls of a contact apart, or change their velocities.

    ``how`` is 0 or 2 for places or velocities, and 0 or 1 for the normal or the tangent.
    """
    first, is_along = how
    nx, ny = g.normal[k]
    if is_along:
        nx, ny = -ny, nx
    for i in (g.one[k], g.other[k]):
        if i >= 0:
            part, p = sign_in(g, k, i) * much * lightness(g, i), 6 * i + first
            s[p], s[p + 1] = s[p] + part * nx, s[p + 1] + part * ny
            if first and g.phase[i] == ROLL:
                s[p + 2], s[p + 3] = s[p], s[p + 1]


def measures(g: Any, s: Any) -> list[float]:
    """Return the numbers that end the mode where they fall through 0; infinite if there is none.

    Four numbers of each contact are its force, what friction or the slip has left, the same of the
    roll into a wall, and how far it is to the side's end. One of each ball is what holds it.
    """
    found = []
    for k in range(len(g.one)):
        force = slips = rolls_in = end = math.inf
        if g.on[k]:
            unit, most = unit_of(g, k), g.mu[k] * g.force[k][0]
            force, end = g.force[k][0] / unit, room(g, s, k)
            if g.slides[k]:
                slips = g.slides[k] * g.slip[k]
            elif most > 0.0:
                slips = (most - abs(g.force[k][1])) / unit
            if wrings(g, k) and g.phase[g.one[k]] == SLIP:
                if g.into[k]:
                    rolls_in = g.into[k] * roll_into(g, s, k)
                else:
                    rolls_in = (most / GYRATION - abs(g.force[k][2])) / unit
        found += [force, slips, rolls_in, end]
    return found + [spare_hold(g, i) for i in range(len(g.mass))]


def slack_of(g: Any, which: int) -> float:
    """Return how far below 0 a measure may be by rounding."""
    k, kind = which // 4, which % 4
    if k >= len(g.one) or kind == 0:
        return float(10.0 * g.small[1])
    if kind == 3:
        return float(NEAR * g.radius[g.one[k]])
    is_speed = g.slides[k] if kind == 1 else g.into[k]
    return float(g.small[0] if is_speed else 10.0 * g.small[1])


def change(g: Any, s: Any, which: int) -> None:
    """Change the mode where a measure has fallen to 0."""
    k, kind = which // 4, which % 4
    look(g, s)
    if k >= len(g.one):
        set_free(g, s, which - 4 * len(g.one))
    elif kind in (0, 3):
        g.on[k] = False
    elif kind == 1:
        was, slip = g.slides[k], sign(g.slip[k], g.small[0])
        g.slides[k] = slip if was else (-1 if g.force[k][1] > 0.0 else 1)
    else:
        was, slip = g.into[k], sign(roll_into(g, s, k), g.small[0])
        g.into[k] = slip if was else (-1 if g.force[k][2] > 0.0 else 1)


def room(g: Any, s: Any, k: int) -> float:
    """Return how far (m) a ball is from the nearer end of the side that it touches."""
    i, shape = 6 * g.one[k], g.shape[k]
    if g.what[k] == BALL:
        return math.inf
    if g.what[k] == FLAT:
        foot = s[i + 1] * shape[0] - s[i] * shape[1]
        return float(min(foot - shape[3], shape[4] - foot))
    if shape[6] >= math.pi:
        return math.inf
    x, y = s[i] - shape[0], s[i + 1] - shape[1]
    turned = math.atan2(shape[4] * y - shape[5] * x, shape[4] * x + shape[5] * y)
    return float(shape[3] * (shape[6] - abs(turned)))


def fading(g: Any, s: Any, i: int) -> tuple[float, float]:
    """Return the slip (m/s) of a ball, or its speed where it rolls, and in what time (s) it is 0.

    The time is infinite if it does not fade.
    """
    p, d = 6 * i, g.rate
    if g.phase[i] == REST:
        return 0.0, math.inf
    x, y, a, b = s[p + 2], s[p + 3], d[p + 2], d[p + 3]
    if g.phase[i] == SLIP:
        x, y, a, b = x - s[p + 4], y - s[p + 5], a - d[p + 4], b - d[p + 5]
    size = math.sqrt(x * x + y * y)
    loss = -(x * a + y * b)
    return size, size * size / loss if loss > 0.0 else math.inf



# A piece has the state at its end, its length (s), its error (m, m/s), and how long the next one
# may be (s). `fell` is the measure that ends the mode there, or -1; `faded` tells whether a slip or
# a speed has faded.
Piece = namedtuple("Piece", "end time error next fell faded")


def piece_of(g: Any, s: Any, longest: float, total: Any) -> Piece:
    """Play a piece of the motion, no longer than a time (s); ``total`` becomes the impulses."""
    find_forces(g, s)
    before, first, forces = measures(g, s), list(g.rate), copy_of(g.force)
    fades = math.inf
    for i in range(len(g.mass)):
        size, time = fading(g, s, i)
        if time < math.inf and size <= FADED * g.small[0]:
            return Piece(s, 0.0, 0.0, longest, -1, True)
        fades = min(fades, time)
    h = min(longest, (0.9 if 10.0 * fades > longest else 0.999) * fades)
    while True:
        end, error = step(g, s, h, total)
        share = share_of(g, s, first, h, error)
        if share >= 1.0:
            break
        h *= max(0.2, 0.9 * share)
        longest = h
        recall(g, first, forces)
    after = measures(g, end)
    which = first_to_fall(g, before, after)
    if which < 0:
        lose(g, s, end)
        return Piece(end, h, error, max(longest, h) * min(3.0, 0.9 * share), -1, False)
    if before[which] <= slack_of(g, which):
        recall(g, first, forces)
        return Piece(s, 0.0, 0.0, longest, which, False)
    low, high, m_low, m_high, t = 0.0, h, before[which], after[which], h
    was_high = True
    while abs(m_high) > slack_of(g, which) and high - low > 1e-14 * h:
        t = low + (high - low) * m_low / (m_low - m_high)
        recall(g, first, forces)
        end, error = step(g, s, t, total)
        after = measures(g, end)
        now = first_to_fall(g, before, after)
        if now >= 0 and now != which:
            which, low, m_low = now, 0.0, before[now]
        is_high = now >= 0 or after[which] <= slack_of(g, which)
        if is_high:
            high, m_high = t, after[which]
            m_low /= 2.0 if was_high else 1.0
        else:
            low, m_low = t, after[which]
            m_high /= 1.0 if was_high else 2.0
        was_high = is_high
    if t != high:
        recall(g, first, forces)
        end, error = step(g, s, high, total)
    lose(g, s, end)
    return Piece(end, high, error, longest, which, False)


def recall(g: Any, rate: Any, forces: Any) -> None:
    """Let a press have the rates and the forces again that it had at the start of a step."""
    g.rate[:] = rate
    for k in range(len(forces)):
        g.force[k][:] = forces[k]


def share_of(g: Any, s: Any, first: Any, h: float, error: float) -> float:
    """Return how many times as long a step could be whose length is h (s)."""
    jump = 0.0
    for p in range(len(s)):
        if p % 6 in (2, 3):
            jump = max(jump, abs(g.rate[p] - first[p]))
    deviates, share = jump * h * h / 324.0, math.inf
    if deviates > 0.0:
        share = (DEVIATION * min(g.radius) / deviates) ** (1.0 / 3.0)
    if error > 0.0:
        share = min(share, (ERROR / SLOW * g.small[0] / error) ** 0.2)
    return share


def first_to_fall(g: Any, before: Any, after: Any) -> int:
    """Return the measure that falls through 0 first, by straight lines; -1 if none does."""
    soonest, found = math.inf, -1
    for q in range(len(before)):
        if after[q] < -slack_of(g, q):
            start = max(before[q], 0.0)
            when = start / (start - after[q])
            if when < soonest:
                soonest, found = when, q
    return found


def energy_of(g: Any, s: Any) -> float:
    """Return the energy (J) of a state."""
    energy = 0.0
    for i in range(len(g.mass)):
        x, y, u, v = s[6 * i + 2 : 6 * i + 6]
        energy += 0.5 * g.mass[i] * (x * x + y * y + GYRATION * (u * u + v * v))
    return energy


def lose(g: Any, s: Any, end: Any) -> None:
    """Take away energy that a step has gained by its error."""
    before, after = energy_of(g, s), energy_of(g, end)
    if after > before:
        share = math.sqrt(before / after)
        for p in range(len(s)):
            if p % 6 > 1:
                end[p] *= share


def settle(g: Any, s: Any) -> list[int]:
    """Let balls roll or rest whose slip or speed has faded; return their numbers."""
    found = []
    for i in range(len(g.mass)):
        size, time = fading(g, s, i)
        if g.phase[i] == REST or size > 10.0 * FADED * g.small[0] or time == math.inf:
            continue
        p = 6 * i
        was = g.phase[i]
        if was == SLIP and g.rolls:
            for q in (p + 2, p + 3):
                s[q] = s[q + 2] = (1.0 - SHARE) * s[q] + SHARE * s[q + 2]
            g.phase[i] = ROLL
            size, time = fading(g, s, i)
        if size <= 10.0 * FADED * g.small[0]:
            s[p + 2] = s[p + 3] = s[p + 4] = s[p + 5] = 0.0
            g.phase[i], g.stuck[i] = REST, size <= 2.0 * g.small[0]
        if g.phase[i] != was:
            found.append(i)
    close(g, s)
    return found


def halves(g: Any, s: Any, end: Any, h: float, i: int) -> tuple[float, ...]:
    """Return the accelerations (m/s^2) of the two halves of a ball's piece.

    With them place and velocity at its end are those of the state there, except in a brief piece, in
    which the places are rounding alone.
    """
    found, strongest = [], max(g.pull, g.drag, abs(g.rate[6 * i + 2]) + abs(g.rate[6 * i + 3]))
    for p in (6 * i, 6 * i + 1):
        mean = (end[p + 2] - s[p + 2]) / h
        if strongest * h * h < BRIEF * g.radius[i]:
            found += [mean, mean]
            continue
        ahead = 4.0 * ((end[p] - s[p]) / h - s[p + 2]) / h
        first = ahead - mean
        found += [first, 2.0 * mean - first]
    return found[0], found[2], found[1], found[3]
