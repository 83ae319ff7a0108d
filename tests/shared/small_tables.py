"""Random small tables of balls that touch others, cushions, arcs and posts, and their depths."""

from __future__ import annotations

import math
import random
from itertools import combinations
from typing import NamedTuple

import numpy as np

from pool_pymunk import Ball, Friction, Post, Restitution, Run, Scene, Table

Point = tuple[float, float]

TABLES = {
    "stadium": Table.stadium(1.0, 0.6),
    "circle": Table.circle(0.35),
    "posts": Table.rectangle(0.8, 0.5),
    "unequal": Table.rectangle(0.8, 0.5),
}


class Start(NamedTuple):
    """A ball of a random table has a place (m), a radius (m), a mass (kg), a velocity, a roll."""

    place: Point
    radius: float
    mass: float
    velocity: Point
    roll: float


def inner(scene: Scene) -> tuple[Point, Point, float]:
    """Return the corners (m) of a table's middle, and how far (m) its cushions are from it.

    The middle of a rectangle is all of it, that of a circle its centre, that of a stadium a line.
    """
    assert scene.table is not None
    x0, y0, x1, y1 = scene.table.bounds
    far = (y1 - y0) / 2.0 if any(scene.table.bulge) else 0.0
    return (x0 + far, y0 + far), (x1 - far, y1 - far), far


def deepest(run: Run) -> float:
    """Return how deep (radii) balls are in what they touch, at and between breakpoints."""
    times = np.unique(np.concatenate([rows[:, 0] for rows in run.knots]))
    places, _ = run.at(np.concatenate((times, (times[1:] + times[:-1]) / 2.0)))
    low, high, far = inner(run.scene)
    radii, gaps = [ball.radius for ball in run.scene.balls], []
    for i, r in enumerate(radii):
        mine, lies = places[:, i], np.clip(places[:, i], low, high)
        if far > 0.0:
            gaps.append((far - r - np.hypot(*(mine - lies).T).max()) / r)
        else:
            gaps += [(mine - low).min() / r - 1.0, (high - mine).min() / r - 1.0]
        for post in run.scene.posts:
            away = np.hypot(*(mine - post.position).T).min()
            gaps.append((away - post.radius - r) / r)
    for i, j in combinations(range(len(radii)), 2):
        away = np.hypot(*(places[:, i] - places[:, j]).T).min()
        gaps.append((away - radii[i] - radii[j]) / min(radii[i], radii[j]))
    return float(max(-min(gaps), 0.0))


def has_room(kind: str, place: Point, r: float, balls: list[Start], posts: list[Post]) -> bool:
    """Tell whether a ball of radius r (m) fits at a place."""
    (x, y), table = place, TABLES[kind]
    if kind in ("stadium", "circle"):
        half = 0.35 if kind == "circle" else 0.3
        middle = min(max(x, half), table.bounds[2] - half)
        if math.dist(place, (middle, half)) > half - r:
            return False
    elif not (r <= x <= 0.8 - r and r <= y <= 0.5 - r):
        return False
    return all(math.dist(place, ball.place) >= ball.radius + r for ball in balls) and all(
        math.dist(place, post.position) >= post.radius + r for post in posts
    )


def place_of(rnd: random.Random, kind: str, r: float, balls: list[Start]) -> Point:
    """Return a random place (m): beside another ball, at an arc, or anywhere."""
    what = rnd.random()
    if balls and what < 0.5:
        other, turn = rnd.choice(balls), rnd.uniform(0.0, math.tau)
        away = other.radius + r + rnd.choice((0, 0, 1e-9, 1e-6, 1e-3))
        return other.place[0] + away * math.cos(turn), other.place[1] + away * math.sin(turn)
    if what < 0.75 and kind in ("circle", "stadium"):
        turn, half = rnd.uniform(0.0, math.tau), 0.35 if kind == "circle" else 0.3
        x = 0.7 if kind == "stadium" and math.cos(turn) > 0.0 else half
        far_x = (half - r) * math.cos(turn) * (1.0 - 1e-15)
        return x + far_x, half + (half - r) * math.sin(turn) * (1.0 - 1e-15)
    return rnd.uniform(0, 1), rnd.uniform(0, 0.7)


def balls_of(rnd: random.Random, kind: str, posts: list[Post]) -> list[Start]:
    """Return random balls, of which many touch, and many move towards another one."""
    count, balls = rnd.choice((2, 3, 4, 5)), list[Start]()
    while len(balls) < count:
        is_unequal = kind == "unequal" or rnd.random() < 0.2
        r = rnd.choice((0.03, 0.03, 0.02, 0.04)) if is_unequal else 0.03
        place = place_of(rnd, kind, r, balls)
        if not has_room(kind, place, r, balls, posts):
            continue
        speed, turn = 10 ** rnd.uniform(-2, 0.5), rnd.uniform(0.0, math.tau)
        if balls and rnd.random() < 0.5:
            x, y = rnd.choice(balls).place
            turn = math.atan2(y - place[1], x - place[0])
        velocity = speed * math.cos(turn), speed * math.sin(turn)
        velocity = velocity if rnd.random() < 0.6 else (0.0, 0.0)
        mass, roll = rnd.choice((0.2, 0.2, 0.2, 0.6, 0.05, 2.0)), rnd.choice((0.0, 1, 1, -1, 2))
        balls.append(Start(place, r, mass, velocity, roll))
    return balls


def small_table(seed: int) -> Scene:
    """Return a small table with arcs, posts or unequal balls, of which most touch something."""
    rnd, posts = random.Random(f"fz3 {seed}"), list[Post]()  # Another word draws other tables.
    kind = rnd.choice(tuple(TABLES))
    if kind == "posts":
        for _ in range(rnd.choice((1, 2))):
            place = rnd.uniform(0.15, 0.65), rnd.uniform(0.12, 0.38)
            posts.append(Post(place, rnd.choice((0.0, 0.02, 0.05))))
    starts, rolls = balls_of(rnd, kind, posts), rnd.random() < 0.7
    surface, cushion, ball_ball = (
        rnd.choice((0.1, 0.2, 0.5)), rnd.choice((0.0, 0.1, 0.3)), rnd.choice((0.0, 0.05, 0.2)),
    )  # fmt: skip
    rolling = rnd.choice((0.01, 0.02, 0.05)) if rolls else None
    e, at_cushions = rnd.choice((0.0, 0.3, 0.7, 0.9, 0.95)), rnd.choice((0.0, 0.0, 0.3, 0.7, 0.9))
    balls = tuple(
        Ball(f"{k}", each.place, each.radius, each.mass, velocity=each.velocity,
             roll=each.roll if rolls else 0.0)
        for k, each in enumerate(starts)
    )  # fmt: skip
    return Scene(
        balls, TABLES[kind], Restitution(e, cushion=at_cushions),
        Friction(surface, cushion, ball_ball, rolling=rolling), posts=tuple(posts),
    )  # fmt: skip
