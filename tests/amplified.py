"""How much farther ends move than starts."""

from __future__ import annotations

import math
import random
from dataclasses import replace

from hard_scenes import exact

from pool_pymunk import Run, Scene

NUDGE = 1e-10  # m; it is small beside all else, and large beside rounding


def amplification(scene: Scene, run: Run) -> float:
    """Return how much farther ends move than starts, from one nudge of every start."""
    rnd = random.Random(0)

    def nudge(x: float) -> float:
        return x + NUDGE * rnd.choice((-1, 1))

    balls = tuple(
        replace(b, position=(nudge(b.position[0]), nudge(b.position[1]))) for b in scene.balls
    )
    nudged = exact(replace(scene, balls=balls))
    return max(1.0, max(math.dist(nudged.final[i], run.final[i]) for i in run.final) / NUDGE)
