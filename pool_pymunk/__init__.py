"""pool_pymunk: 2D billiards in pymunk, by the report's time slices, and exactly.

>>> from pool_pymunk import load, simulate
>>> scene = load("report")
>>> run = simulate(scene, "Simulation 3", solver="pymunk", dt=1 / 240)
>>> run.status, len(run.events)
('settled', 2)
"""

from pool_pymunk.model import (
    Ball,
    Friction,
    Physics,
    Restitution,
    Scene,
    SceneError,
    Shot,
    State,
    Table,
    Units,
)
from pool_pymunk.model.scenario import load, loads
from pool_pymunk.physics.contact import NT, Pair
from pool_pymunk.physics.laws import Law
from pool_pymunk.report.collide import Collision, Disc, Material, collide, collide_at
from pool_pymunk.results.run import Event, Run
from pool_pymunk.solvers import SOLVERS, SettingError, simulate, simulate_all
from pool_pymunk.studies.sensitivity import Sensitivity, sensitivity
from pool_pymunk.studies.tolerance import Choice, Outcome, choose_step, simulate_within
from pool_pymunk.studies.uncertainty import Uncertainty, written_uncertainty
from pool_pymunk.world import Billiards, same_balls

__version__ = "0.1.0"

__all__ = [
    "NT",
    "SOLVERS",
    "Ball",
    "Billiards",
    "Choice",
    "Collision",
    "Disc",
    "Event",
    "Friction",
    "Law",
    "Material",
    "Outcome",
    "Pair",
    "Physics",
    "Restitution",
    "Run",
    "Scene",
    "SceneError",
    "Sensitivity",
    "SettingError",
    "Shot",
    "State",
    "Table",
    "Uncertainty",
    "Units",
    "choose_step",
    "collide",
    "collide_at",
    "load",
    "loads",
    "same_balls",
    "sensitivity",
    "simulate",
    "simulate_all",
    "simulate_within",
    "written_uncertainty",
]
