"""This module checks the places of balls in many layouts, by the rules of model.places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core import layouts
from pool_pymunk.core.floor import TOUCHING
from pool_pymunk.model import Scene
from pool_pymunk.solvers.in_core import floor_of


def may_lie(scene: Scene, position: Any, share: float = TOUCHING) -> NDArray[np.bool_]:
    """Tell which balls (S, N) of layouts (S, N, 2), in m, may lie where they are.

    Such a ball is on the table, in no cushion and no pocket, and in no ball before it. An overlap
    of up to a ``share`` of a radius counts as a touch. NaN stands for a ball off the table.

    >>> from pool_pymunk import load
    >>> may_lie(load("two-balls"), [[(0.5, 0.5), (0.5, 0.51)]]).tolist()
    [[True, False]]
    """
    places = np.array(position, dtype=float)
    radii = [ball.radius for ball in scene.balls]
    free = layouts.may_lie(floor_of(scene), radii, places.tobytes(), share)
    return np.frombuffer(free, np.bool_).reshape(places.shape[:2])
