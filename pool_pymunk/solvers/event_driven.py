"""The exact solver: between contacts the motion is closed-form, so jump from contact to contact.

There is no time step and no error but rounding: the contact engine
(:mod:`pool_pymunk.engine.contacts`) looks for what is near by boxes around the balls' paths.
"""

from __future__ import annotations

import math
from functools import cache

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.near import MANY, Boxes, ManyBoxes
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.path import motion_at, set_off
from pool_pymunk.physics.sides import Face, Post, Wall
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.settings import Settings, TraceRecorder, warn_if_given_up


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here.

    Events carry their true times; the Run's positions are closed-form at any time.
    """
    trace = Trace(start)
    engine = set_up(scene, start, settings, trace)
    latest = math.inf if settings.max_time is None else settings.max_time
    settings.bound(engine)
    engine.advance(latest)
    trace.steps = engine.answered
    trace.status = _status(engine, latest)
    if trace.status == "settled":
        return trace
    if trace.status == "max_time" and latest < math.inf:
        engine.now = latest
    trace.duration = engine.now
    warn_if_given_up(engine, trace)
    for i in engine.moving():
        x, y, vx, vy = motion_at(engine.paths[i], engine.now)
        trace.knot(i, engine.now, (x, y), (vx, vy))
    return trace


def set_up(scene: Scene, start: State, settings: Settings, trace: Trace) -> ContactEngine:
    """The contact engine with the scene's balls on their way."""
    law = settings.law_of(scene)
    recorder = TraceRecorder(scene, trace, law)
    engine = ContactEngine(law, cache(scene.pair), scene.deceleration, recorder)
    for ball, position, velocity in zip(scene.balls, start.position, start.velocity, strict=True):
        path = set_off(0.0, position, velocity, scene.deceleration)
        engine.add_ball(path, ball.radius, ball.mass)
    engine.walls = walls(scene)
    boxes = Boxes if len(scene.balls) < MANY else ManyBoxes
    engine.near = boxes(len(scene.balls), len(engine.walls))
    for i, path in enumerate(engine.paths):
        engine.near.begin(i, path, engine.radii[i], math.inf)
    for id_ in start.off:
        engine.remove(scene.index[id_])
    if engine.is_finite:
        engine.predict([i for i, path in enumerate(engine.paths) if path.speed > 0.0])
    return engine


def walls(scene: Scene) -> list[Wall]:
    """The scene's cushions: each has its face, and its first corner where that sticks out."""
    if scene.table is None:
        return []
    e = scene.restitution.cushion
    assert e is not None, "the scene saw to it"
    found = []
    for number, edge in enumerate(scene.table.edges):
        face = Face(edge.start, edge.tangent, edge.normal, edge.length)
        corner = (Post(edge.start),) if number in scene.table.reflex_corners else ()
        found.append(Wall((face, *corner), e, scene.friction.cushion, number))
    return found


def _status(engine: ContactEngine, latest: float) -> str:
    """Why the engine went no further."""
    if not engine.is_finite:
        return "non_finite"
    if engine.upcoming() < math.inf:
        return "max_time" if engine.upcoming() > latest else "max_events"
    drifts = any(path.stop == math.inf for path in engine.paths)
    return "max_time" if drifts else "settled"


SOLVER = Solver(
    name="event-driven", solve=solve, about="exact: from contact to contact", dt=None, exact=True,
    no_tolerance="it is exact and has no step: no tolerance is needed",
    color="#000000", marker="*",
)  # fmt: skip
