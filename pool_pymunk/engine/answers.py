"""The contacts of one round are answered by the law, and balls begin new paths.

- *One round*: the law answers together the contacts that share a ball. A contact that closes only
  because of a hit, as in a row of touching balls, comes in the next round of the same instant.
- *Rounding*: a closing speed of the size of rounding is no hit, and a ball with only such a speed
  after a hit rests.

The functions are loops over the numbers of an :class:`Instant`, in Python or compiled. They ask
those who play them, ``w``, only by the functions of :mod:`pool_pymunk.engine.asked`.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING, Any

from pool_pymunk.engine import decisions
from pool_pymunk.engine.asked import (
    answer_group,
    begin,
    can_leap,
    count_unlisted,
    kick_of,
    law_of,
    noise_of,
    note_collapse,
    note_contact,
    note_jump,
    path_of,
    read_plastic,
    roll_after,
    room_to_collapse,
    settle_group,
    slip_of,
)
from pool_pymunk.engine.policies import left_out
from pool_pymunk.physics import collapse
from pool_pymunk.physics.contact import (
    NO_BALL,
    Vector,
    closing_speed,
    drift_of,
    first_of,
    join,
    relative,
)
from pool_pymunk.physics.impulses import pushes_of
from pool_pymunk.physics.laws import respond

# What becomes of a contact: two balls touch, but do not close; the law answers, and this is an
# event; a cushion leads a ball along itself; the law answered many hits of an inelastic collapse.
MISSED, HIT, LED, COLLAPSED = 0, 1, 2, 3

# What an instant has by contact C and by ball N; arrays by ball have room for the ball -1 at the
# end. `due` and `met` (in the rounds of an instant) have contacts as pairs: a ball, and another
# ball or -1 - a wall. `contact` has those that are `due`, `kind` what became of each, `impulse` its
# impulses (N s) along the normal and, on the second and the first ball, along the tangent; `jumped`
# tells whether the law jumps there. A round has the contacts of the numbers `turn`; `hitting` has
# those that hit, with numbers `which`, and `group` those that share balls, with numbers `member`.
# `gap` (m), `closing` (m/s) and `hits` are those of a cluster.
BY_CONTACT: dict[str, tuple[type, tuple[Any, ...]]] = {
    "due": (int, ("C", 2)), "met": (int, ("C", 2)), "missed": (int, ("C",)),
    "other": (int, ("C",)), "kind": (int, ("C",)), "impulse": (float, ("C", 3)),
    "jumped": (int, ("C",)),
    "turn": (int, ("C",)), "which": (int, ("C",)), "member": (int, ("C",)),
    "gap": (float, ("C",)), "closing": (float, ("C",)), "hits": (int, ("C",)),
}  # fmt: skip
# The balls of the contacts are `ball`, in the order of their numbers; `is_in` marks them, and
# `plays` those of a round. `place` (m), `velocity` and `before` (m/s) are those now and before it.
# A round has `moved` some, and the instant has `changed` them.
BY_BALL: dict[str, tuple[type, tuple[Any, ...]]] = {
    "ball": (int, ("N",)), "is_in": (int, ("N",)), "plays": (int, ("N",)),
    "place": (float, ("N", 2)), "velocity": (float, ("N", 2)), "before": (float, ("N", 2)),
    "moved": (int, ("N",)), "changed": (int, ("N",)), "gone": (int, ("N",)),
    "first": (int, ("N",)), "shares": (int, ("N",)),
}  # fmt: skip


class Instant:
    """This is what the engine knows of an instant, which ``began`` at a time (s).

    Rows are dictionaries here, because an engine has any number of balls and contacts.
    """

    def __init__(self) -> None:
        self.began, self.most = -math.inf, math.inf
        self.rounds = self.mets = self.dues = self.contacts = self.misses = self.turns = 0
        self.balls = self.is_asked = self.is_played_out = 0
        self.kick: dict[int, float] = {}  # m/s, of a wall's contact that is a hit
        self.contact: dict[int, Any] = {}
        self.hitting: dict[int, Any] = {}
        self.group: dict[int, Any] = {}
        for name, (kind, shape) in {**BY_CONTACT, **BY_BALL}.items():
            is_mark = kind is int and len(shape) == 1
            setattr(self, name, defaultdict[int, int](int) if is_mark else {})

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...  # the rows


def squared(v: Any) -> Any:
    """Return the square of a velocity."""
    return v[0] * v[0] + v[1] * v[1]


# -- one round -------------------------------------------------------------------------------------


def resolve(w: Any) -> int:
    """Answer the contacts of a round, and return how many were hits."""
    at, hits = w.instant, 0
    begin_round(w)
    for n in range(at.turns):
        k = at.turn[n]
        at.kind[k] = HIT if is_hit(w, at.contact[k]) else MISSED
        if at.kind[k] == HIT:
            at.hitting[hits], at.which[hits] = at.contact[k], k
            hits += 1
    if hits == 1:
        answer_lone(w, at.which[0])
    elif hits > 0:
        answer_hits(w, hits)
    kick_all(w, hits)
    leave_out(w)
    report(w, hits > 0)
    carry_out(w)
    return hits


def begin_round(w: Any) -> None:
    """Note which balls take part in a round, and how fast they are before it."""
    at = w.instant
    for n in range(at.balls):
        i = at.ball[n]
        at.moved[i] = at.plays[i] = 0
    for n in range(at.turns):
        k = at.turn[n]
        at.jumped[k] = 0
        for i in (at.contact[k].a, at.contact[k].b):
            if i != NO_BALL:
                at.plays[i], at.before[i] = 1, (at.velocity[i][0], at.velocity[i][1])


def is_hit(w: Any, one: Any) -> bool:
    """Tell whether the two sides of a contact close faster than noise."""
    noise = noise_of(w, one.a)
    if one.b != NO_BALL:
        noise = max(noise, noise_of(w, one.b))
    return bool(closing_speed(one, w.instant.velocity) > noise)


def answer_hits(w: Any, hits: int) -> None:
    """Answer the hits of a round, group by group of contacts that share a ball."""
    at = w.instant
    join(at.hitting, hits, at.first)
    for k in range(hits):
        size = take_group(at, hits, k)
        if size == 1:
            answer_lone(w, at.member[0])
        elif size > 1:
            answer_group(w, size)


def take_group(at: Any, hits: int, k: int) -> int:
    """Put the hits that share balls with hit ``k`` into ``group``; return 0 if it is not the first.

    Else return how many they are.
    """
    first, size = first_of(at.hitting[k].a, at.first), 0
    for m in range(hits):
        if first_of(at.hitting[m].a, at.first) == first:
            if m < k:
                return 0
            at.group[size], at.member[size] = at.hitting[m], at.which[m]
            size += 1
    return size


def answer_lone(w: Any, k: int) -> None:
    """Answer a hit that shares no ball with another one."""
    at = w.instant
    one, v = at.contact[k], at.velocity
    i, j = one.a, one.b if one.b != NO_BALL else one.a
    before = (v[i][0], v[i][1]), (v[j][0], v[j][1])
    at.jumped[k] |= respond(law_of(w), one, v, slip_of(w))
    keep_impulse(w, k, before)


def keep_impulse(w: Any, k: int, before: Any) -> None:
    """Keep the impulse of a contact that alone has changed the velocities (m/s) of its balls."""
    at = w.instant
    one, v = at.contact[k], at.velocity
    j = one.b if one.b != NO_BALL else one.a
    after = (v[one.a][0], v[one.a][1]), (v[j][0], v[j][1])
    at.impulse[k] = pushes_of(one, before, after)


def kick_all(w: Any, hits: int) -> None:
    """Let the walls of a round kick the balls that have hit them, after the law's answer."""
    at = w.instant
    for n in range(hits):
        k = at.which[n]
        one = at.contact[k]
        if one.b == NO_BALL:
            at.velocity[one.a] = kicked(w, k, (at.velocity[one.a][0], at.velocity[one.a][1]))


def kicked(w: Any, k: int, v: Vector) -> Vector:
    """Return a ball's velocity (m/s) after the kick of a wall, if it kicks.

    The kick is an impulse along the normal, without friction, which slows no roll.
    """
    nx, ny = w.instant.contact[k].normal
    kick = kick_of(w, k)
    if kick == 0.0:
        return v
    return v[0] + kick * nx, v[1] + kick * ny


def leave_out(w: Any) -> None:
    """Lead balls along their cushions that were not hit, and note balls that only touch."""
    at = w.instant
    for n in range(at.turns):
        k = at.turn[n]
        one = at.contact[k]
        if at.kind[k] != MISSED:
            at.moved[one.a] = at.moved[one.b] = HIT
    for n in range(at.turns):
        k = at.turn[n]
        one = at.contact[k]
        if at.kind[k] != MISSED or at.moved[one.a] == HIT:
            continue
        if one.b == NO_BALL:
            nx, ny = one.normal
            vx, vy = at.velocity[one.a][0], at.velocity[one.a][1]
            ux, uy = relative((vx, vy), drift_of(one))
            along = ux * nx + uy * ny
            at.velocity[one.a] = (vx - along * nx, vy - along * ny)
            at.moved[one.a] = at.kind[k] = LED
            keep_impulse(w, k, ((vx, vy), (vx, vy)))
        elif at.moved[one.b] != HIT and at.misses < at.most:
            at.missed[at.misses] = k
            at.misses += 1


def report(w: Any, is_listed: bool) -> None:
    """Tell of the hits of a round, and count a round without one."""
    at = w.instant
    for n in range(at.turns):
        if at.kind[at.turn[n]] == HIT:
            note_contact(w, at.turn[n])
    if not is_listed:
        count_unlisted(w)
    for n in range(at.turns):
        if at.jumped[at.turn[n]]:
            note_jump(w, at.turn[n])


def carry_out(w: Any) -> None:
    """Give the balls their new paths, or put them to rest."""
    at, fastest, noise = w.instant, 0.0, 0.0  # the square of a speed, and a speed
    for n in range(at.balls):
        i = at.ball[n]
        if at.plays[i]:
            fastest = max(fastest, squared(at.velocity[i]), squared(at.before[i]))
            noise = max(noise, noise_of(w, i))
    noise = decisions.noise_after(fastest, noise)
    for n in range(at.balls):
        i = at.ball[n]
        if at.moved[i]:
            place, v = (at.place[i][0], at.place[i][1]), (at.velocity[i][0], at.velocity[i][1])
            begin(w, i, place, v, roll_after(w, i), noise)
            path = path_of(w, i)
            at.velocity[i], at.changed[i] = (path.vx, path.vy), 1


# -- collapse --------------------------------------------------------------------------------------


def play_out(w: Any) -> None:
    """Answer the hits of a collapse, at one instant, until closing speeds are rounding."""
    at = w.instant
    c = room_to_collapse(w)
    w.collapses += at.contacts > 2
    c.can_leap, c.most = can_leap(w), collapse.MOST_HITS
    if w.collapses > decisions.PILE:
        c.most = decisions.MOST_IN_PILE
    at.turns, at.is_played_out = at.contacts, 1
    for k in range(at.contacts):
        at.turn[k], at.kind[k] = k, COLLAPSED
    begin_round(w)
    collapse.begin(c, at.contact, at.contacts, at.gap, left_out(w.errors))
    while collapse.next_hits(c, at.contact, at.velocity) > 0:
        hits = 0
        for k in range(at.contacts):
            if c.hits[k]:
                at.hitting[hits], at.which[hits] = at.contact[k], k
                hits += 1
        answer_hits(w, hits)
    settle(w)  # Mostly this changes rounding only.
    at.is_played_out = 0
    for n in range(at.balls):
        at.moved[at.ball[n]] = COLLAPSED
    note_collapse(w)
    report(w, False)
    carry_out(w)


def press_together(w: Any) -> None:
    """Answer all contacts of a cluster by one plastic hit, because a wall squeezes its balls."""
    at = w.instant
    at.turns, at.is_played_out = at.contacts, 1
    for k in range(at.contacts):
        at.turn[k], at.kind[k] = k, COLLAPSED
    begin_round(w)
    settle(w)
    at.is_played_out = 0
    for n in range(at.balls):
        at.moved[at.ball[n]] = COLLAPSED
    report(w, False)
    carry_out(w)


def settle(w: Any) -> None:
    """Give an inelastic collapse its limit: a plastic hit (e = 0) without friction."""
    at = w.instant
    for k in range(at.contacts):
        read_plastic(w, k)
        at.which[k] = k
    join(at.hitting, at.contacts, at.first)
    for k in range(at.contacts):
        size = take_group(at, at.contacts, k)
        if size > 0:
            settle_group(w, size)
