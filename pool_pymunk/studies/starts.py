"""This module draws and makes starts of many shots: random numbers, places, struck balls.

Balls of a start that overlap each other or a cushion are moved apart as little as possible: the sum
of the squares of all moves is least. So a rack whose balls touch can be studied, too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.places import may_lie
from pool_pymunk.model import NEAREST, Edge, Scene, Shot
from pool_pymunk.physics.motion import Array
from pool_pymunk.solvers import SettingError

Floats = NDArray[np.float64]

ATTEMPTS = 20  # So often a start is drawn whose balls cannot be moved apart.
SWEEPS = 2000  # So often all overlaps of a start are looked at.
APART = 2.5e-10  # of a radius; pushes that are smaller end the search
NEIGHBORS = 8.0  # widths; balls that are farther apart than this do not come to overlap
A_BLOCK = 4  # numbers a step of the generator


def launched(scene: Scene, shot: Shot, position: Floats) -> Floats:
    """Return the velocity (S, 2) that a shot gives to its ball at each start (S, N, 2).

    NaN as a ball's position means that it is off the table.
    """
    if shot.launch is not None:
        return np.tile(shot.launch, (len(position), 1))
    assert shot.aim is not None and shot.speed is not None
    ball = scene.index[shot.ball]
    offset = position - position[:, ball : ball + 1]
    if shot.aim == NEAREST:
        away = np.nan_to_num(np.hypot(offset[..., 0], offset[..., 1]), nan=np.inf)
        away[:, ball] = np.inf
        target = away.argmin(axis=1)
    else:
        target = np.full(len(position), scene.index[shot.aim])
    dx, dy = offset[np.arange(len(position)), target].T
    angles = list(map(math.atan2, dy.tolist(), dx.tolist()))  # with the bits of Scene.start
    return np.array([(math.cos(a) * shot.speed, math.sin(a) * shot.speed) for a in angles])


def uniforms(seed: int, shots: range, count: int) -> Floats:
    """Return ``count`` numbers in [0, 1) for each of the shots (S, count), by their numbers.

    >>> bool((uniforms(7, range(5, 9), 6)[1] == uniforms(7, range(6, 7), 6)[0]).all())
    True
    """
    blocks = -(-count // A_BLOCK)
    source = np.random.Philox(key=seed)
    source.advance(shots.start * blocks)
    raw = source.random_raw(len(shots) * blocks * A_BLOCK).reshape(len(shots), -1)
    return np.asarray((raw[:, :count] >> np.uint64(11)) * 2.0**-53)


def normal(numbers: Floats) -> Floats:
    """Return normal numbers (S,) of two uniform ones each (Box and Muller)."""
    return np.asarray(
        np.sqrt(-2.0 * np.log1p(-numbers[:, 0])) * np.cos(2.0 * np.pi * numbers[:, 1])
    )


class StartSampler:
    """A start sampler draws starts in which no ball overlaps another or a cushion.

    ``overlapping`` counts the balls that overlapped something as they were drawn.
    """

    def __init__(self, scene: Scene, widths: Array) -> None:
        self.scene = scene
        self.widths = widths
        self.base = np.array([ball.position for ball in scene.balls])
        self.radius = np.array([ball.radius for ball in scene.balls])
        self.overlapping = 0
        reach = NEIGHBORS * np.hypot(*widths.max(axis=0))
        self.pairs = self._pairs(reach)
        self.cushions = self._cushions(reach)

    def _pairs(self, reach: float) -> list[tuple[int, int]]:
        """Return the pairs of balls whose surfaces are nearer than ``reach`` (m)."""
        apart = np.hypot(*(self.base[:, None] - self.base[None]).transpose(2, 0, 1))
        gaps = apart - self.radius[:, None] - self.radius[None]
        first, second = np.nonzero(np.triu(gaps < reach, 1))
        return list(zip(first.tolist(), second.tolist(), strict=True))

    def _cushions(self, reach: float) -> list[tuple[int, Edge]]:
        """Return the balls that are nearer than ``reach`` (m) to a cushion, each with it."""
        edges = self.scene.table.edges if self.scene.table else ()
        return [
            (i, edge)
            for i, (x, y) in enumerate(self.base.tolist())
            for edge in edges
            if edge.distance(x, y) < self.radius[i] + reach
        ]

    def starts(self, samples: int, rng: np.random.Generator) -> Array:
        """Draw positions (S, N, 2), in m."""
        starts = np.empty((samples, *self.base.shape))
        missing = np.ones(samples, dtype=bool)
        for _ in range(ATTEMPTS):
            count = int(missing.sum())
            drawn = self.base + self.widths * rng.uniform(-1.0, 1.0, (count, *self.base.shape))
            self.overlapping += int((~may_lie(self.scene, drawn)).sum())
            starts[missing] = self.apart(drawn)
            missing[missing] = ~may_lie(self.scene, starts[missing]).all(axis=1)
            if not missing.any():
                return starts
        raise SettingError(
            "position: the balls lie so close that no starts within the uncertainty were found in "
            "which none overlap"
        )

    def apart(self, starts: Array) -> Array:
        """Return the nearest starts (S, N, 2) in which nothing overlaps; each is found on its own.

        Each overlap is taken back along its line of centres, in turn, by a push that later turns
        may lessen but never make a pull (Hildreth, Naval Research Logistics 4, 1957, 79).
        """
        starts = starts.copy()
        radius = self.radius
        lines = [_unit(starts[:, j] - starts[:, i]) for i, j in self.pairs]
        pushes = np.zeros((len(self.pairs) + len(self.cushions), len(starts)))
        moves = np.ones(len(starts), dtype=bool)
        for _ in range(SWEEPS):
            worst = np.zeros(len(starts))
            for k, (i, j) in enumerate(self.pairs):
                gap = np.hypot(*(starts[:, j] - starts[:, i]).T) - radius[i] - radius[j]
                push = moves * (np.maximum(pushes[k] - gap / 2.0, 0.0) - pushes[k])
                pushes[k] += push
                starts[:, i] -= push[:, None] * lines[k]
                starts[:, j] += push[:, None] * lines[k]
                worst = np.maximum(worst, np.abs(push) / radius[i])
            for k, (i, edge) in enumerate(self.cushions, start=len(self.pairs)):
                gap = edge.height(*starts[:, i].T) - radius[i]
                push = moves * (np.maximum(pushes[k] - gap, 0.0) - pushes[k])
                pushes[k] += push
                starts[:, i] += push[:, None] * np.array(edge.normal)
                worst = np.maximum(worst, np.abs(push) / radius[i])
            moves &= worst >= APART
            if not moves.any():
                break
        return starts


def _unit(offsets: Array) -> Array:
    """Return unit vectors (S, 2) along offsets (S, 2)."""
    return np.asarray(offsets / np.hypot(*offsets.T)[:, None])
