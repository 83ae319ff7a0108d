"""Variants of a run show what its policies and rounding decide."""

from __future__ import annotations

import math
from typing import NamedTuple

SURE = 4.0  # A figure is this many times the largest change of some runs, which are samples.


class Variant(NamedTuple):
    """A variant of a run shows what policies and rounding decide."""

    seed: int | None = None  # of random errors of places and velocities, of the size of rounding
    nudge: int | None = None  # the number of a nudge of the start (solvers/frozen.py)
    coarser: float = 1.0  # so many times as much is left out of contacts that persist
    #                    (of a solver that plays them to a tolerance: so many times that)
    slip: tuple[float, float] | None = None  # of balls whose slip is rounding, where the law jumps

    @property
    def sure(self) -> float:
        """A figure is this many times the change that this variant shows.

        Variants of a slip are all that there are; others are some of many. If c times as much is
        left out, errors are at least sqrt(c) times as large: bounces have the square of a speed as
        their height. So the run errs by at most the change over sqrt(c) - 1. If less is left out,
        the change is nearly all of the error.
        """
        if self.slip is not None:
            return 1.0
        return SURE if self.coarser <= 1.0 else SURE / (math.sqrt(self.coarser) - 1.0)


AS_IT_IS = Variant()

# These show how far contacts that persist put the ends off: to finer tolerances, or where a solver
# has none, with much more that is left out.
FINER = tuple(Variant(coarser=share) for share in (1 / 3, 0.1))
COARSER = tuple(Variant(coarser=times) for times in (30.0, 300.0))
