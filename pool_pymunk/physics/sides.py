"""Balls bounce off walls; a wall consists of sides, which are straight faces and round sides.

A pocket is a wall of another kind, which takes balls in. Its only side is its rim.

A side answers when a ball meets it, how wide the ``gap`` to a ball is, which ``normal`` a contact
has, and how the normal turns. A caller need not know what kind of side it asks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from pool_pymunk.physics.motion import (
    EPSILON,
    Vector,
    path_out_of_disc,
    path_to_disc,
    time_to_return,
)
from pool_pymunk.physics.path import (
    Path,
    arrival,
    disc_time,
    fastest_of,
    motion_at,
    speed_of,
    time_in,
    time_out,
)
from pool_pymunk.physics.pressed import FLAT, ROUND

# radii; a ball that overlaps a face by no more than this touches it. Scenes allow this overlap at a
# start (TOUCHING in model/places.py), because coordinates may be rounded.
OVERLAP = 1e-6
# A ball that touches a face and sinks by less than this share of its speed moves along it. This is
# far above rounding, 1e-16, and far below the angles of shots; so are half and twice of it.
GRAZING = 1e-12
# A ball sets off along a circle if a smaller share of its acceleration points across. This is far
# above the rounding of directions, 1e-15, and so are half and twice of it.
ALONG = 1e-9

# A parabola crosses a circle four times at most, so it comes in twice and leaves twice.
MOST_CROSSINGS = 2
BEFORE = 2e-8  # radii; a ball that runs along a side passes to the next one so much before its end


class Side(Protocol):
    """A side is a part of a wall that a ball can bounce off.

    ``time_of_contact`` is the time (s), not before now, at which a ball of radius ``r`` on its path
    meets the side; it is infinite if the ball does not. ``gap`` is the distance (m) from a ball at
    (x, y); it is infinite if the ball is not beside the side. ``normal`` is the unit vector from
    the side to a ball there. ``curvature`` (1/m) is how fast the normal turns as a ball moves along
    the side: 0 at a straight side, one over the distance of the centres at a round one.

    A side may have a ``core``: how far (m) it is solid below its surface, 0 if it does not say. A
    ball whose centre is deeper lies behind the side, and not in it.
    """

    def time_of_contact(self, path: Path, r: float, now: float) -> float: ...

    def gap(self, x: float, y: float, r: float) -> float: ...

    def normal(self, x: float, y: float) -> Vector: ...

    def curvature(self, x: float, y: float) -> float: ...


# The numbers of a shape are those of physics/pressed.py.
Shape = tuple[float, float, float, float, float, float, float, float]


class Straight(NamedTuple):
    """A straight edge is a line through ``point``, across the unit vector ``normal``."""

    point: Vector
    normal: Vector

    def height(self, near: Vector) -> float:
        """Return how far ``near`` lies off the line, along its normal."""
        (x, y), (nx, ny) = self
        return (near[0] - x) * nx + (near[1] - y) * ny

    def nearest(self, near: Vector) -> Vector:
        """Return the point of it that is nearest to ``near``."""
        (nx, ny), height = self.normal, self.height(near)
        return near[0] - height * nx, near[1] - height * ny


class Round(NamedTuple):
    """A round edge is a circle."""

    center: Vector
    radius: float

    def nearest(self, near: Vector) -> Vector:
        """Return the point of it that is nearest to ``near``."""
        (x, y), r = self
        nx, ny = unit(near[0] - x, near[1] - y)
        return x + r * nx, y + r * ny


class Face(NamedTuple):
    """A face is one side of a straight cushion.

    It runs from ``start`` along ``tangent`` and faces ``outward``. ``start`` (m) lies on the
    cushion's middle line; ``radius`` (m) is half the cushion's thickness.
    """

    start: Vector
    tangent: Vector
    outward: Vector
    length: float
    radius: float = 0.0

    @property
    def core(self) -> float:
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball; infinite if the ball is not beside the face."""
        (x0, y0), (tx, ty), (nx, ny), length, radius = self
        foot = (x - x0) * tx + (y - y0) * ty
        slack = GRAZING * length
        if foot < -slack or foot > length + slack:
            return math.inf
        return (x - x0) * nx + (y - y0) * ny - radius - r

    def shape(self, x: float, y: float, r: float) -> tuple[int, Shape]:
        (x0, y0), _, (nx, ny), length, radius = self
        gap, last = (x - x0) * nx + (y - y0) * ny - radius - r, y0 * nx - x0 * ny
        return FLAT, (nx, ny, x * nx + y * ny - gap, last - length, last, 0.0, 0.0, 0.0)

    def normal(self, x: float, y: float) -> Vector:
        return self.outward

    def curvature(self, x: float, y: float) -> float:
        return 0.0

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the face; never if it moves along it, to rounding."""
        nx, ny = self.outward
        closing = -(path.vx * nx + path.vy * ny)
        if closing <= 0.0 and path.slows:
            return math.inf
        pull = -(path.ax * nx + path.ay * ny)
        if closing <= 0.0 and pull <= 0.0:
            return math.inf
        (x0, y0), (tx, ty), _, width, radius = self
        x, y = path.x - x0, path.y - y0
        height = x * nx + y * ny
        if height < 0.0:
            return math.inf
        gap = height - r - radius
        rounding = EPSILON * (abs(path.x) + abs(path.y) + r)
        if gap <= rounding and closing <= GRAZING * speed_of(path):
            if path.slows:
                return math.inf
            gap, closing = (0.0 if gap > -OVERLAP * r else gap), min(closing, 0.0)
        time = 0.0
        if closing <= 0.0:
            time = time_to_return(gap, -closing, pull)
        elif gap > 0.0:
            square = closing * closing + 2.0 * gap * pull
            if square <= 0.0:
                return math.inf
            time = 2.0 * gap / (closing + math.sqrt(square))
        if not path.slows and (time == math.inf or time > path.end - path.t):
            return math.inf
        u, pull = path.vx * tx + path.vy * ty, path.ax * tx + path.ay * ty
        foot, u = x * tx + y * ty + time * (u + time * pull / 2.0), u + time * pull
        slack, ahead = GRAZING * width, 0.0
        if foot < -slack or foot > width + slack:
            ahead = BEFORE * r / abs(u) if u != 0.0 and not path.slows else 0.0
            foot += ahead * u
            if foot < -slack or foot > width + slack or ahead == 0.0:
                return math.inf
        t = path.t + time + ahead  # It is beside the face until then, and runs on along it.
        return t if t > now else now

    def edge(self, r: float) -> Straight:
        """Return the line on which the centre of a touching ball lies."""
        (x, y), (nx, ny), far = self.start, self.outward, self.radius + r
        return Straight((x + far * nx, y + far * ny), self.outward)


class RoundSide(NamedTuple):
    """A round side is a circle, or with radius 0 a corner.

    Balls hit it from all around. Where other sides begin, a persistent contact with it ends: it is
    between the directions ``first`` and ``last``, counter-clockwise. A whole circle has (0, 0).
    """

    center: Vector
    radius: float = 0.0
    first: Vector = (0.0, 0.0)
    last: Vector = (0.0, 0.0)

    @property
    def core(self) -> float:
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius - r

    def shape(self, x: float, y: float, r: float) -> tuple[int, Shape]:
        (cx, cy), radius, (fx, fy), (lx, ly) = self
        return ROUND, (cx, cy, 1.0, radius + r, fx, fy, lx, ly)

    def normal(self, x: float, y: float) -> Vector:
        return unit(x - self.center[0], y - self.center[1])

    def curvature(self, x: float, y: float) -> float:
        dx, dy = x - self.center[0], y - self.center[1]
        return 1.0 / math.sqrt(dx * dx + dy * dy)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the circle; never if its path is tangent, to rounding."""
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        touching = r + self.radius - rounding
        if is_tangent(path, self.center, touching, rounding):
            return math.inf
        return disc_time(path, self.center, touching, now)

    def edge(self, r: float) -> Round:
        """Return the circle on which the centre of a touching ball lies."""
        return Round(self.center, self.radius + r)


class Arc(NamedTuple):
    """An arc is a side that is part of a circle; balls are inside of the circle or outside.

    It runs counter-clockwise around ``center`` (m), from the direction ``first`` to ``last``, which
    are unit vectors. ``facing`` is 1 for an arc that bulges into the table, so that balls are
    outside of its circle, and -1 for one that bulges outwards.
    """

    center: Vector
    radius: float
    first: Vector
    last: Vector
    facing: float

    @property
    def core(self) -> float:
        return 0.0

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball; infinite if the ball is not beside the arc."""
        (cx, cy), radius, first, last, facing = self
        dx, dy = x - cx, y - cy
        if not within_sector(dx, dy, first, last):
            return math.inf
        return facing * (math.sqrt(dx * dx + dy * dy) - radius) - r

    def shape(self, x: float, y: float, r: float) -> tuple[int, Shape]:
        (cx, cy), (fx, fy), (lx, ly) = self.center, self.first, self.last
        return ROUND, (cx, cy, self.facing, self.radius + self.facing * r, fx, fy, lx, ly)

    def normal(self, x: float, y: float) -> Vector:
        nx, ny = unit(x - self.center[0], y - self.center[1])
        return self.facing * nx, self.facing * ny

    def curvature(self, x: float, y: float) -> float:
        dx, dy = x - self.center[0], y - self.center[1]
        return self.facing / math.sqrt(dx * dx + dy * dy)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball meets the arc: as it comes into the circle, or as it leaves it."""
        if path.slows:
            return straight_to_arc(self, path, r, now)
        return bent_to_arc(self, path, r, now)

    def edge(self, r: float) -> Round:
        """Return the circle on which the centre of a touching ball lies."""
        return Round(self.center, self.radius + self.facing * r)


def straight_to_arc(arc: Arc, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball on a straight path meets an arc."""
    center, radius, first, last, facing = arc
    x, y, speed = path.x - center[0], path.y - center[1], speed_of(path)
    if speed == 0.0 or keeps_beside_sector(x, y, path, first, last, 2.0 * GRAZING * radius):
        return math.inf
    ux, uy, touching = path.vx / speed, path.vy / speed, radius + facing * r
    if facing > 0.0:
        rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        touching -= rounding
        is_behind = x * x + y * y < radius * radius
        if is_behind or is_tangent(path, center, touching, rounding):
            return math.inf
        length = path_to_disc((-x, -y), (ux, uy), touching)
    else:
        time, within = (path.end - path.t) / 2.0, touching * (1.0 - ALONG)
        rest_x, rest_y = x + time * path.vx, y + time * path.vy
        if rest_x * rest_x + rest_y * rest_y < within * within:
            return math.inf
        length = path_out_of_disc((-x, -y), (ux, uy), touching, radius, GRAZING)
    if length == math.inf or not within_sector(x + length * ux, y + length * uy, first, last):
        return math.inf
    return arrival(path, length, now)


def bent_to_arc(arc: Arc, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball on a bent path meets an arc.

    It has the same bits whenever it is asked for: it is looked for from the path's beginning.
    """
    t = bent_to_arc_since(arc, path, r, path.t)
    return t if t >= now or path.t >= now else bent_to_arc_since(arc, path, r, now)


def bent_to_arc_since(arc: Arc, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball on a bent path meets an arc from a time ``now`` (s) on."""
    center, radius, first, last, facing = arc
    since, touching = max(path.t, now), radius + facing * r
    if is_short_of(arc, path, r, since):
        return math.inf
    if facing > 0.0:
        touching -= 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
        x, y, _, _ = motion_at(path, since)
        dx, dy = x - center[0], y - center[1]
        if dx * dx + dy * dy < radius * radius:  # The ball is behind the arc.
            since = time_out(path, center, touching, radius, since)
    else:
        since = after_setting_off(path, center, touching, r, since)
    for _ in range(MOST_CROSSINGS if since < math.inf else 0):
        if facing > 0.0:
            t = time_in(path, center, touching, since)
        else:
            t = time_out(path, center, touching, radius, since)
        if t == math.inf:
            return t
        x, y, vx, vy = motion_at(path, t)
        x, y, speed = x - center[0], y - center[1], math.sqrt(vx * vx + vy * vy)
        ahead = BEFORE * r / speed if speed > 0.0 else 0.0
        x_on, y_on = x + ahead * vx, y + ahead * vy
        if within_sector(x, y, first, last):
            return t if t > now else now
        if within_sector(x_on, y_on, first, last):  # It is beside the arc, and runs on along it.
            return t + ahead if t + ahead > now else now
        if facing > 0.0:
            since = time_out(path, center, touching, touching, t)
        else:
            since = time_in(path, center, touching, t)
        if since == math.inf:
            return since
    return math.inf


def is_tangent(path: Path, center: Vector, touching: float, rounding: float) -> bool:
    """Tell whether a straight path begins along a circle, as after a dull hit, to ``rounding``."""
    dx, dy = center[0] - path.x, center[1] - path.y
    along, near = dx * path.vx + dy * path.vy, touching + 2.0 * rounding
    begins_along = path.slows and along <= GRAZING * touching * speed_of(path)
    return begins_along and dx * dx + dy * dy <= near * near


def after_setting_off(path: Path, center: Vector, touching: float, r: float, since: float) -> float:
    """Return from when on (s) a ball within a circle may meet it; infinite if its path ends before.

    A ball at rest that sets off along the circle stays on it until it is off by more than rounding.
    """
    if path.vx != 0.0 or path.vy != 0.0:
        return since
    dx, dy, ax, ay = path.x - center[0], path.y - center[1], path.ax, path.ay
    across, along, near = ax * dx + ay * dy, ay * dx - ax * dy, touching * (1.0 - ALONG)
    if abs(across) >= ALONG * abs(along) or dx * dx + dy * dy < near * near:
        return since
    rounding = 8.0 * EPSILON * (abs(path.x) + abs(path.y) + r)
    time = math.sqrt(math.sqrt(8.0 * rounding * touching / (ax * ax + ay * ay)))
    since = max(since, path.t + time)
    return since if since < path.end else math.inf


def keeps_beside_sector(
    x: float, y: float, path: Path, first: Vector, last: Vector, margin: float
) -> bool:
    """Tell whether a straight path from (x, y) keeps beside a sector, as it leads away from it."""
    if first[0] * y - first[1] * x >= -margin or x * last[1] - y * last[0] >= -margin:
        return False
    vx, vy = path.vx, path.vy
    return first[0] * vy - first[1] * vx <= 0.0 and vx * last[1] - vy * last[0] <= 0.0


def is_short_of(arc: Arc, path: Path, r: float, since: float) -> bool:
    """Tell whether a bent path is too short to come into the sector of an arc after a time (s)."""
    (cx, cy), _, (fx, fy), (lx, ly), _ = arc
    x, y, _, _ = motion_at(path, since)
    x, y = x - cx, y - cy
    far = fastest_of(path) * (path.end - since) + 2.0 * BEFORE * r
    after, before = far + fx * y - fy * x, far + x * ly - y * lx
    if fx * ly - fy * lx > 0.0:
        return after < 0.0 or before < 0.0
    return after < 0.0 and before < 0.0


def within_sector(x: float, y: float, first: Vector, last: Vector) -> bool:
    """Tell whether a direction lies between two others, counter-clockwise, to rounding."""
    after, before = first[0] * y - first[1] * x, x * last[1] - y * last[0]
    if after >= 0.0 and before >= 0.0:
        return True
    slack = GRAZING * math.sqrt(x * x + y * y)
    if first[0] * last[1] - first[1] * last[0] > 0.0:  # They are less than half a turn apart.
        return after >= -slack and before >= -slack
    return after >= -slack or before >= -slack


class Rim(NamedTuple):
    """A rim is the circle on which a ball's centre is when a pocket takes it in."""

    center: Vector
    radius: float

    @property
    def core(self) -> float:
        return self.radius

    def gap(self, x: float, y: float, r: float) -> float:
        """Return the distance (m) from the ball's centre to the rim; negative within it."""
        dx, dy = x - self.center[0], y - self.center[1]
        return math.sqrt(dx * dx + dy * dy) - self.radius

    def shape(self, x: float, y: float, r: float) -> tuple[int, Shape]:
        return circle(self.center[0], self.center[1], 1.0, self.radius)

    def normal(self, x: float, y: float) -> Vector:
        return unit(x - self.center[0], y - self.center[1])

    def curvature(self, x: float, y: float) -> float:
        return 1.0 / self.radius

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        """Return when (s) a ball's centre comes to the rim."""
        return disc_time(path, self.center, self.radius, now)

    def edge(self, r: float) -> Round:
        """Return a circle just outside of the rim, on which a ball's centre may lie."""
        return Round(self.center, self.radius * (1.0 + 1e-9))


class Measured:
    """A measured side answers ``length_along``, the path length (m), and not when."""

    def __init__(self, side: Any) -> None:
        self.gap, self.normal, self.length_along = side.gap, side.normal, side.length_along
        self.curvature = getattr(side, "curvature", lambda x, y: 0.0)
        self.core = core_of(side)

    def time_of_contact(self, path: Path, r: float, now: float) -> float:
        return arrival(path, self.length_along(path, r), now)


class Wall:
    """A wall bounces balls off, or takes them in if it is a pocket; it consists of sides.

    It has its coefficients, its ``kick`` (m/s), and the number by which it is reported. ``center``
    (m) is where a pocket keeps the balls that it has taken in; it is None for a wall that bounces
    balls off.
    ``time_of_contact`` is that of the side that a ball meets first; a wall may have no side.
    """

    __slots__ = (
        "center", "friction", "kick", "number", "restitution", "sides", "time_of_contact"
    )  # fmt: skip

    time_of_contact: Callable[[Path, float, float], float]

    def __init__(
        self,
        sides: tuple[Side, ...],
        restitution: float,
        friction: float,
        number: int,
        kick: float = 0.0,
    ) -> None:
        from pool_pymunk.physics.of_core import side_of

        sides = tuple([s if hasattr(s, "time_of_contact") else Measured(s) for s in sides])
        sides = tuple(map(side_of, sides))
        self.sides = sides
        self.restitution = restitution
        self.friction = friction
        self.number = number
        self.kick = kick
        self.center: Vector | None = None
        first = sides[0].time_of_contact if len(sides) == 1 else self._first_contact
        self.time_of_contact = first

    def drift(self, x: float, y: float, r: float) -> Vector:
        """Return the velocity (m/s) of the wall where a ball at (x, y) touches it: it stands."""
        return 0.0, 0.0

    def sweep(self, x: float, y: float) -> tuple[float, float, float, float]:
        """Return how the wall moves at (x, y): it stands (``MovingWall``)."""
        return 0.0, 0.0, 0.0, 0.0

    def motion(self, now: float) -> tuple[float, float, float, float, float, float]:
        """Return how the wall moves now (s): it stands (``MovingWall``)."""
        return 0.0, 0.0, now, 0.0, 0.0, 0.0

    @property
    def is_pocket(self) -> bool:
        """Tell whether the wall takes balls in."""
        return self.center is not None

    def _first_contact(self, path: Path, r: float, now: float) -> float:
        return min([side.time_of_contact(path, r, now) for side in self.sides], default=math.inf)

    def length_along(self, path: Path, r: float) -> float:
        """Return the path length (m) after which a ball meets the wall, if its path is straight."""
        t = self.time_of_contact(path, r, path.t)
        return math.dist(path.at(t)[0], (path.x, path.y)) if t < math.inf else math.inf

    def nearest(self, x: float, y: float, r: float) -> Side:
        """Return the side whose surface is nearest to a ball of radius ``r`` at (x, y)."""
        if len(self.sides) == 1:
            return self.sides[0]
        return min(self.sides, key=lambda side: away(side.gap(x, y, r), core_of(side) + r))


def pocket(center: Vector, radius: float, number: int) -> Wall:
    """Return a wall that takes balls in whose centres come within ``radius`` (m)."""
    wall = Wall((Rim(center, radius),), 0.0, 0.0, number)
    wall.center = center
    return wall


def away(gap: float, depth: float) -> float:
    """Return how far (m) a surface is from a ball, for the choice of the nearest one.

    This is the gap, which is negative where the ball has sunk in by rounding. So the face next to a
    corner wins, in whose circle the ball has sunk less deep. Deeper than its ``depth`` (m) the ball
    is behind the surface.
    """
    return gap if gap >= -depth else -gap


def core_of(side: Any) -> float:
    """Return how far (m) a side is solid below its surface."""
    return float(getattr(side, "core", 0.0))


def face_between(start: Vector, end: Vector, radius: float = 0.0) -> Face:
    """Return the face that a traveller from ``start`` to ``end`` (m) has on the left."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    tx, ty = unit(dx, dy)
    return Face(start, (tx, ty), (-ty, tx), math.sqrt(dx * dx + dy * dy), radius)


def shape_of(side: Any, x: float, y: float, r: float) -> tuple[int, Shape]:
    """Return what a ball touches, and the numbers of its shape, as a press takes them.

    The ball has its centre at (x, y), and the radius r (m). A side of a user's own is taken as the
    line or the circle that its normal and its curvature describe there, without ends.
    """
    if type(side) in (Face, RoundSide, Arc):
        return side.shape(x, y, r)  # type: ignore[no-any-return]
    (nx, ny), bends = side.normal(x, y), side.curvature(x, y)
    if bends != 0.0:
        return circle(x - nx / bends, y - ny / bends, math.copysign(1.0, bends), 1.0 / abs(bends))
    height = x * nx + y * ny - side.gap(x, y, r)
    return FLAT, (nx, ny, height, -math.inf, math.inf, 0.0, 0.0, 0.0)


def circle(x: float, y: float, facing: float, far: float) -> tuple[int, Shape]:
    """Return the shape of a circle without ends, from whose centre a ball is ``far`` (m)."""
    return ROUND, (x, y, facing, far, 0.0, 0.0, 0.0, 0.0)


def unit(x: float, y: float) -> Vector:
    """Return the unit vector along (x, y), or the x axis if both are zero."""
    length = math.sqrt(x * x + y * y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
