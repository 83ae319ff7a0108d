"""This command makes one HTML file that plays every shot exactly, in any browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pool_pymunk.cli import common, lib, opt, read


def page(
    scenario: opt.Scenario,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    contact_tolerance: opt.ContactTolerance = None,
    overlay: Annotated[
        list[str] | None,
        opt.option(
            "Compare with this solver, or with this scenario; may be repeated.",
            "SOLVER[:DT][:LAW]|SCENARIO",
        ),
    ] = None,
    predict: Annotated[
        bool, opt.option("Stop before the first contact, and ask for the rest.", None, "--predict")
    ] = False,
    out: Annotated[
        Path | None, opt.option("Default: page.html in renders/<scenario>.", "FILE.html", "--out")
    ] = None,
) -> int:
    """Make a page that plays every shot: one HTML file that needs nothing else.

    The page has the exact paths between contacts. Stop it, go from contact to contact, slow it
    down a hundred times, and see other runs as ghosts. A scenario to compare with must have the
    same table, and balls of the same ids and sizes; the page names it by its title. With --predict
    a class says where balls will go before the page shows it.
    """
    how = common.How(law, friction, max_time, contact_tolerance)
    scene = how.scene(scenario)
    chosen = read.shots(scene, shot)
    files = [text for text in overlay or () if common.is_scenario(text)]
    others = [common.other_scene(how, scene, scenario, text) for text in files]
    ghosts = [common.read_setting(text) for text in overlay or () if text not in files]
    settings = [how.setting(scene, solver, dt), *ghosts]
    path = out or common.place(None, scenario) / "page.html"
    read.ending("--out", path, (".html", ".htm"), ".html")
    columns = [common.simulate_and_warn(scene, chosen, settings)]
    for other in others:
        its = common.same_shots(scene, other, chosen)
        columns.append(common.simulate_and_warn(other, its, settings[:1]))
    shown = [sum(runs, ()) for runs in zip(*columns, strict=True)]
    lib.page.write_page(shown, path, predict)
    typer.echo(path)
    return 0
