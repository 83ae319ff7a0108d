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
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args
from weakref import WeakSet

import pymunk

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.recorder import Recorder
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.physics.contact import Pair, Vector
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.sides import Side, Wall
from pool_pymunk.physics.surface import Sliding
from pool_pymunk.world import checks
from pool_pymunk.world.ball import Ball, ContactEvent, TableState
from pool_pymunk.world.broad_phase import BroadPhase, EndOfStep
from pool_pymunk.world.others import SharedSteps
from pool_pymunk.world.outlook import Prediction, free_spot, sketch
from pool_pymunk.world.pairs import check_pair
from pool_pymunk.world.state import BALL, SENSOR, Phase, State
from pool_pymunk.world.steps import Steps
from pool_pymunk.world.telling import Callbacks
from pool_pymunk.world.walls import WALL, Walls, sides_of

Contacts = Literal["swept", "discrete"]
FrictionBy = Literal["joint", "callback"]

_taken: WeakSet[pymunk.Space] = WeakSet()  # spaces that have a Billiards, which lives as long


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
        _check_settings(space, pair, contacts, friction)
        self.space = space
        self.max_dt = checks.read_size("max_dt", max_dt)
        self.friction = friction
        self.alone = alone
        self.on_contact: Callable[[ContactEvent], object] | None = None
        self.on_stop: Callable[[Ball, float], object] | None = None
        self.on_stop_revoked: Callable[[Ball, float], object] | None = None
        self.on_pocket: Callable[[Ball, int, float], object] | None = None
        self._said_pair = pair
        surface = Sliding(checks.read_from_zero("deceleration", deceleration))
        self.engine = ContactEngine(checks.read_law(law), self._pair, surface, Recorder())
        is_swept = contacts == "swept"
        self.near = self.engine.near = (BroadPhase if is_swept else EndOfStep)(space, self.engine)
        self.state = State(
            space, self.engine, self.near, self.max_dt,
            alone=alone, has_joints=friction == "joint", is_swept=is_swept,
        )  # fmt: skip
        self.balls = self.state.balls  # all that were ever added, by their numbers
        self.moving = self.state.moving  # the balls that move, by their numbers
        self._walls = Walls(self.state)
        self._callbacks = Callbacks(self.state, lambda name: getattr(self, name))
        self.engine.recorder = self._callbacks
        self._install("begin" if is_swept else "pre_solve")
        self._steps = (Steps if alone else SharedSteps)(self.state, self._walls, self._callbacks)
        _taken.add(space)

    def __reduce__(self) -> str | tuple[Any, ...]:
        raise TypeError(
            "a Billiards and its space cannot be copied or pickled: use save_state and "
            "restore_state"
        )

    def _install(self, when: str) -> None:
        """Set the collision handlers.

        A swept contact is predicted as soon as two sensors touch, so one call is enough until they
        part. A discrete contact needs a call in every step.
        """
        self.space.on_collision(SENSOR, SENSOR, **{when: self._feels})
        self.space.on_collision(SENSOR, WALL, **{when: self._feels})
        if not self.alone:
            self.space.on_collision(BALL, BALL, pre_solve=_no_response)
            self.space.on_collision(BALL, WALL, pre_solve=_no_response)

    def _feels(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        """Handle a collision: note that these two shapes may have met during this step."""
        try:
            arbiter.process_collision = False
            self.near.touched(*arbiter.shapes)
        except Exception as error:
            self.state.note(error)

    def _pair(self, i: int, j: int) -> Pair:
        """Return the pair that the user gives, with the masses of the bodies."""
        masses = self.engine.masses
        return check_pair(self._said_pair(i, j), (masses[i], masses[j]), (i, j))

    def _catch_up(self, changes_space: bool = False) -> None:
        """Follow what others have done to the balls before this call, or refuse the call.

        Most changes need a space that is not closed because pymunk steps it.
        """
        phase = self.state.phase
        if phase is Phase.STEPPING and changes_space:
            message = "pymunk is stepping the space: do this between steps, or from on_contact"
            self.state.note(error := setting_error("space", "locked", message))
            raise error
        if phase is Phase.ANSWERING:
            message = "wait for on_contact: the table cannot be used while a contact is answered"
            raise setting_error("pair", "a change", message)
        if phase is Phase.TELLING:
            self._callbacks.follow()
        elif phase is Phase.BETWEEN:
            self._steps.catch_up()

    # -- what there is ---------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """The time (s) at the end of the last step."""
        return self.state.time

    @time.setter
    def time(self, t: float) -> None:
        self.state.set_time(t)

    @property
    def steps(self) -> int:
        """The number of steps that were made."""
        return self.state.steps

    @property
    def deceleration(self) -> float:
        """The deceleration (m/s^2) of a ball that slides, mu_s g."""
        return self.state.surface.pull

    @property
    def count(self) -> int:
        """The number of balls on the table."""
        return len(self.state.ball_of)

    @property
    def joints(self) -> int:
        """The number of friction joints that are in the space now."""
        return self.state.joints

    @property
    def pockets(self) -> dict[int, tuple[Vector, float]]:
        """The centre and the radius (m) of each pocket, by its number."""
        walls = [wall for wall in self.engine.walls if wall.center is not None]
        return {wall.number: wall.sides[0][:2] for wall in walls}  # type: ignore[index]

    @property
    def _inside(self) -> bool:
        """Tell whether the instants of a step are being played."""
        return self.state.phase in (Phase.ANSWERING, Phase.TELLING)

    def on_table(self) -> list[Ball]:
        """Return the balls that are on the table."""
        return self.state.on_table()

    def ball_of(self, shape: pymunk.Shape) -> Ball | None:
        """Return the ball on the table to which a shape belongs, or None."""
        return None if shape.body is None else self.state.ball_of.get(shape.body)

    # -- setting up ------------------------------------------------------------------------------

    def add_ball(self, circle: pymunk.Circle) -> Ball:
        """Make ``circle`` and its body a ball; both join the space if they are not in it.

        In a shared space the ball gets a second circle, its sensor, a little larger than the ball.
        If ``alone``, the circle itself is the sensor. The circle's filter holds for both. Raises
        ValueError for what cannot be a ball: a shape that is no circle in the middle of a dynamic
        body, one that is a ball already, one that overlaps a ball or a wall or lies within a
        pocket.
        """
        checks.check_circle(circle)
        self._catch_up(changes_space=True)
        state, body = self.state, circle.body
        assert body is not None
        if body in state.ball_of:
            raise setting_error("circle", "taken", "this body is a ball already")
        place, number = checks.read_vector("position", body.position), len(state.balls)
        checks.check_place(place, circle.radius, state.discs(), self._walls.obstacles())
        for other in itertools.islice(state.ball_of.values(), 1):
            masses = (other.body.mass, body.mass)
            check_pair(self._said_pair(other.number, number), masses, (other.number, number))
        return state.put_ball(circle)

    def put_ball(self, circle: pymunk.Circle) -> Ball:
        """Do what :meth:`add_ball` does, for a circle of which nothing is wrong, unchecked."""
        return self.state.put_ball(circle)

    def remove_ball(self, ball: Ball) -> None:
        """Take a ball off the table; its body can still be read.

        Its body and shapes leave the space. You may do this from within a callback.
        """
        self._check_ball(ball)
        self.state.drop(ball)

    def clear(self) -> None:
        """Take all balls off the table."""
        for ball in self.on_table():
            self.remove_ball(ball)

    def _check_ball(self, ball: Ball, changes_space: bool = False) -> None:
        own = self.balls
        if not isinstance(ball, Ball) or own[ball.number : ball.number + 1] != [ball]:
            raise setting_error("ball", shown(ball), "must be what add_ball of this table returned")
        if not ball.is_on_table:
            message = "the ball is off the table: add_ball(ball.circle) makes a new one of it"
            raise setting_error("ball", ball.number, message)
        self._catch_up(changes_space)
        if not ball.is_on_table:
            raise setting_error("ball", ball.number, "the ball was taken out of the space")

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
        ValueError for what cannot be a wall, and if a ball lies in it now.
        """
        checks.check_wall(shape)
        if shape in self.near.numbers:
            raise setting_error("shape", "taken", "this shape is a wall already")
        restitution = checks.read_share("restitution", restitution)
        friction = checks.read_from_zero("friction", friction)
        checks.warn_of_lengths(sides or ())
        self._catch_up(changes_space=True)
        wall = Wall(sides or sides_of(shape), restitution, friction, self._walls.count)
        self._walls.refuse_on_balls(shape, wall, has_own_sides=bool(sides))
        return self._walls.put_wall(shape, wall, has_own_sides=bool(sides))

    def put_wall(self, shape: pymunk.Shape, wall: Wall) -> int:
        """Put up a wall with sides of its own, of which nothing is wrong, unchecked."""
        return self._walls.put_wall(shape, wall, has_own_sides=True)

    def remove_wall(self, wall: int) -> None:
        """Take the wall of this number out of the space; the other walls keep their numbers."""
        self._catch_up(changes_space=True)
        if not self._walls.remove(wall):
            raise setting_error("wall", shown(wall), "there is no wall of this number")

    def add_pocket(self, position: Vector, radius: float) -> int:
        """Make a pocket, which takes balls in whose centres come within ``radius`` (m).

        The bodies and shapes of these balls leave the space. Returns the pocket's number. Raises
        ValueError if a ball lies within it now.
        """
        position, radius = (
            checks.read_vector("position", position),
            checks.read_size("radius", radius),
        )
        self._catch_up(changes_space=True)
        return self._walls.put_pocket(position, radius)

    # -- moving balls ----------------------------------------------------------------------------

    def strike(self, ball: Ball, velocity: Vector) -> None:
        """Give a ball a velocity (m/s) now."""
        self._check_ball(ball)
        velocity = checks.read_vector("velocity", velocity)
        checks.check_unchanged(ball, self.engine.masses[ball.number])
        self.state.send(ball, None, velocity)

    def place(self, ball: Ball, position: Vector) -> None:
        """Put a ball to rest at another place (m), such as one of :meth:`free_spot`.

        Raises ValueError if it overlaps a ball or a wall there, or lies within a pocket.
        """
        self._check_ball(ball, changes_space=True)
        position = checks.read_vector("position", position)
        discs = self.state.discs(without=ball)
        checks.check_place(position, ball.radius, discs, self._walls.obstacles())
        self.state.send(ball, position, (0.0, 0.0))

    def set_out(self, balls: Sequence[Ball]) -> None:
        """Predict what balls on new paths meet, and put their bodies on them."""
        self.state.set_out(balls)

    # -- undo, and looking ahead -----------------------------------------------------------------

    def save_state(self) -> TableState:
        """Return where the balls are and how they move, for :meth:`restore_state`."""
        self._catch_up()
        return self.state.saved()

    def restore_state(self, state: TableState) -> None:
        """Put the balls back to where they were, and the clock.

        Balls that have left the table since come back, those that have come since leave it. The
        velocities are the exact ones, so the table goes on as it did. Do this between two steps;
        raises ValueError from within a callback, for a state of another table, and if a wall or a
        pocket is now where a ball was.
        """
        self._steps.refuse_in_step("restore_state")
        if not isinstance(state, TableState):
            raise setting_error("state", shown(state), "must be what save_state of a table gave")
        strangers = [i for i in state.motions if not 0 <= i < len(self.balls)]
        if strangers:
            raise setting_error("state", strangers, "this table has had no balls of these numbers")
        if self.state.is_swept:  # Walls and pockets may have come since.
            for i, (x, y, _, _) in state.motions.items():
                checks.check_place((x, y), self.balls[i].radius, {}, self._walls.obstacles())
        self.state.restore(state)

    def predict(self, ball: Ball, velocity: Vector) -> Prediction[Ball]:
        """Return where a ball and what it meets would go, if it were struck now: the aiming line.

        All balls move on, as they would; nothing else in the space is looked at.
        """
        self._check_ball(ball)
        velocity = checks.read_vector("velocity", velocity)
        numbers = [each.number for each in self.on_table()]
        found = sketch(self.engine, numbers, ball.number, velocity, self.state.now)
        return found._replace(met=None if found.met is None else self.balls[found.met])

    def free_spot(
        self, near: Vector, radius: float | None = None, ball: Ball | None = None
    ) -> Vector:
        """Return the place (m) nearest to ``near`` where a ball overlaps nothing: ball in hand.

        It is for ``ball``, which is not in its own way; or for a new ball of this ``radius`` (m),
        by default that of the first ball. The way from ``near`` crosses no wall; outside of the
        table there is room, too. Raises ValueError if there is none.
        """
        self._catch_up()
        near = checks.read_vector("near", near)
        if ball is not None:
            radius = ball.radius
        elif radius is None and not self.balls:
            raise setting_error("radius", None, "is missing where there is no ball")
        size = self.balls[0].radius if radius is None else checks.read_size("radius", radius)
        discs = list(self.state.discs(without=ball).values())
        found = free_spot(near, size, discs, self._walls.obstacles())
        if found is None:
            raise setting_error("near", list(near), "there is no room for a ball near this place")
        return found

    # -- stepping a space that holds nothing else ------------------------------------------------

    def step(self, dt: float | None = None) -> None:
        """Make one step (s) of a space that holds nothing else, contacts and stops included.

        By default it is as long as the last one, or ``max_dt``. An error from a callback is raised
        here, because pymunk itself only prints it. In a shared space step the space instead.
        """
        if not self.alone:
            raise setting_error("alone", False, "the space is shared: call space.step(dt)")
        self._steps.step(dt)

    def play(
        self, on_time: Callable[[float], object] | None = None, latest: float = math.inf
    ) -> None:
        """Step until everything rests, until ``latest`` (s), or until nothing more may happen.

        ``on_time`` is called now and then with the time (s).
        """
        self._steps.play(on_time, latest)


def _check_settings(space: Any, pair: Any, contacts: Any, friction: Any) -> None:
    """Refuse settings that cannot be."""
    checks.check_space(space)
    checks.check_choice("contacts", contacts, get_args(Contacts))
    checks.check_choice("friction", friction, get_args(FrictionBy))
    if not callable(pair):
        raise setting_error("pair", shown(pair), "must be a function of two balls' numbers")
    if space in _taken:
        raise setting_error("space", "taken", "this space has a Billiards already")


def _no_response(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
    arbiter.process_collision = False
