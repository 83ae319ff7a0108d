"""This module follows small changes through many shots, one after the other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.tangent.shot import changes_of
from pool_pymunk.fast.shots import Source
from pool_pymunk.model import State
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import points
from pool_pymunk.solvers.small_changes import (
    Pausing,
    check_surface,
    corners_of,
    engine_of,
    inputs_of,
)

BLOCK = 1_000  # So many starts are changed at once; a tenth and ten times as many take as long.


def derive(source: Source, names: Names, is_played: NDArray[np.bool_]) -> Array:
    """Return the derivatives (S, N, 2, P) of the ends of shots; NaN for those that cannot start.

    Raises SettingError for a surface of somebody's own.
    """
    check_surface(source.scene)
    count, balls, _ = source.position.shape
    found = np.full((count, balls, 2, len(names)), math.nan)
    numbers = changed_numbers(source.scene, names, "restitution.cue_ball" in source.vary)
    corners = corners_of(source.scene)
    struck = source.watched if source.watched >= 0 else None
    for first in range(0, count, BLOCK):
        part = slice(first, min(first + BLOCK, count))
        is_off = np.asarray(np.isnan(source.position[part]).any(axis=-1))
        velocity, roll = (
            None if each is None else np.where(is_off[..., np.newaxis], 0.0, each[part])
            for each in (source.velocity, source.roll)
        )
        assert velocity is not None
        starts = starts_of(source.scene, names, struck, velocity, roll)
        places = source.places(part, is_off)
        for n in np.flatnonzero(is_played[part]).tolist():
            rolls = None if roll is None else points(roll[n])
            off = frozenset(source.scene.balls[i].id for i in np.flatnonzero(is_off[n]))
            start = State(points(places[n]), points(velocity[n]), off, rolls)
            engine = engine_for(source, first + n, start)
            inputs = inputs_of(source.scene, starts[n], numbers)
            limit = source.asked.settings.max_time
            latest = math.inf if limit is None else limit
            ends = changes_of(engine, latest, Pausing(), corners, inputs)
            found[first + n] = np.array(ends).reshape(balls, 2, len(names))
    return found


def engine_for(source: Source, k: int, start: State) -> Engine:
    """Return an engine that has the balls of shot ``k`` on their first paths."""
    scene = source.scene_of(k) if source.vary else source.scene
    return engine_of(scene, start, source.law, source.asked.settings.contact_tolerance)
