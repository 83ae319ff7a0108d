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

import itertools
import math
import weakref
from collections.abc import Callable
from typing import Any, Literal, get_args

import pymunk

from pool_pymunk.engine.contacts import ContactEngine, Motion, Recorder
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.physics.contact import Contact, Pair, Vector
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import EPSILON, slid
from pool_pymunk.physics.path import Path, motion_at, set_off
from pool_pymunk.physics.sides import Nothing, Side, Wall, pocket
from pool_pymunk.world.ball import Ball, ContactEvent, TableState
from pool_pymunk.world.bodies import Bodies, Moves
from pool_pymunk.world.broad_phase import EVERYTHING, BroadPhase, EndOfStep
from pool_pymunk.world.checks import (
    LONGEST,
    check_choice,
    check_circle,
    check_place,
    check_space,
    check_unchanged,
    check_wall,
    read_from_zero,
    read_law,
    read_share,
    read_size,
    read_vector,
    step_error,
)
from pool_pymunk.world.outlook import Outlook, Prediction, free_spot
from pool_pymunk.world.pairs import check_pair
from pool_pymunk.world.shapes import sides_of

Contacts = Literal["swept", "discrete"]
FrictionBy = Literal["joint", "callback"]

BALL, SENSOR, WALL = 0x42616C6C, 0x53656E73, 0x57616C6C  # These are our own collision types.
MOST_QUIET = 1000.0  # steps between two looks at the clock
HAIR = 1e-9  # radii; the sensor of a ball that moves is larger by this
# With discrete contacts, the sensor of a resting ball is smaller by this: then balls that rest in
# touch do not call in every step.


_tables: weakref.WeakKeyDictionary[pymunk.Space, weakref.ref[Billiards]]
_tables = weakref.WeakKeyDictionary()


class Billiards:
    """Billiards is the report's physics for balls and walls of a pymunk space.

    You step the space as ever, by ``space.step(dt)``, with any steps up to ``max_dt`` (s).
    ``deceleration`` (m/s^2) is that of surface friction, mu_s g; 0 leaves friction out. ``pair``
    returns the coefficients of a hit of two balls, given their numbers (:func:`same_balls`); masses
    are those of the bodies. ``law`` is the name of a contact law, or a law of your own
    (:class:`~pool_pymunk.physics.laws.Law`).

    Everything else in the space keeps its built-in response, with each other and with the balls. If
    you, a spring or a flipper gives a ball a velocity, this is noticed. Gravity, damping and forces
    act once at the end of each step. If nothing else touches balls, say ``alone=True``: then the
    circles themselves are the sensors, and :meth:`step` steps the space, which is faster.

    Set ``on_contact(contact)``, ``on_stop(ball, t)`` and ``on_pocket(ball, pocket, t)`` to be told
    what happens; from within them you may add, remove, place and strike balls.

    Raises ValueError, in one sentence that names the argument, for what cannot be.

    >>> from pool_pymunk import same_balls
    >>> space = pymunk.Space()
    >>> table = Billiards(space, 1 / 60, deceleration=0.5, pair=same_balls(0.9, 0.05))
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
        max_dt: float,
        *,
        pair: Callable[[int, int], Pair],
        law: str | Law = "coulomb",
        deceleration: float = 0.0,
        contacts: Contacts = "swept",
        friction: FrictionBy = "joint",
        alone: bool = False,
    ) -> None:
        check_space(space)
        check_choice("contacts", contacts, get_args(Contacts))
        check_choice("friction", friction, get_args(FrictionBy))
        if not callable(pair):
            raise setting_error("pair", shown(pair), "must be a function of two balls' numbers")
        taken = _tables.get(space)
        if taken is not None and taken() is not None:
            raise setting_error("space", "taken", "this space has a Billiards already")
        self.space = space
        self.max_dt = self.dt = read_size("max_dt", max_dt)
        self.deceleration = read_from_zero("deceleration", deceleration)
        self.friction = friction
        self.alone = alone
        self._said_pair = pair
        self._is_swept = contacts == "swept"
        listens = Callbacks(self)
        self.engine = ContactEngine(read_law(law), self._pair, self.deceleration, listens)
        self.near = (BroadPhase if self._is_swept else EndOfStep)(space, self.engine)
        self.engine.near = self.near
        self.on_contact: Callable[[ContactEvent], object] | None = None
        self.on_stop: Callable[[Ball, float], object] | None = None
        self.on_stop_revoked: Callable[[Ball, float], object] | None = None
        self.on_pocket: Callable[[Ball, int, float], object] | None = None
        self.balls: list[Ball] = []
        self.moving: dict[int, Ball] = {}
        self.time = 0.0
        self.latest = math.inf  # the time (s) to stop at, in the middle of a step if need be
        self.steps = 0
        # The time is that at which the present length of steps began, and the steps since then.
        self._since, self._count = 0.0, 0
        self._next_stop = math.inf
        # the time (s) when something is to be done; steps that end before it are bare
        self._wake = -math.inf
        self._ball_of: dict[pymunk.Body, Ball] = {}
        self._moved_by_others: list[int] = []
        self._error: Exception | None = None
        self._this_step = self.dt  # s; that of the step which pymunk makes now
        self._moves: dict[int, Moves] = {}  # how all bodies moved as this step began, by their ids
        self._kicks: dict[Ball, Vector] = {}  # m/s^2, at the end of this step
        # what springs, joints and collisions with others have added to velocities in this step; m/s
        self._pushes: dict[Ball, Vector] = {}
        self._damped_to: dict[pymunk.Body, Vector] = {}  # m/s, by damping callbacks in this step
        self._damped = 1.0  # the share of a velocity that the space's damping leaves in this step
        self._lost: list[Ball] = []  # These balls were taken out of the space by others.
        self._is_refused = False
        self._is_other = False  # The step is of another length than the one before.
        self._has_new_joints = False  # No joint keeps an impulse from the step before,
        self._knows_pull = True  # so it is known how each of them pulls in this step.
        self._inside = False  # It plays the instants of a step.
        self._plays = False  # It is in the middle of an instant, and changes have to wait.
        self._later: list[Callable[[], object]] = []
        self._install()
        _tables[space] = weakref.ref(self)

    def __reduce__(self) -> str | tuple[Any, ...]:
        raise TypeError(
            "a Billiards and its space cannot be copied or pickled: use save_state and "
            "restore_state"
        )

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
            clock = pymunk.Body(body_type=pymunk.Body.KINEMATIC)  # It never falls asleep.
            clock.position_func = self._on_step
            self.space.add(clock)
            self._bodies = Bodies(self.space, clock)

    def _pair(self, i: int, j: int) -> Pair:
        """Return the pair that the user gives, with the masses of the bodies."""
        masses = self.engine.masses
        return check_pair(self._said_pair(i, j), (masses[i], masses[j]), (i, j))

    # -- setting up ------------------------------------------------------------------------------

    def add_ball(self, circle: pymunk.Circle) -> Ball:
        """Make ``circle`` and its body a ball; both join the space if they are not in it.

        In a shared space the ball gets a second circle, its sensor, a little larger than the ball.
        If ``alone``, the circle itself is the sensor. The circle's filter holds for both. Raises
        ValueError for what cannot be a ball: a shape that is no circle in the middle of a dynamic
        body, one that is a ball already, one that overlaps a ball or a wall or lies within a
        pocket.
        """
        check_circle(circle)
        body = circle.body
        assert body is not None
        if body in self._ball_of:
            raise setting_error("circle", "taken", "this body is a ball already")
        place = read_vector("position", body.position)
        check_place(place, circle.radius, self._discs(), self.engine.walls)
        number = len(self.balls)
        for other in itertools.islice(self._ball_of.values(), 1):
            masses = (other.body.mass, body.mass)
            check_pair(self._said_pair(other.number, number), masses, (other.number, number))
        self.near.filters = self.near.filters or circle.filter != EVERYTHING
        return self.put_ball(circle)

    def put_ball(self, circle: pymunk.Circle) -> Ball:
        """Do what :meth:`add_ball` does, for a circle of which nothing is wrong, unchecked."""
        body = circle.body
        assert body is not None
        radius = circle.radius
        self._join(body, circle)
        sensor = circle
        if not self.alone:
            sensor = pymunk.Circle(body, radius)
            sensor.sensor = True
            sensor.color = (0, 0, 0, 0)
        (x, y), (vx, vy) = body.position, body.velocity
        path = set_off(self._now, (x, y), (vx, vy), self.deceleration)
        number = self.engine.add_ball(path, radius, body.mass)
        ball = Ball(number, circle, sensor, self.engine)
        self.balls.append(ball)
        self.near.sensors.append(sensor)
        self._enter(ball)
        if path.speed > 0.0:
            self.engine.predict([number])
            self._carry(ball)
        elif not self._is_swept:
            sensor.unsafe_set_radius(radius * (1.0 - HAIR))
        return ball

    def _enter(self, ball: Ball) -> None:
        """Put a ball's sensor into the space, and mark its circle as a ball's."""
        if not self.alone:
            ball.circle.collision_type = BALL
            ball.sensor.filter = ball.circle.filter
            self._join(ball.sensor)
        ball.sensor.collision_type = SENSOR
        self.near.numbers[ball.sensor] = ball.number
        self._ball_of[ball.body] = ball
        ball.is_on_table = True

    def _discs(self, without: Ball | None = None) -> list[tuple[Vector, float]]:
        """Return places and radii (m) of the balls on the table, perhaps ``without`` one."""
        now, balls = self._now, self._ball_of.values()
        return [(ball.path.at(now)[0], ball.radius) for ball in balls if ball is not without]

    def _join(self, *things: pymunk.Body | pymunk.Shape) -> None:
        self.space.add(*[thing for thing in things if thing.space is None])

    def remove_ball(self, ball: Ball) -> None:
        """Take a ball off the table; its body can still be read.

        Its body and shapes leave the space. You may do this from within a callback.
        """
        self._check_ball(ball)
        self._do(lambda: self._remove(ball))

    def _remove(self, ball: Ball) -> None:
        if ball.is_on_table:
            self.engine.now = self._now
            self.engine.remove(ball.number)
            self._take_out(self.near.gone)

    def clear(self) -> None:
        """Take all balls off the table."""
        for ball in list(self._ball_of.values()):
            self.remove_ball(ball)

    def _check_ball(self, ball: Ball) -> None:
        if not isinstance(ball, Ball) or ball not in self.balls:
            raise setting_error("ball", shown(ball), "must be what add_ball of this table returned")
        if not ball.is_on_table:
            raise setting_error("ball", ball.number, "the ball is off the table")

    def _do(self, change: Callable[[], object]) -> None:
        """Make a change now, or if an instant is being played as soon as that is over."""
        if self._plays:
            self._later.append(change)
        else:
            change()

    def add_wall(
        self,
        shape: pymunk.Shape,
        restitution: float,
        friction: float = 0.0,
        sides: tuple[Side, ...] | None = None,
    ) -> int:
        """Make a static segment, circle or polygon a wall that balls bounce off (Eq. 9).

        ``sides`` are the sides of it that a ball can meet (default: all of them). Returns its
        number. Raises ValueError for what cannot be a wall.
        """
        check_wall(shape)
        if shape in self.near.numbers:
            raise setting_error("shape", "taken", "this shape is a wall already")
        restitution = read_share("restitution", restitution)
        friction = read_from_zero("friction", friction)
        self._join(shape)
        shape.collision_type = WALL
        self.near.filters = self.near.filters or shape.filter != EVERYTHING
        walls = self.engine.walls
        number = sum(not wall.is_pocket for wall in walls)
        self.near.numbers[shape] = -1 - len(walls)
        walls.append(Wall(sides or sides_of(shape), restitution, friction, number))
        return number

    def remove_wall(self, wall: int) -> None:
        """Take the wall of this number out of the space; the other walls keep their numbers."""
        walls = self.engine.walls
        own = (k for k, each in enumerate(walls) if not each.is_pocket and each.number == wall)
        place = next(own, None)
        if place is None:
            raise setting_error("wall", shown(wall), "there is no wall of this number")
        shapes = self.near.numbers.items()
        shape = next(shape for shape, number in shapes if number == -1 - place)
        del self.near.numbers[shape]
        self.space.remove(shape)
        walls[place] = Wall((Nothing(),), 0.0, 0.0, -1)
        self._predict_anew()

    def add_pocket(self, position: Vector, radius: float) -> int:
        """Make a pocket, which takes balls in whose centres come within ``radius`` (m).

        The bodies and shapes of these balls leave the space. Returns the pocket's number. Raises
        ValueError if a ball lies within it now.
        """
        position, radius = read_vector("position", position), read_size("radius", radius)
        if any(math.dist(position, place) < radius for place, _ in self._discs()):
            raise setting_error("position", list(position), "a ball lies within this pocket")
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
        """Give a ball a velocity (m/s) now."""
        self._check_ball(ball)
        velocity = read_vector("velocity", velocity)
        check_unchanged(ball, self.engine.masses[ball.number])
        self._do(lambda: self._send(ball, None, velocity))

    def place(self, ball: Ball, position: Vector) -> None:
        """Put a ball to rest at another place (m), such as one of :meth:`free_spot`.

        Raises ValueError if it overlaps a ball or a wall there, or lies within a pocket.
        """
        self._check_ball(ball)
        position = read_vector("position", position)
        check_place(position, ball.radius, self._discs(without=ball), self.engine.walls)
        self._do(lambda: self._send(ball, position, (0.0, 0.0)))

    def _send(self, ball: Ball, position: Vector | None, velocity: Vector) -> None:
        """Set a ball off from where it is, or from a position (m)."""
        if not ball.is_on_table:
            return
        now = self._now
        self._pushes[ball] = (0.0, 0.0)  # This word is the last one in this step.
        place = ball.path.at(now)[0] if position is None else position
        path = set_off(now, place, velocity, self.deceleration)
        self.engine.now = now
        self.engine.set_off(ball.number, path)
        if path.speed == 0.0:
            self.engine.rested[ball.number] = now
        self._carry(ball)
        if position is not None:
            self.space.reindex_shapes_for_body(ball.body)
        self.engine.predict([ball.number])
        self._carry(ball)

    @property
    def _now(self) -> float:
        """Return the time (s), which within a step is that of the present instant."""
        return self.engine.now if self._inside else self.time

    # -- undo, and looking ahead -----------------------------------------------------------------

    def save_state(self) -> TableState:
        """Return where the balls are and how they move, for :meth:`restore_state`."""
        motions = {ball: motion_at(ball.path, self.time) for ball in self._ball_of.values()}
        return TableState(self.time, motions, dict(self.engine.resolver.history))

    def restore_state(self, state: TableState) -> None:
        """Put the balls back to where they were, and the clock.

        Balls that have left the table since come back, those that have come since leave it. The
        velocities are the exact ones, so the table goes on as it did. Do this between two steps.
        """
        for ball in list(self._ball_of.values()):
            if ball not in state.motions:
                self._remove(ball)
        self.time = self._since = state.time
        self._count = 0
        self.engine.turn_back(self.time)
        self._moved_by_others.clear()
        for ball, (x, y, vx, vy) in state.motions.items():
            if not ball.is_on_table:
                self._join(ball.body, *ball.shapes)
                self._enter(ball)
            path = set_off(self.time, (x, y), (vx, vy), self.deceleration)
            self.engine.set_off(ball.number, path)
            self.engine.rested[ball.number] = math.inf if path.speed > 0.0 else -math.inf
        self.engine.resolver.history.clear()
        self.engine.resolver.history.update(state.history)
        self._predict_anew()

    def predict(self, ball: Ball, velocity: Vector) -> Prediction[Ball]:
        """Return where a ball and what it meets would go, if it were struck now: the aiming line.

        All balls move on, as they would; nothing else in the space is looked at.
        """
        self._check_ball(ball)
        velocity = read_vector("velocity", velocity)
        found = self._outlook().sketch(ball.number, velocity, self._now)
        met = None if found.met is None else self.balls[found.met]
        return Prediction(met, *found[1:])

    def free_spot(self, near: Vector, radius: float | None = None) -> Vector:
        """Return the place (m) nearest to ``near`` where a ball overlaps nothing: ball in hand.

        ``radius`` (m) is by default that of the first ball. Raises ValueError if there is no room.
        """
        near = read_vector("near", near)
        if radius is None and not self.balls:
            raise setting_error("radius", None, "is wanted where there is no ball")
        size = self.balls[0].radius if radius is None else read_size("radius", radius)
        found = free_spot(near, size, self._discs(), self.engine.walls)
        if found is None:
            raise setting_error("near", list(near), "there is no room for a ball near this place")
        return found

    def _outlook(self) -> Outlook:
        engine = self.engine
        numbers = [ball.number for ball in self._ball_of.values()]
        return Outlook(
            paths={i: engine.paths[i] for i in numbers},
            radii={i: engine.radii[i] for i in numbers},
            masses={i: engine.masses[i] for i in numbers},
            walls=engine.walls,
            law=engine.resolver.law,
            pair=self._pair,
            deceleration=self.deceleration,
        )

    def _predict_anew(self) -> None:
        """Put all balls on their paths, and predict again what they meet."""
        self.near.until = self.engine.now = self.time
        for ball in self._ball_of.values():
            path = ball.path
            if path.speed > 0.0:
                x, y, vx, vy = motion_at(path, self.time)
                path = set_off(self.time, (x, y), (vx, vy), self.deceleration)
                self.engine.set_off(ball.number, path)
            self._carry(ball)
            self.space.reindex_shapes_for_body(ball.body)
        self.engine.predict([ball.number for ball in self._ball_of.values()])

    # -- stepping --------------------------------------------------------------------------------

    def step(self, dt: float | None = None) -> None:
        """Make one step (s) of a space that holds nothing else, contacts and stops included.

        By default it is as long as the last one, or ``max_dt``. An error from a callback is raised
        here, because pymunk itself only prints it. In a shared space step the space instead.
        """
        if not self.alone:
            raise setting_error("alone", False, "the space is shared: call space.step(dt)")
        if dt is not None and dt != self.dt:
            dt = float(dt)
            if not 0.0 < dt <= LONGEST * self.max_dt:
                raise step_error(dt, self.max_dt)
            self._since, self._count, self.dt = self.time, 0, dt
            self._is_other = True
            self._carry_all()
        self.space.step(self.dt)
        self._after_step()
        if self._is_other:
            self._carry_all()
            self._is_other = False

    def _carry_all(self) -> None:
        """Put all moving bodies on their paths.

        This is needed after a step of another length than the one before: pymunk's joints keep
        impulses from step to step, and take it that steps are equally long.
        """
        for ball in list(self.moving.values()):
            self._carry(ball)

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
        self._count += quiet
        self.time = self._since + self._count * dt

    def _steps_until_due(self) -> int:
        """Return in how many steps something is due, if no two sensors touch until then."""
        if self.friction == "callback" or self._wake == -math.inf:
            return 1
        steps = (self._wake - self.time) / self.dt * (1.0 - HAIR)  # rather a step too early
        return int(max(0.0, min(steps, MOST_QUIET))) + 1

    def _after_step(self, *_: object) -> None:
        """Answer what happened in the step that pymunk has just made; mostly it is nothing."""
        if self._error is not None:
            error, self._error = self._error, None
            raise error
        since = self.time
        self.steps += 1
        self._count += 1
        self.time = min(self._since + self._count * self.dt, self.latest)
        if self.near.pairs or self._moved_by_others or self.engine.upcoming() <= self.time:
            self._answer_contacts(since)
        ahead = 0.0 if self.alone else self.max_dt  # in a shared space others see how a ball stops
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
        self._advance()
        for i in near.changed:
            self._carry(self.balls[i])
        near.changed.clear()
        self._take_out(near.gone)

    def _take_out(self, gone: list[int]) -> None:
        """Take the bodies and shapes of balls that have left the table out of the space."""
        for i in gone:
            ball = self.balls[i]
            self._rest(ball)
            ball.is_on_table = False
            ball.body.position = ball.path.x, ball.path.y
            del self._ball_of[ball.body]
            ball.shapes = tuple(ball.body.shapes)
            things: list[pymunk.Body | pymunk.Shape] = [ball.body, *ball.shapes]
            self.space.remove(*[thing for thing in things if thing.space is not None])
        gone.clear()

    def _advance(self) -> None:
        """Play the instants of this step; changes from within callbacks come after each."""
        engine = self.engine
        self._inside = True
        try:
            while engine.is_finite and not engine.is_over and engine.upcoming() <= self.time:
                self._plays = True
                engine.next()
                self._plays = False
                while self._later:
                    self._later.pop(0)()
        finally:
            self._plays = self._inside = False
            self._later.clear()

    def _on_step(self, _clock: pymunk.Body, dt: float) -> None:
        """Notice, as a step begins, which balls others have moved, and what acts on them."""
        try:
            self.space.add_post_step_callback(self._after_shared_step, self)
            self._this_step = dt
            self._is_refused = not 0.0 < dt <= LONGEST * self.max_dt
            self._moves = self._bodies.read(dt)
            self._pushes.clear()
            self._damped_to.clear()
            if not self._is_refused:
                self._look_at_balls(dt)
        except Exception as error:
            self._note(error)

    def _look_at_balls(self, dt: float) -> None:
        """Follow the balls that others have moved, and note what forces will do in this step."""
        space, moves, engine = self.space, self._moves, self.engine
        (gx, gy), shapes = space.gravity, space.shapes
        self._damped = space.damping**dt
        falls = gx != 0.0 or gy != 0.0 or self._damped != 1.0
        for ball in self._ball_of.values():
            if ball.id not in moves or ball.circle not in shapes:
                self._lost.append(ball)
                continue
            x, y, vx, vy, fx, fy = moves[ball.id]
            path = engine.paths[ball.number]
            rests = x == path.rest_x and y == path.rest_y and vx == vy == 0.0
            if not rests or ball.number in self.moving:
                self._follow(ball, path, (x, y), (vx, vy))
            if falls or fx != 0.0 or fy != 0.0:
                mass = engine.masses[ball.number]
                self._kicks[ball] = (gx + fx / mass, gy + fy / mass)

    def _after_shared_step(self, *_: object) -> None:
        """Answer what happened in a step of a shared space."""
        if self._is_refused:
            if math.isfinite(self._this_step):  # Else no place is left to go back to.
                self._undo_step()
            raise step_error(self._this_step, self.max_dt)
        lost, self._lost = self._lost, []
        for ball in lost:
            self._remove(ball)
        is_other, self._is_other = self._is_other or self._this_step != self.dt, False
        self._knows_pull = self._has_new_joints or not is_other
        if self._this_step != self.dt:
            self._since, self._count, self.dt = self.time, 0, self._this_step
        joints = sum(ball.joint is not None for ball in self.moving.values())
        if len(self.space.constraints) > joints:
            for ball in self._ball_of.values():
                self._feel_push(ball)
        self._after_step()
        kicks, pushes = self._kicks, self._pushes
        self._moves.clear()  # From now on velocities are what this table makes of them.
        for ball in dict.fromkeys((*kicks, *pushes)):
            self._kick(ball, kicks.get(ball, (0.0, 0.0)), pushes.get(ball, (0.0, 0.0)))
        kicks.clear()
        pushes.clear()
        may_sleep = self.space.sleep_time_threshold < math.inf
        if may_sleep:
            for ball in self.moving.values():
                ball.body.activate()
        if is_other or may_sleep:
            self._carry_all()
        if is_other:
            self._renew_joints()
        self._has_new_joints = is_other

    def _undo_step(self) -> None:
        """Put the balls back to where they were before a step that cannot be."""
        self._kicks.clear()
        self._pushes.clear()
        self._lost.clear()
        self._is_other = True
        for ball in self._ball_of.values():
            if ball.id in self._moves:
                x, y, vx, vy, *_ = self._moves[ball.id]
                ball.body.position, ball.body.velocity = (x, y), (vx, vy)

    def _feel_push(self, ball: Ball) -> None:
        """Note what others than friction and forces have added to a velocity in this step."""
        is_pulled = ball.joint is not None and ball.number in self.moving
        if ball in self._pushes or (is_pulled and not self._knows_pull):
            return
        vx, vy = self._damped_to.get(ball.body) or self._velocity_without_others(ball)
        wx, wy = ball.body.velocity
        if abs(wx - vx) + abs(wy - vy) > 1e-9 * (abs(vx) + abs(vy) + abs(wx) + abs(wy)):
            self._pushes[ball] = (wx - vx, wy - vy)

    def _velocity_without_others(self, ball: Ball) -> Vector:
        """Return the velocity (m/s) that pymunk gives a body by forces and the friction joint."""
        _, _, vx, vy, _, _ = self._moves[ball.id]
        ax, ay = self._kicks.get(ball, (0.0, 0.0))
        dt = self._this_step
        vx, vy = vx * self._damped + ax * dt, vy * self._damped + ay * dt
        if ball.joint is None or ball.number not in self.moving:
            return vx, vy
        _, left = slid(math.sqrt(vx * vx + vy * vy), self.deceleration, dt)
        return vx * left, vy * left

    def _kick(self, ball: Ball, acceleration: Vector, push: Vector) -> None:
        """Let forces (m/s^2) and pushes (m/s) act for this step, at its end.

        Surface friction holds a ball at rest against as much as its own deceleration.
        """
        if not ball.is_on_table:
            return
        dt = self.dt
        gain_x, gain_y = acceleration[0] * dt + push[0], acceleration[1] * dt + push[1]
        x, y, vx, vy = motion_at(ball.path, self.time)
        gain = math.sqrt(gain_x * gain_x + gain_y * gain_y)
        if vx == vy == 0.0 and gain <= self.deceleration * dt:
            ball.body.velocity = (0.0, 0.0)
            return
        kicked = (vx * self._damped + gain_x, vy * self._damped + gain_y)
        self.engine.now = self.time
        path = set_off(self.time, (x, y), kicked, self.deceleration)
        self.engine.set_off(ball.number, path)
        self.engine.predict([ball.number])
        self._carry(ball)

    def _follow(self, ball: Ball, path: Path, place: Vector, velocity: Vector) -> None:
        """Give a ball a new path if it is not on its own: somebody else has moved it."""
        (x, y), (vx, vy), number = place, velocity, ball.number
        x0, y0, ex, ey = self._expected(path)
        scale = 1e-9 * (abs(vx) + abs(vy) + abs(ex) + abs(ey))
        slack = 1e-9 * (ball.radius + abs(x) + abs(y))
        is_on_path = abs(x - x0) + abs(y - y0) <= slack
        if is_on_path and abs(vx - ex) + abs(vy - ey) <= scale:
            return
        path = set_off(self.time, place, velocity, self.deceleration)
        self.engine.set_off(number, path)
        if path.speed == 0.0:
            self.engine.rested[number] = self.time
        self._moved_by_others.append(number)

    def _expected(self, path: Path) -> Motion:
        """Return where a body on this path is now (m), and its velocity (m/s) in this step."""
        if path.stop <= self.time + self.dt:
            x, y, _, _ = motion_at(path, self.time)
            return x, y, *self._mean_velocity(path, self.time)
        time, left = slid(path.speed, path.deceleration, self.time - path.t)
        mean = left - path.deceleration * self.dt / (2.0 * path.speed)
        return path.x + path.vx * time, path.y + path.vy * time, path.vx * mean, path.vy * mean

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
            now = self._since + (self._count + 1) * self.dt
            ball = self._ball_of[body]
            damped = self._mean_velocity(ball.path, now)
            if not self.alone:  # A spring has pulled before.
                (x, y), (_, _, vx, vy, _, _) = body.velocity, self._moves[ball.id]
                self._damped_to[body] = damped
                damped = (damped[0] + x - vx, damped[1] + y - vy)
            body.force = (0.0, 0.0)
            body.velocity = damped
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
        if not self.alone and ball.id in self._moves:
            self._feel_push(ball)
        path = ball.path
        x, y, vx, vy = motion_at(path, self.time)
        ball.body.position = x, y
        if path.stop <= self.time:
            self._rest(ball)
            return
        ball.body.velocity = self._mean_velocity(path, self.time)
        margin = 0.0
        if self._is_swept:
            margin = math.sqrt(vx * vx + vy * vy) * self.max_dt
            if not self.alone:  # A body may be beside its path if steps differ in length.
                margin += self.deceleration * self.max_dt**2
        rounding = HAIR * ball.radius + 16.0 * EPSILON * (abs(x) + abs(y))
        ball.sensor.unsafe_set_radius(ball.radius + margin + rounding)
        if ball.number not in self.moving:
            check_unchanged(ball, self.engine.masses[ball.number])
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

    def _renew_joints(self) -> None:
        """Give all moving balls new joints, which keep no impulse from a step of other length."""
        for ball in self.moving.values():
            if ball.joint is not None:
                self.space.remove(ball.joint)
                ball.joint = None
                self._slow_down(ball)

    def _rest(self, ball: Ball) -> None:
        """Put a ball to rest; from now on it costs nothing."""
        ball.body.velocity = (0.0, 0.0)
        ball.sensor.unsafe_set_radius(ball.radius * (1.0 if self._is_swept else 1.0 - HAIR))
        if self.moving.pop(ball.number, None) is None:
            return
        if ball.joint is not None:
            self.space.remove(ball.joint)
            ball.joint = ball.joint if self.alone else None
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
            balls = tuple(self.table.balls[i] for i in contact.balls)
            self.table.on_contact(ContactEvent(t, balls, contact.cushion))

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Call ``on_stop``."""
        if self.table.on_stop is not None:
            self.table.on_stop(self.table.balls[i], t)

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Call ``on_pocket`` with the ball, the number of the pocket, and the time (s)."""
        if self.table.on_pocket is not None:
            self.table.on_pocket(self.table.balls[i], pocket, t)

    def stop_revoked(self, i: int, t: float) -> None:
        """Call ``on_stop_revoked``, because the ball had not come to rest."""
        if self.table.on_stop_revoked is not None:
            self.table.on_stop_revoked(self.table.balls[i], t)


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
