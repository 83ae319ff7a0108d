"""The JSON schema of scenario files says what their reader takes, in words for editors."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from pool_pymunk import SceneError, loads
from pool_pymunk.model.scenario import bundled
from pool_pymunk.model.schema import scenario_schema
from tests import DATA, ROOT
from tests.shared.commands import Capture, exit_code
from tests.shared.texts import HEXAGON, changed

DOCS = ROOT / "docs"
SCHEMA = json.loads(json.dumps(scenario_schema()))
SECTIONS = {name: each for name, each in SCHEMA["properties"].items() if name != "title"}
TYPES = {
    "array": list, "boolean": bool, "integer": int, "number": int | float, "object": dict,
    "string": str,
}  # fmt: skip


def inside(section: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a section, or of each section of a list."""
    found: dict[str, Any] = section.get("items", section)
    return found


def unfit(value: Any, schema: dict[str, Any], where: str = "") -> Iterator[str]:
    """Yield the places where a value is not as the schema says."""
    if "anyOf" in schema:
        if all([*unfit(value, each)] for each in schema["anyOf"]):
            yield where
        return
    is_other = isinstance(value, bool) and schema["type"] != "boolean"
    if is_other or not isinstance(value, TYPES[schema["type"]]):
        yield where
    elif isinstance(value, dict):
        keys = schema.get("properties", {})
        yield from (f"{where}.{key}" for key in schema.get("required", ()) if key not in value)
        for key, one in value.items():
            its = keys.get(key, schema["additionalProperties"])
            yield from unfit(one, its, f"{where}.{key}") if its else [f"{where}.{key}"]
    elif isinstance(value, list):
        count, one = len(value), schema.get("items") or schema["prefixItems"][0]
        if not schema.get("minItems", 0) <= count <= schema.get("maxItems", count):
            yield where
        for k, each in enumerate(value):
            yield from unfit(each, one, f"{where}[{k}]")
    elif isinstance(value, str):
        if value not in schema.get("enum", [value]) or not re.search(
            schema.get("pattern", ""), value
        ):
            yield where
    elif not schema.get("minimum", value) <= value <= schema.get("maximum", value):
        yield where


def sound_files() -> list[str]:
    docs = (DOCS / "scenario-files.md").read_text("utf-8")
    commented = docs.partition("```toml\n")[2].partition("```")[0]
    files = [*bundled().values(), *(DATA / "scenarios").glob("[e-g]*.toml")]
    return [commented, HEXAGON, *(path.read_text("utf-8") for path in files)]


@pytest.mark.parametrize("text", sound_files())
def test_a_sound_file_is_as_the_schema_says(text: str) -> None:
    assert loads(text)
    assert not [*unfit(tomllib.loads(text), SCHEMA)]


@pytest.mark.parametrize(
    ("change", "where"),
    [
        (("mass = 160", 'mass = "160"'), ".ball.mass"),
        (("mass = 160", "mass = 0"), ".ball.mass"),
        (("cue = true", "cue = 1"), ".balls[0].cue"),
        (("cushion = 0.7", "cushion = 1.2"), ".restitution.cushion"),
        (('id = "1"', 'id = "1"\ncolor = "red"'), ".balls[1].color"),
        (('id = "1"', "idd = 3"), ".balls[1].id"),
        (("[40, 21]", "[40, 21, 0]"), ".balls[1].position"),
        (("[40, 21]", '[40, "x"]'), ".balls[1].position[1]"),
        (('"in"', '"ft"'), ".units.length"),
        (("[[shots]]", "[shots]"), ".shots"),
    ],
)
def test_a_mistake_of_one_key_is_one_by_the_schema(change: tuple[str, str], where: str) -> None:
    text = changed(change)
    with pytest.raises(SceneError):
        loads(text)
    assert where in [*unfit(tomllib.loads(text), SCHEMA)]


@pytest.mark.parametrize("name", SECTIONS)
def test_the_keys_of_the_schema_are_those_that_files_take(name: str) -> None:
    text = f"[[{name}]]\nx = 1\n" if "items" in SECTIONS[name] else f"[{name}]\nx = 1\n"
    with pytest.raises(SceneError) as refused:
        loads(text)
    unknown = next(line for line in str(refused.value).splitlines() if f"{name}" in line)
    (known,) = re.findall(r"\(there are: (.*?)\)", unknown)
    assert known.split(", ") == [*inside(SECTIONS[name])["properties"]]


def test_every_key_is_described_in_a_sentence() -> None:
    keys = [key for section in SECTIONS.values() for key in inside(section)["properties"].items()]
    assert len(keys) > 60
    for key, schema in [*SCHEMA["properties"].items(), *keys]:
        assert re.fullmatch(r"[^ ].+\.", schema["description"]), key


@pytest.mark.parametrize("more", [(), ("report",)])
def test_the_command_writes_the_schema_and_nothing_else(
    more: tuple[str, ...], capsys: Capture
) -> None:
    assert exit_code("check", "--schema", *more) == 0
    said = capsys.readouterr()
    assert json.loads(said.out) == SCHEMA and said.err == ""
