"""This module makes figures: an empty canvas measured in points, text on it, its pixels, plots.

It also draws into pixels, fast. A frame is an array (height, width, 3) of uint8, with row 0 on top.
Positions are in pixels from the lower left corner, as on the canvas (a point is a pixel in a film).
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, size
from pool_pymunk.render.style import Style
from pool_pymunk.safety.files import RenderError, whole

Pixels = NDArray[np.uint8]
FORMATS = (".png", ".svg", ".pdf")
POINTS_PER_INCH = 72.0
BESIDE = 2.0  # pixels; points that `_outlines` finds are this far apart
FINE = 4  # Sprites are drawn this many times finer than the frame, and placed as finely.


class Figure(matplotlib.figure.Figure):
    """A notebook shows this figure as a picture, with or without ``%matplotlib inline``.

    >>> Figure((2.0, 1.0))._repr_png_()[1:4]
    b'PNG'
    """

    def _repr_png_(self) -> bytes:
        """Return the picture as a PNG file."""
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()


def save_figure(figure: Figure, path: Path | str, dpi: float = 200.0) -> None:
    """Write a figure to a file, whole or not at all; the suffix says the format."""
    if Path(path).suffix.lower() not in FORMATS:
        raise RenderError(f"{path}: a picture's name must end in one of {', '.join(FORMATS)}")
    with whole(Path(path)) as part:
        figure.savefig(part, dpi=argument("dpi", dpi, size))


def canvas(width: float, height: float, color: str = "none") -> tuple[Figure, Axes]:
    """Return a canvas of ``width`` x ``height`` points, y upwards; clear without a ``color``."""
    inches = (width / POINTS_PER_INCH, height / POINTS_PER_INCH)
    figure = Figure(inches, dpi=POINTS_PER_INCH, facecolor=color)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(0.0, height))
    axes.axis("off")
    return figure, axes


def pixels(figure: Figure, per_point: float = 1.0) -> Pixels:
    """Return red, green, blue and alpha, (height, width, 4), with ``per_point`` pixels a point."""
    figure.set_dpi(per_point * POINTS_PER_INCH)
    agg = FigureCanvasAgg(figure)
    agg.draw()  # type: ignore[no-untyped-call]
    return np.array(agg.buffer_rgba())  # type: ignore[no-untyped-call]


def draw_text(axes: Axes, text: str, at: Point, size: float, room: float, **looks: Any) -> None:
    """Write a line of text in ``size`` points, or smaller if it is wider than ``room`` points."""
    drawn = axes.text(*at, text, fontsize=size, parse_math=False, **looks)
    drawn.set_fontsize(size * min(room / max(drawn.get_window_extent().width, 1e-9), 1.0))


Label = tuple[str, Point, str]  # text that belongs to a point of a plot, and its colour
# These are the sides of a point on which its label may stand, the best first, in points.
SIDES: tuple[tuple[float, float, str, str], ...] = (
    (10, 0, "left", "center"), (-10, 0, "right", "center"), (0, 9, "center", "bottom"),
    (0, -9, "center", "top"), (9, 9, "left", "bottom"), (9, -9, "left", "top"),
    (-9, 9, "right", "bottom"), (-9, -9, "right", "top"), (26, -14, "left", "top"),
    (26, 14, "left", "bottom"), (-26, -14, "right", "top"), (-26, 14, "right", "bottom"),
    (0, -26, "center", "top"), (0, 26, "center", "bottom"),
)  # fmt: skip
ALIGNED = {"left": 0.0, "bottom": 0.0, "center": 0.5, "right": 1.0, "top": 1.0}


def place_labels(axes: Axes, labels: Sequence[Label], **looks: Any) -> None:
    """Write each label beside its point, where it covers least of lines, arrows and labels."""
    taken = [text.get_window_extent() for text in axes.texts]
    drawn, room, points = _outlines(axes), axes.get_window_extent(), axes.figure.dpi / 72.0
    for text, at, color in labels:
        looks |= {"textcoords": "offset points", "linespacing": 1.25, "zorder": 4}
        note = axes.annotate(text, at, (0, 0), color=color, **looks)
        place, size = axes.transData.transform(at), note.get_window_extent().size
        found = []
        for side in SIDES:
            x, y = place + points * np.array(side[:2])
            (width, height), (across, up) = size, (ALIGNED[name] for name in side[2:])
            box = Bbox.from_bounds(x - across * width, y - up * height, width, height)
            inside = int(((drawn > box.min) & (drawn < box.max)).all(axis=1).sum())
            out = box.x0 < room.x0 or box.x1 > room.x1 or box.y0 < room.y0
            found.append((inside + 1e3 * box.count_overlaps(taken) + 1e4 * bool(out), side, box))
        _, side, box = min(found, key=lambda one: one[0])
        note.xyann = side[:2]
        note.set(ha=side[2], va=side[3])
        taken.append(box)


def _outlines(axes: Axes) -> Array:
    """Return points (N, 2), in pixels, on all lines, arrows and outlines of a plot."""
    points = [np.empty((0, 2))]
    drawn: list[Any] = [*axes.lines, *axes.patches]
    for artist in (one for one in drawn if one.get_linewidth() > 0.0):
        path = artist.get_transform().transform_path(artist.get_path())
        for corners in path.to_polygons(closed_only=False):
            gone = np.append(0.0, np.cumsum(np.hypot(*np.diff(corners, axis=0).T)))
            at = np.arange(0.0, gone[-1], BESIDE)
            points.append(np.column_stack([np.interp(at, gone, part) for part in corners.T]))
    return np.concatenate(points)


def dress(axes: Axes, style: Style, letter: float | None = None) -> None:
    """Give a plot the page's colours, only the left and lower axis, and letters of a size."""
    axes.set_facecolor("none")
    axes.tick_params(colors=style.ink, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(style.faint)
    legend = axes.get_legend()
    labels = (axes.xaxis.label, axes.yaxis.label, axes.title)
    for words in (*labels, *axes.texts, *(legend.get_texts() if legend else ())):
        words.set_color(style.ink)
    if letter is not None:
        axes.tick_params(labelsize=0.85 * letter, length=0.25 * letter, pad=0.25 * letter)
        for words in labels:
            words.set_fontsize(letter)


class Sprite:
    """A sprite is a small picture with soft edges, drawn FINE times finer than the frame."""

    def __init__(self, fine: Pixels) -> None:
        self.half = len(fine) // FINE // 2
        self._fine = np.pad(fine, ((FINE, 2 * FINE), (FINE, 2 * FINE), (0, 0)))
        self._shifted: dict[tuple[int, int], tuple[NDArray[np.uint16], NDArray[np.uint16]]] = {}

    def stamp(self, frame: Pixels, x: float, y: float, strength: float = 1.0) -> None:
        """Put the sprite's middle at (x, y), unless that is NaN, with a ``strength`` in [0, 1]."""
        if strength <= 0.0 or not math.isfinite(x + y):
            return
        column, across = divmod(round(x * FINE), FINE)
        row, down = divmod(round((frame.shape[0] - y) * FINE), FINE)
        if (across, down) not in self._shifted:  # 255 x the light there, and 255 - alpha
            n = 2 * self.half + 1
            fine = self._fine[FINE - down :, FINE - across :][: n * FINE, : n * FINE]
            total = fine.reshape(n, FINE, n, FINE, 4).sum(axis=(1, 3), dtype=np.float32)
            light = np.rint(total[..., :3] * (255.0 / FINE**2)).astype(np.uint16)
            clear = np.rint(255.0 - total[..., 3:] / FINE**2).astype(np.uint16)
            self._shifted[across, down] = np.minimum(light, 255 * (255 - clear)), clear
        light, clear = self._shifted[across, down]
        top, left = row - self.half, column - self.half
        r0, r1 = max(top, 0), min(top + len(light), frame.shape[0])
        c0, c1 = max(left, 0), min(left + len(light), frame.shape[1])
        if r0 < r1 and c0 < c1:
            part = np.s_[r0 - top : r1 - top, c0 - left : c1 - left]
            under = frame[r0:r1, c0:c1]
            drawn = (light[part] + under * clear[part] + 127) // 255
            if strength < 1.0:
                drawn = np.rint(under + strength * (drawn.astype(np.float32) - under))
            frame[r0:r1, c0:c1] = drawn


def window(frame: Pixels, box: Array) -> tuple[slice, slice, Array, Array] | None:
    """Return rows and columns of a box (x0, y0, x1, y1), and its pixels' x (1, c) and y (r, 1)."""
    if not np.isfinite(box).all():
        return None
    height, width = frame.shape[:2]
    c0, c1 = max(int(box[0]), 0), min(int(box[2]) + 1, width)
    r0, r1 = max(int(height - box[3]), 0), min(int(height - box[1]) + 1, height)
    if c0 >= c1 or r0 >= r1:
        return None
    x = np.arange(c0, c1, dtype=np.float32)[None, :] + 0.5
    y = height - np.arange(r0, r1, dtype=np.float32)[:, None] - 0.5
    return slice(r0, r1), slice(c0, c1), x, y


def mixed(under: Pixels, over: Pixels | Array, share: NDArray[Any]) -> Pixels:
    """Return pixels with a ``share``, in [0, 1], of others over them."""
    change = np.subtract(over, under, dtype=np.float32)
    pixels: Pixels = (under + share[..., None] * change + np.float32(0.5)).astype(np.uint8)
    return pixels


def glow(
    frame: Pixels, at: Point, radius: float, soft: float, color: Array, strength: float
) -> None:
    """Draw a ring of light around ``at``, which fades over ``soft`` pixels on both sides."""
    (x0, y0), extent = at, radius + 2.2 * soft
    seen = window(frame, np.array([x0 - extent, y0 - extent, x0 + extent, y0 + extent]))
    if seen is not None:
        rows, columns, x, y = seen
        distance = np.sqrt((x - x0) ** 2 + (y - y0) ** 2)
        share = strength * np.exp(-(((distance - radius) / soft) ** 2))
        frame[rows, columns] = mixed(frame[rows, columns], color, share)
