"""Steps of any lengths in a shared space lead to the same ends, and what others do is noticed."""

from __future__ import annotations

import itertools
import math
import random
import time
from collections.abc import Callable, Iterator
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards
from tests.shared.worlds import PAIR, A, M, R, ball, hexagon, plane

LONGEST = 0.05  # s; the longest step


def uneven(seed: int) -> Iterator[float]:
    """Return steps (s) of all lengths from 1e-9 s on; half of them are longer than 1e-3 s."""
    rnd = random.Random(seed)
    while True:
        least = rnd.choice([1e-9, 1e-3])
        yield math.exp(rnd.uniform(math.log(least), math.log(LONGEST)))


STEPS: dict[str, Callable[[], Iterator[float]]] = {
    "1/1000": lambda: itertools.repeat(1 / 1000),
    "every other 1e-5": lambda: itertools.cycle([1 / 60, 1e-5]),
    "every other 1e-9": lambda: itertools.cycle([1 / 60, 1e-9]),
    "in groups": lambda: itertools.cycle([1 / 60] * 5 + [1 / 90] * 5),
    "random 1": lambda: uneven(1),
    "random 2": lambda: uneven(2),
}
every_step = pytest.mark.parametrize("steps", STEPS)


def ends(steps: Iterator[float], x: float, spring: bool = False, **settings: Any) -> list[Any]:
    """Return where balls end that meet walls and each other near ``x`` (m), and when they stop."""
    space, table = hexagon(x=x, max_dt=LONGEST, **settings)
    table.add_wall(pymunk.Circle(space.static_body, 0.1, (x + 0.3, 0.1)), 0.9, 0.1)
    if spring:
        weight = pymunk.Body(1.0, 1.0)
        weight.position = x, 5.0
        space.add(weight, pymunk.DampedSpring(space.static_body, weight, (x, 0), (0, 0), 1, 9, 0.1))
    balls = [ball(table, x - 0.5, 0.1), ball(table, x + 0.1, 0.25), ball(table, x + 0.5, -0.2)]
    stops: list[float] = []
    table.on_stop = lambda _ball, t: stops.append(t)
    table.strike(balls[0], (1.0, 0.2))
    balls[1].body.velocity = 0.5, -0.4  # set by hand
    while table.moving:
        space.step(next(steps))
    return [*(place for each in balls for place in each.body.position), *stops]


@every_step
@pytest.mark.parametrize("x", [0.0, pytest.param(1000.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("spring", [False, True], ids=["no guest", "a guest on a spring"])
def test_ends_are_those_of_contacts_at_exact_times(steps: str, x: float, spring: bool) -> None:
    exact = ends(itertools.repeat(1 / 60), x)
    ours = ends(STEPS[steps](), x, spring)
    assert ours == pytest.approx(exact, abs=1e-12 + 4.0 * math.ulp(x))


@every_step
@pytest.mark.parametrize("push", [3e-11, 1e-9, 1e-4])
def test_a_small_push_is_noticed(steps: str, push: float) -> None:
    """It is added to the velocity of the path."""
    space, table = plane(max_dt=LONGEST)
    one, lengths = ball(table, 0.0), STEPS[steps]()
    table.strike(one, (1.0, 0.0))
    while table.time < 0.5:
        space.step(next(lengths))
    one.body.apply_impulse_at_local_point((0.0, M * push))
    pushed = table.save_state().motions[0]
    assert pushed[3] == pytest.approx(push, rel=1e-4)
    assert pushed[2] == pytest.approx(1.0 - A * table.time, abs=0.5 * A * LONGEST)
    time = math.hypot(*pushed[2:]) / A
    while table.moving:
        space.step(next(lengths))
    assert one.body.position.y == pytest.approx(push * time / 2.0, rel=1e-4)


@every_step
@pytest.mark.parametrize("by", ["place", "velocity"])
def test_the_least_change_of_a_ball_at_rest_is_noticed(steps: str, by: str) -> None:
    space, table = plane(max_dt=LONGEST)
    one, lengths = ball(table, 0.5), STEPS[steps]()
    for _ in range(3):
        space.step(next(lengths))
    if by == "place":
        one.body.position = math.nextafter(0.5, 1.0), 0.0
    else:
        one.body.velocity = 1e-14, 0.0
    space.step(next(lengths))
    x, _, vx, _ = table.save_state().motions[0]
    assert x > 0.5 or by == "velocity"
    assert one.path.speed == (0.0 if by == "place" else 1e-14)
    assert vx <= 1e-14


@every_step
@pytest.mark.parametrize("deceleration", [0.0, 0.05])
@pytest.mark.parametrize("sleepy", [False, True], ids=["awake", "sleepy"])
def test_a_box_that_hits_a_ball_loses_what_the_ball_gains(
    steps: str, deceleration: float, sleepy: bool
) -> None:
    """No push is lost where bodies are put on their paths: after uneven steps, or in sleep.

    Where steps are equal, the push counts as a velocity set by hand, to first order in the step.
    """
    space, table = plane(max_dt=LONGEST, deceleration=deceleration)
    space.sleep_time_threshold = 5.0 if sleepy else math.inf
    one, box = ball(table, 0.0), pymunk.Body(0.5, math.inf)
    shape = pymunk.Poly.create_box(box, (0.1, 0.3))
    box.position, box.velocity = (-0.3, 0.0), (1.0, 0.0)
    shape.elasticity = one.circle.elasticity = 1.0
    space.add(box, shape)
    table.strike(one, (0.2, 0.0))
    lengths = STEPS[steps]()
    while table.time < 1.2:
        space.step(next(lengths))
    gained = table.save_state().motions[0][2] - 0.2 + deceleration * table.time
    assert gained > 0.0
    assert M * gained == pytest.approx(
        0.5 * (1.0 - box.velocity.x), abs=1e-12 + M * deceleration / 60
    )


# -- what a refused step leaves, and what long use leaves ------------------------------------------


@pytest.mark.parametrize("wrong", [1.02 * LONGEST, 1.0, -0.01, math.nan, math.inf])
@pytest.mark.parametrize("then", ["nothing", "0", "strike", "another"])
def test_a_refused_step_changes_nothing(wrong: float, then: str) -> None:
    paths = []
    for refused in (False, True):
        space = pymunk.Space()
        guest = pymunk.Body(1.0, 1.0)  # which pymunk moves before it calls the table
        space.add(guest)
        table = Billiards(space, LONGEST, pair=PAIR, deceleration=A)
        table.add_wall(pymunk.Segment(space.static_body, (1.0, -1), (1.0, 1), 0.0), 0.8, 0.2)
        balls = [ball(table, 0.0), ball(table, 0.5, 0.01), ball(table, 0.0, 0.5)]
        table.strike(balls[0], (1.5, 0.0))
        for _ in range(8):
            space.step(LONGEST)
        if refused:
            with pytest.raises(ValueError, match=r"^dt = .*: a step m"):
                space.step(wrong)
        if then == "0":
            space.step(0.0)
        elif then == "strike":
            table.strike(balls[2], (0.3, -0.4))
        elif then == "another" and refused:
            with pytest.raises(ValueError, match=r"^dt = .*: a step m"):
                space.step(wrong)
        for _ in range(200):
            space.step(LONGEST)
        paths.append([place for each in balls for place in each.body.position])
    assert paths[1] == pytest.approx(paths[0], abs=1e-12)


def test_a_step_refused_for_a_wall_that_moved_is_made_again() -> None:
    """Nothing of it stays: the wall is put up again, and the ball meets it there."""
    space, table = plane(max_dt=LONGEST)
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    shape = pymunk.Segment(carrier, (0.5, -1), (0.5, 1), 0.0)
    space.add(carrier)
    wall, one = table.add_wall(shape, 0.8), ball(table, 0.0)
    table.strike(one, (1.0, 0.0))
    carrier.position = 0.01, 0.0
    with pytest.raises(ValueError, match=r"body.position = .*it was .* when the wall came"):
        for _ in range(20):
            space.step(LONGEST)
    before = table.time, tuple(one.body.position)
    with pytest.raises(ValueError, match=r"body.position = .*it was .* when the wall came"):
        space.step(LONGEST)
    assert (table.time, tuple(one.body.position)) == before
    table.remove_wall(wall)
    table.add_wall(shape, 0.8)
    heard: list[float] = []
    table.on_contact = lambda contact: heard.append(contact.t)
    for _ in range(100):
        space.step(LONGEST)
    assert heard == [pytest.approx((1 - math.sqrt(1 - 2 * A * (0.51 - R))) / A, abs=1e-12)]
    table.remove_wall(1)
    carrier.position = 0.3, 0.0  # It carries no wall any more.
    table.strike(one, (1.0, 0.0))
    space.step(LONGEST)


def test_nothing_grows_with_use() -> None:
    """Strikes without a step, and balls and walls that come and go, cost what they cost at first.

    Counted are the places where something could remain; the time is compared with that at first.
    """
    space, table = plane(max_dt=LONGEST)
    balls = [ball(table, 0.1 * k) for k in range(6)]
    for k in range(1_500):
        table.strike(balls[k % 6], (0.1, 1.0))
    assert len(table.engine.queue.line) <= 1001
    table.place(balls[0], (-1.0, 0.0))
    times = []
    for _ in range(8):
        began = time.process_time()
        for _ in range(25):
            table.remove_ball(balls[0])
            balls[0] = table.add_ball(balls[0].circle)
            carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
            space.add(carrier)
            wall = table.add_wall(pymunk.Segment(carrier, (2, -1), (2, 1), 0.0), 0.8)
            table.remove_wall(wall)
            space.remove(carrier)
        times.append(time.process_time() - began)
    assert len(table.engine.table.walls) == len(table.walls) == 0
    assert len(table.live.ball_of) == 6
    assert len(balls[0].body.shapes) == 1
    assert min(times[4:]) < 2.0 * max(times[:4])


def test_each_stop_is_told_once() -> None:
    """A ball that is struck or predicted again and again still stops once."""
    space, table = plane(max_dt=LONGEST)
    one, stops = ball(table, 0.0), list[float]()
    wall = table.add_wall(pymunk.Segment(space.static_body, (9, -1), (9, 1), 0.0), 0.8)
    table.on_stop = lambda _ball, t: stops.append(t)
    table.strike(one, (0.3, 0.0))
    for _ in range(3):
        table.strike(one, (0.3, 0.0))
    table.remove_wall(wall)
    while table.moving:
        space.step(LONGEST)
    assert stops == [1.0]


def test_a_state_is_refused_if_a_wall_is_now_where_a_ball_was() -> None:
    space, table = plane(max_dt=LONGEST)
    one = ball(table, 0.0)
    saved = table.save_state()
    table.place(one, (0.5, 0.0))
    wall = table.add_wall(pymunk.Segment(space.static_body, (0, -1), (0, 1), 0.0), 0.8)
    with pytest.raises(ValueError, match="the ball overlaps wall 0"):
        table.restore_state(saved)
    assert one.body.position.x == 0.5
    table.remove_wall(wall)
    table.restore_state(saved)
    assert one.body.position.x == 0.0


def test_undo_gives_a_body_back_to_the_ball_that_it_was() -> None:
    space, table = plane(max_dt=LONGEST)
    first = ball(table, 0.0)
    saved = table.save_state()
    table.remove_ball(first)
    second = table.add_ball(first.circle)
    table.strike(second, (1.0, 0.0))
    space.step(LONGEST)
    table.restore_state(saved)
    first.body.velocity = 1.0, 0.0
    while table.time < 5.0:
        space.step(LONGEST)
    assert first.is_on_table and not second.is_on_table
    assert first.body.position.x == pytest.approx(1 / (2 * A), abs=1e-12)


def test_play_after_another_strike() -> None:
    """A table of its own is played to its end, struck, and played again."""
    space, table = plane()
    table.add_wall(pymunk.Segment(space.static_body, (0.2, -1), (0.2, 1), 0.0), 0.8)
    one = ball(table, 0.2 - 1.001 * R)
    for _ in range(2):
        table.strike(one, (0.5, 0.1))
        table.play()
    assert one.body.position.x < 0.2 - R
