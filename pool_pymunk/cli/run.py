"""``run``: the main job."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from pool_pymunk.cli.common import (
    InputError,
    JsonFile,
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
    from collections.abc import Iterator, Sequence

    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.results.run import Run
    from pool_pymunk.studies.tolerance import Choice


def run(
    scenario: Scenario,
    solver: SolverName = "pymunk",
    dt: Step = None,
    tolerance: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Choose the step that keeps ends within it: 0.01in."),
    ] = None,
    shot: ShotName = None,
    json: JsonFile = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw the start and end of each shot.")] = True,
) -> int:
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV. What ends the command early leaves the
    files of the shots that were finished.
    """
    from pool_pymunk.report.listing import opening

    scene = read_scenario(scenario)
    step, limit = read_step(dt), _read_tolerance(tolerance, scene, solver, dt)
    shots = read_shots(scene, shot)
    folder = out or Path("renders") / Path(scenario).stem
    played = _played(scene, shots, solver, step, limit)
    for line in opening(scene):
        typer.echo(line)
    done: list[Played] = []
    try:
        with progress("simulating", len(shots)) as bar, input_errors():
            for one in played:
                done.append(one)
                _log(one)
                _save(one.run, folder, len(done), pictures)
                bar.update(bar.task_ids[0], advance=1)
    finally:
        if json is not None and done:
            _write_json(json, scenario, scene, done)
    _close(done, folder, pictures)
    return _verdict(done)


def _read_tolerance(text: str | None, scene: Scene, solver: str, dt: str | None) -> float | None:
    """The tolerance in m; there must be a step to choose, and nobody who has chosen it."""
    if text is None:
        return None
    from pool_pymunk.model.quantities import positive
    from pool_pymunk.studies.tolerance import finest_step

    if dt is not None:
        raise InputError(f"--tolerance = {text}: stands beside --dt: one of the two")
    with input_errors():
        finest_step(solver)  # there must be one
        return positive("--tolerance", text, "length", scene.units)


class Played(NamedTuple):
    """A shot that is finished, and the choice of its step where there was one."""

    run: Run
    choice: Choice | None = None


def _played(
    scene: Scene,
    shots: Sequence[Shot | None],
    solver: str,
    dt: float | None,
    tolerance: float | None,
) -> Iterator[Played]:
    """Each shot, as soon as it is there, at the step ``dt`` or at the one that is chosen for it."""
    from pool_pymunk.solvers import find_solver, simulate_all
    from pool_pymunk.studies.tolerance import simulate_within

    with input_errors():
        find_solver(solver)
    if tolerance is not None:
        return (Played(*one) for one in simulate_within(scene, shots, tolerance, solver))
    return (Played(one) for one in simulate_all(scene, shots, solver=solver, dt=dt))


def _log(one: Played) -> None:
    from pool_pymunk.report.listing import shot_lines

    for line in shot_lines(one.run):
        typer.echo(line)
    if one.choice is not None:
        for line in one.choice.lines(one.run.scene.units):
            typer.echo(f"    {line}")
        typer.echo()


def _save(run: Run, folder: Path, k: int, pictures: bool) -> None:
    """Write the data and pictures of one shot, the ``k``-th of this command."""
    from pool_pymunk.safety.files import whole

    number = run.scene.shots.index(run.shot) + 1 if run.shot else k
    stem = f"shot-{number}"
    for name, write in (
        (f"{stem}.npz", run.write_npz),
        (f"{stem}.csv", run.write_csv),
        (f"{stem}-events.csv", run.write_events_csv),
    ):
        with whole(folder / name) as part:
            write(part)
    if pictures:
        _draw(run, folder, stem)


def _close(done: Sequence[Played], folder: Path, pictures: bool) -> None:
    """The last lines: agreement over all shots, and where the files are."""
    from pool_pymunk.report.listing import closing
    from pool_pymunk.results.words import counted

    for line in closing([one.run for one in done]):
        typer.echo(line)
    what = "pictures and data" if pictures else "data"
    typer.echo(f"{what.capitalize()} of {counted(len(done), 'shot')}: {folder}")


def _draw(one: Run, folder: Path, stem: str) -> None:
    from pool_pymunk.render import picture

    for when in ("start", "end"):
        picture(one, folder / f"{stem}-{when}.png", when=when)


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
    """A shot as it stands in the JSON."""
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
