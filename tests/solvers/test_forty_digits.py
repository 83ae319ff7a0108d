"""The exact solver ends, and has its events, when and where the reference in forty digits says."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import Any

import pytest

from pool_pymunk import Pocket, Scene, SceneError
from tests import DATA
from tests.oracle.reference import (
    FILES,
    OUTLINES,
    Refused,
    fresh_scenes,
    random_round_scene,
    reference_run,
    run_to_dict,
    scene_from_dict,
)
from tests.shared.amplified import amplification
from tests.shared.hard_scenes import exact
from tests.shared.scenes import seeds, share_of

Answered = tuple[Scene, dict[str, Any]]  # a scene, and its run in forty digits
RECORDS = [each for file in FILES for each in json.loads((DATA / f"{file}_runs.json").read_text())]


def agrees(scene: Scene, answer: dict[str, Any]) -> None:
    """Check events of each ball, their times, who is pocketed where, and ends.

    Ends agree to 1e-13 m and times to 1e-12 s, times the scene's amplification. Coordinates of some
    metres are good to 4e-16 m, and a scene has some dozen contacts.
    """
    run = exact(scene)
    ends, times = amplification(scene, run, 3)
    for i, (ball, (x, y)) in enumerate(zip(scene.balls, answer["final"], strict=True)):
        mine = [event for event in run.events if ball.id in event.balls]
        its = [event for event in answer["events"] if i in event[2]]
        for event, (t, kind, balls, where) in zip(mine, its, strict=True):
            assert (event.kind, event.balls) == (kind, tuple(map(str, balls)))
            assert kind == "pocket" or event.cushion == where
            assert abs(event.t - float(t)) < 1e-12 * times
        assert math.dist(run.final[ball.id], (float(x), float(y))) < 1e-13 * ends
    fell = [(str(balls[0]), scene.pockets[hole].id) for _, kind, balls, hole in answer["events"]
            if kind == "pocket"]  # fmt: skip
    assert run.pocketed == dict(fell)
    assert run.duration == pytest.approx(float(answer["duration"]), abs=1e-12 * times)


@pytest.mark.parametrize("record", RECORDS, ids=lambda record: record["name"])
def test_random_scenes_on_file(record: dict[str, Any]) -> None:
    agrees(scene_from_dict(record["scene"]), record["run"])


# -- fresh ones, which POOL_SEED makes -------------------------------------------------------------


def round_scenes(pockets: bool = False) -> Iterator[Answered]:
    """Yield random scenes with arcs and posts, and perhaps with pockets that lie over arcs."""
    for k in range(seeds(1)[0] * 10_000, 10**9):
        rng = random.Random(f"round {k}")
        law, table = rng.choice(["coulomb", "published"]), rng.choice(sorted(OUTLINES))
        scene = random_round_scene(law, table, rng)
        try:
            scene = on_arcs(scene, rng) if pockets else scene
            if scene.pockets or not pockets:
                yield scene, run_to_dict(reference_run(scene))
        except (Refused, SceneError):
            continue  # A ball lies in a pocket, or a post.


def on_arcs(scene: Scene, rng: random.Random) -> Scene:
    """Return the scene with three pockets over arcs of its outline, if it has any."""
    arcs = [edge for edge in scene.table.edges if edge.bulge] if scene.table else []
    holes = [
        Pocket(str(n), rng.choice(arcs).at(rng.random())[0], round(rng.uniform(0.03, 0.2), 3))
        for n in range(3 * bool(arcs))
    ]
    return replace(scene, pockets=tuple(holes))


def fresh(kind: str) -> Iterator[Answered]:
    """Yield new scenes of a kind that no policy decides."""
    known, first = kind in FILES, 10_000 * seeds(1)[0]
    scenes = fresh_scenes(kind, first) if known else round_scenes(pockets=kind != "round")
    return (each for each in scenes if not exact(each[0]).policies)


@pytest.mark.seeded
@pytest.mark.parametrize(("kind", "count"), [("round", 8), ("pockets on arcs", 5)])
def test_a_few_round_scenes(kind: str, count: int) -> None:
    scenes = [*islice(fresh(kind), count)]
    assert kind == "round" or any(exact(scene).pocketed for scene, _ in scenes)
    for scene, answer in scenes:
        agrees(scene, answer)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count"), [("pocket", 200), ("rolling", 200), ("round", 150), ("pockets on arcs", 60)]
)
def test_many_fresh_scenes(kind: str, count: int) -> None:
    for scene, answer in islice(fresh(kind), share_of(count, least=6)):
        agrees(scene, answer)
