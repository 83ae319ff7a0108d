"""These are random small scenes with patches, which tests share."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

from pool_pymunk import Ball, Friction, Patch, Restitution, Scene, SceneError, Table

R, M = 0.03, 0.17  # m, kg
LENGTH, WIDTH = 0.8, 0.5  # m


def random_patch(rnd: random.Random, rolls: bool) -> Patch:
    """Return a round patch or a polygon, with more or less friction than elsewhere."""
    own: dict[str, Any] = {"surface": rnd.uniform(0.05, 0.8)}
    if rolls:
        own["rolling"] = own["surface"] * rnd.uniform(0.02, 0.5)
    x, y = rnd.uniform(0.1, LENGTH - 0.1), rnd.uniform(0.1, WIDTH - 0.1)
    if rnd.random() < 0.4:
        return Patch(center=(x, y), radius=rnd.uniform(0.05, 0.25), **own)
    size = rnd.uniform(0.1, 0.3)
    angles = sorted(rnd.uniform(0.0, math.tau) for _ in range(rnd.choice((3, 4, 5))))
    corners = tuple((x + size * math.cos(a), y + size * math.sin(a)) for a in angles)
    try:
        return Patch(corners, **own)
    except SceneError:  # Two corners are the same.
        return random_patch(rnd, rolls)


def random_scene(seed: object, **changes: Any) -> Scene:
    """Return one to three balls on a small table with one to three patches."""
    rnd = random.Random(f"patches {seed}")
    rolls, balls = rnd.random() < 0.6, list[Ball]()
    for _ in range(rnd.choice((1, 2, 2, 3))):
        place = rnd.uniform(0.04, LENGTH - 0.04), rnd.uniform(0.04, WIDTH - 0.04)
        while any(math.dist(place, other.position) < 2 * R + 0.002 for other in balls):
            place = rnd.uniform(0.04, LENGTH - 0.04), rnd.uniform(0.04, WIDTH - 0.04)
        speed, angle = rnd.uniform(0.3, 2.0), rnd.uniform(0.0, math.tau)
        velocity = speed * math.cos(angle), speed * math.sin(angle)
        roll = rnd.choice((0.0, 1.0, -0.5, rnd.uniform(-1.0, 1.5))) if rolls else 0.0
        balls.append(Ball(f"{len(balls)}", place, R, M, velocity=velocity, roll=roll))
    surface = rnd.uniform(0.05, 0.3)
    patches = tuple(random_patch(rnd, rolls) for _ in range(rnd.choice((1, 2, 3))))
    scene = Scene(
        tuple(balls),
        Table.rectangle(LENGTH, WIDTH),
        Restitution(rnd.choice((0.5, 0.8, 0.95)), cushion=rnd.choice((0.6, 0.8))),
        Friction(surface, 0.1, 0.05, rolling=surface * rnd.uniform(0.05, 0.4) if rolls else None),
        patches=patches,
    )
    return replace(scene, **changes)
