"""This module moves walls as their kinematic bodies do, and keeps balls out of them.

pymunk carries such a body along its velocity in each step. The table plans the same motion before
the step, and asks which balls the wall may meet.
"""

from __future__ import annotations

import math

import pymunk

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.moving import Moving, angle_at, frame_at
from pool_pymunk.world.ball import HAIR
from pool_pymunk.world.checks import check_motion


class Mover:
    """A mover is a wall whose body moves: the body, its shape, and the wall's only side."""

    def __init__(self, body: pymunk.Body, shape: pymunk.Shape, side: Moving, number: int) -> None:
        self.body, self.shape, self.side, self.number = body, shape, side, number
        # the place, the angle and the velocities after the last step
        self._expected: tuple[Vector, float, Vector, float] | None = None
        self._end = 0.0  # s; where pymunk's step takes the body

    def pose(self) -> tuple[Vector, float]:
        """Return the place (m) of the body's center of gravity, and its angle."""
        x, y = self.body.local_to_world(self.body.center_of_gravity)
        return (x, y), self.body.angle

    def stand(self) -> None:
        """Let the wall stand where its body is now, between two steps."""
        self.check()
        self.side.stand(*self.pose())
        self.shape.cache_bb()

    def plan(self, since: float, until: float, end: float) -> pymunk.BB:
        """Let the wall move with its body until a time (s); return the box that it sweeps (m).

        pymunk's step takes the body to where it is at the ``end`` (s).
        """
        self._end = end
        (place, angle), (vx, vy), turns = (
            self.pose(),
            self.body.velocity,
            self.body.angular_velocity,
        )
        self.side.move(place, angle, (vx, vy), turns, since, until)
        time = until - since
        box = self.shape.cache_bb()
        x, y = time * vx, time * vy
        if turns != 0.0:
            (px, py), far = place, 0.0
            for u in (box.left, box.right):
                for v in (box.bottom, box.top):
                    far = max(far, math.dist((u, v), place))
            box = pymunk.BB(px - far, py - far, px + far, py + far)
        hair = HAIR * (abs(place[0]) + abs(place[1]) + abs(x) + abs(y))
        return pymunk.BB(
            min(box.left, box.left + x) - hair, min(box.bottom, box.bottom + y) - hair,
            max(box.right, box.right + x) + hair, max(box.top, box.top + y) + hair,
        )  # fmt: skip

    def finish(self, t: float) -> None:
        """Let the wall stand at the end of a step, at a time (s) that may have cut it short."""
        if t < self._end:
            self.put_back(t)
        how = self.side.how
        self.stand()
        self._expected = (*self.pose(), (how.ux, how.uy), how.turns)

    def is_there(self) -> bool:
        """Tell whether the body is where the last step took it, and nobody has put it elsewhere."""
        return self._expected is not None and self.pose() == self._expected[:2]

    def goes_on(self) -> bool:
        """Tell whether the body goes on as in the last step."""
        (vx, vy), turns = self.body.velocity, self.body.angular_velocity
        return self.is_there() and self._expected[2:] == ((vx, vy), turns)  # type: ignore[index]

    def check(self) -> None:
        """Refuse numbers of the body that are not finite, or too large."""
        check_motion(self.number, self.body)

    def put_back(self, t: float) -> None:
        """Put the body where it is at a time (s) of its motion, which is cut short."""
        x, y, _, _ = frame_at(self.side.how, t)
        self.body.angle = angle_at(self.side.how, t)
        (px, py), _ = self.pose()
        bx, by = self.body.position
        self.body.position = bx + x - px, by + y - py
