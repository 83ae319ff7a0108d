"""Balls in pymunk spaces of one's own, which the tests of Billiards share."""

from __future__ import annotations

import math
from typing import Any

import pymunk

from pool_pymunk import Billiards, same_balls
from pool_pymunk.world import ContactEvent, TableBall

Point = tuple[float, float]

R, M, A = 0.03, 0.17, 0.3  # m, kg, m/s^2
PAIR = same_balls(0.95, 0.05)
STEP = 1 / 60  # s


def ball(table: Billiards, x: float, y: float = 0.0, velocity: Point = (0.0, 0.0)) -> TableBall:
    """Put a ball on the table."""
    body = pymunk.Body(M, 1e-4)
    body.position, body.velocity = (x, y), velocity
    return table.add_ball(pymunk.Circle(body, R))


def plane(**settings: Any) -> tuple[pymunk.Space, Billiards]:
    """Return an open plane with friction."""
    space = pymunk.Space()
    return space, Billiards(space, **{"max_dt": STEP, "pair": PAIR, "deceleration": A, **settings})


def fence(table: Billiards, corners: list[Point], radius: float, e: float, mu: float) -> list[int]:
    """Put walls up from corner to corner, and return their numbers."""
    static = table.space.static_body
    return [
        table.add_wall(pymunk.Segment(static, a, b, radius), e, mu)
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    ]


def hexagon(radius: float = 0.0, x: float = 0.0, **settings: Any) -> tuple[pymunk.Space, Billiards]:
    """Return a table with six walls around ``x`` (m), as thin as most people write them."""
    space, table = plane(**settings)
    corners = [(x + math.cos(math.pi / 3 * k), math.sin(math.pi / 3 * k)) for k in range(6)]
    fence(table, corners, radius, 0.8, 0.2)
    return space, table


def steps(space: pymunk.Space, seconds: float, dt: float = STEP) -> None:
    """Let time pass."""
    for _ in range(round(seconds / dt)):
        space.step(dt)


def heard_by(table: Billiards) -> list[ContactEvent]:
    """Return a list that hears of contacts."""
    heard = list[ContactEvent]()
    table.on_contact = heard.append
    return heard
