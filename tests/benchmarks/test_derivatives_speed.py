"""Derivatives beside the runs they belong to: ``make bench``, or run this file.

``python tests/benchmarks/test_derivatives_speed.py`` prints how many runs all derivatives cost.
"""

from __future__ import annotations

import timeit
from collections.abc import Callable
from functools import partial

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from pool_pymunk import load, simulate

SHOTS = (("report", 1), ("hexagon", 1), ("eight-ball", 1))
INPUTS = (("angle",), ("position", "velocity"), ("all",))


@pytest.mark.parametrize(("scenario", "shot"), SHOTS)
def test_derivatives_by_every_start(benchmark: BenchmarkFixture, scenario: str, shot: int) -> None:
    run = simulate(load(scenario), shot, solver="event-driven")
    benchmark(run.derivatives)


def best(work: Callable[[], object]) -> float:
    """Return the shortest time (s) of some calls."""
    return min(timeit.repeat(work, number=3, repeat=15)) / 3


def main() -> None:
    """Print the times of runs, and of their derivatives in runs."""
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


if __name__ == "__main__":
    main()
