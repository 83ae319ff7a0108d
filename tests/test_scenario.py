"""Scenario files: the whole format works, and every mistake gives one clear line."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from pool_pymunk import load, loads
from pool_pymunk.model import STANDARD_GRAVITY, UNITS, SceneError, Table, Units
from pool_pymunk.model.scenario import bundled, label

GOOD = """
title = "two balls"
[units]
length = "in"
mass = "g"
[table]
length = 88
width = 44
[restitution]
ball_ball = 0.9
cushion = 0.7
[friction]
surface = 0.1
[ball]
radius = 2.25
mass = 160
[[balls]]
id = "C"
cue = true
position = [66, 22]
[[balls]]
id = "1"
position = [40, 21]
[[shots]]
name = "break"
velocity = [-4, 0]
"""
SIZE = "length = 88\nwidth = 44"
LAUNCH = "velocity = [-4, 0]"
FILE = "table.toml"
TOP_KEYS = "title, units, table, physics, restitution, friction, ball, pockets, balls, racks, shots"


def changed(*changes: tuple[str, str]) -> str:
    """Return the good scenario with each first text replaced by the second."""
    text = GOOD
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def problems(text: str) -> list[str]:
    """Return the lines that answer a scenario's text, without the file's name."""
    with pytest.raises(SceneError) as caught:
        loads(text, FILE)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{FILE}: ") for line in lines)
    return [line.removeprefix(f"{FILE}: ") for line in lines]


# -- the format ----------------------------------------------------------------------------------


def test_the_whole_format() -> None:
    scene = loads(
        """
        title = "everything"
        [units]
        length = "cm"
        mass = "g"
        speed = "in/s"
        [table]
        length = 200
        width = 100.0
        [physics]
        law = "published"
        gravity = 1.62
        max_time = 30
        [restitution]
        ball_ball = 1
        cue_ball = 0.95
        cushion = 0
        [friction]
        surface = 0.2
        cushion = 0.3
        ball_ball = 0.05
        [ball]
        radius = 3
        mass = 170
        color = "#00ff00"
        [[balls]]
        id = "C"
        cue = true
        position = [50, 50.0]
        mass = 200
        color = "#FFFFFF"
        [[balls]]
        id = "é 8"
        position = [150, 50]
        radius = 2
        velocity = [100, -50]
        [[shots]]
        name = "first"
        velocity = [10, 20]
        published = { C = [10, 20], "é 8" = [30.5, 40] }
        [[shots]]
        speed = 10
        angle = 90
        ball = "é 8"
        from = "previous"
        [[shots]]
        name = "third"
        speed = 10
        aim = "é 8"
        from = "start"
        """
    )
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


@pytest.mark.parametrize("name", ["report", "report-corrected", "two-balls"])
def test_bundled_scenarios_load_by_name(name: str) -> None:
    scene = load(name)
    assert name in bundled() and label(name) == f"scenarios/{name}.toml"
    assert scene.title and scene.shots


def test_the_report_and_its_correction() -> None:
    report, corrected = load("report"), load("report-corrected")
    assert (report.physics.law, report.restitution.cue_ball) == ("published", 0.70)
    assert (corrected.physics.law, corrected.restitution.cue_ball) == ("coulomb", 0.95)
    assert report.balls == corrected.balls and report.table == corrected.table
    assert all(len(shot.published) == 11 for shot in report.shots)
    assert not any(shot.published for shot in corrected.shots)


def test_a_file_is_read_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(GOOD, encoding="utf-8")
    assert load(path) == load(str(path)) == loads(GOOD)
    assert label(path) == str(path)


def test_a_byte_order_mark_and_dos_line_ends_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "dos.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load(path) == loads(GOOD)


# -- what is wrong with a file, a line each --------------------------------------------------------

Case = tuple[str, list[str]]

SYNTAX: dict[str, Case] = {
    "empty file": ("", ["balls = (left out): one ball or more is needed"]),
    "no equals sign": (
        changed(("mass = 160", "mass 160")),
        [
            'line 16 = "mass 160": is not TOML: '
            "Expected '=' after a key in a key/value pair (column 6)"
        ],
    ),
    "no value": (
        changed(("mass = 160", "mass = ")),
        ['line 16 = "mass =": is not TOML: Invalid value (column 8)'],
    ),
    "key twice": (
        changed(("mass = 160", "mass = 160\nmass = 170")),
        ['line 17 = "mass = 170": is not TOML: Cannot overwrite a value (column 11)'],
    ),
    "section twice": (
        GOOD + "[table]\n",
        ["line 27 = \"[table]\": is not TOML: Cannot declare ('table',) twice (column 7)"],
    ),
    "text never closed": (
        'title = """\n',
        [f'file = "{FILE}": is not TOML: Unterminated string (at end of document)'],
    ),
    "control character": (
        "ti\x00tle = 1",
        [
            r'line 1 = "ti\x00tle = 1": is not TOML: '
            "Expected '=' after a key in a key/value pair (column 3)"
        ],
    ),
    "nested too deeply to parse": (
        "x = " + "[" * 5000 + "]" * 5000,
        [f'file = "{FILE}": is nested too deeply'],
    ),
    "nested deeply": (
        GOOD + "x = " + "[" * 50 + "]" * 50,
        [
            "shots[0].x = [[[...]]]: unknown key (there are: name, ball, velocity, speed, aim, "
            "from, published, angle)"
        ],
    ),
    "dotted deeply": (
        "a" + ".a" * 990 + " = 1" + GOOD,  # Python 3.14 refuses more than 1000 parts.
        [f"a = {{a = {{a = {{a = ...}}}}}}: unknown key (there are: {TOP_KEYS})"],
    ),
    "integer too long for Python": (
        changed(("mass = 160", "mass = 1" + "0" * 5000)),
        [
            'line 16 = "mass = 100000000000000000000000000000000000000000000000...": '
            "has a number with too many digits"
        ],
    ),
}

KEYS_AND_TYPES: dict[str, Case] = {
    "unknown section": (
        changed(("[ball]", "[bal]")),
        [
            f"bal = {{radius = 2.25, mass = 160}}: unknown key (there are: {TOP_KEYS}); did you "
            'mean "ball"?',
        ],
    ),
    "unknown key in a section": (
        changed(("surface = 0.1", "surface = 0.1\nrolling = 0.01")),
        ["friction.rolling = 0.01: unknown key (there are: surface, cushion, ball_ball)"],
    ),
    "unknown key of a ball": (
        changed(('id = "1"', 'id = "1"\nspin = [0, 1]')),
        [
            "balls[1].spin = [0, 1]: unknown key (there are: id, position, radius, mass, cue, "
            "velocity, color)"
        ],
    ),
    "unknown key with odd characters": (
        '"a\\nb" = 1\n' + GOOD,
        [rf'"a\nb" = 1: unknown key (there are: {TOP_KEYS})'],
    ),
    "the name of a field is not the key": (
        changed((LAUNCH, LAUNCH + '\nfrom_ = "start"')),
        [
            'shots[0].from_ = "start": unknown key (there are: name, ball, velocity, speed, '
            'aim, from, published, angle); did you mean "from"?'
        ],
    ),
    "bool for number": (
        changed(("mass = 160", "mass = true")),
        ["ball.mass = true: must be a number"],
    ),
    "text for number": (
        changed(("surface = 0.1", 'surface = "0.1"')),
        ['friction.surface = "0.1": must be a number'],
    ),
    "date for number": (
        changed(("mass = 160", "mass = 1979-05-27")),
        ["ball.mass = 1979-05-27: must be a number"],
    ),
    "number for text": (
        changed(('id = "1"', "id = 1")),
        ['balls[1].id = 1: must be text, in "quotes"'],
    ),
    "direction for a ball to aim at": (
        changed((LAUNCH, "speed = 4\naim = 30")),
        [
            'shots[0].aim = 30: must be the id of a ball, in "quotes"; for a direction in degrees '
            "write angle"
        ],
    ),
    "number for bool": (
        changed(("cue = true", "cue = 1")),
        ["balls[0].cue = 1: must be true or false"],
    ),
    "number for table": (
        "friction = 3\n" + changed(("[friction]\nsurface = 0.1\n", "")),
        ["friction = 3: must be a table"],
    ),
    "list for table": (
        changed(("[ball]", "[[ball]]")),
        ["ball = [{radius = 2.25, mass = 160}]: must be a table"],
    ),
    "table for list": (
        '[balls]\nid = "1"\n',
        ['balls = {id = "1"}: must be a list: write [[balls]] above each of them'],
    ),
    "table for list of shots": (
        changed(("[[shots]]", "[shots]")),
        [
            'shots = {name = "break", velocity = [-4, 0]}: must be a list: write [[shots]] above '
            "each of them"
        ],
    ),
    "number for ball": ("balls = [3]", ["balls[0] = 3: must be a table"]),
    "one number for two": (
        changed(("[40, 21]", "40")),
        ["balls[1].position = 40: must be two numbers, [x, y]"],
    ),
    "three numbers for two": (
        changed(("[40, 21]", "[40, 21, 0]")),
        ["balls[1].position = [40, 21, 0]: must be two numbers, [x, y]"],
    ),
    "text in a vector": (
        changed(("[40, 21]", '[40, "x"]')),
        ['balls[1].position[1] = "x": must be a number'],
    ),
    "outline of numbers": (
        changed((SIZE, "outline = [0, 88]")),
        [
            "table.outline[0] = 0: must be two numbers, [x, y]",
            "table.outline[1] = 88: must be two numbers, [x, y]",
        ],
    ),
    "outline of nothing": (
        changed((SIZE, "outline = true")),
        ["table.outline = true: must be corners, [[x, y], ...]"],
    ),
    "list for published": (
        changed((LAUNCH, LAUNCH + "\npublished = [1, 2]")),
        ['shots[0].published = [1, 2]: must be points by ids, {"1" = [x, y]}'],
    ),
    "unknown units": (
        changed(('"in"', '"ft"'), ('"g"', '"g"\nspeed = "mph"')),
        [
            'units.length = "ft": must be one of m, cm, mm, in',
            'units.speed = "mph": must be one of m/s, in/s',
        ],
    ),
    "unknown law": (
        '[physics]\nlaw = "newton"' + GOOD.replace('title = "two balls"', ""),
        ['physics.law = "newton": must be one of coulomb, published'],
    ),
    "shot from nowhere": (
        changed((LAUNCH, LAUNCH + '\nfrom = "end"')),
        ['shots[0].from = "end": must be one of start, previous'],
    ),
}

NUMBERS: dict[str, Case] = {
    "NaN": (changed(("mass = 160", "mass = nan")), ["ball.mass = nan: must be a finite number"]),
    "infinite place": (
        changed(("[40, 21]", "[40, -inf]")),
        ["balls[1].position = [40, -inf]: must be two finite numbers"],
    ),
    "infinite through its exponent": (
        changed(("length = 88", "length = 1e999")),
        ["table.length = inf: must be a finite number"],
    ),
    "integer with 401 digits": (
        changed(("mass = 160", "mass = 1" + "0" * 400)),
        ["ball.mass = (a number of about 401 digits): is too large (more than 1e+100 in SI units)"],
    ),
    "integer with 9,633 digits": (
        changed(("mass = 160", "mass = 0x" + "f" * 8000)),
        [
            "ball.mass = (a number of about 9633 digits): "
            "is too large (more than 1e+100 in SI units)"
        ],
    ),
    "largest float": (
        changed(("radius = 2.25", "radius = 1.7e308")),
        ["ball.radius = 1.7e+308: is too large (more than 1e+100 in SI units)"],
    ),
    "nearly zero": (
        changed(("radius = 2.25", "radius = 1e-320")),
        ["ball.radius = 1e-320: is too small (less than 1e-100 in SI units)"],
    ),
    "zero mass": (changed(("mass = 160", "mass = 0")), ["ball.mass = 0: must be greater than 0"]),
    "negative radius, of one ball, in inches": (
        changed(('id = "1"', 'id = "1"\nradius = -2.25')),
        ["balls[1].radius = -2.25: must be greater than 0"],
    ),
    "negative gravity": (
        "[physics]\ngravity = -9.81" + GOOD.replace('title = "two balls"', ""),
        ["physics.gravity = -9.81: must be 0 or more"],
    ),
    "no time at all": (
        "[physics]\nmax_time = 0" + GOOD.replace('title = "two balls"', ""),
        ["physics.max_time = 0: must be greater than 0"],
    ),
    "restitution above one": (
        changed(("cushion = 0.7", "cushion = 1.2")),
        ["restitution.cushion = 1.2: must be between 0 and 1"],
    ),
    "negative friction": (
        changed(("surface = 0.1", "surface = -0.1")),
        ["friction.surface = -0.1: must be 0 or more"],
    ),
    "colour in words": (
        changed(('id = "1"', 'id = "1"\ncolor = "red"')),
        ['balls[1].color = "red": must be "#rrggbb", six hexadecimal digits'],
    ),
    "default colour in words": (
        changed(("[ball]", '[ball]\ncolor = "red"')),
        ['ball.color = "red": must be "#rrggbb", six hexadecimal digits'],
    ),
}

TABLES: dict[str, Case] = {
    "neither size nor outline": (
        changed((SIZE, "")),
        [
            "table.length = (left out): is missing (or an outline)",
            "table.width = (left out): is missing (or an outline)",
        ],
    ),
    "length without width": (
        changed((SIZE, "length = 88")),
        ["table.width = (left out): is missing (or an outline)"],
    ),
    "negative width": (
        changed(("width = 44", "width = -44")),
        ["table.width = -44: must be greater than 0"],
    ),
    "length beside outline": (
        changed((SIZE, "length = 88\noutline = [[0, 0], [88, 0], [88, 44], [0, 44]]")),
        ["table.length = 88: stands beside outline: one of the two"],
    ),
    "outline crosses itself": (
        changed((SIZE, "outline = [[0, 0], [88, 44], [88, 0], [0, 44]]")),
        [
            "table.outline = [[0, 0], [88, 44], [88, 0], [0, 44]]: "
            "crosses itself (cushion 0 meets cushion 2)"
        ],
    ),
    "outline clockwise": (
        changed((SIZE, "outline = [[0, 0], [0, 44], [88, 44], [88, 0]]")),
        [
            "table.outline = [[0, 0], [0, 44], [88, 44], [88, 0]]: must run counter-clockwise",
        ],
    ),
    "outline of two corners": (
        changed((SIZE, "outline = [[0, 0], [88, 0]]")),
        ["table.outline = [[0, 0], [88, 0]]: must have three corners or more"],
    ),
    "outline of none": (
        changed((SIZE, "outline = []")),
        ["table.outline = []: must have three corners or more"],
    ),
    "outline with a corner twice": (
        changed((SIZE, "outline = [[0, 0], [88, 0], [88, 0], [88, 44]]")),
        [
            "table.outline = [[0, 0], [88, 0], [88, 0], [88, 44]]: "
            "has two equal corners in a row (1 and 2)"
        ],
    ),
    "outline not finite": (
        changed((SIZE, "outline = [[0, 0], [nan, 0], [88, 44]]")),
        ["table.outline[1] = [nan, 0]: must be two finite numbers"],
    ),
    "cushions without restitution": (
        changed(("cushion = 0.7", "")),
        ["restitution.cushion = (left out): is missing where there is a table"],
    ),
}

BALLS: dict[str, Case] = {
    "no balls": (
        "balls = []",
        ["balls = []: one ball or more is needed"],
    ),
    "a ball of nothing": (
        "[[balls]]",
        [
            "balls[0].id = (left out): is missing",
            "balls[0].position = (left out): is missing",
            "balls[0].radius = (left out): is missing, here or in [ball]",
            "balls[0].mass = (left out): is missing, here or in [ball]",
        ],
    ),
    "no mass anywhere": (
        changed(("mass = 160", "")),
        [
            "balls[0].mass = (left out): is missing, here or in [ball]",
            "balls[1].mass = (left out): is missing, here or in [ball]",
        ],
    ),
    "empty id": (changed(('"1"', '""')), ['balls[1].id = "": must not be empty']),
    "id of two lines": (
        changed(('"1"', r'"a\u2028b"')),
        [r'balls[1].id = "a\u2028b": must be one line of text without control characters'],
    ),
    "id is a word of the format": (
        changed(('"1"', '"nearest"')),
        ['balls[1].id = "nearest": means the nearest ball in a shot: choose another id'],
    ),
    "repeated id": (changed(('"1"', '"C"')), ['balls[1].id = "C": is the id of balls[0] already']),
    "two cue balls": (
        changed(('id = "1"', 'id = "1"\ncue = true')),
        ["balls[1].cue = true: balls[0] is the cue ball already"],
    ),
    "overlapping balls": (
        changed(("[40, 21]", "[62.5, 22.25]")),
        ['balls[1].position = [62.5, 22.25]: ball "1" overlaps ball "C" by 0.99 in (0.44 radii)'],
    ),
    "ball off the table": (
        changed(("[40, 21]", "[40, 44.5]")),
        ['balls[1].position = [40, 44.5]: ball "1" is off the table'],
    ),
    "ball in a cushion": (
        changed(("[40, 21]", "[40, 2.2]")),
        ['balls[1].position = [40, 2.2]: ball "1" overlaps cushion 0 by 0.05 in (0.022 radii)'],
    ),
    "ball in two cushions": (
        changed(("[40, 21]", "[87, 43]")),
        ['balls[1].position = [87, 43]: ball "1" overlaps cushions 1, 2 by 1.3 in (0.56 radii)'],
    ),
    "hits without restitution": (
        changed(("ball_ball = 0.9", "")),
        ["restitution.ball_ball = (left out): is missing where two balls can meet"],
    ),
}

SHOTS: dict[str, Case] = {
    "no velocity": (
        changed((LAUNCH, "")),
        ["shots[0].velocity = (left out): is missing (or speed and angle, or speed and aim)"],
    ),
    "speed without direction": (
        changed((LAUNCH, "speed = 4")),
        ["shots[0].angle = (left out): is missing beside speed (or aim)"],
    ),
    "angle without speed": (
        changed((LAUNCH, "angle = 180")),
        ["shots[0].speed = (left out): is missing beside angle"],
    ),
    "aim without speed": (
        changed((LAUNCH, 'aim = "1"')),
        ["shots[0].speed = (left out): is missing beside aim"],
    ),
    "velocity beside speed and angle": (
        changed((LAUNCH, LAUNCH + "\nspeed = 4\nangle = 180")),
        [
            "shots[0].speed = 4: stands beside velocity: one of the two",
            "shots[0].angle = 180: stands beside velocity: one of the two",
        ],
    ),
    "aim beside angle": (
        changed((LAUNCH, 'speed = 4\nangle = 180\naim = "1"')),
        ['shots[0].aim = "1": stands beside angle: one of the two'],
    ),
    "negative speed": (
        changed((LAUNCH, "speed = -4\nangle = 0")),
        ["shots[0].speed = -4: must be 0 or more"],
    ),
    "infinite angle": (
        changed((LAUNCH, "speed = 4\nangle = inf")),
        ["shots[0].angle = inf: must be a finite number"],
    ),
    "infinite velocity": (
        changed((LAUNCH, "velocity = [inf, 0]")),
        ["shots[0].velocity = [inf, 0]: must be two finite numbers"],
    ),
    "aim at itself": (
        changed((LAUNCH, 'speed = 4\naim = "C"')),
        ['shots[0].aim = "C": a ball cannot aim at itself'],
    ),
    "aim at nobody": (
        changed(
            (LAUNCH, 'speed = 4\naim = "nearest"'), ('[[balls]]\nid = "1"\nposition = [40, 21]', "")
        ),
        ['shots[0].aim = "nearest": there is no other ball to aim at'],
    ),
    "aim at a stranger": (
        changed((LAUNCH, 'speed = 4\naim = "8"')),
        ['shots[0].aim = "8": there is no such ball (there are: C, 1)'],
    ),
    "unknown ball": (
        changed((LAUNCH, LAUNCH + '\nball = "8"')),
        ['shots[0].ball = "8": there is no such ball (there are: C, 1)'],
    ),
    "empty ball": (
        changed((LAUNCH, LAUNCH + '\nball = ""')),
        ['shots[0].ball = "": there is no such ball (there are: C, 1)'],
    ),
    "no ball and no cue ball": (
        changed(("cue = true", "")),
        ["shots[0].ball = (left out): is missing where there is no cue ball"],
    ),
    "first shot from the previous": (
        changed((LAUNCH, LAUNCH + '\nfrom = "previous"')),
        ['shots[0].from = "previous": there is no shot before the first'],
    ),
    "repeated name": (
        GOOD + '[[shots]]\nname = "break"\nvelocity = [1, 0]\n',
        ['shots[1].name = "break": is the name of shots[0] already'],
    ),
    "a name that another shot gets by default": (
        GOOD.replace('"break"', '"Shot 2"') + "[[shots]]\nvelocity = [1, 0]\n",
        ['shots[1].name = "Shot 2": is the name of shots[0] already'],
    ),
    "empty name": (
        changed(('name = "break"', 'name = ""')),
        ['shots[0].name = "": must not be empty'],
    ),
    "published ends": (
        GOOD + '[shots.published]\n1 = [1]\nC = [nan, 1]\n8 = [1.5, 2]\n"a.b" = [3, 4]\n',
        [
            "shots[0].published.1 = [1]: must be two numbers, [x, y]",
            "shots[0].published.C = [nan, 1]: must be two finite numbers",
            "shots[0].published.8 = [1.5, 2]: there is no such ball (there are: C, 1)",
            'shots[0].published."a.b" = [3, 4]: there is no such ball (there are: C, 1)',
        ],
    ),
    "name with a control character": (
        changed(('name = "break"', r'name = "\u001b[2J"')),
        [r'shots[0].name = "\x1b[2J": must be one line of text without control characters'],
    ),
    "nothing brings it to rest": (
        changed(("surface = 0.1", "")),
        [
            "physics.max_time = (left out): is missing: without surface friction and gravity the "
            "balls never come to rest"
        ],
    ),
}

MALFORMED = SYNTAX | KEYS_AND_TYPES | NUMBERS | TABLES | BALLS | SHOTS


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("[table]", "[tabel]"),
        ("[restitution]", "[restituton]"),
        ("[friction]", "[fricton]"),
        ("[ball]", "[bal]"),
        ("[[shots]]", "[[shot]]"),
        ("ball_ball = 0.9", "bal_ball = 0.9"),
        ("cushion = 0.7", "cushon = 0.7"),
        ("surface = 0.1", "surfaces = 0.1"),
        ("radius = 2.25", "radus = 2.25"),
        ("position = [66, 22]", "postion = [66, 22]"),
        ('id = "1"', 'ids = "1"'),
        ("velocity = [-4, 0]", "velocty = [-4, 0]"),
    ],
)
def test_a_misspelt_key_is_one_line_and_nothing_is_left_out(right: str, wrong: str) -> None:
    (line,) = problems(changed((right, wrong)))
    assert line.endswith(f'did you mean "{re.split("[][ =]+", right.strip("["))[0]}"?')


def test_balls_that_are_misspelt_are_one_line_and_any_id_may_be_one_of_them() -> None:
    (line,) = problems(
        GOOD.replace("[[balls]]", "[[bals]]").replace(LAUNCH, 'speed = 4\naim = "1"')
    )
    assert line.endswith('did you mean "balls"?')


def test_a_key_that_stands_beside_a_misspelt_one_is_checked() -> None:
    text = changed(("surface = 0.1", "surface = -0.1\nsurfaces = 0.1"))
    lines = problems(text)
    assert len(lines) == 2
    assert "friction.surface = -0.1: must be 0 or more" in lines


@pytest.mark.parametrize(("text", "lines"), MALFORMED.values(), ids=MALFORMED)
def test_malformed_scenarios(text: str, lines: list[str]) -> None:
    assert problems(text) == lines


def test_all_problems_of_a_file_are_said_at_once() -> None:
    """Each problem has one line, and nothing is said that only follows from them.

    The file has a wrong type, an unknown key, a number out of range, a missing value, a ball off
    the table and an unknown ball.
    """
    text = changed(
        ("surface = 0.1", 'surface = "ice"'),
        ("[ball]", '[ball]\nweight = "heavy"'),
        ("cushion = 0.7", "cushion = 1.2"),
        ("width = 44", ""),
        ('id = "1"', 'id = "1"\nradius = -1'),
        (LAUNCH, 'speed = 4\naim = "8"'),
    )
    assert sorted(problems(text)) == [
        'ball.weight = "heavy": unknown key (there are: radius, mass, color)',
        "balls[1].radius = -1: must be greater than 0",
        'friction.surface = "ice": must be a number',
        "restitution.cushion = 1.2: must be between 0 and 1",
        'shots[0].aim = "8": there is no such ball (there are: C, 1)',
        "table.width = (left out): is missing (or an outline)",
    ]


def test_places_are_checked_although_something_else_is_wrong() -> None:
    text = changed(("[66, 22]", "[66, 1]"), ("[40, 21]", "[99, 21]"), (LAUNCH, 'ball = "8"'))
    assert problems(text) == [
        "shots[0].velocity = (left out): is missing (or speed and angle, or speed and aim)",
        'balls[0].position = [66, 1]: ball "C" overlaps cushion 0 by 1.2 in (0.56 radii)',
        'balls[1].position = [99, 21]: ball "1" is off the table',
        'shots[0].ball = "8": there is no such ball (there are: C, 1)',
    ]


def test_one_unsound_ball_does_not_hide_another() -> None:
    text = changed(('id = "C"', 'id = "C"\nmass = "x"'), ("[40, 21]", "[40, 1]"))
    assert problems(text) == [
        'balls[0].mass = "x": must be a number',
        'balls[1].position = [40, 1]: ball "1" overlaps cushion 0 by 1.2 in (0.56 radii)',
    ]


@pytest.mark.parametrize(
    "change",
    [('id = "1"', "id = 1"), ('id = "1"', ""), ('[[balls]]\nid = "1"\nposition = [40, 21]', "")],
    ids=["wrong type", "left out", "no such ball"],
)
def test_a_name_is_not_called_unknown_where_a_ball_has_no_sound_id(change: tuple[str, str]) -> None:
    lines = problems(changed(change, (LAUNCH, 'speed = 1\naim = "1"')))
    assert any("no such ball" in line for line in lines) == (change[1] == "" and "[[" in change[0])


def test_a_default_that_is_wrong_is_said_once() -> None:
    more = "".join(f'[[balls]]\nid = "b{k}"\nposition = [{k}, 0]\n' for k in range(5))
    text = "[ball]\nradius = -1\nmass = 1\n[restitution]\nball_ball = 1\n" + more
    assert problems(text) == ["ball.radius = -1: must be greater than 0"]


def test_many_ids_are_cut_short() -> None:
    many = "".join(f'[[balls]]\nid = "b{k}"\nposition = [{k}, 0]\n' for k in range(1000))
    text = (
        "[ball]\nradius = 0.1\nmass = 1\n[restitution]\nball_ball = 1\n[friction]\nsurface = 1\n"
        + many
        + '[[shots]]\nball = "x"\nvelocity = [1, 0]\n'
    )
    assert problems(text) == [
        'shots[0].ball = "x": there is no such ball '
        "(there are: b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10, b11 and 988 more)"
    ]


# -- what is wrong with getting at a file ---------------------------------------------------------


def load_problem(path: str | Path) -> str:
    with pytest.raises(SceneError) as caught:
        load(path)
    (line,) = str(caught.value).splitlines()
    return line


def test_a_missing_file_is_answered_with_the_bundled_names() -> None:
    line = load_problem("rpeort")
    assert line.startswith('scenario = "rpeort": there is no such file (bundled: ')
    assert all(name in line for name in bundled())


def test_a_path_that_no_file_can_have() -> None:
    assert load_problem("a\0b").startswith(r'scenario = "a\x00b": there is no such file')


def test_a_directory_is_no_file(tmp_path: Path) -> None:
    assert load_problem(tmp_path).startswith("scenario = ")
    assert load_problem(tmp_path).endswith(": cannot be read: Is a directory")


def test_a_file_that_is_not_utf8(tmp_path: Path) -> None:
    path = tmp_path / "latin.toml"
    path.write_bytes('title = "Königsstoß"\n'.encode("latin-1"))
    assert load_problem(path) == f'{path}: byte 11 = "0xf6": is not UTF-8 text'


def test_problems_name_the_file_as_it_was_given(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(changed(("surface = 0.1", "surface = -0.1")), encoding="utf-8")
    assert load_problem(path) == f"{path}: friction.surface = -0.1: must be 0 or more"
