"""Scenario files: TOML in the file's units -> a :class:`~pool_pymunk.scene.Scene` in SI.

The models here know the format: which keys there are and what type each has. What the numbers may
be is checked by the Scene. All problems of a file are reported at once, each in one line with the
file, the key and the value as it is written.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pool_pymunk import scene as s
from pool_pymunk.scene import LEFT_OUT, Problem, Scene, SceneError

Made = TypeVar("Made")
Vector = Annotated[list[float], Field(min_length=2, max_length=2)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, populate_by_name=True)


class _Units(_Section):
    length: Literal["m", "cm", "mm", "in"] = "m"
    mass: Literal["kg", "g"] = "kg"
    speed: Literal["m/s", "in/s"] = "m/s"


class _Table(_Section):
    length: float | None = None
    width: float | None = None
    outline: list[Vector] | None = None


class _Physics(_Section):
    law: str = "coulomb"
    gravity: float = s.STANDARD_GRAVITY
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
    id: str
    position: Vector
    cue: bool = False
    velocity: Vector | None = None


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
    balls: list[_Ball] = []
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

    Raises :class:`~pool_pymunk.scene.SceneError` with every problem of the file, or OSError where
    it cannot be read.

    >>> scene = load("report")
    >>> len(scene.balls), scene.balls[0].radius, [shot.name for shot in scene.shots][0]
    (11, 0.05715, 'Simulation 1')
    """
    path = Path(scenario)
    known = bundled()
    if str(scenario) in known:
        return loads(known[str(scenario)].read_text(encoding="utf-8"), f"scenarios/{scenario}.toml")
    if not path.exists():
        names = ", ".join(known)
        raise SceneError([Problem("scenario", str(scenario), f"no such file, nor one of: {names}")])
    try:
        return loads(path.read_text(encoding="utf-8"), str(scenario))
    except UnicodeDecodeError as error:
        raise SceneError(
            [Problem("file", LEFT_OUT, f"not UTF-8 text: {error}")], str(path)
        ) from None


def label(scenario: str | Path) -> str:
    """How output names a scenario: the path as given, or where a bundled one stands."""
    return f"scenarios/{scenario}.toml" if str(scenario) in bundled() else str(scenario)


def loads(text: str, source: str = "scenario") -> Scene:
    """Make a Scene of a scenario's text; ``source`` is what error messages call it."""
    try:
        raw = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        message = str(error) or "nested too deeply"
        raise SceneError([Problem("TOML", LEFT_OUT, message)], source) from None
    builder = _Builder(raw)
    made = builder.scene()
    if made is None:
        raise SceneError(builder.problems, source)
    return made


class _Builder:
    """Turns a raw file into a Scene part by part, and collects the problems of all parts."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        self.raw = raw
        self.problems: list[Problem] = []
        self.broken: set[str] = set()  # keys whose type is wrong: nothing more is said of them
        self.file = self._read(raw)
        self.units = s.Units(**self.file.units.model_dump())

    def scene(self) -> Scene | None:
        """The Scene, or None where there are problems."""
        parts: dict[str, Any] = {
            "table": self._table(),
            "restitution": self._part("restitution", s.Restitution),
            "friction": self._part("friction", s.Friction),
            "physics": self._part("physics", s.Physics),
        }
        balls = list(self._balls())
        shots = list(self._shots(balls))
        whole = not self.problems
        if not self.file.balls and "balls" not in self.broken:
            self.problems.append(Problem("balls", LEFT_OUT, "one ball or more is wanted"))
        if not whole:
            self._check_what_is_there(balls, shots, parts)
            return None
        try:
            return Scene(
                balls=tuple(ball for _, ball in balls),
                shots=tuple(shot for _, shot in shots),
                title=self.file.title,
                units=self.units,
                **parts,
            )
        except SceneError as error:
            self.problems = [self._as_written(p) for p in error.problems]
            return None

    def _check_what_is_there(
        self,
        balls: list[tuple[int, s.Ball]],
        shots: list[tuple[int, s.Shot]],
        parts: Mapping[str, Any],
    ) -> None:
        """Say what is wrong between the parts, too, where the parts themselves are sound."""
        found = list(s.ball_problems([ball for _, ball in balls], parts["table"]))
        self._renumber(found, "balls", [k for k, _ in balls])
        if len(balls) == len(self.file.balls) and "balls" not in self.broken:
            shot_problems = list(s.shot_problems([x for _, x in shots], [b for _, b in balls]))
            self._renumber(shot_problems, "shots", [k for k, _ in shots])

    def _renumber(self, found: list[Problem], name: str, numbers: list[int]) -> None:
        for problem in found:
            head, _, rest = problem.key.removeprefix(f"{name}[").partition("]")
            key = f"{name}[{numbers[int(head)]}]{rest}"
            self.problems.append(self._as_written(Problem(key, problem.value, problem.message)))

    # -- types and keys --------------------------------------------------------------------------

    def _read(self, raw: Mapping[str, Any]) -> _File:
        """The file's typed content; what does not fit is reported and left out."""
        try:
            return _File.model_validate(raw)
        except ValidationError as error:
            pruned = _copied(raw)
            for details in error.errors(include_url=False):
                self._note_type_problem(details, raw)
                _prune(pruned, details["loc"])
        try:
            return _File.model_validate(pruned)
        except ValidationError:
            sound = {}
            for key, value in pruned.items():
                try:
                    _File.model_validate({key: value})
                    sound[key] = value
                except ValidationError:
                    self.broken.add(key)
            return _File.model_validate(sound)

    def _note_type_problem(self, details: Any, raw: Mapping[str, Any]) -> None:
        location = details["loc"]
        value = details["input"] if details["type"] != "missing" else LEFT_OUT
        self.broken.add(str(location[0]))
        message = _type_message(details, location)
        self.problems.append(Problem(_key(location), value, message))

    # -- parts -----------------------------------------------------------------------------------

    def _made(self, prefix: str, make: Callable[[], Made]) -> Made | None:
        """What ``make`` makes, or None and its problems under ``prefix``."""
        try:
            return make()
        except SceneError as error:
            for p in error.problems:
                self.problems.append(
                    self._as_written(Problem(f"{prefix}.{p.key}", p.value, p.message))
                )
            return None

    def _part(self, name: str, kind: Callable[..., Made]) -> Made | None:
        return self._made(name, lambda: kind(**getattr(self.file, name).model_dump()))

    def _point(self, xy: list[float], kind: str = "length") -> s.Point:
        return (self.units.to_si(xy[0], kind), self.units.to_si(xy[1], kind))

    def _table(self) -> s.Table | None:
        table = self.file.table
        if table is None or "table" in self.broken:
            return None
        size = (table.length, table.width)
        if table.outline is not None:
            if size != (None, None):
                message = "stands beside length or width: one of the two"
                self.problems.append(Problem("table.outline", table.outline, message))
                return None
            corners = tuple(self._point(corner) for corner in table.outline)
            return self._made("table", lambda: s.Table(corners))
        for key, value in zip(("length", "width"), size, strict=True):
            if value is None:
                message = "is wanted (or an outline)"
                self.problems.append(Problem(f"table.{key}", LEFT_OUT, message))
        if None in size:
            return None
        length, width = (self.units.to_si(value, "length") for value in size if value is not None)
        return self._made("table", lambda: s.Table.rectangle(length, width))

    def _balls(self) -> Iterator[tuple[int, s.Ball]]:
        for k, entry in enumerate(self.file.balls):
            ball = self._made(f"balls[{k}]", lambda k=k, entry=entry: self._ball(k, entry))  # type: ignore[misc]
            if ball is not None:
                yield k, ball

    def _ball(self, k: int, entry: _Ball) -> s.Ball:
        default = self.file.ball
        size = {
            "radius": default.radius if entry.radius is None else entry.radius,
            "mass": default.mass if entry.mass is None else entry.mass,
        }
        missing = [
            Problem(key, LEFT_OUT, "is wanted, here or in [ball]")
            for key, value in size.items()
            if value is None
        ]
        if missing:
            raise SceneError(missing)
        return s.Ball(
            id=entry.id,
            position=self._point(entry.position),
            radius=self.units.to_si(size["radius"] or 0.0, "length"),
            mass=self.units.to_si(size["mass"] or 0.0, "mass"),
            cue=entry.cue,
            velocity=self._point(entry.velocity or [0.0, 0.0], "speed"),
            color=entry.color or default.color,
        )

    def _shots(self, balls: list[tuple[int, s.Ball]]) -> Iterator[tuple[int, s.Shot]]:
        cue = next((ball.id for _, ball in balls if ball.cue), None)
        names: dict[str, int] = {}
        for k, entry in enumerate(self.file.shots):
            name = entry.name or f"Shot {k + 1}"
            if name in names:
                message = f"is the name of shots[{names[name]}] already"
                self.problems.append(Problem(f"shots[{k}].name", name, message))
            names.setdefault(name, k)
            shot = self._made(
                f"shots[{k}]",
                lambda entry=entry, name=name: self._shot(entry, name, cue),  # type: ignore[misc]
            )
            if shot is not None:
                yield k, shot

    def _shot(self, entry: _Shot, name: str, cue: str | None) -> s.Shot:
        velocity, problems = self._launch(entry)
        ball = entry.ball or cue
        if ball is None:
            problems.append(Problem("ball", LEFT_OUT, "is wanted where there is no cue ball"))
        if problems:
            raise SceneError(problems)
        return s.Shot(
            name=name,
            ball=ball or "",
            velocity=velocity,
            speed=None if entry.speed is None else self.units.to_si(entry.speed, "speed"),
            aim=entry.aim,
            from_previous=entry.from_ == "previous",
            published={id_: self._point(end) for id_, end in entry.published.items()},
        )

    def _launch(self, entry: _Shot) -> tuple[s.Point | None, list[Problem]]:
        """The shot's velocity where the file gives it: as such, or as speed and angle."""
        if entry.velocity is not None:
            beside = [key for key in ("speed", "angle", "aim") if getattr(entry, key) is not None]
            return self._point(entry.velocity, "speed"), [
                Problem(key, getattr(entry, key), "stands beside velocity: one of the two")
                for key in beside
            ]
        if entry.speed is None:
            message = "is wanted (or speed and angle, or speed and aim)"
            return None, [Problem("velocity", LEFT_OUT, message)]
        if entry.angle is None and entry.aim is None:
            return None, [Problem("angle", LEFT_OUT, "is wanted beside speed (or aim)")]
        if entry.angle is not None and entry.aim is not None:
            return None, [Problem("aim", entry.aim, "stands beside angle: one of the two")]
        if entry.angle is None:
            return None, []
        if not math.isfinite(entry.angle):
            return None, [Problem("angle", entry.angle, "must be a finite number")]
        if not entry.speed >= 0.0:
            return None, [Problem("speed", entry.speed, "must be 0 or more")]
        speed, angle = self.units.to_si(entry.speed, "speed"), math.radians(entry.angle)
        return (math.cos(angle) * speed, math.sin(angle) * speed), []

    # -- messages --------------------------------------------------------------------------------

    def _as_written(self, problem: Problem) -> Problem:
        """The problem with the value as the file has it, in its units; defaults name [ball]."""
        key = problem.key
        value = _find(self.raw, key)
        if value is None and key.startswith("balls["):
            default = f"ball.{key.rpartition('.')[2]}"
            if (value := _find(self.raw, default)) is not None:
                key = default
        if key.endswith((".length", ".width")) or value is not None:
            return Problem(key, problem.value if value is None else value, problem.message)
        return problem


def _key(location: tuple[int | str, ...]) -> str:
    """``("balls", 2, "mass")`` as ``balls[2].mass``."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}"
    return text.removeprefix(".")


def _type_message(details: Any, location: tuple[int | str, ...]) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "extra_forbidden":
        known = ", ".join(_known_keys(location[:-1]))
        return f"unknown key (there are: {known})"
    messages = {
        "missing": "is wanted",
        "float_type": "must be a number",
        "string_type": 'must be text, in "quotes"',
        "bool_type": "must be true or false",
        "list_type": "must be a list",
        "dict_type": "must be a table",
        "model_type": "must be a table",
        "model_attributes_type": "must be a table",
        "literal_error": f"must be one of {context.get('expected', '')}",
        "too_short": "must be two numbers",
        "too_long": "must be two numbers",
    }
    return messages.get(kind) or str(details["msg"])


def _known_keys(location: tuple[int | str, ...]) -> list[str]:
    model: type[BaseModel] = _File
    parts: dict[str, type[BaseModel]] = {
        "units": _Units, "table": _Table, "physics": _Physics, "restitution": _Restitution,
        "friction": _Friction, "ball": _BallDefaults, "balls": _Ball, "shots": _Shot,
    }  # fmt: skip
    if location:
        model = parts[str(location[0])]
    return [field.alias or name for name, field in model.model_fields.items()]


def _find(raw: Any, key: str) -> Any:
    """What stands at ``balls[2].mass`` in the raw file; None where nothing does."""
    at = raw
    for part in key.replace("[", ".[").split("."):
        if part.startswith("[") and isinstance(at, list):
            at = at[int(part[1:-1])]
        elif isinstance(at, Mapping) and part in at:
            at = at[part]
        else:
            return None
    return at


def _copied(raw: Any) -> Any:
    if isinstance(raw, dict):
        return {key: _copied(value) for key, value in raw.items()}
    return [_copied(value) for value in raw] if isinstance(raw, list) else raw


def _prune(raw: Any, location: tuple[int | str, ...]) -> None:
    """Take the value at ``location`` out (a list keeps its places: its entry becomes None)."""
    *path, last = location
    for part in path:
        try:
            raw = raw[part]
        except (KeyError, IndexError, TypeError):
            return
    if isinstance(raw, dict):
        raw.pop(last, None)
