"""Impacts of several contacts at one instant give hand results, and keep what must hold."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, permutations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

import pool_pymunk
from pool_pymunk import Friction, Restitution, Scene, rack
from pool_pymunk.core.contact import collapse as core_collapse
from pool_pymunk.core.contact import contact as core_contact
from pool_pymunk.core.contact import impulses as core_impulses
from pool_pymunk.core.contact import instant, rounds
from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.contact import together as core
from pool_pymunk.core.contact.laws import HitsByLaw
from pool_pymunk.core.motion.times import unit
from pool_pymunk.core.variant import NO_SLIP
from pool_pymunk.laws import LAWS, law_in_core, respond
from pool_pymunk.laws.contact import NO_BALL, NT, Contact, Pair, Vector, Velocities, closing_speed
from tests.shared.clusters import ROUNDING, answered, energy, random_cluster
from tests.shared.core_clusters import InCore, answered_in_core
from tests.shared.hard_scenes import unmeasured

HOME = Path(pool_pymunk.__file__).parent.parent
RIGHT, UP = (1.0, 0.0), (0.0, 1.0)


def ball(a: int, b: int, normal: Vector, e: float = 1.0, mu: float = 0.0) -> Contact:
    return Contact(a, b, normal, Pair(1.0, 1.0, e, mu))


def wall(a: int, normal: Vector, e: float = 1.0, mu: float = 0.0, number: int = 0) -> Contact:
    return Contact(a, NO_BALL, normal, Pair(1.0, math.inf, e, mu), number)


# -- by hand ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_one_ball_between_two_that_stand_symmetrically(e: float) -> None:
    """J is (1 + e) v cos 30 / (1 + 2 cos^2 30) at each: the ball keeps v (1 - 3 (1 + e) / 5)."""
    normals = [(math.sqrt(0.75), 0.5), (math.sqrt(0.75), -0.5)]
    contacts = [ball(0, k + 1, normal, e) for k, normal in enumerate(normals)]
    after = answered(contacts, {0: (1.0, 0.0), 1: (0.0, 0.0), 2: (0.0, 0.0)})
    j = (1 + e) * math.sqrt(0.75) / 2.5
    assert after[0] == pytest.approx((1 - 0.6 * (1 + e), 0.0), abs=1e-15)
    for k, (nx, ny) in enumerate(normals):
        assert after[k + 1] == pytest.approx((j * nx, j * ny), abs=1e-15)


def test_friction_between_one_ball_and_two_is_shared() -> None:
    """Each contact may take half of what would end its slip alone, here less than mu J."""
    nx, ny = math.sqrt(0.75), 0.5
    contacts = [ball(0, 1, (nx, ny), 1.0, 0.2), ball(0, 2, (nx, -ny), 1.0, 0.2)]
    after = answered(contacts, {0: (1.0, 0.0), 1: (0.0, 0.0), 2: (0.0, 0.0)})
    j, slip = 2 * nx / 2.5, 0.2 * ny  # The ball comes back with 0.2.
    j_t = slip / 2 / 2
    assert j_t < 0.2 * j
    assert after[0] == pytest.approx((-0.2 + 2 * j_t * ny, 0.0), abs=1e-15)
    assert after[1] == pytest.approx((j * nx - j_t * ny, j * ny + j_t * nx), abs=1e-15)
    assert after[2] == pytest.approx((j * nx - j_t * ny, -j * ny - j_t * nx), abs=1e-15)


def test_two_balls_meet_a_third_from_both_sides() -> None:
    contacts = [ball(0, 1, RIGHT), ball(1, 2, RIGHT)]
    after = answered(contacts, {0: (1.0, 0.0), 1: (0.0, 0.0), 2: (-1.0, 0.0)})
    for i, v in enumerate((-1.0, 0.0, 1.0)):
        assert after[i] == pytest.approx((v, 0.0), abs=1e-15)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_both_cushions_of_a_corner_answer(e: float) -> None:
    after = answered([wall(0, RIGHT, e), wall(0, UP, e, number=1)], {0: (-1.0, -2.0)})
    assert after[0] == pytest.approx((e, 2 * e), abs=1e-15)


def test_the_same_cushion_twice_is_one_cushion() -> None:
    """Two cushions may run on straight; a ball at the seam then meets both."""
    contacts = [wall(0, UP, 0.5, 0.2), wall(0, UP, 0.5, 0.2, number=1)]
    once, twice = (answered(t, {0: (1.0, -1.0)}) for t in (contacts[:1], contacts))
    assert twice[0] == pytest.approx(once[0], abs=1e-15)
    one, other = InCore(contacts, {0: (1.0, -1.0)}).contacts
    assert one.is_same(other)


def test_contacts_that_share_no_ball_are_answered_as_if_alone() -> None:
    contacts = [ball(0, 1, RIGHT, 0.9, 0.1), ball(2, 3, UP, 0.5, 0.2)]
    velocity = {0: (1.0, 0.3), 1: (0.0, 0.0), 2: (0.1, 2.0), 3: (0.0, 0.0)}
    both = answered(contacts, velocity)
    for contact in contacts:
        alone = answered([contact], velocity)
        assert all(both[i] == alone[i] for i in contact.balls)


def test_one_contact_is_the_law() -> None:
    after = answered([ball(0, 1, RIGHT, 0.9, 0.1)], {0: (1.0, 0.5), 1: (-0.2, 0.1)})
    a, b = LAWS["coulomb"].ball_ball(NT(1.0, 0.5), NT(-0.2, 0.1), Pair(1.0, 1.0, 0.9, 0.1))
    assert after[0] == pytest.approx(tuple(a))
    assert after[1] == pytest.approx(tuple(b))


def test_the_published_law_answers_in_the_listings_order() -> None:
    """Cushions across x come first, then those across y, then pairs by number, in any listing."""
    contacts = [
        Contact(1, NO_BALL, (-1.0, 0.0), Pair(1.0, math.inf, 0.7, 0.2), 1),
        Contact(1, NO_BALL, (0.0, -1.0), Pair(1.0, math.inf, 0.7, 0.2), 2),
        ball(0, 1, (math.sqrt(0.5), math.sqrt(0.5)), 0.9, 0.05),
    ]
    velocity = {0: (2.0, 1.0), 1: (1.0, 0.5)}
    by_hand = dict(velocity)
    for contact in contacts:
        respond(LAWS["published"], contact, by_hand)
    assert all(
        answered(order, velocity, LAWS["published"]) == by_hand for order in permutations(contacts)
    )


def test_a_cradle_is_answered_ball_by_ball() -> None:
    """Only contacts that close are answered, so a hit runs down a row, round by round."""
    row = [ball(k, k + 1, RIGHT) for k in range(4)]
    velocity: dict[int, Vector] = dict.fromkeys(range(5), (0.0, 0.0)) | {0: (1.0, 0.0)}
    for _ in range(4):
        velocity = answered([t for t in row if closing_speed(t, velocity) > 0.0], velocity)
    assert [velocity[k][0] for k in range(5)] == [0.0, 0.0, 0.0, 0.0, 1.0]


# -- in any cluster --------------------------------------------------------------------------------

seeds = st.integers(0, 10**6)


@given(seeds)
def test_energy_never_grows(seed: int) -> None:
    masses, _, velocity = cluster = random_cluster(seed)
    after = answered(cluster.closing(), velocity)
    assert energy(masses, after) <= energy(masses, velocity) * (1 + ROUNDING)


def with_pair(contacts: Sequence[Contact], **coefficients: float) -> list[Contact]:
    pairs = [Pair(**{**contact.pair._asdict(), **coefficients}) for contact in contacts]
    return [contact._replace(pair=pair) for contact, pair in zip(contacts, pairs, strict=True)]


@given(seeds)
def test_without_losses_energy_is_kept(seed: int) -> None:
    """If every contact that pushes opens as fast as it closed, nothing is lost."""
    masses, _, velocity = cluster = random_cluster(seed)
    after = answered(with_pair(cluster.closing(), restitution=1.0, friction=0.0), velocity)
    assert energy(masses, after) == pytest.approx(energy(masses, velocity), rel=1e-11, abs=0.0)


@given(seeds)
def test_momentum_is_kept_between_balls(seed: int) -> None:
    masses, _, velocity = cluster = random_cluster(seed)
    after = answered([t for t in cluster.closing() if t.b != NO_BALL], velocity)
    for axis in (0, 1):
        moments = [(m * after[i][axis], m * velocity[i][axis]) for i, m in enumerate(masses)]
        change = sum(new - old for new, old in moments)
        assert abs(change) <= ROUNDING * sum(abs(new) + abs(old) for new, old in moments)


@given(seeds)
def test_every_contact_that_closed_opens_e_times_as_fast_or_faster(seed: int) -> None:
    """By Newton's law for simultaneous impact J >= 0, and J > 0 only at just e times."""
    cluster = random_cluster(seed)
    smooth = with_pair(cluster.closing(), friction=0.0)
    after = answered(smooth, cluster.velocity)
    for contact in smooth:
        e, closed = contact.pair.restitution, closing_speed(contact, cluster.velocity)
        assert -closing_speed(contact, after) >= e * closed - 1e-10


@given(seeds, st.randoms(use_true_random=False))
def test_the_order_of_contacts_does_not_matter(seed: int, rnd: random.Random) -> None:
    cluster = random_cluster(seed)
    contacts = cluster.closing()
    shuffled = rnd.sample(contacts, len(contacts))
    one, other = (answered(order, cluster.velocity) for order in (contacts, shuffled))
    for i in one:
        assert one[i] == pytest.approx(other[i], abs=1e-9)


@given(seeds, st.floats(-math.pi, math.pi))
def test_turning_the_cluster_turns_the_outcome(seed: int, angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)

    def turned(v: Vector) -> Vector:
        return (c * v[0] - s * v[1], s * v[0] + c * v[1])

    cluster = random_cluster(seed)
    contacts = cluster.closing()
    after = answered(contacts, cluster.velocity)
    other = answered(
        [contact._replace(normal=turned(contact.normal)) for contact in contacts],
        {i: turned(v) for i, v in cluster.velocity.items()},
    )
    for i in after:
        assert other[i] == pytest.approx(turned(after[i]), abs=1e-9)


def settle(contacts: Sequence[Contact], velocity: Velocities) -> None:
    """Answer contacts as a collapse that comes to its limit: without restitution and friction."""
    plastic = with_pair(contacts, restitution=0.0, friction=0.0)
    velocity.update(answered_in_core(plastic, velocity, LAWS["coulomb"]))


@given(seeds)
def test_settling_leaves_nothing_that_closes_and_adds_no_energy(seed: int) -> None:
    """This includes contacts that did not close before, and masses over six decades."""
    masses, contacts, velocity = random_cluster(seed, widest=6.0)
    after = dict(velocity)
    settle(contacts, after)
    assert energy(masses, after) <= energy(masses, velocity) * (1 + ROUNDING)
    plastic = with_pair(contacts, restitution=0.0, friction=0.0)
    groups = core_contact.groups(InCore(plastic, velocity).contacts)
    # This excludes one cluster in 3000.
    assume(all(core.at_once(group) for group in groups if len(group) > 1))
    assert all(closing_speed(contact, after) < 1e-7 for contact in contacts)


def mean_of(contacts: Sequence[Contact], velocity: Velocities) -> Velocities:
    """Return the velocities after the mean over orders of contacts that share balls."""
    found = InCore(contacts, velocity)
    for group in core_contact.groups(found.contacts):
        core.mean_over_orders(group, HitsByLaw(law_in_core(LAWS["coulomb"]), NO_SLIP))
    return found.velocity


@pytest.mark.xfail(strict=True, reason="the mean over orders has not come to its limit")
@pytest.mark.parametrize("seed", [1648, 2117])
def test_settling_where_impulses_are_given_up(seed: int) -> None:
    """The mean over orders answers instead, and should leave no contact that closes."""
    # Some versions of NumPy round such that none are given up in the second of these clusters.
    _, contacts, velocity = random_cluster(seed, widest=6.0)
    after = mean_of(with_pair(contacts, restitution=0.0, friction=0.0), velocity)
    assert all(closing_speed(contact, after) < 1e-7 for contact in contacts)


def complementarity(seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Make a random G of any rank, and a w that it can reach."""
    rnd = np.random.default_rng(seed)
    count, rank = (int(n) for n in rnd.integers(1, 9, size=2))
    basis = rnd.normal(size=(count, rank))
    response = basis @ basis.T + 1e-30 * np.eye(count)
    wanted = basis @ rnd.normal(size=rank)
    # A self-stress, J >= 0 with G J = 0, could never end, but contacts of discs that close have
    # none.
    if (wanted > 0).all() and rank < count:
        wanted = response @ np.abs(rnd.normal(size=count))
    return response, wanted


def solved(response: NDArray[np.float64], wanted: NDArray[np.float64]) -> list[float] | None:
    """Return the impulses that solve a problem, or None if they are given up."""
    return core.find_impulses(response.tolist(), wanted.tolist())


def test_impulses_are_hardly_ever_given_up() -> None:
    """Only two of 20,000 such problems are given up."""
    problems = map(complementarity, range(1000))
    assert sum(solved(*problem) is None for problem in problems) <= 1


@given(seeds)
def test_impulses_solve_the_complementarity_problem(seed: int) -> None:
    """The impulses fulfil J >= 0, G J >= w, and J (G J - w) = 0."""
    response, wanted = complementarity(seed)
    found = solved(response, wanted)
    assume(found is not None)
    impulses = np.array(found)
    opened = response @ impulses
    scale = np.abs(response).sum() * (1 + impulses.max())
    assert (impulses >= 0).all()
    assert (opened - wanted >= -1e-9 * scale).all()
    assert np.abs(impulses * (opened - wanted)).max() <= 1e-9 * scale * (1 + impulses.max())


# -- redundant contacts --------------------------------------------------------------------------


def imploding(rows: int) -> Scene:
    """Return a frozen rack whose balls move inwards and slip, so that all contacts close at once.

    In a triangle of 15 their 30 contacts have 27 independent ones, so many impulses open them.
    """
    balls = rack((0.0, 0.0), radius=0.03, mass=0.2, rows=rows)
    middle = sum(ball.position[0] for ball in balls) / len(balls)
    moving = []
    for ball in balls:
        x, y = ball.position[0] - middle, ball.position[1]
        moving.append(
            replace(ball, velocity=(-8.0 * x - 2.0 * y, -8.0 * y + 2.0 * x + 40.0 * x * x))
        )
    return Scene(tuple(moving), None, Restitution(0.5), Friction(0.2, 0.0, 0.2))


def ends_of(scene: Scene, turn: float = 1.0) -> dict[str, tuple[float, float]]:
    """Return where the balls end, by their ids; with ``turn`` -1 seen in a mirror."""
    return {i: (x, turn * y) for i, (x, y) in unmeasured(scene).final.items()}


def mirrored(scene: Scene) -> Scene:
    """Return a scene as a mirror shows it."""
    balls = [
        replace(ball, position=(x, -y), velocity=(vx, -vy))
        for ball in scene.balls
        for (x, y), (vx, vy) in [(ball.position, ball.velocity)]
    ]
    return replace(scene, balls=tuple(balls))


def relabelled_and_mirrored(scene: Scene) -> float:
    """Return how far (m) the ends of a rack lie elsewhere if it is listed otherwise or mirrored."""
    ends, rnd = ends_of(scene), random.Random(3)
    others = [ends_of(mirrored(scene), -1.0)]
    for _ in range(3):
        order = rnd.sample(scene.balls, len(scene.balls))
        others.append(ends_of(replace(scene, balls=tuple(order))))
    return max(math.dist(other[i], end) for other in others for i, end in ends.items())


@pytest.mark.parametrize("rows", [4, 5])
def test_no_listing_changes_the_ends_of_redundant_contacts(rows: int) -> None:
    assert relabelled_and_mirrored(imploding(rows)) < 1e-13


Pushes = dict[tuple[int, int], float]  # N s, by two balls


def dropped(response: list[list[float]], wanted: list[float]) -> list[float]:
    """Return impulses that open the contacts as they should, of which redundant ones have none."""
    count = len(wanted)
    chosen, factor = list(range(count)), [[0.0] * count for _ in wanted]
    rank = core.decompose(response, chosen, factor)
    assert rank < count
    found = [wanted[k] for k in chosen]
    for p in range(rank):
        row = factor[chosen[p]]
        found[p] = (found[p] - core.product(row, found, p)) / row[p]
    core.backwards(factor, chosen, rank, found)
    pushes = [0.0] * count
    for p in range(rank):
        pushes[chosen[p]] = found[p]
    return pushes


def pushes_of(scene: Scene, seed: int, drops: bool) -> Pushes:
    """Return the impulses at all contacts of a scene, which are listed in some order."""
    touching = [
        Contact(i, j, unit(b.position[0] - a.position[0], b.position[1] - a.position[1]),
                scene.pair(i, j))
        for (i, a), (j, b) in combinations(enumerate(scene.balls), 2)
        if math.dist(a.position, b.position) < (a.radius + b.radius) * (1.0 + 1e-9)
    ]  # fmt: skip
    listed = random.Random(seed).sample(touching, len(touching))
    found = InCore(listed, {i: ball.velocity for i, ball in enumerate(scene.balls)}).contacts
    response = [[core.coupling(one, other) for other in found] for one in found]
    wanted = [one.closing for one in found]
    assert min(wanted) > 0.0
    pushes = (
        dropped(response, wanted)
        if drops
        else core.least_impulses(response, wanted, [True] * len(wanted))
    )
    return dict(zip([one[:2] for one in listed], pushes, strict=True))


@pytest.mark.parametrize("rows", [4, 5])
def test_impulses_of_redundant_contacts_must_not_be_dropped(rows: int) -> None:
    """Friction depends on each normal impulse, and a listing decides which ones are redundant."""

    def differ(drops: bool) -> float:
        scenes = imploding(rows), mirrored(imploding(rows))
        first, *others = (pushes_of(scene, seed, drops) for scene in scenes for seed in range(9))
        return max(abs(other[key] - push) for other in others for key, push in first.items())

    assert differ(drops=False) < 1e-12
    assert differ(drops=True) > 1e-2


# -- on every machine ----------------------------------------------------------------------------


def test_nothing_that_decides_an_end_rounds_as_its_machine_does() -> None:
    """BLAS and LAPACK do, and so do the functions of the C library except the square root."""
    rounding = r" @ |linalg|hypot|math\.(sin|cos|tan|atan2?|exp|log|pow)\b"
    for module in (core, core_collapse, core_contact, core_impulses, core_laws, instant, rounds):
        source = HOME.joinpath(*module.__name__.split(".")).with_suffix(".py")
        assert not re.search(rounding, source.read_text("utf-8")), module
