"""The table of the extremes: on a terminal, and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pool_pymunk.stability.extremes import EXTREMES
from pool_pymunk.stability.suite import STEPS, Cell

if TYPE_CHECKING:
    from rich.table import Table

# Why the others break where they do; `pymunk` and `event-driven` have no such excuse.
METHODS = {
    "pymunk-discrete": "answers overlaps at the end of a step: it misses grazes and what tunnels, "
    "and every contact comes up to a step late",
    "time-slice": "the report's method: contacts come up to a slice late, a pair answers once "
    "until it has parted, those of one instant one after the other, and rounding decides the sign "
    "of a slip of zero",
    "pymunk-builtin": "another contact law, with spin and its own rules for touching balls; "
    "contacts come up to a step late",
}
FIELDS = (
    "extreme", "case", "law", "solver", "dt", "status", "contacts", "wall_time", "compared",
    "claim", "value", "bound", "unit", "holds", "note",
)  # fmt: skip


def in_order(cells: Iterable[Cell]) -> list[Cell]:
    """The cells row by row, as the table has them."""
    rows = {extreme.name: k for k, extreme in enumerate(EXTREMES)}
    columns = {solver: k for k, solver in enumerate(STEPS)}
    return sorted(cells, key=lambda cell: (rows[cell.extreme], columns[cell.solver]))


def rich_table(cells: Sequence[Cell]) -> Table:
    """The verdicts as a table: a row an extreme, a column a solver."""
    from rich.table import Table

    solvers = [solver for solver in STEPS if any(cell.solver == solver for cell in cells)]
    table = Table(title="Stability at the extremes", show_lines=True)
    table.add_column("extreme", ratio=3)
    for solver in solvers:
        table.add_column(solver, ratio=4)
    found = {(cell.extreme, cell.solver): cell for cell in cells}
    for extreme in EXTREMES:
        row = [found.get((extreme.name, solver)) for solver in solvers]
        if any(row):
            texts = ("" if cell is None else _styled(cell) for cell in row)
            table.add_row(f"{extreme.name}\n[dim]{extreme.about}[/dim]", *texts)
    return table


def _styled(cell: Cell) -> str:
    from rich.markup import escape

    style = "" if cell.worst is None else "yellow" if reason(cell) else "bold red"
    return f"[{style}]{escape(str(cell))}[/]" if style else str(cell)


def reason(cell: Cell) -> str:
    """Why the cell breaks, in words; empty where it has no business to."""
    return cell.because or METHODS.get(cell.solver, "")


def notes(cells: Iterable[Cell]) -> list[str]:
    """The reasons of all that breaks, each once."""
    lines: dict[str, None] = {}
    for cell in cells:
        if cell.worst is None:
            continue
        if cell.because:
            lines[f"{cell.extreme}: {cell.because}"] = None
        elif cell.solver in METHODS:
            lines[f"{cell.solver}: {METHODS[cell.solver]}"] = None
        else:
            lines[f"{cell.solver} breaks at {cell.extreme}: {cell}"] = None
    return list(lines)


def write_csv(cells: Iterable[Cell], path: Path) -> None:
    """Write one row a measure (SI, all digits), and one for every case that was not run."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(FIELDS)
        for cell in cells:
            for o in cell.outcomes:
                about = (cell.extreme, o.case, o.law, cell.solver, o.dt)
                if o.not_run:
                    rows.writerow((*about, *[""] * 9, f"not run: {o.not_run}"))
                for m in o.measures:
                    note = "" if m.holds else f"{m} ({reason(cell)})" if reason(cell) else str(m)
                    rows.writerow((*about, o.status, o.contacts, o.wall_time, o.compared,
                                   m.claim, m.value, m.bound, m.unit, m.holds, note))  # fmt: skip
