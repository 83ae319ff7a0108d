"""This study fits numbers of a scene to where balls were measured, and says how sure they are.

It is least squares with a robust loss (Cauchy's, of SciPy), with the exact derivatives of the runs.
Runs are smooth in their numbers only as long as contacts come in the same order, so the sum of
squares has jumps and many minima: the search starts from the scene's own numbers, and from the best
of many others.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
from pool_pymunk.studies.fit_doubts import Optimum, doubts
from pool_pymunk.studies.forecast import Forecast
from pool_pymunk.studies.measured import Measurement, read_measured
from pool_pymunk.studies.robust import (
    CAUCHY,
    SAME,
    blind_part,
    first_scale,
    hanging,
    robust_scale,
    told,
)

Mask = NDArray[np.bool_]

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

    ``scene`` is the scene with the fitted numbers, and ``before`` the one that was given.
    ``values`` and ``standard_errors`` are by the inputs' names, in SI, angles in degrees;
    ``correlations`` is (P, P) in their order. What the data cannot tell has the standard error
    nan. ``measured`` has what was measured; ``residuals`` (M, 2) are measured less fitted places
    (m), and ``residuals_before`` (M, 2) those of the scene that was given. ``used`` (M,) tells
    which of them were fitted to. ``sigma`` (m) is the standard deviation of one measured
    coordinate: estimated, or as stated, and nan where nothing tells it. ``warnings`` say what the
    data cannot tell, and what is to be doubted.
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
        known = f"; sigma {sigma}" if math.isfinite(self.sigma) else ""
        return f"<Fit to {len(self.measured)} places: {found or 'nothing free'}{known}>"

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
            known = listed(self.values)
            raise setting_error("name", name, f"was not free (these were: {known})")
        return abs(value - self.values[name]) / self.standard_errors[name]

    def as_dict(self) -> dict[str, object]:
        """Return the fit as in the JSON of ``fit --json``, in SI; null is what is not known."""
        return {
            "values": dict(self.values),
            "before": {name: input_value(self.before, name) for name in self.values},
            "standard_errors": {name: _known(e) for name, e in self.standard_errors.items()},
            "correlations": [[_known(each) for each in row] for row in self.correlations.tolist()],
            "sigma": _known(self.sigma),
            "rms": _known(self.rms),
            "rms_before": _known(self.rms_before),
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
    return f"{value:.{min(max(digits, 0), 15)}f} ± {error:.{min(max(digits, 0), 15)}f}"


def write_csv(found: Fit, path: Path) -> None:
    """Write one row a place: measured, fitted, and how far off it is, in the scenario's unit.

    ``off_before`` is the distance with the scenario's own numbers, and ``used`` 0 for a place that
    was left out.
    """
    unit = found.scene.units.from_si(1.0, "length")
    shots = [shot.name for shot in found.scene.shots] or [""]
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        for m, one in enumerate(found.measured):
            x, y = one.x * unit, one.y * unit
            dx, dy = (found.residuals[m] * unit).tolist()
            off = [math.hypot(dx, dy), float(np.hypot(*found.residuals_before[m]) * unit)]
            time = "" if one.t is None else one.t
            place = [x, y, x - dx, y - dy]
            numbers = (f"{number:.10g}" for number in (*place, *off))
            rows.writerow([shots[one.shot - 1], one.ball, time, *numbers, int(found.used[m])])


def _rms(residuals: Array) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean())) if len(residuals) else math.nan


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


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
    :class:`~pool_pymunk.Derivatives`, with "speed.2" and "angle.2" for those of the second shot,
    or groups of them: "restitution", "friction", "position", "mass", "radius", "speed", "angle",
    "velocity" (of balls that no shot strikes).
    ``error`` (m) is the standard deviation of one measured coordinate, if it is known; it is
    estimated from the residuals otherwise. The loss is robust, so a few blunders do no harm. The
    search starts from the scene's own numbers and from ``starts`` - 1 others, the best of a first
    look with the random numbers of ``seed``. ``law`` is that of every contact (default: the
    scene's).

    All runs are exact, whatever solver the measured ends may come from. Raises SceneError or
    SettingError, one line a problem, and ImportError without SciPy.

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
    return _Search(Forecast(scene, names, rows, law), error, first).fit(count)


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


def _bounds(name: str) -> tuple[float, float]:
    row = TABLE[parts(name)[0]]
    return row.low, row.high


def _size(scene: Scene, name: str) -> float:
    """Return the size of a change of an input that matters: its scale in a search."""
    kind, whose = parts(name)
    row = TABLE[kind]
    if row.group in ("restitution", "friction"):
        return 0.1
    if row.group == "position":
        return 0.1 * scene.balls[scene.index[whose]].radius
    return 1.0 if row.quantity == "angle" else max(0.1 * abs(input_value(scene, name)), 1e-3)


def _span(scene: Scene, name: str) -> tuple[float, float]:
    """Return the range in which a search looks for an input, around the scene's own number."""
    kind, whose = parts(name)
    row, own = TABLE[kind], input_value(scene, name)
    if row.group == "restitution":
        return 0.2, 1.0
    if row.group == "friction":
        return (own / 3.0, 3.0 * own) if kind == "friction.surface" and own else (0.0, 0.4)
    if row.low == 0.0:
        return 0.8 * own, 1.25 * own
    wide = {"angle": 3.0, "length": 0.2 * scene.balls[scene.index.get(whose, 0)].radius}
    half = wide.get(row.quantity, 0.2 * abs(own))
    return own - half, own + half


class _State(NamedTuple):
    """A state of a search: the numbers, and the scale (m) of the errors that they leave."""

    values: Array
    scale: float


class _Search:
    """A search knows what is fitted, the error if it is stated, and where numbers may lie."""

    def __init__(self, forecast: Forecast, error: float | None, seed: int) -> None:
        self.forecast, self.error, self.seed = forecast, error, seed
        scene, self.names = forecast.scene, forecast.names
        self.own = forecast.own
        self.low, self.high = np.array([_bounds(name) for name in self.names]).reshape(-1, 2).T
        self.sizes = np.array([_size(scene, name) for name in self.names])
        self.used: Mask = np.ones(len(forecast.measured), dtype=bool)

    def fit(self, starts: int) -> Fit:
        """Search from several starts, and say what came of it."""
        self.used = self._sound(self._inside(self.own))
        tried = [self._refined(start, FIRST_ROUNDS) for start in self._starts(starts)]
        best = self._settled(self._refined(self._best(tried).values))
        for k in range(MORE if starts > 1 and self.names else 0):
            if self._optimum(best).is_plausible:
                break
            tried = [self._refined(start, FIRST_ROUNDS) for start in self._more(k, starts, best)]
            best = self._settled(self._refined(self._best([best, *tried]).values))
        best = self._nearest(best)
        if self.error is not None:  # It is known, so it need not be estimated any more.
            values = self._down(best.values, self.error) if self.names else best.values
            best = _State(values, self.error)
        return self._answer(best)

    def _settled(self, best: _State) -> _State:
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
            raise setting_error(
                "scene", self.forecast.scene.title, "its shots do not come to an end"
            )
        derivatives, _ = self.forecast.derivatives(values)
        found: Mask = np.asarray(np.isfinite(derivatives).all(axis=(1, 2)))
        if not found.any():
            message = "no measured place has derivatives: runs have no exact answer to fit with"
            raise setting_error("measured", len(found), message)
        return found

    # -- where to start ----------------------------------------------------------------------------

    def _starts(self, count: int) -> list[Array]:
        """Return the scene's own numbers, and the best others of a first look."""
        if count == 1 or not self.names:
            return [self._inside(self.own)]
        return [self._inside(self.own), *self._look(*self._spans(), count - 1)]

    def _more(self, k: int, count: int, best: _State) -> list[Array]:
        """Return further starts for the ``k``-th round: close to the best numbers, or anywhere."""
        low, high = self._spans()
        if k % 2 == 0:
            close = CLOSE * (high - low) * 0.5 ** (k // 2)
            low, high = best.values - close, best.values + close
        return self._look(low, high, count, k + 1)

    def _spans(self) -> tuple[Array, Array]:
        """Return the ranges in which a search looks."""
        low, high = np.array([_span(self.forecast.scene, name) for name in self.names]).T
        return low, high

    def _look(self, low: Array, high: Array, count: int, k: int = 0) -> list[Array]:
        """Return the best numbers of the ``k``-th look at many between ``low`` and ``high``."""
        halton = _scipy("stats").qmc.Halton(len(self.names), scramble=False)
        shift = np.random.default_rng(self.seed).random(len(self.names))
        looks = min(LOOKS * len(self.names), MOST_LOOKS)
        halton.fast_forward(k * looks)
        draws = (halton.random(looks) + shift) % 1.0
        tries = list(np.clip(low + draws * (high - low), self.low, self.high))
        radius = min(ball.radius for ball in self.forecast.scene.balls)
        costs = [self._cost(values, radius) for values in tries]
        order = np.argsort(costs, kind="stable")[:count]
        return [tries[k] for k in order if math.isfinite(costs[k])]

    def _cost(self, values: Array, scale: float) -> float:
        """Return Cauchy's loss for errors of this scale (m)."""
        residuals = self.forecast.residuals(values)[self.used]
        return float(np.log1p((residuals / (CAUCHY * scale)) ** 2).sum())

    def _best(self, found: Sequence[_State]) -> _State:
        """Return the best of several, all judged by the smallest scale."""
        scale = min(state.scale for state in found)
        return min(found, key=lambda state: self._cost(state.values, scale))

    # -- one search --------------------------------------------------------------------------------

    def _refined(self, start: Array, rounds: int = ROUNDS) -> _State:
        """Go down from a start, with a scale of the errors that follows the residuals."""
        if not self.names:
            return _State(start, self._scale(start, None))
        values = np.clip(start, self.low, self.high)
        scale = self._scale(values, None)
        for _ in range(rounds):
            values = self._down(values, scale)
            last, scale = scale, self._scale(values, scale)
            if abs(scale - last) <= SETTLED * last:
                break
        return _State(values, scale)

    def _down(self, values: Array, scale: float) -> Array:
        """Minimize Cauchy's loss for errors of this scale (m)."""
        used, forecast = self.used, self.forecast

        def residuals(at: Array) -> Array:
            return np.asarray(forecast.residuals(at)[used].ravel() / scale)

        def jacobian(at: Array) -> Array:
            return -self._jacobian(at) / scale

        found = _scipy("optimize").least_squares(
            residuals, values, jacobian, bounds=(self.low, self.high), x_scale=self.sizes,
            loss="cauchy", f_scale=CAUCHY, max_nfev=STEPS,
        )  # fmt: skip
        return np.asarray(found.x)

    def _jacobian(self, values: Array) -> Array:
        """Return the derivatives (2 U, P) of what is used; 0 where there is none."""
        found = self.forecast.derivatives(values)[0][self.used]
        return np.nan_to_num(found).reshape(2 * len(found), len(self.names))

    def _inside(self, values: Array) -> Array:
        """Move numbers a little off their bounds, where derivatives may not exist."""
        margin = 0.1 * self.sizes
        return np.clip(values, self.low + margin, self.high - margin)

    def _scale(self, values: Array, scale: float | None) -> float:
        """Estimate the standard deviation (m) of the errors, from the residuals and the last scale.

        Places that depend on nothing that is free do not count: they are often where they were
        anyway. A stated error is the least scale: far from the answer the residuals are larger, and
        a loss with too small a scale would take them all for blunders.
        """
        residuals = self.forecast.residuals(values)[self.used].ravel()
        jacobian = self._jacobian(values) * self.sizes
        if self.names:
            residuals = residuals[hanging(jacobian)]
        count = told(jacobian)
        found = (scale and robust_scale(residuals, scale, count)) or first_scale(residuals, count)
        return max(found, self.error or 0.0)

    # -- what the data do not tell -----------------------------------------------------------------

    def _nearest(self, best: _State) -> _State:
        """Return what lies nearest to the scene's own numbers, of all that is as good."""
        if not self.names:
            return best
        blind = blind_part(self._jacobian(best.values) * self.sizes)
        for k in np.flatnonzero(np.diagonal(blind) > 1.0 - SAME):
            values = best.values.copy()
            values[k] = self.own[k]
            best = self._kept(best, _State(values, best.scale))
        blind = blind_part(self._jacobian(best.values) * self.sizes)
        away = (best.values - self.own) / self.sizes
        values = np.clip(best.values - self.sizes * (blind @ away), self.low, self.high)
        if not blind.any() or np.array_equal(values, best.values):
            return best
        return self._kept(best, self._refined(values) if self.forecast.runs(values) else best)

    def _kept(self, best: _State, other: _State) -> _State:
        """Return another state if it is as good, or else the best one."""
        costs = [self._cost(state.values, best.scale) for state in (best, other)]
        return other if costs[1] <= costs[0] + SETTLED else best

    # -- the answer --------------------------------------------------------------------------------

    def _optimum(self, best: _State) -> Optimum:
        """Return a state with what its doubts need; a stated error is the scale."""
        return Optimum(
            forecast=self.forecast,
            values=best.values,
            used=self.used,
            jacobian=self._jacobian(best.values),
            sigma=self.error or best.scale,
            stated=self.error is not None,
            sizes=self.sizes,
            low=self.low,
            high=self.high,
        )

    def _answer(self, best: _State) -> Fit:
        """Return the fit, with standard errors and with what is to be doubted."""
        forecast, values, optimum = self.forecast, best.values, self._optimum(best)
        return Fit(
            scene=forecast.scene_of(values),
            before=forecast.scene,
            values=dict(zip(self.names, values.tolist(), strict=True)),
            standard_errors=dict(zip(self.names, optimum.errors.tolist(), strict=True)),
            correlations=optimum.correlations,
            measured=tuple(forecast.measured),
            residuals=forecast.residuals(values),
            residuals_before=forecast.residuals(forecast.own),
            used=self.used,
            sigma=best.scale if optimum.knows_sigma else math.nan,
            warnings=tuple(doubts(optimum)),
        )


def _scipy(part: str) -> Any:
    """Return a part of SciPy, or say how to get it."""
    from importlib import import_module

    try:
        return import_module(f"scipy.{part}")
    except ImportError:
        raise ImportError(NEEDS_SCIPY) from None
