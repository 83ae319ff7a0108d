"""This command sets solvers beside each other and the published ends."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pool_pymunk.cli.choices import SOLVERS, solver_lists
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
    Step,
    input_errors,
    progress,
    read_scenario,
    read_shots,
    read_step,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.table import Table

    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.results.run import Run
    from pool_pymunk.studies.compare import Comparison


def compare(
    scenario: Scenario,
    solvers: Annotated[
        str | None,
        typer.Option(
            metavar="S[:DT],...",
            help=f"Beside the exact one these, with steps: {', '.join(SOLVERS)}.",
            show_default="all",
            autocompletion=solver_lists,
        ),
    ] = None,
    dt: Step = None,
    shot: ShotName = None,
    law: LawName = None,
    friction: FrictionBy = None,
    max_time: MaxTime = None,
    json: JsonFile = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw exact and compared ends and paths.")] = True,
) -> int:
    """Run every shot through several solvers: ends, distances, and where they first part ways."""
    how = How(law, friction, max_time)
    scene = how.scene(read_scenario(scenario))
    settings = read_solvers(solvers, read_step(dt))
    names = [name for name, _ in settings]
    options = how.options_of(scene, names, named=solvers is not None)
    folder = out or Path("renders") / Path(scenario).stem / "compare"
    shots = read_shots(scene, shot)
    found: list[Comparison] = []
    try:
        for one in shots:
            comparisons = _compared(scene, one, settings, options)
            _print(comparisons)
            found += comparisons
    finally:
        if found:
            _write_ends(folder / "ends.csv", found)
        if found and json is not None:
            _write_json(json, scenario, scene, found)
    if pictures:
        _draw(found, folder)
    typer.echo(f"{'Pictures and data' if pictures else 'Data'}: {folder}")
    return 0


def read_solvers(text: str | None, dt: float | None) -> list[tuple[str, float | None]]:
    """Return solvers and steps as typed, such as ``pymunk:1/60,time-slice``.

    Solvers typed without a step get ``dt``, if they have steps at all; None is their own.

    Where nothing is typed, these are all solvers but the one that the others are compared with.

    >>> read_solvers("pymunk:1/64, time-slice", None)
    [('pymunk', 0.015625), ('time-slice', None)]
    """
    from pool_pymunk.solvers import SOLVERS, find_solver, yardstick

    if text is None:
        return [(name, dt) for name in SOLVERS if name != yardstick().name]
    settings = []
    for part in text.split(","):
        name, _, step = part.strip().partition(":")
        with input_errors():
            has_step = find_solver(name).dt is not None
        if step and not has_step:
            raise InputError(f"--solvers = {part.strip()}: {name} has no time step")
        settings.append((name, read_step(step) if step else dt if has_step else None))
    if not text.strip():
        raise InputError("--solvers = : name one solver or more")
    return settings


def _compared(
    scene: Scene,
    shot: Shot | None,
    settings: list[tuple[str, float | None]],
    options: Mapping[str, Mapping[str, Any]],
) -> list[Comparison]:
    from pool_pymunk.solvers import simulate, yardstick
    from pool_pymunk.studies.compare import Comparison

    with input_errors(), progress("simulating", len(settings)) as bar:
        reference = simulate(scene, shot, solver=yardstick().name)
        found = []
        for name, dt in settings:
            run = simulate(scene, shot, solver=name, dt=dt, **options[name])
            found.append(Comparison(reference, run))
            bar.update(bar.task_ids[0], advance=1)
    return found


# -- the terminal ----------------------------------------------------------------------------------


def _print(found: list[Comparison]) -> None:
    from rich.console import Console

    reference = found[0].reference
    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    console.print(f"\n[bold]{reference.name}[/bold]")
    console.print(_ends(found))
    console.print(_costs(found))
    for line in sentences(found):
        console.print(line, soft_wrap=True)


def _ends(found: list[Comparison]) -> Table:
    """Return each ball's exact end, and how far from it the others end."""
    from rich.table import Table

    reference = found[0].reference
    unit, published = reference.scene.units, reference.shot.published if reference.shot else {}
    table = Table(title=f"Exact ends, and how far from them the others end ({unit.length})")
    for heading in ("ball", "exact", *(_name(one.run) for one in found)):
        table.add_column(heading, justify="right")
    if published:
        table.add_column("published", justify="right")
    for ball in reference.scene.balls:
        x, y = (unit.from_si(v, "length") for v in reference.final[ball.id])
        row = [ball.id, f"{x:.4f}, {y:.4f}"]
        row += [_small(unit.from_si(one.distances[ball.id], "length")) for one in found]
        if ball.id in published:
            from pool_pymunk.studies.compare import end_distances

            off = end_distances(reference, {ball.id: published[ball.id]})[ball.id]
            row.append(f"{unit.from_si(off, 'length'):.3f}")
        table.add_row(*row)
    return table


def _costs(found: list[Comparison]) -> Table:
    from rich.table import Table

    table = Table()
    for heading in ("solver", "contacts", "steps", "wall time", "energy left", "status"):
        table.add_column(heading, justify="left" if heading in ("solver", "status") else "right")
    for run in (found[0].reference, *(one.run for one in found)):
        left = run.energy["final"] / run.energy["initial"] if run.energy["initial"] else 0.0
        contacts = sum(event.is_contact for event in run.events)
        table.add_row(
            _name(run), str(contacts), str(run.steps), f"{run.wall_time * 1e3:.1f} ms",
            f"{left:.1%}", run.status,
        )  # fmt: skip
    return table


def sentences(found: list[Comparison]) -> list[str]:
    """Say in words what the comparison of one shot tells."""
    reference, unit = found[0].reference, found[0].reference.scene.units
    lines = []
    for one in found:
        largest = _small(unit.from_si(one.largest, "length"))
        text = f"{_name(one.run)}: ends within {largest} {unit.length} of the exact ones"
        if one.divergence is None:
            text += ", with the same contacts."
        else:
            text += f"; they part at {one.divergence.t:.4f} s: {one.divergence.text}."
        lines.append(text)
    published = reference.shot.published if reference.shot else {}
    if published:
        lines.append(_published_sentence(reference))
    lines += [f"Warning: {warning}." for warning in reference.warnings]
    return lines


def _published_sentence(reference: Run) -> str:
    from pool_pymunk.report.listing import is_of_the_report
    from pool_pymunk.results.trace import ZERO_SLIP

    assert reference.shot is not None
    off = {
        id_: max(abs(a - b) for a, b in zip(reference.final[id_], end, strict=True))
        for id_, end in reference.shot.published.items()
    }
    farthest = max(off, key=lambda id_: off[id_])
    largest = reference.scene.units.from_si(off[farthest], "length")
    text = (
        f"Published ends: off the exact ones by up to {largest:.3f} "
        f"{reference.scene.units.length} along x or y (ball {farthest})"
    )
    if ZERO_SLIP in reference.policies and is_of_the_report(reference):
        text += "; a slip that is exactly zero got its sign from rounding there, see the warning"
    return text + "."


def _name(run: Run) -> str:
    from pool_pymunk.results.words import step_text

    return run.solver if run.dt is None else f"{run.solver} {step_text(run.dt)}"


def _small(value: float) -> str:
    return "0" if value == 0.0 else f"{value:.2g}" if value < 0.001 else f"{value:.3f}"


# -- files -----------------------------------------------------------------------------------------


def _write_ends(path: Path, found: list[Comparison]) -> None:
    from pool_pymunk.safety.files import whole

    with whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["shot", "solver", "dt", "ball", "x", "y", "distance"])
        for one in found:
            for id_, (x, y) in one.run.final.items():
                run = one.run
                rows.writerow([run.name, run.solver, run.dt, id_, x, y, one.distances[id_]])


def _draw(found: list[Comparison], folder: Path) -> None:
    from pool_pymunk.render import Show, picture

    with progress("drawing", len(found)) as bar:
        for one in found:
            run = one.run
            number = run.scene.shots.index(run.shot) + 1 if run.shot else 1
            name = f"shot-{number}-{run.solver}.png"
            picture(Show((one.reference, run)), folder / name, when="end")
            bar.update(bar.task_ids[0], advance=1)


def _write_json(path: Path, scenario: str, scene: Scene, found: list[Comparison]) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.model.scenario import label
    from pool_pymunk.safety.files import whole

    content = {
        "scenario": label(scenario),
        "title": scene.title,
        "version": __version__,
        "reference": found[0].reference.solver,
        "comparisons": [_record(one) for one in found],
    }
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _record(one: Comparison) -> dict[str, object]:
    run, parted = one.run, one.divergence
    return {
        "shot": run.name,
        "solver": {"name": run.solver, "dt": run.dt},
        "status": run.status,
        "final": {id_: list(end) for id_, end in run.final.items()},
        "distance": one.distances,
        "largest": one.largest,
        "rms": one.rms,
        "divergence": parted and {"t": parted.t, "kind": parted.kind, "text": parted.text},
        "energy": run.energy,
        "steps": run.steps,
        "wall_time": run.wall_time,
        "warnings": list(run.warnings),
    }
