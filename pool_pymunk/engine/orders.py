"""Contacts of one instant have no order; tiny gaps between the balls give them one.

What touches is taken to have no gap, and then the law answers all contacts of a round together. In
a real rack every contact has a gap of its own, however small, and each order of the gaps may have
another outcome. A *pattern* gives every contact a share of a gap. Balls move along straight lines
while such gaps close, and normals do not turn, so only the ratios of the gaps matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from random import Random
from typing import NamedTuple

from pool_pymunk.physics.contact import Contact, Vector, Velocities

Motions = dict[int, tuple[float, float, float, float]]  # x, y (m), vx, vy (m/s), by ball number

FEW = 12  # Each of up to this many contacts is once the only one with a gap, and once without.
# This many patterns are random. Half as many find the same spread in 30 frozen clusters, and four
# times as many 6 % more (``python -m tests.frozen``).
RANDOM = 24
DECADES = 4.0  # Random gaps differ by up to this power of ten.
# m; nobody sees a gap of 1e-6 m between balls that lie frozen. A few random draws seldom meet the
# worst one, so they are four times as wide.
WIDEST = 4e-6
# This pattern has no gaps. Its outcome is that of velocities which differ a little. Contacts are
# unstable if, in one of KICKS tries, a difference of KICK of the fastest speed becomes GROWS times
# larger. Hits of stable contacts make it a few times larger, as masses differ.
UNSTABLE = -1
KICK = 1e-9
KICKS = 4
GROWS = 1e3


class Doubt(NamedTuple):
    """A doubt tells what the order of the contacts of one instant decides.

    ``spread`` (m/s) is how far velocities may lie elsewhere. ``orders`` are numbers of patterns,
    one for each other outcome; the outcome that lies farthest off comes first.
    """

    spread: float = 0.0
    orders: tuple[int, ...] = ()


def patterns(count: int) -> range:
    """Return the numbers of the patterns for a number of contacts."""
    return range(1 + RANDOM + (2 * count if count <= FEW else 0))


def with_gaps(contacts: Sequence[Contact], pattern: int) -> list[Contact]:
    """Return the contacts with the gaps of this pattern, which no listing order changes."""
    contacts = sorted(contacts, key=_place)
    if pattern == UNSTABLE:
        return closed(contacts)
    gaps = _gaps(len(contacts), pattern % len(patterns(len(contacts))))
    return [hit._replace(gap=gap) for hit, gap in zip(contacts, gaps, strict=True)]


def kicked(velocity: Mapping[int, Vector], most: float, number: int) -> Velocities:
    """Return velocities that differ by up to ``most`` (m/s), in a different way for each number."""
    rnd = Random(number)
    return {
        i: (vx + rnd.uniform(-most, most), vy + rnd.uniform(-most, most))
        for i, (vx, vy) in velocity.items()
    }


def moved(motions: Motions, errors: Random) -> Motions:
    """Return the motions with places that are off as gaps of up to ``WIDEST`` put them.

    A ball may lie off by all gaps of a row.
    """
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
