"""Racks are balls in rows, so that nobody computes fifteen positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from numbers import Integral

from pool_pymunk.model.parts import Ball
from pool_pymunk.model.plain import number, optional, point, read, text, texts
from pool_pymunk.model.problems import (
    LARGEST,
    Point,
    Problem,
    number_problems,
    point_problems,
    raise_any,
    size_problems,
)

SHAPES = ("triangle", "diamond")
DIAMOND = (1, 2, 3, 2, 1)  # balls in each row
MOST_ROWS = 100


def rack(
    apex: Point,
    *,
    radius: float,
    mass: float,
    rows: int | None = None,
    shape: str = "triangle",
    angle: float = 0.0,
    gap: float = 0.0,
    ids: Sequence[str] | None = None,
    color: str | None = None,
) -> tuple[Ball, ...]:
    """Return balls in rows: a triangle of so many ``rows`` (default: 5), or a "diamond" of nine.

    ``apex`` (m) is the centre of the foremost ball. The rows lie behind it at an ``angle``
    (degrees, counter-clockwise from +x). ``gap`` (m) is that between the surfaces of neighbours; at
    0 the rack is frozen. ``ids`` go row by row, each row counter-clockwise as seen from the apex;
    by default they are "1", "2" and so on. ``radius`` (m), ``mass`` (kg) and ``color`` are those of
    every ball. Raises SceneError for what is no rack.

    >>> balls = rack((1.905, 0.635), radius=0.028575, mass=0.17, gap=0.0001)
    >>> len(balls), balls[0].position, [round(x, 6) for x in balls[1].position]
    (15, (1.905, 0.635), [1.95458, 0.606375])
    """
    apex = read("apex", apex, point)
    radius, angle, gap = (
        read("radius", radius, number),
        read("angle", angle, number),
        read("gap", gap, number),
    )
    names = read("ids", ids, optional(texts))
    shape = read("shape", shape, text)
    rows = int(rows) if isinstance(rows, Integral) and not isinstance(rows, bool) else rows
    raise_any(rack_problems(apex, rows, shape, angle, gap, names))
    raise_any(size_problems("radius", radius))
    pitch = 2.0 * radius + gap
    ahead = (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    names = rack_ids(rows, shape, names)
    return tuple(
        Ball(
            name,
            (
                apex[0] + pitch * (behind * ahead[0] - beside * ahead[1]),
                apex[1] + pitch * (behind * ahead[1] + beside * ahead[0]),
            ),
            radius,
            mass,
            color=color,
        )
        for name, (behind, beside) in zip(names, _places(_counts(rows, shape)), strict=True)
    )


def rack_ids(rows: int | None, shape: str, ids: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the ids of a rack's balls, row by row; by default they are numbers from 1.

    >>> rack_ids(2, "triangle")
    ('1', '2', '3')
    """
    return tuple(ids or (str(k + 1) for k in range(sum(_counts(rows, shape)))))


def rack_problems(
    apex: Point,
    rows: int | None,
    shape: str,
    angle: float = 0.0,
    gap: float = 0.0,
    ids: Sequence[str] | None = None,
) -> Iterator[Problem]:
    """Find what is wrong with a rack."""
    yield from point_problems("apex", apex)
    yield from number_problems("gap", gap, 0.0)
    yield from number_problems("angle", angle, -LARGEST)
    if shape not in SHAPES:
        yield Problem("shape", shape, f"must be one of {', '.join(SHAPES)}")
    elif shape == "diamond" and rows is not None:
        yield Problem("rows", rows, "stands beside shape: a diamond has five rows")
    elif rows is not None and (
        not isinstance(rows, int) or isinstance(rows, bool) or not 1 <= rows <= MOST_ROWS
    ):
        yield Problem("rows", rows, f"must be a whole number from 1 to {MOST_ROWS}")
    elif ids is not None and len(ids) != (count := sum(_counts(rows, shape))):
        yield Problem("ids", list(ids), f"must be {count} ids, one a ball ({len(ids)} given)")


def _counts(rows: int | None, shape: str) -> tuple[int, ...]:
    """Return how many balls each row has."""
    return DIAMOND if shape == "diamond" else tuple(range(1, (5 if rows is None else rows) + 1))


def _places(counts: Sequence[int]) -> Iterator[tuple[float, float]]:
    """Yield how far each ball lies behind the apex and beside it, in distances of neighbours."""
    for row, count in enumerate(counts):
        for place in range(count):
            yield row * math.sqrt(0.75), place - (count - 1) / 2.0
