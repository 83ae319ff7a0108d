"""A surface says how a ball moves on it when nothing touches the ball."""

from __future__ import annotations

from typing import NamedTuple

from pool_pymunk.physics.motion import Vector
from pool_pymunk.physics.path import Path, set_off


class Sliding(NamedTuple):
    """On this surface balls slide straight on, and lose speed at a ``deceleration`` (m/s^2)."""

    deceleration: float = 0.0

    def path(self, t: float, position: Vector, velocity: Vector) -> Path:
        """Return the path of a ball that sets off at ``t`` (s), or rests there."""
        return set_off(t, position, velocity, self.deceleration)
