"""Between contacts, no two balls overlap and no ball is in a wall: paths are sampled densely."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from pool_pymunk import Run, load, simulate
from pool_pymunk.core.motion.times import EPSILON
from tests.shared.scenes import TABLES, random_scene, seeds

ROUNDING = 64 * EPSILON  # m; coordinates are a few metres at most
TIMES = 20_000


def room(run: Run) -> float:
    """Return the least room (m) between two balls, or between a ball and a cushion."""
    scene = run.scene
    times = np.linspace(0.0, run.duration, TIMES)
    times = np.sort(np.concatenate([times, *[breakpoints[:, 0] for breakpoints in run.knots]]))
    places, _ = run.at(times)
    rooms = [
        np.hypot(*(places[:, i] - places[:, j]).T) - scene.balls[i].radius - scene.balls[j].radius
        for i, j in combinations(range(len(scene.balls)), 2)
    ]
    for k, ball in enumerate(scene.balls):
        for edge in scene.table.edges if scene.table else ():
            off = places[:, k] - np.array(edge.start)
            along = off @ np.array(edge.tangent)
            height = off @ np.array(edge.normal) - ball.radius
            rooms.append(height[(along >= 0.0) & (along <= edge.length) & (height > -ball.radius)])
        if scene.table is None:
            continue
        for number in scene.table.reflex_corners:
            off = places[:, k] - np.array(scene.table.outline[number])
            rooms.append(np.hypot(*off.T) - ball.radius)
    return min(float(each.min()) for each in rooms if len(each))


@pytest.mark.seeded
@pytest.mark.parametrize("table", TABLES)
def test_random_scenes(table: str) -> None:
    for seed in seeds(2):
        run = simulate(random_scene(seed, table), solver="event-driven")
        contacts = [event for event in run.events if event.kind != "stop"]
        least = room(run)
        assert least > -10.0 * ROUNDING, seed
        assert least < 10.0 * ROUNDING or not contacts, seed  # At a contact the room is 0.


def test_the_report() -> None:
    assert abs(room(simulate(load("report"), 1, solver="event-driven"))) < 10.0 * ROUNDING
