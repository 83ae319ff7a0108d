"""This module declares options: those that several commands share, and the words that they take.

--help must come at once, so no slow module is imported here: of the library, only laws and files.
tests/test_cli_manners.py compares the words of the other modules with the library.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.laws import LAWS
from pool_pymunk.safety.files import bundled

SOLVERS = ("pymunk", "pymunk-discrete", "pymunk-builtin", "event-driven", "time-slice")
FRICTION = ("joint", "callback")
PICTURES = ("png", "svg", "pdf")
SHOWS = ("end", "first-hit", "hits", "pocket", "duration")
EXPERTS = "for experts"  # Options in this panel are shown by --help-all alone.
UNITS = {"length": ("m", "cm", "mm", "in"), "mass": ("kg", "g"), "speed": ("m/s", "in/s")}
KNOWN = ", ".join("|".join(units) for units in UNITS.values())
LAW_NAMES = "|".join(LAWS)
SOLVER_NAMES = ", ".join(SOLVERS)


def among(words: Iterable[str]) -> Callable[[str], list[str]]:
    """Return a function that finds the words that begin with what was typed."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


def solver_lists(incomplete: str) -> list[str]:
    """Return the lists that complete a list of solvers, such as ``pymunk,ev``."""
    before, comma, last = incomplete.rpartition(",")
    return [before + comma + name for name in SOLVERS if name.startswith(last)]


def option(
    says: str, metavar: str | None = None, *names: str, for_experts: bool = False, **more: Any
) -> Any:
    """Declare an option: its help, what stands for its value, and names other than typer's."""
    panel = EXPERTS if for_experts else None
    return typer.Option(*names, metavar=metavar, help=says, rich_help_panel=panel, **more)


Scenario = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="A file, or a bundled name (pool-pymunk --help).",
        autocompletion=among(bundled()),  # Where none begins as typed, shells offer files.
    ),
]
SolverName = Annotated[
    str, option(f"One of {SOLVER_NAMES}.", "SOLVER", "--solver", autocompletion=among(SOLVERS))
]
SolverList = Annotated[
    str | None,
    option(
        f"Some of {SOLVER_NAMES}; default: all.", "S,...", "--solvers",
        autocompletion=solver_lists,
    ),
]  # fmt: skip
Columns = Annotated[
    str | None,
    option(
        f"Some of {SOLVER_NAMES}, each with :DT or without, or all; default: all but the report's "
        "slices of 1e-6 s.",
        "S[:DT],...", "--solvers", autocompletion=solver_lists,
    ),
]  # fmt: skip
law_names = among(LAWS)
LawName = Annotated[
    str | None,
    option("Contact law, instead of the scenario's.", LAW_NAMES, "--law",
           autocompletion=law_names, for_experts=True),
]  # fmt: skip
Workers = Annotated[
    int | None,
    option("Processes; default: one per core.", "N", "--workers", for_experts=True),
]
Cluster = Annotated[
    str | None, option("A Dask scheduler: tcp://host:8786.", "ADDRESS", for_experts=True)
]
FrictionBy = Annotated[
    str | None,
    option(
        "How solvers in a space apply surface friction; default: joint, if it has that.",
        "|".join(FRICTION), "--friction", autocompletion=among(FRICTION), for_experts=True,
    ),
]  # fmt: skip
AimAnew = Annotated[
    bool,
    option("Aim again wherever the ball lies; default: aim once, as the scenario is.",
           None, "--aim-anew", for_experts=True),
]  # fmt: skip
MaxTime = Annotated[
    str | None, option("End each shot at this time (s).", "S", "--max-time", for_experts=True)
]
ContactTolerance = Annotated[
    str | None,
    option(
        "How far what the exact solver leaves out where balls stay in contact may move a ball; "
        "default: 1e-7m. Without a unit it is in the scenario's.",
        "LENGTH", "--contact-tolerance", for_experts=True,
    ),
]  # fmt: skip
Step = Annotated[str | None, option("Time step in s, e.g. 1e-4 or 1/240.", "DT", "--dt")]
ShotName = Annotated[str | None, option("One shot only: its number or its name.", "K", "--shot")]
PositionError = Annotated[
    str | None,
    option(
        "Half-width of each start's error; default: half its last digit.", "LENGTH",
        "--position-error",
    ),
]  # fmt: skip
JsonFile = Annotated[Path | None, option("Write the results to this JSON file.", "FILE", "--json")]
OutDir = Annotated[Path | None, option("The folder for the files.", "DIR", "--out")]
StartAndEnd = Annotated[bool, option("Draw the start and end of each shot.")]
