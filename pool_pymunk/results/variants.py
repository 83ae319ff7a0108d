"""Variants of a run show what its policies and rounding decide."""

from __future__ import annotations

from typing import NamedTuple

SURE = 4.0  # A figure is this many times the largest change of some runs, which are samples.
SURE_OF_FINER = 10.0  # There are only two of them. A factor of 8 missed 1 of 232 runs, 12 none.


class Variant(NamedTuple):
    """A variant of a run shows what policies and rounding decide."""

    seed: int | None = None  # of random errors of places and velocities, of the size of rounding
    nudge: int | None = None  # the number of a nudge of the start (solvers/frozen.py)
    coarser: float = 1.0  # The tolerance of contacts that persist is so many times as large.
    slip: tuple[float, float] | None = None  # of balls whose slip is rounding, where the law jumps

    @property
    def sure(self) -> float:
        """A figure is this many times the change that this variant shows.

        Variants of a slip are all that there are; others are some of many. If less is left out of
        contacts that persist, the change is nearly all of the error, unless chance is in it.
        """
        if self.coarser != 1.0:
            return SURE_OF_FINER
        return 1.0 if self.slip is not None else SURE


AS_IT_IS = Variant()

# These show how far contacts that persist put the ends off. With the smaller one, runs play
# one bounce more, too: with e = 0.03 it has 1e-3 of the energy of the bounce before.
FINER = tuple(Variant(coarser=share) for share in (0.1, 1e-3))
