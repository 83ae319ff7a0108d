"""This module plays a grid of shots by solvers at steps, and measures what a column errs and costs.

A *column* of the grid is a solver at a step, a row is a shot, and a cell is a run beside the
reference run of that shot (:class:`~pool_pymunk.studies.compare.Comparison`). The error of a column
is the largest distance of any ball's end from its exact end, over all shots. Its time is the sum
over the shots of the least time of one to seven runs. The exact solver errs by rounding alone
(:attr:`~pool_pymunk.Run.rounding`) and by contacts that persist
(:attr:`~pool_pymunk.Run.persistent_shift`), and no error is taken to be smaller than that, except
for the exact solver at other tolerances of such contacts.
"""

from __future__ import annotations

import math
import platform
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.model import Scene, Shot, Units
from pool_pymunk.results.run import Run
from pool_pymunk.results.table import ResultTable
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, find_solver, reference_solver, simulate_all
from pool_pymunk.solvers.record import OnTime
from pool_pymunk.studies import known
from pool_pymunk.studies.compare import Comparison, contacts
from pool_pymunk.studies.tolerance import slope

Shots = Sequence[Shot | None]

LONGEST = 45  # letters; if the names of shots are longer together, the shots are counted
MOST_REPEATS = 7  # More runs hardly lower the least of seven times.
FINER = 0.1  # of the finest tolerance that is measured is that of the runs to compare with


class Column(NamedTuple):
    """A column has a solver, its step (s; None: its own), law (None: the scene's), and options."""

    solver: str
    dt: float | None = None
    law: str | None = None
    options: Mapping[str, Any] = MappingProxyType({})

    def __str__(self) -> str:
        return self.solver if self.dt is None else f"{self.solver} {step_text(self.dt)}"

    def at_steps(self, every: bool) -> list[Column]:
        """Return it at its step as typed, else at its own one, or at ``every`` step of its ladder.

        >>> [str(each) for each in Column("pymunk").at_steps(False)]
        ['pymunk 1/240 s']
        """
        solver = find_solver(self.solver)
        steps = solver.ladder if every and solver.ladder else (solver.dt,)
        return [self] if self.dt else [self._replace(dt=dt) for dt in steps]

    @property
    def is_longest(self) -> bool:
        """Tell whether these are the report's own slices, which take longest."""
        return self.dt is not None and self.dt == find_solver(self.solver).published_step

    def scene(self, scene: Scene) -> Scene:
        """Return the scene under this law."""
        return replace(scene, physics=replace(scene.physics, law=self.law or scene.physics.law))

    def runs(self, scene: Scene, shots: Shots, on_time: OnTime | None = None) -> Iterator[Run]:
        """Play the shots one after the other, and yield their runs."""
        how = {"solver": self.solver, "dt": self.dt, "on_time": on_time, **self.options}
        return simulate_all(self.scene(scene), shots, **how)


# -- work and precision ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Setting:
    """A setting is a measured column: errors (m), shared contacts, time (s), or failure.

    It has a step ``dt`` (s), or a ``contact_tolerance`` (m) if one was asked for, or neither.
    """

    solver: str
    dt: float | None
    largest: float = math.nan
    rms: float = math.nan
    shared: int = 0
    contacts: int = 0
    time: float = math.nan
    repeats: int = 1
    failure: str = ""
    contact_tolerance: float | None = None
    events: int = 0

    @property
    def fineness(self) -> float | None:
        """The step (s) or the tolerance (m), if it has one: errors shrink with it."""
        return self.dt or self.contact_tolerance

    def __str__(self) -> str:
        """Return its fineness as people write it; a tolerance is in m."""
        return self.text(Units())

    def text(self, units: Units) -> str:
        """Return its fineness as people write it; a tolerance is in ``units``."""
        if self.contact_tolerance is not None:
            return units.text(self.contact_tolerance, ".3g")
        return "" if self.dt is None else step_text(self.dt)


@dataclass(frozen=True)
class Tradeoff:
    """A tradeoff holds the exact runs of a scene's shots, and every setting that was measured.

    ``spread`` (m) is how far the uncertainty of the start positions alone moves an end (standard
    deviation of the worst ball); it is None where it is not known. ``known_by`` says whence that
    uncertainty is known. ``runs`` are those that were measured, one of each setting and shot.
    If ``all_count``, shots without an exact end are measured, too.

    >>> from pool_pymunk import load
    >>> [one] = begin(load("report")).measured(Column("pymunk-discrete", 1e-3)).settings
    >>> round(one.largest / 0.0254), one.shared, one.contacts
    (12, 11, 20)
    """

    scene: Scene
    references: tuple[Run, ...]
    settings: tuple[Setting, ...] = ()
    spread: float | None = None
    known_by: str = ""
    runs: tuple[Run, ...] = ()
    all_count: bool = False

    @cached_property
    def sound(self) -> tuple[Run, ...]:
        """Return the exact runs whose ends do not depend on rounding (or all, if none is so)."""
        sound = tuple(run for run in self.references if self.all_count or not run.policies)
        return sound or self.references

    @property
    def left_out(self) -> tuple[str, ...]:
        """Name the other shots: no error can be measured there."""
        return tuple(run.name for run in self.references if run not in self.sound)

    @property
    def measured_shots(self) -> str:
        """Name the shots that are measured, or count them if their names are long."""
        measured, shots = len(self.sound), len(self.scene.shots)
        if measured >= shots:
            return "all shots"
        names = ", ".join(run.name for run in self.sound)
        return names if len(names) <= LONGEST else f"{measured} of {shots} shots"

    @property
    def warned(self) -> list[Run]:
        """Return the runs that warn, one of each shot and solver."""
        runs = {(run.name, run.solver): run for run in (*self.references, *self.runs)}
        return [run for run in runs.values() if run.warnings]

    @cached_property
    def rounding(self) -> float:
        """Return how far (m) rounding moves the ends: by a unit of their last digit, or more.

        It includes how far contacts that persist may put the exact runs off.
        """
        figures = ((known(run.rounding) or 0.0) + run.persistent_shift for run in self.sound)
        return max(self.last_digit, *figures)

    @property
    def last_digit(self) -> float:
        """Return the unit (m) of the last digit of the ends."""
        return max(EPSILON * float(np.abs(run.end.position).max()) for run in self.sound)

    @property
    def exact(self) -> list[str]:
        """Return the solvers that were measured and are exact to rounding."""
        measured = dict.fromkeys(setting.solver for setting in self.settings)
        return [name for name in measured if name in SOLVERS and SOLVERS[name].exact]

    def of(self, solver: str) -> list[Setting]:
        """Return the solver's settings that did not fail, from coarse to fine."""
        return [s for s in self.settings if s.solver == solver and not s.failure]

    def table(self, same: Mapping[str, object] = MappingProxyType({})) -> ResultTable:
        """Return a row for each setting, in SI; what is the ``same`` in all of them stands last."""
        columns = [*(each.name for each in fields(Setting)), *same]
        return ResultTable(columns, [(*astuple(s), *same.values()) for s in self.settings])

    def measured(self, column: Column, budget: float = 0.0) -> Tradeoff:
        """Measure one more column; ``budget`` (s) is about the time for repeated runs.

        It fails if a run ends neither at rest nor as the reference does.
        """
        until, shots = time.perf_counter() + budget, [run.shot for run in self.sound]
        passes = [list(column.runs(self.scene, shots))]
        cells = [Comparison(*both) for both in zip(self.sound, passes[0], strict=True)]
        ends = [(each.run.status, each.reference.status) for each in cells]
        failures = [status for status, other in ends if status not in ("settled", other)]
        while not failures and len(passes) < MOST_REPEATS:
            if time.perf_counter() + sum(run.wall_time for run in passes[-1]) > until:
                break
            passes.append(list(column.runs(self.scene, shots)))
        found = Setting(
            column.solver, column.dt, repeats=len(passes), failure=(*failures, "")[0],
            contact_tolerance=column.options.get("contact_tolerance"),
            events=sum(len(each.run.events) for each in cells),
        )  # fmt: skip
        if not failures:
            floor = self.rounding if found.contact_tolerance is None else self.last_digit
            found = replace(
                found,
                largest=max(floor, *(each.largest for each in cells)),
                rms=max(floor, math.sqrt(sum(each.rms**2 for each in cells) / len(cells))),
                shared=sum(each.shared for each in cells),
                contacts=sum(len(contacts(run)) for run in self.sound),
                time=sum(min(run.wall_time for run in runs) for runs in zip(*passes, strict=True)),
            )
        runs = (*self.runs, *passes[0])
        return replace(self, settings=(*self.settings, found), runs=runs)


def begin(scene: Scene, shots: Shots | None = None, tolerances: Sequence[float] = ()) -> Tradeoff:
    """Play the shots exactly; nothing else is measured yet.

    If ``tolerances`` (m) of contacts that persist are to be measured, the runs to compare with have
    a tenth of the finest one.
    """
    name, finest = reference_solver().name, FINER * min(tolerances) if tolerances else None
    runs = simulate_all(scene, shots, solver=name, contact_tolerance=finest)
    return Tradeoff(scene, tuple(runs))


def at_tolerances(tolerances: Sequence[float]) -> list[Column]:
    """Return columns of the exact solver that play contacts that persist to tolerances (m)."""
    name = reference_solver().name
    return [Column(name, options={"contact_tolerance": each}) for each in tolerances]


# -- what is measured, in words --------------------------------------------------------------------


def order(settings: Sequence[Setting], floor: float, ceiling: float) -> float | None:
    """Return the slope of log error over log dt, of errors from 10 ``floor`` to ``ceiling`` (m).

    Settings at tolerances have these in place of a step.

    It is None for fewer than three of them. Smaller errors are rounding, which has no order.
    """
    good = [s for s in settings if 10 * floor < s.largest < ceiling]
    return slope([(s.fineness, s.largest) for s in good if s.fineness])


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
    if any(s.contact_tolerance for s in result.settings):
        return [*_to_tolerances(result), *_without_exact_end(result)]
    lines = [_within(result, digits) for digits in (1.0, 0.1, 0.01, 0.001)]
    lines += [
        f"Without a step: {one.solver} in {one.time * 1e3:.3g} ms, to "
        f"{units.text(one.largest, '.1g')}."
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


def _to_tolerances(result: Tradeoff) -> Iterator[str]:
    """Say how errors and times go with the tolerance of contacts that persist."""
    good = [s for s in result.settings if s.contact_tolerance and not s.failure]
    if not any(run.persistent for run in result.sound):
        yield "No contact persists in these shots, so their tolerance does not matter."
    elif good:
        ratios = {s.largest / (s.contact_tolerance or 1.0): s for s in good}
        units = result.scene.units
        most = max(ratios)
        yield f"The largest error is {most:.2g} times the tolerance, at {ratios[most].text(units)}."
        finest = max(run.contact_tolerance or 0.0 for run in result.references)
        yield (
            f"Errors are distances from runs at {units.text(finest, '.3g')}, which may be off by "
            f"{units.text(result.rounding, '.1g')} themselves."
        )


def _verdict(result: Tradeoff, spread: float) -> str:
    """Say what the uncertainty of the starts leaves to choose."""
    units, measured = result.scene.units, [s for s in result.settings if not s.failure]
    finer = sum(s.largest < spread for s in measured)
    rules = f"so it rules the choice: {finer} of {len(measured)} settings err by less"
    if not finer:
        rules = "and every setting errs by more, so it rules nothing"
    return (
        f"This uncertainty of the starts alone moves an end by {units.text(spread)} (standard "
        f"deviation, worst ball). A smaller error than that gains nothing, {rules}."
    )


def _without_exact_end(result: Tradeoff) -> Iterator[str]:
    """Say which shots have no exact end, and what that means."""
    for run in result.references:
        why = ", ".join(sorted(run.policies))
        if run.name in result.left_out:
            yield (
                f"{run.name} is left out: its exact end depends on what has no exact answer "
                f"({why}). Alone (--shot) it is measured all the same."
            )
        elif run.policies:
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
