"""This study measures the error that a solver and a step leave, and the time that they cost.

The error of a setting is the largest distance of any ball's end from its exact end, over all shots.
Its time is the sum over the shots of the least of several runs after a warm-up. The exact solver
errs by rounding alone. This rounding is measured as well: the scene is turned through an angle, and
its ends are turned back.
"""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.model import Point, Scene, Shot, Table
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, find_solver, request, simulate, yardstick
from pool_pymunk.studies.compare import Comparison, contacts
from pool_pymunk.studies.tolerance import slope

Ladders = Mapping[str, Sequence[float | None]]  # These are the steps (s) of each solver.

TURN = 1.0  # rad
TRIAL = 1 / 20  # of a run's steps are made to estimate it, which costs that share of its time,
MOST_STEPS, FEWEST_STEPS = 20_000, 1_000  # but never more nor fewer steps than these.
MOST_REPEATS = 7


@dataclass(frozen=True)
class Setting:
    """A setting is one solver at one step, measured.

    It holds the errors (m), the contacts shared and the time (s), or the failure.
    """

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
    deviation of the worst ball); it is None where it is not known. ``left_out`` names the shots
    whose exact end depends on rounding: no error can be measured there.
    """

    scene: Scene
    settings: tuple[Setting, ...]
    spread: float | None
    rounding: float
    left_out: tuple[str, ...]
    seed: int

    @property
    def exact(self) -> list[str]:
        """Return the solvers that were measured and are exact to rounding."""
        measured = dict.fromkeys(setting.solver for setting in self.settings)
        return [name for name in measured if name in SOLVERS and SOLVERS[name].exact]

    def of(self, solver: str) -> list[Setting]:
        """Return the solver's settings that did not fail, from coarse to fine."""
        return [s for s in self.settings if s.solver == solver and not s.failure]


def ladders_of(names: Iterable[str] | None = None) -> Ladders:
    """Return the steps (s) at which solvers are measured; default: all solvers, steps first.

    Solvers without a step come last. Raises SettingError for an unknown solver.
    """
    if names is None:
        names = sorted(SOLVERS, key=lambda name: SOLVERS[name].dt is None)
    chosen = map(find_solver, names)
    return {solver.name: solver.ladder or (solver.dt,) for solver in chosen}


def tradeoff(
    scene: Scene,
    ladders: Ladders | None = None,
    *,
    shots: Sequence[Shot | None] | None = None,
    budget: float = 60.0,
    spread: float | None = None,
    seed: int = 0,
    on_done: Callable[[Tradeoff], object] = lambda _so_far: None,
    options: Mapping[str, Any] | None = None,
) -> Tradeoff:
    """Measure every solver of ``ladders`` (default: all solvers) at every step.

    ``budget`` (s) is about the time that repeated runs may take in all; each setting runs once at
    least. ``on_done`` is called after every setting, with all that is measured so far. Of the
    ``options``, such as ``friction``, each solver gets those that it has.
    """
    ladders = ladders_of() if ladders is None else ladders
    exact = _exact(scene, shots)
    sound = _sound(exact)
    rounding = max(_rounding(run) for run in sound)
    count = sum(len(steps) for steps in ladders.values())
    left_out = tuple(run.name for run in exact if run not in sound)
    result = Tradeoff(scene, (), spread, rounding, left_out, seed)
    for solver, steps in ladders.items():
        for dt in steps:
            one = _measure(sound, solver, dt, budget / count, rounding, options or {})
            result = replace(result, settings=(*result.settings, one))
            on_done(result)
    return result


def sound_shots(scene: Scene, shots: Sequence[Shot | None] | None = None) -> list[Shot | None]:
    """Return the shots whose exact end does not depend on rounding (or all, if there is none)."""
    return [run.shot for run in _sound(_exact(scene, shots))]


def _exact(scene: Scene, shots: Sequence[Shot | None] | None) -> list[Run]:
    played = shots if shots is not None else scene.shots or (None,)
    return [simulate(scene, shot, solver=yardstick().name) for shot in played]


def _sound(exact: list[Run]) -> list[Run]:
    return [run for run in exact if not run.policies] or exact


def _measure(
    exact: Sequence[Run], solver: str, dt: float | None, budget: float, rounding: float,
    options: Mapping[str, Any],
) -> Setting:  # fmt: skip
    """Return error and time of one setting over all shots."""
    found, times, repeats = [], 0.0, MOST_REPEATS
    for reference in exact:
        run, least, repeated = _timed(reference, solver, dt, budget / len(exact), options)
        if run.status not in ("settled", reference.status):
            return Setting(solver, dt, math.nan, math.nan, 0, 0, math.nan, repeated, run.status)
        found.append(Comparison(reference, run))
        times += least
        repeats = min(repeats, repeated)
    return Setting(
        solver=solver,
        dt=dt,
        largest=max(rounding, *(one.largest for one in found)),
        rms=max(rounding, math.sqrt(sum(one.rms**2 for one in found) / len(found))),
        shared=sum(one.shared for one in found),
        contacts=sum(len(contacts(one.reference)) for one in found),
        time=times,
        repeats=repeats,
    )


def _timed(
    reference: Run, solver: str, dt: float | None, budget: float, options: Mapping[str, Any]
) -> tuple[Run, float, int]:
    """Return a run, the least wall time (s) of several after a warm-up, and how many there were."""
    taken = {name: options[name] for name in options if name in find_solver(solver).options}
    play = partial(simulate, reference.scene, reference.shot, solver=solver, dt=dt, **taken)
    began = time.perf_counter()
    run = play()
    least, repeats = run.wall_time, 1
    while repeats < MOST_REPEATS and time.perf_counter() - began + run.wall_time < budget:
        run = play()
        least = min(least, run.wall_time)
        repeats += 1
    return run, least, repeats


def _rounding(run: Run) -> float:
    """Return how far (m) rounding alone moves an exact end: turn the scene, and turn it back."""
    scene = run.scene
    turned = turn(scene, TURN)
    shot = None if run.shot is None else turned.shots[scene.shots.index(run.shot)]
    ends = simulate(turned, shot, solver=yardstick().name).final
    back = {id_: _turned(end, -TURN) for id_, end in ends.items()}
    apart = max(math.dist(back[id_], end) for id_, end in run.final.items())
    size = max(abs(x) for end in run.final.values() for x in end)
    return max(apart, 2.0**-52 * size)


def turn(scene: Scene, angle: float) -> Scene:
    """Return the scene turned by ``angle`` (rad) about the origin."""
    table = scene.table and Table(tuple(_turned(corner, angle) for corner in scene.table.outline))
    balls = tuple(
        replace(b, position=_turned(b.position, angle), velocity=_turned(b.velocity, angle))
        for b in scene.balls
    )
    shots = tuple(
        replace(shot, velocity=_turned(shot.launch, angle), speed=None, angle=None)
        if shot.launch
        else shot
        for shot in scene.shots
    )
    return replace(scene, table=table, balls=balls, shots=shots)


def _turned(p: Point, angle: float) -> Point:
    c, s = math.cos(angle), math.sin(angle)
    return (c * p[0] - s * p[1], s * p[0] + c * p[1])


# -- how long a run will take ----------------------------------------------------------------------


class Estimate(NamedTuple):
    """An estimate of one shot: how long the computer takes (s), the shot (s), and its steps.

    ``cost`` is zero for a shot of which a trial is not worth its time, because it has few steps.
    """

    cost: float
    duration: float
    steps: float


def estimate(
    scene: Scene, shots: Sequence[Shot | None], solver: str, dt: float | None, **options: Any
) -> list[Estimate]:
    """Estimate each shot by the exact solver, and by a trial with fewer and longer steps.

    A solver without a step has no estimate. The arguments are those of
    :func:`~pool_pymunk.simulate`.

    >>> from pool_pymunk import load
    >>> scene = load("report")
    >>> [one] = estimate(scene, scene.shots[:1], "time-slice", 1e-9)
    >>> one.cost > 60.0, 1.4 < one.duration < 1.6, 1e9 < one.steps < 2e9
    (True, True, True)
    """
    step = dt or find_solver(solver).dt
    if step is None:
        return []
    return [_estimate(scene, shot, solver, step, options) for shot in shots]


def _estimate(
    scene: Scene, shot: Shot | None, solver: str, dt: float, options: dict[str, Any]
) -> Estimate:
    said = {key: options[key] for key in ("law", "max_time") if key in options}
    asked = request(scene, yardstick().name, **said)
    settings = asked.settings._replace(measures_policies=False)
    duration = asked._replace(settings=settings).play(shot).duration
    steps = duration / dt
    if steps < FEWEST_STEPS / TRIAL:
        return Estimate(0.0, duration, steps)
    coarse = duration / min(MOST_STEPS, TRIAL * steps)
    trial = simulate(scene, shot, solver=solver, dt=coarse, **options)
    times = coarse / dt  # The run itself has this many times the trial's steps.
    return Estimate(trial.wall_time * times, trial.duration, trial.steps * times)


# -- what it means -------------------------------------------------------------------------------


def order(settings: Sequence[Setting], floor: float, ceiling: float) -> float | None:
    """Return the order of convergence: the slope of log error over log dt.

    Only errors between floor and ceiling (m) count. The order is None if fewer than three settings
    lie there, because an error that is rounding has no order.
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
INDEPENDENT = (
    "Two others are independent: the time slices, which converge to them, and the reference in "
    "forty digits that the project's tests compare with."
)


def sentences(result: Tradeoff) -> list[str]:
    """Say in words what the measurement tells."""
    units = result.scene.units
    lines = [_within(result, digits) for digits in (1.0, 0.1, 0.01, 0.001)]
    for exact in result.of(yardstick().name):
        error = units.from_si(exact.largest, "length")
        cost = f"{exact.time * 1e3:.3g} ms"
        lines.append(f"Without a step: {exact.solver} in {cost}, to {error:.1g} {units.length}.")
    if result.spread is not None:
        lines.append(
            f"The start positions are known to the last digit written: that alone moves an end by "
            f"{units.from_si(result.spread, 'length'):.2g} {units.length} (standard deviation, "
            f"worst ball). A smaller error than that gains nothing."
        )
    if len(result.exact) > 1:
        lines.append(f"{SHARED_ENGINE} {INDEPENDENT}")
    lines += [
        f"{name} is left out: its exact end depends on a slip of zero, which rounding decides."
        for name in result.left_out
    ]
    return lines


def _within(result: Tradeoff, digits: float) -> str:
    """Say in words which step comes within this many units of length in the least time."""
    units = result.scene.units
    stepped = (s for s in result.settings if s.dt is not None)
    best = cheapest(stepped, units.to_si(digits, "length"))
    if best is None or best.dt is None:
        return f"No step tried comes within {digits:g} {units.length}."
    text = (
        f"Within {digits:g} {units.length}: {best.solver} at {step_text(best.dt)} does, "
        f"in {best.time * 1e3:.3g} ms"
    )
    steps = ((name, solver.published_step) for name, solver in SOLVERS.items())
    for slices in (s for name, dt in steps for s in result.of(name) if dt and s.dt == dt):
        text += f", {slices.time / best.time:,.0f} times faster than slices of {slices.dt:g} s"
    return text + "."


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
