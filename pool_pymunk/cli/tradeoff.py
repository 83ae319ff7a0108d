"""This command measures error and time over solvers and steps."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, place, say
from pool_pymunk.safety.files import whole

HEADINGS = ("solver", "dt", "largest error", "rms error", "contacts shared", "time")


def tradeoff(
    scenario: opt.Scenario,
    shot: opt.ShotName = None,
    solvers: opt.SolverList = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    budget: Annotated[float, opt.option("About this time (s) for all repeated runs.", "S")] = 60.0,
    samples: Annotated[
        int, opt.option("Perturbed starts, for the effect of rounded inputs.", "N")
    ] = 1000,
    seed: Annotated[int, opt.option("Seed of the perturbed starts.")] = 0,
    out: opt.OutDir = None,
) -> int:
    """Work and precision: the error and the time of each solver and step on this scene.

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg to renders/<scenario>, after Ctrl-C with what
    was measured.
    """
    if not budget >= 0.0:
        raise read.InputError(f"--budget = {budget}: must be 0 or more")
    how = How(law, friction, max_time)
    scene = how.scene(scenario)
    ladders = lib.tradeoff.ladders_of(None if solvers is None else read.names("--solvers", solvers))
    played = how.options_of(scene, ladders, named=solvers is not None)
    ladders = {name: ladders[name] for name in played}
    shots, folder = read.shots(scene, shot), place(out, scenario)
    so_far: list[lib.tradeoff.Tradeoff] = []
    try:
        with lib.terminal.progress("measuring", 1 + sum(map(len, ladders.values()))) as bar:
            # how far (m) the worst end spreads if starts are known to half of their last digit
            written = lib.uncertainty.written_uncertainty(scenario)
            spread = max(
                lib.sensitivity.sensitivity(scene, one, written, samples, seed).worst.deviation
                for one in lib.tradeoff.sound_shots(scene, shots)
            )

            def note(result: lib.tradeoff.Tradeoff) -> None:
                so_far.append(result)
                bar.update(bar.task, completed=1 + len(result.settings))

            lib.tradeoff.tradeoff(
                scene, ladders, shots=shots, budget=budget, spread=spread, on_done=note,
                options=how.options,
            )  # fmt: skip
    finally:
        if so_far:
            _report(so_far[-1], seed, folder)
    return 0


def _report(result: lib.tradeoff.Tradeoff, seed: int, folder: Path) -> None:
    """Print the table and what it says, and write the files."""
    units, shown = result.scene.units, []
    for s in result.settings:
        cells = [f"failed: {s.failure}", "", "", ""]
        if not s.failure:
            errors = (units.from_si(error, "length") for error in (s.largest, s.rms))
            cells = [lib.words.figures(error, 2) for error in errors]
            cells += [f"{s.shared} of {s.contacts}", f"{lib.words.figures(s.time * 1e3, 3)} ms"]
        shown.append([s.solver, "" if s.dt is None else lib.words.step_text(s.dt), *cells])
    title = f"Errors at the end ({units.length}) and time for all shots"
    lib.terminal.show(lib.terminal.TextTable(HEADINGS, shown, left=("solver",), title=title))
    say(lib.tradeoff.sentences(result))
    same = {"spread": result.spread, "seed": seed, **lib.tradeoff.machine()}
    rows = [{**asdict(setting), **same} for setting in result.settings]
    with whole(folder / "tradeoff.csv") as part:
        lib.run.write_rows(part, rows[0], (row.values() for row in rows))
    lib.diagram.draw(result, [folder / f"tradeoff{suffix}" for suffix in (".png", ".svg")])
    typer.echo(f"Diagram and data: {folder}")
