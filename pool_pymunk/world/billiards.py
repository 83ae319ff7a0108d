"""This module applies the contact law and surface friction to shapes of any pymunk space.

The engine (:mod:`pool_pymunk.core.live`) keeps each ball's exact path, and answers contacts at the
time inside the step at which they come. pymunk then moves the bodies there, and lets everything
else in the space act. The contract stands at the top of :mod:`pool_pymunk.world`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from difflib import get_close_matches
from functools import partial
from itertools import count
from typing import TYPE_CHECKING

import pymunk

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.live import SAME, LiveEngine
from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.patches import Patches
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.persistent.scale import TOLERANCE
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table as CoreTable
from pool_pymunk.core.walls.moving import MovingWall
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import Law, Pair, law_in_core
from pool_pymunk.model import Scene, State, Table
from pool_pymunk.model.former import Former
from pool_pymunk.model.plain import argument, check_choice, finite, number, point, size
from pool_pymunk.model.problems import listed, setting_error, shown, suggestion
from pool_pymunk.world import checks
from pool_pymunk.world.as_scene import scene_of
from pool_pymunk.world.ball import FROM_ZERO, SHARE, ContactEvent, TableBall, TableState
from pool_pymunk.world.ground import read_patch
from pool_pymunk.world.outlook import Prediction, check_free, check_place, free_spot, sketch
from pool_pymunk.world.steps import Steps
from pool_pymunk.world.table import LiveTable, Phase
from pool_pymunk.world.walls import STILL, Obstacle, pocket_of, sides_of

PairOf = Callable[[int, int], Pair]  # the coefficients of a hit of two balls, by their numbers
CALLBACKS = ("on_contact", "on_stop", "on_pocket", "on_jam")
SETTABLE = ("deceleration", "rolling", "least_closing")
SERVES = {  # what serves instead of names that people try
    "joints": "the engine slows balls down, without joints",
    "dt": "each step has its own, up to max_dt",
    **{name: f"it is space.{name}" for name in ("gravity", "damping", "iterations")},
    **dict.fromkeys(("pair", "law", "contact_tolerance"), "it is given when the table is made"),
    **dict.fromkeys(
        ("restitution", "elasticity", "friction"), "pair says that of balls, add_wall that of walls"
    ),
}
REVOKED = "on_stop_revoked"  # a callback that there was


class Billiards:
    """Billiards is the report's physics for balls and walls of a pymunk space.

    You step the space as always, by ``space.step(dt)``, with any steps up to ``max_dt`` (s).
    ``deceleration`` (m/s^2) is that of surface friction, mu_s g; 0 leaves friction out. With
    ``rolling`` (m/s^2), the deceleration of rolling, balls are spheres that slide until they roll
    (:class:`~pool_pymunk.core.motion.surface.Rolling`). ``pair`` returns the coefficients of a hit
    of two balls, given their numbers (:func:`same_balls`); masses are those of the bodies. ``law``
    is the name of a contact law, or a law of your own (:class:`~pool_pymunk.Law`).

    All other shapes keep pymunk's own response, to each other and to the balls. The table follows
    what you do to a ball's body between steps and in callbacks. What springs, other bodies,
    gravity, damping and forces change of a velocity acts once, at the end of each step. Without
    friction of the surface, gravity of the space is exact: balls fall on parabolas.
    ``contact_tolerance`` (m) is how far it may move a ball that contacts persist. ``friction`` and
    ``alone`` do nothing any more.

    Set ``on_contact(contact)``, ``on_stop(ball, t)``, ``on_pocket(ball, pocket, t)`` and
    ``on_jam(ball, wall, t)`` to hear what happens. They are called when the instant of which they
    tell is over. What they change counts from that instant on; they cannot call
    :meth:`restore_state` or make a step. For a contact that persists, ``on_contact`` is called
    once, when it is over. ``on_jam`` tells that a wall that moves goes into a ball, which has
    nowhere to go.

    Raises ValueError for impossible arguments, in one sentence that names the argument.

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

    A ball that is struck at 0.7 m/s without rotation rolls at 0.5 m/s:

    >>> table = Billiards(
    ...     pymunk.Space(), 1 / 60, deceleration=2.0, rolling=0.1, pair=same_balls(0.9, 0.05)
    ... )
    >>> body = pymunk.Body(0.2, math.inf)
    >>> table.strike(table.add_ball(pymunk.Circle(body, 0.03)), (0.7, 0.0))
    >>> table.play()
    >>> [round(x, 12) for x in body.position]  # 0.06 m of sliding, 1.25 m of rolling
    [1.31, 0.0]
    """

    on_contact: Callable[[ContactEvent], object] | None = None
    on_stop: Callable[[TableBall, float], object] | None = None
    on_pocket: Callable[[TableBall, int, float], object] | None = None
    on_jam: Callable[[TableBall, int, float], object] | None = None

    def __init__(
        self,
        space: pymunk.Space,
        max_dt: float,
        *,
        pair: PairOf,
        law: str | Law = "coulomb",
        deceleration: float = 0.0,
        rolling: float | None = None,
        contact_tolerance: float = TOLERANCE,
        contacts: str | None = None,
        friction: str = "joint",
        alone: bool = False,
    ) -> None:
        checks.check_settings(space, pair)
        checks.refuse_contacts(contacts)
        check_choice("friction", friction, ("joint", "callback"))
        surface = checks.read_surface(deceleration, rolling)
        self.space, self.alone, self._law = space, alone, checks.read_law(law)
        tolerance = argument("contact_tolerance", contact_tolerance, size)
        longest = argument("max_dt", max_dt, size)
        table = OwnPairs(surface, Patches([], []), pair)
        self.engine = LiveEngine(table, law_in_core(self._law), tolerance)
        self.live = LiveTable(space, self.engine, longest)
        table.balls = self.live.balls
        self._has_warned = False  # that predict leaves out what pushes balls
        self._walls, self._steps = self.live.walls, Steps(self.live, self)
        self._patch_numbers = count()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for name in vars(cls):
            _check_name(name, is_own=True)

    if not TYPE_CHECKING:  # Type checkers know all names.

        def __setattr__(self, name: str, value: object) -> None:
            """Set an attribute; refuse one that would do nothing, or that cannot be called."""
            _check_name(name, is_own=hasattr(type(self), name))
            if name in CALLBACKS:
                checks.check_function(name, value)
            super().__setattr__(name, value)

        def __getattr__(self, name: str) -> object:
            """Say what serves instead of what a table does not have."""
            raise _no_such(name)

    def _catch_up(self, changes_space: bool = False, sees_walls: bool = False) -> None:
        """Follow what others have done before this call, or refuse the call."""
        phase = self.live.phase
        if phase is Phase.STEPPING and changes_space:
            message = "pymunk is stepping the space: do this between steps, or from on_contact"
            self._steps.note(error := setting_error("space", "locked", message))
            raise error
        if phase is Phase.PLAYING:
            message = "wait for on_contact: the table cannot be used while a contact is answered"
            raise setting_error("pair", "a change", message)
        if phase is Phase.BETWEEN:
            self._walls.stand()
        self.live.follow()
        if sees_walls:
            self._walls.refuse_changed()

    # -- what there is ---------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Return the time (s) at the end of the last step; in a callback, that of its instant."""
        is_stepping = self.live.phase is Phase.STEPPING  # The last step is the one before it.
        return self.live.began if is_stepping else self.engine.now

    @time.setter
    def time(self, t: float) -> None:
        self._steps.refuse_in_step("time", t)
        self.live.restore(self.live.save()._replace(time=argument("time", t, finite)))

    @property
    def max_dt(self) -> float:
        """Return how long (s) a step may be at most."""
        return self.live.max_dt

    @property
    def steps(self) -> int:
        """Return the number of steps that were made."""
        return self._steps.count

    @property
    def moving(self) -> dict[int, TableBall]:
        """Return the balls that move or have a roll, by their numbers."""
        self.live.follow()
        return {ball.number: self.balls[ball.number] for ball in self.engine.moving()}

    @property
    def deceleration(self) -> float:
        """Return the deceleration (m/s^2) of a ball that slides, mu_s g; you may set it in play."""
        return 0.0 if isinstance(self.live.surface, Falling) else self.live.surface.pull

    @deceleration.setter
    def deceleration(self, pull: float) -> None:
        self._change_surface(pull, self.rolling)

    @property
    def rolling(self) -> float | None:
        """Return the deceleration (m/s^2) of a ball that rolls, mu_r g; None if none rolls.

        You may set it in play, as when ice is swept: all balls go on over the other surface.
        """
        return self.live.surface.drag if self.live.surface.rolls else None

    @rolling.setter
    def rolling(self, drag: float | None) -> None:
        self._change_surface(self.deceleration, drag)

    def _change_surface(self, pull: float, drag: float | None) -> None:
        """Let balls slide and roll at other decelerations (m/s^2) from now on."""
        surface = checks.read_surface(pull, drag)
        self._catch_up(changes_space=True)
        self.live.change_surface(surface, self.live.patches)
        self.live.gravity = STILL  # It is followed anew.
        self.live.follow()

    @property
    def least_closing(self) -> float:
        """Return the speed (m/s), 0 at first, below which ``on_contact`` is not called for a hit.

        With a speed above 0 it is not called for persistent contacts, either.
        """
        return self._steps.least_closing

    @least_closing.setter
    def least_closing(self, speed: float) -> None:
        self._steps.least_closing = argument("least_closing", speed, FROM_ZERO)

    @property
    def balls(self) -> list[TableBall]:
        """Return all balls that were ever added, by their numbers."""
        return self.live.balls

    @property
    def count(self) -> int:
        """Return the number of balls on the table."""
        return len(self.on_table)

    @property
    def walls(self) -> dict[int, pymunk.Shape]:
        """Return the shape of each wall, by its number."""
        return {each.wall.number: each.shape for each in self._walls.solid}

    @property
    def pockets(self) -> dict[int, tuple[Vector, float]]:
        """Return the centre and the radius (m) of each pocket, by its number."""
        return self._walls.pockets

    @property
    def on_table(self) -> OnTable:
        """Return the balls that are on the table, in a list."""
        return OnTable(ball for ball in self.live.on_table if self.live.is_there(ball))

    def ball_of(self, shape: pymunk.Shape) -> TableBall | None:
        """Return the ball on the table to which a shape belongs, or None."""
        ball = None if shape.body is None else self.live.ball_of.get(shape.body.id)
        return ball if ball is not None and self.live.is_there(ball) else None

    # -- setting up ------------------------------------------------------------------------------

    def add_ball(self, circle: pymunk.Circle, id: str | None = None) -> TableBall:  # noqa: A002
        """Make ``circle`` and its body a ball; both join the space if they are not in it.

        ``id`` is your own name of the ball, such as "8".

        Raises ValueError if ``circle`` is no circle in the middle of a dynamic body, is a ball
        already, overlaps a ball or a wall, or lies within a pocket or outside of the table, if its
        filter has a group, and if another ball on the table has this id. A table has an outside if
        all its balls lie within segments that stand and share their ends.
        """
        self._catch_up(changes_space=True, sees_walls=True)
        live = self.live
        checks.check_circle(circle, live.end_of_step, self.space)
        body = circle.body  # A circle does not keep its body alive.
        assert body is not None
        if body.id in live.ball_of:
            raise setting_error("circle", "taken", "this body is a ball already")
        place = argument("position", body.position, point)
        near = live.discs_near(place, circle.radius)
        check_place(place, circle.radius, near, self._walls.now())
        self._walls.refuse_outside(place, (live.place_of(b) for b in self.balls if b.is_on_table))
        checks.check_id(id, live.ball_of.values())
        ball = live.ball_of_circle(circle, STILL)
        ball.id = id
        live.join(ball, self._check_pair)
        return ball

    def _check_pair(self, ball: TableBall) -> None:
        """Refuse what ``pair`` says of a new ball and one that is there, if it is no pair."""
        if (other := next(iter(self.live.ball_of.values()), None)) is not None:
            two, table = (other.number, ball.number), self.engine.table
            assert isinstance(table, OwnPairs)
            checks.check_pair(table.said(*two), (other.body.mass, ball.body.mass), two)

    def put_ball(self, circle: pymunk.Circle, roll: Vector = STILL) -> TableBall:
        """Do what :meth:`add_ball` does, with a roll (m/s), and check nothing."""
        ball = self.live.ball_of_circle(circle, roll)
        self.live.join(ball)
        return ball

    def remove_ball(self, ball: TableBall) -> None:
        """Take a ball off the table, and its body and shapes out of the space."""
        if self.live.phase is Phase.STEPPING:
            self._steps.do_later(partial(self.remove_ball, ball))
            return
        self._check_ball(ball)
        self.live.drop(ball)

    def clear(self) -> None:
        """Take all balls off the table."""
        self._catch_up(changes_space=True)
        for ball in self.on_table:
            self.live.drop(ball)

    def _check_ball(
        self, ball: TableBall, changes_space: bool = False, may_be_off: bool = False
    ) -> None:
        own = self.balls
        if not isinstance(ball, TableBall) or own[ball.number : ball.number + 1] != [ball]:
            raise setting_error("ball", shown(ball), "must be what add_ball of this table returned")
        was_on_table = ball.is_on_table
        if not (was_on_table or may_be_off):
            message = "the ball is off the table: place(ball, position) puts it back"
            raise setting_error("ball", ball.name, message)
        self._catch_up(changes_space)
        if was_on_table and not ball.is_on_table:
            raise setting_error("ball", ball.name, "the ball was taken out of the space")

    def add_wall(
        self,
        shape: pymunk.Shape,
        restitution: float,
        friction: float = 0.0,
        sides: tuple[Side, ...] | None = None,
        *,
        kick: float = 0.0,
    ) -> int:
        """Make a segment, circle or polygon a wall that balls bounce off (Eq. 9).

        If its body is static, the wall stands. If it is kinematic, the wall moves as the body does:
        in each step with the velocity and the angular velocity that you gave it.

        A bumper has a ``kick`` (m/s). After the law's answer to a hit, this is added to the ball's
        velocity along the normal, so energy may grow.

        Balls meet all sides of the shape, or only the ``sides`` that you give
        (:class:`~pool_pymunk.core.walls.side.Side`), such as a concave arc. The shape then only
        says where your sides are, and may be a sensor; sides of your own stand. Returns the wall's
        number. Raises ValueError for a shape that cannot be a wall, and if a ball lies in the wall
        now.
        """
        self._catch_up(changes_space=True)
        drawn = checks.check_wall(shape, self.space, bool(sides))
        restitution = argument("restitution", restitution, SHARE)
        friction = argument("friction", friction, FROM_ZERO)
        kick = argument("kick", kick, FROM_ZERO)
        for side in sides or ():
            if not isinstance(side, Side):
                message = "a side of your own is a subclass of Side, with its time_of_contact"
                raise setting_error("sides", shown(side), message)
        assert drawn.body is not None
        self._walls.refuse_moved(drawn.body)
        moves = drawn.body.body_type == pymunk.Body.KINEMATIC
        if moves and sides is not None:
            message = "a wall that moves has the sides of its shape: leave sides out"
            raise setting_error("sides", len(sides), message)
        own = list(sides) if sides else sides_of(drawn)
        kind = MovingWall if moves else Wall
        wall = kind(own, restitution, friction, self._walls.count, kick)
        return self._put_if_free(Obstacle(drawn, wall, is_drawn=not sides))

    def put_wall(self, shape: checks.Drawn, wall: Wall) -> int:
        """Put up a wall with sides of its own, and check nothing."""
        return self._walls.put(Obstacle(shape, wall))

    def _put_if_free(self, obstacle: Obstacle) -> int:
        """Put up a wall or a pocket if no ball lies in it now, and return its number."""
        obstacle.shape.cache_bb()  # A shape outside of the space does not know where it is.
        check_free(obstacle, self.live.discs())
        return self._walls.put(obstacle)

    def remove_wall(self, wall: int) -> None:
        """Take the wall of this number out of the space; the other walls keep their numbers."""
        self._catch_up(changes_space=True)
        self._walls.remove(wall)

    def add_pocket(self, position: Vector, radius: float) -> int:
        """Make a pocket, which takes in balls whose centres come within ``radius`` (m).

        They leave the space. Returns the pocket's number. Raises ValueError if a ball lies in it.
        """
        center, radius = argument("position", position, point), argument("radius", radius, size)
        self._catch_up(changes_space=True)
        return self._put_if_free(pocket_of(self.space, center, radius, self._walls.holes))

    def remove_pocket(self, pocket: int) -> None:
        """Take the pocket of this number away; the other pockets keep their numbers."""
        self._catch_up(changes_space=True)
        self._walls.remove(pocket, is_pocket=True)

    # -- moving balls ----------------------------------------------------------------------------

    def strike(self, ball: TableBall, velocity: Vector, roll: float = 0.0) -> None:
        """Give a ball a velocity (m/s) now, and where balls roll a ``roll``, a share of it.

        With 1 the ball rolls at once, with 0 it slides without rotation, below 0 it has draw.
        """
        if self.live.phase is Phase.STEPPING:
            self._steps.do_later(partial(self.strike, ball, velocity, roll))
            return
        self._check_ball(ball)
        goes, turns = checks.read_strike(velocity, roll, self.live.surface)
        checks.check_speed("velocity", goes, ball.radius, self.live.end_of_step)
        self.live.touched.add(ball)  # If this refuses it, so does each step.
        ball.as_it_came.refuse_changed()
        self.live.mend(ball)
        self.live.send(ball, SAME, goes, turns)

    def place(self, ball: TableBall, position: Vector) -> None:
        """Put a ball to rest at another place (m), such as one of :meth:`free_spot`.

        A ball that was pocketed or removed comes back, with its number and its id. Raises
        ValueError if the ball overlaps a ball or a wall there, or lies within a pocket, or outside
        of the table in which it lies now; and if a ball that comes back is another ball by now.
        """
        self._check_ball(ball, changes_space=True, may_be_off=True)
        self._walls.refuse_changed()
        position = argument("position", position, point)
        live = self.live
        check_place(position, ball.radius, live.discs(without=ball), self._walls.now())
        if ball.is_on_table:
            self._walls.refuse_off_table(position, live.place_of(ball))
        else:
            checks.check_return(ball, live.ball_of, self.space)
            self._walls.refuse_outside(position, map(live.place_of, live.on_table))
            live.enter(ball)
        live.mend(ball)
        live.send(ball, position, (0.0, 0.0), STILL)

    def add_patch(
        self, shape: pymunk.Shape, deceleration: float, rolling: float | None = None
    ) -> int:
        """Give the region of a static circle or polygon other friction, such as that of sand.

        Balls whose centres are in it lose speed at ``deceleration`` (m/s^2) where they slide, and
        at ``rolling`` where they roll, by default at the table's. The last patch that holds a ball
        wins. The shape only says where the patch is: it does not come to the space, and may be
        forgotten. Returns the patch's number. Raises ValueError for what cannot be a patch.
        """
        self._catch_up(changes_space=True)
        number = next(self._patch_numbers)
        patches = self.live.patches | {number: read_patch(shape, deceleration, rolling)}
        self.live.change_surface(self.live.surface, patches)
        return number

    def remove_patch(self, patch: int) -> None:
        """Take the patch of this number away; the other patches keep their numbers."""
        self._catch_up(changes_space=True)
        if patch not in self.live.patches:
            raise setting_error("patch", shown(patch), "there is no patch of this number")
        patches = {k: each for k, each in self.live.patches.items() if k != patch}
        self.live.change_surface(self.live.surface, patches)

    @property
    def patches(self) -> dict[int, tuple[tuple[Vector, ...], Vector | None, float | None]]:
        """Return corners, centre and radius (m) of each patch, by its number.

        A polygon has neither centre nor radius (None), and a circle has no corners.
        """
        return {k: (p.corners, p.center, p.radius) for k, p in self.live.patches.items()}

    def to_scene(self, table: Table | None = None) -> tuple[Scene, State]:
        """Return the table as a Scene and a State, as solvers and many shots take them.

        So an opponent tries thousands of shots at once. Balls have their ids, or their numbers.
        Walls that are segments become the ``table``'s cushions, round ones posts; if the segments
        are no single outline, give the table. A ball whose id is "cue" is the cue ball. Gravity is
        1 m/s^2, so that coefficients of surface friction are decelerations. Raises ValueError for
        what a scene cannot have, such as walls with several coefficients, and balls with springs.
        Other bodies of the space are left out.

        >>> from pool_pymunk import same_balls, simulate_many
        >>> live = Billiards(pymunk.Space(), 1 / 60, deceleration=1.0, pair=same_balls(0.9, 0.0))
        >>> body = pymunk.Body(0.2, math.inf)
        >>> ball = live.add_ball(pymunk.Circle(body, 0.03), id="cue")
        >>> scene, state = live.to_scene()
        >>> tries = simulate_many(scene, state.position, [[(v, 0.0)] for v in (1.0, 2.0)])
        >>> tries.final[:, 0].tolist()
        [[0.5, 0.0], [2.0, 0.0]]
        """
        self._catch_up(sees_walls=True)
        return scene_of(self.live, self._law, table)

    # -- undo, and looking ahead -----------------------------------------------------------------

    def save_state(self) -> TableState:
        """Return where the balls are and how they move, for :meth:`restore_state`.

        Bodies of walls that move are yours: keep their places yourself.
        """
        self._catch_up()
        return self.live.save()

    def restore_state(self, state: TableState) -> None:
        """Put the balls and the clock back to a saved state.

        Balls that have left the table since come back, those that have come since leave it, and
        the table goes on as it did: to rounding, and while balls stay in contact
        to within ``contact_tolerance``. Raises ValueError from within a callback, for a
        state of another table, and if a wall or a pocket is now where a ball was.
        """
        self._steps.refuse_in_step("restore_state")
        self._catch_up()
        if not isinstance(state, TableState):
            message = "must be what save_state of a table gave"
            if isinstance(state, str):
                message += ": TableState.from_json makes it of its JSON"
            raise setting_error("state", shown(state), message)
        strangers = [i for i in state.motions if not 0 <= i < len(self.balls)]
        if strangers:
            raise setting_error("state", strangers, "this table has had no balls of these numbers")
        for i, (x, y, vx, vy) in state.motions.items():  # Walls and pockets may have come since.
            check_place((x, y), self.balls[i].radius, {}, self._walls.now())
            key = f"state: velocity of ball {self.balls[i].name}"
            checks.check_speed(key, (vx, vy), self.balls[i].radius, state.time + self.max_dt)
        self.live.restore(state)

    def predict(self, ball: TableBall, velocity: Vector, roll: float = 0.0) -> Prediction:
        """Return where a ball and what it meets would go, if it were struck now: the aiming line.

        Only the table's balls, walls and pockets count. Walls that move stand where they are.
        Damping of the space, and gravity where friction slows balls, are left out, with a warning.
        """
        self._check_ball(ball)
        self._walls.refuse_changed()
        going = checks.read_strike(velocity, roll, self.live.surface)
        if self.live.left_out and not self._has_warned:
            self._has_warned = True
            said = " and ".join(self.live.left_out)
            warnings.warn(f"predict leaves out the {said} of the space", stacklevel=2)
        own = self.engine.table
        assert isinstance(own, OwnPairs)
        engine = self.engine.copy(own.copy(), Recorder())
        return sketch(engine, self.balls, ball.number, going)

    def free_spot(
        self, near: Vector, radius: float | None = None, ball: TableBall | None = None
    ) -> Vector:
        """Return the place (m) nearest to ``near`` where a ball overlaps nothing: ball in hand.

        The place is for ``ball``, which does not block itself, or for a new ball of this ``radius``
        (m), by default that of the first ball. The line from ``near`` to the place crosses no wall.
        The place may be off the table only if ``near`` is. Raises ValueError if there is no place.
        """
        self._catch_up(sees_walls=True)
        near = argument("near", near, point)
        if ball is not None:
            radius = ball.radius
        elif radius is None and not self.balls:
            raise setting_error("radius", None, "is missing where there is no ball")
        wide = self.balls[0].radius if radius is None else argument("radius", radius, size)
        known = [ball] if ball is not None and ball.is_on_table else self.on_table
        return free_spot(
            near,
            wide,
            self.live.discs(without=ball).values(),
            self._walls.now(),
            partial(self._walls.is_off_table, known=[*map(self.live.place_of, known)]),
        )

    # -- steps -----------------------------------------------------------------------------------

    def step(self, dt: float | None = None) -> None:
        """Make one step of the space, of ``dt`` (s) or by default of ``max_dt``."""
        self.space.step(self.max_dt if dt is None else dt)

    def play(
        self, on_time: Callable[[float], object] | None = None, latest: float = math.inf
    ) -> None:
        """Step until everything rests, until ``latest`` (s), or until nothing more may happen.

        ``on_time`` is called after each step with the time (s). A wall that moves counts if there
        is a latest time: while it moves, not everything rests. Between walls, where nothing slows
        balls, there must be one; ValueError says so.
        """
        checks.check_function("on_time", on_time)
        self._steps.play(on_time, argument("latest", latest, number))


class OnTable(Former, list[TableBall]):
    """These are balls in a list."""

    name = "on_table"


class OwnPairs(CoreTable):
    """This is a table of the core whose pairs a user's function gives.

    It is asked once for two balls while the engine plays on, until a callback or the next step.
    """

    def __init__(self, surface: Surface, patches: Patches, said: PairOf) -> None:
        super().__init__([], surface, patches, 0.0, 0.0, 0.0)
        self.said = said
        self.balls: list[TableBall] = []
        self.known: dict[tuple[int, int], CorePair] = {}

    def copy(self) -> OwnPairs:
        """Return the same table without walls."""
        other = OwnPairs(self.surface, self.patches, self.said)
        other.balls = self.balls
        return other

    def pair(self, a: Ball, b: Ball) -> CorePair:
        two = a.number, b.number
        known = self.known.get(two)
        if known is None:
            for i in two:
                self.balls[i].in_hits.refuse_changed()
            _, _, e, mu = checks.check_pair(self.said(*two), (a.mass, b.mass), two)
            known = self.known[two] = CorePair(a.mass, b.mass, e, mu)
        return known

    def forget(self) -> None:
        self.known.clear()


def _no_such(name: str) -> AttributeError:
    """Make the error of a name that a table does not have."""
    serves, former = SERVES.get(name, ""), " any more" * (name == "joints")
    return AttributeError(f"a Billiards has no {name}{former}{serves and ': '}{serves}")


def _check_name(name: str, is_own: bool) -> None:
    """Refuse names that do nothing, or are like a callback's; a subclass may have ``own`` ones."""
    if name in SERVES and not is_own:
        raise _no_such(name)
    if name == REVOKED:
        message = f"{REVOKED} does nothing: a ball of which on_stop tells has come to rest"
        warnings.warn(message, DeprecationWarning, stacklevel=3)
        return
    if not is_own and name not in SETTABLE and get_close_matches(name, SETTABLE, cutoff=0.8):
        raise AttributeError(f"a Billiards has no {name}{suggestion(name, SETTABLE)}")
    is_alike = bool(get_close_matches(name.lower(), CALLBACKS, cutoff=0.8))
    is_misspelled = is_alike if is_own else is_alike or name.startswith("on_")
    if is_misspelled and name.lower().startswith("on") and name not in CALLBACKS:
        there = (
            suggestion(name.lower(), CALLBACKS) if is_alike else f"; it calls {listed(CALLBACKS)}"
        )
        raise AttributeError(f"a Billiards has no {name}{there}")
