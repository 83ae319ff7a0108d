"""A ball's path from one contact to the next, and when two paths meet.

A path is a straight line, slid along in closed form (:mod:`pool_pymunk.physics.motion`); it may end
at rest. It is a NamedTuple of numbers, so that functions of paths are functions of numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pool_pymunk.physics.motion import (
    EPSILON,
    Vector,
    path_to_disc,
    pressing,
    slid,
    stopping_time,
    time_of_impact,
    time_to_slide,
)

LOST = 1e-3  # radii; a ball is lost that travels farther in one rounding error of the time
NOISE = 16.0 * EPSILON  # share of the speeds in a contact that may be rounding
BARELY = 0.9  # share of the least bounce; touching balls that close more slowly sink on


class Path(NamedTuple):
    """Position (m) and velocity (m/s) of a ball at time ``t`` (s), and all that follows from them.

    ``ux``, ``uy`` are the unit vector of the velocity; ``stop`` (s) is when the ball rests,
    infinite without friction; ``reach`` (m) is how far it comes, ``rest_x``, ``rest_y`` (m) where
    that is. ``noise`` (m/s) is how much of the velocity may be rounding.

    >>> path = set_off(1.0, (0.0, 0.0), (2.0, 0.0), deceleration=0.5)
    >>> path.stop, path.rest_x, path.at(2.0)
    (5.0, 4.0, ((1.75, 0.0), (1.5, 0.0)))
    """

    t: float
    x: float
    y: float
    vx: float
    vy: float
    speed: float
    ux: float
    uy: float
    deceleration: float
    stop: float
    reach: float
    rest_x: float
    rest_y: float
    noise: float

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Position and velocity at time ``t`` (s), not before the path began."""
        x, y, vx, vy = motion_at(self, t)
        return (x, y), (vx, vy)

    def time_at(self, length: float) -> float:
        """When (s) the ball has come ``length`` (m) along the path; infinite if it never does."""
        if length > self.reach or length == math.inf:
            return math.inf
        return self.t + time_to_slide(length, self.speed, self.deceleration)

    def is_lost(self, radius: float) -> bool:
        """Tell whether the ball is so fast, or so far off, that its contacts mean nothing.

        Within one rounding error of the time it travels more than ``LOST`` radii.
        """
        way = self.speed * EPSILON * self.t
        return not (way <= LOST * radius and math.isfinite(self.x + self.y + self.speed))


def set_off(
    t: float, position: Vector, velocity: Vector, deceleration: float, noise: float | None = None
) -> Path:
    """Make the path of a ball that sets off at ``t`` (s), or rests there.

    Without ``noise`` (m/s), the velocity is taken to be good to a few roundings.
    """
    (x, y), (vx, vy) = position, velocity
    speed = math.sqrt(vx * vx + vy * vy)
    if noise is None:
        noise = NOISE * speed
    if speed == 0.0:
        return Path(t, x, y, 0.0, 0.0, 0.0, 1.0, 0.0, deceleration, t, 0.0, x, y, noise)
    stop = t + stopping_time(speed, deceleration)
    rest_x, rest_y, reach = x, y, math.inf
    if deceleration > 0.0:
        reach = speed * speed / (2.0 * deceleration)
        time, _ = slid(speed, deceleration, math.inf)
        rest_x, rest_y = x + vx * time, y + vy * time
    return Path(t, x, y, vx, vy, speed, vx / speed, vy / speed, deceleration, stop,
                reach, rest_x, rest_y, noise)  # fmt: skip


def motion_at(path: Path, t: float) -> tuple[float, float, float, float]:
    """Position (m) and velocity (m/s) of a path's ball at ``t`` (s), not before it began."""
    if t >= path.stop:
        return path.rest_x, path.rest_y, 0.0, 0.0
    time, left = slid(path.speed, path.deceleration, t - path.t)
    return path.x + path.vx * time, path.y + path.vy * time, path.vx * left, path.vy * left


def pair_time(
    a: Path, b: Path, reach: float, since: float, until: float, contact_time: float = 0.0
) -> float:
    """When two balls meet, between ``since`` and ``until`` (s); infinite if they do not.

    ``reach`` is the sum of the radii (m). Each ball may stop on the way and rest. Of balls that
    have met, ``contact_time`` (s) is how long one contact of theirs takes where surface friction
    presses them together (:func:`least_bounce`).
    """
    first_stop = a.stop if a.stop < b.stop else b.stop
    if since < first_stop:
        t = _both_move(a, b, reach, since, min(until, first_stop), contact_time)
        if t < math.inf:
            return t
    mover, rester = (a, b) if b.stop <= a.stop else (b, a)
    if rester.stop == math.inf or mover.stop <= since:
        return math.inf
    t = _one_moves(mover, rester, reach)
    return t if since <= t <= until else math.inf


def _one_moves(mover: Path, rester: Path, reach: float) -> float:
    """When the mover meets the other at rest, from its stop on; infinite if it does not."""
    t, x, y, speed, left = mover.t, mover.x, mover.y, mover.speed, mover.reach
    if rester.stop > t:
        t = rester.stop
        x, y, vx, vy = motion_at(mover, t)
        speed = math.sqrt(vx * vx + vy * vy)
        left = _braking_distance(speed, mover.deceleration)
    offset = (rester.rest_x - x, rester.rest_y - y)
    length = path_to_disc(offset, (mover.ux, mover.uy), reach)
    return t + time_to_slide(length, speed, mover.deceleration) if length < left else math.inf


def _braking_distance(speed: float, deceleration: float) -> float:
    return speed * speed / (2.0 * deceleration) if deceleration > 0.0 else math.inf


def _both_move(
    a: Path, b: Path, reach: float, since: float, until: float, contact_time: float
) -> float:
    offset, velocity, pull = _relative(a, b, since)
    noise = max(a.noise, b.noise) + NOISE * (a.speed + b.speed)
    if contact_time > 0.0:
        (dx, dy), size = offset, abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) + reach
        if math.sqrt(dx * dx + dy * dy) - reach <= 16.0 * EPSILON * size:
            reach -= _allowed_penetration(offset, velocity, pull, reach, contact_time)
    return since + time_of_impact(offset, velocity, pull, reach, until - since, noise)


def _relative(a: Path, b: Path, t: float) -> tuple[Vector, Vector, Vector]:
    """Offset (m), velocity (m/s) and acceleration (m/s^2) of b relative to a while both move."""
    ax, ay, avx, avy = motion_at(a, t)
    bx, by, bvx, bvy = motion_at(b, t)
    pull = (a.deceleration * (a.ux - b.ux), a.deceleration * (a.uy - b.uy))
    return (bx - ax, by - ay), (bvx - avx, bvy - avy), pull


def least_bounce(a: Path, b: Path, t: float, contact_time: float) -> float:
    """The speed (m/s) at which touching balls part, so that they meet anew a contact time later.

    Surface friction may drive together two balls that touch and both move. They would touch
    without end, or hit each other infinitely often in finite time; with bounces of this least
    speed they hit each other once in every ``contact_time`` (s). Zero where they are driven apart.
    """
    if contact_time == 0.0 or t >= min(a.stop, b.stop):
        return 0.0
    offset, velocity, pull = _relative(a, b, t)
    return max(pressing(offset, velocity, pull), 0.0) * contact_time / 2.0


def _allowed_penetration(
    offset: Vector, velocity: Vector, pull: Vector, reach: float, contact_time: float
) -> float:
    """How far (m) balls that touch get nearer than ``reach`` until it is a hit.

    Balls that are pressed together, and close or part more slowly than ``BARELY`` the least bounce,
    fall on until they close as fast as that.
    """
    (dx, dy), (vx, vy) = offset, velocity
    distance = math.sqrt(dx * dx + dy * dy)
    rate = (dx * vx + dy * vy) / distance
    press = pressing(offset, velocity, pull)
    least = press * contact_time / 2.0
    if press <= 0.0 or abs(rate) >= BARELY * least:
        return 0.0
    return (least * least - rate * rate) / (2.0 * press) + max(reach - distance, 0.0)
