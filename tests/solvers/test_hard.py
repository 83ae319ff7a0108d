"""Solvers agree with answers in many digits where contacts are hard, or say that they may not.

The reference is checked against itself first: two methods with the same end.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import pytest
from mpmath import mp, mpc, mpf

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, simulate
from tests import DATA
from tests.large.hard_random import TooLongError, time_limit
from tests.oracle.hard_reference import COARSE, FINE, Settings, hard_run, off
from tests.oracle.reference import Refused, scene_from_dict
from tests.shared.hard_kinds import FOUND, KINDS, RECORDS, random_hard_scene
from tests.shared.hard_scenes import unmeasured
from tests.shared.scenes import seeds, takes_long

ANSWERS = json.loads((DATA / "hard_runs.json").read_text())
EASY = json.loads((DATA / "reference_runs.json").read_text())
BY_NAME = {record["name"]: record for record in ANSWERS}


def ends_off(scene: Scene, final: Sequence[Sequence[Any]]) -> tuple[float, tuple[str, ...]]:
    """Return how far (m) the exact solver ends from an answer, and its warnings."""
    run = simulate(scene, solver="event-driven")
    ends = zip(scene.balls, final, strict=True)
    far = max(math.dist(run.final[ball.id], (float(x), float(y))) for ball, (x, y) in ends)
    return far, run.warnings


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(record, marks=[pytest.mark.slow] * (k % 3 > 0), id=record["name"])
        for k, record in enumerate(ANSWERS)
    ],
)
def test_hard_contacts_in_many_digits(record: dict[str, Any]) -> None:
    """A run agrees within rounding, 1e-12 m times the scene's amplification, or has warnings."""
    far, warnings = ends_off(scene_from_dict(record["scene"]), record["final"])
    allowed = max(1e-12 * record["amplification"], record["trusted"])
    assert far <= allowed or warnings, f"{far:.1e} m off, and no warning"


# -- the reference against itself ------------------------------------------------------------------

QUICK = ("squeeze 0", "corner 0", "row 5", "packed 2", "moving 0", "struck 4", "found corner 113")
# No change of the engine makes the reference another, so `.ci/run` plays some of its records.
ELSEWHERE = pytest.mark.slow, takes_long


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(record, marks=() if name in QUICK else ELSEWHERE, id=name)
        for name, record in BY_NAME.items()
    ],
)
def test_the_reference_has_the_answers_on_file_to_their_last_digit(record: dict[str, Any]) -> None:
    run = hard_run(scene_from_dict(record["scene"]))
    assert (run.hits, run.most_at_once) == (record["hits"], record["most_at_once"])
    ends = [x for place in run.final for x in (place.real, place.imag)]
    with mp.workdps(40):
        for x, digits in zip(ends, chain(*record["final"]), strict=True):
            assert mp.almosteq(x, mpf(digits), 1e-19, 1e-19)


def squeeze(ratio: float, gap: float = 0.1, aside: float = 0.0, mu: float = 0.0) -> Scene:
    """Return a heavy ball that drives a light one to a cushion."""
    r = 0.0625
    return Scene(
        balls=(
            Ball("light", (r + gap, 0.5), r, 0.125),
            Ball("heavy", (3 * r + 2 * gap, 0.5 + aside), r, 0.125 * ratio, velocity=(-1, aside)),
        ),
        table=Table.rectangle(2, 1),
        restitution=Restitution(0.3, cushion=0.6),
        friction=Friction(0.05, mu, mu),
        physics=Physics(max_time=10),
    )


def test_there_are_answers_of_every_kind() -> None:
    names = {f"{kind} {k}" for kind, count in RECORDS.items() for k in range(count)}
    assert names | {f"found {kind} {k}" for kind, k in FOUND} == set(BY_NAME)
    assert all(record["trusted"] < 1e-13 for record in ANSWERS)


@takes_long
def test_easy_scenes_end_where_the_other_reference_has_them() -> None:
    easy = [record for record in EASY if record["scene"]["law"] == "coulomb"]
    for record in easy:
        run = hard_run(scene_from_dict(record["scene"]))
        for place, answer in zip(run.final, record["run"]["final"], strict=True):
            with mp.workdps(40):
                assert abs(place - mpc(*map(mpf, answer))) < 1e-18


@pytest.mark.parametrize("mu", [0.0, 0.2])
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_the_short_way_ends_where_hit_by_hit_does(gap: float, mu: float) -> None:
    scene = squeeze(60, gap, gap / 100, mu)
    short, long = (hard_run(scene, replace(FINE, shortcut=short)) for short in (True, False))
    assert short.hits == long.hits > 500
    assert off(short, long) < 1e-60


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_tiny_gaps_have_the_answer_of_none(mu: float) -> None:
    scene = squeeze(1000, 0.0, 0.0, mu)
    base = hard_run(scene)
    for gap in (1e-15, 1e-20):
        tiny = hard_run(scene, FINE, [mpc(gap), mpc(2 * gap)])
        assert off(tiny, base) < 20 * gap


def test_normals_may_stand_still_in_the_last_moment() -> None:
    """With 180 digits, hits go on in time until they are 1e-60 s apart, and end nowhere else."""
    scene = squeeze(20, 0.1, 0.001, 0.1)
    in_time = Settings(digits=180, at_once=1e-60, near=1e-55, no_gap=1e-90)
    run, base = hard_run(scene, in_time), hard_run(scene)
    assert run.hits == base.hits > run.most_at_once
    assert base.most_at_once > run.most_at_once
    assert off(run, base) < 1e-20


@pytest.mark.parametrize("kick", [1e-4, pytest.param(1e-5, marks=ELSEWHERE)])
@pytest.mark.parametrize(
    "name", ["struck 3", *(pytest.param(f"persistent {k}", marks=ELSEWHERE) for k in (1, 3))]
)
def test_contact_forces_are_the_limit_of_ever_smaller_hits(name: str, kick: float) -> None:
    scene = scene_from_dict(BY_NAME[name]["scene"])
    base = hard_run(scene)
    more, less = (
        off(hard_run(scene, Settings(digits=50, closed=0, kick=one)), base)
        for one in (10 * kick, kick)
    )
    assert less < min(0.1 * kick, more / 4)


@pytest.mark.slow
@pytest.mark.seeded
@takes_long
@pytest.mark.parametrize("kind", KINDS)
def test_coarser_bounds_leave_random_ends_where_they_are(kind: str) -> None:
    """Scenes that take the reference long are left out."""
    for seed in seeds(10):
        scene = random_hard_scene(kind, random.Random(f"coarse {kind} {seed}"))
        try:
            with time_limit(10):
                run, coarse = hard_run(scene), hard_run(scene, COARSE)
        except (Refused, TooLongError):
            continue
        assert off(run, coarse) < 1e-13, seed


# -- scenes that once went wrong -------------------------------------------------------------------


def checked(kind: str, k: int) -> Scene:
    """Return the scene of that number of ``python -m tests.large.hard_random``."""
    return random_hard_scene(kind, random.Random(f"check {kind} {k}"))


@takes_long
@pytest.mark.slow
@pytest.mark.parametrize("k", [28, 188])
def test_the_reference_sees_balls_meet_again_that_part_while_others_press(k: int) -> None:
    """Balls that touch and part may close again within one step under contact forces."""
    scene = checked("packed", k)
    far, _ = ends_off(scene, [(p.real, p.imag) for p in hard_run(scene).final])
    assert far < 2e-6


def test_every_ball_of_a_settled_run_is_at_rest() -> None:
    """A stop that is due at the time of a void one is still due when void ones are left out."""
    run = unmeasured(checked("packed", 188))
    assert run.status == "settled"
    assert all(not breakpoints[-1, 3:].any() for breakpoints in run.knots)


@takes_long
@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="five nudges of 399 events see 2e-4 m of 4 cm")
def test_a_run_says_what_hangs_on_the_order_of_hits_of_balls_that_press() -> None:
    """A ball is hit that presses on another: their tiny gap decides the order of the hits."""
    scene = checked("packed", 168)
    run = simulate(scene, solver="event-driven")
    far, _ = ends_off(scene, [(p.real, p.imag) for p in hard_run(scene).final])
    assert 1e-3 < far < run.policy_shift


@pytest.mark.slow
def test_a_pair_whose_bounces_are_nearly_rounding_does_not_hit_without_end() -> None:
    """What is too slow for a hit, and too near for a later one, is in persistent contact."""
    run = unmeasured(checked("struck", 200))
    assert run.status == "settled"
    assert run.steps < 5_000
