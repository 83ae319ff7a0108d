"""``page``: one HTML file that plays every shot exactly, in any browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, place, read_setting, simulate_beside


def page(
    scenario: opt.Scenario,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    overlay: Annotated[
        list[str] | None,
        opt.option("Compare with these runs; may be repeated.", "SOLVER[:DT][:LAW]"),
    ] = None,
    out: Annotated[
        Path | None, opt.option("Default: renders/<scenario>/page.html.", "FILE.html", "--out")
    ] = None,
) -> int:
    """Make a page that plays every shot: one HTML file that needs nothing else.

    The page has the exact paths between contacts. Stop it, go from contact to contact, slow it
    down a hundred times, and see the runs to compare with as ghosts.
    """
    how = How(law, friction, max_time)
    scene = how.scene(scenario)
    settings = [how.setting(scene, solver, dt), *map(read_setting, overlay or ())]
    path = out or place(None, scenario) / "page.html"
    read.ending("--out", path, (".html", ".htm"), ".html")
    runs = simulate_beside(scene, read.shots(scene, shot), settings)
    lib.page.write_page(runs, path)
    typer.echo(path)
    return 0
