"""The scene in a pymunk space: cushions are static segments, balls are circles.

The contact law and surface friction come from :mod:`pool_pymunk.adapter`. A part that the scene
leaves out is not installed: no table, no segments; no surface friction, no damping; a ball at rest
costs no callback.
"""

from __future__ import annotations

import math
from functools import partial
from itertools import count

import pymunk

from pool_pymunk.adapter import Ball, Billiards, Contact, Contacts, FrictionBy
from pool_pymunk.path import Face, Post
from pool_pymunk.result import Trace
from pool_pymunk.scene import Scene, State, Table
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.settings import NEVER_SETTLES, Settings, slip_warning
from pool_pymunk.walls import face_between


def solve(
    scene: Scene,
    start: State,
    settings: Settings,
    *,
    contacts: Contacts = "swept",
    friction: FrictionBy = "joint",
) -> Trace:
    """Simulate with steps of ``settings.dt`` s.

    ``contacts`` "swept" finds every contact at its true time inside the step; "discrete" answers
    overlaps at the end of the step, an error of first order in dt.
    """
    assert settings.dt is not None
    trace = Trace(start)
    table = _set_up(scene, start, settings.dt, contacts, friction)
    most = NEVER_SETTLES if settings.max_events is None else settings.max_events
    _write_down(scene, table, trace, most)
    for ball, velocity in zip(table.balls, start.velocity, strict=True):
        if velocity != (0.0, 0.0):
            table.strike(ball, velocity)
    trace.knots = [knots[:1] for knots in trace.knots]
    if settings.max_time is not None:
        table.latest = settings.max_time
    try:
        table.play()
        trace.status = _status(table)
    except _Enough as enough:
        trace.status = "max_events"
        table.end_at(enough.t)
    trace.steps = table.steps
    if trace.status != "settled":
        trace.duration = table.time
        for ball in table.balls:
            if ball.path.stop > table.time:
                trace.knot(ball.number, table.time, *ball.path.at(table.time))
    return trace


def _status(table: Billiards) -> str:
    if not table.is_finite:
        return "non_finite"
    return "max_time" if table.moving else "settled"


class _Enough(Exception):
    """There were as many events as a run may have; ``t`` (s) is when the last one was."""

    def __init__(self, t: float) -> None:
        super().__init__()
        self.t = t


discrete = partial(solve, contacts="discrete")


def _set_up(
    scene: Scene, start: State, dt: float, contacts: Contacts, friction: FrictionBy
) -> Billiards:
    """A space with the scene's cushions and balls."""
    space = pymunk.Space()
    table = Billiards(
        space,
        dt,
        pair=scene.pair,
        law=scene.physics.law,
        deceleration=scene.deceleration,
        contacts=contacts,
        friction=friction,
        alone=True,
    )
    for ball, position in zip(scene.balls, start.position, strict=True):
        body = pymunk.Body(ball.mass, math.inf)
        body.position = position
        table.add_ball(pymunk.Circle(body, ball.radius))
    if scene.table is not None:
        restitution = scene.restitution.cushion
        assert restitution is not None
        for number, edge in enumerate(scene.table.edges):
            cushion = pymunk.Segment(space.static_body, edge.start, edge.end, 0.0)
            sides = _sides(scene.table, number)
            table.add_wall(cushion, restitution, scene.friction.cushion, sides)
    return table


def _sides(table: Table, number: int) -> tuple[Face | Post, ...]:
    """What balls meet of a cushion: its face, and its first corner where that sticks out."""
    edge = table.edges[number]
    face = face_between(edge.start, edge.end)
    return (face, Post(edge.start)) if number in table.reflex_corners else (face,)


def _write_down(scene: Scene, table: Billiards, trace: Trace, most: int) -> None:
    """Let the trace hear of contacts, new paths, stops and warnings; stop at so many events."""

    answers = count(1)  # not all are listed as events

    def contact(contact: Contact) -> None:
        if contact.wall is None:
            trace.ball_ball(contact.t, *contact.balls)
        else:
            trace.ball_cushion(contact.t, contact.balls[0], contact.wall)
        for i, j in table.hits.impacts.zero_slips:
            trace.warn(slip_warning(scene.balls[i].id, scene.balls[j].id), contact.t)
        table.hits.impacts.zero_slips.clear()

    def answer(t: float) -> None:
        if max(len(trace.events), next(answers)) >= most:
            raise _Enough(t)

    def path(ball: Ball) -> None:
        trace.knot(ball.number, ball.path.t, ball.path.position, ball.path.velocity)

    def stop(ball: Ball) -> None:
        trace.stop(ball.number, ball.path.stop, ball.path.rest)

    def stir(ball: Ball) -> None:
        trace.forget_stop(ball.number, ball.rested)

    table.on_contact = contact
    table.on_answer = answer
    table.on_path = path
    table.on_stop = stop
    table.on_stir = stir
    table.on_warning = trace.warn
    table.name_of = lambda i: scene.balls[i].id


FRICTION = {"friction": ("joint", "callback")}
SWEPT = Solver(
    name="pymunk", solve=solve, about="in a pymunk space, contacts inside the step", dt=1 / 240,
    options={"contacts": ("swept", "discrete"), **FRICTION}, exact=True, finest=1e-4,
    ladder=(1 / 30, 1 / 60, 1 / 120, 1 / 240, 1e-3),
    stability_steps=(1 / 60, 1 / 240, 1 / 1000), quick_stability_steps=(1 / 60,),
    color="#009e73", marker="o",
)  # fmt: skip
DISCRETE = Solver(
    name="pymunk-discrete", solve=discrete, about="the same, contacts at a step's end", dt=1e-4,
    options=FRICTION, late=True, finest=1e-6,
    ladder=(1 / 60, 1 / 120, 1 / 240, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5),
    quick_stability_steps=(1e-3,), color="#56b4e9", marker="s",
    limits="answers overlaps at the end of a step: it misses grazes and what tunnels, and every "
    "contact comes up to a step late",
)  # fmt: skip
