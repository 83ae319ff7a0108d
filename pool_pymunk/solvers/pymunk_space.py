"""The scene in a pymunk space: cushions are static segments, balls are circles.

Collision handlers replace the built-in response by the contact law, and a per-step damping
callback applies surface friction to the balls that move. A part that the scene leaves out is not
installed: no table, no segments and no cushion handler; no surface friction, no callback; one
ball, no ball-ball handler.

Inside a step pymunk moves positions, then finds contacts, then asks the damping callbacks for
velocities. Between steps a body therefore carries the velocity of the middle of the coming step,
v(t + dt/2) = v(t) - a dt/2: with it the positions at the steps are exact (Eq. 10). Contacts are
found at the end of the step in which they happen, up to dt late.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

import pymunk

from pool_pymunk.contact import LAWS, NT, Pair, cushion, published, slips_by_rounding
from pool_pymunk.result import Trace
from pool_pymunk.scene import Point, Scene, State
from pool_pymunk.solvers.settings import NEVER_SETTLES, Settings

BALL, CUSHION = 1, 2
SLIP_WARNING = (
    "law published jumps at zero slip: in a head-on hit of balls {} and {} at {:.6g} s the slip was "
    "below 1e-9 of the closing speed and was taken for zero (no friction); rounding would decide"
)
P = ParamSpec("P")


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate with steps of ``settings.dt`` s; the error is of first order in dt."""
    assert settings.dt is not None
    world = World(scene, start, settings.dt)
    trace, dt = world.trace, settings.dt
    last = math.inf if settings.max_time is None else math.ceil(settings.max_time / dt)
    most = NEVER_SETTLES if settings.max_events is None else settings.max_events
    while world.moving:
        if trace.steps >= last or len(trace.events) >= most:
            trace.status = "max_time" if trace.steps >= last else "max_events"
            break
        world.step()
        if not world.is_finite():
            trace.status = "non_finite"
            break
    if trace.status != "settled":
        trace.duration = world.time
        world.note_moving()
    return trace


class World:
    """A pymunk space set up from a scene, and what its callbacks need."""

    def __init__(self, scene: Scene, start: State, dt: float) -> None:
        self.scene = scene
        self.dt = dt
        self.kick = scene.deceleration * dt / 2  # half of what friction takes in a step (m/s)
        self.law = LAWS[scene.physics.law]
        self.trace = Trace(start)
        self.time = 0.0
        self.moving: dict[int, pymunk.Body] = {}
        self.rest_time: dict[int, float] = {}  # when a ball stops that stops in the coming step
        self.error: Exception | None = None
        self.space = pymunk.Space()
        self.space.static_body.position = (0.0, 0.0)
        self.bodies = [self._add_ball(i, p) for i, p in enumerate(start.position)]
        self.number = {body: i for i, body in enumerate(self.bodies)}
        self._add_cushions()
        self._add_handlers()
        for i, velocity in enumerate(start.velocity):
            self._send_off(i, velocity, before_damping=False)

    # -- the space -------------------------------------------------------------------------------

    def _add_ball(self, i: int, position: Point) -> pymunk.Body:
        ball = self.scene.balls[i]
        body = pymunk.Body(ball.mass, math.inf)
        body.position = position
        circle = pymunk.Circle(body, ball.radius)
        circle.collision_type = BALL
        self.space.add(body, circle)
        return body

    def _add_cushions(self) -> None:
        self.cushions: dict[pymunk.Shape, int] = {}
        for number, edge in enumerate(self.scene.table.edges if self.scene.table else ()):
            segment = pymunk.Segment(self.space.static_body, edge.start, edge.end, 0.0)
            segment.collision_type = CUSHION
            self.cushions[segment] = number
            self.space.add(segment)

    def _add_handlers(self) -> None:
        if len(self.bodies) > 1:
            self.space.on_collision(BALL, BALL, pre_solve=self._guarded(self._balls_meet))
        if self.cushions:
            self.space.on_collision(BALL, CUSHION, pre_solve=self._guarded(self._cushion_meets))

    def _guarded(self, callback: Callable[P, None]) -> Callable[P, None]:
        """pymunk swallows exceptions in callbacks: keep the first, raise it after the step."""

        @wraps(callback)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> None:
            try:
                callback(*args, **kwargs)
            except Exception as error:
                self.error = self.error or error

        return guarded

    def step(self) -> None:
        """One step of the space; what a callback raised comes out here."""
        self.trace.steps += 1
        self.time = self.trace.steps * self.dt
        self.space.step(self.dt)
        if self.error is not None:
            raise self.error

    # -- surface friction ------------------------------------------------------------------------

    def _send_off(self, i: int, velocity: Point, before_damping: bool) -> None:
        """Give ball ``i`` a velocity at this moment; it moves, or it rests from now on.

        Inside a step the damping callback is still to come: it takes a whole step's loss, and
        half of it belongs to the step before.
        """
        body = self.bodies[i]
        speed = math.hypot(*velocity)
        if speed == 0.0:
            self._rest(i)
            return
        self.moving[i] = body
        if self.kick == 0.0:
            body.velocity = velocity
        elif before_damping:
            body.velocity = _scaled(velocity, 1.0 + self.kick / speed)
            body.velocity_func = self._damping
        else:
            body.velocity = self._mid_step(i, velocity, speed)
            body.velocity_func = self._damping

    def _mid_step(self, i: int, velocity: Point, speed: float) -> Point:
        """The velocity that carries a ball over the coming step as friction would (Eq. 10)."""
        if speed > 2.0 * self.kick:
            return _scaled(velocity, 1.0 - self.kick / speed)
        self.rest_time[i] = self.time + speed / self.scene.deceleration
        return _scaled(velocity, speed / (4.0 * self.kick))  # it stops inside the step

    def _damping(
        self, body: pymunk.Body, _gravity: tuple[float, float], _damping: float, _dt: float
    ) -> None:
        """The per-step damping callback: friction slows a ball and stops it exactly."""
        try:
            velocity = body.velocity
            speed = velocity.length - self.kick  # at this moment, the middle of two half kicks
            i = self.number[body]
            if speed <= 0.0:
                self._stop(i, self.rest_time.get(i, self.time))
            else:
                now = _scaled(velocity, speed / (speed + self.kick))
                body.velocity = self._mid_step(i, now, speed)
        except Exception as error:
            self.error = self.error or error

    def _rest(self, i: int) -> None:
        body = self.bodies[i]
        body.velocity = (0.0, 0.0)
        body.velocity_func = pymunk.Body.update_velocity  # a ball at rest costs no callback
        self.moving.pop(i, None)

    def _stop(self, i: int, t: float) -> None:
        self._rest(i)
        self.trace.stop(i, t, self._position(i))

    def _position(self, i: int) -> Point:
        x, y = self.bodies[i].position
        return (x, y)

    def _velocity(self, i: int) -> Point:
        """The velocity of ball ``i`` at this moment, inside a step."""
        if i not in self.moving:
            return (0.0, 0.0)
        velocity = self.bodies[i].velocity
        speed = velocity.length
        return _scaled(velocity, max(1.0 - self.kick / speed, 0.0) if speed > 0.0 else 0.0)

    # -- contacts --------------------------------------------------------------------------------

    def _balls_meet(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        arbiter.process_collision = False
        a, b = arbiter.bodies
        i, j = sorted((self.number[a], self.number[b]))  # A is the ball that comes first
        (ax, ay), (bx, by) = self._position(i), self._position(j)
        distance = math.hypot(bx - ax, by - ay)
        if distance == 0.0:
            return
        normal = ((bx - ax) / distance, (by - ay) / distance)
        v_a, v_b = split(self._velocity(i), normal), split(self._velocity(j), normal)
        if v_a.n > v_b.n:
            after = self.law(v_a, v_b, self._pair(i, j, v_a, v_b))
            self.trace.ball_ball(self.time, i, j)
            for ball, v in zip((i, j), after, strict=True):
                self._answer(ball, join(v, normal))

    def _pair(self, i: int, j: int, v_a: NT, v_b: NT) -> Pair:
        pair = self.scene.pair(i, j)
        if self.law is published and pair.friction > 0.0 and slips_by_rounding(v_a, v_b):
            ids = self.scene.balls[i].id, self.scene.balls[j].id
            self.trace.warn(SLIP_WARNING.format(*ids, self.time))
            return pair._replace(friction=0.0)
        return pair

    def _cushion_meets(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        arbiter.process_collision = False
        ball, segment = arbiter.shapes
        assert ball.body is not None
        i = self.number[ball.body]
        nx, ny = arbiter.normal  # from the ball to the cushion
        v = split(self._velocity(i), (-nx, -ny))
        if v.n < 0.0:
            e = self.scene.restitution.cushion
            assert e is not None
            after = cushion(v, e, self.scene.friction.cushion)
            self.trace.ball_cushion(self.time, i, self.cushions[segment])
            self._answer(i, join(after, (-nx, -ny)))

    def _answer(self, i: int, velocity: Point) -> None:
        self._send_off(i, velocity, before_damping=True)
        if velocity == (0.0, 0.0):
            self._stop(i, self.time)
        else:
            self.trace.knot(i, self.time, self._position(i), velocity)

    # -- the end ---------------------------------------------------------------------------------

    def is_finite(self) -> bool:
        return all(math.isfinite(sum(b.position) + sum(b.velocity)) for b in self.moving.values())

    def note_moving(self) -> None:
        """Write down where the balls are that still move; the step's damping is behind them."""
        for i, body in self.moving.items():
            speed = body.velocity.length
            v = _scaled(body.velocity, 1.0 + self.kick / speed if speed > 0.0 else 1.0)
            self.trace.knot(i, self.time, self._position(i), v)


def split(v: Point, normal: Point) -> NT:
    """A velocity along the normal and the tangent (-n_y, n_x)."""
    nx, ny = normal
    return NT(v[0] * nx + v[1] * ny, v[1] * nx - v[0] * ny)


def join(v: NT, normal: Point) -> Point:
    """The velocity that :func:`split` took apart."""
    nx, ny = normal
    return (v.n * nx - v.t * ny, v.n * ny + v.t * nx)


def _scaled(v: Point, factor: float) -> Point:
    return (v[0] * factor, v[1] * factor)
