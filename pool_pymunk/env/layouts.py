"""This module draws for many tables at once: random numbers, and places where balls are free."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
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

Floats = NDArray[np.float64]

PLACES = 2  # This many places a ball are drawn at once.
FEW = 4_096  # Laying out these tables takes 1.4 ms, as long as starting threads.
# A ball that has found no free place after this number of draws has no room. Where a hundredth of
# the table is free, this is wrong once in 23,000 times.
MOST_DRAWN = 500


class Generators:
    """Generators draw random numbers for many tables (S), with one generator for each table.

    They have the methods of ``numpy.random.Generator``, which return one row a table. A table draws
    from its own generator. Only ``random`` is compiled. All bit generators must be of one kind.

    >>> rng = Generators([np.random.default_rng(seed) for seed in (1, 2, 3)])
    >>> rng.random((4, 2)).shape, rng.integers(6).shape
    ((3, 4, 2), (3,))
    """

    def __init__(self, each: Sequence[np.random.Generator]) -> None:
        self.each = np.asarray(each, dtype=object)
        kinds = {type(one.bit_generator).__name__ for one in self.each}
        if len(kinds) > 1:
            raise setting_error("generators", sorted(kinds), "must be of one kind")
        known = [one.bit_generator.ctypes for one in self.each]
        self.draw = known[0].next_double if known else None  # a C function of a state
        self.states = np.array([one.state_address for one in known], np.uint64)

    def __len__(self) -> int:
        return len(self.each)

    def __reduce__(self) -> Any:
        return Generators, (list(self.each),)  # The states of a copy are elsewhere.

    def __getattr__(self, name: str) -> Callable[..., NDArray[Any]]:
        method = getattr(np.random.Generator, name)
        return lambda *args, **kwargs: np.array([method(one, *args, **kwargs) for one in self.each])

    def at(self, rows: Any) -> Generators:
        """Return the generators of some tables."""
        some = Generators([])
        some.each, some.draw, some.states = self.each[rows], self.draw, self.states[rows]
        return some

    def random(self, size: int | tuple[int, ...] = ()) -> Floats:
        """Return numbers from 0 to 1, each as likely as any other, with one row a table."""
        shape = (size,) if isinstance(size, int) else size
        found = np.empty((len(self), math.prod(shape)))
        if len(self) == 1:  # numba takes longer to check its arguments.
            self.each[0].random(out=found[0])
        else:
            compiled.alone(fill)(self.draw, self.states, found)
        return found.reshape(len(self), *shape)


class Layouts:
    """Layouts draw balls at random places, where they touch no cushion, pocket or other ball."""

    def __init__(self, scene: Scene) -> None:
        assert scene.table is not None, "a game has a table"
        # No part of a ball may lie over a pocket, so pockets are walls here.
        filled = [Wall((RoundSide(p.position, p.radius),), 0.0, 0.0, 0) for p in scene.pockets]
        table = arrays_of([*scene.cushions, *filled], scene.table)
        self.table = table if compiled.is_there() else plain(table)
        self.radius = np.array([ball.radius for ball in scene.balls])
        corners = np.array(scene.table.bounds).reshape(2, 1, 2)
        self.corner = corners[0] + self.radius[:, np.newaxis]
        self.size = corners[1] - self.radius[:, np.newaxis] - self.corner

    def draw(self, rng: Generators) -> Floats:
        """Return a layout (S, N, 2), in m, for each of the generators."""
        layouts, lay_out = np.empty((len(rng), *self.size.shape)), compiled.alone(lay_out_all)
        table = self.table, self.radius, self.corner, self.size
        each = max(FEW, -(-len(rng) // (os.cpu_count() or 1)))
        parts = [slice(first, first + each) for first in range(0, len(rng), each)]

        def work(part: slice) -> int:
            return lay_out(rng.draw, rng.states[part], *table, layouts[part])

        with ThreadPoolExecutor() if len(parts) > 1 else nullcontext() as pool:
            if sum(pool.map(work, parts) if pool else map(work, parts)) < len(rng):
                message = "no free places for all balls were found: ask for fewer balls"
                raise setting_error("layout", "random", message)
        return layouts


def fill(draw: Any, states: Any, found: Any) -> int:
    """Draw a row of numbers from each state, and return how many; numba can compile it."""
    for s in range(len(states)):
        for k in range(found.shape[1]):
            found[s, k] = draw(int(states[s]))
    return len(states)


def lay_out_all(
    draw: Any, states: Any, table: Any, radius: Any, corner: Any, size: Any, layouts: Any
) -> int:
    """Lay out tables until one has no room, and return how many; numba can compile it."""
    count, is_off = len(radius), np.zeros(len(radius), np.int64)
    shares = np.empty((1, PLACES * count * 2))
    for s in range(len(states)):
        layout, i, tries = layouts[s], 0, 0
        while i < count:
            if tries == MOST_DRAWN:
                return s
            fill(draw, states[s : s + 1], shares)
            k, tries = 0, tries + 1
            while i < count and k < PLACES:
                for axis in range(2):
                    share = shares[0, 2 * (k * count + i) + axis]
                    layout[i, axis] = share * size[i, axis] + corner[i, axis]
                k += 1
                if fits(table, layout, is_off, radius, i):
                    i, k = i + 1, 0
    return len(states)


def fits(table: Any, layout: Any, is_off: Any, radius: Any, i: int) -> bool:
    """Tell whether ball ``i`` touches nothing that was there before it."""
    return misplaced(table, layout, is_off, radius, TOUCHING, i, i + 1) > i
