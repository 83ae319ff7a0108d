"""``run``: the main job."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pool_pymunk.cli.common import (
    InputError,
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

    from pool_pymunk.result import Run
    from pool_pymunk.scene import Scene, Shot
    from pool_pymunk.tolerance import Choice


def run(
    scenario: Scenario,
    solver: SolverName = "pymunk",
    dt: Step = None,
    tolerance: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Choose the step that keeps ends within it: 0.01in."),
    ] = None,
    shot: ShotName = None,
    json: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the results here.")
    ] = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw the start and end of each shot.")] = True,
) -> int:
    """Simulate every shot: the log, agreement with published ends, pictures and data.

    Files go to renders/<scenario>: for each shot its start and end as pictures, times, positions
    and velocities as npz and CSV, and the events as CSV.
    """
    scene = read_scenario(scenario)
    step, limit = read_step(dt), _read_tolerance(tolerance, scene, solver, dt)
    folder = out or Path("renders") / Path(scenario).stem
    runs, choices = _simulate(scene, shot, solver, step, limit)
    _save(runs, folder, pictures)
    if json is not None:
        _write_json(json, scenario, scene, runs, choices)
    return _verdict(runs, choices)


def _read_tolerance(text: str | None, scene: Scene, solver: str, dt: str | None) -> float | None:
    """The tolerance in m; there must be a step to choose, and nobody who has chosen it."""
    if text is None:
        return None
    from pool_pymunk.quantities import positive
    from pool_pymunk.tolerance import check_solver

    if dt is not None:
        raise InputError(f"--tolerance = {text}: stands beside --dt: one of the two")
    with input_errors():
        check_solver(solver)
        return positive("--tolerance", text, "length", scene.units)


def _simulate(
    scene: Scene, shot: str | None, solver: str, dt: float | None, tolerance: float | None
) -> tuple[list[Run], list[Choice]]:
    """Simulate the shots asked for, and log each as soon as it is there."""
    from pool_pymunk.listing import closing, opening, shot_lines
    from pool_pymunk.solvers import find_solver

    shots = read_shots(scene, shot)
    with input_errors():
        find_solver(solver)
    for line in opening(scene):
        typer.echo(line)
    runs: list[Run] = []
    choices: list[Choice] = []
    with progress("simulating", len(shots)) as bar, input_errors():
        for done, choice in _played(scene, shots, solver, dt, tolerance):
            runs.append(done)
            bar.update(bar.task_ids[0], advance=1)
            for line in shot_lines(done):
                typer.echo(line)
            if choice is not None:
                choices.append(choice)
                for line in choice.lines(scene.units):
                    typer.echo(f"    {line}")
                typer.echo()
    for line in closing(runs):
        typer.echo(line)
    return runs, choices


def _played(
    scene: Scene,
    shots: Sequence[Shot | None],
    solver: str,
    dt: float | None,
    tolerance: float | None,
) -> Iterator[tuple[Run, Choice | None]]:
    """Each shot's run at the step ``dt``, or at the one chosen for it by ``tolerance``."""
    from pool_pymunk.solvers import simulate_all
    from pool_pymunk.tolerance import simulate_within

    if tolerance is not None:
        yield from simulate_within(scene, shots, tolerance, solver)
        return
    for one in simulate_all(scene, shots, solver=solver, dt=dt):
        yield one, None


def _save(runs: list[Run], folder: Path, pictures: bool) -> None:
    """Write each shot's data and pictures."""
    from pool_pymunk.files import whole
    from pool_pymunk.listing import counted

    with progress("drawing", len(runs)) as bar:
        for k, one in enumerate(runs, start=1):
            number = one.scene.shots.index(one.shot) + 1 if one.shot else k
            stem = f"shot-{number}"
            for name, write in (
                (f"{stem}.npz", one.write_npz),
                (f"{stem}.csv", one.write_csv),
                (f"{stem}-events.csv", one.write_events_csv),
            ):
                with whole(folder / name) as part:
                    write(part)
            if pictures:
                _draw(one, folder, stem)
            bar.update(bar.task_ids[0], advance=1)
    what = "pictures and data" if pictures else "data"
    typer.echo(f"{what.capitalize()} of {counted(len(runs), 'shot')}: {folder}")


def _draw(one: Run, folder: Path, stem: str) -> None:
    from pool_pymunk.files import whole
    from pool_pymunk.render import picture

    for when in ("start", "end"):
        with whole(folder / f"{stem}-{when}.png") as part:
            picture(one, part, when=when)


def _write_json(
    path: Path, scenario: str, scene: Scene, runs: list[Run], choices: list[Choice]
) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.files import whole
    from pool_pymunk.listing import Agreement
    from pool_pymunk.scenario import label

    shots = []
    for one in runs:
        record = one.as_dict()
        if one.shot and one.shot.published:
            record["published"] = Agreement.of(one).as_dict()
        shots.append(record)
    for record, choice in zip(shots, choices, strict=False):
        record["tolerance"] = choice.as_dict()
    steps = {one.dt for one in runs}
    content = {
        "scenario": label(scenario),
        "title": scene.title,
        "version": __version__,
        "solver": {"name": runs[0].solver, "dt": runs[0].dt if len(steps) == 1 else None},
        "shots": shots,
    }
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _verdict(runs: list[Run], choices: list[Choice]) -> int:
    from pool_pymunk.result import STATUSES

    unfinished = [one for one in runs if one.status in ("non_finite", "max_events")]
    for one in unfinished:
        typer.echo(f"error: {one.name}: {STATUSES[one.status]}", err=True)
    missed = [one for one, choice in zip(runs, choices, strict=False) if not choice.reached]
    for one in missed:
        typer.echo(f"error: {one.name}: the tolerance is not reached", err=True)
    return 1 if unfinished or missed else 0
