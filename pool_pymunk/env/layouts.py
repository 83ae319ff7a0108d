"""This module draws for many tables at once: random numbers, and places where balls are free."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.layouts import DRAWN, Spot, lay_out
from pool_pymunk.model import Post, Scene
from pool_pymunk.model.problems import setting_error
from pool_pymunk.solvers.in_core import floor_between

Floats = NDArray[np.float64]

# A ball that has found no free place after this number of draws has no room. Where a hundredth of
# the table is free, this is wrong once in 23,000 times.
MOST_DRAWN = 500


class Generators:
    """Generators draw random numbers for many tables (S), with one generator for each table.

    They have the methods of ``numpy.random.Generator``, which return one row a table. A table draws
    from its own generator.

    >>> rng = Generators([np.random.default_rng(seed) for seed in (1, 2, 3)])
    >>> rng.random((4, 2)).shape, rng.integers(6).shape
    ((3, 4, 2), (3,))
    """

    def __init__(self, each: Sequence[np.random.Generator]) -> None:
        self.each = np.asarray(each, dtype=object)

    def __len__(self) -> int:
        return len(self.each)

    def __reduce__(self) -> Any:
        return Generators, (list(self.each),)  # Attributes that are not here are a Generator's.

    def __getattr__(self, name: str) -> Callable[..., NDArray[Any]]:
        method = getattr(np.random.Generator, name)
        return lambda *args, **kwargs: np.array([method(one, *args, **kwargs) for one in self.each])

    def at(self, rows: Any) -> Generators:
        """Return the generators of some tables."""
        some = Generators([])
        some.each = self.each[rows]
        return some

    def random(self, size: int | tuple[int, ...] = ()) -> Floats:
        """Return numbers from 0 to 1, each as likely as any other, with one row a table."""
        shape = (size,) if isinstance(size, int) else size
        found = np.empty((len(self), math.prod(shape)))
        for one, row in zip(self.each, found, strict=True):
            one.random(out=row)
        return found.reshape(len(self), *shape)


class Layouts:
    """Layouts draw balls at random places, where they touch no cushion, pocket or other ball."""

    def __init__(self, scene: Scene) -> None:
        assert scene.table is not None, "a game has a table"
        self.scene = scene
        # No part of a ball may lie over a pocket, so pockets are posts here.
        posts = [*scene.posts, *(Post(p.position, p.radius) for p in scene.pockets)]
        self.floor = floor_between(scene.table, posts)
        x0, y0, x1, y1 = scene.table.bounds
        self.spots = [
            Spot(r, (x0 + r, y0 + r), (x1 - r - (x0 + r), y1 - r - (y0 + r)))
            for r in (ball.radius for ball in scene.balls)
        ]

    def __reduce__(self) -> Any:
        return Layouts, (self.scene,)

    def draw(self, rng: Generators) -> Floats:
        """Return a layout (S, N, 2), in m, for each of the generators."""
        count, balls = len(rng), len(self.spots)
        found, begun = np.zeros((count, balls, 2)), np.zeros(count, int)
        for _ in range(MOST_DRAWN):
            rows = np.flatnonzero(begun < balls)
            if not len(rows):
                return found
            shares = rng.at(rows).random(DRAWN * balls * 2)
            places, its = bytearray(found[rows]), begun[rows].tolist()
            lay_out(self.floor, self.spots, shares.tobytes(), places, its)
            found[rows], begun[rows] = np.frombuffer(places).reshape(-1, balls, 2), its
        if (begun < balls).any():
            message = "no free places for all balls were found: ask for fewer balls"
            raise setting_error("layout", "random", message)
        return found
