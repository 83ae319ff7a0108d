"""The environments are measured beside ``simulate_many`` alone: ``make bench``.

``python tests/benchmarks/test_env_speed.py`` prints the table of docs/environments.md: steps a
second of one table and of 4,096, and what ``simulate_many`` alone makes of the same shots.
``--check`` fails if Carom is slower than it shall be.
"""

from __future__ import annotations

import sys
import time
from typing import Any, NamedTuple

import numpy as np
import pytest

from pool_pymunk import simulate_many

TABLES, STEPS = 4_096, 60  # The fastest step counts.
IDS = ("pool_pymunk/Carom-v0", "pool_pymunk/Pot-v0")
LEAST, SHARE = 20_000.0, 0.5  # steps a second, and in those of simulate_many alone


class Speed(NamedTuple):
    """A speed is in steps a second: of many tables, of their shots alone, and of one table."""

    many: float
    shots: float
    one: float
    scored: float  # the share of the shots of random play that score

    @property
    def share(self) -> float:
        """How fast many tables are, in what their shots alone make."""
        return self.many / self.shots


def vector_env(id_: str) -> Any:
    """Return many tables, laid out, and played once."""
    gym = pytest.importorskip("gymnasium")
    pytest.importorskip("pool_pymunk.env")
    envs = gym.make_vec(id_, TABLES, autoreset_mode="SameStep").unwrapped
    envs.reset(seed=0)
    envs.step(np.zeros((TABLES, 2)))
    return envs


def measure(id_: str) -> Speed:
    """Measure an environment with random play, then play its shots again, alone."""
    envs, rng = vector_env(id_), np.random.default_rng(0)
    many, alone, scored, sources = [], [], [], []
    for actions in rng.uniform(-1.0, 1.0, (STEPS, TABLES, 2)):
        began = time.perf_counter()
        scored.append(envs.step(actions)[1].mean())
        many.append(time.perf_counter() - began)
        sources.append(envs._batch.source)
    for shots in sources:
        began = time.perf_counter()
        simulate_many(envs.scene, shots.position, shots.velocity)
        alone.append(time.perf_counter() - began)
    score = float(np.mean(scored))
    return Speed(TABLES / min(many), TABLES / min(alone), measure_one(id_), score)


def measure_one(id_: str, steps: int = 1_000) -> float:
    """Return the steps a second of one table."""
    gym = pytest.importorskip("gymnasium")
    env = gym.make(id_)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(steps)]
    began = time.perf_counter()
    for action in actions:
        if env.step(action)[2]:
            env.reset()
    return steps / (time.perf_counter() - began)


@pytest.mark.parametrize("id_", IDS)
def test_many_tables(benchmark: Any, id_: str) -> None:
    """The time is that of a step of 4,096 tables."""
    pytest.importorskip("numba")
    envs, rng = vector_env(id_), np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (TABLES, 2))
    benchmark.pedantic(lambda: envs.step(actions), rounds=20, warmup_rounds=2)


def print_table() -> list[Speed]:
    """Print the table of the documentation, and return its rows."""
    print("| | steps a second, 4,096 tables | their shots alone | share | one table | scored |")
    print("|---|---:|---:|---:|---:|---:|")
    rows = []
    for id_ in IDS:
        found = measure(id_)
        rows.append(found)
        print(
            f"| `{id_}` | {found.many:,.0f} | {found.shots:,.0f} | {100 * found.share:.0f} % | "
            f"{found.one:,.0f} | {100 * found.scored:.2g} % |",
            flush=True,
        )
    return rows


if __name__ == "__main__":
    first = print_table()[0]
    if "--check" in sys.argv:
        assert first.many > LEAST, "Carom has become slow"
        assert first.share > SHARE, "Carom has become slow beside its shots"
