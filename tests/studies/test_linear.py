"""The linear sensitivity agrees with samples, as far as it says that it holds."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pool_pymunk import Scene, Shot, Uncertainty, load, sensitivity
from pool_pymunk.studies.sensitivity import ellipse, linear
from tests.shared.commands import exit_code

INCH = 0.0254
ERRORS = Uncertainty(0.005 * INCH, speed=0.01, angle=0.001)


def assert_agree(scene: Scene, shot: int, errors: Uncertainty, aims_anew: bool = False) -> None:
    """Where the derivatives hold, samples spread as they say."""
    found = linear(scene, shot, errors, aims_anew=aims_anew)
    assert found.holds > 0.0
    within = errors.scaled(min(found.holds, 1.0) / 2.0)
    played = sensitivity(scene, shot, within, 4000, aims_anew=aims_anew)
    sampled = np.array([ball.std for ball in played.balls])
    said = linear(scene, shot, within, aims_anew=aims_anew).std
    assert np.allclose(sampled, said, rtol=0.08, atol=0.02 * said.max())


@pytest.mark.parametrize("shot", [1, 2, 3])
def test_samples_spread_as_the_derivatives_say(shot: int) -> None:
    assert_agree(load("report"), shot, ERRORS)


@pytest.mark.parametrize("anew", [False, True])
def test_a_shot_is_aimed_once_or_at_where_the_ball_is(anew: bool) -> None:
    aimed = Shot("aimed", "C", speed=2.0, aim="6")
    scene = replace(load("report"), shots=(aimed,))
    assert_agree(scene, 1, Uncertainty(1e-4), anew)
    velocity = scene.start(aimed).velocity[scene.index[aimed.ball]]
    held = replace(scene, shots=(Shot("held", aimed.ball, velocity=velocity),))
    own = linear(scene, 1, Uncertainty(1e-4), aims_anew=anew).std
    turned = np.abs(own - linear(held, 1, Uncertainty(1e-4)).std).max()
    assert turned > 1e-4 if anew else turned == 0.0


def test_a_chain_of_shots_is_differentiated_through() -> None:
    scene = load("report")
    first, second, *rest = scene.shots
    scene = replace(scene, shots=(first, replace(second, from_previous=True), *rest))
    assert_agree(scene, 2, Uncertainty(1e-5 * INCH, speed=1e-5, angle=1e-6))


def test_where_derivatives_are_not_known_nothing_is_said() -> None:
    found = linear(load("report"), 4, ERRORS)
    assert math.isnan(found.holds) and np.isnan(found.std).any()
    assert "jumps or has a kink" in found.warnings[0]


def test_an_ellipse_has_its_share_of_a_normal_distribution() -> None:
    covariance = np.array([[2.0, 0.7], [0.7, 0.5]])
    points = np.random.default_rng(0).multivariate_normal((0, 0), covariance, 20_000)
    inverse = np.linalg.inv(covariance)
    outline = ellipse(covariance)
    level = np.einsum("pi,ij,pj->p", outline, inverse, outline)
    assert np.allclose(level, level[0])
    inside = np.einsum("pi,ij,pj->p", points, inverse, points) < level[0]
    assert abs(inside.mean() - 0.95) < 0.005


def test_the_command_shows_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log.json"
    chosen = ("sensitivity", "report", "--linear", "--shot", 3, "--samples", 50)
    assert exit_code(*chosen, "--out", tmp_path, "--json", log) == 0
    printed = capsys.readouterr().out
    assert "std by" in printed
    assert "The derivatives hold to a tenth within" in printed
    (shot,) = json.loads(log.read_text(encoding="utf-8"))["shots"]
    assert shot["linear"]["holds"] > 1.0 and len(shot["linear"]["std"]["C"]) == 2
    assert (tmp_path / "shot-3.png").exists()
    assert exit_code(*chosen[:2], "--linear", "--shot", 4, "--samples", 5, "--out", tmp_path) == 0
    assert "not known" in capsys.readouterr().out


def test_the_command_says_it_at_once_without_samples(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.json"
    chosen = ("sensitivity", "report", "--linear", "--samples", 0, "--shot", 1)
    assert exit_code(*chosen, "--out", tmp_path, "--json", log) == 0
    assert "The derivatives hold to a tenth within" in capsys.readouterr().out
    (shot,) = json.loads(log.read_text(encoding="utf-8"))["shots"]
    assert shot.keys() == {"name", "linear"}
    assert [path.name for path in tmp_path.glob("*.png")] == ["shot-1-linear.png"]
