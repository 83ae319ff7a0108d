"""Racks are balls in rows, so that nobody computes fifteen positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated

from pool_pymunk.model.keys import Angle, Gap, Ids, Key, Length, Mass, Place, keys_of, read_all
from pool_pymunk.model.parts import Ball, Color
from pool_pymunk.model.plain import choice, whole
from pool_pymunk.model.problems import Problem, raise_any

SHAPES = ("triangle", "diamond")
DIAMOND = (1, 2, 3, 2, 1)  # balls in each row
MOST_ROWS = 100

Rows = Annotated[int, Key(whole(1, MOST_ROWS))]
Shape = Annotated[str, Key(choice(SHAPES))]


def rack(
    apex: Place,
    *,
    radius: Length,
    mass: Mass,
    rows: Rows | None = None,
    shape: Shape = "triangle",
    angle: Angle = 0.0,
    gap: Gap = 0.0,
    ids: Ids | None = None,
    color: Color | None = None,
) -> tuple[Ball, ...]:
    """Return balls in rows: a triangle of this many ``rows`` (default: 5), or a "diamond" of nine.

    ``apex`` (m) is the centre of the foremost ball. The rows lie behind it at an ``angle``
    (degrees, counter-clockwise from +x). ``gap`` (m) is that between the surfaces of neighbours; at
    0 the rack is frozen. ``ids`` go row by row, each row counter-clockwise as seen from the apex;
    by default they are "1", "2" and so on. ``radius`` (m), ``mass`` (kg) and ``color`` are those of
    every ball. Raises SceneError for what is no rack.

    >>> balls = rack((1.905, 0.635), radius=0.028575, mass=0.17, gap=0.0001)
    >>> len(balls), balls[0].position, [round(x, 6) for x in balls[1].position]
    (15, (1.905, 0.635), [1.95458, 0.606375])
    """
    given = read_all(KEYS, locals())
    apex, radius, mass, rows, shape, angle, gap, ids, color = given.values()
    counts = _counts(rows, shape)
    raise_any(_problems(rows, shape, ids, sum(counts)))
    pitch, (x, y) = 2.0 * radius + gap, apex
    cos, sin = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    places = [
        (x + pitch * (behind * cos - beside * sin), y + pitch * (behind * sin + beside * cos))
        for behind, beside in _places(counts)
    ]
    names = rack_ids(rows, shape, ids)
    return tuple(
        Ball(name, place, radius, mass, color=color)
        for name, place in zip(names, places, strict=True)
    )


KEYS = keys_of(rack)


def _problems(
    rows: int | None, shape: str, ids: Sequence[str] | None, count: int
) -> Iterator[Problem]:
    """Find what is wrong between the numbers of rows, balls and ids."""
    if shape == "diamond" and rows is not None:
        yield Problem("rows", rows, "stands beside shape: a diamond has five rows")
    elif ids is not None and len(ids) != count:
        yield Problem("ids", ids, f"must be {count} ids, one a ball ({len(ids)} given)")


def rack_ids(rows: int | None, shape: str, ids: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the ids of a rack's balls, row by row; by default they are numbers from 1.

    >>> rack_ids(2, "triangle")
    ('1', '2', '3')
    """
    return tuple(ids or (str(k + 1) for k in range(sum(_counts(rows, shape)))))


def _counts(rows: int | None, shape: str) -> tuple[int, ...]:
    """Return how many balls each row has."""
    return DIAMOND if shape == "diamond" else tuple(range(1, (5 if rows is None else rows) + 1))


def _places(counts: Sequence[int]) -> Iterator[tuple[float, float]]:
    """Yield how far each ball lies behind the apex and beside it, in distances of neighbours."""
    for row, count in enumerate(counts):
        for place in range(count):
            yield row * math.sqrt(0.75), place - (count - 1) / 2.0
