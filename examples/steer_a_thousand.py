"""A thousand shots that learn where to go
=======================================

A thousand shots of the report's table start anywhere, and each learns by gradient descent to leave
the cue ball at one place.

:func:`pool_pymunk.simulate_many` plays them all at once, and says how their ends depend on angle
and speed. Each shot takes a step downhill, and a shorter one if this led uphill (Levenberg and
Marquardt). Then all shots are played again. The picture shows the first and the last ends.

Run it with ``python examples/steer_a_thousand.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.progress import track

from pool_pymunk import Scene, load, simulate_many

TARGET = (1.6, 0.35)  # m; the cue ball shall end here
NEAR = 0.01  # m; a shot that leaves the ball this near has done it
SLOWEST, FASTEST = 0.5, 6.0  # m/s
STEADY = 1e-3  # of the largest derivative; it keeps steps short where the ball hardly moves

Floats = NDArray[np.float64]


class Learned(NamedTuple):
    """These shots (S, 2) have angles (degrees) and speeds (m/s), and miss by ``off`` (S,), in m.

    The cue ball ended at ``first`` (S, 2) with the first shots, and at ``last`` with these (m).
    """

    shots: Floats
    off: Floats
    first: Floats
    last: Floats


def ends_of(scene: Scene, shots: Floats) -> tuple[Floats, Floats]:
    """Return where the cue ball ends (S, 2), and its derivatives (S, 2, 2) by angle and speed."""
    vary = {"angle": shots[:, 0], "speed": shots[:, 1]}
    batch = simulate_many(scene, vary=vary, derivatives=["angle", "speed"])
    assert batch.derivatives is not None
    cue = scene.index["C"]
    return batch.final[:, cue], np.nan_to_num(batch.derivatives[:, cue])


def steps_of(slopes: Floats, miss: Floats, damping: Floats) -> Floats:
    """Return the damped steps (S, 2) of the shots whose ends ``miss`` (S, 2) the target (m)."""
    turned = np.swapaxes(slopes, 1, 2)
    square = turned @ slopes
    size = np.trace(square, axis1=1, axis2=2) + 1e-12
    held = (damping + STEADY) * size
    step = np.linalg.solve(square + held[:, None, None] * np.eye(2), turned @ miss[..., None])
    return np.asarray(step[..., 0])


def learn(scene: Scene, count: int, rounds: int, seed: int = 1) -> Learned:
    """Let shots from random starts go downhill, all at once."""
    rng = np.random.default_rng(seed)
    shots = np.stack([rng.uniform(0, 360, count), rng.uniform(1, 5, count)], axis=1)
    ends, slopes = ends_of(scene, shots)
    first, damping = ends, np.ones(count)
    for _ in track(range(rounds), description="Playing", transient=True):
        tried = shots + steps_of(slopes, TARGET - ends, damping)
        tried[:, 1] = np.clip(tried[:, 1], SLOWEST, FASTEST)
        new, new_slopes = ends_of(scene, tried)
        nearer = np.hypot(*(new - TARGET).T) < np.hypot(*(ends - TARGET).T)
        damping = np.where(nearer, damping / 3.0, damping * 4.0)
        shots, ends = (np.where(nearer[:, None], a, b) for a, b in ((tried, shots), (new, ends)))
        slopes = np.where(nearer[:, None, None], new_slopes, slopes)
    return Learned(shots, np.hypot(*(ends - TARGET).T), first, ends)


def picture(scene: Scene, found: Learned) -> Figure:
    """Return a picture of the first ends and the last ones."""
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.add_subplot(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    assert scene.table is not None
    axes.fill(*np.array(scene.table.outline).T, color="#2f6f4f", zorder=0)
    axes.plot(*found.first.T, ".", color="white", markersize=3, alpha=0.5, label="at first")
    axes.plot(*found.last.T, ".", color="#ffb000", markersize=4, label="at last")
    axes.plot(*TARGET, "x", color="black", markersize=10, label="target")
    axes.legend(loc="upper left")
    return figure


def main(argv: Sequence[str] | None = None) -> Learned:
    """Let a thousand shots learn, print how many got there and the best one, and draw them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--shots", type=int, default=1_000)
    parser.add_argument("--rounds", type=int, default=60)
    options = parser.parse_args(argv)
    scene = load("report")
    found = learn(scene, options.shots, options.rounds)
    best = int(found.off.argmin())
    angle, speed = found.shots[best]
    print(f"{(found.off < NEAR).sum()} of {options.shots} shots leave the cue ball within 1 cm")
    print(f"the best: {angle % 360:.4f} degrees, {speed:.4f} m/s, {found.off[best]:.2g} m off")
    picture(scene, found).savefig(options.out / "steer_a_thousand.png", dpi=120)
    return found


if __name__ == "__main__":
    main()
