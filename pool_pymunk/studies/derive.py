"""This module follows small changes through many shots, one after the other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.tangent.shot import changes_of
from pool_pymunk.model import State
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import points
from pool_pymunk.studies.changes import Pausing, check_surface, corners_of, engine_of, inputs_of

if TYPE_CHECKING:
    from pool_pymunk.fast.shots import Source

BLOCK = 1_000  # So many starts are changed at once; a tenth and ten times as many take as long.


def derive(source: Source, names: Names, is_played: NDArray[np.bool_]) -> Array:
    """Return the derivatives (S, N, 2, P) of the ends of shots; NaN for those that cannot start.

    Raises SettingError for a surface of somebody's own.
    """
    check_surface(source.scene)
    count, balls, _ = source.position.shape
    found = np.full((count, balls, 2, len(names)), math.nan)
    for first in range(0, count, BLOCK):
        part = slice(first, min(first + BLOCK, count))
        is_off = np.asarray(np.isnan(source.position[part]).any(axis=-1))
        velocity, roll = (
            None if each is None else np.where(is_off[..., np.newaxis], 0.0, each[part])
            for each in (source.velocity, source.roll)
        )
        assert velocity is not None
        struck = source.watched if source.watched >= 0 else None
        starts = starts_of(source.scene, names, struck, velocity, roll)
        places = source.places(part, is_off)
        for n in np.flatnonzero(is_played[part]).tolist():
            rolls = None if roll is None else points(roll[n])
            off = frozenset(source.scene.balls[i].id for i in np.flatnonzero(is_off[n]))
            start = State(points(places[n]), points(velocity[n]), off, rolls)
            found[first + n] = derive_one(source, first + n, start, names, starts[n])
    return found


def derive_one(source: Source, k: int, start: State, names: Names, starts: Array) -> Array:
    """Return the derivatives (N, 2, P) of the ends of shot ``k``."""
    scene = source.scene_of(k) if source.vary else source.scene
    numbers = changed_numbers(source.scene, names, "restitution.cue_ball" in source.vary)
    settings = source.asked.settings
    engine = engine_of(scene, start, source.law, settings.contact_tolerance)
    latest = math.inf if settings.max_time is None else settings.max_time
    inputs = inputs_of(scene, starts, numbers)
    found = changes_of(engine, latest, Pausing(), corners_of(scene), inputs)
    return np.array(found).reshape(len(starts), 2, len(names))
