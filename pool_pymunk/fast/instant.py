"""This module finds what comes at one instant of a compiled shot, and what touches then."""

from __future__ import annotations

import math

from pool_pymunk.engine import decisions
from pool_pymunk.engine.instants import has_met
from pool_pymunk.engine.policies import nearly_closed
from pool_pymunk.fast.due import path_of
from pool_pymunk.fast.kinds import gap
from pool_pymunk.fast.records import MOST_TOGETHER, NOTHING, Sides, Work
from pool_pymunk.fast.walls import meeting_time, nearest, rounding
from pool_pymunk.physics.path import motion_at

# -- what comes at this instant --------------------------------------------------------------------


def latest_of(w: Work, i: int, j: int) -> float:
    """Return until when (s) contacts come at the same instant as this one of ball ``i``."""
    speed = w.ball[i].speed
    if j >= 0:
        speed = max(speed, w.ball[j].speed)
    return float(w.now + decisions.nearly_now(w.ball[i].radius, speed))


def gather(w: Work, sides: Sides, i: int, j: int) -> None:
    """Put the contacts of this instant into ``due``.

    The contact of ball ``i`` with ball ``j`` or a wall is among them. Their order is that of their
    numbers: pairs of balls first, then balls and walls.
    """
    at, balls, latest = w.instant, w.scene.balls, latest_of(w, i, j)
    at.dues = 0
    for k in range(balls):
        if w.due[k].ball_t <= latest:
            for m in range(k + 1, balls):
                is_first = k == i and m == j
                is_now = w.pair_t[k, m] <= min(latest, latest_of(w, k, m))
                if is_first or (is_now and touch(w, k, m, 1.0)):
                    note_due(w, k, m)
    for k in range(balls):
        if w.due[k].wall_t <= latest:
            for n in range(len(sides)):
                is_first = j < 0 and k == i and sides[n].wall == sides[w.due[k].side].wall
                is_due = is_first or (sides[n].first == n and meets_wall(w, sides, k, n, latest))
                if is_due and sides[n].first == n:
                    note_due(w, k, -1 - n)


def note_due(w: Work, i: int, other: int) -> None:
    """Put a contact of a ball, with another one or with a wall, into ``due``, if there is room."""
    at = w.instant
    if at.dues == MOST_TOGETHER:
        w.is_hard = 1
        return
    at.due[at.dues, 0], at.due[at.dues, 1] = i, other
    at.dues += 1


def meets_wall(w: Work, sides: Sides, i: int, n: int, latest: float) -> bool:
    """Tell whether a ball meets a wall until ``latest`` (s), and touches it now."""
    ball, t = w.ball[i], math.inf
    for k in range(n, sides[n].last):
        t = min(t, meeting_time(sides[k], sides, path_of(ball), ball.radius, ball.t))
    return t <= min(latest, latest_of(w, i, NOTHING)) and touches_wall(w, sides, i, n, 1.0)


def touch(w: Work, i: int, j: int, times: float) -> bool:
    """Tell whether two balls touch now; the gap may be ``times`` as wide as a closed one."""
    x, y, _, _ = motion_at(path_of(w.ball[i]), w.now)
    touching = w.ball[i].radius + w.ball[j].radius
    return decisions.is_closed(gap_between(w, i, j) / times, x, y, touching)


def gap_between(w: Work, i: int, j: int) -> float:
    """Return the gap (m) between two balls now."""
    x, y, _, _ = motion_at(path_of(w.ball[i]), w.now)
    u, v, _, _ = motion_at(path_of(w.ball[j]), w.now)
    dx, dy = u - x, v - y
    return float(math.sqrt(dx * dx + dy * dy) - w.ball[i].radius - w.ball[j].radius)


def touches_wall(w: Work, sides: Sides, i: int, n: int, times: float) -> bool:
    """Tell whether a ball touches now the wall whose first side is ``n``."""
    x, y, _, _ = motion_at(path_of(w.ball[i]), w.now)
    r = w.ball[i].radius
    room = gap(nearest(sides[n], sides, w.now, x, y, r), x, y, r)
    room -= rounding(sides[n], sides, w, i, x, y)
    return decisions.is_closed(room / times, x, y, r)


def gap_to_wall(w: Work, sides: Sides, i: int, n: int) -> float:
    """Return the gap (m) between a ball and the wall whose first side is ``n`` now."""
    x, y, _, _ = motion_at(path_of(w.ball[i]), w.now)
    r = w.ball[i].radius
    return float(gap(nearest(sides[n], sides, w.now, x, y, r), x, y, r))


# -- what touches ----------------------------------------------------------------------------------


def spread(w: Work, found: int) -> None:
    """Mark all balls in the cluster of the ``found`` ones."""
    at, done = w.instant, 0
    while done < found:
        i = at.queue[done]
        done += 1
        for j in range(w.scene.balls):
            if not at.is_near[j] and touches_ball(w, min(i, j), max(i, j)):
                at.is_near[j], at.queue[found] = 1, j
                found += 1


def touches_ball(w: Work, i: int, j: int) -> bool:
    """Tell whether two balls are on the table, and touch now, or nearly so."""
    one, other = w.ball[i].box, w.ball[j].box
    is_apart = other[0] > one[2] or other[2] < one[0] or other[1] > one[3] or other[3] < one[1]
    return not is_apart and touch(w, i, j, nearly_closed(w.errors))


def find_cluster(w: Work, sides: Sides) -> None:
    """Let all contacts be ``due`` that touch in the cluster of what has met at this instant."""
    at, balls, found = w.instant, w.scene.balls, 0
    for i in range(balls):
        at.is_near[i] = 0
    for k in range(at.mets):
        for i in (at.met[k, 0], at.met[k, 1]):
            if i >= 0 and not at.is_near[i]:
                at.is_near[i], at.queue[found] = 1, i
                found += 1
    spread(w, found)
    at.dues = 0
    for i in range(balls):
        for j in range(i + 1, balls if at.is_near[i] else 0):
            if at.is_near[j] and (has_met(at, i, j) or touches_ball(w, i, j)):
                note_due(w, i, j)
    for i in range(balls):
        for n in range(len(sides)):
            if at.is_near[i] and sides[n].first == n and sides[n].pocket == NOTHING:
                touches = touches_wall(w, sides, i, n, nearly_closed(w.errors))
                if touches or has_met(at, i, -1 - n):
                    note_due(w, i, -1 - n)


def cluster_around(w: Work, sides: Sides, i: int) -> None:
    """Find all contacts in the cluster around a ball, for its group."""
    at, r, balls = w.instant, w.groups, w.scene.balls
    for k in range(balls):
        at.is_near[k] = 0
    at.is_near[i], at.queue[0], r.hits = 1, i, 0
    spread(w, 1)
    for k in range(balls):
        for j in range(k + 1, balls if at.is_near[k] else 0):
            if at.is_near[j] and touches_ball(w, k, j):
                note_touching(w, k, j)
    for k in range(balls):
        for n in range(len(sides)):
            is_cushion = sides[n].first == n and sides[n].pocket == NOTHING
            is_asked = is_cushion and at.is_near[k] != 0
            if is_asked and touches_wall(w, sides, k, n, nearly_closed(w.errors)):
                note_touching(w, k, -1 - n)


def note_touching(w: Work, i: int, other: int) -> None:
    """Put a contact among those of a group, if there is room."""
    r = w.groups
    if r.hits == len(r.hit):
        w.is_hard = 1
        return
    r.hit[r.hits][0], r.hit[r.hits][1] = i, other
    r.hits += 1
