"""This module makes an empty canvas measured in points, text on it, its pixels, and plots.

It needs no window and no display.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from pool_pymunk.model import Point
from pool_pymunk.render.style import Style

Pixels = NDArray[np.uint8]
POINTS_PER_INCH = 72.0


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
    """Return the figure as red, green, blue and alpha, (height, width, 4).

    A point has ``per_point`` pixels.
    """
    figure.set_dpi(per_point * POINTS_PER_INCH)
    agg = FigureCanvasAgg(figure)
    agg.draw()  # type: ignore[no-untyped-call]
    return np.array(agg.buffer_rgba())  # type: ignore[no-untyped-call]


def draw_text(axes: Axes, text: str, at: Point, size: float, room: float, **looks: Any) -> Text:
    """Write a line of text in ``size`` points, or smaller if it is wider than ``room`` points."""
    drawn = axes.text(*at, text, fontsize=size, parse_math=False, **looks)
    width = drawn.get_window_extent().width
    if width > room:
        drawn.set_fontsize(size * room / width)
    return drawn


def dress(axes: Axes, style: Style) -> None:
    """Give a plot the page's colours, and axes at the left and below alone."""
    axes.set_facecolor("none")
    axes.tick_params(colors=style.ink, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(style.faint)
    for words in (axes.xaxis.label, axes.yaxis.label, axes.title, *axes.texts):
        words.set_color(style.ink)
