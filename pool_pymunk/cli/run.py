"""This command is the main job: every shot, with its log, pictures and data."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from pool_pymunk.cli.common import (
    FrictionBy,
    How,
    InputError,
    JsonFile,
    LawName,
    MaxTime,
    OutDir,
    Scenario,
    ShotName,
    SolverName,
    Step,
    input_errors,
    progress,
    read_scenario,
    read_shots,
    read_step,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rich.progress import Progress

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
PACE = 0.1  # s between two moves of the progress bar


def run(
    scenario: Scenario,
    solver: SolverName = "pymunk",
    dt: Step = None,
    tolerance: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Choose the step that keeps ends within it: 0.01in."),
    ] = None,
    shot: ShotName = None,
    law: LawName = None,
    friction: FrictionBy = None,
    max_time: MaxTime = None,
    json: JsonFile = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw the start and end of each shot.")] = True,
    show: Annotated[
        str | None, typer.Option(metavar="energy", help="Draw energy and momentum over time, too.")
    ] = None,
) -> int:
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV. What ends the command early leaves the
    files of the shots that were finished.
    """
    from pool_pymunk.report.listing import opening

    how = How(law, friction, max_time)
    scene = how.scene(read_scenario(scenario))
    step = read_step(dt)
    how.check(scene, solver, dt)
    asked = Asked(scene, read_shots(scene, shot), solver, step, how.options)
    limit = _read_tolerance(tolerance, scene, solver, dt)
    drawn = _drawn(pictures, show)
    folder = out or Path("renders") / Path(scenario).stem
    for line in opening(scene):
        typer.echo(line)
    done: list[Played] = []
    try:
        with progress("simulating", len(asked.shots)) as bar, input_errors():
            for one in _played(asked, bar) if limit is None else _within(asked, limit, bar):
                done.append(one)
                _log(one)
                _save(one.run, folder, len(done), drawn)
    finally:
        if json is not None and done:
            _write_json(json, scenario, scene, done)
    _close(done, folder, bool(drawn))
    return _verdict(done)


def _read_tolerance(text: str | None, scene: Scene, solver: str, dt: str | None) -> float | None:
    """Return the tolerance in m; there must be a step to choose that is not chosen already."""
    if text is None:
        return None
    from pool_pymunk.model.quantities import positive
    from pool_pymunk.studies.tolerance import finest_step

    if dt is not None:
        raise InputError(f"--tolerance = {text}: stands beside --dt: one of the two")
    with input_errors():
        finest_step(solver)  # there must be one
        return positive("--tolerance", text, "length", scene.units)


def _drawn(pictures: bool, show: str | None) -> tuple[What, ...]:
    """Return the pictures that are asked for."""
    if show not in (None, "energy"):
        raise InputError(f"--show = {show}: must be energy")
    both: tuple[What, ...] = ("start", "end") if pictures else ()
    return (*both, "energy") if show else both


class Asked(NamedTuple):
    """These shots are asked for, by a solver with its options, at a step (s; None: its own)."""

    scene: Scene
    shots: Sequence[Shot | None]
    solver: str
    dt: float | None
    options: Mapping[str, Any]


class Played(NamedTuple):
    """A shot is finished; ``choice`` tells of its step, where that was chosen by a tolerance."""

    run: Run
    choice: Choice | None = None


def _within(asked: Asked, tolerance: float, bar: Progress) -> Iterator[Played]:
    """Yield each shot at the step that is chosen for it."""
    from pool_pymunk.studies.tolerance import simulate_within

    scene, shots, solver, _, options = asked
    for run, choice in simulate_within(scene, shots, tolerance, solver, **options):
        yield Played(run, choice)
        bar.update(bar.task_ids[0], advance=1)


def _played(asked: Asked, bar: Progress) -> Iterator[Played]:
    """Yield each shot as soon as it is there; announce what takes long."""
    from pool_pymunk.solvers import simulate_all
    from pool_pymunk.studies.tradeoff import estimate

    scene, shots, solver, dt, options = asked
    estimates = estimate(scene, shots, solver, dt, **options)
    if (announced := announcement(estimates, solver)) is not None:
        typer.echo(announced, err=True)
    share = Share(bar, estimates)
    for run in simulate_all(scene, shots, solver=solver, dt=dt, on_time=share.move, **options):
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


class Share:
    """This class moves the progress bar inside a shot, by the share of its estimated time."""

    def __init__(self, bar: Progress, estimates: Sequence[Estimate]) -> None:
        self.bar = bar
        self.durations = [one.duration for one in estimates]
        self.done = 0
        self.moved = time.monotonic()

    def move(self, t: float) -> None:
        """Show that the shot has come to ``t`` (s)."""
        now = time.monotonic()
        if now - self.moved >= PACE:
            self.moved = now
            self._show(self.done + min(t / self.durations[self.done], 1.0))

    def finish(self) -> None:
        """Show that a shot is finished."""
        self.done += 1
        self._show(self.done)

    def _show(self, completed: float) -> None:
        self.bar.update(self.bar.task_ids[0], completed=completed)


def _log(one: Played) -> None:
    from pool_pymunk.report.listing import shot_lines

    for line in shot_lines(one.run):
        typer.echo(line)
    if one.choice is not None:
        for line in one.choice.lines(one.run.scene.units):
            typer.echo(f"    {line}")
        typer.echo()


def _save(run: Run, folder: Path, k: int, drawn: Sequence[What]) -> None:
    """Write the data and pictures of one shot, the ``k``-th of this command."""
    from pool_pymunk.results.run import FILES
    from pool_pymunk.safety.files import whole

    number = run.scene.shots.index(run.shot) + 1 if run.shot else k
    stem = f"shot-{number}"
    for ending, write in FILES:
        with whole(folder / f"{stem}{ending}") as part:
            write(run, part)
    for what in drawn:
        run.plot(what, folder / f"{stem}-{what}.png")


def _close(done: Sequence[Played], folder: Path, pictures: bool) -> None:
    """Print the last lines: agreement over all shots, and where the files are."""
    from pool_pymunk.report.listing import closing
    from pool_pymunk.results.words import counted

    for line in closing([one.run for one in done]):
        typer.echo(line)
    for name in _differ_exactly([one.run for one in done]):
        typer.echo(f"{name}: {REASONS[name]}.")
    what = "pictures and data" if pictures else "data"
    typer.echo(f"{what.capitalize()} of {counted(len(done), 'shot')}: {folder}")


def _differ_exactly(runs: Sequence[Run]) -> Iterator[str]:
    """Yield the names of the report's own shots that are exact and end elsewhere than published."""
    from pool_pymunk.report.listing import Agreement, is_of_the_report
    from pool_pymunk.solvers import find_solver

    for run in runs:
        agreement = Agreement.of(run)
        differs = len(agreement.agreeing) < agreement.count and find_solver(run.solver).exact
        if differs and is_of_the_report(run):
            yield run.name


def _write_json(path: Path, scenario: str, scene: Scene, done: Sequence[Played]) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.model.scenario import label
    from pool_pymunk.safety.files import whole

    steps = {one.run.dt for one in done}
    content = {
        "scenario": label(scenario),
        "title": scene.title,
        "version": __version__,
        "solver": {"name": done[0].run.solver, "dt": steps.pop() if len(steps) == 1 else None},
        "shots": [_record(one) for one in done],
    }
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _record(one: Played) -> dict[str, object]:
    """Return a shot as it stands in the JSON."""
    from pool_pymunk.report.listing import Agreement

    record = one.run.as_dict()
    if one.run.shot and one.run.shot.published:
        record["published"] = Agreement.of(one.run).as_dict()
    if one.choice is not None:
        record["tolerance"] = one.choice.as_dict()
    return record


def _verdict(done: Sequence[Played]) -> int:
    from pool_pymunk.results.run import STATUSES

    unfinished = [one for one in done if one.run.status in ("non_finite", "max_events")]
    for one in unfinished:
        typer.echo(f"error: {one.run.name}: {STATUSES[one.run.status]}", err=True)
    missed = [one for one in done if one.choice is not None and not one.choice.reached]
    for one in missed:
        typer.echo(f"error: {one.run.name}: the tolerance is not reached", err=True)
    return 1 if unfinished or missed else 0
