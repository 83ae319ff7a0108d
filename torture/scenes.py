"""This module reads the scenes of the torture suite, each with a known answer and its source.

They stand in `scenes.json`, which `python -m torture.export` makes of the extremes of
`pool-pymunk stability`. A scene is data and needs no simulator: a runner gets `plain()` as JSON,
and `judge()` says how far an answer is from the known one. Lengths are in m, speeds in m/s, masses
in kg.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

Pair = tuple[float, float]
State = Sequence[Sequence[float]]  # x, y, vx, vy of each ball


class Ball(NamedTuple):
    """A ball has a place, a velocity, a radius and a mass."""

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    r: float = 0.03
    m: float = 0.17


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
    walls: tuple[Pair, ...] = ()
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
        upright = all(
            0.0 in (a[0] - b[0], a[1] - b[1])
            for a, b in zip(self.walls, self.walls[1:] + self.walls[:1], strict=True)
        )
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
        known = zip(answer["gradient"], check.answer, strict=True)
        return float(max(abs(a - b) for a, b in known))
    states: list[State] = answer["states"]
    if any(not math.isfinite(number) for row in states[-1] for number in row):
        return math.inf
    if check.kind == "overlap":
        return max(_overlap(scene, state) for state in states)
    if check.kind == "inside":
        return max(_outside(scene, state) for state in states)
    if check.kind == "energy":
        return abs(energy(scene, states[-1]) / energy(scene, _starts(scene)) - 1.0)
    if check.kind == "mirror":
        pairs = [(states[-1][i], states[-1][j]) for i, j in check.answer]
        return max(math.dist((a[0], a[1]), (b[0], -b[1])) for a, b in pairs)
    columns = slice(0, 2) if check.kind == "ends" else slice(2, 4)
    ends = [row[columns] for row in states[-1]]
    known = zip(ends, check.answer, strict=True)
    return float(max(math.dist(end, right) for end, right in known if right is not None))


def _starts(scene: Scene) -> State:
    return [ball[:4] for ball in scene.balls]


def energy(scene: Scene, state: State) -> float:
    """Return the kinetic energy of discs, and that of their heights (J)."""
    return sum(
        ball.m * ((vx * vx + vy * vy) / 2 - scene.gravity * y)
        for ball, (_, y, vx, vy) in zip(scene.balls, state, strict=True)
    )


def _overlap(scene: Scene, state: State) -> float:
    """Return how deep two balls are in each other, at most."""
    rows = [(row[0], row[1], ball.r) for row, ball in zip(state, scene.balls, strict=True)]
    pairs = [(a, b) for i, a in enumerate(rows) for b in rows[:i]]
    return max(max(0.0, a[2] + b[2] - math.dist(a[:2], b[:2])) for a, b in pairs)


def _outside(scene: Scene, state: State) -> float:
    """Return how far a ball's edge is beyond a wall, at most; the outline is convex."""
    worst = 0.0
    for (ax, ay), (bx, by) in zip(scene.walls, scene.walls[1:] + scene.walls[:1], strict=True):
        length = math.hypot(bx - ax, by - ay)
        for (x, y, *_), ball in zip(state, scene.balls, strict=True):
            inwards = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length
            worst = max(worst, ball.r - inwards)
    return worst


# -- the scenes --------------------------------------------------------------------------------


def read(told: dict[str, Any]) -> Scene:
    """Return a scene from its JSON."""
    balls = tuple(Ball(*ball) for ball in told["balls"])
    checks = tuple(Check(*check) for check in told["checks"])
    walls = tuple((x, y) for x, y in told.get("walls", ()))
    return Scene(**told | {"balls": balls, "checks": checks, "walls": walls})


FILE = Path(__file__).with_name("scenes.json")
SCENES = [read(told) for told in json.loads(FILE.read_text(encoding="utf-8"))]
