"""This module follows what others in a shared space do to the balls.

Between two steps somebody may set a velocity or a place: that is found when the next step begins,
and the ball's path begins anew. In a step, gravity, damping and forces change velocities, and so do
springs, joints, and collisions with shapes that are not the table's. All of this acts once, as a
kick at the step's end, so it is right to first order in the step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pymunk

from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.sides import unit
from pool_pymunk.world.ball import Ball
from pool_pymunk.world.bodies import Bodies, Moves
from pool_pymunk.world.checks import LONGEST, step_error

if TYPE_CHECKING:
    from pool_pymunk.world.billiards import Billiards

NOTHING = (0.0, 0.0)
# A place or velocity set by hand differs from that of the path by more than this share. What
# differs less is a push: it is added to what the path says.
SET = 1e-9
# A step of pymunk rounds a velocity by less than this share of it, and a place too: some operations
# round by half an EPSILON each.
STEP_ROUNDING = 4.0 * EPSILON
# In a step pymunk's solver goes over all joints ten times, and each time rounds the velocity.
PUSH_ROUNDING = 64.0 * EPSILON


class Others:
    """The others are all that moves balls in a shared space, but for the table itself.

    A kinematic body is their clock: pymunk asks it to move as every step begins, and it never falls
    asleep.
    """

    def __init__(self, table: Billiards) -> None:
        self.table = table
        self.space = table.space
        self.is_stepping = False
        self._dt = table.dt  # s; the length of this step
        self._is_refused = False
        # how all bodies moved as this step began; the balls on the table, each with its place there
        self._moves: list[Moves] = []
        # m/s, by joints that keep impulses from a step of another length, and how they change
        self._kept: dict[Ball, Vector] = {}
        self._longer = 1.0
        # the moves of the step before, and the bodies' places there
        self._last: tuple[dict[int, int], list[Moves]] = {}, []
        self._is_after_refusal = self._has_to_mend = False  # The step before was refused.
        self._is_answering = False  # The table answers this step, and calls callbacks.
        self._inner: dict[int, Moves] = {}  # by bodies: the moves of a step within this step
        self._rows: list[tuple[Ball, int, int]] = []  # the balls, their numbers and their places
        self._circles: set[pymunk.Shape] = set()
        self._kicks: dict[Ball, Vector] = {}  # m/s^2, by gravity and forces
        self._damping = 1.0  # the share of a velocity that the space's damping leaves in this step
        # m/s, what springs, joints and collisions have added to velocities in this step
        self._pushes: dict[Ball, Vector] = {}
        self._damped_to: dict[Ball, Vector] = {}  # m/s, by the damping callback in this step
        self._lost: list[Ball] = []  # These balls were taken out of the space.
        self._walls: dict[pymunk.Body, tuple[Vector, float]] = {}  # their places (m) and angles
        self._is_other = False  # This step is of another length than the one before.
        self._has_new_joints = False  # No joint keeps an impulse from the step before.
        self.clock = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        self.clock.position_func = self._on_step
        self.space.add(self.clock)
        self._bodies = Bodies(self.space, self.clock)

    def stand(self, body: pymunk.Body) -> None:
        """Note where a wall's body stands."""
        self._walls[body] = (body.position, body.angle)

    def let_go(self, body: pymunk.Body | None) -> None:
        """Forget a body that carries no wall any more."""
        if body is not None:
            self._walls.pop(body, None)

    def welcome(self, body: pymunk.Body) -> None:
        """Find the balls among the bodies anew: one has come, perhaps with a body of another."""
        self._rows.clear()
        self._stop_turning(body)

    # -- between two steps -----------------------------------------------------------------------

    def catch_up(self) -> None:
        """Follow what has happened to the balls since the last step."""
        if self.is_stepping:
            return
        if self.clock.space is None:  # Somebody has emptied the space.
            self.space.add(self.clock)
        moved, paths = [], self.table.engine.paths
        for ball in self.table.on_table():
            body = ball.body
            move = (*body.position, *body.velocity, *body.force)
            if body.space is None or ball.circle.space is None:
                self.table.drop(ball)
            elif self._follow(ball, paths[ball.number], move):
                moved.append(ball)
        self.table.set_out(moved)

    # -- as a step begins ------------------------------------------------------------------------

    def _on_step(self, _clock: pymunk.Body, dt: float) -> None:
        """Notice which balls others have moved, and what acts on them."""
        try:
            self.space.add_post_step_callback(self._after_step, self)
            if self._is_answering:  # Somebody steps the space from within a callback.
                bodies = Bodies(self.space, self.clock)
                moves = bodies.read(dt)
                self._inner = dict(zip(bodies.ids, moves, strict=True))
                return
            self.is_stepping = True
            self._longer, self._dt = dt / self._dt, dt
            self._has_to_mend, self._is_after_refusal = self._is_after_refusal, False
            self._is_refused = not 0.0 < dt <= LONGEST * self.table.max_dt
            self._is_other = self._is_other or dt != self.table.dt
            self._moves = self._bodies.read(dt)
            for each in (self._kicks, self._pushes, self._damped_to):
                each.clear()
            if self._bodies.has_new_order:
                self._rows.clear()
            if not self._is_refused:
                self._look_at_balls()
        except Exception as error:
            self.table.note(error)

    def _find_balls(self) -> None:
        """Find the balls among the bodies, and note those that were taken out of the space."""
        place = self._bodies.place
        there, shapes = self.table.on_table(), self.space.shapes
        self._lost = [b for b in there if b.id not in place or b.circle not in shapes]
        kept = [ball for ball in there if ball not in self._lost]
        self._rows = [(ball, ball.number, place[ball.id]) for ball in kept]
        self._circles = {ball.circle for ball in kept}

    def _look_at_balls(self) -> None:
        """Follow the balls that others have moved, and note which forces act in this step."""
        table, space, moves, moving = self.table, self.space, self._moves, self.table.moving
        paths, masses = table.engine.paths, table.engine.masses
        if len(self._rows) != table.count or not self._circles <= space.shapes:
            self._find_balls()
        if self._is_other:
            self._recall()
        (gx, gy), damping = space.gravity, space.damping
        self._damping = damping**self._dt if damping != 1.0 else 1.0
        falls = gx != 0.0 or gy != 0.0 or damping != 1.0
        for ball, number, row in self._rows:
            x, y, vx, vy, fx, fy = move = moves[row]
            path = paths[number]
            rests = vx == vy == 0.0 and (x, y) == path.rest
            if (not rests or number in moving) and self._follow(ball, path, move):
                table.moved_by_others.append(number)
            if falls or fx != 0.0 or fy != 0.0:
                mass = masses[number]
                self._kicks[ball] = (gx + fx / mass, gy + fy / mass)

    def _recall(self) -> None:
        """Note what joints of moving balls keep from the step before, which was of other length.

        It is against the velocity with which the ball began that step.
        """
        self._kept.clear()
        place, moves = self._last
        for ball in () if self._has_new_joints else self.table.moving.values():
            if ball.joint is not None and ball.id in place and ball.joint.impulse > 0.0:
                _, _, vx, vy, _, _ = moves[place[ball.id]]
                nx, ny = unit(vx, vy)
                gain = -ball.joint.impulse / ball.body.mass
                self._kept[ball] = gain * nx, gain * ny

    def look_at_walls(self) -> None:
        """Refuse a step in which balls may meet something if walls have moved."""
        for body, (place, angle) in self._walls.items():
            if body.position != place or body.angle != angle:
                message = "a wall's body stands still: to move a wall, remove it and add it again"
                self._undo()
                raise setting_error("position", list(body.position), message)

    def _follow(self, ball: Ball, path: Path, move: Moves) -> bool:
        """Give a ball a new path if it is not on its own, and tell so: somebody has moved it."""
        x, y, vx, vy, _, _ = move
        table = self.table
        px, py, pvx, pvy = motion_at(path, table.time)
        ex, ey = table.mean_velocity(path, table.time)
        off, gain = abs(x - px) + abs(y - py), abs(vx - ex) + abs(vy - ey)
        size, rounding = abs(x) + abs(y), STEP_ROUNDING if path.end > table.time else 0.0
        if gain <= rounding * path.speed and off <= rounding * size:
            return False
        rounding *= table.steps_on(path)
        is_as_fast = gain <= rounding * path.speed
        is_there = off <= rounding * (size + path.speed * (table.time - path.t) + ball.radius)
        if is_there and is_as_fast:
            return False
        speed = abs(vx) + abs(vy) + abs(ex) + abs(ey)
        if is_as_fast:  # Only its place is new.
            vx, vy = pvx, pvy
        elif gain <= SET * speed:
            vx, vy = pvx + vx - ex, pvy + vy - ey
        place = (px, py) if is_there else table.beside(ball, x, y)
        path = table.surface.path(table.time, place, (vx, vy))
        table.engine.set_off(ball.number, path)
        if not path.moves:
            table.engine.rested[ball.number] = table.time
        return True

    # -- in a step -------------------------------------------------------------------------------

    def damp(self, ball: Ball, velocity: Vector) -> Vector:
        """Return what a ball carries that the damping callback gives this velocity (m/s).

        What springs and joints have given it before in this step is added.
        """
        self._damped_to[ball] = velocity
        began = self._began(ball)
        if began is None:
            return velocity
        (x, y), (_, _, vx, vy, _, _) = ball.body.velocity, began
        return velocity[0] + x - vx, velocity[1] + y - vy

    def last_word(self, ball: Ball) -> None:
        """Let nothing that others have done in this step act on a ball that was sent off."""
        if self.is_stepping:
            self._pushes[ball] = NOTHING
            self._kicks.pop(ball, None)

    def feel_push(self, ball: Ball) -> None:
        """Note what others than friction and forces have added to a velocity in this step.

        It is noted once, before the table itself changes the body's velocity.
        """
        began = None if ball in self._pushes else self._began(ball)
        if began is None:
            return
        _, _, bx, by, _, _ = began
        vx, vy = self._damped_to.get(ball) or self._velocity_without_others(ball, (bx, by))
        wx, wy = ball.body.velocity
        speed = abs(bx) + abs(by) + abs(vx) + abs(vy) + abs(wx) + abs(wy)
        is_pushed = abs(wx - vx) + abs(wy - vy) > PUSH_ROUNDING * speed
        self._pushes[ball] = (wx - vx, wy - vy) if is_pushed else NOTHING

    def _began(self, ball: Ball) -> Moves | None:
        """Return how a ball moved as this step began, or None if nobody knows."""
        place = self._bodies.place.get(ball.id)
        return self._moves[place] if self._moves and place is not None else None

    def _velocity_without_others(self, ball: Ball, began: Vector) -> Vector:
        """Return the velocity (m/s) that pymunk gives a body by forces and the friction joint."""
        (ax, ay), dt = self._kicks.get(ball, NOTHING), self._dt
        vx, vy = began[0] * self._damping + ax * dt, began[1] * self._damping + ay * dt
        if ball.joint is None or ball.number not in self.table.moving:
            return vx, vy
        most, speed = self.table.surface.pull * dt, math.sqrt(vx * vx + vy * vy)
        if ball in self._kept:
            return _pulled((vx, vy), self._kept[ball], self._longer, most, self.space.iterations)
        left = 1.0 - most / speed if speed > most else 0.0
        return vx * left, vy * left

    # -- as a step ends --------------------------------------------------------------------------

    def _after_step(self, *_: object) -> None:
        """Let the table answer this step, and let then act what others did in it."""
        if self._is_answering:
            if self._inner:  # There is none for a step of 0 s.
                self._put_back(self._inner)
                self._inner = {}
            message = "a callback cannot step the space: wait until the present step is over"
            raise setting_error("dt", self._dt, message)
        if not self.is_stepping:  # pymunk calls again what raised an error in the step before.
            return
        if self._is_refused:
            self._undo()
            raise step_error(self._dt, self.table.max_dt)
        self._is_answering = True
        try:
            self._answer()
        finally:
            self._moves, self.is_stepping, self._is_answering = [], False, False
        self.table.raise_noted()

    def _answer(self) -> None:
        """Let the table answer this step, and let then act what others did in it."""
        table = self.table
        while self._lost:
            table.drop(self._lost.pop())
        if self._has_to_mend:
            self._mend()
        is_other, self._is_other = self._is_other, False
        if is_other:
            table.take_steps_of(self._dt)
        # What others do to the balls that are put on their paths would be lost.
        may_sleep = self.space.sleep_time_threshold < math.inf
        felt = is_other or may_sleep or len(self.space.constraints) > table.joints
        for ball in table.on_table() if felt else self._kicks:
            self.feel_push(ball)
        table.answer_step()
        # From now on velocities are what the table makes of them.
        self._last, self._moves = (self._bodies.place, self._moves), []
        if self._kicks or self._pushes:
            self._let_act()
        if is_other or may_sleep:
            self._put_right(is_other, may_sleep)
        self._has_new_joints = is_other

    def _let_act(self) -> None:
        """Let forces and pushes act, each once."""
        for ball in dict.fromkeys((*self._kicks, *self._pushes)):
            acceleration, push = self._kicks.get(ball), self._pushes.get(ball, NOTHING)
            if ball.is_on_table and (acceleration or push != NOTHING):
                self._kick(ball, acceleration, push)

    def _kick(self, ball: Ball, acceleration: Vector | None, push: Vector) -> None:
        """Change a velocity by a force (m/s^2) and a push (m/s).

        Surface friction holds a ball at rest against as much as its own deceleration.
        """
        table, dt = self.table, self._dt
        (ax, ay), damping = acceleration or NOTHING, self._damping if acceleration else 1.0
        gain_x, gain_y = ax * dt + push[0], ay * dt + push[1]
        x, y, vx, vy = motion_at(table.engine.paths[ball.number], table.time)
        gain = math.sqrt(gain_x * gain_x + gain_y * gain_y)
        if vx == vy == 0.0 and gain <= table.surface.pull * dt:
            ball.body.velocity = NOTHING
            return
        kicked = (vx * damping + gain_x, vy * damping + gain_y)
        table.engine.now = table.time
        path = table.surface.path(table.time, (x, y), kicked)
        table.engine.set_off(ball.number, path)
        if not path.moves:
            table.engine.rested[ball.number] = table.time
        table.set_out([ball])

    def _put_right(self, is_other: bool, may_sleep: bool) -> None:
        """Put bodies on their paths where pymunk does not keep them there.

        Joints keep impulses from step to step, and take it that steps are equally long; new ones
        have nothing to keep. A ball that moves must not fall asleep.
        """
        table = self.table
        if may_sleep:
            for ball in table.moving.values():
                ball.body.activate()
        table.carry_all()
        if is_other:
            self._kept.clear()
            table.renew_joints()

    def _undo(self) -> None:
        """Put all back to where it was before a step that cannot be."""
        self._lost.clear()
        self._rows.clear()
        table, moves = self.table, dict(zip(self._bodies.ids, self._moves, strict=True))
        self._last, self._moves, self.is_stepping = ({}, []), [], False
        self._put_back(moves)
        moved, table.moved_by_others = dict.fromkeys(table.moved_by_others), []
        table.set_out([table.balls[i] for i in moved if table.balls[i].is_on_table])

    def _put_back(self, moves: dict[int, Moves]) -> None:
        """Put the balls back to where they were as a step began."""
        self._is_other = self._is_after_refusal = True
        table = self.table
        for ball in table.on_table():
            move, body = moves.get(ball.id), ball.body
            if move is None or not math.isfinite(sum(move)):
                path = table.engine.paths[ball.number]
                goes = table.mean_velocity(path, table.time)
                move = (*path.at(table.time)[0], *goes, 0.0, 0.0)
            self._stop_turning(body)  # Else its place could not be set.
            body.position, body.velocity, body.force = move[:2], move[2:4], move[4:]
            self.space.reindex_shapes_for_body(body)
        table.renew_joints()

    def _mend(self) -> None:
        """Mend the velocities that friction joints have spoilt.

        pymunk scales the impulses of joints by the length of the step before, which was refused and
        may have been no number. The paths are as they were.
        """
        for ball in self.table.on_table():
            began = self._began(ball)
            if began and not math.isfinite(sum(ball.body.velocity)):
                ball.body.velocity = self._velocity_without_others(ball, began[2:4])
            self._stop_turning(ball.body)
        ground = self.space.static_body
        ground.velocity, ground.angular_velocity = NOTHING, 0.0

    def _stop_turning(self, body: pymunk.Body) -> None:
        """Mend how a body turns if a step of no length in numbers has spoilt it."""
        if not math.isfinite(body.angle + body.angular_velocity):
            body.angle = body.angular_velocity = 0.0


def _pulled(
    velocity: Vector, kept: Vector, longer: float, most: float, rounds: int
) -> Vector:  # fmt: skip
    """Return the velocity (m/s) that pymunk's solver makes of one with a friction joint.

    The joint has ``kept`` an impulse (m/s) from the step before. First the solver lets that act
    again, as ``longer`` as this step is. Then it changes the impulse in some ``rounds``, so that
    the body stands if ``most`` (m/s) is enough for that.
    """
    (vx, vy), (jx, jy) = velocity, kept
    vx, vy = vx + longer * jx, vy + longer * jy
    for _ in range(rounds):
        kx, ky = jx - vx, jy - vy
        size = math.sqrt(kx * kx + ky * ky)
        if size > most:
            kx, ky = kx * most / size, ky * most / size
        vx, vy = vx + kx - jx, vy + ky - jy
        jx, jy = kx, ky
    return vx, vy
