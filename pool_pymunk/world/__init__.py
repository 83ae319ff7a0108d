"""This package puts the contact engine into any pymunk space.

Balls are circles there, and walls are static shapes.
"""

from pool_pymunk.world.ball import Ball, ContactEvent, TableState, same_balls
from pool_pymunk.world.billiards import Billiards
from pool_pymunk.world.outlook import Prediction

__all__ = ["Ball", "Billiards", "ContactEvent", "Prediction", "TableState", "same_balls"]
