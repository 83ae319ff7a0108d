"""This module decides what is shown and where it goes, and draws all that does not move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from pool_pymunk.model import Point
from pool_pymunk.render.balls import Disc, discs
from pool_pymunk.render.canvas import canvas, draw_text
from pool_pymunk.render.distance import draw_key, key_columns, plot_distances
from pool_pymunk.render.output import RenderError
from pool_pymunk.render.style import Style
from pool_pymunk.render.table import draw_plane, draw_pockets, draw_table
from pool_pymunk.render.view import Box, View, extent, fit
from pool_pymunk.results.run import Run

DOT = "  \N{MIDDLE DOT}  "
SMALL = 0.7  # the size of labels beside balls, in that of the caption's letters


@dataclass(frozen=True)
class Show:
    """A show is one run, or two of the same shot to compare.

    Two runs are on one table, one of them as a ghost, or side by side.
    """

    runs: tuple[Run, ...]
    side_by_side: bool = False

    def __post_init__(self) -> None:
        """Raise RenderError for runs that cannot be shown together."""
        if not 1 <= len(self.runs) <= 2:
            raise RenderError(f"runs = {len(self.runs)}: one can be shown, or two to compare")
        if len({tuple(ball.id for ball in run.scene.balls) for run in self.runs}) > 1:
            raise RenderError("runs of other balls cannot be compared")

    @property
    def panels(self) -> tuple[tuple[Run, ...], ...]:
        """Return the runs shown on each table; the first of them is solid, the other a ghost."""
        return tuple((run,) for run in self.runs) if self.side_by_side else (self.runs,)

    @cached_property
    def seen(self) -> Box:
        """Return the part of the plane (m) that shows all that happens."""
        return extent(self.runs[0].scene, self.runs)

    @cached_property
    def tray(self) -> tuple[str, ...]:
        """Return the balls that are beside the table at the end, in the order in which they left.

        Those that were off the table before the shot come first.
        """
        return (*self.before, *self.runs[0].pocketed)

    @property
    def before(self) -> tuple[str, ...]:
        """Return the balls that were off the table before the shot."""
        run = self.runs[0]
        gone = run.off - run.pocketed.keys()
        return tuple(ball.id for ball in run.scene.balls if ball.id in gone)

    @property
    def duration(self) -> float:
        """Return the time at which the last ball of any run stops (s)."""
        return max(run.duration for run in self.runs)

    def settings(self) -> list[str]:
        """Return the setting of each run, with the contact law if they differ in it."""
        laws = {run.law for run in self.runs} - {run.solver for run in self.runs}
        return [setting(run, with_law=len(laws) > 1) for run in self.runs]

    def caption(self, *more: str) -> str:
        """Return scenario, shot, solver and time step in one line."""
        run, names = self.runs[0], self.settings()
        if self.side_by_side:
            names = []
        elif len(names) > 1:
            names = [f"{names[0]} (ghost: {names[1]})"]
        return DOT.join(text for text in (run.scene.title, run.name, *names, *more) if text)


def setting(run: Run, with_law: bool = False) -> str:
    """Return solver and time step as "pymunk, dt = 1/240 s", with the law if it is asked for.

    A solver's own law goes without saying.
    """
    parts = [run.solver] if run.solver else []
    if run.dt is not None:
        parts.append(f"dt = {step(run.dt)} s")
    if with_law and run.law != run.solver:
        parts.append(f"{run.law} law")
    return ", ".join(parts)


def step(dt: float) -> str:
    """Return a time step as a number, or as a fraction if the number would be rounded.

    >>> step(0.0001), step(1 / 240), step(1e-6), step(0.0123)
    ('0.0001', '1/240', '1e-06', '0.0123')
    """
    number, per_second = f"{dt:g}", round(1.0 / dt)
    is_fraction = per_second > 0 and abs(per_second * dt - 1.0) < 1e-9
    return f"1/{per_second}" if is_fraction and float(number) != dt else number


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
    margin, letter, strip = 16.0, 10.5, 36.0
    panels, seen = len(show.panels), show.seen
    below = strip + (112.0 if len(show.runs) > 1 else 0.0)
    foot = below + (2.4 * letter if tray else 0.0)
    width = min(720.0, (panels + 1) * margin + panels * 540.0 * seen.width / seen.height)
    inner = (width - (panels + 1) * margin) / panels
    top = foot + inner * seen.height / seen.width
    return _layout(
        show, (width, top + margin + (1.8 * letter if panels > 1 else 0.0)), letter, margin,
        tables=(foot, top), plot=Box(66.0, strip + 22.0, width - 24.0, below - 12.0),
        tray=Box(margin, below, width - margin, foot - 4.0) if tray else None,
        caption=Box(margin, margin, width - margin, strip),
    )  # fmt: skip


def film_layout(show: Show, size: tuple[int, int]) -> Layout:
    """Lay out a frame of ``size`` pixels: the panels, below them the plot, then the caption."""
    width, height = size
    unit = min(height, 0.7 * width) / 100.0
    margin, strip = 2.0 * unit, 6.0 * unit
    panels, compared = len(show.panels), len(show.runs) > 1
    head = height - margin - (4.5 * unit if panels > 1 else 0.0)
    shelf = 6.5 * unit if show.tray else 0.0
    tall = head - strip - shelf - (26.0 * unit if compared else 0.0)
    if compared:  # The plot gets what the tables leave.
        inner = (width - (panels + 1) * margin) / panels
        tall = min(tall, inner * show.seen.height / show.seen.width)
    low = head - tall - shelf
    return _layout(
        show, size, 2.6 * unit, margin, tables=(head - tall, head),
        plot=Box(13.0 * unit, strip + 6.0 * unit, width - 4.0 * unit, low - 1.5 * margin),
        tray=Box(2 * margin, low, width - 2 * margin, low + shelf - 0.6 * unit) if shelf else None,
        caption=Box(2 * margin, margin, width - 2 * margin, strip),
    )  # fmt: skip


def _layout(
    show: Show,
    size: tuple[float, float],
    letter: float,
    margin: float,
    *,
    tables: tuple[float, float],
    plot: Box,
    tray: Box | None,
    caption: Box,
) -> Layout:
    """Return a layout whose tables stand side by side between two heights, with margins.

    There is a plot for two runs, and beside it a key if there is a label that does not fit.
    """
    (width, height), panels = size, len(show.panels)
    inner = (width - (panels + 1) * margin) / panels
    left = [margin + k * (inner + margin) for k in range(panels)]
    rooms = tuple(Box(x, tables[0], x + inner, tables[1]) for x in left)
    if len(show.runs) == 1:
        return Layout(width, height, rooms, None, tray, caption, letter)
    run = show.runs[0]
    balls = discs(run.scene, run.at([0.0])[0][0], fit(show.seen, rooms[0], SMALL * letter))
    key = not all(ball.is_labelled_inside for ball in balls)
    longest = max(len(ball.label) for ball in balls)
    beside = key_columns(len(balls)) * (2.0 + 0.55 * longest) * letter if key else 0.0
    return Layout(
        width, height, rooms, plot._replace(x1=plot.x1 - beside), tray, caption, letter, key
    )


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
        for room, text in zip(layout.rooms, show.settings(), strict=True):
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


def in_tray(run: Run, ids: Sequence[str], layout: Layout, view: View) -> list[Disc]:
    """Return these balls as they lie in the tray."""
    radius, places = layout.places(len(ids))
    balls = {ball.label: ball for ball in discs(run.scene, run.at([0.0])[0][0], view)}
    return [
        balls[id_]._replace(x=x, y=y, radius=radius)
        for id_, (x, y) in zip(ids, places, strict=True)
    ]


def draw_tray(axes: Axes, layout: Layout, style: Style) -> Text:
    """Say what the balls in the tray are."""
    assert layout.tray is not None
    at = (layout.tray.x0, (layout.tray.y0 + layout.tray.y1) / 2)
    looks = {"va": "center", "color": style.faint}
    return draw_text(axes, "Pocketed", at, layout.letter, 6.0 * layout.letter, **looks)


def draw_caption(sheet: Sheet, layout: Layout, text: str, style: Style, share: float = 1.0) -> None:
    """Write a line into the ``share`` of the caption's room, in the middle or from the left."""
    room = layout.caption
    x, side = ((room.x0 + room.x1) / 2, "center") if share == 1.0 else (room.x0, "left")
    draw_text(
        sheet.axes, text, (x, room.y0), layout.letter, share * room.width, ha=side, color=style.ink
    )
