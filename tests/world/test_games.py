"""A table is what a game asks for: balls come back, the cloth changes, an opponent looks ahead."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import pymunk
import pytest

from pool_pymunk import Billiards, Table, simulate
from pool_pymunk.laws.contact import Pair
from pool_pymunk.world import TableState
from tests.shared.worlds import PAIR, Point, R, ball, fence, plane

WIDE: list[Point] = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]
CORNERED: list[Point] = [*WIDE[:3], (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]


def walled(corners: list[Point] = WIDE, radius: float = 0.0, **settings: Any) -> Billiards:
    """Return a table with walls all around."""
    _, table = plane(**{"deceleration": 2.0, "rolling": 0.1, **settings})
    fence(table, corners, radius, 0.8, 0.1)
    return table


def play(table: Billiards, steps: int = 600) -> None:
    for _ in range(steps):
        table.space.step(table.max_dt)


# -- balls that come back --------------------------------------------------------------------------


def test_a_pocketed_ball_that_is_placed_is_the_same_ball() -> None:
    table = walled()
    hole = table.add_pocket((1.5, 0.5), 0.05)
    cue = ball(table, 0.5, 0.5)
    cue.data = "mine"
    table.strike(cue, (3.0, 0.0))
    play(table, 60)
    assert not cue.is_on_table
    table.remove_pocket(hole)
    table.place(cue, (0.5, 0.5))
    assert (cue.is_on_table, cue.number, table.count, cue.data) == (True, 0, 1, "mine")
    table.strike(cue, (3.0, 0.0))
    play(table)
    assert cue.is_on_table
    assert cue.body.position.x < 1.97


def test_a_callback_puts_the_cue_ball_back_at_once() -> None:
    """Another ball that moves then hits it there."""
    table = walled()
    table.add_pocket((1.5, 0.5), 0.05)
    cue, other = ball(table, 0.5, 0.5), ball(table, 0.3, 0.2)
    fallen = []

    def put_back(one: Any, pocket: int, t: float) -> None:
        fallen.append((one.number, pocket))
        table.place(one, (0.9, 0.2))

    table.on_pocket = put_back
    table.strike(cue, (3.0, 0.0))
    table.strike(other, (0.9, 0.0), 1.0)
    play(table)
    assert fallen == [(0, 0)]
    assert cue.body.position.x > 1.0  # The other ball has hit it.


def test_a_removed_ball_comes_back_unless_its_circle_or_its_id_is_another_balls() -> None:
    table = walled()
    body = pymunk.Body(0.2, math.inf)
    body.position = (0.5, 0.5)
    one = table.add_ball(pymunk.Circle(body, R), id="8")
    table.remove_ball(one)
    with pytest.raises(ValueError, match="the ball is off the table: place"):
        table.strike(one, (1.0, 0.0))
    again = table.add_ball(one.circle)
    with pytest.raises(ValueError, match="its body is that of ball 1 now"):
        table.place(one, (0.7, 0.5))
    table.remove_ball(again)
    twin = ball(table, 1.5, 0.5)
    with pytest.raises(ValueError, match="overlaps ball 2"):
        table.place(one, (1.5, 0.52))
    assert not one.is_on_table
    table.place(one, (0.7, 0.5))
    assert [each.number for each in table.on_table] == [twin.number, one.number]


# -- walls, pockets, what is heard -----------------------------------------------------------------


def test_walls_and_pockets_keep_their_numbers() -> None:
    table = walled()
    assert list(table.walls) == [0, 1, 2, 3]
    assert all(isinstance(shape, pymunk.Segment) for shape in table.walls.values())
    first, second = table.add_pocket((0.5, 0.5), 0.05), table.add_pocket((1.5, 0.5), 0.05)
    table.remove_pocket(first)
    assert list(table.pockets) == [second]
    assert table.add_pocket((1.0, 0.5), 0.05) == 2
    with pytest.raises(ValueError, match="pocket = 0: there is no pocket of this number"):
        table.remove_pocket(first)
    assert list(table.walls) == [0, 1, 2, 3]


def test_a_table_without_balls_may_change() -> None:
    table = walled()
    post = pymunk.Circle(table.space.static_body, 0.05, (1.0, 0.5))
    table.remove_wall(table.add_wall(post, 0.5))
    table.deceleration, table.rolling = 1.0, None
    table.clear()
    assert list(table.walls) == [0, 1, 2, 3]


def test_slow_hits_are_not_told() -> None:
    heard: dict[float, list[float]] = {0.0: [], 3.2: []}
    for least, speeds in heard.items():
        table = walled(rolling=None)
        one, _ = ball(table, 0.5, 0.5), ball(table, 1.5, 0.56)
        table.least_closing = least
        table.on_contact = lambda event, speeds=speeds: speeds.append(event.closing)
        table.strike(one, (4.0, 0.3))
        play(table)
    assert heard[3.2] == [speed for speed in heard[0.0] if speed >= 3.2]
    assert 0 < len(heard[3.2]) < len(heard[0.0])
    with pytest.raises(ValueError, match="least_closing = -1"):
        table.least_closing = -1


# -- another cloth ---------------------------------------------------------------------------------


def test_the_cloth_may_change_in_play() -> None:
    """A ball of 1 m/s slides at 2 m/s^2 for 0.2 s, at 0.5 m/s^2 for 0.2 s, and on at 1 m/s^2."""
    _, table = plane(deceleration=2.0, max_dt=0.01)
    one = ball(table, 0.0)
    table.strike(one, (1.0, 0.0))
    for pull in (0.5, 1.0, 1.0):
        for _ in range(20):
            play(table, 1)
            place, _ = one.path.at(table.time)
            assert math.dist(one.body.position, place) < 1e-12  # in the midst of a slide, too
        table.deceleration = pull
    play(table, 100)
    slid = (1.0 - 0.6**2) / 4.0 + (0.6**2 - 0.5**2) / 1.0 + 0.5**2 / 2.0
    assert one.body.position.x == pytest.approx(slid, abs=1e-12)
    assert not table.moving


def test_a_swept_ball_rolls_on_farther_and_no_roll_is_lost() -> None:
    _, table = plane(deceleration=2.0, rolling=0.2, max_dt=0.01)
    one = ball(table, 0.0)
    table.strike(one, (1.0, 0.0), 1.0)
    play(table, 100)
    table.rolling = 0.1
    assert table.rolling == 0.1
    play(table, 1000)
    assert one.body.position.x == pytest.approx(0.9 + 0.8**2 / 0.2, abs=1e-12)
    with pytest.raises(ValueError, match=r"rolling = 3.0: must not be above"):
        table.rolling = 3.0
    with pytest.raises(ValueError, match="deceleration = -1"):
        table.deceleration = -1


def test_a_pressed_row_goes_on_over_another_cloth() -> None:
    table = walled(rolling=0.1)
    row = [ball(table, 0.5 + 2.0 * R * k, 0.5) for k in range(3)]
    table.strike(row[0], (1.0, 0.0), 2.0)
    play(table, 10)
    table.deceleration = 1.0
    play(table)
    places = [each.body.position.x for each in row]
    assert all(b - a >= 2.0 * R * (1.0 - 1e-9) for a, b in itertools.pairwise(places))


# -- a state as text -------------------------------------------------------------------------------


@pytest.mark.parametrize("rolling", [None, 0.1])
def test_a_state_is_the_same_after_json(rolling: float | None) -> None:
    table = walled(rolling=rolling)
    one, other = ball(table, 0.5, 0.5), ball(table, 0.9, 0.51)
    table.strike(one, (2.0, 0.1))
    play(table, 20)
    saved = table.save_state()
    text = saved.to_json()
    assert TableState.from_json(text) == saved
    play(table)
    ends = [tuple(each.body.position) for each in (one, other)]
    table.restore_state(TableState.from_json(text))
    play(table)
    for each, end in zip((one, other), ends, strict=True):
        assert math.dist(each.body.position, end) < 1e-12


def test_json_has_plain_names() -> None:
    saved = TableState(0.5, {3: (0.1, 0.2, 0.0, 0.0)}, {3: (0.0, 0.0)})
    assert json.loads(saved.to_json()).keys() == {"time", "motions", "rolls"}


# -- a table as a scene ----------------------------------------------------------------------------


@pytest.mark.parametrize("turns", [1, -1])
@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_table_goes_on_as_its_scene_does(radius: float, turns: int) -> None:
    table = walled(WIDE[::turns], radius)
    table.add_pocket((1.8, 0.2), 0.05)
    table.add_wall(pymunk.Circle(table.space.static_body, 0.05, (1.2, 0.7)), 0.9)
    balls = [ball(table, 0.5, 0.5), *(ball(table, 1.0 + 0.07 * k, 0.5) for k in range(3))]
    table.strike(balls[0], (3.0, 0.4), 0.3)
    play(table, 10)
    scene, state = table.to_scene()
    end = simulate(scene, start=state, solver="event-driven").end
    table.play()
    assert end.off == {f"{each.number}" for each in balls if not each.is_on_table}
    for each in table.on_table:
        there = end.position[scene.index[f"{each.number}"]]
        assert math.dist(there, each.body.position) < 1e-12


def test_the_outline_begins_with_the_first_wall_and_has_corners_inside_of_thick_ones() -> None:
    found = []
    for corners, radius in ((WIDE, 0.0), (CORNERED, 0.0), (WIDE, 0.1)):
        table = walled(corners, radius)
        ball(table, 0.5, 0.5)
        found.append(table.to_scene()[0].table)
    assert found[:2] == [Table(tuple(WIDE)), Table(tuple(CORNERED))]
    assert found[2] is not None
    assert found[2].bounds == pytest.approx((0.1, 0.1, 1.9, 0.9), abs=1e-15)


def test_the_outline_of_walls_that_run_clockwise_begins_with_the_first_one_too() -> None:
    table = walled([WIDE[-k] for k in range(4)])
    ball(table, 0.5, 0.5)
    # The first wall runs from (0, 0) to (0, 1), and the outline back along it.
    assert table.to_scene()[0].table == Table((WIDE[3], *WIDE[:3]))


def test_a_cue_ball_is_one_whose_hits_have_another_restitution() -> None:
    def pair(i: int, j: int) -> Pair:
        return Pair(math.nan, math.nan, 0.7 if 1 in (i, j) else 0.9, 0.05)

    table = walled(pair=lambda i, j: pair(i, j)._replace(m_a=0.17, m_b=0.17))
    for k in range(4):
        ball(table, 0.3 + 0.07 * k, 0.5)
    scene, _ = table.to_scene()
    assert scene.cue is not None
    assert scene.cue.id == "1"
    assert (scene.restitution.ball_ball, scene.restitution.cue_ball) == (0.9, 0.7)


def test_what_no_scene_has_is_refused_in_one_sentence() -> None:
    table = walled(CORNERED, radius=0.02)
    ball(table, 0.5, 0.5)
    with pytest.raises(ValueError, match="walls = thick at an inner corner"):
        table.to_scene()
    assert table.to_scene(Table(tuple(CORNERED)))[0].table == Table(tuple(CORNERED))
    table = walled()
    ball(table, 0.5, 0.5)
    table.remove_wall(2)
    with pytest.raises(ValueError, match="no single outline of segments"):
        table.to_scene()
    table.add_wall(pymunk.Segment(table.space.static_body, (2.0, 1.0), (0.0, 1.0), 0.0), 0.5)
    with pytest.raises(ValueError, match="one restitution and one friction for all cushions"):
        table.to_scene()
    table = walled(pair=lambda i, j: PAIR(i, j)._replace(m_a=0.17, m_b=0.17, friction=0.1 * i))
    for k in range(3):
        ball(table, 0.3 + 0.07 * k, 0.5)
    with pytest.raises(ValueError, match="pair = several coefficients"):
        table.to_scene()


def test_what_pushes_balls_in_a_space_is_in_no_scene_and_no_aiming_line() -> None:
    for key, value, said in (
        ("gravity", (0.0, -9.8), r"^gravity = \[0.0, -9.8\]: balls of a scene fall only without"),
        ("damping", 0.3, r"^damping = 0.3: a scene has no damping of a space$"),
    ):
        table = walled()
        one = ball(table, 0.5, 0.5)
        setattr(table.space, key, value)
        with pytest.raises(ValueError, match=said):
            table.to_scene()
        with pytest.warns(UserWarning, match=f"^predict leaves out the {key} of the space$"):
            table.predict(one, (1.0, 0.0))
        table.predict(one, (1.0, 0.0))  # It is said once.
    table = walled()
    one = ball(table, 0.5, 0.5)
    spring = pymunk.DampedSpring(table.space.static_body, one.body, (0, 0), (0, 0), 0.1, 1.0, 0.1)
    table.space.add(spring)
    with pytest.raises(ValueError, match=r"^constraints = 1: .* joints: remove those of ball 0 "):
        table.to_scene()


def test_a_ball_called_cue_is_the_cue_ball_of_a_scene() -> None:
    table = walled()
    for k, name in enumerate(("1", "cue")):
        ball(table, 0.3 + 0.2 * k, 0.5).id = name
    scene, _ = table.to_scene()
    assert scene.cue is scene.balls[1]
