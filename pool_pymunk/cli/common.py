"""This module has what commands share: options, reading a scenario, errors, progress."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from pool_pymunk.cli.choices import (
    FRICTION,
    SOLVERS,
    friction_names,
    law_names,
    scenario_names,
    solver_lists,
    solver_names,
)
from pool_pymunk.physics.laws import LAWS

if TYPE_CHECKING:
    from rich.progress import Progress

    from pool_pymunk.model import Scene, Shot

Scenario = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO", help="A file, or a bundled name.", autocompletion=scenario_names
    ),
]
SolverName = Annotated[
    str,
    typer.Option(
        "--solver",
        metavar="SOLVER",
        help=f"One of {', '.join(SOLVERS)}.",
        autocompletion=solver_names,
    ),
]
SolverList = Annotated[
    str | None,
    typer.Option(
        "--solvers",
        metavar="S,...",
        help=f"Only these solvers, of {', '.join(SOLVERS)}.",
        show_default="all",
        autocompletion=solver_lists,
    ),
]
LawName = Annotated[
    str | None,
    typer.Option(
        "--law",
        metavar="|".join(LAWS),
        help="Contact law, instead of the scenario's.",
        autocompletion=law_names,
    ),
]
FrictionBy = Annotated[
    str | None,
    typer.Option(
        "--friction",
        metavar="|".join(FRICTION),
        help="How solvers in a space apply surface friction.",
        show_default="joint",
        autocompletion=friction_names,
    ),
]
MaxTime = Annotated[
    str | None,
    typer.Option("--max-time", metavar="S", help="End each shot after so many seconds."),
]
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
    """This error is bad input: one line a problem, and exit code 2."""


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
    """Return the scene of a scenario; its problems are bad input."""
    from pool_pymunk.model.scenario import load

    with input_errors():
        return load(scenario)


class How(NamedTuple):
    """These options say how shots are played, whatever the solver; None is the usual way."""

    law: str | None = None
    friction: str | None = None
    max_time: str | None = None

    def scene(self, scene: Scene) -> Scene:
        """Return the scene with this law, and with this end of its shots."""
        latest = read_seconds("--max-time", self.max_time) or scene.physics.max_time
        law = self.law or scene.physics.law
        with input_errors():
            return replace(scene, physics=replace(scene.physics, law=law, max_time=latest))

    @property
    def options(self) -> dict[str, Any]:
        """Return the solver's options."""
        return {} if self.friction is None else {"friction": self.friction}

    def options_of(
        self, scene: Scene, solvers: Collection[str], named: bool
    ) -> dict[str, dict[str, Any]]:
        """Return each solver's options; solvers that were ``named`` must be able to take them."""
        from pool_pymunk.solvers import find_solver, request

        found = {}
        for name in solvers:
            known = find_solver(name).options
            found[name] = {k: v for k, v in self.options.items() if named or k in known}
            with input_errors():
                request(scene, name, **found[name])
        return found

    def check(self, scene: Scene, solver: str, dt: str | None = None) -> None:
        """Raise InputError for what the solver cannot take, a step among it."""
        from pool_pymunk.solvers import find_solver, request

        with input_errors():
            request(scene, solver, law=self.law, **self.options)
            if dt is not None and find_solver(solver).dt is None:
                raise InputError(f"--dt = {dt}: {solver} has no time step")


def read_step(text: str | None) -> float | None:
    """Return a time step as typed: a number or a fraction.

    >>> read_step("1/240") == 1 / 240, read_step("1e-4"), read_step(None)
    (True, 0.0001, None)
    """
    return read_seconds("--dt", text)


def read_seconds(key: str, text: str | None) -> float | None:
    """Return a time (s) as typed: a number or a fraction."""
    if text is None:
        return None
    try:
        value = float(Fraction(text.replace(" ", ""))) if "/" in text else float(text)
    except (ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f"{key} = {text}: must be a number or a fraction, e.g. 1/240") from None
    if not (value > 0.0 and math.isfinite(value)):
        raise InputError(f"{key} = {text}: must be greater than 0 and finite")
    return value


def read_shots(scene: Scene, name: str | None) -> list[Shot | None]:
    """Return the shots asked for: all of the scene's, or one by its number from 1 or its name."""
    from pool_pymunk.model.problems import suggestion

    if name is None:
        return list(scene.shots) or [None]
    for k, shot in enumerate(scene.shots, start=1):
        if name in (str(k), shot.name):
            return [shot]
    known = ", ".join(f"{k} ({shot.name})" for k, shot in enumerate(scene.shots, start=1))
    meant = suggestion(name, [shot.name for shot in scene.shots])
    message = f"there is no such shot (there are: {known or 'none'}){meant}"
    raise InputError(f"--shot = {name}: {message}")


@contextmanager
def progress(label: str, total: float) -> Iterator[Progress]:
    """Show progress on a terminal, nothing in a pipe; advance it with ``update(0, advance=1)``."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not sys.stderr.isatty()
    ) as bar:
        bar.add_task(label, total=total)
        yield bar
