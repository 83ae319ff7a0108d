"""The figure of a run covers what rounding did to its ends, and is not much too large."""

from __future__ import annotations

import json
import math
import random
import statistics
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from typing import Any

import pytest
from mpmath import mp, mpf
from oracle import reference
from scenes import BASE_SEED, DATA, share_of

from pool_pymunk import Ball, Friction, Physics, Restitution, Run, Scene, Table, simulate
from pool_pymunk.studies.changes import rounding

SCENES = 40
MOST_TOO_LARGE = 30.0  # in the median


def shot(
    rng: random.Random,
    across: float,
    *,
    e: float = 0.9,
    friction: float = 0.0,
    far: float = 0.0,
    distance: float = 1.0,
    max_time: float = 3.0,
    mass: float = 0.2,
) -> Scene:
    """Return a ball that meets another ``across`` of the contact distance off the line."""
    turn, side, speed = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(0.5, 3.0)
    u, r = (math.cos(turn), math.sin(turn)), (rng.uniform(0.02, 0.07), rng.uniform(0.02, 0.07))
    x, y = far * math.cos(side), far * math.sin(side)
    off = across * (r[0] + r[1])
    balls = (
        Ball("a", (x, y), r[0], 0.2, velocity=(speed * u[0], speed * u[1])),
        Ball("b", (x + u[0] * distance - u[1] * off, y + u[1] * distance + u[0] * off), r[1], mass),
    )
    return Scene(balls, None, Restitution(e), Friction(0.0, 0.0, friction),
                 Physics(max_time=max_time + distance / speed))  # fmt: skip


def along_a_cushion(rng: random.Random) -> Scene:
    slope = 10 ** rng.uniform(-8, -1)
    ball = Ball("a", (0.2, 0.05 + slope), 0.05, 0.2, velocity=(1.0, -slope))
    return Scene((ball,), Table.rectangle(4.0, 1.0), Restitution(cushion=rng.uniform(0.3, 1.0)),
                 physics=Physics(max_time=2.0))  # fmt: skip


def past_a_corner(rng: random.Random) -> Scene:
    outline = ((0.0, 0.0), (2.0, 0.0), (2.0, 0.8), (0.9, 0.8), (0.9, 1.7), (0.0, 1.7))
    x = 0.9 + rng.uniform(-0.04, 0.0)
    ball = Ball("a", (x, 0.3), 0.05, 0.2, velocity=(0.0, rng.uniform(0.5, 1.0)))
    return Scene((ball,), Table(outline), Restitution(cushion=0.9), physics=Physics(max_time=2.0))


def into_a_round_corner(rng: random.Random) -> Scene:
    """Return a ball that comes into a corner whose arc is hardly wider than the ball."""
    wider, turn, speed = 10 ** rng.uniform(-5, -4), rng.uniform(-3, 3), rng.uniform(0.5, 2.0)
    c, x, y = 0.02 + wider, rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.4)
    outline = ((c, 0.0), (1.0 - c, 0.0), (1.0, c), (1.0, 0.5 - c),
               (1.0 - c, 0.5), (c, 0.5), (0.0, 0.5 - c), (0.0, c))  # fmt: skip
    table = Table(outline, (0.0, math.tan(math.pi / 8.0)) * 4)
    aside = wider * rng.uniform(0.0, 0.9)
    dx, dy = c + aside * math.cos(turn) - x, c + aside * math.sin(turn) - y
    distance = math.hypot(dx, dy)
    ball = Ball("a", (x, y), 0.02, 0.2, velocity=(speed * dx / distance, speed * dy / distance))
    return Scene((ball,), table, Restitution(cushion=rng.uniform(0.6, 1.0)),
                 physics=Physics(max_time=1.3 * distance / speed))  # fmt: skip


CLASSES: dict[str, Callable[[random.Random], Scene]] = {
    "a hit": lambda rng: shot(rng, rng.uniform(-0.9, 0.9)),
    "with friction": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), friction=0.2),
    "far away": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), far=10 ** rng.uniform(1, 6)),
    "a long distance": lambda rng: shot(
        rng, rng.uniform(-0.8, 0.8), distance=10 ** rng.uniform(1, 4)
    ),
    "a graze": lambda rng: shot(rng, 1.0 - 10 ** rng.uniform(-10, -1)),
    "nearly plastic": lambda rng: shot(
        rng, 0.0, e=10 ** rng.uniform(-16, -1), max_time=10 ** rng.uniform(1, 6)
    ),
    "unequal": lambda rng: shot(rng, rng.uniform(-0.9, 0.9), mass=10 ** rng.uniform(-5, 3)),
    "along a cushion": along_a_cushion,
    "past a corner": past_a_corner,
    "into a round corner": into_a_round_corner,
}


def error(run: Run, final: Iterable[Any]) -> float:
    """Return how far (m) a run's ends lie off the true ones."""
    with mp.workdps(reference.DIGITS):
        ends = zip(run.end.position, final, strict=True)
        return max(float(mp.hypot(p[0] - mpf(x), p[1] - mpf(y))) for p, (x, y) in ends)


def covers(runs: Iterable[tuple[Run, Iterable[Any]]], most: float = MOST_TOO_LARGE) -> None:
    """Check the figures of some runs against their true ends: they are not much too large."""
    too_large = []
    for run, final in runs:
        off, figure = error(run, final), rounding(run)
        if run.persistent:  # What is left out there is far more than rounding.
            assert run.policy_shift is not None
            figure = run.persistent_shift + run.policy_shift
        assert off <= figure
        if off > 0.0:
            too_large.append(figure / off)
    assert statistics.median(too_large) <= most


@pytest.mark.parametrize("name", CLASSES)
def test_the_figure_covers_what_rounding_did(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    scenes = [CLASSES[name](random.Random(f"{name} {k}")) for k in range(SCENES)]
    runs = [simulate(scene, solver="event-driven") for scene in scenes]
    covers((run, reference.reference_run(run.scene).final) for run in runs)


# -- balls that roll -------------------------------------------------------------------------------


def rolling(scene: Scene, rng: random.Random) -> Scene:
    """Return the scene with balls that slide, then roll, some of them without end."""
    rolls = [rng.choice((0.0, 1.0, rng.uniform(-2.0, 2.0))) for _ in scene.balls]
    balls = [replace(ball, roll=roll) for ball, roll in zip(scene.balls, rolls, strict=True)]
    friction = replace(scene.friction, surface=0.2, rolling=rng.choice((0.0, 0.01, 0.1)))
    limit = replace(scene.physics, max_time=min(scene.physics.max_time or 50.0, 50.0))
    return replace(scene, balls=tuple(balls), friction=friction, physics=limit)


@pytest.mark.parametrize("name", [name for name in CLASSES if name != "nearly plastic"])
def test_the_figure_covers_it_where_balls_roll(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Balls that hardly bounce are held together by their rolls, which has no exact answer."""
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    numbers = [random.Random(f"{name} {k}") for k in range(SCENES // 2)]
    runs = [simulate(rolling(CLASSES[name](rng), rng), solver="event-driven") for rng in numbers]
    answered = []
    for run in runs:
        with suppress(reference.Refused):
            answered.append((run, reference.reference_run(run.scene).final))
    assert len(answered) >= SCENES // 3
    covers(answered, 2.0 * MOST_TOO_LARGE)


def test_the_figure_covers_it_in_random_scenes_where_balls_roll() -> None:
    known = json.loads((DATA / "rolling_runs.json").read_text(encoding="utf-8"))
    runs = [simulate(reference.scene_from_dict(each["scene"]), solver="event-driven")
            for each in known]  # fmt: skip
    covers((run, each["run"]["final"]) for run, each in zip(runs, known, strict=True))


@pytest.mark.slow
@pytest.mark.seeded
def test_the_figure_covers_it_in_two_hundred_fresh_scenes_where_balls_roll() -> None:
    """Of a share of them the median may be larger, as 32 draws of signs are right to 12 %."""
    fresh = islice(reference.fresh_scenes("rolling", BASE_SEED), share_of(200))
    runs = ((simulate(scene, solver="event-driven"), known["final"]) for scene, known in fresh)
    covers(runs, 1.12 * MOST_TOO_LARGE)


# -- long runs -------------------------------------------------------------------------------------


def folded(place: Fraction, low: Fraction, high: Fraction) -> Fraction:
    """Return where a ball is between two cushions, from where it would be without them."""
    distance = (place - low) % (2 * (high - low))
    return low + min(distance, 2 * (high - low) - distance)


@pytest.mark.parametrize("slope", [0.0, 0.7])
def test_the_errors_of_like_contacts_add_up(slope: float) -> None:
    """A ball between cushions, without any loss: its end is a rational number."""
    ball = Ball("a", (0.3, 0.4), 0.05, 0.2, velocity=(1.1, 1.1 * slope))
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), Restitution(cushion=1.0),
                  physics=Physics(max_time=4_000.0))  # fmt: skip
    run, r = simulate(scene, solver="event-driven"), Fraction(0.05)
    distances = [Fraction(p) + 4_000 * Fraction(v)
            for p, v in zip(ball.position, ball.velocity, strict=True)]  # fmt: skip
    truth = [
        folded(distance, r, side - r) for distance, side in zip(distances, (2, 1), strict=True)
    ]
    ends = zip(run.end.position[0], truth, strict=True)
    off = math.hypot(*(float(Fraction(p) - q) for p, q in ends))
    assert off <= run.rounding <= 100.0 * off


def test_chaos_is_as_large_as_the_table_and_soon_known() -> None:
    """Ten balls without any loss: after some dozen contacts nothing is known of them."""
    balls = tuple(
        Ball(str(k), (0.2 + 0.36 * (k % 5), 0.3 + 0.4 * (k // 5)), 0.05, 0.2,
             velocity=(math.cos(2.4 * k), math.sin(2.4 * k)))
        for k in range(10)
    )  # fmt: skip
    scene = Scene(balls, Table.rectangle(2.0, 1.0), Restitution(1.0, cushion=1.0),
                  physics=Physics(max_time=1e6))  # fmt: skip
    run = simulate(scene, solver="event-driven", max_events=3_000)
    assert run.rounding == math.hypot(2.0, 1.0)


def test_the_figure_of_a_long_run_takes_no_longer_than_fifteen_such_runs() -> None:
    ball = Ball("a", (0.3, 0.4), 0.05, 0.2, velocity=(1.1, 0.7))
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), Restitution(cushion=1.0),
                  physics=Physics(max_time=1e6))  # fmt: skip
    began = time.process_time()
    run = simulate(scene, solver="event-driven", max_events=5_000)
    played = time.process_time()
    assert 0.0 < run.rounding < 1e-6
    assert time.process_time() - played < 15.0 * (played - began)  # It takes some seven.
