"""This module describes a ball's path between contacts, and finds when two paths meet.

On a path the acceleration is constant (:mod:`pool_pymunk.physics.motion`). A path is a NamedTuple
of numbers, so functions of paths are functions of numbers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pool_pymunk.physics.motion import (
    EPSILON,
    Vector,
    path_to_disc,
    stopping_time,
    time_of_impact,
    time_to_leave,
    time_to_slide,
)

# A path passes a ball by if its distance squared is this many times that of touching balls. A
# nearer one is looked at in full precision. Half or twice the excess over 1 gives the same ends.
FAR_OFF = 1.001
# radii; a ball is lost that travels farther within one rounding error of the time, because contacts
# are then known to a thousandth of a radius at best.
LOST = 1e-3
# This share of the speeds in a contact may be rounding: splitting a velocity, the law, and joining
# its parts are a dozen roundings.
NOISE = 16.0 * EPSILON
# A path that leads into a disc by less than this share of its speed is tangent: rounding of a place
# on a circle, 1e-16 to 1e-13 of the radius, turns the normal by as much.
SLIGHT = 1e-12


HAIR = 1e-9  # of coordinates; bounds have this margin, far above rounding


class Path(NamedTuple):
    """A path is the motion of a ball from time ``t`` (s) to its ``end`` (s).

    It begins at a position (m) with a velocity (m/s), and its acceleration (m/s^2) is constant. The
    end is infinite for a ball that goes on without end. A path that ``slows`` runs straight and
    slows to rest. Other paths may bend, and at their end another one follows. (``wx``, ``wy``) is
    the roll (m/s) at the beginning; it is 0 where balls do not roll.

    >>> path = set_off(1.0, (0.0, 0.0), (2.0, 0.0), 0.5)
    >>> path.end, path.at(2.0), path.at(9.0)
    (5.0, ((1.75, 0.0), (1.5, 0.0)), ((4.0, 0.0), (0.0, 0.0)))
    """

    t: float
    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
    end: float
    slows: bool = True
    wx: float = 0.0
    wy: float = 0.0

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return position and velocity at time ``t`` (s), not before the path began."""
        x, y, vx, vy = motion_at(self, t)
        return (x, y), (vx, vy)

    @property
    def rest(self) -> Vector:
        """Where the path ends (m); where it begins if it goes on without end."""
        return self.at(self.end)[0] if self.end < math.inf else (self.x, self.y)

    @property
    def speed(self) -> float:
        """The speed (m/s) at the beginning."""
        return speed_of(self)

    @property
    def fastest(self) -> float:
        """The highest speed (m/s) on the path, or that at the beginning if it has no end."""
        return fastest_of(self)

    @property
    def ux(self) -> float:
        """The part along x of the unit vector of the velocity at the beginning."""
        return self.vx / self.speed if self.speed > 0.0 else 1.0

    @property
    def uy(self) -> float:
        """The part along y of the unit vector of the velocity at the beginning."""
        return self.vy / self.speed if self.speed > 0.0 else 0.0

    @property
    def moves(self) -> bool:
        """Tell whether the ball moves, or sets off."""
        return sets_off(self)

    def is_lost(self, radius: float) -> bool:
        """Tell whether one rounding error of the time moves the ball by ``LOST`` radii."""
        is_finite = math.isfinite(self.x + self.y)
        return not is_finite or is_too_fast((self.vx, self.vy), radius, self.t)


def is_too_fast(velocity: Vector, radius: float, t: float) -> bool:
    """Tell whether a rounding error of the time (s) moves a ball (m, m/s) by ``LOST`` radii.

    >>> is_too_fast((1e9, 0.0), 0.03, 1.0), is_too_fast((1e12, 0.0), 0.03, 1.0)
    (False, True)
    """
    speed = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1])
    return not (speed * EPSILON * t <= LOST * radius and speed < math.inf)


def speed_of(path: Path) -> float:
    """Return the speed (m/s) at the beginning of a path."""
    vx, vy = path.vx, path.vy
    return math.sqrt(vx * vx + vy * vy)


def fastest_of(path: Path) -> float:
    """Return the highest speed (m/s) on a path, or that at the beginning if it has no end."""
    vx, vy = path.vx, path.vy
    speed = math.sqrt(vx * vx + vy * vy)
    if path.slows or path.end == math.inf:
        return speed
    _, _, vx, vy = motion_at(path, path.end)
    return max(speed, math.sqrt(vx * vx + vy * vy))


def bound_of(path: Path) -> float:
    """Return a speed (m/s) that is not exceeded on a path, and is 0 for a ball that rests."""
    fastest = fastest_of(path)
    return fastest if fastest > 0.0 or path.slows else math.inf


def sets_off(path: Path) -> bool:
    """Tell whether the ball of a path moves, or sets off."""
    return path.vx != 0.0 or path.vy != 0.0 or path.ax != 0.0 or path.ay != 0.0


def pull_of(path: Path) -> float:
    """Return the size (m/s^2) of a path's acceleration."""
    ax, ay = path.ax, path.ay
    return math.sqrt(ax * ax + ay * ay)


def set_off(t: float, position: Vector, velocity: Vector, pull: float) -> Path:
    """Return the path of a ball that slides from ``t`` (s) on, and slows down (Eq. 10)."""
    (x, y), (vx, vy) = position, velocity
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        return standing(t, x, y)
    drag, end = pull / speed, t + stopping_time(speed, pull)
    return Path(t, x, y, vx, vy, -drag * vx, -drag * vy, end, True, 0.0, 0.0)


def standing(t: float, x: float, y: float) -> Path:
    """Return the path of a ball that rests."""
    return Path(t, x, y, 0.0, 0.0, 0.0, 0.0, t, True, 0.0, 0.0)


def from_breakpoint(
    t: float, x: float, y: float, vx: float, vy: float, ax: float, ay: float
) -> Path:
    """Return the path from a breakpoint on; another breakpoint ends it."""
    return Path(t, x, y, vx, vy, ax, ay, math.inf, False, 0.0, 0.0)


def motion_at(path: Path, t: float) -> tuple[float, float, float, float]:
    """Return position (m) and velocity (m/s) of a path's ball at ``t`` (s), not before it began."""
    began, x, y, vx, vy, ax, ay, end, slows, _, _ = path
    time = (t if t < end else end) - began
    if t < end or not slows:
        ux, uy = vx + time * ax, vy + time * ay
    else:
        ux = uy = 0.0
    return x + time * (vx + time * ax / 2.0), y + time * (vy + time * ay / 2.0), ux, uy


def arrival(path: Path, length: float, now: float) -> float:
    """Return when (s), not before now, a ball that slows to rest has travelled ``length`` (m)."""
    t = path.t + time_to_slide(length, speed_of(path), pull_of(path))
    return t if t > now else now


def disc_time(path: Path, center: Vector, touching: float, now: float) -> float:
    """Return when (s), not before now, a ball comes as near as ``touching`` (m) to a place (m)."""
    vx, vy, dx, dy = path.vx, path.vy, center[0] - path.x, center[1] - path.y
    if not path.slows:
        time, noise = path.end - path.t, SLIGHT * speed_of(path)
        velocity, pull = (-vx, -vy), (-path.ax, -path.ay)
        t = path.t + time_of_impact((dx, dy), velocity, pull, touching, time, noise)
        return t if t > now else now
    if dx * vx + dy * vy <= 0.0:
        return math.inf
    speed = math.sqrt(vx * vx + vy * vy)
    length = path_to_disc((dx, dy), (vx / speed, vy / speed), touching)
    return arrival(path, length, now) if length < math.inf else math.inf


def time_out(path: Path, center: Vector, touching: float, deepest: float, since: float) -> float:
    """Return when (s), not before ``since``, a ball is farther from a place than ``touching`` (m).

    Its path is bent. A ball that is as far, but not farther than ``deepest`` (m), leaves at once
    unless it moves in.
    """
    x, y, vx, vy = motion_at(path, since)
    dx, dy = center[0] - x, center[1] - y
    if dx * dx + dy * dy > deepest * deepest:
        since = time_in(path, center, touching, since)
        if since == math.inf:
            return since
        x, y, vx, vy = motion_at(path, since)
        dx, dy = center[0] - x, center[1] - y
    pull = -path.ax, -path.ay
    return since + time_to_leave((dx, dy), (-vx, -vy), pull, touching, path.end - since)


def time_in(path: Path, center: Vector, touching: float, since: float) -> float:
    """Return when (s), from ``since`` on, a bent path comes within ``touching`` (m) of a place."""
    x, y, vx, vy = motion_at(path, since)
    offset, time, noise = (center[0] - x, center[1] - y), path.end - since, SLIGHT * speed_of(path)
    return since + time_of_impact(offset, (-vx, -vy), (-path.ax, -path.ay), touching, time, noise)
