"""Balls fall where gravity acts, or a table is tilted: all have one constant acceleration."""

from __future__ import annotations

from typing import final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.motion.times import INF, Vector, length_of


@final
class Falling(Surface):
    """Balls fall at (``gx``, ``gy``) (m/s^2), on parabolas and without friction.

    Seen from each other, two balls that fall move on straight lines. A ball rests only where
    something holds it: then it is in a group that sleeps.

    >>> Falling(0.0, -10.0).path(0.0, (0.0, 5.0), (1.0, 0.0), (0.0, 0.0)).at(1.0)
    (1.0, 0.0, 1.0, -10.0)
    """

    def __init__(self, gx: float, gy: float) -> None:
        super().__init__(length_of(gx, gy), 0.0, False)
        self.gx = gx
        self.gy = gy

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        x, y = place
        vx, vy = velocity
        return Path(t, x, y, vx, vy, self.gx, self.gy, INF, False, 0.0, 0.0)
