"""This study measures the error that a solver and a step leave, and the time that they cost.

The error of a setting is the largest distance of any ball's end from its exact end, over all shots.
Its time is the sum over the shots of the least time of one to seven runs. The exact solver errs by
rounding alone (:attr:`~pool_pymunk.Run.rounding`), and no error is taken to be smaller than that.
"""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.model import Scene, Shot
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import (
    SOLVERS,
    find_solver,
    options_for,
    reference_solver,
    simulate,
    simulate_all,
)
from pool_pymunk.solvers.request import request
from pool_pymunk.studies import known
from pool_pymunk.studies.compare import Comparison, contacts
from pool_pymunk.studies.tolerance import slope

Ladders = Mapping[str, Sequence[float | None]]  # These are the steps (s) of each solver.

TRIAL = 1 / 20  # of a run's steps are made to estimate it, which costs that share of its time,
MOST_STEPS, FEWEST_STEPS = 20_000, 1_000  # but at most MOST_STEPS; shorter trials are not made.
MOST_REPEATS = 7  # More runs hardly lower the least of seven times.
LONG_TRIAL = 0.1  # s; after a shorter trial of the fewest steps there is one of more
LEAST_COST = 2e-3  # s; about what a run of few steps takes


@dataclass(frozen=True)
class Setting:
    """A setting is a solver at one step (s): errors (m), shared contacts, time (s), or failure."""

    solver: str
    dt: float | None
    largest: float
    rms: float
    shared: int
    contacts: int
    time: float
    repeats: int
    failure: str = ""


@dataclass(frozen=True)
class Tradeoff:
    """A tradeoff holds every setting measured on one scene.

    ``spread`` (m) is how far the uncertainty of the start positions alone moves an end (standard
    deviation of the worst ball); it is None where it is not known. ``known_by`` says whence that
    uncertainty is known. ``left_out`` names the shots whose exact end depends on rounding: no error
    can be measured there. ``warned`` has the runs that warn, one of each shot and solver, and all
    runs without an exact end.
    """

    scene: Scene
    settings: tuple[Setting, ...]
    spread: float | None
    rounding: float
    left_out: tuple[str, ...]
    known_by: str = ""
    warned: tuple[Run, ...] = ()

    @property
    def exact(self) -> list[str]:
        """Return the solvers that were measured and are exact to rounding."""
        measured = dict.fromkeys(setting.solver for setting in self.settings)
        return [name for name in measured if name in SOLVERS and SOLVERS[name].exact]

    def of(self, solver: str) -> list[Setting]:
        """Return the solver's settings that did not fail, from coarse to fine."""
        return [s for s in self.settings if s.solver == solver and not s.failure]


def ladders_of(names: Iterable[str] | None = None) -> Ladders:
    """Return the steps (s) of these solvers; by default of all, those without a step last."""
    if names is None:
        names = sorted(SOLVERS, key=lambda name: SOLVERS[name].dt is None)
    chosen = map(find_solver, names)
    return {solver.name: solver.ladder or (solver.dt,) for solver in chosen}


def tradeoff(
    scene: Scene,
    ladders: Ladders,
    *,
    shots: Sequence[Shot | None] | None = None,
    budget: float = 60.0,
    spread: float | None = None,
    on_done: Callable[[Tradeoff], object] = lambda _so_far: None,
    options: Mapping[str, Any] | None = None,
    known_by: str = "",
) -> Tradeoff:
    """Measure every solver of ``ladders`` at every step.

    ``budget`` (s) is about the time that repeated runs may take in all; each setting runs once at
    least. ``on_done`` is called after every setting, with all that is measured so far. Of the
    ``options``, such as ``friction``, each solver gets those that it has.
    """
    sound, others = _references(scene, shots)
    each = budget / sum(len(steps) for steps in ladders.values())
    # Rounding moves the ends by what the runs say, and at least by a unit of their last digit.
    rounding = max(
        max(EPSILON * float(np.abs(run.end.position).max()), known(run.rounding) or 0.0)
        for run in sound
    )
    left_out = tuple(run.name for run in others)
    warned = {(run.name, run.solver): run for run in (*sound, *others) if run.warnings}
    result = Tradeoff(scene, (), spread, rounding, left_out, known_by, tuple(warned.values()))
    for solver, dt in ((solver, dt) for solver, steps in ladders.items() for dt in steps):
        taken = options_for(find_solver(solver), options or {})
        play = partial(simulate, scene, solver=solver, dt=dt, **taken)
        fields, runs = _measure(sound, play, each, rounding)
        warned |= {(run.name, run.solver): run for run in runs if run.warnings}
        settings = (*result.settings, Setting(solver, dt, *fields))
        result = replace(result, settings=settings, warned=tuple(warned.values()))
        on_done(result)
    return result


def sound_shots(scene: Scene, shots: Sequence[Shot | None] | None = None) -> list[Shot | None]:
    """Return the shots whose exact end does not depend on rounding (or all, if there is none)."""
    return [run.shot for run in _references(scene, shots)[0]]


def _references(scene: Scene, shots: Sequence[Shot | None] | None) -> tuple[list[Run], list[Run]]:
    """Return the reference runs whose ends rounding does not decide (or all), and the others."""
    runs = list(simulate_all(scene, shots, solver=reference_solver().name))
    sound = [run for run in runs if not run.policies] or runs
    return sound, [run for run in runs if run not in sound]


def _measure(
    references: Sequence[Run], play: Callable[..., Run], budget: float, rounding: float
) -> tuple[tuple[Any, ...], list[Run]]:
    """Return the fields of a Setting after solver and step, and a run of each shot by ``play``."""
    found, times, repeats = list[Comparison](), 0.0, MOST_REPEATS
    for reference in references:
        until = time.perf_counter() + budget / len(references)
        runs = [play(reference.shot)]
        while len(runs) < MOST_REPEATS and time.perf_counter() + runs[-1].wall_time < until:
            runs.append(play(reference.shot))
        status, repeats = runs[0].status, min(repeats, len(runs))
        if status not in ("settled", reference.status):
            failed = (math.nan, math.nan, 0, 0, math.nan, len(runs), status)
            return failed, [*(one.run for one in found), runs[0]]
        found.append(Comparison(reference, runs[0]))
        times += min(run.wall_time for run in runs)
    largest = max(rounding, *(one.largest for one in found))
    rms = max(rounding, math.sqrt(sum(one.rms**2 for one in found) / len(found)))
    shared, count = sum(one.shared for one in found), sum(map(len, map(contacts, references)))
    return (largest, rms, shared, count, times, repeats), [one.run for one in found]


def planned(
    scene: Scene, ladders: Ladders, shots: Sequence[Shot | None], budget: float
) -> list[float]:
    """Return about how long (s) each setting will be measured, in the order of the settings."""
    share, found = budget / (sum(map(len, ladders.values())) * len(shots)), list[float]()
    durations: list[float] = []
    for solver, steps in ladders.items():
        finest = steps[-1]
        guesses = estimate(scene, shots, solver, finest, durations)
        durations = durations or [one.duration for one in guesses if one.steps]
        for dt in steps:
            fewer = finest / dt if dt and finest else 1.0
            costs = (max(one.cost * fewer, LEAST_COST) for one in guesses)
            found.append(sum(max(cost, min(MOST_REPEATS * cost, share)) for cost in costs))
    return found


class Estimate(NamedTuple):
    """An estimate has the computing time (s; 0: few steps), the shot's duration (s), its steps."""

    cost: float
    duration: float
    steps: float


NO_ESTIMATE = Estimate(0.0, math.inf, 0.0)


def estimate(
    scene: Scene,
    shots: Sequence[Shot | None],
    solver: str,
    dt: float | None,
    durations: Sequence[float] | None = None,
    **options: Any,
) -> list[Estimate]:
    """Estimate each shot's duration by the exact solver, its cost by a trial with longer steps.

    Runs of few steps cost next to nothing: 0. A solver without a step has no estimate: it would
    cost 0, for ever. ``durations`` (s) are those of the shots, if they are known. Other arguments
    are those of :func:`~pool_pymunk.simulate`.

    >>> from pool_pymunk import load
    >>> scene = load("report")
    >>> [one] = estimate(scene, scene.shots[:1], "time-slice", 1e-9)
    >>> one.cost > 60.0, 1.4 < one.duration < 1.6, 1e9 < one.steps < 2e9
    (True, True, True)
    """
    step, found = dt or find_solver(solver).dt, list[Estimate]()
    if step is None:
        return [NO_ESTIMATE] * len(shots)
    said = {key: options[key] for key in ("law", "max_time") if key in options}
    asked = request(scene, reference_solver().name, **said)
    asked = asked._replace(settings=asked.settings._replace(measures_policies=False))
    for k, shot in enumerate(shots):
        duration = durations[k] if durations else asked.play(shot).duration
        one = Estimate(0.0, duration, duration / step)
        if one.steps >= FEWEST_STEPS / TRIAL:
            for most in (FEWEST_STEPS, MOST_STEPS):
                coarse = duration / min(most, TRIAL * one.steps)
                trial = simulate(scene, shot, solver=solver, dt=coarse, **options)
                if trial.wall_time > LONG_TRIAL:
                    break
            times = coarse / step  # The run itself has this many times the trial's steps.
            one = Estimate(trial.wall_time * times, trial.duration, trial.steps * times)
        found.append(one)
    return found


def order(settings: Sequence[Setting], floor: float, ceiling: float) -> float | None:
    """Return the slope of log error over log dt, of errors from 10 ``floor`` to ``ceiling`` (m).

    It is None for fewer than three of them. Smaller errors are rounding, which has no order.
    """
    return slope([(s.dt, s.largest) for s in settings if s.dt and 10 * floor < s.largest < ceiling])


def cheapest(settings: Iterable[Setting], tolerance: float) -> Setting | None:
    """Return the fastest of the settings that err by ``tolerance`` (m) at most."""
    good = [s for s in settings if not s.failure and s.largest <= tolerance]
    return min(good, key=lambda s: s.time, default=None)


SHARED_ENGINE = (
    "The solvers that are exact to rounding share one contact engine: their agreement proves "
    "nothing by itself."
)


def sentences(result: Tradeoff) -> list[str]:
    """Say in words what the measurement tells."""
    units = result.scene.units
    lines = [_within(result, digits) for digits in (1.0, 0.1, 0.01, 0.001)]
    lines += [
        f"Without a step: {one.solver} in {one.time * 1e3:.3g} ms, "
        f"to {units.from_si(one.largest, 'length'):.1g} {units.length}."
        for one in result.of(reference_solver().name)
    ]
    if result.spread is not None:
        lines += [*[result.known_by] * bool(result.known_by), _verdict(result, result.spread)]
    if len(result.exact) > 1:
        lines.append(
            f"{SHARED_ENGINE} Others are independent: the time slices, which converge to them, "
            "and the reference in forty digits that the project's tests compare with."
        )
    return lines + list(_without_exact_end(result))


def _verdict(result: Tradeoff, spread: float) -> str:
    """Say what the uncertainty of the starts leaves to choose."""
    units, measured = result.scene.units, [s for s in result.settings if not s.failure]
    finer = sum(s.largest < spread for s in measured)
    rules = f"so it rules the choice: {finer} of {len(measured)} settings err by less"
    if not finer:
        rules = "and every setting errs by more, so it rules nothing"
    return (
        f"This uncertainty of the starts alone moves an end by "
        f"{units.from_si(spread, 'length'):.2g} {units.length} (standard deviation, worst ball). "
        f"A smaller error than that gains nothing, {rules}."
    )


def _without_exact_end(result: Tradeoff) -> Iterator[str]:
    """Say which shots have no exact end, and what that means."""
    exact = reference_solver().name
    for run in result.warned:
        if run.solver == exact and run.policies:
            why = ", ".join(sorted(run.policies))
            if run.name in result.left_out:
                yield (
                    f"{run.name} is left out: its exact end depends on what has no exact answer "
                    f"({why}). Alone (--shot) it is measured all the same."
                )
            else:
                yield f"Errors of {run.name} mean little: it has no exact end ({why})."


def _within(result: Tradeoff, digits: float) -> str:
    """Say in words which step comes within this many units of length in the least time."""
    unit = result.scene.units.length
    stepped = (s for s in result.settings if s.dt is not None)
    best = cheapest(stepped, result.scene.units.to_si(digits, "length"))
    if best is None or best.dt is None:
        return f"No step tried comes within {digits:g} {unit}."
    slices = (
        f", {one.time / best.time:,.0f} times faster than slices of {one.dt:g} s"
        for name, solver in SOLVERS.items()
        for one in result.of(name)
        if one.dt and one.dt == solver.published_step
    )
    at = f"{best.solver} at {step_text(best.dt)} does, in {best.time * 1e3:.3g} ms"
    return f"Within {digits:g} {unit}: {at}{''.join(slices)}."


def machine() -> dict[str, str]:
    """Return what the times were measured on."""
    import pymunk

    from pool_pymunk import __version__

    return {
        "machine": platform.machine(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "pymunk": pymunk.version,
        "pool_pymunk": __version__,
    }
