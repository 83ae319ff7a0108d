"""This command compares solvers with each other and with the published ends."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import closing
from functools import partial
from typing import Annotated, Any

import typer

from pool_pymunk.cli import common, lib, opt, read
from pool_pymunk.safety.files import whole

ENDS = ("shot", "solver", "dt", "ball", "x", "y", "distance")


def compare(
    scenario: opt.Scenario,
    solvers: opt.Columns = None,
    dt: opt.Step = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    contact_tolerance: opt.ContactTolerance = None,
    json: opt.JsonFile = None,
    out: opt.OutDir = None,
    pictures: Annotated[bool, opt.option("Draw each run over the exact one.")] = True,
) -> int:
    """Play every shot with several solvers; show the ends, and where runs first diverge."""
    how = common.How(law, friction, max_time, contact_tolerance)
    scene = how.scene(scenario)
    columns, left_out = how.columns(scene, solvers, read.seconds("--dt", dt))
    columns.insert(0, how.reference(scene))
    folder = common.place(out, scenario, "compare")
    found: list[lib.compare.Comparison] = []
    try:
        with closing(common.simulate_beside(scene, read.shots(scene, shot), columns)) as rows:
            for reference, *runs in rows:
                comparisons = [lib.compare.Comparison(reference, run) for run in runs]
                _print(reference, comparisons)
                found += comparisons
        common.say(common.left_out_sentences(left_out))
    finally:
        if found:
            with whole(folder / "ends.csv") as part:
                lib.table.ResultTable(ENDS, _ends(found)).csv(part)
            results = {
                "reference": found[0].reference.solver,
                "comparisons": [_record(one) for one in found],
                "left_out": left_out,
            }
            common.write_json(json, results, scenario, scene.title)
    if pictures:
        with lib.terminal.Bar("drawing", len(found)) as bar:
            for each in found:
                show, run = lib.render.Show((each.reference, each.run)), each.run
                lib.render.picture(
                    show, folder / f"{common.stem(run)}-{run.solver}.png", when="end"
                )
                bar.step()
    typer.echo(f"{'Pictures and data' if pictures else 'Data'}: {folder}")
    return 0


def _print(reference: lib.Run, found: list[lib.compare.Comparison]) -> None:
    runs = (reference, *(one.run for one in found))
    column = lib.table.TableColumn
    solver, status = (column(each, left=True) for each in ("solver", "status"))
    costs = (column("wall time", unit="ms"), column("energy left", unit="%"))
    columns = (solver, "contacts", "steps", *costs, status)
    said = [*sentences(reference, found), *common.warnings_of(runs)]
    unit = reference.scene.units.length
    lib.terminal.show(
        f"\n[bold]{reference.name}[/bold]",
        f"Exact ends, and distances of the other ends from them ({unit})\n",
        _distances(reference, found),
        lib.table.ResultTable(columns, map(_cost, runs)),
        *said,
    )


def _distances(reference: lib.Run, found: list[lib.compare.Comparison]) -> lib.table.ResultTable:
    """Return each ball's exact end, and its distance from the end in each other run."""
    published = reference.shot.published if reference.shot else {}
    ends, from_si = reference.final, partial(reference.scene.units.from_si, kind="length")
    columns: dict[str, Iterable[Any]] = {
        "ball": ends,
        "exact": ["{:.4f}, {:.4f}".format(*map(from_si, end)) for end in ends.values()],
    }
    for one in found:
        name = _name(one.run).replace(" s", f"{lib.table.NO_BREAK}s")
        columns[name] = map(from_si, one.distances.values())
    if published:
        columns["published"] = [
            f"{from_si(math.dist(end, published[id_])):.3f}" if id_ in published else ""
            for id_, end in ends.items()
        ]
    return lib.table.ResultTable.of(columns)


def _cost(run: lib.Run) -> tuple[object, ...]:
    share = run.energy["final"] / run.energy["initial"] if run.energy["initial"] else 0.0
    contacts = sum(event.is_contact for event in run.events)
    spent = f"{run.wall_time * 1e3:.1f}", f"{share:.1%}".rstrip("%")
    return _name(run), contacts, run.steps, *spent, run.status


def sentences(reference: lib.Run, found: list[lib.compare.Comparison]) -> Iterator[str]:
    """Say in words how the runs of one shot differ from the reference."""
    unit, published = reference.scene.units, reference.shot.published if reference.shot else {}
    for one in found:
        parted, off = one.divergence, unit.from_si(one.largest, "length")
        largest = f"{off:.3f}" if off >= 0.001 else f"{off:.2g}"
        text = f"{_name(one.run)}: ends within {largest} {unit.length} of the exact ones"
        same = ", with the same contacts"
        yield text + (f"; they part at {parted.t:.4f} s: {parted.text}." if parted else f"{same}.")
    if published:
        axes = [
            (abs(a - b), id_)
            for id_, end in published.items()
            for a, b in zip(reference.final[id_], end, strict=True)
        ]
        off, ball = max(axes, key=lambda one: one[0])
        text = (
            f"The published ends are up to {unit.from_si(off, 'length'):.3f} {unit.length} off the "
            f"exact ones, along x or y (ball {ball})"
        )
        if lib.trace.ZERO_SLIP in reference.policies and lib.listing.is_of_the_report(reference):
            text += "; a slip of exactly zero got its sign from rounding there, see the warning"
        yield f"{text}.{common.published_by(reference)}"


def _name(run: lib.Run) -> str:
    return run.solver if run.dt is None else f"{run.solver} {lib.words.step_text(run.dt)}"


def _ends(found: list[lib.compare.Comparison]) -> Iterator[tuple[object, ...]]:
    for one in found:
        for id_, end in one.run.final.items():
            yield one.run.name, one.run.solver, one.run.dt, id_, *end, one.distances[id_]


def _record(one: lib.compare.Comparison) -> dict[str, object]:
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
