"""This module finds the side of a wall that a ball meets, and coefficients, in compiled shots."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.fast.kinds import gap
from pool_pymunk.fast.records import Sides


def nearest(sides: Sides, side: Any, x: float, y: float, r: float) -> Any:
    """Return the side of the same wall whose surface is nearest to a ball."""
    found, least = side.first, math.inf
    if side.last > side.first + 1:
        for k in range(side.first, side.last):
            far = abs(gap(sides[k], x, y, r))
            if far < least:
                found, least = k, far
    return sides[found]


def coefficients(side: Any, scene: Any) -> tuple[float, float]:
    """Return restitution and friction of a wall: its own, or those of the scene."""
    has_e, has_mu = owns(side)
    e, mu = scene.cushion, scene.cushion_friction
    return side.own[0] if has_e else e, side.own[1] if has_mu else mu


def owns(side: Any) -> tuple[bool, bool]:
    """Tell whether a wall has its own restitution, and whether it has its own friction."""
    return len(side.own) > 0 and side.own[0] >= 0.0, len(side.own) > 0 and side.own[1] >= 0.0
