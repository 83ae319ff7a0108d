"""The contact engine plays single runs here, for tests that compare the core with it.

It has no time step. The contact engine
(:mod:`pool_pymunk.engine.contacts`) finds what is near a ball by boxes around the balls' paths.
"""

from __future__ import annotations

import math
from functools import cache

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import boxes_around
from pool_pymunk.engine.recorder import Recorder
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.of_core import wall_of
from pool_pymunk.physics.path import sets_off
from pool_pymunk.physics.surface import NO_ROLL
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.exact import begin, cut_off, pockets
from pool_pymunk.solvers.record import Settings


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here, and events carry their true times."""
    law, pair = settings.law_of(scene), cache(scene.pair)
    engine = ContactEngine(law, pair, scene.surface, Recorder())
    engine.lay(scene.surface, scene.ground)
    engine.compiled = settings.compiled
    rolls = start.roll or (NO_ROLL,) * len(scene.balls)
    starts = zip(scene.balls, start.position, start.velocity, rolls, strict=True)
    for i, (ball, *motion) in enumerate(starts):
        engine.add_ball(engine.path_at(i, 0.0, *motion), ball.radius, ball.mass)
    engine.walls = [*map(wall_of, scene.cushions), *pockets(scene)]
    engine.near = boxes_around(engine.paths, engine.radii, len(engine.walls))
    for id_ in start.off:
        engine.remove(scene.index[id_])
    if engine.is_finite:
        engine.predict([i for i, path in enumerate(engine.paths) if sets_off(path)])
    trace = begin(scene, start, settings, engine)
    latest = math.inf if settings.max_time is None else settings.max_time
    engine.advance(latest)
    trace.steps = engine.tally.answered
    trace.status = _status(engine, latest)
    is_cut = trace.status == "max_time" and latest < math.inf
    cut_off(trace, engine, latest if is_cut else engine.now)
    return trace


def _status(engine: ContactEngine, latest: float) -> str:
    """Tell why the run ended."""
    if not engine.is_finite:
        return "non_finite"
    if engine.upcoming() < math.inf:
        return "max_time" if engine.upcoming() > latest else "max_events"
    drifts = any(path.end == math.inf for path in engine.paths)
    return "max_time" if drifts else "settled"
