"""Batches beside the last version whose shots numba compiled (7e514f1), in turns on one core.

``python tests/benchmarks/beside_numba.py PYTHON`` prints how many shots a second both play, by the
fastest round of each. ``PYTHON`` is that of an environment of the other version:

    git worktree add ../with-numba 7e514f1
    python -m venv ../with-numba/.venv
    ../with-numba/.venv/bin/pip install "../with-numba[fast]"
"""

from __future__ import annotations

import inspect
import math
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from pool_pymunk import Scene, load, simulate_many
from pool_pymunk import compile as compile_shots

ROUNDS = 9
Play = Callable[[], Any]
IS_OLD = "workers" not in inspect.signature(simulate_many).parameters
ALONE: dict[str, Any] = {"threads": 1} if IS_OLD else {}


def turned(scene: Scene, count: int, low: float, high: float, turn: float) -> Play:
    """Return what plays so many shots of the cue ball: at some speeds (m/s), and turned (rad)."""
    rng, shot = np.random.default_rng(3), scene.shots[0]
    start, ball = scene.start(shot), scene.index[shot.ball]
    vx, vy = start.velocity[ball]
    angle = math.atan2(vy, vx) + rng.uniform(-turn, turn, count)
    speed, velocity = rng.uniform(low, high, count), np.zeros((count, len(scene.balls), 2))
    velocity[:, ball] = np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=-1)
    places = np.broadcast_to(np.array(start.position), velocity.shape)
    roll = np.zeros_like(velocity) if scene.surface.rolls else None
    return lambda: simulate_many(scene, places, velocity, roll=roll, law="coulomb", **ALONE)


def derived(count: int) -> Play:
    """Return what derives so many shots of the report by two inputs."""
    scene, rng = load("report"), np.random.default_rng(0)
    vx, vy = scene.start(scene.shots[0]).velocity[scene.index[scene.shots[0].ball]]
    vary = {
        "angle": math.degrees(math.atan2(vy, vx)) + rng.normal(0.0, 0.2, count),
        "speed": math.hypot(vx, vy) * (1.0 + rng.normal(0.0, 0.01, count)),
    }
    return lambda: simulate_many(scene, vary=vary, derivatives=("angle", "speed"), **ALONE)


def that_slides(scene: Scene) -> Scene:
    """Return a scene whose balls slide, and do not roll."""
    return replace(
        scene,
        friction=replace(scene.friction, rolling=None),
        shots=tuple(replace(shot, roll=0.0) for shot in scene.shots),
        balls=tuple(replace(ball, roll=0.0) for ball in scene.balls),
    )


# their number, and what plays so many
KINDS: dict[str, tuple[int, Callable[[int], Play]]] = {
    "report, any direction": (100_000, lambda n: turned(load("report"), n, 0.5, 2.0, math.pi)),
    "the same, in calls of 2,000": (2_000, lambda n: turned(load("report"), n, 0.5, 2.0, math.pi)),
    "report, shot 1 turned": (4_000, lambda n: turned(load("report"), n, 3.0, 4.6, 0.05)),
    "break that slides": (1_500, lambda n: turned(that_slides(load("eight-ball")), n, 5, 8, 0.02)),
    "break that rolls": (60, lambda n: turned(load("eight-ball"), n, 5.0, 8.0, 0.02)),
    "report, derived by two inputs": (4_000, derived),
}


def serve() -> None:
    """Play a kind of shots for each line, and print the time (s) and the number of events."""
    warnings.simplefilter("ignore")
    for name in ("report", "eight-ball") if IS_OLD else ():
        compile_shots(load(name))  # It would play few shots in Python.
    made: dict[str, Play] = {}
    for line in sys.stdin:
        name = line.strip()
        if name not in made:
            count, make = KINDS[name]
            made[name] = make(count)
            made[name]()
        began = time.process_time()
        batch = made[name]()
        print(time.process_time() - began, batch.events.mean(), flush=True)


class Version:
    """A version plays in a process of its own."""

    def __init__(self, python: str, **environment: str) -> None:
        self.process = subprocess.Popen(
            [python, __file__, "--serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, **environment},
        )  # fmt: skip

    def play(self, name: str) -> tuple[float, float]:
        """Return how long (s) a kind of shots takes, and their mean number of events."""
        assert self.process.stdin and self.process.stdout
        print(name, file=self.process.stdin, flush=True)
        taken, events = map(float, self.process.stdout.readline().split())
        return taken, events


def compare(python: str) -> None:
    """Print the table."""
    new, old = Version(sys.executable), Version(python, PYTHONPATH="")
    print("| shots | events | a second | with numba | share |")
    print("|---|---:|---:|---:|---:|")
    for name, (count, _) in KINDS.items():
        rounds = [(new.play(name), old.play(name)) for _ in range(ROUNDS)]
        ours, theirs = (count / min(each[k][0] for each in rounds) for k in (0, 1))
        events = rounds[0][0][1]
        print(f"| {name} | {events:.1f} | {ours:,.0f} | {theirs:,.0f} | {ours / theirs:.2f} |")


if __name__ == "__main__":
    serve() if "--serve" in sys.argv else compare(sys.argv[1])
