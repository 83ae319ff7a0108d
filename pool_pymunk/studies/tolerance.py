"""This study finds a time step that keeps an error below a tolerance, from runs alone.

It needs no exact solution, so it serves any pymunk world. Halving the step until the ends no longer
change is optimistic: if contacts are found at the end of a step, every second one is found at the
same time with half the step, so ends agree by chance. (For single contacts at random instants, a
quarter of the ends would be outside of the tolerance.) So a step dt is accepted only if

- the ends at 4 dt, 2 dt and dt agree (two halvings; the first may change the ends twice as much),
  and the ends at dt agree with those at five steps between dt and 2 dt, which have other grids;
- all of them agree to a quarter of the tolerance (``SAFETY`` is 4);
- in all these runs the same contacts happen, in the same order for every ball, and no ball has two
  of them so close together that steps blur their order.

A comparison of runs cannot see a contact that all runs miss: a graze shorter than a step.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.model import Point, Scene, Shot, Units
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import counted, step_text
from pool_pymunk.solvers import SettingError, find_solver, simulate
from pool_pymunk.studies import known
from pool_pymunk.studies.compare import contact_order, contacts

# The estimated error is this many times the largest change. Of 2,000 contacts that are answered at
# the end of a step, 2.0 accepts 4 wrong ends, and 4.0 accepts none; 8.0 costs 9 % more.
SAFETY = 4.0
BETWEEN = tuple(2.0 ** (k / 6) for k in (5, 4, 3, 2, 1))  # dt; ends at these steps must agree, too
COARSEST = 1 / 60  # s, a frame of a screen, which is the step of most games
NO_ORDER = 0.3  # Methods have an order of 1/2 or more; less than this is no order.


class Outcome(NamedTuple):
    """An outcome is where one run ended: ``positions`` (m) and, where known, contacts and steps.

    ``contacts`` may be anything that is equal if the same contacts happened in the same order.
    ``resolved`` is False if some follow each other so closely that steps blur their order.
    """

    positions: Sequence[Point]
    contacts: Hashable = None
    steps: int = 0
    resolved: bool = True


RunAtStep = Callable[[float], Outcome | Sequence[Point]]


class Level(NamedTuple):
    """A level is one halving: its step (s), the change of the ends (m), the estimated error (m).

    ``change`` and ``error`` are infinite at the first level, and if the ends are not finite.
    ``error`` is also infinite if contacts differ from those at twice the step.
    """

    dt: float
    change: float
    same_contacts: bool
    error: float


@dataclass(frozen=True)
class Choice:
    """A choice is the step (s) that was chosen, and the work spent.

    ``reached`` tells whether its error is within the ``tolerance`` (m), and ``reason`` why not.
    ``error`` (m) is the estimate for ``dt``, safety factor included. ``order`` is the observed
    order of convergence, None if there are fewer than three changes.
    """

    dt: float
    tolerance: float
    reached: bool
    error: float
    order: float | None
    levels: tuple[Level, ...]
    runs: int
    steps: int
    wall_time: float
    reason: str = ""

    def lines(self, units: Units) -> Iterator[str]:
        """Yield the choice in words: the step, the error, the work, and why it falls short."""
        tolerance, error = (units.from_si(x, "length") for x in (self.tolerance, self.error))
        reached = "reached" if self.reached else "not reached; the finest run is kept:"
        size = f"{error:.2g} {units.length}" if error < math.inf else "unknown"
        yield (
            f"Tolerance {tolerance:.3g} {units.length}: {reached} with dt = {step_text(self.dt)}, "
            f"estimated error {size if error else 'none, to rounding'}"
        )
        order = "" if self.order is None else f"; observed order {self.order:.2f}"
        work = f"{counted(self.runs, 'run')}, {self.steps:,} steps, {self.wall_time:.3g} s"
        yield f"Work: {work}{order}"
        if self.reason:
            yield f"Why: {self.reason}"

    def as_dict(self) -> dict[str, object]:
        """Return the choice as in the JSON of ``run``, in SI; an unknown error is null."""
        keys = "tolerance reached dt error order runs steps wall_time reason"
        return {key: getattr(self, key) for key in keys.split()} | {"error": known(self.error)}


def choose_step(
    run: RunAtStep,
    tolerance: float,
    start: float = COARSEST,
    smallest: float = 1e-6,
    on_run: Callable[[float], object] | None = None,
) -> Choice:
    """Halve the step from ``start`` (s) until the ends are within ``tolerance`` (m) of converged.

    ``run(dt)`` simulates anything with steps of dt seconds and returns where it ended: points (m),
    or an :class:`Outcome`, which also tells the contacts. All runs must end at rest, or at the same
    moment even if it is no multiple of dt. If no step of ``smallest`` (s) or more reaches the
    tolerance, the finest is kept and ``reason`` says why. ``on_run(dt)`` is called before each run.
    Raises SettingError for a tolerance or steps that make no sense.

    >>> def euler(dt):  # x' = -x from 1, to t = 1: first order
    ...     return [((1.0 - dt) ** (1.0 / dt), 0.0)]
    >>> choice = choose_step(euler, tolerance=1e-3, start=1 / 4)
    >>> choice.reached, 1 / choice.dt, abs(euler(choice.dt)[0][0] - math.exp(-1.0)) < 1e-3
    (True, 1024.0, True)
    """
    for key, value in (("tolerance", tolerance), ("start", start), ("smallest", smallest)):
        if not 0.0 < value < math.inf:
            raise SettingError(f"{key} = {value}: must be greater than 0 and finite")
    if smallest > start:
        raise SettingError(f"smallest = {smallest}: must not be larger than start = {start}")
    began, played = time.perf_counter(), list[Outcome]()

    def outcome_at(dt: float) -> Outcome:
        if on_run is not None:
            on_run(dt)
        ended = run(dt)
        played.append(ended if isinstance(ended, Outcome) else Outcome(ended))
        return played[-1]

    levels, last, settled, dt = list[Level](), None, math.inf, start
    while dt >= smallest and not (levels and levels[-1].error <= tolerance):
        before, last = last, outcome_at(dt)
        change = _distance(before, last)
        same = before is not None and before.contacts == last.contacts and last.resolved
        largest = max(change, settled / 2.0)
        for factor in BETWEEN:
            if not same or SAFETY * largest > tolerance:
                break
            other = outcome_at(factor * dt)
            same = other.contacts == last.contacts
            largest = max(largest, _distance(other, last))
        levels.append(Level(dt, change, same, SAFETY * largest if same else math.inf))
        settled = change if same else math.inf
        dt /= 2.0
    shared = [(one.dt, one.change) for one in levels if one.same_contacts]
    order = slope([(dt, change) for dt, change in shared if 0.0 < change < math.inf][-5:])
    finest, steps = levels[-1], sum(each.steps for each in played)
    reached = finest.error <= tolerance
    return Choice(
        finest.dt, tolerance, reached, finest.error, order, tuple(levels), len(played), steps,
        time.perf_counter() - began, "" if reached else _reason(levels, order),
    )  # fmt: skip


def _distance(a: Outcome | None, b: Outcome) -> float:
    """Return the largest distance (m) of two runs' ends; infinite if they cannot be compared."""
    off = [math.inf] if a is None else list(map(math.dist, a.positions, b.positions))
    return max(off, default=0.0) if all(map(math.isfinite, off)) else math.inf


def slope(errors: Sequence[tuple[float, float]]) -> float | None:
    """Return the slope of log error over log dt, of pairs (dt, error); None for fewer than three.

    >>> round(slope([(0.1, 2e-4), (0.01, 2e-6), (0.001, 2e-8)]) or 0.0, 9)
    2.0
    """
    if len(errors) < 3:
        return None
    steps, sizes = np.log(errors).T
    return float(np.polyfit(steps, sizes, 1)[0])


def _reason(levels: Sequence[Level], order: float | None) -> str:
    """Tell why no level reaches the tolerance."""
    last = levels[-1]
    if len(levels) < 2:
        return f"no step below {last.dt:.3g} s may be tried"
    if not math.isfinite(last.change):
        return f"at {last.dt:.3g} s the run ends in numbers that are not finite"
    if last.same_contacts and order is not None and order < NO_ORDER:
        return (
            f"halving does not help: down to {last.dt:.3g} s the ends change from step to step and "
            f"do not settle (observed order {order:.1f})"
        )
    still = "ends still change too much"
    if not last.same_contacts:
        still = "contacts or their order still depend on the step"
        still += ": the scene is ill-conditioned for this solver"
    return f"at {last.dt:.3g} s, the smallest step tried, the {still}"


# -- scenes ----------------------------------------------------------------------------------------


def simulate_within(
    scene: Scene,
    shots: Sequence[Shot | None],
    tolerance: float,
    solver: str = "pymunk",
    smallest: float | None = None,
    on_run: Callable[[float], object] | None = None,
    **options: Any,
) -> Iterator[tuple[Run, Choice]]:
    """Simulate each shot with the step that keeps every ball's end within ``tolerance`` (m).

    No step below ``smallest`` (s; None: the solver's own) is tried. The run at the chosen step and
    the Choice are given even if the tolerance is not reached. A shot that goes on from the one
    before is run with it, at one step. ``options`` are the solver's. An exact solver errs by
    rounding alone, so it plays each shot once, at its own step. Raises SettingError for a solver
    that has no step, or whose physics is not the scene's.

    >>> from pool_pymunk import load
    >>> scene = load("report")
    >>> [(run, choice)] = simulate_within(scene, [scene.shots[2]], tolerance=0.000254)
    >>> choice.reached, round(1 / run.dt), choice.runs
    (True, 240, 1)
    """
    finest, method = finest_step(solver), find_solver(solver)
    start, least = COARSEST, smallest or finest
    if method.exact:
        start = least = max(method.dt or COARSEST, smallest or 0.0)
    for shot in shots:
        runs: dict[float, Run] = {}

        def trial(dt: float, shot: Shot | None = shot, runs: dict[float, Run] = runs) -> Outcome:
            runs[dt] = simulate(scene, shot, solver=solver, dt=dt, **options)
            return outcome(runs[dt])

        choice = choose_step(trial, tolerance, start, least, on_run)
        yield runs[choice.dt], _judged(choice, runs[choice.dt], method.exact)


def _judged(choice: Choice, run: Run, is_exact: bool) -> Choice:
    """Return a choice with the errors that no step removes: by policies and by rounding."""
    error, reason, levels = choice.error, choice.reason, choice.levels
    text = run.scene.units.text
    if is_exact:
        error = math.inf if run.status == "non_finite" else run.rounding
        error = 0.0 if math.isnan(error) else error  # It is not known without the contact engine.
        reason, levels = f"rounding may move the ends by {text(error)}, at every step", ()
        persistent = run.persistent_shift
        if persistent > error:
            reason = f"contacts that persist may put the ends off by {text(persistent)}"
        error += persistent
    if (shifted := error + run.policy_shift) != error:
        error, policies = shifted, ", ".join(sorted(run.policies))
        reason = (
            f"some contacts have no exact answer ({policies}). With other answers the ends may lie "
            f"up to {text(run.policy_shift)} elsewhere, whatever the step"
        )
    reached = error <= choice.tolerance
    reason = "" if reached else reason
    return replace(choice, error=error, reached=reached, reason=reason, levels=levels)


def finest_step(solver: str) -> float:
    """Return the finest step (s) worth trying with a solver; raise SettingError if it has none."""
    method = find_solver(solver)
    if method.finest is None:
        raise SettingError(f"solver = {solver}: {method.no_tolerance}")
    return method.finest


def outcome(run: Run) -> Outcome:
    """Return where a run ended (at ``max_time`` if it cut the run off), its contacts and steps."""
    last = run.scene.physics.max_time if run.status == "max_time" else None
    ends = run.at(last)[0].tolist() if last is not None else run.end.position
    if run.status == "non_finite":
        ends = [(math.nan, math.nan)] * len(ends)
    return Outcome(ends, (run.status, contact_order(run)), run.steps, _resolved(run))


def _resolved(run: Run) -> bool:
    """Tell whether each ball's contacts are 1.5 steps apart or more, if contacts wait for steps."""
    assert run.dt is not None
    last: dict[str, float] = {}
    for event in contacts(run) if find_solver(run.solver).late else ():
        if any(event.t - last.get(id_, -math.inf) < 1.5 * run.dt for id_ in event.balls):
            return False
        last |= dict.fromkeys(event.balls, event.t)
    return True
