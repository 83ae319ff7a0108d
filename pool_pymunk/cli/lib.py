"""Commands use modules of the library through this one, as in ``lib.scenario.load``.

--help must come at once, so a module is loaded when it is first asked for. This is the only place
from which commands import what is slow to import. Classes serve for annotations alone.
"""

# Commands use what is imported here.
# ruff: noqa: F401, I001
# mypy: implicit-reexport

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table as Printed

    from pool_pymunk import page, render, solvers
    from pool_pymunk.cli import terminal
    from pool_pymunk.many import workers
    from pool_pymunk.model import Point, Scene, Shot, Units
    from pool_pymunk.model import inputs, problems, quantities, scenario, schema
    from pool_pymunk.page.live import server
    from pool_pymunk.laws import contact
    from pool_pymunk.render import clouds, collision, diagram, residuals
    from pool_pymunk.render import atlas as maps
    from pool_pymunk.report import collide, listing
    from pool_pymunk.results import contacts, run, table, trace, words
    from pool_pymunk.results.run import Run
    from pool_pymunk.results.table import TableColumn
    from pool_pymunk.studies import atlas, compare, fit, grid, sensitivity, sweep, tolerance
    from pool_pymunk.studies import uncertainty
    from pool_pymunk.studies.sensitivity import Linear, Sensitivity
    from pool_pymunk.studies.stability import extremes, suite
else:
    MODULES = """
        page render solvers cli.terminal many.workers model.inputs model.problems model.quantities
        model.scenario model.schema page.live.server laws.contact render.clouds render.collision
        render.diagram render.residuals report.collide report.listing results.contacts results.run
        results.table results.trace results.words studies.atlas studies.compare studies.fit
        studies.grid studies.sensitivity studies.stability.extremes studies.stability.suite
        studies.sweep studies.tolerance studies.uncertainty
    """
    PATHS = {path.rpartition(".")[2]: path for path in MODULES.split()}
    PATHS["maps"] = "render.atlas"  # The studies have an atlas of their own.

    def __getattr__(name: str) -> Any:
        """Return a module by its name."""
        if name not in PATHS:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return import_module(f"pool_pymunk.{PATHS[name]}")
