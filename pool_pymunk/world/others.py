"""This module follows what others in a shared space do to the balls.

Between two steps somebody may set a velocity or a place: that is found when the next step begins,
and the ball's path begins anew. What gravity, damping, forces, springs, joints and collisions with
others do in a step acts once, as a kick at its end, so it is right to first order in the step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pymunk

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.surface import SHARE
from pool_pymunk.world.ball import HAIR, TableBall
from pool_pymunk.world.checks import check_step
from pool_pymunk.world.state import NOTHING, Moves, Phase, Snapshot, read_bodies
from pool_pymunk.world.steps import Steps

# A step of pymunk rounds velocity and place by less than this: a few roundings of EPSILON / 2.
STEP_ROUNDING = 4.0 * EPSILON
# In a step pymunk's solver goes over all joints ten times, and each time rounds the velocity.
PUSH_ROUNDING = 64.0 * EPSILON


class SharedSteps(Steps):
    """These are the steps of a space that balls share with others.

    The table looks at the bodies before pymunk steps them, and answers each step ahead of all
    other callbacks after it.
    """

    alone = False

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        # the bodies when all balls were last seen to be on their paths, and which of them are balls
        self._seen = Snapshot()
        self._rows: Sequence[Moves | None] = ()
        self._balls: list[TableBall | None] = []
        self._entries = 0  # of balls, at `_seen`
        self._forces: dict[TableBall, Vector] = {}  # N, on balls then

    # -- between two steps -----------------------------------------------------------------------

    def catch_up(self) -> None:
        """Follow what has happened to the balls since the last step."""
        seen, now = self._seen, read_bodies(self.space)
        has_others = now.ids != seen.ids or now.shapes != seen.shapes
        if has_others or self.entries != self._entries:
            self.drop_lost()
            now = read_bodies(self.space)
            ball_of = {ball.body_id: ball for ball in self.ball_of.values()}
            self._balls = [ball_of.get(body) for body in now.moves()]
            self._rows = [None] * len(self._balls)
            self._forces.clear()
        elif now.numbers == seen.numbers:
            return
        rows = now.rows()
        moved = [
            ball
            for ball, move, was in zip(self._balls, rows, self._rows, strict=True)
            if move != was and ball is not None and self._follow(ball, move)
        ]
        self._seen, self._rows, self._entries = now, rows, self.entries
        if moved:
            self.set_out(moved)
            self.catch_up()  # This second look finds them on their paths.

    def _follow(self, ball: TableBall, move: Moves) -> bool:
        """Give a ball a new path if somebody has moved it off its own; tell whether that is so."""
        x, y, vx, vy, fx, fy = move
        if fx != 0.0 or fy != 0.0:
            self._forces[ball] = fx, fy
        elif self._forces:
            self._forces.pop(ball, None)
        now, path = self.time, self.engine.paths[ball.number]
        px, py, pvx, pvy = motion_at(path, now)
        ex, ey = self.mean_of(path, path.end - now, pvx, pvy)
        off, gain = abs(x - px) + abs(y - py), abs(vx - ex) + abs(vy - ey)
        share = late = speed = 0.0
        if path.end > now:
            # All its steps along the path have rounded place, velocity and the clock (s).
            share = STEP_ROUNDING * (2.0 + min((now - path.t) / self.dt, self.count))
            speed, late = self.engine.speeds[ball.number], 2.0 * EPSILON * now
        size = abs(x) + abs(y) + speed * (now - path.t) + ball.radius
        is_there = off <= share * size + late * speed
        is_as_fast = gain <= share * speed + late * self.surface.pull
        if is_there and is_as_fast:
            return False
        if is_as_fast:  # Only its place is new.
            vx, vy = pvx, pvy
        elif gain <= HAIR * (abs(vx) + abs(vy) + abs(ex) + abs(ey)):  # It is a push.
            vx, vy = pvx + vx - ex, pvy + vy - ey
        place = (px, py) if is_there else self.beside(ball, x, y)
        self.begin_path(ball, place, (vx, vy))
        return True

    # -- a step ----------------------------------------------------------------------------------

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        if dt == 0.0:  # It is no step to pymunk, either.
            return
        self.refuse_in_step("dt", dt)
        check_step(dt, self.max_dt)
        self.catch_up()
        if is_uneven := dt != self.dt:
            self.set_clock(self.time, dt)
            self.carry_all()
            self.renew_joints()
            self._seen = read_bodies(self.space)
            self._rows = self._seen.rows()
        self.begin_step()
        self.space.add_post_step_callback(self._end, self, is_uneven)
        try:
            self._pymunk_step(dt)
        finally:
            self.phase = Phase.BETWEEN
        self.raise_noted()

    def _end(self, space: pymunk.Space, _key: object, is_uneven: bool) -> None:
        """Answer this step, unless another step has ended it."""
        if self.phase is not Phase.STEPPING:
            return
        try:
            self._answer_all(space, is_uneven)
        except Exception as error:
            self.note(error)
        finally:
            self.phase = Phase.BETWEEN

    def _answer_all(self, space: pymunk.Space, is_uneven: bool) -> None:
        """Answer this step, and then let what others did in it act once on each ball."""
        may_sleep, began, damping = space.sleep_time_threshold < math.inf, self.time, space.damping
        on_all = is_uneven or may_sleep or len(space.constraints) > self.joints
        kicks = self._kicks(space.gravity, damping)
        self.tick()
        is_due = self.time >= self.wake or self.near.pairs or self.sent
        if not (is_due or on_all or kicks):
            return
        paths, after = tuple(self.engine.paths), read_bodies(space)
        if is_due:
            self.answer(began)
        self.phase = Phase.BETWEEN
        # A body that the table has not put on a path in this step still has its pushes.
        balls = dict.fromkeys(self.ball_of.values() if on_all else (*kicks, *self.carried))
        before, moves = (self._seen.moves(), after.moves()) if balls else ({}, {})
        share = damping**self.dt if damping != 1.0 else 1.0
        for ball in balls:
            is_known = ball.body_id in before and ball.body_id in moves
            if ball.is_on_table and is_known and ball not in self.sent_off:
                (ax, ay), path = kicks.get(ball, NOTHING), paths[ball.number]
                gain, slides = (ax * self.dt, ay * self.dt), path.end > began
                was, now = before[ball.body_id][2:4], moves[ball.body_id][2:4]
                push = self._push(path if slides else None, was, now, gain, share)
                if ball in kicks or push != NOTHING:
                    self._kick(ball, (gain[0] + push[0], gain[1] + push[1]), share)
        if may_sleep:
            for ball in self.moving.values():
                ball.body.activate()  # A ball that moves must not fall asleep.
            self.carry_all()

    def _kicks(self, gravity: Vector, damping: float) -> dict[TableBall, Vector]:
        """Return the accelerations (m/s^2) of balls by gravity and forces, where there are any."""
        (gx, gy), masses, forces = gravity, self.engine.masses, self._forces
        falls = gx != 0.0 or gy != 0.0 or damping != 1.0
        kicks = {}
        for ball in self.ball_of.values() if falls else forces:
            (fx, fy), mass = forces.get(ball, NOTHING), masses[ball.number]
            kicks[ball] = (gx + fx / mass, gy + fy / mass)
        return kicks

    def _push(
        self, path: Path | None, was: Vector, now: Vector, gain: Vector, share: float
    ) -> Vector:
        """Return the change of velocity (m/s) beyond friction, damping and the gain by forces."""
        (bx, by), (wx, wy), surface = was, now, self.surface
        if path and surface.pull > 0.0 and not (self.has_joints and path.slows):
            vx, vy = self.mean_velocity(path, self.time)
        else:
            vx, vy = bx * share + gain[0], by * share + gain[1]
            most = surface.drag * self.dt if path else 0.0
            speed = math.sqrt(vx * vx + vy * vy)
            kept = 1.0 - most / speed if speed > most else 0.0
            vx, vy = vx * kept, vy * kept
        sizes = abs(bx) + abs(by) + abs(vx) + abs(vy) + abs(wx) + abs(wy)
        is_pushed = abs(wx - vx) + abs(wy - vy) > PUSH_ROUNDING * sizes
        return (wx - vx, wy - vy) if is_pushed else NOTHING

    def _kick(self, ball: TableBall, gain: Vector, share: float) -> None:
        """Add a push to the damped velocity (m/s), unless friction holds the ball at rest."""
        path, surface = self.engine.paths[ball.number], self.surface
        (gx, gy), (x, y, vx, vy) = gain, motion_at(path, self.time)
        # A ball that rolls keeps 5/7 of a push.
        holds = min(surface.pull, surface.drag / (1.0 - SHARE)) * self.dt
        if path.slows and vx == vy == 0.0 and math.sqrt(gx * gx + gy * gy) <= holds:
            ball.body.velocity = NOTHING
            return
        self.begin_path(ball, (x, y), (vx * share + gx, vy * share + gy))
        self.set_out([ball])
