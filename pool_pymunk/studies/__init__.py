"""Studies measure the errors and costs of solvers, the effects of inputs, and when solvers fail."""

import math

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def known(value: float) -> float | None:
    """Return a number for JSON: None, which JSON writes as null, where it is not finite."""
    return value if math.isfinite(value) else None
