"""This module draws an atlas: the outcome of a shot at every angle and speed, each one a pixel.

Its colours can be distinguished with any kind of colour vision.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import in_units, unit_of
from pool_pymunk.render.canvas import Figure, dress, save_figure
from pool_pymunk.render.style import SCREEN, Style, default_color
from pool_pymunk.studies.atlas import Atlas

Image = NDArray[np.uint8]  # (H, W, 3)
Pieces = Iterator[Image]  # of a map, from its lowest row on

DPI = 100.0
ROWS = 800  # The sizes below are for a map of this many rows, and in proportion for others.
LETTER = 16.0  # points
LEFT, BOTTOM, TOP, GAP = 95.0, 85.0, 60.0, 50.0  # pixels
RIGHT, WIDE = 345.0, 470.0  # pixels; the room of a bar or of names, and of a table in colours
COLD, WARM = "#1f5fd0", "#ff9d1e"
NEVER = "#3a4148"  # the colour of what did not happen
TITLES = {
    "end": "where ball {} ends",
    "first-hit": "which ball is met first",
    "hits": "how many hits there are",
    "pocket": "which pocket takes ball {}",
    "duration": "when all balls rest",
}
TURNED = "turned from the shot's angle"  # All angles of an atlas are relative to the shot's.
MOST_HITS = 0.995  # This share of the shots has no more hits than the scale shows.
# A map is coloured and drawn in pieces of this number of rows: a pixel takes 24 bytes while it is
# coloured, and about 110 bytes while matplotlib draws it.
AT_ONCE = 100


def atlas_picture(found: Atlas, show: str, path: Path, style: Style = SCREEN) -> None:
    """Draw an atlas; ``show`` is one of ``TITLES``. The suffix of ``path`` gives the format."""
    height, width = len(found.speed), len(found.angle)
    size = height / ROWS
    beside = WIDE if show == "end" else RIGHT
    wide, high = width + size * (LEFT + beside), height + size * (BOTTOM + TOP)
    figure = Figure((wide / DPI, high / DPI), dpi=DPI, facecolor=style.page)
    foot, right = size * BOTTOM / high, size * (LEFT + GAP) + width
    axes = figure.add_axes((size * LEFT / wide, foot, width / wide, height / high))
    key = figure.add_axes((right / wide, foot, (wide - right) / wide, height / high))
    key.axis("off")
    _draw_map(axes, found, _colored(found, show, key, size * LETTER), size)
    scene, shot = found.scene, found.plan.begun.struck
    what = TITLES[show].format(scene.balls[found.ball].id)
    title = f"{scene.title or 'Scene'}, {shot.name if shot else 'shot'}: {what}"
    axes.set_title(title, loc="left", fontsize=size * LETTER, color=style.ink, parse_math=False)
    for part in figure.findobj(Axes):
        dress(part, style, size * LETTER)
        part.spines[:].set_visible(False)
    save_figure(figure, path, DPI)


def _draw_map(axes: Axes, found: Atlas, pieces: Pieces, size: float) -> None:
    """Draw the map with its axes, and mark the shot itself."""
    across, up = found.axes
    left, right, x, xlabel = _axis(found, across, found.angle)
    low, high, y, ylabel = _axis(found, up, found.speed)
    foot, row = low, (high - low) / len(found.speed)
    for piece in pieces:
        head = foot + len(piece) * row
        extent = (left, right, foot, head)
        axes.imshow(piece, origin="lower", extent=extent, aspect="auto", interpolation="none")
        foot = head
    axes.set(xlim=(left, right), ylim=(low, high), xlabel=xlabel, ylabel=ylabel)
    if left <= x <= right and low <= y <= high:
        for color, width in (("#000000", 4.5), ("#ffffff", 2.0)):
            axes.plot(x, y, "o", ms=15 * size, mfc="none", mec=color, mew=width * size)


def _axis(found: Atlas, name: str, values: Array) -> tuple[float, float, float, str]:
    """Return where the pixels of an axis begin and end, the shot's own value, and the label."""
    units, meaning = found.scene.units, found.plan.meaning(name)
    low, high, own = (
        in_units(units, meaning, float(v)) for v in (*values[[0, -1]], found.plan.own(name))
    )
    half = (high - low) / (len(values) - 1) / 2.0
    unit, text = unit_of(units, meaning), TURNED if meaning == "turn" else name
    return low - half, high + half, own, f"{text} ({unit})" if unit else text


def _colored(found: Atlas, show: str, key: Axes, letter: float) -> Pieces:
    """Colour what is shown of every shot, and draw the key to the colours."""
    if show == "end":
        return _ends(found, key)
    if show == "first-hit":
        balls = [f"ball {ball.id}" for ball in found.scene.balls]
        return _names(found.first_hit, balls, "none", key, letter)
    if show == "pocket":
        holes = [hole.id for hole in found.scene.pockets]
        return _names(found.pocketed, holes, "stays", key, letter)
    if show == "hits":
        most = max(int(np.quantile(found.hits, MOST_HITS)), 1)
        return _scaled(found.hits, (0.0, most), "viridis", "number of hits", key)
    low, high = np.nanquantile(found.duration, (0.005, 0.995)).tolist()
    return _scaled(found.duration, (low, high), "cividis", "time until rest (s)", key)


def _ends(found: Atlas, key: Axes) -> Pieces:
    """Colour where the ball ends; the key is the table in these colours."""
    table, units = found.scene.table, found.scene.units
    if table is not None:
        x0, y0, x1, y1 = table.bounds
    else:
        (x0, y0), (x1, y1) = np.nanquantile(found.end, (0.01, 0.99), axis=(0, 1)).tolist()
    size = max(x1 - x0, 1e-9), max(y1 - y0, 1e-9)
    extent = tuple(units.from_si(each, "length") for each in (x0, x1, y0, y1))
    axes = key.inset_axes((0.12, 0.0, 0.83, 1.0), anchor="NW")
    shares = np.stack(np.meshgrid(*[np.linspace(0, 1, 240)] * 2), axis=-1)
    axes.imshow(_two_colors(shares), origin="lower", extent=extent, aspect="equal")  # type: ignore[arg-type]
    axes.set(xlabel=f"x ({units.length})", ylabel=f"y ({units.length})")
    axes.set_title("the colour of an end")
    axes.locator_params(nbins=5)
    return _in_pieces(lambda end: _two_colors((end - (x0, y0)) / size), found.end)


def _in_pieces(color: Callable[[NDArray[Any]], Image], values: NDArray[Any]) -> Pieces:
    """Colour a map, some rows at once."""
    for first in range(0, len(values), AT_ONCE):
        yield color(values[first : first + AT_ONCE])


def _two_colors(shares: Array) -> Image:
    """Return colours from blue to orange along x and from dark to light along y, each in [0, 1]."""
    u, v = np.moveaxis(np.clip(np.nan_to_num(shares, nan=0.0), 0.0, 1.0)[..., np.newaxis], -2, 0)
    cold, warm = (np.array(to_rgb(color)) for color in (COLD, WARM))
    middle = np.array([0.72, 0.72, 0.72])
    hue = np.where(u < 0.5, cold + (middle - cold) * 2 * u, middle + (warm - middle) * (2 * u - 1))
    dark = hue * (0.25 + 0.75 * np.minimum(2.0 * v, 1.0))
    light = dark + (1.0 - dark) * 0.8 * np.maximum(2.0 * v - 1.0, 0.0)
    colors: Image = np.rint(255.0 * light).astype(np.uint8)
    return colors


def _names(
    numbers: NDArray[np.int32], names: list[str], never: str, key: Axes, letter: float
) -> Pieces:
    """Colour numbers that stand for names; -1 is what never happened."""
    colors = [NEVER, *(default_color(k + (k >= 7)) for k in range(len(names)))]
    counted = zip(*np.unique(numbers, return_counts=True), strict=True)
    patches = [
        Patch(facecolor=colors[k + 1], label=f"{(never, *names)[k + 1]}, {n / numbers.size:.1%}")
        for k, n in counted
    ]
    key.legend(
        handles=patches, loc="upper left", frameon=False, fontsize=letter, borderaxespad=0.0,
        handlelength=1.2, handleheight=1.2,
    )  # fmt: skip
    palette = np.rint(255.0 * np.array([to_rgb(color) for color in colors])).astype(np.uint8)
    return _in_pieces(lambda some: palette[some + 1], numbers)


def _scaled(
    values: NDArray[Any], scale: tuple[float, float], name: str, label: str, key: Axes
) -> Pieces:
    """Colour numbers on a scale, which stands beside the map and is as high."""
    low, high = scale
    colors = ScalarMappable(Normalize(low, max(high, low + 1e-9), clip=True), name)
    bar = key.figure.colorbar(colors, cax=key.inset_axes((0.0, 0.0, 0.12, 1.0)), label=label)
    bar.outline.set_visible(False)
    return _in_pieces(lambda some: colors.to_rgba(np.nan_to_num(some), bytes=True)[..., :3], values)
