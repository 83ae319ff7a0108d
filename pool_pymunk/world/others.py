"""This module follows what others in a shared space do to the balls.

Between two steps somebody may set a velocity or a place: that is found when the next step begins,
and the ball's path begins anew. In a step, gravity, damping and forces change velocities, and so do
springs, joints, and collisions with shapes that are not the table's. All of this acts once, as a
kick at the step's end, so it is right to first order in the step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.world.ball import Ball
from pool_pymunk.world.bodies import Bodies, Moves, Snapshot
from pool_pymunk.world.checks import check_step
from pool_pymunk.world.state import NOTHING, Phase, State
from pool_pymunk.world.steps import Steps
from pool_pymunk.world.telling import Callbacks
from pool_pymunk.world.walls import Walls

# A place or velocity set by hand differs from that of the path by more than this share. What
# differs less is a push: it is added to what the path says.
SET = 1e-9
# A step of pymunk rounds a velocity by less than this share of it, and a place too: some operations
# round by half an EPSILON each.
STEP_ROUNDING = 4.0 * EPSILON
# In a step pymunk's solver goes over all joints ten times, and each time rounds the velocity.
PUSH_ROUNDING = 64.0 * EPSILON


class Acts(NamedTuple):
    """These are what acts on balls in one step.

    It ``began`` (s) with these bodies ``before`` it on these ``paths``, and is ``dt`` (s) long.
    ``kicks`` (m/s^2) are accelerations by gravity and forces; ``damping`` is the share of a
    velocity that the space's damping leaves. Pushes are looked for ``on_all`` balls, or on those
    that the table has put on their paths: the velocities of the other bodies still have them.
    """

    began: float
    dt: float
    before: Snapshot
    paths: tuple[Path, ...]
    kicks: dict[Ball, Vector]
    damping: float
    on_all: bool
    may_sleep: bool


class SharedSteps(Steps):
    """These are the steps of a space that balls share with others.

    ``space.step(dt)`` goes through here: the table looks at the bodies before pymunk steps them,
    and answers the step when pymunk has made it, before all other callbacks after a step.
    """

    def __init__(self, state: State, walls: Walls, callbacks: Callbacks) -> None:
        super().__init__(state, walls, callbacks)
        self._bodies = Bodies(state.space)
        # the bodies when all balls were last seen to be on their paths, and which of them are balls
        self._seen = Snapshot()
        self._rows: Sequence[Moves | None] = ()
        self._balls: list[Ball | None] = []
        self._entries = 0  # of balls, until then
        self._forces: dict[Ball, Vector] = {}  # N, on balls then

    # -- between two steps -----------------------------------------------------------------------

    def catch_up(self) -> None:
        """Follow what has happened to the balls since the last step."""
        now, state = self._bodies.read(), self.state
        if state.entries != self._entries or now.members != self._seen.members:
            state.drop_lost()
            now = self._bodies.read()
            ball_of = {ball.id: ball for ball in state.ball_of.values()}
            self._balls = [ball_of.get(body) for body in now.body_ids]
            self._rows = [None] * len(self._balls)
            self._forces.clear()
        elif now.numbers == self._seen.numbers:
            return
        rows = now.rows()
        moved = [
            ball
            for ball, move, was in zip(self._balls, rows, self._rows, strict=True)
            if move != was and ball is not None and self._follow(ball, move)
        ]
        self._seen, self._rows, self._entries = now, rows, state.entries
        if moved:
            state.set_out(moved)
            self.catch_up()  # It sees them on their paths.

    def _follow(self, ball: Ball, move: Moves) -> bool:
        """Give a ball a new path if it is not on its own, and tell so: somebody has moved it."""
        x, y, vx, vy, fx, fy = move
        if fx != 0.0 or fy != 0.0:
            self._forces[ball] = fx, fy
        elif self._forces:
            self._forces.pop(ball, None)
        state, path = self.state, self.state.engine.paths[ball.number]
        px, py, pvx, pvy = motion_at(path, state.time)
        ex, ey = state.mean_of(path, path.end - state.time, pvx, pvy)
        off, gain = abs(x - px) + abs(y - py), abs(vx - ex) + abs(vy - ey)
        least = STEP_ROUNDING if path.end > state.time else 0.0
        if off <= least * (abs(x) + abs(y)) and gain <= least * (abs(ex) + abs(ey)):
            return False
        share, late = self._rounding(path)
        size = abs(x) + abs(y) + path.speed * (state.time - path.t) + ball.radius
        is_there = off <= share * size + late * path.speed
        is_as_fast = gain <= share * path.speed + late * state.surface.pull
        if is_there and is_as_fast:
            return False
        if is_as_fast:  # Only its place is new.
            vx, vy = pvx, pvy
        elif gain <= SET * (abs(vx) + abs(vy) + abs(ex) + abs(ey)):
            vx, vy = pvx + vx - ex, pvy + vy - ey
        place = (px, py) if is_there else state.beside(ball, x, y)
        state.begin_path(ball, place, (vx, vy))
        return True

    def _rounding(self, path: Path) -> tuple[float, float]:
        """Return what may hide whether a ball is on its path; nothing hides it for one that rests.

        pymunk rounds position and velocity by this share of them in all its steps along the path,
        and the clock is rounded (s).
        """
        state = self.state
        if path.end <= state.time:
            return 0.0, 0.0
        steps = 2.0 + min((state.time - path.t) / state.dt, state.count)
        return STEP_ROUNDING * steps, 2.0 * EPSILON * state.time

    # -- a step ----------------------------------------------------------------------------------

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        if dt == 0.0:  # It is no step to pymunk, either.
            return
        state = self.state
        self.refuse_in_step("dt", dt)
        check_step(dt, state.max_dt)
        self.catch_up()
        if is_uneven := dt != state.dt:
            state.take_steps_of(dt)
            state.renew_joints()
            self._seen = self._bodies.read()
            self._rows = self._seen.rows()
        state.begin_step()
        state.space.add_post_step_callback(self._end, self, dt, is_uneven)
        try:
            self._pymunk_step(dt)
        finally:
            state.phase = Phase.BETWEEN
        state.raise_noted()

    def _end(self, _space: object, _key: object, dt: float, is_uneven: bool) -> None:
        """Answer this step, and let then act what others did in it."""
        state, space = self.state, self.state.space
        if state.phase is not Phase.STEPPING:
            return
        try:
            may_sleep = space.sleep_time_threshold < math.inf
            on_all = is_uneven or may_sleep or len(space.constraints) > state.joints
            damping, kicks = space.damping, self._kicks(space.gravity, space.damping)
            if self.is_bare() and not on_all and not kicks:
                state.tick()
                return
            share = damping**dt if damping != 1.0 else 1.0
            paths, after = tuple(state.engine.paths), self._bodies.read()
            acts = Acts(state.time, dt, self._seen, paths, kicks, share, on_all, may_sleep)
            self.answer()
            state.phase = Phase.BETWEEN
            self._let_act(acts, after)
        except Exception as error:
            state.note(error)
        finally:
            state.phase = Phase.BETWEEN

    def _kicks(self, gravity: Vector, damping: float) -> dict[Ball, Vector]:
        """Return the accelerations (m/s^2) of balls by gravity and forces, where there are any."""
        (gx, gy), masses, forces = gravity, self.state.engine.masses, self._forces
        falls = gx != 0.0 or gy != 0.0 or damping != 1.0
        kicks = {}
        for ball in self.state.ball_of.values() if falls else forces:
            (fx, fy), mass = forces.get(ball, NOTHING), masses[ball.number]
            kicks[ball] = (gx + fx / mass, gy + fy / mass)
        return kicks

    def _let_act(self, acts: Acts, after: Snapshot) -> None:
        """Let act, once each, what others did in a step of pymunk, after which bodies moved so."""
        state = self.state
        balls = state.ball_of.values() if acts.on_all else (*acts.kicks, *state.carried)
        before, moves = (acts.before.moves(), after.moves()) if balls else ({}, {})
        for ball in dict.fromkeys(balls):
            is_known = ball.id in before and ball.id in moves
            if ball.is_on_table and is_known and ball not in state.sent_off:
                push = self._push(ball, acts, before[ball.id], moves[ball.id])
                if ball in acts.kicks or push != NOTHING:
                    self._kick(ball, acts, push)
        if acts.may_sleep:
            for ball in state.moving.values():
                ball.body.activate()  # A ball that moves must not fall asleep.
            state.carry_all()

    def _push(self, ball: Ball, acts: Acts, before: Moves, after: Moves) -> Vector:
        """Return what others than friction and forces have added to a velocity (m/s)."""
        (_, _, bx, by, _, _), (_, _, wx, wy, _, _) = before, after
        path, pull = acts.paths[ball.number], self.state.surface.pull
        slides = pull > 0.0 and path.end > acts.began
        if slides and not self.state.has_joints:
            vx, vy = self.state.mean_velocity(path, self.state.time)
        else:
            (ax, ay), most = acts.kicks.get(ball, NOTHING), pull * acts.dt if slides else 0.0
            vx, vy = bx * acts.damping + ax * acts.dt, by * acts.damping + ay * acts.dt
            speed = math.sqrt(vx * vx + vy * vy)
            left = 1.0 - most / speed if speed > most else 0.0
            vx, vy = vx * left, vy * left
        sizes = abs(bx) + abs(by) + abs(vx) + abs(vy) + abs(wx) + abs(wy)
        is_pushed = abs(wx - vx) + abs(wy - vy) > PUSH_ROUNDING * sizes
        return (wx - vx, wy - vy) if is_pushed else NOTHING

    def _kick(self, ball: Ball, acts: Acts, push: Vector) -> None:
        """Change a velocity by forces and by a push (m/s).

        Surface friction holds a ball at rest against as much as its own deceleration.
        """
        state, kick = self.state, acts.kicks.get(ball)
        (ax, ay), share = kick or NOTHING, acts.damping if kick else 1.0
        gain_x, gain_y = ax * acts.dt + push[0], ay * acts.dt + push[1]
        x, y, vx, vy = motion_at(state.engine.paths[ball.number], state.time)
        most = state.surface.pull * acts.dt
        if vx == vy == 0.0 and math.sqrt(gain_x * gain_x + gain_y * gain_y) <= most:
            ball.body.velocity = NOTHING
            return
        state.begin_path(ball, (x, y), (vx * share + gain_x, vy * share + gain_y))
        state.set_out([ball])

    def _check_walls(self) -> None:
        """Refuse this step if a wall has moved, and put the balls back on their paths."""
        try:
            self.walls.refuse_moved()
        except ValueError:
            for ball in self.state.on_table():
                self.state.carry(ball)
            raise
