"""How exactly contacts that persist are played
============================================

A soft break presses balls together for long. This measures what a tolerance of these contacts does
to the ends of soft breaks of eight-ball, to their events, and to the computing time.

Friction, a roll or an arc may press two sides together, and :func:`pool_pymunk.simulate` takes a
``contact_tolerance`` for this. The shots are drawn by a seed: they aim at the rack, from anywhere
behind the head string, at 0.5 to 3 m/s, and roll at once. Errors are distances of ends from those
at a tenth of the finest tolerance. ``pool-pymunk tradeoff SCENARIO --contact-tolerance ...`` does
the same for the shots of a scenario.

Run it with ``python examples/contact_tolerance.py --out FOLDER``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pool_pymunk import Scene, Shot, load
from pool_pymunk.studies.compare import Comparison
from pool_pymunk.studies.grid import Tradeoff, at_tolerances, begin, sentences

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)  # m
HEAD = ((0.1, 0.6), (0.1, 1.17))  # m; from where to where the cue ball may lie, along x and y
SPEEDS = 0.5, 3.0  # m/s

Floats = NDArray[np.float64]


def soft_breaks(count: int, seed: int = 0) -> Scene:
    """Return the table of eight-ball, with soft breaks that are drawn by a seed."""
    scene, rng = load("eight-ball"), np.random.default_rng(seed)
    shots = []
    for k in range(count):
        (x, y), speed = rng.uniform(*np.transpose(HEAD)), rng.uniform(*SPEEDS)
        place, speed = (round(x, 3), round(y, 3)), round(speed, 2)
        shots.append(Shot(f"Break {k + 1}", "cue", speed=speed, aim="1", roll=1.0, place=place))
    return replace(scene, title=f"{count} soft breaks of eight-ball", shots=tuple(shots))


def measured(scene: Scene, budget: float) -> Tradeoff:
    """Measure all shots at all tolerances, in about the ``budget`` (s) for repeated runs."""
    found = begin(scene, scene.shots, TOLERANCES)
    for column in at_tolerances(TOLERANCES):
        found = found.measured(column, budget / len(TOLERANCES))
    return found


def errors_of(found: Tradeoff) -> Floats:
    """Return the largest error (m) of an end (T, S), at each tolerance and in each shot."""
    runs = iter(found.runs)
    return np.array(
        [[Comparison(one, next(runs)).largest for one in found.sound] for _ in found.settings]
    )


def picture(found: Tradeoff, path: Path) -> None:
    """Draw the errors of all shots and their median, and what a shot costs."""
    figure, errors, shots = Figure((9.0, 4.0), layout="constrained"), errors_of(found), found.sound
    left, right = figure.subplots(1, 2)
    left.loglog(TOLERANCES, errors, ".", color="#56b4e9", markersize=4)
    left.loglog(TOLERANCES, np.median(errors, axis=1), "o-", color="#000000", label="median")
    left.loglog(TOLERANCES, TOLERANCES, ":", color="#999999", label="the tolerance itself")
    left.set(ylabel="largest error of an end of a shot (m)")
    costs = {
        "events": [one.events / len(shots) for one in found.settings],
        "computing time (ms)": [1e3 * one.time / len(shots) for one in found.settings],
    }
    for (label, values), marker in zip(costs.items(), "os", strict=True):
        right.loglog(TOLERANCES, values, f"{marker}-", label=label)
    right.set(ylabel="of a shot, in the mean")
    for axes in (left, right):
        axes.set(xlabel="tolerance of contacts that persist (m)")
        axes.grid(color="#dddddd")
        axes.legend()
    figure.suptitle(f"{len(shots)} soft breaks of eight-ball")
    figure.savefig(path, dpi=120)


def main(argv: Sequence[str] | None = None) -> Tradeoff:
    """Measure, print a line for each tolerance, draw the picture, and return what was measured."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path())
    parser.add_argument("--shots", type=int, default=20)
    parser.add_argument("--budget", type=float, default=3.0)
    options = parser.parse_args(argv)
    found = measured(soft_breaks(options.shots), options.budget)
    for one, errors in zip(found.settings, errors_of(found), strict=True):
        print(
            f"{one}: errors of {np.median(errors):.1e} m in the median and {max(errors):.1e} m at "
            f"most, {one.events / len(errors):.0f} events and "
            f"{1e3 * one.time / len(errors):.1f} ms a shot"
        )
    print(*sentences(found), sep="\n")
    picture(found, options.out / "contact_tolerance.png")
    return found


if __name__ == "__main__":
    main()
