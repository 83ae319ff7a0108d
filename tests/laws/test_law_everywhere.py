"""The law answers every contact of every solver, by name or as an object of one's own."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from itertools import combinations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pool_pymunk import (
    NT,
    SOLVERS,
    Ball,
    Friction,
    Law,
    Pair,
    Physics,
    Restitution,
    Scene,
    Shot,
    Table,
    simulate,
)
from pool_pymunk.laws import LAWS
from pool_pymunk.laws.contact import NO_BALL
from pool_pymunk.studies.stability import EXTREMES, Extreme, check
from pool_pymunk.studies.stability.trial import reference_of
from tests.shared.clusters import ROUNDING, Cluster, answered, energy, random_cluster
from tests.shared.core_clusters import InCore
from tests.shared.hard_scenes import persistent
from tests.shared.scenes import largest_distance

R = 0.05
BY_THE_LAW = [name for name, solver in SOLVERS.items() if not solver.own_law]
STEPS = {"time-slice": 1e-4, "pymunk-discrete": 1e-3}


def moving(*rows: tuple[float, float, float, float]) -> tuple[Ball, ...]:
    """Return balls at x, y (m) that move with vx, vy (m/s)."""
    return tuple(
        Ball(str(k), (x, y), R, 0.2, velocity=(vx, vy)) for k, (x, y, vx, vy) in enumerate(rows)
    )


def scene(*rows: tuple[float, float, float, float], boxed: bool = False) -> Scene:
    """Return lossy, rough balls on a plane, or in a box of 2 m by 1 m, for half a second."""
    table = Table(((-1.0, -0.5), (1.0, -0.5), (1.0, 0.5), (-1.0, 0.5))) if boxed else None
    friction = Friction(0.05, 0.2, 0.1)
    return Scene(moving(*rows), table, Restitution(0.9, None, 0.7), friction, Physics(max_time=0.5))


ONE = scene((-0.3, 0.02, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0))
TWO_AT_ONCE = scene(
    (-0.3, 0.0, 1.0, 0.0),
    (R * math.sqrt(3.0), R, 0.0, 0.0),
    (R * math.sqrt(3.0), -R, 0.0, 0.0),
)
CORNER = scene((-0.8, -0.3, -1.0, -1.0), boxed=True)
CUSHION = scene((0.0, -0.3, 0.3, -1.0), boxed=True)


class BallBallRaises(Law):
    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        raise ZeroDivisionError("no answer to balls")


class CushionRaises(Law):
    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        raise ZeroDivisionError("no answer to cushions")


class Smooth(Law):
    """This is Coulomb's law without friction."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        return super().ball_ball(a, b, pair._replace(friction=0.0))

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        return super().cushion(v, restitution, 0.0)


class Sticky(Law):
    """This law ignores the restitution: nothing ever bounces."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        return super().ball_ball(a, b, pair._replace(restitution=0.0))


# -- every contact asks ----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", BY_THE_LAW)
@pytest.mark.parametrize(
    ("law", "meeting"),
    [
        (BallBallRaises(), ONE),
        (BallBallRaises(), TWO_AT_ONCE),
        (CushionRaises(), CUSHION),
        (CushionRaises(), CORNER),
    ],
    ids=["one ball", "two balls at once", "a cushion", "a corner"],
)
def test_what_a_law_raises_leaves_simulate_as_it_is(law: Law, meeting: Scene, solver: str) -> None:
    with pytest.raises(ZeroDivisionError, match="no answer to"):
        simulate(meeting, solver=solver, dt=STEPS.get(solver), law=law)


@pytest.mark.parametrize("solver", BY_THE_LAW)
@pytest.mark.parametrize("meeting", [ONE, TWO_AT_ONCE, CUSHION, CORNER])
def test_a_law_without_friction_leaves_none(meeting: Scene, solver: str) -> None:
    """The run equals that of the scene without friction of balls and cushions, to the last bit."""
    smooth = replace(meeting, friction=Friction(meeting.friction.surface))
    run = simulate(meeting, solver=solver, dt=STEPS.get(solver), law=Smooth())
    plain = simulate(smooth, solver=solver, dt=STEPS.get(solver), law=Law())
    rough = simulate(meeting, solver=solver, dt=STEPS.get(solver), law=Law())
    assert run.final == plain.final
    assert len(run.events) == len(plain.events) > 0
    assert largest_distance(run, rough) > 1e-4 or meeting is CORNER


def test_hits_without_end_ask_the_law_whether_they_lose_speed() -> None:
    """The scene is elastic, but its law is not: a squeezed ball must still come to an end."""
    balls = (
        Ball("light", (0.3, 0.0), R, 0.1),
        Ball("heavy", (0.6, 0.0), R, 1e5, velocity=(1.0, 0.0)),
        Ball("light too", (0.9, 0.0), R, 0.1),
    )
    table = Table(((0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)))
    elastic = Restitution(1.0, None, 1.0)
    squeeze = Scene(balls, table, elastic, Friction(0.01), Physics(max_time=3.0))
    run = simulate(squeeze, solver="event-driven", law=Sticky(), max_events=5000)
    assert run.status != "max_events"
    assert any("inelastic collapse" in warning for warning in run.warnings)


# -- names and objects -----------------------------------------------------------------------------


@pytest.mark.parametrize("solver", BY_THE_LAW)
def test_a_name_is_as_good_as_the_object(solver: str) -> None:
    by_name = simulate(ONE, solver=solver, dt=STEPS.get(solver), law="published")
    by_object = simulate(ONE, solver=solver, dt=STEPS.get(solver), law=LAWS["published"])
    by_scene = simulate(
        replace(ONE, physics=replace(ONE.physics, law="published")),
        solver=solver,
        dt=STEPS.get(solver),
    )
    assert by_name.final == by_object.final == by_scene.final
    assert by_name.final != simulate(ONE, solver=solver, dt=STEPS.get(solver)).final


def test_a_law_is_named_after_its_class_unless_it_says_otherwise() -> None:
    class Felt(Law):
        name = "felt"

    assert (Smooth().name, Felt().name, LAWS["coulomb"].name) == ("Smooth", "felt", "coulomb")


def test_a_shot_that_goes_on_from_the_last_one_has_its_law() -> None:
    there, on = Shot("there", "0", (1.0, 0.0)), Shot("on", "0", (1.0, 0.0), from_previous=True)
    played = replace(ONE, shots=(there, on))
    run = simulate(played, "on", solver="event-driven", law=Smooth())
    first = simulate(played, "there", solver="event-driven", law=Smooth())
    assert run.knots[1][0, 1:3] == pytest.approx(first.final["1"], abs=0)


# -- the mean over orders, for any law -------------------------------------------------------------


MEAN = Law()
seeds = st.integers(0, 10**6)


@given(seeds)
def test_the_mean_over_orders_keeps_momentum_and_gains_no_energy(seed: int) -> None:
    masses, contacts, velocity = random_cluster(seed)
    touching = [contact for contact in contacts if contact.b != NO_BALL]
    cluster = Cluster(masses, touching, velocity)
    after = answered(cluster.closing(), velocity, MEAN)
    assert energy(masses, after) <= energy(masses, velocity) * (1 + 100 * ROUNDING)
    for axis in (0, 1):
        moments = [(m * after[i][axis], m * velocity[i][axis]) for i, m in enumerate(masses)]
        change = sum(new - old for new, old in moments)
        assert abs(change) <= 100 * ROUNDING * sum(abs(new) + abs(old) for new, old in moments)


@given(seeds, st.randoms(use_true_random=False))
def test_the_mean_over_orders_does_not_depend_on_the_listing(seed: int, rnd: random.Random) -> None:
    cluster = random_cluster(seed, widest=2.0)
    closing = cluster.closing()
    its = InCore(closing, cluster.velocity).contacts
    contacts = [
        one for k, one in enumerate(closing) if not any(its[k].is_same(each) for each in its[:k])
    ]
    places = [contact.point for contact in contacts]
    assume(all(math.dist(p, q) > 1e-6 for p, q in combinations(places, 2)))  # Nothing overlaps.
    one = answered(contacts, cluster.velocity, MEAN)
    other = answered(rnd.sample(contacts, len(contacts)), cluster.velocity, MEAN)
    for i in one:
        assert one[i] == pytest.approx(other[i], abs=1e-12)


def test_the_mean_over_orders_by_hand() -> None:
    """One ball hits two, e = 1: either order is the mirror image of the other.

    The first hit takes cos 30 of the ball's speed along its normal and leaves (1/4, -sqrt(3)/4).
    This closes at half of cos 30 on the second ball. So along x the ball loses 3/4 + 3/8, and comes
    back with 1/8. The two that were hit leave with the mean of cos 30 and half of it.
    """
    smooth = replace(TWO_AT_ONCE, restitution=Restitution(1.0), friction=Friction())
    v0, v1, v2 = simulate(smooth, solver="event-driven", law=MEAN).end.velocity
    cos, leaves = math.sqrt(0.75), 0.75 * math.sqrt(0.75)
    assert v0 == pytest.approx((-1 / 8, 0.0), abs=1e-15)
    assert v1 == pytest.approx((leaves * cos, leaves / 2), abs=1e-15)
    assert v2 == pytest.approx((leaves * cos, -leaves / 2), abs=1e-15)


# The mean over orders loses energy, so it does not keep all of it where e = 1 and a ball meets two.
LOSES = ("one after the other", "known answers")
MANY = ("soft breaks",)  # It plays all orders of what touches, so a rack takes half a minute.
ROWS = [row for row in EXTREMES if row.laws != ("published",) and row.name not in LOSES + MANY]
LONG = ("meeting at one instant", "squeezed to a cushion")  # rows that take it long
MATRIX = [
    pytest.param(row, marks=[pytest.mark.slow] if row.name in LONG else [], id=row.name)
    for row in ROWS
]


@pytest.fixture
def law_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Put the base class under the name `coulomb`, by which claims know what to measure.

    How far policies may have moved the ends is not measured, because no claim asks for it.
    """
    monkeypatch.setattr(import_module("pool_pymunk.solvers.request"), "QUICK", -1.0)

    class Own(Law):
        pass

    monkeypatch.setitem(LAWS, "coulomb", Own())
    reference_of.cache_clear()
    yield
    reference_of.cache_clear()


@pytest.mark.slow
@pytest.mark.usefixtures("law_of_ones_own")
@pytest.mark.parametrize("extreme", MATRIX)
def test_ones_own_law_holds_in_the_whole_matrix(extreme: Extreme) -> None:
    """A law that leaves things to the base class gains no energy, and is symmetric."""
    cell = check(replace(extreme, laws=("coulomb",)), "event-driven", quick=True)
    assert cell.run
    assert cell.worst is None, cell


@pytest.mark.slow
@pytest.mark.parametrize("extreme", MATRIX)
def test_weakening_holds_in_the_whole_matrix(
    extreme: Extreme, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The table of the matrix does not list it, so its rows are played here."""
    monkeypatch.setattr(import_module("pool_pymunk.solvers.request"), "QUICK", -1.0)
    cell = check(replace(extreme, laws=("weakening",)), "event-driven", quick=True)
    assert cell.run
    assert cell.worst is None, cell


def test_a_law_that_ignores_the_restitution_does_not_let_pressed_balls_sink() -> None:
    """In a persistent contact a force keeps the gap closed, whatever their law would do."""
    scene = persistent(0.0)
    run = simulate(scene, solver="event-driven", law=Sticky())
    assert any("presses balls a, b together" in warning for warning in run.warnings)
    times = [run.duration * k / 500 for k in range(501)]
    positions = run.at(times)[0]
    gaps = [math.dist(p, q) - 2 * R for p, q in positions]
    assert min(gaps) > -1e-4 * R
    plain = simulate(scene, solver="event-driven")
    assert largest_distance(run, plain) < 1e-7
