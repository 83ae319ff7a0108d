"""A variant of a run has small errors, which are random, but the same ones each time.

So it shows what policies and rounding decide. Python and numba draw the errors alike.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine.decisions import CONVERGED, NEARLY_CLOSED
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE
from pool_pymunk.results.variants import AS_IT_IS as AS_IT_IS
from pool_pymunk.results.variants import Variant as Variant

Motion = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)

# The numbers are those of the minimal standard generator of Park and Miller, Communications of the
# ACM 36 (1993), 108.
MULTIPLIER, MODULUS = 48_271, 2**31 - 1
FIRST = 1_000  # draws are left out, because those of near seeds are alike at first
# of the velocities in a variant with a nudged start: balls that a hit leaves together part later
KICK = 1e-12
GAPS = 1e-13, 4e-6  # m; as wide as gaps at the start (solvers/frozen.py)


class Errors:
    """These are the errors of a variant: a ``share`` of velocities and of places or not.

    ``state`` is that of the random numbers; ``opens`` tells whether groups that are hit get gaps.
    """

    def __init__(self) -> None:
        self.share, self.state, self.of_places, self.opens = 0.0, 1, False, False


def begin_errors(e: Any, variant: Variant) -> None:
    """Let errors be those of a variant."""
    seed = variant.seed if variant.nudge is None else variant.nudge
    e.share, e.state = 0.0 if seed is None else EPSILON, 1
    e.of_places, e.opens = variant.nudge is None, variant.nudge is not None
    if seed is not None:
        e.share = KICK if e.opens else EPSILON
        e.state = seed % (MODULUS - 1) + 1
        for _ in range(FIRST):
            draw(e)


def draw(e: Any) -> float:
    """Return a random number between -1 and 1."""
    e.state = e.state * MULTIPLIER % MODULUS
    return float(2.0 * e.state / MODULUS - 1.0)


def error(e: Any, number: float) -> float:
    """Return a random error of a number."""
    return float(0.5 * e.share * number * draw(e))


def errs(e: Any) -> bool:
    """Tell whether places and velocities have the errors of rounding."""
    return bool(e.share > 0.0 and e.of_places)


def place_met(e: Any, motion: Motion, now: float) -> Motion:
    """Return the motion of a ball at a contact, now (s)."""
    x, y, vx, vy = motion
    if not errs(e):
        return motion
    late = error(e, now)
    return x + error(e, x) + vx * late, y + error(e, y) + vy * late, vx, vy


def nearly_closed(e: Any) -> float:
    """Return how many times as wide as a closed one a gap may be that closes in a moment.

    In a variant the sides of such a gap go on until they meet.
    """
    return 1.0 if errs(e) else NEARLY_CLOSED


def left_out(e: Any) -> float:
    """Return how much is left out of a collapse; a variant leaves out as much again as the run."""
    return 2.0 * CONVERGED if errs(e) else CONVERGED


def velocity_after(e: Any, velocity: Vector, noise: float) -> Vector:
    """Return a new velocity (m/s), of which ``noise`` may be rounding."""
    vx, vy = velocity
    if e.share == 0.0 or (vx == 0.0 and vy == 0.0):
        return velocity
    fastest = noise / NOISE
    return vx + error(e, fastest), vy + error(e, fastest)


def gap_at_hit(e: Any) -> float:
    """Return how far (m) balls in persistent contact are apart when their group is hit."""
    if not e.opens:
        return 0.0
    narrow, wide = GAPS
    share = 0.5 * (1.0 + draw(e))
    return math.exp((1.0 - share) * math.log(narrow) + share * math.log(wide))
