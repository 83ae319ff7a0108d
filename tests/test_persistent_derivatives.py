"""Derivatives go through persistent contacts, and agree with differences of their reference."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from oracle.press_reference import press_run
from oracle.reference import Refused
from press_scenes import M, R, press_scene
from scenes import seeds

from pool_pymunk import (
    Ball,
    Derivatives,
    Friction,
    Physics,
    Restitution,
    Run,
    Scene,
    SceneError,
    Table,
)
from pool_pymunk.model import Point
from pool_pymunk.model.inputs import input_value, with_inputs
from pool_pymunk.solvers.request import request

DEAD = Restitution(0.0, cushion=0.0)
STEP = 2e-6  # of each input, times its slope
# of the largest derivative along a direction; what remains of a slip that fades is 3e-7 of it
WRONG = 1e-5
NEAR = 1e-5  # Differences of two steps that differ by more have a kink near.
SOME = 40  # scenes; a contact persists in about half of them

Slopes = Mapping[str, float]


def ball(
    k: int, place: Point, velocity: Point = (0.0, 0.0), roll: float = 0.0, m: float = M
) -> Ball:
    return Ball(str(k), place, R, m, velocity=velocity, roll=roll)


def play(scene: Scene) -> Run:
    """Play a scene exactly, without measuring what its policies change."""
    asked = request(scene, "event-driven")
    return asked._replace(settings=asked.settings._replace(measures_policies=False)).play(None)


def random_slopes(scene: Scene, found: Derivatives, known_only: bool = False) -> Slopes:
    """Return a random direction of inputs; those at a bound stay, and so do resting balls."""
    rng, slopes = random.Random(0), dict[str, float]()
    resting = {b.id for b in scene.balls if b.velocity == (0.0, 0.0)}
    unknown = np.asarray(np.isnan(found.final).any(axis=(0, 1)))
    for name, is_unknown in zip(found.names, unknown, strict=True):
        kind, _, key = name.partition(".")
        if kind in ("speed", "angle", "roll") or (kind in ("vx", "vy") and key in resting):
            continue
        value = input_value(scene, name)
        if (kind in ("restitution", "friction") and value == 0.0) or (is_unknown and known_only):
            continue
        scale = value if kind in ("mass", "radius", "friction") else 1.0
        slopes[name] = scale * rng.uniform(-1.0, 1.0)
    return slopes


def varied(scene: Scene, slopes: Slopes, step: float) -> Scene:
    values = {name: input_value(scene, name) + step * slope for name, slope in slopes.items()}
    return with_inputs(scene, values)


def differences(scene: Scene, slopes: Slopes, step: float = STEP) -> np.ndarray:
    """Return the derivatives of the reference's ends (N, 2), and at last of its duration."""
    ends = []
    for side in (1.0, -1.0):
        run = press_run(varied(scene, slopes, side * step))
        ends.append(np.array([*((p.real, p.imag) for p in run.final), (run.duration, 0.0)]))
    return np.asarray((ends[0] - ends[1]) / (2.0 * step))


def along(found: Derivatives, slopes: Slopes) -> np.ndarray:
    chosen = [found.names.index(name) for name in slopes]
    return np.asarray(found.final[:, :, chosen] @ np.array([*slopes.values()]))


PAIR = Scene(
    (ball(0, (0.0, 0.0), (1.0, 0.05), 1.0), ball(1, (0.1, 0.01), m=0.2)),
    None,
    DEAD,
    Friction(0.2, rolling=0.02),
)
DISCS = Scene(
    (ball(0, (0.0, 0.0), (0.9, 0.03)), ball(1, (0.0672, 0.02))),
    None,
    DEAD,
    Friction(0.2, ball_ball=0.1),
)
CUSHION = Scene(
    (ball(0, (0.5, 0.1), (0.7, -0.5), 1.0),),
    Table.rectangle(6, 2),
    DEAD,
    Friction(0.2, 0.1, rolling=0.03),
)
ARC = Scene(
    (ball(0, (1.2, 0.2), (0.97, -0.03), 1.0),),
    Table.circle(0.8),
    DEAD,
    Friction(0.2, 0.2, rolling=0.02),
)
TRIANGLE = Scene(
    (
        ball(0, (0.0, 0.0), (0.9, 0.03), 1.0),
        ball(1, (0.0672, 0.0292), m=0.18),
        ball(2, (0.0672, -0.0292), m=0.2),
    ),
    None,
    DEAD,
    Friction(0.2, rolling=0.05),
)
SCENES = {
    "a ball rolls into another one and pushes it": PAIR,
    "a disc pushes another one aside": DISCS,
    "a roll presses a ball on to a cushion": CUSHION,
    "a ball rolls along an arc": ARC,
    "a triangle": TRIANGLE,
}


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_all_inputs_at_once(scene: Scene) -> None:
    run = play(scene)
    found = run.derivatives("all")
    slopes = random_slopes(scene, found)
    assert run.persistent and found.warnings == ()
    expected = differences(scene, slopes)
    size = np.abs(expected).max()
    assert np.abs(along(found, slopes) - expected[:-1]).max() < WRONG * size
    last = found.times[-1] @ [slopes.get(name, 0.0) for name in found.names]
    assert run.events[-1].kind == "stop" and abs(last - expected[-1, 0]) < WRONG * size


def test_along_an_arc_from_the_start() -> None:
    """What moves the ball off the arc has none; a turn of its velocity has one."""
    balls = (ball(0, (0.0, R - 0.8), (0.6, 0.0), 1.0),)
    table = Table(((-0.8, 0.0), (0.8, 0.0)), bulge=(1.0, 1.0))
    scene = Scene(balls, table, DEAD, Friction(0.2, 0.2, rolling=0.02))
    found = play(scene).derivatives(["y.0", "vx.0", "friction.cushion", "friction.rolling"])
    assert np.isnan(found.final[..., 0]).all() and "touch at the start" in found.warnings[0]
    slopes = {"vx.0": 0.7, "friction.cushion": -0.2, "friction.rolling": 0.01}
    expected = differences(scene, slopes)[:-1]
    assert np.abs(along(found, slopes) - expected).max() < WRONG * np.abs(expected).max()


def test_a_ball_that_rolls_into_two_that_touch() -> None:
    """The hits of that instant have derivatives by what does not open the gap."""
    angle = 0.2
    far = (0.1 + 2 * R * np.cos(angle), 0.01 + 2 * R * np.sin(angle))
    balls = (ball(0, (0.0, 0.0), (0.9, 0.05), 1.0), ball(1, (0.1, 0.01)), ball(2, far, m=0.25))
    scene = Scene(balls, None, DEAD, Friction(0.2, rolling=0.03))
    found = play(scene).derivatives("all")
    slopes = random_slopes(scene, found, known_only=True)
    assert slopes.keys() >= {"x.0", "y.0", "vx.0", "mass.2", "friction.surface"}
    assert slopes.keys().isdisjoint({"x.1", "y.2"})
    assert "one instant share a ball" in found.warnings[0]
    expected = differences(scene, slopes)[:-1]
    assert np.abs(along(found, slopes) - expected).max() < WRONG * np.abs(expected).max()


def test_at_a_time_within_the_contact() -> None:
    """They are those of the end of a run that is cut there, by the same inputs."""
    whole = play(PAIR)
    [contact] = whole.persistent
    t = contact.since + 0.4 * (contact.until - contact.since)
    found = whole.derivatives()
    cut = play(replace(PAIR, physics=Physics(max_time=t))).derivatives()
    for k, ball_ in enumerate(PAIR.balls):
        assert np.abs(found.at([t], ball_.id)[0] - cut.final[k]).max() < 1e-6
    beside = found.at([t - 1e-4, t, t + 1e-4], "0")
    assert np.abs(beside[0] - 2.0 * beside[1] + beside[2]).max() < 1e-5


def test_two_slips_that_fade_at_once_are_a_kink() -> None:
    """Slips of equal balls fade together; by other masses one of them fades first."""
    near, far = PAIR.balls
    equal = replace(PAIR, balls=(near, replace(far, mass=near.mass)))
    found = play(equal).derivatives("all")
    kinks = {n for n, end in zip(found.names, found.final[0, 0], strict=True) if np.isnan(end)}
    assert {"mass.0", "mass.1"} <= kinks and kinks.isdisjoint({"x.0", "vx.0", "friction.rolling"})
    assert "change twice at one instant" in found.warnings[0]
    slopes = random_slopes(equal, found, known_only=True)
    expected = differences(equal, slopes)[:-1]
    assert np.abs(along(found, slopes) - expected).max() < WRONG * np.abs(expected).max()
    ends = [press_run(varied(equal, {"mass.0": 1.0}, step)).final[0] for step in (-STEP, 0.0, STEP)]
    first, second = (after - before for before, after in pairwise(ends))
    assert abs(second - first) > 0.01 * abs(first)


def test_a_loaded_run_has_none(tmp_path: Path) -> None:
    run = play(PAIR)
    run.save(tmp_path / "run.npz")
    found = Run.load(tmp_path / "run.npz").derivatives("position")
    assert np.isnan(found.final).all() and "persistent" in found.warnings[0]


@pytest.mark.slow
@pytest.mark.seeded
def test_random_scenes() -> None:
    """Most derivatives are numbers, and all numbers are right."""
    far, shares, compared = [], [], 0
    for seed in seeds(SOME, 12):
        try:
            scene = press_scene(seed)
        except SceneError:
            continue
        run = play(scene)
        if not run.persistent:
            continue
        found = run.derivatives("all")
        shares.append(float(np.isfinite(found.final).mean()))
        slopes = random_slopes(scene, found, known_only=True)
        try:
            one, other = (differences(scene, slopes, step)[:-1] for step in (STEP, 3.0 * STEP))
        except (Refused, SceneError, ArithmeticError):
            continue
        size = max(np.abs(one).max(), 1e-3)
        if not slopes or np.abs(one - other).max() > NEAR * size:
            continue
        compared += 1
        if np.abs(along(found, slopes) - one).max() > 10.0 * WRONG * size:
            far.append(seed)
    assert not far
    assert np.mean(shares) > 0.5 and compared > len(shares) / 3
