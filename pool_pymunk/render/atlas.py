"""This module draws an atlas: what comes of a shot at every angle and speed, one shot a pixel.

Its colours can be distinguished with any kind of colour vision: ends go from blue to orange along x
and from dark to light along y, numbers go along viridis or cividis, and names have Okabe and Ito's
palette.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pool_pymunk.model.inputs import in_units, unit_of
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import dress
from pool_pymunk.render.pictures import save_figure
from pool_pymunk.render.style import SCREEN, Style, default_color
from pool_pymunk.studies.atlas import Atlas

Image = NDArray[np.uint8]  # (H, W, 3)
Pieces = Iterator[Image]  # of a map, from its lowest row on

DPI = 100.0
ROWS = 800  # Letters and margins are these for a map of this many rows, and in scale for others.
LETTER = 16.0  # points
LEFT, RIGHT, BOTTOM, TOP, GAP = 95.0, 345.0, 85.0, 60.0, 50.0  # pixels
COLD, WARM = "#1f5fd0", "#ff9d1e"
NEVER = "#3a4148"  # the colour of what did not happen
MOST_HITS = 0.995  # of the shots have no more hits than the scale
# A map is coloured and drawn in pieces of this number of rows: a pixel of three bytes takes 24 of
# them while it is coloured, and some 110 while matplotlib draws it.
AT_ONCE = 100


def atlas_picture(found: Atlas, show: str, path: Path, style: Style = SCREEN) -> None:
    """Draw an atlas; ``show`` is one of ``SHOWS``. The suffix of ``path`` gives the format."""
    height, width = len(found.speed), len(found.angle)
    size = height / ROWS
    wide, high = width + size * (LEFT + RIGHT), height + size * (BOTTOM + TOP)
    figure = Figure((wide / DPI, high / DPI), dpi=DPI, facecolor=style.page)
    foot, right = size * BOTTOM / high, size * (LEFT + GAP) + width
    axes = figure.add_axes((size * LEFT / wide, foot, width / wide, height / high))
    key = figure.add_axes((right / wide, foot, (wide - right) / wide, height / high))
    key.axis("off")
    what, draw = SHOWS[show]
    _draw_map(axes, found, draw(found, key, size * LETTER), size)
    scene, shot = found.scene, found.plan.shot
    name = f"{scene.title or 'Scene'}, {shot.name if shot else 'shot'}"
    title = f"{name}: {what.format(scene.balls[found.ball].id)}"
    axes.set_title(title, loc="left", fontsize=size * LETTER, color=style.ink, parse_math=False)
    for part in figure.findobj(Axes):
        dress(part, style, size * LETTER)
        part.spines[:].set_visible(False)
    save_figure(figure, path, DPI)


def _draw_map(axes: Axes, found: Atlas, pieces: Pieces, size: float) -> None:
    """Draw the map with its axes, and mark the shot itself."""
    both = zip(found.axes, (found.angle, found.speed), strict=True)
    (left, right), (low, high) = (_edges(found, name, values) for name, values in both)
    foot, row = low, (high - low) / len(found.speed)
    for piece in pieces:
        head = foot + len(piece) * row
        extent = (left, right, foot, head)
        axes.imshow(piece, origin="lower", extent=extent, aspect="auto", interpolation="none")
        foot = head
    across, up = (_label(found, name) for name in found.axes)
    axes.set(xlim=(left, right), ylim=(low, high), xlabel=across, ylabel=up)
    x, y = (_in_units(found, name, found.plan.own(name)) for name in found.axes)
    if left <= x <= right and low <= y <= high:
        for color, width in (("#000000", 4.5), ("#ffffff", 2.0)):
            axes.plot(x, y, "o", ms=15 * size, mfc="none", mec=color, mew=width * size)


def _in_units(found: Atlas, name: str, value: float) -> float:
    return in_units(found.scene.units, found.plan.meaning(name), value)


def _edges(found: Atlas, name: str, values: Array) -> tuple[float, float]:
    """Return where the first pixel of an axis begins and the last one ends, in its unit."""
    low, high = (_in_units(found, name, float(values[k])) for k in (0, -1))
    half = (high - low) / (len(values) - 1) / 2.0
    return low - half, high + half


def _label(found: Atlas, name: str) -> str:
    """Name an axis, with its unit."""
    unit = unit_of(found.scene.units, found.plan.meaning(name))
    text = "angle of the shot" if name == "angle" else name
    return f"{text} ({unit})" if unit else text


# -- what is shown ---------------------------------------------------------------------------------


def _ends(found: Atlas, key: Axes, letter: float) -> Pieces:
    """Colour where the ball ends; the key is the table in these colours."""
    x, y = found.end[..., 0], found.end[..., 1]
    table = found.scene.table
    if table is not None:
        x0, y0, x1, y1 = table.bounds
    else:
        (x0, x1), (y0, y1) = (np.nanquantile(v, (0.01, 0.99)) for v in (x, y))
    wide, high = max(x1 - x0, 1e-9), max(y1 - y0, 1e-9)
    u, v = np.meshgrid(np.linspace(0, 1, 240), np.linspace(0, 1, 240))
    units = found.scene.units
    extent = tuple(units.from_si(float(each), "length") for each in (x0, x1, y0, y1))
    axes = key.inset_axes((0.2, 0.5, 0.75, 0.5), anchor="NW")
    axes.imshow(_two_colors(u, v), origin="lower", extent=extent, aspect="equal")  # type: ignore[arg-type]
    axes.set(xlabel=f"x of the end ({units.length})", ylabel="y")
    return _in_pieces(
        lambda end: _two_colors((end[..., 0] - x0) / wide, (end[..., 1] - y0) / high), found.end
    )


def _in_pieces(color: Callable[[NDArray[Any]], Image], values: NDArray[Any]) -> Pieces:
    """Colour a map, some rows at once."""
    for first in range(0, len(values), AT_ONCE):
        yield color(values[first : first + AT_ONCE])


def _two_colors(u: Array, v: Array) -> Image:
    """Return colours that go from blue to orange along u, and from dark to light along v."""
    u, v = (np.clip(np.nan_to_num(each, nan=0.0), 0.0, 1.0)[..., np.newaxis] for each in (u, v))
    cold, warm = (np.array(to_rgb(color)) for color in (COLD, WARM))
    middle = np.array([0.72, 0.72, 0.72])
    hue = np.where(u < 0.5, cold + (middle - cold) * 2 * u, middle + (warm - middle) * (2 * u - 1))
    dark = hue * (0.25 + 0.75 * np.minimum(2.0 * v, 1.0))
    return _bytes(dark + (1.0 - dark) * 0.8 * np.maximum(2.0 * v - 1.0, 0.0))


def _bytes(colors: Array) -> Image:
    """Return colours as bytes, of numbers from 0 to 1."""
    return np.rint(255.0 * colors).astype(np.uint8)


def _names(
    numbers: NDArray[np.int32], names: list[str], never: str, key: Axes, letter: float
) -> Pieces:
    """Colour numbers that stand for names; -1 is what never happened."""
    colors = [NEVER, *(default_color(k + (k >= 7)) for k in range(len(names)))]
    labels = [never, *names]
    patches = [
        Patch(facecolor=colors[number + 1], label=labels[number + 1])
        for number in np.unique(numbers).tolist()
    ]
    key.legend(
        handles=patches, loc="upper left", frameon=False, fontsize=letter, borderaxespad=0.0,
        handlelength=1.2, handleheight=1.2,
    )  # fmt: skip
    palette = _bytes(np.array([to_rgb(color) for color in colors]))
    return _in_pieces(lambda some: palette[some + 1], numbers)


def _first_hits(found: Atlas, *key: Any) -> Pieces:
    return _names(found.first_hit, [f"ball {b.id}" for b in found.scene.balls], "none", *key)


def _pockets(found: Atlas, *key: Any) -> Pieces:
    return _names(found.pocketed, [hole.id for hole in found.scene.pockets], "stays", *key)


def _hits(found: Atlas, key: Axes, letter: float) -> Pieces:
    most = max(int(np.quantile(found.hits, MOST_HITS)), 1)
    return _scaled(found.hits, 0.0, most, "viridis", "number of hits", key)


def _durations(found: Atlas, key: Axes, letter: float) -> Pieces:
    low, high = np.nanquantile(found.duration, (0.005, 0.995)).tolist()
    return _scaled(found.duration, low, high, "cividis", "time until rest (s)", key)


def _scaled(
    values: NDArray[Any], low: float, high: float, name: str, label: str, key: Axes
) -> Pieces:
    """Colour numbers on a scale, which stands beside the map and is as high."""
    colors = ScalarMappable(Normalize(low, max(high, low + 1e-9), clip=True), name)
    bar = key.figure.colorbar(colors, cax=key.inset_axes((0.0, 0.0, 0.12, 1.0)), label=label)
    bar.outline.set_visible(False)
    return _in_pieces(lambda some: colors.to_rgba(np.nan_to_num(some), bytes=True)[..., :3], values)


SHOWS: dict[str, tuple[str, Callable[[Atlas, Axes, float], Pieces]]] = {
    "end": ("where ball {} ends", _ends),
    "first-hit": ("which ball is met first", _first_hits),
    "hits": ("how many hits there are", _hits),
    "pocket": ("which pocket takes ball {}", _pockets),
    "duration": ("when all balls rest", _durations),
}
