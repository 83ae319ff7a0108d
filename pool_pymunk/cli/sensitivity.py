"""This command shows what the uncertainty of the inputs does to the ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pool_pymunk.cli import read, runs
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import SensitivityOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.terminal import Bar, heading
from pool_pymunk.model import Scene, Shot, Units, scenario
from pool_pymunk.model.quantities import quantity
from pool_pymunk.results.run import Run
from pool_pymunk.results.table import NO_BREAK, ResultTable, TableColumn, alike
from pool_pymunk.results.words import counted
from pool_pymunk.studies import sensitivity as study
from pool_pymunk.studies.sensitivity import Linear, Sensitivity
from pool_pymunk.studies.uncertainty import Uncertainty

AIMED_ONCE = "Shots that aim at a ball are aimed once, in the scenario as it is (see --aim-anew)."
AIMED_ANEW = "Shots that aim at a ball are aimed anew in each sample."
HALF = "Each ± is half the width of a uniform distribution; what follows are standard deviations."


def sensitivity(asked: SensitivityOptions) -> int:
    """Show what uncertain inputs do to the ends of each shot."""
    scene, samples = scenario.load(asked.scenario), asked.samples
    position, known_by = read.position_errors(asked, asked.scenario, scene)
    faster = quantity("--speed-error", asked.speed_error, "speed", scene.units, 0.0)
    turned = quantity("--angle-error", asked.angle_error, "angle", scene.units, 0.0)
    others = read.widths("--input-error", asked.input_error, scene.units)
    errors = Uncertainty(position, faster, math.radians(turned), others)
    shots = read.shots(scene, asked.shot)
    folder = read.folder(asked.out, asked.scenario, "sensitivity")
    if samples == 0 and not asked.by_derivatives:
        raise InputError("--samples = 0: must be 2 or more, or stand beside --linear")
    parts = 1 + len(errors.causes(scene))  # all causes together, and each alone
    count = len(shots) * (samples * (parts if parts > 2 else 1) or 1)
    kinds = " and ".join(["pictures"] * asked.pictures + ["data"] * bool(samples)).capitalize()
    found = list[ShotSpread]()
    with (
        read.players(asked) as workers,
        Output(folder, kinds, asked.json, (asked.scenario, scene.title)) as put,
        Bar("playing", count) as bar,
    ):
        put.at_end(_results(found, known_by))
        for shot in shots:
            found.append(_spread(asked, scene, shot, errors, workers, bar))
            if len(found) == 1:
                put(filter(None, (*_opening(asked, scene, shots, errors), known_by)))
            put(_report(found, asked.pictures))
    return 1 if any(each.cloud and each.cloud.unfinished for each in found) else 0


def _opening(
    asked: SensitivityOptions, scene: Scene, shots: Sequence[Shot | None], errors: Uncertainty
) -> Iterator[str]:
    """Say what is drawn, and how the shots are aimed."""
    what = errors.described(scene)
    drawn = f"{asked.samples:,} samples a shot with {what}; seed {asked.seed}"
    yield drawn if asked.samples else f"By derivatives, with {what}"
    yield HALF
    if any(one.aim for one in shots if one):
        yield AIMED_ANEW if asked.aims_anew else AIMED_ONCE


def _spread(
    asked: SensitivityOptions, scene: Scene, shot: Shot | None, errors: Uncertainty, workers: Any,
    bar: Bar,
) -> ShotSpread:  # fmt: skip
    """Play the samples of a shot, follow small changes, or both."""
    one = ShotSpread()
    how: Any = {"seed": asked.seed, "aims_anew": asked.aims_anew}
    if asked.samples:
        one.cloud = study.sensitivity(
            scene, shot, errors, asked.samples, workers=workers, on_done=bar.step, **how
        )
        one.alone = study.by_causes(one.cloud, workers, on_done=bar.step)
    if asked.by_derivatives:
        one.line = study.linear(scene, shot, errors, **how)
        bar.step(0 if asked.samples else 1)
    return one


@dataclass
class ShotSpread:
    """This is what samples, derivatives or both tell of a shot; ``alone`` has single causes."""

    cloud: Sensitivity | None = None
    line: Linear | None = None
    alone: Mapping[str, Sensitivity] = field(default_factory=dict)

    @property
    def run(self) -> Run:
        """Return the run of the shot as it is."""
        return (self.cloud or self.line).reference  # type: ignore[union-attr]  # One is there.

    def as_dict(self) -> dict[str, object]:
        """Return what stands in the JSON."""
        found: dict[str, object] = {"name": self.run.name}
        if self.cloud is not None:
            found |= {**self.cloud.as_dict(), "causes": {
                cause: {ball.ball: {"std": ball.std, "amplification": ball.amplification}
                        for ball in each.balls}
                for cause, each in self.alone.items()
            }}  # fmt: skip
        return found | ({} if self.line is None else {"linear": self.line.as_dict()})


def _report(found: list[ShotSpread], pictures: bool) -> Report:
    """Yield the tables of the latest shot and what they say, its samples, and its picture."""
    last = found[-1]
    run, cloud, line, alone = last.run, last.cloud, last.line, last.alone
    yield heading(f"{run.name}\n")
    if cloud is not None:
        yield _ends(cloud)
    if cloud is not None and line is not None and len(alone) > 1:  # They need two tables.
        yield _spreads(run, cloud, None, alone)
        yield _spreads(run, None, line, alone)
    else:
        yield _spreads(run, cloud, line, alone)
    yield from sentences(cloud, alone) if cloud else ()
    yield from linear_sentences(line) if line else ()
    clouds, name = [one.cloud for one in found if one.cloud], runs.stem(run)
    if cloud is not None:
        yield File("spread.csv", study.table(clouds).csv)
        yield File(f"{name}.npz", cloud.write_npz)
    if pictures:
        from pool_pymunk.render.clouds import cloud_picture  # Only who draws waits for it.

        drawn = f"{name}.png" if cloud else f"{name}-linear.png"
        yield File(drawn, lambda path: cloud_picture(cloud, path, line))


def _results(found: list[ShotSpread], known_by: str) -> Report:
    """Yield what stands in the JSON, if a shot was played."""
    if found:
        yield {"known_by": known_by, "shots": [one.as_dict() for one in found]}


def _ends(found: Sensitivity) -> ResultTable:
    """Return a table of the ends: which digits hold, and where the samples end."""
    scene, units = found.reference.scene, found.reference.scene.units
    columns: dict[TableColumn | str, list[str]] = {
        "ball": [ball.ball for ball in found.balls],
        TableColumn("end", unit=units.length): _pairs(units, found.reference.final.values(), ".2f"),
        "holds": [", ".join(ball.digits(scene)) for ball in found.balls],
    }
    for k, axis in enumerate("xy"):
        sides = [(b.low[k] - b.end[k], b.high[k] - b.end[k]) for b in found.balls]
        columns[f"95 % off {axis}"] = _pairs(units, sides, sign="+")
    if scene.pockets:
        columns[TableColumn("pocketed", left=True)] = [
            ", ".join(f"{id_} {share:.1%}" for id_, share in
                      sorted(ball.pocketed.items(), key=lambda item: -item[1])) or "never"
            for ball in found.balls
        ]  # fmt: skip
    return ResultTable.of(columns)


def _spreads(
    run: Run, found: Sensitivity | None, line: Linear | None, alone: Mapping[str, Sensitivity]
) -> ResultTable:
    """Return a table of the ends' standard deviations, in all and by each cause alone.

    Its headings stay in one line: where they are too wide, there are several tables.
    """
    units = run.scene.units
    columns: dict[TableColumn | str, list[str]] = {}
    if found is None:
        end = TableColumn("end", unit=units.length)
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
    whole = {
        TableColumn(key, key.replace(" ", NO_BREAK)) if isinstance(key, str) else key: cells
        for key, cells in columns.items()
    }
    return ResultTable.of({"ball": run.final, **whole})


def _pairs(
    units: Units, points: Iterable[Iterable[float]], form: str = "", sign: str = ""
) -> list[str]:
    """Return lengths along x and y in the scene's unit: in this form, or all in one notation."""
    rows = [[units.from_si(float(v), "length") for v in point] for point in points]
    values = [v for row in rows for v in row]
    texts = iter([f"{v:{form}}" for v in values] if form else alike(values, sign=sign))
    return [", ".join(next(texts) or "not known" for _ in row) for row in rows]


def linear_sentences(line: Linear) -> list[str]:
    """Say in words for which errors the derivatives hold."""
    warnings = [f"Warning: {warning}." for warning in line.warnings]
    if not math.isfinite(line.holds):
        return warnings
    holds = f"within {line.holds:g} times these errors"
    if line.radius > 0.0:
        holds += f" (starts within {line.reference.scene.units.text(line.radius)})"
    return [f"The derivatives hold to a tenth {holds}.", *warnings]


def sentences(found: Sensitivity, alone: Mapping[str, Sensitivity]) -> list[str]:
    """Say in words how far the ends of one shot spread, in all and by each cause alone."""
    units = found.reference.scene.units
    kept, printed = found.kept_digits
    off = units.text(found.agree)
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
        runs = counted(found.unfinished, "run")
        lines.append(f"{runs} could not be finished and are left out.")
    return lines + [f"Warning: {warning}." for warning in found.reference.warnings]


def _worst_sentences(found: Sensitivity, alone: Mapping[str, Sensitivity]) -> Iterator[str]:
    """Say which ball spreads most, how far by each cause alone, and what ``amplified`` means."""
    worst, units = found.worst, found.reference.scene.units
    x0, y0, x1, y1 = (units.from_si(v, "length") for v in (*worst.low, *worst.high))
    ratio = ""
    if times := worst.amplification:
        form = ".1f" if times < 9.95 else ".0f"
        ratio = f", {times:{form}} x that of the starts"
    yield (
        f"Ball {worst.ball} spreads most: its end has a standard deviation of "
        f"{units.text(worst.deviation)}{ratio}; 95 % of its ends lie between {x0:.2f} and "
        f"{x1:.2f} {units.length} along x and between {y0:.2f} and {y1:.2f} {units.length} along y."
    )
    if len(alone) > 1:
        its = found.balls.index(worst)
        deviations = {name: each.balls[its].deviation for name, each in alone.items()}
        said = ", ".join(f"{name} {units.text(std)}" for name, std in deviations.items())
        yield f"Its standard deviation by each cause alone: {said}."
    if "starts" in alone:
        starts = units.text(found.deviation_of_starts)
        yield f"Amplified: deviation by the starts alone, divided by that of the starts ({starts})."
