"""The outline of a table: a simple polygon, whose sides are the cushions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from pool_pymunk.model.keys import Corners, Part
from pool_pymunk.model.plain import problems_of, size
from pool_pymunk.model.problems import COORDINATE_ROUNDING, Point, Problem, raise_any
from pool_pymunk.physics.sides import Face, RoundSide, Wall


class Edge(NamedTuple):
    """One cushion from ``start`` to ``end``, its unit ``tangent``, its unit ``normal`` inwards."""

    start: Point
    end: Point
    tangent: Point
    normal: Point
    length: float

    def height(self, x: float, y: float) -> float:
        """Distance (m) of a point from the cushion's line, positive on the table's side."""
        return (x - self.start[0]) * self.normal[0] + (y - self.start[1]) * self.normal[1]

    def along(self, x: float, y: float) -> float:
        """Where the point's foot lies on the cushion: 0 at ``start``, ``length`` at ``end`` (m)."""
        return (x - self.start[0]) * self.tangent[0] + (y - self.start[1]) * self.tangent[1]

    def distance(self, x: float, y: float) -> float:
        """Distance (m) of a point from the cushion itself, ends included."""
        s = min(max(self.along(x, y), 0.0), self.length)
        foot_x = self.start[0] + s * self.tangent[0]
        foot_y = self.start[1] + s * self.tangent[1]
        return math.hypot(x - foot_x, y - foot_y)


def _edge(start: Point, end: Point) -> Edge:
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    tangent = (dx / length, dy / length)
    return Edge(start, end, tangent, (-tangent[1], tangent[0]), length)


@dataclass(frozen=True)
class Table(Part):
    """A table: any simple polygon, counter-clockwise; cushion k runs from corner k to the next.

    >>> table = Table.rectangle(2.0, 1.0)
    >>> [edge.normal for edge in table.edges][1]
    (-1.0, 0.0)
    >>> table.contains(1.0, 0.5), table.contains(3.0, 0.5)
    (True, False)
    """

    outline: Corners

    @classmethod
    def rectangle(cls, length: float, width: float) -> Table:
        """The report's table: x from 0 to ``length``, y from 0 to ``width`` (m)."""
        raise_any([*problems_of(length, size, "length"), *problems_of(width, size, "width")])
        return cls(((0.0, 0.0), (length, 0.0), (length, width), (0.0, width)))

    def _problems(self) -> Iterator[Problem]:
        if len(self.outline) < 3:
            yield self._problem("must have three corners or more")
            return
        slack = COORDINATE_ROUNDING * max(map(abs, self.bounds))
        for k, corner in enumerate(self.outline):
            if math.dist(self.outline[k - 1], corner) <= slack:
                k_before = (k - 1) % len(self.outline)
                yield self._problem(f"has two equal corners in a row ({k_before} and {k})")
                return
        meeting = _crossing(self.edges, slack)
        if meeting is not None:
            yield self._problem("crosses itself (cushion {} meets cushion {})".format(*meeting))
        elif _area(self.outline) <= 0.0:
            yield self._problem("must run counter-clockwise")

    def _problem(self, message: str) -> Problem:
        return Problem("outline", [list(corner) for corner in self.outline], message)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The cushions, in order along the outline."""
        corners = self.outline
        return tuple(_edge(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))

    @cached_property
    def reflex_corners(self) -> tuple[int, ...]:
        """Corners that stick out into the table, so that a ball can hit them.

        Corner k joins cushions k - 1 and k.
        """
        tangents = [edge.tangent for edge in self.edges]
        return tuple(k for k, t in enumerate(tangents) if _cross(tangents[k - 1], t) < 0.0)

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The cushions as walls without coefficients, in order along the outline.

        Each wall has the cushion's face, and the cushion's first corner if it sticks out into the
        table.
        """
        found = []
        for k, edge in enumerate(self.edges):
            face = Face(edge.start, edge.tangent, edge.normal, edge.length)
            corner = (RoundSide(edge.start),) if k in self.reflex_corners else ()
            found.append(Wall((face, *corner), 0.0, 0.0, k))
        return tuple(found)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y (m)."""
        xs, ys = self._corners
        return min(xs), min(ys), max(xs), max(ys)

    @cached_property
    def is_rectangle(self) -> bool:
        """Tell whether the table is a rectangle with cushions 0 to 3 as the report has them."""
        x0, y0, x1, y1 = self.bounds
        return self.outline == ((x0, y0), (x1, y0), (x1, y1), (x0, y1))

    def contains(self, x: float, y: float) -> bool:
        """Tell whether a point is on the table (even-odd rule)."""
        return contains(*self._corners, x, y)

    @cached_property
    def _corners(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        xs, ys = zip(*self.outline, strict=True)
        return xs, ys


def contains(xs: Any, ys: Any, x: float, y: float) -> bool:
    """Tell whether a point is within an outline, by its corners; numba can compile it."""
    inside = False
    for k in range(len(xs)):
        inside ^= crosses(xs[k - 1], ys[k - 1], xs[k], ys[k], x, y)
    return inside


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
