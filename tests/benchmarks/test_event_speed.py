"""The exact solver's cost is measured, and how that of one event grows with the balls.

``make bench`` shows the times; ``python -m tests.benchmarks.test_event_speed`` prints the table of
the README. Tables are as crowded as the report's. The cost of an event is that of the run without
its set-up (paths, boxes and first predictions of all balls), over the events. The set-up is shown
beside it.
"""

from __future__ import annotations

import statistics
import time
from typing import Any, NamedTuple

import pytest

from pool_pymunk import Scene, Shot, load, simulate
from tests.shared.crowded import crowded

SIZES = (11, 50, 200, 1000)
MOST_GROWTH = 5.0  # in the cost of an event, from 11 balls to 1,000


class Cost(NamedTuple):
    """A cost is that of some tables of one size: events of one, one event (s), one set-up (s)."""

    events: float
    event: float
    set_up: float


def least_time(scene: Scene, **bounds: Any) -> tuple[float, int]:
    """Return the least time (s) of three runs, as the solver measures it, and their events."""
    runs = [simulate(scene, solver="event-driven", **bounds) for _ in range(3)]
    return min(run.wall_time for run in runs), len(runs[0].events)


def cost(count: int, all_move: bool) -> Cost:
    """Return the cost over some tables of that size: a few hundred events."""
    whole = set_up = 0.0
    events = 0
    tables = 16 if not all_move else max(1, 400 // count)
    for seed in range(tables):
        scene = crowded(count, all_move, seed)
        seconds, found = least_time(scene)
        events += found
        whole += seconds
        set_up += least_time(scene, max_time=1e-9)[0]
    return Cost(events / tables, (whole - set_up) / events, set_up / tables)


@pytest.mark.parametrize("shot", [1, 2, 3, 4])
def test_the_reports_shots(benchmark: Any, shot: int) -> None:
    scene = load("report")
    benchmark(simulate, scene, shot, solver="event-driven")


@pytest.mark.parametrize("all_move", [False, True])
@pytest.mark.parametrize("count", SIZES)
def test_a_crowded_table(benchmark: Any, count: int, all_move: bool) -> None:
    scene = crowded(count, all_move)
    run = benchmark.pedantic(simulate, (scene,), {"solver": "event-driven"}, rounds=3, iterations=1)
    assert run.status == "settled"
    benchmark.extra_info["events"] = len(run.events)


@pytest.mark.benchmark
@pytest.mark.parametrize("all_move", [False, True])
def test_an_event_at_1000_balls_costs_at_most_five_at_11(benchmark: Any, all_move: bool) -> None:
    """Both are measured in one run, on one machine; no time is asserted."""
    small, large = benchmark.pedantic(
        lambda: [cost(count, all_move) for count in (SIZES[0], SIZES[-1])], rounds=1, iterations=1
    )
    benchmark.extra_info["growth"] = large.event / small.event
    assert large.event <= MOST_GROWTH * small.event


def print_table() -> None:
    """Print the table of the README."""
    print("| what moves | balls | events of a run | one event | beside 11 balls | set-up |")
    print("|---|---:|---:|---:|---:|---:|")
    for all_move, name in ((False, "one ball, 4 m/s"), (True, "all balls, 0.5 to 2 m/s")):
        costs = {count: cost(count, all_move) for count in SIZES}
        for count, (events, event, set_up) in costs.items():
            growth = event / costs[SIZES[0]].event
            print(
                f"| {name} | {count} | {events:.0f} | {event * 1e6:.0f} µs | {growth:.1f} "
                f"| {set_up * 1e3:.2g} ms |"
            )


def print_shots() -> None:
    """Print the median times of the report's shots."""
    for name in ("report", "report-corrected"):
        scene = load(name)
        for shot in scene.shots:
            assert isinstance(shot, Shot)
            times = [simulate(scene, shot, solver="event-driven").wall_time for _ in range(101)]
            print(f"{name}, {shot.name}: median {statistics.median(times) * 1e3:.2f} ms")


if __name__ == "__main__":
    began = time.perf_counter()
    print_table()
    print_shots()
    print(f"(measured in {time.perf_counter() - began:.0f} s)")
