"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import about, place, stem, write_json
from pool_pymunk.cli.read import InputError
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    from rich.table import Table

    from pool_pymunk.model import Scene
    from pool_pymunk.studies.sensitivity import Linear, Sensitivity, Spread
    from pool_pymunk.studies.uncertainty import Uncertainty

DERIVED = "std by derivatives"


def sensitivity(
    scenario: opt.Scenario,
    position_error: Annotated[
        str | None, opt.option("Of every start; default: half its last digit.", "LENGTH")
    ] = None,
    speed_error: Annotated[str, opt.option("Of the struck ball.", "SPEED")] = "0",
    angle_error: Annotated[float, opt.option("Of its direction.", "DEGREES")] = 0.0,
    samples: Annotated[int, opt.option("Runs of each shot.", "N")] = 1000,
    seed: Annotated[int, opt.option("Of the random numbers.", "N")] = 0,
    threads: Annotated[
        int | None,
        opt.option("Default: one for each core.", "N", "--threads", "--processes"),
    ] = None,
    shot: opt.ShotName = None,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
    pictures: Annotated[bool, opt.option("Draw the cloud of ends of every ball.")] = True,
    by_derivatives: Annotated[
        bool,
        opt.option(
            "Say it by derivatives, too, and how far they hold; alone with --samples 0.",
            None, "--linear",
        ),
    ] = False,
) -> int:  # fmt: skip
    """Move the starts, and on request the cue's speed and angle, a little: where may balls end?

    Errors are half the widths of uniform distributions; a length or speed may have a unit (0.1mm)
    and is in the scenario's unit without one.
    """
    scene = lib.scenario.load(scenario)
    uncertainty = _uncertainty(scenario, scene, position_error, speed_error, angle_error)
    shots = read.shots(scene, shot)
    folder = place(out, scenario, "sensitivity")
    if samples == 0 and not by_derivatives:
        raise InputError("--samples = 0: must be 2 or more, or stand beside --linear")
    found: list[Sensitivity] = []
    records: list[dict[str, object]] = []
    for one in shots:
        if samples:
            with lib.terminal.progress("playing", samples) as bar:
                how = (samples, seed, threads)
                played = lib.sensitivity.sensitivity(
                    scene, one, uncertainty, *how, on_done=bar.step
                )
            found.append(played)
            if len(found) == 1:
                what = uncertainty.described(scene)
                typer.echo(f"{samples:,} samples a shot with {what}; seed {seed}")
        line = (
            lib.sensitivity.linear(scene, one, uncertainty, seed=seed) if by_derivatives else None
        )
        if samples:
            _print(found[-1], line)
            _save(found, line, folder, pictures)
            records.append(found[-1].as_dict())
        elif line is not None:
            _print_line(line)
            records.append({"name": line.reference.name})
            if pictures:
                file = folder / f"{stem(line.reference)}-linear.png"
                lib.clouds.linear_picture(line, file)
        if line is not None:
            records[-1]["linear"] = line.as_dict()
        write_json(json, about(scenario, scene), {"shots": records})
    what = " and ".join(["pictures"] * pictures + ["data"] * bool(samples))
    if what:
        typer.echo(f"{what.capitalize()}: {folder}")
    return 1 if any(one.unfinished for one in found) else 0


def _uncertainty(
    scenario: str, scene: Scene, position: str | None, speed: str, angle: float
) -> Uncertainty:
    """Return the errors as typed; those of positions as the scenario writes them, if not typed."""
    faster = lib.quantities.quantity("--speed-error", speed, "speed", scene.units)
    if position is not None:
        width = lib.quantities.quantity("--position-error", position, "length", scene.units)
        return lib.uncertainty.Uncertainty(width, faster, math.radians(angle))
    written = lib.uncertainty.written_uncertainty(scenario).position
    if not isinstance(written, dict) or written.keys() != scene.index.keys():
        raise InputError(
            "--position-error = (left out): is missing, the scenario cannot be read twice"
        )
    return lib.uncertainty.Uncertainty(written, faster, math.radians(angle))


# -- the terminal ----------------------------------------------------------------------------------


def _print_line(line: Linear) -> None:
    """Say at once, by derivatives alone, what the uncertainty does to the ends."""
    run = line.reference
    headings = ("ball", f"end ({run.scene.units.length})", DERIVED)
    rows = []
    for i, (id_, end) in enumerate(run.final.items()):
        x, y = (run.scene.units.from_si(v, "length") for v in end)
        rows.append((id_, f"{x:.4f}, {y:.4f}", _both(line, i)))
    table = lib.terminal.table(headings, rows)
    lib.terminal.show(f"\n[bold]{run.name}[/bold]", table, *linear_sentences(line))


def _print(found: Sensitivity, line: Linear | None) -> None:
    more = [] if line is None else linear_sentences(line)
    heading = f"\n[bold]{found.reference.name}[/bold]"
    lib.terminal.show(heading, _table(found, line), *sentences(found), *more)


def _table(found: Sensitivity, line: Linear | None) -> Table:
    scene = found.reference.scene
    text = f"ball|end ({scene.units.length})|holds|std of x, y|95 % off x|95 % off y|amplified"
    headings = [*text.split("|"), "apart from"]
    headings += ["pocketed"] * bool(scene.pockets) + [DERIVED] * (line is not None)
    rows = [_row(scene, ball) for ball in found.balls]
    if line is not None:
        rows = [[*row, _both(line, i)] for i, row in enumerate(rows)]
    return lib.terminal.table(headings, rows, left=("pocketed",))


def _row(scene: Scene, ball: Spread) -> list[str]:
    low, high, end, std = (
        tuple(scene.units.from_si(v, "length") for v in point)
        for point in (ball.low, ball.high, ball.end, ball.std)
    )
    return [
        ball.ball,
        f"{end[0]:.2f}, {end[1]:.2f}",
        ", ".join(ball.digits(scene)),
        f"{std[0]:.2g}, {std[1]:.2g}",
        *(f"{a - c:+.2g} {b - c:+.2g}" for a, b, c in zip(low, high, end, strict=True)),
        _times(ball.amplification),
        f"{ball.horizon:.2f} s" if math.isfinite(ball.horizon) else "never",
        *([_chances(ball)] if scene.pockets else []),
    ]


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


def sentences(found: Sensitivity) -> list[str]:
    """Say in words what the spread of one shot tells."""
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
        lines.append(
            f"{lib.words.counted(found.unfinished, 'run')} could not be finished and are left out."
        )
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
    with whole(folder / "spread.csv") as part:
        lib.sensitivity.write_csv(found, part)
    name = stem(found[-1].reference)
    with whole(folder / f"{name}.npz") as part:
        found[-1].write_npz(part)
    if pictures:
        lib.clouds.cloud_picture(found[-1], folder / f"{name}.png", line)
