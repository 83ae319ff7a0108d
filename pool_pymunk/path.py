"""A ball's path from one contact to the next, and when paths meet.

A path is a straight line, slid along in closed form (:mod:`pool_pymunk.motion`); it may end at
rest. Walls are faces (one side of a straight cushion) and posts (round things and corners).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pool_pymunk.motion import (
    Vector,
    path_to_disc,
    pressing,
    slide,
    stopping_time,
    time_of_impact,
    time_to_slide,
)

EPSILON = 2.0**-52
LOST = 1e-3  # radii; who comes so far in a rounding error of the time is lost
GRAZING = 1e-12  # a ball that touches a face and moves along it sinks by less than this share


class Path:
    """Position (m) and velocity (m/s) at time ``t`` (s), and all that follows from them.

    ``stop`` is when the ball rests (infinite without friction), ``rest`` where, ``reach`` how far
    that is; ``direction`` is the unit vector of the velocity.

    >>> path = Path(1.0, (0.0, 0.0), (2.0, 0.0), deceleration=0.5)
    >>> path.stop, path.rest, path.at(2.0)
    (5.0, (4.0, 0.0), ((1.75, 0.0), (1.5, 0.0)))
    """

    __slots__ = (
        "deceleration",
        "direction",
        "position",
        "reach",
        "rest",
        "speed",
        "stop",
        "t",
        "velocity",
    )

    def __init__(self, t: float, position: Vector, velocity: Vector, deceleration: float) -> None:
        self.t = t
        self.position = self.rest = position
        self.velocity = velocity
        self.deceleration = deceleration
        speed = self.speed = math.hypot(*velocity)
        self.stop = t + stopping_time(speed, deceleration)
        self.reach = 0.0
        self.direction = (1.0, 0.0)
        if speed > 0.0:
            self.direction = (velocity[0] / speed, velocity[1] / speed)
            self.reach = math.inf
            if deceleration > 0.0:
                self.reach = speed * speed / (2.0 * deceleration)
                self.rest = self.at(self.stop)[0]

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Position and velocity at time ``t`` (s), not before the path began."""
        x, y, vx, vy = slide(*self.position, *self.velocity, self.deceleration, t - self.t)
        return (x, y), (vx, vy)

    def time_at(self, length: float) -> float:
        """When (s) the ball has come ``length`` (m) along the path; infinite if it never does."""
        if length > self.reach or length == math.inf:
            return math.inf
        return self.t + time_to_slide(length, self.speed, self.deceleration)

    def is_lost(self, radius: float) -> bool:
        """Whether the ball is too fast, or where no numbers are, for its contacts to mean anything.

        It is where in a rounding error of the time it comes as far as a share of its ``radius``.
        """
        way = self.speed * EPSILON * self.t
        return not (math.isfinite(sum(self.position) + self.speed) and way <= LOST * radius)


class Face(NamedTuple):
    """One side of a straight cushion: its ends' span along ``tangent``, and its unit ``normal``.

    ``start`` lies on the cushion's middle line, ``radius`` (m) is half its thickness.
    """

    start: Vector
    tangent: Vector
    normal: Vector
    length: float
    radius: float = 0.0

    def height(self, point: Vector) -> float:
        """Distance (m) of a point from the middle line, on this side positive."""
        return (point[0] - self.start[0]) * self.normal[0] + (
            point[1] - self.start[1]
        ) * self.normal[1]

    def along(self, point: Vector) -> float:
        """Where the point's foot lies: 0 at the start, ``length`` at the end (m)."""
        return (point[0] - self.start[0]) * self.tangent[0] + (
            point[1] - self.start[1]
        ) * self.tangent[1]


class Post(NamedTuple):
    """A round wall, or with radius 0 a corner."""

    center: Vector
    radius: float = 0.0


def face_length(path: Path, r: float, face: Face) -> float:
    """Path length (m) after which a ball of radius ``r`` meets a face; infinite if it does not."""
    x, y = path.position
    ux, uy = path.direction
    sink = -(ux * face.normal[0] + uy * face.normal[1])
    if sink <= 0.0 or path.speed == 0.0:
        return math.inf
    height = face.height(path.position)
    gap = height - r - face.radius
    if height < 0.0 or (gap <= EPSILON * (abs(x) + abs(y) + r) and sink < GRAZING):
        return math.inf
    length = max(gap / sink, 0.0)
    foot = face.along((x + ux * length, y + uy * length))
    slack = GRAZING * face.length
    return length if -slack <= foot <= face.length + slack else math.inf


def post_length(path: Path, r: float, post: Post) -> float:
    """Path length (m) after which a ball of radius ``r`` meets a post; infinite if it does not.

    A path that is tangent to rounding does not: a ball that slides along a cushion goes past its
    end.
    """
    if path.speed == 0.0:
        return math.inf
    (x, y), (ux, uy) = path.position, path.direction
    dx, dy = post.center[0] - x, post.center[1] - y
    rounding = 8.0 * EPSILON * (abs(x) + abs(y) + r)
    reach = r + post.radius - rounding
    if dx * ux + dy * uy <= GRAZING * reach and math.hypot(dx, dy) <= reach + 2.0 * rounding:
        return math.inf
    return path_to_disc((dx, dy), path.direction, reach)


class Past(NamedTuple):
    """What earlier hits left of two balls.

    ``noise`` (m/s) is what rounding did to their velocities; of ``contact_time`` (s), 0 for balls
    that have not met, see :func:`least_bounce`.
    """

    noise: float = 0.0
    contact_time: float = 0.0


NO_PAST = Past()


def pair_time(
    a: Path,
    b: Path,
    reach: float,
    since: float,
    until: float,
    past: Past = NO_PAST,
) -> float:
    """When two balls meet, between ``since`` and ``until`` (s); infinite if they do not.

    ``reach`` is the sum of the radii (m). Each ball may stop on the way and rest.
    """
    first_stop = min(a.stop, b.stop)
    if since < first_stop:
        t = _both_move(a, b, reach, since, min(until, first_stop), past)
        if t < math.inf:
            return t
    mover, rester = (a, b) if b.stop <= a.stop else (b, a)
    if rester.stop == math.inf or mover.stop <= since:
        return math.inf
    t = _one_moves(mover, rester, reach)
    return t if since <= t <= until else math.inf


def _one_moves(mover: Path, rester: Path, reach: float) -> float:
    """When the mover meets the other at rest, from its stop on; infinite if it does not."""
    path = mover
    if rester.stop > mover.t:
        path = Path(rester.stop, *mover.at(rester.stop), mover.deceleration)
    offset = (rester.rest[0] - path.position[0], rester.rest[1] - path.position[1])
    length = path_to_disc(offset, path.direction, reach)
    return path.time_at(length) if length < path.reach else math.inf


def _both_move(a: Path, b: Path, reach: float, since: float, until: float, past: Past) -> float:
    offset, velocity, pull = motion = _relative(a, b, since)
    noise = past.noise + 16.0 * EPSILON * (a.speed + b.speed)
    if past.contact_time > 0.0 and math.hypot(*offset) - reach <= 16.0 * EPSILON * (
        sum(map(abs, a.position)) + sum(map(abs, b.position)) + reach
    ):
        reach -= _give(motion, reach, past.contact_time)
    return since + time_of_impact(offset, velocity, pull, reach, until - since, noise)


def _relative(a: Path, b: Path, t: float) -> tuple[Vector, Vector, Vector]:
    """Offset (m), velocity (m/s) and acceleration (m/s^2) of b relative to a while both move."""
    ((ax, ay), (avx, avy)), ((bx, by), (bvx, bvy)) = a.at(t), b.at(t)
    (aux, auy), (bux, buy) = a.direction, b.direction
    pull = (a.deceleration * (aux - bux), a.deceleration * (auy - buy))
    return (bx - ax, by - ay), (bvx - avx, bvy - avy), pull


def least_bounce(a: Path, b: Path, t: float, contact_time: float) -> float:
    """The speed (m/s) at which touching balls part, so that they meet anew a contact time later.

    Surface friction may drive together two balls that touch and both move. They would touch
    without end, or hit each other infinitely often in finite time; with bounces of this least
    speed they hit each other once in every ``contact_time`` (s). Zero where they are driven apart.
    """
    if contact_time == 0.0 or t >= min(a.stop, b.stop):
        return 0.0
    return max(pressing(*_relative(a, b, t)), 0.0) * contact_time / 2.0


def _give(motion: tuple[Vector, Vector, Vector], reach: float, contact_time: float) -> float:
    """How far (m) touching balls get nearer than ``reach`` until it is a hit.

    Balls that are pressed together and close more slowly than :func:`least_bounce` fall on until
    they do not.
    """
    (dx, dy), (vx, vy), _ = motion
    distance = math.hypot(dx, dy)
    rate = (dx * vx + dy * vy) / distance
    press = pressing(*motion)
    least = press * contact_time / 2.0
    if press <= 0.0 or abs(rate) >= 0.99 * least:
        return 0.0
    return (least * least - rate * rate) / (2.0 * press) + max(reach - distance, 0.0)
