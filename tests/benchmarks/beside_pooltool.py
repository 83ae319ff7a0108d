"""Two-ball shots without cushions, beside pooltool 0.6, which has the same equations of rolling.

pooltool moves balls 1e-6 m apart at a hit, so ends agree to what this moves them. The environment
is that of the torture suite (docs/beside-others.md), with this package in it:

    python -m torture.play pooltool --only "stop shot"
    .venv-torture/pooltool/bin/pip install .
    .venv-torture/pooltool/bin/python tests/benchmarks/beside_pooltool.py
"""

from __future__ import annotations

import math
import random
import time
from typing import Any

import numpy as np
import pooltool
from pooltool.objects import BilliardTableSpecs
from pooltool.physics.engine import PhysicsEngine
from pooltool.physics.resolve.ball_ball.frictionless_elastic import FrictionlessElastic
from pooltool.physics.resolve.resolver import default_resolver

from pool_pymunk import Ball, Friction, Physics, Restitution, Run, Scene, Shot, simulate

R, MASS, G, SLIDING, ROLLING = 0.028575, 0.170097, 9.81, 0.2, 0.01
MIDDLE = 100.0  # m; a table so large that nobody comes to a cushion
SHOTS = 200


def shots(count: int) -> list[tuple[float, ...]]:
    """Return random shots: speed (m/s), roll, distance (m), and how full the hit is (radii)."""
    rnd = random.Random(1)
    ranges = ((0.5, 4.0), (-2.0, 2.0), (0.2, 1.5), (-1.9, 1.9))
    return [tuple([rnd.uniform(*each) for each in ranges]) for _ in range(count)]


def ours(speed: float, roll: float, away: float, across: float) -> Run:
    """Play a shot by event-driven."""
    balls = (
        Ball("cue", (0.0, 0.0), R, MASS, cue=True),
        Ball("1", (away, across * R), R, MASS),
    )
    return simulate(
        Scene(
            balls, restitution=Restitution(1.0), physics=Physics(gravity=G),
            friction=Friction(SLIDING, rolling=ROLLING),
            shots=(Shot("shot", "cue", speed=speed, angle=0.0, roll=roll),),
        ),
        solver="event-driven",
    )  # fmt: skip


def theirs(engine: Any, speed: float, roll: float, away: float, across: float) -> dict[str, Any]:
    """Play it by pooltool, and return the ends (m) of its balls."""
    about = {"m": MASS, "R": R, "u_s": SLIDING, "u_r": ROLLING, "e_b": 1.0, "g": G}
    places = {"cue": (MIDDLE, MIDDLE), "1": (MIDDLE + away, MIDDLE + across * R)}
    balls = {name: pooltool.Ball.create(name, xy=xy, **about) for name, xy in places.items()}
    cue = balls["cue"]
    cue.state.rvw[1] = speed, 0.0, 0.0
    cue.state.rvw[2] = 0.0, roll * speed / R, 0.0
    cue.state.s = 2  # It slides.
    table = pooltool.Table.from_table_specs(BilliardTableSpecs(l=2 * MIDDLE, w=2 * MIDDLE))
    system = pooltool.System(cue=pooltool.Cue.default(), table=table, balls=balls)
    pooltool.simulate(system, engine=engine, inplace=True)
    return {name: ball.state.rvw[0, :2] - MIDDLE for name, ball in balls.items()}


def main() -> None:
    """Print how far the ends lie apart, and the times of both."""
    resolver = default_resolver()
    resolver.ball_ball = FrictionlessElastic()
    engine = PhysicsEngine(resolver=resolver)
    theirs(engine, 1.0, 0.5, 0.5, 0.2)  # numba compiles
    apart, far, clocks = [], [], np.zeros(2)
    for shot in shots(SHOTS):
        began = time.perf_counter()
        run = ours(*shot)
        between = time.perf_counter()
        ends = theirs(engine, *shot)
        clocks += between - began, time.perf_counter() - between
        starts = zip(ends, run.knots, strict=True)
        apart.append(max(math.dist(run.final[name], ends[name]) for name in ends))
        far.append(
            max(math.dist(run.final[name], breakpoints[0, 1:3]) for name, breakpoints in starts)
        )
    mine, its = 1e3 * clocks / SHOTS
    print(f"{SHOTS} shots, balls travel up to {max(far):.3g} m")
    print(f"ends apart: median {np.median(apart):.2g} m, most {max(apart):.2g} m")
    print(f"ms a shot: event-driven {mine:.3g}, pooltool {its:.3g}")


if __name__ == "__main__":
    main()
