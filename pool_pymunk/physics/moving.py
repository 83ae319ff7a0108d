"""Walls that move: within a step their bodies keep a velocity and an angular velocity.

A wall's sides are given in the frame of its body, in which the ball has its relative
motion, with centrifugal and Coriolis terms. A wall is convex, so the gap to it is at least as wide
as the one to a plane along it. A contact is looked for in steps in which that one cannot close: the
acceleration in the frame, and its change, are bounded. They cannot pass a contact, and where the
gap closes they converge as Newton's method does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple, Protocol

from pool_pymunk.physics.motion import EPSILON, Vector
from pool_pymunk.physics.path import Path, fastest_of, motion_at, pull_of
from pool_pymunk.physics.sides import GRAZING, Face, RoundSide, Side, Wall, core_of

# This many steps look for a contact: ten are usual. After the first one that a ball needs to leave
# a wall, of LEAST (s), each further one may be twice as long.
MOST, LEAST = 200, 1e-9
HALVINGS = 60

Flat = Face | RoundSide
Pull = Vector
Four = tuple[float, float, float, float]


class Bounds(NamedTuple):
    """These bound the motion of a ball in the frame of a wall.

    They are for its speed (m/s), its acceleration (m/s^2), and the change of this (m/s^3). A gap
    (m) is ``closed`` that rounding may have opened.
    """

    quick: float
    most: float
    jerk: float
    closed: float


class Clock(Protocol):
    """A clock has the time (s)."""

    now: float


class Moving:
    """This is the side of a wall whose body moves; it has all ``sides`` of the body's shape.

    From ``since`` to ``until`` (s) the body moves from a ``place`` (m) and an ``angle`` with a
    ``velocity`` (m/s) and ``turns`` (rad/s). Before and after that it stands. A contact is looked
    for until then, because the velocity may be another one after it. Gaps and normals are those at
    the time of the ``clock``.

    >>> class Noon:
    ...     now = 0.0
    >>> wall = Moving((RoundSide((0.0, 0.0), 0.1),), Noon())
    >>> wall.move((0.0, 0.0), 0.0, (1.0, 0.0), 0.0, 0.0, 1.0)
    >>> path = Path(0.0, 0.5, 0.0, -1.0, 0.0, 0.0, 0.0, math.inf)
    >>> round(wall.time_of_contact(path, 0.1, 0.0), 12)
    0.15
    """

    def __init__(self, sides: tuple[Flat, ...], clock: Clock) -> None:
        self.sides, self.clock = sides, clock
        self.stand((0.0, 0.0), 0.0)

    @property
    def core(self) -> float:
        return core_of(self.sides[0])

    # -- how it moves --------------------------------------------------------------------------

    def stand(self, place: Vector, angle: float, until: float = -math.inf) -> None:
        """Let the body stand; nothing meets the wall after ``until`` (s)."""
        self.move(place, angle, (0.0, 0.0), 0.0, 0.0, until)

    def move(
        self,
        place: Vector,
        angle: float,
        velocity: Vector,
        turns: float,
        since: float,
        until: float,
    ) -> None:
        """Let the body move for a while."""
        self.place, self.angle, self.velocity, self.turns = place, angle, velocity, turns
        self.since, self.until = since, until
        self.is_still = turns == 0.0 and velocity == (0.0, 0.0)
        self._axes = math.cos(angle), math.sin(angle)

    def copy(self, clock: Clock, late: float) -> Moving:
        """Return the same side for another clock, which is ``late`` by a time (s)."""
        other = Moving(self.sides, clock)
        how = self.place, self.angle, self.velocity, self.turns
        other.move(*how, self.since - late, self.until - late)
        return other

    def standing(self, clock: Clock) -> Moving:
        """Return the same side for another clock, as if the body stood where it is now."""
        other, now = Moving(self.sides, clock), self.clock.now
        other.stand(self.frame(now)[:2], self.angle_at(now), math.inf)
        return other

    def angle_at(self, t: float) -> float:
        """Return the angle of the body at a time (s)."""
        if self.turns == 0.0:
            return self.angle
        return self.angle + (min(max(t, self.since), self.until) - self.since) * self.turns

    def frame(self, t: float) -> tuple[float, float, float, float]:
        """Return the place (m) of the body's frame at a time (s), and its axis."""
        (x, y), (c, s) = self.place, self._axes
        if self.is_still:
            return x, y, c, s
        time = min(max(t, self.since), self.until) - self.since
        if self.turns != 0.0:
            c, s = math.cos(self.angle_at(t)), math.sin(self.angle_at(t))
        return x + time * self.velocity[0], y + time * self.velocity[1], c, s

    # -- where it is ---------------------------------------------------------------------------

    def _find(self, x: float, y: float) -> tuple[Flat, float, float]:
        """Return the side that is nearest to a place (m) now, and this place in the frame."""
        px, py, c, s = self.frame(self.clock.now)
        x, y = x - px, y - py
        x, y = x * c + y * s, y * c - x * s
        return self._nearest(x, y), x, y

    def _nearest(self, x: float, y: float) -> Flat:
        """Return the side that is nearest to a place (m) in the frame."""
        if len(self.sides) == 1:
            return self.sides[0]
        best = flattest = self.sides[0]
        least, highest = math.inf, -math.inf
        for side in self.sides:
            gap = side.gap(x, y, 0.0)
            if -side.radius <= gap < least:
                best, least = side, gap
            if isinstance(side, Face):
                (u, v), (nx, ny) = side.start, side.outward
                height = (x - u) * nx + (y - v) * ny
                if height > highest:
                    flattest, highest = side, height
        return flattest if -math.inf < highest < 0.0 else best  # Only a polygon has an inside.

    def gap(self, x: float, y: float, r: float) -> float:
        side, x, y = self._find(x, y)
        return side.gap(x, y, r)

    def normal(self, x: float, y: float) -> Vector:
        _, _, c, s = self.frame(self.clock.now)
        side, x, y = self._find(x, y)
        nx, ny = side.normal(x, y)
        return nx * c - ny * s, nx * s + ny * c

    def curvature(self, x: float, y: float) -> float:
        side, x, y = self._find(x, y)
        return side.curvature(x, y)

    def nearest(self, x: float, y: float) -> Flat:
        """Return the side that is nearest to a place (m) now, where it is now."""
        return self._put(self._find(x, y)[0])

    def sides_now(self) -> tuple[Flat, ...]:
        """Return the sides where they are now."""
        return tuple([self._put(side) for side in self.sides])

    def _put(self, side: Flat) -> Flat:
        """Return a side where it is now."""
        px, py, c, s = self.frame(self.clock.now)
        if isinstance(side, RoundSide):
            x, y = side.center
            return RoundSide((px + x * c - y * s, py + x * s + y * c), side.radius)
        (x, y), (tx, ty), (nx, ny), length, radius = side
        start = px + x * c - y * s, py + x * s + y * c
        along, across = (tx * c - ty * s, tx * s + ty * c), (nx * c - ny * s, nx * s + ny * c)
        return Face(start, along, across, length, radius)

    def drift(self, x: float, y: float, r: float) -> Vector:
        """Return the velocity (m/s) of the wall now where a ball at (x, y) touches it."""
        ux, uy = self.velocity
        if self.turns == 0.0 or not self.since <= self.clock.now <= self.until:
            return ux, uy
        px, py, _, _ = self.frame(self.clock.now)
        nx, ny = self.normal(x, y)
        x, y = x - r * nx - px, y - r * ny - py
        return ux - self.turns * y, uy + self.turns * x

    # -- when a ball meets it ------------------------------------------------------------------

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the wall until the end of its motion.

        The time has the same bits whenever it is asked for, until the ball has met the wall.
        """
        t = self._first(path, r, max(path.t, self.since))
        return t if t >= now else self._first(path, r, now)

    def _first(self, path: Path, r: float, since: float) -> float:
        for pull, begin, end in self._parts(path, since):
            t = self._touch(path, pull, r, begin, end)
            if t < math.inf:
                return t
        return math.inf

    def _parts(self, path: Path, since: float) -> Iterator[tuple[Pull, float, float]]:
        """Return the acceleration (m/s^2) of a ball while it moves, and while it rests then."""
        if since < path.end:
            yield (path.ax, path.ay), since, min(path.end, self.until)
        if path.slows and not self.is_still:
            yield (0.0, 0.0), max(since, path.end), self.until

    def _touch(self, path: Path, pull: Pull, r: float, t: float, end: float) -> float:
        """Return when (s) a ball touches the wall and closes; it has this ``pull`` (m/s^2)."""
        if end < t:
            return math.inf
        b = self._bounds(path, pull, r, t, end)
        least, last, still = LEAST, t, GRAZING * b.quick
        for _ in range(MOST):
            gap, opening, bend, rate = self._look(path, pull, r, t)
            if gap - b.quick * (end - t) > b.closed:
                return math.inf
            is_touching = gap <= b.closed
            if is_touching:
                if gap < -b.closed and last < t:
                    return self._closing(path, r, last, t)
                if opening < -still or (opening <= still and rate < -GRAZING * b.most):
                    return t
                gap, opening = 0.0, max(opening, 0.0)
            h = time_open(gap, opening, bend, b.most, b.jerk)
            last = math.inf
            if is_touching and h < least:
                h, last, least = least, t, 2.0 * least
            if h == math.inf:
                return h
            if t + h == t:
                return t
            t = min(t + h, end) if is_touching else t + h
            if t > end or (t == end and h < LEAST):
                return math.inf
        return math.inf

    def _bounds(self, path: Path, pull: Pull, r: float, t: float, end: float) -> Bounds:
        """Return bounds on the motion of a ball in the frame between two times (s)."""
        (ux, uy), w, (x, y, _, _) = self.velocity, abs(self.turns), motion_at(path, t)
        force = pull_of(path) if pull != (0.0, 0.0) else 0.0
        fast = fastest_of(path) + math.sqrt(ux * ux + uy * uy)
        px, py, _, _ = self.frame(t)
        far = abs(x - px) + abs(y - py)
        if end < math.inf:  # Else the wall stands.
            far += fast * (end - t)
        quick, size = fast + w * far, abs(x) + abs(y) + abs(px) + abs(py) + r + far
        closed = EPSILON * (8.0 * size + abs(t) * quick)
        most = force + 2.0 * w * quick + w * w * far
        return Bounds(quick, most, w * (3.0 * force + w * (3.0 * fast + w * far)), closed)

    def _look(self, path: Path, pull: Pull, r: float, t: float) -> Four:
        """Return the gap (m) at a time (s), its derivative, the acceleration along the normal.

        Last comes the gap's second derivative, in which the normal turns.
        """
        (px, py, c, s), w, (ux, uy) = self.frame(t), self.turns, self.velocity
        x, y, vx, vy = motion_at(path, t)
        x, y, vx, vy = x - px, y - py, vx - ux, vy - uy
        x, y, vx, vy = x * c + y * s, y * c - x * s, vx * c + vy * s, vy * c - vx * s
        vx, vy = vx + w * y, vy - w * x
        ax, ay = pull[0] * c + pull[1] * s, pull[1] * c - pull[0] * s
        ax, ay = ax + 2.0 * w * vy + w * w * x, ay - 2.0 * w * vx + w * w * y
        side = self._nearest(x, y)
        nx, ny = side.normal(x, y)
        along = vy * nx - vx * ny
        bend = ax * nx + ay * ny
        rate = bend + side.curvature(x, y) * along * along
        return side.gap(x, y, r), vx * nx + vy * ny, bend, rate

    def _closing(self, path: Path, r: float, low: float, high: float) -> float:
        """Return when (s), after ``low``, a ball that touches the wall begins to sink in."""
        start = self._look(path, (0.0, 0.0), r, low)[0]
        for _ in range(HALVINGS):
            middle = low + (high - low) / 2.0
            if self._look(path, (0.0, 0.0), r, middle)[0] < min(start, 0.0):
                high = middle
            else:
                low = middle
        return high


def time_to_close(gap: float, opening: float, most: float) -> float:
    """Return how long (s) a gap (m) that opens at this speed (m/s) surely stays open.

    Its second derivative is at least -``most`` (m/s^2).

    >>> time_to_close(3.0, -1.0, 4.0)
    1.0
    """
    if most == 0.0:
        return gap / -opening if opening < 0.0 else math.inf
    root = math.sqrt(opening * opening + 2.0 * most * gap)
    return (opening + root) / most if opening > 0.0 else 2.0 * gap / (root - opening + (gap == 0.0))


def time_open(gap: float, opening: float, bend: float, most: float, jerk: float) -> float:
    """Return how long (s) a gap (m) to a convex wall surely stays open.

    It opens at a speed (m/s). A plane along the wall, through the point that is nearest now, has
    the wall behind it. So the gap is at least as wide as that to the plane, whose second derivative
    is ``bend`` (m/s^2) now, at least -``most``, and changes by at most ``jerk`` (m/s^3).

    >>> time_open(0.0, 0.0, 2.0, 1000.0, 3.0), time_open(0.0, 1.0, 0.0, 1000.0, 0.0)
    (2.0, 0.004)
    """
    h = time_to_close(gap, opening, most)
    if opening >= 0.0 and bend > 0.0:
        h = max(h, 3.0 * bend / jerk if jerk > 0.0 else math.inf)
    if h == math.inf:
        return h
    # In twice the time, the second derivative is hardly lower than now.
    pull = max(jerk * 2.0 * h / 3.0 - bend, 0.0)
    return max(h, min(2.0 * h, time_to_close(gap, opening, pull)))


class MovingWall(Wall):
    """A moving wall bounces balls off, and moves with its body."""

    __slots__ = ("moving",)

    def __init__(
        self, moving: Moving, restitution: float, friction: float, number: int, kick: float = 0.0
    ) -> None:
        super().__init__((moving,), restitution, friction, number, kick)
        self.moving = moving

    def drift(self, x: float, y: float, r: float) -> Vector:
        return self.moving.drift(x, y, r)

    def sweep(self, x: float, y: float) -> tuple[float, float, float, float]:
        """Return the velocity (m/s) of the wall's frame at (x, y), and the angular velocity.

        Last comes the centrifugal acceleration (m/s^2) there, along the normal.
        """
        side = self.moving
        (ux, uy), spins = side.velocity, side.turns
        if spins == 0.0:
            return ux, uy, 0.0, 0.0
        (px, py, _, _), (nx, ny) = side.frame(side.clock.now), side.normal(x, y)
        px, py = x - px, y - py
        return ux - spins * py, uy + spins * px, spins, spins * spins * (px * nx + py * ny)

    def motion(self, now: float) -> tuple[float, float, float, float, float, float]:
        """Return velocity (m/s), time (s), angular velocity (rad/s), and place (m) of the body."""
        (ux, uy), (x, y, _, _) = self.moving.velocity, self.moving.frame(now)
        return ux, uy, now, self.moving.turns, x, y

    def nearest(self, x: float, y: float, r: float) -> Side:
        return self.moving.nearest(x, y)

    def copy(self, moving: Moving) -> MovingWall:
        """Return the same wall with another motion."""
        return MovingWall(moving, self.restitution, self.friction, self.number, self.kick)
