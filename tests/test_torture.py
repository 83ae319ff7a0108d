"""The torture suite: our own column, the known answers, and the page that shows the results.

Nothing here needs another package or the network.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from typing import Any

import pytest
from oracle.reference import reference_run

from pool_pymunk import Ball, Physics, Restitution, Scene, Table, simulate
from pool_pymunk.studies.stability.known import HEAVY, LIGHT, elastic, pi_velocities
from torture import export, show
from torture.play import PACKAGES, is_for, result
from torture.runners import by_ours, common
from torture.scenes import FILE, SCENES, judge

LONG = ("e = 1, a million contacts", "e = 1, ten thousand contacts")
SLOW = ("balls pass through each other",)
BY_NAME = {scene.name: scene for scene in SCENES}


def answered(name: str, setting: str) -> dict[str, Any]:
    """Return our answer to a scene, as a runner gives it."""
    given = json.loads(json.dumps(BY_NAME[name].plain()))
    request = {"scene": given, "setting": setting, "limit": 60}
    return common._answer(request, by_ours.OFFERS, by_ours.SETTINGS, by_ours.play)


@pytest.mark.parametrize("setting", by_ours.SETTINGS)
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else [])
        for name in BY_NAME
        if name not in LONG
    ],
)
def test_we_survive_or_do_not_offer(name: str, setting: str) -> None:
    row = result(BY_NAME[name], answered(name, setting))
    if BY_NAME[name].gravity:
        assert row["not offered"][0] == "gravity in the plane"
    else:
        assert show.verdict(BY_NAME[name], row).startswith("✓"), row


def test_errors_are_far_below_the_tolerances() -> None:
    """Tolerances are for everybody; ours are errors of rounding, except where a scene nudges."""
    for name in ("reversal", "six balls", "wedge", "graze", "stop shot", "three digits of pi"):
        errors = judge(BY_NAME[name], answered(name, "event-driven"))
        assert max(error for _, error in errors) < 1e-10


def test_six_balls_are_those_of_forty_digits() -> None:
    given = BY_NAME["six balls"]
    scene = Scene(
        tuple(
            Ball(str(i), (b.x, b.y), b.r, b.m, velocity=(b.vx, b.vy))
            for i, b in enumerate(given.balls)
        ),
        Table(given.walls),
        Restitution(1.0, cushion=1.0),
        physics=Physics(max_time=given.time),
    )
    exact = reference_run(scene).final
    known = given.checks[0].answer
    assert max(math.dist(end, right) for end, right in zip(exact, known, strict=True)) < 1e-15
    assert len(simulate(scene, solver="event-driven").events) == 9


def test_galperins_balls_hit_3141_times() -> None:
    light, heavy, hits = pi_velocities(LIGHT, HEAVY)
    assert hits == 3141
    assert LIGHT * light**2 + HEAVY * heavy**2 == pytest.approx(HEAVY)


def test_elastic_hits_keep_momentum_and_energy() -> None:
    v, w = elastic(2.0, 3.0, 5.0, -1.0)
    assert 2.0 * v + 5.0 * w == pytest.approx(2.0 * 3.0 - 5.0)
    assert 2.0 * v * v + 5.0 * w * w == pytest.approx(2.0 * 9.0 + 5.0)


@pytest.mark.parametrize("name", ["wedge", "stop shot", "gradient", "thin cut"])
def test_an_answer_beyond_the_tolerance_does_not_survive(name: str) -> None:
    scene = BY_NAME[name]
    answer = answered(name, "event-driven")
    moved = 1.1 * scene.checks[0].tolerance
    row = answer["gradient"] if scene.nudge else answer["states"][-1][0]
    row[2 if scene.checks[0].kind == "velocities" else 0] += moved
    assert show.verdict(scene, result(scene, answer)).startswith("**off by")


def test_overlap_outside_and_mirror_are_seen() -> None:
    rack, thin = BY_NAME["balls pass through each other"], BY_NAME["fast ball, thin walls"]
    twice = [list(ball[:4]) for ball in rack.balls]
    twice[0] = twice[1]
    overlap, inside = (error for _, error in judge(rack, {"states": [twice]}))
    assert overlap == pytest.approx(2 * rack.balls[0].r)
    assert inside == 0.0
    outside = [[2.5, 0.5, 100.0, 7.0]]
    assert judge(thin, {"states": [outside]})[0][1] == pytest.approx(0.53)
    mirror = BY_NAME["mirror"]
    state = [list(ball[:4]) for ball in mirror.balls]
    state[0][1] += 0.1
    assert judge(mirror, {"states": [state]})[0][1] == pytest.approx(0.1)


def test_energy_has_a_sign_for_height() -> None:
    scene = BY_NAME["e = 1, dropped on a floor"]
    (x, y, *_), fallen = scene.balls[0], 1.0
    speed = (2 * 9.81 * fallen) ** 0.5
    state = [[x, y - fallen, 0.0, -speed]]
    assert judge(scene, {"states": [state]})[0][1] < 1e-12


def test_what_a_scene_needs_follows_from_its_numbers() -> None:
    assert BY_NAME["six balls"].needs == ()
    assert BY_NAME["wedge"].needs == ("any outline",)
    assert BY_NAME["three digits of pi"].needs == ("unequal masses",)
    assert replace(BY_NAME["stop shot"], rolling=None).needs == ("friction of sliding discs",)
    request = {"scene": BY_NAME["stop shot"].plain(), "setting": "x"}
    row = common._answer(request, set(), {"x": {"given": {}}}, by_ours.play)
    assert row == {"not offered": ["balls that roll"]}


def test_an_error_of_a_package_is_an_answer() -> None:
    def fails(*_: object) -> None:
        raise ValueError("no root")

    request = {"scene": BY_NAME["wedge"].plain(), "setting": "x", "limit": 60}
    row = common._answer(request, {"any outline"}, {"x": {"given": {}}}, fails)
    assert row == {"error": "ValueError: no root"}


def test_the_scenes_are_exported_from_the_extremes() -> None:
    """After a change of a case, `python -m torture.export` makes the file anew."""
    assert FILE.read_text(encoding="utf-8") == export.text()


def test_results_have_every_scene_and_setting() -> None:
    found = show.results()
    assert list(found) == list(PACKAGES)
    for name, measured in found.items():
        assert list(measured["versions"].values())
        for scene in SCENES:
            settings = {
                setting
                for setting, about in measured["settings"].items()
                if is_for(about["given"], scene)
            }
            assert set(measured["scenes"][scene.name]) == settings, (name, scene.name)


def test_the_pages_are_made_of_the_results() -> None:
    """After `python -m torture.play`, `python -m torture.show` makes them anew."""
    texts = [path.read_text(encoding="utf-8") for path in show.PAGES]
    for text in texts:
        assert show.page(text, show.results()) == text
    marks = {mark for text in texts for mark in re.findall(r"^<!-- (\w+) -->$", text, re.M)}
    assert marks == {"counts", "survivors", "scenes", "speeds", "settings", "machine", "end"}
