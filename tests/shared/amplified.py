"""How much farther ends move than starts."""

from __future__ import annotations

import random
from dataclasses import replace

from pool_pymunk import Run, Scene, SceneError
from tests.shared.hard_scenes import exact
from tests.shared.scenes import largest_distance

NUDGE = 1e-10  # m; it is small beside all else, and large beside rounding


def amplification(scene: Scene, run: Run, nudges: int = 1) -> tuple[float, float]:
    """Return how much ends (m/m) and events (s/m) move when all starts are nudged."""
    rnd = random.Random(0)
    ends, times = 1.0, 1.0
    for _ in range(nudges):
        balls = []
        for ball in scene.balls:
            x, y = (value + NUDGE * rnd.choice((-1, 1)) for value in ball.position)
            balls.append(replace(ball, position=(x, y)))
        try:
            nudged = exact(replace(scene, balls=tuple(balls)))
        except SceneError:  # The balls overlap.
            continue
        ends = max(ends, largest_distance(nudged, run) / NUDGE)
        later = (abs(a.t - b.t) for a, b in zip(nudged.events, run.events, strict=False))
        times = max(times, max(later, default=0.0) / NUDGE)
    return ends, times
