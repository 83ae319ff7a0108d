"""This module reads scenario files, TOML in units of their own, as Scenes in SI.

The parts of a scene say which keys there are, and what each may be (``model/plain.py``). All
problems of a file are reported at once, each in one line with the file, the key and its value.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from inspect import signature
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import LAUNCH, SECTIONS, Ball, Patch, Pocket, Post, Shot, beside
from pool_pymunk.model.plain import Key, Part, Unfit, argument, choice
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Location,
    Problem,
    SceneError,
    most_like,
    suggestion,
    written,
)
from pool_pymunk.model.quantities import Units
from pool_pymunk.model.racks import HEXAGON, rack
from pool_pymunk.model.racks import KEYS as RACK
from pool_pymunk.model.scene import Located, Scene, Sketch
from pool_pymunk.safety.files import bundled as bundled

Made = TypeVar("Made")
SomePart = TypeVar("SomePart", bound=Part)
Values = dict[str, Any]  # of a section, in SI
Entry = tuple[Location, Values]

DEFAULTS = ("radius", "mass", "color")  # the keys of [ball]
INHERIT = ("balls", "racks")  # They take from [ball] the keys that they leave out.

FROM, TITLE = Key(choice(("start", "previous"))), Scene.KEYS["title"]
# A file has lists of sections, and sections, each with its keys.
LISTS: Mapping[str, Mapping[str, Key]] = {
    "pockets": Pocket.KEYS,
    "posts": Post.KEYS,
    "patches": Patch.KEYS,
    "balls": Ball.KEYS,
    "racks": RACK,
    "shots": {  # A file says `from` for `from_previous`.
        name.removesuffix("_previous"): FROM if name == "from_previous" else key
        for name, key in Shot.KEYS.items()
    },
}
KEYS: Mapping[str, Mapping[str, Key]] = {
    "units": Units.KEYS | {"numbers": Key(choice(("units", "SI")))},
    "table": dict.fromkeys(("length", "width"), Pocket.KEYS["radius"]) | Table.KEYS,
    **{name: part.KEYS for name, part in SECTIONS.items()},
    "ball": {key: Ball.KEYS[key] for key in DEFAULTS},
    **LISTS,
}
SIZE = {"radius": 1.0, "mass": 1.0}  # m, kg; used for one that is missing or broken
# These keys of a rack give these keys of its balls; in a hexagon, center gives the position.
OF_RACKS = {"position": "apex", "id": "ids"}


def load(scenario: str | Path) -> Scene:
    """Read a scenario: a path, or the name of a bundled one.

    Raises :class:`~pool_pymunk.SceneError` with all problems of the file, or if it is unreadable.

    >>> scene = load("report")
    >>> len(scene.balls), scene.balls[0].radius, [shot.name for shot in scene.shots][0]
    (11, 0.05715, 'Simulation 1')
    """
    if not isinstance(scenario, str | PathLike) or str(scenario) == "":
        message = "must be the path of a file, or the name of a bundled scenario"
        raise SceneError([Problem("scenario", scenario, message)])
    source = str(scenario)
    known = bundled()
    path = known.get(str(scenario), Path(scenario))
    try:
        content = path.read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        byte = f"0x{error.object[error.start]:02x}"
        problem = Problem(f"byte {error.start + 1}", byte, "is not UTF-8 text")
        raise SceneError([problem], source) from None
    except (FileNotFoundError, ValueError):  # ValueError: a path that no file can have
        meant = suggestion(path.stem, known)
        message = f"there is no such file (bundled: {', '.join(known)}){meant}"
    except OSError as error:
        message = f"cannot be read: {error.strerror or error}"
    else:
        return loads(content, source)
    raise SceneError([Problem("scenario", source, message)])


def loads(text: str, source: str = "scenario") -> Scene:
    """Make a Scene of a scenario's text; ``source`` is what error messages call it."""
    text = argument("text", text, TITLE.read)
    try:
        raw = tomllib.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise SceneError([_toml_problem(text, source, error)], source) from None
    file = _File(raw)
    if (made := file.scene()) is not None:
        return made
    raise SceneError(file.problems, source)


def _toml_problem(text: str, source: str, error: Exception) -> Problem:
    """Say why a text could not be parsed, and show the line."""
    if isinstance(error, RecursionError):
        return Problem("file", source, "is nested too deeply")
    digits = re.search(r"\d[\d_]{4000}", text)
    if place := re.search(r" \(at line (\d+), column (\d+)\)$", str(error)):
        number = int(place[1])
        message = f"is not TOML: {str(error)[: place.start()]} (column {place[2]})"
    elif digits and not isinstance(error, tomllib.TOMLDecodeError):  # Python reads no such integers
        number = text.count("\n", 0, digits.start()) + 1
        message = "has a number with too many digits"
    else:
        return Problem("file", source, f"is not TOML: {error}")
    line = [*text.split("\n"), ""][number - 1].strip()
    return Problem(f"line {number}", line, message)


class _File:
    """A file makes a Scene part by part, and collects the problems of all parts.

    A wrong key is noted as ``broken``, and each section around it as ``touched``. A sound value
    replaces the wrong one. So the rest is checked, and mere consequences are not reported.
    """

    def __init__(self, raw: Values) -> None:
        self.raw = raw
        self.problems: list[Problem] = []
        self.broken: set[Location] = set()
        self.touched: set[Location] = set()
        self.nowhere: set[Location] = set()  # balls that are not sound enough to have a place
        self.written = Units()  # the units of the file's numbers
        as_it_is = Key(lambda value: value)
        self.content = self._read((), raw, {"title": TITLE} | dict.fromkeys(KEYS, as_it_is))
        units = self._section("units")
        is_si = units.pop("numbers", "units") == "SI"
        self.units = self._part("units", Units, units)
        self.written = Units() if is_si else self.units
        self.defaults = self._section("ball")
        self.entries = {name: self._entries(name) for name in LISTS}

    def scene(self) -> Scene | None:
        """Return the Scene, or None where there are problems."""
        sections: Values = {"table": self._table()}
        for name, part in SECTIONS.items():
            sections[name] = self._part(name, part, self._section(name))
        balls = [*self._balls(), *self._racked()]
        lists: Values = {"balls": balls}
        for name, kind in (("pockets", Pocket), ("posts", Post), ("patches", Patch)):
            lists[name] = [*self._sound(name, kind)]
        lists["shots"] = [*self._shots(balls)]
        sketch = Sketch(
            **lists,
            **sections,
            has_table="table" in self.content,
            nowhere=self.nowhere,
            knows_balls=self._knows_balls(),
            units=self.written,
        )
        self._note(sketch.problems())
        if self.problems:
            return None
        parts: Values = {name: tuple(part for _, part in each) for name, each in lists.items()}
        title = self.content.get("title", "")
        return Scene(**parts, **sections, title=title, units=self.units)

    # -- problems --------------------------------------------------------------------------------

    def _note(self, problems: Iterable[Problem]) -> None:
        """Keep the problems of what is not broken yet, with the values that the file has."""
        for problem in problems:
            where = problem.steps
            if where[0] == "racks":
                is_hexagon = _find(self.raw, (*where[:2], "shape")) == HEXAGON
                own = OF_RACKS | ({"position": "center"} if is_hexagon else {})
                where = (*where[:2], *(own.get(str(step), step) for step in where[2:]))
            if self._is_sound(where):
                value = _find(self.raw, where)
                value = problem.value if value is None else value
                self.problems.append(Problem(where, value, problem.message))
                self._break(where)

    def _missing(self, where: Location, message: str = "is missing") -> None:
        self._note([Problem(where, LEFT_OUT, message)])

    def _break(self, where: Location) -> None:
        self.broken.add(where)
        self.touched.update(where[:n] for n in range(1, len(where) + 1))

    def _is_sound(self, where: Location) -> bool:
        """Tell whether no problem is known of this key, of keys in it, or of sections around it."""
        return where not in self.touched and not any(
            where[:n] in self.broken for n in range(1, len(where))
        )

    # -- values ----------------------------------------------------------------------------------

    def _read(self, where: Location, raw: Any, keys: Mapping[str, Key]) -> Values:
        """Return the values of a section, without those that do not fit."""
        found: Values = {}
        if not isinstance(raw, dict):
            self._note([Problem(where, raw, "must be a table")])
            return found
        for name, value in raw.items():
            try:
                if name in keys:
                    read, unit, _ = keys[name]
                    in_si = (self.written.to_si(1.0, unit),) if unit else ()
                    found[name] = read(value, *in_si)
                else:
                    self._refuse(where, name, value, keys)
            except Unfit as unfit:
                self._note(unfit.problems((*where, name), value))
        return found

    def _refuse(self, where: Location, name: str, value: Any, known: Iterable[str]) -> None:
        """Refuse an unknown key. The known key most like it then does not count as missing."""
        message = f"unknown key (there are: {', '.join(known)}){suggestion(name, known)}"
        self.problems.append(Problem((*where, name), value, message))
        meant = (*where, most_like(name, known))
        if meant[-1] and _find(self.raw, meant) is None:
            self._break(meant)

    def _section(self, name: str) -> Values:
        return self._read((name,), self.content.get(name, {}), KEYS[name])

    def _entries(self, name: str) -> list[Entry]:
        """Return the values of the sections in a list; balls and racks also get those of [ball]."""
        raw = self.content.get(name, [])
        if not isinstance(raw, list):
            message = f"must be a list: write [[{name}]] above each of them"
            self._note([Problem((name,), raw, message)])
            return []
        found: list[Entry] = []
        for k, one in enumerate(raw):
            own = self._read((name, k), one, KEYS[name])
            for key, value in self.defaults.items() if name in INHERIT else ():
                if self._is_sound((name, k, key)):
                    own.setdefault(key, value)
            found.append(((name, k), own))
        return found

    # -- parts -----------------------------------------------------------------------------------

    def _part(self, name: str, kind: type[SomePart], values: Values) -> SomePart:
        """Return a section's object; sound values stand in for broken ones."""
        sound = {key: getattr(kind(), key) or 1.0 for key in kind.KEYS}
        broken = {key: sound[key] for key in sound if not self._is_sound((name, key))}
        return self._made((name,), kind, values | broken) or kind(**sound)

    def _made(self, where: Location, kind: Callable[..., Made], values: Values) -> Made | None:
        """Return a part, or None if something is wrong between its values."""
        try:
            return kind(**values)
        except SceneError as error:
            self._note(problem.under(*where) for problem in error.problems)
            return None

    def _is_complete(self, where: Location, kind: Callable[..., Any], values: Values) -> bool:
        """Tell whether all needed keys are there, and note those that are missing."""
        missing = [key for key in _needed(kind) if key not in values]
        for key in missing:
            inherits = where[0] in INHERIT and key in DEFAULTS
            if not inherits or self._is_sound(("ball", key)):
                self._missing((*where, key), "is missing" + ", here or in [ball]" * inherits)
        return not missing

    def _table(self) -> Table | None:
        if "table" not in self.content:
            return None
        values = self._section("table")
        sides = {key: values.pop(key, None) for key in ("length", "width")}
        if "outline" in values:
            self._note(problem.under("table") for problem in beside("outline", **sides))
            is_known = self._is_sound(("table", "bulge"))
            return self._made(("table",), Table, values) if is_known else None
        if not self._is_sound(("table", "outline")):
            return None
        if "bulge" in values:
            message = "needs an outline, whose sides it bends"
            self._note([Problem(("table", "bulge"), values["bulge"], message)])
            return None
        for key, side in sides.items():
            if side is None:
                self._missing(("table", key), "is missing (or an outline)")
        has_sides = None not in sides.values()
        return self._made(("table",), Table.rectangle, sides | values) if has_sides else None

    def _balls(self) -> Iterator[tuple[Location, Ball]]:
        """Yield the balls of the list; what is missing or broken is replaced by sound values."""
        for where, own in self.entries["balls"]:
            self._is_complete(where, Ball, own)
            if not {"id", "position", "radius"} <= own.keys():
                self.nowhere.add(where)
            stand_in: Values = {"id": written(where), "position": (0.0, 0.0), **SIZE}
            yield where, Ball(**stand_in | own)

    def _racked(self) -> Iterator[tuple[Location, Ball]]:
        """Yield the balls of sound racks."""
        for where, own in self.entries["racks"]:
            if not {"rows", "shape"} & own.keys() and self._is_sound((*where, "shape")):
                self._missing((*where, "rows"), "is missing (or a shape)")
            is_whole = self._is_complete(where, rack, own)
            if all(self._is_sound((*where, key)) for key in ("rows", "rings", "shape")):
                balls = self._made(where, rack, SIZE | own)
                if is_whole and balls and self._is_sound(where):
                    yield from ((where, ball) for ball in balls)

    def _sound(self, name: str, kind: type[SomePart]) -> Iterator[tuple[Location, SomePart]]:
        """Yield sound pockets, posts or patches; a pocket without an id gets its number, from 1."""
        for k, (where, own) in enumerate(self.entries[name], start=1):
            values: Values = {"id": str(k)} | own if kind is Pocket else own
            is_known = kind is not Patch or self._is_sound(where)
            if is_known and self._is_complete(where, kind, values):
                made = self._made(where, kind, values)
                if made is not None:
                    yield where, made

    def _shots(self, balls: Located[Ball]) -> Iterator[tuple[Location, Shot]]:
        """Yield the shots; what is missing or broken is replaced by sound values."""
        struck = next((ball.id for _, ball in balls if ball.cue), "")
        for k, (where, own) in enumerate(self.entries["shots"], start=1):
            name = f"Shot {k}" if self._is_sound((*where, "name")) else written(where)
            raw = _find(self.raw, (*where, "published"))
            ends = dict.fromkeys(raw if isinstance(raw, dict) else (), (0.0, 0.0))  # stand in
            values: Values = {"name": name, "ball": struck, "published": ends} | own
            if not values["ball"] and "ball" not in own and balls and self._knows_balls():
                self._missing((*where, "ball"), "is missing (there is no cue ball)")
            values["from_previous"] = values.pop("from", "start") == "previous"
            is_launched = all(self._is_sound((*where, key)) for key in LAUNCH)
            made = self._made(where, Shot, values) if is_launched else None
            rest = {key: value for key, value in values.items() if key not in LAUNCH}
            aim = own.get("aim")
            start = {"speed": 0.0, "aim": aim} if aim else {"velocity": (0.0, 0.0)}
            yield where, made or Shot(**rest, **start)

    def _knows_balls(self) -> bool:
        """Tell whether all ids and the cue ball are known, so that any other id is a mistake."""
        balls = self.entries["balls"]
        return (
            ("balls",) not in self.broken
            and self._is_sound(("racks",))
            and all("id" in own and self._is_sound((*where, "cue")) for where, own in balls)
        )


@cache
def _needed(kind: Callable[..., Any]) -> tuple[str, ...]:
    """Return the names of the arguments without a default."""
    arguments = signature(kind).parameters.values()
    return tuple(one.name for one in arguments if one.default is one.empty)


def _find(raw: Any, where: Location) -> Any:
    """Return what stands at a location in the raw file, or None."""
    for step in where:
        try:
            raw = raw[step]
        except (KeyError, IndexError, TypeError):
            return None
    return raw
