"""This command measures error and time over solvers and steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from pool_pymunk.cli import read, runs
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import TradeoffOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Units
from pool_pymunk.results.table import Columns, ResultTable, TableColumn
from pool_pymunk.studies import grid
from pool_pymunk.studies.sensitivity import sensitivity
from pool_pymunk.studies.uncertainty import Uncertainty

KEY = "--contact-tolerance"


def tradeoff(asked: TradeoffOptions) -> int:
    """Measure every column of the grid, and the effect of rounded inputs."""
    read.at_least(0, budget=asked.budget, seed=asked.seed)
    read.at_least(2, samples=asked.samples)
    scene = read.scene(asked)
    tolerances = _tolerances(asked, scene.units)
    if tolerances:
        columns, left_out = grid.at_tolerances(tolerances), dict[str, str]()
    else:
        columns, left_out = read.columns(asked, scene, every=True)
    shots, folder = read.shots(scene, asked.shot), read.folder(asked.out, asked.scenario)
    widths, known_by = read.position_errors(asked, asked.scenario, scene)
    found = grid.begin(scene, shots, tolerances)
    with Output(folder, "Diagram and data", asked.json, (asked.scenario, scene.title)) as put:
        if not tolerances:
            with Bar("playing", asked.samples * len(found.sound)) as bar:
                spread = max(
                    sensitivity(
                        scene, run.shot, Uncertainty(widths), asked.samples, asked.seed,
                        on_done=bar.step,
                    ).worst.deviation
                    for run in found.sound
                )  # fmt: skip
            found = replace(found, spread=spread, known_by=known_by)
        for each in measure(found, columns, asked.budget):
            put.at_end(_report(each, left_out, asked.seed))
    return 0


def measure(
    found: grid.Tradeoff, columns: Sequence[grid.Column], budget: float = 0.0
) -> Iterator[grid.Tradeoff]:
    """Measure one column after the other; yield all that was measured so far."""
    with Bar("measuring", len(columns)) as bar:
        for column in columns:
            bar.name(str(column))
            found = found.measured(column, budget / len(columns))
            yield found
            bar.step()


def _tolerances(asked: TradeoffOptions, units: Units) -> list[float]:
    """Return the tolerances (m) as typed, from coarse to fine; they stand for solvers."""
    typed = asked.contact_tolerance
    if typed is None:
        return []
    if asked.solvers is not None:
        raise InputError(f"{KEY} = {typed}: give either {KEY} or --solvers")
    return sorted({read.length(KEY, each, units) for each in read.names(KEY, typed)}, reverse=True)


def _report(found: grid.Tradeoff, left_out: Mapping[str, str], seed: int) -> Report:
    """Yield the table and what it says, the settings, and the diagram."""
    from pool_pymunk.render import diagram  # Only who draws waits for it.

    warnings = list(runs.warnings_of(found.warned))
    yield f"Errors at the end and time for {found.measured_shots}\n"
    yield _printed(found)
    yield from (*grid.sentences(found), *runs.doubts_of(found.sound))
    yield from (*runs.left_out_sentences(left_out), *warnings)
    name = "contact-tolerance" if _is_tolerant(found) else "tradeoff"
    same = {"spread": found.spread, "seed": seed, **grid.machine()}
    yield File(f"{name}.csv", found.table(same).csv)
    for suffix in (".png", ".svg"):
        yield File(f"{name}{suffix}", lambda path: diagram.draw(found, [path]))
    yield {  # What failed has null for its numbers.
        "settings": found.table().json(),
        "spread": found.spread,
        "known_by": found.known_by,
        "seed": seed,
        "left_out": {"shots": list(found.left_out), "solvers": dict(left_out)},
        "warnings": warnings,
        "machine": grid.machine(),
    }


def _is_tolerant(found: grid.Tradeoff) -> bool:
    """Tell whether tolerances of contacts were measured."""
    return any(s.contact_tolerance for s in found.settings)


def _printed(found: grid.Tradeoff) -> ResultTable:
    """Return the settings as a terminal shows them; what failed says so in place of its error."""
    unit = found.scene.units
    kinds = ("largest error", "rms error", "tolerance")
    largest, rms, tolerance = (TableColumn(kind, unit=unit.length) for kind in kinds)
    fine = tolerance if _is_tolerant(found) else TableColumn("dt", unit="ms")
    first: Columns = (TableColumn("solver", left=True), fine, largest, rms)
    columns = (*first, "contacts shared", "events", TableColumn("time", unit="ms"))
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
        for s in found.settings
    ]
    return ResultTable(columns, rows)


def _fineness(one: grid.Setting, units: Units) -> float | None:
    """Return the step (ms), or the tolerance in the scenario's unit."""
    if one.contact_tolerance is not None:
        return units.from_si(one.contact_tolerance, "length")
    return one.dt and one.dt * 1e3
