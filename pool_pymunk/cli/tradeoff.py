"""This command measures error and time over solvers and steps."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import common, lib, opt, read
from pool_pymunk.safety.files import whole


def tradeoff(
    scenario: opt.Scenario,
    shot: opt.ShotName = None,
    solvers: opt.Columns = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    budget: Annotated[float, opt.option("About this time (s) for all repeated runs.", "S")] = 10.0,
    samples: Annotated[
        int,
        opt.option("Perturbed starts, for the effect of rounded inputs.", "N", for_experts=True),
    ] = 1000,
    seed: Annotated[int, opt.option("Seed of the perturbed starts.", for_experts=True)] = 0,
    position_error: opt.PositionError = None,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
) -> int:
    """Work and precision: the error and the time of each solver and step on this scene.

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg to renders/<scenario>, after Ctrl-C with what
    was measured.
    """
    for key, value, least in (("budget", budget, 0), ("samples", samples, 2), ("seed", seed, 0)):
        if not value >= least:
            raise read.InputError(f"--{key} = {value}: must be {least} or more")
    how = common.How(law, friction, max_time)
    scene = how.scene(scenario)
    columns, left_out = how.columns(scene, solvers, every=True)
    shots, folder = read.shots(scene, shot), common.place(out, scenario)
    widths, known_by = common.position_errors(scenario, scene, position_error)
    errors, began = lib.uncertainty.Uncertainty(widths), time.perf_counter()
    found = lib.grid.begin(scene, shots)
    share = (time.perf_counter() - began) / len(shots)  # s; about what a sample takes
    try:
        with lib.terminal.Bar("measuring", 1.0) as bar:
            sound = [run.shot for run in found.sound]
            plan = lib.grid.planned(scene, columns, sound, budget)
            bar.plan(share * samples * len(sound) + sum(plan))
            clouds = [
                lib.sensitivity.sensitivity(
                    scene, one, errors, samples, seed, on_done=lambda count: bar.step(count * share)
                )
                for one in sound
            ]
            spread = max(cloud.worst.deviation for cloud in clouds)
            found = replace(found, spread=spread, known_by=known_by)
            for column, seconds in zip(columns, plan, strict=True):
                found = found.measured(column, budget / len(columns))
                bar.step(seconds)
    finally:
        if found.settings:
            _report(found, left_out, seed, folder)
            common.write_json(json, _results(found, left_out, seed), scenario, scene.title)
    return 0


def _report(
    result: lib.grid.Tradeoff, left_out: Mapping[str, str], seed: int, folder: Path
) -> None:
    """Print the table and what it says, and write the files."""
    lib.terminal.show(f"Errors at the end and time for {result.measured_shots}\n", _printed(result))
    common.say(lib.grid.sentences(result))
    common.say([*common.left_out_sentences(left_out), *common.warnings_of(result.warned)])
    same = {"spread": result.spread, "seed": seed, **lib.grid.machine()}
    with whole(folder / "tradeoff.csv") as part:
        result.table(same).csv(part)
    lib.diagram.draw(result, [folder / f"tradeoff{suffix}" for suffix in (".png", ".svg")])
    typer.echo(f"Diagram and data: {folder}")


def _printed(result: lib.grid.Tradeoff) -> lib.table.ResultTable:
    """Return the settings as a terminal shows them; what failed says so in place of its error."""
    unit = result.scene.units
    column = lib.table.TableColumn
    largest, rms = (column(f"{each} error", unit=unit.length) for each in ("largest", "rms"))
    about: lib.table.Columns = (column("solver", left=True), column("dt", unit="ms"))
    columns = (*about, largest, rms, "contacts shared", column("time", unit="ms"))
    rows = [
        (
            s.solver,
            s.dt and s.dt * 1e3,
            f"failed: {s.failure}" if s.failure else unit.from_si(s.largest, "length"),
            unit.from_si(s.rms, "length"),
            "" if s.failure else f"{s.shared} of {s.contacts}",
            "" if s.failure else f"{s.time * 1e3:.1f}",
        )
        for s in result.settings
    ]
    return lib.table.ResultTable(columns, rows)


def _results(
    result: lib.grid.Tradeoff, left_out: Mapping[str, str], seed: int
) -> dict[str, object]:
    """Return the measurement as it stands in the JSON; what failed has null for its numbers."""
    return {
        "settings": result.table().json(),
        "spread": result.spread,
        "known_by": result.known_by,
        "seed": seed,
        "left_out": {"shots": list(result.left_out), "solvers": dict(left_out)},
        "warnings": list(common.warnings_of(result.warned)),
        "machine": lib.grid.machine(),
    }
