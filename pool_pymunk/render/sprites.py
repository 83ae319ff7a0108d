"""This module draws into pixels, fast: sprites, soft rings and soft lines.

Sprites are placed to a quarter of a pixel. A frame is an array (height, width, 3) of uint8, with
row 0 on top. Positions are in pixels from the lower left corner, as on the canvas (one point is one
pixel in a film).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import Pixels, canvas, pixels

HALO = 0.2  # the strength of the halo around a track
FINE = 4  # Sprites are drawn this many times finer than the frame, and placed as finely.


class Sprite:
    """A sprite is a small picture with soft edges that can be put anywhere on a frame.

    ``fine`` (side, side, 4) has FINE times the frame's pixels, and its alpha darkens its colours.
    """

    def __init__(self, fine: Pixels) -> None:
        self.half = len(fine) // FINE // 2
        self._fine = np.pad(fine, ((FINE, 2 * FINE), (FINE, 2 * FINE), (0, 0)))
        self._shifted: dict[tuple[int, int], tuple[NDArray[np.uint16], NDArray[np.uint16]]] = {}

    def stamp(self, frame: Pixels, x: float, y: float, strength: float = 1.0) -> None:
        """Put the sprite's middle at (x, y); a ball without a position (NaN) is not drawn.

        With a ``strength`` below 1 the frame shows through.
        """
        if not math.isfinite(x + y):
            return
        column, across = divmod(round(x * FINE), FINE)
        row, down = divmod(round((frame.shape[0] - y) * FINE), FINE)
        light, clear = self._at(across, down)
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

    def _at(self, across: int, down: int) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
        """Return the sprite moved right and down by quarters of a pixel.

        The first array is 255 x its light, the second 255 - alpha.
        """
        if (across, down) not in self._shifted:
            n = 2 * self.half + 1
            total = np.zeros((n, n, 4), dtype=np.float32)
            for i in range(FINE - down, 2 * FINE - down):
                for j in range(FINE - across, 2 * FINE - across):
                    total += self._fine[i::FINE, j::FINE][:n, :n]
            light = np.rint(total[..., :3] * (255.0 / FINE**2)).astype(np.uint16)
            clear = np.rint(255.0 - total[..., 3:] / FINE**2).astype(np.uint16)
            self._shifted[across, down] = np.minimum(light, 255 * (255 - clear)), clear
        return self._shifted[across, down]


def sprites(
    count: int, reach: float, draw: Callable[[Axes, list[Point]], None]
) -> tuple[Sprite, ...]:
    """Return so many sprites that reach so far (pixels) from their middles, drawn all at once.

    ``draw`` gets axes and the points around which it must draw each sprite.
    """
    half = math.ceil(reach) + 1
    columns = math.ceil(math.sqrt(count))
    rows = math.ceil(count / columns)
    figure, axes = canvas(2 * half * columns, 2 * half * rows)
    cells = [divmod(k, columns) for k in range(count)]
    draw(axes, [(half * (2.0 * c + 1.0), half * (2.0 * (rows - r) - 1.0)) for r, c in cells])
    fine = pixels(figure, FINE)
    light = (fine[..., :3].astype(np.uint16) * fine[..., 3:] + 127) // 255
    fine[..., :3] = light
    side = 2 * half * FINE
    return tuple(
        Sprite(fine[r * side : (r + 1) * side, c * side : (c + 1) * side]) for r, c in cells
    )


def _window(frame: Pixels, box: Array) -> tuple[slice, slice, Array, Array] | None:
    """Return the rows and columns of a box (x0, y0, x1, y1), and the middles of its pixels.

    The middles are x (1, c) and y (r, 1).
    """
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


def mix(frame: Pixels, rows: slice, columns: slice, share: Array, color: Array) -> None:
    """Mix ``color`` into the frame, by ``share`` (r, c) in [0, 1]."""
    under = frame[rows, columns]
    frame[rows, columns] = np.rint(under + share[..., None] * (color - under)).astype(np.uint8)


def glow(
    frame: Pixels, at: Point, radius: float, soft: float, color: Array, strength: float
) -> None:
    """Draw a ring of light around ``at``, which fades over ``soft`` pixels on both sides."""
    reach = radius + 2.2 * soft
    window = _window(frame, np.array([at[0] - reach, at[1] - reach, at[0] + reach, at[1] + reach]))
    if window is None:
        return
    rows, columns, x, y = window
    distance = np.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2)
    share = strength * np.exp(-(((distance - radius) / soft) ** 2))
    mix(frame, rows, columns, share, color)


class Track:
    """A track is the soft line a ball leaves behind, drawn piece by piece, nowhere twice.

    ``corners`` (K, 3) are the times and places (pixels) where its straight path bends. A ``halo``
    is a colour that shines out under the line.
    """

    def __init__(
        self, corners: Array, width: float, color: Array, strength: float, halo: Array | None = None
    ) -> None:
        self.corners, self.width, self.color, self.strength = corners, width, color, strength
        self.halo = color if halo is None else halo
        self.glow = 0.0 if halo is None else HALO
        self.outer = width if halo is None else 1.35 * width + 0.5
        self.points = [corners[0, 1:]]
        self.passed = 1

    def reach(self, frame: Pixels, t: float, at: Array) -> None:
        """Draw the line on to where the ball is at ``t``; steps too short to see can wait."""
        while self.passed < len(self.corners) and self.corners[self.passed, 0] <= t:
            self._piece(frame, self.corners[self.passed, 1:])
            self.passed += 1
        if np.hypot(*(at - self.points[-1])) > max(4.0, self.width):
            self._piece(frame, at)

    def _piece(self, frame: Pixels, end: Array) -> None:
        """Raise the line's cover from that of the pieces so far to that with one more."""
        start = self.points[-1]
        if (start == end).all():
            return
        box = np.concatenate([np.minimum(start, end), np.maximum(start, end)])
        box += np.array([-1.0, -1.0, 1.0, 1.0]) * self.outer
        window = _window(frame, box)
        if window is not None:
            rows, columns, x, y = window
            old = np.full((y.size, x.size), np.inf)
            for a, b in self._near(box):
                old = np.minimum(old, _distance(x, y, a, b))
            new = np.minimum(old, _distance(x, y, start, end))
            self._raise(frame[rows, columns], old, new)
        self._append(start, end)

    def _append(self, start: Array, end: Array) -> None:
        """Remember the new end; a piece that goes straight on makes the last one longer."""
        if len(self.points) > 1:
            before, after = start - self.points[-2], end - start
            cross = before[0] * after[1] - before[1] * after[0]
            if abs(cross) < 0.1 * np.hypot(*before) and before @ after > 0.0:
                self.points[-1] = end
                return
        self.points.append(end)

    def _near(self, box: Array) -> list[tuple[Array, Array]]:
        """Return the pieces drawn so far that may show in the box."""
        points = np.array(self.points)
        low = np.minimum(points[:-1], points[1:]) - self.outer
        high = np.maximum(points[:-1], points[1:]) + self.outer
        meets = (low <= box[2:]).all(axis=1) & (high >= box[:2]).all(axis=1)
        return [(points[k], points[k + 1]) for k in np.flatnonzero(meets)]

    def _raise(self, part: Pixels, old: Array, new: Array) -> None:
        """Draw the line as far as pixels have come nearer to it: from ``old`` to ``new`` away."""
        clear_before, light_before = self._look(old)
        clear, light = self._look(new)
        under = (part - light_before) / clear_before
        part[:] = np.rint(np.clip(under * clear + light, 0.0, 255.0))

    def _look(self, distance: Array) -> tuple[Array, Array]:
        """Return how much shows through at a distance (r, c) from the line, and its own light."""
        core = self.strength * _soft(distance / self.width)[..., None]
        halo = self.glow * _soft(distance / self.outer)[..., None] * (1.0 - core)
        return 1.0 - core - halo, core * self.color + halo * self.halo


def _distance(x: Array, y: Array, a: Array, b: Array) -> Array:
    """Return how far pixels are from the straight line between a and b."""
    along = b - a
    share = ((x - a[0]) * along[0] + (y - a[1]) * along[1]) / float(along @ along)
    share = np.clip(share, 0.0, 1.0)
    distance: Array = np.hypot(x - a[0] - share * along[0], y - a[1] - share * along[1])
    return distance


def _soft(share: Array) -> Array:
    """Return 1 in the middle of a line and 0 beyond its sides, where ``share`` is 1."""
    depth: Array = np.clip(1.6 * (1.0 - share), 0.0, 1.0)
    return depth * depth * (3.0 - 2.0 * depth)
