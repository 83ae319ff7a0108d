"""This command plays every shot, and writes its log, pictures and data."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, place, published_by, say, stem, write_json
from pool_pymunk.safety.files import whole

LONG = 60.0  # s; a run that takes longer is announced
What = Literal["start", "end", "energy"]  # pictures
# a finished shot, and the choice of its step if a tolerance made it
PlayedShot = tuple["lib.Run", "lib.tolerance.Choice | None"]
Contacts = Annotated[
    bool,
    opt.option("Also print each contact: place, impulses, velocities, energy.", None, "--contacts"),
]
Against = Annotated[
    str | None, opt.option("List only ends that differ from those of a run there.", "FOLDER")
]
Verbose = Annotated[bool, opt.option("Also print steps and computing time.", None, "--verbose")]
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


def run(
    scenario: opt.Scenario,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    tolerance: Annotated[
        str | None, opt.option("Choose a step whose ends are within this error: 0.01in.", "LENGTH")
    ] = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    contact_tolerance: opt.ContactTolerance = None,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
    pictures: opt.StartAndEnd = True,
    contacts: Contacts = False,
    against: Against = None,
    verbose: Verbose = False,
    show: Annotated[
        str | None, opt.option("Draw energy and momentum over time, too.", "energy")
    ] = None,
    units: Annotated[
        str,
        opt.option(
            f'The units of the CSV: "scene", or some of {opt.KNOWN}.', "U,...", for_experts=True
        ),
    ] = "m,kg,m/s",
) -> int:
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV, with --contacts also the contacts. If the
    command ends early, it keeps the files of the shots that were finished.
    """
    how = How(law, friction, max_time, contact_tolerance)
    scene = how.scene(scenario)
    setting = how.setting(scene, solver, dt)
    shots = read.shots(scene, shot)
    limit, written = _limit(tolerance, dt, solver, scene.units), _units(units, scene.units)
    if show not in (None, "energy"):
        raise read.InputError(f"--show = {show}: must be energy")
    drawn: list[What] = ["start", "end"] if pictures else []
    drawn += ["energy"] if show else []
    folder = place(out, scenario)
    others = {} if against is None else _others(against, scene, shots)
    say(lib.listing.opening(scene))
    done: list[PlayedShot] = []
    try:
        with lib.terminal.Bar("simulating", len(shots)) as bar:
            for played in _played(scene, shots, setting, limit, bar):
                done.append(played)
                say(lib.listing.shot_lines(played[0], others.get(played[0].shot), verbose))
                _report(played, folder, drawn, written, contacts)
    finally:
        if done:
            write_json(json, _results(done), scenario, scene.title)
    _close([one for one, _ in done], folder, bool(drawn))
    return _verdict(done)


def _others(
    folder: str, scene: lib.Scene, shots: Sequence[lib.Shot | None]
) -> dict[lib.Shot | None, lib.listing.Others]:
    """Read the ends of the same shots from a folder."""
    numbers = (scene.shots.index(one) + 1 if one else 1 for one in shots)
    found = [lib.listing.ends_in(Path(folder), f"shot-{k}.npz", scene) for k in numbers]
    return dict(zip(shots, found, strict=True))


def _limit(tolerance: str | None, dt: str | None, solver: str, units: lib.Units) -> float | None:
    """Return the tolerance (m) as typed, which stands for a step."""
    if tolerance is None:
        return None
    if dt is not None:
        raise read.InputError(f"--tolerance = {tolerance}: give either --tolerance or --dt")
    lib.tolerance.finest_step(solver)  # There must be a step to choose.
    return read.length("--tolerance", tolerance, units)


def _units(typed: str, own: lib.Units) -> lib.Units:
    """Return the units of the CSV: the scene's own, or as typed."""
    if "scene" in (named := read.names("--units", typed)) and len(named) > 1:
        raise read.InputError(f"--units = {typed}: scene must stand alone")
    return own if typed == "scene" else lib.quantities.read_units("--units", typed)


def _played(
    scene: lib.Scene,
    shots: Sequence[lib.Shot | None],
    setting: lib.grid.Column,
    limit: float | None,
    bar: lib.terminal.Bar,
) -> Iterator[PlayedShot]:
    """Yield each shot as soon as it is finished; a ``limit`` (m) of errors chooses its step."""
    solver, options = setting.solver, setting.options
    if limit is not None:

        def tries(step: float) -> None:
            bar.name(f"simulating in steps of {lib.words.step_text(step)}")

        chosen = lib.tolerance.simulate_within(scene, shots, limit, solver, None, tries, **options)
        for run, choice in chosen:
            yield run, choice
            bar.step()
        return
    estimates = lib.grid.estimate(scene, shots, setting)
    if (announced := announcement(estimates, solver)) is not None:
        print(announced, file=sys.stderr, flush=True)
    share = lib.terminal.Share(bar, estimates)
    for run in setting.runs(scene, shots, share.move):
        yield run, None
        share.finish()


def announcement(estimates: Sequence[lib.grid.Estimate], solver: str) -> str | None:
    """Return the line that says how long the shots will take, if it is more than a minute.

    >>> from pool_pymunk.studies.grid import Estimate
    >>> announcement([Estimate(2400.0, 1.5, 1.5e9), Estimate(600.0, 0.5, 5e8)], "time-slice")
    'This will take about 50 minutes (time-slice, 2e+09 steps); Ctrl-C keeps finished shots.'
    """
    cost, steps = sum(one.cost for one in estimates), sum(one.steps for one in estimates)
    if cost <= LONG:
        return None
    size = f"{cost / 3600.0:,.0f} hours" if cost > 2 * 3600.0 else f"{cost / 60.0:.0f} minutes"
    size = "a minute" if size == "1 minutes" else size
    return (
        f"This will take about {size} ({solver}, {steps:.2g} steps); Ctrl-C keeps finished shots."
    )


def _report(
    shot: PlayedShot, folder: Path, drawn: Sequence[What], units: lib.Units, contacts: bool
) -> None:
    """Print how the step of a shot was chosen, if it was, and write data, pictures and contacts."""
    run, choice = shot
    if choice is not None:
        say([*(f"    {line}" for line in choice.lines(run.scene.units)), ""])
    for ending, write in lib.run.FILES:
        with whole(folder / f"{stem(run)}{ending}") as part:
            write(run, part, **({"units": units} if ending == ".csv" else {}))
    for what in drawn:
        run.plot(what, folder / f"{stem(run)}-{what}.png")
    if contacts:
        for heading, table in lib.contacts.printed_tables(run):
            lib.terminal.show(f"    {heading}\n", table)
        with whole(folder / f"{stem(run)}-contacts.csv") as part:
            run.write_contacts_csv(part, units)


def _close(runs: Sequence[lib.Run], folder: Path, pictures: bool) -> None:
    """Print the last lines: agreement over all shots, and where the files are."""
    say(lib.listing.closing(runs))
    for run in filter(lib.listing.is_of_the_report, runs):
        agreement, exact = lib.listing.Agreement.of(run), lib.solvers.find_solver(run.solver).exact
        if exact and len(agreement.agreeing) < agreement.count:
            typer.echo(f"{run.name}: {REASONS[run.name]}.{published_by(run)}")
    what = "Pictures and data" if pictures else "Data"
    typer.echo(f"{what} of {lib.words.counted(len(runs), 'shot')}: {folder}")


def _results(done: Sequence[PlayedShot]) -> dict[str, object]:
    """Return the shots as they stand in the JSON."""
    records = [run.as_dict() for run, _ in done]
    for record, (run, choice) in zip(records, done, strict=True):
        if run.shot and run.shot.published:
            record["published"] = lib.listing.Agreement.of(run).as_dict()
        if choice is not None:
            record["tolerance"] = choice.as_dict()
    steps = {run.dt for run, _ in done}
    first = done[0][0]
    solver: dict[str, object] = {"name": first.solver}
    solver["dt"] = steps.pop() if len(steps) == 1 else None
    if first.contact_tolerance is not None:
        solver["contact_tolerance"] = first.contact_tolerance
    return {"solver": solver, "shots": records}


def _verdict(done: Sequence[PlayedShot]) -> int:
    """Name the shots that failed or missed the tolerance; return the exit code."""
    code = 0
    for run, choice in done:
        failed = [] if run.success else [lib.run.STATUSES[run.status]]
        if choice is not None and not choice.reached:
            failed.append("the tolerance is not reached")
        for why in failed:
            typer.echo(f"error: {run.name}: {why}", err=True)
            code = 1
    return code
