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
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args

import pymunk

from pool_pymunk.engine.contacts import ContactEngine, Motion, Recorder
from pool_pymunk.model.places import lies_in, room_beside
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.physics.contact import Contact, Pair, Vector, closing_speed
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.sides import Side, Wall, pocket, unit
from pool_pymunk.physics.surface import Sliding
from pool_pymunk.world.ball import Ball, ContactEvent, TableState
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
    warn_of_lengths,
)
from pool_pymunk.world.others import Others
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

# This is a callback's name, what it is called with, and balls' paths before it.
Told = tuple[str, tuple[object, ...], dict[Ball, Path]]

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
    what happens. They are called in the middle of a step, when the instant of which they tell is
    over. What you change from within them (all but :meth:`restore_state` and a step) counts from
    that instant on, as it would between two steps.

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
        self.surface = Sliding(read_from_zero("deceleration", deceleration))
        self.friction = friction
        self.alone = alone
        self._said_pair = pair
        self._is_swept = contacts == "swept"
        listens = Callbacks(self)
        self.engine = ContactEngine(read_law(law), self._pair, self.surface, listens)
        self.near = (BroadPhase if self._is_swept else EndOfStep)(space, self.engine)
        self.engine.near = self.near
        self.on_contact: Callable[[ContactEvent], object] | None = None
        self.on_stop: Callable[[Ball, float], object] | None = None
        self.on_stop_revoked: Callable[[Ball, float], object] | None = None
        self.on_pocket: Callable[[Ball, int, float], object] | None = None
        self._wall_count = 0
        self._unused: list[int] = []  # the engine's places of walls that were removed
        self._carriers: set[pymunk.Shape] = set()  # shapes of walls whose sides are others
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
        self.moved_by_others: list[int] = []  # in this step
        self._error: Exception | None = None
        self._is_other = False  # The step is of another length than the one before.
        self._inside = False  # It plays the instants of a step.
        self._told: list[Told] = []  # what has happened in the present instant
        # While a callback runs, this is how the table left each body: place (m) and velocity (m/s).
        self._left: dict[Ball, tuple[Vector, Vector]] | None = None
        self._install()
        self._others = None if alone else Others(self)
        self._step = space.step  # This is how a table steps a space of its own.
        if alone:
            vars(space)["step"] = _refuse_step
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
        self._check_is_open()
        self._catch_up()
        body = circle.body
        assert body is not None
        if body in self._ball_of:
            raise setting_error("circle", "taken", "this body is a ball already")
        place = read_vector("position", body.position)
        check_place(place, circle.radius, self._discs(), self._obstacles())
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
        path = self.surface.path(self._now, (x, y), (vx, vy))
        number = self.engine.add_ball(path, radius, body.mass)
        ball = Ball(number, circle, sensor, self.engine)
        self.balls.append(ball)
        self.near.sensors.append(sensor)
        self._enter(ball)
        if path.moves or self._inside:
            self._let_go(ball)
        elif not self._is_swept:
            sensor.unsafe_set_radius(radius * (1.0 - HAIR))
        return ball

    def _enter(self, ball: Ball) -> None:
        """Put a ball's sensor into the space, and mark its circle as a ball's."""
        if not self.alone:
            ball.circle.collision_type = BALL
            ball.sensor.filter = ball.circle.filter
            ball.sensor.body = ball.body
            self._join(ball.sensor)
        ball.sensor.collision_type = SENSOR
        ball.type = ball.circle.collision_type
        self.near.numbers[ball.sensor] = ball.number
        self._ball_of[ball.body] = ball
        ball.is_on_table = True
        if self._others is not None:
            self._others.welcome(ball.body)

    def _obstacles(self) -> list[tuple[pymunk.Shape | None, Wall]]:
        """Return the walls and pockets, each with its shape if the sides are those of the shape."""
        walls = [(shape, -1 - k) for shape, k in self.near.numbers.items() if k < 0]
        return [
            (None if shape in self._carriers else shape, self.engine.walls[k]) for shape, k in walls
        ]

    def _discs(self, without: Ball | None = None) -> dict[int, tuple[Vector, float]]:
        """Return place and radius (m) of each ball by its number, perhaps ``without`` one."""
        now, balls, paths = self._now, self._ball_of.values(), self.engine.paths
        return {
            ball.number: (paths[ball.number].at(now)[0], ball.radius)
            for ball in balls
            if ball is not without
        }

    def _join(self, *things: pymunk.Body | pymunk.Shape) -> None:
        self.space.add(*[thing for thing in things if thing.space is None])

    def remove_ball(self, ball: Ball) -> None:
        """Take a ball off the table; its body can still be read.

        Its body and shapes leave the space. You may do this from within a callback.
        """
        self._check_ball(ball)
        self.drop(ball)

    def drop(self, ball: Ball) -> None:
        """Take a ball off the table now, unless it is off it already."""
        if ball.is_on_table:
            self.engine.now = self._now
            self.engine.remove(ball.number)
            self._take_out(self.near.gone)

    def clear(self) -> None:
        """Take all balls off the table."""
        for ball in self.on_table():
            self.remove_ball(ball)

    def _check_ball(self, ball: Ball) -> None:
        own = self.balls
        if not isinstance(ball, Ball) or own[ball.number : ball.number + 1] != [ball]:
            raise setting_error("ball", shown(ball), "must be what add_ball of this table returned")
        if not ball.is_on_table:
            message = "the ball is off the table: add_ball(ball.circle) makes a new one of it"
            raise setting_error("ball", ball.number, message)
        self._catch_up()
        if not ball.is_on_table:
            raise setting_error("ball", ball.number, "the ball was taken out of the space")

    def ball_of(self, shape: pymunk.Shape) -> Ball | None:
        """Return the ball on the table to which a shape belongs, or None."""
        return None if shape.body is None else self._ball_of.get(shape.body)

    def _catch_up(self) -> None:
        """Follow what others have done to the balls since the last step, or in a callback."""
        if self._left is not None:
            self._follow_callback(self._left)
        elif self._inside:
            message = "wait for on_contact: the table cannot be used while a contact is answered"
            raise setting_error("pair", "a change", message)
        elif self._others is not None:
            self._others.catch_up()

    def _check_is_open(self) -> None:
        """Refuse a change while pymunk steps the space, which is closed to it."""
        if self._others is not None and self._others.is_stepping and not self._inside:
            message = "pymunk is stepping the space: do this between steps, or from on_contact"
            self.note(error := setting_error("space", "locked", message))
            raise error

    def on_table(self) -> list[Ball]:
        """Return the balls that are on the table."""
        return list(self._ball_of.values())

    def add_wall(
        self,
        shape: pymunk.Shape,
        restitution: float,
        friction: float = 0.0,
        sides: tuple[Side, ...] | None = None,
    ) -> int:
        """Make a static segment, circle or polygon a wall that balls bounce off (Eq. 9).

        ``sides`` are the sides of it that a ball can meet (default: all of them). You may give it
        sides of your own (:class:`~pool_pymunk.physics.sides.Side`), such as a concave arc; the
        shape then only says where they are, and may be a sensor. Returns the wall's number. Raises
        ValueError for what cannot be a wall.
        """
        check_wall(shape)
        if shape in self.near.numbers:
            raise setting_error("shape", "taken", "this shape is a wall already")
        restitution = read_share("restitution", restitution)
        friction = read_from_zero("friction", friction)
        warn_of_lengths(sides or ())
        self._check_is_open()
        self._catch_up()
        wall = Wall(sides or sides_of(shape), restitution, friction, self._wall_count)
        self._join(shape)
        if self._others is not None and shape.body is not None:
            self._others.stand(shape.body)
        self.near.filters = self.near.filters or shape.filter != EVERYTHING
        if sides:
            self._carriers.add(shape)
        self._wall_count += 1
        self._put_up(shape, wall)
        return wall.number

    def _put_up(self, shape: pymunk.Shape, wall: Wall) -> None:
        """Let balls meet a wall or pocket, which is where its shape is."""
        walls, shape.collision_type = self.engine.walls, WALL
        place = self._unused.pop() if self._unused else len(walls)
        walls[place : place + 1] = [wall]
        self.near.numbers[shape] = -1 - place
        if self._inside:  # pymunk reports the balls that are near it in the next step only.
            for i in self.moving:
                self.engine.meet_wall(i, place)

    def remove_wall(self, wall: int) -> None:
        """Take the wall of this number out of the space; the other walls keep their numbers."""
        self._check_is_open()
        self._catch_up()
        walls = self.engine.walls
        own = (k for k, each in enumerate(walls) if not each.is_pocket and each.number == wall)
        place = next(own, None)
        if place is None:
            raise setting_error("wall", shown(wall), "there is no wall of this number")
        shapes = self.near.numbers.items()
        shape = next(shape for shape, number in shapes if number == -1 - place)
        self.near.forget(shape)
        self._carriers.discard(shape)
        shape.collision_type = 0
        if shape.space is not None:
            self.space.remove(shape)
        bodies = {each.body for each in self.near.numbers}
        if self._others is not None and shape.body not in bodies:
            self._others.let_go(shape.body)
        walls[place] = Wall((), 0.0, 0.0, -1)
        self._unused.append(place)
        self._predict_anew()

    def add_pocket(self, position: Vector, radius: float) -> int:
        """Make a pocket, which takes balls in whose centres come within ``radius`` (m).

        The bodies and shapes of these balls leave the space. Returns the pocket's number. Raises
        ValueError if a ball lies within it now.
        """
        position, radius = read_vector("position", position), read_size("radius", radius)
        self._check_is_open()
        self._catch_up()
        number = sum(wall.is_pocket for wall in self.engine.walls)
        hole = pocket(position, radius, number)
        for place, r in self._discs().values():
            if lies_in(hole, room_beside(hole.sides, *place, r), *place, r):
                raise setting_error("position", list(position), "a ball lies within this pocket")
        shape = pymunk.Circle(self.space.static_body, radius, position)
        shape.sensor = True
        self.space.add(shape)
        self._put_up(shape, hole)
        return number

    def strike(self, ball: Ball, velocity: Vector) -> None:
        """Give a ball a velocity (m/s) now."""
        self._check_ball(ball)
        velocity = read_vector("velocity", velocity)
        check_unchanged(ball, self.engine.masses[ball.number])
        self._send(ball, None, velocity)

    def place(self, ball: Ball, position: Vector) -> None:
        """Put a ball to rest at another place (m), such as one of :meth:`free_spot`.

        Raises ValueError if it overlaps a ball or a wall there, or lies within a pocket.
        """
        self._check_is_open()
        self._check_ball(ball)
        position = read_vector("position", position)
        check_place(position, ball.radius, self._discs(without=ball), self._obstacles())
        self._send(ball, position, (0.0, 0.0))

    def _send(self, ball: Ball, position: Vector | None, velocity: Vector | None) -> None:
        """Set a ball off from a position (m), or from where it is; perhaps as fast as it is."""
        now = self._now
        place, goes = self.engine.paths[ball.number].at(now)
        path = self.surface.path(now, position or place, velocity or goes)
        self.engine.now = now
        self.engine.set_off(ball.number, path)
        if not path.moves:
            self.engine.rested[ball.number] = now
        self._carry(ball)
        if position is not None:
            self._move_sensor(ball)
        self._let_go(ball)

    def _let_go(self, ball: Ball) -> None:
        """Predict what a ball on a new path meets, in the rest of this step or from now on."""
        is_stepping = self._others is not None and self._others.is_stepping
        if self._others is not None and is_stepping:
            self._others.last_word(ball)
        if is_stepping and not self._inside:
            self.moved_by_others.append(ball.number)  # pymunk is still at this step.
        else:
            self.engine.predict([ball.number])
        self._carry(ball)

    @property
    def _now(self) -> float:
        """Return the time (s), which within a step is that of the present instant."""
        return self.engine.now if self._inside else self.time

    # -- undo, and looking ahead -----------------------------------------------------------------

    def save_state(self) -> TableState:
        """Return where the balls are and how they move, for :meth:`restore_state`."""
        self._catch_up()
        now, paths = self._now, self.engine.paths
        motions = {ball.number: motion_at(paths[ball.number], now) for ball in self.on_table()}
        return TableState(now, motions, dict(self.engine.resolver.history))

    def restore_state(self, state: TableState) -> None:
        """Put the balls back to where they were, and the clock.

        Balls that have left the table since come back, those that have come since leave it. The
        velocities are the exact ones, so the table goes on as it did. Do this between two steps;
        raises ValueError from within a callback, for a state of another table, and if a wall or a
        pocket is now where a ball was.
        """
        self._check_between_steps("restore_state")
        if not isinstance(state, TableState):
            raise setting_error("state", shown(state), "must be what save_state of a table gave")
        strangers = [i for i in state.motions if not 0 <= i < len(self.balls)]
        if strangers:
            raise setting_error("state", strangers, "this table has had no balls of these numbers")
        if self._is_swept:  # Walls and pockets may have come since.
            for i, (x, y, _, _) in state.motions.items():
                check_place((x, y), self.balls[i].radius, {}, self._obstacles())
        for ball in self.on_table():
            if ball.number not in state.motions:
                self.drop(ball)
        self.time = self._since = state.time
        self._count = 0
        self.engine.turn_back(self.time)
        self.moved_by_others.clear()
        for number, (x, y, vx, vy) in state.motions.items():
            ball = self.balls[number]
            if not ball.is_on_table:
                self._join(ball.body, *ball.shapes)
                self._enter(ball)
            path = self.surface.path(self.time, (x, y), (vx, vy))
            self.engine.set_off(ball.number, path)
            self.engine.rested[ball.number] = math.inf if path.moves else -math.inf
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

    def free_spot(
        self, near: Vector, radius: float | None = None, ball: Ball | None = None
    ) -> Vector:
        """Return the place (m) nearest to ``near`` where a ball overlaps nothing: ball in hand.

        It is for ``ball``, which is not in its own way; or for a new ball of this ``radius`` (m),
        by default that of the first ball. The way from ``near`` crosses no wall; outside of the
        table there is room, too. Raises ValueError if there is none.
        """
        self._catch_up()
        near = read_vector("near", near)
        if ball is not None:
            radius = ball.radius
        elif radius is None and not self.balls:
            raise setting_error("radius", None, "is wanted where there is no ball")
        size = self.balls[0].radius if radius is None else read_size("radius", radius)
        found = free_spot(near, size, list(self._discs(without=ball).values()), self._obstacles())
        if found is None:
            raise setting_error("near", list(near), "there is no room for a ball near this place")
        return found

    @property
    def pockets(self) -> dict[int, tuple[Vector, float]]:
        """The centre and the radius (m) of each pocket, by its number."""
        walls = [wall for wall in self.engine.walls if wall.center is not None]
        return {wall.number: wall.sides[0][:2] for wall in walls}  # type: ignore[index]

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
            surface=self.surface,
        )

    def _predict_anew(self) -> None:
        """Put all balls on their paths, and predict again what they meet."""
        if not self._inside:
            self.near.until = self.engine.now = self.time
        now = self._now
        for ball in self._ball_of.values():
            x, y, vx, vy = motion_at(self.engine.paths[ball.number], now)
            path = self.surface.path(now, (x, y), (vx, vy))
            if path.moves:
                self.engine.set_off(ball.number, path)
            self._carry(ball)
            self._move_sensor(ball)
        self.engine.predict([ball.number for ball in self._ball_of.values()])

    def _move_sensor(self, ball: Ball) -> None:
        """Let pymunk find anew what a ball's sensor touches, because the ball was put elsewhere.

        pymunk reports a touch only once until the two part.
        """
        self.space.remove(ball.sensor)
        self.space.add(ball.sensor)
        self.space.reindex_shapes_for_body(ball.body)

    # -- stepping --------------------------------------------------------------------------------

    def step(self, dt: float | None = None) -> None:
        """Make one step (s) of a space that holds nothing else, contacts and stops included.

        By default it is as long as the last one, or ``max_dt``. An error from a callback is raised
        here, because pymunk itself only prints it. In a shared space step the space instead.
        """
        if not self.alone:
            raise setting_error("alone", False, "the space is shared: call space.step(dt)")
        self._check_between_steps("step")
        if dt is not None and dt != self.dt:
            dt = float(dt)
            if not 0.0 < dt <= LONGEST * self.max_dt:
                raise step_error(dt, self.max_dt)
            self.take_steps_of(dt)
            self._is_other = True
            self.carry_all()
        self._step(self.dt)
        self.answer_step()
        if self._is_other:
            self.carry_all()
            self._is_other = False
        self.raise_noted()

    def _check_between_steps(self, call: str) -> None:
        """Refuse a call that is for the time between two steps."""
        if self._inside or (self._others is not None and self._others.is_stepping):
            raise setting_error(call, "in a step", "wait until the present step is over")

    def carry_all(self) -> None:
        """Put all moving bodies on their paths.

        This is needed after a step of another length than the one before: pymunk's joints keep
        impulses from step to step, and take it that steps are equally long.
        """
        for ball in list(self.moving.values()):
            self._carry(ball)

    def take_steps_of(self, dt: float) -> None:
        """Count steps of this length (s) from now on."""
        if dt != self.dt:
            self._since, self._count, self.dt = self.time, 0, dt

    def play(self, on_time: Callable[[float], object] | None = None) -> None:
        """Step until everything rests, until ``latest``, or until nothing more may happen.

        ``on_time`` is called now and then with the time (s).
        """
        self._check_between_steps("play")
        self._wake = -math.inf  # Balls may have been struck since.
        while self.moving and self.time < self.latest:
            self._make_steps(self._steps_until_due())
            self.answer_step()
            self.raise_noted()
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
        step, dt, pairs = self._step, self.dt, self.near.pairs
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

    def raise_noted(self) -> None:
        """Raise the first error of this step, if there was one: now that all is in order."""
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def answer_step(self) -> None:
        """Answer what happened in the step that pymunk has just made; mostly it is nothing."""
        since, end = self.time, min(self._since + (self._count + 1) * self.dt, self.latest)
        is_due = self.near.pairs or self.moved_by_others or self.engine.upcoming() <= end
        if is_due and self._others is not None:
            self._others.look_at_walls()
        self.steps += 1
        self._count += 1
        self.time = end
        if is_due:
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
        moved, self.moved_by_others = dict.fromkeys(self.moved_by_others), []
        engine.predict([i for i in moved if self.balls[i].is_on_table])
        self._advance()
        for i in near.changed:
            self._carry(self.balls[i])
        near.settle()

    def _take_out(self, gone: list[int]) -> None:
        """Take the bodies and shapes of balls that have left the table out of the space."""
        for i in gone:
            ball = self.balls[i]
            self._rest(ball)
            ball.is_on_table = False
            path = self.engine.paths[i]
            ball.body.position = path.x, path.y
            ball.circle.collision_type = 0
            del self._ball_of[ball.body]
            there = [each for each in ball.body.shapes if each.space is not None]
            things: list[pymunk.Body | pymunk.Shape] = [ball.body, *there]
            self.space.remove(*[thing for thing in things if thing.space is not None])
            if not self.alone:
                there = [each for each in there if each is not ball.sensor]
                if ball.sensor.space is None:
                    ball.sensor.body = None  # Its body may come back as another ball.
            ball.shapes = tuple(there)
        gone.clear()

    def _advance(self) -> None:
        """Play the instants of this step, and call the callbacks after each."""
        engine = self.engine
        self._inside = True
        try:
            while engine.is_finite and not engine.is_over and engine.upcoming() <= self.time:
                engine.next()
                if self.near.gone:
                    self._take_out(self.near.gone)
                if self._told:
                    self._tell()
        except Exception:  # A law or pair of the user's has failed: its contact is still due.
            engine.predict(list(self.moving))
            raise
        finally:
            self._inside = False
            self._told.clear()

    def steps_on(self, path: Path) -> float:
        """Return how many steps at most pymunk itself has taken a body along this path.

        Each of them rounds its place and velocity.
        """
        steps = (self.time - path.t) / self.dt
        return 2.0 + (steps if steps < self._count else self._count)

    @property
    def deceleration(self) -> float:
        """The deceleration (m/s^2) of a ball that slides, mu_s g."""
        return self.surface.pull

    @property
    def count(self) -> int:
        """The number of balls on the table."""
        return len(self._ball_of)

    @property
    def joints(self) -> int:
        """The number of friction joints that are in the space now."""
        has = self.friction == "joint" and self.surface.pull > 0.0
        return len(self.moving) if has else 0

    def set_out(self, balls: Sequence[Ball]) -> None:
        """Predict what balls on new paths meet, and put their bodies on them."""
        self.engine.predict([ball.number for ball in balls])
        for ball in balls:
            self._carry(ball)

    def _feels(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """Handle a collision: note that these two shapes may have met during this step."""
        try:
            arbiter.process_collision = False
            self.near.touched(*arbiter.shapes)
        except Exception as error:
            self.note(error)

    def tell(self, key: str, said: tuple[object, ...], balls: Sequence[int] = ()) -> None:
        """Call the callback of this name as soon as the present instant is over.

        The ``path`` of these balls is for it what it is now.
        """
        if getattr(self, key) is not None:
            self._told.append((key, said, {self.balls[i]: self.engine.paths[i] for i in balls}))

    def _tell(self) -> None:
        """Call the callbacks of this instant; errors of theirs are kept to the step's end."""
        told, self._told = self._told, []
        for key, said, paths in told:
            callback = getattr(self, key)
            if callback is None:
                continue
            for ball, path in paths.items():
                ball.before = path
            bodies = ((ball, ball.body) for ball in self._ball_of.values())
            self._left = {ball: (body.position, body.velocity) for ball, body in bodies}
            try:
                callback(*said)
                self._follow_callback(self._left)
            except Exception as error:
                self.note(error)
            finally:
                self._left = None
                for ball in paths:
                    ball.before = None

    def _follow_callback(self, left: dict[Ball, tuple[Vector, Vector]]) -> None:
        """Follow what a callback has done to bodies itself."""
        for ball, (place, velocity) in list(left.items()):
            body = ball.body
            if ball.is_on_table and (body.space is None or ball.circle.space is None):
                self.drop(ball)
            elif ball.is_on_table and (body.position != place or body.velocity != velocity):
                (x, y), goes = body.position, body.velocity
                there = None if (x, y) == place else self.beside(ball, x, y)
                self._send(ball, there, None if goes == velocity else goes)

    def beside(self, ball: Ball, x: float, y: float) -> Vector:
        """Return where a ball lies that was pushed into balls and walls: it touches them."""
        radius, now, engine = ball.radius, self._now, self.engine
        for other in self._ball_of.values():
            (u, v), reach = engine.paths[other.number].at(now)[0], radius + other.radius
            if other is not ball and math.dist((x, y), (u, v)) < reach:
                nx, ny = unit(x - u, y - v)
                x, y = u + reach * nx, v + reach * ny
        for wall in engine.walls:
            for side in () if wall.is_pocket else wall.sides:
                gap = side.gap(x, y, radius)
                if -radius <= gap < 0.0:
                    nx, ny = side.normal(x, y)
                    x, y = x - gap * nx, y - gap * ny
        return x, y

    def note(self, error: Exception) -> None:
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
            velocity = self.mean_velocity(self.engine.paths[ball.number], now)
            body.force = (0.0, 0.0)
            body.velocity = velocity if self._others is None else self._others.damp(ball, velocity)
        except Exception as error:
            self.note(error)

    def mean_velocity(self, path: Path, t: float) -> Vector:
        """Return the velocity (m/s) that takes a body along its path from ``t`` to ``t + dt``.

        A difference of two places would know it to rounding of a place over ``dt`` only.
        """
        moves = path.end - t
        _, _, vx, vy = motion_at(path, t)
        if moves > self.dt:
            return vx + self.dt * path.ax / 2.0, vy + self.dt * path.ay / 2.0
        share = max(moves, 0.0) / self.dt
        return share * (vx + moves * path.ax / 2.0), share * (vy + moves * path.ay / 2.0)

    # -- bodies on their paths -------------------------------------------------------------------

    def _carry(self, ball: Ball) -> None:
        """Put a ball's body on its path at the end of this step, or to rest."""
        if self._others is not None:
            self._others.feel_push(ball)
        path = self.engine.paths[ball.number]
        x, y, vx, vy = motion_at(path, self.time)
        ball.body.position = x, y
        goes = self.mean_velocity(path, self.time)
        if self._left is not None:
            self._left[ball] = (x, y), goes
        if path.end <= self.time:
            self._rest(ball)
            return
        ball.body.velocity = goes
        margin = 0.0
        if self._is_swept:
            margin = math.sqrt(vx * vx + vy * vy) * self.max_dt
            if not self.alone:  # A body may be beside its path if steps differ in length.
                margin += self.surface.pull * self.max_dt**2
        rounding = HAIR * ball.radius + 16.0 * EPSILON * (abs(x) + abs(y))
        ball.sensor.unsafe_set_radius(ball.radius + margin + rounding)
        if ball.number not in self.moving:
            check_unchanged(ball, self.engine.masses[ball.number])
            self.moving[ball.number] = ball
            self._slow_down(ball)
        self._next_stop = min(self._next_stop, path.end)

    def _slow_down(self, ball: Ball) -> None:
        """Install surface friction on a ball that begins to move."""
        if self.surface.pull == 0.0:
            return
        if self.friction == "joint":
            ball.joint = ball.joint or _friction_joint(self.space, ball.body, self.surface.pull)
            self.space.add(ball.joint)
        else:
            ball.body.velocity_func = self._damp

    def renew_joints(self) -> None:
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
        elif self.surface.pull > 0.0:
            ball.body.velocity_func = pymunk.Body.update_velocity

    def _stop_balls(self) -> None:
        """Put balls to rest whose paths have ended, and steer those that stop in the next step."""
        for ball in list(self.moving.values()):
            path = self.engine.paths[ball.number]
            if path.end <= self.time:
                self._carry(ball)
            elif path.end <= self.time + self.dt:
                ball.body.velocity = self.mean_velocity(path, self.time)
        paths = self.engine.paths
        self._next_stop = min((paths[i].end for i in self.moving), default=math.inf)


class Callbacks(Recorder):
    """This recorder passes on what the engine does to the callbacks of a :class:`Billiards`."""

    def __init__(self, table: Billiards) -> None:
        self.table = table

    def contact(self, contact: Contact, t: float) -> None:
        """Tell ``on_contact``."""
        table = self.table
        if table.on_contact is not None:
            velocity = {i: table.engine.paths[i].at(t)[1] for i in contact.balls}
            closing = closing_speed(contact, velocity)
            balls = tuple(table.balls[i] for i in contact.balls)
            event = ContactEvent(t, balls, contact.cushion, contact.point, contact.normal, closing)
            table.tell("on_contact", (event,), contact.balls)

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Tell ``on_stop``."""
        self.table.tell("on_stop", (self.table.balls[i], t))

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Tell ``on_pocket`` the ball, the number of the pocket, and the time (s)."""
        self.table.tell("on_pocket", (self.table.balls[i], pocket, t))

    def stop_revoked(self, i: int, t: float) -> None:
        """Tell ``on_stop_revoked``, because the ball had not come to rest."""
        self.table.tell("on_stop_revoked", (self.table.balls[i], t))


def _friction_joint(space: pymunk.Space, body: pymunk.Body, pull: float) -> pymunk.PivotJoint:
    """Return a joint that is Coulomb friction inside the C step.

    It pulls back with the force m a, and holds the body at no place.
    """
    joint = pymunk.PivotJoint(space.static_body, body, (0.0, 0.0), (0.0, 0.0))
    joint.max_bias = 0.0
    joint.max_force = body.mass * pull
    return joint


def _refuse_step(dt: float) -> None:
    raise setting_error("alone", True, "the space is the table's own: call table.step(dt)")


def _no_response(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
    arbiter.process_collision = False
