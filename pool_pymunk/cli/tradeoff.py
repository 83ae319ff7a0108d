"""This command measures error and time over solvers and steps."""

from __future__ import annotations

import csv
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pool_pymunk.cli.common import (
    FrictionBy,
    How,
    InputError,
    LawName,
    MaxTime,
    OutDir,
    Scenario,
    ShotName,
    SolverList,
    input_errors,
    progress,
    read_scenario,
    read_shots,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.studies.tradeoff import Ladders, Tradeoff


def tradeoff(
    scenario: Scenario,
    shot: ShotName = None,
    solvers: SolverList = None,
    law: LawName = None,
    friction: FrictionBy = None,
    max_time: MaxTime = None,
    budget: Annotated[
        float, typer.Option(metavar="S", help="About how long repeated runs may take in all.")
    ] = 60.0,
    samples: Annotated[
        int, typer.Option(metavar="N", help="Perturbed starts, to see what the input is worth.")
    ] = 1000,
    seed: Annotated[int, typer.Option(help="Of the perturbed starts.")] = 0,
    out: OutDir = None,
) -> int:
    """Work and precision: what error each solver and step leaves on this scene, and what it costs.

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg to renders/<scenario>; after Ctrl-C, what was
    measured.
    """
    if not budget >= 0.0:
        raise InputError(f"--budget = {budget}: must be 0 or more")
    if samples < 2:
        raise InputError(f"--samples = {samples}: must be 2 or more")
    how = How(law, friction, max_time)
    scene = how.scene(read_scenario(scenario))
    folder = out or Path("renders") / Path(scenario).stem
    ladders = _ladders(solvers)
    how.options_of(scene, ladders, named=solvers is not None)
    shots = read_shots(scene, shot)
    from pool_pymunk.studies.tradeoff import tradeoff as measure

    count = sum(len(steps) for steps in ladders.values())
    so_far: list[Tradeoff] = []
    try:
        with input_errors(), progress("measuring", count + 1) as bar:
            spread = _spread(scenario, scene, shots, samples, seed)

            def note(result: Tradeoff) -> None:
                so_far.append(result)
                bar.update(bar.task_ids[0], completed=1 + len(result.settings))

            measure(scene, ladders, shots=shots, budget=budget, spread=spread, seed=seed,
                    on_done=note, options=how.options)  # fmt: skip
    finally:
        if so_far:
            _report(so_far[-1], folder)
    return 0


def _report(result: Tradeoff, folder: Path) -> None:
    """Print the table and what it says, and write the files."""
    from pool_pymunk.studies.tradeoff import sentences

    _print(result)
    for line in sentences(result):
        typer.echo(line)
    _save(result, folder)
    typer.echo(f"Diagram and data: {folder}")


def _spread(
    scenario: str, scene: Scene, shots: Sequence[Shot | None], samples: int, seed: int
) -> float:
    """Return how far (m) half of the last digit of the start positions moves the worst end."""
    from pool_pymunk.studies.sensitivity import sensitivity
    from pool_pymunk.studies.tradeoff import sound_shots
    from pool_pymunk.studies.uncertainty import written_uncertainty

    written = written_uncertainty(scenario)
    return max(
        sensitivity(scene, shot, written, samples, seed).worst.deviation
        for shot in sound_shots(scene, shots)
    )


def _ladders(solvers: str | None) -> Ladders:
    from pool_pymunk.studies.tradeoff import ladders_of

    with input_errors():
        return ladders_of(None if solvers is None else map(str.strip, solvers.split(",")))


def _print(result: Tradeoff) -> None:
    from rich.console import Console

    Console(width=None if Console().is_terminal else 120, highlight=False).print(_table(result))


def _table(result: Tradeoff) -> Table:
    from rich.table import Table

    from pool_pymunk.results.words import step_text

    units = result.scene.units
    table = Table(title=f"Errors at the end ({units.length}) and time for all shots")
    for heading in ("solver", "dt", "largest error", "rms error", "contacts shared", "time"):
        table.add_column(heading, justify="left" if heading == "solver" else "right")
    for s in result.settings:
        dt = "" if s.dt is None else step_text(s.dt)
        if s.failure:
            table.add_row(s.solver, dt, f"failed: {s.failure}", "", "", "")
            continue
        errors = [f"{units.from_si(error, 'length'):.2g}" for error in (s.largest, s.rms)]
        share = f"{s.shared} of {s.contacts}"
        table.add_row(s.solver, dt, *errors, share, f"{s.time * 1e3:.3g} ms")
    return table


def _save(result: Tradeoff, folder: Path) -> None:
    from pool_pymunk.render.diagram import draw
    from pool_pymunk.safety.files import whole
    from pool_pymunk.studies.tradeoff import machine

    rows = [
        {**asdict(setting), "spread": result.spread, "seed": result.seed, **machine()}
        for setting in result.settings
    ]
    path = folder / "tradeoff.csv"
    with whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    for suffix in (".png", ".svg"):
        with whole(folder / f"tradeoff{suffix}") as part:
            draw(result, [part])
