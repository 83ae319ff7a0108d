"""This module follows what others in a shared space do to the balls.

Between two steps somebody may set a velocity or a place: that is found when the next step begins,
and the ball's path begins anew. In a step, gravity, damping and forces change velocities, and so do
springs, joints, and collisions with shapes that are not the table's. All of this acts once, as a
kick at the step's end, so it is right to first order in the step.
"""

from __future__ import annotations

import math

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import motion_at
from pool_pymunk.world.ball import Ball
from pool_pymunk.world.bodies import Bodies, Moves, Snapshot
from pool_pymunk.world.checks import check_step
from pool_pymunk.world.pushes import NOTHING, Pushes
from pool_pymunk.world.state import Phase, State
from pool_pymunk.world.steps import Steps
from pool_pymunk.world.telling import Callbacks
from pool_pymunk.world.walls import Walls

# A place or velocity set by hand differs from that of the path by more than this share. What
# differs less is a push: it is added to what the path says.
SET = 1e-9
# A step of pymunk rounds a velocity by less than this share of it, and a place too: some operations
# round by half an EPSILON each.
STEP_ROUNDING = 4.0 * EPSILON


class SharedSteps(Steps):
    """These are the steps of a space that balls share with others.

    ``space.step(dt)`` goes through here: the table looks at the bodies before pymunk steps them,
    and answers the step when pymunk has made it, before all other callbacks after a step.
    """

    def __init__(self, state: State, walls: Walls, callbacks: Callbacks) -> None:
        super().__init__(state, walls, callbacks)
        self._bodies = Bodies(state.space)
        # how the bodies moved when all balls were last seen to be on their paths
        self._seen, self._moves = Snapshot(), dict[int, Moves]()
        self._entries = 0  # of balls, until then
        self._forces: dict[Ball, Vector] = {}  # N, on balls then

    # -- between two steps -----------------------------------------------------------------------

    def catch_up(self) -> None:
        """Follow what has happened to the balls since the last step."""
        now, state = self._bodies.read(), self.state
        is_new = state.entries != self._entries
        if now == self._seen and not is_new:
            return
        if is_new or now.members != self._seen.members:
            state.drop_lost()
            now = self._bodies.read()
        before, moves, moved = self._moves, now.moves(), []
        self._forces = {}
        for ball in state.ball_of.values():
            move = moves[ball.id]
            if move[4] != 0.0 or move[5] != 0.0:
                self._forces[ball] = move[4:]
            is_new = ball.number in state.moving or move != before.get(ball.id)
            if is_new and self._follow(ball, move):
                moved.append(ball)
        state.set_out(moved)
        if moved:
            now = self._bodies.read()
            moves = now.moves()
        self._seen, self._moves, self._entries = now, moves, state.entries

    def _follow(self, ball: Ball, move: Moves) -> bool:
        """Give a ball a new path if it is not on its own, and tell so: somebody has moved it."""
        x, y, vx, vy, _, _ = move
        state, path = self.state, self.state.engine.paths[ball.number]
        px, py, pvx, pvy = motion_at(path, state.time)
        ex, ey = state.mean_velocity(path, state.time)
        off, gain = abs(x - px) + abs(y - py), abs(vx - ex) + abs(vy - ey)
        if off == gain == 0.0:
            return False
        rounding = STEP_ROUNDING * state.steps_on(path) if path.end > state.time else 0.0
        size = abs(x) + abs(y) + path.speed * (state.time - path.t) + ball.radius
        is_there, is_as_fast = off <= rounding * size, gain <= rounding * path.speed
        if is_there and is_as_fast:
            return False
        if is_as_fast:  # Only its place is new.
            vx, vy = pvx, pvy
        elif gain <= SET * (abs(vx) + abs(vy) + abs(ex) + abs(ey)):
            vx, vy = pvx + vx - ex, pvy + vy - ey
        place = (px, py) if is_there else state.beside(ball, x, y)
        state.begin_path(ball, place, (vx, vy))
        return True

    # -- a step ----------------------------------------------------------------------------------

    def step_of_space(self, dt: float) -> None:
        """Do what ``space.step(dt)`` does from now on."""
        if dt == 0.0:  # It is no step to pymunk, either.
            return
        state = self.state
        self.refuse_in_step("dt", dt)
        check_step(dt, state.max_dt)
        self._begin(dt)
        state.phase = Phase.STEPPING
        state.space.add_post_step_callback(self._end, self)
        try:
            self._pymunk_step(dt)
        finally:
            state.phase, state.pushes = Phase.BETWEEN, None
        state.raise_noted()

    def _begin(self, dt: float) -> None:
        """Follow the balls that others have moved, and note what acts on them in this step."""
        self.catch_up()
        state, space = self.state, self.state.space
        is_uneven, damping = dt != state.dt, space.damping
        if is_uneven:
            state.take_steps_of(dt)
            state.renew_joints()
            self.catch_up()
        gx, gy = space.gravity
        falls = gx != 0.0 or gy != 0.0 or damping != 1.0
        is_felt = self._has_joints_of_others() or space.sleep_time_threshold < math.inf
        if not (falls or is_felt or is_uneven or state.moving or self._forces):
            return
        masses, kicks = state.engine.masses, {}
        for ball in state.ball_of.values() if falls else self._forces:
            (fx, fy), mass = self._forces.get(ball, NOTHING), masses[ball.number]
            kicks[ball] = (gx + fx / mass, gy + fy / mass)
        pull = state.surface.pull
        state.pushes = Pushes(dt, self._moves, kicks, damping**dt, pull, is_uneven)

    def _has_joints_of_others(self) -> bool:
        return len(self.state.space.constraints) > self.state.joints

    def _end(self, *_: object) -> None:
        """Answer this step, and let then act what others did in it."""
        state = self.state
        if state.phase is not Phase.STEPPING:
            return
        try:
            self._answer_shared()
        except Exception as error:
            state.note(error)
        finally:
            state.phase, state.pushes = Phase.BETWEEN, None

    def _answer_shared(self) -> None:
        state, pushes = self.state, self.state.pushes
        if pushes is None:
            self.answer()
            return
        may_sleep = state.space.sleep_time_threshold < math.inf
        # What others do to the balls that are put on their paths would be lost.
        is_felt = pushes.is_uneven or may_sleep or self._has_joints_of_others()
        for ball in state.on_table() if is_felt else pushes.kicks:
            pushes.feel(ball)
        self.answer()
        # From now on velocities are what the table makes of them.
        state.phase, state.pushes = Phase.BETWEEN, None
        for ball in dict.fromkeys((*pushes.kicks, *pushes.felt)):
            if ball.is_on_table and (ball in pushes.kicks or pushes.felt[ball] != NOTHING):
                self._kick(ball, *pushes.gain(ball))
        for ball in state.moving.values() if may_sleep else ():
            ball.body.activate()  # A ball that moves must not fall asleep.
        if pushes.is_uneven or may_sleep:
            state.carry_all()

    def _kick(self, ball: Ball, gain: Vector, share: float) -> None:
        """Keep a ``share`` of a velocity, and add a ``gain`` (m/s).

        Surface friction holds a ball at rest against as much as its own deceleration.
        """
        state, (gain_x, gain_y) = self.state, gain
        x, y, vx, vy = motion_at(state.engine.paths[ball.number], state.time)
        most = state.surface.pull * state.dt
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
            self.state.pushes = None
            for ball in self.state.on_table():
                self.state.carry(ball)
            raise
