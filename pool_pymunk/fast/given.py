"""This module gives shots to the compiled loop, in records and arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.engine.decisions import NEVER_SETTLES
from pool_pymunk.fast.records import Shots
from pool_pymunk.fast.tables import (
    coefficients_of,
    cue_of,
    law_number,
    loop_form,
    put_patches,
    together_number,
)
from pool_pymunk.many.source import Floats, Source, is_gone
from pool_pymunk.model import inputs

OF_SURFACE = ("friction.surface", "friction.rolling")
COLUMNS = inputs.column_of("coefficients")  # of the coefficients of the compiled shots


def work_of(source: Source, keeps: bool) -> Any:
    """Return an array (1,) of a record to play shots in, which may keep their tracks."""
    work = np.zeros(1, loop_form(source.scene).work)
    put_patches(work, source.scene.ground)
    own, latest = work[0].scene, source.asked.settings.max_time
    own.kind, own.together = law_number(source.law), together_number(source.law)
    own.watched, own.keeps, own.coarser, own.most = source.watched, keeps, 1.0, NEVER_SETTLES
    own.balls, own.walls = len(source.scene.balls), len(source.scene.cushions)
    own.cue, own.latest = cue_of(source.scene), np.inf if latest is None else latest
    return work


def shots_of(source: Source, part: slice) -> Shots:
    """Return some of the shots as the compiled loop takes them, in arrays of their own."""
    is_off, balls = is_gone(source.position[part]), source.scene.balls
    mass = own_array(np.broadcast_to([ball.mass for ball in balls], is_off.shape))
    own = coefficients_of(source.scene)
    coefficients = own_array(np.broadcast_to(own, (len(mass), len(own))))
    for key, values in source.vary.items():
        if key == "mass":
            mass[:] = values[part]
        else:
            unit = source.scene.physics.gravity if key in OF_SURFACE else 1.0
            coefficients[:, COLUMNS[key]] = values[part] * unit
    if "restitution.cue_ball" not in source.vary and source.scene.restitution.cue_ball is None:
        coefficients[:, 1] = coefficients[:, 0]  # The cue ball is as any other.
    radius = np.array([ball.radius for ball in balls])
    places, velocity = source.places(part, is_off), own_array(source.velocity[part])
    roll = own_array(source.velocity[:0] if source.roll is None else source.roll[part])
    return Shots(places, velocity, roll, is_off.astype(np.int64), mass, radius, coefficients)


def own_array(array: NDArray[Any]) -> Floats:
    """Return a copy in C order, because numba compiles anew for another order in memory."""
    return np.array(array, order="C")
