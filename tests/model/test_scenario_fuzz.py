"""Any scenario text gives a sound Scene, or a SceneError of clear lines, and nothing else."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pool_pymunk import load, loads
from pool_pymunk.model import Scene, SceneError
from pool_pymunk.model.problems import LARGEST, SMALLEST
from pool_pymunk.model.scenario import bundled
from tests.shared.scenes import lines_run, some_slow
from tests.shared.texts import text_of as scenario_text

FILE = "fuzz.toml"
LINE = re.compile(rf"{re.escape(FILE)}: .+?( = .+)?: .+")
# It holds a key, a value of 60 characters, and a message that may list a dozen names.
LONGEST_LINE = 600

EXTREMES = (
    0.0, -0.0, 1.0, -1.0, 5e-324, 1e-320, 1e-308, 1e-162, 1e-100, 1e-99, 1e99, 1e100, 1e154, 1e308,
    -1e308, math.inf, -math.inf, math.nan, 2**53, 2**63, -(2**63), 10**400, -(10**400), 1e-9, 1e9,
)  # fmt: skip

SCENARIO = tomllib.loads(scenario_text("fuzzed"))
OUTLINE = [[0.0, 0.0], [200.0, 0.0], [200.0, 100.0], [100.0, 80.0], [0.0, 100.0]]

Path_ = tuple[str | int, ...]


def paths(value: Any, here: Path_ = ()) -> list[Path_]:
    """Return where everything stands."""
    below: list[Path_] = []
    if isinstance(value, dict):
        below = [p for key, v in value.items() for p in paths(v, (*here, key))]
    elif isinstance(value, list):
        below = [p for k, v in enumerate(value) for p in paths(v, (*here, k))]
    return ([here] if here else []) + below


PLACES = [*paths(SCENARIO), ("table", "outline")]


def quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml(value: Any) -> str:
    """Return TOML in inline form."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{quoted(key)} = {toml(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return quoted(value) if isinstance(value, str) else str(value)


def text_of(raw: dict[str, Any]) -> str:
    return "".join(f"{quoted(key)} = {toml(value)}\n" for key, value in raw.items())


scalars = (
    st.sampled_from(EXTREMES)
    | st.floats()
    | st.integers(-(10**6), 10**6)
    | st.booleans()
    | st.text(max_size=12)
    | st.sampled_from(("C", "1", "nearest", "previous", "m", "published", "", "a\nb", "#ffffff"))
)
junk = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3)
    ),
    max_leaves=6,
)
outlines = st.lists(
    st.lists(st.sampled_from((*EXTREMES, 0.0, 50.0, 100.0, 200.0)), min_size=2, max_size=2),
    max_size=6,
)


@st.composite
def scenarios(draw: st.DrawFn) -> str:
    """Return the sound scenario with a few things replaced, taken out or put in."""
    raw = copy.deepcopy(SCENARIO)
    if draw(st.booleans()):
        raw["table"] = {"outline": draw(outlines | st.just(OUTLINE))}
    for _ in range(draw(st.integers(0, 4))):
        change(draw, raw, draw(st.sampled_from(PLACES)))
    return text_of(raw)


def change(draw: st.DrawFn, raw: Any, place: Path_) -> None:
    *path, last = place
    for part in path:
        try:
            raw = raw[part]
        except (KeyError, IndexError, TypeError):
            return
    what = draw(st.sampled_from(("replace", "extreme", "take out", "put in")))
    try:
        if what == "take out":
            del raw[last]
        elif what == "put in" and isinstance(raw, dict):
            raw[draw(st.text(max_size=8))] = draw(junk)
        else:
            raw[last] = draw(junk if what == "replace" else st.sampled_from(EXTREMES))
    except (KeyError, IndexError, TypeError):
        return


def answer(text: str) -> Scene | list[str]:
    """Return what ``loads`` says: a sound scene, or the lines of its error, checked."""
    try:
        scene = loads(text, FILE)
    except SceneError as error:
        lines = str(error).split("\n")
        assert lines == str(error).splitlines() and len(lines) == len(error.problems)
        for line in lines:
            assert LINE.fullmatch(line), line
            assert line.isprintable() and len(line) < LONGEST_LINE
        assert len(set(lines)) == len(lines)
        return lines
    assert_sound(scene)
    return scene


def assert_sound(scene: Scene) -> None:
    """Assert that everything a solver may ask gives finite numbers in range."""
    for ball in scene.balls:
        assert SMALLEST <= ball.radius <= LARGEST and SMALLEST <= ball.mass <= LARGEST
        assert all(abs(x) <= LARGEST for x in (*ball.position, *ball.velocity))
    for edge in scene.table.edges if scene.table else ():
        assert math.hypot(*edge.normal) == pytest.approx(1.0) and 0.0 < edge.length < math.inf
    assert 0.0 <= scene.deceleration < math.inf
    for i in range(1, len(scene.balls)):
        assert math.isfinite(sum(scene.pair(0, i)))
    for shot in (None, *scene.shots):
        state = scene.start(shot)
        assert all(map(math.isfinite, sum((*state.position, *state.velocity), ())))


def test_the_scenario_that_is_fuzzed_is_sound() -> None:
    assert isinstance(answer(text_of(SCENARIO)), Scene)
    assert isinstance(answer(text_of(SCENARIO | {"table": {"outline": OUTLINE}})), Scene)


@settings(max_examples=5 * settings().max_examples)
@given(scenarios())
def test_scenarios_with_a_few_changes(text: str) -> None:
    answer(text)


@settings(max_examples=2 * settings().max_examples)
@given(st.dictionaries(st.sampled_from(list(SCENARIO)) | st.text(max_size=5), junk, max_size=6))
def test_scenarios_of_junk(raw: dict[str, Any]) -> None:
    answer(text_of(raw))


@pytest.mark.parametrize("first", some_slow(5, quick=1))
def test_every_number_at_every_extreme(first: int) -> None:
    """Each key of the format takes each extreme, or says why not, one by one: a fifth at a time."""
    for k, (*path, last) in enumerate(PLACES):
        for value in EXTREMES[(first + k) % 5 :: 5]:
            raw = copy.deepcopy(SCENARIO)
            inner: Any = raw
            for part in path:
                inner = inner[part]
            inner[last] = value
            answer(text_of(raw))


@settings(max_examples=2 * settings().max_examples)
@given(
    scale=st.sampled_from((1e-320, 1e-200, 1e-99, 1e-60, 1.0, 1e60, 1e96, 1e200, 1e305)),
    balls=st.sampled_from((1e-320, 1e-99, 1.0, 1e96, 1e305)),
    masses=st.sampled_from((1e-320, 1e-90, 1.0, 1e96, 1e305)),
    outlined=st.booleans(),
)
def test_scenarios_of_any_size(scale: float, balls: float, masses: float, outlined: bool) -> None:
    raw = copy.deepcopy(SCENARIO)
    raw["units"] = {}
    raw["table"] = {"length": 200.0 * scale, "width": 100.0 * scale}
    if outlined:
        raw["table"] = {"outline": [[x * scale, y * scale] for x, y in OUTLINE]}
    for entry in raw["balls"]:
        entry["position"] = [x * scale for x in entry["position"]]
        entry |= {"radius": balls, "mass": masses}
    answer(text_of(raw))


@given(st.text())
@example("\ufeff")
@example("a = " + "[" * 3000)
def test_any_text(text: str) -> None:
    answer(text)


@settings(max_examples=2 * settings().max_examples)
@given(st.data())
def test_the_report_with_a_piece_cut_out_or_put_in(data: st.DataObject) -> None:
    text = bundled()["report"].read_text(encoding="utf-8")
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(start + 40, len(text))))
    answer(
        text[:start] + data.draw(st.text(max_size=4) | st.sampled_from('[]{}=",.#-0')) + text[end:]
    )


@given(content=st.binary(max_size=64))
def test_any_bytes(content: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    path: Path = tmp_path_factory.mktemp("fuzz") / FILE
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:  # 64 bytes are too few for a sound scenario.
        load(path)
    assert all(line.startswith(str(path)) for line in str(caught.value).splitlines())


@given(st.lists(st.text(min_size=1, max_size=6), min_size=1, max_size=30, unique=True))
def test_any_ids(ids: list[str]) -> None:
    raw: dict[str, Any] = {
        "ball": {"radius": 0.1, "mass": 1.0},
        "restitution": {"ball_ball": 0.5},
        "friction": {"surface": 0.1},
        "balls": [{"id": id_, "position": [k, 0]} for k, id_ in enumerate(ids)],
        "shots": [{"ball": id_, "velocity": [1, 0], "published": {id_: [1, 2]}} for id_ in ids],
    }
    found = answer(text_of(raw))
    if isinstance(found, Scene):
        assert [ball.id for ball in found.balls] == ids
    else:  # Only ids of blanks and control characters are refused.
        assert all(
            "must be one line" in line or "must not be empty" in line or "TOML" in line
            for line in found
        )


def many_balls(count: int, wrong: bool) -> str:
    """Write a scenario of this many balls, sound or with two mistakes each."""
    raw: dict[str, Any] = {
        "ball": {"radius": 0.4, "mass": 0 if wrong else 1},
        "restitution": {"ball_ball": 0.5},
        "balls": [
            {"id": f"b{k}", "position": [k % 70, k // 70], "velocity": [0, "x" if wrong else 0]}
            for k in range(count)
        ],
    }
    return text_of(raw)


@pytest.mark.parametrize("wrong", [False, True], ids=["sound", "each wrong"])
def test_the_work_of_reading_is_in_proportion_to_the_file(wrong: bool) -> None:
    """Four times the balls take four times the work, which is mostly the TOML parser's."""
    small, large = (many_balls(count, wrong) for count in (250, 1000))
    few, many = lines_run(lambda: answer(small)), lines_run(lambda: answer(large))
    assert many < 5 * few
    assert isinstance(answer(large), Scene) != wrong
