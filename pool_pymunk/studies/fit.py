"""This study fits numbers of a scene to where balls were measured, and says how sure they are.

It is least squares with a robust loss (Cauchy's, of SciPy), with the exact derivatives of the runs.
Runs are smooth in their numbers only as long as contacts come in the same order, so there are jumps
and many minima: the search starts from the scene's own numbers, and from the best of many others.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pool_pymunk.model import Scene
from pool_pymunk.model.inputs import (
    TABLE,
    Names,
    chosen,
    in_units,
    input_value,
    names_in,
    parts,
    unit_of,
)
from pool_pymunk.model.plain import argument, size, whole
from pool_pymunk.model.problems import listed, setting_error
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.studies import Mask, known
from pool_pymunk.studies.fit_doubts import CAUCHY, SAME, Optimum, doubts, first_scale, robust_scale
from pool_pymunk.studies.measured import Forecast, Measurement, read_measured

MORE = 6  # This many rounds of further starts are made where what remains is implausible.
CLOSE = 0.15  # of the range of every number; so far around the best ones every second round looks
LOOKS = 64  # tries of the first look, for each number that is free
MOST_LOOKS = 400
STEPS = 60  # evaluations of one search
ROUNDS = 20  # So often the scale of the errors is estimated anew.
FIRST_ROUNDS = 3
SETTLED = 1e-3  # The scale is found when it changes by less than this share.
COLUMNS = ("shot", "ball", "t", "x", "y", "x_fitted", "y_fitted", "off", "off_before", "used")
NEEDS_SCIPY = "fit needs SciPy: pip install 'pool-pymunk[fit]'"


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit has numbers of a scene that lead closest to what was measured, and how sure they are.

    ``scene`` has the fitted numbers, and ``before`` is the one that was given. ``values`` and
    ``standard_errors`` are by the inputs' names, in SI, angles in degrees; ``correlations`` is
    (P, P) in their order. What the data cannot tell has the standard error nan. ``residuals``
    (M, 2) are ``measured`` less fitted places (m), and ``residuals_before`` (M, 2) those of the
    scene that was given. ``used`` (M,) tells which were fitted to. ``sigma`` (m) is the standard
    deviation of one measured coordinate: estimated, or as stated, and nan where nothing tells it.
    ``warnings`` say what the data cannot tell, and what is to be doubted.
    """

    scene: Scene = field(repr=False)
    before: Scene
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    correlations: Array
    measured: tuple[Measurement, ...]
    residuals: Array
    residuals_before: Array
    used: Mask
    sigma: float
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        units = self.scene.units
        found = ", ".join(
            f"{name} {self.written(name)} {unit_of(units, name)}".rstrip() for name in self.values
        )
        sigma = f"{units.from_si(self.sigma, 'length'):.3g} {units.length}"
        error = f"; sigma {sigma}" if math.isfinite(self.sigma) else ""
        return f"<Fit to {len(self.measured)} places: {found or 'nothing free'}{error}>"

    def written(self, name: str) -> str:
        """Write a fitted number with its standard error, in the scenario's units."""
        units = self.scene.units
        error = in_units(units, name, self.standard_errors[name])
        return _with_error(in_units(units, name, self.values[name]), error)

    @property
    def rms(self) -> float:
        """Return the root mean square distance (m) between measured and fitted places."""
        return _rms(self.residuals[self.used])

    @property
    def rms_before(self) -> float:
        """Return the same distance (m) with the numbers of the scene that was given."""
        return _rms(self.residuals_before[self.used])

    def errors_off(self, name: str, value: float) -> float:
        """Return by how many standard errors a value (SI) lies off the fitted one."""
        if name not in self.values:
            raise setting_error("name", name, f"was not free (these were: {listed(self.values)})")
        return abs(value - self.values[name]) / self.standard_errors[name]

    def as_dict(self) -> dict[str, object]:
        """Return the fit as in the JSON of ``fit --json``, in SI; null is what is not known."""
        return {
            "values": dict(self.values),
            "before": {name: input_value(self.before, name) for name in self.values},
            "standard_errors": {name: known(e) for name, e in self.standard_errors.items()},
            "correlations": [[known(each) for each in row] for row in self.correlations.tolist()],
            "sigma": known(self.sigma),
            "rms": known(self.rms),
            "rms_before": known(self.rms_before),
            "measured": [one._asdict() for one in self.measured],
            "residuals": self.residuals.tolist(),
            "used": self.used.tolist(),
            "warnings": list(self.warnings),
        }


def _with_error(value: float, error: float) -> str:
    """Write a value with its standard error, with the digits that this leaves.

    >>> _with_error(0.70012, 0.00031), _with_error(0.5, math.nan), _with_error(12.0, 3.0)
    ('0.70012 ± 0.00031', '0.5 (unknown)', '12.0 ± 3.0')
    """
    if not math.isfinite(error):
        return f"{value:.4g} (unknown)"
    digits = 1 - math.floor(math.log10(error)) if error > 0.0 else 6
    digits = min(max(digits, 0), 15)
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def write_csv(found: Fit, path: Path) -> None:
    """Write one row a place: measured, fitted, and how far off it is, in the scenario's unit."""
    unit = found.scene.units.from_si(1.0, "length")
    shots = [shot.name for shot in found.scene.shots] or [""]
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        for m, one in enumerate(found.measured):
            x, y = one.x * unit, one.y * unit
            dx, dy = (found.residuals[m] * unit).tolist()
            before = float(np.hypot(*found.residuals_before[m]) * unit)
            places = (x, y, x - dx, y - dy, math.hypot(dx, dy), before)
            numbers = (f"{number:.10g}" for number in places)
            rows.writerow([shots[one.shot - 1], one.ball, one.t, *numbers, int(found.used[m])])


def _rms(residuals: Array) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean())) if len(residuals) else math.nan


def fit(
    scene: Scene,
    measured: str | Path | Sequence[Any],
    free: str | Sequence[str],
    *,
    error: float | None = None,
    starts: int = 8,
    seed: int = 0,
    law: str | Law | None = None,
) -> Fit:
    """Fit numbers of a scene to where its balls were measured.

    ``measured`` is a CSV file with the columns shot, ball, x, y and optionally t (s); lengths are
    in the scenario's unit, without a time it is the end that was measured, and a shot goes by
    number or name. Or it is "published", the ends that the scenario has, or rows (shot, ball, x, y)
    or (shot, ball, x, y, t) in SI. ``free`` are the names of inputs as in
    :class:`~pool_pymunk.Derivatives`, with "speed.2" for that of the second shot, or groups of
    them: "restitution", "friction", "position", "mass", "radius", "speed", "angle", "roll",
    "velocity" (of balls that no shot strikes). ``error`` (m) is the standard deviation of one
    measured coordinate; by default it is estimated. The loss is robust, so a few blunders do no
    harm. The search starts from the scene's own numbers and from ``starts`` - 1 others, the best of
    a first look with the random numbers of ``seed``. ``law`` is that of every contact (default: the
    scene's). All runs are exact. Raises SceneError or SettingError, one line a problem, and
    ImportError without SciPy.

    >>> from pool_pymunk import load, simulate
    >>> table = load("report")
    >>> run = simulate(table, 1)
    >>> rows = [(1, id_, *end) for id_, end in run.final.items()]
    >>> found = fit(table, rows, ["restitution.cushion"], starts=1)
    >>> round(found.values["restitution.cushion"], 9), found.warnings
    (0.7, ())
    """
    rows = read_measured(measured, scene)
    shots = sorted({one.shot for one in rows})
    names = input_names(scene, free, shots)
    if error is not None:
        error = argument("error", error, size)
    count, first = argument("starts", starts, whole(1)), argument("seed", seed, whole(0))
    return _Minimizer(Forecast(scene, names, rows, law), error, first).fit(count)


# -- what is free ----------------------------------------------------------------------------------


def input_names(scene: Scene, free: str | Sequence[str], shots: Sequence[int] = ()) -> Names:
    """Return the names of the inputs that shall be free, each once.

    The inputs of a shot are those of the measured ``shots``. Raises SettingError for a name that
    the scene does not have, and for an input that a fit cannot vary.
    """
    measured = map(str, shots if scene.shots else ())
    groups = {
        group: [name for name in names if not _why_not(scene, name, shots)]
        for group, names in names_in(scene, measured).items()
    }
    every = names_in(scene, map(str, range(1, len(scene.shots) + 1)))
    found = chosen("free", free, groups, (name for names in every.values() for name in names))
    for name in found:
        if why := _why_not(scene, name, shots):
            raise setting_error("free", name, f"there is no such input: {why}")
    return found


def _why_not(scene: Scene, name: str, shots: Sequence[int]) -> str:
    """Say why an input of the scene cannot be free; return "" if it can."""
    kind, whose = parts(name)
    if kind in ("angle", "turn") and scene.shots[int(whose) - 1].aim is not None:
        return f"shot {whose} aims at a ball, and that gives its direction"
    struck = {scene.shots[k - 1].ball for k in shots} if scene.shots else set()
    if TABLE[kind].group == "velocity" and struck == {whose}:
        return f"ball {whose} is struck, so its velocity is that of the shot: speed and angle"
    return ""


def _span(scene: Scene, name: str) -> tuple[float, float]:
    """Return the range in which a search looks for an input, around the scene's own number."""
    kind, whose = parts(name)
    row, own = TABLE[kind], input_value(scene, name)
    if row.group == "restitution":
        return 0.2, 1.0
    if row.group == "friction":
        of_table = kind in ("friction.surface", "friction.rolling")
        return (own / 3.0, 3.0 * own) if of_table and own else (0.0, 0.4)
    if row.low == 0.0:
        return 0.8 * own, 1.25 * own
    wide = {"": 1.0, "angle": 3.0, "length": 0.2 * scene.balls[scene.index.get(whose, 0)].radius}
    half = wide.get(row.quantity, 0.2 * abs(own))
    return own - half, own + half


class _Minimizer:
    """A search knows what is fitted, the error if it is stated, and where numbers may lie."""

    def __init__(self, forecast: Forecast, error: float | None, seed: int) -> None:
        self.forecast, self.error, self.seed = forecast, error, seed
        self.names, self.own, self.sizes = forecast.names, forecast.own, forecast.sizes
        self.low, self.high = forecast.low, forecast.high
        self.used: Mask = np.ones(len(forecast.measured), dtype=bool)

    def fit(self, starts: int) -> Fit:
        """Search from several starts, and say what came of it."""
        self.used = self._sound(self._inside(self.own))
        others = self._look(0, starts - 1) if starts > 1 and self.names else []
        first = [self._inside(self.own), *others]
        tried = [self._refined(start, FIRST_ROUNDS) for start in first]
        best = self._settled(self._refined(self._best(tried).values))
        for k in range(1, 1 + MORE if starts > 1 and self.names else 1):
            if self._judged(best).is_plausible:
                break
            tried = [self._refined(start, FIRST_ROUNDS) for start in self._look(k, starts, best)]
            best = self._settled(self._refined(self._best([best, *tried]).values))
        best = self._nearest(best)
        if self.error is not None:  # It is known, so it need not be estimated any more.
            values = self._down(best.values, self.error) if self.names else best.values
            best = self._at(values, self.error)
        return self._answer(best)

    def _settled(self, best: Optimum) -> Optimum:
        """Go down again until the places that have derivatives are the same ones."""
        for _ in range(5):
            sound = self._sound(best.values)
            if (sound == self.used).all():
                break
            self.used = sound
            best = self._refined(best.values)
        return best

    def _sound(self, values: Array) -> Mask:
        """Tell which places have derivatives here."""
        if self.forecast.runs(values) is None:
            message = "its shots do not come to an end"
            raise setting_error("scene", self.forecast.scene.title, message)
        derivatives, _ = self.forecast.derivatives(values)
        found: Mask = np.asarray(np.isfinite(derivatives).all(axis=(1, 2)))
        if not found.any():
            message = "no measured place has derivatives: runs have no exact answer to fit with"
            raise setting_error("measured", len(found), message)
        return found

    # -- where to start ----------------------------------------------------------------------------

    def _look(self, k: int, count: int, best: Optimum | None = None) -> list[Array]:
        """Return the best numbers of the ``k``-th look at many, in odd looks close to the best."""
        low, high = np.array([_span(self.forecast.scene, name) for name in self.names]).T
        if best is not None and k % 2 == 1:
            close = CLOSE * (high - low) * 0.5 ** (k // 2)
            low, high = best.values - close, best.values + close
        halton = _scipy("stats").qmc.Halton(len(self.names), scramble=False)
        shift = np.random.default_rng(self.seed).random(len(self.names))
        looks = min(LOOKS * len(self.names), MOST_LOOKS)
        halton.fast_forward(k * looks)
        draws = (halton.random(looks) + shift) % 1.0
        tries = list(np.clip(low + draws * (high - low), self.low, self.high))
        radius = min(ball.radius for ball in self.forecast.scene.balls)
        costs = [self._at(values).cost(radius) for values in tries]
        order = np.argsort(costs, kind="stable")[:count]
        return [tries[k] for k in order if math.isfinite(costs[k])]

    def _at(self, values: Array, sigma: float = 1.0) -> Optimum:
        return Optimum(self.forecast, values, self.used, sigma)

    def _best(self, found: Sequence[Optimum]) -> Optimum:
        """Return the best of several, all judged by the smallest scale."""
        scale = min(each.sigma for each in found)
        return min(found, key=lambda each: each.cost(scale))

    # -- one search --------------------------------------------------------------------------------

    def _refined(self, start: Array, rounds: int = ROUNDS) -> Optimum:
        """Go down from a start, with a scale of the errors that follows the residuals."""
        if not self.names:
            return self._at(start, self._scale(start, None))
        values = np.clip(start, self.low, self.high)
        scale = self._scale(values, None)
        for _ in range(rounds):
            values = self._down(values, scale)
            last, scale = scale, self._scale(values, scale)
            if abs(scale - last) <= SETTLED * last:
                break
        return self._at(values, scale)

    def _down(self, values: Array, scale: float) -> Array:
        """Minimize Cauchy's loss for errors of this scale (m)."""
        used, forecast = self.used, self.forecast

        def residuals(at: Array) -> Array:
            return np.asarray(forecast.residuals(at)[used].ravel() / scale)

        def jacobian(at: Array) -> Array:
            return -forecast.jacobian(at, used) / scale

        found = _scipy("optimize").least_squares(
            residuals, values, jacobian, bounds=(self.low, self.high), x_scale=self.sizes,
            loss="cauchy", f_scale=CAUCHY, max_nfev=STEPS,
        )  # fmt: skip
        return np.asarray(found.x)

    def _inside(self, values: Array) -> Array:
        """Move numbers a little off their bounds, where derivatives may not exist."""
        margin = 0.1 * self.sizes
        return np.clip(values, self.low + margin, self.high - margin)

    def _scale(self, values: Array, scale: float | None) -> float:
        """Estimate the standard deviation (m) of the errors, from the residuals and the last scale.

        Places that depend on nothing that is free do not count. A stated error is the least scale:
        a loss with too small a scale would take all places far from the answer for blunders.
        """
        here = self._at(values)
        off, count = here.off[here.hangs] if self.names else here.off, here.rank
        found = (scale and robust_scale(off, scale, count)) or first_scale(off, count)
        return max(found, self.error or 0.0)

    # -- what the data do not tell -----------------------------------------------------------------

    def _nearest(self, best: Optimum) -> Optimum:
        """Return what lies nearest to the scene's own numbers, of all that is as good."""
        if not self.names:
            return best
        blind = best.blind
        for k in np.flatnonzero(np.diagonal(blind) > 1.0 - SAME):
            values = best.values.copy()
            values[k] = self.own[k]
            best = self._kept(best, self._at(values, best.sigma))
        blind = best.blind
        away = (best.values - self.own) / self.sizes
        values = np.clip(best.values - self.sizes * (blind @ away), self.low, self.high)
        if not blind.any() or np.array_equal(values, best.values):
            return best
        return self._kept(best, self._refined(values) if self.forecast.runs(values) else best)

    def _kept(self, best: Optimum, other: Optimum) -> Optimum:
        """Return another state if it is as good, or else the best one."""
        return other if other.cost(best.sigma) <= best.cost(best.sigma) + SETTLED else best

    # -- the answer --------------------------------------------------------------------------------

    def _judged(self, best: Optimum) -> Optimum:
        """Return where a search has come to as its doubts take it; a stated error is the scale."""
        return replace(best, sigma=self.error or best.sigma, stated=self.error is not None)

    def _answer(self, best: Optimum) -> Fit:
        """Return the fit, with standard errors and with what is to be doubted."""
        forecast, values, optimum = self.forecast, best.values, self._judged(best)
        return Fit(
            scene=forecast.scene_of(tuple(values.tolist())),
            before=forecast.scene,
            values=dict(zip(self.names, values.tolist(), strict=True)),
            standard_errors=dict(zip(self.names, optimum.errors.tolist(), strict=True)),
            correlations=optimum.correlations,
            measured=tuple(forecast.measured),
            residuals=forecast.residuals(values),
            residuals_before=forecast.residuals(forecast.own),
            used=self.used,
            sigma=best.sigma if optimum.knows_sigma else math.nan,
            warnings=tuple(doubts(optimum)),
        )


def _scipy(part: str) -> Any:
    """Return a part of SciPy, or say how to get it."""
    from importlib import import_module

    try:
        return import_module(f"scipy.{part}")
    except ImportError:
        raise ImportError(NEEDS_SCIPY) from None
