"""Dense piles come to rest; ``pytest tests/benchmarks/test_piles.py -s`` prints in what time.

``-k land`` lets fifty balls fall into a box on a live table: its steps take this processor time.
"""

from __future__ import annotations

import math
import time

import pymunk
import pytest

from pool_pymunk import Billiards, same_balls, simulate
from tests.shared.scenes import pile

COUNT, RADIUS, WIDE, HIGH = 50, 0.03, 0.6, 2.0  # m


@pytest.mark.parametrize("rolling", [None, 0.01, 1e-4])
@pytest.mark.parametrize(("count", "e"), [(50, 0.0), (200, 0.5)])
def test_piles(count: int, e: float, rolling: float | None) -> None:
    """Play a pile, and print its time."""
    began = time.perf_counter()
    run = simulate(pile(count, e, rolling), solver="event-driven")
    took = time.perf_counter() - began
    print(f"{count} balls, e = {e}, rolling {rolling}: {took:.2f} s, {len(run.events):,} events")
    assert run.status == "settled"


def boxed() -> Billiards:
    """Return a table in a space with gravity, with balls above the floor of a box."""
    space = pymunk.Space()
    space.gravity = (0.0, -9.80665)
    table = Billiards(space, 1 / 60, pair=same_balls(0.6, 0.0))
    for a, b in (((0, 0), (WIDE, 0)), ((0, 0), (0, HIGH)), ((WIDE, 0), (WIDE, HIGH))):
        table.add_wall(pymunk.Segment(space.static_body, a, b, 0.0), 0.6)
    for k in range(COUNT):
        body = pymunk.Body(0.2, math.inf)
        body.position = 0.09 + 0.08 * (k % 6) + 0.001 * (k % 7), 0.2 + 0.1 * (k // 6)
        table.add_ball(pymunk.Circle(body, RADIUS))
    return table


def test_fifty_balls_land() -> None:
    """Let balls fall into a box, and print how long steps take."""
    table, took = boxed(), list[float]()
    while table.moving and table.time < 20.0:
        began = time.thread_time()
        table.step()
        took.append(1e3 * (time.thread_time() - began))
    mean, slow = sum(took) / len(took), sum(each > 1e3 / 60 for each in took)
    print(
        f"{COUNT} balls land, and rest after {table.time:.1f} s: {mean:.1f} ms a step on the mean, "
        f"{max(took):.0f} ms at most; {slow} of {len(took)} steps take longer than a frame"
    )
    assert not table.moving
