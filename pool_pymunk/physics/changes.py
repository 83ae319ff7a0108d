"""This module follows small changes of the inputs through the events of a run, to first order.

Between events a change evolves with the motion, and at a contact the saltation matrix multiplies
it. Python plays these functions with lists and with arrays of P inputs at once, and numba with
arrays and one input after the other. What the two must do differently is in physics/columns.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pool_pymunk.physics import errors
from pool_pymunk.physics.columns import (
    MOST_SIDES,
    advance,
    advance_slowing,
    any_of,
    columns,
    copy,
    greater,
    has_parted,
    is_beyond,
    is_changed,
    is_idle,
    is_of_errors,
    is_unknown,
    keep,
    path_of,
    saltate,
    surface_at,
    unknown_if,
    warn,
)
from pool_pymunk.physics.contact import split
from pool_pymunk.physics.kinks import SAME, ask, law_sides
from pool_pymunk.physics.motion import EPSILON, Vector
from pool_pymunk.physics.pairs import is_far
from pool_pymunk.physics.path import Path, motion_at, set_off, sets_off, standing
from pool_pymunk.physics.saltation import (
    AGREE,
    BLUR,
    GAP,
    GRAZE,
    LAW,
    MOST,
    TURN,
    Geometry,
    is_now,
    meeting,
    touching,
)
from pool_pymunk.physics.surface import (
    NO_ROLL,
    longer,
    roll_rate,
    rolling_on,
    slide_or_roll,
    slipping,
    slowing,
    stops_later,
)
from pool_pymunk.physics.touches import (
    NEVER,
    is_at_corner,
    is_beside,
    touch_of_discs,
    touch_of_face,
)

# An event has its time, its ball, and what that meets: another ball, or a wall, which is -1 - its
# number; pockets come after the walls. Or the ball comes to rest, or begins to roll.
STOP = -(1 << 30)
ROLL = STOP - 1
ROUNDED = 64.0 * EPSILON  # of a unit of an input; rounding changes a gap by as much
ANYTHING = STOP - 2  # stands for all that a ball may meet

# why there is no derivative
REASONS = (
    "",
    "it was not known before",
    "contacts of one instant share a ball",
    "the run was cut off at a contact",
    "the run ends just at a contact",
    "a ball comes to rest just as it is hit, or just where it touches",
    "a contact is persistent, or answered by a policy",
    "a ball meets a cushion just where a corner begins",
    "a contact is a graze",
    "law {} jumps or has a kink",
    "a contact is answered by a policy",
    "a ball grazes the rim of a pocket",
    f"the derivatives have grown beyond {MOST:g}",
    "a path touches what it does not hit",
    "balls touch at the start",
    "law {} has a kink, as between sticking and slipping",
    "a ball stops at contact, so the time of its stop has a kink",
    "a contact is persistent",
    "a ball comes to rest just as the run ends",
    "errors grow until other contacts may come",
    "a contact begins to persist just where the gap may open",
    "the forces of persistent contacts change twice at one instant",
    "a slip in persistent contact falls to zero and grows again, or turns until it has faded",
)
(
    FOLLOWED, KNOWN_BEFORE, SHARED, CUT_OFF, ENDS_THERE, RESTS_THERE, PERSISTS, AT_CORNER,
    IS_GRAZE, JUMPS, BY_POLICY, AT_RIM, GROWN, TOUCHES, TOUCH_FIRST, BENT, STOPPED, GOES_ON,
    RESTS_LAST, CHAOS, OPENS, TWICE, TURNS,
) = range(len(REASONS))  # fmt: skip


# What follows changes through a run by compiled code has a place here, where it is loaded. It
# returns why they cannot be followed, or None where it cannot be asked.
FASTER: list[Callable[[Any, Any], int | None]] = []


def start(g: Any, first: int) -> None:
    """Put the balls on their first paths, whose breakpoints are those from ``first`` on."""
    g.one.ends[3] = first
    for i in range(len(g.ball)):
        g.ball[i].at, g.ball[i].met = first + i, STOP
        for p in columns(g):
            g.ever[i, p] = is_changed(g.change[i], p)


def follow(g: Any, first: int, last: int) -> int:
    """Follow the changes through these events; return why errors cannot be followed, if so."""
    for k in range(first, last):
        why = go_through(g, k, first, last)
        if is_of_errors(g) and why != FOLLOWED:
            return why
    return FOLLOWED


def go_through(g: Any, k: int, first: int, last: int) -> int:
    """Follow the changes through one of these events; return why that cannot be, if so."""
    why = reason_at(g, k, first, last)
    if not is_of_errors(g):
        look_before(g, k, why)
    if why == FOLLOWED:
        why = take(g, k)
    if not is_of_errors(g):
        settle(g, k, why)
    return why


def look_before(g: Any, k: int, why: int) -> None:
    """Look for touches on the paths that an event ends."""
    t, i, j = time_and_balls(g, k)
    other = int(g.events[k][2])
    for n in range(1 if j == i else 2):
        met = other if n == 0 else i
        look(g, j if n == 1 else i, t, ANYTHING if why == SHARED else met, i)


def finish(g: Any) -> int:
    """Follow the changes to the end of the run; return why errors cannot be followed, if so."""
    t = g.one.ends[0]
    for i in range(len(g.ball)):
        following = g.following[g.ball[i].at]
        if following >= 0 and g.rows[following][1] < t:
            if is_of_errors(g):
                return GOES_ON
            lose(g, GOES_ON, i, i, g.rows[following][1])
        if not is_of_errors(g):
            look(g, i, t, STOP, i)
    for i in range(len(g.ball)):
        rests = g.one.ends[1] != 0.0 and rests_just_at(g, i, t)
        move(g, i, t)
        if rests and not is_of_errors(g):
            lose_velocity(g, i, t)
    return FOLLOWED


def lose_velocity(g: Any, i: int, t: float) -> None:
    """Lose what changes the velocity of a ball that rests just at the end; its place is smooth."""
    own = g.change[i]
    for p in columns(g):
        flag = is_changed(own, p)
        if any_of(flag):
            warn(g, RESTS_LAST, t)
        for k in range(2, len(own)):
            own[k, p] += unknown_if(flag)


# -- events ----------------------------------------------------------------------------------------


def time_and_balls(g: Any, k: int) -> tuple[float, int, int]:
    """Return when an event comes, and its balls, or its only ball twice."""
    i, other = int(g.events[k][1]), int(g.events[k][2])
    return g.events[k][0], i, other if other >= 0 else i


def reason_at(g: Any, k: int, first: int, last: int) -> int:
    """Return why an event has no derivative, as far as its time tells."""
    (t, i, j), other = time_and_balls(g, k), g.events[k][2]
    if is_of_errors(g):
        return SHARED if shares_a_ball(g, k, first, k) else FOLLOWED
    if is_unknown(g.change[i]) or is_unknown(g.change[j]):
        return KNOWN_BEFORE
    if other <= STOP:
        return FOLLOWED
    if shares_a_ball(g, k, first, last):
        return SHARED
    if t == g.one.ends[0] and g.one.ends[2] != 0.0:
        return CUT_OFF
    if g.one.ends[1] != 0.0 and is_at(g, t, g.one.ends[0], i, j):
        return ENDS_THERE
    return RESTS_THERE if rests_just_at(g, i, t) or rests_just_at(g, j, t) else FOLLOWED


def take(g: Any, k: int) -> int:
    """Take the changes through an event; return why that cannot be, if so."""
    (t, i, j), other = time_and_balls(g, k), int(g.events[k][2])
    row = g.rows[g.ball[i].at]
    errors.begin(g, i + j + max(-1 - other, 0) if other > STOP else g.ball[i].at)
    if other == STOP and row[4] == 0.0 and row[5] == 0.0:
        if not is_of_errors(g):
            warn(g, STOPPED, t)
        for p in columns(g):
            g.late[p] = math.nan
        come_to(g, i, t)
        return FOLLOWED
    for n in (i, j):
        following = g.following[g.ball[n].at]
        if following < 0 or g.rows[following][1] != t:
            return AT_RIM if is_pocket(g, other) else PERSISTS
    if other == STOP:
        return stop(g, i, t)
    if other == ROLL:
        return begin_to_roll(g, i, t)
    return fall(g, i, other, t) if is_pocket(g, other) else meet(g, i, other, t)


def is_pocket(g: Any, other: int) -> bool:
    """Tell whether what a ball meets is a pocket; pockets come after the cushions."""
    return other > STOP and other < -g.cushions


def settle(g: Any, k: int, why: int) -> None:
    """Note what an event has changed, and lose what is not known after it."""
    t, i, j = time_and_balls(g, k)
    if why == FOLLOWED and (is_beyond(g.change[i]) or (j != i and is_beyond(g.change[j]))):
        lose(g, GROWN, i, j, t)
    elif why != FOLLOWED:
        lose(g, why, i, j, t)
        for p in columns(g):
            g.late[p] = math.nan
    keep(g, k, i, j, t)
    for c in range(1 if j == i else 2):
        n = i if c == 0 else j
        for p in columns(g):
            if why == FOLLOWED:
                g.ever[n, p] = g.ever[n, p] | is_changed(g.change[n], p)
            else:
                g.ever[n, p] = True


def shares_a_ball(g: Any, k: int, first: int, last: int) -> bool:
    """Tell whether a contact has a ball in common with another event of its instant."""
    t, i, j = time_and_balls(g, k)
    if g.events[k][2] <= STOP:
        return False
    for step in (-1, 1):
        n = k + step
        while first <= n < last:
            now, one, other = time_and_balls(g, n)
            if now != t and (is_of_errors(g) or not is_at(g, now, t, i, j)):
                break
            # A contact may have stopped the ball.
            counts = g.events[n][2] != STOP or (n < k and not is_of_errors(g))
            if counts and (one in (i, j) or other in (i, j)):
                return True
            n += step
    return False


def is_at(g: Any, t: float, now: float, i: int, j: int) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of two balls."""
    fastest = size = 0.0
    for n in (i, j):
        row = g.rows[g.ball[n].at]
        fastest = max(fastest, max(abs(row[4]), abs(row[5])))
        size = max(size, abs(row[2]) + abs(row[3]) + g.ball[n].radius)
    return is_now(t, now, fastest, size)


def rests_just_at(g: Any, i: int, t: float) -> bool:
    """Tell whether a ball that moved comes to rest at this time (s)."""
    row, balls = g.rows[g.ball[i].at], len(g.ball)
    moved = row[4] != 0.0 or row[5] != 0.0 or g.ball[i].at >= g.one.ends[3] + balls
    return moved and is_at(g, end_of(g, row), t, i, i)


def end_of(g: Any, row: Any) -> float:
    """Return when (s) the path of a breakpoint ends."""
    t, place, velocity, pull = row[1], (row[2], row[3]), (row[4], row[5]), g.one.numbers[3]
    if len(g.change[0]) > 4:
        return slide_or_roll(t, place, velocity, (row[8], row[9]), pull, g.one.numbers[6]).end
    return set_off(t, place, velocity, pull).end


def stop(g: Any, i: int, t: float) -> int:
    """Let a ball come to rest: changes of its place stay."""
    own = g.change[i]
    if not is_of_errors(g):
        note_end(g, i)
    move(g, i, t)
    for p in columns(g):
        for k in range(2, len(own)):
            own[k, p] *= 0.0  # What is unknown stays so.
    come_to(g, i, t)
    return FOLLOWED


def begin_to_roll(g: Any, i: int, t: float) -> int:
    """Let a ball begin to roll: its acceleration changes, and its slip is gone."""
    before, own = g.rows[g.ball[i].at], g.change[i]
    note_end(g, i)
    move(g, i, t)
    errors.delay(g, before, t)
    come_to(g, i, t)
    after = g.rows[g.ball[i].at]
    for p in columns(g):
        own[2, p] += (before[6] - after[6]) * g.late[p]
        own[3, p] += (before[7] - after[7]) * g.late[p]
        own[4, p], own[5, p] = own[2, p], own[3, p]
    return FOLLOWED


def fall(g: Any, i: int, hole: int, t: float) -> int:
    """Let a ball fall into its pocket, where it stays."""
    own, (x, y, vx, vy) = g.change[i], motion_at(path_of(g, i), t)
    (nx, ny), bends = surface_at(g, -1 - hole, x, y, 0.0)
    closing = -(vx * nx + vy * ny)
    move(g, i, t)
    is_graze = errors.may_miss(g, own, (vx, vy), (nx, ny), bends)
    if is_graze or (not is_of_errors(g) and closing <= GRAZE * max(abs(vx), abs(vy))):
        return AT_RIM
    for p in columns(g):
        g.late[p] = (nx * own[0, p] + ny * own[1, p]) / closing
        for k in range(len(own)):
            own[k, p] *= 0.0
    come_to(g, i, t)
    g.ball[i].gone = 1
    return FOLLOWED


# -- contacts --------------------------------------------------------------------------------------


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


# -- touches ---------------------------------------------------------------------------------------


def look(g: Any, i: int, t: float, met: int, done: int) -> None:
    """Lose what touches decide on the path of a ball up to ``t`` (s), where it has ``met`` another.

    A path may be tangent to a ball, a corner, an arc or the rim of a pocket. It may run along a
    cushion, or end just where it touches. A small change makes a contact there or leaves a gap, so
    the ends have a kink. Ball ``done`` was looked at before.
    """
    path, radius = path_of(g, i), g.ball[i].radius
    is_still = not sets_off(path)
    if g.ball[i].gone:
        return
    if not is_still:
        look_at_table(g, i, path, t, met)
    for j in range(len(g.ball)):
        if j in (i, done) or g.ball[j].gone:
            continue
        other = path_of(g, j)
        since = max(path.t, other.t)
        if since >= t or (is_still and not sets_off(other)):
            continue
        begins, apart = not (g.ball[i].met == j and g.ball[j].met == i), radius + g.ball[j].radius
        if is_far(path, other, t, apart):
            continue
        begins = (begins or path.t != other.t) and not has_parted(g, i, j)
        along, turns = touch_of_discs(
            path, other, t, apart, 1.0, (begins, met != j and met != ANYTHING)
        )
        if along:
            touch(g, (i, j), since, NO_ROLL)
        if turns != NEVER:
            touch(g, (i, j), turns, NO_ROLL)


def look_at_table(g: Any, i: int, path: Path, t: float, met: int) -> None:
    """Lose what touches of the table, of a post or of a rim decide."""
    radius = g.ball[i].radius
    for k in range(len(g.discs) + len(g.faces)):
        is_disc = k < len(g.discs)
        thing = g.discs[k] if is_disc else g.faces[k - len(g.discs)]
        wall = -1 - int(thing[4 if is_disc else 7])
        begins = g.ball[i].met != wall and not has_parted(g, i, wall)
        free = begins, met != wall and met != ANYTHING
        if is_disc:
            still, apart = standing(0.0, thing[0], thing[1]), thing[2] + thing[3] * radius
            along, turns = touch_of_discs(path, still, t, apart, thing[3], free)
            along = along and is_beside(thing, path.x, path.y)
            if turns != NEVER:
                x, y, _, _ = motion_at(path, turns)
                turns = turns if is_beside(thing, x, y) else NEVER
        else:
            along, turns = touch_of_face(path, thing, t, radius, free)
        across = NO_ROLL if is_disc else (thing[4], thing[5])
        if along:
            touch(g, (i, i), path.t, across)
        if turns != NEVER:
            touch(g, (i, i), turns, across)


def touch(g: Any, balls: tuple[int, int], t: float, across: Vector) -> None:
    """Lose the derivatives at a touch: a contact there acts by the root of the gap's change.

    Every input that has changed one of the balls therefore matters, even to second order. At a face
    with a normal ``across``, a ball that a persistent contact has led along it stays at it.
    """
    i, j = balls
    was_known = not is_unknown(g.change[i]) and not is_unknown(g.change[j])
    for p in columns(g):
        matters = g.ever[i, p] | g.ever[j, p]
        for n in (i, j):
            matters = matters | (g.of_radius[n, p] != 0.0)
            row = g.rows[g.ball[n].at]
            if sets_off(path_of(g, n)) and t > row[1]:
                pull = g.of_numbers[3 if is_sliding(row, len(g.change[0])) else 6, p]
                matters = matters | (pull != 0.0)
        matters = matters & moves_across(g, i, across, p)
        if was_known and any_of(matters):
            warn(g, TOUCHES, t)
        for n in (i, j):
            for k in range(len(g.change[n])):
                g.change[n, k, p] += unknown_if(matters)
            g.ever[n, p] = g.ever[n, p] | matters
    keep(g, -1, i, j, t)


def moves_across(g: Any, i: int, across: Vector, p: Any) -> Any:
    """Tell whether an input changes how far a ball is from a face, or how fast it parts from it."""
    own, (nx, ny) = g.change[i], across
    found = (own[0, p] != own[0, p]) | (nx == 0.0 and ny == 0.0)
    for k in range(0, len(own), 2):
        part = nx * own[k, p] + ny * own[k + 1, p] - (g.of_radius[i, p] if k == 0 else 0.0)
        found = found | (abs(part) > SAME * (abs(own[k, p]) + abs(own[k + 1, p])) + ROUNDED)
    return found


# -- motion ----------------------------------------------------------------------------------------


def is_sliding(row: Any, size: int) -> bool:
    """Tell whether a ball slides from a breakpoint on, and does not roll."""
    return size == 4 or row[4] != row[8] or row[5] != row[9]


def move(g: Any, i: int, t: float) -> None:
    """Take the change of a ball along its path to a time (s), with the errors that this makes."""
    carry(g, g.rows[g.ball[i].at], g.change[i], t)
    errors.misplace(g, i, t)


def carry(g: Any, row: Any, own: Any, t: float) -> None:
    """Take a change from a breakpoint along the path to a time (s)."""
    vx, vy, time, pull, drag = row[4], row[5], t - row[1], g.one.numbers[3], g.one.numbers[6]
    if len(own) == 4:
        by_state, by_pull = slowing(vx, vy, time, pull)
        advance_slowing(g, own, by_state, by_pull, g.of_numbers[3])
    elif is_sliding(row, len(own)):
        by_state, by_pull = slipping((vx - row[8], vy - row[9]), time, pull)
        advance(g, own, by_state, by_pull, g.of_numbers[3])
    elif time > 0.0:
        by_state, by_pull = rolling_on(vx, vy, time, drag)
        advance(g, own, by_state, by_pull, g.of_numbers[6])


def note_end(g: Any, i: int) -> None:
    """Note how much later (s) the path of a ball ends, by the change at its beginning."""
    row, own, of_numbers = g.rows[g.ball[i].at], g.change[i], g.of_numbers
    vx, vy, pull, drag = row[4], row[5], g.one.numbers[3], g.one.numbers[6]
    for p in columns(g):
        u, v = own[2, p], own[3, p]
        if len(own) == 4:
            g.late[p] = stops_later(vx, vy, pull, u, v, of_numbers[3, p])
        elif not is_sliding(row, len(own)):
            g.late[p] = stops_later(vx, vy, drag, u, v, of_numbers[6, p])
        else:
            u, v = u - own[4, p], v - own[5, p]
            g.late[p] = longer(vx - row[8], vy - row[9], pull, u, v, of_numbers[3, p])


def come_to(g: Any, i: int, t: float) -> None:
    """Go on to a ball's last breakpoint of this time."""
    while g.following[g.ball[i].at] >= 0 and g.rows[g.following[g.ball[i].at]][1] <= t:
        g.ball[i].at, g.ball[i].met = g.following[g.ball[i].at], STOP


def lose(g: Any, why: int, i: int, j: int, t: float) -> None:
    """Note that two balls have no derivatives from ``t`` (s) on, and why."""
    if why != KNOWN_BEFORE:
        warn(g, why, t)
    for n in (i, j):
        for p in columns(g):
            for k in range(len(g.change[n])):
                g.change[n, k, p] = math.nan
        come_to(g, n, t)
