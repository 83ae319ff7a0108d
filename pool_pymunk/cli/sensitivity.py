"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import place, stem, write_json
from pool_pymunk.safety.files import whole


def sensitivity(
    scenario: opt.Scenario,
    position_error: Annotated[
        str | None, opt.option("Of every start; default: half its last digit.", "LENGTH")
    ] = None,
    speed_error: Annotated[str, opt.option("Of the struck ball.", "SPEED")] = "0",
    angle_error: Annotated[str, opt.option("Of its direction.", "DEGREES")] = "0",
    samples: Annotated[int, opt.option("Runs of each shot.", "N")] = 1000,
    seed: Annotated[int, opt.option("Of the random numbers.", "N")] = 0,
    threads: Annotated[
        int | None, opt.option("Default: one for each core.", "N", "--threads", "--processes")
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
        raise read.InputError("--samples = 0: must be 2 or more, or stand beside --linear")
    found: list[lib.Sensitivity] = []
    records: list[dict[str, object]] = []
    for one in shots:
        cloud = line = None
        if samples:
            with lib.terminal.progress("playing", samples) as bar:
                how = (samples, seed, threads)
                cloud = lib.sensitivity.sensitivity(scene, one, uncertainty, *how, on_done=bar.step)
            if not found:
                what = uncertainty.described(scene)
                typer.echo(f"{samples:,} samples a shot with {what}; seed {seed}")
            found.append(cloud)
        if by_derivatives:
            line = lib.sensitivity.linear(scene, one, uncertainty, seed=seed)
        records.append(_print(cloud, line))
        _save(found, line, folder, pictures)
        write_json(json, {"shots": records}, scenario, scene.title)
    what = " and ".join(["pictures"] * pictures + ["data"] * bool(samples))
    if what:
        typer.echo(f"{what.capitalize()}: {folder}")
    return 1 if any(one.unfinished for one in found) else 0


def _uncertainty(
    scenario: str, scene: lib.Scene, position: str | None, speed: str, angle: str
) -> lib.uncertainty.Uncertainty:
    """Return the errors as typed; those of positions as the scenario writes them, if not typed."""
    faster = lib.quantities.quantity("--speed-error", speed, "speed", scene.units)
    width: float | Mapping[str, lib.Point]
    if position is not None:
        width = lib.quantities.quantity("--position-error", position, "length", scene.units)
    else:
        width = lib.uncertainty.written_uncertainty(scenario).position
        if not isinstance(width, dict) or width.keys() != scene.index.keys():
            missing = "is missing, the scenario cannot be read twice"
            raise read.InputError(f"--position-error = (left out): {missing}")
    turned = math.radians(read.degrees("--angle-error", angle))
    return lib.uncertainty.Uncertainty(width, faster, turned)


def _print(found: lib.Sensitivity | None, line: lib.Linear | None) -> dict[str, object]:
    """Say what the samples, the derivatives or both tell of a shot; return what the JSON has."""
    record: dict[str, object] = {}
    said: list[str] = []
    if found is not None:
        run, record, said = found.reference, found.as_dict(), sentences(found)
    if line is not None:
        run = line.reference
        record = {"name": run.name, **record, "linear": line.as_dict()}
        said += linear_sentences(line)
    lib.terminal.show(f"\n[bold]{run.name}[/bold]", _table(run, found, line), *said)
    return record


def _table(
    run: lib.Run, found: lib.Sensitivity | None, line: lib.Linear | None
) -> lib.terminal.TextTable:
    """Return a table of the ends, with what samples and derivatives say of them."""
    units, headings = run.scene.units, ["ball", f"end ({run.scene.units.length})"]
    if found is None:
        rows = [[id_, _pair(units, end, ".4f")] for id_, end in run.final.items()]
    else:
        headings += ["holds", "std of x, y", "95 % off x", "95 % off y", "amplified", "apart from"]
        headings += ["pocketed"] * bool(run.scene.pockets)
        rows = [_row(run.scene, ball) for ball in found.balls]
    if line is not None:
        headings.append("std by derivatives")
        for row, std in zip(rows, line.std, strict=False):
            row.append(_pair(units, std, ".2g") if math.isfinite(std[0]) else "not known")
    return lib.terminal.TextTable(headings, rows, left=("pocketed",))


def _row(scene: lib.Scene, ball: lib.sensitivity.Spread) -> list[str]:
    sides = (
        " ".join(f"{scene.units.from_si(a - c, 'length'):+.2g}" for a in (low, high))
        for low, high, c in zip(ball.low, ball.high, ball.end, strict=True)
    )
    pockets = sorted(ball.pocketed.items(), key=lambda item: -item[1])
    return [
        ball.ball,
        _pair(scene.units, ball.end, ".2f"),
        ", ".join(ball.digits(scene)),
        _pair(scene.units, ball.std, ".2g"),
        *sides,
        _times(ball.amplification),
        f"{ball.horizon:.2f} s" if math.isfinite(ball.horizon) else "never",
        *[", ".join(f"{id_} {share:.1%}" for id_, share in pockets) or "never"]
        * bool(scene.pockets),
    ]


def _pair(units: lib.Units, point: Iterable[float], form: str) -> str:
    """Return lengths along x and y in the scene's unit."""
    return ", ".join(f"{units.from_si(float(v), 'length'):{form}}" for v in point)


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


def sentences(found: lib.Sensitivity) -> list[str]:
    """Say in words what the spread of one shot tells."""
    units = found.reference.scene.units
    kept, printed = found.kept_digits
    off = f"{units.from_si(found.agree, 'length'):.2g} {units.length}"
    parted = f"Half of the runs stay within {off} of the reference run."
    if math.isfinite(found.horizon):
        first = min(found.balls, key=lambda ball: ball.horizon).ball
        parted = (
            f"From {found.horizon:.2f} s on, half of the runs are more than {off} off the "
            f"reference run (ball {first} first)."
        )
    lines = [
        _worst_sentence(found),
        f"Of the {printed} digits of the printed ends, {kept} mean anything.",
        parted,
        f"In {found.same:.0%} of the runs every ball has the same contacts in its order.",
    ]
    if found.rejected:
        moved = f"{found.rejected:,} balls overlapped something as drawn"
        lines.append(f"{moved}, and were moved apart.")
    if found.unfinished:
        runs = lib.words.counted(found.unfinished, "run")
        lines.append(f"{runs} could not be finished and are left out.")
    return lines + [f"Warning: {warning}." for warning in found.reference.warnings]


def _worst_sentence(found: lib.Sensitivity) -> str:
    worst, units = found.worst, found.reference.scene.units
    std, unit = units.from_si(worst.deviation, "length"), units.length
    x0, y0, x1, y1 = (units.from_si(v, "length") for v in (*worst.low, *worst.high))
    text = f"Ball {worst.ball} spreads most: its end has a standard deviation of {std:.2g} {unit}"
    if worst.amplification is not None:
        text += f", {_times(worst.amplification)} that of the starts"
    return (
        f"{text}; 95 % of its ends lie between {x0:.2f} and {x1:.2f} {unit} along x and between "
        f"{y0:.2f} and {y1:.2f} {unit} along y."
    )


def _times(factor: float | None) -> str:
    return "" if factor is None else f"{factor:.0f} x" if factor >= 9.95 else f"{factor:.1f} x"


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
