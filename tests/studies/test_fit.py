"""A fit finds the numbers that measured ends came from, and its errors are what they say."""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Fit,
    Friction,
    Physics,
    Restitution,
    Scene,
    SceneError,
    SettingError,
    Shot,
    Table,
    fit,
    load,
    simulate,
    simulate_all,
)
from pool_pymunk.model.inputs import input_value, with_inputs
from pool_pymunk.studies import fit_doubts as robust
from pool_pymunk.studies.fit import input_names
from pool_pymunk.studies.fit_doubts import (
    Optimum,
    blind_part,
    covariances,
    doubts,
    robust_scale,
)
from pool_pymunk.studies.measured import Forecast, Measurement, read_measured
from tests import ROOT
from tests.shared.commands import exit_code, refusal
from tests.shared.scenes import takes_long

pytest.importorskip("scipy")

Capture = pytest.CaptureFixture[str]
Rows = list[tuple[Any, ...]]

RADIUS, MASS = 0.0286, 0.17
NOISE = 1e-3  # m
COEFFICIENTS = ("restitution", "friction")

BALLS = (
    Ball("cue", (0.6, 0.6), RADIUS, MASS, cue=True),
    Ball("1", (1.3, 0.7), RADIUS, MASS),
    Ball("2", (1.9, 0.45), RADIUS, MASS),
    Ball("3", (2.1, 0.95), RADIUS, MASS),
)
TRUTH = Scene(
    BALLS,
    Table.rectangle(2.54, 1.27),
    Restitution(ball_ball=0.93, cushion=0.75),
    Friction(surface=0.1, cushion=0.15, ball_ball=0.05),
    shots=(
        Shot("long", "cue", speed=3.0, angle=31.0),
        Shot("soft", "cue", speed=1.6, angle=8.5),
        Shot("bank", "cue", speed=2.6, angle=-38.0),
        Shot("cut", "cue", speed=2.2, angle=5.0),
        Shot("lag", "cue", speed=2.0, angle=90.0),
    ),
)
GUESS = replace(
    TRUTH,
    restitution=Restitution(ball_ball=0.9, cushion=0.8),
    friction=Friction(surface=0.12, cushion=0.2, ball_ball=0.03),
)


def ends(scene: Scene) -> Rows:
    """Return where the balls that moved end in each shot of a scene."""
    starts = {ball.id: ball.position for ball in scene.balls}
    return [
        (k, id_, *end)
        for k, run in enumerate(simulate_all(scene, solver="event-driven"), start=1)
        for id_, end in run.final.items()
        if end != starts[id_]
    ]


def tracked(scene: Scene) -> Rows:
    """Return where the balls that move are, thirty times a second, in each shot of a scene."""
    tracks: Rows = []
    for k, run in enumerate(simulate_all(scene, solver="event-driven"), start=1):
        times = np.arange(0.0, run.duration, 1.0 / 30.0).tolist()
        for i, ball in enumerate(scene.balls):
            if run.final[ball.id] != ball.position:
                at = run.at(times)[0][:, i].tolist()
                tracks += [(k, ball.id, *p, t) for p, t in zip(at, times, strict=True)]
    return tracks


def noisy(rows: Rows, rng: np.random.Generator, sigma: float = NOISE) -> Rows:
    """Return rows with normal errors of both coordinates."""
    errors = rng.normal(0.0, sigma, (len(rows), 2)).tolist()
    return [
        (shot, ball, x + dx, y + dy, *more)
        for (shot, ball, x, y, *more), (dx, dy) in zip(rows, errors, strict=True)
    ]


def errors_off(found: Fit, truth: Scene = TRUTH) -> list[float]:
    """Return by how many standard errors each fitted number is off the truth."""
    return [found.errors_off(name, input_value(truth, name)) for name in found.values]


def sliding(surface: float = 0.1, shots: int = 1) -> Scene:
    """Return a ball on an open plane that slides until it stops."""
    struck = tuple(Shot(f"{k}", "C", (2.0, 0.0)) for k in range(1, shots + 1))
    ball = Ball("C", (0.0, 0.0), 0.03, 0.2, cue=True)
    return Scene((ball,), friction=Friction(surface=surface), shots=struck)


# -- what a fit finds ------------------------------------------------------------------------------


def test_the_friction_of_a_ball_that_slides() -> None:
    """It stops at v^2 / (2 mu g), so mu and its error are known in closed form."""
    rng = np.random.default_rng(5)
    stops = rng.normal(2.0, NOISE, 40)
    rows = [(k, "C", float(x), 0.0) for k, x in enumerate(stops, start=1)]
    found = fit(sliding(0.15, shots=40), rows, "friction.surface", error=NOISE, starts=1)
    mu = 2.0 / (9.80665 * float(np.mean(stops)))
    by_mu = 2.0 / (9.80665 * mu**2)
    error = NOISE / by_mu / math.sqrt(40.0)
    assert found.values["friction.surface"] == pytest.approx(mu, abs=0.5 * error)
    assert found.standard_errors["friction.surface"] == pytest.approx(error, rel=0.1)
    assert found.sigma == NOISE
    assert found.warnings == ()
    assert found.scene.friction.surface == found.values["friction.surface"]


@pytest.mark.slow
def test_exact_ends_give_the_exact_numbers() -> None:
    found = fit(GUESS, ends(TRUTH), COEFFICIENTS)
    for name, value in found.values.items():
        assert value == pytest.approx(input_value(TRUTH, name), abs=1e-9)
    assert found.rms < 1e-9 < 0.01 < found.rms_before
    assert found.warnings == ()


def test_friction_of_rolling_and_the_rolls_of_shots() -> None:
    shots = (replace(TRUTH.shots[0], roll=0.8), replace(TRUTH.shots[3], roll=-0.5))
    truth = replace(TRUTH, friction=Friction(0.2, 0.15, 0.05, 0.012), shots=shots)
    guess = with_inputs(truth, {"friction.rolling": 0.008, "roll.1": 0.0, "roll.2": 0.0})
    found = fit(guess, tracked(truth)[::10], ["friction.rolling", "roll"], starts=1)
    expected = {"friction.rolling": 0.012, "roll.1": 0.8, "roll.2": -0.5}
    assert found.values == pytest.approx(expected, rel=1e-9)


def test_the_report_printed_070() -> None:
    """Its published ends alone say so, though the search starts from the 0.95 that it states."""
    report = load("report")
    stated = replace(report, restitution=replace(report.restitution, cue_ball=0.95))
    for scene in (report, stated):
        found = fit(scene, "published", "restitution.cue_ball", starts=2)
        assert found.values["restitution.cue_ball"] == pytest.approx(0.7, abs=2e-4)
        assert found.errors_off("restitution.cue_ball", 0.7) < 2.0
        assert found.errors_off("restitution.cue_ball", 0.95) > 1000.0
        assert found.rms < 0.01 * 0.0254
        (left_out,) = found.warnings
        assert left_out.startswith("4 of 44 places are left out")
        assert "Simulation 4: balls C, 1, 9, 10" in left_out
        assert "law published jumps" in left_out
    assert found.rms_before > 1.0 * 0.0254


@pytest.mark.slow
def test_tracks_with_blunders() -> None:
    """Of five hundred places on tracks a dozen are nonsense; fifteen numbers come out right."""
    rng = np.random.default_rng(3)
    rows = noisy(tracked(TRUTH), rng)
    spoilt = rng.choice(len(rows), 12, replace=False).tolist()
    for m in spoilt:
        shot, ball, _, _, t = rows[m]
        rows[m] = (shot, ball, rng.uniform(0.0, 2.54), rng.uniform(0.0, 1.27), t)
    found = fit(GUESS, rows, (*COEFFICIENTS, "speed", "angle"), starts=1)
    assert len(found.values) == 15
    assert found.sigma == pytest.approx(NOISE, rel=0.1)
    assert max(errors_off(found)) < 3.5
    assert any(f"12 of {len(rows)} places are more than 5 sigma off" in w for w in found.warnings)


@pytest.mark.slow
def test_several_starts_find_what_one_does_not() -> None:
    """From the guess alone the search ends where contacts come in a wrong order, and says so."""
    rows = noisy(ends(TRUTH), np.random.default_rng(1))
    alone = fit(GUESS, rows, COEFFICIENTS, starts=1)
    assert alone.rms > 20.0 * NOISE
    assert any("not move in proportion" in warning for warning in alone.warnings)
    found = fit(GUESS, rows, COEFFICIENTS)
    assert found.rms < 2.0 * NOISE
    again = fit(GUESS, rows, COEFFICIENTS)
    assert found.values == again.values


@takes_long
@pytest.mark.slow
def test_standard_errors_are_calibrated() -> None:
    """The truth lies within two standard errors in 90 to 99 of 100 sets of noisy ends."""
    shots = tuple(
        replace(shot, name=f"{shot.name} {k}", angle=(shot.angle or 0.0) + 0.7 * k)
        for k in range(2)
        for shot in TRUTH.shots
    )
    truth = replace(TRUTH, shots=shots)
    near = with_inputs(truth, {name: 1.01 * input_value(truth, name) for name in FREE})
    rng = np.random.default_rng(2)
    exact = ends(truth)
    off = np.array(
        [errors_off(fit(near, noisy(exact, rng), FREE, starts=1), truth) for _ in range(100)]
    )
    inside = (off < 2.0).sum(axis=0)
    assert ((inside >= 90) & (inside <= 99)).all(), inside
    assert 0.75 < (off**2).mean() < 1.35
    assert 0.9 < (off < 2.0).mean() < 0.99


FREE = (
    "restitution.ball_ball",
    "restitution.cushion",
    "friction.surface",
    "friction.cushion",
    "friction.ball_ball",
)


def test_correlations_are_those_of_the_derivatives() -> None:
    """Speed and friction of a slide: x = v^2 / 2 mu g, and the time t = v / mu g of its stop."""
    scene = sliding()
    rows = [(1, "C", 2.0 * t - 0.5 * scene.deceleration * t * t, 0.0, t) for t in (0.2, 0.5, 1.0)]
    found = fit(scene, rows, ["speed.1", "friction.surface"], error=NOISE, starts=1)
    by = np.array([[t, -0.5 * 9.80665 * t * t] for t in (0.2, 0.5, 1.0)])
    covariance = np.linalg.inv(by.T @ by)
    said = covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1])
    assert found.correlations[0, 1] == pytest.approx(said, abs=1e-6)
    assert found.correlations[0, 0] == pytest.approx(1.0)


# -- what is predicted -----------------------------------------------------------------------------


@pytest.mark.parametrize("anew", [False, True])
@pytest.mark.parametrize(("max_time", "rolling"), [(None, None), (1.0, None), (1.0, 0.03)])
def test_derivatives_through_a_chain_of_shots(
    max_time: float | None, rolling: float | None, anew: bool
) -> None:
    """They agree with differences, though shots aim at balls that the shots before have moved."""
    shots = (
        Shot("a", "cue", speed=2.2, aim="1"),
        Shot("b", "cue", speed=1.6, aim="nearest", from_previous=True),
        Shot("c", "cue", speed=1.5, aim="3", from_previous=True),
    )
    scene = replace(TRUTH, shots=shots, physics=Physics(max_time=max_time))
    groups = (*COEFFICIENTS, "position", "mass", "radius", "speed")
    if rolling is not None:
        friction = replace(TRUTH.friction, rolling=rolling)
        rolls = tuple(replace(s, roll=k / 4.0) for k, s in enumerate(shots, start=-1))
        scene = replace(scene, friction=friction, shots=rolls)
    names = input_names(scene, (*groups, *["roll"] * scene.surface.rolls), (1, 3))
    assert ("roll.3" in names) is ("friction.rolling" in names) is (rolling is not None)
    assert "speed.3" in names
    assert "speed.2" not in names
    measured = [
        Measurement(k, ball.id, 0.5, 0.5, t)
        for k in (3, 1)
        for ball in BALLS
        for t in (None, 0.3, 0.9)
    ]
    forecast = Forecast(scene, names, measured, None, aims_anew=anew)
    found, warnings = forecast.derivatives(forecast.own)
    assert warnings == ()
    for column in range(len(names)):
        step = 1e-7 * np.eye(len(names))[column]
        low, high = (forecast.residuals(forecast.own + sign * step) for sign in (-1, 1))
        np.testing.assert_allclose(found[..., column], (low - high) / 2e-7, 1e-6, 2e-6)


@pytest.mark.parametrize("anew", [False, True])
def test_a_fit_aims_once_or_at_where_a_try_has_the_ball(anew: bool) -> None:
    """The fitted scene plays as the fit did."""
    shots = (
        Shot("a", "cue", speed=2.2, aim="1"),
        Shot("b", "cue", speed=1.6, aim="nearest", from_previous=True),
    )
    scene, names = replace(TRUTH, shots=shots), ("y.1", "restitution.ball_ball")
    own = [run.knots[0][0, 3:5] for run in simulate_all(scene, solver="event-driven")]
    forecast = Forecast(scene, names, [Measurement(2, "1", 0.5, 0.5)], None, aims_anew=anew)
    values = forecast.own + np.array([0.01, -0.02])
    runs = forecast.runs(values)
    assert runs is not None
    for k, run in runs.items():
        turned = np.abs(run.knots[0][0, 3:5] - own[k - 1]).max()
        assert turned > 1e-3 if anew else turned < 1e-12
    fitted = forecast.scene_of(values.tolist())
    assert [shot.aim for shot in fitted.shots] == (["1", "nearest"] if anew else [None, None])
    again = simulate_all(fitted, solver="event-driven")
    assert [run.final for run in again] == [run.final for run in runs.values()]


def test_a_fit_that_moves_no_ball_keeps_the_aims() -> None:
    scene = load("report")
    rows = read_measured([(4, "C", 1.0, 0.5)], scene)
    assert Forecast(scene, ("restitution.cushion",), rows, None).scene == scene


def test_inputs_of_shots() -> None:
    report = load("report")
    faster = with_inputs(report, {"speed.1": 2.0, "angle.1": 90.0, "angle.2": 10.0})
    assert faster.shots[0].velocity == pytest.approx((0.0, 2.0))
    assert (faster.shots[1].speed, faster.shots[1].angle) == (2.5, 10.0)
    assert with_inputs(report, {"speed.4": 2.0}).shots[3].aim == "nearest"
    with pytest.raises(SettingError, match=r"free = angle\.4: there is no such input"):
        input_names(report, ["angle.4"])
    assert input_names(report, "angle", (1, 2, 4)) == ("angle.1", "angle.2")


# -- what the data cannot tell ---------------------------------------------------------------------


def test_what_no_shot_tells_keeps_its_number() -> None:
    lag = [row for row in ends(TRUTH) if row[0] == 5]
    names = ["restitution.ball_ball", "friction.ball_ball", "mass.1", "x.3", "restitution.cushion"]
    found = fit(GUESS, lag, names, error=NOISE, starts=3)
    assert "restitution.ball_ball: no shot has such a hit" in found.warnings
    assert "friction.ball_ball: no shot has such a hit" in found.warnings
    assert "mass.1: no shot has a hit of ball 1" in found.warnings
    assert "x.3: no place that was measured depends on it" in found.warnings
    for name in names[:4]:
        assert found.values[name] == input_value(GUESS, name)
        assert math.isnan(found.standard_errors[name])
    assert math.isfinite(found.standard_errors["restitution.cushion"])
    assert "(unknown)" in repr(found)


def test_masses_are_known_but_for_a_factor() -> None:
    rows = [row for row in ends(TRUTH) if row[0] == 4]
    found = fit(TRUTH, rows, ["mass.cue", "mass.1", "friction.surface"], error=NOISE, starts=1)
    assert any(
        w == "mass.cue and mass.1: the data tell only a combination of them, so one must be given"
        for w in found.warnings
    )
    assert math.isnan(found.standard_errors["mass.1"])
    assert math.isfinite(found.standard_errors["friction.surface"])
    assert found.values["mass.cue"] == pytest.approx(MASS)


def test_too_few_places_have_no_errors() -> None:
    found = fit(sliding(), [(1, "C", 1.9, 0.0)], "friction.surface", starts=1)
    assert math.isnan(found.standard_errors["friction.surface"])
    (warning,) = found.warnings
    assert warning.startswith("1 number fitted to 1 measured coordinate: none is left over")
    assert math.isnan(found.sigma)
    stated = fit(sliding(), [(1, "C", 1.9, 0.0)], "friction.surface", starts=1, error=NOISE)
    assert stated.standard_errors["friction.surface"] > 0.0


def test_numbers_that_are_hardly_told_apart() -> None:
    rows = [(1, "C", 2.0 * t - 0.490333 * t * t, 0.0, t) for t in (1.0, 1.02, 1.04)]
    found = fit(sliding(), rows, ["speed.1", "friction.surface"], error=NOISE, starts=1)
    assert any("speed.1 and friction.surface are hardly distinguished" in w for w in found.warnings)


def test_what_remains_may_be_more_than_the_stated_error() -> None:
    rows = [(k, "C", 2.0 + 0.01 * (-1.0) ** k, 0.0) for k in range(1, 11)]
    found = fit(sliding(shots=10), rows, "friction.surface", error=NOISE, starts=1)
    assert any("times the stated error" in warning for warning in found.warnings)


def test_an_error_that_no_measurement_has_is_doubted() -> None:
    """Places 12 mm off are not errors of measurement for balls of 30 mm, if nobody says so."""
    rows = [(k, "C", 2.0 + 0.012 * (-1.0) ** k, 0.0) for k in range(1, 11)]
    found = fit(sliding(shots=10), rows, "friction.surface", starts=1)
    assert any("more than 0.1 of a ball's radius" in warning for warning in found.warnings)
    stated = fit(sliding(shots=10), rows, "friction.surface", starts=1, error=0.012)
    assert stated.warnings == ()


@pytest.mark.parametrize("spare", [1, 3, 10, 1000])
def test_the_largest_excess_is_passed_once_in_a_thousand_times(spare: int) -> None:
    from scipy.special import chdtrc  # the tail of chi squared

    largest = robust.largest_excess(spare)
    assert chdtrc(spare, spare * largest**2) == pytest.approx(1e-3, rel=1e-9)
    errors = np.random.default_rng(0).normal(0.0, NOISE, spare + 2)
    assert robust.excess(errors, NOISE, 2) < largest
    assert robust.excess(errors[:2], NOISE, 2) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, *(pytest.param(seed, marks=takes_long) for seed in (25, 28))])
def test_a_search_goes_on_where_what_remains_is_implausible(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without further starts these fits end in wrong minima, and say so."""
    guess, rows, free, error = random_set(seed)
    assert fit(guess, rows, free, error=error).rms < 2.5 * NOISE
    monkeypatch.setattr("pool_pymunk.studies.fit.MORE", 0)
    stuck = fit(guess, rows, free, error=error)
    assert stuck.rms > 5.0 * NOISE
    assert any("ended in a wrong minimum" in warning for warning in stuck.warnings)


def random_set(seed: int) -> tuple[Scene, Rows, list[str], float | None]:
    """Return a guess, noisy ends of random shots on a random table, what is free, and the error."""
    rng = np.random.default_rng(1000 + seed)
    count = int(rng.integers(3, 7))
    places: list[tuple[float, float]] = []
    while len(places) < count:
        place = (rng.uniform(0.1, 2.44), rng.uniform(0.1, 1.17))
        if all(math.dist(place, other) > 3 * RADIUS for other in places):
            places.append(place)
    ids = ["cue", *map(str, range(1, count))]
    surface = rng.uniform(0.03, 0.15)
    truth = Scene(
        tuple(Ball(i, p, RADIUS, MASS, cue=i == "cue") for i, p in zip(ids, places, strict=True)),
        Table.rectangle(2.54, 1.27),
        Restitution(ball_ball=rng.uniform(0.85, 0.98), cushion=rng.uniform(0.6, 0.9)),
        Friction(surface, cushion=rng.uniform(0.05, 0.25), ball_ball=rng.uniform(0.02, 0.1)),
    )
    shots = tuple(random_shot(k, places, rng) for k in range(int(rng.integers(4, 8))))
    truth = replace(truth, shots=shots)
    friction = Friction(surface * rng.choice([0.75, 1.3]), cushion=0.15, ball_ball=0.05)
    free = list(COEFFICIENTS)
    if seed % 3 == 1:
        free.append("speed")
        shots = tuple(replace(one, speed=(one.speed or 0) * rng.uniform(0.93, 1.07))
                      for one in shots)  # fmt: skip
    guess = replace(truth, restitution=Restitution(0.92, cushion=0.75), friction=friction,
                    shots=shots)  # fmt: skip
    return guess, noisy(ends(truth), rng), free, NOISE if seed // 3 % 2 else None


def random_shot(k: int, places: Sequence[tuple[float, float]], rng: np.random.Generator) -> Shot:
    """Return a shot of the first ball anywhere, or so that it hits another one."""
    if rng.random() < 0.5:
        (x, y), (x0, y0) = places[int(rng.integers(1, len(places)))], places[0]
        thick = math.asin(min(1.0, 2 * RADIUS / math.hypot(x - x0, y - y0)))
        angle = math.degrees(math.atan2(y - y0, x - x0) + thick * rng.uniform(-0.9, 0.9))
    else:
        angle = rng.uniform(0, 360)
    return Shot(f"s{k}", "cue", speed=float(rng.uniform(1.0, 3.0)), angle=angle)


def test_a_number_at_its_bound() -> None:
    elastic = replace(TRUTH, restitution=Restitution(ball_ball=0.93, cushion=1.0))
    farther = [(k, id_, x, y - 0.1) for k, id_, x, y in ends(elastic) if k == 5]
    found = fit(GUESS, farther, "restitution.cushion", starts=1)
    assert any("ends at its bound, 1" in warning for warning in found.warnings)


def test_a_search_that_stopped_too_early_is_doubted() -> None:
    """From friction 0.15 it goes downhill to 0.1, by more than half a standard error."""
    rows = [Measurement(k, "C", 2.0 + NOISE * (-1.0) ** k, 0.0) for k in range(1, 11)]
    forecast = Forecast(sliding(0.15, shots=10), ("friction.surface",), rows, None)
    used = np.ones(10, dtype=bool)
    found = {}
    for mu in (0.15, 2.0 / (2.0 * 9.80665)):
        values = np.array([mu])
        sigma = 0.7 if mu == 0.15 else NOISE
        optimum = Optimum(forecast, values, used, sigma, True)
        found[mu] = [doubt for doubt in doubts(optimum) if "another order" in doubt]
    assert [len(said) for said in found.values()] == [1, 0]


def test_nothing_free_tells_how_far_off_a_scene_is() -> None:
    found = fit(TRUTH, [(5, "cue", 0.6, 0.6)], [])
    assert found.rms == found.rms_before > 0.0
    assert repr(found).startswith("<Fit to 1 places: nothing free")


def test_statistics_of_the_robust_loss() -> None:
    from scipy.integrate import quad

    def mean(of: Any) -> float:
        return float(
            quad(lambda x: of(x) * math.exp(-x * x / 2.0) / math.sqrt(2.0 * math.pi), -40, 40)[0]
        )

    c = robust.CAUCHY
    weight = mean(lambda x: 1.0 / (1.0 + (x / c) ** 2))
    psi_squared = mean(lambda x: (x / (1.0 + (x / c) ** 2)) ** 2)
    slope = mean(lambda x: (1.0 - (x / c) ** 2) / (1.0 + (x / c) ** 2) ** 2)
    constants = (robust.WEIGHT, robust.PSI_SQUARED, robust.PSI_SLOPE)
    assert constants == pytest.approx((weight, psi_squared, slope))
    assert slope**2 / psi_squared == pytest.approx(0.95, abs=1e-3)


def test_the_scale_forgets_blunders() -> None:
    errors = np.random.default_rng(0).normal(0.0, NOISE, 4000)
    assert robust_scale(errors, NOISE, 0) == pytest.approx(NOISE, rel=0.05)
    errors[:200] = 1.0
    assert robust_scale(errors, NOISE, 0) == pytest.approx(NOISE, rel=0.05)
    assert robust_scale(np.ones(3), 1e-9, 1) is None


def test_covariances_of_a_mean() -> None:
    errors = np.random.default_rng(0).normal(0.0, NOISE, 4000)
    (variance,) = covariances(np.ones((4000, 1)), errors, NOISE)[0]
    assert variance == pytest.approx(NOISE**2 / 4000.0, rel=0.1)
    assert blind_part(np.array([[1.0, -1.0]])) == pytest.approx(np.full((2, 2), 0.5))


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: must name the columns: shot, ball, x, y, t"),
        ("shot,ball,x,y\n", "measured: one measurement or more is needed"),
        ("shot,ball,x\n1,C,2\n", 'line 1 = ["shot", "ball", "x"]: has no column y'),
        ("shot,ball,x,y,tt\n", 'line 1 = "tt": there is no such column'),
        ("shot,ball,x,y\n9,C,2,3\n", 'line 2, shot = "9": there is no such shot'),
        ("shot,ball,x,y\n1,Z,2,3\n", 'line 2, ball = "Z": there is no such ball'),
        ("shot,ball,x,y\n1,C,nan,3\n", 'line 2, x = "nan": must be a finite number'),
        ("shot,ball,x,y\n1,C,1e999,3\n", 'line 2, x = "1e999": must be a finite number'),
        ("shot,ball,x,y\n1,C,,3\n", "line 2, x: is missing"),
        ("shot,ball,x,y\n1,C,5\n", "line 2, y: is missing"),
        ("shot,ball,x,y\n1,C,5,6,7\n", 'line 2, columns = ["7"]: there are too many'),
        ("shot,ball,x,y,t\n1,C,5,6,-1\n", 'line 2, t = "-1": must be 0 or more (s)'),
        ("shot,ball,x,y\n1,C,500,6\n", "line 2, x = 500.0: is off the table, 0 to 88 in"),
    ],
)
def test_a_bad_file_is_one_line_a_problem(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "m.csv"
    path.write_text(text)
    with pytest.raises(SceneError) as refused:
        read_measured(path, load("report"))
    assert len(refused.value.problems) == 1
    assert str(refused.value).startswith(f"{path}: {said}")


def test_a_file_is_read_in_the_units_of_the_scenario(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text(
        "\ufeffball, shot, t, y, x\nC,Simulation 2,,24.5,2\n8,4,0.25,9,10\n", encoding="utf-8"
    )
    first, second = read_measured(path, load("report"))
    assert first == Measurement(2, "C", 2 * 0.0254, 24.5 * 0.0254)
    assert (second.shot, second.ball, second.t) == (4, "8", 0.25)


def test_every_bad_row_is_named(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    path.write_text("shot,ball,x,y\n" + "7,Z,a,b\n" * 30)
    with pytest.raises(SceneError) as refused:
        read_measured(path, load("report"))
    lines = str(refused.value).splitlines()
    assert len(lines) == 50
    assert lines[5].startswith(f'{path}: line 3, ball = "Z"')


# -- the command -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_command_writes_a_scenario_that_fits(tmp_path: Path, capsys: Capture) -> None:
    scenario, measured, out = tmp_path / "guess.toml", tmp_path / "m.csv", tmp_path / "out"
    GUESS.to_toml(scenario)
    rows: Sequence[Any] = noisy(ends(TRUTH), np.random.default_rng(4))
    with measured.open("w", newline="") as file:
        csv.writer(file).writerows([("shot", "ball", "x", "y"), *rows])
    names = ",".join(FREE)
    code = exit_code(
        "fit", scenario, "--measured", measured, "--free", names, "--out", out, "--starts", 4,
        "--json", out / "fit.json",
    )  # fmt: skip
    assert code == 0
    said = capsys.readouterr().out
    assert "restitution.cushion" in said
    assert "Fitted to 9 places" in said
    fitted = load(out / "fitted.toml")
    record = json.loads((out / "fit.json").read_text())
    for name in FREE:
        assert input_value(fitted, name) == record["values"][name]
        assert record["standard_errors"][name] > 0.0
    with (out / "residuals.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(rows)
    assert float(table[0]["x"]) - float(table[0]["x_fitted"]) == pytest.approx(
        record["residuals"][0][0], abs=1e-8
    )
    assert (out / "residuals.png").stat().st_size > 10_000


def test_a_second_fit_does_not_replace_the_first(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Folders of its own are numbered, and one that is typed is refused unless --force is there."""
    monkeypatch.chdir(tmp_path)
    chosen = ("fit", "report", "--measured", "published", "--free", "speed.1", "--starts", 1)
    for name in ("fit", "fit-2", "fit-3"):
        assert exit_code(*chosen, "--no-pictures") == 0
        assert (tmp_path / "renders" / "report" / name / "fitted.toml").is_file()
    typed = (*chosen, "--no-pictures", "--out", "renders/report/fit")
    capsys.readouterr()
    assert "fit: has a fit already; replace it with --force" in refusal(capsys, *typed)
    assert exit_code(*typed, "--force") == 0


def test_progress_comes_to_what_is_planned() -> None:
    said: list[tuple[int, int]] = []
    rows = [(1, id_, *end) for id_, end in simulate(load("report"), 1).final.items()]
    fit(load("report"), rows, ["restitution.cushion"], starts=2, on_done=lambda *n: said.append(n))
    done, planned = zip(*said, strict=True)
    assert list(done) == sorted(done)
    assert done[-1] == planned[-1] > 60
    assert all(a <= b for a, b in said)


def test_without_scipy_one_sentence_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "scipy"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "scipy", None)
    code = exit_code("fit", "report", "--measured", "published", "--free", "speed.1")
    assert code == 2
    assert capsys.readouterr().err.splitlines() == [
        "error: fit needs SciPy: pip install 'pool-pymunk[fit]'"
    ]


@pytest.mark.slow
def test_a_stated_error_does_not_trap_the_search(tmp_path: Path) -> None:
    """Far from the answer all residuals are many stated errors, and none of them is a blunder."""
    shots = {
        "long": (3.0, 31.0), "cut": (2.2, 4.0), "bank": (2.6, -38.0),
        "lag": (2.0, 90.0), "soft": (1.0, 2.0), "thin": (1.8, 5.0),
    }  # fmt: skip
    mine = ROOT / "docs" / "figures" / "mine.toml"
    guess = replace(
        load(mine), shots=tuple(Shot(n, "cue", speed=v, angle=a) for n, (v, a) in shots.items())
    )
    table = replace(guess, restitution=Restitution(0.93, cushion=0.74),
                    friction=Friction(0.025, 0.17, 0.06))  # fmt: skip
    rng = np.random.default_rng(1)
    rows = [
        (run.name, ball, *rng.normal(end, NOISE).tolist())
        for run in simulate_all(table)
        for ball, end in run.final.items()
    ]
    found = fit(guess, rows, COEFFICIENTS, error=NOISE)
    assert found.sigma == NOISE
    for name, true in (("restitution.cushion", 0.74), ("friction.surface", 0.025)):
        assert found.errors_off(name, true) < 4.0
