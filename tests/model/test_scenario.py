"""Scenario files: the whole format works, and every mistake gives one clear line."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import pytest

from pool_pymunk import load, loads, simulate
from pool_pymunk.model import STANDARD_GRAVITY, UNITS, SceneError, Table, Units
from pool_pymunk.model.scenario import bundled
from tests.shared.texts import GOOD, LAUNCH, SIZE, changed, text_of

FILE = "table.toml"


def problems(text: str) -> list[str]:
    """Return the lines that answer a scenario's text, without the file's name."""
    with pytest.raises(SceneError) as caught:
        loads(text, FILE)
    lines = str(caught.value).splitlines()
    assert all(re.fullmatch(rf"{FILE}: .+?( = .+?)?: .+", line) for line in lines)
    return [line.removeprefix(f"{FILE}: ") for line in lines]


# -- the format ----------------------------------------------------------------------------------


def test_the_whole_format() -> None:
    scene = loads(text_of("everything"))
    assert scene.title == "everything"
    assert scene.units == Units("cm", "g", "in/s")
    assert scene.table == Table.rectangle(2.0, 1.0)
    assert (scene.physics.law, scene.physics.gravity, scene.physics.max_time) == (
        "published",
        1.62,
        30.0,
    )
    coefficients = scene.restitution
    assert (coefficients.ball_ball, coefficients.cue_ball, coefficients.cushion) == (1.0, 0.95, 0.0)
    frictions = scene.friction
    assert (frictions.surface, frictions.cushion, frictions.ball_ball) == (0.2, 0.3, 0.05)
    cue, eight = scene.balls
    assert (cue.id, cue.cue, cue.position, cue.radius) == ("C", True, (0.5, 0.5), 0.03)
    assert (cue.mass, cue.color, cue.velocity) == (0.2, "#FFFFFF", (0.0, 0.0))
    assert (eight.id, eight.cue, eight.radius, eight.color) == ("é 8", False, 0.02, "#00ff00")
    assert eight.mass == pytest.approx(0.17)
    assert eight.velocity == pytest.approx((2.54, -1.27))
    first, second, third = scene.shots
    assert (first.name, first.ball, first.from_previous) == ("first", "C", False)
    assert first.velocity == pytest.approx((0.254, 0.508))
    assert first.published["é 8"] == pytest.approx((0.305, 0.4))
    assert (second.name, second.ball, second.from_previous) == ("Shot 2", "é 8", True)
    assert (second.velocity, second.angle) == (None, 90.0)
    # The cosine of 90 degrees is rounded.
    assert second.launch == pytest.approx((0.0, 0.254), abs=1e-16)
    assert (third.velocity, third.aim, third.from_previous) == (None, "é 8", False)
    assert third.speed == pytest.approx(0.254)


def test_what_is_left_out_has_its_default() -> None:
    scene = loads('[[balls]]\nid = "1"\nposition = [1, 2]\nradius = 0.1\nmass = 1\n')
    assert scene.units == Units("m", "kg", "m/s")
    assert scene.table is None and scene.shots == () and scene.title == ""
    assert scene.physics.law == "coulomb" and scene.physics.max_time is None
    assert scene.physics.gravity == STANDARD_GRAVITY
    assert scene.friction.surface == scene.friction.cushion == scene.friction.ball_ball == 0.0
    (ball,) = scene.balls
    assert (ball.cue, ball.velocity, ball.color) == (False, (0.0, 0.0), None)


def test_any_simple_polygon_is_a_table() -> None:
    outline = "outline = [[0, 0], [88, 0], [88, 44], [44, 60], [0, 44]]"
    table = loads(changed((SIZE, outline))).table
    assert table is not None
    assert table.outline[3] == pytest.approx((44 * 0.0254, 60 * 0.0254))
    assert not table.is_rectangle


@pytest.mark.parametrize(
    "sides", [SIZE, "outline = [[0, 0], [88, 0], [88, 44], [0, 45]]\nbulge = [0, 0, 0, 1]"]
)
def test_a_table_may_have_a_colour(sides: str) -> None:
    scene = loads(changed((SIZE, f'{sides}\ncolor = "#e2b779"')))
    plain = loads(changed((SIZE, sides)))
    assert scene.table is not None and plain.table is not None
    assert (scene.table.color, plain.table.color) == ("#e2b779", None)
    assert replace(scene.table, color=None) == plain.table
    assert loads(scene.to_toml()) == scene
    assert scene.to_toml().replace('color = "#e2b779"\n', "") == plain.to_toml()


def test_aim_at_the_nearest_ball() -> None:
    scene = loads(changed((LAUNCH, 'speed = 2\naim = "nearest"')))
    vx, vy = scene.start(scene.shots[0]).velocity[0]
    assert math.hypot(vx, vy) == pytest.approx(2.0)
    assert vy / vx == pytest.approx(1 / 26)


def test_published_ends_may_be_a_table_of_their_own() -> None:
    scene = loads(GOOD + "[shots.published]\nC = [1, 2]\n1 = [3, 4]\n")
    assert scene.shots[0].published["1"] == pytest.approx((3 * 0.0254, 4 * 0.0254))


@pytest.mark.parametrize("kind", UNITS)
def test_every_unit_is_read_as_what_it_is(kind: str) -> None:
    for unit, factor in UNITS[kind].items():
        scene = loads(
            f'[units]\n{kind} = "{unit}"\n[friction]\nsurface = 0.1\n[[balls]]\nid = "1"\n'
            "position = [3, 4]\nradius = 2\nmass = 5\nvelocity = [6, 7]\n"
        )
        (ball,) = scene.balls
        length, mass, speed = (factor if k == kind else 1.0 for k in ("length", "mass", "speed"))
        assert ball.position == (3 * length, 4 * length)
        assert (ball.radius, ball.mass) == (2 * length, 5 * mass)
        assert ball.velocity == (6 * speed, 7 * speed)


def test_numbers_come_back_in_the_units_of_the_file() -> None:
    scene = load("report")
    cue = scene.balls[0]
    back = [scene.units.from_si(x, "length") for x in cue.position]
    # This is a product and a quotient, both rounded.
    assert back == pytest.approx([66.0, 22.0], rel=3e-16, abs=0.0)
    assert scene.units.from_si(cue.mass, "mass") == pytest.approx(200.0, rel=3e-16, abs=0.0)


@pytest.mark.parametrize("name", ["report", "report-corrected", "two-balls", "follow-and-draw"])
def test_bundled_scenarios_load_by_name(name: str) -> None:
    scene = load(name)
    assert name in bundled()
    assert scene.title and scene.shots


@pytest.mark.parametrize(
    ("shot", "met"), [(1, ["red", 1, 2, 3, "yellow"]), (2, [0, 2, 1, "red", "yellow"])]
)
def test_shots_of_three_cushion_score(shot: int, met: list[str | int]) -> None:
    """The cue ball meets three cushions or more before it meets the second ball."""
    run = simulate(load("three-cushion"), shot, solver="event-driven")
    own = [event for event in run.events if event.is_contact and "white" in event.balls]
    found = [next((id_ for id_ in e.balls if id_ != "white"), e.cushion) for e in own]
    assert found[: len(met)] == met
    second = max(map(found.index, ("red", "yellow")))
    assert sum(isinstance(each, int) for each in found[:second]) >= 3


def test_the_report_and_its_correction() -> None:
    report, corrected = load("report"), load("report-corrected")
    assert (report.physics.law, report.restitution.cue_ball) == ("published", 0.70)
    assert (corrected.physics.law, corrected.restitution.cue_ball) == ("coulomb", 0.95)
    assert report.balls == corrected.balls and report.table == corrected.table
    assert all(len(shot.published) == 11 for shot in report.shots)
    assert not any(shot.published for shot in corrected.shots)


def test_a_file_is_read_by_its_path_whatever_its_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert load(path) == load(str(path)) == loads(GOOD)
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load(path) == loads(GOOD)


# -- what is wrong with a file, a line each --------------------------------------------------------
# Most of these are in data/refusals.txt.


@pytest.mark.parametrize(
    "wrong",
    ["tabel", "restituton", "fricton", "bal", "shot", "bal_ball", "cushon", "surfaces", "radus",
     "postion", "ids", "velocty"],
)  # fmt: skip
def test_a_misspelt_key_is_one_line_and_nothing_is_left_out(wrong: str) -> None:
    keys = re.findall(r"^\W*(\w+)", GOOD, re.MULTILINE)
    (right,) = get_close_matches(wrong, dict.fromkeys(keys), 1)
    (line,) = problems(re.sub(rf"(?m)^(\W*){right}\b", rf"\g<1>{wrong}", GOOD, count=1))
    assert line.endswith(f'did you mean "{right}"?')


@pytest.mark.parametrize(
    "change",
    [('id = "1"', "id = 1"), ('id = "1"', ""), ('[[balls]]\nid = "1"\nposition = [40, 21]', "")],
    ids=["wrong type", "left out", "no such ball"],
)
def test_a_name_is_not_called_unknown_where_a_ball_has_no_sound_id(change: tuple[str, str]) -> None:
    lines = problems(changed(change, (LAUNCH, 'speed = 1\naim = "1"')))
    assert any("no such ball" in line for line in lines) == (change[1] == "" and "[[" in change[0])


# -- what is wrong with getting at a file ---------------------------------------------------------


def load_problem(path: str | Path) -> str:
    with pytest.raises(SceneError) as caught:
        load(path)
    (line,) = str(caught.value).splitlines()
    return line


def test_problems_name_the_file_as_it_was_given(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes('title = "Königsstoß"\n'.encode("latin-1"))
    assert load_problem(path) == f'{path}: byte 11 = "0xf6": is not UTF-8 text'
    path.write_text(changed(("surface = 0.1", "surface = -0.1")), encoding="utf-8")
    assert load_problem(path) == f"{path}: friction.surface = -0.1: must be 0 or more"
