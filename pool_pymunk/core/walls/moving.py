"""Walls that move: for a while their bodies keep a velocity and an angular velocity.

A wall's sides are given in the frame of its body, in which the ball has its relative motion, with
centrifugal and Coriolis terms. A wall is convex, so the gap to it is at least as wide as the one to
a plane along it. A contact is looked for in steps in which that one cannot close: the acceleration
in the frame, and its change, are bounded. They cannot pass a contact, and where the gap closes they
converge as Newton's method does.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import EPSILON, INF, Vector
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.side import GRAZING, Side
from pool_pymunk.core.walls.wall import Sweep, Wall

# This many steps look for a contact: ten are usual. After the first one that a ball needs to leave
# a wall, of LEAST (s), each further one may be twice as long.
MOST: Final = 200
LEAST: Final = 1e-9
HALVINGS: Final = 60

# the place (m) of a body, and cosine and sine of its angle
Frame = tuple[float, float, float, float]
# The gap (m), its derivative (m/s), the acceleration along the normal (m/s^2), and the gap's second
# derivative, in which the normal turns.
Look = tuple[float, float, float, float]
# These bound the motion of a ball in the frame of a wall: its speed (m/s), its acceleration (m/s^2)
# and the change of this (m/s^3). A gap (m) is closed that rounding may have opened.
Bounds = tuple[float, float, float, float]
REST: Vector = (0.0, 0.0)


@final
class Body:
    """A body is where the frame of a wall is: from ``since`` to ``until`` (s) it moves evenly.

    It moves from a place (m) and an angle with a velocity (m/s) and ``turns`` (rad/s). Before and
    after that it stands. Its wall asks it.

    >>> body = Body((0.0, 1.0), 0.0, (2.0, 0.0), 0.0, 1.0, 3.0)
    >>> body.frame(2.0), body.frame(9.0)
    ((2.0, 1.0, 1.0, 0.0), (4.0, 1.0, 1.0, 0.0))
    """

    def __init__(
        self, place: Vector, angle: float, velocity: Vector, turns: float, since: float,
        until: float,
    ) -> None:  # fmt: skip
        self.x, self.y = place
        self.angle = angle
        self.c, self.s = math.cos(angle), math.sin(angle)
        self.ux, self.uy = velocity
        self.turns = turns
        self.since = since
        self.until = until

    @property
    def is_still(self) -> bool:
        """This tells whether the body stands."""
        return self.turns == 0.0 and self.ux == 0.0 and self.uy == 0.0

    def _elapsed(self, t: float) -> float:
        return min(max(t, self.since), self.until) - self.since

    def angle_at(self, t: float) -> float:
        """Return the angle of the body at a time (s)."""
        return self.angle if self.turns == 0.0 else self.angle + self._elapsed(t) * self.turns

    def frame(self, t: float) -> Frame:
        """Return the place (m) of the frame at a time (s), and its axis."""
        if self.is_still:
            return self.x, self.y, self.c, self.s
        time, c, s = self._elapsed(t), self.c, self.s
        if self.turns != 0.0:
            angle = self.angle_at(t)
            c, s = math.cos(angle), math.sin(angle)
        return self.x + time * self.ux, self.y + time * self.uy, c, s


@final
class Carried(Side):
    """A side of a body's shape is carried along: it answers where it is at the time it is set to.

    Contacts that persist ask it.

    >>> body = Body((0.0, 1.0), 0.0, (2.0, 0.0), 0.0, 0.0, 3.0)
    >>> side = Carried(RoundSide((0.0, 0.0), 0.5), body, 1.0)
    >>> side.normal(2.0, 3.0), side.gap(2.0, 3.0, 0.25), side.flow(2.0, 3.0)
    ((0.0, 1.0), 1.25, (2.0, 0.0, 0.0, 0.0))
    """

    def __init__(self, side: Side, body: Body, time: float) -> None:
        super().__init__(side.core)
        self.side = side
        self.body = body
        self.frame = body.frame(time)

    def set_to(self, time: float) -> None:
        """Let it be where it is at a time (s)."""
        self.frame = self.body.frame(time)

    def gap(self, x: float, y: float, r: float) -> float:
        u, v = in_frame(self.frame, x, y)
        return self.side.gap(u, v, r)

    def gap_beyond(self, x: float, y: float, r: float) -> float:
        u, v = in_frame(self.frame, x, y)
        return self.side.gap_beyond(u, v, r)

    def normal(self, x: float, y: float) -> Vector:
        u, v = in_frame(self.frame, x, y)
        return turned(self.side.normal(u, v), self.frame[2], self.frame[3])

    def curvature(self, x: float, y: float) -> float:
        u, v = in_frame(self.frame, x, y)
        return self.side.curvature(u, v)

    def room(self, x: float, y: float) -> float:
        u, v = in_frame(self.frame, x, y)
        return self.side.room(u, v)

    def flow(self, x: float, y: float) -> tuple[float, float, float, float]:
        """Return the frame's velocity (m/s) at a place, and its centrifugal acceleration there."""
        body, w = self.body, self.body.turns
        x, y = x - self.frame[0], y - self.frame[1]
        return body.ux - w * y, body.uy + w * x, w * w * x, w * w * y


STANDS: Final = Body(REST, 0.0, REST, 0.0, 0.0, -INF)


@final
class MovingWall(Wall):
    """A moving wall has the sides of its body's shape, in the body's frame: faces and round sides.

    A contact is looked for until the end of the body's motion, because the velocity may be another
    one after it.

    >>> wall = MovingWall([RoundSide((0.0, 0.0), 0.1)], 0.8, 0.1, 0)
    >>> wall.body = Body((0.0, 0.0), 0.0, (1.0, 0.0), 0.0, 0.0, 1.0)
    >>> path = Path(0.0, 0.5, 0.0, -1.0, 0.0, 0.0, 0.0, INF, True, 0.0, 0.0)
    >>> round(wall.time_of_contact(path, 0.1, 0.0), 12)
    0.15
    """

    def __init__(
        self, sides: list[Side], restitution: float, friction: float, number: int, kick: float = 0.0
    ) -> None:
        super().__init__(sides, restitution, friction, number, kick)
        self.moves = True
        self.body = STANDS

    # -- where it is -------------------------------------------------------------------------------

    def _nearest(self, u: float, v: float) -> Side:
        """Return the side that is nearest to a place (m) in the frame."""
        best = flattest = self.sides[0]
        if len(self.sides) == 1:
            return best
        least, highest = INF, -INF
        for side in self.sides:
            gap = side.gap(u, v, 0.0)
            if -side.core <= gap < least:
                best, least = side, gap
            height = side.height(u, v) if isinstance(side, Face) else -INF
            if height > highest:
                flattest, highest = side, height
        return flattest if -INF < highest < 0.0 else best  # Only a polygon has an inside.

    def nearest(self, x: float, y: float, r: float, now: float) -> Side:
        """Return the side that is nearest to a place (m), where it is now (s)."""
        frame = self.body.frame(now)
        u, v = in_frame(frame, x, y)
        return put(self._nearest(u, v), frame)

    def sides_at(self, now: float) -> list[Side]:
        """Return the sides where they are now (s)."""
        frame = self.body.frame(now)
        return [put(side, frame) for side in self.sides]

    def drift(self, x: float, y: float, r: float, now: float) -> Vector:
        """Return the velocity (m/s) of the wall where a ball at (x, y) touches it now (s)."""
        body = self.body
        if body.turns == 0.0 or not body.since <= now <= body.until:
            return body.ux, body.uy
        px, py, _c, _s = body.frame(now)
        nx, ny = self.side_beside(x, y, r, now).normal(x, y)
        x, y = x - r * nx - px, y - r * ny - py
        return body.ux - body.turns * y, body.uy + body.turns * x

    def sweep(self, x: float, y: float, now: float) -> Sweep:
        body = self.body
        spins = body.turns
        if spins == 0.0:
            return body.ux, body.uy, 0.0, 0.0
        px, py, _c, _s = body.frame(now)
        nx, ny = self.side_beside(x, y, 0.0, now).normal(x, y)
        px, py = x - px, y - py
        lifts = spins * spins * (px * nx + py * ny)
        return body.ux - spins * py, body.uy + spins * px, spins, lifts

    @property
    def until(self) -> float:
        return self.body.until

    def side_beside(self, x: float, y: float, r: float, now: float) -> Side:
        u, v = in_frame(self.body.frame(now), x, y)
        return Carried(self._nearest(u, v), self.body, now)

    # -- when a ball meets it ----------------------------------------------------------------------

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the wall until the end of its motion.

        The time has the same bits whenever it is asked for, until the ball has met the wall.
        """
        t = self._first_touch(path, r, max(path.t, self.body.since))
        return t if t >= now else self._first_touch(path, r, now)

    def _first_touch(self, path: Path, r: float, since: float) -> float:
        """Return when (s) a ball meets the wall while it moves, or while it rests then."""
        body, t = self.body, INF
        if since < path.end:
            t = self._touch(path, (path.ax, path.ay), r, since, min(path.end, body.until))
        if t == INF and path.slows and not body.is_still:
            t = self._touch(path, REST, r, max(since, path.end), body.until)
        return t

    def _touch(self, path: Path, pull: Vector, r: float, t: float, end: float) -> float:
        """Return when (s) a ball with a ``pull`` (m/s^2) touches the wall and closes."""
        if end < t:
            return INF
        quick, most, jerk, closed = self._bounds(path, pull, r, t, end)
        least, last, still = LEAST, t, GRAZING * quick
        for _ in range(MOST):
            gap, opening, bend, rate = self._look(path, pull, r, t)
            if gap - quick * (end - t) > closed:
                return INF
            is_touching = gap <= closed
            if is_touching:
                if gap < -closed and last < t:
                    return self._closing(path, r, last, t)
                if opening < -still or (opening <= still and rate < -GRAZING * most):
                    return t
                gap, opening = 0.0, max(opening, 0.0)
            h = time_open(gap, opening, bend, most, jerk)
            last = INF
            if is_touching and h < least:
                h, last, least = least, t, 2.0 * least
            if h == INF:
                return h
            if t + h == t:
                return t
            t = min(t + h, end) if is_touching else t + h
            if t > end or (t == end and h < LEAST):
                return INF
        return INF

    def _bounds(self, path: Path, pull: Vector, r: float, t: float, end: float) -> Bounds:
        """Return bounds on the motion of a ball in the frame between two times (s)."""
        body = self.body
        w, (x, y) = abs(body.turns), path.place(t)
        force = path.pull if pull != REST else 0.0
        fast = path.fastest_until(end) + math.sqrt(body.ux * body.ux + body.uy * body.uy)
        px, py, _c, _s = body.frame(t)
        far = abs(x - px) + abs(y - py)
        if end < INF:  # Else the wall stands.
            far += fast * (end - t)
        quick, size = fast + w * far, abs(x) + abs(y) + abs(px) + abs(py) + r + far
        closed = EPSILON * (8.0 * size + abs(t) * quick)
        most = force + 2.0 * w * quick + w * w * far
        return quick, most, w * (3.0 * force + w * (3.0 * fast + w * far)), closed

    def _look(self, path: Path, pull: Vector, r: float, t: float) -> Look:
        """Return how the gap is at a time (s), and how it changes."""
        body = self.body
        px, py, c, s = body.frame(t)
        w = body.turns
        x, y, vx, vy = path.at(t)
        x, y, vx, vy = x - px, y - py, vx - body.ux, vy - body.uy
        x, y, vx, vy = x * c + y * s, y * c - x * s, vx * c + vy * s, vy * c - vx * s
        vx, vy = vx + w * y, vy - w * x
        fx, fy = pull
        ax, ay = fx * c + fy * s, fy * c - fx * s
        ax, ay = ax + 2.0 * w * vy + w * w * x, ay - 2.0 * w * vx + w * w * y
        side = self._nearest(x, y)
        nx, ny = side.normal(x, y)
        along = vy * nx - vx * ny
        bend = ax * nx + ay * ny
        rate = bend + side.curvature(x, y) * along * along
        return side.gap(x, y, r), vx * nx + vy * ny, bend, rate

    def _closing(self, path: Path, r: float, low: float, high: float) -> float:
        """Return when (s), after ``low``, a ball that touches the wall begins to sink in."""
        start, _opening, _bend, _rate = self._look(path, REST, r, low)
        for _ in range(HALVINGS):
            middle = low + (high - low) / 2.0
            gap, _opening, _bend, _rate = self._look(path, REST, r, middle)
            if gap < min(start, 0.0):
                high = middle
            else:
                low = middle
        return high


def in_frame(frame: Frame, x: float, y: float) -> Vector:
    """Return a place (m) as a frame has it."""
    px, py, c, s = frame
    x, y = x - px, y - py
    return x * c + y * s, y * c - x * s


def put(side: Side, frame: Frame) -> Side:
    """Return a side of a body where its frame is."""
    px, py, c, s = frame
    if isinstance(side, Face):
        x, y = side.start
        start = px + x * c - y * s, py + x * s + y * c
        along, across = turned(side.tangent, c, s), turned(side.outward, c, s)
        return Face(start, along, across, side.length, side.core)
    assert isinstance(side, RoundSide), "a wall that moves has faces and round sides"
    x, y = side.center
    center = px + x * c - y * s, py + x * s + y * c
    return RoundSide(center, side.radius, turned(side.first, c, s), turned(side.last, c, s))


def turned(v: Vector, c: float, s: float) -> Vector:
    """Return a vector turned by the angle with this cosine and sine."""
    x, y = v
    return x * c - y * s, x * s + y * c


def time_to_close(gap: float, opening: float, most: float) -> float:
    """Return how long (s) a gap (m) that opens at this speed (m/s) surely stays open.

    Its second derivative is at least -``most`` (m/s^2).

    >>> time_to_close(3.0, -1.0, 4.0)
    1.0
    """
    if most == 0.0:
        return gap / -opening if opening < 0.0 else INF
    root = math.sqrt(opening * opening + 2.0 * most * gap)
    if opening > 0.0:
        return (opening + root) / most
    return 2.0 * gap / (root - opening + (1.0 if gap == 0.0 else 0.0))


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
        h = max(h, 3.0 * bend / jerk if jerk > 0.0 else INF)
    if h == INF:
        return h
    # In twice the time, the second derivative is hardly lower than now.
    pull = max(jerk * 2.0 * h / 3.0 - bend, 0.0)
    return max(h, min(2.0 * h, time_to_close(gap, opening, pull)))
