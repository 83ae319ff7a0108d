"""This module keeps the solvers by their names."""

from __future__ import annotations

from pool_pymunk.model.problems import setting_error, suggestion
from pool_pymunk.solvers import event_driven, pymunk_builtin, pymunk_space, time_slice
from pool_pymunk.solvers.record import Solver

SOLVERS: dict[str, Solver] = {
    solver.name: solver
    for solver in (
        pymunk_space.SWEPT,
        pymunk_space.DISCRETE,
        pymunk_builtin.SOLVER,
        event_driven.SOLVER,
        time_slice.SOLVER,
    )
}


def find_solver(name: str) -> Solver:
    """Return the solver of that name."""
    if not isinstance(name, str) or name not in SOLVERS:
        known = f"({', '.join(SOLVERS)}){suggestion(name, SOLVERS)}"
        raise setting_error("solver", name, f"there is no such solver {known}")
    return SOLVERS[name]


def yardstick() -> Solver:
    """Return the exact solver without a step, by which the others are measured."""
    return next(solver for solver in SOLVERS.values() if solver.is_yardstick)
