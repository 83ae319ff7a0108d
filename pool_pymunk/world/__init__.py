"""The contact engine in any pymunk space: balls are circles, walls are static shapes."""

from pool_pymunk.world.billiards import Ball, Billiards, ContactEvent, same_balls

__all__ = ["Ball", "Billiards", "ContactEvent", "same_balls"]
