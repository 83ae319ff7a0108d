"""This command plays the extremes, and prints a table."""

from __future__ import annotations

from functools import partial

from rich.table import Table as Printed

from pool_pymunk.cli import read
from pool_pymunk.cli.options import StabilityOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.terminal import Bar, draw
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies.stability import extremes, suite


def stability(asked: StabilityOptions) -> int:
    """Play extreme scenes, and show verdicts."""
    known, tried = [solver.name for solver in suite.columns()], extremes.EXTREMES
    chosen = known if asked.solvers is None else read.names("--solvers", asked.solvers)
    for name in chosen:
        find_solver(name)
    read.at_least(1, processes=asked.processes)
    folder, cells = read.folder(asked.out, "stability"), list[suite.Cell]()
    with Output(folder, "Data and picture") as put:
        count = len(tried) * len(chosen)
        put.at_end(_report(cells, count, asked))
        with Bar("measuring", count) as bar:
            for cell in suite.check_all(tried, chosen, asked.quick, asked.processes):
                cells.append(cell)
                bar.step()
    return 0


def _report(played: list[suite.Cell], count: int, asked: StabilityOptions) -> Report:
    """Yield the verdicts with what they mean, the measures, and the table as a picture.

    Where fewer verdicts than the ``count`` have come before an interrupt, both say so.
    """
    if cells := suite.in_order(played):
        said: list[str | Printed] = [suite.verdicts(cells), *suite.notes(cells)]
        if len(cells) < count:
            said.append(f"Incomplete: {len(cells)} of {count} verdicts, as it was interrupted.")
        yield "Stability at the extremes\n"
        yield from said
        yield File("stability.csv", suite.table(cells).csv)
        solvers = f" --solvers {asked.solvers}" if asked.solvers else ""
        command = f"pool-pymunk stability{' --quick' * asked.quick}{solvers}"
        yield File("stability.svg", partial(draw, command, said))
