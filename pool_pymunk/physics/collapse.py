"""This module plays the hits of an inelastic collapse, all at one instant.

A light ball that a heavy one squeezes to a cushion is the usual case. Its hits are played in
rounds: every contact that closes is answered. Soon the rounds repeat: the same contacts close, and
the friction of each has the same direction. Such a cycle is a linear map of the closing speeds and
slips r of its contacts, and of the velocities v,

    r -> T r,   v -> v + Q r.

Restitution is linear, and so is friction: it is mu J_n where two sides slip, and takes all of the
slip where they stick. So n cycles are the n-th power of the map, by repeated squaring:

    v -> v + Q S_n r,   S_n = 1 + T + ... + T^(n-1),   S_2n = S_n + S_n T^n.

A leap over n cycles is valid if the next cycle is still the same. The parts of r that no hit
answers, such as slips without friction, are left out of the map.

The functions are loops over the numbers of a record, in lists or in arrays. They do not answer
hits: the caller does, until :func:`next_hits` finds no more.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pool_pymunk.physics.contact import NO_BALL, Contact, closing_speed, slip_of
from pool_pymunk.physics.together import fastest_of, list_balls, push

# Half or twice each of these bounds moves at most one end of 54, by 3e-6 m at most (``python -m
# tests.halved physics.collapse.CLUSTER``, and so on). Beyond a bound a policy answers.
MOST_HITS = 30_000  # This many hits are played one by one at most.
MOST_IN_TIME = 2_000  # This many hits come in the order of their times; then all gaps are closed.
CLUSTER = 8  # With more contacts than this, all gaps count as closed.
MOST_IN_CLUSTER = 1_000  # At most this many hits of such a cluster are played.
TOGETHER_IN_TIME = 1e-9  # Hits whose times differ by this share come together.
TOGETHER = 20  # A round of several contacts, or a leap, takes the time of this many hits.
LONGEST_CYCLE = 24  # rounds
# A cycle with more closing speeds and slips than this is not leapt over. With 8, 20 of 1,200 random
# collapses ended otherwise, with 32 none.
MOST_PARTS = 16
MOST_DOUBLINGS = 30  # The cycles of a leap double this many times at most.
TO_BE_SURE = 0.25  # A leap goes to this share of the noise, where a collapse is surely over.
SHORT = 8  # After a leap over fewer cycles, the next one is tried later.

STICKS = 0  # Friction takes the whole slip; else its number is the sign of the slip.
NORMAL, ALONG = 0, 1  # parts of a contact's speed: it closes, it slips
LATEST = 2 * LONGEST_CYCLE  # This many rounds are kept.

# These are the rows of a collapse, each with its type, and its shape by the most balls N and
# contacts C. `ball` lists the balls. Each contact has its `gap` (m), the speed at which it is
# `closing` (m/s), and whether it is among the next `hits`. A round has the `size` of its list
# `which` of contacts; `slides` tells how the friction of each acts. Each `part` of the map is a
# contact and NORMAL or ALONG, and its speed is `r` (m/s). Each of the balls that are a `mover`
# changes its velocity by two rows of `push` (Q), and `turn` is T to the n-th power, and its square
# is made in `spare`. `sums` are S_n. The velocities (m/s) of all balls are those at the `start` of
# a leap, `after` it, and in a cycle that is on `trial`.
FORM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "ball": (int, ("N",)), "is_in": (int, ("N+1",)),
    "gap": (float, ("C",)), "closing": (float, ("C",)), "hits": (int, ("C",)),
    "size": (int, (LATEST,)), "which": (int, (LATEST, MOST_PARTS)),
    "slides": (int, (LATEST, MOST_PARTS)),
    "part": (int, (MOST_PARTS, 2)), "mover": (int, (2 * MOST_PARTS,)), "r": (float, (MOST_PARTS,)),
    "push": (float, (4 * MOST_PARTS, MOST_PARTS)), "turn": (float, (MOST_PARTS, MOST_PARTS)),
    "spare": (float, (MOST_PARTS, MOST_PARTS)),
    "sums": (float, (MOST_DOUBLINGS + 1, MOST_PARTS, MOST_PARTS)),
    "start": (float, ("N+1", 2)), "after": (float, ("N+1", 2)), "trial": (float, ("N+1", 2)),
}  # fmt: skip


class Collapse(NamedTuple):
    """A collapse had these ``hits``, and ``is_over`` tells whether they came to an end."""

    hits: int
    is_over: bool


def go_on(gaps: Any, closing: Any, count: int, least: float, hits: Any) -> int:
    """Go on to the next hits that are faster than ``least`` (m/s), mark them, and count them.

    ``gaps`` (m) close at the speeds ``closing`` (m/s).
    """
    wait, found = math.inf, 0  # s
    for k in range(count):
        hits[k] = False
        if closing[k] > least:
            wait = min(wait, gaps[k] / closing[k])
    if wait == math.inf:
        return 0
    latest = wait * (1.0 + TOGETHER_IN_TIME)
    for k in range(count):
        hits[k] = closing[k] > least and gaps[k] / closing[k] <= latest
        found += hits[k]
        gaps[k] = 0.0 if hits[k] else max(gaps[k] - closing[k] * wait, 0.0)
    return found


# -- hit by hit ----------------------------------------------------------------------------------


def begin(c: Any, contacts: Any, count: int, gaps: Any, noise: float) -> None:
    """Begin the collapse of contacts with these ``gaps`` (m).

    ``noise`` is the share of the speeds that may be rounding. Where ``c.can_leap``, which needs
    Coulomb's law, cycles of hits are leapt over. At most ``c.most`` hits are played one by one.
    """
    c.contacts, c.noise = count, noise
    c.played = c.spent = c.rounds = c.wait = c.is_over = 0
    c.pause, c.least = 1, 0.0
    list_balls(c, contacts, count)
    for k in range(count):
        c.gap[k] = max(gaps[k], 0.0)
    if count > CLUSTER:
        close_gaps(c)
        c.most = min(c.most, MOST_IN_CLUSTER)


def next_hits(c: Any, contacts: Any, velocity: Any) -> int:
    """Go on to the next hits, mark them in ``c.hits``, and return how many there are.

    The caller answers them. There are none where the collapse ``is_over``, and where more hits
    would be too many. ``velocity`` (m/s) changes where cycles are leapt over.
    """
    while True:
        c.least = max(c.least, c.noise * fastest_of(c, velocity))
        if c.played >= MOST_IN_TIME:
            close_gaps(c)
        for k in range(c.contacts):
            c.closing[k] = closing_speed(contacts[k], velocity)
        found = go_on(c.gap, c.closing, c.contacts, c.least, c.hits)
        c.is_over = found == 0
        if found == 0 or c.spent >= c.most:
            return 0
        leapt = leap_over(c, contacts, velocity) if c.can_leap and may_leap(c) else 0
        c.played += leapt if leapt > 0 else found
        c.spent += 1 if found == 1 and leapt == 0 else TOGETHER
        if leapt == 0:
            return found
        close_gaps(c)


def close_gaps(c: Any) -> None:
    """Let all gaps be closed from now on."""
    for k in range(c.contacts):
        c.gap[k] = 0.0


def may_leap(c: Any) -> bool:
    """Tell whether gaps have no part in the order of the hits any more."""
    widest = 0.0
    for k in range(c.contacts):
        widest = max(widest, c.gap[k])
    return c.contacts == 2 or widest == 0.0


# -- rounds and cycles ---------------------------------------------------------------------------


def leap_over(c: Any, contacts: Any, velocity: Any) -> int:
    """Leap over cycles, if the last rounds repeat, and return how many hits that were."""
    note_round(c, contacts, velocity)
    c.wait -= 1
    if c.wait > 0 or not find_cycle(c):
        return 0
    cycles = leap(c, contacts, velocity) if find_parts(c, contacts) else 0
    c.pause = 1 if cycles >= SHORT else 2 * c.pause
    c.wait = c.pause
    if cycles == 0:
        return 0
    c.rounds, hits = 0, 0
    for n in range(c.period):
        hits += c.size[(c.first + n) % LATEST]
    return cycles * hits


def note_round(c: Any, contacts: Any, velocity: Any) -> None:
    """Note which contacts close, and how friction acts; forget all if two of them share a ball."""
    least, size = TO_BE_SURE * c.least, 0
    which, slides = c.which[c.rounds % LATEST], c.slides[c.rounds % LATEST]
    for k in range(c.contacts):
        if c.closing[k] > least:
            if size == MOST_PARTS or shares_ball(contacts, k, which, size):
                c.rounds = 0
                return
            slip = slip_of(contacts[k], velocity)
            which[size], slides[size] = k, slides_as(contacts[k], c.closing[k], slip)
            size += 1
    c.size[c.rounds % LATEST] = size
    c.rounds += 1


def shares_ball(contacts: Any, k: int, which: Any, size: int) -> bool:
    """Tell whether a contact shares a ball with one of a list."""
    a, b = contacts[k].a, contacts[k].b
    for p in range(size):
        other = contacts[which[p]]
        if a in (other.a, other.b) or (b != NO_BALL and b in (other.a, other.b)):
            return True
    return False


def slides_as(one: Contact, closing: float, slip: float) -> int:
    """Return how friction acts: ``STICKS``, or the sign of the slip (m/s)."""
    mu = one.pair.friction
    if mu == 0.0 or abs(slip) <= mu * (1.0 + one.pair.restitution) * closing:
        return STICKS
    return 1 if slip > 0.0 else -1


def find_cycle(c: Any) -> bool:
    """Find the shortest cycle that the last rounds repeat; return whether there is one."""
    for period in range(1, min(c.rounds, LATEST) // 2 + 1):
        if has_period(c, period):
            c.period, c.first = period, c.rounds - 1 - period
            return True
    return False


def has_period(c: Any, period: int) -> bool:
    """Tell whether the last rounds, as many as a period has, are those before them."""
    for n in range(c.rounds - 1, c.rounds - 1 - period, -1):
        one, other = n % LATEST, (n - period) % LATEST
        if c.size[one] != c.size[other]:
            return False
        for p in range(c.size[one]):
            if c.which[one][p] != c.which[other][p] or c.slides[one][p] != c.slides[other][p]:
                return False
    return True


# -- leaps ---------------------------------------------------------------------------------------


def find_parts(c: Any, contacts: Any) -> bool:
    """List the parts of the cycle's map, and its balls; return False if there are too many."""
    c.parts = c.movers = 0
    for n in range(c.first, c.first + c.period):
        row = n % LATEST
        for p in range(c.size[row]):
            k = c.which[row][p]
            sticks = c.slides[row][p] == STICKS and contacts[k].pair.friction > 0.0
            if not add_part(c, k, NORMAL) or (sticks and not add_part(c, k, ALONG)):
                return False
            add_mover(c, contacts[k].a)
            add_mover(c, contacts[k].b)
    return True


def add_part(c: Any, k: int, kind: int) -> bool:
    """Add a part to the map, if it is not there; return False if there is no room."""
    for p in range(c.parts):
        if c.part[p][0] == k and c.part[p][1] == kind:
            return True
    if c.parts == MOST_PARTS:
        return False
    c.part[c.parts][0], c.part[c.parts][1] = k, kind
    c.parts += 1
    return True


def add_mover(c: Any, ball: int) -> None:
    """Add a ball to those that the cycle moves, if it is not there."""
    for m in range(c.movers):
        if c.mover[m] == ball:
            return
    if ball != NO_BALL:
        c.mover[c.movers] = ball
        c.movers += 1


def leap(c: Any, contacts: Any, velocity: Any) -> int:
    """Leap while cycles stay the same, and return over how many."""
    find_map(c, contacts)
    copy_velocities(c, velocity, c.start)
    cycles = doublings = 0
    while doublings < MOST_DOUBLINGS and try_power(c, contacts, doublings):
        cycles += 1 << doublings
        double(c, doublings)
        doublings += 1
    for n in range(doublings - 1, -1, -1):
        if try_power(c, contacts, n):
            cycles += 1 << n
    for m in range(c.movers if cycles > 0 else 0):
        v = c.start[c.mover[m]]
        velocity[c.mover[m]] = (v[0], v[1])
    return cycles


def find_map(c: Any, contacts: Any) -> None:
    """Find what a cycle makes of each part alone, and what that does to the balls."""
    for q in range(c.parts):
        for p in range(c.balls):
            c.trial[c.ball[p]] = (0.0, 0.0)
        for n in range(c.first, c.first + c.period):
            hit_round(c, contacts, n % LATEST, q)
        for m in range(c.movers):
            v = c.trial[c.mover[m]]
            c.push[2 * m][q], c.push[2 * m + 1][q] = v[0], v[1]
        for p in range(c.parts):
            c.sums[0][p][q] = 1.0 if p == q else 0.0
            c.turn[p][q] = c.sums[0][p][q] + speed_of(c, contacts, p, c.trial)


def hit_round(c: Any, contacts: Any, row: int, q: int) -> None:
    """Answer a round's hits, as if part q, unless it is -1, were faster by 1 m/s."""
    for p in range(c.size[row]):
        k, v = c.which[row][p], c.trial
        one = contacts[k]
        closing, slip = closing_speed(one, v), slip_of(one, v)
        if q >= 0 and c.part[q][0] == k:
            closing += c.part[q][1] == NORMAL
            slip += c.part[q][1] == ALONG
        lightness = 1.0 / one.pair.m_a + (0.0 if one.b == NO_BALL else 1.0 / one.pair.m_b)
        mu, slides = one.pair.friction, c.slides[row][p]
        along = (1.0 + one.pair.restitution) * closing / lightness
        across = -slides * mu * along
        if slides == STICKS and mu > 0.0:
            across = -slip / lightness
        push(one, along, across, v)


def speed_of(c: Any, contacts: Any, p: int, velocity: Any) -> float:
    """Return the speed (m/s) of a part."""
    one = contacts[c.part[p][0]]
    if c.part[p][1] == NORMAL:
        return float(closing_speed(one, velocity))
    return slip_of(one, velocity)


def double(c: Any, n: int) -> None:
    """Find the map of 2 to the power n + 1 cycles from that of half as many."""
    turn, sums, twice = c.turn, c.sums[n], c.sums[n + 1]
    for p in range(c.parts):
        for q in range(c.parts):
            square, total = 0.0, sums[p][q]
            for m in range(c.parts):
                square += turn[p][m] * turn[m][q]
                total += sums[p][m] * turn[m][q]
            c.spare[p][q], twice[p][q] = square, total
    for p in range(c.parts):
        for q in range(c.parts):
            turn[p][q] = c.spare[p][q]


def try_power(c: Any, contacts: Any, doublings: int) -> bool:
    """Go on by that power of the map if the next cycle is still the same; tell whether it is."""
    sums = c.sums[doublings]
    for p in range(c.parts):
        c.r[p] = speed_of(c, contacts, p, c.start)
    copy_velocities(c, c.start, c.after)
    for p in range(c.parts):
        total = 0.0
        for q in range(c.parts):
            total += sums[p][q] * c.r[q]
        for m in range(c.movers):
            i = c.mover[m]
            x, y = c.push[2 * m][p] * total, c.push[2 * m + 1][p] * total
            c.after[i] = (c.after[i][0] + x, c.after[i][1] + y)
    copy_velocities(c, c.after, c.trial)
    for n in range(c.first, c.first + c.period):
        if not is_round(c, contacts, n % LATEST):
            return False
        hit_round(c, contacts, n % LATEST, -1)
    copy_velocities(c, c.after, c.start)
    return True


def is_round(c: Any, contacts: Any, row: int) -> bool:
    """Tell whether the velocities on trial lead to this round."""
    least, found = TO_BE_SURE * c.least, 0
    for k in range(c.contacts):
        closing = closing_speed(contacts[k], c.trial)
        if closing > least:
            if found == c.size[row] or c.which[row][found] != k:
                return False
            slip = slip_of(contacts[k], c.trial)
            slides = slides_as(contacts[k], closing, slip)
            if slides != c.slides[row][found] or not closing + abs(slip) < math.inf:
                return False
            found += 1
    return bool(found == c.size[row])


def copy_velocities(c: Any, source: Any, target: Any) -> None:
    """Copy the velocities of the balls."""
    for p in range(c.balls):
        v = source[c.ball[p]]
        target[c.ball[p]] = (v[0], v[1])
