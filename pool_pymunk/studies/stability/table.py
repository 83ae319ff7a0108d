"""This module writes the table of the extremes, on a terminal and as CSV."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pool_pymunk.results.run import write_rows
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies.stability.extremes import EXTREMES
from pool_pymunk.studies.stability.suite import Cell, columns

if TYPE_CHECKING:
    from rich.table import Table

FIELDS = (
    "extreme", "case", "law", "solver", "dt", "status", "contacts", "wall_time", "compared",
    "claim", "value", "bound", "unit", "holds", "note",
)  # fmt: skip


def in_order(cells: Iterable[Cell]) -> list[Cell]:
    """Return the cells row by row, as the table has them."""
    rows = {extreme.name: k for k, extreme in enumerate(EXTREMES)}
    places = {solver.name: k for k, solver in enumerate(columns())}
    return sorted(cells, key=lambda cell: (rows[cell.extreme], places[cell.solver]))


def rich_table(cells: Sequence[Cell]) -> Table:
    """Return the verdicts as a table: a row for an extreme, a column for a solver."""
    from rich.table import Table

    used = {cell.solver for cell in cells}
    solvers = [solver.name for solver in columns() if solver.name in used]
    table = Table(title="Stability at the extremes", show_lines=True)
    table.add_column("extreme", ratio=3)
    for solver in solvers:
        table.add_column(solver, ratio=4)
    found = {(cell.extreme, cell.solver): _styled(cell) for cell in cells}
    for extreme in EXTREMES:
        row = [found.get((extreme.name, solver), "") for solver in solvers]
        if any(row):
            table.add_row(f"{extreme.name}\n[dim]{extreme.about}[/dim]", *row)
    return table


def _styled(cell: Cell) -> str:
    from rich.markup import escape

    style = "" if cell.worst is None else "yellow" if reason(cell) else "bold red"
    return f"[{style}]{escape(str(cell))}[/]" if style else str(cell)


def reason(cell: Cell) -> str:
    """Tell in words why the cell breaks; empty where it must not break."""
    return cell.because or find_solver(cell.solver).limits


def notes(cells: Iterable[Cell]) -> list[str]:
    """Return the reasons of all that breaks, each once."""
    lines = (
        f"{cell.extreme if cell.because else cell.solver}: {reason(cell)}" if reason(cell)
        else f"{cell.solver} breaks at {cell.extreme}: {cell}"
        for cell in cells if cell.worst is not None
    )  # fmt: skip
    return list(dict.fromkeys(lines))


def write_csv(cells: Iterable[Cell], path: Path) -> None:
    """Write one row a measure (SI, all digits), and one for every case that was not run."""
    rows: list[tuple[object, ...]] = []
    for cell in cells:
        for o in cell.outcomes:
            about = (cell.extreme, o.case, o.law, cell.solver, o.dt)
            if o.not_run:
                rows.append((*about, *[""] * 9, f"not run: {o.not_run}"))
            for m in o.measures:
                note = "" if m.holds else f"{m} ({reason(cell)})" if reason(cell) else str(m)
                rows.append((*about, o.status, o.contacts, o.wall_time, o.compared, m.claim,
                             m.value, m.bound, m.unit, m.holds, note))  # fmt: skip
    write_rows(path, FIELDS, rows)
