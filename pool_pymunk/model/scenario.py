"""Scenario files: TOML in the file's units -> a :class:`~pool_pymunk.model.scene.Scene` in SI.

The models here know the format: which keys there are and what type each has. What the numbers may
be is checked by the scene's parts. All problems of a file are reported at once, each in one line
with the file, the key and the value as it is written there.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pool_pymunk.model.outline import Table
from pool_pymunk.model.parts import (
    NO_TARGET,
    STANDARD_GRAVITY,
    Ball,
    Friction,
    Physics,
    Pocket,
    Restitution,
    Shot,
)
from pool_pymunk.model.places import place_problems
from pool_pymunk.model.problems import (
    LEFT_OUT,
    TOO_LARGE,
    Point,
    Problem,
    SceneError,
    key_of,
    most_like,
    name_problems,
    suggestion,
)
from pool_pymunk.model.racks import MOST_ROWS, SHAPES, rack, rack_ids
from pool_pymunk.model.scene import (
    Scene,
    id_problems,
    repeated,
    rest_needs,
    restitution_needs,
    shot_problems,
)
from pool_pymunk.model.units import Units

Made = TypeVar("Made")
Location = tuple[int | str, ...]  # where something stands in a file: ("balls", 2, "mass")
SMALL = 1e-9  # stands in for a size that is missing, so that the rest of a ball is checked
Vector = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Section(BaseModel):
    """All keys are optional here: what is wanted is said by :class:`_Builder`."""

    model_config = ConfigDict(extra="forbid", strict=True)


class _Units(_Section):
    length: str = "m"
    mass: str = "kg"
    speed: str = "m/s"
    numbers: Literal["units", "SI"] = "units"


class _Table(_Section):
    length: float | None = None
    width: float | None = None
    outline: list[Vector] | None = None


class _Physics(_Section):
    law: str = "coulomb"
    gravity: float = STANDARD_GRAVITY
    max_time: float | None = None


class _Restitution(_Section):
    ball_ball: float | None = None
    cue_ball: float | None = None
    cushion: float | None = None


class _Friction(_Section):
    surface: float = 0.0
    cushion: float = 0.0
    ball_ball: float = 0.0


class _BallDefaults(_Section):
    radius: float | None = None
    mass: float | None = None
    color: str | None = None


class _Ball(_BallDefaults):
    id: str | None = None
    position: Vector | None = None
    cue: bool = False
    velocity: Vector | None = None


class _Rack(_BallDefaults):
    rows: Annotated[int, Field(ge=1, le=MOST_ROWS)] | None = None
    shape: Literal["triangle", "diamond"] | None = None
    apex: Vector | None = None
    angle: float = 0.0
    gap: float = 0.0
    ids: list[str] | None = None


class _Pocket(_Section):
    id: str | None = None
    position: Vector | None = None
    radius: float | None = None


class _Shot(_Section):
    name: str | None = None
    ball: str | None = None
    velocity: Vector | None = None
    speed: float | None = None
    angle: float | None = None
    aim: str | None = None
    from_: Literal["start", "previous"] = Field("start", alias="from")
    published: dict[str, Vector] = {}


class _File(_Section):
    title: str = ""
    units: _Units = _Units()
    table: _Table | None = None
    physics: _Physics = _Physics()
    restitution: _Restitution = _Restitution()
    friction: _Friction = _Friction()
    ball: _BallDefaults = _BallDefaults()
    pockets: list[_Pocket] = []
    balls: list[_Ball] = []
    racks: list[_Rack] = []
    shots: list[_Shot] = []


def bundled() -> dict[str, Path]:
    """The scenarios that come with the package, by name."""
    here = Path(str(resources.files("pool_pymunk")))
    for folder in (here / "scenarios", here.parent / "scenarios"):
        if folder.is_dir():
            return {path.stem: path for path in sorted(folder.glob("*.toml"))}
    return {}


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
    """How output names a scenario: the path as given, or where a bundled one stands."""
    return f"scenarios/{scenario}.toml" if str(scenario) in bundled() else str(scenario)


def loads(text: str, source: str = "scenario") -> Scene:
    """Make a Scene of a scenario's text; ``source`` is what error messages call it."""
    try:
        raw = tomllib.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError) as error:
        raise SceneError([_toml_problem(text, source, error)], source) from None
    builder = _Builder(raw)
    made = builder.scene()
    if made is None:
        raise SceneError(list(builder.problems.values()), source)
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


class _Builder:
    """Turns a raw file into a Scene part by part, and collects the problems of all parts.

    What is unsound is noted as ``broken`` and left out or stood in for, so that the rest is
    checked all the same and nothing is said of what only follows from it.
    """

    def __init__(self, raw: Mapping[str, Any]) -> None:
        self.raw = raw
        self.problems: dict[str, Problem] = {}  # by their text: the same is said once
        self.broken: set[Location] = set()
        self.file = self._read()
        self.units = self._part("units", Units)
        self.racks: list[int] = []  # of each ball of a rack, the number of the rack
        self.written = Units() if self.file.units.numbers == "SI" else self.units

    def scene(self) -> Scene | None:
        """The Scene, or None where there are problems."""
        table = self._table()
        physics = self._part("physics", Physics)
        restitution = self._part("restitution", Restitution)
        friction = self._part("friction", Friction)
        balls = dict(self._balls())
        for n, ball in self._racked():
            balls[len(self.file.balls) + len(self.racks)] = ball
            self.racks.append(n)
        pockets = dict(self._pockets())
        shots = {k: self._shot(k, entry) for k, entry in enumerate(self.file.shots)}
        self._check_balls(balls, table, pockets)
        self._check_shots(shots)
        self._check_needs(restitution, friction, physics)
        if self.problems:
            return None
        return Scene(
            balls=tuple(balls.values()),
            table=table,
            restitution=restitution,
            friction=friction,
            physics=physics,
            shots=tuple(shots.values()),
            title=self.file.title,
            units=self.units,
            pockets=tuple(pockets.values()),
        )

    # -- problems --------------------------------------------------------------------------------

    def _note(self, problem: Problem) -> None:
        """Keep a problem with key and value as the file has them; defaults stand in [ball]."""
        location = _location(problem.key)
        value = _find(self.raw, location)
        if value is None and location[0] in ("balls", "racks") and len(location) == 3:
            default = ("ball", location[2])
            if (value := _find(self.raw, default)) is not None:
                location = default
        if value is not None:
            problem = Problem(_key(location), value, problem.message)
        self.problems.setdefault(str(problem), problem)
        self.broken.add(location)

    def _note_all(self, problems: Iterable[Problem]) -> None:
        """Note problems, less those of what is broken already."""
        for problem in problems:
            if not self._is_broken(*_location(problem.key)):
                self._note(problem)

    def _is_broken(self, *location: int | str) -> bool:
        """Whether something is known to be wrong with this value or with what it stands in."""
        return any(location[:n] in self.broken for n in range(1, len(location) + 1))

    # -- types and keys --------------------------------------------------------------------------

    def _read(self) -> _File:
        """The file's typed content; what does not fit is noted and left out."""
        try:
            return _File.model_validate(self.raw)
        except ValidationError as error:
            sound = _copied(self.raw, depth=4)
            for details in error.errors(include_url=False):
                location = details["loc"]
                self._note(Problem(_key(location), details["input"], _type_message(details)))
                self._take_as_meant(details)
                field = location[: _depth(location)]
                self.broken.add(field)
                _take_out(sound, field)
            return _File.model_validate(sound)

    def _take_as_meant(self, details: Any) -> None:
        """Take an unknown key for the one that it is most like: so that is not left out."""
        if details["type"] == "extra_forbidden":
            *path, name = details["loc"]
            meant = (*path, most_like(name, _known_keys(tuple(path))))
            if meant[-1] and _find(self.raw, meant) is None:
                self.broken.add(meant)

    # -- parts -----------------------------------------------------------------------------------

    def _part(self, name: str, kind: Callable[..., Made]) -> Made:
        """A section's object; sound values stand in for broken ones."""
        values = getattr(self.file, name).model_dump(exclude={"numbers"})
        values |= {key: _stand_in(key) for key in values if self._is_broken(name, key)}
        try:
            return kind(**values)
        except SceneError as error:
            self._note_all(_under(name, error))
            return kind(**values | {p.key: _stand_in(p.key) for p in error.problems})

    def _si(self, value: float, kind: str) -> float:
        return self.written.to_si(value, kind)

    def _point(self, xy: list[float], kind: str = "length") -> Point:
        return (self._si(xy[0], kind), self._si(xy[1], kind))

    def _table(self) -> Table | None:
        table = self.file.table
        if table is None:
            return None
        size = {key: getattr(table, key) for key in ("length", "width")}
        try:
            if table.outline is not None:
                self._note_all(_beside("table", size, "outline"))
                return Table(tuple(map(self._point, table.outline)))
            if self._is_broken("table", "outline"):
                return None
            self._note_all(_wanted("table", size, "is wanted (or an outline)"))
            si = [self._si(x, "length") for x in size.values() if x is not None]
            return Table.rectangle(*si) if len(si) == 2 else None
        except SceneError as error:
            self._note_all(_under("table", error))
            return None

    def _balls(self) -> Iterator[tuple[int, Ball]]:
        """The sound balls, each with its number."""
        for k, entry in enumerate(self.file.balls):
            own = {"id": entry.id, "position": entry.position}
            self._note_all(_wanted(f"balls[{k}]", own, "is wanted"))
            size = self._sizes(f"balls[{k}]", entry)
            try:
                ball = self._ball(entry, **size)
            except SceneError as error:
                self._note_all(_under(f"balls[{k}]", error))
                continue
            if None not in own.values():
                yield k, ball

    def _racked(self) -> Iterator[tuple[int, Ball]]:
        """The balls of sound racks, each with the number of its rack."""
        for n, entry in enumerate(self.file.racks):
            key = f"racks[{n}]"
            self._note_all(_wanted(key, {"apex": entry.apex}, "is wanted"))
            said = {entry.rows, entry.shape} != {None} or self._is_broken("racks", n, "shape")
            if not said:
                self._note_all(_wanted(key, {"rows": None}, "is wanted (or a shape)"))
            size = self._sizes(key, entry)
            try:
                balls = self._rack(entry, **size)
            except SceneError as error:
                self._note_all(_under(key, error))
                continue
            if not any(location[:2] == ("racks", n) for location in self.broken):
                yield from ((n, ball) for ball in balls)

    def _rack(self, entry: _Rack, radius: float, mass: float) -> tuple[Ball, ...]:
        return rack(
            self._point(entry.apex or [0.0, 0.0]),
            radius=self._si(radius, "length"),
            mass=self._si(mass, "mass"),
            rows=entry.rows,
            shape=entry.shape or SHAPES[0],
            angle=entry.angle,
            gap=self._si(entry.gap, "length"),
            ids=entry.ids,
            color=self.file.ball.color if entry.color is None else entry.color,
        )

    def _pockets(self) -> Iterator[tuple[int, Pocket]]:
        """The sound pockets, each with its number; without an id it is called by that, from 1."""
        for k, entry in enumerate(self.file.pockets):
            own = {"position": entry.position, "radius": entry.radius}
            self._note_all(_wanted(f"pockets[{k}]", own, "is wanted"))
            id_ = str(k + 1) if entry.id is None else entry.id
            radius = SMALL if entry.radius is None else self._si(entry.radius, "length")
            try:
                pocket = Pocket(id_, self._point(entry.position or [0.0, 0.0]), radius)
            except SceneError as error:
                self._note_all(_under(f"pockets[{k}]", error))
                continue
            if None not in own.values():
                yield k, pocket

    def _sizes(self, key: str, entry: _BallDefaults) -> dict[str, float]:
        """Radius and mass, the entry's or those of [ball]; small ones stand in for missing ones."""
        size = {name: self._size(entry, name) for name in ("radius", "mass")}
        for name, value in size.items():
            if not self._is_broken("ball", name):
                self._note_all(_wanted(key, {name: value}, "is wanted, here or in [ball]"))
        return {name: SMALL if value is None else value for name, value in size.items()}

    def _size(self, entry: _BallDefaults, key: str) -> float | None:
        value: float | None = getattr(entry, key)
        return getattr(self.file.ball, key) if value is None else value

    def _ball(self, entry: _Ball, radius: float, mass: float) -> Ball:
        return Ball(
            id="?" if entry.id is None else entry.id,
            position=self._point(entry.position or [0.0, 0.0]),
            radius=self._si(radius, "length"),
            mass=self._si(mass, "mass"),
            cue=entry.cue,
            velocity=self._point(entry.velocity or [0.0, 0.0], "speed"),
            color=self.file.ball.color if entry.color is None else entry.color,
        )

    def _shot(self, k: int, entry: _Shot) -> Shot:
        """A shot; where it is unsound, one that stands in for it in the checks to come."""
        key, name = f"shots[{k}]", f"Shot {k + 1}" if entry.name is None else entry.name
        ball = self._shot_ball(key, entry)
        try:
            if not any(self._is_broken(*_location(f"{key}.{said}")) for said in _LAUNCH):
                return self._sound_shot(entry, name, ball)
        except SceneError as error:
            self._note_all(_under(key, error))
        ends = dict.fromkeys(entry.published, (0.0, 0.0))
        name = key if any(name_problems("name", name)) else name
        start: dict[str, Any] = (
            {"speed": 0.0, "aim": entry.aim} if entry.aim else {"velocity": (0.0, 0.0)}
        )
        return Shot(name, ball, **start, from_previous=entry.from_ == "previous", published=ends)

    def _sound_shot(self, entry: _Shot, name: str, ball: str) -> Shot:
        return Shot(
            name=name,
            ball=ball,
            velocity=None if entry.velocity is None else self._point(entry.velocity, "speed"),
            speed=None if entry.speed is None else self._si(entry.speed, "speed"),
            angle=entry.angle,
            aim=entry.aim,
            from_previous=entry.from_ == "previous",
            published={id_: self._point(end) for id_, end in entry.published.items()},
        )

    def _shot_ball(self, key: str, entry: _Shot) -> str:
        if entry.ball is not None:
            return entry.ball
        cues = [ball.id for ball in self.file.balls if ball.cue]
        if not cues and self._knows_balls():
            message = "is wanted where there is no cue ball"
            self._note_all([Problem(f"{key}.ball", LEFT_OUT, message)])
        return cues[0] or "" if cues else ""

    def _knows_balls(self) -> bool:
        """Whether every ball's id is known (and the cue ball), so that any other is unknown."""
        return bool(self.file.balls or self.racks) and not (
            self._is_broken("balls")
            or any(location[:1] == ("racks",) for location in self.broken)
            or any(
                ball.id is None or self._is_broken("balls", k, "cue")
                for k, ball in enumerate(self.file.balls)
            )
        )

    # -- between the parts -----------------------------------------------------------------------

    def _check_balls(
        self, balls: Mapping[int, Ball], table: Table | None, pockets: Mapping[int, Pocket]
    ) -> None:
        entries = self.file.balls
        if not entries and not self.file.racks:
            self._note_all([Problem("balls", LEFT_OUT, "one ball or more is wanted")])
        ids = {k: entry.id for k, entry in enumerate(entries) if entry.id is not None}
        ids |= {k: ball.id for k, ball in balls.items() if k >= len(entries)}
        cues = [k for k, entry in enumerate(entries) if entry.cue]
        holes = {k: pocket.id for k, pocket in pockets.items()}
        self._note_all(map(self._as_written, id_problems(ids, cues)))
        self._note_all(repeated("pockets", "id", holes))
        holes_there = tuple(pockets.values())
        places = place_problems(balls, table, holes_there, units=self.written)
        self._note_all(map(self._as_written, places))

    def _as_written(self, problem: Problem) -> Problem:
        """Name the rack of a ball that the file does not list itself."""

        def rack_of(found: re.Match[str]) -> str:
            k = int(found[1]) - len(self.file.balls)
            return found[0] if k < 0 else f"racks[{self.racks[k]}]"

        key = re.sub(r"^balls\[(\d+)\]", rack_of, problem.key)
        if key == problem.key:
            return replace(problem, message=re.sub(r"balls\[(\d+)\]", rack_of, problem.message))
        key = key.replace(".position", ".apex").replace(".id", ".ids")
        return Problem(key, problem.value, re.sub(r"balls\[(\d+)\]", rack_of, problem.message))

    def _check_shots(self, shots: Mapping[int, Shot]) -> None:
        ids = [entry.id for entry in self.file.balls if entry.id is not None]
        for entry in self.file.racks:
            ids += rack_ids(entry.rows, entry.shape or SHAPES[0], entry.ids)
        if not self._knows_balls():  # then any name may be the name of a ball
            for shot in shots.values():
                ids += [shot.ball, shot.aim or shot.ball, *shot.published]
        self._note_all(shot_problems(shots, ids))

    def _check_needs(self, restitution: Restitution, friction: Friction, physics: Physics) -> None:
        balls = self.file.balls
        cues = [k for k, ball in enumerate(balls) if ball.cue]
        moves = bool(self.file.shots) or any(any(ball.velocity or ()) for ball in balls)
        has_table = "table" in self.raw
        count = len(balls) + len(self.racks)
        self._note_all(restitution_needs(restitution, has_table, count, cues))
        if not self._is_broken("friction", "surface"):
            self._note_all(rest_needs(friction, physics, moves))


LISTS = ("pockets", "balls", "racks", "shots")
_LAUNCH = ("velocity", "speed", "angle", "aim")


def _stand_in(key: str) -> float | str:
    """A sound value for a broken one: 1 with every number in need of none other."""
    return {"law": "coulomb", "length": "m", "mass": "kg", "speed": "m/s"}.get(key, 1.0)


def _under(key: str, error: SceneError) -> Iterator[Problem]:
    """The problems that a part of the file has found in itself."""
    for problem in error.problems:
        yield Problem(f"{key}.{problem.key}", problem.value, problem.message)


def _wanted(key: str, values: Mapping[str, object], message: str) -> Iterator[Problem]:
    for name, value in values.items():
        if value is None:
            yield Problem(f"{key}.{name}", LEFT_OUT, message)


def _beside(key: str, values: Mapping[str, object], other: str) -> Iterator[Problem]:
    for name, value in values.items():
        if value is not None:
            yield Problem(f"{key}.{name}", value, f"stands beside {other}: one of the two")


# -- keys and messages ---------------------------------------------------------------------------


def _key(location: Location) -> str:
    """``("balls", 2, "mass")`` as ``balls[2].mass``."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{key_of(part)}" for part in location)
    return "".join(parts).removeprefix(".")


def _location(key: str) -> Location:
    """What :func:`_key` was made from."""
    parts = re.findall(r'\[(\d+)\]|("(?:[^"\\]|\\.)*")|([^.\[\]]+)', key)
    return tuple(int(n) if n else json.loads(text) if text else bare for n, text, bare in parts)


def _depth(location: Location) -> int:
    """How many steps down ``location`` lies what can be left out: a key, not half a vector."""
    if location[2:3] == ("published",):
        return 4
    return 3 if location[0] in LISTS else 2


def _find(raw: Any, location: Location) -> Any:
    """What stands at a location in the raw file; None where nothing does."""
    for part in location:
        try:
            raw = raw[part]
        except (KeyError, IndexError, TypeError):
            return None
    return raw


def _copied(raw: Any, depth: int) -> Any:
    if depth > 0 and isinstance(raw, dict):
        return {key: _copied(value, depth - 1) for key, value in raw.items()}
    if depth > 0 and isinstance(raw, list):
        return [_copied(value, depth - 1) for value in raw]
    return raw


def _take_out(raw: Any, location: Location) -> None:
    """Take a value out; a list keeps its places, with an empty table in this one."""
    *path, last = location
    parent = _find(raw, tuple(path))
    if isinstance(parent, list):
        parent[int(last)] = {}
    elif parent is not None:
        parent.pop(last, None)


_TYPE_MESSAGES = {
    "string_type": 'must be text, in "quotes"',
    "bool_type": "must be true or false",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "too_short": "must be two numbers, [x, y]",
    "too_long": "must be two numbers, [x, y]",
}


def _type_message(details: Any) -> str:
    kind, location, value = details["type"], details["loc"], details["input"]
    if kind == "string_type" and location[-1] == "aim":
        return NO_TARGET
    if kind == "extra_forbidden":
        known = _known_keys(location[:-1])
        return f"unknown key (there are: {', '.join(known)}){suggestion(location[-1], known)}"
    if kind == "literal_error":
        return f"must be {details['ctx']['expected']}".replace("'", '"')
    if kind == "float_type":
        is_integer = isinstance(value, int) and not isinstance(value, bool)
        return TOO_LARGE if is_integer else "must be a number"
    if kind == "list_type" and location[-1] in LISTS:
        return f"must be a list: write [[{location[-1]}]] above each of them"
    if kind == "list_type" and location[-1] == "ids":
        return 'must be ids, ["1", "2", ...]'
    if kind in ("int_type", "int_from_float", "greater_than_equal", "less_than_equal"):
        return f"must be a whole number from 1 to {MOST_ROWS}"
    if kind == "list_type":
        is_outline = location[-1] == "outline"
        return f"must be {'corners, [[x, y], ...]' if is_outline else 'two numbers, [x, y]'}"
    return _TYPE_MESSAGES.get(kind) or str(details["msg"])


def _known_keys(location: Location) -> list[str]:
    """The keys of the part of a file at ``location``."""
    parts: Mapping[int | str, type[BaseModel]] = {
        "units": _Units, "table": _Table, "physics": _Physics, "restitution": _Restitution,
        "friction": _Friction, "ball": _BallDefaults, "balls": _Ball, "shots": _Shot,
        "pockets": _Pocket, "racks": _Rack,
    }  # fmt: skip
    model = parts[location[0]] if location else _File
    return [field.alias or name for name, field in model.model_fields.items()]
