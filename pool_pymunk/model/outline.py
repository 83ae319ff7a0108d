"""The outline of a table: a simple polygon, whose sides are the cushions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, NamedTuple

from pool_pymunk.core.floor import Bow, Floor
from pool_pymunk.core.motion.times import unit
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.core.walls.face import Face
from pool_pymunk.core.walls.round import RoundSide
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.model.plain import (
    Acceleration,
    Bulges,
    Color,
    Corners,
    Part,
    problems_of,
    size,
)
from pool_pymunk.model.problems import COORDINATE_ROUNDING, Point, Problem, raise_any

PIECES = 360  # chords of a whole circle in the polyline; they lie up to 4e-5 radii inside the arc
# The radius of a flatter or rounder arc is so large that its rounding moves the cushion by more
# than 6e-13 of the length between the corners (2^-52 b / 4 or 2^-52 / (4 b), with the bulge b).
FLATTEST, ROUNDEST = 1e-4, 1e4
LEVEL: Point = (0.0, 0.0)  # a tilt (m/s^2)
NO_FRICTION = "on a tilted table with friction of the surface, paths have no closed form"
NEVER_RESTS = "on a tilted table balls may never come to rest"
STRAIGHT_ON = 1e-12  # rad; where an arc meets a side at a smaller angle, there is no corner


class Edge(NamedTuple):
    """An edge is a cushion from ``start`` to ``end``, with unit ``tangent`` and inward ``normal``.

    If the cushion is an arc, the tangent, the normal and the ``length`` (m) are those of its chord.
    ``bulge`` is the tangent of a quarter of the arc's angle.
    """

    start: Point
    end: Point
    tangent: Point
    normal: Point
    length: float
    bulge: float = 0.0

    @property
    def side(self) -> Face | Arc:
        """The cushion's surface."""
        if self.bulge == 0.0:
            return Face(self.start, self.tangent, self.normal, self.length)
        b = self.bulge
        far = self.length * (1.0 - b * b) / (4.0 * b)
        x, y = ((p + q) / 2.0 + far * n
                for p, q, n in zip(self.start, self.end, self.normal, strict=True))  # fmt: skip
        ends = [unit(end[0] - x, end[1] - y) for end in (self.start, self.end)]
        first, last = ends if b > 0.0 else ends[::-1]
        return Arc((x, y), self.arc_radius, first, last, -math.copysign(1.0, b))

    @property
    def arc_radius(self) -> float:
        """The radius (m) of the arc; infinite for a straight cushion."""
        b = abs(self.bulge)
        return self.length * (1.0 + b * b) / (4.0 * b) if b > 0.0 else math.inf

    @property
    def arc_length(self) -> float:
        """The length (m) along the cushion."""
        b = abs(self.bulge)
        return 4.0 * math.atan(b) * self.arc_radius if b > 0.0 else self.length

    def heading(self, at_end: bool) -> Point:
        """Return the unit vector along the cushion at its start, or at its end."""
        (tx, ty), b = self.tangent, self.bulge if at_end else -self.bulge
        cos, sin = (1.0 - b * b) / (1.0 + b * b), 2.0 * b / (1.0 + b * b)
        return cos * tx - sin * ty, sin * tx + cos * ty

    def at(self, share: float) -> tuple[Point, Point]:
        """Return the place (m) at a share of the cushion's length, and its normal there."""
        (x, y), side = self.start, self.side
        if isinstance(side, Face):
            s = share * self.length
            return (x + s * self.tangent[0], y + s * self.tangent[1]), self.normal
        turn = 4.0 * math.atan(self.bulge) * share
        (cx, cy), cos, sin = side.center, math.cos(turn), math.sin(turn)
        x, y = cx + cos * (x - cx) - sin * (y - cy), cy + sin * (x - cx) + cos * (y - cy)
        return (x, y), side.normal(x, y)

    def share(self, x: float, y: float) -> float:
        """Return the share of the cushion's length at the foot of a point, as ``at`` takes it.

        It is 0 at ``start`` and 1 at ``end``. The point may be the centre of a ball that touches.

        >>> straight, arc = Table.stadium(2.0, 1.0).edges[:2]
        >>> straight.share(0.75, 0.1), arc.share(1.7, 0.5)
        (0.25, 0.5)
        """
        side, (nx, ny) = self.side, self.normal
        if isinstance(side, Face):
            return self.along(x, y) / self.length
        away = -math.copysign(1.0, self.bulge)  # The arc's middle is at ``away`` n of its centre.
        dx, dy = away * (x - side.center[0]), away * (y - side.center[1])
        turn = math.atan2(nx * dy - ny * dx, nx * dx + ny * dy)
        return 0.5 + turn / (4.0 * math.atan(self.bulge))

    def points(self) -> list[Point]:
        """Return points along the cushion (m), from its start on, without its end."""
        parts = math.ceil(PIECES * 4.0 * abs(math.atan(self.bulge)) / math.tau)
        return [self.start, *(self.at(k / parts)[0] for k in range(1, parts))]

    def height(self, x: float, y: float) -> float:
        """Return a point's distance (m) from the cushion's line, positive on the table's side."""
        return (x - self.start[0]) * self.normal[0] + (y - self.start[1]) * self.normal[1]

    def along(self, x: float, y: float) -> float:
        """Return how far (m) along the cushion from ``start`` a point's foot lies."""
        return (x - self.start[0]) * self.tangent[0] + (y - self.start[1]) * self.tangent[1]

    def distance(self, x: float, y: float) -> float:
        """Return a point's distance (m) from the cushion itself, ends included."""
        if self.bulge != 0.0:
            gap = abs(self.side.gap(x, y, 0.0))
            ends = [math.dist((x, y), end) for end in (self.start, self.end)]
            return gap if gap < math.inf else min(ends)
        (x0, y0), (tx, ty) = self.start, self.tangent
        s = min(max(self.along(x, y), 0.0), self.length)
        return math.hypot(x - (x0 + s * tx), y - (y0 + s * ty))


def _edge(start: Point, end: Point, bulge: float = 0.0) -> Edge:
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.sqrt(dx * dx + dy * dy) or math.hypot(dx, dy)  # Squares of tiny sides are 0.
    tangent = (dx / length, dy / length)
    return Edge(start, end, tangent, (-tangent[1], tangent[0]), length, bulge)


@dataclass(frozen=True)
class Table(Part):
    """A table is a simple polygon, counter-clockwise; cushion k runs from corner k to the next.

    A cushion may be an arc. Its ``bulge`` is the tangent of a quarter of the arc's angle: 0 is
    straight, 1 a half circle outwards, and negative numbers bulge into the table. If both cushions
    bulge outwards, two corners are enough. ``color`` ("#rrggbb") is that of the cloth or board in
    pictures; by default the table is green. Balls fall along a table that is tilted, all at the
    acceleration ``tilt`` (m/s^2): an upright board has (0, -9.80665).

    >>> table = Table.rectangle(2.0, 1.0)
    >>> [edge.normal for edge in table.edges][1]
    (-1.0, 0.0)
    >>> table.contains(1.0, 0.5), table.contains(3.0, 0.5)
    (True, False)
    """

    outline: Annotated[Corners, "Corners of any simple polygon, counter-clockwise."]
    bulge: Annotated[Bulges, "Of each side: 0 straight, 1 a half circle out, -1 in."] = ()
    color: Annotated[Color, "Of a board in pictures; default: green cloth."] | None = None
    tilt: Annotated[Acceleration, "m/s^2, at which balls fall; without surface friction."] = LEVEL

    @classmethod
    def rectangle(
        cls, length: float, width: float, color: str | None = None, tilt: Point = LEVEL
    ) -> Table:
        """Return a rectangle: x from 0 to ``length``, y from 0 to ``width`` (m)."""
        _check_sizes(length=length, width=width)
        return cls(
            ((0.0, 0.0), (length, 0.0), (length, width), (0.0, width)), color=color, tilt=tilt
        )

    @classmethod
    def stadium(cls, length: float, width: float) -> Table:
        """Return a rectangle between two half circles; all of it has x from 0 to ``length`` (m).

        >>> Table.stadium(2.0, 1.0).bounds
        (0.0, 0.0, 2.0, 1.0)
        """
        _check_sizes(length=length, width=width)
        if not length > width:
            raise_any([Problem("length", length, f"must be greater than the width ({width:g})")])
        low, high = width / 2.0, length - width / 2.0
        outline = ((low, 0.0), (high, 0.0), (high, width), (low, width))
        return cls(outline, (0.0, 1.0, 0.0, 1.0))

    @classmethod
    def circle(cls, radius: float) -> Table:
        """Return a round table, whose middle is at (``radius``, ``radius``) (m).

        >>> [round(x, 12) for x in Table.circle(0.5).bounds]
        [0.0, 0.0, 1.0, 1.0]
        """
        _check_sizes(radius=radius)
        return cls(((2.0 * radius, radius), (0.0, radius)), (1.0, 1.0))

    def _problems(self) -> Iterator[Problem]:
        """Return the first thing that is wrong with the bulges, or else with the outline."""
        sound = [bulge == 0.0 or FLATTEST <= abs(bulge) <= ROUNDEST for bulge in self.bulge]
        if self.bulge and len(self.bulge) != len(self.outline):
            message = f"must have {len(self.outline)} numbers, one for each side"
            yield Problem("bulge", list(self.bulge), message)
        elif not all(sound):
            message = f"must be 0, or between {FLATTEST:g} and {ROUNDEST:g} in size"
            yield Problem(("bulge", k := sound.index(False)), self.bulge[k], message)
        elif message := self._misdrawn():
            yield Problem("outline", [list(corner) for corner in self.outline], message)

    def _misdrawn(self) -> str:
        """Return what is wrong with the outline, or an empty text."""
        count = len(self.outline)
        if count < 2 or (count == 2 and min(self.bulge, default=0.0) <= 0.0):
            return "must have three corners or more, or two between sides that bulge outwards"
        if message := _equal_corners(self.outline):
            return message
        points = self.polyline
        cushions = [k for k, edge in enumerate(self.edges) for _ in edge.points()]
        meeting = _crossing(points, _slack(self.outline))
        if meeting is not None:
            first, second = (cushions[piece] for piece in meeting)
            return f"crosses itself (cushion {first} meets cushion {second})"
        return "" if _area(points) > 0.0 else "must run counter-clockwise"

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The cushions, in order along the outline."""
        corners, bulge = self.outline, self.bulge or (0.0,) * len(self.outline)
        return tuple(map(_edge, corners, corners[1:] + corners[:1], bulge))

    @cached_property
    def polyline(self) -> tuple[Point, ...]:
        """The outline, in which arcs are strings of many corners (m)."""
        return tuple(point for edge in self.edges for point in edge.points())

    @cached_property
    def reflex_corners(self) -> tuple[int, ...]:
        """Corners that stick out into the table, so that a ball can hit them.

        Corner k joins cushions k - 1 and k.
        """
        edges = self.edges
        least = [STRAIGHT_ON if edges[k - 1].bulge or e.bulge else 0.0 for k, e in enumerate(edges)]
        turns = [_cross(edges[k - 1].heading(True), e.heading(False)) for k, e in enumerate(edges)]
        return tuple(k for k, turn in enumerate(turns) if turn < -least[k])

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The cushions as walls without coefficients, in order along the outline.

        Each has the cushion's face or arc, and its first corner if that sticks out into the table.
        """
        corners = {k: (self._corner(k),) for k in self.reflex_corners}
        sides = ([edge.side, *corners.get(k, ())] for k, edge in enumerate(self.edges))
        return tuple(Wall(each, 0.0, 0.0, k) for k, each in enumerate(sides))

    def _corner(self, k: int) -> RoundSide:
        """Return the corner that joins cushions k - 1 and k, between their normals."""
        edge, before = self.edges[k], self.edges[k - 1]
        (x, y), (u, v) = edge.heading(False), before.heading(True)
        return RoundSide(edge.start, 0.0, (-y, x), (-v, u))

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y (m)."""
        xs, ys = zip(*self.polyline, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    @cached_property
    def is_rectangle(self) -> bool:
        """Tell whether the table is a rectangle with cushions 0 to 3 as the report has them."""
        x0, y0, x1, y1 = self.bounds
        return self.outline == ((x0, y0), (x1, y0), (x1, y1), (x0, y1)) and not any(self.bulge)

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point is on the table (even-odd rule)."""
        return _floor(*self.lines).holds(x, y, 0.0, 0.0)

    @cached_property
    def lines(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[Bow, ...]]:
        """The corners' x and y (m), and for each arc both ends, centre, radius (m) and bulge."""
        xs, ys = zip(*self.outline, strict=True)
        arcs = [(edge, edge.side) for edge in self.edges]
        return xs, ys, tuple(
            (*edge.start, *edge.end, *side.center, side.radius, edge.bulge)
            for edge, side in arcs if isinstance(side, Arc)
        )  # fmt: skip


@lru_cache(maxsize=64)
def _floor(xs: tuple[float, ...], ys: tuple[float, ...], bows: tuple[Bow, ...]) -> Floor:
    """Return an outline as the core has it."""
    return Floor([*xs], [*ys], [*bows], [])


def _check_sizes(**sizes: object) -> None:
    """Raise SceneError for values that are not lengths (m) above 0."""
    raise_any(each for key, value in sizes.items() for each in problems_of(value, size, key))


def _cross(a: Point, b: Point) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _area(outline: Sequence[Point]) -> float:
    x0, y0 = outline[0]  # relative to a corner: a table far from the origin keeps its digits
    shifted = [(x - x0, y - y0) for x, y in outline]
    return sum(_cross(a, b) for a, b in zip(shifted, shifted[1:] + shifted[:1], strict=True)) / 2


def misdrawn(corners: Sequence[Point]) -> str:
    """Return what is wrong with a polygon that runs in any direction, or an empty text.

    >>> misdrawn([(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])
    'crosses itself (side 0 meets side 2)'
    """
    if len(corners) < 3:
        return "must have three corners or more"
    if message := _equal_corners(corners):
        return message
    meeting = _crossing(corners, _slack(corners))
    return "" if meeting is None else "crosses itself (side {} meets side {})".format(*meeting)


def _slack(corners: Sequence[Point]) -> float:
    """Return how far (m) rounding may move corners."""
    return COORDINATE_ROUNDING * max(max(map(abs, corner)) for corner in corners)


def _equal_corners(corners: Sequence[Point]) -> str:
    """Say which two corners in a row are equal, or return an empty text."""
    slack, count = _slack(corners), len(corners)
    for k, corner in enumerate(corners):
        if math.dist(corners[k - 1], corner) <= slack:
            return f"has two equal corners in a row ({(k - 1) % count} and {k})"
    return ""


def _crossing(points: Sequence[Point], slack: float) -> tuple[int, int] | None:
    """Return two sides of a closed polygon that meet where they should not."""
    edges = tuple(map(_edge, points, (*points[1:], *points[:1])))
    along_x = (sorted((edge.start[0], edge.end[0])) for edge in edges)
    pairs = sweep({k: (low, high + slack) for k, (low, high) in enumerate(along_x)})
    return next((pair for pair in pairs if _sides_meet(edges, *pair, slack)), None)


def sweep(spans: Mapping[int, tuple[float, float]]) -> Iterator[tuple[int, int]]:
    """Yield all pairs of numbers, the lower one first, whose spans (low, high) overlap."""
    active: list[int] = []
    for i in sorted(spans, key=lambda k: spans[k][0]):
        active = [j for j in active if spans[j][1] >= spans[i][0]]
        yield from ((min(i, j), max(i, j)) for j in active)
        active.append(i)


def _sides_meet(edges: Sequence[Edge], i: int, j: int, slack: float) -> bool:
    """Tell whether two sides meet; the common corner of neighbours does not count."""
    p, q = edges[i], edges[j]
    (p_low, p_high), (q_low, q_high) = (sorted((e.start[1], e.end[1])) for e in (p, q))
    if p_low - slack > q_high or q_low - slack > p_high:
        return False
    if j - i in (1, len(edges) - 1):
        first, second = (p, q) if p.end == q.start else (q, p)
        return first.distance(*second.end) <= slack or second.distance(*first.start) <= slack
    both = ((p, q), (q, p))
    if any(min(a.distance(*b.start), a.distance(*b.end)) <= slack for a, b in both):
        return True
    return all((a.height(*b.start) > 0.0) != (a.height(*b.end) > 0.0) for a, b in both)
