"""Derivatives beside the runs they belong to: ``make bench``, or run this file.

``python tests/benchmarks/test_derivatives_speed.py`` prints how many runs all derivatives cost, and
how many compiled shots a second and core have derivatives by two inputs.
"""

from __future__ import annotations

import time
import timeit
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from pool_pymunk import load, simulate, simulate_many

SHOTS = (("report", 1), ("hexagon", 1), ("eight-ball", 1))
INPUTS = (("angle",), ("position", "velocity"), ("all",))


@pytest.mark.parametrize(("scenario", "shot"), SHOTS)
def test_derivatives_by_every_start(benchmark: BenchmarkFixture, scenario: str, shot: int) -> None:
    run = simulate(load(scenario), shot, solver="event-driven")
    benchmark(run.derivatives)


def best(work: Callable[[], object]) -> float:
    """Return the shortest time (s) of some calls."""
    return min(timeit.repeat(work, number=3, repeat=15)) / 3


def many_shots(scenario: str, count: int = 40_000) -> float:
    """Return how many shots like the first of a scenario are derived in a second of CPU time."""
    scene, rng = load(scenario), np.random.default_rng(0)
    vx, vy = scene.start(scene.shots[0]).velocity[scene.index[scene.shots[0].ball]]
    vary = {
        "angle": np.degrees(np.arctan2(vy, vx)) + rng.normal(0.0, 0.2, count),
        "speed": np.hypot(vx, vy) * (1.0 + rng.normal(0.0, 0.01, count)),
    }
    times = []
    for _ in range(4):  # The first one compiles.
        began = time.process_time()
        simulate_many(scene, vary=vary, threads=1, derivatives=["angle", "speed"])
        times.append(time.process_time() - began)
    return count / min(times)


def main() -> None:
    """Print the times of runs, and of their derivatives in runs; and those of many shots."""
    for scenario, shot in SHOTS:
        scene = load(scenario)
        run = simulate(scene, shot, solver="event-driven")
        played = best(partial(simulate, scene, shot, solver="event-driven"))
        costs = []
        for wrt in INPUTS:
            count = len(run.derivatives(wrt).names)
            cost = best(partial(run.derivatives, wrt)) / played
            costs.append(f"by {', '.join(wrt)} ({count}): {cost:.1f} runs")
        print(f"{scenario} {shot}: a run {1e3 * played:.2f} ms; {'; '.join(costs)}")
    for scenario in ("report", "follow-and-draw"):
        rate = many_shots(scenario)
        print(f"{scenario} 1, varied: {rate:,.0f} shots a second and core, derived by two")


if __name__ == "__main__":
    main()
