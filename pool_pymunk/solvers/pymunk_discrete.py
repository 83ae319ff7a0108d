"""The method in one file: pymunk finds what overlaps, and the report's equations answer it.

Balls are circles in a pymunk space, and cushions are static segments. Balls slide as discs and do
not spin. A step of ``dt`` (s) does this, in this order:

1. pymunk moves every ball by v dt.
2. pymunk calls a handler for each two shapes that overlap. The handler switches pymunk's own
   response off. If the two sides close, the contact law changes their velocities at once: two balls
   by Eqs. 1-7, a ball at a cushion by Eq. 9.
3. pymunk calls a velocity function for each moving ball. It takes mu_s g dt off the speed (Eq. 10).
4. A pocket takes in a ball whose centre it has.

A contact is therefore answered up to a step late. Eq. 8 bounds the error of its direction by
v dt / r, and the error of a run is of first order in dt. Two balls that overlap at no step's end do
not meet, and a ball that travels farther than its radius in a step may pass a cushion.
"""

from __future__ import annotations

import math
from itertools import pairwise

import pymunk

from pool_pymunk.laws import respond
from pool_pymunk.laws.contact import (
    NO_BALL,
    Contact,
    Pair,
    Velocities,
    closing_speed,
    fastest,
    impulse_of,
)
from pool_pymunk.model import Point, Scene, State
from pool_pymunk.results.trace import Push, Trace
from pool_pymunk.results.words import without_slip
from pool_pymunk.solvers.record import Settings, Stepping

BALL, CUSHION = 1, 2  # These are the collision types of the shapes.
# of an arc's radius; its segments are so thick because they lie up to 4e-5 radii off the arc.
THICKNESS = 1e-4
ROUNDING = 1e-12  # of the speed; sides that close more slowly do so by rounding alone


def solve(scene: Scene, start: State, settings: Settings, *, friction: str = "callback") -> Trace:
    """Simulate with steps of ``settings.dt`` s; the one ``friction`` is the velocity function."""
    return Discrete(scene, start, settings).play(settings)


class Discrete(Stepping):
    """This is a pymunk space with a scene's balls and cushions."""

    moving: set[int]

    def __init__(self, scene: Scene, start: State, settings: Settings) -> None:
        super().__init__(scene, start, settings.dt)
        self.law, self.loss = settings.law_of(scene), scene.deceleration * self.dt  # m/s; mu_s g dt
        self.space = pymunk.Space()
        self.bodies: dict[int, pymunk.Body] = {}  # of the balls on the table
        self.number: dict[pymunk.Shape, int] = {}  # of the ball, or of the cushion
        self.moving = set()
        self.met: set[int] = set()  # the balls that the law has answered in this step
        self.raised: Exception | None = None  # what the law has raised in this step
        for i, ball in enumerate(scene.balls):
            if ball.id not in start.off:
                self._add_ball(i, start.position[i], start.velocity[i])
        self._add_cushions()
        self.space.on_collision(BALL, BALL, pre_solve=self._two_balls)
        self.space.on_collision(BALL, CUSHION, pre_solve=self._ball_and_cushion)

    # -- the scene in pymunk ---------------------------------------------------------------------

    def _add_ball(self, i: int, position: Point, velocity: Point) -> None:
        """Add a circle that does not spin, because its moment of inertia is infinite."""
        body = pymunk.Body(self.scene.balls[i].mass, math.inf)
        body.position, self.bodies[i] = position, body
        self.space.add(body)
        self._add(pymunk.Circle(body, self.scene.balls[i].radius), BALL, i)
        if velocity != (0.0, 0.0):
            self._set_off(i, velocity)

    def _add_cushions(self) -> None:
        """Add segments for the outline, whose arcs are polylines, and circles for the posts."""
        scene, ground = self.scene, self.space.static_body
        for number, edge in enumerate(scene.table.edges if scene.table else ()):
            thickness = THICKNESS * edge.arc_radius if edge.bulge != 0.0 else 0.0
            for a, b in pairwise([*edge.points(), edge.end]):
                self._add(pymunk.Segment(ground, a, b, thickness), CUSHION, number)
        for number, post in enumerate(scene.posts, start=scene.first_post):
            self._add(pymunk.Circle(ground, post.radius, post.position), CUSHION, number)

    def _add(self, shape: pymunk.Shape, kind: int, number: int) -> None:
        shape.collision_type, self.number[shape] = kind, number
        self.space.add(shape)

    # -- contacts (Eqs. 1-9) ---------------------------------------------------------------------

    def _two_balls(self, arbiter: pymunk.Arbiter, _space: object, _data: object) -> None:
        """Answer two balls that overlap (Eqs. 1-7); the normal n points from ball A to ball B."""
        i, j = sorted(self.number[shape] for shape in arbiter.shapes)
        normal = (self.bodies[j].position - self.bodies[i].position).normalized()
        if push := self._answer(arbiter, Contact(i, j, normal, self.scene.pair(i, j))):
            self.trace.ball_ball(self.time, i, j, push)

    def _ball_and_cushion(self, arbiter: pymunk.Arbiter, _space: object, _data: object) -> None:
        """Answer a ball that overlaps a cushion (Eq. 9); the normal n points into the table.

        The outline tells the gap and the normal, because an arc is round and its segments are not.
        """
        i, number = (self.number[shape] for shape in arbiter.shapes)
        ball, wall = self.scene.balls[i], self.scene.cushions[number]
        x, y = self.bodies[i].position
        side = wall.nearest(x, y, ball.radius, 0.0)
        pair = Pair(ball.mass, math.inf, wall.restitution, wall.friction)
        contact = Contact(i, NO_BALL, side.normal(x, y), pair, number)
        if push := self._answer(arbiter, contact, side.gap(x, y, ball.radius)):
            self.trace.ball_cushion(self.time, i, number, push)

    def _answer(self, arbiter: pymunk.Arbiter, contact: Contact, gap: float = -1.0) -> Push:
        """Let the law, and not pymunk, answer sides that overlap and close; return a hit's impulse.

        ``respond`` turns the velocities to n and t (Eqs. 4-5). It asks ``law.ball_ball`` (Eqs. 1-3,
        and friction, which changes v_t by mu |v_n' - v_n|) or ``law.cushion`` (Eq. 9), and turns
        the velocities back (Eqs. 6-7). A law may be the user's own, and pymunk swallows what a
        handler raises. So it is kept here, and ``advance`` raises it.
        """
        arbiter.process_collision = False
        velocity: Velocities = {i: self.bodies[i].velocity for i in contact.balls}
        closing = closing_speed(contact, velocity)
        before = [velocity[i] for i in contact.balls]
        if gap >= 0.0 or closing <= ROUNDING * fastest(velocity) or self.raised is not None:
            return None
        try:
            jumps = respond(self.law, contact, velocity)
        except Exception as error:
            self.raised = error
            return None
        if jumps:
            balls = " and ".join(self.scene.balls[i].id for i in contact.balls)
            self.trace.warn(without_slip(self.law.name, f"the hit of balls {balls}"), self.time)
        for i in contact.balls:
            self._set_off(i, velocity[i])
        self.met.update(contact.balls)
        # It is no new hit if surface friction alone has pressed together what touched before.
        if arbiter.is_first_contact or closing > 2.0 * self.loss:
            return impulse_of(contact, before, [velocity[i] for i in contact.balls])
        return None

    # -- surface friction (Eq. 10) ---------------------------------------------------------------

    def _set_off(self, i: int, velocity: Point) -> None:
        """Give a ball a velocity, and where there is friction the function that slows it down."""
        self.bodies[i].velocity = velocity
        self.moving.add(i)
        if self.loss > 0.0:
            self.bodies[i].velocity_func = self._slow_down

    def _slow_down(self, body: pymunk.Body, _gravity: object, _damping: float, dt: float) -> None:
        """Take mu_s g dt off the speed, at most all of it (Eq. 10).

        pymunk has moved the ball at its old velocity. In the report's listing it moves at the mean
        of the old and the new one, so half of what was lost is taken back.
        """
        velocity = body.velocity
        lost = velocity * (self.loss / max(velocity.length, self.loss))
        body.velocity, body.position = velocity - lost, body.position - lost * (dt / 2.0)

    # -- a step ----------------------------------------------------------------------------------

    def advance(self, most: float) -> None:
        """Make one step, and write down which balls have met, stopped or come to a pocket."""
        self.trace.steps += 1
        self.space.step(self.dt)
        if self.raised is not None:
            raise self.raised
        for i in sorted(self.moving):
            body = self.bodies[i]
            (x, y), (vx, vy) = body.position, body.velocity
            self.is_finite = self.is_finite and math.isfinite(x + y + vx + vy)
            if self.pocketed(i, x, y, vx, vy) is not None:
                self.space.remove(self.bodies.pop(i), *body.shapes)
                self.moving.discard(i)
            elif vx == vy == 0.0:
                body.velocity_func = pymunk.Body.update_velocity  # A ball at rest needs no other.
                self.trace.stop(i, self.time, (x, y))
                self.moving.discard(i)
            elif i in self.met:
                self.trace.breakpoint(i, self.time, (x, y), (vx, vy))
        self.met.clear()

    def cut_off(self) -> None:
        for i, body in ((i, self.bodies[i]) for i in self.moving):
            self.trace.breakpoint(i, self.time, body.position, body.velocity)
