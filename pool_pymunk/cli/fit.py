"""This command fits numbers of a scenario to measured places of balls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import count
from pathlib import Path

from pool_pymunk.cli import read
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import FitOptions
from pool_pymunk.cli.output import File, Output, Report
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import inputs, scenario
from pool_pymunk.results.table import ResultTable, TableColumn
from pool_pymunk.results.words import counted
from pool_pymunk.studies import fit as fits

FITTED = "fitted.toml"


def fit(asked: FitOptions) -> int:
    """Fit the numbers, and write the new scenario."""
    folder = _folder(asked)
    scene = scenario.load(asked.scenario)
    free = list(filter(None, read.names("--free", asked.free)))
    sigma = None
    if asked.error is not None:
        sigma = read.length("--error", asked.error, scene.units)
    try:
        with Bar("fitting") as bar:
            found = fits.fit(
                scene, asked.measured, free, error=sigma, starts=asked.starts, seed=asked.seed,
                aims_anew=asked.aims_anew, on_done=bar.come_to,
            )  # fmt: skip
    except ImportError as missing:
        raise InputError(str(missing)) from None
    kinds = f"Scenario, residuals{' and picture' if asked.pictures else ''}"
    with Output(folder, kinds, asked.json, (asked.scenario, found.scene.title)) as put:
        put(_report(found, asked.pictures))
    return 0


def _folder(asked: FitOptions) -> Path:
    """Return ``out``, or a numbered folder; one that has a fit is taken only by ``force``."""
    out, force = asked.out, asked.force
    if out is None:
        names = (f"fit-{k}" if k > 1 else "fit" for k in count(1))
        folders = (read.folder(None, asked.scenario, name) for name in names)
        return next(each for each in folders if force or not (each / FITTED).exists())
    if (out / FITTED).exists() and not force:
        raise InputError(f"--out = {out}: has a fit already; replace it with --force")
    return out


def _report(found: fits.Fit, pictures: bool) -> Report:
    """Yield the fitted numbers and how good they are, the new scenario, and the residuals."""
    if found.values:
        number, unit = (TableColumn(each, left=True) for each in ("number", "unit"))
        columns = (number, "fitted", "standard error", "scenario's", unit)
        yield ResultTable(columns, _rows(found))
    yield from sentences(found)
    yield File(FITTED, found.scene.to_toml)
    yield File("residuals.csv", fits.table(found).csv)
    if pictures:
        from pool_pymunk.render.residuals import residuals_picture  # Only who draws waits for it.

        yield File("residuals.png", partial(residuals_picture, found))
    yield found.as_dict()


def _rows(found: fits.Fit) -> Iterator[tuple[str, ...]]:
    units = found.scene.units
    for name in found.values:
        value, _, error = found.written(name).removesuffix(" (unknown)").partition(" ± ")
        own = inputs.in_units(units, name, inputs.input_value(found.before, name))
        yield name, value, error or "not known", f"{own:g}", inputs.unit_of(units, name)


def sentences(found: fits.Fit) -> list[str]:
    """Say in words how good a fit is."""
    sigma, now, before = (
        found.scene.units.text(each, ".3g") if math.isfinite(each) else "not known"
        for each in (found.sigma, found.rms, found.rms_before)
    )
    return [
        f"Fitted to {counted(int(found.used.sum()), 'place')}: the root mean square of "
        f"the residuals is {now}, and {before} with the scenario's own numbers.",
        f"The standard deviation of one measured coordinate is {sigma}.",
        *(f"Warning: {warning}." for warning in found.warnings),
    ]
