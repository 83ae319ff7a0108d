"""This module applies the contact law and surface friction to shapes of any pymunk space.

Cushions are pymunk shapes, and balls are circles. Collision handlers replace the built-in response
by the contact law. Friction is a per-step damping callback, or a joint inside the C step.

pymunk moves the balls and finds what is near. The contact engine
(:mod:`pool_pymunk.engine.contacts`) is that of the exact solver, and keeps each ball's exact path.
With ``contacts="swept"`` it finds the time inside the step at which the paths meet, answers the
contact there, and lets the balls travel the rest of the step with their new velocities. For this, a
ball's sensor is larger than the ball by a margin, the way that the ball can travel in one step.
Whatever the ball touched during a step is then near at the step's end. With ``contacts="discrete"``
overlaps are answered at the end of the step, as a plain handler does. Such an answer comes up to a
step late, and it never comes where a ball only grazed or tunnelled.

A step of pymunk moves positions first and changes velocities last. Between steps a body therefore
carries the mean velocity of its path over the coming step, which makes positions exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import pymunk

from pool_pymunk.engine.contacts import ContactEngine, Motion, Recorder
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.laws import Law, find_law
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at, set_off
from pool_pymunk.physics.sides import Side, Wall, pocket
from pool_pymunk.world.broad_phase import BroadPhase, EndOfStep
from pool_pymunk.world.shapes import sides_of

Contacts = Literal["swept", "discrete"]
FrictionBy = Literal["joint", "callback"]

BALL, SENSOR, WALL = 0x42616C6C, 0x53656E73, 0x57616C6C  # These are our own collision types.
MOST_QUIET = 1000.0  # steps between two looks at the clock
HAIR = 1e-9  # radii; the sensor of a ball that moves is larger by this
# With discrete contacts, the sensor of a resting ball is smaller by this: then balls that rest in
# touch do not call in every step.


class ContactEvent(NamedTuple):
    """A contact event tells when a contact was answered, and whose it was.

    ``balls`` are two balls, or one ball that met the wall of number ``wall``.
    """

    t: float
    balls: tuple[int, ...]
    wall: int | None


class Ball:
    """A ball on the table has a number, a body, and a sensor that feels what is near."""

    __slots__ = ("_engine", "body", "joint", "number", "radius", "sensor")

    def __init__(
        self, number: int, radius: float, sensor: pymunk.Circle, engine: ContactEngine
    ) -> None:
        assert sensor.body is not None
        self.number = number
        self.radius = radius
        self.sensor = sensor
        self.body = sensor.body
        self.joint: pymunk.PivotJoint | None = None  # This is the friction while the ball moves.
        self._engine = engine

    @property
    def path(self) -> Path:
        """The ball's exact path."""
        return self._engine.paths[self.number]


class Billiards:
    """Billiards is the report's physics for balls and walls of a pymunk space.

    You step the space by ``dt`` (s). ``deceleration`` (m/s^2) is that of surface friction, mu_s g;
    0 leaves friction out. ``pair`` returns the masses and coefficients of a hit of two balls, given
    their numbers. ``law`` is the name of a contact law, or a law of your own
    (:class:`~pool_pymunk.physics.laws.Law`).

    Call ``space.step(dt)`` as ever. Everything else in the space keeps its built-in response, with
    each other and with the balls. If you, a spring or a flipper gives a ball a velocity, this is
    noticed. If nothing else touches balls, say ``alone=True``: then the circles themselves are the
    sensors, and :meth:`step` steps the space, which is faster.

    >>> space = pymunk.Space()
    >>> table = Billiards(space, dt=1 / 60, deceleration=0.5, pair=same_balls(0.9, 0.05, mass=0.2))
    >>> body = pymunk.Body(0.2, math.inf)
    >>> body.position = (0.0, 0.0)
    >>> ball = table.add_ball(pymunk.Circle(body, 0.03))
    >>> body.velocity = (1.0, 0.0)
    >>> for _ in range(180):
    ...     space.step(1 / 60)
    >>> [round(x, 12) for x in body.position], table.moving
    ([1.0, 0.0], {})
    """

    def __init__(
        self,
        space: pymunk.Space,
        dt: float,
        *,
        pair: Callable[[int, int], Pair],
        law: str | Law = "coulomb",
        deceleration: float = 0.0,
        contacts: Contacts = "swept",
        friction: FrictionBy = "joint",
        alone: bool = False,
    ) -> None:
        self.space = space
        self.dt = dt
        self.deceleration = deceleration
        self.friction = friction
        self.alone = alone
        self._is_swept = contacts == "swept"
        self.engine = ContactEngine(find_law(law), pair, deceleration, Callbacks(self))
        self.near = (BroadPhase if self._is_swept else EndOfStep)(space, self.engine)
        self.engine.near = self.near
        self.on_contact: Callable[[ContactEvent], None] | None = None
        self.on_stop: Callable[[Ball], None] | None = None
        self.on_stop_revoked: Callable[[Ball], None] | None = None
        self.on_pocket: Callable[[Ball, int], None] | None = None
        self.balls: list[Ball] = []
        self.moving: dict[int, Ball] = {}
        self.time = 0.0
        self.latest = math.inf  # the time (s) to stop at, in the middle of a step if need be
        self.steps = 0
        self._next_stop = math.inf
        # the time (s) when something is to be done; steps that end before it are bare
        self._wake = -math.inf
        self._ball_of: dict[pymunk.Body, Ball] = {}
        self._moved_by_others: list[int] = []
        self._error: Exception | None = None
        self._install()

    def _install(self) -> None:
        """Set the collision handlers and, in a shared space, the clock that calls every step.

        A swept contact is predicted as soon as two sensors touch, so one call is enough until they
        part. A discrete contact needs a call in every step.
        """
        when = "begin" if self._is_swept else "pre_solve"
        self.space.on_collision(SENSOR, SENSOR, **{when: self._feels})
        self.space.on_collision(SENSOR, WALL, **{when: self._feels})
        if not self.alone:
            self.space.on_collision(BALL, BALL, pre_solve=_no_response)
            self.space.on_collision(BALL, WALL, pre_solve=_no_response)
            clock = pymunk.Body(1.0, 1.0)
            clock.velocity_func = self._on_clock
            self.space.add(clock)

    # -- setting up ------------------------------------------------------------------------------

    def add_ball(self, circle: pymunk.Circle) -> Ball:
        """Make ``circle`` and its body a ball; both join the space if they are not in it.

        In a shared space the ball gets a second circle, its sensor, a little larger than the ball.
        If ``alone``, the circle itself is the sensor.
        """
        body = circle.body
        assert body is not None
        self._join(body, circle)
        sensor, radius = circle, circle.radius
        if not self.alone:
            circle.collision_type = BALL
            sensor = pymunk.Circle(body, radius)
            sensor.sensor = True
            sensor.color = (0, 0, 0, 0)
            self.space.add(sensor)
        sensor.collision_type = SENSOR
        path = set_off(self.time, body.position, body.velocity, self.deceleration)
        number = self.engine.add_ball(path, radius, body.mass)
        ball = Ball(number, radius, sensor, self.engine)
        self.near.sensors.append(sensor)
        self.near.numbers[sensor] = number
        self._ball_of[body] = ball
        self.balls.append(ball)
        if path.speed > 0.0:
            self.engine.predict([number])
            self._carry(ball)
        elif not self._is_swept:
            sensor.unsafe_set_radius(radius * (1.0 - HAIR))
        return ball

    def _join(self, *things: pymunk.Body | pymunk.Shape) -> None:
        self.space.add(*[thing for thing in things if thing.space is None])

    def remove_ball(self, ball: Ball) -> None:
        """Take a ball off the table, between two steps; its body can still be read."""
        self.engine.remove(ball.number)
        self._take_out(self.near.gone)

    def add_wall(
        self,
        shape: pymunk.Shape,
        restitution: float,
        friction: float = 0.0,
        sides: tuple[Side, ...] | None = None,
    ) -> int:
        """Make a static segment, circle or polygon a wall that balls bounce off (Eq. 9).

        ``sides`` are the sides of it that a ball can meet (default: all of them). Returns its
        number.
        """
        self._join(shape)
        shape.collision_type = WALL
        walls = self.engine.walls
        number = sum(not wall.is_pocket for wall in walls)
        self.near.numbers[shape] = -1 - len(walls)
        walls.append(Wall(sides or sides_of(shape), restitution, friction, number))
        return number

    def add_pocket(self, position: Vector, radius: float) -> int:
        """Make a pocket, which takes balls in whose centres come within ``radius`` (m).

        The bodies and shapes of these balls leave the space. Returns the pocket's number.
        """
        shape = pymunk.Circle(self.space.static_body, radius, position)
        shape.sensor = True
        shape.collision_type = WALL
        self.space.add(shape)
        walls = self.engine.walls
        number = sum(wall.is_pocket for wall in walls)
        self.near.numbers[shape] = -1 - len(walls)
        walls.append(pocket(position, radius, number))
        return number

    def strike(self, ball: Ball, velocity: Vector) -> None:
        """Give a ball a velocity (m/s) now, between two steps."""
        position, _ = ball.path.at(self.time)
        path = set_off(self.time, position, velocity, self.deceleration)
        self.engine.now = self.time
        self.engine.set_off(ball.number, path)
        self.engine.predict([ball.number])
        self._carry(ball)

    # -- stepping --------------------------------------------------------------------------------

    def step(self) -> None:
        """Make one step of a space that holds nothing else, contacts and stops included.

        An error from a callback is raised here, because pymunk itself only prints it.
        """
        self.space.step(self.dt)
        self._after_step()

    def play(self, on_time: Callable[[float], object] | None = None) -> None:
        """Step until everything rests, until ``latest``, or until nothing more may happen.

        ``on_time`` is called now and then with the time (s).
        """
        while self.moving and self.time < self.latest:
            self._make_steps(self._steps_until_due())
            self._after_step()
            if on_time is not None:
                on_time(self.time)
            if self.engine.is_over or not self.engine.is_finite:
                self.time = self.engine.now
                self._stop_balls()
                return

    def _make_steps(self, count: int) -> None:
        """Step the space until two sensors touch, but at most ``count`` times.

        The last step is not counted yet: the caller finishes it.
        """
        step, dt, pairs = self.space.step, self.dt, self.near.pairs
        quiet = 0
        step(dt)
        while quiet < count - 1 and not pairs and self._error is None:
            step(dt)
            quiet += 1
        self.steps += quiet
        self.time = self.steps * dt

    def _steps_until_due(self) -> int:
        """Return in how many steps something is due, if no two sensors touch until then."""
        if self.friction == "callback" or self._wake == -math.inf:
            return 1
        steps = (self._wake - self.time) / self.dt * (1.0 - HAIR)  # rather a step too early
        return int(max(0.0, min(steps, MOST_QUIET))) + 1

    def _after_step(self, *_: object) -> None:
        """Answer what happened in the step that pymunk has just made; mostly it is nothing."""
        since = self.time
        self.steps += 1
        self.time = min(self.steps * self.dt, self.latest)
        if self._error is not None:
            error, self._error = self._error, None
            raise error
        if self.near.pairs or self._moved_by_others or self.engine.upcoming() <= self.time:
            self._answer_contacts(since)
        ahead = 0.0 if self.alone else self.dt  # in a shared space others see how a ball stops
        if self.time + ahead >= self._next_stop:
            self._stop_balls()
        self._wake = min(self.engine.upcoming(), self.latest, self._next_stop)

    def _answer_contacts(self, since: float) -> None:
        """Answer the contacts of the step that began at ``since`` (s), in their order."""
        engine, near = self.engine, self.near
        engine.now, near.until = since, self.time
        near.foresee()
        moved, self._moved_by_others = self._moved_by_others, []
        engine.predict(moved)
        engine.advance(self.time)
        for i in near.changed:
            self._carry(self.balls[i])
        near.changed.clear()
        self._take_out(near.gone)

    def _take_out(self, gone: list[int]) -> None:
        """Take the bodies and shapes of balls that have left the table out of the space."""
        for i in gone:
            ball = self.balls[i]
            if ball.number in self.moving:
                self._rest(ball)
            ball.body.position = ball.path.x, ball.path.y
            del self._ball_of[ball.body]
            self.space.remove(ball.body, *ball.body.shapes)
        gone.clear()

    def _on_clock(
        self, _clock: pymunk.Body, _gravity: Vector, _damping: float, dt: float
    ) -> None:  # fmt: skip
        """Notice moved balls in each step, when positions are new and velocities are not yet."""
        try:
            self.space.add_post_step_callback(self._after_step, self)
            if abs(dt - self.dt) > 1e-9 * self.dt:
                raise ValueError(
                    f"the space was stepped by {dt} s, but its Billiards was made for {self.dt} s"
                )
            for ball in self._ball_of.values():
                self._notice(ball)
        except Exception as error:
            self._note(error)

    def _notice(self, ball: Ball) -> None:
        """Follow a ball that somebody else moved: its path begins anew at the step's start."""
        (x, y), (vx, vy) = ball.body.position, ball.body.velocity
        expected, (ex, ey) = ball.path.at(self.time + self.dt)[0], (0.0, 0.0)
        if ball.number in self.moving:
            ex, ey = self._mean_velocity(ball.path, self.time)
        scale = abs(vx) + abs(vy) + abs(ex) + abs(ey)
        slack = 1e-9 * (ball.radius + abs(x) + abs(y)) + self.deceleration * self.dt**2
        if abs(vx - ex) + abs(vy - ey) <= 1e-9 * scale and math.dist((x, y), expected) <= slack:
            return
        begin = (x - vx * self.dt, y - vy * self.dt)
        path = set_off(self.time, begin, (vx, vy), self.deceleration)
        self.engine.set_off(ball.number, path)
        self._moved_by_others.append(ball.number)

    def _feels(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """Handle a collision: note that these two shapes may have met during this step."""
        try:
            arbiter.process_collision = False
            self.near.touched(*arbiter.shapes)
        except Exception as error:
            self._note(error)

    def _note(self, error: Exception) -> None:
        """Keep an error until the step's end, because pymunk only prints what a callback raises."""
        self._error = self._error or error
        self._wake = -math.inf

    def _damp(
        self, body: pymunk.Body, _gravity: Vector, _damping: float, _dt: float
    ) -> None:  # fmt: skip
        """Damp a body: it carries its path's mean velocity over the coming step."""
        try:
            now = (self.steps + 1) * self.dt
            body.velocity = self._mean_velocity(self._ball_of[body].path, now)
        except Exception as error:
            self._note(error)

    def _mean_velocity(self, path: Path, t: float) -> Vector:
        """Return the velocity (m/s) that takes a body along its path from ``t`` to ``t + dt``."""
        x0, y0, _, _ = motion_at(path, t)
        x1, y1, _, _ = motion_at(path, t + self.dt)
        return ((x1 - x0) / self.dt, (y1 - y0) / self.dt)

    # -- bodies on their paths -------------------------------------------------------------------

    def _carry(self, ball: Ball) -> None:
        """Put a ball's body on its path at the end of this step, or to rest."""
        path = ball.path
        x, y, vx, vy = motion_at(path, self.time)
        ball.body.position = x, y
        if path.stop <= self.time:
            self._rest(ball)
            return
        ball.body.velocity = self._mean_velocity(path, self.time)
        margin = math.sqrt(vx * vx + vy * vy) * self.dt if self._is_swept else 0.0
        rounding = HAIR * ball.radius + 16.0 * EPSILON * (abs(x) + abs(y))
        ball.sensor.unsafe_set_radius(ball.radius + margin + rounding)
        if ball.number not in self.moving:
            self.moving[ball.number] = ball
            self._slow_down(ball)
        self._next_stop = min(self._next_stop, path.stop)

    def _slow_down(self, ball: Ball) -> None:
        """Install surface friction on a ball that begins to move."""
        if self.deceleration == 0.0:
            return
        if self.friction == "joint":
            ball.joint = ball.joint or _friction_joint(self.space, ball.body, self.deceleration)
            self.space.add(ball.joint)
        else:
            ball.body.velocity_func = self._damp

    def _rest(self, ball: Ball) -> None:
        """Put a ball to rest; from now on it costs nothing."""
        ball.body.velocity = (0.0, 0.0)
        ball.sensor.unsafe_set_radius(ball.radius * (1.0 if self._is_swept else 1.0 - HAIR))
        if self.moving.pop(ball.number, None) is None:
            return
        if ball.joint is not None:
            self.space.remove(ball.joint)
        elif self.deceleration > 0.0:
            ball.body.velocity_func = pymunk.Body.update_velocity

    def _stop_balls(self) -> None:
        """Put balls to rest whose paths have ended, and steer those that stop in the next step."""
        for ball in list(self.moving.values()):
            if ball.path.stop <= self.time:
                self._carry(ball)
            elif ball.path.stop <= self.time + self.dt:
                ball.body.velocity = self._mean_velocity(ball.path, self.time)
        self._next_stop = min((ball.path.stop for ball in self.moving.values()), default=math.inf)


class Callbacks(Recorder):
    """This recorder passes on what the engine does to the callbacks of a :class:`Billiards`."""

    def __init__(self, table: Billiards) -> None:
        self.table = table

    def contact(self, contact: Contact, t: float) -> None:
        """Call ``on_contact``."""
        if self.table.on_contact is not None:
            self.table.on_contact(ContactEvent(t, contact.balls, contact.cushion))

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Call ``on_stop``."""
        if self.table.on_stop is not None:
            self.table.on_stop(self.table.balls[i])

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Call ``on_pocket`` with the ball, and with the number of the pocket."""
        if self.table.on_pocket is not None:
            self.table.on_pocket(self.table.balls[i], pocket)

    def stop_revoked(self, i: int, t: float) -> None:
        """Call ``on_stop_revoked``, because the ball had not come to rest."""
        if self.table.on_stop_revoked is not None:
            self.table.on_stop_revoked(self.table.balls[i])


def same_balls(restitution: float, friction: float, mass: float) -> Callable[[int, int], Pair]:
    """Return the ``pair`` of a table whose balls are all alike.

    >>> same_balls(0.9, 0.05, mass=0.2)(0, 1)
    Pair(m_a=0.2, m_b=0.2, restitution=0.9, friction=0.05)
    """
    return lambda _i, _j: Pair(mass, mass, restitution, friction)


def _friction_joint(
    space: pymunk.Space, body: pymunk.Body, deceleration: float
) -> pymunk.PivotJoint:
    """Return a joint that is Coulomb friction inside the C step.

    It pulls back with the force m a, and holds the body at no place.
    """
    joint = pymunk.PivotJoint(space.static_body, body, (0.0, 0.0), (0.0, 0.0))
    joint.max_bias = 0.0
    joint.max_force = body.mass * deceleration
    return joint


def _no_response(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
    arbiter.process_collision = False
