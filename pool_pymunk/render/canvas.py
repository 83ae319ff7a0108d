"""This module makes figures: an empty canvas measured in points, text on it, its pixels, plots.

It also has what films are put together from: pictures (Pillow) with covers that say where they hide
what is below. Positions are in pixels from the lower left corner, as on the canvas (a point is a
pixel in a film).
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
from PIL import Image

from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, size
from pool_pymunk.render.style import Style
from pool_pymunk.safety.files import RenderError, whole

Pixels = NDArray[np.uint8]
Box = tuple[int, int, int, int]  # left, top, right and bottom, in pixels from the upper left corner
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


def blank(width: float, height: float, color: str = "none") -> Figure:
    """Return a sheet of ``width`` x ``height`` points; clear without a ``color``."""
    inches = (width / POINTS_PER_INCH, height / POINTS_PER_INCH)
    return Figure(inches, dpi=POINTS_PER_INCH, facecolor=color)


def canvas(width: float, height: float, color: str = "none") -> tuple[Figure, Axes]:
    """Return a sheet with a canvas that covers it, measured in points, y upwards."""
    figure = blank(width, height, color)
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


class Frame:
    """A frame has ``pixels`` (height, width, 4), and a ``picture`` that shares their memory."""

    def __init__(self, pixels: Pixels) -> None:
        self.pixels, size = pixels, (pixels.shape[1], pixels.shape[0])
        self.picture = Image.frombuffer("RGBA", size, pixels, "raw", "RGBA", 0, 1)
        self.picture.readonly = 0  # Otherwise Pillow draws on a copy.


def dimmed(cover: Image.Image, strength: float) -> Image.Image:
    """Return a cover with a ``strength`` in [0, 1] of its own."""
    return cover if strength == 1.0 else cover.point([round(strength * k) for k in range(256)])


class Sprite:
    """A sprite is a small picture with soft edges, drawn FINE times finer than the frame."""

    def __init__(self, fine: Pixels) -> None:
        self.side = len(fine) // FINE + 1
        self.fine = Image.fromarray(np.pad(fine, ((FINE, FINE), (FINE, FINE), (0, 0))))
        self.shifted: dict[tuple[int, int], tuple[Image.Image, Image.Image]] = {}

    def stamp(self, frame: Frame, x: float, y: float, strength: float = 1.0) -> None:
        """Put the sprite's middle at (x, y), unless that is NaN, with a ``strength`` in [0, 1]."""
        if strength <= 0.0 or not math.isfinite(x + y):
            return
        column, across = divmod(round(x * FINE), FINE)
        row, down = divmod(round((frame.picture.height - y) * FINE), FINE)
        if (across, down) not in self.shifted:
            left, top, size = FINE - across, FINE - down, self.side * FINE
            picture = self.fine.reduce(FINE, (left, top, left + size, top + size))
            self.shifted[across, down] = picture, picture.getchannel("A")
            picture.putalpha(255)
        picture, cover = self.shifted[across, down]
        at = column - self.side // 2, row - self.side // 2
        frame.picture.paste(picture, at, dimmed(cover, strength))
