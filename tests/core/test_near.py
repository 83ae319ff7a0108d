"""A grid finds the balls that are near as one finds them by looking through all."""

from __future__ import annotations

import random

import pytest

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import sliding
from pool_pymunk.core.near import MANY, Grid, Near, near_of

R, PULL = 0.03, 1.0


def scattered(width: float, height: float, count: int = MANY + 20) -> list[Ball]:
    """Return balls that move anywhere on a table of this size (m)."""
    rnd, balls = random.Random(count), list[Ball]()
    for k in range(count):
        place = rnd.uniform(0.0, width), rnd.uniform(0.0, height)
        velocity = rnd.gauss(0.0, 0.5), rnd.gauss(0.0, 0.5)
        path = sliding(0.0, place, velocity, PULL)
        balls.append(Ball(k, R, 0.2, path, False))
        balls[-1].set_off(path)
    return balls


def check(grid: Grid, balls: list[Ball]) -> None:
    """Check that the grid finds what overlaps, and each of them once."""
    plain = Near(balls)
    for ball in balls:
        expected = [other.number for other in plain.around(ball)]
        found = [other.number for other in grid.around(ball)]
        assert sorted(found) == expected, ball.number
    assert any(plain.around(ball) for ball in balls)


@pytest.mark.parametrize(("width", "height"), [(3.0, 1.0), (1.0, 3.0), (2.0, 0.0), (0.0, 2.0)])
def test_a_grid_finds_what_is_near(width: float, height: float) -> None:
    balls = scattered(width, height)
    grid = near_of(balls)
    assert isinstance(grid, Grid)
    for ball in balls:
        grid.put(ball, 0.0, 0.3)
    check(grid, balls)
    for ball in balls[::3]:  # Others look farther ahead, or begin later.
        grid.put(ball, 0.2, 0.9)
    check(grid, balls)


def test_a_ball_that_is_taken_away_is_found_again_when_it_comes_back() -> None:
    balls = scattered(2.0, 1.0)
    grid = Grid(balls)
    for ball in balls:
        grid.put(ball, 0.0, 0.5)
    gone = balls[::7]
    for ball in gone:
        grid.remove(ball)
    for ball in balls:
        if ball not in gone:
            assert not {each.number for each in grid.around(ball)} & {each.number for each in gone}
    for ball in gone:
        grid.remove(ball)  # It is away already.
        grid.put(ball, 0.0, 0.5)
    check(grid, balls)


def test_a_ball_that_comes_late_is_found() -> None:
    balls = scattered(2.0, 1.0)
    grid = Grid(balls)
    late = scattered(1.0, 2.0)[:1]
    late[0].number = len(balls)
    balls += late
    grid.add(late[0])
    for ball in balls:
        grid.put(ball, 0.0, 0.5)
    check(grid, balls)
