"""Batches beside single runs: shots of random scenes of every kind must have the same bits.

``python -m tests.large.batches 2000`` plays this many scenes, three shots each, and prints what
differs; ``python -m tests.large.batches 2000 2`` shares all but the first shots out to two workers.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from pool_pymunk import Run, SceneError
from pool_pymunk.many import play, workers
from pool_pymunk.many.batch import CANNOT_START, STATUSES
from pool_pymunk.many.play import Results, play_all
from pool_pymunk.many.source import NOTHING, Source
from pool_pymunk.many.workers import Workers
from pool_pymunk.results.variants import AS_IT_IS
from pool_pymunk.solvers import reference_solver
from pool_pymunk.solvers.request import Request
from tests.shared.core_scenes import BUNDLED, MOST, Case, bundled_shot, case_of, names


def shots_of(case: Case) -> Source:
    """Return the start of a case, another one of the same scene, and the first once more."""
    scene, start = case.scene, case.start
    settings = case.settings._replace(
        variant=AS_IT_IS, max_events=max(MOST, case.settings.max_events)
    )
    place, velocity = np.array(start.position), np.array(start.velocity)
    place[[scene.index[id_] for id_ in start.off]] = math.nan
    roll = None if start.roll is None else np.array(start.roll)
    return Source(
        scene, Request(scene, reference_solver(), {}, settings), np.stack([place] * 3),
        np.stack([velocity, -0.7 * velocity[:, ::-1], velocity]), {},
        None if roll is None else np.stack([roll, -0.7 * roll, roll]),
    )  # fmt: skip


def result_of(source: Source, run: Run) -> dict[str, Any]:
    """Return what a batch tells of a run."""
    scene, watched = source.scene, source.watched
    number, kinds = scene.index, [event.kind for event in run.events]
    hits = [{number[id_] for id_ in e.balls} for e in run.events if e.kind == "ball-ball"]
    met = [(balls - {watched}).pop() for balls in hits if watched in balls]
    holes = [hole.id for hole in scene.pockets]
    return {
        "final": run.end.position, "duration": run.duration, "events": len(kinds),
        "hits": len(hits), "cushions": kinds.count("ball-cushion"),
        "first_hit": met[0] if met else NOTHING,
        "pocketed": [
            holes.index(run.pocketed[id_]) if id_ in run.pocketed else NOTHING for id_ in number
        ],
        "met": [i in met for i in range(len(number))],
        "status": STATUSES.index(run.status),
    }  # fmt: skip


def differences(source: Source, found: Results) -> Iterator[str]:
    """Say where shots differ from single runs of them."""
    for k in range(len(found.status)):
        try:
            run = source.run(k, measures_policies=False)
        except SceneError:
            if found.status[k] != CANNOT_START:
                yield f"{k}: cannot start, but has status {found.status[k]}"
            continue
        wanted = result_of(source, run)
        wanted["final"] = np.where(np.isnan(source.position[k]), np.nan, wanted["final"])
        if run.status == "max_events":  # A run leaves out what its last instant had more.
            wanted = {key: wanted[key] for key in ("final", "duration", "events", "status")}
        for key, value in wanted.items():
            own = getattr(found, key)[k]
            if not np.array_equal(own, value, equal_nan=key == "final"):
                yield f"{k}: {key} {own} instead of {value}"
                break


def wrong(case: Case, several: Workers | None = None) -> list[str]:
    """Return what is wrong with a case, whose later shots are played by several workers."""
    source = shots_of(case)
    try:
        found = play_all(source, lambda _: None, several)
    except Exception as error:
        try:
            for k in range(3):
                source.run(k, measures_policies=False)
        except type(error):
            return []
        return [f"{case.name}: {type(error).__name__}: {error}"]
    return [f"{case.name}: {said}" for said in differences(source, found)]


def main(count: int, processes: int = 1) -> None:
    """Print what differs in so many cases."""
    if processes > 1:
        play.FEWEST, workers.START, workers.SEND = 1, 0.0, 0.0  # Any shot is worth a process.
    cases = [*(bundled_shot(name, seed) for name in BUNDLED for seed in range(count // 40))]
    with Workers(processes) as several:
        for case in (*cases, *map(case_of, islice(names(), count))):
            for said in wrong(case, several):
                print(said[:300], flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
