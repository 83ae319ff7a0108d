"""No hit is lost around balls in persistent contact: none passes through another, or a cushion.

`data/lost_hits.json` has random scenes in which one did.
"""

from __future__ import annotations

import json
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scenes import DATA

from pool_pymunk import Ball, Friction, Restitution, Run, Scene, Table, simulate

R = 0.03
FOUND = json.loads((DATA / "lost_hits.json").read_text(encoding="utf-8"))


def scene_of(found: Any) -> Scene:
    """Return a scene of the file."""
    balls = tuple(
        Ball(f"{k}", (x, y), R, mass, velocity=(vx, vy), roll=roll)
        for k, (x, y, vx, vy, roll, mass) in enumerate(found["balls"])
    )
    e, at_cushions = found["restitution"]
    surface, cushion, ball_ball, rolling = found["friction"]
    return Scene(
        balls, Table.rectangle(*found["table"]), Restitution(e, cushion=at_cushions),
        Friction(surface, cushion, ball_ball, rolling=rolling),
    )  # fmt: skip


def deepest(run: Run) -> float:
    """Return how deep (radii) balls are in others or in cushions, at and between breakpoints."""
    assert run.scene.table is not None
    times = np.unique(np.concatenate([rows[:, 0] for rows in run.knots]))
    places, _ = run.at(np.concatenate((times, (times[1:] + times[:-1]) / 2.0)))
    x0, y0, x1, y1 = run.scene.table.bounds
    gaps = [(places - (x0, y0)).min() - R, ((x1, y1) - places).min() - R]
    for i, j in combinations(range(places.shape[1]), 2):
        gaps.append(np.hypot(*(places[:, i] - places[:, j]).T).min() - 2.0 * R)
    return float(max(-min(gaps) / R, 0.0))


@pytest.mark.parametrize("solver", ["event-driven", "pymunk"])
@pytest.mark.parametrize("away", [0.06, 0.08])
def test_a_ball_that_rests_in_a_group_is_hit_after_the_group(away: float, solver: str) -> None:
    """The hit is predicted while ball 1 pushes ball 2 on to a cushion, and comes later or not."""
    balls = (
        Ball("1", (2.0 - 3.0 * R - 0.002, 0.5), R, 0.2, velocity=(1.0, 0.0), roll=1.0),
        Ball("2", (2.0 - R, 0.5), R, 0.2),
        Ball("3", (2.0 - R, 0.5 - 2.0 * R - away), R, 0.2, velocity=(0.0, 0.5)),
    )
    friction = Friction(0.2, 0.1, 0.05, rolling=0.01)
    scene = Scene(balls, Table.rectangle(2.0, 1.0), Restitution(0.0, cushion=0.0), friction)
    run = simulate(scene, solver=solver)
    met = {event.balls for event in run.events} | {contact.balls for contact in run.persistent}
    assert ("2", "3") in met
    assert deepest(run) < 1e-8


@pytest.mark.parametrize("found", FOUND, ids=[each["name"] for each in FOUND])
def test_no_ball_passes_through_another_or_a_cushion(found: Any) -> None:
    run = simulate(scene_of(found), solver="event-driven")
    assert run.status == "settled"
    assert deepest(run) < 1e-8
