"""This module describes scenario files as JSON schema, by which editors complete and check them."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from pydantic import TypeAdapter

from pool_pymunk.model.plain import Key
from pool_pymunk.model.quantities import UNITS
from pool_pymunk.model.scenario import LISTS, MISSING, PARTS, TOP, Section

Schema = dict[str, Any]


def scenario_schema() -> Schema:
    """Return the JSON schema of scenario files.

    >>> scenario_schema()["properties"]["friction"]["properties"]["surface"]["minimum"]
    0
    """
    found = {"title": _value(TOP["title"])}
    found |= {name: _section(name, section) for name, section in PARTS.items()}
    draft = "https://json-schema.org/draft/2020-12/schema"  # what pydantic writes
    return {"$schema": draft, "title": "A scenario of pool-pymunk", **_object(found)}


def _section(name: str, section: Section) -> Schema:
    """Describe a section, or a list of them."""
    needed = [key for key, said in section.needed.items() if said == MISSING]
    inside = _object({key: _value(its) for key, its in section.keys.items()}, needed)
    outside = {"type": "array", "items": inside} if name in LISTS else inside
    return {"description": section.about, **outside}


def _value(key: Key) -> Schema:
    """Describe a value by its type; a file has its number in a unit of [units]."""
    unit = f" In the file's unit of {key.unit}." if key.unit in UNITS else ""
    return {
        "description": key.about + unit,
        **TypeAdapter(key.type).json_schema(),
        **dict(key.limits),
    }


def _object(keys: dict[str, Schema], needed: Collection[str] = ()) -> Schema:
    required = {"required": [*needed]} if needed else {}
    return {"type": "object", "properties": keys, **required, "additionalProperties": False}
