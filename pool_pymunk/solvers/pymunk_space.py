"""This solver puts the scene into a pymunk space.

Cushions are static segments, and balls are circles of a :class:`pool_pymunk.world.Billiards`, which
plays by the same core as ``event-driven``: so the ends have the same bits, whatever the step.
"""

from __future__ import annotations

import math

import pymunk

from pool_pymunk.model import Scene, State
from pool_pymunk.model.problems import setting_error
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers.by_core import play
from pool_pymunk.solvers.in_core import new_table_of
from pool_pymunk.solvers.record import Settings
from pool_pymunk.world.billiards import Billiards
from pool_pymunk.world.checks import Drawn
from pool_pymunk.world.walls import STILL


def solve(scene: Scene, start: State, settings: Settings, *, friction: str = "joint") -> Trace:
    """Simulate with steps of ``settings.dt`` s; contacts come at their true times inside them.

    Both choices of ``friction`` are the same now: the core slows balls down.
    """
    table = set_up(scene, start, settings)
    trace = play(
        table.engine, scene, start, settings._replace(on_time=None),
        lambda latest: table.play(settings.on_time, latest),
    )  # fmt: skip
    trace.steps = table.steps
    return trace


def set_up(scene: Scene, start: State, settings: Settings) -> Billiards:
    """Return a space with the scene's cushions, and its balls in motion."""
    assert settings.dt is not None
    space = pymunk.Space()
    space.gravity = scene.tilt
    table = Billiards(
        space,
        settings.dt,
        pair=scene.pair,
        law=settings.law_of(scene),
        contact_tolerance=settings.contact_tolerance * settings.variant.coarser,
    )
    own = new_table_of(scene)
    walls, own.walls = own.walls[: len(scene.cushions)], []
    table.live.lay(own)
    table.live.gravity = scene.tilt  # The table of the core has it already.
    shapes = cushion_shapes(scene, table.space)
    if len(walls) != len(shapes):
        message = "takes the walls of tables and posts only, and this scene has walls of its own"
        raise setting_error("solver", "pymunk", f"{message}; event-driven plays them")
    for wall, shape in zip(walls, shapes, strict=True):
        table.put_wall(shape, wall)
    for hole in scene.pockets:
        table.add_pocket(hole.position, hole.radius)
    rolls = start.roll or (STILL,) * len(scene.balls)
    starts = zip(scene.balls, start.position, start.velocity, rolls, strict=True)
    for ball, position, velocity, roll in starts:
        body = pymunk.Body(ball.mass, math.inf)
        body.position, body.velocity = position, velocity
        one = table.put_ball(pymunk.Circle(body, ball.radius), roll)
        one.core.is_cue = ball.cue
    for id_ in start.off:
        table.remove_ball(table.balls[scene.index[id_]])
    return table


# of an arc's radius; a polygon of pieces of the arc is widened by this. The pieces lie 4e-5 off the
# arc (PIECES), so half as much would do; twice as much makes more balls near, and moves no end.
AROUND = 1e-3


def cushion_shapes(scene: Scene, space: pymunk.Space) -> list[Drawn]:
    """Return shapes that hold the scene's cushions, and its posts.

    A straight cushion is a segment, and a post a circle. pymunk has no arcs: a polygon around one
    shows where it is, and the arc itself answers the balls.
    """
    found: list[Drawn] = []
    ground = space.static_body
    for edge in scene.table.edges if scene.table else ():
        if edge.bulge == 0.0:
            found.append(pymunk.Segment(ground, edge.start, edge.end, 0.0))
        else:
            around = [*edge.points(), edge.end]
            found.append(pymunk.Poly(ground, around, radius=AROUND * edge.arc_radius))
    return [*found, *(pymunk.Circle(ground, p.radius, p.position) for p in scene.posts)]
