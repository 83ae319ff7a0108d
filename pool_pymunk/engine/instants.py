"""This module answers what is due at one instant: a contact that comes alone, or several at once.

- *One instant*: contacts belong to one instant if their gaps are closed, to rounding, at the time
  of the first. At a corner, for example, both cushions answer.
- *Rounds*: what closes after an answer is the next round of the same instant. After many rounds all
  that touches here is answered, round after round, until nothing closes.
- *Inelastic collapse*: after ``LISTED`` hits at one instant the others are played out
  (:mod:`pool_pymunk.physics.collapse`). They are no events; a warning gives their number.
- *Pockets*: a ball leaves the table when its centre comes to a pocket's rim, and has no part in
  contacts of that instant.

Python and numba run these functions; ``w`` is who plays them (:mod:`pool_pymunk.engine.asked`).
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.engine import asked, decisions, modes, persisting
from pool_pymunk.engine.answers import HIT, kicked, play_out, press_together, resolve, squared
from pool_pymunk.engine.policies import gap_at_hit, place_met
from pool_pymunk.physics.collapse import go_on
from pool_pymunk.physics.contact import (
    NO_BALL,
    NT,
    approach,
    changed,
    closing_speed,
    drift_of,
    pair_of,
    relative,
    split,
    wall_approach,
)
from pool_pymunk.physics.impulses import pushes_of
from pool_pymunk.physics.laws import balls_after, cushion_after, jumps_at
from pool_pymunk.physics.path import NOISE

SAME_NORMAL = 1e-12  # 1 - cosine of two normals; half or twice it moves no ball in tests.halved


def answer(w: Any, sides: Any) -> None:
    """Answer the contacts of this instant, which are ``due``."""
    at = w.instant
    take_all_in(w, sides)
    at.is_asked = w.groups.members
    if at.dues == 0:
        asked.predict_loose(w, sides)
        return
    if at.dues > 1 or at.is_asked:
        if absorb(w, sides):
            return
        take_apart(w)
    i, other = at.due[0][0], at.due[0][1]
    if at.dues > 1:
        answer_several(w, sides)
    elif other >= 0:
        answer_hit(w, sides, i, other)
    else:
        answer_cushion(w, sides, i, other)


def end_path(w: Any, sides: Any, i: int) -> None:
    """Let a ball rest at the end of its path, or go on as the surface says."""
    path = asked.path_of(w, i)
    if asked.is_at_its_end(w, path):
        asked.put_to_rest(w, i, path.end)
        return
    then = asked.follower(w, i, path)
    if asked.moves_on(then):
        asked.begins_to_roll(w, i, then.t)
        asked.lead(w, i, then)
    else:
        asked.put_to_rest(w, i, path.end)
    asked.predict(w, sides, (i,))


# -- what needs no answer --------------------------------------------------------------------------


def take_all_in(w: Any, sides: Any) -> None:
    """Let pockets take balls in; contacts of these balls are not answered."""
    at, found = w.instant, False
    for k in range(at.dues):
        found |= asked.is_pocket(w, sides, at.due[k][1])
    if not found:
        return
    for k in range(at.dues):
        at.gone[at.due[k][0]] = at.gone[max(at.due[k][1], 0)] = 0
    for k in range(at.mets):
        at.gone[at.met[k][0]] = at.gone[max(at.met[k][1], 0)] = 0
    for k in range(at.dues):
        i, other = at.due[k][0], at.due[k][1]
        if asked.is_pocket(w, sides, other) and not at.gone[i]:
            at.gone[i] = 1
            asked.take_in(w, sides, i, other)
    at.dues, at.mets = without_gone(at, at.due, at.dues), without_gone(at, at.met, at.mets)


def without_gone(at: Any, contacts: Any, count: int) -> int:
    """Leave out contacts of balls that are ``gone``; return how many others there are."""
    kept = 0
    for k in range(count):
        i, other = contacts[k][0], contacts[k][1]
        if not (at.gone[i] or (other >= 0 and at.gone[other])):
            contacts[kept] = (i, other)
            kept += 1
    return kept


def absorb(w: Any, sides: Any) -> bool:
    """Let sides persist, if all close too slowly to be seen to bounce; tell whether that is so.

    Hits that the group leaves out are answered as any others.
    """
    at, is_over = w.instant, True
    for k in range(at.dues):
        if not persisting.is_faint(w, sides, at.due[k][0], at.due[k][1]):
            return False
    for k in range(at.dues):  # What is predicted from here on is another hit.
        asked.use_up(w, sides, at.due[k][0], at.due[k][1])
    modes.begin_at(w, sides, at.due[0][0])
    for k in range(at.dues):
        is_over &= persisting.is_absorbed(w, sides, at.due[k][0], at.due[k][1])
    if not is_over:
        take_apart(w)
        answer_several(w, sides)
    return True


def absorb_alone(w: Any, sides: Any, i: int, other: int) -> bool:
    """Let the two sides of one hit persist, if they close too slowly to be seen to bounce."""
    at = w.instant
    at.dues, at.due[0] = 1, (i, other)
    return not at.is_asked and absorb(w, sides)


def take_apart(w: Any) -> None:
    """Take groups apart that are hit; the order of their contacts is unknown then."""
    at, found = w.instant, False
    if not w.groups.members:
        return
    gap = gap_at_hit(w.errors)
    for k in range(at.dues):
        found |= modes.release(w, at.due[k][0], gap)
        if at.due[k][1] >= 0:
            found |= modes.release(w, at.due[k][1], gap)
    if found:
        asked.note_order(w)


# -- one contact -----------------------------------------------------------------------------------


def answer_hit(w: Any, sides: Any, i: int, j: int) -> None:
    """Answer a hit of two balls that comes alone."""
    at, r, pull = w.instant, asked.radius_of(w, i), asked.pull_of(w)
    x, y, ax, ay = read_motion(w, i)
    u, v, bx, by = read_motion(w, j)
    one = asked.read_contact(w, sides, 0, i, j)
    nx, ny = one.normal
    along, noise = (nx, ny), max(asked.noise_of(w, i), asked.noise_of(w, j))
    closing = approach((ax, ay), (bx, by), along)
    if persisting.is_slow(closing, pull, r) and absorb_alone(w, sides, i, j):
        return
    has_many = has_many_rounds(w, j if asked.speed_of(w, j) > asked.speed_of(w, i) else i)
    note_met(w, i, j)
    before_a, before_b, pair = split((ax, ay), along), split((bx, by), along), pair_of(one)
    is_ordinary = not has_many and closing > noise
    if not is_ordinary or jumps_at(asked.law_of(w), before_a, before_b, pair):
        answer_round(w, sides, has_many)
        return
    parts_a, parts_b = balls_after(asked.law_of(w), before_a, before_b, pair)
    after_a = changed((ax, ay), before_a, parts_a, along)
    after_b = changed((bx, by), before_b, parts_b, along)
    note_many(w, 1)
    at.impulse[0] = pushes_of(one, ((ax, ay), (bx, by)), (after_a, after_b))
    asked.note_contact(w, 0)
    fastest = max(squared((ax, ay)), squared((bx, by)), squared(after_a), squared(after_b))
    noise = decisions.noise_after(fastest, noise)
    asked.begin(w, i, (x, y), after_a, asked.roll_of(w, i), noise)
    asked.begin(w, j, (u, v), after_b, asked.roll_of(w, j), noise)
    asked.predict(w, sides, (i, j))
    persisting.note_hit(w, i)
    persisting.note_hit(w, j)
    closing = approach(asked.velocity_of(w, i), asked.velocity_of(w, j), along)
    if closing >= 0.0 or persisting.is_slow(closing, pull, r):
        persisting.look_again(w, sides, i, j)


def answer_cushion(w: Any, sides: Any, i: int, other: int) -> None:
    """Answer a hit on a cushion that comes alone."""
    at, r, noise = w.instant, asked.radius_of(w, i), asked.noise_of(w, i)
    x, y, vx, vy = read_motion(w, i)
    one = asked.read_contact(w, sides, 0, i, other)
    nx, ny = one.normal
    across, drift = (nx, ny), drift_of(one)
    toward = relative((vx, vy), drift)
    closing = wall_approach(toward, across)
    strongest = asked.pull_of(w) + abs(one.curvature) * squared(toward)
    if persisting.is_slow(closing, strongest, r) and absorb_alone(w, sides, i, other):
        return
    has_many = has_many_rounds(w, i)
    note_met(w, i, other)
    if has_many or closing <= noise:
        answer_round(w, sides, has_many)
        return
    before = split(toward, across)
    parts = cushion_after(asked.law_of(w), before, one.pair.restitution, one.pair.friction)
    after = changed((vx, vy), before, parts, across)
    note_many(w, 1)
    at.impulse[0] = pushes_of(one, ((vx, vy), (vx, vy)), (after, after))
    at.turns, at.turn[0], at.kind[0] = 1, 0, HIT
    after = kicked(w, 0, after)
    asked.note_contact(w, 0)
    noise = decisions.noise_after(max(squared((vx, vy)), squared(after)), noise)
    asked.begin(w, i, (x, y), after, asked.roll_after(w, i), noise)
    asked.predict(w, sides, (i,))
    persisting.note_hit(w, i)
    closing = wall_approach(relative(asked.velocity_of(w, i), drift), across)
    if closing >= 0.0 or persisting.is_slow(closing, strongest, r):
        persisting.look_again(w, sides, i, other)


# -- rounds ----------------------------------------------------------------------------------------


def has_many_rounds(w: Any, i: int) -> bool:
    """Count a round of this instant, whose fastest ball is given; tell if there were many."""
    at, path = w.instant, asked.path_of(w, i)
    length = decisions.instant(w.now, path.x, path.y, asked.radius_of(w, i), asked.speed_of(w, i))
    if w.now - at.began > length:
        at.began, at.rounds, at.mets = w.now, 0, 0
    at.rounds += 1
    return bool(at.rounds > decisions.FEW_ROUNDS)


def note_met(w: Any, i: int, other: int) -> None:
    """Note what has met at this instant, once."""
    at = w.instant
    if has_met(at, i, other):
        return
    if at.mets == at.most:
        asked.give_up(w)
        return
    at.met[at.mets] = (i, other)
    at.mets += 1


def has_met(at: Any, i: int, other: int) -> bool:
    """Tell whether two sides have met at this instant."""
    found = False
    for k in range(at.mets):
        found |= at.met[k][0] == i and at.met[k][1] == other
    return found


def note_many(w: Any, contacts: int) -> None:
    """Note that the order of this many contacts is unknown; two alone may take turns."""
    if contacts > 1 or w.instant.mets > 2:
        asked.note_order(w)


def answer_several(w: Any, sides: Any) -> None:
    """Answer several contacts of this instant."""
    at = w.instant
    fastest = at.due[0][0]
    for k in range(at.dues):
        for i in (at.due[k][0], at.due[k][1]):
            if i >= 0 and asked.speed_of(w, i) > asked.speed_of(w, fastest):
                fastest = i
    has_many = has_many_rounds(w, fastest)
    for k in range(at.dues):
        note_met(w, at.due[k][0], at.due[k][1])
    answer_round(w, sides, has_many)


def answer_round(w: Any, sides: Any, has_many: bool) -> None:
    """Answer a round of contacts, or after many rounds all that touches."""
    at = w.instant
    if not asked.may_answer(w):
        return
    for n in range(at.balls):
        at.is_in[at.ball[n]] = at.changed[at.ball[n]] = 0
    at.balls = at.misses = 0
    read_contacts(w, sides)
    note_many(w, at.contacts)
    for k in range(at.dues):  # These predictions have come true, whatever follows from them.
        asked.use_up(w, sides, at.due[k][0], at.due[k][1])
    if has_many:
        answer_cluster(w, sides)
    else:
        at.turns = at.contacts
        for k in range(at.contacts):
            at.turn[k] = k
        resolve(w)
    asked.predict_changed(w, sides)
    for m in range(at.misses):
        one = at.contact[at.missed[m]]
        is_moved = has_many and (at.changed[one.a] or at.changed[one.b])
        soonest = min(asked.path_of(w, one.a).end, asked.path_of(w, one.b).end)
        if soonest > w.now and not is_moved:
            asked.meet(w, sides, one.a, one.b)
    for k in range(at.dues):
        persisting.look_after(w, sides, at.due[k][0], at.due[k][1])


def answer_cluster(w: Any, sides: Any) -> None:
    """Answer all that touches here, round after round, until nothing closes.

    The contacts that are read already come first.
    """
    at, count, hits = w.instant, w.instant.contacts, 0
    for k in range(count):
        at.group[k] = at.contact[k]
    asked.find_cluster(w, sides)
    take_apart(w)
    read_contacts(w, sides)
    for k in range(at.contacts):
        at.gap[k], at.hits[k] = max(gap_of_contact(w, sides, k), 0.0), 0
        for m in range(count):
            at.hits[k] |= is_same(at.group[m], at.contact[k])
    at.turns = take_turn(at)
    while at.turns > 0 and asked.may_go_on(w):
        if hits > decisions.LISTED and loses_speed(w):  # The hits may have no end.
            play_out(w)
            break
        if asked.squeezes(w):
            press_together(w)
            break
        hits += resolve(w)
        at.turns = next_round(w)
    at.rounds = at.mets = 0


def take_turn(at: Any) -> int:
    """Let the contacts of a cluster have their turn that hit next, and return how many they are."""
    count = 0
    for k in range(at.contacts):
        if at.hits[k]:
            at.turn[count] = k
            count += 1
    return count


def next_round(w: Any) -> int:
    """Go on to the contacts of the cluster that hit next, and return how many there are."""
    at, noise, moves = w.instant, 0.0, False
    for n in range(at.balls):
        moves |= at.moved[at.ball[n]] != 0
        noise = max(noise, asked.noise_of(w, at.ball[n]))
    if not moves:
        return 0
    for k in range(at.contacts):
        at.closing[k] = closing_speed(at.contact[k], at.velocity)
        if asked.squeeze(w, k):
            at.closing[k] = 0.0
    found = go_on(at.gap, at.closing, at.contacts, noise, at.hits)
    return take_turn(at) if found else 0


def loses_speed(w: Any) -> bool:
    """Tell whether any contact of the cluster loses speed when it closes head-on at 1 m/s.

    None does while a wall moves into a ball: its hits end when the ball is jammed.
    """
    at, law, found, drives = w.instant, asked.law_of(w), False, False
    for k in range(at.contacts):
        one = at.contact[k]
        a, b, pair = NT(0.0, 0.0), NT(-1.0, 0.0), pair_of(one)
        if one.b == NO_BALL:
            b = cushion_after(law, b, pair.restitution, pair.friction)
        else:
            a, b = balls_after(law, NT(1.0, 0.0), a, pair)
        found |= b.n - a.n < 1.0 - NOISE
        ux, uy = drift_of(one)
        drives |= ux != 0.0 or uy != 0.0
    return found and not drives


# -- contacts --------------------------------------------------------------------------------------


def read_contacts(w: Any, sides: Any) -> None:
    """Read the contacts that are ``due``; where two cushions lie on one line, they are one."""
    at, count = w.instant, 0
    for k in range(at.dues):
        i, other = at.due[k][0], at.due[k][1]
        add_ball(w, i)
        if other >= 0:
            add_ball(w, other)
        one, at.other[count] = asked.read_contact(w, sides, count, i, other), other
        is_new = True
        for m in range(count if other < 0 else 0):
            is_new &= not is_same(at.contact[m], one)
        count += is_new
    at.contacts = count


def gap_of_contact(w: Any, sides: Any, k: int) -> float:
    """Return the gap (m) of a contact, or 0 where rounding hides it."""
    at, i = w.instant, w.instant.contact[k].a
    x, y = at.place[i][0], at.place[i][1]
    gap = asked.gap_between(w, sides, i, at.other[k])
    return decisions.known_gap(gap, x, y, asked.radius_of(w, i))


def is_same(one: Any, other: Any) -> bool:
    """Tell whether two contacts of the same sides have the same normal."""
    nx, ny = one.normal
    ux, uy = other.normal
    is_of_same = one.a == other.a and one.b == other.b
    return bool(is_of_same and nx * ux + ny * uy > 1.0 - SAME_NORMAL)


def add_ball(w: Any, i: int) -> None:
    """Put a ball among those of this instant, in the order of their numbers."""
    at = w.instant
    if at.is_in[i]:
        return
    n = at.balls
    while n > 0 and at.ball[n - 1] > i:
        at.ball[n] = at.ball[n - 1]
        n -= 1
    at.ball[n], at.is_in[i] = i, 1
    at.balls += 1
    read_motion(w, i)


def read_motion(w: Any, i: int) -> Any:
    """Note where ball ``i`` is now, and how fast, and return it."""
    at = w.instant
    x, y, vx, vy = place_met(w.errors, asked.motion(w, i), w.now)
    at.place[i], at.velocity[i] = (x, y), (vx, vy)
    return x, y, vx, vy
