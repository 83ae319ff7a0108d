"""This module names the inputs of a run, and says how its start and its contacts depend on them."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from pool_pymunk.model.problems import setting_error, suggestion
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Run

RESTITUTIONS = ("ball_ball", "cue_ball", "cushion")
FRICTIONS = ("surface", "ball_ball", "cushion")
GROUPS = ("position", "velocity", "speed", "angle", "mass", "radius", "restitution", "friction")

Names = tuple[str, ...]


def names_of(run: Run, wrt: object) -> Names:
    """Return the names of the inputs that are asked for, each once."""
    asked = [wrt] if isinstance(wrt, str | bytes) else wrt
    groups = _groups(run)
    known = [name for names in groups.values() for name in names]
    if not isinstance(asked, Iterable):
        raise setting_error("wrt", wrt, f"must be names, such as {', '.join(GROUPS)}")
    found: dict[str, None] = {}
    for name in asked:
        if not isinstance(name, str) or not (name in known or name in groups or name == "all"):
            meant = suggestion(name, [*groups, *known]) if isinstance(name, str) else ""
            raise setting_error("wrt", name, f"there is no such input of this run{meant}")
        names = known if name == "all" else groups.get(name, [name])
        found |= dict.fromkeys(map(str, names))
    return tuple(found)


def _groups(run: Run) -> dict[str, list[str]]:
    """Return the inputs that this run has, group by group."""
    scene, ids = run.scene, [ball.id for ball in run.scene.balls]
    e = scene.restitution
    groups = {
        "position": [f"{axis}.{id_}" for id_ in ids for axis in ("x", "y")],
        "velocity": [f"{axis}.{id_}" for id_ in ids for axis in ("vx", "vy")],
        "mass": [f"mass.{id_}" for id_ in ids],
        "radius": [f"radius.{id_}" for id_ in ids],
        "restitution": [
            f"restitution.{key}" for key in RESTITUTIONS if getattr(e, key) is not None
        ],
        "friction": [f"friction.{key}" for key in FRICTIONS],
    }
    if run.shot is not None:
        groups |= {"speed": ["speed"], "angle": ["angle"]}
    return groups


class Inputs:
    """The inputs are what is varied: each has a column in every change.

    ``start(i)`` is the change (4, P) of a ball's state at the start. ``radius(i)``, ``mass(i)`` and
    ``unit(name)`` are the changes (P,) of what contacts are told; None stands for none.
    """

    def __init__(self, run: Run, names: Names) -> None:
        self.run, self.count = run, len(names)
        self.column = {name: k for k, name in enumerate(names)}

    def start(self, i: int) -> Array:
        """Return the change of a ball's state at the start."""
        change = np.zeros((4, self.count))
        id_ = self.run.scene.balls[i].id
        for row, axis in enumerate(("x", "y", "vx", "vy")):
            column = self.column.get(f"{axis}.{id_}")
            if column is not None:
                change[row, column] = 1.0
        if self.run.shot is not None and self.run.shot.ball == id_:
            vx, vy = self.run.knots[i][0, 3:5].tolist()
            speed = math.hypot(vx, vy)
            if "speed" in self.column and speed > 0.0:
                change[2:, self.column["speed"]] = vx / speed, vy / speed
            if "angle" in self.column:
                change[2:, self.column["angle"]] = math.radians(-vy), math.radians(vx)
        return change

    def unit(self, name: str) -> Array | None:
        """Return the change of one input itself; None if it is not varied."""
        column = self.column.get(name)
        if column is None:
            return None
        change = np.zeros(self.count)
        change[column] = 1.0
        return change

    def radius(self, i: int) -> Array | None:
        """Return the change of a ball's radius."""
        return self.unit(f"radius.{self.run.scene.balls[i].id}")

    def mass(self, i: int) -> Array | None:
        """Return the change of a ball's mass."""
        return self.unit(f"mass.{self.run.scene.balls[i].id}")
