"""This command plays the extremes, and prints a table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pool_pymunk.cli.common import InputError, OutDir, SolverList, progress

if TYPE_CHECKING:
    from pool_pymunk.studies.stability import Cell


def stability(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer cases and steps: 30 s.")] = False,
    solvers: SolverList = None,
    processes: Annotated[int, typer.Option(metavar="N", help="How many at once.")] = 2,
    out: OutDir = None,
) -> int:
    """The extremes: where each solver breaks, by how much, and from where on.

    Writes stability.csv and stability.png to renders/stability; after Ctrl-C, what is done.
    """
    chosen = _solvers(solvers)
    if processes < 1:
        raise InputError(f"--processes = {processes}: must be 1 or more")
    folder = out or Path("renders") / "stability"
    cells: list[Cell] = []
    try:
        _check(cells, chosen, quick, processes)
    finally:
        if cells:
            _report(cells, folder)
    return 0


def _solvers(names: str | None) -> list[str]:
    from pool_pymunk.model.problems import suggestion
    from pool_pymunk.studies.stability import columns

    known = [solver.name for solver in columns()]
    chosen = known if names is None else [name.strip() for name in names.split(",")]
    for name in chosen:
        if name not in known:
            message = f"there is no such solver ({', '.join(known)}){suggestion(name, known)}"
            raise InputError(f"--solvers = {name}: {message}")
    return chosen


def _check(cells: list[Cell], solvers: list[str], quick: bool, processes: int) -> None:
    """Add the cells as they are worked out."""
    from pool_pymunk.studies.stability import EXTREMES, check_all

    with progress("measuring", len(EXTREMES) * len(solvers)) as bar:
        for cell in check_all(EXTREMES, solvers, quick, processes):
            cells.append(cell)
            bar.update(bar.task_ids[0], advance=1)


def _report(cells: list[Cell], folder: Path) -> None:
    """Print the table and write the files."""
    from rich.console import Console

    from pool_pymunk.render import heatmap
    from pool_pymunk.safety.files import whole
    from pool_pymunk.studies.stability import table

    cells = table.in_order(cells)
    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    console.print(table.rich_table(cells))
    for line in table.notes(cells):
        typer.echo(line)
    with whole(folder / "stability.csv") as part:
        table.write_csv(cells, part)
    with whole(folder / "stability.png") as part:
        heatmap.draw(cells, part)
    typer.echo(f"Data and picture: {folder}")
