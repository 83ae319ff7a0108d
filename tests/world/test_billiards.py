"""Billiards is right in people's worlds, or refuses in one sentence what it cannot do."""

from __future__ import annotations

import itertools
import math
import pickle
import random
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, Pair, same_balls
from pool_pymunk.core.walls.arc import Arc
from pool_pymunk.world import TableBall
from tests.shared.worlds import PAIR, STEP, A, M, Point, R, ball, heard_by, hexagon, plane, steps


def places(balls: list[TableBall]) -> list[tuple[float, float]]:
    return [(each.body.position.x, each.body.position.y) for each in balls]


BODIES: list[pymunk.Body] = []  # A shape of pymunk's does not keep its body alive.


def circle_at(x: float) -> pymunk.Circle:
    """Return the circle of a ball that is not on the table yet."""
    body = pymunk.Body(M, 1e-4)
    BODIES.append(body)
    body.position = (x, 0.0)
    return pymunk.Circle(body, R)


def apart(one: list[tuple[float, float]], other: list[tuple[float, float]]) -> float:
    return max(math.dist(p, q) for p, q in zip(one, other, strict=True))


# -- what else acts on balls -----------------------------------------------------------------------


def test_forces_act_on_a_body_that_was_in_the_space_before() -> None:
    space = pymunk.Space()
    body = pymunk.Body(M, 1e-4)
    circle = pymunk.Circle(body, R)
    space.add(body, circle)
    mover = Billiards(space, STEP, pair=PAIR).add_ball(circle)
    for _ in range(60):
        body.apply_force_at_world_point((M, 0.0), body.position)
        space.step(STEP)
    assert mover.path.vx == pytest.approx(1.0, abs=1e-9)


def test_a_filter_lets_balls_through_each_other() -> None:
    space, table = plane()
    met = heard_by(table)
    balls = []
    for k, bits in enumerate((0b01, 0b10, 0b11)):
        body = pymunk.Body(M, 1e-4)
        body.position = (0.2 * k, 0.0)
        circle = pymunk.Circle(body, R)
        circle.filter = pymunk.ShapeFilter(categories=bits, mask=bits)
        balls.append(table.add_ball(circle))
    table.strike(balls[0], (1.0, 0.0))
    steps(space, 4.0)
    assert [contact.balls for contact in met] == [(balls[0], balls[2])]


# -- coming and going ------------------------------------------------------------------------------


def test_a_body_may_be_a_ball_again_after_it_was_removed() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    table.remove_ball(one)
    one.body.position = (1.0, 0.0)
    again = table.add_ball(one.circle)
    assert (one.number, again.number, again.is_on_table) == (0, 1, True)
    assert "its body is that of ball 1 now" in said(lambda: table.place(one, (1.0, 1.0)))
    table.clear()
    assert not again.is_on_table
    assert not [body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC]


def test_undo_brings_a_ball_back_with_its_own_shapes_alone() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    extra = pymunk.Circle(one.body, 0.01, (0.0, 0.01))
    extra.sensor = True
    space.add(extra)
    shapes = set(space.shapes)
    saved = table.save_state()
    table.remove_ball(one)
    table.add_ball(pymunk.Circle(one.body, R))
    table.restore_state(saved)
    assert one.is_on_table
    assert set(space.shapes) == shapes


RAILS = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
ELL = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.8, 1.0), (0.8, 2.0), (0.0, 2.0))


def walled(corners: tuple[Point, ...], how: str) -> Billiards:
    """Return a table with walls of some kind, perhaps with gaps at the corners or an obstacle."""
    space, table = plane()
    gap = 0.1 if how == "gaps" else 0.0
    for (x, y), (u, v) in itertools.pairwise([*corners, corners[0]]):
        length = math.dist((x, y), (u, v))
        dx, dy = gap * (u - x) / length, gap * (v - y) / length
        ends = (x + dx, y + dy), (u - dx, v - dy)
        out = (0.1 * (v - y) / length, -0.1 * (u - x) / length)
        block = [*ends, *((a + out[0], b + out[1]) for a, b in ends)]
        shape = (
            pymunk.Poly(space.static_body, block)
            if how == "blocks"
            else pymunk.Segment(space.static_body, *ends, 0.005)
        )
        table.add_wall(shape, 0.8)
    if how == "obstacle":
        table.add_wall(pymunk.Circle(space.static_body, 0.15, (0.5, 0.5)), 0.8)
    return table


@pytest.mark.parametrize("how", ["rails", "gaps", "blocks", "obstacle"])
@pytest.mark.parametrize("corners", [RAILS, ELL], ids=["rectangle", "L"])
def test_a_ball_is_not_placed_off_a_bounded_table(corners: tuple[Point, ...], how: str) -> None:
    table = walled(corners, how)
    one = ball(table, 0.2, 0.2)
    for place in ((1.9, 0.5), (0.1, 0.1), (0.5, 0.69), (0.31, 0.5), (1.0, 0.06)):
        table.place(one, place)  # Beside gaps and obstacles there is room, too.
    for off in ((2.3, 0.5), (5.0, 7.0), (-0.3, -0.3), (1.0, 1.4), (0.4, 2.3)):
        assert said(partial(table.place, one, off)) == (
            f"position = {list(off)}: the ball would lie off the table"
        )
    assert one.body.position == (1.0, 0.06)


@pytest.mark.parametrize("corners", [RAILS, ELL], ids=["rectangle", "L"])
def test_a_ball_is_not_added_outside_of_walls_that_hold_all_others(
    corners: tuple[Point, ...],
) -> None:
    table = walled(corners, "rails")
    slope = pymunk.Segment(table.space.static_body, (0.6, 0.4), (0.9, 0.5), 0.0)
    table.add_wall(slope, 0.5)  # It has free ends.
    one, other = ball(table, 0.2, 0.2), ball(table, 0.4, 0.2)
    table.remove_ball(other)
    for off in ((2.3, 0.5), (5.0, 7.0), (-0.3, -0.3), (0.4, 2.3), (1.0, -0.1)):
        for come in (partial(ball, table, *off), partial(table.place, other, off)):
            assert said(come) == f"position = {list(off)}: the ball would lie off the table"
    assert table.on_table == [one] and len(table.space.shapes) == len(table.walls) + 1
    ball(table, 1.9, 0.9 if corners is RAILS else 0.5)


@pytest.mark.parametrize(
    "how", ["no ball", "a ball outside", "a gap", "no lid", "a lid that moves"]
)
def test_a_ball_may_come_from_outside_of_an_open_table(how: str) -> None:
    space, table = plane()
    corners = [(0.0, 1.0), (0.0, 0.0), (0.3, 0.0), (0.3, 1.0)]
    for a, b in itertools.pairwise(corners):
        table.add_wall(pymunk.Segment(space.static_body, a, b, 0.0), 0.8)
    if how == "a ball outside":
        ball(table, 3.0)
    if how != "no lid":
        lid = pymunk.Body(body_type=pymunk.Body.KINEMATIC if "moves" in how else pymunk.Body.STATIC)
        start = 0.1 if how == "a gap" else 0.0
        table.add_wall(pymunk.Segment(lid, (start, 1.0), (0.3, 1.0), 0.0), 0.8)
    if how != "no ball":
        ball(table, 0.15, 0.05)
    ball(table, 0.15, 1.5)


@pytest.mark.parametrize("corners", [RAILS, ELL], ids=["rectangle", "L"])
@pytest.mark.parametrize("how", ["rails", "gaps", "blocks"])
def test_a_free_spot_near_a_wall_is_one_that_place_takes(
    corners: tuple[Point, ...], how: str
) -> None:
    table = walled(corners, how)
    one = ball(table, 0.2, 0.2)
    own = corners[:1] if how == "gaps" else corners  # Other gaps are off the table.
    for out in (0.0, 0.02) if how == "gaps" else (0.0,):  # a pocket behind the gap, too
        hole = table.add_pocket((-out, -out), 0.075)
        for x, y in (*own, (1.0, 0.0), (1.0, -0.003), (0.0, 0.7), (-0.003, 0.7), (0.0, 1e-4)):
            for near in ((x, y), (x + 0.001, y - 0.001)):
                for whose in (None, one):
                    table.place(one, table.free_spot(near, ball=whose))
                    table.place(one, (0.2, 0.2))
        table.remove_pocket(hole)


def test_a_ball_that_is_put_on_a_corner_by_hand_lies_on_the_table() -> None:
    table = walled(RAILS, "rails")
    one = ball(table, 0.2, 0.2)
    one.body.position = (0.0, 0.0)
    table.step(STEP)
    assert one.body.position == pytest.approx((0.035, 0.035))


def test_a_ball_is_placed_between_round_ends_of_ones_own() -> None:
    """Their shapes are discs that overlap, which tell nothing of what lies within the table."""
    space, table = plane(deceleration=0.1)
    for y in (-0.5, 0.5):
        table.add_wall(pymunk.Segment(space.static_body, (-0.1, y), (0.1, y), 0.0), 0.8)
    for x, first, last in ((-0.1, (0.0, 1.0), (0.0, -1.0)), (0.1, (0.0, -1.0), (0.0, 1.0))):
        disc = pymunk.Circle(space.static_body, 0.5, (x, 0.0))
        disc.sensor = True
        side: Any = Arc((x, 0.0), 0.5, first, last, -1.0)
        table.add_wall(disc, 0.8, sides=(side,))
    one = ball(table, -0.55)
    table.place(one, (0.0, 0.0))
    assert one.body.position == (0.0, 0.0)
    one.body.velocity, far = (2.0, 0.0), 0.0
    for _ in range(60):  # It met the discs in place of the arcs, and stood still at once.
        table.step(STEP)
        far = max(far, abs(one.body.position.x))
    assert 0.5 < far < 0.6 - R


def test_a_ball_that_was_put_aside_comes_to_the_table() -> None:
    table = walled(RAILS, "rails")
    aside = ball(table, -1.0)
    table.place(aside, (-2.0, 0.0))
    table.place(aside, (1.0, 0.5))
    assert aside.body.position == (1.0, 0.5)


# -- undo and looking ahead ------------------------------------------------------------------------


def test_a_saved_state_comes_back_with_everybody_in_it() -> None:
    space, table = hexagon()
    balls = [ball(table, -0.5 + 0.2 * k, 0.4) for k in range(5)]
    table.add_pocket((0.5, -0.1), 0.1)
    table.strike(balls[0], (2.0, -0.3))
    steps(space, 0.5)
    saved = table.save_state()
    table.strike(balls[2], (1.5, -1.3))
    ends = []
    for _ in range(3):
        steps(space, 8.0)
        ends.append((places(balls), [each.is_on_table for each in balls]))
        extra = ball(table, -0.8, 0.0)
        table.restore_state(saved)
        assert table.time == 0.5
        assert not extra.is_on_table
        assert all(each.is_on_table for each in balls)
        table.strike(balls[2], (1.5, -1.3))
    assert not all(ends[0][1])
    for positions, there in ends[1:]:
        assert apart(positions, ends[0][0]) < 1e-9
        assert there == ends[0][1]


def test_the_aiming_line_is_where_the_balls_go() -> None:
    space, table = hexagon()
    cue, target = ball(table, -0.3), ball(table, 0.2, 0.02)
    seen = table.predict(cue, (2.0, 0.0))
    assert seen.met is target
    assert seen.wall is seen.pocket is None
    met = heard_by(table)
    table.strike(cue, (2.0, 0.0))
    while not met:
        space.step(STEP)
    assert met[0].t == pytest.approx(seen.t, abs=1e-12)
    start, ghost, _ = seen.way
    assert start == (-0.3, 0.0)
    assert math.dist(ghost, (0.2, 0.02)) == pytest.approx(2 * R, abs=1e-12)
    assert seen.other_way[0] == (0.2, 0.02)
    steps(space, 0.05)
    (x, y), (dx, dy) = target.body.position, seen.other_way[1]
    assert math.atan2(y - 0.02, x - 0.2) == pytest.approx(math.atan2(dy - 0.02, dx - 0.2), abs=1e-9)


@pytest.mark.parametrize(
    ("velocity", "wall", "pocket"), [((0.0, 2.0), 1, None), ((2.0, 0.0), None, 0)]
)
def test_the_aiming_line_to_a_wall_or_a_pocket(
    velocity: tuple[float, float], wall: int | None, pocket: int | None
) -> None:
    _, table = hexagon()
    table.add_pocket((0.5, 0.0), 0.1)
    cue = ball(table, 0.0)
    seen = table.predict(cue, velocity)
    assert (seen.met, seen.wall, seen.pocket) == (None, wall, pocket)
    assert table.save_state().motions[cue.number] == (0.0, 0.0, 0.0, 0.0)


def test_nothing_is_met_on_an_empty_plane() -> None:
    _, table = plane()
    seen = table.predict(ball(table, 0.0), (1.0, 0.0))
    assert seen[:4] == (None, None, None, math.inf)
    assert seen.way[1] == pytest.approx((1 / (2 * A), 0.0))


# -- what cannot be --------------------------------------------------------------------------------


def said(attempt: Callable[[], object]) -> str:
    """Return the one line in which an attempt is refused."""
    with pytest.raises(ValueError) as caught:
        attempt()
    line = str(caught.value)
    assert "\n" not in line
    return line


def test_a_ball_twice_or_in_another_one() -> None:
    _, table = plane()
    one = ball(table, 0.0)
    assert said(lambda: table.add_ball(one.circle)).startswith("circle = taken")
    assert said(lambda: table.add_ball(pymunk.Circle(one.body, R))) == (
        "circle = taken: this body is a ball already"
    )
    deep = "the ball overlaps ball 0 by 0.01 (0.33 radii)"
    assert said(lambda: ball(table, 0.05)) == f"position = [0.05, 0.0]: {deep}"
    other = ball(table, 1.0)
    assert said(lambda: table.place(other, (0.05, 0.0))) == f"position = [0.05, 0.0]: {deep}"
    one.id = "8"
    assert 'overlaps ball 0 (id "8") by' in said(lambda: ball(table, 0.05))
    body: Any = one.body
    assert said(lambda: table.add_ball(body)).endswith("a ball must be a pymunk.Circle")


@pytest.mark.parametrize("far", [0.0, 0.1, 0.2])
def test_a_small_ball_in_a_large_one_is_refused_wherever_it_is(far: float) -> None:
    _, table = plane()
    body = pymunk.Body(M, 1e-4)
    table.add_ball(pymunk.Circle(body, 0.2))
    assert "the ball overlaps ball 0 by" in said(lambda: ball(table, far))
    assert ball(table, 0.2 + R + 1e-6).number == 1


def test_a_ball_within_a_pocket_or_a_wall() -> None:
    """It would lie there for ever, or go through the wall."""
    space, table = hexagon()
    table.add_pocket((0.5, 0.0), 0.1)
    resting = ball(table, 0.0)
    for attempt in (lambda: ball(table, 0.45), lambda: table.place(resting, (0.45, 0.0))):
        assert said(attempt) == (
            "position = [0.45, 0.0]: the ball is within pocket 0 by 0.05 (1.7 radii)"
        )
    edge = math.sqrt(0.75)
    ball(table, 0.0, edge - R)  # It touches the wall.
    for attempt in (lambda: ball(table, 0.1, edge), lambda: table.place(resting, (0.1, edge))):
        deep = "the ball overlaps wall 1 by 0.03 (1 radii)"
        assert said(attempt) == f"position = [0.1, {edge}]: {deep}"
    assert said(lambda: table.add_pocket((0.0, 0.02), 0.05)) == (
        "position = [0.0, 0.02]: a ball lies within this pocket"
    )
    steps(space, 0.1)
    assert resting.is_on_table


WALLS: dict[str, tuple[Callable[[pymunk.Body], pymunk.Shape], str]] = {
    "segment through": (lambda b: pymunk.Segment(b, (0, -1), (0, 1), 0), "0.03 (1 radii)"),
    "segment at its rim": (lambda b: pymunk.Segment(b, (0.02, -1), (0.02, 1), 0), "0.01 (0.33 "),
    "segment that ends in it": (lambda b: pymunk.Segment(b, (0.01, 0), (1, 0), 0), "0.02"),
    "circle around it": (lambda b: pymunk.Circle(b, 0.5), "0.53 (18"),
    "polygon around it": (lambda b: pymunk.Poly.create_box(b, (1, 1)), "0.53 (18"),
}


@pytest.mark.parametrize("moved", [0.0, 0.3])
@pytest.mark.parametrize("name", WALLS)
def test_a_wall_in_a_ball_is_refused(name: str, moved: float) -> None:
    """Nothing of it stays; where it touches the ball alone, it is put up."""
    space, table = plane()
    make, deep = WALLS[name]
    carrier = pymunk.Body(body_type=pymunk.Body.STATIC)
    carrier.position = moved, 0.0
    ball(table, 1.5)
    ball(table, moved)
    shapes = len(space.shapes)
    shape = make(carrier)
    line = said(lambda: table.add_wall(shape, 0.8))
    assert line.startswith(f"shape = {type(shape).__name__}: ball 1 overlaps this wall by {deep}")
    assert len(space.shapes) == shapes
    assert shape.filter == pymunk.ShapeFilter()
    space.add(carrier)
    touches = pymunk.Segment(carrier, (-R, -1), (-R, 1), 0)
    assert table.add_wall(touches, 0.8) == 0


def test_balls_may_have_ids() -> None:
    _, table = plane()
    eight, other = table.add_ball(circle_at(0.0), id="8"), table.add_ball(circle_at(1.0))
    assert (eight.id, other.id) == ("8", None)
    assert said(lambda: table.add_ball(circle_at(2.0), id="8")) == (
        "id = 8: another ball on the table has this id"
    )
    assert said(lambda: table.add_ball(circle_at(2.0), id=8)) == "id = 8: must be a text"  # type: ignore[arg-type]
    assert table.count == 2
    table.remove_ball(eight)
    assert table.add_ball(eight.circle, id="8").number == 2


def test_pair_finds_a_ball_that_is_being_added() -> None:
    """It may look at both balls; one that it refuses is no ball."""

    def pair(i: int, j: int) -> Pair:
        a, b = table.balls[i], table.balls[j]
        asked.append((a.id, b.id))
        return Pair(a.body.mass, b.body.mass, 1.5 if b.id == "refused" else 0.9, 0.05)

    asked = list[tuple[str | None, str | None]]()
    _, table = plane(pair=pair)
    table.add_ball(circle_at(0.0), id="first")
    table.add_ball(circle_at(1.0), id="second")
    assert "restitution = 1.5" in said(lambda: table.add_ball(circle_at(2.0), id="refused"))
    assert asked == [("first", "second"), ("first", "refused")]
    assert [each.id for each in table.balls] == ["first", "second"]


def test_ctrl_c_in_a_step_leaves_bodies_where_their_balls_are() -> None:
    """It may come at any moment; the table goes on from there, and ends as if nothing had been."""

    def played(raise_at: int) -> tuple[list[Point], bool]:
        space, table = hexagon()
        balls = [ball(table, -0.3, 0.01, (3.0, 0.0)), ball(table, 0.0), ball(table, 0.5, 0.2)]
        mallet = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        mallet.position, mallet.velocity = (-0.6, 0.4), (0.3, 0.0)
        table.add_wall(pymunk.Circle(mallet, 0.05), 0.9, 0.1)
        steps(space, 0.1)
        calls, interrupted = itertools.count(), False

        def interrupt(frame: object, event: str, argument: object) -> None:
            if event == "call" and next(calls) == raise_at:
                sys.setprofile(None)
                raise KeyboardInterrupt

        sys.setprofile(interrupt)
        try:
            space.step(STEP)
        except KeyboardInterrupt:
            interrupted = True
            now = table.save_state()
            for each in balls:
                assert each.body.position == pytest.approx(now.motions[each.number][:2], abs=1e-12)
            assert mallet.position.x == pytest.approx(-0.6 + 0.3 * table.time, abs=1e-12)
        finally:
            sys.setprofile(None)
        while table.time < 0.5 - 1e-9:
            space.step(min(STEP, 0.5 - table.time))
        return places(balls), interrupted

    (whole, _), moments = played(-1), 0
    for k in itertools.count(0, 5):
        ends, was_interrupted = played(k)
        assert apart(ends, whole) < 1e-9
        moments += was_interrupted
        if not was_interrupted and k > 5 * (moments + 5):
            break
    assert moments > 20


def test_calls_that_make_no_sense() -> None:
    """What makes no sense on any table stands in data/refusals.txt."""
    _, table = plane()
    one = ball(table, 0.0)
    assert said(lambda: table.strike(one, (math.nan, 0.0))).startswith("velocity = [nan, 0.0]")
    table.remove_ball(one)
    assert said(lambda: table.strike(one, (1.0, 0.0))) == (
        "ball = 0: the ball is off the table: place(ball, position) puts it back"
    )


def test_the_same_balls_can_be_pickled() -> None:
    pair = same_balls(0.9, 0.05, mass=0.2)
    assert pickle.loads(pickle.dumps(pair))(0, 1) == pair(0, 1)


# -- others in the space ---------------------------------------------------------------------------

ACTS: dict[str, Callable[[pymunk.Space, pymunk.Body], object]] = {
    "nothing": lambda space, body: None,
    "gravity": lambda space, body: setattr(space, "gravity", (0.0, -0.5)),
    "damping": lambda space, body: setattr(space, "damping", 0.9),
    "force": lambda space, body: body.apply_force_at_world_point((0.1, 0.0), body.position),
}


def with_company(company: str, acts: str, is_ball: bool) -> tuple[float, float]:
    """Return where a ball ends that meets others; or a disc of stock pymunk does instead of it."""
    space = pymunk.Space()
    space.collision_slop = 0.0
    body = pymunk.Body(M, math.inf)
    disc = pymunk.Circle(body, R)
    body.velocity, disc.elasticity = (1.0, 0.0), 0.5
    if is_ball:
        Billiards(space, 1 / 240, pair=PAIR).add_ball(disc)
    else:
        space.add(body, disc)
    other = pymunk.Body(M, math.inf)
    other.position = 0.4, 0.0
    box = pymunk.Poly.create_box(other, (0.1, 0.4))
    floor = pymunk.Segment(space.static_body, (-9.0, -0.2), (9.0, -0.2), 0.01)
    box.elasticity = floor.elasticity = 0.5
    if company == "box":
        space.add(other, box)
    elif company == "floor":
        space.add(floor)
    elif company == "pivot":
        body.position = 0.1, 0.0
        space.add(pymunk.PinJoint(space.static_body, body))
    for _ in range(240):
        ACTS[acts](space, body)
        space.step(1 / 240)
    x, y = body.position
    return x, y


@pytest.mark.parametrize("acts", ACTS)
@pytest.mark.parametrize("company", ["nobody", "box", "floor", "pivot"])
def test_others_and_forces_act_on_a_ball_as_on_any_disc(company: str, acts: str) -> None:
    ours, stock = (with_company(company, acts, is_ball) for is_ball in (True, False))
    assert math.dist(ours, stock) < 0.02


def test_a_contact_event_says_where_and_how_fast() -> None:
    space, table = plane()
    one, other = ball(table, 0.0), ball(table, 0.2)
    heard = heard_by(table)
    table.strike(one, (1.0, 0.0))
    steps(space, 1.0)
    [event] = heard
    assert event.balls == (one, other)
    assert event.point == pytest.approx((0.2 - R, 0.0))
    assert event.normal == pytest.approx((1.0, 0.0))
    assert event.closing == pytest.approx(math.sqrt(1.0 - 2 * A * (0.2 - 2 * R)))
    assert event.impulse == pytest.approx(M / 2 * 1.95 * event.closing)  # e = 0.95


@pytest.mark.parametrize("how", ["restore_state", "place"])
@pytest.mark.parametrize("obstacle", ["wall", "pocket", "ball"])
def test_what_was_near_before_an_undo_is_met_after_it(how: str, obstacle: str) -> None:
    space, table = plane()
    one = ball(table, 0.4)
    if obstacle == "wall":
        table.add_wall(pymunk.Segment(space.static_body, (0.5, -1), (0.5, 1), 0), 0.8, 0.1)
    elif obstacle == "pocket":
        table.add_pocket((0.5, 0.0), 0.05)
    else:
        ball(table, 0.5)
    start = table.save_state()
    table.strike(one, (2.0, 0.0))
    space.step(STEP)
    if how == "restore_state" or not one.is_on_table:
        table.restore_state(start)
    else:
        if obstacle == "ball":
            table.place(table.balls[1], (0.5, 0.0))
        table.place(one, (0.4, 0.0))
    met: list[object] = []
    table.on_contact = met.append
    table.on_pocket = lambda *said: met.append(said)
    table.strike(one, (2.0, 0.0))
    for _ in range(100):
        space.step(STEP)
    assert met
    assert one.body.position.x < 0.6


def test_a_state_can_be_pickled() -> None:
    space, table = hexagon()
    one = ball(table, 0.0)
    table.strike(one, (1.0, 0.3))
    steps(space, 0.3)
    kept, before = pickle.dumps(table.save_state()), places([one])
    steps(space, 1.0)
    table.restore_state(pickle.loads(kept))
    assert apart(places([one]), before) < 1e-15


def test_the_nearest_free_spot_is_the_nearest() -> None:
    space, table = plane()
    table.add_wall(pymunk.Segment(space.static_body, (1, -1), (1, 1), 0.0), 0.8)
    table.add_wall(pymunk.Circle(space.static_body, 0.2, (0.0, 0.8)), 0.8)
    balls = [ball(table, 0.055 * k, 0.035 * (k % 2)) for k in range(4)]
    rnd = random.Random(3)

    def is_free(spot: tuple[float, float]) -> bool:
        return (
            all(math.dist(spot, each.body.position) >= 2 * R for each in balls)
            and math.dist(spot, (0.0, 0.8)) >= 0.2 + R
            and abs(spot[0] - 1.0) >= R
        )

    for near in ((0.08, 0.02), (1.0, 0.0), (0.99, 0.2), (0.0, 0.8), (0.1, 0.1)):
        spot = table.free_spot(near)
        assert is_free(spot)
        for _ in range(3000 if spot != near else 0):
            turn, far = rnd.uniform(0.0, math.tau), 0.999 * rnd.uniform(0.0, math.dist(near, spot))
            assert not is_free((near[0] + far * math.cos(turn), near[1] + far * math.sin(turn)))
    assert table.free_spot((0.0, 0.0), ball=balls[0]) == (0.0, 0.0)
    assert table.pockets == {}


def test_there_is_no_room_within_a_wall() -> None:
    space, table = plane()
    table.add_wall(pymunk.Poly.create_box(space.static_body, (1.0, 1.0)), 0.8)
    deep = "the ball overlaps wall 0 by 0.43 (14 radii)"
    assert said(lambda: ball(table, 0.1)) == f"position = [0.1, 0.0]: {deep}"
    assert table.free_spot((0.1, 0.0), R) == pytest.approx((0.53, 0.0))
    _, closed = hexagon()
    assert "there is no room" in said(lambda: closed.free_spot((0.0, 0.0), 2.0))


@pytest.mark.parametrize("balls", [1, 2])
def test_a_heavy_box_pushes_no_ball_into_a_wall_or_another_ball(balls: int) -> None:
    space, table = plane(max_dt=1 / 240)
    table.add_wall(pymunk.Segment(space.static_body, (0, -1), (0, 1), 0), 0.75, 0.1)
    row = [ball(table, -0.1 - 0.07 * k) for k in range(balls)]
    body = pymunk.Body(5.0, math.inf)
    body.position, body.velocity = (-0.5, 0.0), (1.0, 0.0)
    space.add(body, pymunk.Poly.create_box(body, (0.1, 0.4)))
    for _ in range(480):
        space.step(1 / 240)
        assert all(each.body.position.x < -0.9 * R for each in row)
        gaps = [math.dist(p, q) for p, q in itertools.pairwise(places(row))]
        assert all(gap > 1.9 * R for gap in gaps)


def test_a_shape_tells_its_ball() -> None:
    space, table = plane()
    one = ball(table, 0.0)
    assert table.ball_of(one.circle) is one
    assert table.ball_of(pymunk.Circle(space.static_body, 1.0)) is None
