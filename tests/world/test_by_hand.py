"""What somebody does by hand to balls, walls and joints in a pymunk space: followed, or refused."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from typing import Any

import pymunk
import pytest

from pool_pymunk import NT, Billiards, Law, Pair, SettingError, same_balls
from pool_pymunk.world import ContactEvent, TableBall, TableState
from pool_pymunk.world import steps as world_steps
from tests.shared.worlds import Point, fence, plane, steps
from tests.shared.worlds import ball as small_ball

DT = 1 / 60  # s
R = 15.0


def world(e: float = 0.0, **settings: Any) -> tuple[pymunk.Space, Billiards]:
    """A world of pixels without friction between sides."""
    space = pymunk.Space()
    return space, Billiards(space, DT, pair=same_balls(e, 0.0), **settings)


def ball(table: Billiards, x: float, y: float = 0.0, velocity: Point = (0.0, 0.0)) -> TableBall:
    """A ball of mass 1 and radius 15."""
    body = pymunk.Body(1.0, 100.0)
    body.position, body.velocity = (x, y), velocity
    return table.add_ball(pymunk.Circle(body, R))


def wall_at(table: Billiards, x: float, e: float = 0.0) -> pymunk.Segment:
    """An upright wall whose face is 4 left of x."""
    wall = pymunk.Segment(table.space.static_body, (x, -1000), (x, 1000), 4.0)
    table.add_wall(wall, e)
    return wall


# -- the same state by hand in every frame ---------------------------------------------------------


@pytest.mark.parametrize("settings", [{}, {"deceleration": 100.0}], ids=["no friction", "friction"])
@pytest.mark.parametrize("speed", [300.0, 3000.0])
def test_a_ball_driven_at_a_dead_wall_stays_there(speed: float, settings: dict[str, float]) -> None:
    space, table = world(**settings)
    wall_at(table, 800.0)
    body = ball(table, 781.0).body
    for _ in range(12):
        body.velocity = speed, 0.0
        space.step(DT)
        assert body.position == pytest.approx((781.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("push", ["velocity", "impulse"])
def test_a_ball_driven_into_a_corner_stays_in_it(push: str) -> None:
    space, table = world(0.5)
    fence(table, [(0, 0), (800, 0), (800, 400), (0, 400)], 4.0, 0.5, 0.0)
    body = ball(table, 700.0, 350.0).body
    for _ in range(200):
        if push == "velocity":
            body.velocity = 3000.0, 1000.0
        else:
            body.apply_impulse_at_local_point((500.0, 300.0))
        space.step(DT)
        assert 19.0 - 1e-9 <= body.position.x <= 781.0 + 1e-9
        assert 19.0 - 1e-9 <= body.position.y <= 381.0 + 1e-9


def test_a_row_that_is_driven_at_a_wall_keeps_its_distances() -> None:
    space, table = world()
    wall_at(table, 800.0)
    row = [ball(table, 781.0 - 2.0 * R * k) for k in range(4)]
    for _ in range(30):
        row[-1].body.velocity = 300.0, 0.0
        space.step(DT)
        gaps = [one.body.position.x - two.body.position.x for one, two in pairwise(row)]
        assert gaps == pytest.approx([2.0 * R] * 3, abs=1e-9)
        assert row[0].body.position.x == pytest.approx(781.0, abs=1e-9)


def test_a_scene_that_is_put_back_by_hand_is_played_again() -> None:
    """Each ball is where it was before the step, and not where the table put it."""
    space, table = world(1.0)
    still, runner = ball(table, 0.0), ball(table, -31.0, velocity=(600.0, 0.0))
    for _ in range(3):
        still.body.position, still.body.velocity = (0.0, 0.0), (0.0, 0.0)
        runner.body.position, runner.body.velocity = (-31.0, 0.0), (600.0, 0.0)
        space.step(DT)
        assert runner.body.position == pytest.approx((-30.0, 0.0), abs=1e-12)
        assert still.body.position == pytest.approx((9.0, 0.0), abs=1e-12)


# -- two threads -----------------------------------------------------------------------------------


def match(count: int) -> list[Point]:
    """Play on a table of its own, and return where the balls end."""
    space, table = world(0.95, deceleration=50.0)
    fence(table, [(0, 0), (800, 0), (800, 400), (0, 400)], 4.0, 0.8, 0.1)
    balls = [ball(table, 60.0 + 70.0 * (k % 10), 60.0 + 70.0 * (k // 10)) for k in range(count)]
    for k in range(120):
        if k % 40 == 0:
            table.strike(balls[k % count], (37.0 * count - 300.0, 11.0 * k - 200.0))
        space.step(DT)
    return [(each.body.position.x, each.body.position.y) for each in balls]


def test_tables_in_two_threads_do_not_know_each_other() -> None:
    counts, ends = [20, 7, 30, 12] * 2, dict[int, list[Point]]()
    alone = {count: match(count) for count in counts}
    jobs = [
        threading.Thread(target=lambda k, n: ends.__setitem__(k, match(n)), args=(k, count))
        for k, count in enumerate(counts)
    ]
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        for job in jobs:
            job.start()
        for job in jobs:
            job.join()
    finally:
        sys.setswitchinterval(usual)
    assert ends == {k: alone[count] for k, count in enumerate(counts)}


# -- somebody takes things out of the space --------------------------------------------------------

TAKEN_OUT: dict[str, Callable[[pymunk.Space, TableBall], object]] = {
    "circle, body, joints": lambda s, b: s.remove(b.circle, b.body, *b.body.constraints),
    "all shapes, body, joints": lambda s, b: s.remove(*b.body.shapes, b.body, *b.body.constraints),
    "circle": lambda s, b: s.remove(b.circle),
    "body": lambda s, b: s.remove(b.body),
    "everything": lambda s, b: s.remove(*s.shapes, *s.bodies, *s.constraints),
}


@pytest.mark.parametrize("how", TAKEN_OUT)
def test_a_moving_ball_that_is_taken_out_has_left_the_table(how: str) -> None:
    space, table = world(deceleration=100.0)
    wall_at(table, 800.0)
    one, two = ball(table, 0.0), ball(table, 0.0, 100.0)
    table.strike(one, (300.0, 0.0))
    for _ in range(3):
        space.step(DT)
    TAKEN_OUT[how](space, one)
    for _ in range(300):
        space.step(DT)
    assert not one.is_on_table
    assert one.body.space is one.circle.space is None
    assert table.count == (0 if how == "everything" else 1)
    assert two.is_on_table == (how != "everything")
    assert not table.moving
    assert len(space.constraints) == 0


def test_walls_and_pockets_that_are_taken_out_are_gone() -> None:
    space, table = world(1.0)
    gate, _ = wall_at(table, 200.0, 1.0), wall_at(table, 600.0, 1.0)
    table.add_pocket((400.0, 0.0), 10.0)
    [hole] = [shape for shape in space.shapes if isinstance(shape, pymunk.Circle)]
    one = ball(table, 0.0)
    space.remove(gate)
    assert table.predict(one, (100.0, 0.0)).pocket == 0
    space.remove(hole)
    assert table.predict(one, (100.0, 0.0)).wall == 1
    assert table.pockets == {}
    table.place(one, (200.0, 0.0))
    assert table.free_spot((200.0, 0.0), ball=one) == (200.0, 0.0)
    table.strike(one, (100.0, 0.0))
    for _ in range(360):
        space.step(DT)
    assert one.body.position.x == pytest.approx(581.0 - (600.0 - 381.0), abs=1e-9)


def test_a_wall_that_was_taken_out_can_be_added_again() -> None:
    space, table = world(1.0)
    gate, one = wall_at(table, 200.0, 1.0), ball(table, 0.0)
    space.remove(gate)
    assert table.add_wall(gate, 1.0) == 1
    space.step(DT)
    assert table.predict(one, (100.0, 0.0)).wall == 1


# -- what others do in a step with a contact -------------------------------------------------------


def box(dt: float, deceleration: float = 0.0) -> tuple[pymunk.Space, Billiards]:
    """A small box with walls of e = 1."""
    space = pymunk.Space()
    table = Billiards(space, dt, pair=same_balls(1.0, 0.0), deceleration=deceleration)
    fence(table, [(0, 0), (120, 0), (120, 90), (0, 90)], 2.0, 1.0, 0.0)
    return space, table


@pytest.mark.parametrize("fps", [60, 240])
def test_a_drag_function_keeps_its_share_in_each_step(fps: int) -> None:
    space, table = box(1 / fps)
    body = ball(table, 60.0, 45.0, (700.0, 387.0)).body
    started, kept = body.velocity.length, 0.97 ** (60 / fps)
    body.velocity_func = lambda body, gravity, _, dt: body.update_velocity(body, gravity, kept, dt)
    for _ in range(fps):
        space.step(1 / fps)
    assert body.velocity.length == pytest.approx(started * kept**fps, rel=1e-9)


@pytest.mark.parametrize("deceleration", [0.0, 50.0])
def test_a_limit_of_speed_holds_at_every_contact(deceleration: float) -> None:
    """Also for balls that rested before they were hit."""

    def limit(body: pymunk.Body, gravity: Point, damping: float, dt: float) -> None:
        pymunk.Body.update_velocity(body, gravity, damping, dt)
        if body.velocity.length > 200.0:
            body.velocity *= 200.0 / body.velocity.length

    space, table = box(DT, deceleration)
    balls = [ball(table, x, y) for x, y in ((25.0, 45.0), (57.0, 40.0), (90.0, 50.0))]
    for each in balls:
        each.body.velocity_func = limit
    balls[0].body.velocity = 400.0, 30.0
    speeds = []
    for _ in range(60):
        space.step(DT)
        speeds += [each.body.velocity.length for each in balls]
        speeds += [math.hypot(*each.path.at(table.time)[1]) for each in balls]
    assert max(speeds) <= 200.0 * (1.0 + 1e-12)
    assert max(speeds) > 150.0


def test_a_friction_joint_of_ones_own_slows_a_ball_in_steps_with_contacts_too() -> None:
    space, table = box(DT)
    body = ball(table, 60.0, 45.0, (700.0, 387.0)).body
    joint = pymunk.PivotJoint(space.static_body, body, (0, 0), (0, 0))
    joint.max_bias, joint.max_force = 0.0, 300.0
    space.add(joint)
    started = body.velocity.length
    for _ in range(60):
        space.step(DT)
    assert body.velocity.length == pytest.approx(started - 300.0, rel=1e-9)


# -- what is changed while a ball moves ------------------------------------------------------------

CHANGED_BALLS: dict[str, Callable[[TableBall], object]] = {
    "mass": lambda b: setattr(b.body, "mass", 20.0),
    "radius": lambda b: b.circle.unsafe_set_radius(30.0),
    "filter": lambda b: setattr(b.circle, "filter", pymunk.ShapeFilter(group=3)),
    "body_type": lambda b: setattr(b.body, "body_type", pymunk.Body.KINEMATIC),
}


@pytest.mark.parametrize("what", CHANGED_BALLS)
def test_a_moving_ball_that_is_changed_is_refused_in_turn(what: str) -> None:
    space, table = world(1.0, deceleration=100.0)
    one, two = ball(table, 0.0), ball(table, 0.0, 200.0)
    table.strike(one, (300.0, 0.0))
    table.strike(two, (300.0, 0.0))
    for _ in range(3):
        space.step(DT)
    CHANGED_BALLS[what](one)
    with suppress(ValueError):  # One ball or wall is looked at in each step, in turn.
        space.step(DT)
    before = table.time, *two.body.position
    for _ in range(2):
        with pytest.raises(ValueError, match=f"^ball 0: {what} = .* the ball came to the table"):
            space.step(DT)
    assert (table.time, *two.body.position) == before
    table.remove_ball(one)
    for _ in range(300):
        space.step(DT)
    assert two.body.position == pytest.approx((450.0, 200.0), abs=1e-9)


CHANGED_WALLS: dict[str, Callable[[pymunk.Segment], object]] = {
    "a": lambda s: s.unsafe_set_endpoints((300, -100), (200, 100)),
    "b": lambda s: s.unsafe_set_endpoints((200, -100), (300, 100)),
    "radius": lambda s: s.unsafe_set_radius(50.0),
    "sensor": lambda s: setattr(s, "sensor", True),
    "filter": lambda s: setattr(s, "filter", pymunk.ShapeFilter(mask=0)),
    "body.position": lambda s: setattr(s.body, "position", (100.0, 0.0)),
    "body.angle": lambda s: setattr(s.body, "angle", 0.5),
    "body_type": lambda s: setattr(s.body, "body_type", pymunk.Body.KINEMATIC),
}


@pytest.mark.parametrize("what", CHANGED_WALLS)
def test_a_wall_that_is_changed_is_refused_until_it_is_put_up_again(what: str) -> None:
    space, table = world(1.0)
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    gate = pymunk.Segment(carrier, (200, -100), (200, 100), 5.0)
    space.add(carrier)
    number, one = table.add_wall(gate, 1.0), ball(table, 0.0)
    table.strike(one, (100.0, 0.0))
    space.step(DT)  # One ball or wall is looked at in each step, in turn.
    before = one.body.position
    CHANGED_WALLS[what](gate)
    line = f"^wall 0: {what} = .*: it was .* when the wall came to the table; to change it, remove "
    for call in (
        lambda: space.step(DT),
        lambda: table.predict(one, (100.0, 0.0)),
        lambda: table.place(one, (50.0, 50.0)),
        lambda: ball(table, 0.0, 100.0),
        lambda: table.free_spot((0.0, 0.0), R),
    ):
        with pytest.raises(ValueError, match=line):
            call()
    assert one.body.position == before
    table.remove_wall(number)
    table.predict(one, (100.0, 0.0))


# -- numbers that are none -------------------------------------------------------------------------

NO_NUMBERS: dict[str, Callable[[pymunk.Body], object]] = {
    "velocity": lambda b: setattr(b, "velocity", (math.nan, 0.0)),
    "position": lambda b: setattr(b, "position", (0.0, math.inf)),
    "force": lambda b: b.apply_force_at_local_point((math.nan, 0.0)),
    "position of a body whose angle is none": lambda b: setattr(b, "angle", math.nan),
    "angular_velocity": lambda b: setattr(b, "angular_velocity", math.inf),
    "torque": lambda b: setattr(b, "torque", math.nan),
}


@pytest.mark.parametrize("what", NO_NUMBERS)
def test_a_number_that_is_none_is_refused_and_touches_nobody_else(what: str) -> None:
    space, table = world(1.0, deceleration=100.0)
    wall_at(table, 800.0)
    one, two, three = (ball(table, x) for x in (0.0, 100.0, 200.0))
    table.strike(two, (50.0, 0.0))

    def step() -> None:
        space.step(DT)

    for _ in range(3):
        step()
    NO_NUMBERS[what](one.body)
    before = [tuple(each.body.position) for each in (two, three)]
    key = what.split()[0]
    for _ in range(2):
        with pytest.raises(ValueError, match=rf"^ball 0: {key} = .*(nan|inf).*finite number"):
            step()
    assert [tuple(each.body.position) for each in (two, three)] == before
    table.place(one, (-50.0, 0.0))
    for _ in range(300):
        step()
    assert one.body.position == (-50.0, 0.0)
    assert two.body.position == pytest.approx((112.5, 0.0), abs=1e-9)


def test_a_number_that_is_none_in_a_callback_is_refused_when_the_step_is_over() -> None:
    space, table = world(1.0)
    one, two = ball(table, 0.0), ball(table, 100.0)
    table.strike(one, (300.0, 0.0))

    def on_contact(contact: ContactEvent) -> None:
        table.on_contact = None
        two.body.velocity = math.nan, 0.0

    table.on_contact = on_contact
    with pytest.raises(ValueError, match=r"^ball 1: velocity = \[nan"):
        for _ in range(100):
            space.step(DT)
    for _ in range(10):
        space.step(DT)
    assert two.body.velocity == pytest.approx((300.0, 0.0))


def test_a_velocity_function_that_returns_no_number_is_refused() -> None:
    space, table = world(1.0)
    one, two = ball(table, 0.0, velocity=(10.0, 0.0)), ball(table, 100.0)
    one.body.velocity_func = lambda body, *_: setattr(body, "velocity", (math.nan, 0.0))
    with pytest.raises(ValueError, match=r"^ball 0: velocity = \[nan"):
        for _ in range(2):
            space.step(DT)
    assert two.body.position == (100.0, 0.0)
    table.remove_ball(one)
    space.step(DT)


# -- step and play ---------------------------------------------------------------------------------


def test_play_follows_what_is_set_by_hand() -> None:
    _, table = world(1.0, deceleration=100.0)
    one = ball(table, 0.0)
    one.body.velocity = 300.0, 0.0
    table.play()
    assert one.body.position == pytest.approx((450.0, 0.0), abs=1e-9)


def test_play_ends_where_nothing_slows_balls() -> None:
    """Two balls fly apart; between walls they would not."""
    _, table = world(1.0)
    one, two = ball(table, 0.0, velocity=(300.0, 0.0)), ball(table, 100.0)
    table.play()
    assert (one.body.velocity, two.body.velocity) == ((0.0, 0.0), (300.0, 0.0))
    wall_at(table, 800.0, 1.0)
    with pytest.raises(SettingError, match=r"^latest = inf: is missing: "):
        table.play()
    table.play(latest=20.0)
    assert table.time == 20.0
    table.deceleration = 100.0
    table.play()
    assert not table.moving
    table.deceleration = 0.0
    table.play()


def test_a_callback_of_another_name_is_refused() -> None:
    _, table = world()
    with pytest.raises(AttributeError, match=r'^a Billiards has no on_contcat; did you mean "on_c'):
        table.on_contcat = print  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match=r'no oncontact; did you mean "on_contact"\?$'):
        table.oncontact = print  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match=r"no on_hit; it calls on_contact, on_stop, on_pocket"):
        table.on_hit = print  # type: ignore[attr-defined]
    table.on_contact = print
    table.score = 3  # type: ignore[attr-defined]


# -- places, paths, numbers ------------------------------------------------------------------------


def test_a_ball_that_is_dragged_off_the_table_is_warned_of_once() -> None:
    """It lies where it was put, as any body does; within the walls nothing is said."""
    space, table = world(deceleration=100.0)
    fence(table, [(0, 0), (800, 0), (800, 400), (0, 400)], 4.0, 0.5, 0.0)
    one = ball(table, 700.0, 350.0)
    one.id = "8"
    with pytest.warns(UserWarning) as said:
        for x in (600.0, 790.0, 900.0, 1000.0):
            one.body.position = x, 200.0
            space.step(DT)
    assert [str(each.message).partition(";")[0] for each in said] == [
        'ball 0 (id "8"): the position of its body put it off the table'
    ]
    assert one.body.position == (1000.0, 200.0)


def test_a_ball_that_is_dragged_between_others_overlaps_none() -> None:
    """It lies beside both: at the height of a triangle of 30, 30 and 40 over its base."""
    space, table = world(1.0)
    others, one = [ball(table, 0.0), ball(table, 40.0)], ball(table, 100.0)
    for _ in range(5):
        one.body.position = 20.0, 0.1
        space.step(DT)
        assert one.body.position == pytest.approx((20.0, math.sqrt(500.0)), abs=1e-6)
        assert all(math.dist(one.body.position, each.body.position) >= 30 - 1e-6 for each in others)


def test_a_new_ball_overlaps_none_that_was_moved_since_the_last_step() -> None:
    """pymunk does not know yet where these are."""
    space, table = world(1.0)
    one, two = ball(table, 0.0), ball(table, 0.0, 100.0, (6000.0, 0.0))
    space.step(DT)
    one.body.position = 500.0, 0.0
    for x, y in ((510.0, 0.0), (110.0, 100.0)):
        with pytest.raises(ValueError, match="overlaps ball"):
            ball(table, x, y)
    assert two.body.position == pytest.approx((100.0, 100.0), abs=1e-9)
    ball(table, 0.0)


def test_a_path_is_that_after_a_push() -> None:
    space, table = world(1.0, deceleration=100.0)
    one = ball(table, 0.0)
    space.step(DT)
    one.body.velocity = 0.0, -100.0
    assert one.path.at(table.time)[1] == (0.0, -100.0)
    one.body.apply_impulse_at_local_point((50.0, 0.0))
    assert one.path.at(table.time)[1] == pytest.approx((50.0, -100.0), abs=1.0)
    one.body.position = 7.0, 7.0
    assert one.path.at(table.time)[0] == (7.0, 7.0)


def test_many_balls_come_to_a_table_one_after_the_other_in_linear_time() -> None:
    def seconds(count: int) -> float:
        _, table = world()
        began = time.process_time()
        for k in range(count):
            ball(table, 40.0 * (k % 40), 40.0 * (k // 40))
        return time.process_time() - began

    few, many = (min(seconds(count) for _ in range(3)) for count in (300, 2400))
    assert many < 45.0 * few  # eight times as many take some 30 times; quadratic it was over 60


def test_lengths_in_a_world_of_pixels_have_no_unit() -> None:
    _, table = world()
    ball(table, 0.0)
    with pytest.raises(ValueError, match=r"overlaps ball 0 by 18 \(1\.2 radii\)$"):
        ball(table, 12.0)


def test_shapes_that_are_on_a_table_already_are_refused_in_words() -> None:
    _, table = world()
    wall, one = wall_at(table, 800.0), ball(table, 0.0)
    _, other = world()
    for again in (table, other):
        with pytest.raises(
            ValueError, match="this shape is a ball, a wall or a pocket of a table already"
        ):
            again.add_wall(wall, 0.5)
        with pytest.raises(ValueError, match=r"of a table already|is a ball already"):
            again.add_ball(one.circle)


# -- what a callback does to bodies ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "speed"),
    [
        (lambda body: body.apply_impulse_at_local_point((-50.0, 0.0)), -350.0),
        (lambda body: setattr(body, "velocity", body.velocity * 1.1), -330.0),
        (lambda body: setattr(body, "velocity", (-20.0, 0.0)), -20.0),
    ],
)
def test_a_callback_finds_bodies_as_they_are_after_the_contact(
    change: Callable[[pymunk.Body], object], speed: float
) -> None:
    space, table = world(1.0)
    wall_at(table, 200.0, 1.0)
    one, other = ball(table, 0.0, velocity=(300.0, 0.0)), ball(table, 0.0, 100.0, (30.0, 0.0))
    seen: list[tuple[float, ...]] = []

    def hear(event: ContactEvent) -> None:
        seen.append((*one.body.position, *one.body.velocity, *other.body.position))
        change(one.body)

    table.on_contact = hear
    for _ in range(60):
        space.step(DT)
    [found] = seen
    # The other ball shows the beginning of the step.
    assert found == pytest.approx((181.0, 0.0, -300.0, 0.0, 18.0, 100.0), abs=1e-9)
    assert one.path.at(table.time)[1] == pytest.approx((speed, 0.0), abs=1e-9)
    assert other.body.position == pytest.approx((30.0, 100.0), abs=1e-9)


# -- a push in each step ---------------------------------------------------------------------------


@pytest.mark.parametrize("fps", [60, 240])
def test_a_push_in_each_step_leaves_friction_as_it_is(fps: int) -> None:
    """A ball that is steered loses 100 px/s in a second, and none half as much again."""
    space = pymunk.Space()
    table = Billiards(space, 1 / fps, pair=same_balls(1.0, 0.0), deceleration=100.0)
    one = ball(table, 0.0)
    table.strike(one, (300.0, 0.0))
    for _ in range(fps):
        one.body.velocity = one.body.velocity.rotated(0.5 / fps)
        space.step(1 / fps)
    assert math.hypot(*one.path.at(table.time)[1]) == pytest.approx(200.0, abs=1e-2)


@pytest.mark.parametrize(("rolling", "holds"), [(None, 2.0), (0.5, 0.7), (1.9, 2.0)])
def test_a_force_moves_a_ball_at_rest_if_it_is_stronger_than_what_holds_it(
    rolling: float | None, holds: float
) -> None:
    """To roll, a sphere needs 7/5 of the rolling resistance, and it slips where that is more."""
    for share, moves in ((0.99, False), (1.01, True)):
        space, table = plane(deceleration=2.0, rolling=rolling)
        body = small_ball(table, 0.0).body
        for _ in range(30):
            body.force = body.mass * share * holds, 0.0
            space.step(DT)
        assert (body.position.x > 0.0) == moves


# -- contacts that are refused ---------------------------------------------------------------------


@pytest.mark.parametrize("what", ["mass", "pair"])
def test_the_clock_stands_at_a_contact_that_is_refused(what: str) -> None:
    """Nothing passes anything, and once the cause is gone all goes on as if it had never been."""
    space, table = world(1.0)
    ids = [ball(table, x).number for x in (0.0, -100.0)]
    one, two = table.balls
    own: Any = table.engine.table
    good = own.said
    table.strike(two, (300.0, 0.0))

    def step() -> None:
        space.step(DT)

    step()
    if what == "mass":
        one.body.mass = 9.0
    else:
        own.said = lambda i, j: 1 / 0
    refused = 0
    for _ in range(40):
        try:
            step()
        except (ValueError, ZeroDivisionError):
            refused += 1
    assert ids == [0, 1] and refused >= 25
    assert one.body.position == (0.0, 0.0) and two.body.position.x <= -30.0 + 1e-9
    one.body.mass, own.said = 1.0, good
    while table.time < 1.0 - 1e-9:
        space.step(min(DT, 1.0 - table.time))
    assert one.path.at(1.0)[0] == pytest.approx((300.0 - 70.0, 0.0), abs=1e-9)
    assert two.path.at(1.0)[0] == pytest.approx((-30.0, 0.0), abs=1e-9)


# -- more that belongs to the table ----------------------------------------------------------------


@pytest.mark.parametrize("steps_between", [0, 1])
def test_a_ball_that_was_taken_out_comes_back_whole(steps_between: int) -> None:
    space, table = world(1.0)
    one, two = ball(table, 0.0), ball(table, 100.0)
    saved = table.save_state()
    space.remove(two.circle, two.body)
    for _ in range(steps_between):
        space.step(DT)
    table.restore_state(saved)
    assert two.is_on_table and two.circle.space is two.body.space is space
    table.strike(one, (300.0, 0.0))
    for _ in range(60):
        space.step(DT)
    assert two.body.position.x == pytest.approx(330.0, abs=1e-9)
    table.clear()
    assert table.count == 0


def test_a_ball_that_is_put_into_a_pocket_falls_in() -> None:
    space, table = world(1.0)
    table.add_pocket((100.0, 0.0), 20.0)
    one, heard = ball(table, 0.0), list[int]()
    table.on_pocket = lambda _ball, pocket, _t: heard.append(pocket)
    one.body.position = 100.0, 1.0
    space.step(DT)
    assert heard == [0] and not one.is_on_table


def test_a_spring_gains_no_energy_at_a_wall() -> None:
    """It is right to first order: the gain becomes small with the step."""
    gains = []
    for fps in (60, 240):
        space = pymunk.Space()
        table = Billiards(space, 1 / fps, pair=same_balls(1.0, 0.0))
        wall_at(table, 40.0, 1.0)
        body = ball(table, -40.0, velocity=(0.0, 30.0)).body
        space.add(pymunk.DampedSpring(space.static_body, body, (0, 0), (0, 0), 0.0, 20.0, 0.0))
        energies = []
        for _ in range(20 * fps):
            space.step(1 / fps)
            place, velocity = body.position, body.velocity
            energies.append(10.0 * place.length**2 + 0.5 * velocity.length**2)
        gains.append(max(energies) / (10.0 * 1600.0 + 450.0) - 1.0)
    assert gains[1] < 0.02
    assert gains[0] < 0.2


def test_a_wall_on_a_body_that_has_moved_is_no_way_around_the_refusal() -> None:
    space, table = world(1.0)
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    space.add(carrier)
    table.add_wall(pymunk.Segment(carrier, (200, -100), (200, 100), 5.0), 1.0)
    carrier.position = -100.0, 0.0
    with pytest.raises(ValueError, match=r"^wall 0: body.position"):
        table.add_wall(pymunk.Segment(carrier, (200, 300), (200, 400), 5.0), 1.0)


def test_a_pocket_on_a_body_that_has_moved_is_no_way_around_it_either() -> None:
    space, table = world(1.0)
    wall_at(table, 200.0)
    one = ball(table, 0.0)
    space.static_body.position = 50.0, 0.0
    table.add_pocket((400.0, 0.0), 10.0)
    with pytest.raises(ValueError, match=r"^wall 0: body.position"):
        table.predict(one, (100.0, 0.0))


@pytest.mark.parametrize("key", ["gravity", "damping"])
def test_gravity_and_damping_must_be_finite(key: str) -> None:
    space, table = world(1.0)
    one = ball(table, 0.0, velocity=(10.0, 0.0))
    setattr(space, key, (0.0, math.nan) if key == "gravity" else math.inf)
    with pytest.raises(ValueError, match=f"^{key} = .*(nan|inf)"):
        space.step(DT)
    assert one.body.position == (0.0, 0.0)


def test_subclasses_may_have_callbacks_as_methods() -> None:
    class Game(Billiards):
        hits = 0

        def on_contact(self, event: ContactEvent) -> None:
            self.hits += 1

    space = pymunk.Space()
    table = Game(space, DT, pair=same_balls(1.0, 0.0))
    ball(table, 0.0), ball(table, 40.0, velocity=(-300.0, 0.0))
    for _ in range(20):
        space.step(DT)
    assert table.hits == 1
    with pytest.raises(AttributeError, match='did you mean "on_contact"'):
        type("Other", (Billiards,), {"on_contcat": None})


# -- what cannot go on -----------------------------------------------------------------------------


class NoNumber(Law):
    """A law that gives a ball a velocity that is no number."""

    name = "mine"

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        return NT(math.nan, 0.0), b


def test_a_law_that_gives_no_number_is_named_and_an_undo_goes_on() -> None:
    space, table = world(1.0, law=NoNumber())
    one, _ = ball(table, 0.0, velocity=(300.0, 0.0)), ball(table, 60.0)
    saved = table.save_state()
    with pytest.raises(ValueError, match=r"^law = mine: a ball got a velocity that is no number"):
        for _ in range(60):
            space.step(DT)
    table.restore_state(saved)
    space.step(DT)
    assert one.body.position.x == pytest.approx(300.0 * DT, abs=1e-9)


def test_a_callback_that_makes_contact_after_contact_is_refused() -> None:
    space, table = world(0.5)
    wall_at(table, 20.0, 0.5)
    one = ball(table, 0.0, velocity=(300.0, 0.0))
    table.on_contact = lambda event: table.strike(one, (300.0, 0.0))
    with pytest.raises(ValueError, match=r"^on_contact = .*called 1000 times at 0\.003"):
        space.step(DT)
    table.on_contact = None
    space.step(DT)
    assert one.body.velocity.x < 0.0


def test_a_callback_that_makes_one_contact_more_may_do_so_at_each(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A ball goes to and fro between two walls, and is driven once more at each of them."""
    monkeypatch.setattr(world_steps, "MOST_TOLD", 4)
    space, table = world(1.0)
    for x in (-24.0, 24.0):
        table.add_wall(pymunk.Segment(space.static_body, (x, -99.0), (x, 99.0), 4.0), 1.0)
    one, heard = ball(table, 0.0, velocity=(300.0, 0.0)), list[float]()

    def again(event: ContactEvent) -> None:
        heard.append(event.t)
        if heard.count(event.t) == 1:
            table.strike(one, (math.copysign(300.0, -one.body.velocity.x), 0.0))

    table.on_contact = again
    steps(space, 0.5)
    assert len(heard) >= 2 * 10 and heard[::2] == heard[1::2]


def test_a_callback_that_takes_a_ball_out_and_fails_is_heard_of() -> None:
    space, table = world(1.0)
    one, other = ball(table, 0.0), ball(table, 31.0, velocity=(-300.0, 0.0))

    def fail(event: ContactEvent) -> None:
        space.remove(one.circle, one.body)
        raise RuntimeError("mine")

    table.on_contact = fail
    with pytest.raises(RuntimeError, match="mine"):
        table.step()
    table.on_contact = None
    table.step()
    assert table.on_table == [other]


@pytest.mark.parametrize("how", ["strike", "by hand", "a new ball"])
def test_a_ball_that_is_too_fast_for_the_clock_is_refused(how: str) -> None:
    space, table = world(1.0)
    one = ball(table, 0.0)
    table.time = 1e4
    with pytest.raises(ValueError, match=r"velocity = .*so fast that the clock"):
        if how == "strike":
            table.strike(one, (1e12, 0.0))
        elif how == "by hand":
            one.body.velocity = 1e12, 0.0
            space.step(DT)
        else:
            ball(table, 100.0, velocity=(1e12, 0.0))
    one.body.velocity = 0.0, 0.0
    space.step(DT)
    assert table.on_table == [one] and one.body.position == (0.0, 0.0)


def test_a_ball_that_is_taken_out_is_on_no_list_at_once() -> None:
    space, table = world(1.0)
    one, other = ball(table, 0.0), ball(table, 100.0)
    space.remove(one.circle, one.body)
    assert table.on_table == [other] and table.count == 1
    assert table.ball_of(one.circle) is None and table.ball_of(other.circle) is other


def test_settings_of_a_table_are_not_misspelled_nor_of_another_kind() -> None:
    _, table = world(1.0)
    with pytest.raises(ValueError, match=r"^on_contact = 5: must be a function, or None$"):
        table.on_contact = 5  # type: ignore[assignment]
    with pytest.raises(AttributeError, match='did you mean "deceleration"'):
        table.decelaration = 5.0  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="max_dt"):
        table.max_dt = 0.5  # type: ignore[misc]


@pytest.mark.parametrize(
    ("name", "serves"),
    [
        ("gravity", "it is space.gravity"),
        ("damping", "it is space.damping"),
        ("dt", "each step has its own, up to max_dt"),
        ("restitution", "pair says that of balls, add_wall that of walls"),
        ("law", "it is given when the table is made"),
    ],
)
def test_a_name_that_would_do_nothing_says_what_serves(name: str, serves: str) -> None:
    class Game(Billiards):
        gravity = damping = dt = restitution = law = 0.0

    _, table = world(1.0)
    for ask in (lambda: setattr(table, name, 1.0), lambda: getattr(table, name)):
        with pytest.raises(AttributeError, match=f"^a Billiards has no {name}: {serves}$"):
            ask()
    own = Game(pymunk.Space(), DT, pair=same_balls(1.0, 0.0))
    setattr(own, name, 1.0)
    assert getattr(own, name) == 1.0


def test_times_and_states_of_another_kind_are_named() -> None:
    _, table = world(1.0)
    for dt in ("a", None, [0.01]):
        with pytest.raises(ValueError, match=r"^dt = .*: must be a number$"):
            table.space.step(dt)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r'^latest = "a": must be a number$'):
        table.play(latest="a")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^on_time = 5: must be a function, or None$"):
        table.play(5)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"^state = .*TableState\.from_json makes it of its JSON$"):
        table.restore_state(table.save_state().to_json())  # type: ignore[arg-type]
    one = ball(table, 0.0)
    fast = TableState(0.0, {0: (0.0, 0.0, 1e30, 0.0)})
    with pytest.raises(ValueError, match=r"^state: velocity of ball 0 = \[1e\+30, 0.0\]: is so "):
        table.restore_state(fast)
    assert one.body.velocity == (0.0, 0.0)


def test_what_a_ball_is_cannot_be_set() -> None:
    _, table = world(1.0)
    one = ball(table, 0.0)
    for key, value in (("radius", 1.0), ("is_on_table", False), ("number", 3)):
        with pytest.raises(AttributeError):
            setattr(one, key, value)
    assert (one.radius, one.is_on_table) == (one.circle.radius, True)
    table.strike(one, (1.0, 0.0))
    with pytest.raises(ValueError, match=r"^t = -1.0: this path began at 0 s$"):
        one.path.at(-1.0)


def test_a_sensor_is_no_ball_and_no_wall() -> None:
    space, table = world(1.0)
    circle, gate = pymunk.Circle(pymunk.Body(1.0, 1.0), R), pymunk.Circle(space.static_body, R)
    circle.sensor = gate.sensor = True
    with pytest.raises(ValueError, match=r"^circle = Circle: a ball's circle must not be a sensor"):
        table.add_ball(circle)
    with pytest.raises(ValueError, match=r"^shape = Circle: balls do not bounce off a sensor: set"):
        table.add_wall(gate, 0.5)
    assert not (table.balls or table.walls or space.shapes)


def test_other_threads_are_refused_while_a_step_is_made() -> None:
    _, table = plane()
    one, said = small_ball(table, 0.0), list[str]()

    def look() -> None:
        for call in (table.save_state, lambda: one.path, lambda: table.moving):
            with pytest.raises(ValueError) as refused:
                call()
            said.append(str(refused.value))

    def in_another_thread(_: object, __: float) -> None:
        other = threading.Thread(target=look)
        other.start()
        other.join()

    table.on_stop = in_another_thread
    table.strike(one, (1.0, 0.0))
    table.play()
    line = "space = in a step: another thread makes a step: call this between steps, under a lock"
    assert said == [line] * 3
    assert table.moving == {}


@pytest.mark.parametrize("where", ["body", "both"])
def test_what_is_in_another_space_is_refused(where: str) -> None:
    space, table = world(1.0)
    other, body = pymunk.Space(), pymunk.Body(1.0, 1.0)
    circle = pymunk.Circle(body, R)
    other.add(body, *[circle] * (where == "both"))
    with pytest.raises(ValueError, match=r"^circle = Circle: its body is in another space$"):
        table.add_ball(circle)
    with pytest.raises(ValueError, match=r"^shape = Segment: its body is in another space$"):
        table.add_wall(pymunk.Segment(other.static_body, (0, 0), (1, 0), 0.0), 0.5)
    assert not (table.balls or table.walls or space.shapes)


def test_a_wall_may_have_a_static_body_of_its_own() -> None:
    space, table = world(1.0)
    post = pymunk.Circle(pymunk.Body(body_type=pymunk.Body.STATIC), 5.0)
    body = post.body
    table.add_wall(post, 0.5)
    assert body is not None and body.space is space


@pytest.mark.parametrize("what", ["wall", "pocket"])
def test_what_is_put_up_behind_a_ball_does_not_meet_it(what: str) -> None:
    """The path of the ball began before the place where the wall is now."""
    space, table = plane(deceleration=0.0)
    one = small_ball(table, 0.0)
    table.strike(one, (1.0, 0.0))
    steps(space, 0.2)
    if what == "wall":
        table.add_wall(pymunk.Segment(space.static_body, (0.16, -1.0), (0.16, 1.0), 0.0), 0.5)
    else:
        table.add_pocket((0.18, 0.0), 0.015)
    steps(space, 0.2)
    assert one.body.velocity == (1.0, 0.0)
    assert one.body.position.x == pytest.approx(0.4, abs=1e-12)
