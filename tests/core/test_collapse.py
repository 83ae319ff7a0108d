"""Collapses, played with leaps, end as hit by hit."""

from __future__ import annotations

import math
import random
from typing import NamedTuple

import pytest

from pool_pymunk.core.contact.collapse import MOST_HITS, MOST_PARTS, Collapse
from pool_pymunk.core.contact.together import all_orders
from pool_pymunk.core.variant import CONVERGED
from pool_pymunk.laws import LAWS, law_in_core
from pool_pymunk.laws.contact import NO_BALL, Contact, Pair, Vector, Velocities, fastest
from tests.shared.clusters import random_cluster
from tests.shared.core_clusters import InCore

Start = tuple[list[Contact], dict[int, Vector]]


def squeezed(seed: int) -> Start:
    """Return light balls between heavy ones in a row that may bend, at a cushion or in a wedge."""
    rnd = random.Random(seed)
    e, mu = rnd.choice((0.0, 0.05, 0.2, 0.5)), rnd.choice((0.0, 0.1, 0.3))
    count, bends = rnd.randint(2, 5), rnd.choice((0.0, 0.3))
    mass = [10 ** rnd.uniform(0, 4) if k % 2 else 10 ** rnd.uniform(-1, 0) for k in range(count)]
    contacts, lean = [], rnd.choice((0.0, rnd.uniform(0.05, 0.8)))
    for i in range(count - 1):
        turn, gap = rnd.gauss(0.0, bends), rnd.choice((0.0, 10 ** rnd.uniform(-15, -9)))
        normal, pair = (math.cos(turn), math.sin(turn)), Pair(mass[i], mass[i + 1], e, mu)
        contacts.append(Contact(i, i + 1, normal, pair, gap=gap))
    for turn in {lean, -lean}:
        pair, normal = Pair(mass[0], math.inf, e, mu), (math.cos(turn), math.sin(turn))
        contacts.append(Contact(0, NO_BALL, normal, pair, 0))
    velocity = {i: (-i - rnd.random(), rnd.choice((0.0, rnd.gauss(0, 0.3)))) for i in range(count)}
    return contacts, velocity


def crowded(seed: int) -> Start:
    """Return a cluster in which all balls drive to one place, so that many contacts close."""
    cluster = random_cluster(seed)
    contacts = [one._replace(pair=one.pair._replace(restitution=0.1)) for one in cluster.contacts]
    balls = sorted({i for contact in contacts for i in contact.balls})
    return contacts, {i: cluster.velocity[i] for i in balls}


class Played(NamedTuple):
    """A collapse was played: it had these hits, it may be over, and many were ``leapt`` over."""

    hits: int
    is_over: bool
    leapt: int
    velocity: Velocities


def played(start: Start, can_leap: bool, most: int = MOST_HITS) -> Played:
    """Play out a collapse."""
    found, law, answered = InCore(*start), law_in_core(LAWS["coulomb"]), 0
    c = Collapse(found.contacts, CONVERGED, can_leap, most)
    while hitting := c.next_hits():
        found.answer(hitting, law)
        answered += len(hitting)
    return Played(c.played, c.is_over, c.played - answered, found.velocity)


def farthest(one: Velocities, other: Velocities, before: Velocities) -> float:
    """Return how far velocities differ, as a share of the fastest before."""
    return max(math.dist(one[i], other[i]) for i in one) / fastest(before)


# -- leaps -----------------------------------------------------------------------------------------


def test_leaps_come_to_what_hit_by_hit_comes_to() -> None:
    """Collapses that a bound cuts off have no end to compare."""
    compared = leapt = 0
    for seed in range(300):
        contacts, before = squeezed(seed)
        closed = [contact._replace(gap=0.0) for contact in contacts]  # So it may leap at once.
        one, other = (played((closed, before), can, 3_000) for can in (True, False))
        if one.is_over and other.is_over:
            assert farthest(one.velocity, other.velocity, before) < 1e-11, seed
            compared, leapt = compared + 1, leapt + (one.leapt > 0)
    assert compared > 100
    assert leapt > 20


@pytest.mark.parametrize("ratio", [1e2, 1e3])
@pytest.mark.parametrize("aslant", [0.05, 0.1, 0.2, 0.3])
def test_leaps_know_whether_a_slip_sticks(aslant: float, ratio: float) -> None:
    """The slip is a share of the closing speed at which e decides whether friction can hold it."""
    wall, pair = Pair(1.0, math.inf, 0.8, 0.1), Pair(1.0, ratio, 0.8, 0.1)
    normal = (1.0, 0.0)
    contacts = [Contact(0, 1, normal, pair), Contact(0, NO_BALL, normal, wall, 0)]
    before = {0: (0.0, 0.0), 1: (-1.0, aslant)}
    one, other = (played((contacts, before), can) for can in (True, False))
    assert one.is_over and other.is_over and one.leapt > 100
    assert farthest(one.velocity, other.velocity, before) < 1e-12


def between(ratio: float, copies: int = 1) -> Start:
    """Return a light ball at a cushion, and one that drives it there; e = 0.8, no friction.

    There may be more such pairs of balls, of which each hits as the first one.
    """
    contacts = list[Contact]()
    for i in range(0, 2 * copies, 2):
        contacts += [
            Contact(i, i + 1, (1.0, 0.0), Pair(1.0, ratio, 0.8, 0.0)),
            Contact(i, NO_BALL, (1.0, 0.0), Pair(1.0, math.inf, 0.8, 0.0), 0),
        ]
    return contacts, {i: (-1.0 * (i % 2), 0.0) for i in range(2 * copies)}


def test_a_leap_over_many_cycles_counts_their_hits() -> None:
    """In each cycle the heavy ball loses a share of its speed that is as the light one's mass."""
    hits = []
    for ratio in (1e5, 1e6):
        found = played(between(ratio), True)
        assert found.is_over
        assert fastest(found.velocity) < 1e-12
        hits.append(found.hits)
    assert hits[0] > MOST_HITS
    assert hits[1] == pytest.approx(10 * hits[0], rel=0.01)


def test_a_cycle_with_too_many_parts_is_not_leapt_over() -> None:
    """The cycle has a part for the closing speed of each contact: two for each pair of balls."""
    for copies in (MOST_PARTS // 2, MOST_PARTS // 2 + 1):
        found = played(between(1e5, copies), True)
        assert found.is_over == (found.leapt > 0) == (2 * copies <= MOST_PARTS)


def test_all_orders_are_there_once() -> None:
    for count in range(1, 5):
        orders = all_orders(count)
        assert len({*map(tuple, orders)}) == len(orders) == math.factorial(count)
        assert all(sorted(order) == list(range(count)) for order in orders)
