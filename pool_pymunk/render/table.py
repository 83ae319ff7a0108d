"""This module draws the table from above, whatever its outline, or an open plane."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.collections import CircleCollection, LineCollection
from matplotlib.patches import Circle, Polygon

from pool_pymunk.model import Pocket, Point, Table, Units
from pool_pymunk.render.style import Style
from pool_pymunk.render.view import CUSHION, RAIL, Box, View

SHARPEST_MITRE = math.radians(60.0)  # A sharper corner of the cushions is drawn round.


def draw_table(
    axes: Axes, table: Table, pockets: Sequence[Pocket], view: View, style: Style
) -> None:
    """Draw wooden rails, cushions and cloth, each as a wide stroke around what lies on it.

    Rails have no sights where pockets are.
    """
    x0, y0, x1, y1 = table.bounds
    short = min(x1 - x0, y1 - y0) * view.scale
    cushion, rail, thin = CUSHION * short, (CUSHION + RAIL) * short, 0.006 * short
    corners = [view.place(corner) for corner in table.outline]
    mitre: Join = "round" if is_sharp(table) else "miter"
    _stroke(axes, corners, style.rail_edge, rail, "round")
    _stroke(axes, corners, style.rail, rail - thin, "round")
    _stroke(axes, corners, style.inlay, cushion + thin, mitre)
    _stroke(axes, corners, style.cushion, cushion, mitre)
    _stroke(axes, corners, style.nose, thin / 2, mitre)
    cloth = Polygon(corners, facecolor=style.cloth, edgecolor="none", zorder=1.1)
    axes.add_artist(cloth)
    for k in range(1, 7):  # This is the cushions' soft shadow.
        shade = _stroke(axes, corners, "#000000", 0.12 * k * cushion, "round")
        shade.set(alpha=0.05, zorder=1.2)
        shade.set_clip_path(cloth)
    places = [view.place(point) for point in sights(table, pockets)]
    _dots(axes, places, 0.007 * short, style.sight)


def draw_pockets(axes: Axes, pockets: Sequence[Pocket], view: View, style: Style) -> None:
    """Draw the circles within which pockets take the centres of balls, each with a lip."""
    for hole in pockets:
        radius = view.scale * hole.radius
        place = view.place(hole.position)
        for size, color in ((1.0, style.lip), (0.9, style.hole)):
            axes.add_artist(Circle(place, size * radius, facecolor=color, linewidth=0, zorder=1.4))


Join = Literal["miter", "round"]


def _stroke(axes: Axes, corners: list[Point], color: str, width: float, join: Join) -> Polygon:
    """Draw a line that reaches ``width`` points to either side of the outline."""
    line = Polygon(corners, facecolor="none", edgecolor=color, linewidth=2.0 * width, zorder=1.0)
    line.set_joinstyle(join)
    axes.add_artist(line)
    return line


def is_sharp(table: Table) -> bool:
    """Tell whether the table has a corner that is too sharp for a mitre."""
    headings = [math.atan2(edge.tangent[1], edge.tangent[0]) for edge in table.edges]
    turns = [b - a for a, b in zip(headings, headings[1:] + headings[:1], strict=True)]
    return min(math.pi - math.remainder(turn, math.tau) for turn in turns) <= SHARPEST_MITRE


def sights(table: Table, pockets: Sequence[Pocket]) -> Iterator[Point]:
    """Yield points on the rails (m), but for those near pockets."""
    x0, y0, x1, y1 = table.bounds
    out = (CUSHION + RAIL / 2) * min(x1 - x0, y1 - y0)
    for point in _along_rails(table, out):
        if all(math.dist(point, hole.position) > 2.0 * hole.radius for hole in pockets):
            yield point


def _along_rails(table: Table, out: float) -> Iterator[Point]:
    """Yield points on the rails, ``out`` (m) from the noses of the cushions.

    They are quarters of the shortest side apart. None lie near a corner that sticks out into the
    table, because the rails have no room for them there.
    """
    step = min(edge.length for edge in table.edges) / 4.0
    for k, edge in enumerate(table.edges):
        low = 2.0 * out if k in table.reflex_corners else 0.0
        high = 2.0 * out if (k + 1) % len(table.edges) in table.reflex_corners else 0.0
        parts = min(round(edge.length / step), 40)
        for s in (edge.length * part / parts for part in range(1, parts)):
            if low < s < edge.length - high:
                yield (
                    edge.start[0] + s * edge.tangent[0] - out * edge.normal[0],
                    edge.start[1] + s * edge.tangent[1] - out * edge.normal[1],
                )


def _dots(axes: Axes, points: list[Point], radius: float, color: str) -> None:
    dots = CircleCollection(
        [math.pi * radius**2], offsets=points, offset_transform=axes.transData, facecolor=color,
        edgecolor="none", zorder=1.3,
    )  # fmt: skip
    axes.add_collection(dots, autolim=False)


def draw_plane(axes: Axes, room: Box, view: View, units: Units, style: Style) -> None:
    """Draw an open plane: a calm sheet with a faint grid, and a bar that shows its pitch.

    The pitch is a round number in the scenario's ``units``.
    """
    corners = [(room.x0, room.y0), (room.x1, room.y0), (room.x1, room.y1), (room.x0, room.y1)]
    axes.add_artist(Polygon(corners, facecolor=style.plane, edgecolor="none", zorder=1.0))
    unit = view.scale * units.to_si(1.0, "length")
    count = round_number(0.16 * room.width / unit)
    pitch = count * unit
    xs = _grid(view.x, pitch, room.x0, room.x1)
    ys = _grid(view.y, pitch, room.y0, room.y1)
    upright = [[(x, room.y0), (x, room.y1)] for x in xs]
    level = [[(room.x0, y), (room.x1, y)] for y in ys]
    grid = LineCollection(upright + level, colors=style.grid, linewidths=0.8, zorder=1.1)
    axes.add_collection(grid, autolim=False)
    _scale_bar(axes, room, pitch, f"{count:g} {units.length}", view.letter, style)


def round_number(most: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not more than ``most``.

    >>> round_number(7.3), round_number(0.049), round_number(100.0)
    (5.0, 0.02, 100.0)
    """
    power = 10.0 ** math.floor(math.log10(most))
    return next(k * power for k in (5.0, 2.0, 1.0) if k * power <= most)


def _scale_bar(
    axes: Axes, room: Box, length: float, text: str, letter: float, style: Style
) -> None:
    """Draw a bar of so many points in the lower left corner, with ``text`` over it."""
    x, y, tick = room.x0 + 1.2 * letter, room.y0 + 1.2 * letter, 0.35 * letter
    bar = [[(x, y + tick), (x, y), (x + length, y), (x + length, y + tick)]]
    lines = LineCollection(bar, colors=style.ink, linewidths=0.2 * letter, zorder=1.3)
    axes.add_collection(lines, autolim=False)
    axes.text(
        x + length / 2, y + 0.5 * letter, text, fontsize=1.2 * letter, color=style.ink,
        ha="center", va="bottom", parse_math=False, zorder=1.3,
    )  # fmt: skip


def _grid(origin: float, pitch: float, low: float, high: float) -> list[float]:
    """Return where the grid's lines lie between two points of the canvas."""
    first, last = math.ceil((low - origin) / pitch), math.floor((high - origin) / pitch)
    return [origin + k * pitch for k in range(first, last + 1)]
