"""This module checks the places of balls in many layouts, by the rules of model.places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast import compiled
from pool_pymunk.fast.loop import misplaced
from pool_pymunk.fast.tables import plain, table_of
from pool_pymunk.model import Scene
from pool_pymunk.model.places import TOUCHING

# Python looks at this many layouts in less time than numba takes to load, which is about a second.
FEW = 500


def may_lie(scene: Scene, position: Any, share: float = TOUCHING) -> NDArray[np.bool_]:
    """Tell which balls (S, N) of layouts (S, N, 2), in m, may lie where they are.

    Such a ball is on the table, in no cushion and no pocket, and in no ball before it. An overlap
    of up to a ``share`` of a radius counts as a touch. NaN stands for a ball off the table.

    >>> from pool_pymunk import load
    >>> may_lie(load("two-balls"), [[(0.5, 0.5), (0.5, 0.51)]]).tolist()
    [[True, False]]
    """
    places = np.array(position, dtype=float)
    is_off = np.isnan(places).any(axis=-1).astype(np.int64)
    radius = np.array([ball.radius for ball in scene.balls])
    free = np.empty(is_off.shape, np.bool_)
    table, mark = table_of(scene), mark_free
    if len(places) < FEW or not compiled.is_there():
        table = plain(table)
    else:
        mark = compiled.alone(mark_free)
    mark(table, places, is_off, radius, share, free)
    return free


def mark_free(table: Any, position: Any, is_off: Any, radius: Any, share: float, free: Any) -> int:
    """Mark the balls that may lie where they are, or are off the table; return how many do."""
    count = 0
    for s in range(len(position)):
        for i in range(len(radius)):
            found = misplaced(table, position[s], is_off[s], radius, share, i, i + 1)
            free[s, i] = found > i
            count += free[s, i]
    return count
