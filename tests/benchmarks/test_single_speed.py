"""Single runs by the core are measured.

``python tests/benchmarks/test_single_speed.py`` prints a table of docs/speed.md, for the core as it
is: compiled, or with POOL_PYMUNK_PURE=1 as plain Python. The fastest round counts.
"""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from pool_pymunk import Scene, Shot, State, compiled, load
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.record import Record
from pool_pymunk.laws import LAWS, law_in_core
from pool_pymunk.solvers.in_core import balls_of, table_of

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


def play_core(scene: Scene, start: State) -> int:
    """Play a shot by the core alone, and return its events."""
    table = table_of(scene)
    balls = balls_of(scene, start, table)
    record = Record([[] for _ in balls], scene.surface.rolls)
    engine = Engine(table, balls, law_in_core(LAWS[scene.physics.law]), record, Persistence())
    engine.begin_run()
    engine.advance(math.inf)
    return len(record.events)


def time_of(scene: Scene, shots: tuple[Shot, ...]) -> float:
    """Return how long (ms) the core takes for the shots."""
    starts = [scene.start(shot) for shot in shots]
    found = math.inf
    for _ in range(ROUNDS):
        began = time.perf_counter()
        for start in starts:
            play_core(scene, start)
        found = min(found, 1e3 * (time.perf_counter() - began))
    return found


@pytest.mark.parametrize("name", CASES)
def test_single_runs(benchmark: Any, name: str) -> None:
    scene, shots = case(name)
    benchmark.extra_info["ms"] = benchmark.pedantic(time_of, (scene, shots), rounds=1, iterations=1)


def main() -> None:
    """Print the table."""
    print(f"| runs | events | core, {'compiled' if compiled else 'plain Python'}, ms |")
    print("|---|---:|---:|")
    for name in CASES:
        scene, shots = case(name)
        events = sum(play_core(scene, scene.start(shot)) for shot in shots)
        print(f"| {name} | {events} | {time_of(scene, shots):.3f} |")


if __name__ == "__main__":
    main()
