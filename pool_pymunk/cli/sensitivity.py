"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pool_pymunk.cli.common import (
    InputError,
    JsonFile,
    OutDir,
    Scenario,
    ShotName,
    input_errors,
    progress,
    read_scenario,
    read_shots,
)

if TYPE_CHECKING:
    from rich.table import Table

    from pool_pymunk.model import Scene, Shot
    from pool_pymunk.results.run import Run
    from pool_pymunk.studies.sensitivity import Linear, Sensitivity, Spread
    from pool_pymunk.studies.uncertainty import Uncertainty


def sensitivity(
    scenario: Scenario,
    position_error: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Of every start; default: half its last digit."),
    ] = None,
    speed_error: Annotated[str, typer.Option(metavar="SPEED", help="Of the struck ball.")] = "0",
    angle_error: Annotated[float, typer.Option(metavar="DEGREES", help="Of its direction.")] = 0.0,
    samples: Annotated[int, typer.Option(metavar="N", help="Runs of each shot.")] = 1000,
    seed: Annotated[int, typer.Option(metavar="N", help="Of the random numbers.")] = 0,
    threads: Annotated[
        int | None,
        typer.Option("--threads", "--processes", metavar="N", help="Default: one for each core."),
    ] = None,
    shot: ShotName = None,
    json: JsonFile = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw the cloud of ends of every ball.")] = True,
    by_derivatives: Annotated[
        bool,
        typer.Option(
            "--linear",
            help="Say it by derivatives, too, and how far they hold; alone with --samples 0.",
        ),
    ] = False,
) -> int:
    """Move the starts, and on request the cue's speed and angle, a little: where may balls end?

    Errors are half the widths of uniform distributions; a length or speed may have a unit (0.1mm)
    and is in the scenario's unit without one.
    """
    scene = read_scenario(scenario)
    uncertainty = _uncertainty(scenario, scene, position_error, speed_error, angle_error)
    shots = read_shots(scene, shot)
    folder = out or Path("renders") / Path(scenario).stem / "sensitivity"
    if by_derivatives and samples == 0:
        lines_only = [_differentiate(scene, one, uncertainty, seed) for one in shots]
        return _say_lines(scenario, lines_only, folder, json, pictures)
    if samples == 0:
        raise InputError("--samples = 0: must be 2 or more, or stand beside --linear")
    found: list[Sensitivity] = []
    lines: list[Linear | None] = []
    for one in shots:
        found.append(_play(scene, one, uncertainty, (samples, seed, threads)))
        lines.append(_differentiate(scene, one, uncertainty, seed) if by_derivatives else None)
        if len(found) == 1:
            what = uncertainty.described(scene)
            typer.echo(f"{samples:,} samples a shot with {what}; seed {seed}")
        _print(found[-1], lines[-1])
        _save(found, lines[-1], folder, pictures)
        if json is not None:
            _write_json(json, scenario, scene, found, lines)
    typer.echo(f"{'Pictures and data' if pictures else 'Data'}: {folder}")
    return 1 if any(one.unfinished for one in found) else 0


def _uncertainty(
    scenario: str, scene: Scene, position: str | None, speed: str, angle: float
) -> Uncertainty:
    """Return the errors as typed; those of positions as the scenario writes them, if not typed."""
    from pool_pymunk.model.quantities import quantity
    from pool_pymunk.studies.uncertainty import Uncertainty, written_uncertainty

    with input_errors():
        faster = quantity("--speed-error", speed, "speed", scene.units)
        if position is not None:
            width = quantity("--position-error", position, "length", scene.units)
            return Uncertainty(width, faster, math.radians(angle))
        written = written_uncertainty(scenario).position
        if not isinstance(written, dict) or written.keys() != scene.index.keys():
            raise InputError(
                "--position-error = (left out): is wanted, the scenario cannot be read twice"
            )
        return Uncertainty(written, faster, math.radians(angle))


def _play(
    scene: Scene,
    shot: Shot | None,
    uncertainty: Uncertainty,
    how: tuple[int, int, int | None],
) -> Sensitivity:
    from pool_pymunk.studies.sensitivity import sensitivity

    with input_errors(), progress("playing", how[0]) as bar:

        def advance(done: int) -> None:
            bar.update(bar.task_ids[0], advance=done)

        return sensitivity(scene, shot, uncertainty, *how, on_done=advance)


def _differentiate(scene: Scene, shot: Shot | None, uncertainty: Uncertainty, seed: int) -> Linear:
    from pool_pymunk.studies.sensitivity import linear

    with input_errors():
        return linear(scene, shot, uncertainty, seed=seed)


def _say_lines(
    scenario: str, lines: list[Linear], folder: Path, json: Path | None, pictures: bool
) -> int:
    """Say at once, by derivatives alone, what the uncertainty does to the ends."""
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    for line in lines:
        run = line.reference
        unit = run.scene.units
        table = Table()
        for heading in ("ball", f"end ({unit.length})", "std by derivatives"):
            table.add_column(heading, justify="right")
        for i, (id_, end) in enumerate(run.final.items()):
            x, y = (unit.from_si(v, "length") for v in end)
            table.add_row(id_, f"{x:.4f}, {y:.4f}", _both(line, i))
        console.print(f"\n[bold]{run.name}[/bold]")
        console.print(table)
        for text in linear_sentences(line):
            console.print(text, soft_wrap=True)
        if pictures:
            from pool_pymunk.render.clouds import linear_picture

            linear_picture(line, folder / f"{_stem(run)}-linear.png")
    if json is not None:
        shots: list[dict[str, object]] = [
            {"name": line.reference.name, "linear": line.as_dict()} for line in lines
        ]
        _write_shots(json, scenario, lines[0].reference.scene, shots)
    if pictures:
        typer.echo(f"Pictures: {folder}")
    return 0


# -- the terminal ----------------------------------------------------------------------------------


def _print(found: Sensitivity, line: Linear | None) -> None:
    from rich.console import Console

    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    console.print(f"\n[bold]{found.reference.name}[/bold]")
    console.print(_table(found, line))
    for text in [*sentences(found), *([] if line is None else linear_sentences(line))]:
        console.print(text, soft_wrap=True)


def _table(found: Sensitivity, line: Linear | None) -> Table:
    from rich.table import Table

    scene = found.reference.scene
    unit = scene.units.length
    table = Table()
    headings = f"ball|end ({unit})|holds|std of x, y|95 % off x|95 % off y|amplified|apart from"
    for heading in headings.split("|"):
        table.add_column(heading, justify="right")
    if scene.pockets:
        table.add_column("pocketed")
    if line is not None:
        table.add_column("std by derivatives", justify="right")
    for i, ball in enumerate(found.balls):
        low, high, end, std = (
            tuple(scene.units.from_si(v, "length") for v in point)
            for point in (ball.low, ball.high, ball.end, ball.std)
        )
        table.add_row(
            ball.ball,
            f"{end[0]:.2f}, {end[1]:.2f}",
            ", ".join(ball.digits(scene)),
            f"{std[0]:.2g}, {std[1]:.2g}",
            *(f"{a - c:+.2g} {b - c:+.2g}" for a, b, c in zip(low, high, end, strict=True)),
            _times(ball.amplification),
            _when(ball.horizon),
            *([_chances(ball)] if scene.pockets else []),
            *([] if line is None else [_both(line, i)]),
        )
    return table


def _both(line: Linear, i: int) -> str:
    """Return the standard deviations along x and y by derivatives, where they are known."""
    x, y = (line.reference.scene.units.from_si(float(v), "length") for v in line.std[i])
    return f"{x:.2g}, {y:.2g}" if math.isfinite(x) else "not known"


def linear_sentences(line: Linear) -> list[str]:
    """Say in words how far the derivatives can be believed."""
    warnings = [f"Warning: {warning}." for warning in line.warnings]
    if not math.isfinite(line.holds):
        return warnings
    holds = f"within {line.holds:g} times these errors"
    if line.radius > 0.0:
        units = line.reference.scene.units
        holds += f" (starts within {units.from_si(line.radius, 'length'):.2g} {units.length})"
    return [f"The derivatives hold to a tenth {holds}.", *warnings]


def _chances(ball: Spread) -> str:
    """Return how often the ball is pocketed, and where."""
    found = sorted(ball.pocketed.items(), key=lambda item: -item[1])
    return ", ".join(f"{id_} {share:.1%}" for id_, share in found) or "never"


def _when(t: float) -> str:
    return f"{t:.2f} s" if math.isfinite(t) else "never"


def sentences(found: Sensitivity) -> list[str]:
    """Say in words what the spread of one shot tells."""
    from pool_pymunk.results.words import counted

    scene = found.reference.scene
    unit = scene.units.length
    agree = scene.units.from_si(found.agree, "length")
    kept, printed = found.kept_digits
    lines = [_worst_sentence(found)]
    lines.append(f"Of the {printed} digits of the printed ends, {kept} mean anything.")
    if math.isfinite(found.horizon):
        first = min(found.balls, key=lambda ball: ball.horizon).ball
        lines.append(
            f"From {found.horizon:.2f} s on, half of the runs are more than {agree:.2g} {unit} off "
            f"the unperturbed one (ball {first} first)."
        )
    else:
        lines.append(f"Half of the runs stay within {agree:.2g} {unit} of the unperturbed one.")
    lines.append(f"In {found.same:.0%} of the runs every ball has the same contacts in its order.")
    if found.rejected:
        lines.append(
            f"{found.rejected:,} balls overlapped something as drawn, and were moved apart."
        )
    if found.unfinished:
        lines.append(f"{counted(found.unfinished, 'run')} could not be finished and are left out.")
    return lines + [f"Warning: {warning}." for warning in found.reference.warnings]


def _worst_sentence(found: Sensitivity) -> str:
    scene, worst = found.reference.scene, found.worst
    unit = scene.units.length
    std = scene.units.from_si(worst.deviation, "length")
    x0, y0, x1, y1 = (
        scene.units.from_si(v, "length") for point in (worst.low, worst.high) for v in point
    )
    text = f"Ball {worst.ball} spreads most: its end has a standard deviation of {std:.2g} {unit}"
    if worst.amplification is not None:
        text += f", {_times(worst.amplification)} that of the starts"
    return (
        f"{text}; 95 % of its ends lie between {x0:.2f} and {x1:.2f} {unit} along x and between "
        f"{y0:.2f} and {y1:.2f} {unit} along y."
    )


def _times(factor: float | None) -> str:
    return "" if factor is None else f"{factor:.0f} x" if factor >= 9.95 else f"{factor:.1f} x"


# -- files -----------------------------------------------------------------------------------------


def _save(found: list[Sensitivity], line: Linear | None, folder: Path, pictures: bool) -> None:
    """Write one row a shot and ball, and the last shot's samples and picture."""
    from pool_pymunk.safety.files import whole
    from pool_pymunk.studies.sensitivity import write_csv

    with whole(folder / "spread.csv") as part:
        write_csv(found, part)
    stem = _stem(found[-1].reference)
    with whole(folder / f"{stem}.npz") as part:
        found[-1].write_npz(part)
    if pictures:
        from pool_pymunk.render.clouds import cloud_picture

        cloud_picture(found[-1], folder / f"{stem}.png", line)


def _stem(run: Run) -> str:
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"


def _write_json(
    path: Path,
    scenario: str,
    scene: Scene,
    found: list[Sensitivity],
    lines: list[Linear | None],
) -> None:
    shots = [
        one.as_dict() | ({} if line is None else {"linear": line.as_dict()})
        for one, line in zip(found, lines, strict=True)
    ]
    _write_shots(path, scenario, scene, shots)


def _write_shots(path: Path, scenario: str, scene: Scene, shots: list[dict[str, object]]) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.model.scenario import label
    from pool_pymunk.safety.files import whole

    content = {
        "scenario": label(scenario),
        "title": scene.title,
        "version": __version__,
        "shots": shots,
    }
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
