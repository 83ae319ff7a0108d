"""Shots in which a contact persists are handed back to the exact solver, and others are not."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shots import in_the_loop

from pool_pymunk import Ball, Friction, Restitution, Scene, Table, simulate_many
from pool_pymunk.fast import loop
from pool_pymunk.fast.persistent import (
    Place,
    are_held,
    balls_persist,
    is_held,
    parting_at,
    wall_persists,
)
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
IN_A_CORNER = scene_of(TABLE, Ball("1", (2.0 - r, 1.0 - r), r, 0.2))
ON_A_CIRCLE = scene_of(
    Table.circle(0.5), Ball("1", (0.5, r), r, 0.2, velocity=(0.6, 0.01)), e=0.1
)  # fmt: skip


@pytest.fixture
def few_hits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Play shots in Python, and fail where a shot has many hits, as those that come ever faster."""
    in_the_loop(monkeypatch)
    answer, start, rounds = loop.answer, loop.start, Counter[str]()

    def counted(*args: Any) -> bool:
        rounds["now"] += 1
        assert rounds["now"] < MOST, "the hits have no end"
        return answer(*args)

    def started(*args: Any) -> bool:
        rounds["now"] = 0
        return start(*args)

    monkeypatch.setattr(loop, "answer", counted)
    monkeypatch.setattr(loop, "start", started)


@pytest.mark.parametrize(
    ("scene", "roll"),
    [(HEAD_ON, [(0.5, 0.0), (-0.5, 0.0)]), (AT_A_CUSHION, [(0.2, 0.5)]), (AT_REST, [(0.0, 0.4)]),
     (IN_A_CORNER, [(0.4, 0.4)])],
)  # fmt: skip
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


def some_ball(rnd: random.Random, x: float, y: float, pull: float) -> Any:
    """Return a ball that slides or rolls, as the compiled loop has it."""
    vx, vy, wx, wy = (rnd.choice((0.0, rnd.uniform(-1.0, 1.0))) for _ in range(4))
    path = slide_or_roll(0.0, (x, y), (vx, vy), (wx, wy), pull, 0.05 * pull)
    return SimpleNamespace(**path._asdict(), roll=(path.slows, path.wx, path.wy), radius=r)


def test_what_parts_too_fast_for_the_strongest_pressing_never_persists() -> None:
    """The cheap test leaves out no contact that the rule would hold."""
    rnd, found = random.Random(1), Counter[str]()
    for _ in range(20_000):
        turn, pull, e = rnd.uniform(0.0, math.tau), rnd.uniform(0.1, 3.0), rnd.choice((0.0, 0.5))
        nx, ny = math.cos(turn), math.sin(turn)
        balls = [some_ball(rnd, d * nx, d * ny, pull) for d in (0.0, 2.0 * r)]
        w = SimpleNamespace(ball=balls, now=0.0, scene=SimpleNamespace(pull=pull))
        at, parting = Place((nx, ny), rnd.choice((0.0, -5.0, 5.0))), 10 ** rnd.uniform(-7.0, -4.0)
        if are_held(w, 0, 1, parting, e):
            assert balls_persist(w, 0, 1, parting, e)
            found["balls"] += 1
        if is_held(w, 0, at, parting, e):
            assert wall_persists(w, 0, at, parting, e)
            found["wall"] += 1
    assert min(found["balls"], found["wall"]) > 1_000
