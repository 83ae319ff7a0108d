"""These modules hold scenes in SI units, with their parts, units and problems.

Scenario files are read by :mod:`pool_pymunk.model.scenario`.
"""

from pool_pymunk.model.outline import Table as Table
from pool_pymunk.model.parts import NEAREST as NEAREST
from pool_pymunk.model.parts import STANDARD_GRAVITY as STANDARD_GRAVITY
from pool_pymunk.model.parts import Ball as Ball
from pool_pymunk.model.parts import Friction as Friction
from pool_pymunk.model.parts import Patch as Patch
from pool_pymunk.model.parts import Physics as Physics
from pool_pymunk.model.parts import Pocket as Pocket
from pool_pymunk.model.parts import Post as Post
from pool_pymunk.model.parts import Restitution as Restitution
from pool_pymunk.model.parts import Shot as Shot
from pool_pymunk.model.places import TOUCHING as TOUCHING
from pool_pymunk.model.problems import Point as Point
from pool_pymunk.model.problems import Problem as Problem
from pool_pymunk.model.problems import SceneError as SceneError
from pool_pymunk.model.problems import SettingError as SettingError
from pool_pymunk.model.quantities import UNITS as UNITS
from pool_pymunk.model.quantities import Units as Units
from pool_pymunk.model.scene import Scene as Scene
from pool_pymunk.model.state import State as State
