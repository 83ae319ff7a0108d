"""This module draws the tracks that balls leave in films: soft lines that fade with their age.

Positions are in pixels from the lower left corner, as in :mod:`pool_pymunk.render.sprites`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.motion import Array
from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.sprites import window
from pool_pymunk.render.style import LOOK

HALO = 0.2  # the strength of the halo around a track
LIFE = 1.0  # s of film; in this time what a track will lose of its strength shrinks to 1/e
TICK = 0.16  # s of film; tracks are faded as often
FADED = LOOK.oldest + 0.05  # A track that is no stronger than this fades no more.


class Ground:
    """The ground is what lies under the balls of a film: the table, and tracks as old as they are.

    ``new`` has all tracks as strong as when they were new, and ``seen`` as strong as they are now.
    ``life`` (s) is the time in which they fade.
    """

    def __init__(self, bare: Pixels, life: float) -> None:
        self.bare, self.new, self.seen = bare, bare.copy(), bare.copy()
        self.strength: NDArray[np.float32] = np.zeros(bare.shape[:2], dtype=np.float32)
        self.life, self.now = life, -math.inf

    def fade(self, t: float) -> None:
        """Let the tracks fade up to the time ``t`` (s), unless that would not show."""
        if t - self.now < TICK * self.life / LIFE:
            return
        left = math.exp((self.now - t) / self.life)
        strength, self.now = self.strength.reshape(-1), t
        fading = np.flatnonzero(strength > FADED)
        strength[fading] = LOOK.oldest + left * (strength[fading] - LOOK.oldest)
        bare, new, seen = (each.reshape(-1, 3) for each in (self.bare, self.new, self.seen))
        seen[fading] = _between(bare[fading], new[fading], strength[fading])

    def renew(self, rows: slice, columns: slice, is_new: NDArray[np.bool_], t: float) -> None:
        """Show pixels whose track was drawn at the time ``t`` (s) by the strength of its age."""
        now = max(self.now, t)
        age = LOOK.oldest + (1.0 - LOOK.oldest) * math.exp((t - now) / self.life)
        strength = self.strength[rows, columns]
        np.maximum(strength, np.float32(age) * is_new, out=strength)
        part = np.s_[rows, columns]
        self.seen[part] = _between(self.bare[part], self.new[part], strength)


def _between(bare: Pixels, new: Pixels, strength: NDArray[np.float32]) -> Pixels:
    """Return pixels on the way from the ``bare`` ground to that with ``new`` tracks."""
    change = np.subtract(new, bare, dtype=np.float32)
    return (bare + strength[..., None] * change + np.float32(0.5)).astype(np.uint8)


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

    def reach(self, ground: Ground, t: float, at: Array | None) -> None:
        """Draw the line on to where the ball is at ``t``; steps too short to see can wait.

        A ball that a pocket has taken is nowhere (None).
        """
        while self.passed < len(self.corners) and self.corners[self.passed, 0] <= t:
            self._piece(ground, self.corners[self.passed, 1:], self.corners[self.passed, 0])
            self.passed += 1
        if at is not None and np.hypot(*(at - self.points[-1])) > max(4.0, self.width):
            self._piece(ground, at, t)

    def _piece(self, ground: Ground, end: Array, t: float) -> None:
        """Raise the line's cover from that of the pieces so far to that with one more."""
        start = self.points[-1]
        if (start == end).all():
            return
        box = np.concatenate([np.minimum(start, end), np.maximum(start, end)])
        box += np.array([-1.0, -1.0, 1.0, 1.0]) * self.outer
        here = window(ground.new, box)
        if here is not None:
            rows, columns, x, y = here
            old = np.full((y.size, x.size), np.inf)
            for a, b in self._near(box):
                old = np.minimum(old, _distance(x, y, a, b))
            piece = _distance(x, y, start, end)
            self._raise(ground.new[rows, columns], old, np.minimum(old, piece))
            ground.renew(rows, columns, piece < self.outer, t)
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
