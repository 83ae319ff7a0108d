"""A policy answers what has no exact answer; variants of a run have other policies.

The engine asks its policy for errors, and does not know which one it is.
"""

from __future__ import annotations

import math
from random import Random
from typing import NamedTuple

from pool_pymunk.engine.recorder import Motion
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.errors import SURE
from pool_pymunk.physics.laws import Slip
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE


class Variant(NamedTuple):
    """A variant of a run shows what policies and rounding decide."""

    seed: int | None = None  # of random errors of places and velocities, of the size of rounding
    nudge: int | None = None  # the number of a nudge of the start (solvers/frozen.py)
    coarser: float = 1.0  # so many times as much is left out of contacts that persist
    slip: Slip | None = None  # of balls whose slip is rounding, where the law jumps

    @property
    def sure(self) -> float:
        """A figure is this many times the change that this variant shows.

        Variants of a slip are all that there are, and what is coarser errs by more; other variants
        are some of many.
        """
        return SURE if self.slip is None and self.coarser == 1.0 else 1.0

    @property
    def policy(self) -> RandomErrors:
        """The errors of this variant."""
        return RandomErrors(self.seed) if self.nudge is None else Kicks(self.nudge)


AS_IT_IS = Variant()


class RandomErrors:
    """These are random errors of places and velocities, of rounding size; 0 without a seed."""

    size = EPSILON  # of a number

    def __init__(self, seed: int | None = None) -> None:
        self.random = None if seed is None else Random(seed)

    def place(self, motion: Motion, now: float) -> Motion:
        """Return the motion of a ball at a contact."""
        if self.random is None:
            return motion
        (x, y, vx, vy), late = motion, self._error(now)
        return x + self._error(x) + vx * late, y + self._error(y) + vy * late, vx, vy

    def velocity(self, velocity: Vector, noise: float) -> Vector:
        """Return a new velocity (m/s), of which ``noise`` may be rounding."""
        if self.random is None or velocity == (0.0, 0.0):
            return velocity
        fastest, (vx, vy) = noise / NOISE, velocity
        return vx + self._error(fastest), vy + self._error(fastest)

    def gap(self) -> float:
        """Return how far (m) balls in persistent contact are apart when their group is hit."""
        return 0.0

    def _error(self, number: float) -> float:
        """Return a random error of a number."""
        assert self.random is not None, "there is a seed"
        return 0.5 * self.size * number * self.random.uniform(-1.0, 1.0)


class Kicks(RandomErrors):
    """These are larger errors of velocities alone: balls that a hit leaves together part later."""

    size = 1e-12
    gaps = (1e-13, 4e-6)  # m; as wide as gaps at the start (solvers/frozen.py)

    def place(self, motion: Motion, now: float) -> Motion:
        return motion

    def gap(self) -> float:
        narrow, wide = map(math.log, self.gaps)
        assert self.random is not None, "there is a seed"
        return math.exp(self.random.uniform(narrow, wide))


PLAIN = RandomErrors()
