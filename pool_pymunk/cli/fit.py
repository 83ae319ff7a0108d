"""This command fits numbers of a scenario to measured places of balls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import place, say, write_json
from pool_pymunk.safety.files import whole

FITTED = "fitted.toml"


def fit(
    scenario: opt.Scenario,
    measured: Annotated[
        str,
        opt.option('Columns: shot, ball, x, y, optionally t (s); or "published".', "FILE.csv"),
    ],
    free: Annotated[
        str, opt.option("Fit these inputs: restitution,friction or speed.2,mass.8.", "NAME,...")
    ],
    error: Annotated[
        str | None,
        opt.option("Standard deviation of one measured coordinate; default: estimated.", "LENGTH"),
    ] = None,
    starts: Annotated[int, opt.option("Number of starts of the fit.", "N", for_experts=True)] = 8,
    seed: Annotated[int, opt.option("Seed of the random starts.", "N", for_experts=True)] = 0,
    aims_anew: opt.AimAnew = False,
    json: opt.JsonFile = None,
    out: Annotated[
        Path | None, opt.option("Default: renders/<scenario>/fit, fit-2, ...", "DIR", "--out")
    ] = None,
    force: Annotated[bool, opt.option("Replace a fit that is there.", None, "--force")] = False,
    pictures: Annotated[bool, opt.option("Draw the residuals.")] = True,
) -> int:
    """Fit numbers of a scenario to measured ends or tracks, with standard errors.

    Lengths of the file are in the scenario's unit. A row without t is an end. The command writes
    the new scenario, a table of residuals and their picture, and keeps those of earlier fits.
    """
    folder = _folder(out, scenario, force)
    scene = lib.scenario.load(scenario)
    names = list(filter(None, read.names("--free", free)))
    sigma = None
    if error is not None:
        sigma = lib.quantities.positive("--error", error, "length", scene.units)
    try:
        with lib.terminal.Bar("fitting", 1) as bar:
            found = lib.fit.fit(
                scene, measured, names, error=sigma, starts=starts, seed=seed, aims_anew=aims_anew,
                on_done=bar.come_to,
            )  # fmt: skip
    except ImportError as missing:
        raise read.InputError(str(missing)) from None
    if found.values:
        number, unit = (lib.table.TableColumn(each, left=True) for each in ("number", "unit"))
        columns = (number, "fitted", "standard error", "scenario's", unit)
        lib.terminal.show(lib.table.ResultTable(columns, _rows(found)))
    say(sentences(found))
    found.scene.to_toml(folder / FITTED)
    with whole(folder / "residuals.csv") as part:
        lib.fit.table(found).csv(part)
    if pictures:
        lib.residuals.residuals_picture(found, folder / "residuals.png")
    write_json(json, found.as_dict(), scenario, found.scene.title)
    typer.echo(f"Scenario, residuals{' and picture' if pictures else ''}: {folder}")
    return 0


def _folder(out: Path | None, scenario: str, force: bool) -> Path:
    """Return ``out``, or a numbered folder; one that has a fit is taken only by ``force``."""
    if out is None:
        folders = (place(None, scenario, f"fit-{k}" if k > 1 else "fit") for k in count(1))
        return next(each for each in folders if force or not (each / FITTED).exists())
    if (out / FITTED).exists() and not force:
        raise read.InputError(f"--out = {out}: has a fit already; replace it with --force")
    return out


def _rows(found: lib.fit.Fit) -> Iterator[tuple[str, ...]]:
    units = found.scene.units
    for name in found.values:
        value, _, error = found.written(name).removesuffix(" (unknown)").partition(" ± ")
        own = lib.inputs.in_units(units, name, lib.inputs.input_value(found.before, name))
        yield name, value, error or "not known", f"{own:g}", lib.inputs.unit_of(units, name)


def sentences(found: lib.fit.Fit) -> list[str]:
    """Say in words how good a fit is."""
    units, lengths = found.scene.units, (found.sigma, found.rms, found.rms_before)
    sigma, now, before = (
        f"{units.from_si(each, 'length'):.3g} {units.length}"
        if math.isfinite(each)
        else "not known"
        for each in lengths
    )
    return [
        f"Fitted to {lib.words.counted(int(found.used.sum()), 'place')}: the root mean square of "
        f"the residuals is {now}, and {before} with the scenario's own numbers.",
        f"The standard deviation of one measured coordinate is {sigma}.",
        *(f"Warning: {warning}." for warning in found.warnings),
    ]
