"""This command plays the extremes, and prints a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import place, say
from pool_pymunk.safety.files import whole


def stability(
    quick: Annotated[bool, opt.option("Fewer cases and steps.", None, "--quick")] = False,
    solvers: opt.SolverList = None,
    processes: Annotated[int, opt.option("Number of processes.", "N")] = 2,
    out: opt.OutDir = None,
) -> int:
    """Play extreme scenes: which solver breaks, by how much, and from which case on.

    Writes stability.csv and stability.svg to renders/stability, after Ctrl-C with what was played.
    """
    known, extremes = [solver.name for solver in lib.suite.columns()], lib.extremes.EXTREMES
    chosen = known if solvers is None else read.names("--solvers", solvers)
    for name in chosen:
        lib.solvers.find_solver(name)
    if processes < 1:
        raise read.InputError(f"--processes = {processes}: must be 1 or more")
    folder, cells = place(out, "stability"), list[lib.suite.Cell]()
    try:
        with lib.terminal.Bar("measuring", len(extremes) * len(chosen)) as bar:
            for cell in lib.suite.check_all(extremes, chosen, quick, processes):
                cells.append(cell)
                bar.step()
    finally:
        if cells:
            _report(lib.suite.in_order(cells), folder, quick)
    return 0


def _report(cells: list[lib.suite.Cell], folder: Path, quick: bool) -> None:
    """Print the table and write the files."""
    verdicts, notes = lib.suite.verdicts(cells), lib.suite.notes(cells)
    lib.terminal.show("Stability at the extremes\n", verdicts)
    say(notes)
    with whole(folder / "stability.csv") as part:
        lib.suite.table(cells).csv(part)
    command = f"pool-pymunk stability{' --quick' * quick}"
    lib.terminal.draw(folder / "stability.svg", command, verdicts, *notes)
    typer.echo(f"Data and picture: {folder}")
