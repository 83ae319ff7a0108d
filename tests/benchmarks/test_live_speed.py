"""Steps of a live table are measured.

``python tests/benchmarks/test_live_speed.py`` prints the table of docs/speed.md: the longest step
(1/60 s) of each of some breaks, of which the median and the longest count; with POOL_PYMUNK_PURE=1
as plain Python.
"""

from __future__ import annotations

import gc
import math
import random
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import Any

import pymunk
import pytest

from pool_pymunk import Ball, Billiards, Friction, Restitution, Scene, Table, load
from pool_pymunk.solvers.pymunk_space import set_up
from pool_pymunk.solvers.record import Settings

DT = 1 / 60
BREAKS, STEPS = 40, 600


def broken(seed: int, scene: Scene) -> Billiards:
    """Return a table whose cue ball is struck at the rack, at 1 to 10 m/s and within 10 degrees."""
    rnd = random.Random(seed)
    table = started(scene)
    cue = next(k for k, ball in enumerate(scene.balls) if ball.cue)
    rack = [ball.position for ball in scene.balls if not ball.cue]
    x, y = (sum(parts) / len(rack) for parts in zip(*rack, strict=True))
    own = scene.balls[cue].position
    speed, aside = rnd.uniform(1.0, 10.0), math.radians(rnd.uniform(-10.0, 10.0))
    angle = math.atan2(y - own[1], x - own[0]) + aside
    table.strike(table.balls[cue], (speed * math.cos(angle), speed * math.sin(angle)))
    return table


def discs(count: int = 500, columns: int = 25) -> Scene:
    """Return discs that roll, a radius apart, and set off at 1 m/s in random directions."""
    rnd, radius = random.Random(1), 0.03
    angles = [rnd.uniform(0.0, math.tau) for _ in range(count)]
    balls = tuple(
        Ball(
            f"{k}", (3.0 * radius * (k % columns + 1), 3.0 * radius * (k // columns + 1)), radius,
            0.17, velocity=(math.cos(angle), math.sin(angle)),
        )
        for k, angle in enumerate(angles)
    )  # fmt: skip
    table = Table.rectangle(3.0 * radius * (columns + 1), 3.0 * radius * (count // columns + 1))
    friction = Friction(0.2, 0.1, 0.05, rolling=0.01)
    return Scene(balls, table, Restitution(0.95, cushion=0.8), friction)


def steps(table: Billiards) -> list[float]:
    """Return how long (ms) each step takes."""
    found = []
    for _ in range(STEPS):
        began = time.perf_counter()
        table.step(DT)
        found.append(1e3 * (time.perf_counter() - began))
    return found


def cases() -> dict[str, Scene]:
    """Return the scenes of the table."""
    eight = load("eight-ball")
    slides = replace(eight.friction, rolling=None)
    sliding = replace(eight, friction=slides, shots=eight.shots[:2])
    return {
        "a break of eight-ball": eight, "the same balls sliding": sliding,
        "500 discs that roll": discs(), "16 discs and two spinners": discs(16, 4),
        "200 discs and two spinners": discs(200, 20),
    }  # fmt: skip


def started(scene: Scene) -> Billiards:
    """Return a table with the balls of a scene as they begin."""
    return set_up(scene, scene.start(None), Settings(DT), "joint")


def tables(scene: Scene, turns: bool) -> Iterator[Billiards]:
    """Yield tables with breaks of a scene; without a cue ball, one whose balls move already.

    Where something ``turns``, it is two bars in the gaps between balls, which turn at 4 rad/s.
    """
    if any(ball.cue for ball in scene.balls):
        yield from (broken(seed, scene) for seed in range(BREAKS))
        return
    table = started(scene)
    for k in (0, len(scene.balls) - 1) if turns else ():
        (x, y), gap = scene.balls[k].position, 0.045 if k == 0 else -0.045
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position, body.angular_velocity = (x + gap, y + gap), 4.0
        table.add_wall(pymunk.Segment(body, (-0.03, 0.0), (0.03, 0.0), 0.002), 0.9)
    yield table


def longest(
    scene: Scene, turns: bool, hears: Callable[[Any], object] | None
) -> tuple[list[float], float]:
    """Return the longest step (ms) of each table, and what 99 % of all steps stay below."""
    found = []
    for table in tables(scene, turns):
        table.on_contact = hears
        found.append(steps(table))
    every = sorted(chain.from_iterable(found))
    return [max(each) for each in found], every[99 * len(every) // 100]


@pytest.mark.parametrize("name", ["a break of eight-ball", "the same balls sliding"])
def test_steps_of_a_break(benchmark: Any, name: str) -> None:
    scene = cases()[name]
    benchmark(lambda: steps(broken(12, scene)))


def main() -> None:
    print("| what is played | on_contact | the longest step, ms |\n|---|---|---:|")
    for name, scene in cases().items():
        gc.collect()
        gc.freeze()
        for hears in (None, lambda _: None):
            found, most = longest(scene, "spinners" in name, hears)
            row = f"{statistics.median(found):.1f} ({max(found):.0f}), 99 %: {most:.1f}"
            print(f"| {name} | {'yes' if hears else 'no'} | {row} |")


if __name__ == "__main__":
    main()
