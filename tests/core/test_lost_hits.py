"""No hit is lost around balls in persistent contact: none passes through another, or a cushion.

`data/lost_hits.json` has random scenes in which one did.
"""

from __future__ import annotations

import json
import math
import random
from typing import Any

import pytest

from pool_pymunk import Ball, Friction, Restitution, Scene, Table, simulate
from pool_pymunk.solvers.record import CONTACT_TOLERANCE
from tests import DATA
from tests.shared.scenes import seeds, takes_long
from tests.shared.small_tables import deepest, small_table

Point = tuple[float, float]

R = 0.03
SINKS = CONTACT_TOLERANCE / R  # radii; the error of a piece, which parabolas stand for
FOUND = json.loads((DATA / "lost_hits.json").read_text(encoding="utf-8"))
SLOWEST = "a collapse at a cushion draws in a ball that is held there"  # It takes 100 s.


def scene_of(found: Any) -> Scene:
    """Return a scene of the file."""
    balls = tuple(
        Ball(f"{k}", (x, y), R, mass, velocity=(vx, vy), roll=roll)
        for k, (x, y, vx, vy, roll, mass) in enumerate(found["balls"])
    )
    e, at_cushions = found["restitution"]
    surface, cushion, ball_ball, rolling = found["friction"]
    length, width = found["table"]
    table = Table.rectangle(length, width)
    if found.get("is_round"):
        table = Table.stadium(length, width) if length > width else Table.circle(width / 2.0)
    return Scene(
        balls, table, Restitution(e, cushion=at_cushions),
        Friction(surface, cushion, ball_ball, rolling=rolling),
    )  # fmt: skip


@pytest.mark.parametrize("away", [0.06, 0.08])
def test_a_ball_that_rests_in_a_group_is_hit_after_the_group(away: float) -> None:
    """The hit is predicted while ball 1 pushes ball 2 on to a cushion, and comes later or not."""
    balls = (
        Ball("1", (2.0 - 3.0 * R - 0.002, 0.5), R, 0.2, velocity=(1.0, 0.0), roll=1.0),
        Ball("2", (2.0 - R, 0.5), R, 0.2),
        Ball("3", (2.0 - R, 0.5 - 2.0 * R - away), R, 0.2, velocity=(0.0, 0.5)),
    )
    friction = Friction(0.2, 0.1, 0.05, rolling=0.01)
    scene = Scene(balls, Table.rectangle(2.0, 1.0), Restitution(0.0, cushion=0.0), friction)
    run = simulate(scene, solver="event-driven")
    met = {event.balls for event in run.events} | {contact.balls for contact in run.persistent}
    assert ("2", "3") in met
    assert deepest(run) < SINKS


@pytest.mark.parametrize(
    "found",
    [
        pytest.param(each, id=each["name"], marks=[takes_long] * (each["name"] == SLOWEST))
        for each in FOUND
    ],
)
def test_no_ball_passes_through_another_or_a_cushion(found: Any) -> None:
    run = simulate(scene_of(found), solver="event-driven")
    assert run.status == "settled"
    assert deepest(run) < SINKS


# -- random tables ---------------------------------------------------------------------------------


def place_of(rnd: random.Random, places: list[Point], table: Point) -> Point:
    """Return a random place: beside another ball, at a cushion, or anywhere."""
    width, height = table
    if places and rnd.random() < 0.45:
        (x, y), turn = rnd.choice(places), rnd.uniform(0.0, math.tau)
        away = 2.0 * R + rnd.choice((0.0, 0.0, 1e-9, 1e-6, 1e-3, 5e-3))
        return x + away * math.cos(turn), y + away * math.sin(turn)
    x, y = rnd.uniform(R, width - R), rnd.uniform(R, height - R)
    if rnd.random() < 0.45:
        return rnd.choice((R, width - R, x)), rnd.choice((R, height - R))
    return x, y


def velocity_of(rnd: random.Random, place: Point, others: list[Point]) -> Point:
    """Return a random velocity, often towards another ball."""
    speed, angle = 10 ** rnd.uniform(-2.0, 0.3), rnd.uniform(0.0, math.tau)
    if others and rnd.random() < 0.6:
        x, y = rnd.choice(others)
        angle = math.atan2(y - place[1], x - place[0]) + rnd.choice((0.0, rnd.uniform(-0.3, 0.3)))
    return speed * math.cos(angle), speed * math.sin(angle)


def random_table(seed: int) -> Scene:
    """Return a small table of balls that touch each other and cushions, and of others that move."""
    rnd, places = random.Random(f"lost {seed}"), list[Point]()
    count = rnd.choice((3, 4, 5, 6))
    table: Point = rnd.choice(((0.6, 0.4), (1.0, 0.6), (0.4, 0.3)))
    while len(places) < count:
        x, y = place_of(rnd, places, table)
        lies = R <= x <= table[0] - R and R <= y <= table[1] - R
        if lies and all(math.dist((x, y), other) >= 2.0 * R for other in places):
            places.append((x, y))
    balls = tuple(
        Ball(
            f"{k}", place, R, 0.2 * rnd.choice((1, 1, 1, 3)),
            velocity=velocity_of(rnd, place, places[:k]) if rnd.random() < 0.6 else (0.0, 0.0),
            roll=rnd.choice((0.0, 0.0, 1.0, 1.0, -1.0, 2.0)),
        )
        for k, place in enumerate(places)
    )  # fmt: skip
    e, at_cushions = rnd.choice((0.0, 0.3, 0.7, 0.9, 0.95)), rnd.choice((0.0, 0.0, 0.3, 0.7, 0.9))
    friction = Friction(
        rnd.choice((0.1, 0.2, 0.5)), rnd.choice((0.0, 0.1, 0.3)), rnd.choice((0.0, 0.05, 0.2)),
        rolling=rnd.choice((0.01, 0.02, 0.05)),
    )  # fmt: skip
    return Scene(balls, Table.rectangle(*table), Restitution(e, cushion=at_cushions), friction)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1041, 1320])
def test_a_ball_that_its_neighbours_hold_does_not_stop_again_and_again(seed: int) -> None:
    """Another ball slides along it and presses, but it cannot leave its place."""
    run = simulate(random_table(seed), solver="event-driven")
    stops = {(event.balls, round(event.t, 4)) for event in run.events if event.kind == "stop"}
    assert len(stops) <= 4 * len(run.scene.balls)
    assert deepest(run) < 1e-7  # the contact tolerance


@takes_long
@pytest.mark.slow
@pytest.mark.seeded
def test_no_hit_is_lost_on_random_tables() -> None:
    """Where friction jams, balls have no forces for a moment, and may sink in a little."""
    numbers = seeds(40)
    found = [deepest(simulate(random_table(seed), solver="event-driven")) for seed in numbers]
    assert max(found) < 1e-2
    assert sum(depth > SINKS for depth in found) <= len(found) / 50 + 1


# A ball rolls from a cushion on to an arc, or its friction leads it from an arc to a cushion;
# another one hits it while a contact waits; it meets a cushion again after many hits.
@takes_long
@pytest.mark.slow
@pytest.mark.parametrize("seed", [102, 4956, 5442, 5868, 7820, 20366])
def test_no_hit_is_lost_at_arcs(seed: int) -> None:
    assert deepest(simulate(small_table(seed), solver="event-driven")) < SINKS


@takes_long
@pytest.mark.slow
@pytest.mark.seeded
def test_no_hit_is_lost_on_tables_with_arcs_and_posts() -> None:
    found = [deepest(simulate(small_table(seed), solver="event-driven")) for seed in seeds(40)]
    assert max(found) < SINKS
