"""The figure of a run covers what rounding did to its ends, and is not much too large."""

from __future__ import annotations

import json
import math
import random
import statistics
import time
from collections.abc import Iterable
from contextlib import suppress
from fractions import Fraction
from itertools import islice
from typing import Any

import pytest
from mpmath import mpf

from pool_pymunk import Ball, Physics, Restitution, Run, Scene, Table, simulate
from pool_pymunk.studies.changes import rounding
from tests import DATA
from tests.oracle import reference
from tests.shared.rounding_scenes import CLASSES, error, rolling
from tests.shared.scenes import BASE_SEED, share_of

SCENES = 28
MOST_TOO_LARGE = 30.0  # in the median


def covers(runs: Iterable[tuple[Run, Iterable[Any]]], most: float = MOST_TOO_LARGE) -> None:
    """Check the figures of some runs against their true ends: they are not much too large."""
    too_large = []
    for run, final in runs:
        off, figure = error(run, final), rounding(run)
        if run.persistent:  # What is left out there is far more than rounding.
            assert run.policy_shift is not None
            figure = run.persistent_shift + run.policy_shift
        assert off <= figure
        if off > 0.0:
            too_large.append(figure / off)
    assert statistics.median(too_large) <= most


@pytest.mark.parametrize("name", CLASSES)
def test_the_figure_covers_what_rounding_did(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    scenes = [CLASSES[name](random.Random(f"{name} {k}")) for k in range(SCENES)]
    runs = [simulate(scene, solver="event-driven") for scene in scenes]
    covers((run, reference.reference_run(run.scene).final) for run in runs)


# -- balls that roll -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in CLASSES if name != "nearly plastic"])
def test_the_figure_covers_it_where_balls_roll(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Balls that hardly bounce are held together by their rolls, which has no exact answer."""
    monkeypatch.setattr(reference, "GENTLE", mpf(10) ** -25)
    numbers = [random.Random(f"{name} {k}") for k in range(SCENES // 2)]
    runs = [simulate(rolling(CLASSES[name](rng), rng), solver="event-driven") for rng in numbers]
    answered = []
    for run in runs:
        with suppress(reference.Refused):
            answered.append((run, reference.reference_run(run.scene).final))
    assert len(answered) >= SCENES // 3
    covers(answered, 2.0 * MOST_TOO_LARGE)


def test_the_figure_covers_it_in_random_scenes_where_balls_roll() -> None:
    known = json.loads((DATA / "rolling_runs.json").read_text(encoding="utf-8"))
    runs = [simulate(reference.scene_from_dict(each["scene"]), solver="event-driven")
            for each in known]  # fmt: skip
    covers((run, each["run"]["final"]) for run, each in zip(runs, known, strict=True))


@pytest.mark.slow
@pytest.mark.seeded
def test_the_figure_covers_it_in_two_hundred_fresh_scenes_where_balls_roll() -> None:
    """Of a share of them the median may be larger, as 32 draws of signs are right to 12 %."""
    fresh = islice(reference.fresh_scenes("rolling", BASE_SEED), share_of(200))
    runs = ((simulate(scene, solver="event-driven"), known["final"]) for scene, known in fresh)
    covers(runs, 1.12 * MOST_TOO_LARGE)


# -- long runs -------------------------------------------------------------------------------------


def folded(place: Fraction, low: Fraction, high: Fraction) -> Fraction:
    """Return where a ball is between two cushions, from where it would be without them."""
    distance = (place - low) % (2 * (high - low))
    return low + min(distance, 2 * (high - low) - distance)


@pytest.mark.parametrize("slope", [0.0, 0.7])
def test_the_errors_of_like_contacts_add_up(slope: float) -> None:
    """A ball between cushions, without any loss: its end is a rational number."""
    ball = Ball("a", (0.3, 0.4), 0.05, 0.2, velocity=(1.1, 1.1 * slope))
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), Restitution(cushion=1.0),
                  physics=Physics(max_time=4_000.0))  # fmt: skip
    run, r = simulate(scene, solver="event-driven"), Fraction(0.05)
    distances = [Fraction(p) + 4_000 * Fraction(v)
            for p, v in zip(ball.position, ball.velocity, strict=True)]  # fmt: skip
    truth = [
        folded(distance, r, side - r) for distance, side in zip(distances, (2, 1), strict=True)
    ]
    ends = zip(run.end.position[0], truth, strict=True)
    off = math.hypot(*(float(Fraction(p) - q) for p, q in ends))
    assert off <= run.rounding <= 100.0 * off


def test_chaos_is_as_large_as_the_table_and_soon_known() -> None:
    """Ten balls without any loss: after some dozen contacts nothing is known of them."""
    balls = tuple(
        Ball(str(k), (0.2 + 0.36 * (k % 5), 0.3 + 0.4 * (k // 5)), 0.05, 0.2,
             velocity=(math.cos(2.4 * k), math.sin(2.4 * k)))
        for k in range(10)
    )  # fmt: skip
    scene = Scene(balls, Table.rectangle(2.0, 1.0), Restitution(1.0, cushion=1.0),
                  physics=Physics(max_time=1e6))  # fmt: skip
    run = simulate(scene, solver="event-driven", max_events=3_000)
    assert run.rounding == math.hypot(2.0, 1.0)


def test_the_figure_of_a_long_run_takes_no_longer_than_fifteen_such_runs() -> None:
    ball = Ball("a", (0.3, 0.4), 0.05, 0.2, velocity=(1.1, 0.7))
    scene = Scene((ball,), Table.rectangle(2.0, 1.0), Restitution(cushion=1.0),
                  physics=Physics(max_time=1e6))  # fmt: skip
    began = time.process_time()
    run = simulate(scene, solver="event-driven", max_events=5_000)
    played = time.process_time()
    assert 0.0 < run.rounding < 1e-6
    assert time.process_time() - played < 15.0 * (played - began)  # It takes some seven.
