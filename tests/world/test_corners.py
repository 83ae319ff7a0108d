"""A ball whose roll holds it to a wall goes round its corner, and on along the next face."""

from __future__ import annotations

import math
import random

import pymunk
import pytest

from pool_pymunk import same_balls
from pool_pymunk.core.live import SAME
from tests.shared.scenes import seeds
from tests.shared.worlds import plane

R = 0.03  # m


def sunk(seed: int) -> float:
    """Return how deep (m) a ball sinks into a random polygon, to which its roll presses it."""
    rnd = random.Random(seed)
    pair = same_balls(rnd.choice((0.0, 0.5, 0.9)), rnd.choice((0, 0.05)))
    space, table = plane(max_dt=1 / 30, pair=pair, deceleration=2.0, rolling=0.1)
    radius, corners, size = (
        rnd.choice((0.0, 0.02, 0.05)),
        rnd.choice((3, 4, 6)),
        rnd.uniform(0.1, 0.3),
    )
    turn = rnd.uniform(0.0, 6.28) if rnd.random() < 0.7 else math.pi / 4
    angles = [turn + k * math.tau / corners for k in range(corners)]
    around = [(size * math.cos(angle), size * math.sin(angle)) for angle in angles]
    shape = pymunk.Poly(space.static_body, around, radius=radius)
    table.add_wall(shape, rnd.choice((0, 0.5, 0.9)), rnd.choice((0, 0.2)))
    angle = rnd.uniform(0.0, 6.28)
    ux, uy = math.cos(angle), math.sin(angle)
    inside, far = 0.0, 1.0
    for _ in range(60):
        middle = (inside + far) / 2.0
        if shape.point_query((middle * ux, middle * uy)).distance < R:
            inside = middle
        else:
            far = middle
    body = pymunk.Body(0.17, 1e-4)
    body.position = (far + 1e-12) * ux, (far + 1e-12) * uy
    ball = table.add_ball(pymunk.Circle(body, R))
    speed, ahead, into, roll = (rnd.uniform(0.0, most) for most in (0.3, 6.28, 6.28, 2.0))
    velocity = speed * math.cos(ahead), speed * math.sin(ahead)
    table.live.send(ball, SAME, velocity, (roll * math.cos(into), roll * math.sin(into)))
    deepest = 0.0
    for _ in range(60):
        space.step(1 / 30)
        place, _ = ball.path.at(table.time)
        deepest = max(deepest, R - shape.point_query(place).distance)
    return deepest


# Balls sank in by 1 to 28 mm beside these corners, or were hit without end.
@pytest.mark.parametrize("seed", [386, 775, 946])
def test_a_ball_goes_on_from_a_round_corner_to_a_face(seed: int) -> None:
    assert sunk(seed) < 1e-7 * R  # as deep as in persistent contact


@pytest.mark.slow
@pytest.mark.seeded
def test_no_ball_sinks_into_a_polygon() -> None:
    for seed in seeds(400):
        assert sunk(seed) < 1e-8, seed  # A piece of a motion may err by 1e-7 m.
