"""This module draws the tracks that balls leave in films: soft lines that fade with their age."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model.arrays import Array
from pool_pymunk.render.canvas import Pixels, mixed, window
from pool_pymunk.render.style import LOOK

LIFE = 1.0  # s of film; in this time a track's strength above LOOK.oldest shrinks to 1/e
TICK = 0.16  # s of film; tracks are faded once in this time
EQUAL = 0.01  # Covers that differ less than this are equal; a byte has steps of 0.004.
FADED = LOOK.oldest + 0.05  # A track that is no stronger than this fades no more.

Floats = NDArray[np.float32]


class Ground:
    """The ground is what lies under the balls of a film: the table, and tracks that fade.

    ``new`` has all tracks unfaded, and ``seen`` as they fade with the time constant ``life`` (s). A
    pixel shows the track that has most ``cover`` there, with the ``strength`` of its age.
    """

    def __init__(self, bare: Pixels, life: float) -> None:
        self.bare, self.new, self.seen = bare, bare.copy(), bare.copy()
        self.cover: Floats = np.zeros(bare.shape[:2], dtype=np.float32)
        self.strength: Floats = np.zeros(bare.shape[:2], dtype=np.float32)
        self.life, self.now = life, -math.inf

    def fade(self, t: float) -> None:
        """Let the tracks fade up to the time ``t`` (s), unless that would not show."""
        if t - self.now < TICK * self.life / LIFE:
            return
        kept = math.exp((self.now - t) / self.life)
        strength, self.now = self.strength.reshape(-1), t
        fading = np.flatnonzero(strength > FADED)
        strength[fading] = LOOK.oldest + kept * (strength[fading] - LOOK.oldest)
        bare, new, seen = (each.reshape(-1, 3) for each in (self.bare, self.new, self.seen))
        seen[fading] = mixed(bare[fading], new[fading], strength[fading])

    def lay(self, part: tuple[slice, slice], cover: Floats, color: Array, t: float) -> None:
        """Lay a track of the time ``t`` (s) on pixels (r, c) where no other has more ``cover``."""
        age = max(self.now - t, 0.0)
        fresh = np.float32(LOOK.oldest + (1.0 - LOOK.oldest) * math.exp(-age / self.life))
        on = (cover > 0.0) & (cover >= self.cover[part] - EQUAL)
        bare = self.bare[part][on]
        self.cover[part][on], self.strength[part][on] = cover[on], fresh
        self.new[part][on] = mixed(bare, color[on], cover[on])
        self.seen[part][on] = mixed(bare, color[on], fresh * cover[on])


class Track:
    """A track is the soft line a ball leaves; its corners (K, 3) are times and places (pixels)."""

    def __init__(
        self, corners: Array, width: float, color: Array, strength: float, halo: Array | None = None
    ) -> None:
        self.corners, self.width, self.color, self.strength = corners, width, color, strength
        self.halo = color if halo is None else halo
        self.glow = 0.0 if halo is None else LOOK.halo
        self.outer = width if halo is None else 1.6 * width + 0.8
        self.end = corners[0, 1:]
        self.passed = 1

    def extend_to(self, ground: Ground, t: float, at: Array | None) -> None:
        """Draw the line up to the time ``t`` (s), and to the place ``at`` if the ball has moved."""
        while self.passed < len(self.corners) and self.corners[self.passed, 0] <= t:
            self._piece(ground, self.corners[self.passed, 1:], self.corners[self.passed, 0])
            self.passed += 1
        if at is not None and np.hypot(*(at - self.end)) > max(4.0, self.width):
            self._piece(ground, at, t)

    def _piece(self, ground: Ground, end: Array, t: float) -> None:
        """Draw the piece that goes straight on to the ``end``."""
        start, self.end = self.end, end
        box = np.concatenate([np.minimum(start, end), np.maximum(start, end)])
        here = window(ground.new, box + self.outer * np.array([-1.0, -1.0, 1.0, 1.0]))
        if here is None or (start == end).all():
            return
        rows, columns, x, y = here
        (x0, y0), (dx, dy) = start, end - start
        along = np.clip(((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
        distance = np.hypot(x - x0 - along * dx, y - y0 - along * dy)
        core = self.strength * _soft(distance / self.width)
        halo = self.glow * _soft(distance / self.outer) * (1.0 - core)
        cover = core + halo
        share = (core / np.maximum(cover, 1e-9))[..., None]
        color = share * self.color + (1.0 - share) * self.halo
        ground.lay((rows, columns), cover.astype(np.float32), color, t)


def _soft(share: Array) -> Array:
    """Return 1 in the middle of a line and 0 beyond its sides, where ``share`` is 1."""
    depth: Array = np.clip(1.6 * (1.0 - share), 0.0, 1.0)
    return depth * depth * (3.0 - 2.0 * depth)
