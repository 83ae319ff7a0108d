"""A planner that learns to make caroms
====================================

This plays ``pool_pymunk/Carom-v0`` on 256 tables at once, and plans each shot by trying others.

The planner looks for a shot in which the cue ball meets two others, by the cross-entropy method: it
tries shots at random and takes one that scores. In each later round it tries shots ever closer
around that one, and moves to the mean of those that score. Its tries are rehearsals, without the
player's errors. What is played then errs by a degree and 0.05 m/s, so the planner has to find shots
that forgive errors. The picture shows how often shots score after each number of rounds; after
none, play is random.

Run it with ``python examples/learn_caroms.py --out FOLDER``; it needs Gymnasium.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from matplotlib.figure import Figure

import pool_pymunk.env  # noqa: F401 - this registers the environments

TABLES, TRIES, SHOTS = 256, 64, 4
ROUNDS = (0, 1, 2, 4, 8)
WIDTH, NARROWER = np.array([0.03, 0.1]), 0.7  # deviation of tries, and its factor a round


def plan(envs: Any, rounds: int, rng: np.random.Generator) -> Any:
    """Return a shot for each table (S, 2), found in a number of rounds of tries."""
    if rounds == 0:
        return rng.uniform(-1.0, 1.0, (TABLES, 2))
    tries = rng.uniform(-1.0, 1.0, (TRIES, TABLES, 2))
    shots = tries[envs.unwrapped.rehearse(tries).reward.argmax(axis=0), np.arange(TABLES)]
    for k in range(rounds - 1):
        away = WIDTH * NARROWER**k * rng.standard_normal(tries.shape)
        scores = envs.unwrapped.rehearse(shots + away).reward[..., np.newaxis]
        shots = shots + (scores * away).sum(axis=0) / np.maximum(scores.sum(axis=0), 1.0)
    return shots


def share_of_points(rounds: int) -> float:
    """Play some shots on every table, and return how many of them score."""
    errors = {"angle_error": 1.0, "speed_error": 0.05}  # degrees and m/s
    envs = gym.make_vec("pool_pymunk/Carom-v0", TABLES, autoreset_mode="SameStep", **errors)
    envs.reset(seed=0)
    rng = np.random.default_rng(0)
    return float(np.mean([envs.step(plan(envs, rounds, rng))[1] for _ in range(SHOTS)]))


def main(argv: Sequence[str] | None = None) -> dict[int, float]:
    """Draw how often shots score after each number of rounds, and return it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    options = parser.parse_args(argv)
    shares = {rounds: share_of_points(rounds) for rounds in ROUNDS}
    for rounds, share in shares.items():
        print(f"{rounds} rounds: {100.0 * share:.0f} % of the shots score")
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot(xlabel="rounds of tries", ylabel="share of shots that score")
    axes.plot(list(shares), list(shares.values()), "o-")
    axes.set(ylim=(0.0, 1.0), xticks=ROUNDS)
    figure.savefig(options.out / "learn_caroms.png", dpi=120)
    return shares


if __name__ == "__main__":
    main()
