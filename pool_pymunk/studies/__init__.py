"""Studies measure what a solver errs and costs, what an input is worth, and where solvers break."""

import math

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def known(value: float) -> float | None:
    """Return a number as JSON has it, which is null (None) where it is not finite."""
    return value if math.isfinite(value) else None
