"""Derivatives beside the runs they belong to: ``make bench``, or run this file.

``python tests/benchmarks/test_derivatives_speed.py`` prints how many runs all derivatives cost,
what the rounding of 5,000 contacts costs, how many shots a second have derivatives by two inputs,
and how long a fit of fourteen numbers to 3,600 places takes. It needs SciPy.
"""

from __future__ import annotations

import time
import timeit
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from pool_pymunk import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Scene,
    Shot,
    Table,
    load,
    simulate,
    simulate_many,
)
from pool_pymunk.studies.fit import fit

SHOTS = (("report", 1), ("hexagon", 1), ("eight-ball", 1))
INPUTS = (("angle",), ("position", "velocity"), ("all",))


@pytest.mark.parametrize(("scenario", "shot"), SHOTS)
def test_derivatives_by_every_start(benchmark: BenchmarkFixture, scenario: str, shot: int) -> None:
    run = simulate(load(scenario), shot, solver="event-driven")
    benchmark(run.derivatives)


def best(work: Callable[[], object]) -> float:
    """Return the shortest time (s) of some calls."""
    return min(timeit.repeat(work, number=3, repeat=15)) / 3


def many_shots(scenario: str, count: int = 4_000) -> float:
    """Return how many shots like the first of a scenario are derived in a second of CPU time."""
    scene, rng = load(scenario), np.random.default_rng(0)
    vx, vy = scene.start(scene.shots[0]).velocity[scene.index[scene.shots[0].ball]]
    vary = {
        "angle": np.degrees(np.arctan2(vy, vx)) + rng.normal(0.0, 0.2, count),
        "speed": np.hypot(vx, vy) * (1.0 + rng.normal(0.0, 0.01, count)),
    }
    times = []
    for _ in range(3):
        began = time.process_time()
        simulate_many(scene, vary=vary, derivatives=("angle", "speed"))
        times.append(time.process_time() - began)
    return count / min(times)


def rounding_in_runs() -> str:
    """Say what the rounding of a ball that hits cushions 5,000 times costs, in runs."""
    ball = Ball("1", (0.3, 0.2), 0.03, 0.2, velocity=(0.8, 0.7))
    ends = Restitution(1.0, cushion=1.0), Friction(), Physics(max_time=1e6)
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), *ends)
    play = partial(simulate, scene, solver="event-driven", max_events=5000)
    played = min(timeit.repeat(play, number=1, repeat=5))
    times = []
    for _ in range(5):
        run = play()
        began = time.perf_counter()
        _ = run.rounding
        times.append(time.perf_counter() - began)
    return f"a run {1e3 * played:.0f} ms, its rounding {min(times) / played:.2f} runs"


def billiards(restitution: float, cushion: float, friction: Friction) -> Scene:
    """Return three balls that roll on a table without pockets, and four shots."""
    places = {"W": (0.5, 0.4), "Y": (0.9, 0.7), "R": (2.1, 0.7)}
    shots = ((2.0, 36.0), (2.6, 12.0), (3.1, -25.0), (1.6, 35.0))
    return Scene(
        tuple(Ball(name, place, 0.0305, 0.21) for name, place in places.items()),
        Table.rectangle(2.84, 1.42),
        Restitution(restitution, cushion=cushion),
        friction,
        shots=tuple(Shot(f"{v:g} m/s", "W", speed=v, angle=angle) for v, angle in shots),
    )


def time_of_fit(places: int = 300) -> str:
    """Say how long it takes to fit fourteen numbers to places of four shots, off by 2 mm."""
    true = billiards(0.953, 0.79, Friction(0.213, 0.19, 0.045, rolling=0.0093))
    noise, rows = np.random.default_rng(0), list[tuple[object, ...]]()
    for number in range(1, 5):
        end = simulate(true, number, solver="event-driven").duration
        times = np.linspace(0.05, end, places)
        run = simulate(true, number, solver="event-driven", times=times.tolist())
        seen = run.position + noise.normal(0.0, 0.002, run.position.shape)
        rows += [(number, ball.id, *seen[k, i], t)
                 for k, t in enumerate(times) for i, ball in enumerate(true.balls)]  # fmt: skip
    guess = billiards(0.92, 0.82, Friction(0.18, 0.15, 0.06, rolling=0.011))
    free = ["restitution.ball_ball", "restitution.cushion", "friction", "speed", "angle"]
    began = time.process_time()
    found = fit(guess, rows, free)
    took = time.process_time() - began
    return f"{len(found.values)} numbers, {len(rows)} places: {took:.1f} s of the processor"


def tables() -> None:
    """Print the times of runs, and of their derivatives and rounding in runs."""
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
    print(f"5,000 hits of cushions: {rounding_in_runs()}")


def main() -> None:
    """Print all of it."""
    tables()
    for scenario in ("report", "follow-and-draw"):
        rate = many_shots(scenario)
        print(f"{scenario} 1, varied: {rate:,.0f} shots a second, derived by two")
    print(f"fit: {time_of_fit()}")


if __name__ == "__main__":
    main()
