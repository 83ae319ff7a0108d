"""This module has the tracks that balls leave in films: lines that the balls uncover."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.collections import LineCollection
from PIL import Image, ImageChops, ImageDraw

from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.render.canvas import FINE, Box, Frame, Pixels, blank, dimmed, pixels
from pool_pymunk.render.style import LOOK

STRENGTH = 0.9  # the share of the cloth that a track covers
MARGIN = 1.25  # pixels; a ball uncovers its track, and this much beside it


class Ground(Frame):
    """The ground is what lies under the balls of a film: the table, and tracks.

    ``solid`` is what tracks of solid balls cover so far: those of ghosts lie under them. ``cores``
    is that without halos: what lies on it is slimmer, so that both are seen.
    """

    def __init__(self, bare: Pixels) -> None:
        super().__init__(bare.copy())
        self.solid, self.cores = (Image.new("L", self.picture.size) for _ in range(2))

    def lay(self, line: Line, box: Box, here: Box, brush: Image.Image) -> None:
        """Lay what the brush uncovers of a line on the ground; ``here`` is its box in the track."""
        cover = ImageChops.multiply(line.hidden.crop(here), brush)
        line.hidden.paste(0, here, brush)
        if line.slim is None:
            cover = ImageChops.multiply(cover, ImageChops.invert(self.solid.crop(box)))
        else:
            slim = ImageChops.multiply(line.slim.crop(here), cover)
            cover = Image.composite(slim, cover, self.cores.crop(box))
            self.solid.paste(255, box, cover)
            if not line.is_halo:
                self.cores.paste(255, box, cover)
        self.picture.paste(line.color, box, cover)


class Line(NamedTuple):
    """A line has a colour and a width; ``hidden`` is what is not uncovered yet.

    ``slim`` is what is seen of it where it lies on other tracks; ghosts lie on none.
    """

    color: str
    width: float
    hidden: Image.Image
    slim: Image.Image | None = None
    is_halo: bool = False


class Track:
    """A track is drawn whole and hidden at first, and its ball uncovers it on the ground.

    Its ``corners`` (K, 3) are times and places (pixels). It is a line that is ``wide`` (pixels);
    that of a solid ball has a ``halo``, which is a wider line under it. Each of their pixels is put
    on the ground once, so that soft edges stay soft where a ball returns.
    """

    def __init__(
        self, corners: Array, size: tuple[int, int], wide: float, color: str, halo: str = ""
    ) -> None:
        corners = corners[np.isfinite(corners).all(axis=1)]
        path, outer = corners[:, 1:], 1.6 * wide + 1.0
        box = np.rint([path.min(axis=0) - outer, path.max(axis=0) + outer])
        x0, y0, x1, y1 = np.clip(box, 0, size).astype(int).ravel().tolist()
        self.left, self.top = x0, size[1] - y1
        figure = blank(max(x1 - x0, 1), max(y1 - y0, 1))
        looks: dict[str, Any] = {"capstyle": "round", "joinstyle": "round", "snap": False}
        looks |= {"colors": ["#000", "#f00", "#ff0"], "linewidths": [outer, wide, LOOK.slim * wide]}
        figure.add_artist(LineCollection([path - (x0, y0)] * 3, transform=None, **looks))
        red, green, _, both = Image.fromarray(pixels(figure)).split()
        core, slim = (dimmed(ImageChops.multiply(both, part), STRENGTH) for part in (red, green))
        if halo:
            none = Image.new("L", both.size)
            around = Line(halo, outer, dimmed(both, LOOK.halo), none, is_halo=True)
            self.lines = [around, Line(color, wide, core, slim)]
        else:
            self.lines = [Line(color, wide, core)]
        self.ahead = deque((t, (x, y)) for t, x, y in corners.tolist())
        self.end: Point = self.ahead.popleft()[1]

    def follow(self, ground: Ground, t: float, at: Point) -> None:
        """Uncover the track up to the time ``t`` (s), at which the ball is ``at`` a place."""
        if not self.ahead:
            return
        path = [self.end]
        while self.ahead and self.ahead[0][0] <= t:
            path.append(self.ahead.popleft()[1])
        if self.ahead and self.lines[-1].width < math.dist(at, path[-1]) < math.inf:  # nor NaN
            path.append(at)
        if path[-1] == self.end:
            return
        self.end = path[-1]
        for line in self.lines:
            box, brush = _brush(path, line.width / 2.0 + MARGIN, ground.picture.size)
            x0, y0, x1, y1 = box
            here = x0 - self.left, y0 - self.top, x1 - self.left, y1 - self.top
            ground.lay(line, box, here, brush)


def _brush(path: Sequence[Point], half: float, size: tuple[int, int]) -> tuple[Box, Image.Image]:
    """Return the box around a path, and its pixels, all or nothing, that lie ``half`` beside it."""
    xs, ys = [x for x, _ in path], [size[1] - y for _, y in path]
    left, top = max(math.floor(min(xs) - half), 0), max(math.floor(min(ys) - half), 0)
    right = max(min(math.ceil(max(xs) + half), size[0]), left + 1)
    bottom = max(min(math.ceil(max(ys) + half), size[1]), top + 1)
    inner, radius = (right - left, bottom - top), FINE * half
    fine = Image.new("L", (FINE * inner[0], FINE * inner[1]))
    places = [(FINE * (x - left), FINE * (y - top)) for x, y in zip(xs, ys, strict=True)]
    pen = ImageDraw.Draw(fine)
    pen.line(places, 255, round(2.0 * radius))
    for x, y in places:
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), 255)
    return (left, top, right, bottom), fine.resize(inner, Image.Resampling.NEAREST)
