"""Collapses, played by loops over numbers: with leaps as hit by hit, and compiled as in Python."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from itertools import compress
from typing import Any, NamedTuple

import pytest
from clusters import random_cluster
from core_clusters import InCore

from pool_pymunk.core.contact.collapse import MOST_PARTS
from pool_pymunk.core.contact.collapse import Collapse as CoreCollapse
from pool_pymunk.core.contact.together import all_orders
from pool_pymunk.engine.decisions import CONVERGED
from pool_pymunk.laws import LAWS
from pool_pymunk.physics import collapse, together
from pool_pymunk.physics.collapse import MOST_HITS
from pool_pymunk.physics.contact import (
    NO_BALL,
    Contact,
    Pair,
    Vector,
    Velocities,
    fastest,
    groups,
)
from pool_pymunk.physics.laws import respond
from pool_pymunk.solvers.in_core import law_in_core

Start = tuple[list[Contact], dict[int, Vector]]
Answer = Callable[[Any, Velocities], None]


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


def one_hit(contact: Contact, velocity: Velocities) -> None:
    """Answer one contact by Coulomb's law."""
    respond(LAWS["coulomb"], contact, velocity)


def answer(contacts: Any, velocity: Velocities) -> None:
    """Answer contacts as the resolver does."""
    for group in groups(contacts):
        if len(group) == 1:
            one_hit(group[0], velocity)
        else:
            LAWS["coulomb"].together(group, velocity, one_hit)


class Played(NamedTuple):
    """A collapse was played: it had these hits, it may be over, and many were ``leapt`` over."""

    hits: int
    is_over: bool
    leapt: int
    velocity: Velocities


def played(start: Start, can_leap: bool, most: int = MOST_HITS) -> Played:
    """Play out a collapse by the functions of the contact engine."""
    contacts, before = start
    velocity: Velocities = dict(before)
    c = together.Rows(collapse.FORM, len(contacts))
    c.can_leap, c.most = can_leap, most
    gaps = [contact.gap for contact in contacts]
    collapse.begin(c, contacts, len(contacts), gaps, CONVERGED)
    answered = 0
    while collapse.next_hits(c, contacts, velocity) > 0:
        hitting = list(compress(contacts, c.hits))
        answer(hitting, velocity)
        answered += len(hitting)
    return Played(c.played, bool(c.is_over), c.played - answered, velocity)


def played_by_core(start: Start, can_leap: bool, most: int = MOST_HITS) -> Played:
    """Play out the same collapse by the functions of the core."""
    found, law, answered = InCore(*start), law_in_core(LAWS["coulomb"]), 0
    c = CoreCollapse(found.contacts, CONVERGED, can_leap, most)
    while hitting := c.next_hits():
        found.answer(hitting, law)
        answered += len(hitting)
    return Played(c.played, c.is_over, c.played - answered, found.velocity)


def farthest(one: Velocities, other: Velocities, before: Velocities) -> float:
    """Return how far velocities differ, as a share of the fastest before."""
    return max(math.dist(one[i], other[i]) for i in one) / fastest(before)


# -- leaps -----------------------------------------------------------------------------------------

by = pytest.mark.parametrize("by", [played, played_by_core])


def test_the_core_plays_the_same_hits_and_leaps() -> None:
    for start in starts(30):
        for can_leap in (True, False):
            one, other = (by(start, can_leap, 400) for by in (played, played_by_core))
            assert repr(one) == repr(other)


@by
def test_leaps_come_to_what_hit_by_hit_comes_to(by: Any) -> None:
    """Collapses that a bound cuts off have no end to compare."""
    compared = leapt = 0
    for seed in range(300):
        contacts, before = squeezed(seed)
        closed = [contact._replace(gap=0.0) for contact in contacts]  # So it may leap at once.
        one, other = (by((closed, before), can, 3_000) for can in (True, False))
        if one.is_over and other.is_over:
            assert farthest(one.velocity, other.velocity, before) < 1e-11, seed
            compared, leapt = compared + 1, leapt + (one.leapt > 0)
    assert compared > 100
    assert leapt > 20


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


@by
def test_a_leap_over_many_cycles_counts_their_hits(by: Any) -> None:
    """In each cycle the heavy ball loses a share of its speed that is as the light one's mass."""
    hits = []
    for ratio in (1e5, 1e6):
        found = by(between(ratio), True)
        assert found.is_over
        assert fastest(found.velocity) < 1e-12
        hits.append(found.hits)
    assert hits[0] > MOST_HITS
    assert hits[1] == pytest.approx(10 * hits[0], rel=0.01)


@by
def test_a_cycle_with_too_many_parts_is_not_leapt_over(by: Any) -> None:
    """The cycle has a part for the closing speed of each contact: two for each pair of balls."""
    for copies in (MOST_PARTS // 2, MOST_PARTS // 2 + 1):
        found = by(between(1e5, copies), True)
        assert found.is_over == (found.leapt > 0) == (2 * copies <= MOST_PARTS)


def starts(count: int) -> Iterator[Start]:
    """Yield starts of squeezed balls, and a third as many of crowded balls."""
    yield from map(squeezed, range(count))
    yield from (start for start in map(crowded, range(count // 3)) if start[0])


# -- exact sums ------------------------------------------------------------------------------------


def test_exact_sums_are_those_of_the_library() -> None:
    for seed in range(2_000):
        rnd = random.Random(seed)
        widest = rnd.choice((1, 20, 60, 300))
        numbers = [rnd.gauss(0, 1) * 2.0 ** rnd.randint(-widest, widest) for _ in range(24)]
        numbers += [-x for x in numbers[: rnd.randint(0, 24)]]
        # Half a unit of the last place, and a little more or less
        numbers += [1.0, 2.0**-53, rnd.choice((-1.0, 0.0, 1.0)) * 2.0 ** -rnd.randint(100, 900)]
        rnd.shuffle(numbers)
        parts, many = [0.0] * len(numbers), 0
        for x in numbers:
            many = together.add(x, parts, many)
        assert together.total(parts, many) == math.fsum(numbers), seed


def test_all_orders_are_there_once() -> None:
    for count in range(1, 5):
        o = together.Rows(together.ORDERS, count)
        together.find_all_orders(o, count)
        orders = {tuple(turn[:count]) for turn in o.turn[: o.orders]}
        assert [turn[:count] for turn in o.turn[: o.orders]] == all_orders(count)
        assert len(orders) == o.orders == math.factorial(count)
        assert all(sorted(order) == list(range(count)) for order in orders)
