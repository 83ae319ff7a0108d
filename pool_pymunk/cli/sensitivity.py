"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import place, stem, write_json
from pool_pymunk.cli.read import InputError
from pool_pymunk.safety.files import whole

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
    found: list[lib.Sensitivity] = []
    records: list[dict[str, object]] = []
    for one in shots:
        cloud = line = None
        if samples:
            with lib.terminal.progress("playing", samples) as bar:
                how = (samples, seed, threads)
                cloud = lib.sensitivity.sensitivity(scene, one, uncertainty, *how, on_done=bar.step)
            found.append(cloud)
            if len(found) == 1:
                what = uncertainty.described(scene)
                typer.echo(f"{samples:,} samples a shot with {what}; seed {seed}")
        if by_derivatives:
            line = lib.sensitivity.linear(scene, one, uncertainty, seed=seed)
        records.append(_print(cloud, line))
        _save(found, line, folder, pictures)
        write_json(json, {"shots": records}, scenario, scene)
    what = " and ".join(["pictures"] * pictures + ["data"] * bool(samples))
    if what:
        typer.echo(f"{what.capitalize()}: {folder}")
    return 1 if any(one.unfinished for one in found) else 0


def _uncertainty(
    scenario: str, scene: lib.Scene, position: str | None, speed: str, angle: float
) -> lib.uncertainty.Uncertainty:
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


def _print(found: lib.Sensitivity | None, line: lib.Linear | None) -> dict[str, object]:
    """Say what the samples, the derivatives or both tell of a shot; return what the JSON has."""
    record: dict[str, object] = {}
    tables: list[lib.terminal.TextTable] = []
    said: list[str] = []
    if found is not None:
        record, name = found.as_dict(), found.reference.name
        tables, said = [_table(found, line)], sentences(found)
    if line is not None:
        name = line.reference.name
        record = {"name": name, **record, "linear": line.as_dict()}
        tables = tables or [_line_table(line)]
        said += linear_sentences(line)
    lib.terminal.show(f"\n[bold]{name}[/bold]", *tables, *said)
    return record


def _line_table(line: lib.Linear) -> lib.terminal.TextTable:
    run = line.reference
    rows = []
    for i, (id_, end) in enumerate(run.final.items()):
        x, y = (run.scene.units.from_si(v, "length") for v in end)
        rows.append((id_, f"{x:.4f}, {y:.4f}", _both(line, i)))
    return lib.terminal.TextTable(("ball", f"end ({run.scene.units.length})", DERIVED), rows)


def _table(found: lib.Sensitivity, line: lib.Linear | None) -> lib.terminal.TextTable:
    scene = found.reference.scene
    text = f"ball|end ({scene.units.length})|holds|std of x, y|95 % off x|95 % off y|amplified"
    headings = [*text.split("|"), "apart from"]
    headings += ["pocketed"] * bool(scene.pockets) + [DERIVED] * (line is not None)
    rows = [
        _row(scene, ball) + ([] if line is None else [_both(line, i)])
        for i, ball in enumerate(found.balls)
    ]
    return lib.terminal.TextTable(headings, rows, left=("pocketed",))


def _row(scene: lib.Scene, ball: lib.Spread) -> list[str]:
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
        *[_chances(ball)] * bool(scene.pockets),
    ]


def _both(line: lib.Linear, i: int) -> str:
    """Return the standard deviations along x and y by derivatives, where they are known."""
    x, y = (line.reference.scene.units.from_si(float(v), "length") for v in line.std[i])
    return f"{x:.2g}, {y:.2g}" if math.isfinite(x) else "not known"


def linear_sentences(line: lib.Linear) -> list[str]:
    """Say in words how far the derivatives can be believed."""
    warnings = [f"Warning: {warning}." for warning in line.warnings]
    if not math.isfinite(line.holds):
        return warnings
    holds = f"within {line.holds:g} times these errors"
    if line.radius > 0.0:
        units = line.reference.scene.units
        holds += f" (starts within {units.from_si(line.radius, 'length'):.2g} {units.length})"
    return [f"The derivatives hold to a tenth {holds}.", *warnings]


def _chances(ball: lib.Spread) -> str:
    """Return how often the ball is pocketed, and where."""
    found = sorted(ball.pocketed.items(), key=lambda item: -item[1])
    return ", ".join(f"{id_} {share:.1%}" for id_, share in found) or "never"


def sentences(found: lib.Sensitivity) -> list[str]:
    """Say in words what the spread of one shot tells."""
    scene = found.reference.scene
    kept, printed = found.kept_digits
    lines = [_worst_sentence(found)]
    lines.append(f"Of the {printed} digits of the printed ends, {kept} mean anything.")
    off = f"{scene.units.from_si(found.agree, 'length'):.2g} {scene.units.length}"
    if math.isfinite(found.horizon):
        first = min(found.balls, key=lambda ball: ball.horizon).ball
        lines.append(
            f"From {found.horizon:.2f} s on, half of the runs are more than {off} off the "
            f"reference run (ball {first} first)."
        )
    else:
        lines.append(f"Half of the runs stay within {off} of the reference run.")
    lines.append(f"In {found.same:.0%} of the runs every ball has the same contacts in its order.")
    if found.rejected:
        moved = f"{found.rejected:,} balls overlapped something as drawn"
        lines.append(f"{moved}, and were moved apart.")
    if found.unfinished:
        runs = lib.words.counted(found.unfinished, "run")
        lines.append(f"{runs} could not be finished and are left out.")
    return lines + [f"Warning: {warning}." for warning in found.reference.warnings]


def _worst_sentence(found: lib.Sensitivity) -> str:
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


def _save(
    found: list[lib.Sensitivity], line: lib.Linear | None, folder: Path, pictures: bool
) -> None:
    """Write one row a shot and ball, and the last shot's samples and picture."""
    if not found and line is not None and pictures:
        lib.clouds.cloud_picture(None, folder / f"{stem(line.reference)}-linear.png", line)
    if found:
        name = stem(found[-1].reference)
        with whole(folder / "spread.csv") as part:
            lib.sensitivity.write_csv(found, part)
        with whole(folder / f"{name}.npz") as part:
            found[-1].write_npz(part)
        if pictures:
            lib.clouds.cloud_picture(found[-1], folder / f"{name}.png", line)
