"""These modules hold scenes in SI units, with their parts, units and problems.

Scenario files are read by :mod:`pool_pymunk.model.scenario`.
"""

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import (
    NEAREST,
    STANDARD_GRAVITY,
    Ball,
    Friction,
    Patch,
    Physics,
    Pocket,
    Post,
    Restitution,
    Shot,
)
from pool_pymunk.model.places import TOUCHING
from pool_pymunk.model.problems import Point, Problem, SceneError, SettingError
from pool_pymunk.model.quantities import UNITS, Units
from pool_pymunk.model.scene import Scene
from pool_pymunk.model.state import State

__all__ = [
    "NEAREST",
    "STANDARD_GRAVITY",
    "TOUCHING",
    "UNITS",
    "Ball",
    "Friction",
    "Patch",
    "Physics",
    "Pocket",
    "Point",
    "Post",
    "Problem",
    "Restitution",
    "Scene",
    "SceneError",
    "SettingError",
    "Shot",
    "State",
    "Table",
    "Units",
]
