"""This module plays the hits of an inelastic collapse, all at one instant.

A light ball that a heavy one squeezes to a cushion is the usual case. Its hits are played in
rounds: every contact that closes is answered. Soon the rounds repeat: the same contacts close, and
the friction of each has the same direction. Such a cycle is a linear map of the closing speeds and
slips r of all contacts, and of the velocities v,

    r -> T r,   v -> v + Q r.

Restitution is linear, and so is friction: it is mu J_n where two sides slip, and takes all of the
slip where they stick. So n cycles are the n-th power of the map, by repeated squaring:
T_2n = T_n T_n and Q_2n = Q_n + Q_n T_n. A leap over n cycles is valid if the next cycle is still
the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import chain, compress
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.physics.contact import Contact, Velocities, closing_speed, fastest
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.together import lines, push

# Half or twice each of these bounds moves at most one end of 54, by 3e-6 m at most (``python -m
# tests.halved physics.collapse.CLUSTER``, and so on). Beyond a bound a policy answers.
MOST_HITS = 30_000  # This many hits are played one by one at most.
MOST_IN_TIME = 2_000  # This many hits come in the order of their times; then all gaps are closed.
CLUSTER = 8  # With more contacts than this, all gaps count as closed.
MOST_IN_CLUSTER = 1_000  # At most this many hits of such a cluster are played.
TOGETHER_IN_TIME = 1e-9  # Hits whose times differ by this share come together.
TOGETHER = 20  # A round of several contacts, or a leap, takes the time of this many hits.
LONGEST_CYCLE = 24  # rounds
MOST_DOUBLINGS = 60  # A leap is shorter than 2 to this power cycles.
TO_BE_SURE = 0.25  # A leap goes to this share of the noise, where a collapse is surely over.
SHORT = 8  # After a leap over fewer cycles, the next one is tried later.

STICKS = 0  # Friction takes the whole slip; else its number is the sign of the slip.
# A round has the numbers of the contacts that close, each with how friction acts in it.
Round = tuple[tuple[int, int], ...]


class Collapse(NamedTuple):
    """A collapse had these ``hits``, and ``is_over`` tells whether they came to an end."""

    hits: int
    is_over: bool


def play_out(
    contacts: Sequence[Contact],
    noise: float,
    velocity: Velocities,
    answer: Callable[[Sequence[Contact], Velocities], object],
    can_leap: bool,
    most: int = MOST_HITS,
) -> Collapse:
    """Answer the contacts until closing speeds are rounding; change ``velocity`` (m/s).

    ``noise`` is the share of the speeds that may be rounding. ``answer`` answers contacts that
    close. With ``can_leap``, which needs Coulomb's law, cycles of hits are leapt over. At most
    ``most`` hits are played one by one; ``is_over`` tells whether that was enough.
    """
    order = Order(contacts)
    if len(contacts) > CLUSTER:
        order.forget()
        most = min(most, MOST_IN_CLUSTER)
    leaps = Leaps(contacts) if can_leap else None
    hits = spent = 0
    least = 0.0
    while True:
        least = max(least, noise * fastest(velocity))
        if hits >= MOST_IN_TIME:
            order.forget()
        closing = order.next(velocity, least)
        if not closing:
            return Collapse(hits, is_over=True)
        if spent >= most:
            return Collapse(hits, is_over=False)
        is_time = len(contacts) == 2 or order.is_closed
        if leaps is not None and is_time and (leapt := leaps.over(velocity, TO_BE_SURE * least)):
            order.forget()
            hits += leapt
            spent += TOGETHER
            continue
        answer(closing, velocity)
        hits += len(closing)
        spent += 1 if len(closing) == 1 else TOGETHER


class Order:
    """An order tells by the contacts' gaps which of them hit next.

    In the moment of a collapse balls move along straight lines, and normals do not turn. So a gap g
    that closes at c is closed after g / c. Contacts without a gap hit at once, all together.
    """

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self.contacts = contacts
        self.gaps = [max(contact.gap, 0.0) for contact in contacts]

    @property
    def is_closed(self) -> bool:
        """Tell whether all gaps are closed."""
        return not any(self.gaps)

    def forget(self) -> None:
        """Let all gaps be closed from now on."""
        self.gaps = [0.0] * len(self.gaps)

    def now(self) -> list[Contact]:
        """Return the contacts, each with its present gap."""
        return [
            contact._replace(gap=gap) for contact, gap in zip(self.contacts, self.gaps, strict=True)
        ]

    def next(self, velocity: Velocities, least: float) -> list[Contact]:
        """Return the next contacts that hit faster than ``least`` (m/s), and go to their time."""
        closing = [closing_speed(contact, velocity) for contact in self.contacts]
        if self.is_closed:
            return [contact for contact, c in zip(self.contacts, closing, strict=True) if c > least]
        count, hits = len(closing), [False] * len(closing)
        found = go_on(self.gaps, closing, count, least, hits)
        return list(compress(self.contacts, hits)) if found else []


def go_on(gaps: Any, closing: Any, count: int, least: float, hits: Any) -> int:
    """Go on to the next hits that are faster than ``least`` (m/s), mark them, and count them.

    ``gaps`` (m) close at the speeds ``closing`` (m/s). numba can compile it.
    """
    wait, found = math.inf, 0  # s
    for k in range(count):
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


class Leaps:
    """Leaps follow the rounds of a collapse, and leap over cycles of them."""

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self.contacts = contacts
        masses = {i: m for c in contacts for i, m in zip(c.balls, c.pair, strict=False)}
        self.balls, pushed = sorted(masses), []
        for line in lines(contacts):
            velocity: Velocities = dict.fromkeys(self.balls, (0.0, 0.0))
            push(line, 1.0, 0.0, velocity)
            pushed.append(list(chain(*velocity.values())))
        self.pushes = np.array(pushed).T  # what unit impulses do to the velocities
        mass = np.repeat([masses[i] for i in self.balls], 2)
        self.relative = -(self.pushes.T * mass)  # velocities -> closing speeds and slips
        self.lightness = -(self.relative * self.pushes.T).sum(axis=1)  # 1 / m_eff
        self.least = 0.0  # m/s; what closes more slowly counts as open
        self.hits: dict[Round, Array] = {}
        self.rounds: list[Round] = []
        self.wait, self.pause = 0, 1

    def over(self, velocity: Velocities, least: float) -> int:
        """Leap over cycles, if the last rounds repeat, and return how many hits that were."""
        self.least = least
        v = np.array([velocity[i] for i in self.balls]).reshape(-1, 1)
        this = self._round(times(self.relative, v))
        self.rounds = [*self.rounds[1 - 2 * LONGEST_CYCLE :], this] if this else []
        self.wait -= 1
        cycle = self._cycle() if self.wait <= 0 else None
        if cycle is None:
            return 0
        v, count = self._leap(cycle, v)
        self.pause = 1 if count >= SHORT else 2 * self.pause
        self.wait = self.pause
        for i, (x, y) in zip(self.balls, v.reshape(-1, 2).tolist(), strict=True):
            velocity[i] = (x, y)
        self.rounds = [] if count else self.rounds
        return count * sum(map(len, cycle))

    def _round(self, relative: Array) -> Round:
        """Return which contacts close, and how friction acts; nothing if two share a ball."""
        r = relative[:, 0].tolist()
        closing = [k for k, c in enumerate(r[::2]) if c > self.least]
        balls = [i for k in closing for i in self.contacts[k].balls]
        if len(balls) > len(set(balls)):
            return ()
        return tuple([(k, self._friction(k, *r[2 * k : 2 * k + 2])) for k in closing])

    def _friction(self, k: int, closing: float, slip: float) -> int:
        """Return how friction acts: ``STICKS``, or the slip's sign."""
        pair = self.contacts[k].pair
        if abs(slip) <= pair.friction * (1.0 + pair.restitution) * closing or pair.friction == 0.0:
            return STICKS
        return 1 if slip > 0.0 else -1

    def _cycle(self) -> list[Round] | None:
        """Return the rounds from here on if they have repeated, else None."""
        rounds = self.rounds
        for period in range(1, min(LONGEST_CYCLE, len(rounds) // 2) + 1):
            if rounds[-period:] == rounds[-2 * period : -period]:
                return [rounds[-1], *rounds[-period:-1]]
        return None

    def _leap(self, cycle: Sequence[Round], v: Array) -> tuple[Array, int]:
        """Leap while cycles stay the same; return the velocities, and the number of cycles."""
        at = [2 * k + n for k in sorted({k for k, _ in chain(*cycle)}) for n in (0, 1)]
        relative, hits = self.relative[at], [self._hit(this)[:, at] for this in cycle]
        t, q = np.eye(len(at)), np.zeros((len(v), len(at)))
        for hit in hits:
            pushed = times(hit, t)
            t, q = t + times(relative, pushed), q + pushed
        powers, total = [q], 0
        while len(powers) <= MOST_DOUBLINGS:
            after = v + times(q, times(relative, v))
            if not self._repeats(cycle, after):
                break
            v, total = after, total + 2 ** (len(powers) - 1)
            t, q = times(t, t), q + times(q, t)
            powers.append(q)
        for doubling in reversed(range(len(powers) - 1)):
            after = v + times(powers[doubling], times(relative, v))
            if self._repeats(cycle, after):
                v, total = after, total + 2**doubling
        return v, total

    def _hit(self, this: Round) -> Array:
        """Return the matrix from closing speeds and slips to a round's changes of velocities."""
        if this not in self.hits:
            hit = self.hits[this] = np.zeros(self.pushes.shape)
            for k, friction in this:
                pair, n, t = self.contacts[k].pair, 2 * k, 2 * k + 1
                normal, tangential = (self.pushes[:, m] / self.lightness[m] for m in (n, t))
                bounce = 1.0 + pair.restitution
                hit[:, n] = bounce * (normal + friction * pair.friction * tangential)
                if friction == STICKS and pair.friction > 0.0:
                    hit[:, t] = tangential
        return self.hits[this]

    def _repeats(self, cycle: Sequence[Round], v: Array) -> bool:
        """Tell whether the rounds from here on are those of the cycle."""
        for this in cycle:
            r = times(self.relative, v)
            if not np.isfinite(r).all() or self._round(r) != this:
                return False
            v = v + times(self._hit(this), r)
        return True


def times(a: Array, b: Array) -> Array:
    """Return the product of two matrices; BLAS would round it differently on each machine."""
    return np.asarray((a[:, :, np.newaxis] * b).sum(axis=1))
