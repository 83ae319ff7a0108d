"""This module reads scenario files, TOML in units of their own, as Scenes in SI.

The parts of a scene say which keys there are, and what each may be (``model/plain.py``). A file is
read in two phases: first each section is read on its own, then the parts are put together. All
problems of a phase are reported at once, each in one line with the file, the key and its value.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from pool_pymunk.model import parts
from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import Ball, Shot
from pool_pymunk.model.plain import ABOVE_0, Key, Keys, Part, argument, one_of, read_all, size
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Location,
    Problem,
    SceneError,
    raise_any,
    suggestion,
)
from pool_pymunk.model.quantities import UNITS, Units
from pool_pymunk.model.racks import HEXAGON, rack
from pool_pymunk.model.racks import KEYS as RACK
from pool_pymunk.model.scene import Scene, repeated
from pool_pymunk.safety.files import bundled as bundled

Values = dict[str, Any]  # of a section

USUAL = ("radius", "mass", "color")  # the keys of [ball]: balls and racks take them from there
MISSING, IN_NEITHER = "is missing", "is missing, here or in [ball]"
PLACED, SIZED = {"position": MISSING, "radius": MISSING}, dict.fromkeys(USUAL[:2], IN_NEITHER)


class Section(NamedTuple):
    """A section of a file, or each section of a list, has these keys, and needs some of them.

    Its values ``make`` a part of the scene.
    """

    about: str
    make: Callable[..., Any]
    keys: Keys
    needed: Mapping[str, str] = {}  # what is said where one is missing


def _section_of(about: str, kind: type[Part], needed: Mapping[str, str] = {}) -> Section:
    """Return the section that has the keys of the part that it makes."""
    return Section(about, kind, kind.KEYS, needed)


def _table(**values: Any) -> Table:
    """Make a table, of an outline or of two sides."""
    sides = {key: values.pop(key, None) for key in SIDES}
    if "outline" in values:
        raise_any(parts.beside("outline", **sides))
        return Table(**values)
    if "bulge" in values:
        message = "needs an outline, whose sides it bends"
        raise SceneError([Problem("bulge", values["bulge"], message)])
    missing = [key for key, side in sides.items() if side is None]
    raise_any(Problem(key, LEFT_OUT, "is missing (or an outline)") for key in missing)
    return Table.rectangle(**sides, **values)


def _rack(**values: Any) -> tuple[Ball, ...]:
    if not {"rows", "shape"} & values.keys():
        raise SceneError([Problem("rows", LEFT_OUT, "is missing (or a shape)")])
    return rack(**values)


def _shot(**values: Any) -> Shot:
    if values["ball"] is None:
        raise SceneError([Problem("ball", LEFT_OUT, "is missing (there is no cue ball)")])
    return Shot(from_previous=values.pop("from", "start") == "previous", **values)


SIDES = {
    key: Key(size, "length", ABOVE_0, f"Along {axis}, from {axis} = 0; or: an outline.", float)
    for key, axis in (("length", "x"), ("width", "y"))
}
NUMBERS = one_of(
    ("units", "SI"), "SI: numbers of this file are in SI, only results in these units."
)
FROM = one_of(("start", "previous"), "previous: go on from where the last shot ended.")
SECTIONS = {
    "units": Section("Units of the file's numbers; SI without it.", dict,
                     Units.KEYS | {"numbers": NUMBERS}),
    "table": Section("Left out: an open plane without cushions.", _table, SIDES | Table.KEYS),
    "physics": _section_of("The contact law, gravity, and a run's latest end.", parts.Physics),
    "restitution": _section_of("Coefficients of restitution.", parts.Restitution),
    "friction": _section_of("Coefficients of friction; left out: not modelled.", parts.Friction),
    "ball": Section("What every ball has that does not say otherwise.", dict,
                    {key: Ball.KEYS[key] for key in USUAL}),
}  # fmt: skip
LISTS = {
    "pockets": _section_of("They take balls off the table.", parts.Pocket, PLACED),
    "posts": _section_of("Round obstacles.", parts.Post, PLACED),
    "patches": _section_of("Regions with other friction, such as sand or ice.", parts.Patch),
    "balls": _section_of("The balls.", Ball, {"id": MISSING, "position": MISSING} | SIZED),
    "racks": Section("Balls in rows, or in rings.", _rack, RACK, SIZED),
    "shots": Section("Each is played on its own. Without any, balls have their own velocities.",
                     _shot, {("from" if name == "from_previous" else name): key
                             for name, key in (Shot.KEYS | {"from_previous": FROM}).items()}),
}  # fmt: skip
PARTS = SECTIONS | LISTS
# These keys of a rack give these keys of its balls; in a hexagon, center gives the position.
OF_RACKS = {"position": "apex", "id": "ids"}
TOP: Keys = {"title": Scene.KEYS["title"]} | dict.fromkeys(PARTS, Key(lambda value: value))


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
    text = argument("text", text, TOP["title"].read)
    try:
        raw = tomllib.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise SceneError([_toml_problem(text, source, error)], source) from None
    try:
        return _File(raw).scene()
    except SceneError as error:
        raise SceneError(error.problems, source) from None


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
    """A file makes a Scene section by section, and keeps the problems of all of them."""

    def __init__(self, raw: Values) -> None:
        self.raw = raw
        self.problems: dict[Location, Problem] = {}  # one for each place
        self.written = Units()  # the units of the file's numbers
        self.places: list[Location] = []  # where each ball of the scene stands, if all are sound

    def scene(self) -> Scene:
        """Return the Scene; raises SceneError with all problems of a phase."""
        made = self._parts()
        raise_any(self.problems.values())
        try:
            return Scene(**made)
        except SceneError:  # Its messages are in SI, but the file's numbers need not be.
            scene = object.__new__(Scene)
            vars(scene).update(made)
            ids = (ball.id for ball in scene.balls)
            self._note(repeated("id", zip(self.places, ids, strict=True)))
            self._note(scene.clashes(self.written))
            raise SceneError([*self.problems.values()]) from None

    def _parts(self) -> Values:
        """Return the parts of the Scene that are sound on their own."""
        with self._noting():
            read_all(TOP, self.raw)
        has_usual = "ball" in self.raw or not self.problems  # It may be there, misspelt.
        units: Values = self._section("units") or {}
        is_si = units.pop("numbers", "units") == "SI"
        made: Values = {"title": self.raw.get("title", ""), "units": Units(**units)}
        self.written = Units() if is_si else made["units"]
        usual: Values | None = self._section("ball") if has_usual else None
        made["table"] = self._section("table") if "table" in self.raw else None
        made |= {name: self._section(name) for name in ("physics", "restitution", "friction")}
        made["pockets"] = self._list("pockets", lambda k: {"id": str(k)})
        made |= {name: self._list(name) for name in ("posts", "patches")}
        balls = self._list("balls", lambda _: usual)
        racks = self._list("racks", lambda _: usual)
        made["balls"] = balls + sum(racks, ())
        self.places += [("balls", k) for k in range(len(balls))]
        self.places += [("racks", k) for k, each in enumerate(racks) for _ in each]
        nobody = "" if self.problems or not balls else None
        struck = next((ball.id for ball in balls if ball.cue), nobody)
        made["shots"] = self._list("shots", lambda k: {"name": f"Shot {k}", "ball": struck})
        return made

    def _section(self, name: str) -> Any:
        """Return what a section makes, or None if it is not sound."""
        with self._noting(name):
            return PARTS[name].make(**self._read(name, self.raw.get(name, {})))
        return None

    def _list(
        self, name: str, usual: Callable[[int], Values | None] = lambda _: {}
    ) -> tuple[Any, ...]:
        """Return what the sound sections of a list make.

        They take the ``usual`` values, by their numbers from 1; without these none can be made.
        """
        found: list[Any] = []
        raw = self.raw.get(name, [])
        if not isinstance(raw, list):
            message = f"must be a list: write [[{name}]] above each of them"
            self._note([Problem((name,), raw, message)])
            return ()
        for k, one in enumerate(raw):
            with self._noting(name, k):
                given = usual(k + 1)
                own = self._read(name, one, USUAL if given is None else given)
                if given is not None:
                    found.append(PARTS[name].make(**given | own))
        return tuple(found)

    def _read(self, name: str, raw: Any, given: Collection[str] = ()) -> Values:
        """Return the values of a section; raises SceneError for all that is wrong with them."""
        if not isinstance(raw, dict):
            raise SceneError([Problem((), raw, "must be a table")])
        units = {kind: self.written.to_si(1.0, kind) for kind in UNITS}
        needed = {key: said for key, said in PARTS[name].needed.items() if key not in given}
        return read_all(PARTS[name].keys, raw, units, needed)

    # -- problems --------------------------------------------------------------------------------

    @contextmanager
    def _noting(self, *where: int | str) -> Iterator[None]:
        """Note the problems of what stands there."""
        try:
            yield
        except SceneError as error:
            self._note(problem.under(*where) for problem in error.problems)

    def _note(self, problems: Iterable[Problem]) -> None:
        """Keep the first problem of each place, with the value that the file has."""
        for problem in problems:
            where = problem.steps
            if where[0] == "balls" and len(where) > 2 and self.places:
                where = self.places[int(where[1])] + where[2:]
            if where[0] == "racks" and _find(self.raw, where) is None:
                is_hexagon = _find(self.raw, (*where[:2], "shape")) == HEXAGON
                own = OF_RACKS | ({"position": "center"} if is_hexagon else {})
                where = (*where[:2], *(own.get(str(step), step) for step in where[2:]))
            value = _find(self.raw, where)
            value = problem.value if value is None else value
            self.problems.setdefault(where, Problem(where, value, problem.message))


def _find(raw: Any, where: Location) -> Any:
    """Return what stands at a location in the raw file, or None."""
    for step in where:
        try:
            raw = raw[step]
        except (KeyError, IndexError, TypeError):
            return None
    return raw
