"""``page``: one HTML file that plays every shot exactly, in any browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli.beside import Setting, read_setting, simulate_beside
from pool_pymunk.cli.common import (
    FrictionBy,
    How,
    InputError,
    LawName,
    MaxTime,
    Scenario,
    ShotName,
    SolverName,
    Step,
    input_errors,
    read_scenario,
    read_shots,
    read_step,
)


def page(
    scenario: Scenario,
    solver: SolverName = "pymunk",
    dt: Step = None,
    shot: ShotName = None,
    law: LawName = None,
    friction: FrictionBy = None,
    max_time: MaxTime = None,
    overlay: Annotated[
        list[str] | None,
        typer.Option(metavar="SOLVER[:DT][:LAW]", help="Compare with these runs; may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE.html", help="Default: renders/<scenario>/page.html."),
    ] = None,
) -> int:
    """Make a page that plays every shot: one HTML file that needs nothing else.

    The page has the exact paths between contacts. Stop it, go from contact to contact, slow it
    down a hundred times, and see the runs to compare with as ghosts.
    """
    how = How(law, friction, max_time)
    scene = how.scene(read_scenario(scenario))
    how.check(scene, solver, dt)
    path = out or Path("renders") / Path(scenario).stem / "page.html"
    if path.suffix not in (".html", ".htm"):
        raise InputError(f"--out = {path}: must end in .html")
    settings = [Setting(solver, read_step(dt), options=how.options)]
    settings += [read_setting(text) for text in overlay or ()]
    runs = simulate_beside(scene, read_shots(scene, shot), settings)

    from pool_pymunk.page import write_page

    with input_errors():
        write_page(runs, path)
    typer.echo(path)
    return 0
