"""This module follows what others in a shared space do to the balls in a step.

What gravity, damping, forces, velocity functions, joints and collisions with others do in a step
acts once, as a push at its end, so it is right to first order in the step. Velocity functions and
joints act on the velocity after the contacts of the step: a joint that has no force, and that
pymunk calls after it has found what touches, gives the bodies that velocity before.
"""

from __future__ import annotations

import math
from typing import Any

import pymunk

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.surface import SHARE, Surface
from pool_pymunk.world.ball import TableBall
from pool_pymunk.world.bodies import Moves, Snapshot
from pool_pymunk.world.checks import check_sound, check_step, is_sound
from pool_pymunk.world.outlook import motions_after
from pool_pymunk.world.state import NOTHING, Phase
from pool_pymunk.world.steps import Steps

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
        # the changes of velocity (m/s) by contacts that were foreseen in the present step
        self._turned: dict[TableBall, Vector] = {}
        self._hook = pymunk.PivotJoint(self.space.static_body, pymunk.Body(1.0, 1.0), NOTHING)
        self._hook.max_force = 0.0
        self._hook.pre_solve = self._foresee

    # -- a step ----------------------------------------------------------------------------------

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        if dt == 0.0:  # It is no step to pymunk, either.
            return
        self.refuse_in_step("dt", dt)
        check_step(dt, self.max_dt)
        self.catch_up()
        self.refuse_changes()
        if self.walls.movers:
            self.make_room()
            self.catch_up()
        self.put_back_joints()
        if is_uneven := dt != self.dt:
            self.set_clock(self.time, dt)
            self.carry_all()
            self.renew_joints()
            self.look()
        self._turned.clear()
        self._put_hook(self._others_act())
        self.begin_step()
        self.space.add_post_step_callback(self._end, self, is_uneven)
        try:
            self._pymunk_step(dt)
        finally:
            self.phase = Phase.BETWEEN
        self.raise_noted()

    @property
    def _joints_of_others(self) -> int:
        there = self.space.constraints
        return len(there) - self.joints - (self._hook in there)

    def _others_act(self) -> bool:
        """Tell whether joints or velocity functions of others may act on balls in a step."""
        usual, found = (pymunk.Body.update_velocity, self._damp), self._joints_of_others > 0
        for ball in self.ball_of.values():
            if ball.body.velocity_func not in usual:
                found = True
                if ball.number in self.damped:  # Somebody has replaced the table's function.
                    self._damp_by_callback(ball)
            found = found or ball.velocity_func is not None
        return found

    def _put_hook(self, is_needed: bool) -> None:
        """Put the hook in ahead of all other joints, or take it out."""
        there = self.space.constraints
        if is_needed and self._hook not in there:
            others = list(there)
            self.space.remove(*others)
            self.space.add(self._hook, *others)
        elif not is_needed and self._hook in there:
            self.space.remove(self._hook)

    def _foresee(self, *_: object) -> None:
        """Let bodies move as they do after the contacts of this step, if there are any."""
        if self.engine.upcoming() > self.time + self.dt and not (self.near.pairs or self.sent):
            return
        try:
            after = motions_after(self, self.dt)
        except Exception:  # The answer to this step fails, too, and its error is noted.
            return
        for ball, (place, (vx, vy)) in after.items():
            bx, by = self._seen.moves[ball.body_id][2:4]
            self._turned[ball] = dx, dy = vx - bx, vy - by
            ball.body.position = place
            ball.body.velocity += dx, dy

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
        on_all = is_uneven or may_sleep or self._joints_of_others > 0
        accelerations = self._accelerations(space.gravity, damping)
        self.tick()
        is_due = self.time >= self.wake or self.near.pairs or self.sent
        if not (is_due or on_all or accelerations):
            self.walls.finish()
            return
        paths, after = tuple(self.engine.paths), self.bodies.read()
        surfaces = tuple(self.engine.surfaces)
        if is_due:
            try:
                self.answer(began)
            finally:
                self.walls.finish()
        self.phase = Phase.BETWEEN
        # A body that the table has not put on a path in this step still has its pushes.
        balls = self.ball_of.values() if on_all else (*accelerations, *self.carried, *self._turned)
        for ball in dict.fromkeys(balls):
            if ball.is_on_table and ball not in self.sent_off:
                path = paths[ball.number]
                slides = path if path.end > began else None
                surface = surfaces[ball.number]
                self._act_on(
                    ball, slides, surface, after, accelerations.get(ball), damping**self.dt
                )
        if may_sleep:
            for ball in self.moving.values():
                ball.body.activate()  # A ball that moves must not fall asleep.
            self.carry_all()

    def _accelerations(self, gravity: Vector, damping: float) -> dict[TableBall, Vector]:
        """Return the accelerations (m/s^2) of balls by gravity and forces, where there are any."""
        (gx, gy), masses, forces = gravity, self.engine.masses, self.forces
        falls = gx != 0.0 or gy != 0.0 or damping != 1.0
        accelerations = {}
        for ball in self.ball_of.values() if falls else forces:
            (fx, fy), mass = forces.get(ball, NOTHING), masses[ball.number]
            accelerations[ball] = (gx + fx / mass, gy + fy / mass)
        return accelerations

    def _act_on(
        self,
        ball: TableBall,
        path: Path | None,
        surface: Surface,
        after: Snapshot,
        acceleration: Vector | None,
        share: float,
    ) -> None:
        """Let act once on a ball what others did to its body in this step.

        The ball slid along ``path`` on a ``surface``, if it moved. Damping leaves ``share`` of its
        velocity.
        """
        before, now = (seen.moves.get(ball.body_id) for seen in (self._seen, after))
        if before is None or now is None:
            return
        (ax, ay), (dx, dy) = acceleration or NOTHING, self._turned.get(ball, NOTHING)
        gain, was = (ax * self.dt, ay * self.dt), (before.vx + dx, before.vy + dy)
        if path and self.engine.pull > 0.0 and not (self.has_joints and path.slows):
            vx, vy = self.mean_velocity(surface, path, self.time)
            kept = vx + dx, vy + dy
        else:
            kept = self._slowed(was, gain, share, surface.drag if path else 0.0)
        wx, wy = now.vx - kept[0], now.vy - kept[1]
        sizes = sum(map(abs, (*was, *kept, *now[2:4])))
        is_pushed = not abs(wx) + abs(wy) <= PUSH_ROUNDING * sizes
        if is_pushed:
            gain = gain[0] + wx, gain[1] + wy
        if acceleration is not None or is_pushed:
            self._push(ball, gain, share)
        elif ball in self._turned and ball not in self.carried:
            self.carry(ball)  # What was foreseen did not come: a callback changed it.

    def _slowed(self, was: Vector, gain: Vector, share: float, drag: float) -> Vector:
        """Return the velocity (m/s) of a body after a step with damping, forces and friction."""
        vx, vy = was[0] * share + gain[0], was[1] * share + gain[1]
        speed, most = math.sqrt(vx * vx + vy * vy), drag * self.dt
        kept = 1.0 - most / speed if speed > most else 0.0
        return vx * kept, vy * kept

    def _push(self, ball: TableBall, gain: Vector, share: float) -> None:
        """Add a push to the damped velocity (m/s), unless friction holds the ball at rest."""
        path, surface = self.engine.paths[ball.number], self.engine.surfaces[ball.number]
        (gx, gy), ((x, y, vx, vy), roll) = gain, self.state_of(ball.number)
        # A ball that rolls keeps 5/7 of a push.
        holds = min(surface.pull, surface.drag / (1.0 - SHARE)) * self.dt
        if path.slows and vx == vy == 0.0 and math.sqrt(gx * gx + gy * gy) <= holds:
            ball.body.velocity = NOTHING
            return
        velocity = vx * share + gx, vy * share + gy
        move = Moves(x, y, *velocity)
        if not is_sound(ball, move, self.end_of_step()):
            self.carry(ball)
            check_sound(ball, move, self.end_of_step())
        self.begin_path(ball, (x, y), velocity, roll)
        self.set_out([ball])
