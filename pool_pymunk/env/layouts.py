"""This module draws layouts: balls at random places on a table where they are free."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast import compiled
from pool_pymunk.fast.loop import misplaced
from pool_pymunk.fast.tables import arrays_of, plain
from pool_pymunk.model import Scene
from pool_pymunk.model.places import TOUCHING
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.sides import RoundSide, Wall
from pool_pymunk.solvers.exact import walls

Floats = NDArray[np.float64]
Hands = Sequence[np.random.Generator]

PLACES = 2  # This many places a ball are drawn at once.
MOST_DRAWN = 500  # A ball that is not free after this many draws finds no room.


class Layouts:
    """A scene's layouts are drawn: balls at random places on the table.

    One ball after another is tried at places until it touches no cushion, no pocket and no ball
    before it. Each table draws from its own generator.
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.table is not None, "a game has a table"
        # No part of a ball shall lie over a pocket, so that pockets are walls here.
        filled = [Wall((RoundSide(p.position, p.radius),), 0.0, 0.0, 0) for p in scene.pockets]
        table = arrays_of([*walls(scene), *filled], scene.table)
        self.table = table if compiled.is_there() else plain(table)
        self.radius = np.array([ball.radius for ball in scene.balls])
        x0, y0, x1, y1 = scene.table.bounds
        self.corner = np.array([x0, y0]) + self.radius[:, np.newaxis]
        self.size = np.array([x1, y1]) - self.radius[:, np.newaxis] - self.corner

    def draw(self, hands: Hands) -> Floats:
        """Return a layout (S, N, 2), in m, for each of the generators."""
        layouts, placed = np.empty((len(hands), *self.size.shape)), np.zeros(len(hands), np.int64)
        waiting = np.arange(len(hands))
        for _ in range(MOST_DRAWN):
            places = np.empty((len(waiting), PLACES, *self.size.shape))
            for s, own in zip(waiting.tolist(), places, strict=True):
                hands[s].random(out=own)  # Each place is as likely as any other.
            places = places * self.size + self.corner
            compiled.alone(place)(self.table, layouts, placed, waiting, places, self.radius)
            waiting = waiting[placed[waiting] < len(self.radius)]
            if not len(waiting):
                return layouts
        message = "no free places for all balls were found: ask for fewer balls"
        raise setting_error("layout", "random", message)


def place(
    table: Any, layouts: Any, placed: Any, waiting: Any, places: Any, radius: Any
) -> int:  # fmt: skip
    """Put balls at the first of their places that is free; numba can compile it.

    Each of the layouts that are ``waiting`` has the first ``placed`` of its balls already. Return
    how many balls were put.
    """
    count, is_off = 0, np.zeros(len(radius), np.int64)
    for s in range(len(waiting)):
        layout = layouts[waiting[s]]
        i, k = placed[waiting[s]], 0
        while i < len(radius) and k < places.shape[1]:
            layout[i] = places[s, k, i]
            k += 1
            if misplaced(table, layout, is_off, radius, TOUCHING, i, i + 1) > i:
                i, k = i + 1, 0
                count += 1
        placed[waiting[s]] = i
    return count
