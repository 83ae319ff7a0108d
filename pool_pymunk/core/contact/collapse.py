"""The hits of an inelastic collapse are played here, all at one instant.

A light ball that a heavy one squeezes to a cushion is the usual case. Every contact that closes is
answered, round after round. Soon the rounds repeat. Such a cycle is a linear map of the closing
speeds and slips r of its contacts, and of the velocities v:

    r -> T r,   v -> v + Q r.

So n cycles are a power of the map, by repeated squaring:

    v -> v + Q S_n r,   S_n = 1 + T + ... + T^(n-1),   S_2n = S_n + S_n T^n.

A leap over n cycles is valid if the next cycle is still the same.
"""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.contact.together import (
    Row,
    discs_of,
    fastest_of,
    set_velocities,
    velocities_of,
)
from pool_pymunk.core.motion.times import INF

MOST_HITS: Final = 30_000  # This many hits are played one by one at most.
MOST_IN_TIME: Final = 2_000  # This many come in the order of their times; then all gaps are closed.
CLUSTER: Final = 8  # With more contacts than this, all gaps count as closed.
MOST_IN_CLUSTER: Final = 1_000
TOGETHER_IN_TIME: Final = 1e-9  # Hits whose times differ by this share come together.
TOGETHER: Final = 20  # A round of several contacts, or a leap, takes the time of this many hits.
LONGEST_CYCLE: Final = 24  # rounds
MOST_PARTS: Final = 16
MOST_DOUBLINGS: Final = 30
TO_BE_SURE: Final = 0.25  # A leap goes to this share of the noise.
SHORT: Final = 8  # After a leap over fewer cycles, the next one is tried later.
STICKS: Final = 0  # Friction takes the whole slip; else its number is the sign of the slip.


def go_on(contacts: list[Contact], least: float) -> list[Contact]:
    """Go on to the next hits that are faster than ``least`` (m/s), and return them."""
    wait = INF
    for one in contacts:
        closing = one.closing
        if closing > least:
            wait = min(wait, one.gap / closing)
    if wait == INF:
        return []
    latest = wait * (1.0 + TOGETHER_IN_TIME)
    found: list[Contact] = []
    for one in contacts:
        closing = one.closing
        if closing > least and one.gap / closing <= latest:
            found.append(one)
            one.gap = 0.0
        else:
            one.gap = max(one.gap - closing * wait, 0.0)
    return found


@final
class Round:
    """A round has the contacts that close, and how friction acts at each."""

    def __init__(self) -> None:
        self.contacts: list[Contact] = []
        self.slides: list[int] = []

    def hits(self, one: Contact) -> bool:
        """Tell whether a contact shares a ball with one of the round."""
        return any(one.a in other.discs or one.b in other.discs for other in self.contacts)


@final
class Part:
    """A part of the map is the closing speed of a contact, or its slip."""

    def __init__(self, one: Contact, is_slip: bool) -> None:
        self.one = one
        self.is_slip = is_slip

    @property
    def speed(self) -> float:
        return self.one.slip if self.is_slip else self.one.closing


@final
class Collapse:
    """A collapse of contacts, whose caller answers the hits until there are none."""

    def __init__(self, contacts: list[Contact], noise: float, can_leap: bool, most: int) -> None:
        self.contacts = contacts
        self.discs = discs_of(contacts)
        self.noise = noise  # This share of the speeds may be rounding.
        self.can_leap = can_leap
        self.most = most
        self.played = 0
        self.spent = 0
        self.wait = 0
        self.pause = 1
        self.least = 0.0
        self.is_over = False
        self.rounds: list[Round] = []
        for one in contacts:
            one.gap = max(one.gap, 0.0)
        if len(contacts) > CLUSTER:
            self.close_gaps()
            self.most = min(most, MOST_IN_CLUSTER)

    def next_hits(self) -> list[Contact]:
        """Return the next hits; there are none where it is over, or more would be too many."""
        while True:
            self.least = max(self.least, self.noise * fastest_of(self.discs))
            if self.played >= MOST_IN_TIME:
                self.close_gaps()
            found = go_on(self.contacts, self.least)
            self.is_over = len(found) == 0
            if len(found) == 0 or self.spent >= self.most:
                return []
            leapt = self.leap_over() if self.can_leap and self.may_leap() else 0
            self.played += leapt if leapt > 0 else len(found)
            self.spent += 1 if len(found) == 1 and leapt == 0 else TOGETHER
            if leapt == 0:
                return found
            self.close_gaps()

    def close_gaps(self) -> None:
        for one in self.contacts:
            one.gap = 0.0

    def may_leap(self) -> bool:
        """Tell whether gaps have no part in the order of the hits any more."""
        return len(self.contacts) == 2 or all(one.gap <= 0.0 for one in self.contacts)

    # -- rounds and cycles ---------------------------------------------------------------------

    def leap_over(self) -> int:
        """Leap over cycles, if the last rounds repeat, and return how many hits that were."""
        self.note_round()
        self.wait -= 1
        if self.wait > 0:
            return 0
        cycle = self.find_cycle()
        if not cycle:
            return 0
        parts = parts_of(cycle)
        cycles = leap(self, cycle, parts) if len(parts) <= MOST_PARTS else 0
        self.pause = 1 if cycles >= SHORT else 2 * self.pause
        self.wait = self.pause
        if cycles == 0:
            return 0
        self.rounds = []
        return cycles * sum([len(each.contacts) for each in cycle])

    def note_round(self) -> None:
        """Note which contacts close, and how friction acts; forget all if two share a ball."""
        now = Round()
        for one in self.contacts:
            closing = one.closing
            if closing > TO_BE_SURE * self.least:
                if len(now.contacts) == MOST_PARTS or now.hits(one):
                    self.rounds = []
                    return
                now.contacts.append(one)
                now.slides.append(slides_as(one, closing, one.slip))
        self.rounds.append(now)
        if len(self.rounds) > 2 * LONGEST_CYCLE:
            del self.rounds[0]

    def find_cycle(self) -> list[Round]:
        """Return the shortest cycle that the last rounds repeat; empty if there is none."""
        rounds = self.rounds
        count = len(rounds)
        for period in range(1, count // 2 + 1):
            for n in range(count - period, count):
                now, before = rounds[n], rounds[n - period]
                if now.contacts != before.contacts or now.slides != before.slides:
                    break
            else:
                return rounds[count - 1 - period : count - 1]
        return []


def slides_as(one: Contact, closing: float, slip: float) -> int:
    """Return how friction acts: ``STICKS``, or the sign of the slip (m/s)."""
    mu = one.pair.friction
    if mu == 0.0 or abs(slip) <= mu * (1.0 + one.pair.restitution) * closing:
        return STICKS
    return 1 if slip > 0.0 else -1


# -- leaps ---------------------------------------------------------------------------------------


def parts_of(cycle: list[Round]) -> list[Part]:
    """List the parts of a cycle's map, each of them once."""
    found: list[Part] = []
    for each in cycle:
        for one, slides in zip(each.contacts, each.slides):
            sticks = slides == STICKS and one.pair.friction > 0.0
            for is_slip in [False, True] if sticks else [False]:
                if not any(part.one is one and part.is_slip == is_slip for part in found):
                    found.append(Part(one, is_slip))
    return found


def leap(c: Collapse, cycle: list[Round], parts: list[Part]) -> int:
    """Leap while cycles stay the same, and return over how many."""
    count, discs = len(parts), c.discs
    start = velocities_of(discs)
    turn: list[Row] = [[0.0] * count for _ in parts]
    push_x: list[Row] = [[0.0] * count for _ in discs]
    push_y: list[Row] = [[0.0] * count for _ in discs]
    one = [[1.0 if p == q else 0.0 for q in range(count)] for p in range(count)]
    for q in range(count):  # what a cycle makes of each part alone
        for each in discs:
            each.vx = each.vy = 0.0
        for now in cycle:
            hit_round(now, parts[q])
        for m, each in enumerate(discs):
            push_x[m][q], push_y[m][q] = each.vx, each.vy
        for p in range(count):
            turn[p][q] = one[p][q] + parts[p].speed
    sums = [one]
    set_velocities(discs, start)
    cycles = 0
    while len(sums) <= MOST_DOUBLINGS and try_power(c, cycle, parts, push_x, push_y, sums[-1]):
        cycles += 1 << (len(sums) - 1)
        none = [[0.0] * count for _ in parts]
        sums.append(plus_product(sums[-1], sums[-1], turn))
        turn = plus_product(none, turn, turn)
    for n in range(len(sums) - 2, -1, -1):
        if try_power(c, cycle, parts, push_x, push_y, sums[n]):
            cycles += 1 << n
    return cycles


def plus_product(first: list[Row], a: list[Row], b: list[Row]) -> list[Row]:
    """Return the matrix first + a b.

    >>> plus_product([[1.0]], [[2.0]], [[3.0]])
    [[7.0]]
    """
    count = len(a)
    found = [list(row) for row in first]
    for p in range(count):
        for q in range(count):
            total = first[p][q]
            for m in range(count):
                total += a[p][m] * b[m][q]
            found[p][q] = total
    return found


def hit_round(now: Round, part: Part | None) -> None:
    """Answer a round's hits, as if a part were faster by 1 m/s."""
    for one, slides in zip(now.contacts, now.slides):
        closing, slip = one.closing, one.slip
        if part is not None and part.one is one:
            closing += 0.0 if part.is_slip else 1.0
            slip += 1.0 if part.is_slip else 0.0
        lightness, mu = one.lightness, one.pair.friction
        along = (1.0 + one.pair.restitution) * closing / lightness
        across = -slides * mu * along
        if slides == STICKS and mu > 0.0:
            across = -slip / lightness
        one.push(along, across)


def try_power(
    c: Collapse, cycle: list[Round], parts: list[Part], push_x: list[Row], push_y: list[Row],
    sums: list[Row],
) -> bool:  # fmt: skip
    """Go on by that power of the map if the next cycle is still the same; tell whether it is."""
    discs, count, start = c.discs, len(parts), velocities_of(c.discs)
    speeds = [part.speed for part in parts]
    for p in range(count):
        total = 0.0
        for q in range(count):
            total += sums[p][q] * speeds[q]
        for m, each in enumerate(discs):
            each.vx += push_x[m][p] * total
            each.vy += push_y[m][p] * total
    after = velocities_of(discs)
    for now in cycle:
        if not is_round(c, now):
            set_velocities(discs, start)
            return False
        hit_round(now, None)
    set_velocities(discs, after)
    return True


def is_round(c: Collapse, now: Round) -> bool:
    """Tell whether the present velocities lead to this round."""
    found = 0
    for one in c.contacts:
        closing = one.closing
        if closing > TO_BE_SURE * c.least:
            if found == len(now.contacts) or now.contacts[found] is not one:
                return False
            slip = one.slip
            if slides_as(one, closing, slip) != now.slides[found] or not closing + abs(slip) < INF:
                return False
            found += 1
    return found == len(now.contacts)
