"""Racks are balls in rows or in rings; this module computes their positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from pool_pymunk.model import plain
from pool_pymunk.model.parts import Ball
from pool_pymunk.model.plain import Key, keys_of, one_of, read_all, whole
from pool_pymunk.model.problems import LEFT_OUT, Point, Problem, raise_any

HEXAGON = "hexagon"
SHAPES = ("triangle", "diamond", HEXAGON)
DIAMOND = (1, 2, 3, 2, 1)  # balls in each row
MOST_ROWS = 100  # 5,050 balls; no game has as many rows
# The keys that a shape must have, and what it has instead of the keys of other shapes.
NEEDED = {"triangle": ("apex",), "diamond": ("apex",), HEXAGON: ("center", "rings")}
INSTEAD = {
    "triangle": {"center": "an apex", "rings": "rows"},
    "diamond": {"rows": "five rows", "center": "an apex", "rings": "five rows"},
    HEXAGON: {"apex": "a center", "rows": "rings"},
}
HALF_ROOT_3 = math.sqrt(0.75)
# These are the corners of a hexagon with sides of length 1, counter-clockwise.
CORNERS = (
    (1.0, 0.0), (0.5, HALF_ROOT_3), (-0.5, HALF_ROOT_3),
    (-1.0, 0.0), (-0.5, -HALF_ROOT_3), (0.5, -HALF_ROOT_3),
)  # fmt: skip

Rows = Annotated[int, Key(whole(1, MOST_ROWS), limits=(("minimum", 1), ("maximum", MOST_ROWS)))]
Shape = Annotated[str, one_of(SHAPES)]


def rack(
    apex: Annotated[plain.Place, "The centre of the foremost ball."] | None = None,
    *,
    radius: Annotated[plain.Length, "That of each ball; default: that of [ball]."],
    mass: Annotated[plain.Mass, "That of each ball; default: that of [ball]."],
    rows: Annotated[Rows, "Of a triangle."] | None = None,
    shape: Annotated[Shape, "Default: triangle; a diamond has nine balls."] = "triangle",
    angle: Annotated[plain.Angle, "Where rows lie behind the apex, in degrees from +x."] = 0.0,
    gap: Annotated[plain.Gap, "Between surfaces of neighbours; default 0: frozen."] = 0.0,
    ids: Annotated[plain.Ids, 'Row by row; default: "1", "2" and so on.'] | None = None,
    color: Annotated[plain.Colors, "One for all balls, or a list, one for each."] | None = None,
    center: Annotated[plain.Place, "The centre of a hexagon's middle ball."] | None = None,
    rings: Annotated[Rows, "Of a hexagon, around its middle ball."] | None = None,
) -> tuple[Ball, ...]:
    """Return balls in a triangle of ``rows`` (default: 5), a "diamond" of nine, or a "hexagon".

    ``apex`` (m) is the centre of the foremost ball of a triangle or a diamond. The rows lie behind
    it at an ``angle`` (degrees, counter-clockwise from +x). A hexagon has ``rings`` around the ball
    at its ``center`` (m); each begins at ``angle`` and runs counter-clockwise. ``gap`` (m) is that
    of neighbours' surfaces; at 0 the rack is frozen. ``ids`` (default: "1", "2" and so on) go row
    by row, each row counter-clockwise as seen from the apex, or ring by ring from the middle. All
    balls have the ``radius`` (m) and the ``mass`` (kg). ``color`` is one for all, or a list.

    >>> balls = rack((1.905, 0.635), radius=0.028575, mass=0.17, gap=0.0001)
    >>> len(balls), balls[0].position, [round(x, 6) for x in balls[1].position]
    (15, (1.905, 0.635), [1.95458, 0.606375])
    >>> men = rack(shape="hexagon", center=(0.37, 0.37), rings=2, radius=0.0155, mass=0.0055)
    >>> len(men), men[0].position, [round(x, 6) for x in men[1].position]
    (19, (0.37, 0.37), [0.401, 0.37])
    """
    given = read_all(KEYS, locals())
    raise_any(_problems(given))
    apex, radius, mass, rows, shape, angle, gap, ids, color, center, rings = given.values()
    pitch, (x, y) = 2.0 * radius + gap, center if shape == HEXAGON else apex
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    names = rack_ids(rows, shape, ids, rings)
    colors = [color] * len(names) if color is None or isinstance(color, str) else color
    balls = []
    for (behind, beside), name, its in zip(_places(rows, shape, rings), names, colors, strict=True):
        along, across = behind * cos - beside * sin, behind * sin + beside * cos
        place = (x + pitch * along, y + pitch * across)
        balls.append(Ball(name, place, radius, mass, color=its))
    return tuple(balls)


KEYS = keys_of(rack)


def _problems(given: Mapping[str, Any]) -> Iterator[Problem]:
    """Find what is missing, what belongs to another shape, and wrong numbers of ids and colours."""
    shape, rings = given["shape"], given["rings"]
    for key, has in INSTEAD[shape].items():
        if given[key] is not None:
            yield Problem(key, given[key], f"does not go with shape: a {shape} has {has}")
    for key in NEEDED[shape]:
        if given[key] is None:
            yield Problem(key, LEFT_OUT, "is missing")
    if shape == HEXAGON and rings is None:
        return
    count = len(rack_ids(given["rows"], shape, None, rings))
    for key, name in (("ids", "ids"), ("color", "colours")):
        if not isinstance(values := given[key], str | None) and len(values) != count:
            message = f"must be {count} {name}, one for each ball ({len(values)} given)"
            yield Problem(key, values, message)


def rack_ids(
    rows: int | None, shape: str, ids: Sequence[str] | None = None, rings: int | None = None
) -> tuple[str, ...]:
    """Return the ids of a rack's balls, in their order; by default they are numbers from 1.

    >>> rack_ids(2, "triangle")
    ('1', '2', '3')
    """
    return tuple(ids or (str(k + 1) for k, _ in enumerate(_places(rows, shape, rings))))


def _places(rows: int | None, shape: str, rings: int | None) -> Iterator[Point]:
    """Yield the balls' places along ``angle`` and to its left, in distances of neighbours."""
    if shape == HEXAGON:
        yield 0.0, 0.0
        for ring in range(1, (rings or 0) + 1):
            for (x, y), (dx, dy) in zip(CORNERS, CORNERS[2:] + CORNERS[:2], strict=True):
                for step in range(ring):
                    yield ring * x + step * dx, ring * y + step * dy
    else:
        counts = DIAMOND if shape == "diamond" else range(1, (rows or 5) + 1)
        for row, count in enumerate(counts):
            for place in range(count):
                yield row * HALF_ROOT_3, place - (count - 1) / 2.0
