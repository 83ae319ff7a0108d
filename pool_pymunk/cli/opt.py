"""This module declares options: those that several commands share, and how others are written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

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


def option(says: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """Declare an option: its help, what stands for its value, and names other than typer's."""
    return typer.Option(*names, metavar=metavar, help=says, **more)


LAW_NAMES = "|".join(LAWS)
SOLVER_NAMES = ", ".join(SOLVERS)

Scenario = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO", help="A file, or a bundled name.", autocompletion=scenario_names
    ),
]
SolverName = Annotated[
    str, option(f"One of {SOLVER_NAMES}.", "SOLVER", "--solver", autocompletion=solver_names)
]
SolverList = Annotated[
    str | None,
    option(
        f"Only these solvers, of {SOLVER_NAMES}.", "S,...", "--solvers",
        show_default="all", autocompletion=solver_lists,
    ),
]  # fmt: skip
LawName = Annotated[
    str | None,
    option("Contact law, instead of the scenario's.", LAW_NAMES, "--law", autocompletion=law_names),
]
FrictionBy = Annotated[
    str | None,
    option(
        "How solvers in a space apply surface friction.", "|".join(FRICTION), "--friction",
        show_default="joint", autocompletion=friction_names,
    ),
]  # fmt: skip
MaxTime = Annotated[str | None, option("End each shot after this many seconds.", "S", "--max-time")]
Step = Annotated[str | None, option("Time step in s, e.g. 1e-4 or 1/240.", "DT", "--dt")]
ShotName = Annotated[str | None, option("One shot only: its number or its name.", "K", "--shot")]
JsonFile = Annotated[Path | None, option("Write the results here.", "FILE", "--json")]
OutDir = Annotated[Path | None, option("Where files go.", "DIR", "--out")]
StartAndEnd = Annotated[bool, option("Draw the start and end of each shot.")]
