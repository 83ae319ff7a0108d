"""The exact solver jumps from contact to contact, because motion between them is closed-form.

It has no time step, and it errs by rounding alone. The core plays the run
(:mod:`pool_pymunk.core.engine`). Contacts that persist are played as exactly as a tolerance asks
(:mod:`pool_pymunk.core.persistent.groups`).
"""

from __future__ import annotations

import math

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.persistent.groups import persistence_of
from pool_pymunk.laws import law_in_core
from pool_pymunk.model import Scene, State
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.by_core import Listener, keep, pull_of, tell, vary
from pool_pymunk.solvers.in_core import balls_of, table_of
from pool_pymunk.solvers.record import Settings


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here, and events carry their true times."""
    law, table = settings.law_of(scene), table_of(scene)
    balls = balls_of(scene, start, table)
    trace = Trace(start, [pull_of(ball.path) for ball in balls])
    record = Listener(trace, settings.on_time)
    tolerance = settings.contact_tolerance * settings.variant.coarser
    persistence = persistence_of(table, balls, tolerance)
    engine = Engine(table, balls, law_in_core(law), record, persistence)
    vary(engine.errors, settings.variant)
    engine.most_events = settings.max_events
    for id_ in start.off:
        i = scene.index[id_]
        engine.remove(balls[i], start.position[i])
    engine.begin_run()
    latest = math.inf if settings.max_time is None else settings.max_time
    engine.advance(latest)
    keep(trace, engine, record, latest)
    tell(trace, record, scene, law)
    return trace
