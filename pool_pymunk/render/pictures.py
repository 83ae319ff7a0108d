"""This module draws pictures of a shot's start and end, good enough to print."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes

from pool_pymunk.model import Scene
from pool_pymunk.model.plain import argument, choice
from pool_pymunk.render import balls
from pool_pymunk.render.balls import discs, moves, track_of
from pool_pymunk.render.canvas import Figure, save_figure
from pool_pymunk.render.sheet import draw_caption, draw_sheet, draw_tray, picture_layout
from pool_pymunk.render.style import PRINT, Style
from pool_pymunk.render.view import Show, View
from pool_pymunk.results.run import Run
from pool_pymunk.results.words import seconds

When = Literal["start", "end"]


def picture(
    what: Run | Scene | Show,
    path: Path | str,
    *,
    when: When = "start",
    dpi: float = 200.0,
    caption: str | None = None,
    style: Style = PRINT,
) -> None:
    """Draw a run's ``start`` or ``end``, or a scene, into a file (.png, .svg or .pdf).

    The start has an arrow at every ball that moves, and the end the balls' tracks and its time. A
    Show of two runs compares them, with their distances in a plot below. ``dpi`` matters for PNG
    (10 in wide). ``caption`` replaces the line that names scenario, shot, solver and time step.
    Raises RenderError for what cannot be drawn, and OSError if the file cannot be written.
    """
    save_figure(figure_of(what, when, caption=caption, style=style), path, dpi)


def figure_of(
    what: Run | Scene | Show,
    when: When = "start",
    *,
    caption: str | None = None,
    style: Style = PRINT,
) -> Figure:
    """Draw what :func:`picture` saves."""
    run = as_set_up(what) if isinstance(what, Scene) else what
    show = run if isinstance(run, Show) else Show((run,))
    style = style.on(show.runs[0].scene.table)
    out = show.tray if argument("when", when, choice(("start", "end"))) == "end" else show.before
    layout = picture_layout(show, tray=bool(out))
    sheet = draw_sheet(show, layout, style, (0.0, show.duration))
    for panel, view in zip(show.panels, sheet.views, strict=True):
        for shown in reversed(panel):
            _draw_run(sheet.axes, shown, when, view, style, solid=shown is panel[0])
    if out:
        draw_tray(sheet, show.runs[0], out, layout, style)
    if caption is None:
        moment = when if when == "start" else f"end after {seconds(show.duration)}"
        caption = show.caption("" if isinstance(what, Scene) else moment)
    draw_caption(sheet, layout, caption, style)
    return sheet.figure


def as_set_up(scene: Scene) -> Run:
    """Return a run in which nothing happens."""
    start = scene.start(None)
    rolls = start.roll or ((),) * len(start.position)
    motions = zip(start.position, start.velocity, rolls, strict=True)
    breakpoints = [np.array([[0.0, *p, *v, 0.0, 0.0, *w]]) for p, v, w in motions]
    return Run(
        scene=scene, shot=None, solver="", law=scene.physics.law, dt=None, knots=tuple(breakpoints),
        events=(), status="settled", duration=0.0, steps=0, warnings=(), wall_time=0.0,
    )  # fmt: skip


def _draw_run(axes: Axes, run: Run, when: When, view: View, style: Style, *, solid: bool) -> None:
    """Draw the balls of one run: solid, with tracks or arrows, or as ghosts."""
    (before, now), (velocity, _) = run.at([0.0, 0.0 if when == "start" else run.duration])
    shown = discs(run.scene, now, view)
    gone = run.off if when == "end" else run.off - run.pocketed.keys()
    there = [disc for disc in shown if disc.label not in gone]
    if when == "end":
        if solid:
            starts = zip(discs(run.scene, before, view), run.knots, strict=True)
            balls.draw_rings(axes, [disc for disc, rows in starts if moves(rows)])
        paths = [view.places(track_of(run, i)[:, 1:]) for i in range(len(shown))]
        lines = balls.tracks(paths, shown, style.cloth, solid=solid)
        axes.add_collection(lines, autolim=False)
    if not solid:
        balls.draw_ghosts(axes, there, style)
        movers = {disc.label for disc, rows in zip(shown, run.knots, strict=True) if moves(rows)}
        balls.draw_rims(axes, [disc for disc in there if disc.label in movers], style)
    elif there:
        balls.draw_balls(axes, there, style)
    if solid and when == "start":
        balls.draw_arrows(axes, shown, velocity, view.scale, style)
