"""What the commands share: options, reading a scenario, errors, progress."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.progress import Progress

    from pool_pymunk.model import Scene, Shot

Scenario = Annotated[str, typer.Argument(metavar="SCENARIO", help="A file, or a bundled name.")]
SolverName = Annotated[str, typer.Option("--solver", help="Which solver.", show_default=True)]
Step = Annotated[
    str | None, typer.Option("--dt", metavar="DT", help="Time step in s, e.g. 1e-4 or 1/240.")
]
ShotName = Annotated[
    str | None, typer.Option("--shot", metavar="K", help="One shot only: its number or its name.")
]
JsonFile = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write the results here.")
]
OutDir = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Where files go.")]


class InputError(Exception):
    """Bad input: one line a problem, exit code 2."""


@contextmanager
def input_errors() -> Iterator[None]:
    """Turn what the library raises for bad input into :class:`InputError`."""
    from pool_pymunk.model import SceneError
    from pool_pymunk.solvers import SettingError

    try:
        yield
    except (SceneError, SettingError) as error:
        raise InputError(str(error)) from None


def read_scenario(scenario: str) -> Scene:
    """The scene of a scenario; its problems are bad input."""
    from pool_pymunk.model.scenario import load

    with input_errors():
        return load(scenario)


def read_step(text: str | None) -> float | None:
    """A time step as typed: a number or a fraction.

    >>> read_step("1/240") == 1 / 240, read_step("1e-4"), read_step(None)
    (True, 0.0001, None)
    """
    if text is None:
        return None
    try:
        value = float(Fraction(text.replace(" ", ""))) if "/" in text else float(text)
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"--dt = {text}: must be a number or a fraction, e.g. 1/240") from None
    if not (value > 0.0 and math.isfinite(value)):
        raise InputError(f"--dt = {text}: must be greater than 0 and finite")
    return value


def read_shots(scene: Scene, name: str | None) -> list[Shot | None]:
    """The shots asked for: all of the scene's, or one by its number from 1 or its name."""
    if name is None:
        return list(scene.shots) or [None]
    for k, shot in enumerate(scene.shots, start=1):
        if name in (str(k), shot.name):
            return [shot]
    known = ", ".join(f"{k} ({shot.name})" for k, shot in enumerate(scene.shots, start=1))
    raise InputError(f"--shot = {name}: there is no such shot (there are: {known or 'none'})")


@contextmanager
def progress(label: str, total: float) -> Iterator[Progress]:
    """A progress bar on a terminal, silence in a pipe; advance it with ``update(0, advance=1)``."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not sys.stderr.isatty()
    ) as bar:
        bar.add_task(label, total=total)
        yield bar
