"""This module doubts a fit: it says what the data cannot tell, and which errors mean little."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model.inputs import TABLE, parts
from pool_pymunk.model.problems import listed
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Event
from pool_pymunk.results.words import counted
from pool_pymunk.studies.forecast import Forecast, Runs
from pool_pymunk.studies.robust import (
    EXACT,
    SAME,
    blind_part,
    covariances,
    excess,
    hanging,
    largest_excess,
    told,
    weights,
)

Mask = NDArray[np.bool_]

FAR = 5.0  # sigma; what is farther off is named
ALIKE = 0.99  # Numbers that are correlated more strongly are told apart badly.
UPHILL = 0.5  # standard errors; a fit from which it goes downhill farther has not come to an end
BENT = 0.5  # of what the derivatives say; places that are farther from there show a bend
# of the smallest radius: a picture in which a ball is twenty pixels wide shows its centre to a
# pixel, so errors of measurement are smaller.
COARSE = 0.1
ROUNDING = 1e-9  # m; residuals of measured places are larger


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum is where a fit ended: what was fitted to what, and with which derivatives.

    ``jacobian`` (2 U, P) are the derivatives of the U places that are ``used`` (M,), 0 where there
    is none, and ``sigma`` (m) is the error of a coordinate, which may be ``stated``.
    ``sizes``, ``low`` and ``high`` (P,) are scales and bounds of the numbers.
    """

    forecast: Forecast
    values: Array
    used: Mask
    jacobian: Array
    sigma: float
    stated: bool
    sizes: Array
    low: Array
    high: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of what was free."""
        return self.forecast.names

    @cached_property
    def runs(self) -> Runs:
        """Return the runs with the fitted numbers."""
        runs = self.forecast.runs(self.values)
        assert runs is not None, "the fitted numbers could be played"
        return runs

    @cached_property
    def residuals(self) -> Array:
        """Return measured less fitted places (M, 2), in m."""
        return self.forecast.residuals(self.values)

    @property
    def off(self) -> Array:
        """Return the residuals (2 U,) of what is used, as the rows of the derivatives."""
        return np.asarray(self.residuals[self.used].ravel())

    @property
    def hangs(self) -> Mask:
        """Tell which of them (2 U,) depend on something that is free."""
        return hanging(self.jacobian * self.sizes)

    @property
    def told(self) -> int:
        """Return how many numbers, or combinations of them, the data tell."""
        return told(self.jacobian * self.sizes)

    @property
    def has_spare(self) -> bool:
        """Tell whether more data depend on what is free than are needed to find it."""
        return int(self.hangs.sum()) > self.told

    @property
    def knows_sigma(self) -> bool:
        """Tell whether the error of a coordinate is stated, or can be estimated."""
        return self.stated or self.has_spare

    @cached_property
    def excess(self) -> float:
        """Return the root mean square of what remains, blunders and all, in sigmas."""
        return excess(self.off[self.hangs], self.sigma, self.told)

    @property
    def is_coarse(self) -> bool:
        """Tell whether an error that nobody has stated is too large to be one of measurement."""
        radius = min(ball.radius for ball in self.forecast.scene.balls)
        return not self.stated and self.knows_sigma and self.sigma > COARSE * radius

    @property
    def is_plausible(self) -> bool:
        """Tell whether errors of measurement may have left what remains."""
        if not self.has_spare or np.abs(self.off).max(initial=0.0) <= ROUNDING:
            return True
        most = largest_excess(int(self.hangs.sum()) - self.told)
        return self.excess <= most and not self.is_coarse

    @cached_property
    def covariance(self) -> Array:
        """Return the covariances (P, P) of the fitted numbers; nan is what is not known."""
        found = covariances(self.jacobian * self.sizes, self.off, self.sigma)
        if not self.knows_sigma:
            found[:] = np.nan
        return np.asarray(found * np.outer(self.sizes, self.sizes))

    @cached_property
    def errors(self) -> Array:
        """Return the standard errors (P,) of the fitted numbers."""
        return np.sqrt(np.diagonal(self.covariance))

    @cached_property
    def correlations(self) -> Array:
        """Return the correlations (P, P) of the fitted numbers."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.covariance / np.outer(self.errors, self.errors))


def doubts(found: Optimum) -> Iterator[str]:
    """Say all that is to be doubted, a sentence each."""
    yield from _left_out(found)
    yield from _blind(found)
    yield from _too_few(found)
    yield from _alike(found)
    yield from _at_bounds(found)
    yield from _at_jump(found)
    yield from _bent(found)
    yield from _far_off(found)
    yield from _implausible(found)


def _left_out(found: Optimum) -> Iterator[str]:
    if not found.used.all():
        _, why = found.forecast.derivatives(found.values)
        yield (
            f"{int((~found.used).sum())} of {len(found.used)} places are left out, because it is "
            f"not known how they depend on what is free ({_places(found, ~found.used)})"
            + "".join(f"; {reason}" for reason in why)
        )


def _places(found: Optimum, which: Mask) -> str:
    """Name places by shot and ball."""
    by_shot: dict[str, dict[str, None]] = {}
    for m in np.flatnonzero(which).tolist():
        one = found.forecast.measured[m]
        by_shot.setdefault(found.runs[one.shot].name, {})[one.ball] = None
    return "; ".join(
        f"{name}: ball{'s' * (len(balls) > 1)} {listed(balls)}" for name, balls in by_shot.items()
    )


def _blind(found: Optimum) -> Iterator[str]:
    """Name what no measured place depends on, and what cannot be told apart."""
    blind = blind_part(found.jacobian * found.sizes)
    left = set(np.flatnonzero(np.diagonal(blind) > SAME).tolist())
    while left:
        first = min(left)
        group = sorted(k for k in left if abs(blind[first, k]) > SAME)
        left -= set(group)
        names = [found.names[k] for k in group]
        if len(names) == 1:
            yield f"{names[0]}: {_why(found, names[0])}"
        else:
            them = f"{', '.join(names[:-1])} and {names[-1]}"
            yield f"{them}: the data tell only a combination of them, so one must be given"


def _why(found: Optimum, name: str) -> str:
    """Say why nothing that was measured depends on an input."""
    hits = [event for run in found.runs.values() for event in run.events if event.is_contact]
    kind, whose = parts(name)
    group = TABLE[kind].group
    if group in ("mass", "radius") and not any(whose in hit.balls for hit in hits):
        return f"no shot has a hit of ball {whose}"
    of_hits = group in ("restitution", "friction") and kind != "friction.surface"
    if of_hits and not any(_is_asked(found, name, hit) for hit in hits):
        return "no shot has such a hit"
    return "no place that was measured depends on it"


def _is_asked(found: Optimum, name: str, hit: Event) -> bool:
    """Tell whether a hit has this coefficient."""
    if len(hit.balls) == 1:
        return name.endswith(".cushion")
    scene = found.forecast.scene
    cue = scene.cue
    of_cue = scene.restitution.cue_ball is not None and cue is not None and cue.id in hit.balls
    return name in ("friction.ball_ball", f"restitution.{'cue_ball' if of_cue else 'ball_ball'}")


def _too_few(found: Optimum) -> Iterator[str]:
    if found.told and not found.knows_sigma:
        yield (
            f"{counted(found.told, 'number')} fitted to "
            f"{counted(int(found.hangs.sum()), 'measured coordinate')}: none is left over, so the "
            "errors are not known"
        )


def _alike(found: Optimum) -> Iterator[str]:
    for i, j in zip(*np.tril_indices(len(found.names), -1), strict=True):
        if abs(found.correlations[i, j]) > ALIKE:
            yield (
                f"{found.names[j]} and {found.names[i]} are hardly told apart (their correlation "
                f"is {found.correlations[i, j]:.4f})"
            )


def _at_bounds(found: Optimum) -> Iterator[str]:
    for bounds in (found.low, found.high):
        near = np.abs(found.values - bounds) < 1e-3 * found.sizes
        for k in np.flatnonzero(near):
            yield f"{found.names[k]} ends at its bound, {bounds[k]:g}: its error means nothing"


def _at_jump(found: Optimum) -> Iterator[str]:
    """Doubt a fit from which it still goes downhill: it ended at a jump."""
    known = np.isfinite(found.errors)
    if not known.any():
        return
    weight = np.sqrt(weights(found.off, found.sigma))
    by_errors = found.jacobian[:, known] * found.errors[known] * weight[:, np.newaxis]
    step = np.linalg.lstsq(by_errors, found.off * weight, rcond=None)[0]
    if np.abs(step).max() > UPHILL:
        yield (
            "the fit ends where contacts come in another order, so its errors mean little: try "
            "more starts"
        )


def _bent(found: Optimum) -> Iterator[str]:
    """Doubt errors within which places do not go where the derivatives say."""
    weight = np.sqrt(weights(found.off, found.sigma))
    for k in np.flatnonzero(found.errors > 0.0):
        for step in (-2.0 * found.errors[k], 2.0 * found.errors[k]):
            values = found.values.copy()
            values[k] = np.clip(values[k] + step, found.low[k], found.high[k])
            said = (values[k] - found.values[k]) * found.jacobian[:, k]
            came = found.off - found.forecast.residuals(values)[found.used].ravel()
            if not _length(weight * (came - said)) <= BENT * _length(weight * said) + EXACT:
                yield (
                    f"{found.names[k]}: within two standard errors places do not move in "
                    "proportion to it, so its error is only a guide"
                )
                break


def _length(vector: Array) -> float:
    return float(np.sqrt((vector**2).sum()))


def _far_off(found: Optimum) -> Iterator[str]:
    far = (np.abs(found.residuals).max(axis=1) > max(FAR * found.sigma, ROUNDING)) & found.used
    if far.any() and found.knows_sigma:
        yield (
            f"{int(far.sum())} of {len(far)} places are more than {FAR:g} sigma off, and hardly "
            f"count ({_places(found, far)}): blunders, or the fit has ended in a wrong minimum"
        )


def _implausible(found: Optimum) -> Iterator[str]:
    """Doubt a fit that leaves more than errors of measurement do."""
    if found.is_plausible:
        return
    units = found.forecast.scene.units
    if found.stated:
        yield (
            f"what remains is {found.excess:.2g} times the stated error: the scene does not do "
            "what the table did, or the fit has ended in a wrong minimum; try more starts"
        )
    elif found.is_coarse:
        yield (
            f"the error of a coordinate comes out as {units.from_si(found.sigma, 'length'):.3g} "
            f"{units.length}, more than {COARSE:g} of a ball's radius: the fit has probably ended "
            "in a wrong minimum; try more starts, or state the error"
        )
