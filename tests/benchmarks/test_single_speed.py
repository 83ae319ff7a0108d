"""Single runs by the core are measured beside those by the contact engine, with the same bits.

``python tests/benchmarks/test_single_speed.py`` prints a table of docs/speed.md, for the core as it
is: compiled, or with POOL_PYMUNK_PURE=1 as plain Python. What is compared is played in turns, and
the fastest round counts.
"""

from __future__ import annotations

import math
import time
from typing import Any

import pytest
from core_scenes import by_core

from pool_pymunk import Scene, Shot, State, compiled, load
from pool_pymunk.core.engine import Engine
from pool_pymunk.core.persistent.declined import Declined
from pool_pymunk.core.record import Record
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import grouped
from pool_pymunk.solvers.in_core import balls_of, law_in_core, table_of
from pool_pymunk.solvers.record import Settings

ROUNDS = 40
# These ratios are far below those of docs/speed.md, so that a busy machine passes.
LEAST = 10.0 if compiled else 1.3
PYTHON = Settings(None, compiled=False)
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
    engine = Engine(table, balls, law_in_core(PYTHON.law_of(scene)), record, Declined())
    engine.begin_run()
    engine.advance(math.inf)
    return len(record.events)


def play_engine(scene: Scene, start: State) -> int:
    """Play a shot by the contact engine in Python, and return its events."""
    return len(grouped.solve(scene, start, PYTHON).events)


def times_of(scene: Scene, shots: tuple[Shot, ...]) -> tuple[float, float]:
    """Return how long (ms) core and contact engine take for the shots, in turns."""
    starts = [scene.start(shot) for shot in shots]
    found = [math.inf, math.inf]
    for _ in range(ROUNDS):
        for k, play in enumerate((play_core, play_engine)):
            began = time.perf_counter()
            for start in starts:
                play(scene, start)
            found[k] = min(found[k], 1e3 * (time.perf_counter() - began))
    return found[0], found[1]


def rows_of(trace: Trace | None) -> object:
    """Return all breakpoints of a run."""
    return None if trace is None else [list(map(tuple, rows)) for rows in trace.knots]


@pytest.mark.parametrize("name", CASES)
def test_the_core_is_faster(benchmark: Any, name: str) -> None:
    scene, shots = case(name)
    for shot in shots:
        start = scene.start(shot)
        one = by_core(scene, start, bounded(scene))
        assert rows_of(one) == rows_of(grouped.solve(scene, start, bounded(scene)))
    core, engine = benchmark.pedantic(times_of, (scene, shots), rounds=1, iterations=1)
    benchmark.extra_info["ratio"] = engine / core
    assert engine > LEAST * core


def bounded(scene: Scene) -> Settings:
    """Return settings with the scene's bound of time."""
    return PYTHON._replace(max_time=scene.physics.max_time)


def main() -> None:
    """Print the table."""
    how = "compiled" if compiled else "plain Python"
    print(f"| runs | events | core, {how}, ms | contact engine in Python, ms | times |")
    print("|---|---:|---:|---:|---:|")
    for name in CASES:
        scene, shots = case(name)
        events = sum(play_core(scene, scene.start(shot)) for shot in shots)
        core, engine = times_of(scene, shots)
        print(f"| {name} | {events} | {core:.3f} | {engine:.2f} | {engine / core:.1f} |")


if __name__ == "__main__":
    main()
