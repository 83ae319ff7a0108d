"""This module draws an atlas: what comes of a shot at every angle and speed, one shot a pixel.

Its colours can be told apart with any kind of colour vision: ends go from blue to orange along x
and from dark to light along y, numbers go along viridis or cividis, and names have Okabe and Ito's
palette.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pool_pymunk.model.inputs import in_units, unit_of
from pool_pymunk.render.style import SCREEN, Style, default_color
from pool_pymunk.safety.files import whole
from pool_pymunk.studies.atlas import Atlas, Floats

Image = NDArray[np.uint8]  # (H, W, 3)
Pieces = Iterator[Image]  # of a map, from its lowest row on

DPI = 100.0
SMALL, LARGE = 13.0, 17.0  # points, for a map of 800 rows
MARGIN = (1.0, 2.5, 0.9, 0.65)  # inches left, right, bottom and top of a map of 800 rows
COLD, WARM = "#1f5fd0", "#ff9d1e"
NEVER = "#3a4148"  # the colour of what did not happen
MOST_HITS = 0.995  # of the shots have no more hits than the scale
# A map is coloured and drawn in pieces of this number of rows: a pixel of three bytes takes 24 of
# them while it is coloured, and some 110 while matplotlib draws it.
AT_ONCE = 100


def atlas_picture(found: Atlas, show: str, path: Path, style: Style = SCREEN) -> None:
    """Draw an atlas; ``show`` is one of ``SHOWS``. The suffix of ``path`` gives the format."""
    height, width = len(found.speed), len(found.angle)
    size = height / 800.0
    left, right, bottom, top = (size * inches for inches in MARGIN)
    inches = (width / DPI + left + right, height / DPI + bottom + top)
    figure = Figure(inches, dpi=DPI, facecolor=style.page)
    box = (left / inches[0], bottom / inches[1], width / DPI / inches[0], height / DPI / inches[1])
    axes = figure.add_axes(box)
    side = figure.add_axes(
        (box[0] + box[2] + 0.55 * size / inches[0], box[1], 1.75 * size / inches[0], box[3])
    )
    side.axis("off")
    pieces = SHOWS[show](found, side, size, style)
    _draw_map(axes, found, pieces, size, style)
    axes.set_title(_title(found, show), fontsize=LARGE * size, color=style.ink, loc="left")
    with whole(path) as part:
        figure.savefig(part, dpi=DPI, facecolor=style.page)


def _title(found: Atlas, show: str) -> str:
    scene, shot = found.scene, found.plan.shot
    ball = scene.balls[found.ball].id
    what = {
        "end": f"where ball {ball} ends",
        "pocket": f"which pocket takes ball {ball}",
        "first-hit": "which ball is met first",
        "hits": "how many hits there are",
        "duration": "when all balls rest",
    }[show]
    return f"{scene.title or 'Scene'}, {shot.name if shot else 'shot'}: {what}"


def _draw_map(axes: Axes, found: Atlas, pieces: Pieces, size: float, style: Style) -> None:
    """Draw the map with its axes, and mark the shot itself."""
    both = zip(found.axes, (found.angle, found.speed), strict=True)
    (left, right), (low, top) = (_edges(found, name, values) for name, values in both)
    extent, row = (left, right, low, top), (top - low) / len(found.speed)
    for piece in pieces:
        high = low + len(piece) * row
        axes.imshow(piece, origin="lower", extent=(*extent[:2], low, high), aspect="auto",
                    interpolation="none")  # fmt: skip
        low = high
    axes.set(xlim=extent[:2], ylim=extent[2:])
    axes.set_xlabel(_label(found, found.axes[0]), fontsize=LARGE * size, color=style.ink)
    axes.set_ylabel(_label(found, found.axes[1]), fontsize=LARGE * size, color=style.ink)
    axes.tick_params(labelsize=SMALL * size, colors=style.ink)
    for spine in axes.spines.values():
        spine.set_visible(False)
    x, y = (_in_units(found, name, found.plan.own(name)) for name in found.axes)
    if left <= x <= right and extent[2] <= y <= top:
        for color, width in (("#000000", 4.5), ("#ffffff", 2.0)):
            axes.plot(
                x, y, "o", markersize=15 * size, markerfacecolor="none",
                markeredgecolor=color, markeredgewidth=width * size,
            )  # fmt: skip


def _in_units(found: Atlas, name: str, value: float) -> float:
    return in_units(found.scene.units, found.plan.meaning(name), value)


def _edges(found: Atlas, name: str, values: Floats) -> tuple[float, float]:
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


def _ends(found: Atlas, side: Axes, size: float, style: Style) -> Pieces:
    """Colour where the ball ends; the legend is the table in these colours."""
    x, y = found.end[..., 0], found.end[..., 1]
    table = found.scene.table
    if table is not None:
        x0, y0, x1, y1 = table.bounds
    else:
        (x0, x1), (y0, y1) = (np.nanquantile(v, (0.01, 0.99)) for v in (x, y))
    wide, high = max(x1 - x0, 1e-9), max(y1 - y0, 1e-9)
    legend = _inset(side, (0.0, 0.78, 1.0, 0.2))
    u, v = np.meshgrid(np.linspace(0, 1, 120), np.linspace(0, 1, 60))
    units = found.scene.units
    extent = tuple(units.from_si(float(each), "length") for each in (x0, x1, y0, y1))
    legend.imshow(_two_ways(u, v), origin="lower", extent=extent, aspect="equal")  # type: ignore[arg-type]
    legend.tick_params(labelsize=SMALL * size, colors=style.ink)
    legend.set_xlabel(f"x of the end ({units.length})", fontsize=SMALL * size, color=style.ink)
    legend.set_ylabel("y", fontsize=SMALL * size, color=style.ink, rotation=0.0)
    return _in_pieces(
        lambda end: _two_ways((end[..., 0] - x0) / wide, (end[..., 1] - y0) / high), found.end
    )


def _in_pieces(color: Callable[[NDArray[Any]], Image], values: NDArray[Any]) -> Pieces:
    """Colour a map, some rows at once."""
    for first in range(0, len(values), AT_ONCE):
        yield color(values[first : first + AT_ONCE])


def _two_ways(u: Floats, v: Floats) -> Image:
    """Return colours that go from blue to orange along u, and from dark to light along v."""
    u, v = (np.clip(np.nan_to_num(each, nan=0.0), 0.0, 1.0)[..., np.newaxis] for each in (u, v))
    cold, warm = (np.array(to_rgb(color)) for color in (COLD, WARM))
    middle = np.array([0.72, 0.72, 0.72])
    hue = np.where(u < 0.5, cold + (middle - cold) * 2 * u, middle + (warm - middle) * (2 * u - 1))
    dark = hue * (0.25 + 0.75 * np.minimum(2.0 * v, 1.0))
    return _bytes(dark + (1.0 - dark) * 0.8 * np.maximum(2.0 * v - 1.0, 0.0))


def _bytes(colors: Floats) -> Image:
    """Return colours as bytes, of numbers from 0 to 1."""
    return np.rint(255.0 * colors).astype(np.uint8)


def _names(
    numbers: NDArray[np.int32], names: list[str], never: str, side: Axes, size: float, style: Style
) -> Pieces:
    """Colour numbers that stand for names; -1 is what never happened."""
    there = np.unique(numbers).tolist()
    colors = {number: default_color(k + (k >= 7)) for k, number in enumerate(range(len(names)))}
    rows = np.array([to_rgb(NEVER), *(to_rgb(colors[number]) for number in range(len(names)))])
    patches = [
        Patch(facecolor=rows[number + 1], label=never if number < 0 else names[number])
        for number in there
    ]
    side.legend(
        handles=patches, loc="upper left", frameon=False, fontsize=LARGE * size * 0.85,
        labelcolor=style.ink, borderaxespad=0.0, handlelength=1.2, handleheight=1.2,
    )  # fmt: skip
    palette = _bytes(rows)
    return _in_pieces(lambda some: palette[some + 1], numbers)


def _first_hits(found: Atlas, side: Axes, size: float, style: Style) -> Pieces:
    names = [f"ball {ball.id}" for ball in found.scene.balls]
    return _names(found.first_hit, names, "none", side, size, style)


def _pockets(found: Atlas, side: Axes, size: float, style: Style) -> Pieces:
    names = [hole.id for hole in found.scene.pockets]
    return _names(found.pocketed, names, "stays", side, size, style)


def _hits(found: Atlas, side: Axes, size: float, style: Style) -> Pieces:
    most = max(int(np.quantile(found.hits, MOST_HITS)), 1)
    return _scaled(found.hits, (0.0, float(most)), "viridis", "hits", side, size, style)


def _durations(found: Atlas, side: Axes, size: float, style: Style) -> Pieces:
    low, high = np.nanquantile(found.duration, (0.005, 0.995)).tolist()
    return _scaled(found.duration, (low, high), "cividis", "rest (s)", side, size, style)


def _scaled(
    values: NDArray[Any],
    limits: tuple[float, float],
    name: str,
    label: str,
    side: Axes,
    size: float,
    style: Style,
) -> Pieces:
    """Colour numbers on a scale."""
    low, high = limits
    scale, colors = Normalize(low, max(high, low + 1e-9), clip=True), colormaps[name]
    legend = _inset(side, (0.0, 0.45, 0.22, 0.5))
    strip = ListedColormap(colors(np.linspace(0, 1, 256)))
    legend.imshow(
        np.linspace(0, 1, 256)[:, np.newaxis], cmap=strip, origin="lower", aspect="auto",
        extent=(0.0, 1.0, low, high),
    )  # fmt: skip
    legend.set_xticks([])
    legend.yaxis.tick_right()
    legend.tick_params(labelsize=SMALL * size, colors=style.ink)
    legend.set_title(label, fontsize=SMALL * size, color=style.ink, loc="left")
    return _in_pieces(lambda some: colors(scale(np.nan_to_num(some)), bytes=True)[..., :3], values)


def _inset(side: Axes, box: tuple[float, float, float, float]) -> Axes:
    inset = side.inset_axes(box)
    for spine in inset.spines.values():
        spine.set_visible(False)
    return inset


SHOWS: dict[str, Callable[[Atlas, Axes, float, Style], Pieces]] = {
    "end": _ends,
    "first-hit": _first_hits,
    "hits": _hits,
    "pocket": _pockets,
    "duration": _durations,
}
