"""A path is the motion of a ball between two contacts: its acceleration is constant."""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.motion.times import (
    EPSILON,
    INF,
    Vector,
    path_to_disc,
    stopping_time,
    time_of_impact,
    time_to_leave,
    time_to_slide,
)

Motion = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)

# This share of the speeds in a contact may be rounding: splitting a velocity, the law, and joining
# its parts are a dozen roundings.
NOISE: Final = 16.0 * EPSILON
# A path that leads into a disc by less than this share of its speed is tangent: rounding of a place
# on a circle, 1e-16 to 1e-13 of the radius, turns the normal by as much.
SLIGHT: Final = 1e-12
# A path passes a ball by if its distance squared is this many times that of touching balls. A
# nearer one is looked at in full precision. Half or twice the excess over 1 gives the same ends.
FAR_OFF: Final = 1.001
# radii; a ball is lost that travels farther within one rounding error of the time, because contacts
# are then known to a thousandth of a radius at best.
LOST: Final = 1e-3


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Path:
    """A ball goes from time ``t`` (s) to ``end`` (s), with constant acceleration (m/s^2).

    It begins at a place (m) with a velocity (m/s). The end is infinite for a ball that goes on
    without end. A path that ``slows`` runs straight, and slows to rest at its end. Another one may
    bend, and at its end another path follows. (``wx``, ``wy``) is the roll (m/s) at the beginning;
    it is 0 where balls do not roll; ``speed`` (m/s) is the size of the velocity there. A
    :class:`~pool_pymunk.core.motion.surface.Surface` makes paths; walls and pairs of balls are
    asked when they meet one.

    >>> path = sliding(1.0, (0.0, 0.0), (2.0, 0.0), 0.5)
    >>> path.end, path.at(2.0), path.at(9.0)
    (5.0, (1.75, 0.0, 1.5, 0.0), (4.0, 0.0, 0.0, 0.0))
    """

    def __init__(
        self, t: float, x: float, y: float, vx: float, vy: float, ax: float, ay: float,
        end: float, slows: bool, wx: float, wy: float,
    ) -> None:  # fmt: skip
        self.t = t
        self.x, self.y = x, y
        self.vx, self.vy = vx, vy
        self.ax, self.ay = ax, ay
        self.end = end
        self.slows = slows
        self.speed = math.sqrt(vx * vx + vy * vy)
        self.wx, self.wy = wx, wy

    def at(self, t: float) -> Motion:
        """Return place (m) and velocity (m/s) at a time (s), not before the path began."""
        s = (t if t < self.end else self.end) - self.t
        x = self.x + s * (self.vx + s * self.ax / 2.0)
        y = self.y + s * (self.vy + s * self.ay / 2.0)
        if t < self.end or not self.slows:
            return x, y, self.vx + s * self.ax, self.vy + s * self.ay
        return x, y, 0.0, 0.0

    def place(self, t: float) -> Vector:
        """Return the place (m) at a time (s), not before the path began."""
        s = (t if t < self.end else self.end) - self.t
        return (
            self.x + s * (self.vx + s * self.ax / 2.0),
            self.y + s * (self.vy + s * self.ay / 2.0),
        )

    def velocity(self, t: float) -> Vector:
        """Return the velocity (m/s) at a time (s), not before the path began."""
        if t >= self.end and self.slows:
            return 0.0, 0.0
        s = (t if t < self.end else self.end) - self.t
        return self.vx + s * self.ax, self.vy + s * self.ay

    @property
    def pull(self) -> float:
        """The size (m/s^2) of the acceleration."""
        return math.sqrt(self.ax * self.ax + self.ay * self.ay)

    @property
    def fastest(self) -> float:
        """The highest speed (m/s) on the path, or that at the beginning if it has no end."""
        return self.fastest_until(self.end)

    def fastest_until(self, end: float) -> float:
        """Return the highest speed (m/s) until a time (s), or at the beginning if it is infinite.

        >>> falls = Path(0.0, 0.0, 9.0, 3.0, 0.0, 0.0, -10.0, INF, False, 0.0, 0.0)
        >>> falls.fastest_until(0.4), falls.fastest
        (5.0, 3.0)
        """
        speed = self.speed
        if self.slows or end == INF:
            return speed
        vx, vy = self.velocity(end)
        return max(speed, math.sqrt(vx * vx + vy * vy))

    @property
    def moves(self) -> bool:
        """This tells whether the ball moves, or sets off."""
        return self.vx != 0.0 or self.vy != 0.0 or self.ax != 0.0 or self.ay != 0.0

    def is_lost(self, radius: float) -> bool:
        """Tell whether one rounding error of the time moves the ball by ``LOST`` radii."""
        speed, size = self.speed, self.x + self.y
        is_finite = size - size == 0.0
        return not (is_finite and speed * EPSILON * self.t <= LOST * radius and speed < INF)

    # -- when it comes to a place ------------------------------------------------------------------

    def arrival(self, length: float, now: float) -> float:
        """Return when (s), not before now, a ball that slows has travelled a ``length`` (m)."""
        t = self.t + time_to_slide(length, self.speed, self.pull)
        return t if t > now else now

    def time_to_disc(self, cx: float, cy: float, touching: float, now: float) -> float:
        """Return when (s), not before now, the ball comes within ``touching`` (m) of a place."""
        dx, dy = cx - self.x, cy - self.y
        if not self.slows:
            t = self.time_in(cx, cy, touching, self.t)
            return t if t > now else now
        vx, vy = self.vx, self.vy
        if dx * vx + dy * vy <= 0.0:
            return INF
        across, square = dx * vy - dy * vx, vx * vx + vy * vy
        if across * across > FAR_OFF * touching * touching * square:
            return INF
        speed = math.sqrt(square)
        length = path_to_disc((dx, dy), (vx / speed, vy / speed), touching)
        return self.arrival(length, now) if length < INF else INF

    def time_in(self, cx: float, cy: float, touching: float, since: float) -> float:
        """Return when (s), from ``since`` on, a bent path comes as near as this (m) to a place."""
        x, y, vx, vy = self.at(since)
        noise = SLIGHT * self.speed
        return since + time_of_impact(
            (cx - x, cy - y), (-vx, -vy), (-self.ax, -self.ay), touching, self.end - since, noise
        )

    def time_out(
        self, cx: float, cy: float, touching: float, deepest: float, since: float
    ) -> float:
        """Return when (s), from ``since`` on, a bent path is farther than this (m) from a place.

        A ball that is as far, but not farther than ``deepest`` (m), leaves at once unless it moves
        in.
        """
        x, y, vx, vy = self.at(since)
        dx, dy = cx - x, cy - y
        if dx * dx + dy * dy > deepest * deepest:
            since = self.time_in(cx, cy, touching, since)
            if since == INF:
                return since
            x, y, vx, vy = self.at(since)
            dx, dy = cx - x, cy - y
        pull = -self.ax, -self.ay
        return since + time_to_leave((dx, dy), (-vx, -vy), pull, touching, self.end - since)


def standing(t: float, x: float, y: float) -> Path:
    """Return the path of a ball that rests from ``t`` (s) on.

    >>> standing(1.0, 0.5, 0.25).at(2.0)
    (0.5, 0.25, 0.0, 0.0)
    """
    return Path(t, x, y, 0.0, 0.0, 0.0, 0.0, t, True, 0.0, 0.0)


def sliding(t: float, place: Vector, velocity: Vector, pull: float) -> Path:
    """Return the path of a ball that slides from ``t`` (s) on, and slows down (Eq. 10)."""
    x, y = place
    vx, vy = velocity
    speed = math.sqrt(vx * vx + vy * vy)
    if speed == 0.0:
        return standing(t, x, y)
    drag, end = pull / speed, t + stopping_time(speed, pull)
    return Path(t, x, y, vx, vy, -drag * vx, -drag * vy, end, True, 0.0, 0.0)
