"""This command makes one HTML file that plays every shot exactly, in any browser."""

from __future__ import annotations

import typer

from pool_pymunk.cli import beside, read
from pool_pymunk.cli.options import PageOptions
from pool_pymunk.page import write_page


def page(asked: PageOptions) -> int:
    """Play the shots and write the page."""
    scene = read.scene(asked)
    chosen = read.shots(scene, asked.shot)
    ghosts, others = beside.compared(asked, scene, asked.overlay or ())
    settings = [read.column(asked, scene), *ghosts]
    path = asked.out or read.folder(None, asked.scenario) / "page.html"
    read.ending("--out", path, (".html", ".htm"), ".html")
    rows = beside.play_beside(scene, chosen, settings, others)
    write_page(rows, path, asked.predict)
    typer.echo(path)
    return 0
