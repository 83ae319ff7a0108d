"""This module works out how the ends of an exact run depend on its inputs, to first order.

Between contacts and through them everything is differentiable in closed form: the run is played
once more, the changes of the balls' states follow it from event to event
(:mod:`pool_pymunk.core.tangent.tangent`), and contact times move with them. Shots that go on from
the one before are followed through the whole chain: the changes of one shot's ends are changes of
the next start, and they turn a shot that aims at a ball anew.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pool_pymunk.model import Scene, Shot
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.former import Former
from pool_pymunk.model.inputs import SHOT, TABLE, Names, chosen, derivable, parts
from pool_pymunk.model.problems import listed, setting_error, suggestion
from pool_pymunk.results.run import Run, read_times
from pool_pymunk.solvers import SOLVERS, find_solver
from pool_pymunk.studies.changes import Changes, by_names, changes_of


@dataclass(frozen=True, eq=False)
class Derivatives:
    """These are the derivatives of a run's ends and event times by its inputs, in SI.

    ``names`` (P) are the inputs, as in the table of inputs (:mod:`pool_pymunk.model.inputs`):
    ``"x.C"`` and ``"mass.C"`` of ball C, ``"speed"`` of the shot, ``"restitution.cushion"``, ...

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
        dx, dy = self.final[ball_number(self.run.scene, ball), :, self.names.index(name)]
        return float(dx), float(dy)

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
        return self.changes.at(t.tolist(), ball_number(self.run.scene, ball))

    @property
    def amplification(self) -> Amplification:
        """Return the largest singular value of each end's derivatives by all balls' positions."""
        by_place = self.final[:, :, [name[:2] in ("x.", "y.") for name in self.names]]
        sound = np.isfinite(by_place).all(axis=(1, 2)) & (by_place.shape[2] > 0)
        most = np.full(len(by_place), math.nan)
        if sound.any():
            most[sound] = np.linalg.svd(by_place[sound], compute_uv=False)[:, 0]
        return Amplification(zip(self.run.scene.index, most.tolist(), strict=True))


class Amplification(Former, dict[str, float]):
    """These are numbers by the ids of balls."""

    name = "amplification"


def ball_number(scene: Scene, ball: str, key: str = "ball") -> int:
    """Return the number of a ball in the scene; raise SettingError where there is none."""
    if ball not in scene.index:
        message = f"there is no such ball (there are: {listed(scene.index)})"
        raise setting_error(key, ball, message + suggestion(ball, scene.index))
    return scene.index[ball]


def derivatives(run: Run, wrt: str | Sequence[str] = ("position", "velocity")) -> Derivatives:
    """Differentiate the ends of an exact run, as :meth:`Run.derivatives` says.

    "all" leaves out "turn", which is "angle" here.
    """
    if not find_solver(run.solver).exact:
        exact = listed([name for name, solver in SOLVERS.items() if solver.exact])
        message = f"is not exact, so its runs have no exact derivatives (exact are: {exact})"
        raise setting_error("solver", run.solver, message)
    names = chosen("wrt", wrt, derivable(run.scene, run.struck is not None))
    return differentiated(run, names, by_names(run, names, names))


def differentiated(run: Run, names: Names, starts: Array) -> Derivatives:
    """Differentiate the ends of an exact run, by the changes (N, K, P) of its ``starts``."""
    changes = changes_of(run, names, starts)
    ends = changes.ends
    return Derivatives(
        run, names, ends[:, :2], ends[:, 2:4], changes.times, changes.warnings, changes
    )


# -- through a chain of shots ----------------------------------------------------------------------


def follow(
    runs: Mapping[int, Run], names: Names, aims_anew: bool = False
) -> Iterator[tuple[int, Derivatives]]:
    """Yield the number of each run of a chain, and its derivatives by names such as "turn.2".

    A shot that aims at a ball keeps its direction, unless it ``aims_anew`` where balls move.
    """
    last: Derivatives | None = None
    for k, run in runs.items():
        before = last if run.shot is not None and run.shot.from_previous else None
        last = differentiated(run, names, _chained(run, names, k, before, aims_anew))
        yield k, last


def _chained(
    run: Run, names: Names, number: int, before: Derivatives | None, aims_anew: bool
) -> Array:
    """Return how the start of a run changes, which is the end of the shot ``before``.

    A shot gives its ball a velocity, and it may put the ball somewhere.
    """
    ours, shot = {"", str(number)}, run.shot
    shots = [n for n in names if TABLE[parts(n)[0]].of == SHOT and parts(n)[1] in ours]
    own = by_names(run, names, [n for n in names if TABLE[parts(n)[0]].of != SHOT])
    starts = own if before is None else before.changes.ends.copy()
    if shot is None:
        return starts
    i = run.scene.index[shot.ball]
    if shot.place is not None:
        starts[i, :2] = own[i, :2]
    moved = starts[:, :2].copy()
    starts[i, 2:] = by_names(run, names, shots)[i, 2:]
    if aims_anew and shot.aim is not None and moved.any():
        vx, vy = run.knots[i][0, 3:5]
        turned = np.outer((-vy, vx), turn(run, shot, moved))
        starts[i, 2:4] += turned
        starts[i, 4:] += shot.roll * turned[: len(starts[i]) - 4]
    return starts


def turn(run: Run, shot: Shot, place: Array) -> Array:
    """Return how far (rad) a shot that aims at a ball turns (P,) if balls move by ``place``."""
    scene = run.scene
    starts = [tuple(breakpoints[0, 1:3].tolist()) for breakpoints in run.knots]
    i = scene.index[shot.ball]
    gone = run.off - run.pocketed.keys()
    assert shot.aim is not None
    j = scene.nearest(i, starts, gone) if shot.aim == "nearest" else scene.index[shot.aim]
    x, y = (b - a for a, b in zip(starts[i], starts[j], strict=True))
    dx, dy = place[j] - place[i]
    return np.asarray((x * dy - y * dx) / (x * x + y * y))
