"""Many shots are measured beside single runs: ``make bench``.

``python tests/benchmarks/test_many_speed.py`` prints the table of docs/many-shots.md: shots a
second and core of batches, and of runs. ``--check`` fails if they are slower than they shall be,
beside runs and in a stadium, whose contacts ``--arcs`` measures alone. ``--workers`` prints what
two processes gain on long batches; it needs two idle cores.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from pool_pymunk import (
    Ball,
    Friction,
    Restitution,
    Scene,
    Shot,
    Table,
    load,
    rack,
    simulate_many,
)

REPEATS = 3
SLOW = 300  # This many shots are played as runs.
TIMES = 12.0  # at least so much faster, on shot 1 of the report
# A contact in a stadium costs at most this many times one in a rectangle; 1.3 was found. At lower e
# some balls slide along an arc for seconds, in pieces.
ARCS = {0.95: 1.45}  # by the restitution of cushions
FROZEN = 8_000  # at least this many frozen racks a second and core


class Kind(NamedTuple):
    """A kind of shots has a scene, and positions and velocities of any number of them."""

    scene: Scene
    draw: Callable[[int], tuple[Any, Any]]


def breaks(scene: Scene, low: float, high: float, turn: float) -> Kind:
    """Return shots of the cue ball at other speeds (m/s), and turned by up to ``turn`` (rad)."""
    cue = scene.index[scene.cue.id if scene.cue else scene.balls[0].id]
    vx, vy = scene.start(scene.shots[0]).velocity[cue]

    def draw(count: int) -> tuple[Any, Any]:
        rng = np.random.default_rng(2)
        angle = np.arctan2(vy, vx) + rng.uniform(-turn, turn, count)
        speed = rng.uniform(low, high, count)
        velocity = np.zeros((count, len(scene.balls), 2))
        velocity[:, cue] = np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=-1)
        return np.array([ball.position for ball in scene.balls]), velocity

    return Kind(scene, draw)


def shot_1() -> Kind:
    """Return shot 1 of the report with its starts varied by half of their last digit."""
    scene = load("report")
    start = scene.start(scene.shots[0])

    def draw(count: int) -> tuple[Any, Any]:
        moves = np.random.default_rng(1).uniform(-1.27e-4, 1.27e-4, (count, 11, 2))
        return np.array(start.position) + moves, np.array(start.velocity)

    return Kind(scene, draw)


def rack_of_fifteen(gap: float) -> Kind:
    """Return a triangle of fifteen balls on an open plane, and a ball that breaks it."""
    balls = rack((0.3, 0.0), radius=0.0286, mass=0.17, rows=5, gap=gap)
    cue = Ball("cue", (-0.5, 0.0), 0.0286, 0.17, cue=True)
    scene = Scene((cue, *balls), None, Restitution(0.95), Friction(0.1, 0.0, 0.05))
    scene = replace(scene, shots=(Shot("break", "cue", velocity=(5.0, 0.0)),))
    return breaks(scene, 2.0, 8.0, 0.03)


def that_rolls(kind: Kind, rolling: float | None = 0.01) -> Kind:
    """Return the shots on a cloth on which balls slide, and roll where ``rolling`` is given."""
    friction = replace(kind.scene.friction, surface=0.2, rolling=rolling)
    return kind._replace(scene=replace(kind.scene, friction=friction))


KINDS: dict[str, Callable[[], Kind]] = {
    "shot 1 of the report, starts varied": shot_1,
    "random breaks on the report's table": lambda: breaks(load("report"), 1.0, 6.0, np.pi),
    "rack of fifteen, gaps of 0.1 mm": lambda: rack_of_fifteen(1e-4),
    "frozen rack of fifteen": lambda: rack_of_fifteen(0.0),
    "eight-ball breaks": lambda: breaks(load("eight-ball"), 4.0, 9.0, 0.02),
    "eight-ball breaks that roll": lambda: that_rolls(KINDS["eight-ball breaks"]()),
    "follow and draw": lambda: breaks(load("follow-and-draw"), 1.0, 3.0, 0.02),
}


class Speed(NamedTuple):
    """A speed is in shots a second and core: of a batch, and of runs."""

    batch: float
    runs: float


def measure(kind: Kind, seconds: float = 1.0) -> Speed:
    """Measure a kind of shots, for about so long each; other programs do not count."""
    position, velocity = kind.draw(200)
    simulate_many(kind.scene, position, velocity)
    began = time.perf_counter()
    simulate_many(kind.scene, position, velocity)
    count = int(max(2_000, 200 * seconds / (time.perf_counter() - began)))
    position, velocity = kind.draw(count)
    times = []
    for _ in range(REPEATS):
        began = time.process_time()
        batch = simulate_many(kind.scene, position, velocity)
        times.append(time.process_time() - began)
    began = time.process_time()
    for k in range(SLOW):
        batch.source.run(k, measures_policies=False)
    return Speed(count / min(times), SLOW / (time.process_time() - began))


@pytest.mark.parametrize("name", KINDS)
def test_many_shots(benchmark: Any, name: str) -> None:
    """The time is that of ten thousand shots in one process."""
    kind = KINDS[name]()
    position, velocity = kind.draw(10_000)
    benchmark.pedantic(
        lambda: simulate_many(kind.scene, position, velocity), rounds=3, warmup_rounds=1
    )
    found = measure(kind, seconds=0.3)
    benchmark.extra_info["shots_a_second"] = round(found.batch)
    benchmark.extra_info["times_a_run"] = round(found.batch / found.runs)


def two_gain(kind: Kind, count: int) -> float:
    """Return how many times as fast two processes play so many shots, by the clock."""
    shots = kind.draw(count)
    one, two = (
        min(simulate_many(kind.scene, *shots, workers=n).wall_time for _ in range(REPEATS))
        for n in (1, 2)
    )
    return float(one / two)


def events_cost(kind: Kind, count: int) -> tuple[float, float]:
    """Return what an event costs (s), in a batch and in runs."""
    simulate_many(kind.scene, *kind.draw(1))
    began = time.process_time()
    batch = simulate_many(kind.scene, *kind.draw(count))
    of_batch = (time.process_time() - began) / batch.events.sum()
    began = time.process_time()
    events = sum(len(batch.source.run(k, False).events) for k in range(SLOW))
    return of_batch, (time.process_time() - began) / events


@pytest.mark.parametrize("name", list(KINDS)[:5])
def test_an_event_of_balls_that_roll(benchmark: Any, name: str) -> None:
    """Its cost is measured beside that of an event of balls that slide on the same cloth."""
    kinds = [that_rolls(KINDS[name](), rolling) for rolling in (None, 0.01)]
    slides, rolls = benchmark.pedantic(lambda: [events_cost(kind, 2_000) for kind in kinds])
    benchmark.extra_info["in_a_batch"] = rolls[0] / slides[0]
    benchmark.extra_info["in_runs"] = rolls[1] / slides[1]


def in_a(table: Table, e: float = 0.8) -> Kind:
    """Return shots of the bundled stadium, in any direction, in a table of the same size."""
    scene = load("stadium")
    own = replace(scene.restitution, cushion=e)
    return breaks(replace(scene, table=table, restitution=own), 1.0, 4.0, np.pi)


def contacts_cost(kind: Kind, count: int = 20_000) -> float:
    """Return what a contact costs (s of processor time); contacts are the listed hits."""
    simulate_many(kind.scene, *kind.draw(1))
    times, shots = [], kind.draw(count)
    for _ in range(REPEATS):
        began = time.process_time()
        batch = simulate_many(kind.scene, *shots)
        times.append((time.process_time() - began) / (batch.hits.sum() + batch.cushions.sum()))
    return float(min(times))


def arcs_cost(e: float = 0.95) -> float:
    """Return how many times as much as in a rectangle a contact in a stadium costs."""
    tables = Table.rectangle(2.0, 1.0), Table.stadium(2.0, 1.0)
    one, other = (contacts_cost(in_a(table, e)) for table in tables)
    return other / one


def test_a_contact_in_a_stadium(benchmark: Any) -> None:
    """Its cost is measured beside that of a contact in a rectangle, with the same balls."""
    benchmark.extra_info["times_a_rectangle"] = benchmark.pedantic(arcs_cost)


def print_table() -> list[Speed]:
    """Print the table, and return its rows."""
    print("| shots | a batch, a second and core | runs | times |")
    print("|---|---:|---:|---:|")
    rows = []
    for name, make in KINDS.items():
        found = measure(make())
        rows.append(found)
        times = found.batch / found.runs
        print(f"| {name} | {found.batch:,.0f} | {found.runs:,.0f} | {times:.0f} |", flush=True)
    return rows


def main() -> None:
    """Print what is asked for."""
    if "--workers" in sys.argv:
        for name, count in (("random breaks on the report's table", 1_000_000),
                            ("shot 1 of the report, starts varied", 200_000)):  # fmt: skip
            print(f"{name}, {count:,}: {two_gain(KINDS[name](), count):.2f} times by two workers")
        return
    times = {e: arcs_cost(e) for e in ARCS}
    for e in ARCS:
        print(f"With e = {e}, a contact in a stadium costs {times[e]:.2f} times as much.")
    if "--arcs" in sys.argv:
        return
    first, *others = print_table()
    if "--check" in sys.argv:
        assert all(times[e] < ARCS[e] for e in ARCS), "arcs have become slow"
        assert first.batch > TIMES * first.runs, "batches have become slow"
        assert others[2].batch > FROZEN, "frozen racks have become slow"


if __name__ == "__main__":
    main()
