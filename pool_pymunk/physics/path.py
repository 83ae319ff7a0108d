"""This module describes a ball's path between contacts, and finds when two paths meet.

A path is a straight line, along which the ball slides in closed form
(:mod:`pool_pymunk.physics.motion`). It may end at rest. It is a NamedTuple of numbers, so functions
of paths are functions of numbers.
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

LOST = 1e-3  # radii; a ball is lost that travels farther within one rounding error of the time
NOISE = 16.0 * EPSILON  # This share of the speeds in a contact may be rounding.
BARELY = 0.9  # of the least bounce: touching balls that close more slowly have no hit yet


class Lasting(NamedTuple):
    """A lasting contact is one of two balls that have met and that friction presses together.

    ``time`` (s) is how long one contact of theirs takes (:func:`least_bounce`); it is 0 for balls
    that have not met. Balls that touch and close more slowly than ``faint`` (m/s) meet a contact
    time later.
    """

    time: float = 0.0
    faint: float = 0.0


NOT_MET = Lasting()


class Path(NamedTuple):
    """A path is the position (m) and velocity (m/s) of a ball at time ``t`` (s).

    The other fields follow from these. ``ux``, ``uy`` are the unit vector of the velocity. ``stop``
    (s) is the time at which the ball comes to rest; it is infinite without friction. ``reach`` (m)
    is the length of the path, and ``rest_x``, ``rest_y`` (m) is its end. ``noise`` (m/s) is how
    much of the velocity may be rounding.

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
        """Return position and velocity at time ``t`` (s), not before the path began."""
        x, y, vx, vy = motion_at(self, t)
        return (x, y), (vx, vy)

    @property
    def acceleration(self) -> Vector:
        """The acceleration (m/s^2) of the ball up to the path's end."""
        drag = self.deceleration if self.speed > 0.0 else 0.0
        return -drag * self.ux, -drag * self.uy

    def is_lost(self, radius: float) -> bool:
        """Tell whether the ball is so fast, or so far off, that its contacts mean nothing.

        Within one rounding error of the time it travels more than ``LOST`` radii, or a number has
        overflowed.
        """
        way = self.speed * EPSILON * self.t
        return not (way <= LOST * radius and math.isfinite(self.x + self.y + self.speed))


def set_off(
    t: float, position: Vector, velocity: Vector, deceleration: float, noise: float | None = None
) -> Path:
    """Return the path of a ball that sets off at ``t`` (s), or rests there.

    Without ``noise`` (m/s), only a few rounding errors of the velocity are assumed.
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
    """Return position (m) and velocity (m/s) of a path's ball at ``t`` (s), not before it began."""
    if t >= path.stop:
        return path.rest_x, path.rest_y, 0.0, 0.0
    time, left = slid(path.speed, path.deceleration, t - path.t)
    return path.x + path.vx * time, path.y + path.vy * time, path.vx * left, path.vy * left


def arrival(path: Path, length: float, now: float) -> float:
    """Return the time (s), not before now, at which a ball has travelled ``length`` (m).

    It is infinite if the path is not so long.
    """
    if length >= path.reach:
        return math.inf
    t = path.t + time_to_slide(length, path.speed, path.deceleration)
    return t if t > now else now


def pair_time(
    a: Path,
    b: Path,
    reach: float,
    since: float,
    until: float,
    lasting: Lasting = NOT_MET,
) -> float:
    """Return the time (s) at which two balls meet; infinite if they do not.

    Look between ``since`` and ``until`` (s). ``reach`` is the sum of the radii (m). Each ball may
    stop on the way and rest. ``lasting`` is for balls that have met.
    """
    first_stop = a.stop if a.stop < b.stop else b.stop
    if since < first_stop:
        t = _both_move(a, b, reach, since, min(until, first_stop), lasting)
        if t < math.inf:
            return t
    mover, rester = (a, b) if b.stop <= a.stop else (b, a)
    if rester.stop == math.inf or mover.stop <= since:
        return math.inf
    t = _one_moves(mover, rester, reach)
    return t if since <= t <= until else math.inf


def _one_moves(mover: Path, rester: Path, reach: float) -> float:
    """Return the time (s) at which the mover meets the other, which rests; infinite if never."""
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
    a: Path,
    b: Path,
    reach: float,
    since: float,
    until: float,
    lasting: Lasting,
) -> float:
    offset, velocity, pull = _relative(a, b, since)
    noise = max(a.noise, b.noise) + NOISE * (a.speed + b.speed)
    if lasting.time > 0.0:
        (dx, dy), size = offset, abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) + reach
        if math.sqrt(dx * dx + dy * dy) - reach <= 16.0 * EPSILON * size:
            reach -= _allowed_penetration(offset, velocity, pull, reach, lasting)
    return since + time_of_impact(offset, velocity, pull, reach, until - since, noise)


def _relative(a: Path, b: Path, t: float) -> tuple[Vector, Vector, Vector]:
    """Return offset (m), velocity (m/s) and acceleration (m/s^2) of b relative to a.

    Both must still move at ``t`` (s).
    """
    ax, ay, avx, avy = motion_at(a, t)
    bx, by, bvx, bvy = motion_at(b, t)
    pull = (a.deceleration * (a.ux - b.ux), a.deceleration * (a.uy - b.uy))
    return (bx - ax, by - ay), (bvx - avx, bvy - avy), pull


def least_bounce(a: Path, b: Path, t: float, contact_time: float) -> float:
    """Return the speed (m/s) at which touching balls part, so that they meet a contact time later.

    Surface friction may drive together two balls that touch and both move. They would touch without
    end, or hit each other infinitely often in finite time. With bounces of this least speed they
    hit each other once in every ``contact_time`` (s). The speed is 0 where the balls are driven
    apart.
    """
    if contact_time == 0.0 or t >= min(a.stop, b.stop):
        return 0.0
    offset, velocity, pull = _relative(a, b, t)
    return max(pressing(offset, velocity, pull), 0.0) * contact_time / 2.0


def _allowed_penetration(
    offset: Vector,
    velocity: Vector,
    pull: Vector,
    reach: float,
    lasting: Lasting,
) -> float:
    """Return how far (m) touching balls get nearer than ``reach`` until they hit each other.

    Friction drives these balls together. If they close or part more slowly than ``BARELY`` times
    the least bounce, they get nearer until they close as fast as the least bounce. Balls that close
    faintly do so for a contact time. Otherwise the answer is 0.
    """
    (dx, dy), (vx, vy) = offset, velocity
    distance = math.sqrt(dx * dx + dy * dy)
    rate = (dx * vx + dy * vy) / distance
    drive = pressing(offset, velocity, pull)
    least = drive * lasting.time / 2.0
    if drive <= 0.0 or abs(rate) >= BARELY * least:
        sunk = max(reach - distance, 0.0)
        return sunk - rate * lasting.time if -lasting.faint < rate < 0.0 else 0.0
    return (least * least - rate * rate) / (2.0 * drive) + max(reach - distance, 0.0)
