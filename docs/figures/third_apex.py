"""The third apex of a ball that bounces, in stock pymunk and in Billiards, by step.

``python docs/figures/third_apex.py`` prints the table of docs/gravity.md: how far (m) the ball is
off at the time of its third apex, and how long (ms) the run takes.
"""

from __future__ import annotations

import math
import time

import pymunk

from pool_pymunk import Billiards, same_balls

G, HEIGHT, E, RADIUS = 9.80665, 2.0, 0.8, 0.1  # m/s^2, m, 1, m
FALL = math.sqrt(2.0 * HEIGHT / G)
APEX = FALL * (1.0 + 2.0 * E + 2.0 * E**2 + E**3)  # s
STEPS = 60, 240, 1000, 4000  # a second


def world() -> tuple[pymunk.Space, pymunk.Body, pymunk.Circle, pymunk.Segment]:
    """Return a space with gravity, a ball, and a floor so thick that none tunnels."""
    space = pymunk.Space()
    space.gravity = (0.0, -G)
    body = pymunk.Body(0.2, math.inf)
    body.position = (0.0, HEIGHT + RADIUS)
    floor = pymunk.Segment(space.static_body, (-9.0, -0.5), (9.0, -0.5), 0.5)
    return space, body, pymunk.Circle(body, RADIUS), floor


def stock(rate: int) -> tuple[float, float]:
    """Return the height (m) of the third apex in stock pymunk, and how long (s) that takes."""
    space, body, ball, floor = world()
    ball.elasticity, floor.elasticity = 1.0, E
    space.collision_slop = 1e-3 * RADIUS
    space.add(body, ball, floor)
    began, y, tops = time.perf_counter(), [HEIGHT], list[float]()
    while len(tops) < 3 and len(y) < 10 * rate:
        space.step(1.0 / rate)
        y.append(body.position.y - RADIUS)
        if len(y) > 2 and y[-3] < y[-2] >= y[-1]:
            tops.append(y[-2])
    return tops[2], time.perf_counter() - began


def exact(rate: int) -> tuple[float, float]:
    """Return the height (m) of the third apex in Billiards, and how long (s) that takes."""
    space, body, ball, floor = world()
    table = Billiards(space, 1.0 / rate, pair=same_balls(E, 0.0))
    table.add_wall(floor, E)
    table.add_ball(ball)
    began = time.perf_counter()
    table.play(latest=APEX)
    return body.position.y - RADIUS, time.perf_counter() - began


def main() -> None:
    right = HEIGHT * E**6
    print("| steps a second | stock pymunk, off (m) | ms | Billiards, off (m) | ms |")
    print("|---|---|---|---|---|")
    for rate in STEPS:
        (by_stock, long), (by_ours, its) = stock(rate), exact(rate)
        print(f"| {rate} | {abs(by_stock - right):.1e} | {long * 1e3:.0f} | "
              f"{abs(by_ours - right):.0e} | {its * 1e3:.0f} |")  # fmt: skip


if __name__ == "__main__":
    main()
