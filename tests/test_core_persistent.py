"""Groups of the core play contacts that persist, as accurately as a tolerance asks.

Only scenes with a reference are here.
"""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from press_scenes import farthest
from scenes import DATA

from pool_pymunk import Ball, Friction, Restitution, Scene, Table
from pool_pymunk.core.persistent import bounces
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import event_driven
from pool_pymunk.solvers.record import Settings

TOLERANCE = 1e-8  # m
R, M = 0.0286, 0.17


def play(scene: Scene, tolerance: float = TOLERANCE) -> Trace:
    """Play a scene by the core alone."""
    settings = Settings(None, max_time=60.0, contact_tolerance=tolerance)
    trace = event_driven.solve(scene, scene.start(None), settings)
    assert trace.status == "settled"
    return trace


def ends_of(trace: Trace) -> list[complex]:
    return [complex(*rows[-1][1:3]) for rows in trace.knots]


def scenes_on_file() -> list[Any]:
    return [pytest.param(r, id=r["name"]) for r in json.loads((DATA / "press.json").read_text())]


@pytest.mark.parametrize("record", scenes_on_file())
def test_ends_by_tiny_time_steps(record: dict[str, Any]) -> None:
    scene = Scene(
        tuple(Ball(**ball) for ball in record["balls"]),
        record["table"] and Table(**record["table"]),
        Restitution(**record["restitution"]),
        Friction(**record["friction"]),
    )
    final = [complex(*place) for place in record["final"]]
    assert farthest(ends_of(play(scene)), final) < 1e-6


def follower(e: float) -> Scene:
    """Return a ball that turns fast behind another one, and bounces on it ever lower."""
    return Scene(
        (
            Ball("b0", (0.0, 0.0), R, M, velocity=(0.602, 0.0), roll=4.31),
            Ball("b1", (0.057307, 0.0), R, M, velocity=(0.602, 0.0), roll=1.0),
        ),
        None, Restitution(e), Friction(0.25, 0.0, 0.0, rolling=0.01),
    )  # fmt: skip


@pytest.mark.parametrize("e", [0.5, 0.8, 0.9])
def test_bounces_that_are_left_out_count_in_first_order(e: float) -> None:
    """A ball that bounces slips for a share of the time, and does not feel rolling resistance then.

    Without that, the ends would move with the root of the tolerance: by 4e-4 m at 1e-5 m.
    """
    ends = [ends_of(play(follower(e), tolerance)) for tolerance in (1e-5, 1e-6, 1e-7)]
    assert farthest(ends[0], ends[2]) < 1e-6 and farthest(ends[1], ends[2]) < 1e-7


def test_the_follower_ends_where_the_reference_has_it() -> None:
    """The reference, by tiny steps, is good to 3e-8 m."""
    final = [complex(4.095778492736671), complex(4.152978492736671)]
    assert farthest(ends_of(play(follower(0.9), 1e-6)), final) < 1e-7


def test_a_lone_hit_comes_again_at_a_share_of_its_speed() -> None:
    """Two sides without slips, of restitution e, close at e times the last speed."""
    assert math.isclose(bounces.return_speed(0.5, [(2.0, 0.0), (2.0, 0.0)], 2.0), 0.5)
