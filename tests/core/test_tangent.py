"""Small changes in the core: slopes of laws, courses of runs, and what goes beside them."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from pool_pymunk import NT, Law, Pair, Run, load, simulate
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.contact.laws import Coulomb, Published, Weakening
from pool_pymunk.core.tangent.differences import OwnHit
from pool_pymunk.core.tangent.slopes import Four, Hit, Nudge, known_hit
from pool_pymunk.laws.own import OwnLaw
from pool_pymunk.studies.changes import played_again
from tests.shared.scenes import random_scene
from tests.shared.shots import KINDS, ROLLING, some_scene

LAWS = [Coulomb(), Published(), Weakening()]
PARTS = ("an", "at", "bn", "bt", "m_a", "m_b", "e", "mu")


def nudge(**parts: float) -> Nudge:
    """Return a nudge of some numbers."""
    found = Nudge()
    for name, by in parts.items():
        setattr(found, name, by)
    return found


def both(law: Any, rnd: random.Random, is_wall: bool) -> tuple[Hit, Hit]:
    """Return a random hit, with slopes that are written down and with those of differences."""
    a = rnd.uniform(0.2, 2.0), rnd.uniform(0.3, 2.0)
    b = rnd.uniform(-1.0, 0.1), rnd.uniform(-2.0, 0.0)
    if is_wall:
        a, b = (-a[0], a[1]), (0.0, 0.0)
    pair = CorePair(0.2, math.inf if is_wall else 0.3, rnd.uniform(0.5, 0.9), rnd.uniform(0.05, 3))
    return known_hit(law, a, b, pair, is_wall), OwnHit(law, a, b, pair, is_wall)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
@pytest.mark.parametrize("is_wall", [False, True])
def test_slopes_that_are_written_down_are_those_of_differences(law: Any, is_wall: bool) -> None:
    """Some hits stick, and some slip on."""
    rnd = random.Random(1)
    for _ in range(200):
        written, measured = both(law, rnd, is_wall)
        by = nudge(**{name: rnd.uniform(-1.0, 1.0) for name in PARTS})
        if is_wall:
            by.bn = by.bt = by.m_a = by.m_b = 0.0
        found = measured.slope(by)
        if not math.isnan(found[0]):  # It is so where friction just stops a ball.
            assert written.slope(by) == pytest.approx(found, rel=1e-6, abs=1e-6)


def hit_of(law: Law, mu: float = 0.1, e: float = 0.9, slip: float = 0.3) -> OwnHit:
    """Return a hit of a law of a user's own, with as many m/s of slip."""
    return OwnHit(OwnLaw(law), (1.0, slip), (0.0, 0.0), CorePair(0.2, 0.2, e, mu), False)


def slope_by(hit: OwnHit, **parts: float) -> Four:
    return hit.slope(nudge(**parts))


class Rubs(Law):
    """The tangential velocities change by mu times the slip, and by e where balls do not stick."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        push = max(pair.friction, 0.0) * (a.t - b.t)
        bounce = min(max(pair.restitution, 0.0), 1.0)
        return NT(b.n * bounce, a.t - push), NT(a.n * bounce, b.t + push)


@pytest.mark.parametrize(("e", "mu"), [(0.9, 0.0), (0.0, 0.1), (1.0, 0.1), (1.0, 0.0)])
def test_at_a_limit_a_difference_goes_to_the_one_side_there_is(e: float, mu: float) -> None:
    """Central differences would give half of it there."""
    hit = hit_of(Rubs(), mu, e)
    assert slope_by(hit, mu=1.0) == pytest.approx((0.0, -0.3, 0.0, 0.3), abs=1e-9)
    assert slope_by(hit, e=1.0) == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-9)
    assert slope_by(hit, mu=-1.0) == pytest.approx((0.0, 0.3, 0.0, -0.3), abs=1e-9)


class Kinked(Law):
    """The tangential velocity of A changes by the size of the slip."""

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        return NT(0.0, a.t - 0.1 * abs(a.t - b.t)), NT(a.n, b.t)


def test_a_kink_has_no_slope_across_and_one_along_it() -> None:
    hit = hit_of(Kinked(), slip=0.0)
    assert all(map(math.isnan, slope_by(hit, at=1.0)))
    assert all(map(math.isnan, slope_by(hit, an=0.5, bt=-2.0)))
    assert slope_by(hit, an=1.0) == pytest.approx((0.0, 0.0, 1.0, 0.0))
    assert slope_by(hit, at=1.0, bt=1.0) == pytest.approx((0.0, 1.0, 0.0, 1.0))
    beside = hit_of(Kinked(), slip=1e-3)
    assert slope_by(beside, at=1.0) == pytest.approx((0.0, 0.9, 0.0, 0.0))


def test_rounding_takes_the_mean_of_both_sides_of_a_kink() -> None:
    hit = OwnHit(OwnLaw(Kinked()), (1.0, 0.0), (0.0, 0.0), CorePair(0.2, 0.2, 0.9, 0.1), False,
                 minds_kinks=False)  # fmt: skip
    assert slope_by(hit, at=1.0) == pytest.approx((0.0, 1.0, 0.0, 0.0))


def test_an_own_copy_of_a_law_has_its_derivatives() -> None:
    """The one is asked beside each hit, and the slopes of the other one are written down."""

    class Mine(Law):
        pass

    scene = load("report")
    for shot in (1, 2, 3):
        usual = simulate(scene, shot, solver="event-driven", law="coulomb").derivatives("all")
        mine = simulate(scene, shot, solver="event-driven", law=Mine()).derivatives("all")
        size = np.nanmax(np.abs(usual.final))
        np.testing.assert_allclose(mine.final, usual.final, rtol=0.0, atol=1e-9 * size)
        assert mine.warnings == usual.warnings


# -- courses ---------------------------------------------------------------------------------------


def runs() -> list[Run]:
    """Return runs of all kinds of scenes, some of which are cut."""
    found = [simulate(some_scene(kind, 1), solver="event-driven", max_events=60)
             for kind in [*KINDS[:6], *ROLLING[:4]]]  # fmt: skip
    found.append(simulate(random_scene(3, "hexagon"), solver="event-driven", max_time=0.7))
    return found


def test_a_run_is_played_again_with_the_same_bits() -> None:
    for run in runs():
        replay = played_again(run)
        steps = [step for step in replay.course.steps if step.kind < 5]
        assert [step.t for step in steps] == [event.t for event in run.events]
        for step, event in zip(steps, run.events, strict=True):
            ids = tuple(run.scene.balls[i].id for i in dict.fromkeys((step.a, step.other)))
            assert ids == event.balls
        for legs, rows in zip(replay.course.legs, run.knots, strict=True):
            begun = {(leg.path.t, leg.path.x, leg.path.y, leg.path.vx, leg.path.vy) for leg in legs}
            assert {tuple(row[:5]) for row in rows.tolist() if row[0] < run.duration} <= begun


def test_a_saved_run_has_the_same_derivatives(tmp_path: Any) -> None:
    run = simulate(load("report"), 1, solver="event-driven")
    run.save(tmp_path / "run")
    other = Run.load(tmp_path / "run")
    np.testing.assert_array_equal(run.derivatives("all").final, other.derivatives("all").final)


def test_derivatives_at_the_end_are_those_of_the_end() -> None:
    run = simulate(load("eight-ball"), 1, solver="event-driven")
    found = run.derivatives("all")
    for k, ball in enumerate(run.scene.balls):
        last, size = found.at([run.duration], ball.id)[0], np.nanmax(np.abs(found.final))
        np.testing.assert_allclose(last, found.final[k], rtol=0.0, atol=1e-14 * size)


def test_nothing_is_differentiated_by_nothing() -> None:
    found = simulate(load("report"), 3, solver="event-driven").derivatives([])
    assert found.final.shape == (11, 2, 0) and found.times.shape == (2, 0)
    assert found.at([0.0, 0.5], "C").shape == (2, 2, 0)


@pytest.mark.parametrize("name", ["report", "follow-and-draw", "stadium"])
def test_derivatives_at_a_time_are_those_of_a_run_that_is_cut_then(name: str) -> None:
    scene = load(name)
    run = simulate(scene, 1, solver="event-driven")
    found = run.derivatives("all")
    for share in (0.13, 0.4, 0.77):
        t = share * run.duration
        cut = simulate(scene, 1, solver="event-driven", max_time=t).derivatives("all").final
        size = np.nanmax(np.abs(cut))
        for k, ball in enumerate(scene.balls):
            at = found.at([t], ball.id)[0]
            np.testing.assert_allclose(at, cut[k], rtol=0.0, atol=1e-13 * size)
