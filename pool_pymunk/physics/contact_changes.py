"""This module takes small changes through a contact of a run, by its saltation matrix.

The four things that a contact does to changes are in :mod:`pool_pymunk.physics.saltation`.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.physics import errors
from pool_pymunk.physics.columns import (
    MOST_SIDES,
    any_of,
    columns,
    copy,
    greater,
    is_idle,
    is_of_errors,
    path_of,
    saltate,
    surface_at,
    unknown_if,
    warn,
)
from pool_pymunk.physics.contact import split
from pool_pymunk.physics.kinks import SAME, ask, law_sides
from pool_pymunk.physics.motion_changes import (
    AT_CORNER,
    BENT,
    BY_POLICY,
    CHAOS,
    FOLLOWED,
    IS_GRAZE,
    JUMPS,
    TOUCH_FIRST,
    is_at,
    move,
)
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.saltation import (
    AGREE,
    BLUR,
    GAP,
    GRAZE,
    LAW,
    TURN,
    Geometry,
    meeting,
    touching,
)
from pool_pymunk.physics.surface import NO_ROLL, roll_rate
from pool_pymunk.physics.touches import is_at_corner


def meet(g: Any, i: int, other: int, t: float) -> int:
    """Follow the changes through a hit of two balls, or of a ball on a wall."""
    size, balls = len(g.change[0]), 2 if other >= 0 else 1
    fastest, extent = read_motions(g, i, other, t)
    geometry = geometry_at(g, i, other)
    for c in range(balls):
        after = g.rows[g.following[g.ball[i if c == 0 else other].at]]
        put_rates(g.one.after, c * size, size, after[4], after[5], after)
    if not is_of_errors(g):
        if other < 0 and is_at_corner(g.corners, g.one.place[0], g.one.place[1], g.ball[i].radius):
            return AT_CORNER
        if geometry.closing <= GRAZE * fastest or geometry.depth <= BLUR * extent:
            return IS_GRAZE
    gather(g, i, other, t)
    geometry = errors.with_gap(g, geometry, i, other, t)
    if geometry.closing == math.inf:
        return CHAOS
    if not is_of_errors(g):
        note_late(g, geometry, i, other, t)
    why = answer(g, geometry, i, other, fastest, t)
    if why != FOLLOWED:
        return why
    saltate(g, geometry, balls, roll_of(g, i, t) if size > 4 else NO_ROLL)
    errors.make(g, geometry, i, other)
    for c in range(balls):
        n = i if c == 0 else other
        copy(g.z[c * size : (c + 1) * size], g.change[n])
        if not is_of_errors(g):
            lose_where(g, n)
        g.ball[n].at, g.ball[n].met = g.following[g.ball[n].at], i if c == 1 else other
    return FOLLOWED


def read_motions(g: Any, i: int, other: int, t: float) -> tuple[float, float]:
    """Read how the balls of a contact move at a time (s).

    Return the largest part of a velocity (m/s), and how large (m) their places are.
    """
    size, fastest, extent = len(g.change[0]), 0.0, 0.0
    for c in range(2 if other >= 0 else 1):
        n = i if c == 0 else other
        x, y, vx, vy = motion_at(path_of(g, n), t)
        g.one.place[2 * c], g.one.place[2 * c + 1] = x, y
        put_rates(g.one.before, c * size, size, vx, vy, g.rows[g.ball[n].at])
        fastest = max(fastest, max(abs(vx), abs(vy)))
        extent += abs(x) + abs(y) + g.ball[n].radius
    return fastest, extent


def note_late(g: Any, geometry: Geometry, i: int, other: int, t: float) -> None:
    """Note how late a contact comes; that is unknown where balls touch at the start."""
    is_first = is_at(g, t, 0.0, i, max(i, other))
    for p in columns(g):
        late = put_parts(g, geometry, 2 if other >= 0 else 1, p)
        flag = (late != 0.0) & is_first
        g.bad[p] = unknown_if(flag)
        g.late[p] = late + g.bad[p]
        if any_of(flag):
            warn(g, TOUCH_FIRST, t)


def lose_where(g: Any, i: int) -> None:
    """Lose the change of a ball by inputs at whose kink a contact is."""
    for p in columns(g):
        if any_of(g.bad[p] != 0.0):
            for k in range(len(g.change[i])):
                g.change[i, k, p] += g.bad[p]


def roll_of(g: Any, i: int, t: float) -> Any:
    """Return the roll (m/s) of a ball at a time (s)."""
    row = g.rows[g.ball[i].at]
    (ax, ay), time = roll_rate(row), t - row[1]
    return row[8] + time * ax, row[9] + time * ay


def put_rates(rates: Any, first: int, size: int, vx: float, vy: float, row: Any) -> None:
    """Write how fast a ball's state changes on the path of a breakpoint."""
    rates[first], rates[first + 1], rates[first + 2], rates[first + 3] = vx, vy, row[6], row[7]
    if size > 4:
        rates[first + 4], rates[first + 5] = roll_rate(row)


def geometry_at(g: Any, i: int, other: int) -> Geometry:
    """Return the geometry of a contact of a ball with another one, or with a wall."""
    x, y, size = g.one.place[0], g.one.place[1], len(g.change[0])
    own = x, y, g.one.before[0], g.one.before[1], g.one.before[2], g.one.before[3]
    if other < 0:
        normal, curvature = surface_at(g, -1 - other, x, y, g.ball[i].radius)
        return touching(own, normal, curvature)
    vx, vy, ax, ay = (
        g.one.before[size],
        g.one.before[size + 1],
        g.one.before[size + 2],
        g.one.before[size + 3],
    )
    return meeting(own, (g.one.place[2], g.one.place[3], vx, vy, ax, ay))


def gather(g: Any, i: int, other: int, t: float) -> None:
    """Take the changes of the balls to a contact, and gather all that it depends on in ``z``."""
    balls, size = 2 if other >= 0 else 1, len(g.change[0])
    rows = balls * size
    for c in range(balls):
        n = i if c == 0 else other
        move(g, n, t)
        copy(g.change[n], g.z[c * size : (c + 1) * size])
    g.z[rows:] = 0.0
    if not is_of_errors(g):
        gather_numbers(g, i, other, rows)


def gather_numbers(g: Any, i: int, other: int, rows: int) -> None:
    """Gather the changes of the gap, and of what the law is asked with, after so many rows."""
    e, law = 1 if g.cue in (i, other) else 0, rows + LAW
    for p in columns(g):
        g.z[rows + GAP, p] = -g.of_radius[i, p]
        if other >= 0:
            g.z[rows + GAP, p] -= g.of_radius[other, p]
            g.z[law, p], g.z[law + 1, p] = g.of_mass[i, p], g.of_mass[other, p]
            g.z[law + 2, p], g.z[law + 3, p] = g.of_numbers[e, p], g.of_numbers[5, p]
        else:
            has_e, has_mu = owns(g, -1 - other)
            g.z[law, p] = g.of_numbers[2, p] * (not has_e)
            g.z[law + 1, p] = g.of_numbers[4, p] * (not has_mu)


def owns(g: Any, wall: int) -> tuple[bool, bool]:
    """Tell whether a wall has its own restitution, and whether it has its own friction."""
    return g.own[wall][0] >= 0.0, g.own[wall][1] >= 0.0


def put_parts(g: Any, geometry: Geometry, balls: int, p: Any) -> Any:
    """Write what changes of the velocities' parts, and how far the normal turns, at a contact.

    Return how late (s) it comes.
    """
    z, size, (nx, ny) = g.z, len(g.change[0]), geometry.normal
    if is_idle(g, p):
        for k in range(len(g.parts)):
            g.parts[k, p] = 0.0
        return 0.0
    rows, x, y = balls * size, g.z[0, p], g.z[1, p]
    if balls == 2:
        x, y = z[size, p] - x, z[size + 1, p] - y
    late = (nx * x + ny * y + z[rows + GAP, p]) / geometry.closing
    turn = geometry.curvature * (nx * y - ny * x + geometry.slip * late) + z[rows + TURN, p]
    g.parts[4, p] = turn
    for c in range(balls):
        k, vx, vy = c * size, g.one.before[c * size], g.one.before[c * size + 1]
        u, v = z[k + 2, p] + g.one.before[k + 2] * late, z[k + 3, p] + g.one.before[k + 3] * late
        g.parts[2 * c, p] = nx * u + ny * v + (vy * nx - vx * ny) * turn
        g.parts[2 * c + 1, p] = nx * v - ny * u - (vx * nx + vy * ny) * turn
    return late


def answer(g: Any, geometry: Geometry, i: int, other: int, fastest: float, t: float) -> int:
    """Write the law's derivatives, the mean of those on all sides; nan where these differ."""
    balls, size, x = 2 if other >= 0 else 1, len(g.change[0]), g.one.asked
    for c in range(balls):
        k = c * size
        x[2 * c], x[2 * c + 1] = split((g.one.before[k], g.one.before[k + 1]), geometry.normal)
    if balls == 2:
        x[4], x[5], x[7] = g.ball[i].mass, g.ball[other].mass, g.one.numbers[5]
        x[6] = g.one.numbers[1 if g.cue in (i, other) else 0]
    else:
        has_e, has_mu = owns(g, -1 - other)
        own = g.own[-1 - other]
        x[2], x[3] = own[0] if has_e else g.one.numbers[2], own[1] if has_mu else g.one.numbers[4]
    sides = law_sides(g, balls, is_moved(g, 0), balls == 2 and is_moved(g, 1), fastest)
    if sides == 0:
        return JUMPS
    ask(g.law, x, balls, g.one.answers[MOST_SIDES])
    for c in range(balls):
        k = c * size
        n, across = split((g.one.after[k], g.one.after[k + 1]), geometry.normal)
        off = max(abs(n - g.one.answers[MOST_SIDES][2 * c]),
                  abs(across - g.one.answers[MOST_SIDES][2 * c + 1]))  # fmt: skip
        if off > AGREE * fastest:
            return BY_POLICY
    if sides > 1 and not is_of_errors(g):
        for p in columns(g):
            flag = is_bent(g, sides, balls, p)
            g.bad[p] += unknown_if(flag)
            if any_of(flag):
                warn(g, BENT, t)
    take_mean(g, sides, balls)
    return FOLLOWED


def take_mean(g: Any, sides: int, balls: int) -> None:
    """Write the mean of the law's derivatives on some sides in place of those on the first."""
    for m in range(2 * balls if sides > 1 else 0):
        for k in range(4 * balls):
            total = 0.0
            for side in range(sides):
                total += g.one.slopes[side][m][k]
            g.one.slopes[0][m][k] = total / sides


def is_moved(g: Any, ball: int) -> bool:
    """Tell whether an input changes the tangential velocity of the first ball, or the second."""
    if is_of_errors(g):
        return bool(g.one.asked[2 * ball] != 0.0 or g.one.asked[2 * ball + 1] != 0.0)
    found = False
    for p in columns(g):
        found |= any_of(g.parts[2 * ball + 1, p] != 0.0)
    return found


def is_bent(g: Any, sides: int, balls: int, p: Any) -> Any:
    """Tell whether the changes after a contact differ from side to side of a kink."""
    count, law = 2 * balls, balls * len(g.change[0]) + LAW
    most, size, found = 0.0, abs(g.parts[0, p]), False & (g.parts[0, p] != 0.0)
    for side in range(sides):
        for m in range(count):
            for k in range(2 * count):
                most = max(most, abs(g.one.slopes[side][m][k]))
    for k in range(2 * count):
        size = greater(size, abs(g.parts[k, p] if k < count else g.z[law + k - count, p]))
    for side in range(1, sides):
        for m in range(count):
            off = 0.0 * size
            for k in range(2 * count):
                by = g.one.slopes[side][m][k] - g.one.slopes[0][m][k]
                off += by * (g.parts[k, p] if k < count else g.z[law + k - count, p])
            found = found | (abs(off) > SAME * most * size)
    return found
