"""Single runs are measured in Python and compiled, with the same bits.

``python tests/benchmarks/test_single_speed.py`` prints the table of docs/speed.md. The fastest of
some rounds counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from pool_pymunk import Run, Scene, Shot, load, simulate
from pool_pymunk.fast import ahead

ROUNDS = 7
EXACT = "event-driven"
SLOW = Shot("slow", ball="C", speed=2.6435714932703336, angle=322.60625223716573)


def runs(scene: Scene, compiled: bool) -> list[Run]:
    """Return the runs of all shots of a scene."""
    return [simulate(scene, shot, solver=EXACT, compiled=compiled) for shot in scene.shots]


def cases() -> dict[str, Scene]:
    """Return the scenes of the table, each with the shots that are played."""
    eight = load("eight-ball")
    cue = next(ball.id for ball in eight.balls if ball.cue)
    slow = replace(SLOW, ball=cue)
    return {
        "the report's four shots": load("report"),
        "a break of eight-ball": replace(eight, shots=eight.shots[:1]),
        "a slow break, whose balls press on each other": replace(eight, shots=(slow,)),
    }


def fastest(play: Callable[[], object]) -> float:
    """Return the time (ms) of the fastest round."""
    found = []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        play()
        found.append(time.perf_counter() - began)
    return 1e3 * min(found)


@pytest.mark.parametrize("name", cases())
def test_compiled_runs_are_faster(benchmark: Any, name: str) -> None:
    scene = cases()[name]
    ahead.compile(scene)
    assert runs(scene, True) == runs(scene, False)
    benchmark(runs, scene, True)


def main() -> None:
    """Print the table."""
    print("| runs | events | in Python, ms | compiled, ms | of these the solver, ms |")
    print("|---|---:|---:|---:|---:|")
    for name, scene in cases().items():
        ahead.compile(scene)
        again = runs(scene, True)
        solver = min(sum(run.wall_time for run in runs(scene, True)) for _ in range(ROUNDS))
        python, loop = (fastest(partial(runs, scene, c)) for c in (False, True))
        events = sum(len(run.events) for run in again)
        print(f"| {name} | {events} | {python:.3g} | {loop:.3g} | {1e3 * solver:.2g} |")


if __name__ == "__main__":
    main()
