"""This module predicts where measured balls are, and how that depends on the numbers of the scene.

Shots that go on from the one before are followed through the whole chain: the changes of its ends
are changes of the next start, and of where a shot goes that aims at a ball.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model import Scene, SceneError, Shot
from pool_pymunk.model.inputs import SHOT, TABLE, Names, input_value, parts, with_inputs
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import simulate_all, yardstick
from pool_pymunk.studies.changes import Inputs
from pool_pymunk.studies.derivatives import Derivatives, differentiated
from pool_pymunk.studies.measured import Measurement

Runs = Mapping[int, Run]  # by the numbers of their shots
Values = tuple[float, ...]
Whole = NDArray[np.intp]
KEPT = 4  # This many plays are kept: a search comes back to its last ones.


class Forecast:
    """A forecast knows the scene, what is varied, and what was measured.

    Of numbers ``values`` (P,) it tells the residuals (M, 2) in m, which are measured less
    predicted, and the derivatives (M, 2, P) of the predicted places.
    """

    def __init__(
        self,
        scene: Scene,
        names: Names,
        measured: Sequence[Measurement],
        law: str | Law | None = None,
    ) -> None:
        self.scene, self.names, self.measured, self.law = scene, names, measured, law
        self.own = np.array([input_value(scene, name) for name in names])
        self.places = np.array([(one.x, one.y) for one in measured])
        self.looks = _looks(scene, measured)
        self.chain = _chain(scene, set(self.looks))
        self._played = lru_cache(KEPT)(self._play)
        self._differentiated = lru_cache(KEPT)(self._differentiate)

    def scene_of(self, values: Array) -> Scene:
        """Return the scene with these numbers; raise SceneError where there is none."""
        return self._scene(tuple(values.tolist()))

    def _scene(self, values: Values) -> Scene:
        return with_inputs(self.scene, dict(zip(self.names, values, strict=True)))

    def runs(self, values: Array) -> Runs | None:
        """Play all shots that count; None if these numbers make no scene, or no end."""
        return self._played(tuple(values.tolist()))

    def _play(self, values: Values) -> Runs | None:
        try:
            scene = self._scene(values)
            shots = [scene.shots[k - 1] if scene.shots else None for k in self.chain]
            played = simulate_all(scene, shots, solver=yardstick().name, law=self.law)
            runs = dict(zip(self.chain, played, strict=True))
        except SceneError:
            return None
        return runs if all(run.success for run in runs.values()) else None

    def residuals(self, values: Array) -> Array:
        """Return measured less predicted places (M, 2); infinite where nothing can be played."""
        runs = self.runs(values)
        if runs is None:
            return np.full_like(self.places, math.inf)
        found = self.places.copy()
        for k, (rows, balls, times) in self.looks.items():
            places = runs[k].at(np.minimum(times, runs[k].duration))[0]
            found[rows] -= places[np.arange(len(rows)), balls]
        return found

    def derivatives(self, values: Array) -> tuple[Array, tuple[str, ...]]:
        """Return the derivatives (M, 2, P) of the predicted places, and what runs warn of."""
        return self._differentiated(tuple(values.tolist()))

    def _differentiate(self, values: Values) -> tuple[Array, tuple[str, ...]]:
        runs = self._played(values)
        assert runs is not None, "these numbers could be played"
        found = np.zeros((len(self.measured), 2, len(self.names)))
        warnings: dict[str, None] = {}
        for k, known in follow(runs, self.names):
            run = known.run
            warnings |= dict.fromkeys(f"{run.name}: {warning}" for warning in known.warnings)
            if k in self.looks:
                rows, balls, times = self.looks[k]
                at = np.minimum(times, run.duration)
                for i in np.unique(balls):
                    its = balls == i
                    found[rows[its]] = known.at(at[its], self.scene.balls[i].id)
        return found, tuple(warnings)


def _looks(scene: Scene, measured: Sequence[Measurement]) -> dict[int, tuple[Whole, Whole, Array]]:
    """Return, for each shot, the rows of its measurements, the balls, and the times (s)."""
    shots = np.array([one.shot for one in measured])
    balls = np.array([scene.index[one.ball] for one in measured])
    times = np.array([math.inf if one.t is None else one.t for one in measured])
    rows = {int(k): np.flatnonzero(shots == k) for k in np.unique(shots)}
    return {k: (its, balls[its], times[its]) for k, its in rows.items()}


def _chain(scene: Scene, measured: set[int]) -> tuple[int, ...]:
    """Return the numbers of the shots that must be played, in their order."""
    wanted = set(measured)
    for k in range(len(scene.shots), 1, -1):
        if k in wanted and scene.shots[k - 1].from_previous:
            wanted.add(k - 1)
    return tuple(sorted(wanted))


# -- derivatives through a chain of shots ----------------------------------------------------------


def follow(runs: Runs, names: Names) -> Iterator[tuple[int, Derivatives]]:
    """Yield each run's number, and its derivatives by these names, through the shots before it.

    The inputs of shots have the numbers of their shots behind them, as in "turn.2".
    """
    known: Derivatives | None = None
    for k, run in runs.items():
        goes_on = run.shot is not None and run.shot.from_previous
        known = differentiated(run, names, _Chained(run, names, k, known if goes_on else None))
        yield k, known


class _Chained(Inputs):
    """These inputs change a shot, and what it goes on from: the end of the shot ``before``."""

    def __init__(self, run: Run, names: Names, number: int, before: Derivatives | None) -> None:
        super().__init__(run, names)
        ours = {"", str(number)}
        self.shots = [n for n in names if TABLE[parts(n)[0]].of == SHOT and parts(n)[1] in ours]
        if before is None:
            others = [n for n in names if TABLE[parts(n)[0]].of != SHOT]
            self.carried = np.array([self.by_names(i, others) for i in range(len(run.knots))])
        else:
            self.carried = np.concatenate([before.final, before.velocity], axis=1)

    def start(self, i: int) -> Array:
        """Return the change of a ball's state at the start; a shot gives its ball a velocity."""
        shot, change = self.run.shot, self.carried[i].copy()
        if shot is not None and shot.ball == self.run.scene.balls[i].id:
            change[2:] = self.by_names(i, self.shots)[2:]
            if shot.aim is not None and self.carried[:, :2].any():
                vx, vy = self.run.knots[i][0, 3:5]
                change[2:] += np.outer((-vy, vx), turn(self.run, shot, self.carried[:, :2]))
        return np.asarray(change)


def turn(run: Run, shot: Shot, place: Array) -> Array:
    """Return how far (rad) a shot that aims at a ball turns (P,) if balls move by ``place``."""
    scene = run.scene
    starts = [tuple(knots[0, 1:3].tolist()) for knots in run.knots]
    i = scene.index[shot.ball]
    gone = run.off - run.pocketed.keys()
    assert shot.aim is not None
    j = scene.nearest(i, starts, gone) if shot.aim == "nearest" else scene.index[shot.aim]
    x, y = (b - a for a, b in zip(starts[i], starts[j], strict=True))
    dx, dy = place[j] - place[i]
    return np.asarray((x * dy - y * dx) / (x * x + y * y))
