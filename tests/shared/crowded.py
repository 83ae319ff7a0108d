"""Tables as crowded as the report's, of any number of balls."""

from __future__ import annotations

import math
import random

from pool_pymunk import Ball, Friction, Restitution, Scene, Table

INCH = 0.0254
RADIUS = 2.25 * INCH
AREA = 88 * 44 * INCH**2 / 11  # of the table, for each ball


def crowded(count: int, all_move: bool, seed: int = 0) -> Scene:
    """Return a table twice as long as wide, with balls anywhere; one of them moves, or all do."""
    rnd = random.Random(seed)
    width = math.sqrt(count * AREA / 2)
    taken: dict[tuple[int, int], tuple[float, float]] = {}
    balls: list[Ball] = []
    while len(balls) < count:
        x, y = rnd.uniform(RADIUS, 2 * width - RADIUS), rnd.uniform(RADIUS, width - RADIUS)
        cell = (int(x / (2 * RADIUS)), int(y / (2 * RADIUS)))
        near = [taken.get((cell[0] + i, cell[1] + j)) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        if cell in taken or any(p and math.dist(p, (x, y)) < 2.02 * RADIUS for p in near):
            continue
        taken[cell] = (x, y)
        angle, speed = rnd.uniform(0, 2 * math.pi), rnd.uniform(0.5, 2.0) * all_move
        if not balls and not all_move:
            speed = 4.0
        velocity = (speed * math.cos(angle), speed * math.sin(angle))
        balls.append(Ball(str(len(balls)), (x, y), RADIUS, 0.16, not balls, velocity))
    return Scene(
        balls=tuple(balls),
        table=Table.rectangle(2 * width, width),
        restitution=Restitution(0.90, 0.95, 0.70),
        friction=Friction(0.10, 0.20, 0.05),
    )
