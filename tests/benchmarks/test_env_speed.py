"""The environments are measured beside their shots alone: ``make bench``.

``python tests/benchmarks/test_env_speed.py`` prints the table of docs/environments.md: steps a
second of 4,096 tables and of one, and the share of a step's time that ``simulate_many`` has.
``--check`` fails if Carom is slower than it shall be.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import pytest

TABLES, STEPS = 4_096, 60  # The fastest step counts.
IDS = ("pool_pymunk/Carom-v0", "pool_pymunk/Pot-v0", "pool_pymunk/Carrom-v0")
LEAST, SHARE = 20_000.0, 0.5  # steps a second, and the share of shots in a step's time


class Speed(NamedTuple):
    """A speed is in steps a second, of many tables and of one."""

    many: float
    share: float  # of the time of steps in which simulate_many plays their shots
    one: float
    scored: float  # the share of the shots of random play that score


class Watch:
    """A watch adds up the time (s) that calls of a function take."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.spent = function, 0.0

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        began = time.perf_counter()
        found = self.function(*args, **kwargs)
        self.spent += time.perf_counter() - began
        return found


def vector_env(id_: str) -> Any:
    """Return many tables, laid out, and played once."""
    gym = pytest.importorskip("gymnasium")
    pytest.importorskip("pool_pymunk.env")
    envs = gym.make_vec(id_, TABLES, autoreset_mode="SameStep").unwrapped
    envs.reset(seed=0)
    envs.step(np.zeros(envs.action_space.shape))
    return envs


def measure(id_: str) -> Speed:
    """Measure an environment with random play."""
    envs, rng = vector_env(id_), np.random.default_rng(0)
    home: Any = import_module("pool_pymunk.env.game")
    play = home.simulate_many
    home.simulate_many = watch = Watch(play)
    steps, scored = [], []
    for actions in rng.uniform(-1.0, 1.0, (STEPS, *envs.action_space.shape)):
        began = time.perf_counter()
        scored.append((envs.step(actions)[1] > 0.0).mean())
        steps.append(time.perf_counter() - began)
    home.simulate_many = play
    share, score = watch.spent / sum(steps), float(np.mean(scored))
    return Speed(TABLES / min(steps), share, measure_one(id_), score)


def measure_one(id_: str, steps: int = 1_000) -> float:
    """Return the steps a second of one table."""
    gym = pytest.importorskip("gymnasium")
    env = gym.make(id_)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(steps)]
    began = time.perf_counter()
    for action in actions:
        if any(env.step(action)[2:4]):
            env.reset()
    return steps / (time.perf_counter() - began)


@pytest.mark.parametrize("id_", IDS)
def test_many_tables(benchmark: Any, id_: str) -> None:
    """The time is that of a step of 4,096 tables."""
    envs, rng = vector_env(id_), np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, envs.action_space.shape)
    benchmark.pedantic(lambda: envs.step(actions), rounds=20, warmup_rounds=2)


def print_table() -> list[Speed]:
    """Print the table of the documentation, and return its rows."""
    print("| | steps a second, 4,096 tables | share of shots | one table | scored |")
    print("|---|---:|---:|---:|---:|")
    rows = []
    for id_ in IDS:
        found = measure(id_)
        rows.append(found)
        print(
            f"| `{id_}` | {found.many:,.0f} | {100 * found.share:.0f} % | {found.one:,.0f} | "
            f"{100 * found.scored:.2g} % |",
            flush=True,
        )
    return rows


if __name__ == "__main__":
    first = print_table()[0]
    if "--check" in sys.argv:
        assert first.many > LEAST, "Carom has become slow"
        assert first.share > SHARE, "Carom has become slow beside its shots"
