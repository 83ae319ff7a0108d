"""Derivatives of many shots are those of each shot's run, and missing where that has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    NT,
    Ball,
    Friction,
    Law,
    Pair,
    Restitution,
    Scene,
    Table,
    load,
    simulate,
)
from pool_pymunk import simulate_many as play
from pool_pymunk.many import play as plays
from tests.shared.kinks import BESIDE, KINKS, L_SHAPED
from tests.shared.scenes import frozen_rack, seeds
from tests.shared.shots import KINDS, ROLLING, shots_of, some_scene
from tests.shared.shots import check_derivatives as check


def compare(kind: str, seed: int, count: int) -> None:
    """Compare the derivatives of some shots of a random scene by all inputs."""
    scene, rng = some_scene(kind, seed), np.random.default_rng(seed)
    vary: dict[str, Any] = {}
    if seed % 2:
        vary = {"mass": rng.uniform(0.1, 0.3, (count, len(scene.balls))),
                "friction.ball_ball": rng.uniform(0.0, 0.3, count),
                "friction.cushion": rng.uniform(0.0, 0.3, count),
                "restitution.ball_ball": rng.uniform(0.6, 1.0, count)}  # fmt: skip
        if not kind.startswith("no friction"):
            vary["friction.surface"] = rng.uniform(0.05, 0.3, count)
            if kind in ROLLING:
                vary["friction.rolling"] = rng.uniform(0.001, 0.05, count)
    batch = play(scene, *shots_of(scene, count, seed), vary=vary, derivatives="all")
    check(batch, range(count))


@pytest.mark.parametrize("kind", [*KINDS, *ROLLING])
def test_some_random_shots_have_the_derivatives_of_their_runs(kind: str) -> None:
    for seed in range(2):
        compare(kind, seed, 1)


@pytest.mark.slow
@pytest.mark.seeded
@pytest.mark.parametrize("kind", [*KINDS, *ROLLING])
def test_two_thousand_random_shots_have_the_derivatives_of_their_runs(kind: str) -> None:
    for seed in seeds(10, 3) if kind.startswith(("crowd", "hard")) else seeds(90):
        compare(kind, seed, 3)


@pytest.mark.parametrize("share", [-1.5, 0.0, 0.3, 1.0])
def test_follow_and_draw_have_the_derivatives_of_their_runs(share: float) -> None:
    scene = load("follow-and-draw")
    vary = {"roll": [share], "angle": [1.0], "speed": [1.5]}
    batch = play(scene, vary=vary, derivatives="all")
    assert {"roll", "friction.rolling", "speed", "mass.cue"} <= set(batch.by)
    check(batch, [0])


def test_rolls_that_are_vectors_have_the_derivatives_of_their_runs() -> None:
    """Such a roll does not change with the ball's velocity; one that is its share does."""
    scene = load("follow-and-draw")
    velocity = np.tile([ball.velocity for ball in scene.balls], (2, 1, 1)).astype(float)
    velocity[:, 0], roll = (1.0, 0.2), np.zeros_like(velocity)
    roll[0, 0], roll[1, 0] = (0.5, 0.1), (0.3, -0.4)
    roll[1, 1] = (0.0, 0.7)
    batch = play(scene, velocity=velocity, roll=roll, derivatives="all")
    check(batch, [0, 1])


# -- kinks -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("off", [-BESIDE, 0.0, BESIDE])
@pytest.mark.parametrize("kind", KINKS)
def test_what_is_missing_at_a_kink_is_so_in_the_run(
    kind: Callable[[float], Scene], off: float
) -> None:
    check(play(kind(off), derivatives="all"), [0])


@pytest.mark.parametrize("off", [0.0, BESIDE])
@pytest.mark.parametrize("kind", KINKS)
def test_what_is_missing_where_balls_roll_is_so_in_the_run(
    kind: Callable[[float], Scene], off: float
) -> None:
    scene = kind(off)
    friction = replace(scene.friction, rolling=scene.friction.surface / 5.0)
    limit = replace(scene.physics, max_time=scene.physics.max_time or 2.0)
    check(play(replace(scene, friction=friction, physics=limit), derivatives="all"), [0])


def drawn(off: float, bulge: float) -> tuple[Scene, Any, Any]:
    """Return a ball whose roll turns it round just where it touches a cushion, and its motion.

    While it slips, its path is a parabola, whose apex touches the cushion in its middle. An arc is
    lower there than a straight cushion, or higher.
    """
    pull, down, low = 0.1 * 9.80665, 0.5, -bulge
    apex = 1.0, low + 0.05 + off
    start = apex[0] - down / pull, apex[1] + down * down / (2.0 * pull)
    ball = Ball("a", start, 0.05, 0.2)
    table = Table(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)), (bulge, 0.0, 0.0, 0.0))
    scene = Scene((ball,), table, Restitution(cushion=0.8), Friction(0.1, 0.1, rolling=0.02))
    return scene, [[(1.0, -down)]], [[(1.0, 1.5)]]


@pytest.mark.parametrize("off", [-BESIDE, 0.0, BESIDE])
@pytest.mark.parametrize("bulge", [0.0, -0.2, 0.2])
def test_a_parabola_that_touches_a_cushion_has_none(off: float, bulge: float) -> None:
    scene, velocity, roll = drawn(off, bulge)
    batch = play(scene, velocity=velocity, roll=roll, max_time=0.7, derivatives="all")
    check(batch, [0])
    assert batch.derivatives is not None
    assert np.isnan(batch.derivatives[0, 0, :, batch.by.index("y.a")]).all() == (off == 0.0)


@pytest.mark.parametrize("gap", [0.0, 1e-4])
def test_a_rack_has_those_of_its_run(gap: float) -> None:
    check(play(frozen_rack(gap), derivatives=["speed", "angle", "y.C"]), [0])


@pytest.mark.parametrize("off", [0.0, 1e-4])
def test_a_ball_that_meets_the_beginning_of_a_corner_has_those_of_its_run(off: float) -> None:
    ball = Ball("a", (0.7 - off, 0.35), 0.05, 0.2, velocity=(1.0, 2.0))
    scene = Scene((ball,), L_SHAPED, Restitution(cushion=0.8), Friction(0.1, 0.1))
    check(play(scene, derivatives="all"), [0])


def test_a_struck_ball_that_is_off_the_table_has_no_speed() -> None:
    """It has a velocity in the array, which means nothing."""
    scene = load("report")
    position = np.tile([ball.position for ball in scene.balls], (2, 1, 1))
    position[1, scene.index["C"]] = np.nan
    velocity = np.zeros((2, 11, 2))
    velocity[:, scene.index["C"]] = (2.0, 0.3)
    velocity[:, scene.index["8"]] = (-1.0, 1.0)
    check(play(scene, position, velocity, derivatives=["speed", "angle", "x.C"]), [0, 1])


def plastic(vy: float) -> Scene:
    """Return two balls that do not bounce off each other."""
    balls = Ball("a", (0.0, 0.0), 0.05, 0.2, velocity=(2.0, vy)), Ball("b", (0.5, 0.02), 0.05, 0.2)
    return Scene(balls, None, Restitution(0.0), Friction(0.1, 0.0, 0.1))


@pytest.mark.parametrize("vy", [0.0, 0.1, -0.2])
def test_balls_that_do_not_bounce_have_those_of_their_run(vy: float) -> None:
    check(play(plastic(vy), derivatives="all"), [0])


@pytest.mark.parametrize("max_time", [0.3, 1.0])
def test_shots_that_are_cut_off_have_those_of_their_run(max_time: float) -> None:
    scene = load("report")
    angle = np.linspace(0.0, 350.0, 12)
    batch = play(scene, vary={"angle": angle, "speed": np.full(12, 3.0)}, max_time=max_time,
                 derivatives=["position", "speed"])  # fmt: skip
    assert batch.derivatives is not None and batch.derivatives.shape == (12, 11, 2, 23)
    check(batch, range(12))


def test_a_shot_that_is_cut_off_just_at_a_hit_has_those_of_its_run() -> None:
    scene = plastic(0.1)
    hit = simulate(scene, solver="event-driven").events[0]
    assert hit.is_contact
    check(play(scene, max_time=hit.t, derivatives="all"), [0])


# -- what is asked for -----------------------------------------------------------------------------


def test_without_derivatives_there_are_none() -> None:
    batch = play(load("two-balls"), max_time=1.0)
    assert (batch.derivatives, batch.by) == (None, ())
    assert "derivatives" not in repr(batch)


def test_ends_do_not_depend_on_derivatives() -> None:
    for scene in (load("report"), frozen_rack(0.0), some_scene("rack", 3)):
        shots = shots_of(scene, 30, 1)
        plain, derived = play(scene, *shots), play(scene, *shots, derivatives="angle")
        for name in ("final", "duration", "hits", "status", "in_doubt", "handed_back", "met"):
            np.testing.assert_array_equal(getattr(plain, name), getattr(derived, name))
        assert plain.by_reference == derived.by_reference


def test_many_chunks_have_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load("report")
    vary = {"angle": np.linspace(150.0, 210.0, 50), "speed": np.full(50, 4.0)}
    usual = play(scene, vary=vary, derivatives=["angle", "speed"])
    monkeypatch.setattr(plays, "FEWEST", 7)
    other = play(scene, vary=vary, derivatives=["angle", "speed"])
    np.testing.assert_array_equal(usual.derivatives, other.derivatives)


def test_a_shot_that_cannot_start_has_none() -> None:
    scene = load("two-balls")
    position = np.tile([ball.position for ball in scene.balls], (2, 1, 1))
    position[1, 0] = position[1, 1]
    batch = play(scene, position, max_time=1.0, derivatives="position")
    assert batch.derivatives is not None
    assert np.isnan(batch.derivatives[1]).all() and np.isfinite(batch.derivatives[0]).all()


def test_a_shot_whose_coefficients_make_no_scene_has_none() -> None:
    vary = {"friction.rolling": [0.01, 0.9], "speed": [1.5, 1.5]}
    batch = play(load("follow-and-draw"), vary=vary, derivatives="speed")
    assert batch.derivatives is not None and batch.ended.tolist() == [True, False]
    assert np.isnan(batch.derivatives[1]).all() and np.isfinite(batch.derivatives[0]).all()


def test_laws_of_ones_own_have_those_of_their_run() -> None:
    class Smooth(Law):
        def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
            return super().ball_ball(a, b, pair._replace(friction=0.0))

    speed = {"speed": np.array([1.0, 2.0, 3.0])}
    batch = play(load("report"), vary=speed, law=Smooth(), derivatives=["speed", "angle", "mass"])
    check(batch, range(3))


def test_a_struck_ball_is_known_in_each_run() -> None:
    """Its derivatives are the differences of shots that are a little faster."""
    scene, h = load("report"), 1e-7
    batch = play(scene, vary={"speed": [2.0, 2.0 + h], "angle": [100.0] * 2}, derivatives="speed")
    moved = (batch.final[1] - batch.final[0]) / h
    assert batch.derivatives is not None
    np.testing.assert_allclose(batch.derivatives[0, :, :, 0], moved, atol=1e-4)
    assert batch.run(0).struck == "C"


def test_no_shots_have_no_derivatives() -> None:
    batch = play(load("two-balls"), np.empty((0, 2, 2)), max_time=1.0, derivatives="position")
    assert batch.derivatives is not None and batch.derivatives.shape == (0, 2, 2, 4)
