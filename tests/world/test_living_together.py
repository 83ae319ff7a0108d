"""What else may live in a space with Billiards: every line of the table in docs/in-pymunk.md."""

from __future__ import annotations

import copy
import math
import pickle
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards
from pool_pymunk.world import TableBall
from tests import ROOT
from tests.shared import worlds
from tests.shared.worlds import PAIR, A, M, R, ball, plane

STEP = 1 / 120
MINE = 7
steps = partial(worlds.steps, dt=STEP)
PAGE = ROOT / "docs" / "in-pymunk.md"


def box(space: pymunk.Space, x: float, y: float = 0.0, kind: int = pymunk.Body.DYNAMIC) -> Any:
    """Put a box of one's own into the space, and return its shape."""
    body = pymunk.Body(1.0, 1.0, kind)
    body.position = x, y
    shape = pymunk.Poly.create_box(body, (0.1, 0.4))
    shape.collision_type = MINE
    space.add(body, shape)
    return shape


def test_every_line_of_the_table_has_its_test_and_every_test_its_line() -> None:
    named = re.findall(r"\| `(test_\w+)` \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    mine = {name for name in globals() if name.startswith("test_") and "every_line" not in name}
    others = set[str]()
    for name in ("test_by_hand.py", "test_games.py", "test_moving_walls.py", "test_bumpers.py"):
        text = Path(__file__).with_name(name).read_text(encoding="utf-8")
        others |= set(re.findall(r"^def (test_\w+)", text, re.MULTILINE))
    assert len(named) == len(set(named))
    assert mine <= set(named) <= mine | others


def test_a_box_goes_into_balls_that_have_no_way_out() -> None:
    space, table = plane()
    table.add_wall(pymunk.Segment(space.static_body, (1.0, -1.0), (1.0, 1.0), 0.0), 0.5)
    balls, shape = [ball(table, 0.9 - 0.07 * k) for k in range(2)], box(space, 0.3)
    shape.body.velocity = (2.0, 0.0)
    steps(space, 5.0)
    assert min(shape.point_query(each.body.position).distance - R for each in balls) < -R
    assert max(each.body.position.x for each in balls) < 1.0 - 0.99 * R  # None is in the wall.


def test_a_box_and_a_ball_push_each_other() -> None:
    space, table = plane()
    shape, striker = box(space, 0.3), ball(table, 0.0)
    shape.elasticity = striker.circle.elasticity = 1.0
    table.strike(striker, (2.0, 0.0))
    steps(space, 0.5)
    assert shape.body.velocity.x > 0.5
    assert striker.body.velocity.x < -0.5
    at, speed = striker.body.position.x, striker.body.velocity.x
    steps(space, 8.0)
    assert striker.body.position.x == pytest.approx(at - speed**2 / (2 * A), abs=1e-2)


def test_a_push_leaves_the_roll_as_it_was() -> None:
    """A ball that is pushed across its track rolls at 5/7 of its velocity and 2/7 of its roll."""
    space, table = plane(rolling=0.2)
    one, shape = ball(table, 0.0), box(space, 0.1, 0.3)
    one.circle.elasticity, shape.elasticity, shape.body.velocity = 1.0, 0.5, (0.0, -1.0)
    table.strike(one, (1.0, 0.0), roll=1.0)
    after = table.save_state()
    while one.path.slows:
        before = after
        space.step(STEP)
        after = table.save_state()
    assert before.rolls is not None and after.rolls is not None
    roll, vx, vy = before.rolls[0][0], *after.motions[0][2:]
    assert vy < -0.5
    assert after.rolls[0] == pytest.approx((roll, 0.0), abs=0.25 * STEP)
    while not one.path.slows:
        space.step(STEP)
    assert one.path[3:5] == pytest.approx(((5 * vx + 2 * roll) / 7, 5 * vy / 7), abs=1e-3)
    steps(space, 8.0)
    assert not table.moving


def test_a_kinematic_flipper_shoots_a_ball() -> None:
    space, table = plane()
    shape, target = box(space, -0.3, kind=pymunk.Body.KINEMATIC), ball(table, 0.0)
    shape.body.velocity = (2.0, 0.0)
    steps(space, 0.3)
    assert target.body.velocity.x > 1.5


def test_handlers_of_ones_own_types_are_called() -> None:
    space, table = plane()
    box(space, 0.3)
    one, other = ball(table, 0.0), ball(table, -0.3)
    one.circle.collision_type = MINE + 1
    seen: list[object] = []
    space.on_collision(MINE, MINE + 1, begin=lambda arbiter, *_: seen.append(arbiter.shapes[1]))
    space.on_collision(MINE + 1, None, begin=lambda arbiter, *_: seen.append(arbiter.shapes[1]))
    table.strike(one, (2.0, 0.0))
    table.strike(other, (3.0, 0.0))  # It meets the first one, which pymunk does not see.
    steps(space, 0.5)
    assert one.circle in seen and other.circle not in seen


def test_sensors_of_ones_own_feel_balls() -> None:
    space, table = plane()
    gate = pymunk.Segment(space.static_body, (0.3, -1.0), (0.3, 1.0), 0.0)
    gate.sensor, gate.collision_type = True, MINE
    space.add(gate)
    came: list[object] = []
    space.on_collision(MINE, None, begin=lambda arbiter, *_: came.append(arbiter.shapes[1]))
    table.strike(one := ball(table, 0.0), (1.0, 0.0))
    steps(space, 8.0)
    assert came == [one.circle]
    assert one.body.position.x == pytest.approx(1 / (2 * A), abs=1e-12)


def test_filters_hold_for_balls_and_walls() -> None:
    space, table = plane()
    wall = pymunk.Segment(space.static_body, (0.3, -1), (0.3, 1), 0)
    wall.filter = pymunk.ShapeFilter(categories=2)
    table.add_wall(wall, 0.8)
    body = pymunk.Body(M, 1e-4)
    ghost = pymunk.Circle(body, R)
    ghost.filter = pymunk.ShapeFilter(mask=1)
    passes, bounces = table.add_ball(ghost), ball(table, 0.0, 0.5)
    table.strike(passes, (2.0, 0.0))
    table.strike(bounces, (2.0, 0.0))
    steps(space, 1.0)
    assert passes.body.position.x > 0.5
    assert bounces.body.position.x < 0.3


@pytest.mark.parametrize("varies", [False, True])
@pytest.mark.parametrize("dt", [1 / 240, 1 / 960])
def test_a_spring_pulls_a_ball(dt: float, varies: bool) -> None:
    space, table = plane(deceleration=0.0)
    bob = ball(table, 0.5)
    stiffness = 5.0
    spring = pymunk.DampedSpring(
        space.static_body, bob.body, (0, 0), (0, 0), rest_length=0.0, stiffness=stiffness, damping=0
    )
    space.add(spring)
    period = math.tau / math.sqrt(stiffness / M)
    for k in range(round(0.4 * period / dt)):
        space.step(dt * (1.0 + 0.5 * (-1) ** k) if varies else dt)
    exact = 0.5 * math.cos(math.tau * table.time / period)
    assert bob.body.position.x == pytest.approx(exact, abs=3.0 * dt)


def test_a_joint_holds_a_ball() -> None:
    space, table = plane(deceleration=0.0)
    held = ball(table, 0.5)
    space.add(pymunk.PinJoint(space.static_body, held.body, (0, 0), (0, 0)))
    held.body.velocity = (0.0, 1.0)
    steps(space, 2.0)
    assert math.hypot(*held.body.position) == pytest.approx(0.5, abs=0.01)
    assert math.hypot(*held.body.velocity) == pytest.approx(1.0, abs=0.02)


def test_gravity_and_forces_act_once_a_step() -> None:
    space, table = plane()
    space.gravity = (0.0, -1.0)
    pushed, falling = ball(table, 0.0), ball(table, 1.0)
    for _ in range(120):
        pushed.body.apply_force_at_world_point((M, M), pushed.body.position)
        space.step(STEP)
    assert falling.body.velocity.y == pytest.approx(-1.0 + A, abs=0.01)
    assert pushed.body.velocity.x == pytest.approx(1.0 - A, abs=0.01)


def test_gravity_is_exact_where_no_friction_slows_balls() -> None:
    """Forces still act at the end of each step; more is in test_gravity.py."""
    space, table = plane(deceleration=0.0)
    space.gravity = (0.0, -1.0)
    falling = ball(table, 0.0)
    steps(space, 2.0)
    assert falling.body.position.y == pytest.approx(-2.0, abs=1e-13)
    assert falling.body.velocity.y == pytest.approx(-2.0, abs=1e-13)


@pytest.mark.parametrize(("share", "moves"), [(0.999, False), (1.001, True)])
@pytest.mark.parametrize("rolling", [None, 0.1])
def test_friction_holds_a_ball_up_to_what_it_takes(
    rolling: float | None, share: float, moves: bool
) -> None:
    """A sphere that is to roll at once needs 7/5 of the deceleration of rolling, a disc that of A.

    It gets 5/7 of a push, and rolling friction acts against that.
    """
    space, table = plane(rolling=rolling)
    one = ball(table, 0.0)
    space.gravity = (share * (A if rolling is None else 1.4 * rolling), 0.0)
    steps(space, 1.0)
    assert (one.body.position.x > 0.0) == moves


def test_damping_of_the_space_acts_on_balls() -> None:
    space, table = plane(deceleration=0.0)
    space.damping = 0.5
    one = ball(table, 0.0)
    table.strike(one, (1.0, 0.0))
    steps(space, 1.0)
    assert table.save_state().motions[one.number][2] == pytest.approx(0.5, abs=1e-9)


def test_a_velocity_or_place_set_by_hand_counts_from_the_next_step() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    one.body.velocity = (1.0, 0.0)
    steps(space, 8.0)
    assert one.body.position.x == pytest.approx(1 / (2 * A), abs=1e-12)
    one.body.position = (-1.0, 0.5)
    one.body.apply_impulse_at_local_point((0.0, M))
    steps(space, 8.0)
    assert tuple(one.body.position) == pytest.approx((-1.0, 0.5 + 1 / (2 * A)), abs=1e-9)


def test_a_velocity_function_of_ones_own_acts_at_each_step() -> None:
    space, table = plane(deceleration=0.0)
    one = ball(table, 0.0)

    def drift(body: pymunk.Body, gravity: Any, damping: float, dt: float) -> None:
        body.velocity = (body.velocity.x + 1.0 * dt, 0.0)

    one.body.velocity_func = drift
    steps(space, 1.0)
    assert one.body.velocity.x == pytest.approx(1.0, abs=0.02)


def test_a_position_function_of_ones_own_is_refused() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    one.body.position_func = lambda body, dt: None
    with pytest.raises(ValueError, match=r"^ball 0: position_func = .*a function of your own"):
        table.strike(one, (1.0, 0.0))
    with pytest.raises(ValueError, match=r"^ball 0: position_func = "):
        space.step(STEP)


def test_a_body_may_turn() -> None:
    space, table = plane()
    one, other = ball(table, 0.0), ball(table, 0.4)
    one.body.angular_velocity = 3.0
    table.strike(one, (2.0, 0.0))
    steps(space, 1.0)
    assert one.body.angle == pytest.approx(3.0)
    assert other.body.velocity.y == 0.0


CHANGED: dict[str, Callable[[TableBall], object]] = {
    "mass": lambda b: setattr(b.body, "mass", 2.0 * M),
    "radius": lambda b: b.circle.unsafe_set_radius(2.0 * R),
    "offset": lambda b: b.circle.unsafe_set_offset((0.01, 0.0)),
    "filter": lambda b: setattr(b.circle, "filter", pymunk.ShapeFilter(group=1)),
    "body_type": lambda b: setattr(b.body, "body_type", pymunk.Body.KINEMATIC),
}


@pytest.mark.parametrize("what", CHANGED)
def test_a_mass_or_radius_that_changes_later_is_refused(what: str) -> None:
    _, table = plane()
    one = ball(table, 0.0)
    CHANGED[what](one)
    with pytest.raises(ValueError, match=rf"^ball 0: {what} = .*: it was .* when the ball came"):
        table.strike(one, (1.0, 0.0))


def test_bodies_may_fall_asleep() -> None:
    space, table = plane()
    space.sleep_time_threshold = 0.1
    one, other = ball(table, 0.0), ball(table, 0.5)
    steps(space, 1.0)
    table.strike(one, (2.0, 0.0))
    steps(space, 8.0)
    assert other.body.position.x > 1.0


def test_a_ball_taken_out_behind_its_back_is_gone() -> None:
    space, table = plane()
    one, other = ball(table, 0.0), ball(table, 0.3)
    table.strike(one, (1.0, 0.0))
    space.remove(other.circle, other.body)
    steps(space, 8.0)
    assert not other.is_on_table and other.circle.space is None
    assert table.moving == {}
    assert one.body.position.x == pytest.approx(1 / (2 * A), abs=1e-12)


def test_queries_find_balls() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    found = [info.shape for info in space.point_query((0.0, 0.0), 0.0, pymunk.ShapeFilter())]
    assert found == [one.circle]
    with pytest.warns(DeprecationWarning, match="a ball has no sensor any more"):
        assert one.sensor is one.circle
    with pytest.raises(AttributeError, match="no joints any more: the engine slows balls down"):
        _ = table.joints  # type: ignore[attr-defined]


def test_a_second_billiards_is_refused() -> None:
    space, _ = plane()
    with pytest.raises(ValueError, match="space = taken"):
        Billiards(space, STEP, pair=PAIR)


def test_two_spaces_have_a_billiards_each() -> None:
    (space, table), (other_space, other_table) = plane(), plane()
    one, other = ball(table, 0.0), ball(other_table, 0.0)
    table.strike(one, (1.0, 0.0))
    for _ in range(960):
        space.step(STEP)
        other_space.step(STEP)
    assert one.body.position.x == pytest.approx(1 / (2 * A), abs=1e-12)
    assert tuple(other.body.position) == (0.0, 0.0)


def test_a_space_with_threads_is_refused() -> None:
    space = pymunk.Space(threaded=True)
    if space.threaded:  # pymunk has no threads on Windows.
        with pytest.raises(ValueError, match="without threads"):
            Billiards(space, STEP, pair=PAIR)


def test_a_table_may_change_its_thread_between_steps() -> None:
    ends = []
    for is_alone in (True, False):
        space, table = plane()
        one, _ = ball(table, 0.0), ball(table, 0.5)
        table.strike(one, (1.0, 0.05))
        for _ in range(60):
            if is_alone:
                space.step(STEP)
            else:
                other = Thread(target=space.step, args=(STEP,))
                other.start()
                other.join()
        ends.append([tuple(each.body.position) for each in table.balls])
    assert ends[0] == ends[1]


def test_a_copy_of_the_space_is_refused() -> None:
    space, _ = plane()
    for attempt in (pickle.dumps, copy.deepcopy, pymunk.Space.copy):
        with pytest.raises(TypeError, match="use save_state and restore_state"):
            attempt(space)
