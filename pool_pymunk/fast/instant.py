"""This module finds what comes at one instant of a compiled shot, and reads its contacts."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions
from pool_pymunk.engine.resolver import SAME_NORMAL
from pool_pymunk.fast.due import path_of
from pool_pymunk.fast.kinds import curvature, gap, normal, time_of_contact
from pool_pymunk.fast.records import MOST_TOGETHER, NOTHING, Sides, Work
from pool_pymunk.fast.walls import coefficients, nearest
from pool_pymunk.physics.contact import NO_BALL
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.sides import unit

# -- what comes at this instant --------------------------------------------------------------------


def latest_of(w: Work, i: int, j: int) -> float:
    """Return the latest time (s) of contacts that may be of one instant with this one of ``i``."""
    speed = w.ball[i].speed
    if j >= 0:
        speed = max(speed, w.ball[j].speed)
    return float(w.now + decisions.nearly_now(w.ball[i].radius, speed))


def gather(w: Work, sides: Sides, i: int, j: int) -> bool:
    """Put the contacts of this instant into ``due``; False if there is no room.

    The contact of ball ``i`` with ball ``j`` or a wall is among them. Their order is that of their
    numbers: pairs of balls first, then balls and walls.
    """
    at, balls, latest = w.together, w.scene.balls, latest_of(w, i, j)
    at.dues = 0
    for k in range(balls):
        if w.due[k].ball_t <= latest:
            for m in range(k + 1, balls):
                is_first = k == i and m == j
                is_now = w.pair_t[k, m] <= min(latest, latest_of(w, k, m))
                if (is_first or (is_now and touch(w, k, m, 1.0))) and not note_due(w, k, m):
                    return False
    for k in range(balls):
        if w.due[k].wall_t <= latest:
            for n in range(len(sides)):
                is_first = j < 0 and k == i and sides[n].wall == sides[w.due[k].side].wall
                is_due = is_first or (sides[n].first == n and meets_wall(w, sides, k, n, latest))
                if is_due and sides[n].first == n and not note_due(w, k, -1 - n):
                    return False
    return True


def note_due(w: Work, i: int, other: int) -> bool:
    """Put a contact of a ball, with another one or with a wall, into ``due``, if there is room."""
    at = w.together
    if at.dues == MOST_TOGETHER:
        return False
    at.due[at.dues, 0], at.due[at.dues, 1] = i, other
    at.dues += 1
    return True


def meets_wall(w: Work, sides: Sides, i: int, n: int, latest: float) -> bool:
    """Tell whether a ball meets a wall until ``latest`` (s), and touches it now."""
    ball, t = w.ball[i], math.inf
    for k in range(n, sides[n].last):
        t = min(t, time_of_contact(sides[k], path_of(ball), ball.radius, ball.t))
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
    room = gap(nearest(sides, sides[n], x, y, r), x, y, r)
    return decisions.is_closed(room / times, x, y, r)


def gap_to_wall(w: Work, sides: Sides, i: int, n: int) -> float:
    """Return the gap (m) between a ball and the wall whose first side is ``n`` now."""
    x, y, _, _ = motion_at(path_of(w.ball[i]), w.now)
    r = w.ball[i].radius
    return float(gap(nearest(sides, sides[n], x, y, r), x, y, r))


# -- what touches ----------------------------------------------------------------------------------


def spread(w: Work, found: int) -> bool:
    """Mark all balls in the cluster of the ``found`` ones; return False if one is off the table."""
    at, done = w.together, 0
    while done < found:
        i = at.queue[done]
        done += 1
        if w.count.pocket[i] != NOTHING:
            return False
        for j in range(w.scene.balls):
            if not at.is_near[j] and touches_ball(w, min(i, j), max(i, j)):
                at.is_near[j], at.queue[found] = 1, j
                found += 1
    return True


def touches_ball(w: Work, i: int, j: int) -> bool:
    """Tell whether two balls are on the table, and touch now, or nearly so."""
    one, other = w.ball[i].box, w.ball[j].box
    is_apart = other[0] > one[2] or other[2] < one[0] or other[1] > one[3] or other[3] < one[1]
    return not is_apart and touch(w, i, j, decisions.NEARLY_CLOSED)


def cluster_around(w: Work, sides: Sides, i: int) -> None:
    """Find all contacts in the cluster around a ball, for its group."""
    at, r, balls = w.together, w.groups, w.scene.balls
    for k in range(balls):
        at.is_near[k] = 0
    at.is_near[i], at.queue[0], r.hits = 1, i, 0
    spread(w, 1)
    for k in range(balls):
        for j in range(k + 1, balls):
            if at.is_near[k] and at.is_near[j] and touches_ball(w, k, j):
                note_touching(w, k, j)
    for k in range(balls):
        for n in range(len(sides)):
            is_cushion = sides[n].first == n and sides[n].pocket == NOTHING
            is_asked = is_cushion and at.is_near[k] != 0
            if is_asked and touches_wall(w, sides, k, n, decisions.NEARLY_CLOSED):
                note_touching(w, k, -1 - n)


def note_touching(w: Work, i: int, other: int) -> None:
    """Put a contact among those of a group, if there is room."""
    r = w.groups
    if r.hits == MOST_TOGETHER:
        r.is_full = 1
        return
    r.hit[r.hits][0], r.hit[r.hits][1] = i, other
    r.hits += 1


# -- contacts --------------------------------------------------------------------------------------


def read_contacts(w: Work, sides: Sides) -> bool:
    """Read the contacts that are ``due``; False if two walls touch a ball at the same point."""
    at = w.together
    for k in range(at.dues):
        i, other = at.due[k, 0], at.due[k, 1]
        read_motion(w, i)
        if other >= 0:
            read_motion(w, other)
            read_pair(w, at.contact[k], i, other)
        else:
            read_wall(w, sides, at.contact[k], i, -1 - other)
            nx, ny = at.contact[k].normal
            for m in range(k):
                ux, uy = at.contact[m].normal
                is_same = at.contact[m].a == i and at.contact[m].b == NO_BALL
                if is_same and nx * ux + ny * uy > 1.0 - SAME_NORMAL:
                    return False
    return True


def read_motion(w: Work, i: int) -> None:
    """Note where ball ``i`` is now, and how fast."""
    at = w.together
    x, y, vx, vy = motion_at(path_of(w.ball[i]), w.now)
    at.place[i] = (x, y)
    at.velocity[i] = (vx, vy)


def read_pair(w: Work, contact: Any, i: int, j: int) -> None:
    """Read the contact of two balls."""
    scene, place = w.scene, w.together.place
    contact.a, contact.b = i, j
    x, y = place[i][0], place[i][1]
    contact.normal[0], contact.normal[1] = unit(place[j][0] - x, place[j][1] - y)
    contact.pair.m_a, contact.pair.m_b = w.ball[i].mass, w.ball[j].mass
    is_cue = scene.cue in (i, j)
    contact.pair.restitution = scene.cue_ball if is_cue else scene.ball_ball
    contact.pair.friction = scene.ball_friction
    contact.gap = decisions.known_gap(gap_between(w, i, j), x, y, w.ball[i].radius)


def read_wall(w: Work, sides: Sides, contact: Any, i: int, n: int) -> None:
    """Read the contact of a ball and the wall whose first side is ``n``."""
    scene, r = w.scene, w.ball[i].radius
    x, y = w.together.place[i][0], w.together.place[i][1]
    side = nearest(sides, sides[n], x, y, r)
    contact.a, contact.b, contact.wall = i, NO_BALL, side.wall
    contact.normal[0], contact.normal[1] = normal(side, x, y)
    contact.pair.m_a, contact.pair.m_b = w.ball[i].mass, math.inf
    contact.pair.restitution, contact.pair.friction = coefficients(side, scene)
    contact.curvature = curvature(side, x, y)
    contact.gap = decisions.known_gap(gap(side, x, y, r), x, y, r)
