"""Walls that move: within a step their bodies keep a velocity and an angular velocity.

A wall's sides are given in the frame of its body, in which the ball has its relative
motion, with centrifugal and Coriolis terms. A wall is convex, so the gap to it is at least as wide
as the one to a plane along it. A contact is looked for in steps in which that one cannot close: the
acceleration in the frame, and its change, are bounded. They cannot pass a contact, and where the
gap closes they converge as Newton's method does.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

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


class Motion(NamedTuple):
    """This is how the body of a wall moves, whose sides are those from ``first`` up to ``last``.

    From ``since`` to ``until`` (s) it moves from a place (m) and an angle, of which it has cosine
    and sine, with a velocity (m/s) and ``turns`` (rad/s). Before and after that it stands.
    """

    first: int
    last: int
    x: float
    y: float
    angle: float
    c: float
    s: float
    ux: float
    uy: float
    turns: float
    since: float
    until: float


# -- sides in the frame of their body: a caller has them in a list, or numba in an array -----------


def gap_of(side: Flat, x: float, y: float, r: float) -> float:
    """Return the gap (m) to a side; numba reads the side from a record."""
    return side.gap(x, y, r)


def normal_of(side: Flat, x: float, y: float) -> Vector:
    """Return the normal of a side; numba reads the side from a record."""
    return side.normal(x, y)


def curvature_of(side: Flat, x: float, y: float) -> float:
    """Return how a side bends (1/m); numba reads the side from a record."""
    return side.curvature(x, y)


def height_of(side: Flat, x: float, y: float) -> float:
    """Return how far (m) a place is before the line of a face; a round side has no line."""
    return height_before(side, x, y) if isinstance(side, Face) else -math.inf


def height_before(face: Face, x: float, y: float) -> float:
    """Return how far (m) a place is before the line of a face."""
    (u, v), (nx, ny) = face.start, face.outward
    return (x - u) * nx + (y - v) * ny


def nearest_of(sides: Any, how: Motion, x: float, y: float) -> int:
    """Return the number of the side that is nearest to a place (m) in the frame."""
    best = flattest = how.first
    if how.last == how.first + 1:
        return best
    least, highest = math.inf, -math.inf
    for k in range(how.first, how.last):
        gap, height = gap_of(sides[k], x, y, 0.0), height_of(sides[k], x, y)
        if -sides[k].core <= gap < least:
            best, least = k, gap
        if height > highest:
            flattest, highest = k, height
    return flattest if -math.inf < highest < 0.0 else best  # Only a polygon has an inside.


def put_face(face: Face, frame: Four) -> Face:
    """Return a face of a body where its frame is."""
    (x, y), (tx, ty), (nx, ny), length, radius = face
    px, py, c, s = frame
    start = px + x * c - y * s, py + x * s + y * c
    along, across = (tx * c - ty * s, tx * s + ty * c), (nx * c - ny * s, nx * s + ny * c)
    return Face(start, along, across, length, radius)


def put_round(side: RoundSide, frame: Four) -> RoundSide:
    """Return a round side of a body where its frame is."""
    (x, y), radius, (fx, fy), (lx, ly) = side
    px, py, c, s = frame
    first, last = (fx * c - fy * s, fx * s + fy * c), (lx * c - ly * s, lx * s + ly * c)
    return RoundSide((px + x * c - y * s, py + x * s + y * c), radius, first, last)


# -- where a body is -------------------------------------------------------------------------------


def is_still(how: Motion) -> bool:
    """Tell whether a body stands."""
    return how.turns == 0.0 and how.ux == 0.0 and how.uy == 0.0


def angle_at(how: Motion, t: float) -> float:
    """Return the angle of a body at a time (s)."""
    if how.turns == 0.0:
        return how.angle
    return how.angle + (min(max(t, how.since), how.until) - how.since) * how.turns


def frame_at(how: Motion, t: float) -> Four:
    """Return the place (m) of a body's frame at a time (s), and its axis."""
    if is_still(how):
        return how.x, how.y, how.c, how.s
    time, c, s = min(max(t, how.since), how.until) - how.since, how.c, how.s
    if how.turns != 0.0:
        c, s = math.cos(angle_at(how, t)), math.sin(angle_at(how, t))
    return how.x + time * how.ux, how.y + time * how.uy, c, s


def in_frame(frame: Four, x: float, y: float) -> Vector:
    """Return a place (m) as a frame has it."""
    px, py, c, s = frame
    x, y = x - px, y - py
    return x * c + y * s, y * c - x * s


def nearest_at(sides: Any, how: Motion, t: float, x: float, y: float) -> int:
    """Return the number of the side that is nearest to a place (m) at a time (s)."""
    u, v = in_frame(frame_at(how, t), x, y)
    return nearest_of(sides, how, u, v)


def normal_at(sides: Any, how: Motion, t: float, x: float, y: float) -> Vector:
    """Return the normal of a wall at a place (m) and a time (s)."""
    frame = frame_at(how, t)
    (u, v), (_, _, c, s) = in_frame(frame, x, y), frame
    nx, ny = normal_of(sides[nearest_of(sides, how, u, v)], u, v)
    return nx * c - ny * s, nx * s + ny * c


def drift_at(sides: Any, how: Motion, t: float, place: Vector, r: float) -> Vector:
    """Return the velocity (m/s) of a wall at a time (s) where a ball at a place touches it."""
    if how.turns == 0.0 or not how.since <= t <= how.until:
        return how.ux, how.uy
    (x, y), (px, py, _, _) = place, frame_at(how, t)
    nx, ny = normal_at(sides, how, t, x, y)
    x, y = x - r * nx - px, y - r * ny - py
    return how.ux - how.turns * y, how.uy + how.turns * x


def sweep_at(sides: Any, how: Motion, t: float, x: float, y: float) -> Four:
    """Return the velocity (m/s) of a wall's frame at (x, y), and the angular velocity.

    Last comes the centrifugal acceleration (m/s^2) there, along the normal.
    """
    ux, uy, spins = how.ux, how.uy, how.turns
    if spins == 0.0:
        return ux, uy, 0.0, 0.0
    (px, py, _, _), (nx, ny) = frame_at(how, t), normal_at(sides, how, t, x, y)
    px, py = x - px, y - py
    return ux - spins * py, uy + spins * px, spins, spins * spins * (px * nx + py * ny)


# -- when a ball meets a wall ----------------------------------------------------------------------


def time_of_meeting(sides: Any, how: Motion, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball meets a wall until the end of its motion.

    The time has the same bits whenever it is asked for, until the ball has met the wall.
    """
    t = first_touch(sides, how, path, r, max(path.t, how.since))
    return t if t >= now else first_touch(sides, how, path, r, now)


def first_touch(sides: Any, how: Motion, path: Path, r: float, since: float) -> float:
    """Return when (s) a ball meets a wall while it moves, or while it rests then."""
    t = math.inf
    if since < path.end:
        t = touch(sides, how, path, (path.ax, path.ay), r, (since, min(path.end, how.until)))
    if t == math.inf and path.slows and not is_still(how):
        t = touch(sides, how, path, (0.0, 0.0), r, (max(since, path.end), how.until))
    return t


def touch(sides: Any, how: Motion, path: Path, pull: Pull, r: float, when: Vector) -> float:
    """Return when (s) a ball touches a wall and closes, between two times.

    It has this ``pull`` (m/s^2).
    """
    t, end = when
    if end < t:
        return math.inf
    b = bounds(how, path, pull, r, t, end)
    least, last, still = LEAST, t, GRAZING * b.quick
    for _ in range(MOST):
        gap, opening, bend, rate = look(sides, how, path, pull, r, t)
        if gap - b.quick * (end - t) > b.closed:
            return math.inf
        is_touching = gap <= b.closed
        if is_touching:
            if gap < -b.closed and last < t:
                return closing(sides, how, path, r, last, t)
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


def bounds(how: Motion, path: Path, pull: Pull, r: float, t: float, end: float) -> Bounds:
    """Return bounds on the motion of a ball in the frame between two times (s)."""
    ux, uy, w, (x, y, _, _) = how.ux, how.uy, abs(how.turns), motion_at(path, t)
    force = pull_of(path) if pull != (0.0, 0.0) else 0.0
    fast = fastest_of(path) + math.sqrt(ux * ux + uy * uy)
    px, py, _, _ = frame_at(how, t)
    far = abs(x - px) + abs(y - py)
    if end < math.inf:  # Else the wall stands.
        far += fast * (end - t)
    quick, size = fast + w * far, abs(x) + abs(y) + abs(px) + abs(py) + r + far
    closed = EPSILON * (8.0 * size + abs(t) * quick)
    most = force + 2.0 * w * quick + w * w * far
    return Bounds(quick, most, w * (3.0 * force + w * (3.0 * fast + w * far)), closed)


def look(sides: Any, how: Motion, path: Path, pull: Pull, r: float, t: float) -> Four:
    """Return the gap (m) at a time (s), its derivative, the acceleration along the normal.

    Last comes the gap's second derivative, in which the normal turns.
    """
    (px, py, c, s), w, ux, uy = frame_at(how, t), how.turns, how.ux, how.uy
    x, y, vx, vy = motion_at(path, t)
    x, y, vx, vy = x - px, y - py, vx - ux, vy - uy
    x, y, vx, vy = x * c + y * s, y * c - x * s, vx * c + vy * s, vy * c - vx * s
    vx, vy = vx + w * y, vy - w * x
    ax, ay = pull[0] * c + pull[1] * s, pull[1] * c - pull[0] * s
    ax, ay = ax + 2.0 * w * vy + w * w * x, ay - 2.0 * w * vx + w * w * y
    side = sides[nearest_of(sides, how, x, y)]
    nx, ny = normal_of(side, x, y)
    along = vy * nx - vx * ny
    bend = ax * nx + ay * ny
    rate = bend + curvature_of(side, x, y) * along * along
    return gap_of(side, x, y, r), vx * nx + vy * ny, bend, rate


def closing(sides: Any, how: Motion, path: Path, r: float, low: float, high: float) -> float:
    """Return when (s), after ``low``, a ball that touches a wall begins to sink in."""
    start = look(sides, how, path, (0.0, 0.0), r, low)[0]
    for _ in range(HALVINGS):
        middle = low + (high - low) / 2.0
        if look(sides, how, path, (0.0, 0.0), r, middle)[0] < min(start, 0.0):
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


class Clock(Protocol):
    """A clock has the time (s)."""

    now: float


class Moving:
    """This is the side of a wall whose body moves; it has all ``sides`` of the body's shape.

    The body moves as :meth:`move` says. A contact is looked for until the end of that, because the
    velocity may be another one after it. Gaps and normals are those at the time of the ``clock``.

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
        """Let the body move for a while; before and after that it stands."""
        axis = math.cos(angle), math.sin(angle)
        numbers = *place, angle, *axis, *velocity, turns, since, until
        self.how = Motion(0, len(self.sides), *numbers)

    def copy(self, clock: Clock, late: float) -> Moving:
        """Return the same side for another clock, which is ``late`` by a time (s)."""
        other, how = Moving(self.sides, clock), self.how
        other.how = how._replace(since=how.since - late, until=how.until - late)
        return other

    def standing(self, clock: Clock) -> Moving:
        """Return the same side for another clock, as if the body stood where it is now."""
        other, now = Moving(self.sides, clock), self.clock.now
        x, y, _, _ = frame_at(self.how, now)
        other.stand((x, y), angle_at(self.how, now), math.inf)
        return other

    # -- where it is ---------------------------------------------------------------------------

    def gap(self, x: float, y: float, r: float) -> float:
        side, x, y = self._find(x, y)
        return side.gap(x, y, r)

    def normal(self, x: float, y: float) -> Vector:
        return normal_at(self.sides, self.how, self.clock.now, x, y)

    def curvature(self, x: float, y: float) -> float:
        side, x, y = self._find(x, y)
        return side.curvature(x, y)

    def _find(self, x: float, y: float) -> tuple[Flat, float, float]:
        """Return the side that is nearest to a place (m) now, and this place in the frame."""
        x, y = in_frame(frame_at(self.how, self.clock.now), x, y)
        return self.sides[nearest_of(self.sides, self.how, x, y)], x, y

    def nearest(self, x: float, y: float) -> Flat:
        """Return the side that is nearest to a place (m) now, where it is now."""
        k = nearest_at(self.sides, self.how, self.clock.now, x, y)
        return self._put(self.sides[k])

    def sides_now(self) -> tuple[Flat, ...]:
        """Return the sides where they are now."""
        return tuple([self._put(side) for side in self.sides])

    def _put(self, side: Flat) -> Flat:
        """Return a side where it is now."""
        frame = frame_at(self.how, self.clock.now)
        return put_face(side, frame) if isinstance(side, Face) else put_round(side, frame)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the wall until the end of its motion."""
        return time_of_meeting(self.sides, self.how, path, r, now)


class MovingWall(Wall):
    """A moving wall bounces balls off, and moves with its body."""

    __slots__ = ("moving",)

    def __init__(
        self, moving: Moving, restitution: float, friction: float, number: int, kick: float = 0.0
    ) -> None:
        super().__init__((moving,), restitution, friction, number, kick)
        self.moving = moving

    def drift(self, x: float, y: float, r: float) -> Vector:
        side = self.moving
        return drift_at(side.sides, side.how, side.clock.now, (x, y), r)

    def sweep(self, x: float, y: float) -> Four:
        """Return how the wall moves at (x, y), as `sweep_at` does."""
        side = self.moving
        return sweep_at(side.sides, side.how, side.clock.now, x, y)

    def motion(self, now: float) -> tuple[float, float, float, float, float, float]:
        """Return velocity (m/s), time (s), angular velocity (rad/s), and place (m) of the body."""
        how = self.moving.how
        x, y, _, _ = frame_at(how, now)
        return how.ux, how.uy, now, how.turns, x, y

    def nearest(self, x: float, y: float, r: float) -> Side:
        return self.moving.nearest(x, y)

    def copy(self, moving: Moving) -> MovingWall:
        """Return the same wall with another motion."""
        return MovingWall(moving, self.restitution, self.friction, self.number, self.kick)
