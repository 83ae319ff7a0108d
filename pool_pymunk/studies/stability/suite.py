"""This module tries every extreme with every solver, and writes the table of the verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pool_pymunk.many.workers import Workers, check_halt
from pool_pymunk.results.table import ResultTable, TableColumn
from pool_pymunk.results.words import step_text
from pool_pymunk.solvers import SOLVERS, Solver, find_solver
from pool_pymunk.studies.stability.claims import measures
from pool_pymunk.studies.stability.extremes import EXTREMES
from pool_pymunk.studies.stability.trial import GRID, Extreme, Measure, Trial, wrong

if TYPE_CHECKING:
    from rich.table import Table

# These limits of one run were chosen: its steps, and the pairs that are looked at one by one. A run
# that needs more is left out.
MOST_STEPS, QUICK_MOST_STEPS = 2_000_000, 20_000
MOST_PAIRS, QUICK_MOST_PAIRS = 100_000_000, 20_000_000
LEFT_OUT = (
    "Cases are not run that would need too many steps, or would look at too many pairs of balls; "
    "the CSV file says of each how many."
)
NARROW = 10  # characters of a line in the columns of exact solvers, which mostly hold
NOT_OFFERED = "not offered"  # Balls roll, and the solver has no rolling.
FIELDS = (
    "extreme", "case", "law", "solver", "dt", "status", "contacts", "wall_time", "compared",
    "claim", "value", "bound", "unit", "holds", "note",
)  # fmt: skip


@dataclass(frozen=True)
class CaseResult:
    """A case result holds what was measured of one case, or why it was ``not_run``.

    ``compared`` is the share of the run, up to chaos, that was compared with the reference.
    """

    case: str
    law: str
    dt: float | None
    measures: tuple[Measure, ...] = ()
    status: str = ""
    contacts: int = 0
    wall_time: float = 0.0
    compared: float = 0.0
    not_run: str = ""

    @property
    def broken(self) -> tuple[Measure, ...]:
        """Return the measures that do not hold."""
        return tuple(measure for measure in self.measures if not measure.holds)


@dataclass(frozen=True)
class Cell:
    """A cell is one extreme by one solver, with a result for every case, law and step."""

    extreme: str
    solver: str
    outcomes: tuple[CaseResult, ...]
    because: str = ""  # why it must break, if it does

    @property
    def run(self) -> tuple[CaseResult, ...]:
        """Return the results that were measured."""
        return tuple(outcome for outcome in self.outcomes if not outcome.not_run)

    @property
    def worst(self) -> Measure | None:
        """Return what breaks worst; None if all holds."""
        broken = [measure for outcome in self.run for measure in outcome.broken]
        return max(broken, key=lambda measure: measure.severity, default=None)

    @property
    def where(self) -> str:
        """Return the cases at which it breaks; the steps, if there is only one case."""
        labels = {outcome: outcome.case for outcome in self.run}
        if len(set(labels.values())) < 2:
            stepped = sorted((one for one in self.run if one.dt), key=lambda one: one.dt or 0.0)
            labels = {outcome: step_text(outcome.dt or 0.0) for outcome in stepped}
        broken = {label for outcome, label in labels.items() if outcome.broken}
        return _where(list(dict.fromkeys(labels.values())), broken)

    @property
    def left_out(self) -> str:
        """Tell why some of it, or all, was not run."""
        if not self.outcomes:
            return "not run: it has a law of its own"
        reasons = [outcome.not_run for outcome in self.outcomes if outcome.not_run]
        if reasons and not self.run and reasons[-1] == NOT_OFFERED:
            return NOT_OFFERED
        share = f"{len(reasons)} of {len(self.outcomes)} " if self.run else ""
        return f"{share}not run: {reasons[-1]}" if reasons else ""

    @property
    def reason(self) -> str:
        """Tell in words why the cell breaks; empty where it must not break."""
        return self.because or find_solver(self.solver).limits

    def __str__(self) -> str:
        verdict = "holds" if self.worst is None else f"{self.worst}; {self.where}"
        if not self.run:
            return self.left_out
        return f"{verdict} ({self.left_out})" if self.left_out else verdict


def _where(labels: Sequence[str], broken: set[str]) -> str:
    """Tell which of the labels, from mild to extreme, are broken.

    >>> _where(["1", "10", "100"], {"10", "100"}), _where(["1", "10", "100"], {"1", "10"})
    ('from 10 on', 'at 1 and 1 more')
    """
    at = [label for label in labels if label in broken]
    if len(at) in (0, len(labels)):
        return "everywhere" if at else ""
    if len(at) > 1 and at == list(labels[-len(at) :]):
        return f"from {at[0]} on"
    return f"at {at[0]}" + (f" and {len(at) - 1} more" if len(at) > 1 else "")


# -- working them out ------------------------------------------------------------------------------


def columns() -> list[Solver]:
    """Return all solvers in the table's order: the reference first, own laws last."""
    return sorted(
        SOLVERS.values(),
        key=lambda solver: (solver.own_law, not solver.exact, not solver.is_reference),
    )


def check(extreme: Extreme, solver: str, quick: bool = False) -> Cell:
    """Try a solver on an extreme's cases, under its laws, at its steps."""
    method = find_solver(solver)
    of_record = (quick and method.quick_stability_steps) or method.stability_steps or (method.dt,)
    steps = extreme.steps or of_record
    outcomes = tuple(
        _outcome(Trial(case, law, solver, dt), quick)
        for case in extreme.cases()
        if not (quick and case.slow)
        for law in extreme.laws
        if law == "coulomb" or not method.own_law
        for dt in (steps if method.dt else (None,))
    )
    return Cell(extreme.name, solver, outcomes, "" if method.own_law else extreme.because)


def _outcome(trial: Trial, quick: bool) -> CaseResult:
    check_halt()
    about = (trial.case.label, trial.law, trial.dt)
    if trial.scene.surface.rolls and not trial.method.rolls:
        return CaseResult(*about, not_run=NOT_OFFERED)
    steps = trial.reference.run.duration / trial.dt if trial.dt else 0.0
    if steps > (QUICK_MOST_STEPS if quick else MOST_STEPS):
        return CaseResult(*about, not_run=f"would need {steps:.0e} steps")
    pairs = steps * len(trial.scene.balls) ** 2 if trial.method.all_pairs else 0.0
    if pairs > (QUICK_MOST_PAIRS if quick else MOST_PAIRS):
        return CaseResult(*about, not_run=f"would look at {pairs:.0e} pairs")
    try:
        found = tuple(measures(trial))
    except Exception as error:  # Whatever a solver raises is what the study looks for.
        return CaseResult(*about, (wrong("raises nothing", f"{type(error).__name__}: {error}"),))
    run, share = trial.run, len(trial.reference.times) / (GRID + 1)
    return CaseResult(*about, found, run.status, trial.contacts, run.wall_time, share)


def check_all(
    extremes: Sequence[Extreme], solvers: Sequence[str], quick: bool, processes: int
) -> Iterator[Cell]:
    """Check these extremes with these solvers, and yield each row's cells once it is done.

    One process works out a whole row, so it needs the row's reference runs only once. The last
    rows, which take longest, come first. If the iterator is closed, as by Ctrl-C, processes end.
    """
    with Workers(processes) as workers:
        for row in workers.share(_check_row, (tuple(solvers), quick), extremes[::-1]):
            yield from row


def _check_row(asked: tuple[Sequence[str], bool], extreme: Extreme) -> list[Cell]:
    solvers, quick = asked
    return [check(extreme, solver, quick) for solver in solvers]


# -- the table -------------------------------------------------------------------------------------


def in_order(cells: Iterable[Cell]) -> list[Cell]:
    """Return the cells row by row, as the table has them."""
    rows = {extreme.name: k for k, extreme in enumerate(EXTREMES)}
    places = {solver.name: k for k, solver in enumerate(columns())}
    return sorted(cells, key=lambda cell: (rows[cell.extreme], places[cell.solver]))


def verdicts(cells: Sequence[Cell]) -> Table:
    """Return the verdicts for a terminal: a row for an extreme, a column for a solver."""
    used = {cell.solver for cell in cells}
    solvers = [solver.name for solver in columns() if solver.name in used]
    found = {(cell.extreme, cell.solver): _styled(cell) for cell in cells}
    rows = [
        (f"{extreme.name}\n[dim]{extreme.about}[/dim]", *row)
        for extreme in EXTREMES
        if any(row := [found.get((extreme.name, solver), "") for solver in solvers])
    ]
    heads = [TableColumn(name, left=True) for name in ("extreme", *solvers)]
    shown = ResultTable(heads, rows).rich()
    shown.show_lines = True
    for column, solver in zip(shown.columns[1:], solvers, strict=True):
        column.width = NARROW if find_solver(solver).exact else None
    return shown


def _styled(cell: Cell) -> str:
    from rich.markup import escape

    style = "" if cell.worst is None else "yellow" if cell.reason else "bold red"
    said = str(cell).partition(" not run: ")  # The notes say why some cases are not run.
    text = f"{said[0]} not run)" if cell.run and said[1] else str(cell)
    return f"[{style}]{escape(text)}[/]" if style else text


def notes(cells: Sequence[Cell]) -> list[str]:
    """Return the reasons of all that breaks, each once, and why some cases are not run."""
    lines = (
        f"{cell.extreme if cell.because else cell.solver}: {cell.reason}" if cell.reason
        else f"{cell.solver} breaks at {cell.extreme}: {cell}"
        for cell in cells if cell.worst is not None
    )  # fmt: skip
    is_short = any(cell.run and cell.left_out for cell in cells)
    return [*dict.fromkeys(lines), *[LEFT_OUT] * is_short]


def table(cells: Iterable[Cell]) -> ResultTable:
    """Return a row for each measure (SI, all digits), and one for each case that was not run."""
    rows: list[tuple[object, ...]] = []
    for cell in cells:
        for o in cell.outcomes:
            about = (cell.extreme, o.case, o.law, cell.solver, o.dt)
            if o.not_run:
                rows.append((*about, *[""] * 9, f"not run: {o.not_run}"))
            for m in o.measures:
                note = "" if m.holds else f"{m} ({cell.reason})" if cell.reason else str(m)
                rows.append((*about, o.status, o.contacts, o.wall_time, o.compared, m.claim,
                             m.value, m.bound, m.unit, m.holds, note))  # fmt: skip
    return ResultTable(FIELDS, rows)
