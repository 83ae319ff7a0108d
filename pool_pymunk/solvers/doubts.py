"""This module finds out what a run must say of itself: gained energy, and ends in doubt."""

from __future__ import annotations

import math
from itertools import groupby, pairwise
from operator import itemgetter

from pool_pymunk.model import Scene
from pool_pymunk.physics.motion import kinetic_energy
from pool_pymunk.physics.path import from_breakpoint, motion_at
from pool_pymunk.results.trace import Knot, Trace
from pool_pymunk.results.words import counted

GAINED = 1e-9  # A contact that gains a smaller share of the kinetic energy gained none.


def farthest(one: Trace, other: Trace) -> float:
    """Return how far (m) the balls of two traces lie apart at most when both have ended.

    Where one of them is cut off, they are looked at before.
    """
    is_cut = "max_events" in (one.status, other.status)
    at = (min if is_cut else max)(one.duration, other.duration)
    return max(
        math.dist(_motion(a, at)[:2], _motion(b, at)[:2])
        for a, b in zip(one.knots, other.knots, strict=True)
    )


def warn_of_gained_energy(trace: Trace, scene: Scene) -> None:
    """Warn if contacts gained kinetic energy: how much, how often, and which was the first."""
    masses, knots = [ball.mass for ball in scene.balls], trace.knots
    initial = sum(kinetic_energy(m, *k[0][3:5]) for m, k in zip(masses, knots, strict=True))
    steps = sorted((new[0], i, old, new) for i, k in enumerate(knots) for old, new in pairwise(k))
    gained = 0.0
    first: tuple[float, list[int]] | None = None
    times = 0
    for t, changes in groupby(steps, key=itemgetter(0)):
        before = after = 0.0
        balls = []
        for _, i, (t0, _, _, vx, vy, ax, ay, *_), new in changes:
            time, mass = t - t0, masses[i]
            vx, vy, wx, wy = vx + time * ax, vy + time * ay, new[3], new[4]
            before += 0.5 * mass * (vx * vx + vy * vy)
            after += 0.5 * mass * (wx * wx + wy * wy)
            balls.append(i)
        if after - before > GAINED * initial:
            gained, times, first = gained + after - before, times + 1, first or (t, balls)
    if first is None:
        return
    t, balls = first
    ids = ", ".join(scene.balls[i].id for i in balls)
    trace.warn(
        f"{counted(times, 'contact')} gained energy, as the law may: in all {gained / initial:.3g} "
        f"times the kinetic energy of the start; the first is that of {ids}",
        t,
    )


def _motion(knots: list[Knot], t: float) -> tuple[float, float, float, float]:
    """Return where a ball is at ``t`` (s), and its velocity, from its breakpoints."""
    knot = next(knot for knot in reversed(knots) if knot[0] <= t)
    return motion_at(from_breakpoint(*knot[:7]), t)
