"""pool_pymunk plays the scenes: by the solver event-driven, and by pymunk at 1/60 s."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np

from pool_pymunk import simulate
from pool_pymunk.studies.stability.known import scene_of
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
    run = simulate(scene_of(scene | {"balls": balls, "time": times[-1]}), **given)
    states: list[list[list[float]]] = np.concatenate(run.at(times), axis=2).tolist()
    return states


if __name__ == "__main__":
    names = ("pool-pymunk", "pymunk", "numpy")
    serve(OFFERS, {name: version(name) for name in names}, SETTINGS, play)
