"""Derivatives end at persistent contacts, and what asks for them does without, and says why."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Derivatives,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SettingError,
    Shot,
    State,
    Table,
    Uncertainty,
    find,
    fit,
    simulate,
    simulate_many,
)
from pool_pymunk.model import Point
from pool_pymunk.model.inputs import input_value, with_inputs
from pool_pymunk.studies.changes import rounding
from pool_pymunk.studies.sensitivity import linear
from tests.shared.press_scenes import M, R

DEAD = Restitution(0.0, cushion=0.0)
REASON = "a contact is persistent"
STEP = 1e-6  # of an input, for differences


def ball(
    k: int, place: Point, velocity: Point = (0.0, 0.0), roll: float = 0.0, m: float = M
) -> Ball:
    return Ball(str(k), place, R, m, velocity=velocity, roll=roll)


def play(scene: Scene) -> Run:
    return simulate(scene, solver="event-driven")


PAIR = Scene(
    (ball(0, (0.0, 0.0), (1.0, 0.05), 1.0), ball(1, (0.1, 0.01), m=0.2)),
    None,
    DEAD,
    Friction(0.2, rolling=0.02),
)
ARC = Scene(
    (ball(0, (1.2, 0.2), (0.97, -0.03), 1.0),),
    Table.circle(0.8),
    DEAD,
    Friction(0.2, 0.2, rolling=0.02),
)
SCENES = {
    "a ball rolls into another one and pushes it": PAIR,
    "a disc pushes another one aside": Scene(
        (ball(0, (0.0, 0.0), (0.9, 0.03)), ball(1, (0.0672, 0.02))),
        None,
        DEAD,
        Friction(0.2, ball_ball=0.1),
    ),
    "a roll presses a ball on to a cushion": Scene(
        (ball(0, (0.5, 0.1), (0.7, -0.5), 1.0),),
        Table.rectangle(6, 2),
        DEAD,
        Friction(0.2, 0.1, rolling=0.03),
    ),
    "a ball rolls along an arc": ARC,
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_they_are_known_until_it_begins_and_nan_from_then_on(scene: Scene) -> None:
    run = play(scene)
    found, since = run.derivatives("all"), run.persistent[0].since
    assert np.isnan(found.final).all() and np.isnan(found.velocity).all()
    assert found.warnings == (
        f"{REASON} (at {since:.6g} s): what depends on it has no derivative, and is NaN",
    )
    assert all(math.isnan(each) for each in found.amplification.values())
    cut = play(replace(scene, physics=Physics(max_time=0.9 * since)))
    assert not cut.persistent
    for k, one in enumerate(scene.balls):
        before, *after = found.at([0.9 * since, 1.01 * since, run.duration], one.id)
        assert np.allclose(before, cut.derivatives("all").final[k], rtol=1e-12, atol=0.0)
        assert np.isnan(after).all()


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_the_time_of_the_hit_at_which_it_begins_is_known(scene: Scene) -> None:
    run = play(scene)
    found, since = run.derivatives(["vx.0", "friction.surface"]), run.persistent[0].since
    assert found.times.shape == (len(run.events), 2)
    known = np.isfinite(found.times).all(axis=1).tolist()
    assert known == [event.t < since or event.is_contact for event in run.events]
    [hit] = [k for k, event in enumerate(run.events) if event.t == since]
    beside = [
        play(with_inputs(scene, {"vx.0": input_value(scene, "vx.0") + step})).events[hit].t
        for step in (-STEP, STEP)
    ]
    assert found.times[hit, 0] == pytest.approx((beside[1] - beside[0]) / (2.0 * STEP), rel=1e-6)


# -- who is lost -----------------------------------------------------------------------------------


def with_others(*others: Ball) -> Scene:
    return replace(PAIR, balls=(*PAIR.balls, *others))


def is_known(found: Derivatives) -> list[bool]:
    """Tell for each ball whether all derivatives of its end are numbers; if not, none is."""
    known = [np.isfinite(own) for own in found.final]
    assert all(bool(own.all()) == bool(own.any()) for own in known)
    return [bool(own.all()) for own in known]


def test_a_ball_that_is_never_in_the_group_keeps_its_own() -> None:
    """It hits another ball while the others are pressed together, and bounces off."""
    striker = replace(ball(2, (0.0, 1.0), (1.0, 0.0), 1.0), cue=True)
    others = striker, ball(3, (0.15, 1.01))
    scene = replace(with_others(*others), restitution=Restitution(0.0, cue_ball=0.95))
    run, alone = play(scene), play(replace(scene, balls=others))
    [contact] = run.persistent
    [hit] = [event for event in run.events if event.balls == ("2", "3")]
    assert contact.balls == ("0", "1") and contact.since < hit.t < contact.until
    names = ["vx.2", "y.2", "y.3", "mass.3", "restitution.cue_ball", "friction.surface"]
    found, own = run.derivatives(names), alone.derivatives(names)
    assert is_known(found) == [False, False, True, True]
    np.testing.assert_array_equal(found.final[2:], own.final)
    theirs = [k for k, event in enumerate(run.events) if not {"0", "1"} & {*event.balls}]
    np.testing.assert_array_equal(found.times[theirs], own.times)


def test_a_ball_that_was_hit_before_keeps_its_own() -> None:
    """The first ball hits one in passing, and pushes another one only later."""
    scene = with_others(ball(2, (0.02, -1.94 * R), m=0.01))
    run = play(scene)
    assert run.events[0].balls == ("0", "2") and run.events[0].t < run.persistent[0].since
    assert {id_ for each in run.persistent for id_ in each.balls} == {"0", "1"}
    assert not any("2" in event.balls and len(event.balls) > 1 for event in run.events[1:])
    found = run.derivatives(["vy.0"])
    assert is_known(found) == [False, False, True]
    ends = [play(with_inputs(scene, {"vy.0": 0.05 + step})).end.position[2]
            for step in (-STEP, STEP)]  # fmt: skip
    slope = (np.array(ends[1]) - ends[0]) / (2.0 * STEP)
    assert found.final[2, :, 0] == pytest.approx(slope, rel=1e-5)


def test_a_ball_that_one_of_the_group_hits_later_is_lost_then() -> None:
    scene = with_others(ball(2, (0.45, 0.06)))
    run = play(scene)
    [hit] = [event for event in run.events if event.balls == ("1", "2")]
    assert hit.t > run.persistent[0].since
    found = run.derivatives(["x.2", "vx.0"])
    assert is_known(found) == [False, False, False]
    assert found.at([0.9 * hit.t], "2")[0].tolist() == [[1.0, 0.0], [0.0, 0.0]]
    assert np.isnan(found.at([1.1 * hit.t], "2")).all()
    assert np.isnan(found.times[run.events.index(hit)]).all()


def beside(row: np.ndarray, t: float, off: float, side: float) -> Point:
    """Return a place so far (m) off a ball that moves on from a breakpoint, at a time (s)."""
    begun, x, y, vx, vy, ax, ay, *_ = row
    s = t - begun
    x, y = x + s * (vx + s * ax / 2.0), y + s * (vy + s * ay / 2.0)
    vx, vy = vx + s * ax, vy + s * ay
    away = side * (2.0 * R + off) / math.hypot(vx, vy)
    return float(x - away * vy), float(y + away * vx)


def test_a_ball_that_the_pushed_one_touches_in_passing_is_at_a_kink() -> None:
    """It lies at its side in one of the many short pieces of its motion, at which is no event."""
    rows = play(PAIR).knots[1]
    k = int(np.searchsorted(rows[:, 0], 0.09))
    t = (rows[k - 1, 0] + rows[k, 0]) / 2.0
    for off, known in ((1e-15, False), (1e-7, True)):
        run = play(with_others(ball(2, beside(rows[k - 1], t, off, 1.0))))
        assert not any("2" in event.balls for event in run.events)
        found = run.derivatives(["vx.0", "x.2"])
        assert is_known(found) == [False, False, known]


def test_a_ball_that_the_pushed_one_would_touch_by_itself_is_not() -> None:
    """Its first piece, if it went on, would touch a ball that is struck a little later."""
    rows, since = play(PAIR).knots[1], play(PAIR).persistent[0].since
    first = rows[rows[:, 0] <= since][-1]
    x, y = beside(first, 0.115, 1e-15, -1.0)
    striker = replace(ball(3, (x, y - 2.0 * R - 0.125), (0.0, 1.0), 1.0), cue=True)
    scene = with_others(ball(2, (x, y)), striker)
    run = play(replace(scene, restitution=Restitution(0.0, cue_ball=0.9)))
    [k] = [k for k, event in enumerate(run.events) if event.balls == ("2", "3")]
    assert 0.115 < run.events[k].t < run.persistent[0].until
    assert not any({"1", "2"} == {*event.balls} for event in run.events[:k])
    found = run.derivatives(["vy.3"])
    assert np.isfinite(found.times[k]).all()
    assert found.times[k, 0] == pytest.approx(-0.125, rel=0.05)


def test_what_the_group_does_need_not_be_understood() -> None:
    """Only the beginning of the contact tells what is lost, and no breakpoint after that."""
    run = play(with_others(ball(2, (0.0, 1.0), (1.0, 0.0), 1.0)))
    since = run.persistent[0].since
    expected = run.derivatives()
    for some in (slice(-1, None), slice(None, None, 3), slice(0)):
        fewer = [
            np.concatenate([rows[rows[:, 0] <= since], rows[rows[:, 0] > since][some]])
            for rows in run.knots[:2]
        ]
        other = replace(run, knots=(*fewer, run.knots[2]))
        found = other.derivatives()
        assert found.warnings == expected.warnings
        np.testing.assert_array_equal(found.final, expected.final)
        np.testing.assert_array_equal(found.times, expected.times)
    events = tuple(event for event in run.events if event.t <= since)
    assert math.isnan(rounding(replace(other, events=events)))


def test_breakpoints_that_nothing_explains_are_no_motion_of_a_ball_alone() -> None:
    """Where a run does not tell of its persistent contact, its ends are still not known."""
    run = play(PAIR)
    found = replace(run, persistent=()).derivatives()
    assert np.isnan(found.final).all() and REASON in found.warnings[0]


ON_AN_ARC = Scene(
    (ball(0, (0.0, R - 0.8), (0.6, 0.0), 1.0),),
    Table(((-0.8, 0.0), (0.8, 0.0)), bulge=(1.0, 1.0)),
    DEAD,
    Friction(0.2, 0.2, rolling=0.02),
)
AT_A_CUSHION = replace(
    ON_AN_ARC, balls=(ball(0, (0.2, R), (0.6, 0.0)),), table=Table.rectangle(3.0, 1.0)
)


@pytest.mark.parametrize("scene", [ON_AN_ARC, AT_A_CUSHION])
def test_one_that_lasts_from_the_start(scene: Scene) -> None:
    velocity, into = scene.balls[0].velocity, ((0.4, -0.9),)
    start = State((scene.balls[0].position,), (velocity,), roll=into)
    run = simulate(scene, solver="event-driven", start=start)
    found = run.derivatives()
    assert run.persistent[0].since == 0.0
    assert np.isnan(found.final).all() and f"{REASON} (at 0 s)" in found.warnings[0]


def test_a_run_that_is_cut_while_it_lasts() -> None:
    since = play(PAIR).persistent[0].since
    run = play(replace(PAIR, physics=Physics(max_time=1.5 * since)))
    found = run.derivatives()
    assert run.persistent[0].until == run.duration
    assert np.isnan(found.final).all() and len(found.warnings) == 1


def test_another_solver_and_many_shots_say_the_same() -> None:
    scene = with_others(ball(2, (0.0, 1.0), (1.0, 0.0), 1.0))
    own = play(scene).derivatives("velocity")
    found = simulate(scene, solver="pymunk", dt=1e-3).derivatives("velocity")
    assert is_known(found) == is_known(own) == [False, False, True]
    assert REASON in found.warnings[0]
    batch = simulate_many(scene, derivatives="velocity")
    assert batch.derivatives is not None
    np.testing.assert_array_equal(batch.derivatives[0], own.final)


# -- studies ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_rounding_comes_from_runs_that_are_played_again(scene: Scene) -> None:
    run = play(scene)
    assert math.isnan(rounding(run))
    assert 0.0 < run.rounding < 1e-10


def test_rounding_before_it_begins_is_linear() -> None:
    since = play(PAIR).persistent[0].since
    run = play(replace(PAIR, physics=Physics(max_time=0.9 * since)))
    assert run.rounding == rounding(run) > 0.0


def struck(*others: Ball) -> Scene:
    """Return a table on which a shot pushes a ball, as in PAIR."""
    balls = (replace(PAIR.balls[0], velocity=(0.0, 0.0), roll=0.0), *PAIR.balls[1:], *others)
    shot = Shot("push", "0", speed=1.0, angle=math.degrees(math.atan2(0.05, 1.0)), roll=1.0)
    return replace(PAIR, balls=balls, shots=(shot, Shot("alone", "0", speed=0.5, angle=90.0)))


def test_the_linear_sensitivity_says_so() -> None:
    found = linear(struck(), 1, Uncertainty(1e-4))
    assert np.isnan(found.std).all() and math.isnan(found.holds)
    assert found.warnings == play(struck()).derivatives("position").warnings
    assert REASON in found.warnings[0]


def ends(scene: Scene, *shots: int) -> Sequence[tuple[int, str, float, float]]:
    runs = {k: simulate(scene, k, solver="event-driven") for k in shots}
    return [(k, "0", *run.final["0"]) for k, run in runs.items()]


def test_a_fit_leaves_its_ends_out_and_says_so() -> None:
    pytest.importorskip("scipy")
    scene = struck()
    found = fit(scene, ends(scene, 1, 2), ["friction.surface"], starts=1)
    assert found.used.tolist() == [False, True]
    [text] = [text for text in found.warnings if "left out" in text]
    assert text.startswith("1 of 2 places are left out, because it is not known how they depend on")
    assert f"push: {REASON} (at " in text
    with pytest.raises(SettingError, match=f"no measured place has derivatives.*push: {REASON}"):
        fit(scene, ends(scene, 1), ["friction.surface"], starts=1)


def test_a_found_shot_is_not_moved_by_what_is_not_known_and_says_so() -> None:
    """The goal is for a ball that is pushed, or for one that is only hit."""
    for e, is_pushed in ((0.0, True), (0.95, False)):
        scene = replace(struck(), restitution=Restitution(e), physics=Physics(max_time=0.1))
        (one,) = find(
            scene, 1, lambda batch: batch.hits > 0, angle=(2.8, 2.9), speed=(0.99, 1.01),
            tries=600, samples=10, best=1, ends={"1": (0.2, 0.02)},
        )  # fmt: skip
        assert bool(one.run.persistent) == is_pushed
        assert bool(one.warnings) == is_pushed
        assert all(REASON in text for text in one.warnings)
