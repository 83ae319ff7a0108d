"""Groups of balls in persistent contact move in pieces, by the forces that keep their gaps closed.

Each ball of a group gets two short paths for a piece. What ends the piece is due like the end of
any path: a force, a slip or a speed falls to zero, or a side ends. A hit on a ball of a group takes
the group apart; what presses after it is a group again.

The functions are loops over the numbers of :class:`Groups`, in lists or in arrays. They ask those
who play them, ``w``, only by the functions of :mod:`pool_pymunk.engine.asked`. A contact is a ball
and its ``other`` one, or -1 - the number of a wall.
"""

from __future__ import annotations

import math
from itertools import accumulate
from operator import mul
from typing import TYPE_CHECKING, Any

from pool_pymunk.engine.asked import (
    begins_to_rest,
    begins_to_roll,
    coefficients,
    count_unlisted,
    facing,
    find_end,
    find_piece,
    find_touching,
    finds_forces,
    follower,
    gap_between,
    has_room,
    has_room_to_wait,
    is_closed,
    is_pocket,
    lead,
    mass_of,
    motion,
    moves_on,
    next_place,
    noise_of,
    note_impulse,
    note_let_go,
    note_piece,
    path_from,
    path_of,
    predict_loose,
    pull_and_drag,
    push_piece,
    push_press,
    radius_of,
    read_shape,
    roll_of,
    rolls,
)
from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.recorder import Persisted
from pool_pymunk.physics.contact import Contact
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.persistent import UNSEEN, persists, pressing_of_balls, pressing_of_wall
from pool_pymunk.physics.pieces import (
    DEVIATION,
    Piece,
    change,
    clear_total,
    close,
    halves,
    is_even,
    join,
    moves,
    settle,
)
from pool_pymunk.physics.pressed import (
    NEAR,
    REST,
    ROLL,
    STUCK,
    Press,
    find_forces,
    find_units,
    guess,
    lengths,
    look,
    opening,
    rows_of,
    set_scale,
)

# s; the first piece of a mode is no longer. Where a contact has just opened it is shorter, because
# the gap is still narrower than pieces deviate.
FIRST, OPENED = 5e-5, 1e-6
# After this many changes of the mode at one instant, or groups that begin at it for each ball, a
# group has no forces for a moment.
MOST_CHANGES = 50
STILL = 1e-10  # of a speed that friction gives within a radius: slower sides do not part or close
# Once a ball has had more than FEW hits, each less than AGO (s) after the one before, each further
# one lets GROWTH times as much go unseen, for MOST hits at most.
GROWTH, FEW, MOST, AGO = 1.3, 30, 50, 0.05
WEAR = tuple(accumulate([GROWTH] * MOST, mul, initial=1.0))
SHORTLY = 1e-3  # of the time from its beginning to a hit; a piece is cut so much before it
NONE = -1  # stands for no ball, no contact

# What groups have by ball N and by contact C. A ball's `leader` is the first ball of its group, or
# -1; the `next` ones follow from there, and `contact` begins the list of the leader's contacts.
# `state`, `phase` and `stuck` are those at the beginning of a piece (physics/pressed.py), `end` is
# its end. The leader has what the group has: when its piece `began`, its length `span`, its number
# of `steps`, how long the `longest` and the one `after` may be (s), what ends it (`fell`, `faded`),
# the `changes` of mode at one instant, and its tolerances (`small`). A ball has had `many` hits,
# the last at `hit_t` (s); it is `loose` if its group was taken apart.
# `wait` has contacts without forces (ball, other) `until` a time (s), of a moment `length` (s).
FORM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "leader": (int, ("N",)), "next": (int, ("N",)), "contact": (int, ("N",)),
    "state": (float, ("N", 6)), "end": (float, ("N", 6)), "phase": (int, ("N",)),
    "stuck": (int, ("N",)), "began": (float, ("N",)), "span": (float, ("N",)),
    "steps": (int, ("N",)), "longest": (float, ("N",)), "after": (float, ("N",)),
    "fell": (int, ("N",)), "faded": (int, ("N",)), "changes": (int, ("N",)),
    "small": (float, ("N", 3)),
    "hit_t": (float, ("N",)), "many": (int, ("N",)), "loose": (int, ("N",)), "todo": (int, ("N",)),
    "local": (int, ("N",)), "first": (int, ("N",)), "joined": (int, ("N",)), "out": (int, ("N",)),
    "balls_of": (int, ("N",)), "contacts_of": (int, ("N",)), "is_new": (int, ("N",)),
    "one": (int, ("C",)), "other": (int, ("C",)), "following": (int, ("C",)),
    "on": (int, ("C",)), "slides": (int, ("C",)), "into": (int, ("C",)), "over": (int, ("C",)),
    "what": (int, ("C",)), "mu": (float, ("C",)), "edge": (float, ("C", 8)),
    "total": (float, ("C", 3)), "hit": (int, ("C", 2)),
    "wait": (int, ("C", 2)), "until": (float, ("C",)), "ended": (float, ("C",)),
    "length": (float, ("C",)),
}  # fmt: skip


class Groups:
    """These are the groups of an engine, in lists; ``persisted`` has their contacts so far."""

    def __init__(self) -> None:
        self.coarser = 1.0  # so many times as much is left out
        self.members = self.loosened = self.waits = self.hits = self.todos = self.begun = 0
        self.used, self.free, self.begun_t = 0, NONE, -math.inf
        self.room = 0, 0
        self.persisted: dict[Hit, Persisted] = {}
        self.modes: dict[int, tuple[Press, list[Contact]]] = {}  # by leader, for a recorder

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


def forget_all(r: Any) -> None:
    """Forget all groups, and what has been until now, except what balls were part of."""
    r.members = r.loosened = r.waits = r.hits = r.todos = r.begun = r.used = 0
    r.free, r.begun_t = NONE, -math.inf


def forget_ball(r: Any, i: int) -> None:
    """Forget what ball ``i`` was part of."""
    r.leader[i], r.loose[i], r.many[i], r.hit_t[i] = NONE, 0, 0, -math.inf


# -- what is asked before a hit --------------------------------------------------------------------


def takes(w: Any, sides: Any, i: int, other: int, t: float) -> bool:
    """Tell whether a hit at ``t`` (s) is no hit: a contact persists, or is predicted later."""
    k = contact_of(w.groups, i, other)
    if k != NONE and (w.groups.on[k] or is_idle(w, sides, i, other)):
        return True
    m = wait_of(w.groups, i, other)
    if m != NONE and w.groups.until[m] > w.now:
        push_press(w, i, w.groups.until[m])
        return True
    if look_at(w, sides, i, other) or cuts(w, i, other, t):
        return True
    return t <= w.now and rubs(w, sides, i, other)


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


def look_at(w: Any, sides: Any, i: int, other: int) -> bool:
    """Look whether two sides touch that persist from now on: a group begins at this instant."""
    if is_pocket(w, sides, other) or not is_closed(w, sides, i, other):
        return False
    if persists_now(w, sides, i, other):
        push_press(w, i, w.now)
        return True
    return False


def persists_now(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides are in persistent contact from now on, by their present paths."""
    parting, noise = -closing_of(w, sides, i, other), noise_between(w, i, other)
    if parting < -noise:
        return False
    return stays_after(w, sides, i, other, parting if parting > noise else 0.0)


def closing_of(w: Any, sides: Any, i: int, other: int) -> float:
    """Return how fast (m/s) two sides close now."""
    nx, ny, _ = facing(w, sides, i, other)
    _, _, vx, vy = motion(w, i)
    if other < 0:
        return -(vx * nx + vy * ny)
    _, _, ux, uy = motion(w, other)
    return vx * nx + vy * ny - (ux * nx + uy * ny)


def noise_between(w: Any, i: int, other: int) -> float:
    """Return how much of the velocities in a contact (m/s) may be rounding."""
    return max(noise_of(w, i), noise_of(w, other)) if other >= 0 else noise_of(w, i)


def least_radius(w: Any, i: int, other: int) -> float:
    """Return the smaller radius (m) in a contact."""
    return min(radius_of(w, i), radius_of(w, other)) if other >= 0 else radius_of(w, i)


def stays_after(w: Any, sides: Any, i: int, other: int, parting: float) -> bool:
    """Tell whether two sides that part at this speed (m/s) stay in contact, to the eye.

    What presses them now presses them at the end of a slip, too, if it ends before the bounces. The
    restitution is asked for only where it matters.
    """
    nx, ny, bends = facing(w, sides, i, other)
    a, b = tangent_of(w, i), tangent_of(w, other if other >= 0 else i)
    radius = least_radius(w, i, other) * wear(w, i, other)
    pressing = pressing_of(a, b, other, (nx, ny, bends), w.now)
    if parting <= 0.0 or not persists(parting, pressing, 0.0, radius):
        return parting <= 0.0 < pressing
    e, _ = coefficients(w, sides, i, other)
    if not persists(parting, pressing, e, radius):
        return False
    bounces = 2.0 * parting / (pressing * (1.0 - e))
    soonest = min(math.inf if a.slows else a.end, math.inf if b.slows else b.end)
    is_grouped = w.groups.leader[i] != NONE or (other >= 0 and w.groups.leader[other] != NONE)
    if soonest >= w.now + bounces or is_grouped:
        return True
    a = follower(w, a) if a.end == soonest else a
    b = follower(w, b) if b.end == soonest else b
    _, _, vx, vy = motion_at(a, soonest)
    closing = vx * nx + vy * ny
    if other >= 0:
        _, _, ux, uy = motion_at(b, soonest)
        closing -= ux * nx + uy * ny
    else:
        closing = -closing
    pressing = pressing_of(a, b, other, (nx, ny, bends), soonest)
    return persists(max(-closing, 0.0), pressing, e, radius)


def pressing_of(a: Path, b: Path, other: int, face: tuple[float, float, float], t: float) -> float:
    """Return how strongly (m/s^2) two sides are pressed together on these paths."""
    if other >= 0:
        return pressing_of_balls(a, b, t)
    return pressing_of_wall(a, (face[0], face[1]), face[2], t)


def tangent_of(w: Any, i: int) -> Path:
    """Return a path with the exact motion of a ball now; those of groups are mean ones."""
    r, g = w.groups, w.press
    if r.leader[i] == NONE:
        return path_of(w, i)
    find_state(w, r.leader[i], w.now)
    find_forces(g, g.end)
    s, p, d = g.end, 6 * r.local[i], g.rate
    return Path(
        w.now, s[p], s[p + 1], s[p + 2], s[p + 3], d[p + 2], d[p + 3], math.inf, False,
        s[p + 4], s[p + 5],
    )  # fmt: skip


def wear(w: Any, i: int, other: int) -> float:
    """Return how many times as much as UNSEEN the bounces of this contact may be."""
    many = w.groups.many[i] if other < 0 else max(w.groups.many[i], w.groups.many[other])
    return float(w.groups.coarser * WEAR[min(max(many - FEW, 0), MOST)])


def note_hit(w: Any, i: int) -> None:
    """Count a hit of a ball."""
    r = w.groups
    r.many[i] = r.many[i] + 1 if w.now - r.hit_t[i] < AGO else 1
    r.hit_t[i] = w.now


def is_idle(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides of a group touch, but do not visibly move."""
    near = NEAR * least_radius(w, i, other)
    is_still = abs(closing_of(w, sides, i, other)) <= stillness(w, i, other)
    return is_still and abs(gap_between(w, sides, i, other)) <= near


def stillness(w: Any, i: int, other: int) -> float:
    """Return the speed (m/s) at which two sides do not yet visibly part or close."""
    pull, _ = pull_and_drag(w)
    return STILL * math.sqrt(pull * least_radius(w, i, other))


def rubs(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides that touch close no faster than rounding explains."""
    is_slow = closing_of(w, sides, i, other) <= noise_between(w, i, other)
    return is_slow and is_closed(w, sides, i, other)


def cuts(w: Any, i: int, other: int, t: float) -> bool:
    """Cut the pieces of balls that are to hit at ``t`` (s) shortly before that.

    Within a piece places are off by its deviation; at the beginning of the next one they are not.
    """
    is_cut = is_cut_for(w, i, t)
    if other >= 0:
        is_cut |= is_cut_for(w, other, t)
    return is_cut


def is_cut_for(w: Any, i: int, t: float) -> bool:
    """Cut the piece of a ball shortly before ``t`` (s), unless it is too near."""
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE:
        return False
    wait = t - r.began[leader]  # It is the same whenever the hit is predicted.
    if t - SHORTLY * wait <= w.now or not wait > 2.0 * SHORTLY * r.span[leader]:
        return False
    push_piece(w, i, t - SHORTLY * wait)
    return True


# -- what is asked after a hit ---------------------------------------------------------------------


def look_after(w: Any, sides: Any, i: int, other: int) -> None:
    """Look at a contact that was answered at this instant."""
    note_hit(w, i)
    if other >= 0:
        note_hit(w, other)
    look_again(w, sides, i, other)


def look_again(w: Any, sides: Any, i: int, other: int) -> None:
    """Look whether two sides persist that have just hit."""
    if may_persist(w, sides, i, other):
        look_at(w, sides, i, other)


def is_slow(speed: float, strongest: float, radius: float) -> bool:
    """Tell whether bounces at a speed (m/s) may ever be too low to be seen.

    No more than the ``strongest`` acceleration (m/s^2) presses their sides together.
    """
    return speed * speed < 4.0 * strongest * UNSEEN * WEAR[MOST] * radius


def may_persist(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether the strongest pressing could hold two sides that have just hit.

    Sliding alone presses no ball on to a straight wall.
    """
    own, (pull, _) = path_of(w, i), pull_and_drag(w)
    if other < 0:
        _, _, bends = facing(w, sides, i, other)
        return rolls(w) or bends < 0.0 or not own.slows
    its = path_of(w, other)
    dx, dy = its.x - own.x, its.y - own.y
    parting = dx * (its.vx - own.vx) + dy * (its.vy - own.vy)
    square = parting * parting / (dx * dx + dy * dy)
    return parting <= 0.0 or square < 4.0 * pull * UNSEEN * radius_of(w, i) * wear(w, i, other)


def is_faint(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides would bounce too low to be seen."""
    (_, _, bends), closing = facing(w, sides, i, other), closing_of(w, sides, i, other)
    pull, _ = pull_and_drag(w)
    _, _, vx, vy = motion(w, i)
    strongest = 2.0 * pull + abs(bends) * (vx * vx + vy * vy)
    radius = radius_of(w, i) * wear(w, i, other)
    is_slow = closing * closing < 2.0 * strongest * UNSEEN * radius
    return is_slow and stays_after(w, sides, i, other, closing)


def is_absorbed(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether a faint hit has become part of a group, or does not close any more."""
    r = w.groups
    is_in = r.leader[i] != NONE and (other < 0 or r.leader[other] != NONE)
    return is_in or rubs(w, sides, i, other)


# -- groups begin and end --------------------------------------------------------------------------


def begin_at(w: Any, sides: Any, i: int) -> None:
    """Let the contacts around ball ``i`` press that persist from now on."""
    r = w.groups
    end_waits(w)
    find_touching(w, sides, i)
    kept = 0
    for k in range(r.hits):
        one, other = r.hit[k][0], r.hit[k][1]
        if stays(w, sides, one, other):
            r.hit[kept][0], r.hit[kept][1] = one, other
            kept += 1
    r.hits = kept
    for k in range(kept):
        for b in (r.hit[k][0], r.hit[k][1]):
            if b >= 0:
                release(w, b, 0.0)
    r.begun = r.begun + 1 if r.begun_t == w.now else 1
    r.begun_t = w.now
    if kept > 0 and has_room(w, 2 * kept, kept):
        gather(w, sides)
        if r.begun > MOST_CHANGES * w.press.balls:
            wait_all(w)
        else:
            join_sides(w)
            guess(w.press, w.press.state)
            close(w.press, w.press.state)
            decide_mode(w, 0, w.now, 0)
            play_pieces(w)
    predict_loose(w, sides)


def end_waits(w: Any) -> None:
    """Predict the hits of contacts again whose wait is over."""
    r = w.groups
    for m in range(r.waits):
        if r.until[m] <= w.now and r.until[m] > -math.inf:
            r.ended[m], r.until[m] = r.until[m], -math.inf
            for b in (r.wait[m][0], r.wait[m][1]):
                if b >= 0:
                    loosen(r, b)


def loosen(r: Any, i: int) -> None:
    """Let the contacts of a ball be predicted again."""
    if not r.loose[i]:
        r.loose[i], r.out[r.loosened] = 1, i
        r.loosened += 1


def stays(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides that touch neither part nor close, to the eye."""
    k = contact_of(w.groups, i, other)
    if k != NONE and w.groups.on[k]:
        return True
    speed = abs(closing_of(w, sides, i, other))
    if speed <= max(noise_between(w, i, other), stillness(w, i, other)):
        return True
    return stays_after(w, sides, i, other, speed)


def gather(w: Any, sides: Any) -> None:
    """Put the balls and contacts of a new group into the press."""
    g, r = w.press, w.groups
    g.balls = g.contacts = 0
    for k in range(r.hits):
        for b in (r.hit[k][0], r.hit[k][1]):
            if b >= 0:
                insert(g, b)
    for m in range(g.balls):
        i = g.ball[m]
        (x, y, vx, vy), (wx, wy) = motion(w, i), roll_of(w, i)
        put_ball(w, m, i, 0, 0)
        put_state(g.state, 6 * m, (x, y, vx, vy, wx, wy))
    for k in range(r.hits):
        i, other = r.hit[k][0], r.hit[k][1]
        _, mu = coefficients(w, sides, i, other)
        put_contact(w, k, i, other)
        g.mu[k], g.what[k] = mu, read_shape(w, sides, i, other, g.edge[k])
        g.on[k], g.over[k], g.slides[k], g.into[k] = 1, 0, 0, 0
    g.contacts, g.small[2] = r.hits, r.coarser
    find_units(g)
    clear_total(g)
    set_scale(g, g.state)


def insert(g: Any, i: int) -> None:
    """Put a ball among those of the press, which are in the order of their numbers, once."""
    m = g.balls
    for n in range(g.balls):
        if g.ball[n] == i:
            return
    while m > 0 and g.ball[m - 1] > i:
        g.ball[m] = g.ball[m - 1]
        m -= 1
    g.ball[m] = i
    g.balls += 1


def put_ball(w: Any, m: int, i: int, phase: int, stuck: int) -> None:
    """Put ball ``i`` into the press, as its ball ``m``."""
    g = w.press
    g.ball[m], g.mass[m], g.radius[m] = i, mass_of(w, i), radius_of(w, i)
    g.phase[m], g.stuck[m], w.groups.local[i] = phase, stuck, m


def put_state(s: Any, p: int, values: tuple[float, float, float, float, float, float]) -> None:
    """Put a ball's six numbers into a state."""
    s[p], s[p + 1], s[p + 2], s[p + 3], s[p + 4], s[p + 5] = values


def put_contact(w: Any, k: int, i: int, other: int) -> None:
    """Put a contact into the press, as its contact ``k``."""
    g, r = w.press, w.groups
    g.one[k], g.place[k] = r.local[i], other
    g.other[k] = r.local[other] if other >= 0 else NONE


def join_sides(w: Any) -> None:
    """Take away the speeds at which the sides of a new group part or close."""
    g, r, noise, fastest = w.press, w.groups, 0.0, 0.0
    for m in range(g.balls):
        noise = max(noise, noise_of(w, g.ball[m]))
    for k in range(g.contacts):
        fastest = max(fastest, abs(opening(g, g.state, k)))
    if fastest > noise:
        join(g, g.state, noise)
        for m in range(g.balls):  # All of them leave their paths.
            set_leader(r, g.ball[m], g.ball[0])


def set_leader(r: Any, i: int, leader: int) -> None:
    """Let a ball be part of a leader's group, or of none."""
    if leader != NONE:
        r.members += 1
    if r.leader[i] != NONE:
        r.members -= 1
    r.leader[i] = leader


def release(w: Any, i: int, gap: float) -> bool:
    """Take the group of a ball apart, at the present time; tell whether there was one.

    A variant opens the gaps (m) of a group that is hit: their order is unknown then.
    """
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE:
        return False
    cut(w, leader)
    if gap != 0.0:
        open_gaps(w.press, gap)
    for m in range(w.press.balls):
        let_go(w, m)
    free_contacts(r, leader)
    return True


def open_gaps(g: Any, gap: float) -> None:
    """Move the balls of a press away from a wall that one of them touches, or from each other."""
    x = y = 0.0
    for m in range(g.balls):
        x, y = x + g.state[6 * m] / g.balls, y + g.state[6 * m + 1] / g.balls
    look(g, g.state)
    for k in range(g.contacts - 1, -1, -1):
        if g.other[k] < 0:
            p, r = 6 * g.one[k], g.radius[g.one[k]]
            x, y = g.state[p] - r * g.normal[k][0], g.state[p + 1] - r * g.normal[k][1]
    least = math.inf
    for m in range(g.balls):
        least = min(least, g.radius[m])
    share = gap / (2.0 * least)
    for m in range(g.balls):
        g.state[6 * m] += share * (g.state[6 * m] - x)
        g.state[6 * m + 1] += share * (g.state[6 * m + 1] - y)


def let_go(w: Any, m: int) -> None:
    """Let ball ``m`` of the press go on by itself."""
    s, p, i = w.press.state, 6 * m, w.press.ball[m]
    set_leader(w.groups, i, NONE)
    path = path_from(w, (s[p], s[p + 1]), (s[p + 2], s[p + 3]), (s[p + 4], s[p + 5]))
    if moves_on(path):
        lead(w, i, path)
        loosen(w.groups, i)
    else:
        rest(w, m)
    note_let_go(w, i)


def rest(w: Any, m: int) -> None:
    """Let ball ``m`` of the press rest, if it has moved."""
    s = w.press.state
    if begins_to_rest(w, w.press.ball[m], s[6 * m], s[6 * m + 1]):
        loosen(w.groups, w.press.ball[m])


def free_contacts(r: Any, leader: int) -> None:
    """Give back the places of a group's contacts."""
    k = r.contact[leader]
    while k != NONE:
        following = r.following[k]
        r.following[k], r.free = r.free, k
        k = following
    r.contact[leader] = NONE


def wait_all(w: Any) -> None:
    """Let no contact of the press have a force for a moment."""
    for k in range(w.press.contacts):
        wait(w, k)


def wait(w: Any, k: int) -> None:
    """Let a contact have no force for a moment, in which no ball sinks in to be seen.

    Each time the moment is twice as long, because what presses so weakly hardly moves a ball.
    """
    g, r = w.press, w.groups
    i, other = g.ball[g.one[k]], g.place[k]
    m = wait_of(r, i, other)
    if m == NONE:
        m = new_wait(w)
        r.wait[m][0], r.wait[m][1], r.until[m], r.ended[m] = i, other, -math.inf, -math.inf
    if r.until[m] > w.now:
        return
    pull, _ = pull_and_drag(w)
    first = math.sqrt(2.0 * DEVIATION * least_radius(w, i, other) / max(pull, 1.0))
    ended = max(r.until[m], r.ended[m])
    r.length[m] = first if ended == -math.inf or ended < w.now - r.length[m] else 2.0 * r.length[m]
    r.until[m] = w.now + r.length[m]
    push_press(w, i, r.until[m])


def new_wait(w: Any) -> int:
    """Return the number of a new wait; it takes that of the oldest one if there is no room."""
    r = w.groups
    if has_room_to_wait(w):
        r.waits += 1
        return int(r.waits - 1)
    oldest = 0
    for m in range(r.waits):
        if max(r.until[m], r.ended[m]) < max(r.until[oldest], r.ended[oldest]):
            oldest = m
    return oldest


# -- pieces ----------------------------------------------------------------------------------------


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
        for n in range(3):
            g.total[k][n] = r.total[c][n]
        k, c = k + 1, r.following[c]
    g.balls, g.contacts = m, k
    for n in range(3):
        g.small[n] = r.small[leader][n]
    find_units(g)


def find_state(w: Any, leader: int, t: float) -> None:
    """Put a group into the press; ``end`` and ``total`` become those at a time (s) of its piece."""
    g, r = w.press, w.groups
    load(w, leader)
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


def cut(w: Any, leader: int) -> None:
    """Put a group into the press as it is now, and note its impulses until now."""
    g, began = w.press, w.groups.began[leader]
    find_state(w, leader, w.now)
    for p in range(6 * g.balls):
        g.state[p] = g.end[p]
    note_impulses(w, began)


def note_impulses(w: Any, began: float) -> None:
    """Note the impulses of the press's contacts, of a piece that ``began`` at a time (s)."""
    g = w.press
    for k in range(g.contacts):
        if g.on[k] or g.total[k][0] != 0.0:
            note_impulse(w, g.ball[g.one[k]], g.place[k], began, (g.total[k][1], g.total[k][2]))
    clear_total(g)


def go_on(w: Any, sides: Any, i: int) -> None:
    """Go on at the end of a half of a piece, or of the piece."""
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE:  # A ball at rest has kept its path.
        return
    end = r.began[leader] + r.span[leader]
    if w.now == path_of(w, i).end < end:
        load(w, leader)
        load_end(w)
        set_out(w, leader, 1)
    else:
        is_cut = w.now < end
        cut(w, leader)
        r.todos = 0
        if is_cut or (r.fell[leader] < 0 and not r.faded[leader] and not any_stuck(w.press)):
            keep_start(w, leader, r.span[leader] if is_cut else r.after[leader])
        else:
            for m in range(w.press.balls):
                w.press.stuck[m] = 0
            turn(w, leader)
        play_pieces(w)
    predict_loose(w, sides)


def load_end(w: Any) -> None:
    """Put the end of the piece of the group in the press into it, and the first rates."""
    g = w.press
    for m in range(g.balls):
        for p in range(6):
            g.end[6 * m + p] = w.groups.end[g.ball[m]][p]


def any_stuck(g: Any) -> bool:
    """Tell whether a ball of the press is stuck."""
    stuck = False
    for m in range(g.balls):
        stuck |= g.stuck[m] == STUCK
    return stuck


def keep_start(w: Any, leader: int, longest: float) -> None:
    """Let the group in the press, whose mode goes on, have its next piece from now on."""
    g, r = w.press, w.groups
    for m in range(g.balls):
        for p in range(6):
            r.state[g.ball[m]][p] = g.state[6 * m + p]
    r.began[leader], r.longest[leader] = w.now, longest
    r.todo[r.todos] = leader
    r.todos += 1


def play_pieces(w: Any) -> None:
    """Play the next pieces of the groups that wait for them; their modes may change at once."""
    r = w.groups
    while r.todos > 0:
        r.todos -= 1
        leader = r.todo[r.todos]
        load(w, leader)
        piece = find_piece(w, r.longest[leader])
        keep_piece(w, leader, piece)
        note_piece(w, leader, piece)
        if piece.time == 0.0:
            r.changes[leader] += 1
            turn(w, leader)
        else:
            r.changes[leader] = 0
            set_out(w, leader, 0)


def keep_piece(w: Any, leader: int, piece: Piece) -> None:
    """Keep the piece of the group in the press."""
    g, r = w.press, w.groups
    r.span[leader], r.after[leader], r.fell[leader], r.faded[leader] = piece
    r.steps[leader] = g.steps
    for m in range(g.balls):
        i = g.ball[m]
        if piece.time > 0.0 and r.stuck[i] != STUCK:
            r.stuck[i] = 0
        for p in range(6):
            r.end[i][p] = g.end[6 * m + p]
    k, c = 0, r.contact[leader]
    while c != NONE:
        for n in range(3):
            r.total[c][n] = g.total[k][n]
        k, c = k + 1, r.following[c]


def turn(w: Any, leader: int) -> None:
    """Change the mode of the group in the press at the end of its piece."""
    g, r = w.press, w.groups
    if r.faded[leader]:
        settle(g, g.state)
        for m in range(g.balls):
            if g.phase[m] == ROLL != r.phase[g.ball[m]]:
                begins_to_roll(w, g.ball[m], w.now)
    before, fell = count_on(g), r.fell[leader]
    if fell >= 0:
        change(g, g.state, fell)
        if r.span[leader] == 0.0 and fell < 4 * g.contacts and fell % 4 == 0:
            wait(w, fell // 4)
    changes = r.changes[leader]
    free_contacts(r, leader)
    decide_mode(w, changes, w.now, before)


def count_on(g: Any) -> int:
    """Return how many contacts of the press have a force."""
    count = 0
    for k in range(g.contacts):
        count += g.on[k]
    return count


def decide_mode(w: Any, changes: int, began: float, before: int) -> None:
    """Go on with the press in a mode that fits, or without forces for a moment if there is none.

    So many contacts had a force ``before``.
    """
    g = w.press
    if changes <= MOST_CHANGES and finds_forces(w):
        note_impulses(w, began)
        split(w, OPENED if count_on(g) < before else FIRST, changes)
        return
    join(g, g.state, 0.0)
    note_impulses(w, began)
    wait_all(w)
    for m in range(g.balls):
        let_go(w, m)


def split(w: Any, longest: float, changes: int) -> None:
    """Go on with the balls that contacts press together, and let go of the others."""
    g, r = w.press, w.groups
    for m in range(g.balls):
        if g.phase[m] == REST:
            rest(w, m)
    find_parts(w)
    for m in range(g.balls):
        if r.leader[g.ball[m]] != NONE and not r.joined[m]:
            let_go(w, m)
    for m in range(g.balls - 1, -1, -1):  # The first part is played first.
        if r.joined[m] and r.first[m] == m:
            store(w, m)
            leader = g.ball[m]
            r.changes[leader], r.began[leader], r.longest[leader] = changes, w.now, longest
            r.todo[r.todos] = leader
            r.todos += 1


def find_parts(w: Any) -> None:
    """Find which balls of the press contacts join, and the ``first`` ball of each part."""
    g, r = w.press, w.groups
    for m in range(g.balls):
        r.first[m], r.joined[m] = m, 0
    for _ in range(g.balls):
        for k in range(g.contacts):
            if g.on[k] and moves(g, k):
                i, j = g.one[k], g.other[k] if g.other[k] >= 0 else g.one[k]
                r.first[i] = r.first[j] = min(r.first[i], r.first[j])
                r.joined[i] = r.joined[j] = 1


def store(w: Any, root: int) -> None:
    """Keep the part of the press that has the ball ``root`` first."""
    g, r = w.press, w.groups
    leader, last, count = g.ball[root], NONE, 0
    for m in range(root, g.balls):
        if r.first[m] != root:
            continue
        i = g.ball[m]
        set_leader(r, i, leader)
        r.phase[i], r.stuck[i], r.next[i] = g.phase[m], g.stuck[m], NONE
        for p in range(6):
            r.state[i][p] = g.state[6 * m + p]
        if last != NONE:
            r.next[last] = i
        last, count = i, count + 1
    r.balls_of[leader], r.contacts_of[leader], r.contact[leader] = count, 0, NONE
    r.is_new[leader] = 1
    for n in range(3):
        r.small[leader][n] = g.small[n]
    for k in range(g.contacts - 1, -1, -1):  # The list is built from its end.
        is_in = r.first[g.one[k]] == root
        if is_in and (g.other[k] < 0 or r.first[g.other[k]] == root):
            store_contact(w, k, leader)


def store_contact(w: Any, k: int, leader: int) -> None:
    """Keep contact ``k`` of the press, before the other ones of its group."""
    g, r = w.press, w.groups
    c = r.free
    if c != NONE:
        r.free = r.following[c]
    else:
        c = next_place(w)
    r.following[c], r.contact[leader] = r.contact[leader], c
    r.contacts_of[leader] += 1
    r.one[c], r.other[c], r.what[c], r.mu[c] = g.ball[g.one[k]], g.place[k], g.what[k], g.mu[k]
    r.on[c], r.over[c], r.slides[c], r.into[c] = g.on[k], g.over[k], g.slides[k], g.into[k]
    for n in range(8):
        r.edge[c][n] = g.edge[k][n]


def set_out(w: Any, leader: int, is_second: int) -> None:
    """Put the balls of the group in the press on the paths of a half of its piece."""
    g, r, first = w.press, w.groups, NONE
    began, span = r.began[leader], r.span[leader]
    for m in range(g.balls):
        if g.phase[m] != REST:
            i = g.ball[m]
            lead(w, i, half_of(g, m, (began, span), is_second))
            loosen(r, i)
            first = i if first == NONE else first
    count_unlisted(w)
    push_piece(w, first, path_of(w, first).end)


def half_of(g: Any, m: int, when: tuple[float, float], is_second: int) -> Path:
    """Return the path of ball ``m`` of the press in a half of its piece.

    ``when`` tells when (s) the piece began, and its length (s).
    """
    (began, h), s, end, p = when, g.state, g.end, 6 * m
    middle = h / 2.0
    x, y, vx, vy, wx, wy = s[p], s[p + 1], s[p + 2], s[p + 3], s[p + 4], s[p + 5]
    if is_even(g, h):
        ax, ay = (end[p + 2] - vx) / h, (end[p + 3] - vy) / h
        return Path(began, x, y, vx, vy, ax, ay, began + h, False, wx, wy)
    (ax, ay), (bx, by) = halves(g, h, m)
    if not is_second:
        return Path(began, x, y, vx, vy, ax, ay, began + middle, False, wx, wy)
    x, y = x + middle * (vx + middle * ax / 2.0), y + middle * (vy + middle * ay / 2.0)
    vx, vy = vx + middle * ax, vy + middle * ay
    if g.phase[m] == ROLL:
        wx, wy = vx, vy
    else:
        wx, wy = (wx + end[p + 4]) / 2.0, (wy + end[p + 5]) / 2.0
    return Path(began + middle, x, y, vx, vy, bx, by, began + h, False, wx, wy)
