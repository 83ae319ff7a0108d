"""This solver puts the scene into a pymunk space.

Cushions are static segments, and balls are circles of a :class:`pool_pymunk.world.Billiards`. A
scene without friction gets no joints or callbacks, and a ball at rest costs no callback.
"""

from __future__ import annotations

import math
from functools import cache

import pymunk

from pool_pymunk.model import Scene, State
from pool_pymunk.physics.of_core import wall_of
from pool_pymunk.physics.surface import NO_ROLL
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.exact import begin, cut_off
from pool_pymunk.solvers.record import Settings
from pool_pymunk.world.billiards import Billiards, FrictionBy


def solve(
    scene: Scene, start: State, settings: Settings, *, friction: FrictionBy = "joint"
) -> Trace:
    """Simulate with steps of ``settings.dt`` s; contacts come at their true times inside them."""
    table = set_up(scene, start, settings, friction)
    trace = begin(scene, start, settings, table.engine)
    table.play(settings.on_time, math.inf if settings.max_time is None else settings.max_time)
    trace.steps = table.steps
    trace.status = _status(table)
    cut_off(trace, table.engine, table.time)
    return trace


def _status(table: Billiards) -> str:
    """Tell why the run ended."""
    if not table.engine.is_finite:
        return "non_finite"
    if table.engine.is_over and (table.moving or table.engine.upcoming() < math.inf):
        return "max_events"
    return "max_time" if table.moving else "settled"


def set_up(scene: Scene, start: State, settings: Settings, friction: FrictionBy) -> Billiards:
    """Return a space with the scene's cushions, and its balls in motion."""
    assert settings.dt is not None
    space = pymunk.Space()
    space.iterations = 1  # Each friction joint pulls at its own ball alone.
    table = Billiards(
        space,
        settings.dt,
        pair=scene.pair,
        law=settings.law_of(scene),
        deceleration=scene.deceleration,
        rolling=scene.surface.drag if scene.surface.rolls else None,
        friction=friction,
        alone=True,
    )
    table.engine.pair = cache(scene.pair)  # A scene's pairs need no check.
    table.engine.lay(scene.surface, scene.ground)
    rolls = start.roll or (NO_ROLL,) * len(scene.balls)
    starts = zip(scene.balls, start.position, start.velocity, rolls, strict=True)
    for ball, position, velocity, roll in starts:
        body = pymunk.Body(ball.mass, math.inf)
        body.position, body.velocity = position, velocity
        table.put_ball(pymunk.Circle(body, ball.radius), roll)
    for id_ in start.off:
        table.remove_ball(table.balls[scene.index[id_]])
    for wall, shape in zip(scene.cushions, cushion_shapes(scene, space), strict=True):
        table.put_wall(shape, wall_of(wall))
    for hole in scene.pockets:
        table.add_pocket(hole.position, hole.radius)
    return table


# of an arc's radius; a polygon of pieces of the arc is widened by this. The pieces lie 4e-5 off the
# arc (PIECES), so half as much would do; twice as much makes more balls near, and moves no end.
AROUND = 1e-3


def cushion_shapes(scene: Scene, space: pymunk.Space) -> list[pymunk.Shape]:
    """Return shapes that hold the scene's cushions, and its posts.

    A straight cushion is a segment, and a post a circle. pymunk has no arcs: a polygon around one
    finds the balls that are near it, and the arc itself answers them.
    """
    found: list[pymunk.Shape] = []
    ground = space.static_body
    for edge in scene.table.edges if scene.table else ():
        if edge.bulge == 0.0:
            found.append(pymunk.Segment(ground, edge.start, edge.end, 0.0))
        else:
            around = [*edge.points(), edge.end]
            found.append(pymunk.Poly(ground, around, radius=AROUND * edge.arc_radius))
    return [*found, *(pymunk.Circle(ground, p.radius, p.position) for p in scene.posts)]
