"""Solvers agree with answers in many digits where contacts are hard, or say that they may not."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from reference import scene_from_dict
from scenes import DATA

from pool_pymunk import simulate

RECORDS = json.loads((DATA / "hard_runs.json").read_text())
NAMES = [record["name"] for record in RECORDS]


@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
@pytest.mark.parametrize("record", RECORDS, ids=NAMES)
def test_hard_contacts_in_many_digits(record: dict[str, Any], solver: str) -> None:
    """A run agrees within rounding, 1e-12 m times the scene's amplification, or has warnings."""
    scene = scene_from_dict(record["scene"])
    run = simulate(scene, solver=solver, dt=1 / 60)
    off = max(
        math.dist(run.final[ball.id], (float(x), float(y)))
        for ball, (x, y) in zip(scene.balls, record["final"], strict=True)
    )
    allowed = max(1e-12 * record["amplification"], record["trusted"])
    assert off <= allowed or run.warnings, f"{off:.1e} m off, and no warning"
