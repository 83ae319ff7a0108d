"""The outline of a table: a simple polygon, whose sides are the cushions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from pool_pymunk.model.keys import Bulges, Color, Corners, Part
from pool_pymunk.model.plain import problems_of, size
from pool_pymunk.model.problems import COORDINATE_ROUNDING, Point, Problem, raise_any
from pool_pymunk.physics.sides import Arc, Face, RoundSide, Wall, unit

PIECES = 360  # of a whole circle, where an arc is drawn; they lie 4e-5 of the radius off
# The radius of a flatter or rounder arc is so large that its rounding moves the cushion by more
# than 6e-13 of the length between the corners (2^-52 b / 4 or 2^-52 / (4 b), with the bulge b).
FLATTEST, ROUNDEST = 1e-4, 1e4
STRAIGHT_ON = 1e-12  # rad; an arc that turns off by less goes on straight, and has no corner there


class Edge(NamedTuple):
    """One cushion from ``start`` to ``end``, its unit ``tangent``, its unit ``normal`` inwards.

    Where the cushion is an arc, they are those of its chord, as is ``length`` (m), and ``bulge`` is
    the tangent of a quarter of the arc's angle.
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
        """Return the share of the cushion's length at which it faces a point: what ``at`` takes.

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
        """Distance (m) of a point from the cushion's line, positive on the table's side."""
        return (x - self.start[0]) * self.normal[0] + (y - self.start[1]) * self.normal[1]

    def along(self, x: float, y: float) -> float:
        """Where the point's foot lies on the cushion: 0 at ``start``, ``length`` at ``end`` (m)."""
        return (x - self.start[0]) * self.tangent[0] + (y - self.start[1]) * self.tangent[1]

    def distance(self, x: float, y: float) -> float:
        """Distance (m) of a point from the cushion itself, ends included."""
        if self.bulge != 0.0:
            gap = abs(self.side.gap(x, y, 0.0))
            ends = [math.dist((x, y), end) for end in (self.start, self.end)]
            return gap if gap < math.inf else min(ends)
        s = min(max(self.along(x, y), 0.0), self.length)
        foot_x = self.start[0] + s * self.tangent[0]
        foot_y = self.start[1] + s * self.tangent[1]
        return math.hypot(x - foot_x, y - foot_y)


def _edge(start: Point, end: Point, bulge: float = 0.0) -> Edge:
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.sqrt(dx * dx + dy * dy) or math.hypot(dx, dy)  # The smallest squares are 0.
    tangent = (dx / length, dy / length)
    return Edge(start, end, tangent, (-tangent[1], tangent[0]), length, bulge)


@dataclass(frozen=True)
class Table(Part):
    """A table: any simple polygon, counter-clockwise; cushion k runs from corner k to the next.

    A cushion may be an arc. Its ``bulge`` is the tangent of a quarter of the arc's angle: 0 is
    straight, 1 a half circle outwards, and negative numbers bulge into the table. Two corners are
    enough where both cushions bulge outwards. ``color`` ("#rrggbb") is that of the cloth or board
    in pictures; by default the table is green.

    >>> table = Table.rectangle(2.0, 1.0)
    >>> [edge.normal for edge in table.edges][1]
    (-1.0, 0.0)
    >>> table.contains(1.0, 0.5), table.contains(3.0, 0.5)
    (True, False)
    """

    outline: Corners
    bulge: Bulges = ()
    color: Color | None = None

    @classmethod
    def rectangle(cls, length: float, width: float, color: str | None = None) -> Table:
        """The report's table: x from 0 to ``length``, y from 0 to ``width`` (m)."""
        raise_any([*problems_of(length, size, "length"), *problems_of(width, size, "width")])
        corners = ((0.0, 0.0), (length, 0.0), (length, width), (0.0, width))
        return cls(corners, color=color)

    @classmethod
    def stadium(cls, length: float, width: float) -> Table:
        """Return a rectangle with half circles at its ends: x from 0 to ``length`` over all (m).

        >>> Table.stadium(2.0, 1.0).bounds
        (0.0, 0.0, 2.0, 1.0)
        """
        raise_any([*problems_of(length, size, "length"), *problems_of(width, size, "width")])
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
        raise_any(problems_of(radius, size, "radius"))
        return cls(((2.0 * radius, radius), (0.0, radius)), (1.0, 1.0))

    def _problems(self) -> Iterator[Problem]:
        if self.bulge and len(self.bulge) != len(self.outline):
            message = f"must have {len(self.outline)} numbers, one for each side"
            yield Problem("bulge", list(self.bulge), message)
            return
        for k, bulge in enumerate(self.bulge):
            if bulge != 0.0 and not FLATTEST <= abs(bulge) <= ROUNDEST:
                message = f"must be 0, or between {FLATTEST:g} and {ROUNDEST:g} in size"
                yield Problem(("bulge", k), bulge, message)
                return
        if len(self.outline) < 3 and not (
            len(self.outline) == 2 and min(self.bulge, default=0) > 0
        ):
            message = "must have three corners or more, or two between sides that bulge outwards"
            yield self._problem(message)
            return
        slack = COORDINATE_ROUNDING * max(max(map(abs, corner)) for corner in self.outline)
        for k, corner in enumerate(self.outline):
            if math.dist(self.outline[k - 1], corner) <= slack:
                k_before = (k - 1) % len(self.outline)
                yield self._problem(f"has two equal corners in a row ({k_before} and {k})")
                return
        meeting = self._crossing(slack)
        if meeting is not None:
            yield self._problem("crosses itself (cushion {} meets cushion {})".format(*meeting))
        elif _area(self.polyline) <= 0.0:
            yield self._problem("must run counter-clockwise")

    def _problem(self, message: str) -> Problem:
        return Problem("outline", [list(corner) for corner in self.outline], message)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The cushions, in order along the outline."""
        corners, bulge = self.outline, self.bulge or (0.0,) * len(self.outline)
        return tuple(map(_edge, corners, corners[1:] + corners[:1], bulge))

    @cached_property
    def polyline(self) -> tuple[Point, ...]:
        """The outline, in which arcs are strings of many corners (m)."""
        return tuple(point for edge in self.edges for point in edge.points())

    def _crossing(self, slack: float) -> tuple[int, int] | None:
        """Return the numbers of two cushions that meet where they should not, or None."""
        points = self.polyline
        of_edge = [k for k, edge in enumerate(self.edges) for _ in edge.points()]
        pieces = tuple(map(_edge, points, points[1:] + points[:1]))
        found = _crossing(pieces, slack)
        return None if found is None else (of_edge[found[0]], of_edge[found[1]])

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

        Each wall has the cushion's face or arc, and the cushion's first corner if it sticks out
        into the table.
        """
        corners = {k: (RoundSide(self.edges[k].start),) for k in self.reflex_corners}
        return tuple(
            Wall((edge.side, *corners.get(k, ())), 0.0, 0.0, k) for k, edge in enumerate(self.edges)
        )

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y (m)."""
        xs, ys = zip(*self.polyline, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    @cached_property
    def is_rectangle(self) -> bool:
        """Tell whether the table is a rectangle with cushions 0 to 3 as the report has them."""
        x0, y0, x1, y1 = self.bounds
        is_straight = not any(self.bulge)
        return is_straight and self.outline == ((x0, y0), (x1, y0), (x1, y1), (x0, y1))

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point is on the table (even-odd rule)."""
        return contains(*self.lines, x, y)

    @cached_property
    def lines(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[tuple[float, ...], ...]]:
        """The x and y of the corners, and of arcs both ends, centre, radius (m) and bulge."""
        xs, ys = zip(*self.outline, strict=True)
        arcs = tuple(
            (*edge.start, *edge.end, *side.center, side.radius, edge.bulge)
            for edge, side in ((edge, edge.side) for edge in self.edges)
            if isinstance(side, Arc)
        )
        return xs, ys, arcs


def contains(xs: Any, ys: Any, arcs: Any, x: float, y: float) -> bool:
    """Tell whether a point is within an outline, by its corners and arcs; numba can compile it.

    A point is within the outline if it is within one of these and not within another one, or within
    three of them, and so on: the polygon of the corners, and what lies between arcs and chords.
    """
    inside = False
    for k in range(len(xs)):
        inside ^= crosses(xs[k - 1], ys[k - 1], xs[k], ys[k], x, y)
    for k in range(len(arcs)):
        inside ^= lies_between(arcs[k], x, y)
    return inside


def lies_between(arc: Any, x: float, y: float) -> bool:
    """Tell whether a point lies between an arc and its chord.

    Rounding puts it on that side of the chord on which ``crosses`` has it.
    """
    ax, ay, bx, by, dx, dy = arc[0], arc[1], arc[2], arc[3], x - arc[4], y - arc[5]
    if dx * dx + dy * dy >= arc[6] * arc[6]:
        return False
    if (ay > y) != (by > y):
        is_left = crosses(ax, ay, bx, by, x, y) == (by > ay)
    elif ay == by:
        is_left = (y >= ay) == (bx > ax)
    else:
        is_left = (bx - ax) * (y - ay) > (by - ay) * (x - ax)
    return bool(is_left != (arc[7] > 0.0))


def crosses(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Tell whether a ray from (x, y) along +x crosses the line from a to b."""
    return (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax)


def _cross(a: Point, b: Point) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _area(outline: Sequence[Point]) -> float:
    x0, y0 = outline[0]  # relative to a corner: a table far from the origin keeps its digits
    shifted = [(x - x0, y - y0) for x, y in outline]
    return sum(_cross(a, b) for a, b in zip(shifted, shifted[1:] + shifted[:1], strict=True)) / 2


def _crossing(edges: Sequence[Edge], slack: float) -> tuple[int, int] | None:
    """Two sides of a closed polygon that meet where they should not, by a sweep along x."""
    active: list[int] = []
    for i in sorted(range(len(edges)), key=lambda k: min(edges[k].start[0], edges[k].end[0])):
        left = min(edges[i].start[0], edges[i].end[0]) - slack
        active = [j for j in active if max(edges[j].start[0], edges[j].end[0]) >= left]
        for j in active:
            if _sides_meet(edges, min(i, j), max(i, j), slack):
                return min(i, j), max(i, j)
        active.append(i)
    return None


def _sides_meet(edges: Sequence[Edge], i: int, j: int, slack: float) -> bool:
    p, q = edges[i], edges[j]
    if min(p.start[1], p.end[1]) - slack > max(q.start[1], q.end[1]) or (
        min(q.start[1], q.end[1]) - slack > max(p.start[1], p.end[1])
    ):
        return False
    if j - i in (1, len(edges) - 1):  # neighbours meet at their corner, and may do so only there
        first, second = (p, q) if p.end == q.start else (q, p)
        return first.distance(*second.end) <= slack or second.distance(*first.start) <= slack
    if (
        min(p.distance(*q.start), p.distance(*q.end), q.distance(*p.start), q.distance(*p.end))
        <= slack
    ):
        return True
    return (p.height(*q.start) > 0.0) != (p.height(*q.end) > 0.0) and (
        (q.height(*p.start) > 0.0) != (q.height(*p.end) > 0.0)
    )
