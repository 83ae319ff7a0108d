"""This module answers contacts of one instant in compiled shots, as the engine answers them.

It does in arrays what :mod:`pool_pymunk.engine.resolver` and :mod:`pool_pymunk.engine.contacts` do
for contacts that share a ball, rows of touching balls, and balls that a cushion leads. A function
that answers returns -1 (``NOTHING``) or False where a shot is hard: where
hits may have no end, where the law's impulses are unknown, or where there is no more room.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions
from pool_pymunk.engine.groups import look_after, release
from pool_pymunk.fast.due import may_roll, meet, predict_marked, refresh
from pool_pymunk.fast.instant import (
    note_due,
    read_contacts,
    spread,
    touches_ball,
    touches_wall,
)
from pool_pymunk.fast.kinds import ball_ball, cushion, jumps
from pool_pymunk.fast.moves import begin, note_cushion, note_hit, roll_of, squared
from pool_pymunk.fast.records import MOST_TOGETHER, NOTHING, Moving, Sides, Work
from pool_pymunk.physics.collapse import go_on
from pool_pymunk.physics.contact import (
    NO_BALL,
    Pair,
    Vector,
    changed,
    closing_speed,
    first_of,
    join,
    split,
)
from pool_pymunk.physics.impulses import along_normal, slowing
from pool_pymunk.physics.laws import as_listed
from pool_pymunk.physics.surface import NO_ROLL, changed_by, slowed_by
from pool_pymunk.physics.together import Room, push_at_once

MISSED, HIT, LED = 0, 1, 2  # what becomes of a contact, as in the resolver

# -- instants --------------------------------------------------------------------------------------


def has_many_rounds(w: Work, ball: Moving) -> bool:
    """Count a round of this instant, whose fastest ball is given; tell if there were many."""
    at = w.together
    length = decisions.instant(w.now, ball.x, ball.y, ball.radius, ball.speed)
    if w.now - w.instant > length:
        w.instant, w.rounds, at.mets = w.now, 0, 0
    w.rounds += 1
    w.in_doubt |= w.rounds > 1
    return bool(w.rounds > decisions.FEW_ROUNDS)


def note_met(w: Work, i: int, other: int) -> bool:
    """Note what has met at this instant, once; return False if there is no room."""
    at = w.together
    if has_met(w, i, other):
        return True
    if at.mets == MOST_TOGETHER:
        return False
    at.met[at.mets, 0], at.met[at.mets, 1] = i, other
    at.mets += 1
    return True


def answer_together(w: Work, sides: Sides) -> bool:
    """Answer the contacts of this instant that are ``due``; return False where that is hard."""
    at, fastest = w.together, NOTHING
    for k in range(at.dues):
        take_apart(w, at.due[k, 0], at.due[k, 1])
    for k in range(at.dues):
        for i in (at.due[k, 0], at.due[k, 1]):
            if i >= 0 and (fastest == NOTHING or w.ball[i].speed > w.ball[fastest].speed):
                fastest = i
    has_many = has_many_rounds(w, w.ball[fastest])
    for k in range(at.dues):
        i, other = at.due[k, 0], at.due[k, 1]
        is_pocket = other < 0 and sides[-1 - other].pocket != NOTHING
        if is_pocket or not note_met(w, i, other):
            return False
    return answer_round(w, sides, has_many)


def take_apart(w: Work, i: int, other: int) -> None:
    """Take groups apart that are hit; the order of their contacts is unknown then."""
    if w.groups.members:
        w.in_doubt |= release(w, i, 0.0)
        if other >= 0:
            w.in_doubt |= release(w, other, 0.0)


def answer_alone(w: Work, sides: Sides, i: int, other: int, has_many: bool) -> bool:
    """Answer a contact that comes alone, but is not an ordinary one; False if it is hard."""
    at = w.together
    at.dues, at.due[0, 0], at.due[0, 1] = 1, i, other
    return answer_round(w, sides, has_many)


def answer_round(w: Work, sides: Sides, has_many: bool) -> bool:
    """Answer a round of contacts, or after many rounds all that touches; False if hard."""
    at = w.together
    if w.scene.keeps or w.scene.together == NOTHING or not read_contacts(w, sides):
        return False
    at.misses = 0
    for i in range(w.scene.balls):
        at.changed[i] = 0
    for k in range(at.dues):
        if at.due[k, 1] >= 0:  # This prediction has come true, whatever follows from it.
            w.pair_t[at.due[k, 0], at.due[k, 1]] = math.inf
            refresh(w, at.due[k, 0])
        at.answered[k] = at.contact[k]
    if not (answer_cluster(w, sides) if has_many else resolve(w, at.dues) >= 0):
        return False
    w.in_doubt |= at.dues > 1 or at.misses > 0
    predict_marked(w, sides)
    for k in range(at.misses):
        i, j = at.missed[k, 0], at.missed[k, 1]
        is_moved = has_many and (at.changed[i] or at.changed[j])
        if w.ball[i].end > w.now and w.ball[j].end > w.now and not is_moved:
            meet(w, sides, i, j)
            refresh(w, i)
    for k in range(at.dues):
        look_after(w, sides, at.due[k, 0], at.due[k, 1])
    return True


# -- what touches, round after round ---------------------------------------------------------------


def answer_cluster(w: Work, sides: Sides) -> bool:
    """Answer all that touches here, round after round, until nothing closes; False if it is hard.

    What is ``due`` comes first.
    """
    at, hits, due = w.together, 0, w.together.dues
    for k in range(due):
        at.turn[k, 0], at.turn[k, 1] = at.due[k, 0], at.due[k, 1]
    if not find_touching(w, sides) or not read_contacts(w, sides):
        return False
    for k in range(at.dues):
        at.gap[k], at.hits[k] = max(at.contact[k].gap, 0.0), 0
        for m in range(due):
            if at.turn[m, 0] == at.due[k, 0] and at.turn[m, 1] == at.due[k, 1]:
                at.hits[k] = 1
    while due > 0:
        due = 0
        for k in range(at.dues):
            if at.hits[k]:
                at.answered[due] = at.contact[k]
                due += 1
        found = resolve(w, due)
        hits += found
        if found == NOTHING or hits > decisions.LISTED:
            return False
        due = next_round(w)
    w.rounds = at.mets = 0
    return True


def find_touching(w: Work, sides: Sides) -> bool:
    """Put into ``due`` all contacts in the cluster of this instant; False if hard."""
    at, balls = w.together, w.scene.balls
    if not find_near(w):
        return False
    at.dues = 0
    for i in range(balls):
        for j in range(i + 1, balls):
            is_near = at.is_near[i] and at.is_near[j]
            is_in = is_near and (has_met(w, i, j) or touches_ball(w, i, j))
            if is_in and not note_due(w, i, j):
                return False
    for i in range(balls):
        for n in range(len(sides)):
            if at.is_near[i] and sides[n].first == n and sides[n].pocket == NOTHING:
                touches = touches_wall(w, sides, i, n, decisions.NEARLY_CLOSED)
                if (touches or has_met(w, i, -1 - n)) and not note_due(w, i, -1 - n):
                    return False
    return True


def find_near(w: Work) -> bool:
    """Mark the balls in the cluster of this instant; return False if one is off the table."""
    at, found = w.together, 0
    for i in range(w.scene.balls):
        at.is_near[i] = 0
    for k in range(at.mets):
        for i in (at.met[k, 0], at.met[k, 1]):
            if i >= 0 and not at.is_near[i]:
                at.is_near[i], at.queue[found] = 1, i
                found += 1
    return spread(w, found)


def has_met(w: Work, i: int, other: int) -> bool:
    """Tell whether two sides have met at this instant."""
    at, found = w.together, False
    for k in range(at.mets):
        found |= at.met[k, 0] == i and at.met[k, 1] == other
    return found


def next_round(w: Work) -> int:
    """Go on to the contacts of the cluster that hit next, and return how many there are."""
    at, noise, moves = w.together, 0.0, False
    for i in range(w.scene.balls):
        moves |= at.moved[i] != 0
        if at.is_near[i]:
            noise = max(noise, w.ball[i].noise)
    if not moves:
        return 0
    for k in range(at.dues):
        at.closing[k] = closing_speed(at.contact[k], at.velocity)
    return go_on(at.gap, at.closing, at.dues, noise, at.hits)


# -- one round -------------------------------------------------------------------------------------


def resolve(w: Work, count: int) -> int:
    """Answer the contacts of a round; return how many were hits, or -1 if they are hard."""
    at, hits = w.together, 0
    for i in range(w.scene.balls):
        at.moved[i] = at.is_in[i] = 0
    for k in range(count):
        one = at.answered[k]
        for i in (one.a, one.b):
            at.is_in[i], at.before[i] = 1, (at.velocity[i][0], at.velocity[i][1])
        one.place, one.impulse = k, 0.0
        one.kind = HIT if is_hit(w, one) else MISSED
        hits += one.kind
    if hits > 0 and not answer_hits(w, count):
        return NOTHING
    is_sound = leave_out(w, count) and report(w, count) and carry_out(w, count)
    return hits if is_sound else NOTHING


def is_hit(w: Work, one: Any) -> bool:
    """Tell whether the two sides of a contact close faster than noise."""
    noise = w.ball[one.a].noise
    if one.b != NO_BALL:
        noise = max(noise, w.ball[one.b].noise)
    return bool(closing_speed(one, w.together.velocity) > noise)


def answer_hits(w: Work, count: int) -> bool:
    """Answer the hits of a round, group by group of contacts that share a ball."""
    at, hits = w.together, 0
    for k in range(count):
        if at.answered[k].kind != MISSED:
            at.hitting[hits] = at.answered[k]
            hits += 1
    join(at.hitting, hits, at.first)
    for k in range(hits):
        first, size, is_new = first_of(at.hitting[k].a, at.first), 0, True
        for m in range(hits):
            if first_of(at.hitting[m].a, at.first) == first:
                is_new &= m >= k
                at.group[size] = at.hitting[m]
                size += 1
        if is_new and not answer_group(w, size):
            return False
    return True


def answer_group(w: Work, count: int) -> bool:
    """Answer a group of contacts by the law; return False if their impulses are unknown."""
    at = w.together
    if count == 1:
        respond(w, at.group[0])
        return True
    if w.scene.together == 0:
        room = Room(
            at.response, at.factor, at.wanted, at.unit, at.impulse, at.rest,
            at.pushing, at.chosen, at.shares,
        )  # fmt: skip
        is_known = push_at_once(at.group, count, at.velocity, room)
        for k in range(count if may_roll(w.ball[0]) else 0):
            at.answered[at.group[k].place].impulse = at.impulse[k]
        return is_known
    if may_roll(w.ball[0]):
        return False
    for k in range(count):
        for m in range(k + 1, count):
            if as_listed(at.group[m]) < as_listed(at.group[k]):
                at.hitting[MOST_TOGETHER] = at.group[k]
                at.group[k] = at.group[m]
                at.group[m] = at.hitting[MOST_TOGETHER]
        if closing_speed(at.group[k], at.velocity) > 0.0:
            respond(w, at.group[k])
    return True


def respond(w: Work, one: Any) -> None:
    """Answer one contact by the law; where the law jumps, leave friction out."""
    v, i, j, e, mu = w.together.velocity, one.a, one.b, one.pair.restitution, one.pair.friction
    a = split(v[i], one.normal)
    if j == NO_BALL:
        after = changed(v[i], a, cushion(w.scene, a, e, mu), one.normal)
        w.together.answered[one.place].impulse = along_normal(one, v[i], after)
        v[i] = after
        return
    b, pair = split(v[j], one.normal), Pair(one.pair.m_a, one.pair.m_b, e, mu)
    if jumps(w.scene, a, b, pair):
        pair = Pair(one.pair.m_a, one.pair.m_b, e, 0.0)
    new_a, new_b = ball_ball(w.scene, a, b, pair)
    v[i] = changed(v[i], a, new_a, one.normal)
    v[j] = changed(v[j], b, new_b, one.normal)


def leave_out(w: Work, count: int) -> bool:
    """Lead balls along their cushions, and note pairs that only touch; False without room."""
    at = w.together
    for k in range(count):
        one = at.answered[k]
        if one.kind != MISSED:
            at.moved[one.a] = at.moved[one.b] = HIT
    for k in range(count):
        one = at.answered[k]
        if one.kind != MISSED or at.moved[one.a] == HIT:
            continue
        if one.b == NO_BALL:
            nx, ny = one.normal
            vx, vy = at.velocity[one.a][0], at.velocity[one.a][1]
            n = vx * nx + vy * ny
            at.velocity[one.a] = (vx - n * nx, vy - n * ny)
            at.moved[one.a] = one.kind = LED
            one.impulse = along_normal(one, (vx, vy), at.velocity[one.a])
        elif at.moved[one.b] != HIT:
            if at.misses == MOST_TOGETHER:
                return False
            at.missed[at.misses, 0], at.missed[at.misses, 1] = one.a, one.b
            at.misses += 1
    return True


def report(w: Work, count: int) -> bool:
    """Count the hits of a round; return False after too many rounds without a hit."""
    at, listed = w.together, False
    for k in range(count):
        one = at.answered[k]
        if one.kind == HIT and one.b != NO_BALL:
            note_hit(w, one.a, one.b)
        elif one.kind == HIT:
            note_cushion(w, one.a, one.wall)
        listed |= one.kind == HIT
    at.unlisted += not listed
    return bool(at.unlisted < decisions.NEVER_SETTLES)


def roll_after(w: Work, i: int, count: int) -> Vector:
    """Return the roll of a ball after the cushions of a round have slowed it."""
    at, roll, change = w.together, roll_of(w, i), NO_ROLL
    if not may_roll(w.ball[i]):
        return roll
    for k in range(count):
        one = at.answered[k]
        if one.a == i and one.b == NO_BALL and one.kind != MISSED:
            nx, ny = one.normal
            slows_by = slowing(one.pair.friction, one.impulse, one.pair.m_a)
            change = slowed_by(((nx, ny), slows_by), roll, change)
    return changed_by(change, roll)


def carry_out(w: Work, count: int) -> bool:
    """Give the balls their new paths, or put them to rest; return False if one is lost."""
    at, fastest, noise, is_sound = w.together, 0.0, 0.0, True
    for i in range(w.scene.balls):
        if at.is_in[i]:
            fastest = max(fastest, squared(at.velocity[i]), squared(at.before[i]))
            noise = max(noise, w.ball[i].noise)
    noise = decisions.noise_after(fastest, noise)
    for i in range(w.scene.balls):
        if at.moved[i]:
            ball, v = w.ball[i], (at.velocity[i][0], at.velocity[i][1])
            place, roll = (at.place[i][0], at.place[i][1]), roll_after(w, i, count)
            is_sound &= begin(w, i, place, v, roll, noise)
            at.velocity[i], at.changed[i] = (ball.vx, ball.vy), 1
    return is_sound
