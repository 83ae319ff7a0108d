"""This module doubts a fit: it says what the data cannot tell, and which errors mean little.

It has the statistics of data that may have blunders. The loss is Cauchy's: an error r counts as
psi(r) = r / (1 + (r / (CAUCHY scale))^2), which is small for an error far beyond the scale.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from itertools import compress
from typing import Any

import numpy as np

from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import TABLE, parts
from pool_pymunk.model.problems import listed
from pool_pymunk.results.words import counted
from pool_pymunk.studies import Mask
from pool_pymunk.studies.measured import Forecast

# Cauchy's loss with this constant has 95 % of the efficiency of least squares for normal errors.
# The other three are the means of psi^2, psi' and psi/x of a standard normal x, with
# psi = x / (1 + (x / CAUCHY)^2).
CAUCHY = 2.385
PSI_SQUARED, PSI_SLOPE, WEIGHT = 0.51195288, 0.69739269, 0.87739713
MEDIAN = 0.6744898  # the median size of a standard normal number
ROUNDS, SETTLED = 200, 1e-6  # iterations of a scale, until it changes by no more than this share
RARE = 1e-3  # Normal errors exceed the largest excess once in a thousand times.
EXACT = 1e-12  # m; the scale of errors is never less: some thousand units of rounding of a table
NOTHING = 1e-13  # of the largest derivative; what is smaller is rounding, some hundred units
SAME = 1e-7  # of the strongest direction: some roots of rounding, because derivatives are squared

# These limits decide only what is said of a fit. They were chosen.
FAR = 5.0  # sigma; a normal number is farther off once in two million times
ALIKE = 0.99  # the correlation above which numbers are distinguished badly
UPHILL = 0.5  # standard errors; a fit whose next step would be longer is not at a minimum
BENT = 0.5  # of the predicted change; where places miss it by more, the derivatives mislead
# of the smallest radius: a picture in which a ball is twenty pixels wide shows its centre to a
# pixel, so errors of measurement are smaller.
COARSE = 0.1
ROUNDING = 1e-9  # m; nobody measures places better, so what is smaller is rounding


def scipy(part: str) -> Any:
    """Return a part of SciPy, or say how to get it."""
    return _library(f"scipy.{part}", "SciPy")


def on_one_thread() -> Any:
    """Keep linear algebra on one thread: with tall thin matrices, others mostly wait for it."""
    scipy("optimize")  # Only what is imported can be kept.
    return _library("threadpoolctl", "threadpoolctl").threadpool_limits(1, "blas")


def _library(module: str, name: str) -> Any:
    try:
        return import_module(module)
    except ImportError:
        raise ImportError(f"fit needs {name}: pip install 'pool-pymunk[fit]'") from None


def weights(residuals: Array, scale: float) -> Array:
    """Return psi(r) / r: about 1 for a small residual, and almost 0 for a blunder."""
    return np.asarray(1.0 / (1.0 + (residuals / (CAUCHY * scale)) ** 2))


def loss(residuals: Array, scale: float) -> float:
    """Return Cauchy's loss for errors of this scale (m)."""
    return float(np.log1p((residuals / (CAUCHY * scale)) ** 2).sum())


def robust_scale(residuals: Array, scale: float, free: int) -> float | None:
    """Return the errors' scale (m), Huber's proposal 2, from a guess; None: all seem blunders."""
    for _ in range(ROUNDS):
        last, weight = scale, weights(residuals, scale)
        spare = float(weight.sum()) / WEIGHT - free
        if spare <= 0.0:
            return None
        squares = float(((weight * residuals) ** 2).sum())
        scale = max(math.sqrt(squares / PSI_SQUARED / spare), EXACT)
        if abs(scale - last) <= SETTLED * last:
            break
    return scale


def covariances(jacobian: Array, residuals: Array, scale: float) -> Array:
    """Return the covariances (P, P) of fitted numbers; nan for those that the data do not tell.

    They are sigma^2 (J^T W J)^-1 with Cauchy's weights, times the factor by which the robust loss
    raises them for normal errors (P. J. Huber, Robust Statistics, 1981, chapter 7).
    """
    scaled, strength = _of_equal_length(jacobian)
    weight = weights(residuals, scale) / WEIGHT
    information = scaled.T @ (weight[:, np.newaxis] * scaled)
    found = np.linalg.pinv(information, rcond=SAME**2, hermitian=True)
    found *= scale**2 * PSI_SQUARED / PSI_SLOPE**2 / np.outer(strength, strength)
    unknown = np.diagonal(blind_part(jacobian)) > SAME
    found[unknown], found[:, unknown] = math.nan, math.nan
    return np.asarray(found)


def excess(residuals: Array, sigma: float, free: int) -> float:
    """Return the root mean square residual in units of ``sigma`` (m); 0 if no data are spare."""
    spare = len(residuals) - free
    return math.sqrt(float(((residuals / sigma) ** 2).sum()) / spare) if spare > 0 else 0.0


def largest_excess(spare: int) -> float:
    """Return the excess that normal errors pass once in a thousand times: a quantile of chi."""
    return float(math.sqrt(scipy("special").chdtri(spare, RARE) / spare))


def blind_part(jacobian: Array) -> Array:
    """Return the projection (P, P) onto the changes that move no measured place.

    >>> blind_part(np.array([[1.0, 0.0], [2.0, 0.0]])).round(6).tolist()
    [[0.0, 0.0], [0.0, 1.0]]
    """
    largest = np.abs(jacobian).max(initial=0.0)
    seen = np.where(np.abs(jacobian) > NOTHING * largest, jacobian, 0.0)
    scaled, lengths = _of_equal_length(seen)
    _, singular, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    strength = np.pad(singular, (0, len(directions) - len(singular)))
    unseen = directions[strength <= SAME * strength.max(initial=0.0)] / lengths
    basis = np.linalg.qr(unseen.T)[0]
    return np.asarray(basis @ basis.T)


def _of_equal_length(jacobian: Array) -> tuple[Array, Array]:
    """Return a matrix with its columns divided by their lengths, and these (1 instead of 0)."""
    lengths = np.sqrt((jacobian**2).sum(axis=0))
    lengths[lengths == 0.0] = 1.0
    return jacobian / lengths, lengths


class Optimum:
    """An optimum is where a fit of ``used`` (M,) places ends; ``sigma`` (m) is their error.

    ``residuals`` (M, 2) are measured less fitted places (m), and ``off`` (2 U,) those that are
    used. ``jacobian`` (2 U, P) are the derivatives of the fitted places, 0 where there is none, and
    ``scaled`` those by the numbers in units of ``Forecast.sizes``. ``blind`` (P, P) projects their
    changes onto those that move no measured place. ``depends`` (2 U,) says which data depend on a
    free number by more than rounding; they determine ``rank`` numbers, and ``spare`` of them are
    left over. ``knows_sigma`` says whether the error is stated or can be estimated.
    """

    def __init__(
        self, forecast: Forecast, values: Array, used: Mask, sigma: float, stated: bool = False
    ) -> None:
        self.forecast, self.values, self.used = forecast, values, used
        self.sigma, self.stated = sigma, stated
        self.residuals = forecast.residuals(values)
        self.off: Array = self.residuals[used].ravel()
        self.jacobian = forecast.jacobian(values, used)
        self.scaled: Array = self.jacobian * forecast.sizes
        self.blind = blind_part(self.scaled)
        strength = np.abs(self.scaled).max(axis=1, initial=0.0)
        self.depends: Mask = strength > SAME * strength.max(initial=0.0)
        self.rank = len(values) - round(float(np.trace(self.blind)))
        self.spare = int(self.depends.sum()) - self.rank
        self.knows_sigma = stated or self.spare > 0

    def scale(self, last: float | None) -> float:
        """Estimate the errors' scale (m) from data that depend on a free number, if one is free."""
        off = self.off[self.depends] if len(self.values) else self.off
        if last and (robust := robust_scale(off, last, self.rank)):
            return robust
        count, spare = len(off), len(off) - self.rank
        if spare > 0:  # the scale by the median
            return max(float(np.median(np.abs(off))) / MEDIAN * math.sqrt(count / spare), EXACT)
        return max(math.sqrt(float((off**2).mean())) if count else 0.0, EXACT)

    @property
    def excess(self) -> float:
        """The root mean square residual, blunders included, in units of sigma."""
        return excess(self.off[self.depends], self.sigma, self.rank)

    @property
    def is_coarse(self) -> bool:
        """Tell whether an error that nobody has stated is too large to be one of measurement."""
        radius = min(ball.radius for ball in self.forecast.scene.balls)
        return not self.stated and self.knows_sigma and self.sigma > COARSE * radius

    @property
    def is_plausible(self) -> bool:
        """Tell whether errors of measurement may explain the residuals."""
        if self.spare <= 0 or np.abs(self.off).max(initial=0.0) <= ROUNDING:
            return True
        return self.excess <= largest_excess(self.spare) and not self.is_coarse

    @cached_property
    def covariance(self) -> Array:
        """The covariances (P, P) of the fitted numbers; nan is what is not known."""
        found, sizes = covariances(self.scaled, self.off, self.sigma), self.forecast.sizes
        if not self.knows_sigma:
            found[:] = np.nan
        return np.asarray(found * np.outer(sizes, sizes))

    @cached_property
    def errors(self) -> Array:
        """The standard errors (P,) of the fitted numbers."""
        return np.sqrt(np.diagonal(self.covariance))

    @cached_property
    def correlations(self) -> Array:
        """The correlations (P, P) of the fitted numbers."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.covariance / np.outer(self.errors, self.errors))


def doubts(found: Optimum) -> Iterator[str]:
    """Say all that is to be doubted, a sentence each."""
    for doubt in (_unfitted, _undetermined, _loose, _bent, _implausible):
        yield from doubt(found)


def _unfitted(found: Optimum) -> Iterator[str]:
    """Name the places that could not be fitted to."""
    out = ~found.used
    if out.any():
        _, why = found.forecast.derivatives(found.values)
        places = f"{int(out.sum())} of {len(out)} places are left out, because it is not known how"
        what = f"{places} they depend on what is free ({_places(found, out)})"
        yield "; ".join((what, *why))


def _undetermined(found: Optimum) -> Iterator[str]:
    """Name what no measured place depends on, and what cannot be distinguished."""
    unknown = set(np.flatnonzero(np.diagonal(found.blind) > SAME).tolist())
    while unknown:
        first = min(unknown)
        group = sorted(k for k in unknown if abs(found.blind[first, k]) > SAME)
        unknown -= set(group)
        *names, last = [found.forecast.names[k] for k in group]
        if names:
            them = f"{', '.join(names)} and {last}"
            yield f"{them}: the data tell only a combination of them, so one must be given"
        else:
            yield f"{last}: {_why(found, last)}"
    if found.rank and not found.knows_sigma:
        data = counted(int(found.depends.sum()), "measured coordinate")
        numbers = counted(found.rank, "number")
        yield f"{numbers} fitted to {data}: none is left over, so the errors are not known"


def _places(found: Optimum, which: Mask) -> str:
    """Name places by shot and ball."""
    by_shot: dict[str, dict[str, None]] = {}
    runs = found.forecast.runs(found.values) or {}
    for one in compress(found.forecast.measured, which):
        by_shot.setdefault(runs[one.shot].name, {})[one.ball] = None
    return "; ".join(
        f"{name}: ball{'s' * (len(balls) > 1)} {listed(balls)}" for name, balls in by_shot.items()
    )


def _why(found: Optimum, name: str) -> str:
    """Say why nothing that was measured depends on an input."""
    kind, whose = parts(name)
    group, scene = TABLE[kind].group, found.forecast.scene
    runs = (found.forecast.runs(found.values) or {}).values()
    hits = [event.balls for run in runs for event in run.events if event.is_contact]
    if group in ("mass", "radius") and not any(whose in balls for balls in hits):
        return f"no shot has a hit of ball {whose}"
    cue = scene.cue.id if scene.cue and scene.restitution.cue_ball is not None else None
    asked = {"friction.surface", "friction.rolling"}
    for balls in hits:
        of = "cushion" if len(balls) == 1 else "ball_ball"
        of_cue = "cue_ball" if of == "ball_ball" and cue in balls else of
        asked |= {f"friction.{of}", f"restitution.{of_cue}"}
    if group in ("restitution", "friction") and kind not in asked:
        return "no shot has such a hit"
    return "no place that was measured depends on it"


def _loose(found: Optimum) -> Iterator[str]:
    """Doubt numbers that are hardly distinguished, that end at a bound, or that end at a jump."""
    names = found.forecast.names
    for i, j in zip(*np.tril_indices(len(names), -1), strict=True):
        if abs(share := found.correlations[i, j]) > ALIKE:
            both = f"{names[j]} and {names[i]}"
            yield f"{both} are hardly distinguished (their correlation is {share:.4f})"
    for bounds in (found.forecast.low, found.forecast.high):
        for k in np.flatnonzero(np.abs(found.values - bounds) < 1e-3 * found.forecast.sizes):
            yield f"{names[k]} ends at its bound, {bounds[k]:g}: its error means nothing"
    known = np.isfinite(found.errors)
    weight = np.sqrt(weights(found.off, found.sigma))
    by_errors = found.jacobian[:, known] * found.errors[known] * weight[:, np.newaxis]
    step = np.linalg.lstsq(by_errors, found.off * weight, rcond=None)[0]
    if np.abs(step).max(initial=0.0) > UPHILL:
        yield (
            "the fit ends where contacts come in another order, so its errors mean little: try "
            "more starts"
        )


def _bent(found: Optimum) -> Iterator[str]:
    """Doubt standard errors within which places do not move as the derivatives say."""
    forecast, weight = found.forecast, np.sqrt(weights(found.off, found.sigma))
    for k in np.flatnonzero(found.errors > 0.0):
        for side in (-2.0, 2.0):
            values = found.values.copy()
            moved = values[k] + side * found.errors[k]
            values[k] = np.clip(moved, forecast.low[k], forecast.high[k])
            said = (values[k] - found.values[k]) * found.jacobian[:, k]
            came = found.off - forecast.residuals(values)[found.used].ravel()
            off, most = (np.linalg.norm(weight * each) for each in (came - said, said))
            if not off <= BENT * most + EXACT:
                yield (
                    f"{forecast.names[k]}: within two standard errors places do not move in "
                    "proportion to it, so its error is only a guide"
                )
                break


def _implausible(found: Optimum) -> Iterator[str]:
    """Doubt places that are far off, and residuals too large for errors of measurement."""
    far = (np.abs(found.residuals).max(axis=1) > max(FAR * found.sigma, ROUNDING)) & found.used
    if far.any() and found.knows_sigma:
        yield (
            f"{int(far.sum())} of {len(far)} places are more than {FAR:g} sigma off, and hardly "
            f"count ({_places(found, far)}): blunders, or the fit has ended in a wrong minimum"
        )
    if found.is_plausible:
        return
    if found.stated:
        yield (
            f"the residuals are {found.excess:.2g} times the stated error: the scene does not do "
            "what the table did, or the fit has ended in a wrong minimum; try more starts"
        )
    elif found.is_coarse:
        sigma = found.forecast.scene.units.text(found.sigma, ".3g")
        yield (
            f"the error of a coordinate comes out as {sigma}, more than {COARSE:g} of a ball's "
            "radius: the fit has probably ended in a wrong minimum; try more starts, or state the "
            "error"
        )
