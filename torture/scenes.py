"""This module says how far an answer to a scene of the torture suite is from the known one.

The scenes are those of `pool_pymunk/studies/stability/known.py`. `python -m torture.export` writes
them into `scenes.json`, as plain numbers for programs that this one does not start.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pool_pymunk.model.arrays import Array
from pool_pymunk.studies.stability.claims import beyond, deepest_overlap
from pool_pymunk.studies.stability.known import Check, KnownScene, known_scenes

FILE = Path(__file__).with_name("scenes.json")
SCENES = list(known_scenes())


def judge(scene: KnownScene, answer: dict[str, Any]) -> list[tuple[Check, float]]:
    """Return each check with the error of an answer: its states at the looks, or its gradient."""
    return [(check, _error(scene, check, answer)) for check in scene.checks]


def _error(scene: KnownScene, check: Check, answer: dict[str, Any]) -> float:
    if check.kind == "gradient":
        return float(np.abs(np.subtract(answer["gradient"], check.answer)).max())
    states = np.array(answer["states"])  # x, y, vx, vy of each ball at each look
    points, velocities, last = states[..., :2], states[..., 2:], states[-1]
    radii = np.array([ball.r for ball in scene.balls])
    if not np.isfinite(last).all():
        return np.inf
    if check.kind == "overlap":
        return deepest_overlap(points, radii)
    if check.kind == "inside" and scene.table is not None:
        return max(0.0, float(beyond(scene.table, points, radii).max()))
    if check.kind == "energy":
        starts = np.array([ball[:4] for ball in scene.balls])
        return abs(energy(scene, last) / energy(scene, starts) - 1.0)
    if check.kind == "mirror":
        one, other = (points[-1, each] for each in np.transpose(check.answer))
        return float(np.hypot(*(one - other * (1.0, -1.0)).T).max())
    ends = points[-1] if check.kind == "ends" else velocities[-1]
    return float(np.hypot(*(ends - check.answer).T).max())


def energy(scene: KnownScene, state: Array) -> float:
    """Return the kinetic energy of discs (N, 4), and that of their heights (J)."""
    mass = np.array([ball.m for ball in scene.balls])
    _, y, vx, vy = state.T
    return float((mass * ((vx * vx + vy * vy) / 2 - scene.gravity * y)).sum())
