"""Random runs of each class in which rounding may do much, and how far their ends are off."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from mpmath import mp, mpf

from pool_pymunk import Ball, Friction, Physics, Restitution, Run, Scene, Table
from tests.oracle import reference


def shot(
    rng: random.Random,
    across: float,
    *,
    e: float = 0.9,
    friction: float = 0.0,
    far: float = 0.0,
    distance: float = 1.0,
    max_time: float = 3.0,
    mass: float = 0.2,
) -> Scene:
    """Return a ball that meets another ``across`` of the contact distance off the line."""
    turn, side, speed = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(0.5, 3.0)
    u, r = (math.cos(turn), math.sin(turn)), (rng.uniform(0.02, 0.07), rng.uniform(0.02, 0.07))
    x, y = far * math.cos(side), far * math.sin(side)
    off = across * (r[0] + r[1])
    balls = (
        Ball("a", (x, y), r[0], 0.2, velocity=(speed * u[0], speed * u[1])),
        Ball("b", (x + u[0] * distance - u[1] * off, y + u[1] * distance + u[0] * off), r[1], mass),
    )
    return Scene(balls, None, Restitution(e), Friction(0.0, 0.0, friction),
                 Physics(max_time=max_time + distance / speed))  # fmt: skip


def along_a_cushion(rng: random.Random) -> Scene:
    slope = 10 ** rng.uniform(-8, -1)
    ball = Ball("a", (0.2, 0.05 + slope), 0.05, 0.2, velocity=(1.0, -slope))
    return Scene((ball,), Table.rectangle(4.0, 1.0), Restitution(cushion=rng.uniform(0.3, 1.0)),
                 physics=Physics(max_time=2.0))  # fmt: skip


def past_a_corner(rng: random.Random) -> Scene:
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 0.8), (0.9, 0.8), (0.9, 1.7), (0.0, 1.7))
    x = 0.9 + rng.uniform(-0.04, 0.0)
    ball = Ball("a", (x, 0.3), 0.05, 0.2, velocity=(0.0, rng.uniform(0.5, 1.0)))
    return Scene((ball,), Table(outline), Restitution(cushion=0.9), physics=Physics(max_time=2.0))


def into_a_round_corner(rng: random.Random) -> Scene:
    """Return a ball that comes into a corner whose arc is hardly wider than the ball."""
    wider, turn, speed = 10 ** rng.uniform(-5, -4), rng.uniform(-3, 3), rng.uniform(0.5, 2.0)
    c, x, y = 0.02 + wider, rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.4)
    outline = ((c, 0.0), (1.0 - c, 0.0), (1.0, c), (1.0, 0.5 - c),
               (1.0 - c, 0.5), (c, 0.5), (0.0, 0.5 - c), (0.0, c))  # fmt: skip
    table = Table(outline, (0.0, math.tan(math.pi / 8.0)) * 4)
    aside = wider * rng.uniform(0.0, 0.9)
    dx, dy = c + aside * math.cos(turn) - x, c + aside * math.sin(turn) - y
    distance = math.hypot(dx, dy)
    ball = Ball("a", (x, y), 0.02, 0.2, velocity=(speed * dx / distance, speed * dy / distance))
    return Scene((ball,), table, Restitution(cushion=rng.uniform(0.6, 1.0)),
                 physics=Physics(max_time=1.3 * distance / speed))  # fmt: skip


CLASSES: dict[str, Callable[[random.Random], Scene]] = {
    "a hit": lambda rng: shot(rng, rng.uniform(-0.9, 0.9)),
    "with friction": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), friction=0.2),
    "far away": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), far=10 ** rng.uniform(1, 6)),
    "a long distance": lambda rng: shot(
        rng, rng.uniform(-0.8, 0.8), distance=10 ** rng.uniform(1, 4)
    ),
    "a graze": lambda rng: shot(rng, 1.0 - 10 ** rng.uniform(-10, -1)),
    "nearly plastic": lambda rng: shot(
        rng, 0.0, e=10 ** rng.uniform(-16, -1), max_time=10 ** rng.uniform(1, 6)
    ),
    "unequal": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), mass=10 ** rng.uniform(-5, 3)),
    "along a cushion": along_a_cushion,
    "past a corner": past_a_corner,
    "into a round corner": into_a_round_corner,
}


def error(run: Run, final: Iterable[Any]) -> float:
    """Return how far (m) a run's ends lie off the true ones."""
    with mp.workdps(reference.DIGITS):
        ends = zip(run.end.position, final, strict=True)
        return max(float(mp.hypot(p[0] - mpf(x), p[1] - mpf(y))) for p, (x, y) in ends)


def rolling(scene: Scene, rng: random.Random) -> Scene:
    """Return the scene with balls that slide, then roll, some of them without end."""
    rolls = [rng.choice((0.0, 1.0, rng.uniform(-2.0, 2.0))) for _ in scene.balls]
    balls = [replace(ball, roll=roll) for ball, roll in zip(scene.balls, rolls, strict=True)]
    friction = replace(scene.friction, surface=0.2, rolling=rng.choice((0.0, 0.01, 0.1)))
    limit = replace(scene.physics, max_time=min(scene.physics.max_time or 50.0, 50.0))
    return replace(scene, balls=tuple(balls), friction=friction, physics=limit)
