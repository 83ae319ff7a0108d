"""Racks put balls in rows, in files and in Python, and say what is wrong with them."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Ball, Scene, SceneError, load, loads, rack, simulate
from pool_pymunk.studies.uncertainty import written_uncertainty
from tests.shared.texts import RACK

R, M = 0.028575, 0.17


def gaps(balls: tuple[Ball, ...]) -> list[float]:
    """Return the gaps (m) between all balls, from the smallest one on."""
    return sorted(
        math.dist(a.position, b.position) - a.radius - b.radius for a, b in combinations(balls, 2)
    )


@pytest.mark.parametrize(("rows", "balls", "touching"), [(1, 1, 0), (2, 3, 3), (5, 15, 30)])
@pytest.mark.parametrize("angle", [0.0, 30.0, -137.0])
@pytest.mark.parametrize("gap", [0.0, 1e-4])
def test_a_triangle_has_rows_and_gaps(
    rows: int, balls: int, touching: int, angle: float, gap: float
) -> None:
    made = rack((0.3, -0.7), radius=R, mass=M, rows=rows, angle=angle, gap=gap)
    assert len(made) == balls
    assert [ball.id for ball in made] == [str(k + 1) for k in range(balls)]
    assert made[0].position == (0.3, -0.7)
    found = gaps(made)
    assert all(abs(one - gap) < 1e-15 for one in found[:touching])
    assert all(one > 0.5 * R for one in found[touching:])
    middle = np.mean([ball.position for ball in made[-rows:]], axis=0)
    assert math.dist(middle, made[0].position) == pytest.approx(
        (rows - 1) * (2 * R + gap) * math.sqrt(0.75), abs=1e-15
    )
    if rows > 1:
        heading = math.atan2(middle[1] + 0.7, middle[0] - 0.3)
        assert math.degrees(heading) == pytest.approx(angle, abs=1e-9)


def test_a_diamond_has_nine_balls_with_one_in_the_middle() -> None:
    made = rack((0.0, 0.0), radius=R, mass=M, shape="diamond")
    assert len(made) == 9
    fifth = made[4].position
    assert sum(math.dist(fifth, ball.position) < 2.01 * R for ball in made) == 7
    assert math.dist(made[0].position, made[8].position) == pytest.approx(8 * R * math.sqrt(0.75))


@pytest.mark.parametrize(("rings", "balls", "touching"), [(1, 7, 12), (2, 19, 42), (4, 61, 156)])
@pytest.mark.parametrize("angle", [0.0, -90.0, 137.0])
@pytest.mark.parametrize("gap", [0.0, 1e-4])
def test_a_hexagon_has_rings_that_run_counter_clockwise(
    rings: int, balls: int, touching: int, angle: float, gap: float
) -> None:
    made = rack(
        shape="hexagon", center=(0.3, -0.7), rings=rings, radius=R, mass=M, angle=angle, gap=gap
    )
    assert [ball.id for ball in made] == [str(k + 1) for k in range(balls)]
    assert made[0].position == (0.3, -0.7)
    found = gaps(made)
    assert all(abs(one - gap) < 1e-15 for one in found[:touching])
    assert all(one > 0.5 * R for one in found[touching:])
    first = 1
    for ring in range(1, rings + 1):
        places = [(x - 0.3, y + 0.7) for x, y in (b.position for b in made[first:][: 6 * ring])]
        turns = [math.degrees(math.atan2(y, x)) - angle for x, y in places]
        from_the_first = [(turn + 1e-9) % 360.0 for turn in turns]
        assert from_the_first == sorted(from_the_first)
        for corner in range(6):
            assert from_the_first[corner * ring] == pytest.approx(60.0 * corner, abs=1e-8)
            assert math.hypot(*places[corner * ring]) == pytest.approx(ring * (2 * R + gap))
        first += 6 * ring


def test_a_rack_may_have_a_colour_a_ball() -> None:
    colors = ["#010203", "#040506", "#070809"]
    made = rack((0.0, 0.0), radius=R, mass=M, rows=2, color=colors)
    assert [ball.color for ball in made] == colors
    assert {b.color for b in rack((0.0, 0.0), radius=R, mass=M, color="#010203")} == {"#010203"}


def test_a_rack_takes_ids_and_numbers_of_numpy() -> None:
    ids = ["a", "b", "c"]
    numbers: dict[str, Any] = {"radius": np.float64(R), "mass": np.float32(0.5)}
    apex: Any = np.array([0.0, 1.0])
    made = rack(apex, **numbers, rows=np.int64(2), ids=tuple(np.array(ids)))  # type: ignore[arg-type]
    assert [ball.id for ball in made] == ids
    assert all(type(value) is float for ball in made for value in (*ball.position, ball.mass))


# -- files -----------------------------------------------------------------------------------------


def test_a_file_has_its_racks_in_its_own_units() -> None:
    scene = loads(RACK)
    inch = 0.0254
    made = rack((20 * inch, 0.0), radius=1.125 * inch, mass=0.17, rows=3, gap=0.01 * inch)
    assert scene.balls[1:] == made
    assert loads(scene.to_toml()) == scene


def test_shots_may_aim_at_a_ball_of_a_rack() -> None:
    shot = '[[shots]]\nspeed = 1.0\naim = "6"\n'
    assert isinstance(loads(RACK + shot), Scene)
    with pytest.raises(SceneError, match=r'shots\[0\].aim = "7": there is no such ball'):
        loads(RACK + shot.replace("6", "7"))


@pytest.mark.parametrize(("name", "balls"), [("eight-ball", 16), ("nine-ball", 10)])
def test_bundled_breaks_are_those_of_pool(name: str, balls: int) -> None:
    scene = load(name)
    assert len(scene.balls) == balls
    assert len(scene.pockets) == 6
    assert scene.table is not None
    assert scene.table.bounds == (0.0, 0.0, 2.54, 1.27)
    assert gaps(scene.balls)[0] == pytest.approx(1e-4, abs=1e-12)
    run = simulate(scene, "Break", solver="event-driven")
    assert run.status == "settled"
    assert not run.warnings
    assert len(run.pocketed) == 1
    assert any(event.kind == "roll" for event in run.events)


def test_the_eight_is_in_the_middle_and_the_corners_differ() -> None:
    ids = [ball.id for ball in load("eight-ball").balls[1:]]
    assert ids[4] == "8"
    assert (int(ids[10]) > 8) != (int(ids[14]) > 8)
    assert [ball.id for ball in load("nine-ball").balls[1:]][4] == "9"


def test_the_bundled_carrom_board_is_that_of_the_laws() -> None:
    scene = load("carrom")
    assert scene.table is not None
    assert scene.table.bounds == (0.0, 0.0, 0.74, 0.74)
    counts = {id_: sum(ball.id[0] == id_ for ball in scene.balls) for id_ in "WBQS"}
    assert counts == {"W": 9, "B": 9, "Q": 1, "S": 1}
    men = {ball.id: ball for ball in scene.balls if not ball.cue}
    assert gaps(tuple(men.values()))[0] == pytest.approx(1e-4, abs=1e-12)
    assert len({ball.color for ball in men.values()}) == 3
    assert len({(id_[0], ball.color) for id_, ball in men.items()}) == 3
    assert men["Q"].position == (0.37, 0.37)
    for middle, outer in (("W1", "W4"), ("W2", "W6"), ("W3", "W8")):  # the Y
        (ax, ay), (bx, by) = men[middle].position, men[outer].position
        assert math.dist((bx - 0.37, by - 0.37), (2 * (ax - 0.37), 2 * (ay - 0.37))) < 1e-15
    assert men["W4"].position == pytest.approx((0.37, 0.37 - 4 * 0.0155 - 2e-4))
    assert all(math.dist(ball.position, (0.37, 0.37)) + 0.0155 < 0.085 for ball in men.values())
    rounds = [ball.id[0] for ball in scene.balls[2:]]
    assert all(a != b for a, b in zip(rounds[:6], rounds[1:6] + rounds[:1], strict=True))
    assert all(a != b for a, b in zip(rounds[6:], rounds[7:] + rounds[6:7], strict=True))
    assert loads(scene.to_toml()) == scene


def test_men_of_a_hexagon_are_as_uncertain_as_its_center() -> None:
    found: Any = written_uncertainty("carrom").position
    assert {found[ball.id] for ball in load("carrom").balls if not ball.cue} == {(0.005, 0.005)}


def test_a_striker_makes_the_runs_that_the_laws_of_carrom_want_of_a_board() -> None:
    run = simulate(load("carrom"), "Three and a half runs", solver="event-driven")
    assert [event.cushion for event in run.events if event.kind == "ball-cushion"] == [2, 0, 2]
    x, y = run.final["S"]
    assert x == pytest.approx(0.18)
    assert y < 0.37  # It has made half of the fourth run.
    assert not run.warnings
