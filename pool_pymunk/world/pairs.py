"""This module has the coefficients of a hit of two balls on a table of one's own."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import Pair
from pool_pymunk.world.checks import read_from_zero, read_share, read_size


@dataclass(frozen=True)
class SameBalls:
    """These are the pairs of a table whose balls are all alike; see :func:`same_balls`."""

    pair: Pair

    def __call__(self, i: int, j: int) -> Pair:
        """Return the pair of any two balls."""
        return self.pair


def same_balls(restitution: float, friction: float, mass: float | None = None) -> SameBalls:
    """Return the ``pair`` of a table whose balls are all alike.

    Without a ``mass`` (kg) it is that of the bodies.

    >>> same_balls(0.9, 0.05, mass=0.2)(0, 1)
    Pair(m_a=0.2, m_b=0.2, restitution=0.9, friction=0.05)
    """
    m = math.nan if mass is None else read_size("mass", mass)
    e = read_share("restitution", restitution)
    return SameBalls(Pair(m, m, e, read_from_zero("friction", friction)))


def check_pair(pair: Pair, masses: tuple[float, float], numbers: tuple[int, int]) -> Pair:
    """Return the pair with the masses of the bodies; refuse a pair that says otherwise."""
    said = (pair.m_a, pair.m_b)
    for mass, own, i in zip(said, masses, numbers, strict=True):
        if not math.isnan(mass) and mass != own:
            message = f"the body of ball {i} has a mass of {own:g} kg"
            raise setting_error("pair", f"a mass of {mass:g} kg", message)
    return pair._replace(m_a=masses[0], m_b=masses[1])
