"""This module owns the state of a table: its clock, its balls, their paths and their bodies.

A step of pymunk moves positions first and changes velocities last. Between steps a body therefore
carries the mean velocity of its path over the coming step, which makes positions exact.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from enum import Enum, auto

import pymunk

from pool_pymunk.engine.contacts import ContactEngine
from pool_pymunk.engine.due import What
from pool_pymunk.engine.recorder import Motion
from pool_pymunk.model.places import lies_in
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.surface import NO_ROLL, Surface, is_piece
from pool_pymunk.world.ball import HAIR, Disc, TableBall, TableState
from pool_pymunk.world.bodies import Bodies, Four
from pool_pymunk.world.broad_phase import BroadPhase
from pool_pymunk.world.checks import BALL, SENSOR, check_unchanged
from pool_pymunk.world.ground import LivePatch, ground_of

NOTHING = (0.0, 0.0)
EVERYTHING = pymunk.ShapeFilter()  # It leaves out what collides with nothing.

Given = Vector | None


class Phase(Enum):
    """A phase says what is going on, and so which changes of the table are allowed."""

    BETWEEN = auto()  # between two steps
    STEPPING = auto()  # pymunk steps the space, which is closed to changes
    ANSWERING = auto()  # the engine answers an instant, and asks the law and the pair
    TELLING = auto()  # a callback hears of an instant that is over


class LiveState:
    """Only these methods change the state of a table (m, m/s, s)."""

    alone = True  # Nothing else is in the space.

    def __init__(
        self, engine: ContactEngine, near: BroadPhase, max_dt: float, joints: bool
    ) -> None:
        self.space, self.engine, self.near = near.space, engine, near
        self.bodies = Bodies(near.space, self.alone)
        self.surface = engine.surface
        self.patches: tuple[LivePatch, ...] = ()
        self.max_dt = self.dt = max_dt
        self.has_joints = joints  # friction by joints, not by callbacks
        self.phase = Phase.BETWEEN
        self.time = 0.0
        self.latest = math.inf  # the time to stop at, in the middle of a step if need be
        self.steps = 0
        # the time (s) since which steps have their present length, and the steps since then
        self.since, self.count = 0.0, 0
        self.next_stop = math.inf
        self.wake = -math.inf  # when something is to be done; earlier steps need no answer
        self.balls: list[TableBall] = []
        self.moving: dict[int, TableBall] = {}
        self.damped: set[int] = set()  # the balls that move and are slowed by callbacks
        self.ball_of: dict[int, TableBall] = {}  # the balls on the table, by the ids of bodies
        self.sent: list[int] = []  # balls that were sent off while pymunk was stepping
        # In the present step the table has set these positions and velocities of bodies, and has
        # sent these balls off. So what others did to them in this step does not count.
        self.carried: dict[TableBall, tuple[float, ...]] = {}
        self.sent_off: set[TableBall] = set()
        # These balls have moved since the table last looked for changes by others.
        self.stirred: set[TableBall] = set()
        self.joined: list[pymunk.Body | pymunk.Shape] = []  # what has come to the table since
        self.error: Exception | None = None

    # -- the clock -------------------------------------------------------------------------------

    @property
    def now(self) -> float:
        """The time (s); while a step is answered, it is that of the present instant."""
        is_inside = self.phase in (Phase.ANSWERING, Phase.TELLING)
        return self.engine.now if is_inside else self.time

    def set_clock(self, t: float, dt: float) -> None:
        """Set the clock, and how long steps are from now on."""
        self.time = self.since = t
        self.count, self.dt = 0, dt

    def tick(self, steps: int = 1) -> None:
        """Count steps that pymunk has made."""
        self.steps += steps
        self.count += steps
        t = self.since + self.count * self.dt
        self.time = t if t < self.latest else self.latest

    def end_of_step(self) -> float:
        """Return the time (s) at the end of the step that begins now."""
        return self.since + (self.count + 1) * self.dt

    def begin_step(self) -> None:
        """Note that pymunk is going to step the space."""
        self.phase = Phase.STEPPING
        self.carried.clear()
        self.sent_off.clear()
        self.stirred.update(self.moving.values())

    def note(self, error: Exception) -> None:
        """Keep an error until the step's end, because pymunk only prints what a callback raises."""
        self.error = self.error or error
        self.wake = -math.inf

    def raise_noted(self) -> None:
        """Raise the first error of this step, if there was one."""
        if self.error is not None:
            error, self.error = self.error, None
            raise error

    # -- balls come and go -----------------------------------------------------------------------

    def put_ball(self, circle: pymunk.Circle, roll: Vector) -> TableBall:
        """Make a circle and its body a ball with this roll (m/s), unchecked."""
        body, radius = circle.body, circle.radius
        assert body is not None
        self.join(body, circle)
        sensor = circle
        if not self.alone:
            sensor = pymunk.Circle(body, radius)
            sensor.sensor = True
            sensor.color = (0, 0, 0, 0)
        (x, y), (vx, vy) = body.position, body.velocity
        path = self.engine.path_at(len(self.balls), self.now, (x, y), (vx, vy), roll)
        number = self.engine.add_ball(path, radius, body.mass)
        ball = TableBall(number, circle, sensor, self.path_of)
        self.balls.append(ball)
        self.near.sensors.append(sensor)
        self._enter(ball)
        ball.as_it_came = ball.features()
        if path.moves or self.phase is not Phase.BETWEEN:
            self.set_out([ball])
        return ball

    def _enter(self, ball: TableBall) -> None:
        """Put a ball's sensor into the space, and mark its circle as a ball's."""
        if not self.alone:
            ball.circle.collision_type = BALL
            ball.sensor.filter = ball.circle.filter
            ball.sensor.body = ball.body
            self.join(ball.sensor)
        ball.sensor.collision_type = SENSOR
        self.near.numbers[ball.sensor] = ball.number
        self.ball_of[ball.body_id] = ball
        ball.is_on_table = True

    def join(self, *things: pymunk.Body | pymunk.Shape) -> None:
        """Put what is not in the space into it, and note that all of it is the table's now."""
        self.joined += things
        self.space.add(*[thing for thing in things if thing.space is None])

    def take_out(self, *things: pymunk.Body | pymunk.Shape) -> None:
        """Take what is in the space out of it."""
        self.space.remove(*[thing for thing in things if thing.space is self.space])

    def on_table(self) -> list[TableBall]:
        """Return the balls that are on the table."""
        return list(self.ball_of.values())

    def is_there(self, ball: TableBall) -> bool:
        """Tell whether a ball is in the space: nobody has taken its body or circle out of it."""
        return ball.body.space is ball.circle.space is self.space

    def drop(self, ball: TableBall) -> None:
        """Take a ball off the table now, unless it is off it already."""
        if ball.is_on_table:
            self.engine.now = self.now
            self.engine.remove(ball.number)
            self.take_out_gone()
            self.set_out(())

    def bring_back(self, ball: TableBall) -> None:
        """Put the body and the shapes of a ball that has left the table into the space again."""
        self.join(ball.body, *ball.shapes)
        self._enter(ball)

    def change_surface(self, surface: Surface, patches: Sequence[LivePatch]) -> None:
        """Let all balls go on over another surface and other patches from now on."""
        ground = ground_of(surface, patches)
        self.engine.take_over()
        now = {ball.number: self.state_of(ball.number) for ball in self.on_table()}
        for ball in list(self.moving.values()):
            self._rest(ball)
            ball.joint = None  # It pulls as the surface does.
        self.surface, self.patches = surface, tuple(patches)
        self.engine.lay(surface, ground)
        rolls = {i: roll for i, (_, roll) in now.items()} if surface.rolls else None
        self.predict_anew({i: motion for i, (motion, _) in now.items()}, rolls)

    def take_out_gone(self) -> None:
        """Take the bodies and shapes of balls that have left the table out of the space."""
        while self.near.gone:
            ball = self.balls[self.near.gone.pop(0)]
            self._rest(ball)
            ball.is_on_table = False
            path = self.engine.paths[ball.number]
            if ball.body.space in (None, self.space):
                ball.body.position = path.x, path.y
            ball.circle.collision_type = 0
            del self.ball_of[ball.body_id]
            there = [each for each in ball.body.shapes if each.space is self.space]
            self.take_out(ball.body, *there)
            if not self.alone and ball.sensor.space is None:
                ball.sensor.body = None  # Its body may come back as another ball.
            shapes = dict.fromkeys((ball.circle, *there))
            ball.shapes = tuple([each for each in shapes if self.alone or each is not ball.sensor])

    def path_of(self, i: int) -> Path:
        """Return the exact path of ball ``i``."""
        return self.engine.paths[i]

    def discs(self, without: TableBall | None = None) -> dict[TableBall, Disc]:
        """Return position and radius of each ball, perhaps ``without`` one."""
        return self._discs(ball for ball in self.ball_of.values() if ball is not without)

    def discs_near(self, place: Vector, radius: float) -> dict[TableBall, Disc]:
        """Return position and radius of each ball that a disc may touch."""
        (x, y), balls, numbers = place, self.balls, self.near.numbers
        around = pymunk.BB(x - radius, y - radius, x + radius, y + radius)
        found = [numbers.get(shape, -1) for shape in self.space.bb_query(around, EVERYTHING)]
        # pymunk sorts shapes in anew in a step only, and these may have been moved since.
        others = dict.fromkeys((*(balls[i] for i in found if i >= 0), *self.moving.values()))
        return self._discs(each for each in (*others, *self.carried) if each.is_on_table)

    def _discs(self, balls: Iterable[TableBall]) -> dict[TableBall, Disc]:
        now, paths = self.now, self.engine.paths
        return {b: (motion_at(paths[b.number], now)[:2], b.radius) for b in balls}

    # -- balls on new paths ----------------------------------------------------------------------

    def state_of(self, i: int) -> tuple[Motion, Vector]:
        """Return the motion (m, m/s) and the roll (m/s) of ball ``i`` now."""
        self.engine.now = self.now
        x, y, vx, vy, wx, wy = self.engine.state_of(i)
        return (x, y, vx, vy), (wx, wy)

    def begin_path(
        self, ball: TableBall, position: Vector, velocity: Vector, roll: Given = None
    ) -> None:
        """Give a ball a new path, by default with its roll; what it meets is not predicted yet."""
        now = self.engine.now = self.now
        roll = self.state_of(ball.number)[1] if roll is None else roll
        path = self.engine.path_at(ball.number, now, position, velocity, roll)
        self.engine.set_off(ball.number, path)
        if not path.moves:
            self.engine.rested[ball.number] = now

    def drop_in(self, ball: TableBall) -> None:
        """Let a pocket take a ball in that somebody has put into it, at once."""
        place, _ = self.engine.paths[ball.number].at(self.now)
        for k, wall in enumerate(self.engine.walls):
            if wall.is_pocket and lies_in(wall, wall.sides[0].gap(*place, 0.0), *place, 0.0):
                self.engine.push(self.now, What("wall", ball.number, k))
                self.wake = -math.inf

    def send(self, ball: TableBall, position: Given, velocity: Given, roll: Given = None) -> None:
        """Set a ball off from a position, with a velocity and a roll; by default with its own."""
        (x, y, vx, vy), _ = self.state_of(ball.number)
        self.begin_path(ball, position or (x, y), velocity or (vx, vy), roll)
        if position is not None:
            self.carry(ball)
            self._move_sensor(ball)
        self.set_out([ball])
        self.drop_in(ball)

    def set_out(self, balls: Collection[TableBall]) -> None:
        """Predict what balls on new paths meet, and put their bodies on these paths.

        The balls of groups that came apart go on by themselves.
        """
        self.sent_off.update(balls)
        loose = [self.balls[i] for i in self.engine.loose()]
        for ball in dict.fromkeys((*balls, *loose)):
            self.carry(ball)
        numbers = [ball.number for ball in (*balls, *loose)]
        if self.phase is Phase.STEPPING:
            self.sent += numbers  # The answer to this step predicts it.
        elif numbers:
            self.engine.predict(numbers)
        self.wake = -math.inf

    def predict_anew(
        self, motions: Mapping[int, Motion] | None = None, rolls: Mapping[int, Vector] | None = None
    ) -> None:
        """Put all balls on their paths, or give them ``motions``, and predict contacts anew."""
        if self.phase is Phase.BETWEEN:
            self.near.until = self.engine.now = self.time
        now, engine = self.now, self.engine
        for i in (numbers := [ball.number for ball in self.ball_of.values()]):
            (x, y, vx, vy), roll = self.state_of(i)
            if motions:
                (x, y, vx, vy), roll = motions[i], (rolls or {}).get(i, NO_ROLL)
            path = self.engine.path_at(i, now, (x, y), (vx, vy), roll)
            if motions:
                engine.rested[i] = -math.inf
            if motions or path.moves:
                engine.set_off(i, path)
            self.carry(self.balls[i])
            self._move_sensor(self.balls[i])
        if numbers:
            engine.predict(numbers)
        self.wake = -math.inf

    def _move_sensor(self, ball: TableBall) -> None:
        """Let pymunk report anew what a ball's sensor touches, because the ball lies elsewhere."""
        self.space.remove(ball.sensor)
        self.space.add(ball.sensor)
        self.space.reindex_shapes_for_body(ball.body)

    def mend(self, ball: TableBall) -> None:
        """Take numbers that are not finite off a ball's body, which gets a new place."""
        body = ball.body
        if not all(map(math.isfinite, body.force)):
            body.force = NOTHING
        for key in ("angle", "angular_velocity", "torque"):
            if not math.isfinite(getattr(body, key)):
                setattr(body, key, 0.0)

    def restore(self, saved: TableState) -> None:
        """Put the balls back to where they were, and the clock."""
        for ball in self.on_table():
            if ball.number not in saved.motions:
                self.drop(ball)
        self.set_clock(saved.time, self.dt)
        self.engine.turn_back(self.time)
        self.sent.clear()
        for ball in (self.balls[number] for number in saved.motions):
            if not ball.is_on_table:
                self.bring_back(ball)
        self.predict_anew(saved.motions, saved.rolls)

    # -- bodies on their paths -------------------------------------------------------------------

    def mean_velocity(self, surface: Surface, path: Path, t: float) -> Vector:
        """Return the velocity that takes a body along its path from ``t`` to ``t + dt``."""
        _, _, vx, vy = motion_at(path, t)
        return self.mean_of(surface, path, path.end - t, vx, vy)

    def mean_of(self, surface: Surface, path: Path, rest: float, vx: float, vy: float) -> Vector:
        """Return the mean velocity over a step of a ball whose path ends in ``rest`` s."""
        dt = self.dt
        if rest > dt or (rest > 0.0 and is_piece(path)):
            return vx + dt * path.ax / 2.0, vy + dt * path.ay / 2.0
        then = None if path.slows else surface.then(path)
        if then is not None and rest <= 0.0:
            return self.mean_velocity(surface, then, path.end - rest)
        if then is not None:
            time = min(dt - rest, then.end - then.t)
            x = rest * (vx + rest * path.ax / 2.0) + time * (then.vx + time * then.ax / 2.0)
            y = rest * (vy + rest * path.ay / 2.0) + time * (then.vy + time * then.ay / 2.0)
            return x / dt, y / dt
        share = max(rest, 0.0) / dt
        return share * (vx + rest * path.ax / 2.0), share * (vy + rest * path.ay / 2.0)

    def carry(self, ball: TableBall) -> None:
        """Put a ball's body on its path at the end of this step, or to rest."""
        path, goes = self.engine.paths[ball.number], NOTHING
        x, y, vx, vy = motion_at(path, self.time)
        ball.body.position = x, y
        if path.end <= self.time:
            self._rest(ball)
        else:
            surface, rest = self.engine.surfaces[ball.number], path.end - self.time
            ball.body.velocity = goes = self.mean_of(surface, path, rest, vx, vy)
            fastest = math.sqrt(vx * vx + vy * vy) if path.slows else path.fastest
            margin = fastest * self.max_dt
            rounding = HAIR * ball.radius + 16.0 * EPSILON * (abs(x) + abs(y))
            ball.widen(ball.radius + margin + rounding)
            is_damped = self.engine.pull > 0.0 and not (self.has_joints and path.slows)
            if ball.number not in self.moving:
                check_unchanged(ball)
                self.moving[ball.number] = ball
                self._slow_down(ball, is_damped)
            elif is_damped != (ball.number in self.damped):
                self._let_go(ball)
                self._slow_down(ball, is_damped)
            elif self.engine.has_patches and ball.joint is not None:
                ball.joint.max_force = self._pull_on(ball)
            self.next_stop = min(self.next_stop, path.end)
        self.carried[ball] = x, y, *goes
        self.stirred.add(ball)

    def show_instant(self) -> dict[TableBall, Four]:
        """Let bodies show how balls move at the present instant, and return what they showed."""
        now, paths = self.now, self.engine.paths
        its = [self.balls[i] for i in dict.fromkeys((*self.moving, *self.near.changed))]
        shows = {ball: motion_at(paths[ball.number], now) for ball in its if self.is_there(ball)}
        for ball in shows:
            self.carried.pop(ball, None)
        return dict(zip(shows, self.bodies.put(shows), strict=True))

    def show_step(self, showed: Mapping[TableBall, Four]) -> None:
        """Put bodies back to where the step took them, except those that begin new paths."""
        is_changed, its = self.near.changed, showed.items()
        self.bodies.put(
            {
                ball: had
                for ball, had in its
                if self.is_there(ball) and ball.number not in is_changed
            }
        )

    def carry_all(self) -> None:
        """Put all moving bodies on their paths."""
        for ball in list(self.moving.values()):
            self.carry(ball)

    def _slow_down(self, ball: TableBall, is_damped: bool) -> None:
        """Install friction: a callback, or a joint that pulls m a on a path that slows to rest."""
        if is_damped:
            self.damped.add(ball.number)
            self._damp_by_callback(ball)
        elif self.engine.pull > 0.0:
            if ball.joint is None:
                ground = self.space.static_body
                ball.joint = pymunk.PivotJoint(ground, ball.body, NOTHING, NOTHING)
                ball.joint.max_bias = 0.0
            ball.joint.max_force = self._pull_on(ball)
            self.space.add(ball.joint)

    def _pull_on(self, ball: TableBall) -> float:
        """Return the force (N) by which friction slows a ball to rest where it is."""
        return float(ball.body.mass * self.engine.surfaces[ball.number].drag)

    def _let_go(self, ball: TableBall) -> None:
        """Take the friction off a ball."""
        if ball.number in self.damped:
            self.damped.remove(ball.number)
            if ball.body.velocity_func == self._damp:
                ball.body.velocity_func = ball.velocity_func or pymunk.Body.update_velocity
            ball.velocity_func = None
        elif ball.joint is not None:
            self._take_out_joint(ball.joint)
            ball.joint = ball.joint if self.alone else None

    def _take_out_joint(self, joint: pymunk.PivotJoint) -> None:
        """Take a joint out of the space, unless somebody has done so."""
        if joint in self.space.constraints:
            self.space.remove(joint)

    def put_back_joints(self) -> None:
        """Put the friction joints back that somebody has taken out of the space."""
        there, damped = self.space.constraints, self.damped
        slowed = [ball for ball in self.moving.values() if ball.number not in damped]
        joints = [ball.joint for ball in slowed if ball.joint is not None]
        self.space.add(*[joint for joint in joints if joint not in there])

    def _damp_by_callback(self, ball: TableBall) -> None:
        """Put the table's function into a body; it calls the function that was there."""
        own = ball.body.velocity_func
        if own != self._damp:
            ball.velocity_func = None if own == pymunk.Body.update_velocity else own
            ball.body.velocity_func = self._damp

    def _damp(self, body: pymunk.Body, _: object, __: float, dt: float) -> None:
        """Give a body its path's mean velocity over the coming step, and keep earlier pushes.

        A function of the user's own then changes it; gravity and damping act later, as a push.
        """
        try:
            ball = self.ball_of[body.id]
            path = self.engine.paths[ball.number]
            surface = self.engine.surfaces[ball.number]
            velocity = self.mean_velocity(surface, path, self.since + (self.count + 1) * self.dt)
            body.force = NOTHING
            if not self.alone:
                (vx, vy), (x, y) = velocity, body.velocity
                ex, ey = self.mean_velocity(surface, path, self.time)
                # In this order nothing is rounded where nothing pushes.
                velocity = vx + (x - ex), vy + (y - ey)
            body.velocity = velocity
            if ball.velocity_func is not None:
                ball.velocity_func(body, NOTHING, 1.0, dt)
        except Exception as error:
            self.note(error)

    def renew_joints(self) -> None:
        """Give all moving balls new joints, which keep no impulse from a step of other length."""
        for ball in self.moving.values():
            if ball.joint is not None:
                self._take_out_joint(ball.joint)
                ball.joint = None
                self._slow_down(ball, is_damped=False)

    @property
    def joints(self) -> int:
        """The number of friction joints that are in the space now."""
        return len(self.moving) - len(self.damped) if self.engine.pull > 0.0 else 0

    def _rest(self, ball: TableBall) -> None:
        """Put a ball to rest; from now on it costs nothing."""
        ball.body.velocity = NOTHING
        ball.widen(ball.radius)
        if self.moving.pop(ball.number, None) is not None:
            self._let_go(ball)

    def stop_balls(self) -> None:
        """Put balls to rest whose paths have ended, and steer those that stop in the next step."""
        paths = self.engine.paths
        for ball in list(self.moving.values()):
            path = paths[ball.number]
            if path.end <= self.time:
                self.carry(ball)
            elif path.end <= self.time + self.dt:
                surface = self.engine.surfaces[ball.number]
                ball.body.velocity = self.mean_velocity(surface, path, self.time)
        self.next_stop = min((paths[i].end for i in self.moving), default=math.inf)
