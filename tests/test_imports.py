"""Nobody waits for what a run does not need: each test looks at the modules of a new process."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from pool_pymunk import Scene, load, simulate
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import SOLVERS
from pool_pymunk.solvers.record import InFile

# What one process does in turn; a later step has what the steps before it have imported, too.
STEPS = {
    "the package": "import pool_pymunk",
    "names of solvers": "from pool_pymunk import SOLVERS\nassert len(SOLVERS) == 5",
    "a run": """
from pool_pymunk import load, simulate
simulate(load("report"), 1, solver="event-driven")
""",
    "a contact that persists": """
from pool_pymunk import Ball, Friction, Restitution, Scene
balls = (
    Ball("A", (0.0, 0.0), 0.03, 0.2, velocity=(1.0, 0.0), roll=1.0),
    Ball("B", (0.0601, 0.01), 0.03, 0.2),
)
scene = Scene(balls, None, Restitution(0.0), Friction(0.1, rolling=0.01))
assert simulate(scene, solver="event-driven").persistent
""",
    "another solver": 'simulate(load("report"), 1, solver="pymunk-discrete")',
}
LIBRARIES = {"matplotlib", "numba", "pydantic", "pymunk", "rich", "scipy", "typer"}


def rooms(modules: set[str]) -> set[str]:
    """Return the rooms of the package that these modules are of."""
    return {name.split(".")[1] for name in modules if name.startswith("pool_pymunk.")}


def test_each_step_imports_what_it_needs_alone() -> None:
    code = "\n".join(f"import sys\n{step}\nprint(*sys.modules)" for step in STEPS.values())
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = (set(line.split()) for line in done.stdout.splitlines())
    found = {
        step: names | {name.rpartition(".")[0] for name in names}
        for step, names in zip(STEPS, lines, strict=True)
    }
    assert not rooms(found["the package"]) and "numpy" not in found["the package"]
    assert "pool_pymunk.solvers.registry" in found["names of solvers"]
    assert not rooms(found["names of solvers"]) & {"engine", "physics", "world"}
    assert "pool_pymunk.core.engine" not in found["names of solvers"]
    assert rooms(found["a run"]) == {"core", "laws", "model", "results", "safety", "solvers"}
    assert not found["a run"] & LIBRARIES
    others = {each.solve.name for each in SOLVERS.values() if isinstance(each.solve, InFile)}
    others = {f"pool_pymunk.solvers.{name}" for name in others - {"event_driven"}}
    assert len(others) == 4 and not found["a run"] & others
    assert not rooms(found["a contact that persists"]) & {"engine", "physics", "world"}
    assert {"pymunk", "pool_pymunk.solvers.pymunk_discrete"} <= found["another solver"]
    assert not rooms(found["another solver"]) & {"engine", "world"}


class Slow(InFile):
    """A file that takes long to import."""

    def load(self) -> Callable[..., Trace]:
        time.sleep(0.3)
        return still

    def __call__(self, *run: Any, **options: str) -> Trace:
        return still(*run)


def still(scene: Scene, start: object, settings: object) -> Trace:
    """Play a run in which nothing moves."""
    return Trace(scene.start(None))


def test_the_time_of_a_run_does_not_have_the_import_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = replace(SOLVERS["event-driven"], solve=Slow("slow"))
    monkeypatch.setitem(SOLVERS, "event-driven", slow)
    began = time.perf_counter()
    run = simulate(load("report"), 1, solver="event-driven")
    assert run.wall_time < 0.1 < 0.3 <= time.perf_counter() - began
