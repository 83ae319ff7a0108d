"""This package puts the contact engine into any pymunk space.

Balls are circles there, and walls are shapes of static or kinematic bodies.
"""

import warnings

from pool_pymunk.world.ball import ContactEvent, TableBall, TableState, same_balls
from pool_pymunk.world.billiards import Billiards
from pool_pymunk.world.outlook import Prediction

__all__ = ["Billiards", "ContactEvent", "Prediction", "TableBall", "TableState", "same_balls"]


def __getattr__(name: str) -> type[TableBall]:
    if name != "Ball":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("pool_pymunk.world.Ball is now TableBall", DeprecationWarning, stacklevel=2)
    return TableBall
