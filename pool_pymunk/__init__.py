"""pool_pymunk plays 2D billiards in pymunk, by a report's time slices, and exactly.

>>> from pool_pymunk import load, simulate
>>> scene = load("report")
>>> run = simulate(scene, "Simulation 3", solver="pymunk", dt=1 / 240)
>>> run.status, len(run.events)
('settled', 2)
"""

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pool_pymunk.core import compiled as compiled  # bool, and no name for `import *`
    from pool_pymunk.laws import NT, Law, Pair
    from pool_pymunk.many import Batch, simulate_many
    from pool_pymunk.model import (
        Ball,
        Friction,
        Patch,
        Physics,
        Pocket,
        Post,
        Restitution,
        Scene,
        SceneError,
        Shot,
        State,
        Table,
        Units,
    )
    from pool_pymunk.model.racks import rack
    from pool_pymunk.model.scenario import load, loads
    from pool_pymunk.report.collide import Collision, Disc, Material, collide, collide_at
    from pool_pymunk.results.contacts import ContactRow
    from pool_pymunk.results.events import Event
    from pool_pymunk.results.persistent import PersistentContact
    from pool_pymunk.results.run import Run
    from pool_pymunk.solvers import SOLVERS, SettingError, simulate, simulate_all
    from pool_pymunk.studies.atlas import Atlas, atlas
    from pool_pymunk.studies.derivatives import Derivatives
    from pool_pymunk.studies.find import Found, find
    from pool_pymunk.studies.fit import Fit, fit
    from pool_pymunk.studies.sensitivity import Sensitivity, sensitivity
    from pool_pymunk.studies.sweep import Sweep, sweep
    from pool_pymunk.studies.tolerance import Choice, Outcome, choose_step, simulate_within
    from pool_pymunk.studies.uncertainty import Uncertainty, written_uncertainty
    from pool_pymunk.studies.variation import Between, Grid, Normal, Uniform, Variation
    from pool_pymunk.world import Billiards, same_balls

__version__ = "1.0.0rc1"

__all__ = [
    "NT",
    "SOLVERS",
    "Atlas",
    "Ball",
    "Batch",
    "Between",
    "Billiards",
    "Choice",
    "Collision",
    "ContactRow",
    "Derivatives",
    "Disc",
    "Event",
    "Fit",
    "Found",
    "Friction",
    "Grid",
    "Law",
    "Material",
    "Normal",
    "Outcome",
    "Pair",
    "Patch",
    "PersistentContact",
    "Physics",
    "Pocket",
    "Post",
    "Restitution",
    "Run",
    "Scene",
    "SceneError",
    "Sensitivity",
    "SettingError",
    "Shot",
    "State",
    "Sweep",
    "Table",
    "Uncertainty",
    "Uniform",
    "Units",
    "Variation",
    "atlas",
    "choose_step",
    "collide",
    "collide_at",
    "compile",
    "find",
    "fit",
    "load",
    "loads",
    "rack",
    "same_balls",
    "sensitivity",
    "simulate",
    "simulate_all",
    "simulate_many",
    "simulate_within",
    "sweep",
    "written_uncertainty",
]

# A module is imported when one of its names is first used, so that --help does not wait for it.
_HOMES = {
    "core": "compiled",
    "laws": "Law NT Pair",
    "many": "Batch simulate_many",
    "model": "Ball Friction Patch Physics Pocket Post Restitution Scene SceneError Shot State Table"
    " Units",
    "model.racks": "rack",
    "model.scenario": "load loads",
    "report.collide": "Collision Disc Material collide collide_at",
    "results.contacts": "ContactRow",
    "results.persistent": "PersistentContact",
    "results.events": "Event",
    "results.run": "Run",
    "solvers": "SOLVERS SettingError simulate simulate_all",
    "studies.atlas": "Atlas atlas",
    "studies.derivatives": "Derivatives",
    "studies.find": "Found find",
    "studies.fit": "Fit fit",
    "studies.sensitivity": "Sensitivity sensitivity",
    "studies.sweep": "Sweep sweep",
    "studies.tolerance": "Choice Outcome choose_step simulate_within",
    "studies.uncertainty": "Uncertainty written_uncertainty",
    "studies.variation": "Between Grid Normal Uniform Variation",
    "world": "Billiards same_balls",
}


def compile(*_: object, **__: object) -> None:  # noqa: A001  It is called by its full name.
    """Do nothing: what it compiled is compiled when the package is built."""
    message = "compile() does nothing any more: the core is compiled when the package is built"
    warnings.warn(message, DeprecationWarning, stacklevel=2)


def _load(name: str) -> Any:
    """Return what the package exports under this name, and keep it here."""
    for home, names in _HOMES.items():
        if name in names.split():
            found = globals()[name] = getattr(import_module(f"{__name__}.{home}"), name)
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


if not TYPE_CHECKING:  # Then a type checker would accept any name.
    __getattr__ = _load
