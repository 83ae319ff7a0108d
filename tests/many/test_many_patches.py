"""Compiled shots, runs and tables cross borders of patches with the bits of Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Patch,
    Run,
    Scene,
    SettingError,
    simulate,
    simulate_many,
)
from tests.shared.patch_scenes import M, R, random_scene
from tests.shared.shots import check_bits, check_derivatives


def played(scene: Scene) -> Run:
    return simulate(scene, solver="event-driven")


@pytest.mark.parametrize("seed", range(10))
def test_a_batch_plays_random_scenes_and_their_derivatives(seed: int) -> None:
    batch = simulate_many(random_scene(seed), derivatives="position")
    assert batch.by_reference == 0
    check_bits(batch, range(1))
    check_derivatives(batch, [0])


def strip(x: float, **own: Any) -> Patch:
    return Patch(((x, -1.0), (x + 0.1, -1.0), (x + 0.1, 1.0), (x, 1.0)), **own)


def test_what_a_patch_leaves_out_varies_with_the_scene() -> None:
    scene = Scene(
        (Ball("a", (0.0, 0.0), R, M, velocity=(2.0, 0.0)),),
        friction=Friction(0.2, rolling=0.02),
        patches=(strip(0.2, rolling=0.05), strip(0.5, surface=0.4)),
    )
    vary = {"friction.surface": [0.1, 0.15, 0.2], "friction.rolling": [0.01, 0.03, 0.02]}
    batch = simulate_many(scene, vary=vary)
    assert batch.by_reference == 0
    check_bits(batch, range(3))
    assert len(set(batch.final[:, 0, 0].tolist())) == 3


def test_rolling_above_sliding_in_a_patch_cannot_start() -> None:
    scene = Scene(
        (Ball("a", (0.0, 0.0), R, M, velocity=(2.0, 0.0)),),
        friction=Friction(0.2, rolling=0.02),
        patches=(strip(0.2, surface=0.1),),
    )
    batch = simulate_many(scene, vary={"friction.rolling": [0.05, 0.15]})
    assert [batch.statuses[k] for k in batch.status] == ["settled", "cannot_start"]


def test_many_patches() -> None:
    patches = tuple(strip(0.2 * k, surface=0.1 + 0.001 * k) for k in range(70))
    ball = Ball("a", (-0.1, 0.0), R, M, velocity=(9.0, 0.0))
    scene = Scene((ball,), friction=Friction(0.1), patches=patches)
    check_bits(simulate_many(scene), range(1))


def test_shots_that_may_stay_on_ice_need_a_latest_time() -> None:
    ball = Ball("a", (0.0, 0.0), R, M)
    ice = Scene((ball,), friction=Friction(0.1), patches=(strip(0.2, surface=0.0),))
    with pytest.raises(SettingError, match="max_time = None: is missing"):
        simulate_many(ice, velocity=np.ones((2, 1, 2)))
