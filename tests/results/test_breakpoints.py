"""A run is its breakpoints: each says all about the motion up to the next one."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pool_pymunk import Ball, Friction, Restitution, Run, Scene, Table, load, simulate
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.model import State
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import SOLVERS

R = 0.03
L_SHAPE = Table(((0, 0), (2, 0), (2, 1), (1.2, 1), (1.2, 0.6), (0, 0.6)))


def scattered(seed: int, count: int = 7) -> Scene:
    """Return balls of several sizes at random places of an L-shaped table, all in motion."""
    rng = np.random.default_rng(seed)
    balls: list[Ball] = []
    while len(balls) < count:
        r, place = R * rng.uniform(0.6, 1.4), rng.uniform(0.05, [1.95, 0.55])
        if all(math.dist(place, b.position) > r + b.radius for b in balls):
            velocity = tuple(rng.normal(0.0, 1.0, 2).tolist())
            balls.append(Ball(str(len(balls)), tuple(place.tolist()), r, r, velocity=velocity))
    return Scene(
        balls=tuple(balls), table=L_SHAPE, restitution=Restitution(0.95, cushion=0.8),
        friction=Friction(surface=0.05, cushion=0.2, ball_ball=0.06),
    )  # fmt: skip


def dense(run: Run) -> np.ndarray:
    """Return many times: breakpoints, times just beside them, and a fine grid."""
    breaks = np.concatenate([breakpoints[:, 0] for breakpoints in run.knots])
    beside = [np.nextafter(breaks, -np.inf), np.nextafter(breaks, np.inf)]
    return np.unique(np.concatenate([breaks, *beside, np.linspace(0.0, run.duration, 2000)]))


@pytest.mark.parametrize("solver", SOLVERS)
def test_nothing_runs_backwards_and_all_comes_to_rest(solver: str) -> None:
    run = simulate(scattered(0, 3), solver=solver, dt=None if solver == "event-driven" else 1e-3)
    times = dense(run)
    position, velocity = run.at(times)
    assert np.isfinite(position).all()
    for i, breakpoints in enumerate(run.knots):
        assert breakpoints.shape[1] == 7
        assert not breakpoints[-1, 3:].any()
        assert (np.diff(breakpoints[:, 0]) >= 0.0).all()
        last = np.searchsorted(breakpoints[:, 0], times, side="right") - 1
        began = breakpoints[last, 3:5]
        along, speed = (velocity[:, i] * began).sum(axis=1), np.hypot(*began.T)
        assert (along >= -16.0 * EPSILON * speed * (speed + 0.5 * run.duration)).all()
        rests = breakpoints[~breakpoints[:, 3:5].any(axis=1)]
        assert not rests[:, 5:].any()


def test_balls_of_a_run_that_is_cut_off_at_rest_are_at_rest() -> None:
    scene = replace(scattered(1, 2), restitution=Restitution(0.0, cushion=0.0))
    whole = simulate(scene, solver="event-driven")
    for most in range(1, len(whole.events) + 1):
        run = simulate(scene, solver="event-driven", max_events=most)
        for id_, v in zip(run.final, run.end.velocity, strict=True):
            stops = [e.t for e in run.events if e.kind == "stop" and e.balls == (id_,)]
            assert not stops or stops[-1] < run.duration or v == (0.0, 0.0)


def test_breakpoints_that_know_no_acceleration_slide_to_rest() -> None:
    """As do those that solvers of one's own write."""
    scene = load("report")
    trace = Trace(State(((0.0, 0.0),), ((1.0, 0.0),)))
    trace.breakpoint(0, 0.5, (0.3, 0.0), (0.0, 0.2))
    trace.duration = 100.0
    trace.complete(scene.surface)
    a = scene.deceleration
    first, second, rest = trace.knots[0]
    assert first == (0.0, 0.0, 0.0, 1.0, 0.0, -a, 0.0)
    assert second == (0.5, 0.3, 0.0, 0.0, 0.2, 0.0, -a)
    assert rest[0] == pytest.approx(0.5 + 0.2 / a)
    assert rest[1:3] == pytest.approx((0.3, 0.02 / a))
    assert rest[3:] == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("solver", ["event-driven", "time-slice"])
def test_files_of_the_first_format_are_read(solver: str, tmp_path: Path) -> None:
    """Their breakpoints have five numbers."""
    options: dict[str, Any] = {"dt": 1e-3} if solver == "time-slice" else {}
    run = simulate(load("report"), 1, solver=solver, **options)
    new, old = tmp_path / "new.npz", tmp_path / "old.npz"
    run.save(new)
    assert Run.load(new) == run
    with np.load(new) as archive:
        about, counts = json.loads(str(archive["about"])), archive["counts"]
        breakpoints = archive["knots"][:, :5]
    assert about["format"] == "pool-pymunk run 2"
    about["format"] = "pool-pymunk run 1"
    np.savez_compressed(old, about=np.array(json.dumps(about)), knots=breakpoints, counts=counts)
    times = np.linspace(0.0, run.duration, 1000)
    for one, other in zip(run.at(times), Run.load(old).at(times), strict=True):
        assert one == pytest.approx(other, rel=0, abs=1e-12)
