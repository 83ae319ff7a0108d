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
    any_of,
    columns,
    is_beyond,
    is_changed,
    is_of_errors,
    is_unknown,
    keep,
    path_of,
    surface_at,
    unknown_if,
    warn,
)
from pool_pymunk.physics.contact_changes import meet
from pool_pymunk.physics.kinks import SAME
from pool_pymunk.physics.motion import Vector
from pool_pymunk.physics.motion_changes import (
    ANYTHING,
    AT_BORDER,
    AT_RIM,
    CUT_OFF,
    ENDS_THERE,
    FOLLOWED,
    GOES_ON,
    GROWN,
    KNOWN_BEFORE,
    LASTS,
    OUT,
    PERSISTS,
    RESTS_LAST,
    RESTS_THERE,
    ROLL,
    ROUNDED,
    SHARED,
    STOP,
    STOPPED,
    TOUCHES,
    come_to,
    end_of,
    friction_of,
    is_at,
    is_sliding,
    lose,
    move,
    note_end,
)
from pool_pymunk.physics.pairs import is_far
from pool_pymunk.physics.patches import normal_at
from pool_pymunk.physics.path import Path, motion_at, sets_off, standing
from pool_pymunk.physics.saltation import GRAZE
from pool_pymunk.physics.surface import NO_ROLL, roll_rate
from pool_pymunk.physics.touches import NEVER, is_beside, touch_of_discs, touch_of_face

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
    catch_up(g, t)
    meets_some = why == SHARED or other == LASTS
    for n in range(1 if j == i else 2):
        met = other if n == 0 else i
        look(g, j if n == 1 else i, t, ANYTHING if meets_some else met, i)


def catch_up(g: Any, t: float) -> None:
    """Let balls of which nothing is known go on to their last breakpoints before a time (s).

    In a persistent contact they have breakpoints that are no events. Others may touch them there.
    """
    for i in range(len(g.ball)):
        following = g.following[g.ball[i].at]
        while following >= 0 and g.rows[following][1] < t and is_unknown(g.change[i]):
            look_at_balls(g, i, g.rows[following][1], ANYTHING, i)
            g.ball[i].at, g.ball[i].met = following, STOP
            following = g.following[following]


def finish(g: Any) -> int:
    """Follow the changes to the end of the run; return why errors cannot be followed, if so."""
    t = g.one.ends[0]
    if not is_of_errors(g):
        catch_up(g, t)
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


def time_and_balls(g: Any, k: int) -> tuple[float, int, int]:
    """Return when an event comes, and its balls, or its only ball twice."""
    i, other = int(g.events[k][1]), int(g.events[k][2])
    return g.events[k][0], i, other if other >= 0 else i


def reason_at(g: Any, k: int, first: int, last: int) -> int:
    """Return why an event has no derivative, as far as its time tells."""
    (t, i, j), other = time_and_balls(g, k), g.events[k][2]
    if is_of_errors(g):
        if other == LASTS:
            return GOES_ON
        return SHARED if shares_a_ball(g, k, first, k) else FOLLOWED
    if is_unknown(g.change[i]) or is_unknown(g.change[j]):
        return KNOWN_BEFORE
    if other == LASTS:
        return GOES_ON
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
    if other <= OUT:
        return cross(g, i, t)
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
            counts = counts and g.events[n][2] != LASTS
            if counts and (one in (i, j) or other in (i, j)):
                return True
            n += step
    return False


def rests_just_at(g: Any, i: int, t: float) -> bool:
    """Tell whether a ball that moved comes to rest at this time (s)."""
    row, balls = g.rows[g.ball[i].at], len(g.ball)
    moved = row[4] != 0.0 or row[5] != 0.0 or g.ball[i].at >= g.one.ends[3] + balls
    return moved and is_at(g, end_of(g, row, t), t, i, i)


def stop(g: Any, i: int, t: float) -> int:
    """Let a ball come to rest: changes of its place stay."""
    own = g.change[i]
    if not is_of_errors(g):
        note_end(g, i, t)
    move(g, i, t)
    for p in columns(g):
        for k in range(2, len(own)):
            own[k, p] *= 0.0  # What is unknown stays so.
    come_to(g, i, t)
    return FOLLOWED


def begin_to_roll(g: Any, i: int, t: float) -> int:
    """Let a ball begin to roll: its acceleration changes, and its slip is gone."""
    before, own = g.rows[g.ball[i].at], g.change[i]
    note_end(g, i, t)
    move(g, i, t)
    errors.delay(g, before, t)
    come_to(g, i, t)
    after = g.rows[g.ball[i].at]
    for p in columns(g):
        own[2, p] += (before[6] - after[6]) * g.late[p]
        own[3, p] += (before[7] - after[7]) * g.late[p]
        own[4, p], own[5, p] = own[2, p], own[3, p]
    return FOLLOWED


def cross(g: Any, i: int, t: float) -> int:
    """Let a ball cross the border of a patch: its acceleration changes, sooner or later."""
    before, own, (x, y, vx, vy) = g.rows[g.ball[i].at], g.change[i], motion_at(path_of(g, i), t)
    nx, ny = normal_at(g.borders, len(g.borders), x, y)
    across = nx * vx + ny * vy
    move(g, i, t)
    is_graze = abs(across) <= GRAZE * max(abs(vx), abs(vy))
    if is_graze or (not is_of_errors(g) and is_at(g, t, 0.0, i, i)):
        return AT_BORDER
    for p in columns(g):
        g.late[p] = -(nx * own[0, p] + ny * own[1, p]) / across
    errors.delay(g, before, t)
    come_to(g, i, t)
    after = g.rows[g.ball[i].at]
    (px, py), (qx, qy) = roll_rate(before), roll_rate(after)
    for p in columns(g):
        own[2, p] += (before[6] - after[6]) * g.late[p]
        own[3, p] += (before[7] - after[7]) * g.late[p]
        if len(own) > 4:
            own[4, p] += (px - qx) * g.late[p]
            own[5, p] += (py - qy) * g.late[p]
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


def look(g: Any, i: int, t: float, met: int, done: int) -> None:
    """Lose what touches decide on the path of a ball up to ``t`` (s), where it has ``met`` another.

    A path may be tangent to a ball, a corner, an arc or the rim of a pocket. It may run along a
    cushion, or end just where it touches. A small change makes a contact there or leaves a gap, so
    the ends have a kink. Ball ``done`` was looked at before.
    """
    if g.ball[i].gone:
        return
    path = path_of(g, i)
    if sets_off(path):
        look_at_table(g, i, path, t, met)
    look_at_balls(g, i, t, met, done)


def look_at_balls(g: Any, i: int, t: float, met: int, done: int) -> None:
    """Lose what touches of other balls decide on the path of a ball up to ``t`` (s)."""
    path, radius = path_of(g, i), g.ball[i].radius
    is_still = not sets_off(path)
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
        begins = begins or path.t != other.t
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
        free = g.ball[i].met != wall, met != wall and met != ANYTHING
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
    with a normal ``across``, inputs that move a ball along it alone do not: the ball stays at it.
    """
    i, j = balls
    was_known = not is_unknown(g.change[i]) and not is_unknown(g.change[j])
    for p in columns(g):
        matters = g.ever[i, p] | g.ever[j, p]
        for n in (i, j):
            matters = matters | (g.of_radius[n, p] != 0.0)
            row = g.rows[g.ball[n].at]
            if sets_off(path_of(g, n)) and t > row[1]:
                _, _, of_pull, of_drag = friction_of(g, row, t)
                pull = g.of_numbers[of_pull if is_sliding(row, len(g.change[0])) else of_drag, p]
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
