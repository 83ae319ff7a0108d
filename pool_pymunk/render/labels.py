"""This module places and draws the labels of balls that are too small to have them inside."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath

from pool_pymunk.model import Point
from pool_pymunk.physics.motion import Array
from pool_pymunk.render.style import Style

if TYPE_CHECKING:
    from pool_pymunk.render.balls import Disc

CAPITAL = 0.73  # height of the font's capitals and digits, in its size
CORNERS = np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])  # the first is preferred
CLEARLY = 0.3  # in half the height of a label


class Labels:
    """Labels stand beside their balls, each at a corner where it covers no other ball.

    ``balls`` are those that have one. A label leaves its corner only for one with clearly more
    room, so that it stands still when balls move.
    """

    def __init__(self, discs: Sequence[Disc]) -> None:
        beside = [k for k, disc in enumerate(discs) if not disc.is_labelled_inside]
        self.of = np.array(beside, dtype=int)
        self.balls = [discs[k] for k in beside]
        self.radii = np.array([disc.radius for disc in discs])
        self.halves = np.array([half_size(ball) for ball in self.balls]).reshape(-1, 2)
        self.corners = np.tile(CORNERS[0], (len(self.balls), 1))

    def place(self, places: Array) -> Array:
        """Return the middles (L, 2) of the labels when the balls are at ``places`` (N, 2)."""
        if self.balls:
            room = self._room(places, self.corners)
            if room.min() < 0.0:
                others = np.array([self._room(places, corner) for corner in CORNERS])
                better = others.max(axis=0) > room + CLEARLY * self.halves[:, 1]
                self.corners[better] = CORNERS[others.argmax(axis=0)][better]
        return self._middles(places, self.corners)

    def _middles(self, places: Array, corners: Array) -> Array:
        """Return where the middles of the labels are at these corners."""
        middles: Array = places[self.of] + corners * (0.8 * self.radii[self.of, None] + self.halves)
        return middles

    def _room(self, places: Array, corners: Array) -> Array:
        """Return 0 for a label that covers no other ball, and less the more it covers one."""
        middles = self._middles(places, corners)
        out = np.maximum(np.abs(places - middles[:, None]) - self.halves[:, None], 0.0)
        gaps = np.hypot(out[..., 0], out[..., 1]) - self.radii
        gaps[np.arange(len(self.of)), self.of] = 0.0
        nearest: Array = np.nan_to_num(gaps, nan=0.0).min(axis=1)
        return np.minimum(nearest, 0.0)


def half_size(ball: Disc) -> Point:
    """Return half the width and height (points) of a label."""
    return _half_size(ball.label, ball.letter)


@lru_cache(maxsize=1024)
def _half_size(label: str, letter: float) -> Point:
    box = TextPath((0.0, 0.0), label.replace("$", r"\$"), size=letter).get_extents()
    return max(float(box.width), 1.0) / 2, CAPITAL * letter / 2


def draw_label(axes: Axes, ball: Disc, middle: Point, style: Style) -> None:
    """Draw the label of a ball, light with a dark rim, around its middle."""
    x, y = middle
    text = axes.text(x, y - CAPITAL * ball.letter / 2, ball.label, parse_math=False, zorder=2.4)
    text.set(color="#ffffff", fontsize=ball.letter, ha="center", va="baseline")
    text.set_path_effects([withStroke(linewidth=0.3 * ball.letter, foreground=style.outline)])
