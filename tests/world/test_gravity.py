"""Gravity of a space: balls of a live table fall on parabolas, whatever the steps are."""

from __future__ import annotations

import math
import random
from itertools import combinations, pairwise
from typing import Any

import pymunk
import pytest

from pool_pymunk import (
    Ball,
    Billiards,
    Physics,
    Restitution,
    Scene,
    SettingError,
    Table,
    same_balls,
    simulate,
)
from pool_pymunk.world import TableBall, TableState

G, R, STEP = 9.80665, 0.03, 1 / 60


def upright(e: float = 0.6, mu: float = 0.0, width: float = 2.0, **more: Any) -> Billiards:
    """Return a table with a floor and two walls, in a space with gravity."""
    space = pymunk.Space()
    space.gravity = (0.0, -G)
    table = Billiards(space, STEP, pair=same_balls(e, mu), **more)
    ground = space.static_body
    for a, b in (((0, 0), (width, 0)), ((0, 0), (0, 9)), ((width, 0), (width, 9))):
        table.add_wall(pymunk.Segment(ground, a, b, 0.0), e, mu)
    return table


def test_the_line_of_a_ball_that_will_fall_is_a_curve() -> None:
    table = upright()
    ball = put(table, 0.2, 1.0)
    found = table.predict(ball, (1.0, 2.0))
    assert found.where is not None and found.wall == 0
    before = found.way[: found.way.index(found.where) + 1]
    for x, y in before:
        t = x - 0.2
        assert y == pytest.approx(1.0 + 2.0 * t - G * t * t / 2.0, abs=1e-12)
    middles = (((a + c) / 2, (b + d) / 2) for (a, b), (c, d) in pairwise(before))
    assert (
        max(abs(1.0 + 2.0 * (x - 0.2) - G * (x - 0.2) ** 2 / 2.0 - y) for x, y in middles) < R / 50
    )


def lift_in(table: Billiards, y: float, e: float = 0.0) -> pymunk.Body:
    """Return the body of a floor at a height (m) that could move, with restitution ``e``."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    body.position = (1.0, y)
    table.space.add(body)
    table.add_wall(pymunk.Segment(body, (-0.5, 0.0), (0.5, 0.0), 0.0), e)
    return body


def put(table: Billiards, x: float, y: float, velocity: tuple[float, float] = (0, 0)) -> TableBall:
    body = pymunk.Body(0.2, math.inf)
    body.position, body.velocity = (x, y), velocity
    return table.add_ball(pymunk.Circle(body, R))


@pytest.mark.parametrize("e", [0.5, 0.8, 0.95, 1.0])
def test_ten_apexes_at_60_frames_a_second_are_those_of_the_closed_form(e: float) -> None:
    table = upright(e)
    ball, hits = put(table, 1.0, R + 2.0), list[float]()
    table.on_contact = lambda contact: hits.append(contact.t)
    places: list[tuple[float, float]] = []
    while len(hits) < 11 and table.time < 20.0:
        table.step()
        (_, y), (_, v) = ball.body.position, ball.body.velocity
        places.append((table.time, y - R + v * abs(v) / (2 * G) if v > 0 else -1.0))
    for k in range(10):
        between = [top for t, top in places if hits[k] < t < hits[k + 1] and top >= 0.0]
        for top in between:  # As it rises, the apex is y + v^2 / (2 g).
            assert top == pytest.approx(2.0 * e ** (2 * (k + 1)), abs=1e-9)
    assert len(hits) >= 11


def test_a_ball_rests_when_its_bounces_have_an_end_and_does_not_move_again() -> None:
    table, stops, e, h = upright(0.8), list[float](), 0.8, 0.5
    ball = put(table, 1.0, R + h)
    table.on_stop = lambda _, t: stops.append(t)
    for _ in range(240):
        table.step()
    assert stops == [pytest.approx((1 + e) / (1 - e) * math.sqrt(2 * h / G), abs=1e-9)]
    assert table.moving == {}
    assert ball.body.position == pytest.approx((1.0, R), abs=1e-12)
    assert tuple(ball.body.velocity) == (0.0, 0.0)


def test_a_live_table_has_the_bits_of_event_driven_whatever_the_steps() -> None:
    scene = Scene(
        (Ball("a", (0.5, 1.0), R, 0.2, velocity=(1.0, 0.0)), Ball("b", (0.9, 1.5), R, 0.2)),
        Table.rectangle(2.0, 3.0, tilt=(0.5, -G)), Restitution(0.9, None, 0.8),
        physics=Physics(max_time=1.5),
    )  # fmt: skip
    exact = simulate(scene, solver="event-driven")
    for dt in (1 / 60, 1 / 240):
        run = simulate(scene, solver="pymunk", dt=dt)
        assert run.end.position == exact.end.position
        assert [event.t for event in run.events] == [event.t for event in exact.events]


def test_fifty_balls_come_to_rest_in_a_box_and_none_lies_in_another() -> None:
    table = upright(width=0.6)
    for k in range(50):
        put(table, 0.09 + 0.08 * (k % 6) + 0.001 * (k % 7), 0.2 + 0.1 * (k // 6))
    while table.moving and table.time < 10.0:
        table.step()
        assert narrowest_of(table) >= -1e-9 * R, table.time
    assert table.moving == {}


def test_balls_that_land_together_bounce_as_high_as_anywhere() -> None:
    table, e, h, shelf = upright(0.6), 0.6, 0.2, 3.0
    table.add_wall(pymunk.Segment(table.space.static_body, (0, shelf), (2, shelf), 0.0), e)
    balls = [put(table, 0.3 + 2.01 * R * k, shelf + R + h) for k in range(12)]
    tops, lands = [0.0] * len(balls), math.sqrt(2 * h / G)
    while table.time < lands * (1 + 1.9 * e):
        table.step()
        if table.time > lands + STEP:
            heights = [ball.body.position.y - shelf - R for ball in balls]
            tops = [max(top, height) for top, height in zip(tops, heights, strict=True)]
    assert tops == [pytest.approx(e * e * h, rel=0.02)] * len(balls)  # They are a crowd.


def narrowest_of(table: Billiards) -> float:
    """Return the narrowest gap (m) in a box that is 0.6 m wide."""
    places = [tuple(ball.body.position) for ball in table.balls]
    gaps = [math.dist(p, q) - 2 * R for p, q in combinations(places, 2)]
    return min(*gaps, *[min(x, 0.6 - x, y) - R for x, y in places])


@pytest.mark.parametrize("seed", range(4))
def test_a_random_pile_of_twelve_comes_to_rest(seed: int) -> None:
    rnd, table = random.Random(seed), upright(0.5, mu=0.05)
    for k in range(12):
        put(table, 0.8 + 0.09 * (k % 4) + 0.01 * rnd.random(), 1.0 + 0.2 * (k // 4))
    table.play(latest=15.0)
    assert table.moving == {}
    places = [tuple(ball.body.position) for ball in table.balls]
    assert min(math.dist(p, q) - 2 * R for p, q in combinations(places, 2)) >= -1e-5 * R


def test_gravity_may_change_and_balls_go_on_from_where_they_are() -> None:
    table = upright(1.0)
    ball = put(table, 1.0, 4.0)
    for _ in range(30):
        table.step()
    v = -G * 0.5
    assert ball.body.velocity.y == pytest.approx(v, abs=1e-12)
    table.space.gravity = (0.0, 0.0)
    for _ in range(6):
        table.step()
    assert ball.body.position.y == pytest.approx(4.0 - G * 0.125 + v * 0.1, abs=1e-12)
    table.space.gravity = (1.0, 0.0)
    for _ in range(6):
        table.step()
    assert ball.body.position.x == pytest.approx(1.0 + 0.5 * 0.1**2, abs=1e-12)
    assert ball.body.velocity.y == pytest.approx(v, abs=1e-12)


def test_what_holds_a_ball_may_be_taken_away() -> None:
    table = upright()
    shelf = table.add_wall(pymunk.Segment(table.space.static_body, (0.5, 1), (1.5, 1), 0.0), 0.5)
    ball = put(table, 1.0, 1.0 + R)
    table.step()
    assert table.moving == {}
    table.remove_wall(shelf)
    for _ in range(12):
        table.step()
    assert ball.body.position.y == pytest.approx(1.0 + R - 0.5 * G * 0.2**2, abs=1e-12)


def test_play_ends_when_what_falls_can_meet_nothing_any_more() -> None:
    table = upright(1.0, width=0.5)
    put(table, 0.25, 1.0)
    put(table, 3.0, 1.0)  # It falls beside the floor.
    table.remove_ball(table.balls[0])
    table.play()
    assert table.time == 0.0 and [*table.moving] == [1]
    table.play(latest=0.5)
    assert table.balls[1].body.position.y == pytest.approx(1.0 - 0.125 * G, abs=1e-12)


def test_a_ball_under_others_may_be_taken_away() -> None:
    table = upright()
    low, high = put(table, 1.0, R), put(table, 1.0, 3 * R)
    table.step()
    assert table.moving == {}
    table.remove_ball(low)
    while table.moving or table.time < 0.1:
        table.step()
    assert high.body.position.y == pytest.approx(R, abs=1e-12)


def test_a_wall_that_moves_lifts_a_ball() -> None:
    table = upright(0.0)
    lift = lift_in(table, 0.5)
    ball = put(table, 1.0, 0.5 + R)
    lift.velocity = (0.0, 0.3)
    for _ in range(60):
        table.step()
    assert ball.body.position.y == pytest.approx(0.8 + R, abs=1e-7)


def test_a_ball_on_a_wall_that_could_move_stops_once() -> None:
    table, stops = upright(0.0), list[float]()
    lift_in(table, 0.5)
    put(table, 1.0, 0.6 + R)
    table.on_stop = lambda _, t: stops.append(t)
    for _ in range(60):
        table.step()
    assert stops == [pytest.approx(math.sqrt(0.2 / G), abs=1e-12)]


def test_a_ball_that_rides_on_a_lift_is_moving() -> None:
    table = upright(0.0)
    lift = lift_in(table, 0.5)
    put(table, 1.0, 0.5 + R)
    table.step()
    assert table.moving == {}
    lift.velocity = (0.0, 0.6)
    table.step()
    assert list(table.moving) == [0]
    lift.velocity = (0.0, 0.0)
    for _ in range(30):
        table.step()
    assert table.moving == {}


@pytest.mark.parametrize("dt", [1 / 60, 1 / 120])
@pytest.mark.parametrize(("drop", "rises"), [(1.0, 0.0), (3.0, 0.0), (2.0, 1.5), (2.0, -1.0)])
def test_a_wall_that_could_move_is_hit_when_it_should(dt: float, drop: float, rises: float) -> None:
    """However fast a ball has become that was dropped from rest."""
    table, hits = upright(0.8), list[float]()
    lift_in(table, 1.0, 0.8).velocity = (0.0, rises)
    put(table, 1.0, 1.0 + R + drop)
    table.on_contact = lambda contact: hits.append(contact.t)
    while not hits and table.time < 2.0:
        table.space.step(dt)
    root = math.sqrt(rises * rises + 2.0 * G * drop)
    assert hits == [pytest.approx((root - rises) / G, abs=1e-12)]


def test_a_saved_state_goes_on_as_it_did() -> None:
    table = upright(0.9)
    balls = [put(table, 0.5, 1.0, (1.0, 0.0)), put(table, 0.9, 1.5)]
    for _ in range(20):
        table.step()
    saved = table.save_state()
    ends = []
    for _ in range(2):
        table.restore_state(saved)
        for _ in range(30):
            table.step()
        ends.append([x for ball in balls for x in ball.body.position])
    assert ends[0] == pytest.approx(ends[1], abs=1e-13)  # The clock has other roundings.


@pytest.mark.parametrize("height", [0.05, 0.0])
def test_a_saved_state_has_the_bounces_that_cannot_be_seen(height: float) -> None:
    """The last ones of the upper of two balls, or of a lone one, last on when it is loaded."""
    table, stops = upright(0.6), list[float]()
    put(table, 1.0, R + height)
    if height == 0.0:
        put(table, 1.0, 3 * R + 0.05)
    table.on_stop = lambda _, t: stops.append(t)
    table.play(latest=0.4 if height else 0.11)
    while not (bounces := table.save_state().bounces):
        table.step(1e-4)
    saved = TableState.from_json(table.save_state().to_json())
    assert min(bounces.values()) > 0.0 and saved.bounces == bounces
    table.play(latest=9.0)
    first, ends = stops.copy(), [tuple(ball.body.position) for ball in table.balls]
    stops.clear()
    table.restore_state(saved)
    table.play(latest=9.0)
    assert stops == pytest.approx(first[-len(stops) :], abs=1e-12)
    assert [tuple(ball.body.position) for ball in table.balls] == ends


def test_bounces_that_cannot_be_seen_last_on_when_a_wall_comes() -> None:
    """All groups are taken apart then, and form anew."""
    stops = list[float]()
    for more in (False, True):
        table = upright(0.6)
        put(table, 1.0, R + 0.05)
        table.on_stop = lambda _, t: stops.append(t)
        table.play(latest=0.4)
        while not table.save_state().bounces:
            table.step(1e-4)
        if more:
            table.add_wall(pymunk.Segment(table.space.static_body, (0, 2), (2, 2), 0.0), 0.5)
        table.play(latest=9.0)
    assert stops[0] == pytest.approx(stops[1], abs=1e-12)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_a_table_with_friction_warns_once_that_balls_hop(e: float) -> None:
    table = upright(e, deceleration=0.5)
    put(table, 0.5, 0.5), put(table, 1.5, 0.1)
    with pytest.warns(UserWarning, match="ball 1 hops at .* and will not rest") as found:
        for _ in range(240):
            table.step()
    assert len(found) == 1 and found[0].filename.endswith(("billiards.py", "test_gravity.py"))
    assert table.moving


@pytest.mark.parametrize("deceleration", [0.5, 9.0, 20.0])
def test_what_flies_or_is_held_does_not_hop(deceleration: float) -> None:
    """Up and down along a wall, and at rest where friction holds it; a warning is an error."""
    table = upright(deceleration=deceleration)
    for x in (R, 1.0):
        put(table, x, 3.0, (0.0, 4.0))
    while table.balls[0].body.position.y > 0.5 and table.time < 2.0:
        table.step()


def test_predict_follows_a_parabola() -> None:
    table = upright()
    ball, fall = put(table, 0.5, 1.0), math.sqrt(2 * (1.0 - R) / G)
    seen = table.predict(ball, (1.0, 0.0))
    assert (seen.wall, seen.met) == (0, None)
    assert seen.t == pytest.approx(fall, abs=1e-12)
    assert seen.where == pytest.approx((0.5 + fall, R), abs=1e-12)
    other = put(table, 0.5 + fall, R)  # It lies where the ball would fall.
    assert table.predict(ball, (1.0, 0.0)).met is other


def test_pymunks_other_bodies_still_push_what_falls() -> None:
    """A force that holds the ball acts at the end of each step: the ball sinks at g dt/2."""
    table = upright()
    ball, count = put(table, 1.0, 2.0), 12
    for _ in range(count):
        ball.body.apply_force_at_local_point((0.0, 0.2 * G))
        table.step()
    assert ball.body.velocity.y == pytest.approx(0.0, abs=1e-12)
    assert ball.body.position.y == pytest.approx(2.0 - count * G * STEP**2 / 2.0, abs=1e-12)


def test_friction_pushes_are_as_before_and_patches_with_friction_are_refused() -> None:
    slides = upright(deceleration=0.5)
    assert slides.deceleration == 0.5
    table = upright()
    assert table.deceleration == 0.0
    square = pymunk.Poly(table.space.static_body, [(0, 0), (1, 0), (1, 1), (0, 1)])
    with pytest.raises(SettingError, match="no closed form"):
        table.add_patch(square, 0.3)


def test_a_table_with_gravity_is_a_scene_with_a_tilt() -> None:
    table = upright(0.8)
    put(table, 0.5, 1.0)
    table.step()
    scene, state = table.to_scene(Table.rectangle(2.0, 9.0))
    assert scene.tilt == (0.0, -G)
    assert state.velocity[0] == pytest.approx((0.0, -G * STEP), abs=1e-15)
