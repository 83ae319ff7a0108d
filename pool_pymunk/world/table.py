"""This module follows the bodies of a table's balls, and lets them show what the engine plays."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from enum import Enum, auto
from functools import partial
from threading import get_ident

import numpy as np
import pymunk

from pool_pymunk.core import ball as core
from pool_pymunk.core.live import SAME, LiveEngine
from pool_pymunk.core.motion.falling import Falling
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.surface import Sliding, Surface
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.side import OVERLAP
from pool_pymunk.model import Patch
from pool_pymunk.model.problems import SettingError, setting_error
from pool_pymunk.model.scene import ground_of
from pool_pymunk.world.ball import HAIR, Disc, TableBall, TableState
from pool_pymunk.world.bodies import ROW, Bodies, Rows, rows_of
from pool_pymunk.world.checks import check_sound, check_space, is_sound, set_apart
from pool_pymunk.world.ground import check_patches
from pool_pymunk.world.outlook import free_spot
from pool_pymunk.world.walls import Obstacle, Walls

NOTHING = (0.0, 0.0)
NO_THREAD = -1
HOPS = (
    "ball {} hops at {:g} s and will not rest: where friction slows balls, gravity is one push a "
    "step. Without deceleration and rolling balls fall exactly, and rest"
)
PUT_OFF = (
    "ball {}: the position of its body put it off the table; place(ball, position) puts it back, "
    "and refuses a place off the table"
)
SLOW = 5  # gains of a step; what falls freely is not slower for more than twice as many steps
ROLLED = 7.0 / 5.0  # A ball that is to roll at once has to be pushed so many times as hard.


class Phase(Enum):
    """A phase says what is going on, and so which changes of the table are allowed."""

    BETWEEN = auto()  # between two steps
    PLAYING = auto()  # the engine plays, and asks the law and the pair
    TELLING = auto()  # a callback hears of an instant that is over
    STEPPING = auto()  # pymunk steps the space, which is closed to changes


class LiveTable:
    """Only these methods change the balls of a table, and their bodies (m, m/s, s).

    ``written`` has a row for each ball: how its body was last made to show its motion. What differs
    from it was done by others.
    """

    def __init__(self, space: pymunk.Space, engine: LiveEngine, max_dt: float) -> None:
        self.space, self.engine, self.max_dt = space, engine, max_dt
        self.bodies, self.walls = Bodies(space), Walls(space, engine)
        self.patches: dict[int, Patch] = {}
        self.surface: Surface = engine.table.surface
        self.gravity: Vector = NOTHING  # of the space, as far as it is followed
        self.has_warned = False  # of balls that gravity lets hop
        self.slow: dict[TableBall, int] = {}  # For so many steps gravity has made them no faster.
        self.balls: list[TableBall] = []
        self.own: set[pymunk.Body | pymunk.Shape] = set()  # bodies and circles of these balls
        self.widest = 0.0  # m; the largest radius of a ball
        self.ball_of: dict[int, TableBall] = {}  # the balls on the table, by the ids of bodies
        self.written: Rows = np.zeros((0, ROW))
        self.phase = Phase.BETWEEN
        self.began = 0.0  # s; when the present step, or the last one, began
        self.stepped_by = NO_THREAD  # the thread that makes the present step
        self.unsound: set[TableBall] = set()  # Their bodies have numbers that are none.
        self.touched: set[TableBall] = set()  # by others, since the last step

    @property
    def end_of_step(self) -> float:
        """The time (s) at which the present step, or the next one, ends at the latest."""
        return self.engine.now + self.max_dt

    @property
    def slows(self) -> bool:
        """This tells whether anything brings balls to rest: friction, gravity, or the space."""
        surfaces = [self.surface, *self.engine.table.patches.surfaces]
        own = self.space.damping < 1.0 or bool(self.space.constraints)
        return own or any(isinstance(each, Falling) or each.drag > 0.0 for each in surfaces)

    # -- balls come and go -------------------------------------------------------------------------

    def ball_of_circle(self, circle: pymunk.Circle, roll: Vector) -> TableBall:
        """Return a ball made of a circle and its body, with this roll (m/s); it has yet to join."""
        body = circle.body
        assert body is not None
        path = self.surface.path(self.engine.now, body.position, body.velocity, roll)
        own = core.Ball(len(self.balls), circle.radius, body.mass, path)
        return TableBall(circle, own, self.follow)

    def join(self, ball: TableBall, check: Callable[[TableBall], None] | None = None) -> None:
        """Let a new ball join the others, unless the check, which finds it there, refuses it."""
        self.balls.append(ball)
        try:
            if check is not None:
                check(ball)
        except BaseException:
            self.balls.pop()
            raise
        self.widest = max(self.widest, ball.radius)
        self.enter(ball)
        self.engine.add(ball.core)
        self.written.resize((len(self.balls), ROW), refcheck=False)  # It copies no rows, mostly.
        self.written[-1] = *ball.body.position, *ball.body.velocity

    def enter(self, ball: TableBall) -> None:
        """Put a ball into the space; pymunk leaves its pairs with others of the table out."""
        things: tuple[pymunk.Body | pymunk.Shape, ...] = (ball.body, ball.circle, *ball.shapes)
        self.space.add(*[each for each in dict.fromkeys(things) if each.space is None])
        ball.own_filter = own = ball.circle.filter
        set_apart(ball.circle)
        ball.stays = True
        self.ball_of[ball.body_id] = ball
        self.own.update((ball.body, ball.circle))
        self.bodies.come(ball)
        self.engine.choose(ball.core, own.categories, own.mask)
        ball.come()

    @property
    def on_table(self) -> list[TableBall]:
        """The balls that are on the table."""
        return list(self.ball_of.values())

    def is_there(self, ball: TableBall) -> bool:
        """Tell whether a ball is in the space: nobody has taken its body or circle out of it."""
        return ball.body.space is ball.circle.space is self.space

    def drop(self, ball: TableBall) -> None:
        """Take a ball off the table, and its body and shapes out of the space."""
        if not ball.is_on_table:
            return
        if not ball.core.is_off:
            self.engine.take_off(ball.core)
        ball.stays = False
        del self.ball_of[ball.body_id]
        self.own.difference_update((ball.body, ball.circle))
        self.bodies.forget()
        self.unsound.discard(ball)
        body = ball.body
        if body.space in (None, self.space):
            body.position, body.velocity = ball.core.path.place(self.engine.now), NOTHING
        there = [each for each in body.shapes if each.space is self.space]
        ball.shapes = tuple(dict.fromkeys((ball.circle, *there)))
        self.space.remove(*there, *([body] if body.space is self.space else []))
        ball.circle.filter = ball.own_filter

    def take_out(self) -> None:
        """Take the balls out of the space that pockets have taken in."""
        taken, self.engine.taken = self.engine.taken, []
        for one in taken:
            self.drop(self.balls[one.number])

    # -- where balls are ---------------------------------------------------------------------------

    def motion_of(self, ball: TableBall) -> tuple[Motion, Vector]:
        """Return the motion (m, m/s) and the roll (m/s) of a ball now."""
        return self.engine.state_of(ball.core)

    def place_of(self, ball: TableBall) -> Vector:
        """Return the place (m) of a ball now."""
        return self.motion_of(ball)[0][:2]

    def discs(self, without: TableBall | None = None) -> dict[TableBall, Disc]:
        """Return place and radius of each ball, perhaps ``without`` one."""
        balls = self.ball_of.values()
        return {b: (self.place_of(b), b.radius) for b in balls if b is not without}

    def discs_near(self, place: Vector, radius: float) -> dict[TableBall, Disc]:
        """Return place and radius of each ball that a disc may touch."""
        if self.phase is not Phase.BETWEEN:  # Bodies show the beginning of the step.
            return self.discs()
        far = (1.0 + HAIR) * (radius + self.widest)
        along_x, along_y = (abs(self.written[:, k] - place[k]) <= far for k in (0, 1))
        near = np.flatnonzero(along_x & along_y).tolist()
        its = [self.balls[k] for k in near if self.balls[k].is_on_table]
        return {ball: (self.place_of(ball), ball.radius) for ball in its}

    # -- bodies show what balls do -----------------------------------------------------------------

    def show(self) -> None:
        """Let bodies show how balls move now."""
        self.read()
        self.write(rows_of(self.engine.motions()))

    def write(self, motions: Rows) -> None:
        """Let the bodies of all balls show these motions."""
        odd = [(ball.body, ball.body.position, ball.body.velocity) for ball in self.unsound]
        self.bodies.write(motions, self.balls)
        self.written = motions
        self.bodies.see()
        for body, place, velocity in odd:  # They are refused until somebody mends them.
            body.position, body.velocity = place, velocity

    def show_some(self, balls: Iterable[TableBall]) -> None:
        """Let the bodies of some balls show how they move now."""
        for ball in balls:
            if ball.is_on_table:
                motion, _ = self.motion_of(ball)
                self.written[ball.number] = self.bodies.show(ball, motion)

    def send(self, ball: TableBall, place: Vector, velocity: Vector, roll: Vector = SAME) -> None:
        """Set a ball off from a place, with a velocity and a roll; what is ``SAME`` stays."""
        self.engine.send(ball.core, place, velocity, roll)
        if place != SAME:
            ball.body.position = place
            self.space.reindex_shapes_for_body(ball.body)
        self.show()

    # -- what others do to bodies ------------------------------------------------------------------

    def follow(self) -> None:
        """Take what differs from what was last written as new starts."""
        if self.stepped_by not in (NO_THREAD, get_ident()):
            message = "another thread makes a step: call this between steps, under a lock"
            raise setting_error("space", "in a step", message)
        if self.phase in (Phase.STEPPING, Phase.PLAYING):
            return
        if self.space.gravity != self.gravity:
            self._follow_gravity()
        self.read()
        if self.bodies.are_as_seen:
            return
        shown, touched = self.bodies.shown(self.written), list[TableBall]()
        differ = shown != self.written
        if not differ.any():
            self.unsound.clear()
            self.bodies.see()
            return
        moved: dict[TableBall, tuple[Motion, bool, bool]] = {}
        for k in np.flatnonzero(differ.any(axis=1)).tolist():
            ball, (x, y, vx, vy) = self.balls[k], shown[k].tolist()
            if not is_sound(ball, (x, y, vx, vy), self.end_of_step):
                self.unsound.add(ball)
                continue
            is_new = differ[k].tolist()
            moved[ball] = (x, y, vx, vy), is_new[0] or is_new[1], is_new[2] or is_new[3]
            touched.append(ball)
        self._move(moved)
        self.unsound.difference_update(touched)
        self.touched.update(touched)
        if touched:
            self.show()
        if self.phase is Phase.TELLING:  # An error of a callback; the ball goes on without it.
            for ball in tuple(self.unsound):
                self.unsound.discard(ball)
                check_sound(ball, self.end_of_step)

    def _follow_gravity(self) -> None:
        """Let balls fall as the space's gravity says, unless friction slows them."""
        check_space(self.space)
        gx, gy = gravity = self.space.gravity
        if not self.surface.rolls and self.surface.drag == 0.0:
            surface = Sliding(0.0) if gravity == NOTHING else Falling(gx, gy)
            self.change_surface(surface, self.patches)
        self.gravity = gravity

    @property
    def falls(self) -> Vector:
        """The acceleration (m/s^2) at which balls fall; gravity pushes those that slide."""
        surface = self.surface
        return (surface.gx, surface.gy) if isinstance(surface, Falling) else NOTHING

    @property
    def left_out(self) -> dict[str, object]:
        """The gravity and damping of the space that push balls at the end of each step."""
        found = dict[str, object]()
        if self.gravity != self.falls:
            found["gravity"] = list(self.gravity)
        if self.space.damping != 1.0:
            found["damping"] = self.space.damping
        return found

    def _move(self, moved: dict[TableBall, tuple[Motion, bool, bool]]) -> None:
        """Set balls off that others have put elsewhere, or have given another velocity."""
        its = {b: (motion[:2], b.radius) for b, (motion, is_put, _) in moved.items() if is_put}
        discs = self.discs() | its if its else {}
        for ball, ((x, y, vx, vy), is_put, is_pushed) in moved.items():
            place = SAME
            if is_put:
                del discs[ball]
                was = self.place_of(ball)
                place = self._spot_for(ball, (x, y), discs) or was
                discs[ball] = place, ball.radius
                if self.walls.is_off_table(place, [was]):
                    warnings.warn(PUT_OFF.format(ball.name), stacklevel=5)
            self.engine.send(ball.core, place, (vx, vy) if is_pushed else SAME, SAME)

    def _spot_for(
        self, ball: TableBall, place: Vector, discs: dict[TableBall, Disc], most: float = math.inf
    ) -> Vector | None:
        """Return the place for a ball that is nearest to a place in balls or walls (m), if any.

        It is not farther off than ``most``.
        """
        others = list(discs.values())
        solid = [each for each in self.walls.now() if not each.wall.is_pocket]
        try:
            is_off = partial(self.walls.is_off_table, known=[self.place_of(ball)])
            return free_spot(place, ball.radius, others, solid, is_off, most)
        except SettingError:
            return None

    def read(self) -> None:
        """Read the bodies; what somebody has taken out of the space is off the table."""
        if self.bodies.read():
            return
        if not self.own <= {*self.space.bodies, *self.space.shapes}:
            for ball in self.on_table:
                if not self.is_there(ball):
                    self.drop(ball)
        self.walls.drop_lost()
        self.bodies.read()
        self.bodies.know(self.ball_of)

    def refuse_changes(self, turn: int) -> None:
        """Refuse changes that the table cannot follow, before anything moves."""
        if self.unsound or not self.bodies.are_as_seen:  # Some number is none, or very large.
            for ball in self.on_table:
                check_sound(ball, self.end_of_step)
        looked_at: list[TableBall | Obstacle] = [b for b in self.touched if b.is_on_table]
        if self.engine.moving():  # One ball or wall in each step, in turn, as each takes some 4 us.
            its = [*self.ball_of.values(), *self.walls.obstacles]
            looked_at.append(its[turn % len(its)])
        for each in looked_at:
            each.as_it_came.refuse_changed()
        self.touched.clear()

    def mend(self, ball: TableBall) -> None:
        """Take numbers that are not finite off a ball's body, which gets a new place."""
        body = ball.body
        if not all(map(math.isfinite, body.force)):
            body.force = NOTHING
        for key in ("angle", "angular_velocity", "torque"):
            if not math.isfinite(getattr(body, key)):
                setattr(body, key, 0.0)
        self.unsound.discard(ball)

    # -- what others have done in pymunk's step ----------------------------------------------------

    def push(self, gains: Rows, dt: float) -> None:
        """Add what others have changed of velocities (m/s) in a step to those of the balls."""
        for k in np.flatnonzero(gains.any(axis=1)).tolist():
            ball, (_, _, gx, gy) = self.balls[k], gains[k].tolist()
            surface = self.engine.table.surface_of(ball.core.patch)
            holds = min(surface.pull, ROLLED * surface.drag) if surface.rolls else surface.drag
            rests = ball.core.path.end <= self.engine.now
            if rests and math.sqrt(gx * gx + gy * gy) <= holds * dt:
                continue
            check_sound(ball, self.end_of_step)
            self.engine.push(ball.core, (gx, gy))
            if self.gravity != NOTHING and self.falls == NOTHING:
                self._warn_if_it_hops(ball, math.sqrt(gx * gx + gy * gy) - holds * dt)

    def _warn_if_it_hops(self, ball: TableBall, gain: float) -> None:
        """Warn once of a ball that something holds up: it gets no faster by its gains (m/s)."""
        _, _, vx, vy = self.motion_of(ball)[0]
        is_slow = math.sqrt(vx * vx + vy * vy) <= SLOW * gain
        self.slow[ball] = self.slow.get(ball, 0) + 1 if is_slow else 0
        if self.slow[ball] > 4 * SLOW and not self.has_warned:
            self.has_warned = True
            warnings.warn(HOPS.format(ball.number, self.engine.now), stacklevel=7)

    # -- walls that move ---------------------------------------------------------------------------

    def make_room(self) -> None:
        """Keep balls out of walls that have come to lie in them since the last step."""
        now, squeezes = self.engine.now, self.engine.squeezes
        for each, wall in self.walls.moving:
            box = each.shape.cache_bb()
            for ball in self.on_table:
                (x, y), r, far = self.place_of(ball), ball.radius, 2.0 * ball.radius
                is_near = box.left - far < x < box.right + far
                is_near = is_near and box.bottom - far < y < box.top + far
                meets = is_near and not ball.core.ignores(wall.categories, wall.mask)
                if not meets or wall.nearest(x, y, r, now).gap(x, y, r) >= -OVERLAP * r:
                    squeezes.free(ball.core, wall)
                    continue
                most = math.inf if self.walls.is_put(each) else far
                spot = self._spot_for(ball, (x, y), self.discs(without=ball), most)
                if spot is None:
                    self.engine.jam(ball.core, wall)
                else:
                    squeezes.free(ball.core, wall)
                    self.engine.send(ball.core, spot, SAME, SAME)

    def lay(self, table: Table) -> None:
        """Let all happen on another table of the core, before there are walls and balls."""
        self.surface = table.surface
        self.engine.lay(table)

    # -- all balls at once -------------------------------------------------------------------------

    def change_surface(self, surface: Surface, patches: dict[int, Patch]) -> None:
        """Let all balls go on over another surface and other patches from now on."""
        its = tuple(patches.values())
        check_patches(surface, its)
        self.surface, self.patches = surface, patches
        for ball in self.engine.balls:
            if ball.is_off:
                ball.patch = -1  # Its patch may be gone.
        self.engine.change_surface(surface, ground_of(surface, its, gravity=1.0))

    def save(self) -> TableState:
        """Return the time, and how balls move now."""
        states = {ball.number: self.motion_of(ball) for ball in self.on_table}
        motions = {i: motion for i, (motion, _) in states.items()}
        rolls = {i: roll for i, (_, roll) in states.items()} if self.surface.rolls else None
        now, until = self.engine.now, self.engine.bounces_of
        ends = {i: until(self.balls[i].core) for i in states}
        bounces = {i: t - now for i, t in ends.items() if t > now}
        return TableState(now, motions, rolls, bounces or None)

    def restore(self, saved: TableState) -> None:
        """Put the balls back to where they were, and the time."""
        for ball in self.on_table:
            if ball.number not in saved.motions:
                self.drop(ball)
        for ball in (self.balls[number] for number in saved.motions):
            if not ball.is_on_table:
                self.enter(ball)
        rolls = [(saved.rolls or {}).get(number, NOTHING) for number in saved.motions]
        left = saved.bounces or {}
        bounces = [saved.time + left.get(number, -math.inf) for number in saved.motions]
        own = [self.balls[number].core for number in saved.motions]
        self.engine.put_back(saved.time, own, list(saved.motions.values()), rolls, bounces)
        self.unsound.clear()
        self.show()
