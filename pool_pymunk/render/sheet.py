"""This module decides where things go, and draws all that does not move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from pool_pymunk.model import Point
from pool_pymunk.render import table
from pool_pymunk.render.balls import DrawnBall, discs, draw_balls, draw_labels
from pool_pymunk.render.canvas import Figure, canvas, draw_text
from pool_pymunk.render.plots import KEY_ROWS, plot_distances
from pool_pymunk.render.style import Style
from pool_pymunk.render.view import Show, View, fit, headings
from pool_pymunk.results.run import Run

SMALL = 0.7  # the size of labels beside balls, in that of the caption's letters
HEADINGS, SHELF, PLOT = 4.5, 6.5, 26.0  # units; the heights of headings, of a tray and of a plot


class Layout(NamedTuple):
    """A layout has the canvas and rooms on it (points), and the height of letters."""

    width: float
    height: float
    rooms: tuple[Bbox, ...]
    plot: Bbox | None
    tray: Bbox | None
    caption: Bbox
    letter: float

    def places(self, count: int) -> tuple[float, list[Point]]:
        """Return the radius of balls in the tray, and where this many of them lie there."""
        assert self.tray is not None
        first, radius = self.tray.x0 + 6.5 * self.letter, 0.42 * self.tray.height
        pitch = min(2.3 * radius, (self.tray.x1 - first) / max(count, 1))
        y = (self.tray.y0 + self.tray.y1) / 2
        return radius, [(first + pitch * (k + 0.5), y) for k in range(count)]


def picture_layout(show: Show, tray: bool = False) -> Layout:
    """Lay out a sheet ten inches wide, or less if the table would be higher than 7.5 inches."""
    margin, panels, seen = 16.0, len(show.panels), show.seen
    width = min(720.0, (panels + 1) * margin + panels * 540.0 * seen.width / seen.height)
    return _layout(show, (width, 0.0), 4.1, margin, 36.0, tray)


def film_layout(show: Show, size: tuple[int, int]) -> Layout:
    """Lay out a frame of ``size`` pixels: the panels, below them the plot, then the caption."""
    unit = min(size[1], 0.7 * size[0]) / 100.0
    return _layout(show, size, unit, 2.0 * unit, 6.0 * unit, bool(show.tray))


def _layout(
    show: Show, size: tuple[float, float], unit: float, margin: float, strip: float, tray: bool
) -> Layout:
    """Lay out tables, tray, plot and caption from the top; a height of 0 follows from the width."""
    panels, letter, compared = len(show.panels), 2.6 * unit, len(show.runs) > 1
    (width, height), box = size, Bbox.from_extents
    inner = (width - (panels + 1) * margin) / panels
    tall, above = inner * show.seen.height / show.seen.width, HEADINGS * unit * show.side_by_side
    around = margin + strip + above + unit * (SHELF * tray + PLOT * compared)
    height = height or around + tall
    tall = min(tall, height - around) if compared else height - around
    head = height - margin - above
    left = [margin + k * (inner + margin) for k in range(panels)]
    rooms = tuple(box(x, head - tall, x + inner, head) for x in left)
    low = head - tall - SHELF * unit * tray
    shelf = box(2 * margin, low, width - 2 * margin, head - tall - 0.6 * unit) if tray else None
    caption = box(2 * margin, margin, width - 2 * margin, strip)
    if not compared:
        return Layout(width, height, rooms, None, shelf, caption, letter)
    columns = -(-len(show.movers) // KEY_ROWS)
    beside = columns * (2.8 + 0.55 * max(map(len, show.movers), default=0)) * letter
    plot = box(13.0 * unit, strip + 6.0 * unit, width - 4.0 * unit - beside, low - 3.0 * unit)
    return Layout(width, height, rooms, plot, shelf, caption, letter)


class Sheet(NamedTuple):
    """A sheet is a drawn background: a view for each panel, and the plot if there is one.

    ``bar`` has the length (points) and the name of a scale; an open plane has its own.
    """

    figure: Figure
    axes: Axes
    views: tuple[View, ...]
    plot: Axes | None
    bar: tuple[float, str] | None


def draw_sheet(show: Show, layout: Layout, style: Style, times: tuple[float, float]) -> Sheet:
    """Draw the page, a table or plane in each room, headings, and the plot over ``times``."""
    figure, axes = canvas(layout.width, layout.height, style.page)
    scene = show.runs[0].scene
    style = style.on(scene.table)
    views = tuple(fit(show.seen, room, SMALL * layout.letter) for room in layout.rooms)
    for room, view in zip(layout.rooms, views, strict=True):
        if scene.table is not None:
            table.draw_table(axes, scene.table, scene.pockets, view, style)
        else:
            table.draw_plane(axes, room, view, scene.units, style)
        table.draw_patches(axes, scene, view, style)
        table.draw_pockets_and_posts(axes, scene, view, style)
        places = [(*view.place((x, y)), text) for x, y, text in table.numbers(scene)]
        named = [DrawnBall(x, y, 0.0, "", text, view.letter) for x, y, text in places]
        draw_labels(axes, named, style)
    if show.side_by_side:
        for room, text in zip(layout.rooms, headings(show.runs), strict=True):
            at = ((room.x0 + room.x1) / 2, room.y1 + 0.6 * layout.letter)
            draw_text(axes, text, at, layout.letter, room.width, ha="center", color=style.ink)
    plot = None
    if layout.plot is not None:
        size = (layout.width, layout.height) * 2
        plot = figure.add_axes(tuple(layout.plot.bounds / np.array(size)))
        plot_distances(plot, show, times, style, 0.85 * layout.letter)
    length, text = table.scale(show.seen, scene.units)
    bar = (views[0].scale * length, text) if scene.table else None
    return Sheet(figure, axes, views, plot, bar)


def draw_tray(sheet: Sheet, run: Run, ids: Sequence[str], layout: Layout, style: Style) -> None:
    """Draw these balls in the tray, beside the word "Pocketed"."""
    assert layout.tray is not None
    at = (layout.tray.x0, (layout.tray.y0 + layout.tray.y1) / 2)
    looks = {"va": "center", "color": style.faint}
    draw_text(sheet.axes, "Pocketed", at, layout.letter, 6.0 * layout.letter, **looks)
    radius, places = layout.places(len(ids))
    balls = discs(run.scene, run.at([0.0])[0][0], sheet.views[0])
    lying = zip((balls[run.scene.index[id_]] for id_ in ids), places, strict=True)
    draw_balls(sheet.axes, [b._replace(x=x, y=y, radius=radius) for b, (x, y) in lying], style)


def draw_caption(sheet: Sheet, layout: Layout, text: str, style: Style, share: float = 1.0) -> None:
    """Write a line into a ``share`` of the caption's room from the left, or beside the scale."""
    room, letter, looks = layout.caption, layout.letter, {"color": style.ink}
    if share < 1.0:
        draw_text(sheet.axes, text, room.p0, letter, share * room.width, ha="left", **looks)
        return
    beside = 0.0
    if sheet.bar is not None:
        length, name = sheet.bar
        (x, y), top = room.p0, room.y0 + 0.3 * letter
        bar = [(x, top), (x, y), (x + length, y), (x + length, top)]
        table.draw_bar(sheet.axes, bar, name, SMALL * letter, style)
        beside = length + 2.0 * letter
    at = ((room.x0 + beside + room.x1) / 2, room.y0)
    draw_text(sheet.axes, text, at, letter, room.width - beside, ha="center", **looks)
