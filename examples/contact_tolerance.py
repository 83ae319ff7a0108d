"""How exactly contacts that persist are played
============================================

A soft break presses balls together for long. This measures what a tolerance of these contacts does
to the ends of soft breaks of eight-ball, to their events, and to the computing time.

Friction, a roll or an arc may press two sides together, and :func:`pool_pymunk.simulate` takes a
``contact_tolerance`` for this. The shots are drawn by a seed: they aim at the rack, from anywhere
behind the head string, at 0.5 to 3 m/s, and roll at once. Errors are distances of ends from those
at a tenth of the finest tolerance. ``pool-pymunk tradeoff SCENARIO --contact-tolerance ...`` does
the same for the shots of a scenario; ``soft-breaks.toml`` has those that are played here.

Run it with ``python examples/contact_tolerance.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pool_pymunk import Scene, Shot, load
from pool_pymunk.render.diagram import draw
from pool_pymunk.studies.compare import Comparison
from pool_pymunk.studies.grid import Tradeoff, at_tolerances, begin, sentences

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)  # m
HEAD = ((0.1, 0.6), (0.1, 1.17))  # m; from where to where the cue ball may lie, along x and y
SPEEDS = 0.5, 3.0  # m/s


def soft_breaks(count: int, seed: int = 0) -> Scene:
    """Return the table of eight-ball, with soft breaks that are drawn by a seed."""
    scene, rng = load("eight-ball"), np.random.default_rng(seed)
    shots = []
    for k in range(count):
        (x, y), speed = rng.uniform(*np.transpose(HEAD)), rng.uniform(*SPEEDS)
        place, speed = (round(x, 3), round(y, 3)), round(speed, 2)
        shots.append(Shot(f"Break {k + 1}", "cue", speed=speed, aim="1", roll=1.0, place=place))
    return replace(scene, title=f"{count} soft breaks of eight-ball", shots=tuple(shots))


def measured(scene: Scene, tolerances: Sequence[float], budget: float) -> Tradeoff:
    """Measure all shots at these tolerances (m), in about the ``budget`` (s) for repeated runs."""
    found = begin(scene, scene.shots, tolerances)
    for column in at_tolerances(tolerances):
        found = found.measured(column, budget / len(tolerances))
    return found


def main(argv: Sequence[str] | None = None) -> Tradeoff:
    """Measure, print a line for each tolerance, draw the picture, and return what was measured."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--shots", type=int, default=10)
    parser.add_argument("--budget", type=float, default=5.0)
    options = parser.parse_args(argv)
    scene = soft_breaks(options.shots)
    (options.out / "soft-breaks.toml").write_text(scene.to_toml(), encoding="utf-8")
    found = measured(scene, TOLERANCES, options.budget)
    count = len(found.sound)
    for k, one in enumerate(found.settings):
        runs = found.runs[k * count : (k + 1) * count]
        errors = [Comparison(*both).largest for both in zip(found.sound, runs, strict=True)]
        print(
            f"{one}: errors of {np.median(errors):.1e} m in the median and {max(errors):.1e} m at "
            f"most, {one.events / count:.0f} events and {1e3 * one.time / count:.1f} ms a shot"
        )
    print(*sentences(found), sep="\n")
    draw(found, [options.out / "contact_tolerance.png"])
    return found


if __name__ == "__main__":
    main()
