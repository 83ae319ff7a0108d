"""Random scenes whose contacts may persist, and how much farther their ends move than starts."""

from __future__ import annotations

import cmath
import json
import math
import random
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from pool_pymunk import Ball, Friction, Restitution, Scene, State, Table
from pool_pymunk.model import Point
from tests import DATA
from tests.oracle.press_reference import press_run
from tests.oracle.reference import Refused

R, M = 0.0286, 0.17
MOST = {"pair": 2, "row": 4, "three": 3, "triangle": 3, "wall": 2, "arc": 2}
LEAST = {"pair": 2, "row": 3, "three": 3, "triangle": 3, "wall": 1, "arc": 1}
TABLES = {
    "wall": (Table.rectangle(1.2, 0.8),),
    "arc": (Table.stadium(1.6, 0.8), Table.circle(0.5)),
}
NUDGE = 1e-6  # m and m/s
# Scenes whose ends were found by tiny time steps and by closed forms.
ON_FILE = {
    record["name"]: (
        Scene(
            tuple(Ball(**ball) for ball in record["balls"]),
            record["table"] and Table(**record["table"]),
            Restitution(**record["restitution"]),
            Friction(**record["friction"]),
        ),
        [complex(*place) for place in record["final"]],
    )
    for record in json.loads((DATA / "press.json").read_text())
}


def press_scene(seed: int, kind: str | None = None) -> Scene:
    """Return balls near each other, near a wall or on an arc; the first one moves, or rolls."""
    rng = random.Random(f"press {seed}")
    kind = kind or rng.choice(list(MOST))
    count, heading = rng.randint(LEAST[kind], MOST[kind]), rng.uniform(0.0, math.tau)
    sizes = (1.0,) if kind == "triangle" else (1.0, 1.0, 1.0, 0.8)
    radii = [R * rng.choice(sizes) for _ in range(count)]
    masses = [M * rng.choice((1.0, 1.0, 1.0, 2.0, 0.5)) for _ in range(count)]
    places = _places(kind, radii, heading, rng)
    aside = 0.0 if rng.random() < 0.3 else rng.uniform(-0.4, 0.4)
    go = cmath.rect(rng.uniform(0.3, 1.2), heading + aside)
    rolls = rng.random() < 0.75
    balls = [
        Ball(str(k), (p.real, p.imag), r, m)
        for k, (p, r, m) in enumerate(zip(places, radii, masses, strict=True))
    ]
    roll = rng.choice((1.0, 1.0, 2.0, 0.0, 3.0)) if rolls else 0.0
    balls[0] = replace(balls[0], velocity=(go.real, go.imag), roll=roll)
    return Scene(
        tuple(balls),
        rng.choice(TABLES[kind]) if kind in TABLES else None,
        Restitution(rng.choice((0.0, 0.0, 0.3, 0.7, 0.9)), cushion=rng.choice((0.0, 0.0, 0.3))),
        Friction(
            rng.choice((0.1, 0.2)),
            rng.choice((0.0, 0.1, 0.2)),
            rng.choice((0.0, 0.05)),
            rolling=rng.choice((0.01, 0.03, 0.08)) if rolls else None,
        ),
    )


def _places(kind: str, radii: Sequence[float], heading: float, rng: random.Random) -> list[complex]:
    gap, places = rng.choice((0.0, 1e-4, 1e-3, 1e-2)), [0.5 + 0.4j]
    if kind == "triangle":
        sides = (cmath.rect(2 * R + gap, heading + turn) for turn in (-math.pi / 6, math.pi / 6))
        return [*places, *(places[0] + side for side in sides)]
    for r, s in pairwise(radii):
        bend = 0.0 if kind == "row" else rng.uniform(-1.0, 1.0)
        places.append(places[-1] + cmath.rect(r + s + gap, heading + bend))
    return places


def nudged(start: State, rng: random.Random) -> State:
    """Return the start with its places, and the velocities of moving balls, a little elsewhere."""

    def near(rows: Sequence[Point]) -> tuple[Point, ...]:
        return tuple(
            (x + NUDGE * rng.uniform(-1, 1), y + NUDGE * rng.uniform(-1, 1)) if moves else (x, y)
            for (x, y), moves in zip(rows, going, strict=True)
        )

    going = [True] * len(start.position)
    place = near(start.position)
    going = [v != (0.0, 0.0) for v in start.velocity]
    return start._replace(position=place, velocity=near(start.velocity))


def amplification(scene: Scene, ends: Sequence[complex], nudges: int = 3) -> float:
    """Return how much farther ends move than starts, by the reference; at least 1."""
    found, rng, start = 1.0, random.Random(0), scene.start(None)
    for _ in range(nudges):
        try:
            other = press_run(scene, nudged(start, rng)).final
        except (Refused, ArithmeticError):  # It takes steps that are too long for this one.
            continue
        found = max(found, farthest(other, ends) / NUDGE)
    return found


def farthest(ends: Sequence[complex], others: Sequence[complex]) -> float:
    """Return how far apart (m) the ends of a ball are at most."""
    return max(abs(a - b) for a, b in zip(ends, others, strict=True))


# -- plain scenes ----------------------------------------------------------------------------------

r = 0.03
TABLE = Table.rectangle(2.0, 1.0)


def scene_of(table: Table | None, *balls: Ball, e: float = 0.5) -> Scene:
    """Return a scene in which balls slide, then roll."""
    return Scene(balls, table, Restitution(e, None, e), Friction(0.2, 0.0, 0.0, 0.01))


HEAD_ON = scene_of(
    None, Ball("1", (0.0, 0.0), r, 0.2, velocity=(0.5, 0.0)),
    Ball("2", (0.061, 0.0), r, 0.2, velocity=(-0.5, 0.0)), e=0.1,
)  # fmt: skip
AT_A_CUSHION = scene_of(TABLE, Ball("1", (0.5, 0.969), r, 0.2, velocity=(0.2, 0.5)), e=0.1)
AT_REST = scene_of(TABLE, Ball("1", (0.5, 1.0 - r), r, 0.2))
IN_A_CORNER = scene_of(TABLE, Ball("1", (2.0 - r, 1.0 - r), r, 0.2))
ON_A_CIRCLE = scene_of(
    Table.circle(0.5), Ball("1", (0.5, r), r, 0.2, velocity=(0.6, 0.01)), e=0.1
)  # fmt: skip
