"""Shots in which contacts persist have the bits of single runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Batch, Friction, Scene, simulate_many
from tests.shared.press_scenes import (
    AT_A_CUSHION,
    AT_REST,
    HEAD_ON,
    IN_A_CORNER,
    ON_A_CIRCLE,
)
from tests.shared.shots import check_bits


def check(batch: Batch) -> None:
    """Check that all shots have the bits of the exact solver."""
    check_bits(batch, range(len(batch)))


@pytest.mark.parametrize(
    ("scene", "roll"),
    [(HEAD_ON, [(0.5, 0.0), (-0.5, 0.0)]), (AT_A_CUSHION, [(0.2, 0.5)]), (AT_REST, [(0.0, 0.4)]),
     (IN_A_CORNER, [(0.4, 0.4)])],
)  # fmt: skip
def test_a_roll_presses_balls_together_and_to_a_cushion(scene: Scene, roll: Any) -> None:
    """Others have rolls that pull them apart, or only slide."""
    rolls = np.array([roll, np.zeros_like(roll), -np.array(roll)])
    batch = simulate_many(scene, roll=rolls)
    check(batch)
    assert [len(batch.run(k).persistent) > 0 for k in range(3)] == [True, False, False]
    check(simulate_many(replace(scene, friction=replace(scene.friction, rolling=None))))


@pytest.mark.parametrize("rolling", [None, 0.01])
def test_an_arc_presses_on_a_ball_that_runs_along_it(
    rolling: float | None
) -> None:  # fmt: skip
    scene = replace(ON_A_CIRCLE, friction=replace(ON_A_CIRCLE.friction, rolling=rolling))
    batch = simulate_many(scene, vary={"restitution.cushion": [0.1]}, max_time=0.3)
    check(batch)
    assert batch.run(0).persistent


def test_hits_on_an_arc_that_keep_all_speed_do_not_converge() -> None:
    scene = replace(ON_A_CIRCLE, friction=Friction(0.2))
    batch = simulate_many(scene, vary={"restitution.cushion": [1.0]}, max_time=0.3)
    check(batch)
    assert not batch.run(0).persistent
