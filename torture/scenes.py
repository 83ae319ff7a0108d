"""This module reads the scenes of the torture suite, each with a known answer and its source.

They stand in `pool_pymunk/studies/stability/known.json`, because `pool-pymunk stability` plays
them, too. A scene is data: a runner gets `plain()` as JSON, and `judge()` says how far an answer is
from the known one. Lengths are in m, speeds in m/s, masses in kg.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.model import Point
from pool_pymunk.model.arrays import Array
from pool_pymunk.studies.stability.claims import deepest_overlap
from pool_pymunk.studies.stability.known import FILE
from torture.runners.common import sides


class Ball(NamedTuple):
    """A ball has a place, a velocity, a radius and a mass."""

    x: float
    y: float
    vx: float
    vy: float
    r: float
    m: float


class Check(NamedTuple):
    """A check says what is compared, the known answer, what counts as right, and its unit."""

    kind: str
    answer: Any
    tolerance: float
    unit: str = "m"


@dataclass(frozen=True)
class Scene:
    """A scene has a known answer.

    ``walls`` are the corners of a closed outline, anticlockwise; ``thin`` ones have no thickness.
    ``together`` says that several balls meet at one instant, and the answer is that of this. The
    states are judged at ``looks`` equally spaced times, up to ``time`` (s). The scene is played in
    this number of ``parts``, each from the end of the last. ``reverse`` plays it, turns all
    velocities round, and plays it again. Balls that roll start with a ``roll``, a share of their
    velocity. ``nudge`` asks for the derivatives of the last ball's end along x by every ball's x
    and vx, by central differences of that size. ``limit`` is the processor time (s) for one play.
    """

    name: str
    about: str
    known: str
    balls: tuple[Ball, ...]
    time: float
    checks: tuple[Check, ...]
    walls: tuple[Point, ...] = ()
    restitution: float = 1.0
    wall_restitution: float = 1.0
    friction: float = 0.0
    rolling: float | None = None
    roll: float = 0.0
    gravity: float = 0.0
    thin: bool = False
    together: bool = False
    looks: int = 1
    parts: int = 1
    reverse: bool = False
    nudge: float = 0.0
    thread: str = ""
    timed: bool = False
    limit: int = 60

    @property
    def needs(self) -> tuple[str, ...]:
        """What a simulator must offer to play this."""
        upright = all(a[0] == b[0] or a[1] == b[1] for a, b in sides(self.walls))
        asked = {
            "restitution below 1": min(self.restitution, self.wall_restitution) < 1.0,
            "friction of sliding discs": self.friction > 0.0 and self.rolling is None,
            "balls that roll": self.rolling is not None,
            "gravity in the plane": self.gravity != 0.0,
            "any outline": not upright,
            "unequal masses": len({ball.m for ball in self.balls}) > 1,
            "hits of one instant": self.together,
            "unequal radii": len({ball.r for ball in self.balls}) > 1,
        }
        return tuple(need for need, is_asked in asked.items() if is_asked)

    def plain(self) -> dict[str, Any]:
        """Return all that a runner learns: everything except the answer."""
        numbers = {k: v for k, v in vars(self).items() if k not in ("about", "known", "checks")}
        kinds = {"touching": self._touch(), "in line": self._in_line()}
        return numbers | kinds | {"needs": self.needs}

    def _touch(self) -> bool:
        """Tell whether two balls touch at the start."""
        pairs = ((a, b) for i, a in enumerate(self.balls) for b in self.balls[:i])
        return any(abs(math.dist(a[:2], b[:2]) - a.r - b.r) < 1e-9 for a, b in pairs)

    def _in_line(self) -> bool:
        """Tell whether all balls lie and move on one line."""
        return len(self.balls) > 1 and len({(ball.y, ball.vy) for ball in self.balls}) == 1


# -- how far an answer is from the known one ---------------------------------------------------


def judge(scene: Scene, answer: dict[str, Any]) -> list[tuple[Check, float]]:
    """Return each check with the error of an answer: its states at the looks, or its gradient."""
    return [(check, _error(scene, check, answer)) for check in scene.checks]


def _error(scene: Scene, check: Check, answer: dict[str, Any]) -> float:
    if check.kind == "gradient":
        return float(np.abs(np.subtract(answer["gradient"], check.answer)).max())
    states = np.array(answer["states"])  # x, y, vx, vy of each ball at each look
    points, last, radii = states[..., :2], states[-1], np.array([ball.r for ball in scene.balls])
    if not np.isfinite(last).all():
        return math.inf
    if check.kind == "overlap":
        return deepest_overlap(points, radii)
    if check.kind == "inside":
        depths = [float((radii - _inwards(points, *side)).max()) for side in sides(scene.walls)]
        return max(0.0, *depths)
    if check.kind == "energy":
        starts = np.array([ball[:4] for ball in scene.balls])
        return abs(energy(scene, last) / energy(scene, starts) - 1.0)
    if check.kind == "mirror":
        one, other = last[np.transpose(check.answer), :2]
        return float(np.hypot(*(one - other * (1.0, -1.0)).T).max())
    vectors = last[:, :2] if check.kind == "ends" else last[:, 2:]
    return float(np.hypot(*(vectors - check.answer).T).max())


def _inwards(points: Array, a: Point, b: Point) -> Array:
    """Return how far (m) points are from the straight line through a wall, on its inner side."""
    x, y = np.moveaxis(points - np.array(a), -1, 0)
    return np.asarray((b[0] - a[0]) * y - (b[1] - a[1]) * x) / math.dist(a, b)


def energy(scene: Scene, state: Array) -> float:
    """Return the kinetic energy of discs, by their x, y, vx, vy, and that of their heights (J)."""
    mass, (_, y, vx, vy) = np.array([ball.m for ball in scene.balls]), state.T
    return float((mass * ((vx * vx + vy * vy) / 2.0 - scene.gravity * y)).sum())


def read(entry: dict[str, Any]) -> Scene:
    """Return a scene from its JSON, without what the stability study alone reads."""
    numbers = {key: value for key, value in entry.items() if key not in ("also", "case", "slow")}
    balls = tuple(Ball(*ball) for ball in entry["balls"])
    checks = tuple(Check(*check) for check in entry["checks"])
    walls = tuple((x, y) for x, y in entry.get("walls", ()))
    return Scene(**numbers | {"balls": balls, "checks": checks, "walls": walls})


SCENES = [read(entry) for entry in json.loads(FILE.read_text(encoding="utf-8"))]
