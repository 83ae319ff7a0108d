"""This module draws layouts: balls at random places on a table where they are free."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast import compiled
from pool_pymunk.model import Scene
from pool_pymunk.model.problems import setting_error
from pool_pymunk.studies.uncertainty import off_table

Floats = NDArray[np.float64]
Hands = Sequence[np.random.Generator]

PLACES = 2  # So many places a ball are drawn at once.
MOST_DRAWN = 500  # A ball that is not free after so many draws finds no room.


class Layouts:
    """A scene's layouts are drawn: balls at random places on the table.

    One ball after another is tried at places until it touches no cushion, no pocket and no ball
    before it. Each table draws from its own generator, so its layouts do not depend on what other
    tables there are.
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.table is not None, "a game has a table"
        self.table, self.pockets = scene.table, scene.pockets
        self.radius = np.array([ball.radius for ball in scene.balls])
        x0, y0, x1, y1 = self.table.bounds
        self.corner = np.array([x0, y0]) + self.radius[:, np.newaxis]
        self.size = np.array([x1, y1]) - self.radius[:, np.newaxis] - self.corner

    def draw(self, hands: Hands) -> Floats:
        """Return a layout (S, N, 2), in m, for each of the generators."""
        layouts, placed = np.empty((len(hands), *self.size.shape)), np.zeros(len(hands), np.int64)
        waiting = np.arange(len(hands))
        for _ in range(MOST_DRAWN):
            places = self._places([hands[s] for s in waiting.tolist()])
            compiled.alone(place)(
                layouts, placed, waiting, places, self._on_the_table(places), self.radius
            )
            waiting = waiting[placed[waiting] < len(self.radius)]
            if not len(waiting):
                return layouts
        message = "no free places for all balls were found: ask for fewer balls"
        raise setting_error("layout", "random", message)

    def _places(self, hands: Hands) -> Floats:
        """Return places (S, PLACES, N, 2), in m; each is as likely as any other."""
        places = np.empty((len(hands), PLACES, *self.size.shape))
        for hand, own in zip(hands, places, strict=True):
            hand.random(out=own)
        places *= self.size
        places += self.corner
        return places

    def _on_the_table(self, places: Floats) -> NDArray[np.bool_]:
        """Tell which places (S, PLACES, N) touch no cushion and no pocket."""
        free = np.ones(places.shape[:-1], np.bool_)
        for pocket in self.pockets:
            dx, dy = places[..., 0] - pocket.position[0], places[..., 1] - pocket.position[1]
            free &= dx * dx + dy * dy >= (pocket.radius + self.radius) ** 2
        if not self.table.is_rectangle:
            for i, radius in enumerate(self.radius.tolist()):
                off = off_table(self.table, places[:, :, i].reshape(-1, 2), radius)
                free[:, :, i] &= ~off.reshape(-1, PLACES)
        return free


def place(
    layouts: Any, placed: Any, tables: Any, places: Any, on_the_table: Any, radius: Any
) -> int:
    """Put balls at the first of their places that is free; numba can compile it.

    Each of the ``tables`` has the first ``placed`` of its balls in its layout already. Return how
    many balls were put.
    """
    count = 0
    for s in range(len(tables)):
        table = tables[s]
        i, k = placed[table], 0
        while i < len(radius) and k < places.shape[1]:
            x, y = places[s, k, i, 0], places[s, k, i, 1]
            free = on_the_table[s, k, i]
            for j in range(i):
                dx, dy = x - layouts[table, j, 0], y - layouts[table, j, 1]
                free = free and dx * dx + dy * dy >= (radius[i] + radius[j]) ** 2
            k += 1
            if free:
                layouts[table, i, 0], layouts[table, i, 1] = x, y
                i, k = i + 1, 0
                count += 1
        placed[table] = i
    return count
