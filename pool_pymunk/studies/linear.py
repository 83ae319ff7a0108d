"""This study says at once, by derivatives, what small uncertainties of the inputs do to the ends.

It also says how far that can be believed. The exact run has the derivatives of its ends by the
starts, and by the speed and the angle of the shot. So for errors drawn uniformly within +-h the
covariance of the ends is D diag(h^2 / 3) D^T. For larger errors contacts come in another order, and
the ends do not lie where the derivatives say. A few samples find out where that begins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pool_pymunk.model import Scene, Shot
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import find_shot
from pool_pymunk.studies.derivatives import Derivatives, derivatives
from pool_pymunk.studies.forecast import turn
from pool_pymunk.studies.sensitivity import Sampled, Study, read_study
from pool_pymunk.studies.uncertainty import Uncertainty

OFF = 0.1  # The linear answer holds where most samples end within this share of it.
MOST = 0.95
TRIED = 500  # So many samples are played at each width.
NARROWEST, WIDEST = 2.0**-40, 2.0**6  # These widths are tried, in those of the uncertainty.


@dataclass(frozen=True, eq=False)
class Linear:
    """A linear sensitivity has what errors within an uncertainty do to the ends, to first order.

    ``by_errors`` (N, 2, K) are the derivatives of the ends (m) by the K errors, in units of half
    their widths. ``holds`` is the multiple of the uncertainty within which 95 % of the samples end
    within a tenth of what the derivatives say; it is 0 if they do so nowhere, and nan if no
    derivatives are known. ``warnings`` say which are not known.
    """

    reference: Run
    uncertainty: Uncertainty
    by_errors: Array
    holds: float
    warnings: tuple[str, ...]

    @cached_property
    def covariance(self) -> Array:
        """Return the covariances of x and y of each ball's end (N, 2, 2), in m^2."""
        return np.asarray(self.by_errors @ self.by_errors.transpose(0, 2, 1) / 3.0)

    @property
    def std(self) -> Array:
        """Return the standard deviations (N, 2) of each ball's end along x and y, in m."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def radius(self) -> float:
        """Return the largest error of a start (m) within which the linear answer holds."""
        return self.holds * float(self.uncertainty.widths(self.reference.scene).max())

    def as_dict(self) -> dict[str, object]:
        """Return the shot as in the JSON of ``sensitivity --linear --json``, in SI."""
        ids = [ball.id for ball in self.reference.scene.balls]
        return {
            "std": {id_: _known(std) for id_, std in zip(ids, self.std.tolist(), strict=True)},
            "holds": self.holds if math.isfinite(self.holds) else None,
            "warnings": list(self.warnings),
        }


def _known(std: Sequence[float]) -> list[float] | None:
    return list(std) if all(map(math.isfinite, std)) else None


def linear(
    scene: Scene,
    shot: Shot | str | int | None,
    uncertainty: Uncertainty,
    *,
    seed: int = 0,
    law: str | Law | None = None,
) -> Linear:
    """Differentiate a shot's ends, and find out how far the derivatives can be believed.

    The errors are those of :func:`~pool_pymunk.sensitivity`: a shot that aims at a ball aims at
    where that ball is, and a shot that goes on from the one before starts where that one ends.
    ``law`` is that of every contact (default: the scene's).
    Raises SettingError as :func:`~pool_pymunk.sensitivity` does.

    >>> from pool_pymunk import load
    >>> found = linear(load("report"), "Simulation 3", Uncertainty(0.005 * 0.0254))
    >>> round(float(found.std.max()) / 0.0254, 4), found.holds > 1.0
    (0.0034, True)
    """
    study = read_study(scene, find_shot(scene, shot), uncertainty, law)
    by_errors, warnings = _chained(study, uncertainty)
    sound = np.isfinite(by_errors).all() and bool(np.any(by_errors))
    holds = _reach(study, uncertainty, by_errors, seed) if sound else math.nan
    return Linear(study.reference, uncertainty, by_errors, holds, warnings)


# -- the chain of shots ----------------------------------------------------------------------------


def _chained(study: Study, uncertainty: Uncertainty) -> tuple[Array, tuple[str, ...]]:
    """Return the derivatives of the ends (N, 2, K) by the errors of starts and of every shot."""
    runs = study.runs()
    count = len(study.reference.scene.balls)
    starts = np.diag(uncertainty.widths(study.reference.scene).ravel())
    shots = np.zeros((2 * count, 2 * len(runs)))
    place = np.concatenate([starts, shots], axis=1).reshape(count, 2, -1)
    warnings: dict[str, None] = {}
    for k, run in enumerate(runs):
        found = derivatives(run, ("position", *(("speed", "angle") if run.shot else ())))
        warnings |= dict.fromkeys(found.warnings)
        place = _next(found, place, uncertainty, 2 * count + 2 * k)
    return place, tuple(warnings)


def _next(found: Derivatives, place: Array, uncertainty: Uncertainty, column: int) -> Array:
    """Return the derivatives of a shot's ends, from those of its starts (N, 2, K)."""
    run, count = found.run, len(place)
    ends = found.final[:, :, : 2 * count] @ place.reshape(2 * count, -1)
    if run.shot is None:
        return np.asarray(ends)
    by_speed, by_angle = found.final[:, :, -2], np.degrees(found.final[:, :, -1])
    if run.shot.aim is not None:
        ends += by_angle[:, :, np.newaxis] * turn(run, run.shot, place)
    ends[:, :, column] += uncertainty.speed * by_speed
    ends[:, :, column + 1] += uncertainty.angle * by_angle
    return np.asarray(ends)


# -- how far it holds ------------------------------------------------------------------------------


def _reach(study: Study, uncertainty: Uncertainty, by_errors: Array, seed: int) -> float:
    """Return the multiple of the uncertainty within which the linear answer holds, to a tenth."""
    low, high = math.log2(NARROWEST), math.log2(WIDEST)
    while high - low > 0.1:
        middle = (low + high) / 2.0
        if _holds(study, uncertainty.scaled(2.0**middle), by_errors * 2.0**middle, seed):
            low = middle
        else:
            high = middle
    return 0.0 if low == math.log2(NARROWEST) else float(f"{2.0**low:.2g}")


def _holds(study: Study, uncertainty: Uncertainty, by_errors: Array, seed: int) -> bool:
    """Tell whether most samples end within a tenth of what the derivatives say."""
    played: Sampled = study.sample(uncertainty, TRIED, seed)
    base = np.array([ball.position for ball in study.reference.scene.balls])
    widths = uncertainty.widths(study.reference.scene)
    shots = np.array([uncertainty.speed, uncertainty.angle])
    errors = np.concatenate(
        [_in_widths(played.starts - base, widths), _in_widths(played.errors, shots)], axis=1
    )
    said = np.einsum("nck,sk->snc", by_errors, errors)
    came = played.ends - study.reference.end.position
    off = np.sqrt(((came - said) ** 2).sum(axis=(1, 2)))
    size = np.sqrt((said**2).sum(axis=(1, 2)))
    return bool((off <= OFF * size).mean() >= MOST)


def _in_widths(errors: Array, widths: Array) -> Array:
    """Return errors in units of their half widths, one row a sample; where there is none, 0."""
    found = np.zeros_like(errors)
    np.divide(errors, widths, out=found, where=widths > 0.0)
    return found.reshape(len(errors), -1)


def ellipse(covariance: Array, share: float = MOST, points: int = 100) -> Array:
    """Return the outline (points, 2) that a normal distribution has this share within.

    >>> outline = ellipse(np.diag([4.0, 1.0]))
    >>> np.abs(outline).max(axis=0).round(2).tolist()
    [4.89, 2.45]
    """
    sizes, axes = np.linalg.eigh(covariance)
    reach = np.sqrt(-2.0 * math.log(1.0 - share) * np.maximum(sizes, 0.0))
    angle = np.linspace(0.0, 2.0 * math.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray((axes @ (reach[:, np.newaxis] * circle)).T)
