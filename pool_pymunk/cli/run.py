"""This command is the main job: every shot, with its log, pictures and data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, Setting, about, place, stem, write_json
from pool_pymunk.cli.read import InputError
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    from pool_pymunk.cli.terminal import Bar
    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.results.run import Run
    from pool_pymunk.studies.tolerance import Choice
    from pool_pymunk.studies.tradeoff import Estimate

LONG = 60.0  # s; a run that takes longer is announced
What = Literal["start", "end", "energy"]  # pictures
# Why the exact ends of the report's shots are not the published ones (docs/report.md, 4 and 5).
REASONS = {
    "Simulation 1": (
        "the published ends are those of time slices of 1e-6 s, which have not converged to the "
        "last printed digit; the ends of this run are exact"
    ),
    "Simulation 4": (
        "the slip at the first hit is exactly zero, where law published jumps; the published ends "
        "come from a slip of 4e-14 m/s, a rounding error of the report's arithmetic"
    ),
}


def run(
    scenario: opt.Scenario,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    tolerance: Annotated[
        str | None, opt.option("Choose the step that keeps ends within it: 0.01in.", "LENGTH")
    ] = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
    pictures: opt.StartAndEnd = True,
    show: Annotated[
        str | None, opt.option("Draw energy and momentum over time, too.", "energy")
    ] = None,
) -> int:
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV. What ends the command early leaves the
    files of the shots that were finished.
    """
    how = How(law, friction, max_time)
    scene = how.scene(scenario)
    setting = how.setting(scene, solver, dt)
    shots = read.shots(scene, shot)
    limit = _read_tolerance(tolerance, scene, solver, dt)
    drawn = _drawn(pictures, show)
    folder = place(out, scenario)
    for line in lib.listing.opening(scene):
        typer.echo(line)
    done: list[Played] = []
    try:
        with lib.terminal.progress("simulating", len(shots)) as bar:
            for one in _played(scene, shots, setting, limit, bar):
                done.append(one)
                _log(one)
                _save(one.run, folder, drawn)
    finally:
        if done:
            write_json(json, about(scenario, scene), _results(done))
    _close([one.run for one in done], folder, bool(drawn))
    return _verdict(done)


def _read_tolerance(text: str | None, scene: Scene, solver: str, dt: str | None) -> float | None:
    """Return the tolerance in m; there must be a step to choose that is not chosen already."""
    if text is None:
        return None
    if dt is not None:
        raise InputError(f"--tolerance = {text}: stands beside --dt: one of the two")
    lib.tolerance.finest_step(solver)  # there must be one
    return lib.quantities.positive("--tolerance", text, "length", scene.units)


def _drawn(pictures: bool, show: str | None) -> tuple[What, ...]:
    """Return the pictures that are asked for."""
    if show not in (None, "energy"):
        raise InputError(f"--show = {show}: must be energy")
    both: tuple[What, ...] = ("start", "end") if pictures else ()
    return (*both, "energy") if show else both


class Played(NamedTuple):
    """A shot is finished; ``choice`` tells of its step, where that was chosen by a tolerance."""

    run: Run
    choice: Choice | None = None


def _played(
    scene: Scene, shots: Sequence[Shot | None], setting: Setting, limit: float | None, bar: Bar
) -> Iterator[Played]:
    """Yield each shot as soon as it is there; a ``limit`` (m) of errors chooses its step."""
    solver, dt, _, options = setting
    if limit is not None:
        for run, choice in lib.tolerance.simulate_within(scene, shots, limit, solver, **options):
            yield Played(run, choice)
            bar.step()
        return
    estimates = lib.tradeoff.estimate(scene, shots, solver, dt, **options)
    if (announced := announcement(estimates, solver)) is not None:
        typer.echo(announced, err=True)
    share = lib.terminal.Share(bar, estimates)
    settings = {"solver": solver, "dt": dt, "on_time": share.move, **options}
    for run in lib.solvers.simulate_all(scene, shots, **settings):
        yield Played(run)
        share.finish()


def announcement(estimates: Sequence[Estimate], solver: str) -> str | None:
    """Return the line that says how long the shots will take, if it is more than a minute.

    >>> from pool_pymunk.studies.tradeoff import Estimate
    >>> announcement([Estimate(2400.0, 1.5, 1.5e9), Estimate(600.0, 0.5, 5e8)], "time-slice")
    'This will take about 50 minutes (time-slice, 2e+09 steps); Ctrl-C keeps finished shots.'
    """
    cost, steps = sum(one.cost for one in estimates), sum(one.steps for one in estimates)
    if cost <= LONG:
        return None
    hours = cost > 2 * 3600.0
    size = f"{cost / 3600.0:,.0f} hours" if hours else f"{cost / 60.0:.0f} minutes"
    size = "a minute" if size == "1 minutes" else size
    work = f"{solver}, {steps:.2g} steps"
    return f"This will take about {size} ({work}); Ctrl-C keeps finished shots."


def _log(one: Played) -> None:
    for line in lib.listing.shot_lines(one.run):
        typer.echo(line)
    if one.choice is not None:
        for line in one.choice.lines(one.run.scene.units):
            typer.echo(f"    {line}")
        typer.echo()


def _save(run: Run, folder: Path, drawn: Sequence[What]) -> None:
    """Write the data and pictures of one shot."""
    for ending, write in lib.run.FILES:
        with whole(folder / f"{stem(run)}{ending}") as part:
            write(run, part)
    for what in drawn:
        run.plot(what, folder / f"{stem(run)}-{what}.png")


def _close(runs: Sequence[Run], folder: Path, pictures: bool) -> None:
    """Print the last lines: agreement over all shots, and where the files are."""
    for line in lib.listing.closing(runs):
        typer.echo(line)
    for run in filter(_differs_exactly, runs):
        typer.echo(f"{run.name}: {REASONS[run.name]}.")
    what = "Pictures and data" if pictures else "Data"
    typer.echo(f"{what} of {lib.words.counted(len(runs), 'shot')}: {folder}")


def _differs_exactly(run: Run) -> bool:
    """Tell whether a run is one of the report's own shots, exact, and ends elsewhere."""
    agreement = lib.listing.Agreement.of(run)
    differs = len(agreement.agreeing) < agreement.count
    exact = lib.solvers.find_solver(run.solver).exact
    return differs and exact and lib.listing.is_of_the_report(run)


def _results(done: Sequence[Played]) -> dict[str, object]:
    steps = {one.run.dt for one in done}
    solver = {"name": done[0].run.solver, "dt": steps.pop() if len(steps) == 1 else None}
    return {"solver": solver, "shots": [_record(one) for one in done]}


def _record(one: Played) -> dict[str, object]:
    """Return a shot as it stands in the JSON."""
    record = one.run.as_dict()
    if one.run.shot and one.run.shot.published:
        record["published"] = lib.listing.Agreement.of(one.run).as_dict()
    if one.choice is not None:
        record["tolerance"] = one.choice.as_dict()
    return record


def _verdict(done: Sequence[Played]) -> int:
    """Name the shots that are no full results; return the exit code."""
    said = [f"{run.name}: {lib.run.STATUSES[run.status]}" for run, _ in done if not run.success]
    said += [
        f"{run.name}: the tolerance is not reached"
        for run, choice in done
        if choice is not None and not choice.reached
    ]
    for line in said:
        typer.echo(f"error: {line}", err=True)
    return 1 if said else 0
