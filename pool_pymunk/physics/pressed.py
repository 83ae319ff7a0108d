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
functions are loops over the numbers of a :class:`Press`, in lists or in arrays. A state is a row of
six numbers a ball: x, y (m), vx, vy, wx, wy (m/s).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pool_pymunk.physics.motion import Vector
from pool_pymunk.physics.surface import GYRATION, SHARE

REST, SLIP, ROLL = 0, 1, 2  # phases of a ball
STUCK, LET_GO = 1, 2  # It came back to rest as soon as it was let go; it was let go just now.
FLAT, ROUND, BALL = 0, 1, 2  # what a ball touches
NORMAL, ALONG, INTO = 0, 1, 2  # kinds of unknown forces: N, that holds a slip, that holds a roll

# of the largest speed and acceleration of a group: smaller ones are none
SLOW, WEAK = 1e-13, 1e-12
TINY = 1e-8  # of the largest speed; slower slips at the beginning are none
# A slip or a speed has faded that is not larger than this many times what is none; a ball that is
# let go begins with as much.
FADED = 1e5
NEAR = 1e-9  # of a contact's size; sides that are nearer touch
REDUNDANT = 1e-11  # A force is redundant if less than this share of its response is independent.
MOST_STEPS = 16  # of a piece
EXCHANGES = 20  # This many changes of what presses, slips and rolls are tried for each contact.

# These are the rows that a press has, each with its type, and its shape by the most balls N and
# contacts C. `small` has the speed and the acceleration below which there is none, and a factor of
# all tolerances. Each ball has its number in the run (`ball`), its `mass` (kg), `radius` (m),
# `phase`, and as `push` its f and c (m/s^2); `rate` is the change of the state. A ball is `stuck`
# that other balls and walls hold at rest, because it came back to rest as soon as it was let go.
# Each contact has what its ball touches in the run (`place`: a ball, or -1 - the number of a wall),
# its balls `one` and `other` (-1 for a wall), `what` is touched, its friction `mu`, and its
# `edge`: of two balls the sum of their radii (m); of a flat wall its normal, the height of a
# touching ball's centre along it, and its ends along the tangent (m); of a round one its center, 1
# or -1 for balls that are outside or inside, the distance of the centres (m), and the directions of
# its ends, if it has any, counter-clockwise. `unit` (kg) is that of its forces, in which its own
# response is about 1. `over` tells whether its side has ended, and `on` whether it presses;
# `slides` and `into` have the signs of its slip and of the roll into a cushion, 0 where friction
# holds them. `force` (N) has N, the friction along the tangent, and what slows the roll. `normal`,
# `bend` (1/m) and `slip` (m/s) are those of the present state. `unknown` and `matrix` are the
# linear system. `state`, `end` and `total` (N s) are those of a piece. At each `stop` one of its
# steps ends, `stop_t` (s) after its beginning. The others are for a step, which begins `here`.
FORM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "small": (float, (3,)),
    "ball": (int, ("N",)), "mass": (float, ("N",)), "radius": (float, ("N",)),
    "phase": (int, ("N",)), "stuck": (int, ("N",)), "push": (float, ("N", 4)),
    "rate": (float, ("6N",)),
    "place": (int, ("C",)), "one": (int, ("C",)), "other": (int, ("C",)), "what": (int, ("C",)),
    "mu": (float, ("C",)), "edge": (float, ("C", 8)), "unit": (float, ("C",)),
    "over": (int, ("C",)), "on": (int, ("C",)), "slides": (int, ("C",)), "into": (int, ("C",)),
    "force": (float, ("C", 3)), "normal": (float, ("C", 2)), "bend": (float, ("C",)),
    "slip": (float, ("C",)), "closed": (int, ("C",)), "chosen": (int, ("C",)),
    "unknown": (int, ("3C", 2)), "matrix": (float, ("3C", "3C+1")), "column": (int, ("3C",)),
    "found": (float, ("3C",)), "free": (float, ("3C", "3C")),
    "state": (float, ("6N",)), "end": (float, ("6N",)), "total": (float, ("C", 3)),
    "rates": (float, (7, "6N")), "forces": (float, (7, "C", 3)),
    "here": (float, ("6N",)), "so_far": (float, ("C", 3)),
    "stop": (float, (MOST_STEPS, "6N")), "stop_t": (float, (MOST_STEPS,)),
    "first": (float, ("6N",)), "held": (float, ("C", 3)),
    "before": (float, ("4C+N",)), "after": (float, ("4C+N",)),
}  # fmt: skip

OF_MODE = (
    "small", "ball", "mass", "radius", "phase", "stuck", "place", "one", "other", "what", "mu",
    "edge", "unit", "over", "on", "slides", "into",
)  # fmt: skip


class Press:
    """A press is a group with the room for its forces and its next piece, in lists."""

    own: Any = None  # a surface of a user's, which accelerates balls without contacts
    steady: tuple[int, ...] = ()  # balls whose slip has no changes (physics/persistent_changes.py)
    is_fixed = False  # Its room is.

    def __init__(self) -> None:
        self.balls = self.contacts = self.steps = 0
        self.pull = self.drag = 0.0
        self.rolls = False
        self.room = 0, 0

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...  # the lists of FORM

    def hold(self, balls: int, contacts: int) -> None:
        """Have room for so many balls and contacts."""
        n, c = self.room
        if balls > n or contacts > c:
            self.room = max(balls, 2 * n), max(contacts, 2 * c)
            for name, (kind, shape) in FORM.items():
                setattr(self, name, rows_of(kind, lengths(shape, *self.room)))


def copy_of(g: Press) -> Press:
    """Return a press with the same balls and contacts in the same mode."""
    found, counts = Press(), (g.balls, g.contacts)
    found.hold(*counts)
    found.balls, found.contacts = counts
    found.own, found.pull, found.drag, found.rolls = g.own, g.pull, g.drag, g.rolls
    for name in OF_MODE:
        mine, its = getattr(found, name), getattr(g, name)
        mine[:] = [[*row] for row in its[: len(mine)]] if name == "edge" else its[: len(mine)]
    return found


def lengths(shape: Sequence[Any], balls: int, contacts: int) -> tuple[int, ...]:
    """Return the lengths of rows for so many balls and contacts.

    >>> lengths((7, "6N"), 2, 1), lengths(("3C", "3C+1"), 2, 1)
    ((7, 12), (3, 4))
    """
    known = {
        "N": balls, "N+1": balls + 1, "6N": 6 * balls, "C": contacts, "3C": 3 * contacts,
        "3C+1": 3 * contacts + 1, "6C": 6 * contacts, "4C+N": 4 * contacts + balls,
    }  # fmt: skip
    return tuple(known.get(each, each) for each in shape)


def rows_of(kind: type, shape: Sequence[int]) -> Any:
    """Return lists of zeros in lists."""
    row = [kind()] * shape[-1]
    if len(shape) == 1:
        return row
    if len(shape) == 2:
        return [row[:] for _ in range(shape[0])]
    return [rows_of(kind, shape[1:]) for _ in range(shape[0])]


def find_units(g: Any) -> None:
    """Find the unit of each contact's forces, and forget how it presses."""
    for k in range(g.contacts):
        m, j = g.mass[g.one[k]], g.other[k]
        g.unit[k] = m if j < 0 else m * g.mass[j] / (m + g.mass[j])


# -- geometry ----------------------------------------------------------------------------------


def gap_of(g: Any, s: Any, k: int) -> Any:
    """Return the gap (m) of a contact."""
    i, shape = 6 * g.one[k], g.edge[k]
    if g.what[k] == FLAT:
        return s[i] * shape[0] + s[i + 1] * shape[1] - shape[2]
    if g.what[k] == BALL:
        j = 6 * g.other[k]
        dx, dy = s[j] - s[i], s[j + 1] - s[i + 1]
        return size_of(dx, dy) - shape[0]
    dx, dy = s[i] - shape[0], s[i + 1] - shape[1]
    return shape[2] * (size_of(dx, dy) - shape[3])


def look(g: Any, s: Any) -> None:
    """Find the normal, the bend and the slip of each contact."""
    for k in range(g.contacts):
        i, shape, n = 6 * g.one[k], g.edge[k], g.normal[k]
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
        distance = size_of(x, y)
        n[0], n[1], g.bend[k] = facing * x / distance, facing * y / distance, facing / distance
        g.slip[k] = v * n[0] - u * n[1]


def opening(g: Any, s: Any, k: int) -> Any:
    """Return the speed (m/s) at which the two sides part."""
    i, n = 6 * g.one[k], g.normal[k]
    along = s[i + 2] * n[0] + s[i + 3] * n[1]
    if g.other[k] < 0:
        return along
    j = 6 * g.other[k]
    return s[j + 2] * n[0] + s[j + 3] * n[1] - along


def roll_into(g: Any, s: Any, k: int) -> Any:
    """Return the part of the roll (m/s) along the normal of a wall."""
    i, n = 6 * g.one[k], g.normal[k]
    return s[i + 4] * n[0] + s[i + 5] * n[1]


def wrings(g: Any, k: int) -> bool:
    """Tell whether a contact's friction slows a roll."""
    return bool(g.rolls) and g.other[k] < 0 and g.mu[k] > 0.0


# -- forces ------------------------------------------------------------------------------------


def find_forces(g: Any, s: Any) -> float:
    """Find the forces and the rates of a state; return how badly (m/s^2) they fit."""
    count, misfit = number_unknowns(g), 0.0
    fill_system(g, s, count)
    if count:
        misfit = solve(g, count)
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
        ux, uy = kept_steady(g, i, (vx - s[p + 4], vy - s[p + 5]))
        share = holding(g.pull, ux, uy)
        d[p + 2], d[p + 3] = fx - share * ux, fy - share * uy
        spun = share / GYRATION if g.rolls else 0.0
        d[p + 4], d[p + 5] = cx + spun * ux, cy + spun * uy
        return
    share = holding(g.drag, vx, vy)
    d[p + 2] = d[p + 4] = (1.0 - SHARE) * fx + SHARE * cx - share * vx
    d[p + 3] = d[p + 5] = (1.0 - SHARE) * fy + SHARE * cy - share * vy


def is_own(g: Any) -> bool:
    """Tell whether the surface is a user's own."""
    return g.own is not None


def own_pull(g: Any, s: Any, p: int) -> Vector:
    """Return the acceleration (m/s^2) that a user's own surface gives a ball without contacts."""
    path = g.own.path(0.0, (s[p], s[p + 1]), (s[p + 2], s[p + 3]), (s[p + 4], s[p + 5]))
    return path.ax, path.ay


def kept_steady(g: Any, i: int, slip: tuple[Any, Any]) -> tuple[Any, Any]:
    """Return the slip (m/s) of ball ``i``; that of a ball that is ``steady`` has no changes."""
    return (slip[0].real, slip[1].real) if i in g.steady else slip


def holding(most: Any, x: Any, y: Any) -> Any:
    """Return what share (1/s) of a velocity friction of this size (m/s^2) takes off, if any."""
    speed = size_of(x, y)
    return most / (speed + (speed == 0.0))


def opening_rate(g: Any, k: int) -> Any:
    """Return the acceleration (m/s^2) at which a gap opens."""
    turns = g.bend[k] * g.slip[k] * g.slip[k]
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
        return rate_along(g, k, -ny, nx)
    i = g.one[k]
    if g.phase[i] == ROLL:
        f = g.push[i]
        fx, fy, cx, cy = f[0], f[1], f[2], f[3]
        return (cx - fx) * nx + (cy - fy) * ny
    b = 6 * i
    turning = g.bend[k] * g.slip[k] * (s[b + 5] * nx - s[b + 4] * ny)
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


def solve(g: Any, count: int) -> float:
    """Solve the linear system in place; its last column becomes the solution of least norm.

    Return the largest number that redundant rows leave, which is 0 where the system has a solution.
    """
    rank, misfit = eliminate(g, count), 0.0
    for q in range(count):
        g.found[q] = 0.0
    for p in range(count):
        if p < rank:
            g.found[g.column[p]] = g.matrix[p][count]
        else:
            misfit = max(misfit, abs(g.matrix[p][count]))
    if rank < count:
        least_norm(g, count, rank)
    for q in range(count):
        g.matrix[q][count] = g.found[q]
    return misfit


def eliminate(g: Any, count: int) -> int:
    """Eliminate forces row by row (Gauss and Jordan); return the number of independent ones.

    ``column`` becomes the pivot's column of each row.
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
            exchange(row, g.matrix[best], q, count)
        pivot = row[q]
        for m in range(q, count + 1):
            row[m] /= pivot
        for p in range(count):
            if p != rank and g.matrix[p][q] != 0.0:
                take_off(g.matrix[p], row, g.matrix[p][q], q, count)
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


# -- what presses, slips and rolls ---------------------------------------------------------------


def guess(g: Any, s: Any) -> None:
    """Guess the mode of a state: everything that could be held is held."""
    set_phases(g, s)
    look(g, s)
    for k in range(g.contacts):
        freshen(g, s, k)


def set_scale(g: Any, s: Any) -> None:
    """Set the speed and the acceleration below which there is none."""
    fastest = 0.0
    strongest = max(g.pull, g.drag)
    for number in range(g.balls):
        p = 6 * number
        fastest = max(fastest, size_of(s[p + 2], s[p + 3]), size_of(s[p + 4], s[p + 5]))
    look(g, s)
    for k in range(g.contacts):
        strongest = max(strongest, abs(g.bend[k]) * g.slip[k] * g.slip[k])
    fastest = max(fastest, math.sqrt(strongest * smallest(g)))
    g.small[0], g.small[1] = SLOW * fastest, WEAK * strongest


def smallest(g: Any) -> float:
    """Return the smallest radius (m)."""
    least = math.inf
    for i in range(g.balls):
        least = min(least, g.radius[i])
    return least


def set_phases(g: Any, s: Any) -> None:
    """Set the phases of balls; tiny slips and speeds are none."""
    fastest = g.small[0] / SLOW
    for i in range(g.balls):
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
    if is_own(g):
        return SLIP
    if size_of(vx, vy) <= least and size_of(wx, wy) <= least:
        return REST
    return ROLL if g.rolls and size_of(vx - wx, vy - wy) <= least else SLIP


def freshen(g: Any, s: Any, k: int) -> None:
    """Let a contact press, with the signs of its slip and of the roll into it."""
    g.on[k] = 1
    g.slides[k] = sign(g.slip[k], g.small[0]) if g.mu[k] > 0.0 else 0
    g.into[k] = sign(roll_into(g, s, k), g.small[0]) if wrings(g, k) else 0


def size_of(x: Any, y: Any) -> Any:
    """Return the length of a vector; a square root has the same bits on every machine."""
    return root_of(x * x + y * y)


def root_of(square: Any) -> Any:
    """Return the square root of a number, or those of an array."""
    return math.sqrt(square) if isinstance(square, float) else np.sqrt(square)


def sign(x: float, least: float) -> int:
    """Return the sign of a number, or 0 if it is not larger than ``least``."""
    return 0 if abs(x) <= least else (1 if x > 0.0 else -1)


def touches(g: Any, s: Any, k: int) -> bool:
    """Tell whether two sides touch and do not part."""
    if g.over[k] or gap_of(g, s, k) > NEAR * g.radius[g.one[k]] or leaves(g, s, k):
        return False
    return bool(opening(g, s, k) <= 10.0 * g.small[0])


def room(g: Any, k: int, x: float, y: float) -> float:
    """Return how far (m) a ball at a place is from the nearer end of the side that it touches."""
    shape = g.edge[k]
    if g.what[k] == BALL:
        return math.inf
    if g.what[k] == FLAT:
        foot = y * shape[0] - x * shape[1]
        return float(min(foot - shape[3], shape[4] - foot))
    fx, fy, lx, ly = shape[4], shape[5], shape[6], shape[7]
    if fx == fy == 0.0:
        return math.inf
    x, y = x - shape[0], y - shape[1]
    after, before = fx * y - fy * x, x * ly - y * lx
    is_short = fx * ly - fy * lx >= 0.0  # at most half a turn
    return float(min(after, before) if is_short else max(after, before))


def leaves(g: Any, s: Any, k: int) -> bool:
    """Tell whether a ball at the end of a side moves on beyond it."""
    p, near = 6 * g.one[k], NEAR * g.radius[g.one[k]]
    left, speed = room(g, k, s[p], s[p + 1]), size_of(s[p + 2], s[p + 3])
    if left > near or speed == 0.0:
        return False
    x, y = s[p] + near / speed * s[p + 2], s[p + 1] + near / speed * s[p + 3]
    return room(g, k, x, y) < left


def decide(g: Any, s: Any) -> bool:
    """Find what presses, slips and rolls, from a guess; tell whether all fits then."""
    look(g, s)
    for k in range(g.contacts):
        g.closed[k] = touches(g, s, k)
        g.on[k] = g.on[k] and g.closed[k]
    for number in range(EXCHANGES * (g.contacts + g.balls)):
        misfit = find_forces(g, s)
        if not mend(g, s, misfit, number < g.contacts + 3):
            return True
    return False


def mend(g: Any, s: Any, misfit: float, all_at_once: bool) -> bool:
    """Change what does not fit, all of a kind or the worst of it; tell whether anything did."""
    if misfit > 1e3 * g.small[1]:
        return open_widest(g)
    return (
        open_pulling(g, all_at_once)
        or let_slip(g, all_at_once)
        or close_closing(g, s, all_at_once)
        or let_go(g, s)
    )


def open_widest(g: Any) -> bool:
    """Open the contact whose sides part fastest, where no forces fit."""
    widest, which = -math.inf, -1
    for k in range(g.contacts):
        if g.on[k] and opening_rate(g, k) > widest:
            widest, which = opening_rate(g, k), k
    if which >= 0:
        g.on[which] = 0
    return which >= 0


def open_pulling(g: Any, all_at_once: bool) -> bool:
    """Open contacts that would pull."""
    least, which = -g.small[1], -1
    for k in range(g.contacts):
        if g.on[k]:
            press = g.force[k][0] / g.unit[k]
            if press < (-g.small[1] if all_at_once else least):
                least, which = press, k
                if all_at_once:
                    g.on[k] = 0
    if which >= 0:
        g.on[which] = 0
    return which >= 0


def let_slip(g: Any, all_at_once: bool) -> bool:
    """Let sides slip that friction cannot hold."""
    found = False
    for k in range(g.contacts):
        if g.on[k] and (all_at_once or not found):
            most, slack = g.mu[k] * g.force[k][0], g.small[1] * g.unit[k]
            if g.slides[k] == 0 and abs(g.force[k][1]) > most + slack:
                g.slides[k], found = (-1 if g.force[k][1] > 0.0 else 1), True
            if g.into[k] == 0 and abs(g.force[k][2]) > most / GYRATION + slack:
                g.into[k], found = (-1 if g.force[k][2] > 0.0 else 1), True
    return found


def close_closing(g: Any, s: Any, all_at_once: bool) -> bool:
    """Let contacts press that would close."""
    least, which = -4.0 * g.small[1], -1
    for k in range(g.contacts):
        if g.closed[k] and not g.on[k]:
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
    f = g.push[i]
    fx, fy, cx, cy = f[0], f[1], f[2], f[3]
    if g.phase[i] == ROLL:
        return SHARE * (fx - cx), SHARE * (fy - cy)
    if g.rolls:
        fx, fy = (1.0 - SHARE) * fx + SHARE * cx, (1.0 - SHARE) * fy + SHARE * cy
    for k in range(g.contacts):
        if g.on[k] and g.one[k] == i and g.other[k] < 0:
            nx, ny = g.normal[k][0], g.normal[k][1]
            into, along = min(fx * nx + fy * ny, 0.0), fy * nx - fx * ny
            held = min(max(along, g.mu[k] * into), -g.mu[k] * into)
            fx, fy = fx - into * nx + held * ny, fy - into * ny - held * nx
    return fx, fy


def spare_hold(g: Any, i: int) -> float:
    """Return how much more (m/s^2) the surface friction that holds a ball could hold."""
    if g.phase[i] == SLIP or g.stuck[i] == STUCK:
        return math.inf
    x, y = drive(g, i)
    most = g.drag if g.rolls and g.phase[i] == REST else g.pull
    return float(most - math.sqrt(x * x + y * y))


def let_go(g: Any, s: Any) -> bool:
    """Let a ball slip that cannot roll on, or move that cannot rest."""
    for i in range(g.balls):
        if spare_hold(g, i) < -g.small[1]:
            set_free(g, s, i)
            return True
    return False


def set_free(g: Any, s: Any, i: int) -> None:
    """Let a ball slip that rolls, or move that rests, with a small speed along its drive."""
    p, (x, y) = 6 * i, drive(g, i)
    least = FADED * g.small[2] * g.small[0] / math.sqrt(x * x + y * y)
    x, y, g.stuck[i] = least * x, least * y, LET_GO
    if g.phase[i] == ROLL:
        s[p + 4], s[p + 5] = s[p + 2] - x, s[p + 3] - y
        g.phase[i] = SLIP
        return
    s[p + 2], s[p + 3] = x, y
    s[p + 4], s[p + 5] = (x, y) if g.rolls else (0.0, 0.0)
    g.phase[i] = ROLL if g.rolls else SLIP
