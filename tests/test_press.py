"""Contacts that persist: ends of an independent reference and of tiny time steps, and symmetries."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hard_scenes import exact
from press_reference import PressRun, press_run
from press_scenes import R, amplification, farthest, press_scene
from reference import Refused
from scenes import DATA, seeds

from pool_pymunk import Ball, Friction, Restitution, Run, Scene, SceneError, Table

OFF = 1e-7  # of the amplification, in m
LEAST = 1e-10  # m; the reference's own accuracy
OPEN = 0.02  # of the scenes; in them the order of hits on a group may decide
GROWN = 1e-15  # of the energy at the start
SINKS = 1e-8  # radii


def ends_of(run: Run) -> list[complex]:
    return [complex(*place) for place in run.end.position]


# -- ends ------------------------------------------------------------------------------------------


def both(seed: int, kind: str | None = None) -> tuple[Scene, PressRun] | None:
    """Return a random scene and its reference; None where balls overlap, or it is refused."""
    try:
        scene = press_scene(seed, kind)
        return scene, press_run(scene)
    except (SceneError, Refused):
        return None


@pytest.mark.slow
@pytest.mark.seeded
def test_random_scenes_end_where_the_reference_has_them() -> None:
    pressed, far, unsaid = 0, [], []
    for seed in seeds(200):
        if (found := both(seed)) is None:
            continue
        scene, expected = found
        pressed += any(force > 0.0 for force in expected.strongest.values())
        run = exact(scene)
        off = farthest(ends_of(run), expected.final)
        if off > OFF * amplification(scene, expected.final):
            far.append(seed)
        if off > max(run.policy_shift + run.rounding, LEAST):
            unsaid.append(seed)
    count = len(seeds(200))
    assert pressed > count / 4
    assert max(len(far), len(unsaid)) <= math.ceil(OPEN * count), (far, unsaid)


def records() -> list[Any]:
    return [pytest.param(r, id=r["name"]) for r in json.loads((DATA / "press.json").read_text())]


@pytest.mark.parametrize("record", records())
def test_ends_by_tiny_time_steps(record: dict[str, Any]) -> None:
    scene = Scene(
        tuple(Ball(**ball) for ball in record["balls"]),
        record["table"] and Table(**record["table"]),
        Restitution(**record["restitution"]),
        Friction(**record["friction"]),
    )
    run = exact(scene)
    assert farthest(ends_of(run), [complex(*place) for place in record["final"]]) < 1e-6
    assert len(run.events) <= 400
