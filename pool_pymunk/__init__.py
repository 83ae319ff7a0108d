"""pool_pymunk: 2D billiards in pymunk, by the report's time slices, and exactly.

>>> from pool_pymunk import load, simulate
>>> scene = load("report")
>>> run = simulate(scene, "Simulation 3", solver="pymunk", dt=1 / 240)
>>> run.status, len(run.events)
('settled', 2)
"""

from pool_pymunk.result import Event, Run
from pool_pymunk.scenario import load, loads
from pool_pymunk.scene import (
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
from pool_pymunk.solvers import SOLVERS, SettingError, simulate, simulate_all

__version__ = "0.1.0"

__all__ = [
    "SOLVERS",
    "Ball",
    "Event",
    "Friction",
    "Physics",
    "Restitution",
    "Run",
    "Scene",
    "SceneError",
    "SettingError",
    "Shot",
    "State",
    "Table",
    "Units",
    "load",
    "loads",
    "simulate",
    "simulate_all",
]
