"""The exact solver jumps from contact to contact, because motion between them is closed-form.

It has no time step, and it errs by rounding alone. The core plays the run
(:mod:`pool_pymunk.core.engine`). Contacts that persist are played as exactly as a tolerance asks
(:mod:`pool_pymunk.core.persistent.groups`).
"""

from __future__ import annotations

from pool_pymunk.model import Scene, State
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.by_core import engine_of, play
from pool_pymunk.solvers.record import Settings


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here, and events carry their true times."""
    tolerance = settings.contact_tolerance * settings.variant.coarser
    engine = engine_of(scene, start, settings.law_of(scene), tolerance)

    def advance(latest: float) -> None:
        engine.begin_run()
        engine.advance(latest)

    return play(engine, scene, start, settings, advance)
