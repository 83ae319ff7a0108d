"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import Widths, place, position_errors, say, stem, write_json
from pool_pymunk.cli.workers import players
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    Alone = Mapping[str, lib.Sensitivity]  # by the cause that acts alone

AIMED_ONCE = "Shots that aim at a ball are aimed once, in the scenario as it is (see --aim-anew)."
AIMED_ANEW = "Shots that aim at a ball are aimed anew in each sample."
NONE_ALONE: Alone = {}
HALF = "Each ± is half the width of a uniform distribution; what follows are standard deviations."


def sensitivity(
    scenario: opt.Scenario,
    position_error: opt.PositionError = None,
    speed_error: Annotated[str, opt.option("Half-width of the shot's speed.", "SPEED")] = "0",
    angle_error: Annotated[str, opt.option("Half-width of the shot's angle.", "DEGREES")] = "0",
    samples: Annotated[int, opt.option("Runs of each shot.", "N")] = 1000,
    seed: Annotated[int, opt.option("Seed of random numbers.", "N", for_experts=True)] = 0,
    workers: Annotated[
        int | None,
        opt.option(
            "Processes; default: one per core.", "N", "--workers", "--threads", "--processes",
            for_experts=True,
        ),
    ] = None,
    cluster: opt.Cluster = None,
    shot: opt.ShotName = None,
    aims_anew: opt.AimAnew = False,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
    pictures: Annotated[bool, opt.option("Draw the cloud of ends of every ball.")] = True,
    by_derivatives: Annotated[
        bool,
        opt.option(
            "Also use derivatives, and say how far they hold; --samples 0: only these.",
            None, "--linear",
        ),
    ] = False,
) -> int:  # fmt: skip
    """Where may balls end if starts, and on request speed and angle, are uncertain?

    An error is typed as half the width of a uniform distribution; the ends are printed with their
    standard deviations. A length or speed may have a unit (0.1mm); without one it is in that of the
    scenario. Where several inputs are uncertain, each is also varied alone.
    """
    scene = lib.scenario.load(scenario)
    position, known_by = position_errors(scenario, scene, position_error)
    uncertainty = _uncertainty(scene, position, speed_error, angle_error)
    shots = read.shots(scene, shot)
    folder = place(out, scenario, "sensitivity")
    if samples == 0 and not by_derivatives:
        raise read.InputError("--samples = 0: must be 2 or more, or stand beside --linear")
    found: list[lib.Sensitivity] = []
    records: list[dict[str, object]] = []
    parts = 1 + len(uncertainty.causes(scene))  # all causes together, and each alone
    runs = len(shots) * samples * (parts if parts > 2 else 1)
    how: Any = {"seed": seed, "aims_anew": aims_anew}
    aimed = (AIMED_ANEW if aims_anew else AIMED_ONCE) * any(one.aim for one in shots if one)
    most = runs or len(shots)
    with players(workers, cluster) as (asked, _), lib.terminal.Bar("playing", most) as bar:
        for one in shots:
            cloud, line, alone = None, None, NONE_ALONE
            if samples:
                cloud = lib.sensitivity.sensitivity(
                    scene, one, uncertainty, samples, workers=asked, on_done=bar.step, **how
                )
                alone = lib.sensitivity.by_causes(cloud, asked, on_done=bar.step)
                found.append(cloud)
            if by_derivatives:
                line = lib.sensitivity.linear(scene, one, uncertainty, **how)
                bar.step(0 if samples else 1)
            if not records:
                what = uncertainty.described(scene)
                played = f"{samples:,} samples a shot with {what}; seed {seed}"
                first = played if samples else f"By derivatives, with {what}"
                say(filter(None, (first, HALF, aimed, known_by)))
            records.append(_print(cloud, line, alone))
            _save(found, line, folder, pictures)
            write_json(json, {"known_by": known_by, "shots": records}, scenario, scene.title)
    what = " and ".join(["pictures"] * pictures + ["data"] * bool(samples))
    if what:
        typer.echo(f"{what.capitalize()}: {folder}")
    return 1 if any(one.unfinished for one in found) else 0


def _uncertainty(
    scene: lib.Scene, position: Widths, speed: str, angle: str
) -> lib.uncertainty.Uncertainty:
    """Return the errors of positions (m), and those of speed and angle as typed."""
    quantity, units = lib.quantities.quantity, scene.units
    faster = quantity("--speed-error", speed, "speed", units, 0.0)
    turned = math.radians(quantity("--angle-error", angle, "angle", units, 0.0))
    return lib.uncertainty.Uncertainty(position, faster, turned)


def _print(
    found: lib.Sensitivity | None, line: lib.Linear | None, alone: Alone
) -> dict[str, object]:
    """Say what samples, derivatives or both tell of a shot; return its record for the JSON."""
    record: dict[str, object] = {}
    said: list[str] = []
    if found is not None:
        run, said = found.reference, sentences(found, alone)
        record = {**found.as_dict(), "causes": {
            cause: {ball.ball: {"std": ball.std, "amplification": ball.amplification}
                    for ball in each.balls}
            for cause, each in alone.items()
        }}  # fmt: skip
    if line is not None:
        run = line.reference
        record = {"name": run.name, **record, "linear": line.as_dict()}
        said += linear_sentences(line)
    tables = [] if found is None else [_ends(found)]
    if found is not None and line is not None and len(alone) > 1:  # They need two tables.
        tables.append(_spreads(run, found, None, alone))
        found = None
    tables.append(_spreads(run, found, line, alone))
    lib.terminal.show(f"\n[bold]{run.name}[/bold]\n", *tables, *said)
    return record


def _ends(found: lib.Sensitivity) -> lib.table.ResultTable:
    """Return a table of the ends: which digits hold, and where the samples end."""
    scene, units = found.reference.scene, found.reference.scene.units
    columns: dict[lib.TableColumn | str, list[str]] = {
        "ball": [ball.ball for ball in found.balls],
        lib.table.TableColumn("end", unit=units.length): _pairs(
            units, found.reference.final.values(), ".2f"
        ),
        "holds": [", ".join(ball.digits(scene)) for ball in found.balls],
    }
    for k, axis in enumerate("xy"):
        sides = [(b.low[k] - b.end[k], b.high[k] - b.end[k]) for b in found.balls]
        columns[f"95 % off {axis}"] = _pairs(units, sides, sign="+")
    if scene.pockets:
        columns[lib.table.TableColumn("pocketed", left=True)] = [
            ", ".join(f"{id_} {share:.1%}" for id_, share in
                      sorted(ball.pocketed.items(), key=lambda item: -item[1])) or "never"
            for ball in found.balls
        ]  # fmt: skip
    return lib.table.ResultTable.of(columns)


def _spreads(
    run: lib.Run, found: lib.Sensitivity | None, line: lib.Linear | None, alone: Alone
) -> lib.table.ResultTable:
    """Return a table of the ends' standard deviations, in all and by each cause alone."""
    units = run.scene.units
    columns: dict[lib.TableColumn | str, list[str]] = {}
    if found is None:
        end = lib.table.TableColumn("end", unit=units.length)
        columns[end] = _pairs(units, run.final.values(), ".4f")
    else:
        columns["std of x, y"] = _pairs(units, [ball.std for ball in found.balls])
        for cause, each in alone.items() if len(alone) > 1 else ():
            columns[f"by {cause}"] = _pairs(units, [[ball.deviation] for ball in each.balls])
        if starts := alone.get("starts"):
            columns["amplified"] = [f"{ball.amplification:.1f} x" for ball in starts.balls]
        columns["apart from"] = [
            f"{ball.horizon:.2f} s" if math.isfinite(ball.horizon) else "never"
            for ball in found.balls
        ]
    if line is not None:
        spreads = {"std by derivatives": line.std}
        causes = {} if found or len(line.by_causes()) < 2 else line.by_causes()
        spreads |= {f"by {cause}": std.max(axis=1, keepdims=True) for cause, std in causes.items()}
        for heading, stds in spreads.items():
            columns[heading] = _pairs(units, stds)
    return lib.table.ResultTable.of({"ball": run.final, **columns})


def _pairs(
    units: lib.Units, points: Iterable[Iterable[float]], form: str = "", sign: str = ""
) -> list[str]:
    """Return lengths along x and y in the scene's unit: in this form, or all in one notation."""
    rows = [[units.from_si(float(v), "length") for v in point] for point in points]
    values = [v for row in rows for v in row]
    texts = iter([f"{v:{form}}" for v in values] if form else lib.table.alike(values, sign=sign))
    return [", ".join(next(texts) or "not known" for _ in row) for row in rows]


def _length(units: lib.Units, value: float) -> str:
    return f"{units.from_si(value, 'length'):.2g} {units.length}"


def linear_sentences(line: lib.Linear) -> list[str]:
    """Say in words for which errors the derivatives hold."""
    warnings = [f"Warning: {warning}." for warning in line.warnings]
    if not math.isfinite(line.holds):
        return warnings
    holds = f"within {line.holds:g} times these errors"
    if line.radius > 0.0:
        holds += f" (starts within {_length(line.reference.scene.units, line.radius)})"
    return [f"The derivatives hold to a tenth {holds}.", *warnings]


def sentences(found: lib.Sensitivity, alone: Alone) -> list[str]:
    """Say in words how far the ends of one shot spread, in all and by each cause alone."""
    units = found.reference.scene.units
    kept, printed = found.kept_digits
    off = _length(units, found.agree)
    parted = f"Half of the runs stay within {off} of the reference run."
    if math.isfinite(found.horizon):
        first = min(found.balls, key=lambda ball: ball.horizon).ball
        parted = (
            f"From {found.horizon:.2f} s on, half of the runs are more than {off} off the "
            f"reference run (ball {first} first)."
        )
    lines = [
        *_worst_sentences(found, alone),
        f"Of the {printed} digits of the printed ends, {kept} {'means' if kept == 1 else 'mean'} "
        "anything.",
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


def _worst_sentences(found: lib.Sensitivity, alone: Alone) -> Iterator[str]:
    """Say which ball spreads most, how far by each cause alone, and what ``amplified`` means."""
    worst, units = found.worst, found.reference.scene.units
    x0, y0, x1, y1 = (units.from_si(v, "length") for v in (*worst.low, *worst.high))
    ratio = ""
    if times := worst.amplification:
        form = ".1f" if times < 9.95 else ".0f"
        ratio = f", {times:{form}} x that of the starts"
    yield (
        f"Ball {worst.ball} spreads most: its end has a standard deviation of "
        f"{_length(units, worst.deviation)}{ratio}; 95 % of its ends lie between {x0:.2f} and "
        f"{x1:.2f} {units.length} along x and between {y0:.2f} and {y1:.2f} {units.length} along y."
    )
    if len(alone) > 1:
        its = found.balls.index(worst)
        deviations = {name: each.balls[its].deviation for name, each in alone.items()}
        said = ", ".join(f"{name} {_length(units, std)}" for name, std in deviations.items())
        yield f"Its standard deviation by each cause alone: {said}."
    if "starts" in alone:
        starts = _length(units, found.deviation_of_starts)
        yield f"Amplified: deviation by the starts alone, divided by that of the starts ({starts})."


def _save(
    found: list[lib.Sensitivity], line: lib.Linear | None, folder: Path, pictures: bool
) -> None:
    """Write one row a shot and ball, and the last shot's samples and picture."""
    if not found and line is not None and pictures:
        lib.clouds.cloud_picture(None, folder / f"{stem(line.reference)}-linear.png", line)
    if found:
        name = stem(found[-1].reference)
        with whole(folder / "spread.csv") as part:
            lib.sensitivity.table(found).csv(part)
        with whole(folder / f"{name}.npz") as part:
            found[-1].write_npz(part)
        if pictures:
            lib.clouds.cloud_picture(found[-1], folder / f"{name}.png", line)
