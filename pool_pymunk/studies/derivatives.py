"""This module works out how the ends of an exact run depend on its inputs, to first order.

Between contacts and through them everything is differentiable in closed form, so nothing is played
again: the changes of the balls' states follow the run from event to event
(:mod:`pool_pymunk.physics.saltation`), and contact times move with them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pool_pymunk.model.inputs import Names, chosen, names_in
from pool_pymunk.model.problems import listed, setting_error
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Run, read_times
from pool_pymunk.solvers import SOLVERS, find_solver
from pool_pymunk.studies.changes import Changes, Inputs, law_of
from pool_pymunk.studies.rounding import rounding as rounding


@dataclass(frozen=True, eq=False)
class Derivatives:
    """These are the derivatives of a run's ends and event times by its inputs, in SI.

    ``names`` (P) are the inputs, as in the table of inputs (:mod:`pool_pymunk.model.inputs`):
    ``"x.C"`` and ``"mass.C"`` of ball C, ``"speed"`` and ``"angle"`` of the shot,
    ``"restitution.cushion"``, and so on.

    ``final`` (N, 2, P) are the derivatives of the ends (m by the input's unit), with N as in
    ``scene.balls``. ``velocity`` (N, 2, P) are those of the velocities at the end (m/s), and
    ``times`` (E, P) those of the times of ``run.events`` (s). An end is that at the time
    ``run.duration``, which is held fixed where balls still move then. NaN stands where no
    derivative exists, or none is known; ``warnings`` say why.
    """

    run: Run = field(repr=False)
    names: Names
    final: Array = field(repr=False)
    velocity: Array = field(repr=False)
    times: Array = field(repr=False)
    warnings: Names
    changes: Changes = field(repr=False)

    def of(self, ball: str, name: str) -> tuple[float, float]:
        """Return the derivatives of one ball's end (x, y) by one input."""
        if name not in self.names:
            known = listed(self.names)
            raise setting_error("name", name, f"there is no such input (there are: {known})")
        dx, dy = self.final[self._index(ball), :, self.names.index(name)]
        return float(dx), float(dy)

    def _index(self, ball: str) -> int:
        index = self.run.scene.index
        if ball not in index:
            raise setting_error("ball", ball, f"there is no such ball (there are: {listed(index)})")
        return index[ball]

    def at(self, times: Sequence[float] | Array, ball: str) -> Array:
        """Return the derivatives (T, 2, P) of one ball's positions at ``times`` (s).

        A time is held fixed, and so is the end of the run, where balls still move then.

        >>> from pool_pymunk import load, simulate
        >>> found = simulate(load("report"), 3, solver="event-driven").derivatives("speed")
        >>> found.at([0.0, 0.5, 99.0], "C")[:, 0, 0].round(6).tolist()
        [0.0, -0.433013, -0.829416]
        """
        t = read_times(times)
        if t.ndim != 1:
            raise setting_error("times", times, "must be a sequence of numbers")
        return self.changes.at_times(t.tolist(), self._index(ball))

    def amplification(self) -> dict[str, float]:
        """Return how much farther each ball's end moves at most than the starts of all balls.

        It is the largest singular value of the derivatives by the positions of all balls.
        """
        columns = [k for k, name in enumerate(self.names) if name[:2] in ("x.", "y.")]
        by_place = self.final[:, :, columns]
        sound = np.isfinite(by_place).all(axis=(1, 2))
        most = np.full(len(by_place), math.nan)
        if columns and sound.any():
            most[sound] = np.linalg.svd(by_place[sound], compute_uv=False)[:, 0]
        return {ball.id: float(m) for ball, m in zip(self.run.scene.balls, most, strict=True)}


def derivatives(run: Run, wrt: str | Sequence[str] = ("position", "velocity")) -> Derivatives:
    """Differentiate the ends of an exact run.

    ``wrt`` names inputs, such as "angle" or "restitution.cushion", or groups of them: "position"
    (the starts of all balls, with the velocities held), "velocity", "speed", "angle", "mass",
    "radius", "restitution", "friction", or "all" (except "turn", which is "angle" here). Raises
    SettingError for a run of a solver that is not exact, and for a law that cannot be
    differentiated.

    >>> from pool_pymunk import load, simulate
    >>> run = simulate(load("report"), "Simulation 3", solver="event-driven")
    >>> found = run.derivatives("speed")
    >>> [round(each, 6) for each in found.of("C", "speed")]
    [-0.829416, -0.417076]
    """
    if not find_solver(run.solver).exact:
        exact = listed([name for name, solver in SOLVERS.items() if solver.exact])
        message = f"is not exact, so its runs have no exact derivatives (exact are: {exact})"
        raise setting_error("solver", run.solver, message)
    groups = names_in(run.scene, [] if run.shot is None else [""])
    groups["all"] = [name for names in groups.values() for name in names if name != "turn"]
    names = chosen("wrt", wrt, groups)
    return differentiated(run, names, Inputs(run, names))


def differentiated(run: Run, names: Names, inputs: Inputs) -> Derivatives:
    """Differentiate the ends of an exact run by inputs that change its start as they say."""
    changes = Changes(run, law_of(run), inputs)
    changes.follow()
    final, velocity = changes.ends()
    times = np.array(changes.times).reshape(len(run.events), len(names))
    return Derivatives(run, names, final, velocity, times, tuple(changes.warnings), changes)
