"""This command fits numbers of a scenario to where balls were measured."""

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
    input_errors,
    read_scenario,
)

if TYPE_CHECKING:
    from rich.table import Table

    from pool_pymunk.model import Scene
    from pool_pymunk.studies.fit import Fit


def fit(
    scenario: Scenario,
    measured: Annotated[
        str,
        typer.Option(
            metavar="FILE.csv",
            help='Columns shot, ball, x, y and, on demand, t (s); or "published".',
        ),
    ],
    free: Annotated[
        str,
        typer.Option(metavar="NAME,...", help="E.g. restitution.cushion,friction,speed.2,mass.8."),
    ],
    error: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Of one measured coordinate; default: estimated."),
    ] = None,
    starts: Annotated[int, typer.Option(metavar="N", help="From so many starts.")] = 8,
    seed: Annotated[int, typer.Option(metavar="N", help="Of the starts.")] = 0,
    json: JsonFile = None,
    out: OutDir = None,
    pictures: Annotated[bool, typer.Option(help="Draw the residuals.")] = True,
) -> int:
    """Fit numbers of a scenario to measured ends or tracks: values, standard errors, what is off.

    Lengths of the file are in the scenario's unit. A row without t is an end. The new scenario, a
    table of residuals and their picture are written.
    """
    scene = read_scenario(scenario)
    found = _fit(scene, measured, free, error, starts, seed)
    _print(found)
    folder = out or Path("renders") / Path(scenario).stem / "fit"
    _save(found, folder, pictures)
    if json is not None:
        _write_json(json, scenario, found)
    typer.echo(f"Scenario, residuals{' and picture' if pictures else ''}: {folder}")
    return 0


def _fit(
    scene: Scene, measured: str, free: str, error: str | None, starts: int, seed: int
) -> Fit:  # fmt: skip
    from pool_pymunk.model.quantities import positive
    from pool_pymunk.studies.fit import fit

    names = [name.strip() for name in free.split(",") if name.strip()]
    with input_errors():
        sigma = None if error is None else positive("--error", error, "length", scene.units)
        try:
            return fit(scene, measured, names, error=sigma, starts=starts, seed=seed)
        except ImportError as missing:
            raise InputError(str(missing)) from None


# -- the terminal ----------------------------------------------------------------------------------


def _print(found: Fit) -> None:
    from rich.console import Console

    console = Console(width=None if Console().is_terminal else 160, highlight=False)
    if found.values:
        console.print(_table(found))
    for line in sentences(found):
        console.print(line, soft_wrap=True)


def _table(found: Fit) -> Table:
    from rich.table import Table

    from pool_pymunk.model.inputs import in_units, input_value, unit_of

    table = Table()
    for heading in ("number", "fitted", "standard error", "scenario's", "unit"):
        table.add_column(heading, justify="left" if heading in ("number", "unit") else "right")
    units = found.scene.units
    for name in found.values:
        value, _, error = found.written(name).removesuffix(" (unknown)").partition(" ± ")
        own = in_units(units, name, input_value(found.before, name))
        table.add_row(name, value, error or "not known", f"{own:g}", unit_of(units, name))
    return table


def sentences(found: Fit) -> list[str]:
    """Say in words how good a fit is."""
    from pool_pymunk.results.words import counted

    units = found.scene.units
    sigma, now, before = (
        f"{units.from_si(length, 'length'):.3g} {units.length}"
        if math.isfinite(length)
        else "not known"
        for length in (found.sigma, found.rms, found.rms_before)
    )
    return [
        f"Fitted to {counted(int(found.used.sum()), 'place')}: they lie {now} off, root mean "
        f"square, and {before} with the scenario's own numbers.",
        f"The standard deviation of one measured coordinate is {sigma}.",
        *(f"Warning: {warning}." for warning in found.warnings),
    ]


# -- files -----------------------------------------------------------------------------------------


def _save(found: Fit, folder: Path, pictures: bool) -> None:
    """Write the new scenario, the residuals and their picture."""
    from pool_pymunk.safety.files import whole
    from pool_pymunk.studies.fit import write_csv

    found.scene.to_toml(folder / "fitted.toml")
    with whole(folder / "residuals.csv") as part:
        write_csv(found, part)
    if pictures:
        from pool_pymunk.render.residuals import residuals_picture

        residuals_picture(found, folder / "residuals.png")


def _write_json(path: Path, scenario: str, found: Fit) -> None:
    import json

    from pool_pymunk import __version__
    from pool_pymunk.model.scenario import label
    from pool_pymunk.safety.files import whole

    content = {
        "scenario": label(scenario),
        "title": found.scene.title,
        "version": __version__,
        **found.as_dict(),
    }
    with whole(path) as part:
        part.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
