"""This module has the statistics of a fit whose data may have blunders: scale, errors, blindness.

The loss is Cauchy's. What it makes of an error r is psi(r) = r / (1 + (r / (CAUCHY scale))^2): an
error that is far beyond the scale hardly counts.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.motion import Array

Mask = NDArray[np.bool_]

# Cauchy's loss with this constant is 95 % as good as plain least squares where errors are normal.
# The other three are the means of psi^2, psi' and psi/x of a standard normal x, with
# psi = x / (1 + (x / CAUCHY)^2).
CAUCHY = 2.385
PSI_SQUARED, PSI_SLOPE, WEIGHT = 0.51195288, 0.69739269, 0.87739713
MEDIAN = 0.6744898  # the median size of a standard normal number
ROUNDS = 200  # So often a scale is put into its own equation.
SETTLED = 1e-6  # It is found when it changes by less than this share.
RARE = 3.0902  # standard deviations, which a normal number passes once in a thousand times
EXACT = 1e-12  # m; errors are never taken for smaller
NOTHING = 1e-13  # of the largest derivative; rounding is smaller
SAME = 1e-7  # Directions that matter less than this share of the strongest one do not matter.


def weights(residuals: Array, scale: float) -> Array:
    """Return psi(r) / r: 1 for what is near, and almost 0 for a blunder."""
    return np.asarray(1.0 / (1.0 + (residuals / (CAUCHY * scale)) ** 2))


def first_scale(residuals: Array, free: int) -> float:
    """Return a first guess of the errors' standard deviation (m): it is that of the median."""
    spare = len(residuals) - free
    if spare <= 0:
        return max(math.sqrt(float((residuals**2).mean())) if len(residuals) else 0.0, EXACT)
    typical = float(np.median(np.abs(residuals))) / MEDIAN
    return max(typical * math.sqrt(len(residuals) / spare), EXACT)


def robust_scale(residuals: Array, scale: float, free: int) -> float | None:
    """Return the standard deviation (m) of errors, from a guess of it; None if all seem blunders.

    It is Huber's proposal 2 with Cauchy's psi: the scale that agrees with itself.
    """
    for _ in range(ROUNDS):
        weight = weights(residuals, scale)
        spare = float(weight.sum()) / WEIGHT - free
        if spare <= 0.0:
            return None
        last = scale
        scale = math.sqrt(float(((weight * residuals) ** 2).sum()) / PSI_SQUARED / spare)
        scale = max(scale, EXACT)
        if abs(scale - last) <= SETTLED * last:
            break
    return scale


def covariances(jacobian: Array, residuals: Array, scale: float) -> Array:
    """Return the covariances (P, P) of fitted numbers; nan for those that the data do not tell.

    They are sigma^2 (J^T W J)^-1 with Cauchy's weights, so what is far off tells nothing, and with
    what the robust loss costs where errors are normal (P. J. Huber, Robust Statistics, 1981,
    chapter 7).
    """
    weight = weights(residuals, scale) / WEIGHT
    strength = np.sqrt((jacobian**2).sum(axis=0))
    strength[strength == 0.0] = 1.0
    scaled = jacobian / strength
    information = scaled.T @ (weight[:, np.newaxis] * scaled)
    found = np.linalg.pinv(information, rcond=SAME**2, hermitian=True)
    found *= scale**2 * PSI_SQUARED / PSI_SLOPE**2 / np.outer(strength, strength)
    unknown = np.diagonal(blind_part(jacobian)) > SAME
    found[unknown], found[:, unknown] = math.nan, math.nan
    return np.asarray(found)


def excess(residuals: Array, sigma: float, free: int) -> float:
    """Return the root mean square of what remains, in standard deviations ``sigma`` (m).

    It is 0 where nothing is left over that could tell.
    """
    spare = len(residuals) - free
    return math.sqrt(float(((residuals / sigma) ** 2).sum()) / spare) if spare > 0 else 0.0


def largest_excess(spare: int) -> float:
    """Return the excess that normal errors pass once in a thousand times.

    It is the quantile of chi-squared by E. B. Wilson and M. M. Hilferty, PNAS 17, 1931, 684.

    >>> round(largest_excess(10), 3), round(largest_excess(1000), 3)
    (1.725, 1.07)
    """
    share = 2.0 / (9.0 * spare)
    return math.sqrt((1.0 - share + RARE * math.sqrt(share)) ** 3)


def blind_part(jacobian: Array) -> Array:
    """Return the matrix (P, P) that keeps of a change only what nothing measured notices.

    >>> blind_part(np.array([[1.0, 0.0], [2.0, 0.0]])).round(6).tolist()
    [[0.0, 0.0], [0.0, 1.0]]
    """
    largest = np.abs(jacobian).max(initial=0.0)
    jacobian = np.where(np.abs(jacobian) > NOTHING * largest, jacobian, 0.0)
    lengths = np.sqrt((jacobian**2).sum(axis=0))
    lengths[lengths == 0.0] = 1.0
    _, singular, directions = np.linalg.svd(jacobian / lengths)
    strength = np.zeros(len(directions))
    strength[: len(singular)] = singular
    unseen = directions[strength <= SAME * strength.max(initial=0.0)] / lengths
    basis = np.linalg.qr(unseen.T)[0]
    return np.asarray(basis @ basis.T)


def hanging(jacobian: Array) -> Mask:
    """Tell which data depend on something, by more than rounding.

    >>> hanging(np.array([[1.0, 0.0], [0.0, 1e-17], [0.0, 0.0]])).tolist()
    [True, False, False]
    """
    strength = np.abs(jacobian).max(axis=1, initial=0.0)
    return np.asarray(strength > SAME * strength.max(initial=0.0))


def told(jacobian: Array) -> int:
    """Return how many numbers, or combinations of them, the data tell.

    >>> told(np.array([[1.0, 0.0], [2.0, 0.0]]))
    1
    """
    blind: float = np.trace(blind_part(jacobian))
    return int(jacobian.shape[1] - round(blind))
