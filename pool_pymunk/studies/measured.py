"""This module reads where balls were measured: a CSV file, a scenario's published ends, or rows."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from pool_pymunk.model import Scene
from pool_pymunk.model.plain import Unfit, is_row, number, text
from pool_pymunk.model.problems import LEFT_OUT, Problem, SceneError, listed, suggestion

PUBLISHED = "published"
NEEDED = ("shot", "ball", "x", "y")
COLUMNS = (*NEEDED, "t")
MOST_PROBLEMS = 50  # of one file


class Measurement(NamedTuple):
    """A measurement says where the centre of a ball was (m).

    ``t`` (s) is the time since the start of the shot; None is the end of it. ``shot`` is the
    shot's number from 1; it is 1 as well for a scene without shots.
    """

    shot: int
    ball: str
    x: float
    y: float
    t: float | None = None


def read_measured(measured: object, scene: Scene) -> tuple[Measurement, ...]:
    """Return measurements from a CSV file, from "published" ends, or from rows.

    A file has the columns shot, ball, x, y and optionally t (s); lengths are in the scenario's
    unit. Shots go by number from 1, or by name. Rows of Python are in SI: (shot, ball, x, y) or
    (shot, ball, x, y, t). Raises SceneError with all that is wrong, one line a problem.

    >>> from pool_pymunk import load
    >>> read_measured([("Simulation 2", "C", 0.06, 0.63)], load("report"))
    (Measurement(shot=2, ball='C', x=0.06, y=0.63, t=None),)
    >>> len(read_measured("published", load("report")))
    44
    """
    if isinstance(measured, str) and measured == PUBLISHED:
        return _published(scene)
    if isinstance(measured, str | Path):
        return _from_file(Path(measured), scene)
    if not isinstance(measured, Iterable) or isinstance(measured, Mapping):
        message = 'must be a CSV file, "published", or rows (shot, ball, x, y[, t])'
        raise SceneError([Problem("measured", measured, message)])
    return _Reader(scene).read(_rows(measured))


def _published(scene: Scene) -> tuple[Measurement, ...]:
    found = tuple(
        Measurement(k, id_, *end)
        for k, shot in enumerate(scene.shots, start=1)
        for id_, end in shot.published.items()
    )
    if not found:
        message = "the scenario has no published ends: a CSV file is needed"
        raise SceneError([Problem("measured", PUBLISHED, message)])
    return found


Row = tuple[str, Mapping[str, Any]]  # where it stands, and its cells


def _rows(measured: Iterable[Any]) -> Iterator[Row]:
    for k, one in enumerate(measured):
        where = f"measured[{k}]"
        if not is_row(one) or not 4 <= len(one) <= 5:
            raise SceneError([Problem(where, one, "must be (shot, ball, x, y) or with t behind")])
        yield where, dict(zip(COLUMNS, one, strict=False))


def _from_file(path: Path, scene: Scene) -> tuple[Measurement, ...]:
    source = str(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        message = f"must be text in UTF-8 (byte {error.start} is not)"
        raise SceneError([Problem("measured", source, message)]) from None
    table = csv.DictReader(lines, restkey="more", skipinitialspace=True)
    header = [name.strip() for name in table.fieldnames or ()]
    problems = [*_header_problems(header)]
    if problems:
        raise SceneError(problems, source)
    table.fieldnames = header
    rows = ((f"line {table.line_num}, ", row) for row in table)
    unit = scene.units.to_si(1.0, "length")
    return _Reader(scene, source, unit).read(rows)


def _header_problems(header: list[str]) -> Iterator[Problem]:
    if not header:
        yield Problem("line 1", LEFT_OUT, f"must name the columns: {', '.join(COLUMNS)}")
        return
    for name in NEEDED:
        if name not in header:
            yield Problem("line 1", header, f"has no column {name}")
    for name in header:
        if name not in COLUMNS:
            known = f"there is no such column ({', '.join(COLUMNS)}){suggestion(name, COLUMNS)}"
            yield Problem("line 1", name, known)


class _Reader:
    """A reader turns cells into measurements, and gathers what is wrong with them."""

    def __init__(self, scene: Scene, source: str = "", unit: float = 1.0) -> None:
        self.scene, self.source, self.unit = scene, source, unit
        self.problems: list[Problem] = []
        numbers = {str(k): k for k in range(1, len(scene.shots) + 1)} or {"": 1, "1": 1}
        self.shots = {shot.name: k for k, shot in enumerate(scene.shots, start=1)} | numbers

    def read(self, rows: Iterable[Row]) -> tuple[Measurement, ...]:
        found = []
        for where, row in rows:
            if len(self.problems) >= MOST_PROBLEMS:
                break
            one = self._one(where, row)
            if one is not None:
                found.append(one)
        if not found and not self.problems:
            self.problems.append(Problem("measured", LEFT_OUT, "one measurement or more is needed"))
        if self.problems:
            raise SceneError(list(islice(self.problems, MOST_PROBLEMS)), self.source)
        return tuple(found)

    def _one(self, where: str, row: Mapping[str, Any]) -> Measurement | None:
        before = len(self.problems)
        of = where if where.endswith(" ") else f"{where}."
        if "more" in row:
            self.problems.append(Problem(f"{of}columns", row["more"], "there are too many"))
        shot = self._name(f"{of}shot", row.get("shot"), self.shots)
        ball = self._name(f"{of}ball", row.get("ball"), self.scene.index)
        x, y = (self._number(f"{of}{key}", row.get(key)) * self.unit for key in ("x", "y"))
        t = self._time(f"{of}t", row.get("t"))
        self._on_table(of, x, y)
        if len(self.problems) > before or shot is None or ball is None:
            return None
        return Measurement(self.shots[shot], ball, x, y, t)

    def _name(self, key: str, value: Any, known: Mapping[str, object]) -> str | None:
        """Return a name that is known."""
        written = "" if value is None else str(value).strip()
        if written in known:
            return text(written)
        message = f"there is no such {key.rpartition('.')[2].rpartition(' ')[2]}"
        every = f" (there are: {listed([name for name in known if name]) or 'none'})"
        self.problems.append(Problem(key, written or LEFT_OUT, message + every))
        return None

    def _number(self, key: str, value: Any) -> float:
        try:
            found = float(value) if isinstance(value, str) else number(value)
        except (ValueError, Unfit):
            found = math.nan
        if not math.isfinite(found):
            shown = LEFT_OUT if value in (None, "") else value
            self.problems.append(Problem(key, shown, "must be a finite number"))
        return found

    def _time(self, key: str, value: Any) -> float | None:
        if value is None or (isinstance(value, str) and not value.strip()):
            return None
        t = self._number(key, value)
        latest = self.scene.physics.max_time
        if t < 0.0:
            self.problems.append(Problem(key, value, "must be 0 or more (s)"))
        elif latest is not None and t > latest:
            message = f"is after the end of the shot, at max_time = {latest:g} s"
            self.problems.append(Problem(key, value, message))
        return t

    def _on_table(self, of: str, x: float, y: float) -> None:
        """Refuse what is far off the table: the unit, or a digit, is wrong."""
        if self.scene.table is None:
            return
        x0, y0, x1, y1 = self.scene.table.bounds
        slack = 2.0 * max(ball.radius for ball in self.scene.balls)
        unit = self.scene.units.length if self.unit != 1.0 or self.source else "m"
        for key, value, low, high in (("x", x, x0, x1), ("y", y, y0, y1)):
            if math.isfinite(value) and not low - slack <= value <= high + slack:
                message = f"is off the table, {low / self.unit:g} to {high / self.unit:g} {unit}"
                self.problems.append(Problem(f"{of}{key}", value / self.unit, message))
