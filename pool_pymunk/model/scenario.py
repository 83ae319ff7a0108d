"""Scenario files: TOML in the file's units -> a :class:`~pool_pymunk.model.scene.Scene` in SI.

Which keys there are, and what each may be, is said by the parts of a scene (``model/keys.py``). All
problems of a file are reported at once, each in one line with the file, the key and the value as it
is written there.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from inspect import signature
from pathlib import Path
from typing import Any, TypeVar

from pool_pymunk.model.keys import Key, Part
from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import (
    LAUNCH,
    Ball,
    Friction,
    Physics,
    Pocket,
    Post,
    Restitution,
    Shot,
    beside,
)
from pool_pymunk.model.plain import Unfit, choice, text
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Location,
    Problem,
    SceneError,
    most_like,
    suggestion,
    written,
)
from pool_pymunk.model.racks import HEXAGON, rack
from pool_pymunk.model.racks import KEYS as RACK
from pool_pymunk.model.scene import Located, Scene, scene_problems
from pool_pymunk.model.units import Units
from pool_pymunk.safety.files import bundled as bundled

Made = TypeVar("Made")
SomePart = TypeVar("SomePart", bound=Part)
Values = dict[str, Any]  # of a section, in SI
Entry = tuple[Location, Values]

FILE_NAMES = {"from_previous": "from"}
DEFAULTS = ("radius", "mass", "color")  # [ball] has them for balls and racks that leave them out

PARTS: dict[str, type[Part]] = {
    "physics": Physics,
    "restitution": Restitution,
    "friction": Friction,
}
# What stands in a file: sections, and lists of sections, each with its keys.
KEYS: Mapping[str, Mapping[str, Key]] = {
    "units": Units.KEYS | {"numbers": Key(choice(("units", "SI")))},
    "table": dict.fromkeys(("length", "width"), Pocket.KEYS["radius"]) | Table.KEYS,
    **{name: part.KEYS for name, part in PARTS.items()},
    "ball": {key: Ball.KEYS[key] for key in DEFAULTS},
    "pockets": Pocket.KEYS,
    "posts": Post.KEYS,
    "balls": Ball.KEYS,
    "racks": RACK,
    "shots": {FILE_NAMES.get(name, name): key for name, key in Shot.KEYS.items()}
    | {"from": Key(choice(("start", "previous")))},
}
LISTS = ("pockets", "posts", "balls", "racks", "shots")
SIZE = {"radius": 1.0, "mass": 1.0}  # stands in for one that is missing or broken
# What a rack has for these keys of its balls; a hexagon has its center for the position.
OF_RACKS = {"position": "apex", "id": "ids"}


def load(scenario: str | Path) -> Scene:
    """Read a scenario: a path, or the name of a bundled one.

    Raises :class:`~pool_pymunk.SceneError` with every problem of the file, or that it
    cannot be read.

    >>> scene = load("report")
    >>> len(scene.balls), scene.balls[0].radius, [shot.name for shot in scene.shots][0]
    (11, 0.05715, 'Simulation 1')
    """
    source = label(scenario)
    data = _bytes(bundled().get(str(scenario), Path(scenario)), source)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        byte = f"0x{data[error.start]:02x}"
        problem = Problem(f"byte {error.start + 1}", byte, "is not UTF-8 text")
        raise SceneError([problem], source) from None
    return loads(text, source)


def _bytes(path: Path, source: str) -> bytes:
    try:
        return path.read_bytes()
    except (FileNotFoundError, ValueError):  # ValueError: a path that no file can have
        known = bundled()
        meant = suggestion(path.stem, known)
        message = f"there is no such file (bundled: {', '.join(known)}){meant}"
    except OSError as error:
        message = f"cannot be read: {error.strerror or error}"
    raise SceneError([Problem("scenario", source, message)])


def label(scenario: str | Path) -> str:
    """Return the name of a scenario in output: its path as given, or where a bundled one is."""
    return f"scenarios/{scenario}.toml" if str(scenario) in bundled() else str(scenario)


def loads(text: str, source: str = "scenario") -> Scene:
    """Make a Scene of a scenario's text; ``source`` is what error messages call it."""
    try:
        raw = tomllib.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise SceneError([_toml_problem(text, source, error)], source) from None
    file = _File(raw)
    made = file.scene()
    if made is None:
        raise SceneError(file.problems, source)
    return made


def _toml_problem(text: str, source: str, error: Exception) -> Problem:
    """Why a text could not be parsed, with the line that it could not be parsed at."""
    if isinstance(error, RecursionError):
        return Problem("file", source, "is nested too deeply")
    place = re.search(r" \(at line (\d+), column (\d+)\)$", str(error))
    if place:
        message = f"{str(error)[: place.start()]} (column {place[2]})"
        return _line_problem(text, int(place[1]), f"is not TOML: {message}")
    digits = re.search(r"\d[\d_]{4000}", text)
    if digits and not isinstance(error, tomllib.TOMLDecodeError):  # Python reads no such integers
        number = text.count("\n", 0, digits.start()) + 1
        return _line_problem(text, number, "has a number with too many digits")
    return Problem("file", source, f"is not TOML: {error}")


def _line_problem(text: str, number: int, message: str) -> Problem:
    lines = text.split("\n")
    line = lines[number - 1].strip() if number <= len(lines) else ""
    return Problem(f"line {number}", line, message)


class _File:
    """Makes a Scene of a raw file part by part, and collects the problems of all parts.

    What is wrong is noted as ``broken``, and all that it stands in as ``touched``. It is left out
    or stood in for, so that the rest is checked all the same and nothing is said of what only
    follows from it.
    """

    def __init__(self, raw: Values) -> None:
        self.raw = raw
        self.problems: list[Problem] = []
        self.broken: set[Location] = set()
        self.touched: set[Location] = set()
        self.nowhere: set[Location] = set()  # balls that are not sound enough to have a place
        self.written = Units()  # the units of the file's numbers
        as_it_is = Key(lambda value: value)
        self.content = self._read((), raw, {"title": Key(text)} | dict.fromkeys(KEYS, as_it_is))
        units = self._section("units")
        numbers = units.pop("numbers", "units")
        self.units = self._part("units", Units, units)
        if numbers == "units":
            self.written = self.units
        self.defaults = self._section("ball")
        self.entries = {name: self._entries(name) for name in LISTS}

    def scene(self) -> Scene | None:
        """Return the Scene, or None where there are problems."""
        sections: Values = {
            "table": self._table(),
            **{name: self._part(name, kind, self._section(name)) for name, kind in PARTS.items()},
        }
        balls = [*self._balls(), *self._racked()]
        lists: Values = {
            "balls": balls, "pockets": [*self._pockets()], "posts": [*self._posts()],
            "shots": [*self._shots(balls)],
        }  # fmt: skip
        self._note(
            scene_problems(
                **lists,
                **sections,
                has_table="table" in self.content,
                nowhere=self.nowhere,
                knows_balls=self._knows_balls(),
                units=self.written,
            )
        )
        if self.problems:
            return None
        parts: Values = {name: tuple(part for _, part in each) for name, each in lists.items()}
        title = self.content.get("title", "")
        return Scene(**parts, **sections, title=title, units=self.units)

    # -- problems --------------------------------------------------------------------------------

    def _note(self, problems: Iterable[Problem]) -> None:
        """Keep problems, less those of what is broken already, with values as the file has them."""
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
        """Tell whether nothing is known to be wrong with this, in it, or with what it stands in."""
        return where not in self.touched and not any(
            where[:n] in self.broken for n in range(1, len(where))
        )

    # -- values ----------------------------------------------------------------------------------

    def _read(self, where: Location, raw: Any, keys: Mapping[str, Key]) -> Values:
        """Return the values of a section, less those that do not fit."""
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
        """Refuse an unknown key. It is taken for the one that is most like it: so that is there."""
        message = f"unknown key (there are: {', '.join(known)}){suggestion(name, known)}"
        self.problems.append(Problem((*where, name), value, message))
        meant = (*where, most_like(name, known))
        if meant[-1] and _find(self.raw, meant) is None:
            self._break(meant)

    def _section(self, name: str) -> Values:
        return self._read((name,), self.content.get(name, {}), KEYS[name])

    def _entries(self, name: str) -> list[Entry]:
        """Return the values of the sections in a list; for balls and racks with [ball]."""
        raw = self.content.get(name, [])
        if not isinstance(raw, list):
            message = f"must be a list: write [[{name}]] above each of them"
            self._note([Problem((name,), raw, message)])
            return []
        found: list[Entry] = [
            ((name, k), self._read((name, k), one, KEYS[name])) for k, one in enumerate(raw)
        ]
        if name in ("balls", "racks"):
            for where, own in found:
                for key, value in self.defaults.items():
                    if self._is_sound((*where, key)):
                        own.setdefault(key, value)
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
        """Tell whether all is there that must be, and say what is not."""
        missing = [key for key in _needed(kind) if key not in values]
        for key in missing:
            inherits = where[0] in ("balls", "racks") and key in DEFAULTS
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
        """Yield the balls of the list; where one is unsound, one that stands in for it."""
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

    def _pockets(self) -> Iterator[tuple[Location, Pocket]]:
        """Yield the sound pockets; one without an id is called by its number, from 1."""
        for k, (where, own) in enumerate(self.entries["pockets"], start=1):
            values: Values = {"id": str(k)} | own
            if self._is_complete(where, Pocket, values):
                yield where, Pocket(**values)

    def _posts(self) -> Iterator[tuple[Location, Post]]:
        """Yield the sound posts."""
        for where, own in self.entries["posts"]:
            if self._is_complete(where, Post, own):
                yield where, Post(**own)

    def _shots(self, balls: Located[Ball]) -> Iterator[tuple[Location, Shot]]:
        """Yield the shots; where one is unsound, one that stands in for it."""
        struck = next((ball.id for _, ball in balls if ball.cue), "")
        for k, (where, own) in enumerate(self.entries["shots"], start=1):
            name = f"Shot {k}" if self._is_sound((*where, "name")) else written(where)
            values: Values = {"name": name, "ball": struck, "published": self._ends(where)} | own
            if not values["ball"] and "ball" not in own and balls and self._knows_balls():
                self._missing((*where, "ball"), "is missing where there is no cue ball")
            values["from_previous"] = values.pop("from", "start") == "previous"
            is_launched = all(self._is_sound((*where, key)) for key in LAUNCH)
            made = self._made(where, Shot, values) if is_launched else None
            rest = {key: value for key, value in values.items() if key not in LAUNCH}
            aim = own.get("aim")
            start = {"speed": 0.0, "aim": aim} if aim else {"velocity": (0.0, 0.0)}
            yield where, made or Shot(**rest, **start)

    def _ends(self, where: Location) -> Values:
        """Return published ends with the file's ids, which stand in for ends that do not fit."""
        raw = _find(self.raw, (*where, "published"))
        return dict.fromkeys(raw if isinstance(raw, dict) else (), (0.0, 0.0))

    def _knows_balls(self) -> bool:
        """Tell whether every ball's id is known (and the cue ball), so that others are unknown."""
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
    """Return what stands at a location in the raw file; None where nothing does."""
    for step in where:
        try:
            raw = raw[step]
        except (KeyError, IndexError, TypeError):
            return None
    return raw
