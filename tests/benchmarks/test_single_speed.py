"""Single runs by the core are measured.

``python tests/benchmarks/test_single_speed.py`` prints a table of docs/speed.md, for the core as it
is: compiled, or with POOL_PYMUNK_PURE=1 as plain Python. The fastest round counts.
"""

from __future__ import annotations

import time
from typing import Any

import pytest

from pool_pymunk import Scene, Shot, compiled, load
from pool_pymunk.solvers import event_driven
from pool_pymunk.solvers.record import Settings

ROUNDS = 40
CASES = {
    "the report's four shots": "report",
    "a break of eight-ball": "eight-ball",
    "a break of nine-ball": "nine-ball",
    "a break of carrom": "carrom",
}


def case(name: str) -> tuple[Scene, tuple[Shot, ...]]:
    """Return the scene of a case, and its shots."""
    scene = load(CASES[name])
    return scene, scene.shots if CASES[name] == "report" else scene.shots[:1]


def play(scene: Scene, shots: tuple[Shot, ...]) -> int:
    """Play shots, and return how many events they have."""
    settings = Settings(None)
    traces = [event_driven.solve(scene, scene.start(shot), settings) for shot in shots]
    return sum(len(trace.events) for trace in traces)


@pytest.mark.parametrize("name", CASES)
def test_a_single_run(benchmark: Any, name: str) -> None:
    assert benchmark(play, *case(name)) > 0


def main() -> None:
    """Print the table."""
    how = "compiled" if compiled else "plain Python"
    print(f"| runs | events | core, {how}, ms |\n|---|---:|---:|")
    for name in CASES:
        scene, shots = case(name)
        took = []
        for _ in range(ROUNDS):
            began = time.perf_counter()
            events = play(scene, shots)
            took.append(1e3 * (time.perf_counter() - began))
        print(f"| {name} | {events} | {min(took):.3f} |")


if __name__ == "__main__":
    main()
