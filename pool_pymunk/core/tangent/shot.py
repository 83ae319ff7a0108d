"""The changes of one shot: what has played is followed by a tangent."""

from __future__ import annotations

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.tangent.course import Course
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.rounding import Errors
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.core.tangent.touches import Corner


def tangent_of(engine: Engine, course: Course, corners: list[Corner], inputs: Inputs) -> Tangent:
    """Return a tangent along the course that an engine has played and that is closed."""
    return Tangent(engine.table, engine.law, engine.balls, corners, course, inputs)


def errors_of(engine: Engine) -> Errors:
    """Return rounding errors for what an engine has played."""
    return Errors(engine.table.surface.rolls, engine.table.pull > 0.0)


def ends_of(tangent: Tangent) -> list[list[float]]:
    """Return the changes (N, 6 P) of all balls: place, velocity and roll, one after the other."""
    found: list[list[float]] = []
    for track in tangent.tracks:
        x, y = [c.x for c in track.changes], [c.y for c in track.changes]
        vx, vy = [c.vx for c in track.changes], [c.vy for c in track.changes]
        wx, wy = [c.wx for c in track.changes], [c.wy for c in track.changes]
        found.append(x + y + vx + vy + wx + wy)
    return found
