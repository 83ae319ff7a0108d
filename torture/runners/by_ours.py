"""pool_pymunk plays the scenes: by the solver event-driven, and by pymunk at 1/60 s."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np

from pool_pymunk import Ball, Friction, Physics, Restitution, Scene, Table, simulate
from torture.runners.common import serve, setting

DOCS = "docs/solver-and-step.md"
OFFERS = {
    "restitution below 1",
    "friction of sliding discs",
    "balls that roll",
    "any outline",
    "hits of one instant",
    "unequal masses",
    "unequal radii",
}
SETTINGS = {
    "event-driven": setting({"solver": "event-driven"}, "the default of studies; no step", DOCS),
    "pymunk, 1/60 s": setting({"solver": "pymunk", "dt": 1 / 60}, "the default step", DOCS),
}


def play(scene: dict[str, Any], balls: Any, times: list[float], given: dict[str, Any]) -> Any:
    """Play by a solver, and look at the run at the times."""
    discs = tuple(
        Ball(str(i), (x, y), r, m, velocity=(vx, vy), roll=scene["roll"])
        for i, (x, y, vx, vy, r, m) in enumerate(balls)
    )
    table = Table(tuple((x, y) for x, y in scene["walls"])) if scene["walls"] else None
    run = simulate(
        Scene(
            discs,
            table,
            Restitution(scene["restitution"], cushion=scene["wall_restitution"]),
            Friction(scene["friction"], rolling=scene["rolling"]),
            physics=Physics(gravity=9.81, max_time=times[-1]),
        ),
        **given,
    )
    states: list[list[list[float]]] = np.concatenate(run.at(times), axis=2).tolist()
    return states


if __name__ == "__main__":
    names = ("pool-pymunk", "pymunk", "numpy")
    serve(OFFERS, {name: version(name) for name in names}, SETTINGS, play)
