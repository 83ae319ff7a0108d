"""The torture suite: our own column, the known answers, and the page that shows the results.

Nothing here needs another package or the network.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pool_pymunk import simulate
from pool_pymunk.studies.stability.known import FILE, scene_of
from tests.oracle.reference import reference_run
from torture import show
from torture.play import PACKAGES, is_for, result
from torture.runners import by_ours, common
from torture.scenes import SCENES, judge

LONG = ("e = 1, a million contacts", "e = 1, ten thousand contacts")
SLOW = ("balls pass through each other",)
BY_NAME = {scene.name: scene for scene in SCENES}
ENTRIES = {entry["name"]: entry for entry in json.loads(FILE.read_text(encoding="utf-8"))}


def answered(name: str, setting: str) -> dict[str, Any]:
    """Return our answer to a scene, as a runner gives it."""
    given = json.loads(json.dumps(BY_NAME[name].plain()))
    request = {"scene": given, "setting": setting, "limit": 60}
    return common._answer(request, by_ours.OFFERS, by_ours.SETTINGS, by_ours.play)


# Steps in a pymunk space have the bits of the exact solver (tests/world/test_live.py).
@pytest.mark.parametrize(
    "setting",
    [pytest.param(each, marks=[pytest.mark.slow] if "pymunk" in each else [])
     for each in by_ours.SETTINGS],
)  # fmt: skip
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
    scene = scene_of(ENTRIES["six balls"])
    exact = reference_run(scene).final
    known = known_of(ENTRIES["six balls"])["ends"]
    assert max(math.dist(end, right) for end, right in zip(exact, known, strict=True)) < 1e-15
    assert len(simulate(scene, solver="event-driven").events) == 9


# -- closed forms ----------------------------------------------------------------------------------

Numbers = Mapping[str, Any]  # of a scene, as the file has them


def known_of(entry: Numbers) -> dict[str, Any]:
    """Return the answers of a scene by their kind."""
    return {kind: answer for kind, answer, *_ in entry["checks"] + entry.get("also", [])}


def folded(start: float, path: float, width: float) -> float:
    """Return where a point between two mirrors is (m), by a straight path that is folded."""
    unfolded = (start + path) % (2.0 * width)
    return min(unfolded, 2.0 * width - unfolded)


def in_box(entry: Numbers) -> dict[str, Any]:
    """A lone ball is in a rectangle from the origin, e = 1."""
    ((x, y, vx, vy, r, _),), (wide, high) = entry["balls"], entry["walls"][2]
    rows = ((x, vx, wide), (y, vy, high))
    return {"ends": [[folded(at - r, v * entry["time"], w - 2.0 * r) + r for at, v, w in rows]]}


def in_wedge(entry: Numbers) -> dict[str, Any]:
    """A lone ball is in a wedge of 20 degrees from the origin, e = 1."""
    ((x, y, vx, vy, r, _),), half, time = entry["balls"], math.radians(10.0), entry["time"]
    tip = r / math.sin(half)  # m; the tip of the wedge of centres
    x, y = x - tip + vx * time, y + vy * time
    angle = folded(math.atan2(y, x) + half, 0.0, 2.0 * half) - half
    far = math.hypot(x, y)
    return {"ends": [[tip + far * math.cos(angle), far * math.sin(angle)]]}


def elastic(m: float, v: float, other_m: float, other_v: float) -> tuple[float, float]:
    """Return both velocities (m/s) after a head-on hit with e = 1."""
    common = (m * v + other_m * other_v) / (m + other_m)
    return 2.0 * common - v, 2.0 * common - other_v


def head_on(entry: Numbers) -> dict[str, Any]:
    """Momentum and energy leave one answer."""
    (*_, v, _, _, m), (*_, other_v, _, _, other_m) = entry["balls"]
    return {"velocities": [[end, 0.0] for end in elastic(m, v, other_m, other_v)]}


def on_two(entry: Numbers) -> dict[str, Any]:
    """By symmetry both leave at 30 degrees, by momentum and energy at 2 sqrt(3) / 5."""
    x, y = (2.0 * math.sqrt(3.0) / 5.0 * part(math.radians(30.0)) for part in (math.cos, math.sin))
    return {"velocities": [[-0.2, 0.0], [x, y], [x, -y]]}


def cradle(entry: Numbers) -> dict[str, Any]:
    """One comes, one goes."""
    return {"velocities": [*[[0.0, 0.0]] * 5, [1.0, 0.0]]}


def beside(entry: Numbers) -> dict[str, Any]:
    """A ball at 1 m/s along x hits one beside its path: the line of centres takes its part."""
    _, (_, across, _, _, r, _) = entry["balls"]
    x, y = math.sqrt(4.0 * r * r - across**2) / (2.0 * r), across / (2.0 * r)
    return {"velocities": [[1.0 - x * x, -x * y], [x * x, x * y]]}


def galperin(entry: Numbers) -> dict[str, Any]:
    """A light ball is between a wall and a heavy one, and takes turns (Galperin 2003)."""
    (*_, light), (*_, heavy) = entry["balls"]
    v, big, hits = 0.0, -1.0, 0
    while v > big or v < 0.0:
        v, big = elastic(light, v, heavy, big) if v > big else (-v, big)
        hits += 1
    return {"velocities": [[v, 0.0], [big, 0.0]], "contacts": hits}


def together(entry: Numbers) -> dict[str, Any]:
    """All go on at the speed of their centre of mass."""
    speeds = [ball[2] for ball in entry["balls"]]
    return {"velocities": [[sum(speeds) / len(speeds), 0.0]] * len(speeds)}


def roll_on(entry: Numbers, speed: float, roll: float) -> float:
    """Return how far (m) a ball moves along its line: it slides, then rolls, then rests."""
    g, slip = 9.81, speed - roll
    rolls_at, slides = speed - 2.0 / 7.0 * slip, 2.0 / 7.0 * abs(slip) / (entry["friction"] * g)
    return float((speed + rolls_at) / 2.0 * slides + rolls_at**2 / (2.0 * entry["rolling"] * g))


def braked(entry: Numbers) -> dict[str, Any]:
    """A ball slides or rolls on until it hits another head-on; then both come to rest."""
    (x, _, v, *_, r, _), (other_x, *_) = entry["balls"]
    meets, roll = other_x - 2.0 * r, entry.get("roll", 0.0) * v  # m, m/s
    brake = 9.81 * entry["rolling" if roll else "friction"]  # m/s^2
    left = math.sqrt(v**2 - 2.0 * brake * (meets - x))  # m/s; the speed at which they meet
    if "rolling" not in entry:
        return {"ends": [[meets, 0.0], [other_x + left**2 / (2.0 * brake), 0.0]]}
    roll = left if roll else 2.5 * (v - left)  # as much as the cloth has given the ball by then
    on, other_on = roll_on(entry, 0.0, roll), roll_on(entry, left, 0.0)
    return {"ends": [[meets + on, 0.0], [other_x + other_on, 0.0]]}


def there_and_back(entry: Numbers) -> dict[str, Any]:
    """What is reversed comes back."""
    return {"ends": [ball[:2] for ball in entry["balls"]]}


def in_pairs(entry: Numbers) -> dict[str, Any]:
    """The partner of each ball is beyond the axis, and moves as its mirror image."""
    starts = [ball[:4] for ball in entry["balls"]]
    return {"mirror": [[k, starts.index([x, -y, u, -v])] for k, (x, y, u, v) in enumerate(starts)]}


def moved_on(entry: Numbers) -> dict[str, Any]:
    """The end of ball 2 is x1 + v1 T + 2 r."""
    return {"gradient": [1.0, 0.0, entry["time"], 0.0]}


CLOSED_FORMS: dict[str, Callable[[Numbers], dict[str, Any]]] = {
    "fast ball, ball at rest": head_on, "three balls at once": on_two, "Newton's cradle": cradle,
    "frozen rack, mirrored": in_pairs, "mirror": in_pairs, "thin cut": beside, "graze": beside,
    "fast ball, thin walls": in_box, "corner": in_box, "corner, both walls at once": in_box,
    "wedge": in_wedge, "gradient": moved_on, "reversal": there_and_back,
    "heavy on light": head_on, "light on heavy": head_on, "three digits of pi": galperin,
    "inelastic collapse": together, "slide to rest": braked, "follow": braked,
    "stop shot": braked,
}  # fmt: skip


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_an_answer_is_that_of_its_closed_form(name: str) -> None:
    known = known_of(ENTRIES[name])
    for kind, answer in CLOSED_FORMS[name](ENTRIES[name]).items():
        assert np.array(known[kind]) == pytest.approx(np.array(answer), rel=0.0, abs=2e-14)


def test_every_answer_has_a_source() -> None:
    """The others are in forty digits, or an invariant, which needs no numbers."""
    numbers = {name for name, entry in ENTRIES.items() if any(known_of(entry).values())}
    assert numbers == {*CLOSED_FORMS, "six balls"}


def test_galperins_balls_hit_3141_times() -> None:
    found = galperin(ENTRIES["three digits of pi"])
    (light, _), (heavy, _) = found["velocities"]
    assert found["contacts"] == 3141
    assert 1e-3 * light**2 + 1e3 * heavy**2 == pytest.approx(1e3)


def test_elastic_hits_keep_momentum_and_energy() -> None:
    v, w = elastic(2.0, 3.0, 5.0, -1.0)
    assert 2.0 * v + 5.0 * w == pytest.approx(2.0 * 3.0 - 5.0)
    assert 2.0 * v * v + 5.0 * w * w == pytest.approx(2.0 * 9.0 + 5.0)


# -- what a judge sees -----------------------------------------------------------------------------


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
