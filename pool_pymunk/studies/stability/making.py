"""This module has what extremes are made of: tables, and scenes from parameters."""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pool_pymunk.model import (
    STANDARD_GRAVITY,
    Ball,
    Friction,
    Physics,
    Point,
    Restitution,
    Scene,
    Table,
)
from pool_pymunk.studies.stability import claims as must
from pool_pymunk.studies.stability.trial import Case

R = 2.0**-5  # m; sizes and places are short binary numbers, so that balls touch exactly
M = 0.2  # kg
REST = (0.0, 0.0)  # m/s
LIVELY = Restitution(ball_ball=0.9, cushion=0.7)
CLOTH = Friction(surface=0.1, cushion=0.2, ball_ball=0.05)
SMOOTH = Friction()
GLIDE = Friction(surface=0.01, cushion=0.2, ball_ball=0.05)
CHALK = Friction(ball_ball=0.05)
ROLLS = Friction(surface=0.2, rolling=0.1)
PULL, DRAG = 0.2 * STANDARD_GRAVITY, 0.1 * STANDARD_GRAVITY  # m/s^2; of sliding, and of rolling

Row = Sequence[float]  # x, y (m), vx, vy (m/s), and the roll of a ball that has one


def scaled(
    rows: Iterable[Row], size: float = 1.0, faster: float = 1.0, shift: Point = (0.0, 0.0)
) -> list[Row]:
    """Return the rows with places scaled and then shifted (m), and with velocities scaled."""
    dx, dy = shift
    return [(size * x + dx, size * y + dy, faster * vx, faster * vy) for x, y, vx, vy in rows]


def rectangle(length: float, width: float, corner: Point = (0.0, 0.0)) -> Table:
    """Return a table of that size (m) with its lower left corner anywhere."""
    x, y = corner
    return Table(((x, y), (x + length, y), (x + length, y + width), (x, y + width)))


def scene_of(
    rows: Iterable[Row], table: Table | None = None, e: float | Restitution = 1.0,
    friction: Friction = SMOOTH, time: float | None = None, *, r: float = R,
    heavier: Mapping[int, float] | None = None, **parts: Any,
) -> Scene:  # fmt: skip
    """Return a scene with one restitution, or with those given, for a time (s; None: to rest).

    Balls have one radius ``r`` (m), and one mass except those that are ``heavier`` by a factor.
    """
    factors = heavier or {}
    balls = tuple(
        Ball(str(k), (x, y), r, M * factors.get(k, 1.0), k == 0, (vx, vy), None, *roll)
        for k, (x, y, vx, vy, *roll) in enumerate(rows)
    )
    restitution = Restitution(e, None, e) if isinstance(e, float) else e
    return Scene(balls, table, restitution, friction, Physics(max_time=time), **parts)


def diagonal(label: str, table: Table, v: float, e: float, mu: float) -> Case:
    """Return a case of a ball that runs along the diagonal into a corner; v (m/s) is along x."""
    scene = scene_of([(0.25, 0.25, v, v)], table, e, Friction(0.05, mu))
    return Case(label, scene, (must.on_the_diagonal,))


def unit(degrees: float) -> Point:
    """Return the unit vector in that direction."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def grip(speed: float, length: float) -> float:
    """Return the coefficient of surface friction that stops a ball after ``length`` (m)."""
    return speed * speed / (2.0 * length * STANDARD_GRAVITY)


def far(v: float, w: float, time: float = math.inf, drag: float = DRAG) -> float:
    """Return how far (m) a ball slides and rolls from v with a roll w (m/s), to rest or for a time.

    It slides for 2 |v - w| / (7 mu_s g) s, until it rolls at 5/7 v + 2/7 w.
    """
    slides, last = 2.0 * abs(v - w) / (7.0 * PULL), (5.0 * v + 2.0 * w) / 7.0
    rolls = min(abs(last) / drag if drag else math.inf, time - slides)
    return (v + last) / 2.0 * slides + (last - math.copysign(drag, last) * rolls / 2.0) * rolls


def crowd(count: int, box: float) -> list[Row]:
    """Return balls on a grid in a square box (m), each in its own direction at 1 m/s."""
    rng, side = random.Random(1), math.ceil(math.sqrt(count))
    pitch = box / side
    places = (((k % side + 0.5) * pitch, (k // side + 0.5) * pitch) for k in range(count))
    return [(*place, *unit(rng.uniform(0.0, 360.0))) for place in places]


def rack(gap: float) -> list[Row]:
    """Return a triangle of fifteen balls, each with a gap (m) to the next ones."""
    pitch = 2.0 * R + gap
    return [
        (1.25 + row * pitch * math.sqrt(0.75), (k - row / 2.0) * pitch, *REST)
        for row in range(5) for k in range(row + 1)
    ]  # fmt: skip


# On a table of 2 m by 1 m, two balls move among others that rest; three of those touch.
MIXED: tuple[Row, ...] = (
    (0.5, 0.5, 3.0, 0.25), (1.0, 0.5, *REST), (1.25, 0.625, *REST), (1.5, 0.25, *REST),
    (1.75, 0.5 + R, -1.0, 0.0),
)  # fmt: skip
RIGHT = 1.0 + 2.0 * R  # m
TOUCHING = (*MIXED[:2], (RIGHT, 0.5, *REST), (RIGHT, 0.5 + 2.0 * R, *REST), *MIXED[3:])
TABLE = rectangle(2.0, 1.0)
