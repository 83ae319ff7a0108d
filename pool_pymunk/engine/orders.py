"""Contacts of one instant have no order; tiny gaps between the balls give them one.

What touches is taken to have no gap, and then the law answers all contacts of a round together. In
a real rack every contact has a gap of its own, however small, and each order of the gaps may have
another outcome. A *pattern* gives every contact a share of a gap. Balls move along straight lines
while such gaps close, and normals do not turn, so only the ratios of the gaps matter.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from random import Random
from typing import NamedTuple

from pool_pymunk.engine import decisions
from pool_pymunk.engine.recorder import Doubt, Motions
from pool_pymunk.engine.resolver import Resolver
from pool_pymunk.physics.collapse import Order
from pool_pymunk.physics.contact import Contact, Vector, Velocities, closing_speed, fastest

# Half or twice each of these numbers changes what 30 frozen clusters may spread by less than 0.02 %
# (``python -m tests.frozen FEW RANDOM DECADES WIDEST KICK KICKS GROWS``).
FEW = 12  # Of up to this many contacts, each is once alone with a gap, once alone without.
RANDOM = 24  # This many patterns are random.
DECADES = 4.0  # Random gaps differ by up to this power of ten.
# m; a gap of 1e-6 m between frozen balls is invisible. Few random draws meet the worst gaps, so
# this is four times as wide.
WIDEST = 4e-6
# This pattern has no gaps. Its outcome is that of velocities which differ a little. Contacts are
# unstable if, in one of KICKS tries, a difference of KICK of the fastest speed becomes GROWS times
# larger. At stable contacts it grows only a few times, as masses differ.
UNSTABLE = -1
KICK = 1e-9
KICKS = 4
GROWS = 1e3


class OrderEnd(NamedTuple):
    """This holds the velocities (m/s) after an instant, its hits, and whether these ended."""

    velocity: Velocities
    hits: int
    is_over: bool

    def off(self, other: OrderEnd) -> float:
        """Return how far (m/s) the velocities of two outcomes lie apart at most."""
        return max(math.dist(v, other.velocity[i]) for i, v in self.velocity.items())


class Doubts:
    """Doubts find out what the order of contacts decides, at the first instants of a run."""

    def __init__(self, resolver: Resolver) -> None:
        self.resolver = resolver
        self.spread = 0.0  # m/s; the largest spread of velocities so far
        self.count = 0  # instants whose order was found to matter
        self.seen: Counter[frozenset[tuple[int, int, int | None]]] = Counter()

    def doubt(self, contacts: Sequence[Contact], before: Mapping[int, Vector]) -> Doubt | None:
        """Return what the order of the contacts of one instant decides.

        Strong friction may wedge a ball between two others, so that tiny closing speeds grow from
        hit to hit. So tiny changes of the velocities after the hits are tried, too.
        """
        closing = [closing_speed(contact, before) for contact in contacts]
        if len(contacts) < 2 or self.count >= decisions.DOUBTS:
            return None
        if self.spread > 0.0 and 4.0 * max(closing) <= self.spread:
            return None  # These contacts cannot spread ends farther.
        same = frozenset((hit.a, hit.b, hit.cushion) for hit in contacts)
        self.seen[same] += 1
        if self.seen[same] > decisions.OFTEN and self.seen[same].bit_count() > 1:
            return None
        first = self._end(closed(contacts), before)
        take_turns = len(contacts) == 2 and min(closing) <= 0.0
        found = [] if take_turns else self._other_outcomes(first, contacts, before)
        kick = KICK * fastest(before)
        for number in range(KICKS):
            other = self._end(closed(contacts), kicked(first.velocity, kick, number))
            if first.off(other) > GROWS * kick:
                found.append((other, UNSTABLE))
        if not found:
            return None
        far = sorted(((first.off(other), pattern) for other, pattern in found), reverse=True)
        self.spread, self.count = max(self.spread, far[0][0]), self.count + 1
        return Doubt(far[0][0], tuple(pattern for _, pattern in far))

    def _other_outcomes(
        self, first: OrderEnd, contacts: Sequence[Contact], before: Mapping[int, Vector]
    ) -> list[tuple[OrderEnd, int]]:
        """Return the outcomes of all patterns that differ from the first, and from each other."""
        found: list[tuple[OrderEnd, int]] = []
        for pattern in patterns(len(contacts)):
            other = self._end(with_gaps(contacts, pattern), before)
            rounding = decisions.SAME_OUTCOME * fastest(before) * (1 + other.hits)
            known = [first, *(outcome for outcome, _ in found)]
            if other.is_over and all(each.off(other) > rounding for each in known):
                found.append((other, pattern))
        return found

    def _end(self, contacts: Sequence[Contact], before: Mapping[int, Vector]) -> OrderEnd:
        """Play contacts in the order of their gaps, which close after ``MOST_IN_ORDER`` hits."""
        velocity, resolver = dict(before), self.resolver
        order, hits = Order(contacts), 0
        while hits < decisions.MOST_IN_ORDER:
            closing = order.next(velocity, decisions.CONVERGED * fastest(velocity))
            if not closing:
                return OrderEnd(velocity, hits, is_over=True)
            resolver.answer(closing, velocity, resolver.respond)
            hits += len(closing)
        order.forget()
        collapse = resolver.play(order.now(), velocity, resolver.respond, decisions.MOST_OTHER)
        return OrderEnd(velocity, hits + collapse.hits, collapse.is_over)


def patterns(count: int) -> range:
    """Return the numbers of the patterns for a number of contacts."""
    return range(1 + RANDOM + (2 * count if count <= FEW else 0))


def with_gaps(contacts: Sequence[Contact], pattern: int) -> list[Contact]:
    """Return the contacts with the gaps of this pattern, in whatever order they are listed."""
    contacts = sorted(contacts, key=_place)
    if pattern == UNSTABLE:
        return closed(contacts)
    gaps = _gaps(len(contacts), pattern % len(patterns(len(contacts))))
    return [hit._replace(gap=gap) for hit, gap in zip(contacts, gaps, strict=True)]


def kicked(velocity: Mapping[int, Vector], most: float, number: int) -> Velocities:
    """Return velocities that differ by up to ``most`` (m/s), differently for each number."""
    rnd = Random(number)
    return {
        i: (vx + rnd.uniform(-most, most), vy + rnd.uniform(-most, most))
        for i, (vx, vy) in velocity.items()
    }


def moved(motions: Motions, errors: Random) -> Motions:
    """Return motions with random changes of places, up to ``WIDEST`` (m) for each ball."""
    most = len(motions) * WIDEST / 2.0
    return {
        i: (x + errors.uniform(-most, most), y + errors.uniform(-most, most), vx, vy)
        for i, (x, y, vx, vy) in motions.items()
    }


def _gaps(count: int, pattern: int) -> list[float]:
    """Return the shares of a gap: equal, one alone, all but one, or random."""
    if pattern == 0:
        return [1.0] * count
    pattern -= 1
    if pattern >= 2 * count or count > FEW:
        rnd = Random(pattern)
        if pattern % 3 == 0:
            return [rnd.random() for _ in range(count)]
        if pattern % 3 == 1:
            return [10.0 ** -(DECADES * rnd.random()) for _ in range(count)]
        return [rnd.choice((0.0, rnd.random())) for _ in range(count)]
    alone, k = pattern < count, pattern % count
    return [float((i == k) == alone) for i in range(count)]


def _place(contact: Contact) -> tuple[float, ...]:
    """Return where a contact is, without the digits that a listing order may change."""
    return tuple(round(x, 9) for x in (*contact.point, *map(abs, contact.normal)))


def closed(contacts: Sequence[Contact]) -> list[Contact]:
    """Return the contacts without gaps."""
    return [hit._replace(gap=0.0) for hit in contacts]
