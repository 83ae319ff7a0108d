"""This command compares solvers with each other and with the published ends.

It measures the grid of ``tradeoff`` with one step for each solver, and shows it shot by shot.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any

from pool_pymunk.cli import read, runs
from pool_pymunk.cli.options import CompareOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.terminal import heading
from pool_pymunk.cli.tradeoff import measure
from pool_pymunk.report.listing import is_of_the_report
from pool_pymunk.results.run import Run
from pool_pymunk.results.table import NO_BREAK, ResultTable, TableColumn
from pool_pymunk.results.trace import ZERO_SLIP
from pool_pymunk.results.words import step_text
from pool_pymunk.studies.compare import Comparison
from pool_pymunk.studies.grid import Tradeoff

ENDS = ("shot", "solver", "dt", "ball", "x", "y", "distance")


def compare(asked: CompareOptions) -> int:
    """Measure the solvers, each at one step."""
    scene = read.scene(asked)
    columns, left_out = read.columns(asked, scene, read.seconds("--dt", asked.dt))
    folder = read.folder(asked.out, asked.scenario, "compare")
    reference = read.reference(asked, scene)
    exact = reference.runs(scene, read.shots(scene, asked.shot))
    others = {str(each): each for each in columns}
    others.pop(str(reference), None)
    found = Tradeoff(scene, tuple(exact), all_count=True)
    kinds = "Pictures and data" if asked.pictures else "Data"
    with Output(folder, kinds, asked.json, (asked.scenario, scene.title)) as put:
        for each in measure(found, list(others.values()) or [reference]):
            put.at_end(_report(each, left_out, asked.pictures))
    return 0


def _report(measured: Tradeoff, left_out: Mapping[str, str], pictures: bool) -> Report:
    """Yield what is to be said of each shot, all ends, and a picture of each run."""
    exact, played = measured.references, measured.runs
    rows = [
        [Comparison(one, run) for run in played[k :: len(exact)]] for k, one in enumerate(exact)
    ]
    found = [one for row in rows for one in row]
    for row in rows:
        yield from _shown(row)
    yield from runs.left_out_sentences(left_out)
    compared = {run.solver for run in played}
    own = [Comparison(one, one) for one in exact if one.solver not in compared]
    yield File("ends.csv", ResultTable(ENDS, _ends([*own, *found])).csv)
    yield {
        "reference": exact[0].solver,
        "exact": {one.name: one.final for one in exact},
        "comparisons": list(map(_record, found)),
        "left_out": dict(left_out),
    }
    if not pictures:
        return
    from pool_pymunk.render import Show, picture  # Only who draws waits for it.

    for one in found:
        show = partial(picture, Show((one.reference, one.run)), when="end")
        yield File(f"{runs.stem(one.run)}-{one.run.solver}.png", show)


def _shown(found: list[Comparison]) -> Report:
    """Yield the ends and the cost of the runs of a shot, and how they differ."""
    reference = found[0].reference
    played = (reference, *(one.run for one in found))
    solver, status = (TableColumn(each, left=True) for each in ("solver", "status"))
    costs = (TableColumn("wall time", unit="ms"), TableColumn("energy left", unit="%"))
    yield heading(reference.name)
    unit = reference.scene.units.length
    yield f"Exact ends, and distances of the other ends from them ({unit})\n"
    yield _distances(found)
    yield ResultTable((solver, "contacts", "steps", *costs, status), map(_cost, played))
    yield from (*sentences(found), *runs.doubts_of([reference]))
    yield from runs.warnings_of(played)


def _distances(found: list[Comparison]) -> ResultTable:
    """Return each ball's exact end, and its distance from the end in each other run."""
    reference = found[0].reference
    published = reference.shot.published if reference.shot else {}
    ends, from_si = reference.final, partial(reference.scene.units.from_si, kind="length")
    columns: dict[str, Iterable[Any]] = {
        "ball": ends,
        "exact": ["{:.4f}, {:.4f}".format(*map(from_si, end)) for end in ends.values()],
    }
    for one in found:
        name = _name(one.run).replace(" s", f"{NO_BREAK}s")
        columns[name] = [_far(from_si(far)) for far in one.distances.values()]
    if published:
        columns["published"] = [
            f"{from_si(math.dist(end, published[id_])):.3f}" if id_ in published else ""
            for id_, end in ends.items()
        ]
    return ResultTable.of(columns)


def _cost(run: Run) -> tuple[object, ...]:
    share = run.energy["final"] / run.energy["initial"] if run.energy["initial"] else 0.0
    contacts = sum(event.is_contact for event in run.events)
    spent = f"{run.wall_time * 1e3:.1f}", f"{share:.1%}".rstrip("%")
    return _name(run), contacts, run.steps, *spent, run.status


def sentences(found: list[Comparison]) -> Iterator[str]:
    """Say in words how the runs of one shot differ from the reference."""
    reference = found[0].reference
    unit, published = reference.scene.units, reference.shot.published if reference.shot else {}
    for one in found:
        parted, off = one.divergence, unit.from_si(one.largest, "length")
        text = f"{_name(one.run)}: ends within {_far(off)} {unit.length} of the exact ones"
        same = ", with the same contacts"
        yield text + (f"; they part at {parted.t:.4f} s: {parted.text}." if parted else f"{same}.")
    if published:
        axes = [
            (abs(a - b), id_)
            for id_, end in published.items()
            for a, b in zip(reference.final[id_], end, strict=True)
        ]
        off, ball = max(axes, key=lambda one: one[0])
        far = unit.text(off, ".3f")
        text = f"The published ends are up to {far} off the exact ones, along x or y (ball {ball})"
        if ZERO_SLIP in reference.policies and is_of_the_report(reference):
            text += "; a slip of exactly zero got its sign from rounding there, see the warning"
        yield f"{text}.{runs.published_by(reference)}"


def _far(length: float) -> str:
    """Return a distance with three decimals, or if they do not show it with two figures."""
    return f"{length:.3f}" if length >= 0.001 else f"{length:.2g}"


def _name(run: Run) -> str:
    return run.solver if run.dt is None else f"{run.solver} {step_text(run.dt)}"


def _ends(found: list[Comparison]) -> Iterator[tuple[object, ...]]:
    for one in found:
        for id_, end in one.run.final.items():
            yield one.run.name, one.run.solver, one.run.dt, id_, *end, one.distances[id_]


def _record(one: Comparison) -> dict[str, object]:
    run, parted = one.run.as_dict(), one.divergence
    kept = ("status", "final", "energy", "steps", "wall_time", "warnings")
    return {
        "shot": one.run.name,
        "solver": {"name": one.run.solver, "dt": one.run.dt},
        **{key: run[key] for key in kept},
        "distance": one.distances,
        "largest": one.largest,
        "rms": one.rms,
        "divergence": parted and {"t": parted.t, "kind": parted.kind, "text": parted.text},
    }
