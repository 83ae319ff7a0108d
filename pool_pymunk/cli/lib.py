"""This module has the modules of the library that commands use: ``lib.scenario.load``.

--help must come at once, so a module is loaded when it is first asked for. This is the only place
from which commands import what is slow to import. The classes are there for annotations alone.
"""

# The modules are there for others.
# ruff: noqa: F401, I001
# mypy: implicit-reexport

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pool_pymunk import page, render, solvers
    from pool_pymunk.cli import terminal
    from pool_pymunk.model import Point, Scene, SceneError, Shot, Units
    from pool_pymunk.model import inputs, problems, quantities, scenario
    from pool_pymunk.page.live import server
    from pool_pymunk.physics import contact
    from pool_pymunk.render import (
        FilmSettings,
        Show,
        clouds,
        collision,
        diagram,
        heatmap,
        residuals,
    )
    from pool_pymunk.render import atlas as maps
    from pool_pymunk.report import collide, listing
    from pool_pymunk.report.collide import Collision
    from pool_pymunk.results import run, trace, words
    from pool_pymunk.results.run import Run
    from pool_pymunk.studies import atlas, compare, fit, sensitivity, stability, sweep, tolerance
    from pool_pymunk.studies import tradeoff, uncertainty
    from pool_pymunk.studies.compare import Comparison
    from pool_pymunk.studies.fit import Fit
    from pool_pymunk.studies.sensitivity import Linear, Sensitivity, Spread
    from pool_pymunk.studies.stability import table

HOMES = {  # the rooms of these modules, for the time when they are loaded
    "": "page render solvers",
    "cli": "terminal",
    "model": "inputs problems quantities scenario",
    "page.live": "server",
    "physics": "contact",
    "render": "clouds collision diagram heatmap residuals",
    "report": "collide listing",
    "results": "run trace words",
    "studies": "atlas compare fit sensitivity stability sweep tolerance tradeoff uncertainty",
    "studies.stability": "table",
}
PATHS = {name: f"{home}.{name}".strip(".") for home in HOMES for name in HOMES[home].split()}
PATHS["maps"] = "render.atlas"  # The studies have an atlas of their own.


def _load(name: str) -> Any:
    """Return a module by its name."""
    if name not in PATHS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"pool_pymunk.{PATHS[name]}")


if not TYPE_CHECKING:  # A type checker would take it for leave to ask for any name.
    __getattr__ = _load
