"""This module decides where things go, and draws all that does not move."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pool_pymunk.model import Point
from pool_pymunk.render.balls import discs, draw_balls
from pool_pymunk.render.canvas import canvas, draw_text
from pool_pymunk.render.plots import KEY_ROWS, draw_key, plot_distances
from pool_pymunk.render.style import Style
from pool_pymunk.render.table import draw_plane, draw_pockets, draw_table
from pool_pymunk.render.view import Box, Show, View, fit, settings
from pool_pymunk.results.run import Run

SMALL = 0.7  # the size of labels beside balls, in that of the caption's letters


# -- where things go ---------------------------------------------------------------------------


class Layout(NamedTuple):
    """A layout has the canvas (points), and a room for each panel, for the plot and the caption.

    The tray is for balls that are off the table, if there are any. ``letter`` is the height of the
    caption's letters; a film's point is a pixel. With a ``key`` there is room beside the plot to
    say which colour is which ball.
    """

    width: float
    height: float
    rooms: tuple[Box, ...]
    plot: Box | None
    tray: Box | None
    caption: Box
    letter: float
    key: bool = False

    def places(self, count: int) -> tuple[float, list[Point]]:
        """Return the radius of balls in the tray, and where this many of them lie there."""
        if self.tray is None:
            return 0.0, []
        x0, y0, x1, y1 = self.tray
        first, radius = x0 + 6.5 * self.letter, 0.42 * (y1 - y0)
        pitch = min(2.3 * radius, (x1 - first) / max(count, 1))
        return radius, [(first + pitch * (k + 0.5), (y0 + y1) / 2) for k in range(count)]


def picture_layout(show: Show, tray: bool = False) -> Layout:
    """Lay out a sheet ten inches wide, or less if the table would be higher than 7.5 inches.

    With a ``tray`` there is room for balls that are off the table.
    """
    unit, margin, panels, seen = 4.1, 16.0, len(show.panels), show.seen
    width = min(720.0, (panels + 1) * margin + panels * 540.0 * seen.width / seen.height)
    inner = (width - (panels + 1) * margin) / panels
    around = margin + 36.0 + unit * _beside(show, tray)
    return _layout(
        show, (width, around + inner * seen.height / seen.width), unit, margin, 36.0, tray
    )


def film_layout(show: Show, size: tuple[int, int]) -> Layout:
    """Lay out a frame of ``size`` pixels: the panels, below them the plot, then the caption."""
    unit = min(size[1], 0.7 * size[0]) / 100.0
    return _layout(show, size, unit, 2.0 * unit, 6.0 * unit, bool(show.tray))


HEADINGS, SHELF, PLOT = 4.5, 6.5, 26.0  # units; the heights of headings, of a tray and of a plot


def _beside(show: Show, tray: bool) -> float:
    """Return the height (units) of what stands above and below the tables."""
    return HEADINGS * show.side_by_side + SHELF * tray + PLOT * (len(show.runs) > 1)


def _layout(
    show: Show, size: tuple[float, float], unit: float, margin: float, strip: float, tray: bool
) -> Layout:
    """Lay out tables side by side, below them the tray and the plot, then a caption in a strip.

    A plot gets what the tables leave, and beside it there is a key if a label does not fit.
    """
    (width, height), panels, letter = size, len(show.panels), 2.6 * unit
    compared = len(show.runs) > 1
    inner = (width - (panels + 1) * margin) / panels
    tall = height - margin - strip - unit * _beside(show, tray)
    if compared:
        tall = min(tall, inner * show.seen.height / show.seen.width)
    head = height - margin - HEADINGS * unit * show.side_by_side
    left = [margin + k * (inner + margin) for k in range(panels)]
    rooms = tuple(Box(x, head - tall, x + inner, head) for x in left)
    low = head - tall - SHELF * unit * tray
    shelf = Box(2 * margin, low, width - 2 * margin, head - tall - 0.6 * unit) if tray else None
    caption = Box(2 * margin, margin, width - 2 * margin, strip)
    if not compared:
        return Layout(width, height, rooms, None, shelf, caption, letter)
    run = show.runs[0]
    balls = discs(run.scene, run.at([0.0])[0][0], fit(show.seen, rooms[0], SMALL * letter))
    key = not all(ball.is_labelled_inside for ball in balls)
    longest = max(len(ball.label) for ball in balls)
    beside = -(-len(balls) // KEY_ROWS) * (2.0 + 0.55 * longest) * letter if key else 0.0
    plot = Box(13.0 * unit, strip + 6.0 * unit, width - 4.0 * unit - beside, low - 3.0 * unit)
    return Layout(width, height, rooms, plot, shelf, caption, letter, key)


# -- what stands still -------------------------------------------------------------------------


class Sheet(NamedTuple):
    """A sheet is a drawn background: a view for each panel, and the plot if there is one."""

    figure: Figure
    axes: Axes
    views: tuple[View, ...]
    plot: Axes | None


def draw_sheet(show: Show, layout: Layout, style: Style, times: tuple[float, float]) -> Sheet:
    """Draw the page, a table or plane in each room, headings, and the plot over ``times``."""
    figure, axes = canvas(layout.width, layout.height, style.page)
    scene = show.runs[0].scene
    views = tuple(fit(show.seen, room, SMALL * layout.letter) for room in layout.rooms)
    for room, view in zip(layout.rooms, views, strict=True):
        if scene.table is not None:
            draw_table(axes, scene.table, scene.pockets, view, style)
        else:
            draw_plane(axes, room, view, scene.units, style)
        draw_pockets(axes, scene.pockets, view, style)
    if show.side_by_side:
        for room, text in zip(layout.rooms, settings(show.runs), strict=True):
            at = ((room.x0 + room.x1) / 2, room.y1 + 0.6 * layout.letter)
            draw_text(axes, text, at, layout.letter, room.width, ha="center", color=style.ink)
    plot = None
    if layout.plot is not None:
        a, b = show.runs
        small = 0.85 * layout.letter
        plot = plot_distances(figure, layout.plot, (a, b), times, style, small)
        if layout.key:
            draw_key(plot, style, small)
    return Sheet(figure, axes, views, plot)


def draw_tray(sheet: Sheet, run: Run, ids: Sequence[str], layout: Layout, style: Style) -> None:
    """Draw these balls as they lie in the tray, and say what they are."""
    assert layout.tray is not None
    at = (layout.tray.x0, (layout.tray.y0 + layout.tray.y1) / 2)
    looks = {"va": "center", "color": style.faint}
    draw_text(sheet.axes, "Pocketed", at, layout.letter, 6.0 * layout.letter, **looks)
    radius, places = layout.places(len(ids))
    balls = discs(run.scene, run.at([0.0])[0][0], sheet.views[0])
    lying = [
        balls[run.scene.index[id_]]._replace(x=x, y=y, radius=radius)
        for id_, (x, y) in zip(ids, places, strict=True)
    ]
    draw_balls(sheet.axes, lying, style)


def draw_caption(sheet: Sheet, layout: Layout, text: str, style: Style, share: float = 1.0) -> None:
    """Write a line into the ``share`` of the caption's room, in the middle or from the left."""
    room = layout.caption
    x, side = ((room.x0 + room.x1) / 2, "center") if share == 1.0 else (room.x0, "left")
    draw_text(
        sheet.axes, text, (x, room.y0), layout.letter, share * room.width, ha=side, color=style.ink
    )
