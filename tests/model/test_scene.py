"""Scenes accept what is sound, refuse the rest with clear words, and answer solvers."""

from __future__ import annotations

import math
import pickle
import re
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pool_pymunk import load, simulate
from pool_pymunk.laws.contact import Pair
from pool_pymunk.model import (
    STANDARD_GRAVITY,
    UNITS,
    Ball,
    Friction,
    Point,
    Problem,
    Restitution,
    Scene,
    SceneError,
    Shot,
    State,
    Table,
    Units,
)
from pool_pymunk.model.problems import listed, shown
from tests.shared.scenes import lines_run

R = 0.05
ELASTIC = Restitution(ball_ball=1.0, cushion=1.0)
ROUGH = Friction(surface=0.1)

# This is an L: the corner (1, 1) sticks out into the table.
ELL = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))


def ball(name: str, x: float, y: float, cue: bool = False, radius: float = R) -> Ball:
    return Ball(name, (x, y), radius, 0.2, cue)


def scene(*balls: Ball, table: Table | None = None, shots: tuple[Shot, ...] = ()) -> Scene:
    return Scene(balls, table, ELASTIC, ROUGH, shots=shots)


def problems(make: Callable[[], object]) -> list[str]:
    """Return what is wrong with the thing that ``make`` makes, a line each."""
    with pytest.raises(SceneError) as caught:
        make()
    return str(caught.value).splitlines()


# -- construction --------------------------------------------------------------------------------


def test_the_error_keeps_its_problems_and_names_its_source() -> None:
    error = SceneError([Problem("a", 1, "no"), Problem("b", "x", "nor this")], "file.toml")
    assert str(error) == 'file.toml: a = 1: no\nfile.toml: b = "x": nor this'
    assert [problem.key for problem in error.problems] == ["a", "b"]


@given(st.text(), st.text(), st.text())
def test_a_problem_is_one_line_whatever_stands_in_it(key: str, value: str, source: str) -> None:
    lines = str(SceneError([Problem(key, value, "no")], source)).splitlines()
    assert len(lines) == 1
    assert lines[0].isprintable()


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (1.5, "1.5"),
        ("a", '"a"'),
        ([1, [2.0, "b"]], '[1, [2.0, "b"]]'),
        ({"a b": {"c": []}}, '{"a b" = {c = []}}'),
        ([[[[1]]]], "[[[...]]]"),
        (10**400, "(a number of about 401 digits)"),
        ("x" * 100, '"' + "x" * 55 + '..."'),
        ([1] * 1000, "[" + "1, " * 18 + "1,..."),
    ],
)
def test_values_are_shown_as_in_a_file_and_short(value: object, text: str) -> None:
    assert shown(value) == text


def test_long_lists_of_names_are_cut() -> None:
    assert listed(["a", "b"]) == "a, b"
    assert listed([str(k) for k in range(1000)]) == (
        "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 988 more"
    )


def test_what_is_not_needed_may_be_left_out() -> None:
    """One ball that rests on an open plane needs no coefficient and no time bound."""
    alone = Scene((ball("1", 0, 0),))
    assert alone.restitution == Restitution() and alone.deceleration == 0.0
    two = (ball("C", 0, 0, cue=True), ball("1", 1, 0))
    assert Scene(two, restitution=Restitution(cue_ball=0.5)).pair(0, 1).restitution == 0.5


# -- tables --------------------------------------------------------------------------------------


def message(make: Callable[[], object]) -> str:
    (line,) = problems(make)
    assert line.startswith("outline = [")
    return line.partition("]]: ")[2] or line.partition("...: ")[2]


# what is wrong, and the corners
def test_rectangle() -> None:
    table = Table.rectangle(2.0, 1.0)
    assert table.is_rectangle and table.bounds == (0.0, 0.0, 2.0, 1.0)
    assert [edge.normal for edge in table.edges] == [(0, 1), (-1, 0), (0, -1), (1, 0)]
    assert [edge.length for edge in table.edges] == [2.0, 1.0, 2.0, 1.0]
    assert table.reflex_corners == ()


def test_polygon_with_a_corner_that_sticks_out() -> None:
    table = Table(ELL)
    assert not table.is_rectangle and table.reflex_corners == (3,)
    assert table.contains(0.5, 1.5) and table.contains(1.5, 0.5) and not table.contains(1.5, 1.5)


def test_corners_in_line_are_allowed() -> None:
    table = Table(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)))
    assert not table.is_rectangle  # Its cushions are numbered differently.
    assert table.edges[0].normal == table.edges[1].normal == (0.0, 1.0)
    assert table.reflex_corners == ()


def test_a_rectangle_that_starts_elsewhere_has_its_own_cushion_numbers() -> None:
    assert not Table(((2.0, 0.0), (2.0, 1.0), (0.0, 1.0), (0.0, 0.0))).is_rectangle


def test_heights_and_distances_of_a_cushion() -> None:
    edge = Table.rectangle(2.0, 1.0).edges[0]
    assert edge.height(0.5, 0.25) == 0.25 and edge.height(0.5, -0.25) == -0.25
    assert edge.along(0.5, 0.25) == 0.5
    assert edge.distance(0.5, -0.25) == 0.25
    assert edge.distance(5.0, 4.0) == 5.0  # This is 3-4-5 from its end.


@pytest.mark.parametrize("bulge", [0.0, 1e-4, -1e-4, 0.5, -0.5, 1.0, 3.0])
def test_a_cushion_knows_the_share_of_its_length_at_which_a_ball_touches_it(bulge: float) -> None:
    edge = Table(((0.3, 0.2), (1.1, -0.7), (9.0, 9.0)), (bulge, 0.0, 0.0)).edges[0]
    for share in (0.0, 0.01, 0.25, 0.5, 0.9, 1.0):
        (x, y), (nx, ny) = edge.at(share)
        for r in (0.0, 0.1):
            assert edge.share(x + r * nx, y + r * ny) == pytest.approx(share, abs=1e-9)


def moved(table: Table, dx: float, dy: float) -> Table:
    return Table(tuple((x + dx, y + dy) for x, y in table.outline))


@pytest.mark.parametrize("away", [1e3, 1e5, 1e7])
def test_tables_far_from_the_origin(away: float) -> None:
    """Coordinates of 1e7 m are rounded to 2e-9 m; all else must be as at the origin."""
    table = moved(Table(ELL), away, -away)
    assert table.reflex_corners == (3,)
    assert table.contains(away + 0.5, -away + 1.5) and not table.contains(away + 1.5, -away + 1.5)
    for far, near in zip(table.edges, Table(ELL).edges, strict=True):
        assert far.normal == pytest.approx(near.normal, abs=4e-9)
        assert far.length == pytest.approx(near.length, abs=4e-9)
    assert "counter-clockwise" in message(lambda: Table(tuple(reversed(table.outline))))


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5, 1e7])
def test_a_table_of_a_millimetre_far_from_the_origin_keeps_its_sense(away: float) -> None:
    table = moved(Table.rectangle(1e-3, 1e-3), away, away)
    assert table.contains(away + 5e-4, away + 5e-4)
    assert "counter-clockwise" in message(lambda: Table(tuple(reversed(table.outline))))


def test_an_outline_of_thousands_of_corners_is_not_checked_pair_by_pair() -> None:
    """The check runs some 80 lines a corner, while 5000 corners have 12 million pairs."""
    turns = [2 * math.pi * k / 5000 for k in range(5000)]
    outline = tuple((math.cos(turn), math.sin(turn)) for turn in turns)
    tables: list[Table] = []
    assert lines_run(lambda: tables.append(Table(outline))) < 200 * len(outline)
    assert tables[0].reflex_corners == () and tables[0].contains(0.9, 0.0)


@given(
    corners=st.lists(st.tuples(st.floats(1.0, 1.9), st.floats(0.5, 2.0)), min_size=3, max_size=12),
    dx=st.floats(-1e3, 1e3),
)
def test_every_star_shaped_outline_is_sound_and_faces_inwards(
    corners: list[tuple[float, float]], dx: float
) -> None:
    """Seen from its centre the outline goes round once, each cushion by less than half a turn."""
    turns = [turn for turn, _ in corners]
    angles = [2 * math.pi * sum(turns[:k]) / sum(turns) for k in range(len(turns))]
    polar = [(angle, r) for angle, (_, r) in zip(angles, corners, strict=True)]
    table = Table(tuple((dx + r * math.cos(a), r * math.sin(a)) for a, r in polar))
    assert table.contains(dx, 0.0)
    assert not any(table.contains(dx + x, y) for x, y in ((3, 0), (-3, 0), (0, 3), (0, -3)))
    assert all(edge.height(dx, 0.0) > 0.0 for edge in table.edges)
    for edge in table.edges:
        assert math.hypot(*edge.normal) == pytest.approx(1.0, rel=1e-15, abs=0.0)
        middle = [(a + b) / 2 for a, b in zip(edge.start, edge.end, strict=True)]
        inner = [m + 1e-6 * n for m, n in zip(middle, edge.normal, strict=True)]
        assert table.contains(*inner)
    assert "counter-clockwise" in message(lambda: Table(tuple(reversed(table.outline))))


# -- balls on tables -----------------------------------------------------------------------------


def one_on(table: Table, x: float, y: float) -> Scene:
    return scene(ball("1", x, y), table=table)


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5, 1e7])
def test_a_ball_may_touch_a_cushion_but_not_sink_into_it(away: float) -> None:
    table = moved(Table.rectangle(2.0, 1.0), away, away)
    one_on(table, away + R, away + R)
    (line,) = problems(lambda: one_on(table, away + R - 1e-6, away + 0.5))
    assert re.search(r'ball "1" overlaps cushion 3 by 1e-06 m \(2e-05 radii\)$', line)
    (line,) = problems(lambda: one_on(table, away + 2.0 - R + 1e-6, away + 1.0 - R + 1e-6))
    assert 'ball "1" overlaps cushions 1, 2 by 1e-06 m' in line


def test_a_ball_off_the_table_is_said_to_be_so_once() -> None:
    assert problems(lambda: one_on(Table.rectangle(2.0, 1.0), 3.0, 0.5)) == [
        'balls[0].position = [3.0, 0.5]: ball "1" is off the table'
    ]
    assert "off the table" in problems(lambda: one_on(Table(ELL), 1.5, 1.5))[0]


def test_a_ball_at_a_corner_that_sticks_out() -> None:
    table, side = Table(ELL), R / math.sqrt(2)
    one_on(table, 1.0 - side, 1.0 - side)
    inside = side - 1e-6
    (line,) = problems(lambda: one_on(table, 1.0 - inside, 1.0 - inside))
    assert 'ball "1" overlaps cushion 3 by 1.4e-06 m (2.8e-05 radii)' in line


def rack(away: float = 0.0) -> list[Ball]:
    """Return fifteen balls in a triangle, each touching its neighbours, to rounding."""
    return [
        ball(f"{row}.{k}", away + row * R * math.sqrt(3), away + (2 * k - row) * R)
        for row in range(5)
        for k in range(row + 1)
    ]


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5, 1e7])
def test_a_frozen_rack_is_sound(away: float) -> None:
    assert len(scene(*rack(away)).balls) == 15


@pytest.mark.parametrize("away", [0.0, 1e3, 1e5, 1e7])
def test_an_overlap_of_a_micrometre_is_not(away: float) -> None:
    (line,) = problems(lambda: scene(ball("1", away, 0), ball("2", away + 2 * R - 1e-6, 0)))
    assert line.startswith("balls[1].position")
    assert line.endswith('ball "2" overlaps ball "1" by 1e-06 m (2e-05 radii)')


def test_rounded_coordinates_may_overlap_by_a_millionth_of_the_smaller_radius() -> None:
    scene(ball("1", 0, 0), ball("2", 2 * R - 0.99e-6 * R, 0))
    one_on(Table.rectangle(2.0, 1.0), R - 0.99e-6 * R, 0.5)
    assert problems(lambda: scene(ball("1", 0, 0), ball("2", 2 * R - 1.01e-6 * R, 0)))
    assert problems(lambda: one_on(Table.rectangle(2.0, 1.0), R - 1.01e-6 * R, 0.5))
    small, touching = 0.01 * R, 1.01 * R
    scene(ball("1", 0, 0), ball("2", touching - 0.99e-6 * small, 0, radius=small))
    assert problems(
        lambda: scene(ball("1", 0, 0), ball("2", touching - 1.01e-6 * small, 0, radius=small))
    )


def test_what_overlaps_by_less_is_touching() -> None:
    """Balls that overlap by half a millionth of a radius break like those that just touch."""
    ends = []
    for overlap in (0.0, 0.5e-6 * R):
        balls = [
            replace(ball("C", -0.5, 0), velocity=(1.0, 0.0), cue=True),
            *(ball(str(k), 2 * k * R - (k - 1) * overlap - overlap, 0) for k in range(1, 4)),
        ]
        made = Scene(tuple(balls), None, Restitution(0.9), Friction(0.1))
        run = simulate(made, solver="event-driven")
        assert run.status == "settled"
        ends.append(run.end.position)
    for one, other in zip(*ends, strict=True):
        assert math.dist(one, other) < 1e-6


def test_a_small_ball_inside_a_large_one_overlaps_it() -> None:
    (line,) = problems(lambda: scene(ball("big", 0, 0, radius=100.0), ball("small", 30, 40)))
    assert line.endswith('ball "small" overlaps ball "big" by 50 m (1e+03 radii)')


@given(
    st.lists(
        st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.sampled_from((0.01, 0.1, 0.5))),
        min_size=2,
        max_size=12,
    )
)
def test_the_sweep_finds_the_overlaps_that_all_pairs_have(
    discs: list[tuple[float, float, float]],
) -> None:
    balls = [ball(str(k), x, y, radius=r) for k, (x, y, r) in enumerate(discs)]
    wanted = [
        f'ball "{j}" overlaps ball "{i}"'
        for i in range(len(balls))
        for j in range(i + 1, len(balls))
        if gap(balls[i], balls[j]) < 0.0
    ]
    gaps = [gap(a, b) for k, a in enumerate(balls) for b in balls[:k]]
    assume(min(map(abs, gaps)) > 1e-6)
    if wanted:
        lines = problems(lambda: scene(*balls))
        found = [line.partition(": ")[2].partition(" by ")[0] for line in lines]
        assert found == wanted
    else:
        scene(*balls)


def gap(a: Ball, b: Ball) -> float:
    return math.dist(a.position, b.position) - a.radius - b.radius


GRIDS: dict[str, Callable[[int], Point]] = {
    "square": lambda k: (k % 45 * 0.11, k // 45 * 0.11),
    "row": lambda k: (k * 0.11, 0.0),
    "column": lambda k: (0.0, k * 0.11),
    "diagonal": lambda k: (k * 0.11, k * 0.11),
}


PAIRS = 2000 * 1999 // 2  # This many pairs do two thousand balls have.


@pytest.mark.parametrize("place", GRIDS.values(), ids=GRIDS)
def test_two_thousand_balls_are_not_checked_pair_by_pair(place: Callable[[int], Point]) -> None:
    balls = tuple(ball(str(k), *place(k)) for k in range(2000))
    assert lines_run(lambda: Scene(balls, restitution=ELASTIC)) < PAIRS / 4


def test_a_heap_of_balls_is_refused_without_a_look_at_every_pair() -> None:
    """There are two million overlaps, of which a hundred are listed."""
    lines: list[str] = []
    heap = [ball(str(k), 0, 0) for k in range(2000)]
    assert lines_run(lambda: lines.extend(problems(lambda: scene(*heap)))) < PAIRS / 10
    assert len(lines) == 100


# -- what solvers ask ----------------------------------------------------------------------------


def trio(cue_ball: float | None) -> Scene:
    balls = (ball("C", 0, 0, cue=True), Ball("1", (1.0, 0.0), R, 0.3), ball("2", 2, 0))
    coefficients = Restitution(ball_ball=0.9, cue_ball=cue_ball)
    return Scene(balls, None, coefficients, Friction(surface=0.1, ball_ball=0.05))


def test_a_hit_of_the_cue_ball_may_have_its_own_restitution() -> None:
    assert trio(0.7).pair(0, 1) == Pair(0.2, 0.3, 0.7, 0.05)
    assert trio(0.7).pair(2, 0) == Pair(0.2, 0.2, 0.7, 0.05)
    assert trio(0.7).pair(1, 2) == Pair(0.3, 0.2, 0.9, 0.05)
    assert trio(None).pair(0, 1).restitution == 0.9
    assert trio(0.0).pair(0, 1).restitution == 0.0  # Zero is a coefficient, not a blank.


def test_indices_cue_and_deceleration() -> None:
    three = trio(None)
    assert three.index == {"C": 0, "1": 1, "2": 2}
    assert three.cue is three.balls[0]
    assert three.deceleration == 0.1 * STANDARD_GRAVITY
    assert scene(ball("1", 0, 0)).cue is None


def test_nearest_is_by_centres_and_the_first_of_equals() -> None:
    some = scene(ball("C", 0, 0), ball("1", 3, 0), ball("2", 0, -2), ball("3", 2, 0))
    assert some.nearest(0) == 2
    assert some.nearest(0, [(0, 0), (1, 0), (5, 5), (5, 6)]) == 1


def test_a_shot_gives_one_ball_its_velocity() -> None:
    moving = Ball("1", (1.0, 0.0), R, 0.2, velocity=(0.0, 3.0))
    shots = (Shot("a", "C", velocity=(1.0, -2.0)), Shot("still", "1", velocity=(0.0, 0.0)))
    two = scene(ball("C", 0, 0), moving, shots=shots)
    assert two.start(None) == State(((0, 0), (1.0, 0.0)), ((0.0, 0.0), (0.0, 3.0)))
    assert two.start(shots[0]).velocity == ((1.0, -2.0), (0.0, 3.0))
    assert two.start(shots[1]).velocity == ((0.0, 0.0), (0.0, 0.0))


def test_a_shot_from_a_state_keeps_its_places_and_aims_from_there() -> None:
    shot = Shot("a", "C", speed=5.0, aim="1")
    two = scene(ball("C", 0, 0), ball("1", 1, 0), shots=(shot,))
    before = State(((0.0, 0.0), (3.0, 4.0)), ((9.0, 9.0), (0.5, 0.0)))
    after = two.start(shot, before)
    assert after.position == before.position
    assert after.velocity[0] == pytest.approx((3.0, 4.0), rel=1e-15, abs=0.0)
    assert after.velocity[1] == (0.5, 0.0)


@given(x=st.floats(-9.0, 9.0), y=st.floats(-9.0, 9.0), speed=st.floats(1e-6, 100.0))
def test_aim_points_from_centre_to_centre(x: float, y: float, speed: float) -> None:
    assume(math.hypot(x, y) > 3 * R)
    shot = Shot("a", "C", speed=speed, aim="nearest")
    vx, vy = scene(ball("C", 0, 0), ball("1", x, y), shots=(shot,)).start(shot).velocity[0]
    # atan2, cosine and sine round once each.
    assert math.hypot(vx, vy) == pytest.approx(speed, rel=1e-15, abs=0.0)
    assert abs(vx * y - vy * x) <= 1e-15 * speed * math.hypot(x, y)
    assert vx * x + vy * y >= 0.0


# -- units ---------------------------------------------------------------------------------------

KINDS = [(kind, unit) for kind, known in UNITS.items() for unit in known]


@pytest.mark.parametrize(("kind", "unit"), KINDS)
@given(value=st.floats(-1e6, 1e6))
def test_units_go_to_si_and_back(kind: str, unit: str, value: float) -> None:
    units = Units(**{kind: unit})
    # There are one product and one quotient, each rounded; the smallest numbers lose digits for
    # good.
    assert units.from_si(units.to_si(value, kind), kind) == pytest.approx(
        value, rel=3e-16, abs=1e-300
    )


def test_units_by_hand() -> None:
    units = Units("in", "g", "in/s")
    assert units.to_si(100.0, "length") == units.to_si(100.0, "speed") == 2.54
    assert units.to_si(160.0, "mass") == 0.16


@pytest.mark.parametrize("copied", [deepcopy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_a_scene_that_was_played_can_be_copied(copied: Callable[[Scene], Scene]) -> None:
    """What it keeps of the core has no copies, and is made anew."""
    scene = load("stadium")
    run = simulate(scene, 1, solver="event-driven")
    assert scene.cushions and scene.surface and scene.ground and scene.table
    other = copied(scene)
    assert other == scene
    assert simulate(other, 1, solver="event-driven").end == run.end
