"""A thousand balls on a plinko board
==================================

Balls fall through rows of pins (a Galton board, or plinko). On an ideal board each row sends a ball
to the left or to the right, whatever happened before, and so many bins have a binomial
distribution. On this one a ball comes to the next row with the motion that the last one left it.

The board is a scene with a tilt: its balls fall on parabolas. They begin within some millimetres of
each other, and the pins do the rest, because every hit makes small differences larger.
:func:`pool_pymunk.simulate_many` plays them all.

Run it with ``python examples/plinko.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pool_pymunk import Ball, Friction, Physics, Post, Restitution, Scene, Table, simulate_many

ROWS = 10
APART, PIN, BALL = 0.05, 0.003, 0.014  # m: from pin to pin, and two radii
LOW = APART * math.sqrt(3.0) / 2.0  # m, from row to row
FLOOR = -(ROWS + 1) * LOW  # m; the highest pin is at (0, 0)
WIDE = (ROWS / 2.0 + 1.5) * APART  # m, from the middle to a wall
GRAVITY = 9.80665  # m/s^2
E_PIN = 0.8  # the restitution of pins
BLURRED = 1e-3  # m; so much do balls differ at first

Counts = NDArray[np.float64]


def board() -> Scene:
    """Return the board with one ball above the highest pin; what lands stays where it is."""
    pins = tuple(
        Post(((k + row % 2 / 2.0) * APART, -row * LOW), PIN, restitution=E_PIN)
        for row in range(ROWS)
        for k in range(-ROWS // 2 - 1, ROWS // 2 + 2 - row % 2)
    )
    corners = (-WIDE, FLOOR), (WIDE, FLOOR), (WIDE, 3.0 * LOW), (-WIDE, 3.0 * LOW)
    return Scene(
        (Ball("a", (0.0, LOW), BALL, 0.01),),
        Table(corners, tilt=(0.0, -GRAVITY)),
        Restitution(cushion=0.0),
        Friction(cushion=1.0),
        Physics(max_time=20.0),
        posts=pins,
    )


def bins_of(scene: Scene, count: int, seed: int = 1) -> Counts:
    """Return how many of so many balls land in each bin, those at the walls in the outer ones."""
    starts = np.random.default_rng(seed).normal(0.0, BLURRED, count)
    batch = simulate_many(scene, vary={"x.a": starts})
    landed = np.rint(batch.final[:, 0, 0] / APART + ROWS / 2.0)
    return np.bincount(np.clip(landed, 0, ROWS).astype(int), minlength=ROWS + 1).astype(float)


def ideal() -> Counts:
    """Return the share of each bin on an ideal board."""
    return np.array([math.comb(ROWS, k) for k in range(ROWS + 1)]) / 2.0**ROWS


def picture(scene: Scene, found: Counts) -> Figure:
    """Return a picture of the pins above, and of the bins below."""
    figure = Figure(figsize=(6.0, 8.5), layout="constrained")
    above, below = figure.subplots(2, height_ratios=(1.7, 1.0), sharex=True)
    for post in scene.posts:
        (x, y), r = post.position, post.radius
        above.add_patch(_circle((x / APART, y / APART), r / APART, "#44505c"))
    above.add_patch(_circle((0.0, LOW / APART), BALL / APART, "#d55e00"))
    above.set_aspect("equal")
    above.set_xlim(-WIDE / APART, WIDE / APART)
    above.set_ylim(FLOOR / APART, 2.0)
    above.set_axis_off()
    middle = np.arange(ROWS + 1) - ROWS / 2.0
    below.bar(middle, found / found.sum(), 0.8, color="#56b4e9", label=f"{found.sum():.0f} balls")
    below.plot(middle, ideal(), "o-", color="#222222", label="ideal board: binomial")
    below.set_xlabel("bin, counted from the middle")
    below.set_ylabel("share of the balls")
    below.legend()
    return figure


def _circle(center: tuple[float, float], radius: float, color: str) -> object:
    from matplotlib.patches import Circle

    return Circle(center, radius, color=color)


def main(words: Sequence[str] | None = None) -> Counts:
    """Drop the balls, print what the bins have, draw it, and return it."""
    parser = argparse.ArgumentParser(description="A thousand balls on a plinko board.")
    parser.add_argument("--out", type=Path, help="folder for the picture")
    parser.add_argument("--balls", type=int, default=1000)
    asked = parser.parse_args(words)
    scene = board()
    found = bins_of(scene, asked.balls)
    print("bin  balls  an ideal board")
    for k, (own, share) in enumerate(zip(found, ideal(), strict=True)):
        print(f"{k - ROWS / 2:+3.0f}  {own:5.0f}  {share * asked.balls:8.1f}")
    if asked.out is not None:
        asked.out.mkdir(parents=True, exist_ok=True)
        picture(scene, found).savefig(asked.out / "plinko.png", dpi=120)
    return found


if __name__ == "__main__":
    main()
