"""This study estimates how long a run will take, from a short run with fewer and longer steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from pool_pymunk.model import Scene, Shot
from pool_pymunk.solvers import find_solver, simulate

TRIAL = 1 / 20  # of the steps are made for the estimate, which costs that share of the time,
MOST_STEPS, FEWEST_STEPS = 20_000, 1_000  # but never more nor fewer steps than these.


class Estimate(NamedTuple):
    """An estimate of one shot: how long the computer takes (s), the shot (s), and its steps.

    ``cost`` is zero for a shot with so few steps that no trial is worth its time.
    """

    cost: float
    duration: float
    steps: float


def estimate(
    scene: Scene, shots: Sequence[Shot | None], solver: str, dt: float | None, **options: Any
) -> list[Estimate]:
    """Estimate each shot; a solver without a step has no estimate.

    The arguments are those of :func:`~pool_pymunk.simulate`.

    >>> from pool_pymunk import load
    >>> scene = load("report")
    >>> [one] = estimate(scene, scene.shots[:1], "time-slice", 1e-9)
    >>> one.cost > 60.0, 1.4 < one.duration < 1.6, 1e9 < one.steps < 2e9
    (True, True, True)
    """
    step = dt or find_solver(solver).dt
    if step is None:
        return []
    return [_estimate(scene, shot, solver, step, options) for shot in shots]


def _estimate(
    scene: Scene, shot: Shot | None, solver: str, dt: float, options: dict[str, Any]
) -> Estimate:
    longest = longest_duration(scene, shot)
    steps = longest / dt
    if not FEWEST_STEPS / TRIAL <= steps < math.inf:
        return Estimate(0.0, longest, steps)
    coarse = longest / min(MOST_STEPS, TRIAL * steps)
    trial = simulate(scene, shot, solver=solver, dt=coarse, **options)
    times = coarse / dt  # so many times more steps does the run itself have
    return Estimate(trial.wall_time * times, trial.duration, trial.steps * times)


def longest_duration(scene: Scene, shot: Shot | None) -> float:
    """Return how long (s) the fastest ball would roll, or the time at which the shot is ended."""
    latest = scene.physics.max_time
    ends = [scene.surface.path(0.0, (0.0, 0.0), v).end for v in scene.start(shot).velocity]
    return min(max(ends), math.inf if latest is None else latest)
