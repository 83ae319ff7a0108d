"""This study fits numbers of a scene to where balls were measured, and says how sure they are.

The fit is least squares with a robust loss (Cauchy's, of SciPy) and exact derivatives of the runs.
Ends depend smoothly on the numbers only as long as contacts come in the same order, so the loss has
jumps and many minima. The search starts from the scene's own numbers and the best of many others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from pool_pymunk.laws import Law
from pool_pymunk.model import Scene, inputs
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, flag, size, whole
from pool_pymunk.model.problems import listed, setting_error
from pool_pymunk.results.table import ResultTable
from pool_pymunk.studies import Mask, known
from pool_pymunk.studies.fit_doubts import (
    CAUCHY,
    SAME,
    Optimum,
    doubts,
    loss,
    on_one_thread,
    scipy,
)
from pool_pymunk.studies.measured import Forecast, Measurement, read_measured

# These limits were chosen so that the fits of tests/studies/test_fit.py find their minima.
MORE = 6  # rounds of further starts, where the residuals are implausible
CLOSE = 0.15  # Every second round looks within this share of the ranges, around the best numbers.
LOOKS, MOST_LOOKS = 64, 400  # tries of a look: for each free number, and at most
STEPS = 60  # evaluations of one search
ROUNDS, FIRST_ROUNDS = 20, 3  # new estimates of the scale, in the last and in a first search
SETTLED = 1e-3  # The scale is found when it changes by less than this share.
COLUMNS = ("shot", "ball", "t", "x", "y", "x_fitted", "y_fitted", "off", "off_before", "used")


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit has the numbers that bring a scene closest to what was measured, and their errors.

    ``scene`` has the fitted numbers, and ``before`` is the one that was given. ``values`` and
    ``standard_errors`` are by the inputs' names, in SI, angles in degrees; ``correlations`` is
    (P, P) in their order. What the data cannot tell has the standard error nan. ``residuals``
    (M, 2) are ``measured`` less fitted places (m), ``residuals_before`` those of the scene that was
    given, and ``used`` (M,) tells which places were fitted. ``sigma`` (m) is the standard deviation
    of one measured coordinate: estimated or stated, nan where it is unknown. ``warnings`` say what
    the data cannot tell, and what is to be doubted.
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
        units, unit_of = self.scene.units, inputs.unit_of
        found = [f"{name} {self.written(name)} {unit_of(units, name)}" for name in self.values]
        said = ", ".join(map(str.rstrip, found)) or "nothing free"
        if math.isfinite(self.sigma):
            said += f"; sigma {units.text(self.sigma, '.3g')}"
        said += "; see its warnings" * bool(self.warnings)
        return f"<Fit to {len(self.measured)} places: {said}>"

    def written(self, name: str) -> str:
        """Write a fitted number with its standard error, in the scenario's units."""
        both = self.values[name], self.standard_errors[name]
        return _with_error(*(inputs.in_units(self.scene.units, name, each) for each in both))

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

    @property
    def table(self) -> ResultTable:
        """A row for each place: measured, fitted, how far off, in the scenario's unit."""
        return table(self)

    def as_dict(self) -> dict[str, object]:
        """Return the fit as in the JSON of ``fit --json``, in SI; null stands for unknown."""
        return {
            "values": dict(self.values),
            "before": {name: inputs.input_value(self.before, name) for name in self.values},
            "standard_errors": {name: known(e) for name, e in self.standard_errors.items()},
            "correlations": [[known(each) for each in row] for row in self.correlations.tolist()],
            **{key: known(getattr(self, key)) for key in ("sigma", "rms", "rms_before")},
            "measured": [one._asdict() for one in self.measured],
            "residuals": self.residuals.tolist(),
            "used": self.used.tolist(),
            "warnings": list(self.warnings),
        }


def _with_error(value: float, error: float) -> str:
    """Write a value with its standard error, both to the second digit of the error.

    >>> _with_error(0.70012, 0.00031), _with_error(0.5, math.nan), _with_error(12.0, 3.0)
    ('0.70012 ± 0.00031', '0.5 (unknown)', '12.0 ± 3.0')
    """
    if not math.isfinite(error):
        return f"{value:.4g} (unknown)"
    digits = 1 - math.floor(math.log10(error)) if error > 0.0 else 6
    digits = min(max(digits, 0), 15)
    return f"{value:.{digits}f} ± {error:.{digits}f}"


def table(found: Fit) -> ResultTable:
    """Return a row for each place: measured, fitted, and how far off, in the scenario's unit."""
    unit = found.scene.units.from_si(1.0, "length")
    shots = [shot.name for shot in found.scene.shots] or [""]
    places = np.array([(one.x, one.y) for one in found.measured])
    off = (np.hypot(*each.T) for each in (found.residuals, found.residuals_before))
    numbers = unit * np.column_stack((places, places - found.residuals, *off))
    return ResultTable(COLUMNS, [
        [shots[one.shot - 1], one.ball, one.t, *(f"{each:.10g}" for each in its), int(used)]
        for one, its, used in zip(found.measured, numbers, found.used, strict=True)
    ])  # fmt: skip


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
    aims_anew: bool = False,
    on_done: Callable[[int, int], object] | None = None,
) -> Fit:
    """Fit numbers of a scene to where its balls were measured.

    ``measured`` is a CSV file with the columns shot (number or name), ball, x, y and optionally t
    (s). Its lengths are in the scenario's unit, and places without a time are ends. Otherwise it is
    "published" (the ends that the scenario has), or it is rows (shot, ball, x, y) or
    (shot, ball, x, y, t) in SI. ``free`` are the names of inputs as in
    :class:`~pool_pymunk.Derivatives`, with "speed.2" for that of the second shot, or groups of
    them: "restitution", "friction", "position", "mass", "radius", "speed", "angle", "roll",
    "velocity" (of balls that no shot strikes). ``error`` (m) is the standard deviation of one
    measured coordinate; by default it is estimated. The loss is robust, so a few blunders do no
    harm. The search starts from the scene's own numbers and from ``starts`` - 1 others, the best of
    a first look with the random numbers of ``seed``. ``law`` is that of every contact (default: the
    scene's). A shot that aims at a ball is aimed once, in the scene as it is; with ``aims_anew`` it
    goes to where each try of the search has the ball. All runs are exact. ``on_done(done,
    planned)`` is called as a look begins, after each of its tries, and after each search, which
    counts as 60 tries; more is planned where the residuals are implausible. Raises
    SceneError or SettingError, one line a problem, and ImportError without SciPy.

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
    anew = argument("aims_anew", aims_anew, flag)
    with on_one_thread():
        return _Minimizer(Forecast(scene, names, rows, law, anew), error, first, on_done).fit(count)


def input_names(scene: Scene, free: str | Sequence[str], shots: Sequence[int] = ()) -> inputs.Names:
    """Return the names of the inputs that shall be free, each once.

    The inputs of a shot are those of the measured ``shots``. Raises SettingError for a name that
    the scene does not have, and for an input that a fit cannot vary.
    """
    measured = map(str, shots if scene.shots else ())
    groups = {
        group: [name for name in names if not _why_not(scene, name, shots)]
        for group, names in inputs.names_in(scene, measured).items()
    }
    every = inputs.names_in(scene, map(str, range(1, len(scene.shots) + 1)))
    found = inputs.chosen("free", free, groups, chain.from_iterable(every.values()))
    for name in found:
        if why := _why_not(scene, name, shots):
            raise setting_error("free", name, f"there is no such input: {why}")
    return found


def _why_not(scene: Scene, name: str, shots: Sequence[int]) -> str:
    """Say why an input of the scene cannot be free; return "" if it can."""
    kind, whose = inputs.parts(name)
    if kind in ("angle", "turn") and scene.shots[int(whose) - 1].aim is not None:
        return f"shot {whose} aims at a ball, and that gives its direction"
    struck = {scene.shots[k - 1].ball for k in shots} if scene.shots else set()
    if inputs.TABLE[kind].group == "velocity" and struck == {whose}:
        return f"ball {whose} is struck, so its velocity is that of the shot: speed and angle"
    return ""


def _span(scene: Scene, name: str) -> tuple[float, float]:
    """Return the range in which a search looks for an input, around the scene's own number."""
    kind, whose = inputs.parts(name)
    row, own = inputs.TABLE[kind], inputs.input_value(scene, name)
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

    def __init__(
        self, forecast: Forecast, error: float | None, seed: int,
        on_done: Callable[[int, int], object] | None = None,
    ) -> None:  # fmt: skip
        self.forecast, self.error, self.seed = forecast, error, seed
        self.on_done, self.done, self.planned = on_done or (lambda *_: None), 0, 0
        self.names, self.own, self.sizes = forecast.names, forecast.own, forecast.sizes
        self.low, self.high = forecast.low, forecast.high
        self.used: Mask = np.ones(len(forecast.measured), dtype=bool)

    def fit(self, starts: int) -> Fit:
        """Search from several starts, and return the fit."""
        margin = 0.1 * self.sizes  # At their bounds numbers may have no derivatives.
        first = np.clip(self.own, self.low + margin, self.high - margin)
        self.used, others = self._sound(first), starts > 1 and bool(self.names)
        best = self._best_of([first, *(self._look(0, starts - 1) if others else ())])
        for k in range(1, 1 + MORE if others else 1):
            if self._judged(best).is_plausible:
                break
            best = self._best_of(self._look(k, starts, best), [best])
        best = self._nearest(best)
        if self.error is not None:  # It is known, so it need not be estimated any more.
            values = self._down(best.values, self.error) if self.names else best.values
            best = Optimum(self.forecast, values, self.used, self.error)
        forecast, numbers, optimum = self.forecast, best.values.tolist(), self._judged(best)
        return Fit(
            forecast.scene_of(numbers), forecast.scene, dict(zip(self.names, numbers, strict=True)),
            dict(zip(self.names, optimum.errors.tolist(), strict=True)), optimum.correlations,
            tuple(forecast.measured), best.residuals, forecast.residuals(self.own), self.used,
            best.sigma if optimum.knows_sigma else math.nan, tuple(doubts(optimum)),
        )  # fmt: skip

    def _best_of(self, starts: Sequence[Array], known: Sequence[Optimum] = ()) -> Optimum:
        """Search from these starts, and refine the best of their optima and the ``known`` ones.

        The refinement is repeated until the same places have derivatives as before.
        """
        found = [*known]
        self.planned += STEPS * (len(starts) + 1)
        for start in starts:
            found.append(self._refined(start, FIRST_ROUNDS))
            self._tell(STEPS)
        scale = min(each.sigma for each in found)  # All are judged by the smallest scale.
        best = self._refined(min(found, key=lambda each: loss(each.off, scale)).values)
        for _ in range(5):
            sound = self._sound(best.values)
            if (sound == self.used).all():
                break
            self.used = sound
            best = self._refined(best.values)
        self._tell(STEPS)
        return best

    def _tell(self, done: int) -> None:
        """Count these tries as done, and say how far the fit has come."""
        self.done += done
        self.on_done(self.done, self.planned)

    def _sound(self, values: Array) -> Mask:
        """Tell which places have derivatives here."""
        if self.forecast.runs(values) is None:
            message = "its shots do not come to an end"
            raise setting_error("scene", self.forecast.scene.title, message)
        derivatives, why = self.forecast.derivatives(values)
        found: Mask = np.asarray(np.isfinite(derivatives).all(axis=(1, 2)))
        if not found.any():
            message = "no measured place has derivatives: runs have no exact answer to fit with"
            raise setting_error("measured", len(found), "; ".join((message, *why)))
        return found

    def _look(self, k: int, count: int, best: Optimum | None = None) -> list[Array]:
        """Return the best of the tries of look ``k``; every second look stays near ``best``."""
        low, high = np.array([_span(self.forecast.scene, name) for name in self.names]).T
        if best is not None and k % 2 == 1:
            close = CLOSE * (high - low) * 0.5 ** (k // 2)
            low, high = best.values - close, best.values + close
        halton = scipy("stats").qmc.Halton(len(self.names), scramble=False)
        shift = np.random.default_rng(self.seed).random(len(self.names))
        looks = min(LOOKS * len(self.names), MOST_LOOKS)
        halton.fast_forward(k * looks)
        draws = (halton.random(looks) + shift) % 1.0
        tries = list(np.clip(low + draws * (high - low), self.low, self.high))
        radius = min(ball.radius for ball in self.forecast.scene.balls)
        self.planned += len(tries)
        self._tell(0)
        costs = []
        for at in tries:
            costs.append(loss(self.forecast.residuals(at)[self.used], radius))
            self._tell(1)
        order = np.argsort(costs, kind="stable")[:count]
        return [tries[k] for k in order if math.isfinite(costs[k])]

    def _at(self, values: Array, last: float | None = None) -> Optimum:
        """Return the optimum at these values; its scale follows the residuals and ``last``, if any.

        A stated error is the least scale: with a smaller scale all places would seem blunders.
        """
        here = Optimum(self.forecast, values, self.used, 1.0)
        here.sigma = max(here.scale(last), self.error or 0.0)
        return here

    def _refined(self, start: Array, rounds: int = ROUNDS) -> Optimum:
        """Minimize the loss from a start, and estimate the errors' scale anew after each round."""
        best = self._at(np.clip(start, self.low, self.high))
        for _ in range(rounds if self.names else 0):
            last = best.sigma
            best = self._at(self._down(best.values, last), last)
            if abs(best.sigma - last) <= SETTLED * last:
                break
        return best

    def _down(self, values: Array, scale: float) -> Array:
        """Minimize Cauchy's loss for errors of this scale (m)."""
        used, forecast = self.used, self.forecast
        found = scipy("optimize").least_squares(
            lambda at: forecast.residuals(at)[used].ravel() / scale, values,
            lambda at: -forecast.jacobian(at, used) / scale, bounds=(self.low, self.high),
            x_scale=self.sizes, loss="cauchy", f_scale=CAUCHY, max_nfev=STEPS,
        )  # fmt: skip
        return np.asarray(found.x)

    def _nearest(self, best: Optimum) -> Optimum:
        """Return, of the equally good numbers, those nearest to the scene's own."""
        for k in np.flatnonzero(np.diagonal(best.blind) > 1.0 - SAME):
            values = best.values.copy()
            values[k] = self.own[k]
            if self._is_as_good(best, values):
                best = Optimum(self.forecast, values, self.used, best.sigma)
        away = best.blind @ ((best.values - self.own) / self.sizes)
        values = np.clip(best.values - self.sizes * away, self.low, self.high)
        if not best.blind.any() or np.array_equal(values, best.values):
            return best
        other = self._refined(values) if self.forecast.runs(values) else best
        return other if self._is_as_good(best, other.values) else best

    def _is_as_good(self, best: Optimum, values: Array) -> bool:
        now = loss(self.forecast.residuals(values)[self.used], best.sigma)
        return now <= loss(best.residuals[self.used], best.sigma) + SETTLED

    def _judged(self, best: Optimum) -> Optimum:
        """Return the optimum for ``doubts``: with the stated error, or else with its own scale."""
        sigma = self.error or best.sigma
        return Optimum(self.forecast, best.values, best.used, sigma, self.error is not None)
