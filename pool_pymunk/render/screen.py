"""This module puts small pictures with soft edges on a drawn figure, fast, one frame after another.

Places are in pixels from the lower left corner; a point of the canvas is one pixel. Pictures are
straight RGBA (height, width, 4) with row 0 at the bottom, as matplotlib's renderer takes them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from PIL import Image

from pool_pymunk.model import Point
from pool_pymunk.render.canvas import POINTS_PER_INCH, Pixels, canvas, pixels

FINE = 4  # Sprites are drawn this many times finer than the frame, and placed as finely.


class Screen:
    """A screen is a figure's pixels. What is drawn lasts until :meth:`clear`, or is kept."""

    def __init__(self, figure: Figure) -> None:
        figure.set_dpi(POINTS_PER_INCH)
        self.canvas = FigureCanvasAgg(figure)
        self.canvas.draw()  # type: ignore[no-untyped-call]
        self.renderer = self.canvas.get_renderer()  # type: ignore[no-untyped-call]
        self.box = figure.bbox
        self.keep()

    def keep(self) -> None:
        """Keep what the screen shows now."""
        self.kept = self.canvas.copy_from_bbox(self.box)  # type: ignore[no-untyped-call]

    def clear(self) -> None:
        """Show what was kept, and nothing else."""
        self.canvas.restore_region(self.kept)  # type: ignore[no-untyped-call]

    def put(self, picture: Pixels, x: float, y: float, strength: float = 1.0) -> None:
        """Put the lower left corner of a picture at a pixel; at a strength of 0 it is not seen."""
        if strength < 1.0:
            picture = (picture * np.array([1.0, 1.0, 1.0, max(strength, 0.0)])).astype(np.uint8)
        self.renderer.draw_image(self.renderer.new_gc(), x, y, picture)

    def write(self, text: str, right: float, y: float, size: float, color: str) -> None:
        """Write a line of figures of ``size`` pixels that ends at the right."""
        font, context = _font(size), self.renderer.new_gc()
        context.set_foreground(color)
        width, _, _ = self.renderer.get_text_width_height_descent(text, font, False)
        top = self.canvas.get_width_height()[1] - y
        self.renderer.draw_text(context, round(right - width), top, text, font, 0.0)

    def pixels(self) -> Pixels:
        """Return red, green and blue (height, width, 3), with row 0 on top."""
        shown = np.asarray(self.canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        frame = np.empty((*shown.shape[:2], 3), dtype=np.uint8)
        for k in range(3):  # This is four times as fast as all at once.
            frame[..., k] = shown[..., k]
        return frame


@lru_cache(maxsize=8)
def _font(size: float) -> FontProperties:
    return FontProperties(size=size)


class Sprite:
    """A sprite is a small picture that can be put anywhere on a screen, to a quarter of a pixel.

    ``fine`` (side, side, 4) has FINE times the screen's pixels.
    """

    def __init__(self, fine: Pixels) -> None:
        self.side = len(fine) // FINE + 1
        wide = np.pad(fine, ((FINE, FINE), (FINE, FINE), (0, 0)))
        self._fine = Image.fromarray(wide).convert("RGBa")
        self._shifted: dict[tuple[int, int], Pixels] = {}

    def stamp(self, screen: Screen, x: float, y: float, strength: float = 1.0) -> None:
        """Put the sprite's middle at (x, y); a ball without a position (NaN) is not drawn."""
        if strength <= 0.0 or not math.isfinite(x + y):
            return
        column, across = divmod(round(x * FINE), FINE)
        row, up = divmod(round(y * FINE), FINE)
        half = (self.side - 1) // 2
        screen.put(self._at(across, up), column - half, row - half, strength)

    def _at(self, across: int, up: int) -> Pixels:
        """Return the sprite moved right and up by quarters of a pixel."""
        if (across, up) not in self._shifted:
            x, y, size = FINE - across, FINE - up, FINE * self.side
            box = (x, y, x + size, y + size)
            small = self._fine.resize((self.side, self.side), Image.Resampling.BOX, box)
            self._shifted[across, up] = np.array(small.convert("RGBA"))
        return self._shifted[across, up]


def sprites(
    count: int, reach: float, draw: Callable[[Axes, list[Point]], None]
) -> tuple[Sprite, ...]:
    """Return a number of sprites that reach so far (pixels) from their middles, drawn all at once.

    ``draw`` gets axes and the points around which it must draw each sprite.
    """
    half = math.ceil(reach) + 1
    columns = math.ceil(math.sqrt(count))
    rows = math.ceil(count / columns)
    figure, axes = canvas(2 * half * columns, 2 * half * rows)
    cells = [divmod(k, columns) for k in range(count)]
    draw(axes, [(half * (2.0 * column + 1.0), half * (2.0 * row + 1.0)) for row, column in cells])
    fine, side = pixels(figure, FINE)[::-1], 2 * half * FINE
    return tuple(Sprite(fine[r * side :, c * side :][:side, :side]) for r, c in cells)


def glow(radius: float, soft: float, color: str) -> Pixels:
    """Return a ring of light, which fades over ``soft`` pixels on both sides of its radius."""
    reach = math.ceil(radius + 2.2 * soft)
    distance = np.hypot(*np.mgrid[-reach:reach, -reach:reach] + 0.5)
    picture = np.empty((*distance.shape, 4))
    picture[..., :3] = to_rgb(color)
    picture[..., 3] = np.exp(-(((distance - radius) / soft) ** 2))
    return np.rint(255.0 * picture).astype(np.uint8)
