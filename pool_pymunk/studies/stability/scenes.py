"""This module has what the scenes of the extremes are made of: balls, tables, coefficients."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

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
from pool_pymunk.physics.laws import LAWS
from pool_pymunk.studies.stability.trial import Case

R = 2.0**-5  # m; sizes and places are short binary numbers, so that balls that should touch do
M = 0.2  # kg
REST = (0.0, 0.0)  # m/s
LIVELY = Restitution(ball_ball=0.9, cushion=0.7)
ELASTIC = Restitution(ball_ball=1.0, cushion=1.0)
CLOTH = Friction(surface=0.1, cushion=0.2, ball_ball=0.05)
SMOOTH = Friction()
GLIDE = Friction(surface=0.01, cushion=0.2, ball_ball=0.05)
CHALK = Friction(ball_ball=0.05)
ROLLS = Friction(surface=0.2, rolling=0.1)
PULL, DRAG = 0.2 * STANDARD_GRAVITY, 0.1 * STANDARD_GRAVITY  # m/s^2; of sliding, and of rolling

Row = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)


@dataclass(frozen=True)
class Extreme:
    """An extreme is a row of the table: its cases run from mild to extreme.

    ``steps`` (s) replace the solvers' usual ones. ``because`` says why all with its law must fail.
    """

    name: str
    about: str
    cases: Callable[[], Iterator[Case]]
    laws: tuple[str, ...] = tuple(LAWS)
    steps: tuple[float, ...] = ()
    because: str = ""


# -- what scenes are made of -----------------------------------------------------------------------


def alike(rows: Iterable[Row], r: float = R, m: float = M) -> tuple[Ball, ...]:
    """Return balls of one kind (m, kg); the first is the cue ball."""
    return tuple(
        Ball(str(k), (x, y), r, m, cue=k == 0, velocity=(vx, vy))
        for k, (x, y, vx, vy) in enumerate(rows)
    )


def rectangle(length: float, width: float, corner: Point = (0.0, 0.0)) -> Table:
    """Return a table of that size (m) with its lower left corner anywhere."""
    x, y = corner
    return Table(((x, y), (x + length, y), (x + length, y + width), (x, y + width)))


def on_plane(balls: tuple[Ball, ...], e: float, time: float, friction: Friction = CHALK) -> Scene:
    """Return a scene in which balls meet nothing but each other, for so long (s)."""
    return Scene(balls, None, Restitution(e), friction, Physics(max_time=time))


def unit(degrees: float) -> Point:
    """Return the unit vector in that direction."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def grip(speed: float, length: float) -> float:
    """Return the coefficient of surface friction that stops a ball after ``length`` (m)."""
    return speed * speed / (2.0 * length * STANDARD_GRAVITY)


# On a table of 2 m by 1 m, two balls move among others that rest; three of those touch.
MIXED: tuple[Row, ...] = (
    (0.5, 0.5, 3.0, 0.25),
    (1.0, 0.5, *REST),
    (1.25, 0.625, *REST),
    (1.5, 0.25, *REST),
    (1.75, 0.5 + R, -1.0, 0.0),
)
TOUCHING: tuple[Row, ...] = (
    *MIXED[:2],
    (1.0 + 2.0 * R, 0.5, *REST),
    (1.0 + 2.0 * R, 0.5 + 2.0 * R, *REST),
    *MIXED[3:],
)
