"""The adapter's cost is measured beside bare pymunk, and how it grows: ``make bench``.

Bare pymunk makes as many ``space.step`` calls on the same balls, with no handlers and no friction.
Each benchmark's ``extra_info`` has the ratio within one run. The balls' set-up is part of the time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pymunk
import pytest

from pool_pymunk import (
    Billiards,
    Scene,
    Shot,
    load,
    same_balls,
    simulate,
)
from tests.shared.crowded import crowded
from tests.shared.scenes import gas

REPEATS = 7


def least(work: Callable[[], Any]) -> float:
    """Return the least time (s) of several calls, after one to warm up."""
    work()
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return min(times)


def bare(scene: Scene, shot: Shot | None, steps: int, dt: float) -> float:
    """Return the least time (s) of this many bare steps of a space with the scene's shapes."""
    times = []
    start = scene.start(shot)
    for _ in range(REPEATS):
        space = pymunk.Space()
        for ball, position, velocity in zip(
            scene.balls, start.position, start.velocity, strict=True
        ):
            body = pymunk.Body(ball.mass, math.inf)
            body.position, body.velocity = position, velocity
            space.add(body, pymunk.Circle(body, ball.radius))
        for edge in scene.table.edges if scene.table else ():
            space.add(pymunk.Segment(space.static_body, edge.start, edge.end, 0.0))
        began = time.perf_counter()
        for _ in range(steps):
            space.step(dt)
        times.append(time.perf_counter() - began)
    return min(times)


def test_a_table_at_rest(benchmark: Any) -> None:
    """``extra_info`` has the time of a step beside that of a bare space with the same balls."""
    table = Billiards(pymunk.Space(), 1 / 60, pair=same_balls(0.9, 0.05), deceleration=1.0)
    scene = load("report")
    for ball in scene.balls:
        body = pymunk.Body(ball.mass, math.inf)
        body.position = ball.position
        table.add_ball(pymunk.Circle(body, ball.radius))

    def steps() -> None:
        for _ in range(1_000):
            table.step()

    ratio = least(steps) / bare(scene, None, 1_000, 1 / 60)
    benchmark.extra_info["times bare pymunk"] = round(ratio, 1)
    benchmark(table.step)


@pytest.mark.parametrize(
    ("solver", "dt", "options"),
    [
        ("pymunk", 1 / 60, {}),
        ("pymunk", 1 / 240, {}),
        ("pymunk", 1 / 240, {"friction": "callback"}),
        ("pymunk-discrete", 1 / 240, {}),
        ("pymunk-discrete", 1e-4, {}),
    ],
)
def test_the_reports_four_shots(
    benchmark: Any, solver: str, dt: float, options: dict[str, Any]
) -> None:
    scene = load("report")
    runs = [partial(simulate, scene, shot, solver=solver, dt=dt, **options) for shot in scene.shots]

    def four() -> None:
        for run in runs:
            run()

    benchmark(four)
    alone = sum(
        bare(scene, shot, run().steps, dt) for shot, run in zip(scene.shots, runs, strict=True)
    )
    benchmark.extra_info["ratio to bare pymunk"] = round(least(four) / alone, 2)


@pytest.mark.parametrize("count", [11, 50, 200, 1000])
def test_many_balls(benchmark: Any, count: int) -> None:
    """One ball moves, on a table as crowded as the report's."""
    scene = crowded(count, all_move=False)
    run = benchmark(partial(simulate, scene, solver="pymunk", dt=1 / 240))
    stepping = min(simulate(scene, solver="pymunk", dt=1 / 240).wall_time for _ in range(3))
    alone = bare(scene, None, run.steps, 1 / 240)
    benchmark.extra_info["us a step"] = round(stepping / run.steps * 1e6, 1)
    benchmark.extra_info["bare us a step"] = round(alone / run.steps * 1e6, 1)
    benchmark.extra_info["ratio to bare pymunk"] = round(stepping / alone, 2)


def eight_ball() -> tuple[pymunk.Space, Billiards]:
    """Return the break of `eight-ball` as a game has it, with the cue ball in motion."""
    scene, space = load("eight-ball"), pymunk.Space()
    pair = same_balls(0.95, scene.friction.ball_ball)
    assert scene.table is not None and scene.friction.rolling is not None
    table = Billiards(
        space, 1 / 60, pair=pair, deceleration=scene.deceleration,
        rolling=scene.friction.rolling * scene.physics.gravity,
    )  # fmt: skip
    for edge in scene.table.edges:
        table.add_wall(pymunk.Segment(space.static_body, edge.start, edge.end, 0), 0.75, 0.14)
    for pocket in scene.pockets:
        table.add_pocket(pocket.position, pocket.radius)
    for ball in scene.balls:
        body = pymunk.Body(ball.mass, 1e-4)
        body.position = ball.position
        table.add_ball(pymunk.Circle(body, ball.radius))
    table.strike(table.balls[0], scene.start(scene.shots[0]).velocity[0])
    return space, table


def test_a_break_at_sixty_frames_a_second(benchmark: Any) -> None:
    """The time is that of 600 frames, with sixteen balls and six pockets."""

    def play(space: pymunk.Space, table: Billiards) -> None:
        for _ in range(600):
            space.step(1 / 60)

    def fresh() -> tuple[tuple[pymunk.Space, Billiards], dict[str, Any]]:
        return eight_ball(), {}

    benchmark.pedantic(play, setup=fresh, rounds=REPEATS)
    space, table = eight_ball()
    began = time.perf_counter()
    play(space, table)
    benchmark.extra_info["ms_a_frame"] = (time.perf_counter() - began) * 1e3 / 600
    assert not table.moving


@pytest.mark.parametrize(("solver", "dt"), [("pymunk", 1 / 60), ("pymunk", 1 / 1000)])
@pytest.mark.parametrize("share", [0.04, 0.3, 0.6])
def test_how_it_grows_with_the_balls_that_move(
    benchmark: Any, share: float, solver: str, dt: float
) -> None:
    """All balls move from the start, and the exponent is that from 250 to 1,000 of them."""

    def seconds(count: int, **how: Any) -> float:
        return min(simulate(gas(count, share, 0.5), **how).wall_time for _ in range(3))

    def exponent(**how: Any) -> float:
        return math.log(seconds(1000, **how) / seconds(250, **how)) / math.log(4)

    benchmark.pedantic(partial(seconds, 1000, solver=solver, dt=dt), rounds=1)
    benchmark.extra_info["exponent"] = round(exponent(solver=solver, dt=dt), 2)
    benchmark.extra_info["event-driven"] = round(exponent(solver="event-driven"), 2)
