"""Half and twice a number of the engine: how many ends move, and how far.

``POOL_PYMUNK_PURE=1 python -m tests.large.halved core.variant.CONVERGED`` plays 54 runs as plain
Python with half and with twice each number that is named, in all modules that have it. Some of the
runs have persistent contacts, an inelastic collapse or frozen balls.
"""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module
from typing import Any

from pool_pymunk import Friction, Restitution, Run, Scene, load, simulate
from tests.shared.frozen import FORMS, random_frozen_scene
from tests.shared.scenes import TABLES, frozen_rack, random_scene

MOST = 2_000  # events a run
MOVED = 1e-9  # m; an end that moves by less than this counts as the same


def runs() -> Iterator[Run]:
    """Play the runs with the numbers that the engine has now."""
    scenes: list[tuple[Scene, Any]] = []
    for name in ("report", "nine-ball", "follow-and-draw", "stadium"):
        scene = load(name)
        scenes += [(scene, shot) for shot in scene.shots if not shot.from_previous]
    scenes += [(random_scene(seed, list(TABLES)[seed % 4]), None) for seed in range(16)]
    dull, rough = Restitution(0.05, None, 0.05), Friction(0.3, 0.2, 0.3)
    soft, rolls = Restitution(0.2, None, 0.2), Friction(0.2, 0.2, 0.1, rolling=0.01)
    for k in range(10):
        one, other = random_scene(1000 + k), random_scene(2000 + k)
        scenes.append((replace(one, restitution=dull, friction=rough), None))
        scenes.append((replace(other, restitution=soft, friction=rolls), None))
    for form in FORMS:
        for at_cushion in (True, False):
            rnd = random.Random(f"{form} {at_cushion} 0")
            scenes.append((random_frozen_scene(form, at_cushion, rnd), None))
    scenes += [(frozen_rack(0.0, 0.2), None), (frozen_rack(1e-4, 0.9), None)]
    for scene, shot in scenes:
        yield simulate(scene, shot, solver="event-driven", max_events=MOST)


def core_modules() -> list[Any]:
    """Return the modules of the core."""
    return [module for name, module in sys.modules.items() if name.startswith("pool_pymunk.core")]


def main() -> None:
    """Print what half and twice of each number that is named move."""
    base = list(runs())
    for name in sys.argv[1:]:
        place, _, number = name.rpartition(".")
        value = getattr(import_module(f"pool_pymunk.{place}"), number)
        homes = [home for home in core_modules() if vars(home).get(number) == value]
        for factor in (0.5, 2.0):
            for home in homes:
                setattr(home, number, type(value)(factor * value))
            ends = [(a.end.position, b.end.position) for a, b in zip(base, runs(), strict=True)]
            moved = [max(map(math.dist, one, other)) for one, other in ends]
            count = sum(far > MOVED for far in moved)
            print(f"{name} x {factor:g}: {count} of {len(moved)} ends, by up to {max(moved):.2g} m")
        for home in homes:
            setattr(home, number, value)


if __name__ == "__main__":
    main()
