"""Shots in which a contact persists are handed back to the exact solver, and others are not."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shots import in_the_loop

from pool_pymunk import Ball, Friction, Restitution, Scene, Table, simulate_many
from pool_pymunk.fast import loop
from pool_pymunk.fast.persistent import is_slow, parting_at
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.persistent import persists, pressing_of_balls, pressing_of_wall
from pool_pymunk.physics.surface import slide_or_roll

r = 0.03
MOST = 10  # hits of a shot, beside those that come ever faster; 6 were found
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
ON_A_CIRCLE = scene_of(
    Table.circle(0.5), Ball("1", (0.5, r), r, 0.2, velocity=(0.6, 0.01)), e=0.1
)  # fmt: skip


@pytest.fixture
def few_hits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Play shots in Python, and fail where a shot has many hits, as those that come ever faster."""
    in_the_loop(monkeypatch)
    predict, start, hits = loop.predict, loop.start, Counter[str]()

    def counted(*args: Any) -> None:
        hits["now"] += 1
        assert hits["now"] < MOST, "the hits have no end"
        predict(*args)

    def started(*args: Any) -> bool:
        hits["now"] = 0
        return start(*args)

    monkeypatch.setattr(loop, "predict", counted)
    monkeypatch.setattr(loop, "start", started)


@pytest.mark.parametrize(
    ("scene", "roll"),
    [(HEAD_ON, [(0.5, 0.0), (-0.5, 0.0)]), (AT_A_CUSHION, [(0.2, 0.5)]), (AT_REST, [(0.0, 0.4)])],
)
def test_a_roll_presses_balls_together_and_to_a_cushion(
    scene: Scene, roll: Any, few_hits: None
) -> None:
    """Balls whose rolls pull them apart, or that only slide, are compiled."""
    rolls = np.array([roll, np.zeros_like(roll), -np.array(roll)])
    batch = simulate_many(scene, roll=rolls)
    assert batch.handed_back.tolist() == [True, False, False]
    assert batch.by_reference == 1
    slides = replace(scene, friction=replace(scene.friction, rolling=None))
    assert simulate_many(slides).by_reference == 0


@pytest.mark.parametrize("rolling", [None, 0.01])
def test_an_arc_presses_on_a_ball_that_runs_along_it(
    rolling: float | None, few_hits: None
) -> None:  # fmt: skip
    scene = replace(ON_A_CIRCLE, friction=replace(ON_A_CIRCLE.friction, rolling=rolling))
    batch = simulate_many(scene, vary={"restitution.cushion": [0.1]}, max_time=0.3)
    assert batch.handed_back.tolist() == [True]


def test_hits_on_an_arc_that_keep_all_speed_do_not_converge(few_hits: None) -> None:
    scene = replace(ON_A_CIRCLE, friction=Friction(0.2))
    batch = simulate_many(scene, vary={"restitution.cushion": [1.0]}, max_time=0.3)
    assert batch.handed_back.tolist() == [False]


@pytest.mark.parametrize("parting", [-2e-9, 0.0, 2e-9])
def test_what_is_noise_is_no_parting(parting: float) -> None:
    assert parting_at(-parting, 1e-9) == parting
    assert parting_at(-parting, 3e-9) == 0.0


def some_path(rnd: random.Random, place: tuple[float, float], pull: float) -> Path:
    """Return the path of a ball that slides, or rolls."""
    vx, vy, wx, wy = (rnd.choice((0.0, rnd.uniform(-1.0, 1.0))) for _ in range(4))
    return slide_or_roll(0.0, place, (vx, vy), (wx, wy), pull, 0.05 * pull)


def test_what_parts_faster_than_the_strongest_pressing_allows_never_persists() -> None:
    """The bound is met: some contacts persist that part nearly as fast."""
    rnd, most = random.Random(1), 0.0
    for _ in range(20_000):
        turn, pull, e = rnd.uniform(0.0, math.tau), rnd.uniform(0.5, 3.0), rnd.choice((0.0, 0.5))
        across, bends = (math.cos(turn), math.sin(turn)), rnd.choice((0.0, -2.0, 5.0))
        a = some_path(rnd, (0.0, 0.0), pull)
        b = some_path(rnd, (2.0 * r * across[0], 2.0 * r * across[1]), pull)
        limit, speed = 2.0 * pull, math.sqrt(a.vx * a.vx + a.vy * a.vy)
        parting = 10 ** rnd.uniform(-6.0, -3.0)
        for pressing, strongest in (
            (pressing_of_balls(a, b, 0.0), limit),
            (pressing_of_wall(a, across, bends, 0.0), pull + abs(bends) * speed * speed),
        ):
            if persists(parting, pressing, e, r):
                assert is_slow(parting, strongest, r)
            most = max(most, pressing / strongest)
    assert most > 0.9
