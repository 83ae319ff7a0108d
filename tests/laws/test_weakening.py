"""The law `weakening` is one class in physics/laws.py, and everything knows it from there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Scene,
    load,
    loads,
    simulate,
    simulate_many,
)
from pool_pymunk.report.listing import modelled
from tests.shared.shots import (
    check_derivatives,
    some_scene,
)

NAME, R = "weakening", 0.05


def scene_of(kind: str, seed: int) -> Scene:
    """Return a random scene of this law, whose balls rub much."""
    scene = some_scene(kind, seed)
    friction = replace(scene.friction, ball_ball=0.3)
    return replace(scene, friction=friction, physics=replace(scene.physics, law=NAME))


def test_contacts_of_one_instant_take_the_mean_over_their_orders() -> None:
    """A ball that comes between two others moves on along its line, as by any symmetric answer."""
    balls = (
        Ball("a", (0.0, 0.0), R, 0.2, velocity=(2.0, 0.0)),
        Ball("b", (0.3 + R * math.sqrt(3.0), R), R, 0.2),
        Ball("c", (0.3 + R * math.sqrt(3.0), -R), R, 0.2),
    )
    scene = Scene(balls, None, Restitution(0.9), Friction(0.2, 0.0, 0.3), Physics(law=NAME))
    run = simulate(scene, solver="event-driven")
    assert run.final["a"][1] == pytest.approx(0.0, abs=1e-12)
    assert run.final["b"][1] == pytest.approx(-run.final["c"][1], abs=1e-12)
    assert run.final["b"][1] > 2.0 * R


# -- names -----------------------------------------------------------------------------------------


def test_files_name_it_and_say_that_energy_does_not_grow() -> None:
    scene = loads(scene_of("rectangle", 1).to_toml())
    assert scene.physics.law == NAME
    assert any(f"law {NAME}" in line for line in modelled(scene))
    assert not any("gain energy" in line for line in modelled(scene))
    worse = replace(scene, physics=replace(scene.physics, law="published"))
    assert any("gain energy" in line for line in modelled(worse))


def test_energy_never_grows_in_runs() -> None:
    for seed in range(5):
        run = simulate(scene_of("rectangle", seed), solver="event-driven")
        energy = run.energy_at(np.linspace(0.0, run.duration, 200))
        assert np.diff(energy).max() <= 1e-12 * energy[0]


# -- derivatives -----------------------------------------------------------------------------------


INPUTS = {"speed": 2.0, "friction.ball_ball": 0.3, "restitution.ball_ball": 0.8}


def test_derivatives_are_those_of_differences() -> None:
    """They go through a hit that slips on, where the slip moves the friction."""
    scene, h = replace(load("two-balls"), friction=Friction(0.2, 0.1, 0.3)), 1e-6
    start = {name: np.full(2 * len(INPUTS) + 1, value) for name, value in INPUTS.items()}
    for k, name in enumerate(INPUTS):
        start[name][2 * k + 1 : 2 * k + 3] += h, -h
    batch = simulate_many(scene, vary=start, law=NAME, derivatives=list(INPUTS))
    found = batch.run(0).derivatives(list(INPUTS)).final
    for k in range(len(INPUTS)):
        moved = (batch.final[2 * k + 1] - batch.final[2 * k + 2]) / (2.0 * h)
        np.testing.assert_allclose(found[:, :, k], moved, rtol=0.0, atol=1e-7)
    check_derivatives(batch, [0])
