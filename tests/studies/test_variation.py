"""Every input has random numbers of its own, and they are the same in every study."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Scene, Uncertainty, load, sensitivity, simulate_many
from pool_pymunk.page.live import answers
from pool_pymunk.page.live.answers import Answers
from pool_pymunk.studies import variation
from pool_pymunk.studies.find import _ShotSearch
from pool_pymunk.studies.sweep.plan import as_begun, make_plan
from pool_pymunk.studies.variation import (
    Between,
    Distribution,
    Grid,
    Normal,
    Uniform,
    Variation,
    numbers,
    uniforms,
)

REPORT = load("report")
SEED, SHOTS = 11, 40
# A ball that nothing meets in the first shot of the report ends where it starts.
REST = "4"
NAMES = ["turn", "speed", "x.8", f"y.{REST}", "mass.C", "restitution.cushion"]


def errors_of_sensitivity(names: list[str]) -> dict[str, Any]:
    """Return where samples start, and the other numbers with which they are played."""
    from pool_pymunk.studies.sensitivity import read_study

    study = read_study(REPORT, REPORT.shots[0], Uncertainty(inputs=dict.fromkeys(names, 1e-3)))
    errors, _ = study.draw(SHOTS, SEED)
    return {name: errors[name if name in errors else f"{name}.1"] for name in names}


def values_of_sweep(names: list[str]) -> dict[str, Any]:
    vary = dict.fromkeys(names, (0.5, 0.6))
    plan = make_plan(as_begun(REPORT, 1, None), vary, None, SHOTS, SEED, SHOTS)
    found = plan.draw(range(SHOTS)).columns
    columns = {name: name.replace(".", "_") for name in names}
    return {
        name: found.get(column, found.get(f"start_{column}")) for name, column in columns.items()
    }


def values_of_batch(names: list[str]) -> dict[str, Any]:
    drawn = Variation(REPORT, dict.fromkeys(names, Normal(1e-3)), 1).draw(SHOTS, SEED)
    batch = simulate_many(REPORT, shot=1, vary=drawn)
    rest = REPORT.index[REST]
    assert batch.source is not None
    assert (batch.final[:, rest, 1] == batch.source.position[:, rest, 1]).all()
    return drawn | {f"y.{REST}": batch.final[:, rest, 1]} if f"y.{REST}" in names else drawn


def errors_of_find(names: list[str]) -> dict[str, Any]:
    search = _ShotSearch(REPORT, REPORT.shots[0], len, SEED, None)
    others = [name for name in names if name not in ("turn", "speed")]
    search.read_player(1e-3, 1e-3, dict.fromkeys(others, 1e-3))
    return {name: numbers(search.player, SHOTS, SEED)[name] for name in names}


STUDIES = [errors_of_sensitivity, values_of_sweep, values_of_batch, errors_of_find]


@pytest.mark.parametrize("drawn", STUDIES)
def test_another_input_leaves_the_draws_of_the_others(drawn: Any) -> None:
    alone, all_ = {name: drawn([name])[name] for name in NAMES}, drawn(NAMES)
    for name in NAMES:
        np.testing.assert_array_equal(alone[name], all_[name])
    turned = drawn(NAMES[::-1])
    assert all((turned[name] == all_[name]).all() for name in NAMES)


def shares(name: str) -> Any:
    return uniforms(SEED, name, range(SHOTS))


@pytest.mark.parametrize("name", NAMES)
def test_an_input_has_the_same_numbers_in_every_study(name: str) -> None:
    numbers = shares(name)
    uniform, normal = 1e-3 * (2.0 * numbers - 1.0), Normal(1e-3).at(numbers)
    found = errors_of_sensitivity(NAMES)[name]
    np.testing.assert_allclose(found, uniform, atol=1e-15)
    np.testing.assert_allclose(values_of_sweep(NAMES)[name], 0.5 + 0.1 * numbers, rtol=1e-15)
    np.testing.assert_array_equal(errors_of_find(NAMES)[name], normal)
    own = Variation(REPORT, {}, 1).own(name)
    np.testing.assert_allclose(values_of_batch(NAMES)[name], own + normal, rtol=1e-15)


def test_the_player_of_the_live_table_errs_by_the_same_numbers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[Any] = []

    def watched(scene: Scene, position: Any, velocity: Any, **how: Any) -> Any:
        seen.append(velocity[:, scene.index["C"]])
        return simulate_many(scene, position, velocity, **how)

    monkeypatch.setattr(variation, "simulate_many", watched)
    monkeypatch.setattr(answers, "SAMPLES", SHOTS)
    state = REPORT.start(None)
    asked = {"position": state.position, "velocity": state.velocity, "ball": "C", "speed": 2.0,
             "angle": 30.0, "angle_error": 0.5, "speed_error": 0.01}  # fmt: skip
    assert Answers(REPORT).to("cloud", json.dumps(asked).encode()).status == 200
    vx, vy = np.concatenate(seen).T
    turn, speed = (Normal(1.0).at(uniforms(0, name, range(SHOTS))) for name in ("turn", "speed"))
    np.testing.assert_allclose(np.degrees(np.arctan2(vy, vx)), 30.0 + 0.5 * turn, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(vx, vy), 2.0 + 0.02 * speed, rtol=1e-12)


def test_inputs_shots_and_seeds_have_numbers_of_their_own() -> None:
    count = 20_000
    names = ["x.1", "x.11", "y.1", "speed", "speed.2", "turn", "noise.speed", "mass.C"]
    found = np.array([uniforms(0, name, range(count)) for name in names])
    found = np.vstack([found, uniforms(1, "x.1", range(count))])
    off = np.abs(np.corrcoef(found) - np.eye(len(found)))
    assert off.max() < 5.0 / math.sqrt(count)
    assert (uniforms(0, "speed.1", range(9)) == uniforms(0, "speed", range(9))).all()


@pytest.mark.parametrize("first", [0, 1, 3, 4, 1 << 40])
def test_a_shots_number_does_not_depend_on_what_is_drawn_beside_it(first: int) -> None:
    some = uniforms(2, "turn", range(first, first + 30))
    for k in (0, 7, 29):
        assert some[k] == uniforms(2, "turn", range(first + k, first + k + 1))[0]


@pytest.mark.parametrize(
    ("its", "mean", "deviation", "kurtosis"),
    [
        (Normal(0.3), 0.0, 0.3, 3.0),
        (Uniform(0.3), 0.0, 0.3 / math.sqrt(3.0), 1.8),
        (Between(2.0, 2.6), 2.3, 0.3 / math.sqrt(3.0), 1.8),
    ],
)
def test_moments_of_the_distributions(
    its: Normal | Uniform | Between, mean: float, deviation: float, kurtosis: float
) -> None:
    """Each lies within five of its standard errors."""
    count = 200_000
    drawn = its.at(uniforms(3, "x.1", range(count)))
    scaled = (drawn - mean) / deviation
    assert abs(scaled.mean()) < 5.0 / math.sqrt(count)
    assert abs((scaled**2).mean() - 1.0) < 5.0 * math.sqrt((kurtosis - 1.0) / count)
    assert abs((scaled**3).mean()) < 5.0 * math.sqrt(15.0 / count)
    assert abs((scaled**4).mean() - kurtosis) < 5.0 * math.sqrt(96.0 / count)
    assert np.isfinite(its.at(np.array([0.0, 1.0 - 2.0**-53]))).all()


def test_grids_are_combined_beside_what_is_drawn() -> None:
    both: dict[str, Distribution] = {
        "speed": Grid(1.0, 2.0, 2),
        "x.8": Uniform(0.1),
        "turn": Grid(0.0, 2.0, 3),
    }
    drawn = numbers(both, 6)
    assert drawn["speed"].tolist() == [1.0] * 3 + [2.0] * 3
    assert drawn["turn"].tolist() == [0.0, 1.0, 2.0] * 2
    np.testing.assert_array_equal(numbers(both, range(4, 6))["x.8"], drawn["x.8"][4:])


def test_values_lie_within_the_limits() -> None:
    wide = Variation(REPORT, {"restitution.cushion": Normal(9.0), "mass.C": Normal(9.0)}).draw(200)
    assert {0.0, 1.0} <= set(wide["restitution.cushion"].tolist())
    assert wide["mass.C"].min() > 0.0


def test_the_scenes_own_numbers_are_those_of_the_shot() -> None:
    for k, shot in enumerate(REPORT.shots, start=1):
        begun = Variation(REPORT, {}, k)
        vx, vy = begun.start.velocity[REPORT.index[shot.ball]]
        assert begun.own("speed") == math.hypot(vx, vy)
        assert begun.own("angle") == math.degrees(math.atan2(vy, vx))
        assert begun.own("vx.C") == vx and begun.own("turn") == 0.0
    assert begun.own("mass.C") == REPORT.balls[0].mass


def test_a_seed_decides_the_samples_of_a_ball_in_a_frozen_rack() -> None:
    """Balls that overlap are moved apart, and so others move; what is drawn stays."""
    scene = load("eight-ball")
    one, other = (
        sensitivity(scene, 1, Uncertainty(1e-5, angle=turn), 20, seed=5) for turn in (0.0, 1e-3)
    )
    np.testing.assert_array_equal(one.starts, other.starts)


def test_a_player_who_errs_by_more_than_the_speed_does_not_strike_the_other_way() -> None:
    varied = Variation(REPORT, {}, 1)
    errors = {"noise.speed": np.array([-9.0, 0.0, 0.5]), "noise.angle": np.zeros(3)}
    begun = varied.begin(varied.places(3), {"speed": np.full(3, 2.0), **errors})
    speeds = np.hypot(*begun.velocity[:, varied.ball].T)
    np.testing.assert_allclose(speeds, [0.0, 2.0, 2.5], atol=1e-15)
