"""Shots that do what you want
===========================

This finds a shot that pots the 8 ball, and one that makes a carom, and draws both.

:func:`pool_pymunk.find` plays a hundred thousand shots, and keeps those that do what is asked. It
ranks them by how often they still do so when the player errs, here by standard deviations of half a
degree and 0.05 m/s.

Run it with ``python examples/find_a_shot.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pool_pymunk import Batch, Found, Scene, Shot, find, load

POOL = {"cue": (0.6, 0.4), "8": (1.6, 0.9), "1": (1.1, 0.75), "4": (2.0, 0.35)}  # m
CAROM = {"C": (1.68, 0.56), "3": (0.56, 0.4), "8": (0.9, 0.95)}  # m


def with_balls(scene: Scene, places: dict[str, tuple[float, float]], shot: Shot) -> Scene:
    """Return the scene with these balls alone, and one shot."""
    balls = (replace(b, position=places[b.id]) for b in scene.balls if b.id in places)
    return replace(scene, balls=tuple(balls), shots=(shot,))


def pot_the_eight(tries: int = 100_000) -> list[Found]:
    """Find shots after which the 8 ball is in a pocket, and the cue ball is not."""
    scene = with_balls(load("eight-ball"), POOL, Shot("pot", "cue", speed=3.0, aim="8"))
    eight, cue = scene.index["8"], scene.index["cue"]

    def wanted(batch: Batch) -> NDArray[np.bool_]:
        return (batch.pocketed[:, eight] >= 0) & (batch.pocketed[:, cue] < 0)

    return find(scene, 1, wanted, tries=tries)


def make_a_carom(tries: int = 100_000) -> list[Found]:
    """Find shots in which the cue ball meets two others."""
    shot = Shot("carom", "C", speed=4.0, aim="3")
    scene = with_balls(load("report"), CAROM, shot)

    def wanted(batch: Batch) -> NDArray[np.bool_]:
        return np.asarray(batch.met.sum(axis=1) == 2)

    return find(scene, 1, wanted, tries=tries)


def main(argv: Sequence[str] | None = None) -> dict[str, list[Found]]:
    """Find both shots, print the best ones, draw the best one of each, and return them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--tries", type=int, default=100_000)
    options = parser.parse_args(argv)
    found = {"pot": pot_the_eight(options.tries), "carom": make_a_carom(options.tries)}
    for name, shots in found.items():
        print(name)
        for one in shots:
            print(f"  {one.angle:8.3f} degrees, {one.speed:.3f} m/s: {100 * one.share:.0f} %")
        shots[0].run.plot(path=options.out / f"found-{name}.png", dpi=120)
    return found


if __name__ == "__main__":
    main()
