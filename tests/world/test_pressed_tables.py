"""Balls in persistent contact on a live table: saved and restored, moved, taken off, pushed."""

from __future__ import annotations

import math
from typing import Any

import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Billiards,
    Friction,
    Restitution,
    Scene,
    Shot,
    Table,
    same_balls,
    simulate,
)
from pool_pymunk.model import State
from pool_pymunk.world import TableBall
from tests.shared.worlds import M, R, fence

SIZE = 0.4  # m; the side of the table
STEPS = [1 / 30, 1 / 60, 1 / 240]


def corner(e: float = 0.0, **settings: Any) -> Billiards:
    """Return a square table of spheres with dull cushions."""
    settings = {"pair": same_balls(0.0, 0.05), **settings}
    table = Billiards(pymunk.Space(), 1 / 30, deceleration=2.0, rolling=0.1, **settings)
    fence(table, [(0.0, 0.0), (SIZE, 0.0), (SIZE, SIZE), (0.0, SIZE)], 0.0, e, 0.14)
    return table


def put(table: Billiards, x: float, y: float) -> TableBall:
    body = pymunk.Body(M, 1e-4)
    body.position = x, y
    return table.add_ball(pymunk.Circle(body, R))


def go(table: Billiards, dt: float = 1 / 60) -> None:
    """Make one step."""
    table.step(dt)


def settle(table: Billiards, dt: float = 1 / 60) -> dict[int, tuple[float, float]]:
    """Step until all balls rest, and return where they are."""
    for _ in range(round(20.0 / dt)):
        if not table.moving:
            break
        go(table, dt)
    assert not table.moving
    return {i: motion[:2] for i, motion in table.save_state().motions.items()}


def in_contact(table: Billiards) -> bool:
    """Tell whether a contact persists."""
    return any(ball.group is not None for ball in table.engine.balls)


def until_pressed(table: Billiards, dt: float = 1 / 60) -> None:
    """Step until a contact presses."""
    while not in_contact(table):
        assert table.moving
        go(table, dt)


def one_in_a_cushion(**settings: Any) -> Billiards:
    table = corner(**settings)
    table.strike(put(table, 0.2, 0.1), (1.0, 0.7), 1.5)
    return table


def two_that_press(**settings: Any) -> Billiards:
    """A ball follows another one, and its roll drives it on."""
    table = corner(**settings)
    first, _ = put(table, 0.1, 0.2), put(table, 0.1 + 2.0 * R, 0.205)
    table.strike(first, (0.4, 0.0), 3.0)
    return table


SETS = [one_in_a_cushion, two_that_press]


def farthest(ends: dict[int, Any], others: dict[int, Any]) -> float:
    assert ends.keys() == others.keys()
    return max(math.dist(ends[i], others[i]) for i in ends)


@pytest.mark.parametrize("dt", STEPS)
@pytest.mark.parametrize("build", SETS)
def test_a_state_of_a_contact_that_persists_goes_on_alike(build: Any, dt: float) -> None:
    untouched = settle(build(), dt)
    table, states = build(), []
    until_pressed(table, dt)
    while in_contact(table):
        states.append(table.save_state())
        go(table, dt)
    assert settle(table, dt) == untouched  # To look at balls changes nothing.
    for state in states[::4]:
        table.restore_state(state)
        assert table.save_state() == state
        assert farthest(settle(table, dt), untouched) < 2e-9


@pytest.mark.parametrize("r", [0.0286, 0.03, 0.0317])
def test_a_ball_at_rest_that_its_roll_drives_into_a_cushion_stays_out_of_it(r: float) -> None:
    """Rounding may leave the ball, which has no speed yet, on either side of the cushion."""
    balls, dull = (Ball("C", (1.0 - r, 0.1), r, M),), Restitution(1.0, cushion=0.0)
    scene = Scene(balls, Table.rectangle(1.0, 0.2), dull, Friction(0.2, rolling=0.01))
    start = State(((1.0 - r, 0.1),), ((0.0, 0.0),), frozenset(), ((0.1, 0.02),))
    run = simulate(scene, start=start, solver="event-driven")
    assert run.knots[0][:, 1].max() == pytest.approx(1.0 - r, abs=1e-10)


def test_a_table_whose_pair_fails_amid_a_contact_goes_on() -> None:
    fails: list[bool] = []

    def pair(i: int, j: int) -> Any:
        if fails and 2 in (i, j):
            raise KeyError("no pair")
        return same_balls(0.0, 0.05)(i, j)

    table = two_that_press(pair=pair)
    until_pressed(table)
    third = put(table, 0.3, 0.1)
    table.strike(third, (-1.0, 1.0))
    fails.append(True)
    with pytest.raises(KeyError):
        settle(table)
    fails.clear()
    settle(table)


@pytest.mark.parametrize("what", ["remove", "place", "strike", "pocket"])
def test_the_other_ball_goes_on_when_one_leaves_a_contact(what: str) -> None:
    table = two_that_press()
    until_pressed(table)
    one, other = table.balls
    before = table.save_state()
    if what == "remove":
        table.remove_ball(other)
    elif what == "place":
        table.place(other, (0.3, 0.3))
    elif what == "strike":
        table.strike(other, (2.0, 0.0))
    else:  # A pocket right ahead of the first ball takes it in.
        x, y = before.motions[1][:2]
        table.add_pocket((x + 0.021, y), 0.02)
    ends = settle(table)
    if what == "pocket":  # The pocket takes in the ball that goes on, too.
        assert not ends
        return
    assert one.is_on_table
    assert (1 in ends) == (what != "remove")
    assert ends[0][0] > before.motions[0][0] + 0.01


def test_a_ball_comes_to_rest_once_while_others_press_it() -> None:
    """A ball that balls and walls hold at rest does not set off and stop without end."""
    table, stops = corner(), []
    put(table, R, SIZE - R)
    table.strike(put(table, R, SIZE - 3.0 * R - 0.01), (0.0, 1.0), 3.0)
    table.on_stop = lambda ball, t: stops.append(ball.number)
    settle(table)
    assert stops.count(0) <= 2
    assert stops.count(1) == 1


@pytest.mark.filterwarnings("ignore:ball . hops")
@pytest.mark.parametrize("pull", [0.05, 0.5])
def test_gravity_and_forces_act_on_balls_that_press(pull: float) -> None:
    table = two_that_press()
    table.space.gravity = (0.0, -pull)
    for _ in range(600):
        for ball in table.on_table:
            ball.body.apply_force_at_world_point((0.01 * M, 0.0), ball.body.position)
        table.space.step(1 / 60)
    table.space.gravity = (0.0, 0.0)
    places = list(settle(table).values())
    assert math.dist(*places) > 2.0 * R * (1.0 - 1e-8)
    assert all(R * (1.0 - 1e-8) < z < SIZE - R * (1.0 - 1e-8) for place in places for z in place)


def test_an_aiming_line_follows_a_ball_that_is_pressed_to_a_cushion() -> None:
    table = corner()
    ball = put(table, 0.1, R)
    seen = table.predict(ball, (0.5, -1e-3), 1.0)
    assert max(x for x, _ in seen.way) > 0.3
    assert all(y == pytest.approx(R, abs=1e-4) for _, y in seen.way)


@pytest.mark.parametrize("dt", STEPS)
@pytest.mark.parametrize("e", [0.0, 0.7])
@pytest.mark.parametrize("outline", [Table.rectangle(0.6, 0.4), Table.circle(0.3)])
def test_steps_of_any_length_have_the_ends_of_no_steps(outline: Table, e: float, dt: float) -> None:
    places = [(0.0, 0.0), (2.0 * R, 0.003), (0.1, 0.08)]
    x, y = (0.3, 0.2) if outline == Table.rectangle(0.6, 0.4) else (0.3, 0.3)
    balls = tuple(Ball(str(k), (x + p, y + q), R, M) for k, (p, q) in enumerate(places))
    scene = Scene(
        balls, outline, Restitution(e, cushion=0.0), Friction(0.2, 0.1, 0.05, rolling=0.02),
        shots=(Shot("s", "0", speed=0.8, angle=10.0, roll=3.0),),
    )  # fmt: skip
    stepped = simulate(scene, solver="pymunk", dt=dt)
    whole = simulate(scene, solver="event-driven")
    assert (stepped.events, stepped.end) == (whole.events, whole.end)
