"""This module has the table of the extremes, and the parts that their scenes are made of."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
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


listed: list[Extreme] = []


def extreme(name: str, about: str, *laws: str, **more: Any) -> Callable[[Any], Any]:
    """Return a decorator that puts cases, under these laws (default: all), into the table."""

    def put(cases: Callable[[], Iterator[Case]]) -> Callable[[], Iterator[Case]]:
        listed.append(Extreme(name, about, cases, laws or tuple(LAWS), **more))
        return cases

    return put


# -- what scenes are made of -----------------------------------------------------------------------


def alike(rows: Iterable[Row], r: float = R, m: float = M) -> tuple[Ball, ...]:
    """Return balls of one kind (m, kg); the first is the cue ball."""
    return tuple(
        Ball(str(k), (x, y), r, m, cue=k == 0, velocity=(vx, vy))
        for k, (x, y, vx, vy) in enumerate(rows)
    )


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


def on_plane(balls: tuple[Ball, ...], e: float, time: float, friction: Friction = CHALK) -> Scene:
    """Return a scene in which balls meet nothing but each other, for a time (s)."""
    return Scene(balls, None, Restitution(e), friction, Physics(max_time=time))


def unit(degrees: float) -> Point:
    """Return the unit vector in that direction."""
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def grip(speed: float, length: float) -> float:
    """Return the coefficient of surface friction that stops a ball after ``length`` (m)."""
    return speed * speed / (2.0 * length * STANDARD_GRAVITY)


def rolling(rows: Iterable[Row], *rolls: float, **parts: Any) -> Scene:
    """Return a scene of balls that roll; ``rolls`` are the first ones' shares of their velocity."""
    balls = alike(rows)
    struck = tuple(replace(ball, roll=roll) for ball, roll in zip(balls, rolls, strict=False))
    made = {"restitution": ELASTIC, "friction": ROLLS, **parts}
    return Scene((*struck, *balls[len(struck) :]), **made)


def far(v: float, w: float, time: float = math.inf, drag: float = DRAG) -> float:
    """Return how far (m) a ball slides and rolls from v with a roll w (m/s), to rest or for a time.

    It slides for 2 |v - w| / 7 mu_s g, until it rolls at 5/7 v + 2/7 w.
    """
    slides, last = 2.0 * abs(v - w) / (7.0 * PULL), (5.0 * v + 2.0 * w) / 7.0
    rolls = min(abs(last) / drag if drag else math.inf, time - slides)
    return (v + last) / 2.0 * slides + (last - math.copysign(drag, last) * rolls / 2.0) * rolls


def crowd(count: int, box: float, seed: int = 1) -> tuple[Ball, ...]:
    """Return balls on a grid in a square box (m), each in its own direction at 1 m/s."""
    rng, side = random.Random(seed), math.ceil(math.sqrt(count))
    pitch = box / side
    return alike(
        ((k % side + 0.5) * pitch, (k // side + 0.5) * pitch, *unit(rng.uniform(0.0, 360.0)))
        for k in range(count)
    )


# On a table of 2 m by 1 m, two balls move among others that rest; three of those touch.
MIXED: tuple[Row, ...] = (
    (0.5, 0.5, 3.0, 0.25), (1.0, 0.5, *REST), (1.25, 0.625, *REST), (1.5, 0.25, *REST),
    (1.75, 0.5 + R, -1.0, 0.0),
)  # fmt: skip
RIGHT = 1.0 + 2.0 * R  # m
TOUCHING = (*MIXED[:2], (RIGHT, 0.5, *REST), (RIGHT, 0.5 + 2.0 * R, *REST), *MIXED[3:])
TABLE = rectangle(2.0, 1.0)
EVERY_STEP = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1 / 240, 1 / 60, 0.1, 0.5)
LISTING = "line 132 pushes B with the slip, not against it: momentum is not kept"
