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

FIRST_RUN = """
import pool_pymunk
pool_pymunk.simulate(pool_pymunk.load("report"), 1, solver="{solver}")
"""
PRESSING = """
from pool_pymunk import Ball, Friction, Restitution, Scene, simulate
balls = (
    Ball("A", (0.0, 0.0), 0.03, 0.2, velocity=(1.0, 0.0), roll=1.0),
    Ball("B", (0.0601, 0.01), 0.03, 0.2),
)
scene = Scene(balls, None, Restitution(0.0), Friction(0.1, rolling=0.01))
assert simulate(scene, solver="event-driven").persistent
"""
LIBRARIES = {"matplotlib", "numba", "pydantic", "pymunk", "rich", "scipy", "typer"}


def imported(code: str) -> set[str]:
    """Return the modules that a new process has imported after this code, and their packages."""
    code += "\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    found = set(done.stdout.split())
    return found | {name.rpartition(".")[0] for name in found}


def rooms(modules: set[str]) -> set[str]:
    """Return the rooms of the package that these modules are of."""
    return {name.split(".")[1] for name in modules if name.startswith("pool_pymunk.")}


def test_a_first_run_imports_what_it_needs_alone() -> None:
    found = imported(FIRST_RUN.format(solver="event-driven"))
    assert rooms(found) == {"core", "laws", "model", "results", "safety", "solvers"}
    assert not found & LIBRARIES
    others = {each.solve.name for each in SOLVERS.values() if isinstance(each.solve, InFile)}
    others = {f"pool_pymunk.solvers.{name}" for name in others - {"event_driven"}}
    assert len(others) == 4 and not found & others


def test_a_run_in_which_a_contact_persists_imports_no_other_engine() -> None:
    assert not rooms(imported(PRESSING)) & {"engine", "physics", "world"}


def test_a_solver_that_is_asked_is_imported() -> None:
    found = imported(FIRST_RUN.format(solver="pymunk-discrete"))
    assert {"pymunk", "pool_pymunk.solvers.pymunk_discrete"} <= found
    assert not rooms(found) & {"engine", "world"}


def test_the_names_of_solvers_import_none_of_them() -> None:
    found = imported("from pool_pymunk import SOLVERS\nassert len(SOLVERS) == 5")
    assert "pool_pymunk.solvers.registry" in found
    assert not rooms(found) & {"engine", "physics", "world"}
    assert "pool_pymunk.core.engine" not in found


def test_importing_the_package_imports_nothing_else() -> None:
    found = imported("import pool_pymunk")
    assert not rooms(found) and "numpy" not in found


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
