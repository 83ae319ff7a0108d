"""This module reads measured places of balls, and predicts them from the numbers of a scene.

Measured places are in a CSV file, in rows, or they are a scenario's published ends.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.laws import Law
from pool_pymunk.model import Scene
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import TABLE, Names, input_value, parts, with_inputs
from pool_pymunk.model.plain import finite, is_row
from pool_pymunk.model.problems import LEFT_OUT, Problem, SceneError, listed, suggestion
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import reference_solver, simulate_all
from pool_pymunk.studies import Mask
from pool_pymunk.studies.derivatives import follow

PUBLISHED = "published"
NEEDED = ("shot", "ball", "x", "y")
COLUMNS = (*NEEDED, "t")
MOST_PROBLEMS = 50  # of one file; a user mends the first ones, and asks again
KEPT = 4  # plays that are kept: a search comes back to its last numbers, and to the best

Runs = Mapping[int, Run]  # by the numbers of their shots
Row = tuple[str, Mapping[str, Any]]  # where it stands, and its cells


class Measurement(NamedTuple):
    """A measurement says where the centre of a ball was (m) at the time ``t`` (s).

    Without a time it is the end of the shot. ``shot`` is the shot's number from 1, and 1 for a
    scene without shots.
    """

    shot: int
    ball: str
    x: float
    y: float
    t: float | None = None


def read_measured(measured: object, scene: Scene) -> tuple[Measurement, ...]:
    """Return measurements from a CSV file, from "published" ends, or from rows.

    A file has the columns shot, ball, x, y and optionally t (s); lengths are in the scenario's
    unit. Shots go by number from 1, or by name. Rows of Python, (shot, ball, x, y) or
    (shot, ball, x, y, t), are in SI. Raises SceneError with all that is wrong, one line a problem.

    >>> from pool_pymunk import load
    >>> read_measured([("Simulation 2", "C", 0.06, 0.63)], load("report"))
    (Measurement(shot=2, ball='C', x=0.06, y=0.63, t=None),)
    >>> len(read_measured("published", load("report")))
    44
    """
    if isinstance(measured, str) and measured == PUBLISHED:
        found = tuple(
            Measurement(k, id_, *end)
            for k, shot in enumerate(scene.shots, start=1)
            for id_, end in shot.published.items()
        )
        if not found:
            _refuse(PUBLISHED, "the scenario has no published ends: a CSV file is needed")
        return found
    if isinstance(measured, str | Path):
        unit = scene.units.to_si(1.0, "length")
        return _Reader(scene, str(measured), unit).read(_lines(str(measured)))
    if not isinstance(measured, Iterable) or isinstance(measured, Mapping):
        _refuse(measured, 'must be a CSV file, "published", or rows (shot, ball, x, y[, t])')
    return _Reader(scene).read(_rows(measured))


def _refuse(value: object, message: str, where: str = "measured") -> NoReturn:
    raise SceneError([Problem(where, value, message)])


def _rows(measured: Iterable[Any]) -> Iterator[Row]:
    for k, one in enumerate(measured):
        if not is_row(one) or not 4 <= len(one) <= 5:
            _refuse(one, "must be (shot, ball, x, y) or (shot, ball, x, y, t)", f"measured[{k}]")
        yield f"measured[{k}].", dict(zip(COLUMNS, one, strict=False))


def _lines(source: str) -> Iterator[Row]:
    try:
        lines = Path(source).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        _refuse(source, f"must be text in UTF-8 (byte {error.start} is not)")
    table = csv.DictReader(lines, restkey="more", skipinitialspace=True)
    table.fieldnames = header = [name.strip() for name in table.fieldnames or ()]
    every = ", ".join(COLUMNS)
    said: list[tuple[object, str]] = [
        (header, f"has no column {k}") for k in NEEDED if k not in header
    ]
    for name in header:
        if name not in COLUMNS:
            said.append((name, f"there is no such column ({every}){suggestion(name, COLUMNS)}"))
    if not header:
        said = [(LEFT_OUT, f"must name the columns: {every}")]
    if said:
        raise SceneError([Problem("line 1", *each) for each in said], source)
    for row in table:
        yield f"line {table.line_num}, ", row


class _Reader:
    """A reader turns cells into measurements, and gathers what is wrong with them."""

    def __init__(self, scene: Scene, source: str = "", unit: float = 1.0) -> None:
        self.scene, self.source, self.unit = scene, source, unit
        self.problems: list[Problem] = []
        numbers = {str(k): k for k in range(1, len(scene.shots) + 1)} or {"": 1, "1": 1}
        self.shots = {shot.name: k for k, shot in enumerate(scene.shots, start=1)} | numbers

    def read(self, rows: Iterable[Row]) -> tuple[Measurement, ...]:
        found = []
        for of, row in rows:
            before = len(self.problems)
            if "more" in row:
                self.problems.append(Problem(f"{of}columns", row["more"], "there are too many"))
            shot = self._name(of, "shot", row, self.shots)
            ball = self._name(of, "ball", row, self.scene.index)
            x, y = (self._number(f"{of}{key}", row.get(key)) * self.unit for key in ("x", "y"))
            t = self._time(f"{of}t", row.get("t"))
            self._on_table(of, x, y)
            if len(self.problems) == before:
                found.append(Measurement(self.shots[shot], ball, x, y, t))
            elif len(self.problems) >= MOST_PROBLEMS:
                break
        if not found and not self.problems:
            self.problems.append(Problem("measured", LEFT_OUT, "one measurement or more is needed"))
        if self.problems:
            raise SceneError(self.problems[:MOST_PROBLEMS], self.source)
        return tuple(found)

    def _name(self, of: str, key: str, row: Mapping[str, Any], known: Mapping[str, object]) -> str:
        """Return a name that is known, or refuse it."""
        written = "" if row.get(key) is None else str(row[key]).strip()
        if written not in known:
            every = listed([name for name in known if name]) or "none"
            said = f"there is no such {key} (there are: {every})" if written else "is missing"
            self.problems.append(Problem(f"{of}{key}", written or LEFT_OUT, said))
        return written

    def _number(self, key: str, value: Any) -> float:
        try:
            return finite(float(value) if isinstance(value, str) else value)
        except ValueError:
            missing = Problem(key, LEFT_OUT, "is missing")
            wrong = Problem(key, value, "must be a finite number")
            self.problems.append(missing if value in (None, "") else wrong)
            return math.nan

    def _time(self, key: str, value: Any) -> float | None:
        if value is None or (isinstance(value, str) and not value.strip()):
            return None
        t, latest = self._number(key, value), self.scene.physics.max_time or math.inf
        if t < 0.0:
            self.problems.append(Problem(key, value, "must be 0 or more (s)"))
        elif t > latest:
            said = f"is after the end of the shot, at max_time = {latest:g} s"
            self.problems.append(Problem(key, value, said))
        return t

    def _on_table(self, of: str, x: float, y: float) -> None:
        """Refuse a place far off the table, because its unit or a digit is wrong."""
        table = self.scene.table
        x0, y0, x1, y1 = table.bounds if table else (-math.inf, -math.inf, math.inf, math.inf)
        slack = 2.0 * max(ball.radius for ball in self.scene.balls)
        unit = self.scene.units.length if self.source else "m"
        for key, value, low, high in (("x", x, x0, x1), ("y", y, y0, y1)):
            if value < low - slack or value > high + slack:
                message = f"is off the table, {low / self.unit:g} to {high / self.unit:g} {unit}"
                self.problems.append(Problem(f"{of}{key}", value / self.unit, message))


def aimed_once(scene: Scene, numbers: Iterable[int], names: Names, law: str | Law | None) -> Scene:
    """Return the scene in which shots of these ``numbers`` keep the directions of their aims.

    A shot goes on aiming if neither the inputs ``names`` nor a shot before it move a ball.

    >>> from pool_pymunk import load
    >>> shot = aimed_once(load("report"), [4], ("x.1",), None).shots[3]
    >>> shot.aim, round(shot.angle, 3)
    (None, -178.298)
    """
    moved = any(TABLE[parts(name)[0]].group == "position" for name in names)
    shots = [scene.shots[k - 1] for k in numbers if scene.shots]
    aiming = [shot for shot in shots if shot.aim is not None and (moved or shot.from_previous)]
    aimed = {}
    for run in simulate_all(scene, aiming, solver=reference_solver().name, law=law):
        assert run.shot is not None
        vx, vy = run.knots[scene.index[run.shot.ball]][0, 3:5].tolist()
        aimed[run.shot] = replace(run.shot, aim=None, angle=math.degrees(math.atan2(vy, vx)))
    return replace(scene, shots=tuple(aimed.get(shot, shot) for shot in scene.shots))


class Forecast:
    """A forecast knows the scene, what is varied, and what was measured.

    For numbers ``values`` (P,) it gives the residuals (M, 2) in m, measured less predicted, and the
    derivatives (M, 2, P) of the predicted places. ``own`` (P,) are the scene's numbers, ``low`` and
    ``high`` their bounds, and ``sizes`` (P,) the changes that matter. Shots that aim at a ball are
    aimed once, in this scene, unless they ``aims_anew`` wherever these numbers have the ball.
    """

    def __init__(
        self, scene: Scene, names: Names, measured: Sequence[Measurement], law: str | Law | None,
        aims_anew: bool = False,
    ) -> None:  # fmt: skip
        self.names, self.measured, self.law, self.aims_anew = names, measured, law, aims_anew
        rows = [TABLE[parts(name)[0]] for name in names]
        self.own = np.array([input_value(scene, name) for name in names])
        self.low = np.array([row.low for row in rows])
        self.high = np.array([row.high for row in rows])
        self.sizes = np.array([_size(scene, name) for name in names])
        self.places = np.array([(one.x, one.y) for one in measured])
        self.shots = np.array([one.shot for one in measured])
        self.balls = np.array([scene.index[one.ball] for one in measured])
        self.times = np.array([math.inf if one.t is None else one.t for one in measured])
        chain = set(self.shots.tolist())
        for k in range(len(scene.shots), 1, -1):
            if k in chain and scene.shots[k - 1].from_previous:
                chain.add(k - 1)
        self.chain = sorted(chain)
        self.scene = scene if aims_anew else aimed_once(scene, self.chain, names, law)
        self._played = lru_cache(KEPT)(self._play)
        self._differentiated = lru_cache(KEPT)(self._differentiate)

    def scene_of(self, values: Sequence[float]) -> Scene:
        """Return the scene with these numbers; raise SceneError where there is none."""
        return with_inputs(self.scene, dict(zip(self.names, values, strict=True)))

    def runs(self, values: Array) -> Runs | None:
        """Play all shots that are needed; None if the scene is not valid, or a run has no end."""
        return self._played(tuple(values.tolist()))

    def _play(self, values: tuple[float, ...]) -> Runs | None:
        try:
            scene = self.scene_of(values)
            shots = [scene.shots[k - 1] if scene.shots else None for k in self.chain]
            played = list(simulate_all(scene, shots, solver=reference_solver().name, law=self.law))
        except SceneError:
            return None
        is_done = all(run.success for run in played)
        return dict(zip(self.chain, played, strict=True)) if is_done else None

    def residuals(self, values: Array) -> Array:
        """Return measured less predicted places (M, 2); infinite where nothing can be played."""
        runs = self.runs(values)
        if runs is None:
            return np.full_like(self.places, math.inf)
        found = self.places.copy()
        for k, run in runs.items():
            rows, balls, times = self.measured_in(k, run)
            found[rows] -= run.at(times)[0][np.arange(len(rows)), balls]
        return found

    def measured_in(self, shot: int, run: Run) -> tuple[NDArray[np.int_], NDArray[np.int_], Array]:
        """Return which rows are those of a shot, and of each its ball, and when (s) it was there.

        This is at the end of the run at the latest.
        """
        rows = np.flatnonzero(self.shots == shot)
        return rows, self.balls[rows], np.minimum(self.times[rows], run.duration)

    def derivatives(self, values: Array) -> tuple[Array, tuple[str, ...]]:
        """Return the derivatives (M, 2, P) of the predicted places, and what runs warn of."""
        return self._differentiated(tuple(values.tolist()))

    def _differentiate(self, values: tuple[float, ...]) -> tuple[Array, tuple[str, ...]]:
        runs = self._played(values)
        assert runs is not None, "these numbers could be played"
        found = np.zeros((len(self.measured), 2, len(self.names)))
        warnings: dict[str, None] = {}
        for k, known in follow(runs, self.names, self.aims_anew):
            run = known.run
            warnings |= dict.fromkeys(f"{run.name}: {warning}" for warning in known.warnings)
            rows, balls, times = self.measured_in(k, run)
            for i in set(balls.tolist()):
                found[rows[balls == i]] = known.changes.at(times[balls == i], i)
        return found, tuple(warnings)

    def jacobian(self, values: Array, used: Mask) -> Array:
        """Return the derivatives (2 U, P) of the ``used`` places; 0 where there is none."""
        found = self.derivatives(values)[0][used]
        return np.nan_to_num(found).reshape(2 * len(found), len(self.names))


def _size(scene: Scene, name: str) -> float:
    """Return how large a change of an input matters, which is its scale in a search."""
    kind, whose = parts(name)
    row = TABLE[kind]
    if kind == "friction.rolling":
        return 0.01
    if row.quantity == "":
        return 0.1
    if row.group == "position":
        return 0.1 * scene.balls[scene.index[whose]].radius
    return 1.0 if row.quantity == "angle" else max(0.1 * abs(input_value(scene, name)), 1e-3)
