"""This module says what others have done to the velocities of balls in one step of pymunk."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.world.ball import Ball
from pool_pymunk.world.bodies import Moves

NOTHING = (0.0, 0.0)
# In a step pymunk's solver goes over all joints ten times, and each time rounds the velocity.
PUSH_ROUNDING = 64.0 * EPSILON


class Pushes:
    """These are the pushes of one step of ``dt`` (s): what springs, joints and collisions do.

    ``moves`` is how the bodies moved as the step began. ``kicks`` (m/s^2) are accelerations by
    gravity and forces, ``damping`` is the share of a velocity that the space's damping leaves, and
    ``pull`` (m/s^2) is surface friction. An uneven step is of another length than the one before.
    """

    def __init__(
        self,
        dt: float,
        moves: Mapping[int, Moves],
        kicks: dict[Ball, Vector],
        damping: float,
        pull: float,
        is_uneven: bool,
    ) -> None:
        self.dt = dt
        self.moves = moves
        self.kicks = kicks
        self.damping = damping
        self.pull = pull
        self.is_uneven = is_uneven
        self.felt: dict[Ball, Vector] = {}  # m/s
        self._damped_to: dict[Ball, Vector] = {}  # m/s, by the damping callback

    def damp(self, ball: Ball, velocity: Vector) -> Vector:
        """Return what a ball carries that the damping callback gives this velocity (m/s).

        What springs and joints have given it before in this step is added.
        """
        self._damped_to[ball] = velocity
        began = self.moves.get(ball.id)
        if began is None:
            return velocity
        x, y = ball.body.velocity
        return velocity[0] + x - began[2], velocity[1] + y - began[3]

    def silence(self, ball: Ball) -> None:
        """Let nothing of this step act on a ball that was sent off in it."""
        self.felt[ball] = NOTHING
        self.kicks.pop(ball, None)

    def feel(self, ball: Ball) -> None:
        """Note what others than friction and forces have added to a velocity in this step.

        It is noted once, before the table itself changes the body's velocity.
        """
        began = None if ball in self.felt else self.moves.get(ball.id)
        if began is None:
            return
        bx, by = began[2:4]
        vx, vy = self._damped_to.get(ball) or self._without_others(ball, bx, by)
        wx, wy = ball.body.velocity
        speed = abs(bx) + abs(by) + abs(vx) + abs(vy) + abs(wx) + abs(wy)
        is_pushed = abs(wx - vx) + abs(wy - vy) > PUSH_ROUNDING * speed
        self.felt[ball] = (wx - vx, wy - vy) if is_pushed else NOTHING

    def _without_others(self, ball: Ball, bx: float, by: float) -> Vector:
        """Return the velocity (m/s) that forces and the friction joint make of another one."""
        (ax, ay), dt = self.kicks.get(ball, NOTHING), self.dt
        vx, vy = bx * self.damping + ax * dt, by * self.damping + ay * dt
        if ball.joint is None:
            return vx, vy
        most, speed = self.pull * dt, math.sqrt(vx * vx + vy * vy)
        left = 1.0 - most / speed if speed > most else 0.0
        return vx * left, vy * left

    def gain(self, ball: Ball) -> tuple[Vector, float]:
        """Return what a ball gains (m/s) in this step, and the share of its velocity that stays."""
        (px, py), kick = self.felt.get(ball, NOTHING), self.kicks.get(ball)
        if kick is None:
            return (px, py), 1.0
        return (kick[0] * self.dt + px, kick[1] * self.dt + py), self.damping
