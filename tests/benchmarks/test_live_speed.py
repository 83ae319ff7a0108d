"""Steps of live tables at 60 frames a second are measured beside those of pymunk itself.

``python tests/benchmarks/test_live_speed.py`` prints the table of docs/speed.md: how long steps
take on the mean and at most, and how often that is what pymunk's own step of the same balls takes.
With ``--cpu`` the time counts in which this thread had a core, as on a machine that is idle.
"""

from __future__ import annotations

import gc
import math
import random
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import Any

import pymunk
import pytest

from pool_pymunk import Ball, Billiards, Friction, Restitution, Scene, Table, load
from pool_pymunk.solvers.pymunk_space import set_up
from pool_pymunk.solvers.record import Settings

DT = 1 / 60  # s
BREAKS, STEPS = 400, 600
CLOCK = time.thread_time if "--cpu" in sys.argv else time.perf_counter
BARS = {"a break of eight-ball": 8.0, "500 discs that roll": 16.0,
        "200 discs and two bars that turn": 8.0}  # fmt: skip


def started(scene: Scene) -> Billiards:
    """Return a table with the balls of a scene as they begin."""
    return set_up(scene, scene.start(None), Settings(DT))


def broken(seed: int, scene: Scene) -> Billiards:
    """Return a table whose cue ball is struck at the rack, at 0.3 to 12 m/s, within 10 degrees."""
    rnd = random.Random(seed)
    table = started(scene)
    cue = next(k for k, ball in enumerate(scene.balls) if ball.cue)
    rack = [ball.position for ball in scene.balls if not ball.cue]
    x, y = (sum(parts) / len(rack) for parts in zip(*rack, strict=True))
    own = scene.balls[cue].position
    speed, aside = 0.3 * 40.0 ** rnd.random(), math.radians(rnd.uniform(-10.0, 10.0))
    angle = math.atan2(y - own[1], x - own[0]) + aside
    table.strike(table.balls[cue], (speed * math.cos(angle), speed * math.sin(angle)))
    return table


def discs(count: int, columns: int, rolling: float | None) -> Scene:
    """Return discs a radius apart, which set off at 1 m/s in random directions."""
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
    return Scene(
        balls, table, Restitution(0.95, cushion=0.8), Friction(0.2, 0.1, 0.05, rolling=rolling)
    )


def with_bars(scene: Scene) -> Billiards:
    """Return a table with two bars in gaps between balls, which turn at 4 rad/s."""
    table = started(scene)
    for k, gap in ((0, 0.045), (len(scene.balls) - 1, -0.045)):
        (x, y), body = scene.balls[k].position, pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position, body.angular_velocity = (x + gap, y + gap), 4.0
        table.add_wall(pymunk.Segment(body, (-0.03, 0.0), (0.03, 0.0), 0.002), 0.9)
    return table


def cases(breaks: int = BREAKS) -> dict[str, Iterator[Billiards]]:
    """Return the tables of each case."""
    eight = load("eight-ball")
    sliding = replace(eight, friction=replace(eight.friction, rolling=None), shots=eight.shots[:2])
    return {
        "a break of eight-ball": (broken(seed, eight) for seed in range(breaks)),
        "the same balls sliding": (broken(seed, sliding) for seed in range(breaks)),
        "500 discs that roll": iter([started(discs(500, 25, 0.01))]),
        "200 discs and two bars that turn": iter([with_bars(discs(200, 20, 0.01))]),
    }


def steps(step: Any, count: int = STEPS) -> list[float]:
    """Return how long (ms) each step takes."""
    found = []
    for _ in range(count):
        began = CLOCK()
        step(DT)
        found.append(1e3 * (CLOCK() - began))
    return found


def bare(table: Billiards) -> pymunk.Space:
    """Return a space with the same discs and segments of pymunk's own."""
    space = pymunk.Space()
    for ball in table.on_table:
        body = pymunk.Body(ball.body.mass, math.inf)
        body.position, body.velocity = ball.body.position, ball.body.velocity
        space.add(body, pymunk.Circle(body, ball.radius))
    for shape in table.walls.values():
        if isinstance(shape, pymunk.Segment):
            space.add(pymunk.Segment(space.static_body, shape.a, shape.b, shape.radius))
    for shape in space.shapes:
        shape.elasticity = 0.9
    return space


def measured(name: str, hears: bool, breaks: int = BREAKS) -> tuple[list[float], float]:
    """Return how long (ms) steps take, and how long those of pymunk take on the mean."""
    found, theirs = [], []
    for table in cases(breaks)[name]:
        if hears:
            table.on_contact = lambda _: None
        gc.collect()  # A game has one table, and not what remains of hundreds.
        theirs.append(steps(bare(table).step))
        found.append(steps(table.step))
    own = [*chain.from_iterable(theirs)]
    return sorted(chain.from_iterable(found)), sum(own) / len(own)


@pytest.mark.parametrize("name", BARS)
def test_steps_end_within_a_frame(benchmark: Any, name: str) -> None:
    found, theirs = benchmark.pedantic(measured, (name, True, 20), rounds=1)
    benchmark.extra_info.update(longest=found[-1], beside_pymunk=sum(found) / len(found) / theirs)
    assert found[-1] < 4.0 * BARS[name]  # A busy machine takes longer.


def main() -> None:
    gc.collect()
    gc.freeze()
    print("| what is played | on_contact | mean, ms | 99 %, ms | longest, ms | times pymunk's |")
    print("|---|---|---:|---:|---:|---:|")
    for name in cases():
        for hears in (False, True):
            found, theirs = measured(name, hears)
            mean, most = sum(found) / len(found), found[99 * len(found) // 100]
            row = f"{mean:.2f} | {most:.2f} | {found[-1]:.1f} | {mean / theirs:.0f}"
            print(f"| {name} | {'yes' if hears else 'no'} | {row} |", flush=True)


if __name__ == "__main__":
    main()
