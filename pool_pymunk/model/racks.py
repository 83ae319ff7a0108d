"""Racks are balls in rows, so that nobody computes fifteen positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

from pool_pymunk.model.keys import Angle, Gap, Ids, Key, Length, Mass, Part, Place
from pool_pymunk.model.parts import Ball, Color
from pool_pymunk.model.plain import choice, whole
from pool_pymunk.model.problems import Point, Problem

SHAPES = ("triangle", "diamond")
DIAMOND = (1, 2, 3, 2, 1)  # balls in each row
MOST_ROWS = 100


@dataclass(frozen=True, slots=True)
class Rack(Part):
    """Balls in rows, as :func:`rack` takes them."""

    apex: Place
    radius: Length
    mass: Mass
    rows: Annotated[int, Key(whole(1, MOST_ROWS))] | None = None
    shape: Annotated[str, Key(choice(SHAPES))] = SHAPES[0]
    angle: Angle = 0.0
    gap: Gap = 0.0
    ids: Ids | None = None
    color: Color | None = None

    def _problems(self) -> Iterator[Problem]:
        if self.shape == "diamond" and self.rows is not None:
            yield Problem("rows", self.rows, "stands beside shape: a diamond has five rows")
        elif self.ids is not None and len(self.ids) != (count := sum(self.counts)):
            message = f"must be {count} ids, one a ball ({len(self.ids)} given)"
            yield Problem("ids", self.ids, message)

    @property
    def counts(self) -> tuple[int, ...]:
        """Return how many balls each row has."""
        return _counts(self.rows, self.shape)

    @property
    def balls(self) -> tuple[Ball, ...]:
        """Return the balls, row by row."""
        pitch, angle = 2.0 * self.radius + self.gap, math.radians(self.angle)
        ahead = (math.cos(angle), math.sin(angle))
        return tuple(
            Ball(
                name,
                (
                    self.apex[0] + pitch * (behind * ahead[0] - beside * ahead[1]),
                    self.apex[1] + pitch * (behind * ahead[1] + beside * ahead[0]),
                ),
                self.radius,
                self.mass,
                color=self.color,
            )
            for name, (behind, beside) in zip(
                rack_ids(self.rows, self.shape, self.ids), _places(self.counts), strict=True
            )
        )


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
    return Rack(apex, radius, mass, rows, shape, angle, gap, ids, color).balls


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
