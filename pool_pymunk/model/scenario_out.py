"""This module writes a :class:`~pool_pymunk.Scene` to a scenario file, which gives it back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from pool_pymunk.model.outline import Table
from pool_pymunk.model.problems import SMALLEST, key_of
from pool_pymunk.model.quantities import Units

if TYPE_CHECKING:
    from pool_pymunk.model.scene import Scene

NEIGHBOURS = 4  # floats on each side of value / unit that are tried, too

# A file has the keys of a part in this order; others follow.
ORDER = (
    "id", "name", "ball", "cue", "place", "position", "length", "radius", "mass", "velocity",
    "speed", "angle", "aim", "from", "published", "color",
)  # fmt: skip


class Inexact(ValueError):
    """No float in these units stands for the number exactly."""


def scenario_text(scene: Scene) -> str:
    """Write a scene in its own units, or in SI if its own units would lose digits."""
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
    lower = upper = units.from_si(value, kind)
    candidates = [lower]
    for _ in range(NEIGHBOURS):
        lower, upper = math.nextafter(lower, -math.inf), math.nextafter(upper, math.inf)
        candidates += [lower, upper]
    exact = [number for number in candidates if units.to_si(number, kind) == value]
    if not exact:
        raise Inexact
    return min(exact, key=lambda number: len(repr(number)))


Values = dict[str, Any]


def _text(scene: Scene, units: Units) -> str:
    """Write the file with all numbers in ``units``."""
    own = {} if units == scene.units else {"numbers": "SI"}
    sections: list[tuple[str, Values]] = [
        ("", {"title": scene.title} if scene.title else {}),
        ("[units]", _unusual(scene.units, units) | own),
        ("[table]", _table(scene.table, units)),
    ]
    for name in ("physics", "restitution", "friction"):
        sections.append((f"[{name}]", _said(getattr(scene, name), units)))
    for name in ("pockets", "posts", "patches", "balls", "shots"):
        sections += [(f"[[{name}]]", _unusual(part, units)) for part in getattr(scene, name)]
    return "\n".join(_section(head, values) for head, values in sections if values)


def _said(part: Any, units: Units) -> Values:
    """Return the fields of a part that are not None, in these units."""
    return {
        key: _in_units(getattr(part, key), its.unit, units)
        for key, its in part.KEYS.items()
        if getattr(part, key) is not None
    }


def _unusual(part: Any, units: Units) -> Values:
    """Return the fields of a part that differ from their defaults."""
    usual = [one.name for one in fields(part) if getattr(part, one.name) in (one.default, {})]
    said = {key: value for key, value in _said(part, units).items() if key not in usual}
    if said.pop("from_previous", False):
        said["from"] = "previous"
    return {key: said[key] for key in (*ORDER, *said) if key in said}


def _table(table: Table | None, units: Units) -> Values:
    if table is None:
        return {}
    corner = table.outline[2:3]
    said = _unusual(table, units)
    is_sound = bool(corner) and min(corner[0]) >= SMALLEST
    if is_sound and table == Table.rectangle(*corner[0], table.color, table.tilt):
        del said["outline"]
        sides = _in_units(corner[0], "length", units)
        return dict(zip(("length", "width"), sides, strict=True)) | said
    return said


def _in_units(value: Any, kind: str, units: Units) -> Any:
    """Return a number, a point or points in these units; a value without a ``kind`` is kept."""
    if not kind:
        return list(value) if isinstance(value, tuple) else value
    if isinstance(value, Mapping):
        return {key: _in_units(one, kind, units) for key, one in value.items()}
    if isinstance(value, tuple):
        return [_in_units(one, kind, units) for one in value]
    return in_units(value, kind, units)


# -- TOML ----------------------------------------------------------------------------------------


def _section(head: str, values: Values) -> str:
    lines = [f"{key} = {toml(value)}" for key, value in values.items()]
    return "\n".join([*([head] if head else []), *lines, ""])


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
