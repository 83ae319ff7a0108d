"""This module writes a scenario file of a :class:`~pool_pymunk.Scene`; read, it gives it again."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import Ball, Pocket, Shot
from pool_pymunk.model.problems import SMALLEST, Point, key_of
from pool_pymunk.model.units import Units
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    from pool_pymunk.model.scene import Scene

NEIGHBOURS = 4  # floats to each side of a quotient, one of which may give the number back


class Inexact(ValueError):
    """No float in these units stands for the number exactly."""


def write(scene: Scene, path: str | Path) -> None:
    """Write the scenario file of a scene; whole, or not at all."""
    with whole(Path(path)) as part:
        part.write_text(scenario_text(scene), encoding="utf-8", newline="\n")


def scenario_text(scene: Scene) -> str:
    """Write a scene in its own units, or in SI where digits would be lost in these."""
    try:
        return _text(scene, scene.units)
    except Inexact:
        return _text(scene, Units())


def in_units(value: float, kind: str, units: Units) -> float:
    """Find the shortest number in these units that stands for ``value`` (SI) exactly.

    Raises :class:`Inexact` where there is none.

    >>> in_units(26.5 * 0.0254, "length", Units(length="in"))
    26.5
    """
    near = units.from_si(value, kind)
    candidates = [near]
    for end in (-math.inf, math.inf):
        there = near
        for _ in range(NEIGHBOURS):
            there = math.nextafter(there, end)
            candidates.append(there)
    exact = [number for number in candidates if units.to_si(number, kind) == value]
    if not exact:
        raise Inexact
    return min(exact, key=lambda number: len(repr(number)))


def _text(scene: Scene, units: Units) -> str:
    """Write the file with all numbers in ``units``."""
    parts = _Parts(units)
    sections = [
        ("", {"title": scene.title} if scene.title else {}),
        ("[units]", _units(scene.units, units)),
        ("[table]", parts.table(scene.table)),
        ("[physics]", _said(scene.physics)),
        ("[restitution]", _said(scene.restitution)),
        ("[friction]", _said(scene.friction)),
        *(("[[pockets]]", parts.pocket(pocket)) for pocket in scene.pockets),
        *(("[[balls]]", parts.ball(ball)) for ball in scene.balls),
        *(("[[shots]]", parts.shot(shot)) for shot in scene.shots),
    ]
    return "\n".join(_section(head, values) for head, values in sections if values)


Values = Mapping[str, object]


class _Parts:
    """This class writes the parts of a scene as a file has them, in its units."""

    def __init__(self, units: Units) -> None:
        self.units = units

    def table(self, table: Table | None) -> Values:
        if table is None:
            return {}
        corner = table.outline[2:3]
        if corner and min(corner[0]) >= SMALLEST and table == Table.rectangle(*corner[0]):
            length, width = self._point(corner[0])
            return {"length": length, "width": width}
        return {"outline": [self._point(corner) for corner in table.outline]}

    def pocket(self, pocket: Pocket) -> Values:
        return {
            "id": pocket.id,
            "position": self._point(pocket.position),
            "radius": in_units(pocket.radius, "length", self.units),
        }

    def ball(self, ball: Ball) -> Values:
        return {
            "id": ball.id,
            **({"cue": True} if ball.cue else {}),
            "position": self._point(ball.position),
            "radius": in_units(ball.radius, "length", self.units),
            "mass": in_units(ball.mass, "mass", self.units),
            **({"velocity": self._point(ball.velocity, "speed")} if any(ball.velocity) else {}),
            **({} if ball.color is None else {"color": ball.color}),
        }

    def shot(self, shot: Shot) -> Values:
        speed, velocity = shot.speed, shot.velocity
        start = {
            "velocity": None if velocity is None else self._point(velocity, "speed"),
            "speed": None if speed is None else in_units(speed, "speed", self.units),
            "angle": shot.angle,
            "aim": shot.aim,
            "from": "previous" if shot.from_previous else None,
        }
        ends = {id_: self._point(end) for id_, end in shot.published.items()}
        said = {key: value for key, value in start.items() if value is not None}
        return {
            "name": shot.name,
            "ball": shot.ball,
            **said,
            **({"published": ends} if ends else {}),
        }

    def _point(self, point: Point, kind: str = "length") -> list[float]:
        return [in_units(value, kind, self.units) for value in point]


def _units(units: Units, written: Units) -> Values:
    """Return the units that differ from SI, and whether the file's numbers are in them."""
    said = {key: name for key, name in _said(units).items() if name != getattr(Units(), key)}
    return said if units == written else {**said, "numbers": "SI"}


def _said(part: object) -> dict[str, object]:
    """Return the fields of a part that are not None."""
    names: Iterable[str] = part.__slots__  # type: ignore[attr-defined]
    return {key: value for key in names if (value := getattr(part, key)) is not None}


# -- TOML ----------------------------------------------------------------------------------------


def _section(head: str, values: Values) -> str:
    return "\n".join([*([head] if head else []), *_lines(values), ""])


def _lines(values: Values) -> Iterator[str]:
    for key, value in values.items():
        yield f"{key} = {toml(value)}"


def toml(value: object) -> str:
    """Write a value as TOML has it.

    >>> toml({"8": [0.5, 1e-05], "ball 9": True})
    '{ 8 = [0.5, 1e-05], "ball 9" = true }'
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        pairs = (f"{key_of(key)} = {toml(one)}" for key, one in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return repr(value)
