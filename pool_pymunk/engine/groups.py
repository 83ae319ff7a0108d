"""Groups are balls in persistent contact; here is who is in which, and by which contacts.

The functions are loops over the numbers of :class:`Groups`, in lists or in arrays. They ask those
who play them, ``w``, only by the functions of :mod:`pool_pymunk.engine.asked`. A contact is a ball
and its ``other`` one, or -1 - the number of a wall.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pool_pymunk.engine.asked import find_end, has_room, mass_of, pull_and_drag, radius_of
from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.recorder import Persisted
from pool_pymunk.physics.pieces import clear_total
from pool_pymunk.physics.pressed import find_units, lengths, rows_of, set_time

NONE = -1  # stands for no ball, no contact

# What groups have by ball N and by contact C. A ball's `leader` is the first ball of its group, or
# -1; the `next` ones follow from there, and `contact` begins the list of the leader's contacts.
# `state`, `phase` and `stuck` are those at the beginning of a piece (physics/pressed.py), `end` is
# its end. The leader has what the group has: when its piece `began`, its length `span`, its number
# of `steps`, how long the `longest` and the one `after` may be (s), what ends it (`fell`, `faded`),
# the `changes` of mode at one instant, how long (s) balls that creep are `held_for`, and its
# tolerances (`small`). A ball has had `many` hits,
# the last at `hit_t` (s); it is `loose` if its group was taken apart.
# `wait` has contacts without forces (ball, other) `until` a time (s), of a moment `length` (s).
FORM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "leader": (int, ("N",)), "next": (int, ("N",)), "contact": (int, ("N",)),
    "state": (float, ("N", 6)), "end": (float, ("N", 6)), "phase": (int, ("N",)),
    "stuck": (int, ("N",)), "began": (float, ("N",)), "span": (float, ("N",)),
    "steps": (int, ("N",)), "longest": (float, ("N",)), "after": (float, ("N",)),
    "fell": (int, ("N",)), "faded": (int, ("N",)), "changes": (int, ("N",)),
    "held_for": (float, ("N",)),
    "small": (float, ("N", 3)),
    "hit_t": (float, ("N",)), "many": (int, ("N",)), "loose": (int, ("N",)), "todo": (int, ("N",)),
    "local": (int, ("N",)), "first": (int, ("N",)), "joined": (int, ("N",)), "out": (int, ("N",)),
    "balls_of": (int, ("N",)), "contacts_of": (int, ("N",)),
    "one": (int, ("C",)), "other": (int, ("C",)), "following": (int, ("C",)),
    "on": (int, ("C",)), "slides": (int, ("C",)), "into": (int, ("C",)), "over": (int, ("C",)),
    "what": (int, ("C",)), "mu": (float, ("C",)), "edge": (float, ("C", 8)),
    "drift": (float, ("C", 6)),
    "total": (float, ("C", 3)), "hit": (int, ("C", 2)),
    "wait": (int, ("C", 2)), "until": (float, ("C",)), "ended": (float, ("C",)),
    "length": (float, ("C",)),
}  # fmt: skip


# Where there are patches, a ball is in one, or in none (-1). It last `crossed` a border at a time
# (s), and has had so many `crossings` at that instant.
OF_PATCHES: dict[str, tuple[type, tuple[Any, ...]]] = {
    "patch": (int, ("N",)), "crossed": (float, ("N",)), "crossings": (int, ("N",)),
}  # fmt: skip


class Groups:
    """These are the groups of an engine, in lists; ``persisted`` has their contacts so far."""

    def __init__(self) -> None:
        self.coarser = 1.0  # so many times as much is left out
        self.members = self.loosened = self.waits = self.hits = self.todos = self.begun = 0
        self.used, self.free, self.begun_t = 0, NONE, -math.inf
        self.room = 0, 0
        self.persisted: dict[Hit, Persisted] = {}
        self.patch: list[int] = []
        self.crossed: list[float] = []
        self.crossings: list[int] = []

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...  # the lists of FORM

    def hold(self, balls: int, contacts: int) -> None:
        """Have room for so many balls and contacts."""
        n, c = self.room
        if balls <= n and contacts <= c:
            return
        more = max(balls, 2 * n) - n if balls > n else 0, max(contacts, 2 * c) - c
        self.room = n + more[0], c + more[1]
        for name, (kind, shape) in FORM.items():
            setattr(self, name, [*getattr(self, name, ()), *rows_of(kind, lengths(shape, *more))])
        for i in range(n, n + more[0]):
            forget_ball(self, i)

    def hold_patches(self, balls: int) -> None:
        """Have room for the patches of so many balls."""
        more = balls - len(self.patch)
        self.patch += [NONE] * more
        self.crossed += [-math.inf] * more
        self.crossings += [0] * more


def forget_all(r: Any) -> None:
    """Forget all groups, and what has been until now, except what balls were part of."""
    r.members = r.loosened = r.waits = r.hits = r.todos = r.begun = r.used = 0
    r.free, r.begun_t = NONE, -math.inf


def forget_ball(r: Any, i: int) -> None:
    """Forget what ball ``i`` was part of."""
    r.leader[i], r.loose[i], r.many[i], r.hit_t[i] = NONE, 0, 0, -math.inf


def contact_of(r: Any, i: int, other: int) -> int:
    """Return the contact of a ball and another one or a wall in their group, or -1."""
    k = r.contact[r.leader[i]] if r.leader[i] != NONE else NONE
    while k != NONE and (r.one[k] != i or r.other[k] != other):
        k = r.following[k]
    return int(k)


def holds(r: Any, i: int, other: int) -> bool:
    """Tell whether a persistent contact presses a ball and another one or a wall together."""
    k = contact_of(r, i, other) if r.members else NONE
    return k != NONE and bool(r.on[k])


def wait_of(r: Any, i: int, other: int) -> int:
    """Return the number of the wait of a contact, or -1."""
    for m in range(r.waits):
        if r.wait[m][0] == i and r.wait[m][1] == other:
            return m
    return NONE


def loosen(r: Any, i: int) -> None:
    """Let the contacts of a ball be predicted again."""
    if not r.loose[i]:
        r.loose[i], r.out[r.loosened] = 1, i
        r.loosened += 1


def put_ball(w: Any, m: int, i: int, phase: int, stuck: int) -> None:
    """Put ball ``i`` into the press, as its ball ``m``."""
    g = w.press
    g.ball[m], g.mass[m], g.radius[m] = i, mass_of(w, i), radius_of(w, i)
    g.phase[m], g.stuck[m], w.groups.local[i] = phase, stuck, m
    g.pull[m], g.drag[m] = pull_and_drag(w, i)


def put_contact(w: Any, k: int, i: int, other: int) -> None:
    """Put a contact into the press, as its contact ``k``."""
    g, r = w.press, w.groups
    g.one[k], g.place[k] = r.local[i], other
    g.other[k] = r.local[other] if other >= 0 else NONE


def set_leader(r: Any, i: int, leader: int) -> None:
    """Let a ball be part of a leader's group, or of none."""
    if leader != NONE:
        r.members += 1
    if r.leader[i] != NONE:
        r.members -= 1
    r.leader[i] = leader


def free_contacts(r: Any, leader: int) -> None:
    """Give back the places of a group's contacts."""
    k = r.contact[leader]
    while k != NONE:
        following = r.following[k]
        r.following[k], r.free = r.free, k
        k = following
    r.contact[leader] = NONE


def load(w: Any, leader: int) -> None:
    """Put a group into the press, as it is at the beginning of its piece."""
    r = w.groups
    has_room(w, r.balls_of[leader], r.contacts_of[leader])
    g, m, i = w.press, 0, leader
    while i != NONE:
        put_ball(w, m, i, r.phase[i], r.stuck[i])
        for p in range(6):
            g.state[6 * m + p] = r.state[i][p]
        m, i = m + 1, r.next[i]
    k, c = 0, r.contact[leader]
    while c != NONE:
        put_contact(w, k, r.one[c], r.other[c])
        g.on[k], g.over[k], g.slides[k], g.into[k] = r.on[c], r.over[c], r.slides[c], r.into[c]
        g.what[k], g.mu[k] = r.what[c], r.mu[c]
        for n in range(8):
            g.edge[k][n] = r.edge[c][n]
        for n in range(6):
            g.drift[k][n] = r.drift[c][n]
        for n in range(3):
            g.total[k][n] = r.total[c][n]
        k, c = k + 1, r.following[c]
    g.balls, g.contacts = m, k
    set_time(g, r.began[leader])
    for n in range(3):
        g.small[n] = r.small[leader][n]
    find_units(g)


def find_state(w: Any, leader: int, t: float) -> None:
    """Put a group into the press; ``end`` and ``total`` become those at a time (s) of its piece."""
    load(w, leader)
    g, r = w.press, w.groups
    if t >= r.began[leader] + r.span[leader]:
        for m in range(g.balls):
            for p in range(6):
                g.end[6 * m + p] = r.end[g.ball[m]][p]
    elif t <= r.began[leader]:
        for p in range(6 * g.balls):
            g.end[p] = g.state[p]
        clear_total(g)
    else:
        find_end(w, r.steps[leader], r.longest[leader], t - r.began[leader])
    g.at[1] = t
