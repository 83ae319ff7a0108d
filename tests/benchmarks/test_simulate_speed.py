"""A run costs what its solver takes, what is outside the solver, and once the imports.

``python tests/benchmarks/test_simulate_speed.py`` prints all of it. What is compared is measured in
turns, in one run, and the fastest round counts.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from pool_pymunk import Scene, Shot, load, simulate
from pool_pymunk.solvers import SOLVERS, Solver
from pool_pymunk.solvers.record import Settings

ROUNDS, PROCESSES = 200, 15
EXACT = "event-driven"
MOST_IMPORTS = 2.0  # times as long as importing the libraries may importing and a first run take
IMPORTS = {
    "numpy and pymunk": "import numpy, pymunk",
    "pool_pymunk, load, a first run": (
        "import pool_pymunk\n"
        "pool_pymunk.simulate(pool_pymunk.load('report'), 1, solver='event-driven')"
    ),
}


class Cost(NamedTuple):
    """The shots of a scene cost this much: the whole of ``simulate``, and its solver alone."""

    simulate: float  # ms
    solver: float  # ms

    @property
    def outside(self) -> float:
        """Return what is outside the solver (ms)."""
        return self.simulate - self.solver


class Clock:
    """A clock adds up how long the solver takes (s)."""

    def __init__(self, solver: Solver) -> None:
        self.solver, self.taken = solver, 0.0

    def __call__(self, scene: Scene, start: object, settings: Settings) -> Any:
        began = time.perf_counter()
        trace = self.solver.solve(scene, start, settings)
        self.taken += time.perf_counter() - began
        return trace


def cost(scene: Scene, shots: Sequence[Shot]) -> Cost:
    """Return what simulating these shots costs; the fastest round counts."""
    usual, found = SOLVERS[EXACT], []
    clock = Clock(usual)
    SOLVERS[EXACT] = replace(usual, solve=clock)
    try:
        for _ in range(ROUNDS):
            clock.taken, began = 0.0, time.perf_counter()
            for shot in shots:
                simulate(scene, shot, solver=EXACT)
            found.append(Cost(1e3 * (time.perf_counter() - began), 1e3 * clock.taken))
    finally:
        SOLVERS[EXACT] = usual
    return Cost(*map(min, zip(*found, strict=True)))


def times_of(codes: Mapping[str, str]) -> dict[str, float]:
    """Return how long (ms) new processes take for these codes, in turns; the fastest counts."""
    found = dict.fromkeys(codes, float("inf"))
    # Like those of an install, the modules are compiled to bytecode.
    usual = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(PROCESSES):
        for name, code in codes.items():
            began = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True, env=usual)
            found[name] = min(found[name], 1e3 * (time.perf_counter() - began))
    return found


CASES = {"the report's four shots": "report", "a break of eight-ball": "eight-ball"}


def case(name: str) -> tuple[Scene, tuple[Shot, ...]]:
    """Return the scene of a case, and its shots."""
    scene = load(CASES[name])
    return scene, scene.shots if CASES[name] == "report" else scene.shots[:1]


@pytest.mark.parametrize("name", CASES)
def test_what_is_outside_the_solver(benchmark: Any, name: str) -> None:
    found = benchmark.pedantic(cost, case(name), rounds=1, iterations=1)
    benchmark.extra_info.update(found._asdict(), outside=found.outside)


def test_a_first_run_takes_at_most_twice_as_long_as_the_libraries(benchmark: Any) -> None:
    libraries, ours = benchmark.pedantic(times_of, (IMPORTS,), rounds=1, iterations=1).values()
    benchmark.extra_info["ratio"] = ours / libraries
    assert ours <= MOST_IMPORTS * libraries


def main() -> None:
    """Print the costs, and how the imports compare."""
    print("| runs | simulate, ms | of these the solver | outside the solver |")
    print("|---|---:|---:|---:|")
    for name in CASES:
        found = cost(*case(name))
        print(f"| {name} | {found.simulate:.3f} | {found.solver:.3f} | {found.outside:.3f} |")
    found_times = times_of(IMPORTS)
    libraries, ours = found_times.values()
    for name, taken in found_times.items():
        print(f"importing {name}: {taken:.0f} ms")
    print(f"that is {ours / libraries:.2f} times as long")


if __name__ == "__main__":
    main()
