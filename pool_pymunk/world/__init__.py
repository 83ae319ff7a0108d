"""This package puts the contact engine into any pymunk space.

Balls are circles there, and walls are static shapes.
"""

from pool_pymunk.world.billiards import Ball, Billiards, ContactEvent, same_balls

__all__ = ["Ball", "Billiards", "ContactEvent", "same_balls"]
