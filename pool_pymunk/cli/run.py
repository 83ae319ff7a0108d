"""This command plays every shot, and writes its log, pictures and data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import typer

from pool_pymunk.cli import read
from pool_pymunk.cli.lines import InputError, say
from pool_pymunk.cli.options import RunOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.runs import published_by, stem
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Scene, Shot, Units
from pool_pymunk.model.quantities import read_units
from pool_pymunk.report import listing
from pool_pymunk.results.contacts import printed_tables
from pool_pymunk.results.run import FILES, STATUSES, Run
from pool_pymunk.results.words import counted, step_text
from pool_pymunk.solvers import find_solver
from pool_pymunk.studies.grid import Column
from pool_pymunk.studies.tolerance import Choice, finest_step, simulate_within

What = Literal["start", "end", "energy"]  # pictures
# a finished shot, and the choice of its step if a tolerance made it
PlayedShot = tuple[Run, Choice | None]
# Why the exact ends of the report's shots are not the published ones (docs/report.md, 4 and 5).
REASONS = {
    "Simulation 1": (
        "the published ends are those of time slices of 1e-6 s, too long for the last printed "
        "digit, and these ends are exact"
    ),
    "Simulation 4": (
        "the first hit has no slip, so nothing says where its friction acts; for the published "
        "ends a rounding error of 4e-14 m/s did"
    ),
}


def run(asked: RunOptions) -> int:
    """Play the shots one after the other, and keep each as soon as it is finished."""
    scene = read.scene(asked)
    setting, shots = read.column(asked, scene), read.shots(scene, asked.shot)
    limit = _limit(asked, scene.units)
    units = _units(asked.units, scene.units)
    if asked.show not in (None, "energy"):
        raise InputError(f"--show = {asked.show}: must be energy")
    drawn: list[What] = ["start", "end"] if asked.pictures else []
    drawn += ["energy"] if asked.show else []
    folder = read.folder(asked.out, asked.scenario)
    others = {} if asked.against is None else _others(Path(asked.against), scene, shots)
    say(listing.opening(scene))
    say(f"Warning: {text}." for text in listing.unreached(scene))
    kinds = f"{'Pictures and data' if drawn else 'Data'} of {counted(len(shots), 'shot')}"
    done = list[PlayedShot]()
    with Output(folder, kinds, asked.json, (asked.scenario, scene.title)) as put:
        put.at_end(_results(done))
        with Bar("simulating", len(shots)) as bar:
            for played in _played(scene, shots, setting, limit, bar):
                done.append(played)
                put(_report(played, others.get(played[0].shot), drawn, units, asked.contacts))
                bar.step()
        say(_closing([one for one, _ in done]))
    return _verdict(done)


def _others(
    folder: Path, scene: Scene, shots: Sequence[Shot | None]
) -> dict[Shot | None, listing.Others]:
    """Read the ends of the same shots from a folder."""
    numbers = (scene.shots.index(one) + 1 if one else 1 for one in shots)
    found = [listing.ends_in(folder, f"shot-{k}.npz", scene) for k in numbers]
    return dict(zip(shots, found, strict=True))


def _limit(asked: RunOptions, units: Units) -> float | None:
    """Return the tolerance (m) as typed, which stands for a step."""
    tolerance = asked.tolerance
    if tolerance is None:
        return None
    if asked.dt is not None:
        raise InputError(f"--tolerance = {tolerance}: give either --tolerance or --dt")
    finest_step(asked.solver)  # There must be a step to choose.
    return read.length("--tolerance", tolerance, units)


def _units(typed: str, own: Units) -> Units:
    """Return the units of the CSV: the scene's own, or as typed."""
    if "scene" in (named := read.names("--units", typed)) and len(named) > 1:
        raise InputError(f"--units = {typed}: scene must stand alone")
    return own if typed == "scene" else read_units("--units", typed)


def _played(
    scene: Scene, shots: Sequence[Shot | None], setting: Column, limit: float | None, bar: Bar
) -> Iterator[PlayedShot]:
    """Yield each shot as soon as it is finished; a ``limit`` (m) of errors chooses its step."""
    if limit is None:
        return ((each, None) for each in setting.runs(scene, shots, bar.at))

    def tries(step: float) -> None:
        bar.name(f"in steps of {step_text(step)}")

    return simulate_within(scene, shots, limit, setting.solver, None, tries, **setting.options)


def _report(
    shot: PlayedShot, others: listing.Others | None, drawn: Sequence[What], units: Units,
    contacts: bool,
) -> Report:  # fmt: skip
    """Yield the log of a shot, how its step was chosen, and its data, pictures and contacts."""
    one, choice = shot
    yield from listing.shot_lines(one, others)
    if choice is not None:
        yield from (*(f"    {line}" for line in choice.lines(one.scene.units)), "")
    for heading, table in printed_tables(one) if contacts else ():
        yield from (f"    {heading}\n", table)
    for ending, write in FILES:
        in_units: dict[str, Any] = {"units": units} if ending == ".csv" else {}
        yield File(f"{stem(one)}{ending}", partial(write, one, **in_units))
    for what in drawn:
        yield File(f"{stem(one)}-{what}.png", partial(one.plot, what))
    if contacts:
        yield File(f"{stem(one)}-contacts.csv", partial(one.write_contacts_csv, units=units))


def _closing(played: Sequence[Run]) -> Iterator[str]:
    """Yield the agreement over all shots."""
    yield from listing.closing(played)
    for one in filter(listing.is_of_the_report, played):
        agreement = listing.Agreement.of(one)
        if find_solver(one.solver).exact and len(agreement.agreeing) < agreement.count:
            yield f"{one.name}: {REASONS[one.name]}.{published_by(one)}"


def _results(done: Sequence[PlayedShot]) -> Report:
    """Yield the shots as they stand in the JSON, if there are any."""
    if not done:
        return
    steps, (first, _) = {one.dt for one, _ in done}, done[0]
    solver: dict[str, object] = {"name": first.solver}
    solver["dt"] = steps.pop() if len(steps) == 1 else None
    if first.contact_tolerance is not None:
        solver["contact_tolerance"] = first.contact_tolerance
    yield {"solver": solver, "shots": [_record(*each) for each in done]}


def _record(one: Run, choice: Choice | None) -> dict[str, object]:
    record = one.as_dict() | listing.figures(one)
    if one.shot and one.shot.published:
        record["published"] = listing.Agreement.of(one).as_dict()
    return record | ({} if choice is None else {"tolerance": choice.as_dict()})


def _verdict(done: Sequence[PlayedShot]) -> int:
    """Name the shots that failed or missed the tolerance; return the exit code."""
    code = 0
    for one, choice in done:
        failed = [] if one.success else [STATUSES[one.status]]
        if choice is not None and not choice.reached:
            failed.append("the tolerance is not reached")
        for why in failed:
            typer.echo(f"error: {one.name}: {why}", err=True)
            code = 1
    return code
