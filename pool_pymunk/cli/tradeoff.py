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

NAME = "contact-tolerance"  # of the files, where tolerances are measured

Tolerances = Annotated[
    str | None,
    opt.option(
        "Measure the exact solver at these tolerances of contacts that persist, in place of "
        "solvers and steps. Without a unit they are in the scenario's.",
        "LENGTH,...", "--contact-tolerance", for_experts=True,
    ),
]  # fmt: skip


def tradeoff(
    scenario: opt.Scenario,
    shot: opt.ShotName = None,
    solvers: opt.Columns = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    contact_tolerance: Tolerances = None,
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

    Writes tradeoff.csv, tradeoff.png and tradeoff.svg (contact-tolerance.csv and so on, if
    tolerances are measured) to renders/<scenario>, after Ctrl-C with what was measured.
    """
    for key, value, least in (("budget", budget, 0), ("samples", samples, 2), ("seed", seed, 0)):
        if not value >= least:
            raise read.InputError(f"--{key} = {value}: must be {least} or more")
    how = common.How(law, friction, max_time)
    scene = how.scene(scenario)
    tolerances = _tolerances(contact_tolerance, solvers, scene.units)
    columns, left_out = how.columns(scene, solvers, every=True)
    if tolerances:
        columns, left_out = lib.grid.at_tolerances(tolerances), {}
    shots, folder = read.shots(scene, shot), common.place(out, scenario)
    widths, known_by = common.position_errors(scenario, scene, position_error)
    errors, began = lib.uncertainty.Uncertainty(widths), time.perf_counter()
    found = lib.grid.begin(scene, shots, tolerances)
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
                if not tolerances
            ]
            if clouds:
                spread = max(cloud.worst.deviation for cloud in clouds)
                found = replace(found, spread=spread, known_by=known_by)
            for column, seconds in zip(columns, plan, strict=True):
                found = found.measured(column, budget / len(columns))
                bar.step(seconds)
    finally:
        if found.settings:
            _report(found, left_out, seed, folder / (NAME if tolerances else "tradeoff"))
            common.write_json(json, _results(found, left_out, seed), scenario, scene.title)
    return 0


def _tolerances(typed: str | None, solvers: str | None, units: lib.Units) -> list[float]:
    """Return the tolerances (m) as typed, from coarse to fine; they stand for solvers."""
    if typed is None:
        return []
    if solvers is not None:
        message = "give either --contact-tolerance or --solvers"
        raise read.InputError(f"--contact-tolerance = {typed}: {message}")
    key = "--contact-tolerance"
    return sorted({read.length(key, each, units) for each in read.names(key, typed)}, reverse=True)


def _report(result: lib.grid.Tradeoff, left_out: Mapping[str, str], seed: int, path: Path) -> None:
    """Print the table and what it says, and write the files."""
    lib.terminal.show(f"Errors at the end and time for {result.measured_shots}\n", _printed(result))
    common.say(lib.grid.sentences(result))
    common.say([*common.left_out_sentences(left_out), *common.warnings_of(result.warned)])
    same = {"spread": result.spread, "seed": seed, **lib.grid.machine()}
    with whole(path.with_suffix(".csv")) as part:
        result.table(same).csv(part)
    lib.diagram.draw(result, [path.with_suffix(suffix) for suffix in (".png", ".svg")])
    typer.echo(f"Diagram and data: {path.parent}")


def _printed(result: lib.grid.Tradeoff) -> lib.table.ResultTable:
    """Return the settings as a terminal shows them; what failed says so in place of its error."""
    unit = result.scene.units
    column = lib.table.TableColumn
    largest, rms = (column(f"{each} error", unit=unit.length) for each in ("largest", "rms"))
    tolerant = any(s.contact_tolerance for s in result.settings)
    fine = column("tolerance", unit=unit.length) if tolerant else column("dt", unit="ms")
    about: lib.table.Columns = (column("solver", left=True), fine)
    columns = (*about, largest, rms, "contacts shared", "events", column("time", unit="ms"))
    rows = [
        (
            s.solver,
            _fineness(s, unit),
            f"failed: {s.failure}" if s.failure else unit.from_si(s.largest, "length"),
            unit.from_si(s.rms, "length"),
            "" if s.failure else f"{s.shared} of {s.contacts}",
            "" if s.failure else s.events,
            "" if s.failure else f"{s.time * 1e3:.1f}",
        )
        for s in result.settings
    ]
    return lib.table.ResultTable(columns, rows)


def _fineness(one: lib.grid.Setting, units: lib.Units) -> float | None:
    """Return the step (ms), or the tolerance in the scenario's unit."""
    if one.contact_tolerance is not None:
        return units.from_si(one.contact_tolerance, "length")
    return one.dt and one.dt * 1e3


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
