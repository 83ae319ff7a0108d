"""The parts of a scene: balls, coefficients, physics and shots, each checked when it is made."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from pool_pymunk.model.plain import Unfit, ends, flag, make_plain, number, optional, point, text
from pool_pymunk.model.problems import (
    LEFT_OUT,
    Point,
    Problem,
    key_of,
    name_problems,
    number_problems,
    point_problems,
    raise_any,
    size_problems,
    suggestion,
)
from pool_pymunk.physics.laws import LAWS

STANDARD_GRAVITY = 9.80665  # m/s^2
NEAREST = "nearest"  # what a shot may aim at instead of a ball's id
NO_TARGET = 'must be the id of a ball, in "quotes"; for a direction in degrees write angle'


@dataclass(frozen=True, slots=True)
class Ball:
    """A disc that slides without turning: position (m), radius (m), mass (kg), velocity (m/s)."""

    id: str
    position: Point
    radius: float
    mass: float
    cue: bool = False
    velocity: Point = (0.0, 0.0)
    color: str | None = None

    def __post_init__(self) -> None:
        make_plain(
            self, id=text, position=point, radius=number, mass=number, cue=flag, velocity=point,
            color=optional(text),
        )  # fmt: skip
        raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("id", self.id)
        if self.id == NEAREST:
            yield Problem("id", self.id, "means the nearest ball in a shot: choose another id")
        yield from point_problems("position", self.position)
        yield from size_problems("radius", self.radius)
        yield from size_problems("mass", self.mass)
        yield from point_problems("velocity", self.velocity)
        if self.color is not None and not re.fullmatch("#[0-9A-Fa-f]{6}", self.color):
            yield Problem("color", self.color, 'must be "#rrggbb", six hexadecimal digits')


@dataclass(frozen=True, slots=True)
class Pocket:
    """A pocket is a circle on the plane: position (m), radius (m).

    A ball whose centre comes within the radius is pocketed at that instant: it leaves the table,
    rests at the pocket's position, and meets nothing any more.
    """

    id: str
    position: Point
    radius: float

    def __post_init__(self) -> None:
        make_plain(self, id=text, position=point, radius=number)
        raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("id", self.id)
        yield from point_problems("position", self.position)
        yield from size_problems("radius", self.radius)


@dataclass(frozen=True, slots=True)
class Restitution:
    """Coefficients of restitution, each in [0, 1]; None where the scene never needs one."""

    ball_ball: float | None = None
    cue_ball: float | None = None
    cushion: float | None = None

    def __post_init__(self) -> None:
        make_plain(self, **dict.fromkeys(self.__slots__, optional(number)))
        raise_any(
            problem
            for key in self.__slots__
            if (value := getattr(self, key)) is not None
            for problem in number_problems(key, value, 0.0, 1.0)
        )


@dataclass(frozen=True, slots=True)
class Friction:
    """Coefficients of friction, each >= 0; 0 is not modelled."""

    surface: float = 0.0
    cushion: float = 0.0
    ball_ball: float = 0.0

    def __post_init__(self) -> None:
        make_plain(self, **dict.fromkeys(self.__slots__, number))
        raise_any(
            problem
            for key in self.__slots__
            for problem in number_problems(key, getattr(self, key), 0.0)
        )


@dataclass(frozen=True, slots=True)
class Physics:
    """The contact law's name, gravity (m/s^2), and when to stop at the latest (s)."""

    law: str = "coulomb"
    gravity: float = STANDARD_GRAVITY
    max_time: float | None = None

    def __post_init__(self) -> None:
        make_plain(self, law=text, gravity=number, max_time=optional(number))
        raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        if self.law not in LAWS:
            yield Problem(
                "law", self.law, f"must be one of {', '.join(LAWS)}{suggestion(self.law, LAWS)}"
            )
        yield from number_problems("gravity", self.gravity, 0.0)
        if self.max_time is not None:
            yield from size_problems("max_time", self.max_time)


@dataclass(frozen=True, slots=True)
class Shot:
    """What is done to one ball: a ``velocity`` (m/s), or a ``speed`` (m/s) and where it goes.

    Beside the speed stands an ``angle`` (degrees, counter-clockwise from +x), or a ball to ``aim``
    at, by its id or as "nearest". ``from_previous`` goes on from where the shot before ended.
    ``published`` are reference ends to compare with (m).

    >>> Shot("break", "C", speed=2.0, angle=0.0).launch
    (2.0, 0.0)
    """

    name: str
    ball: str
    velocity: Point | None = None
    speed: float | None = None
    aim: str | None = None
    from_previous: bool = False
    published: Mapping[str, Point] = field(default_factory=dict, hash=False)
    angle: float | None = None

    def __post_init__(self) -> None:
        make_plain(
            self, name=text, ball=text, velocity=optional(point), speed=optional(number),
            aim=optional(_target), from_previous=flag, published=ends, angle=optional(number),
        )  # fmt: skip
        raise_any(self._problems())

    def __repr__(self) -> str:
        said = {key: getattr(self, key) for key in ("velocity", "speed", "angle", "aim")}
        parts = [f"{key}={value!r}" for key, value in said.items() if value is not None]
        if self.from_previous:
            parts.append("from_previous=True")
        if self.published:
            parts.append(f"published=<ends: {len(self.published)}>")
        return f"Shot({', '.join([repr(self.name), repr(self.ball), *parts])})"

    @property
    def launch(self) -> Point | None:
        """Return the velocity (m/s) at the start; None if it depends on where the balls are."""
        if self.speed is None or self.angle is None:
            return self.velocity
        angle = math.radians(self.angle)
        return (math.cos(angle) * self.speed, math.sin(angle) * self.speed)

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("name", self.name)
        yield from self._launch_problems()
        if self.velocity is not None:
            yield from point_problems("velocity", self.velocity)
        if self.speed is not None:
            yield from number_problems("speed", self.speed, 0.0)
        if self.angle is not None and not math.isfinite(self.angle):
            yield Problem("angle", self.angle, "must be a finite number")
        for id_, end in self.published.items():
            yield from point_problems(f"published.{key_of(id_)}", end)

    def _launch_problems(self) -> Iterator[Problem]:
        """Find out whether the shot says in one way how it starts."""
        if self.velocity is not None:
            yield from beside("velocity", speed=self.speed, angle=self.angle, aim=self.aim)
        elif self.angle is not None and self.speed is not None:
            yield from beside("angle", aim=self.aim)
        elif self.speed is None and (self.angle is not None or self.aim is not None):
            turned = "aim" if self.angle is None else "angle"
            yield Problem("speed", LEFT_OUT, f"is wanted beside {turned}")
        elif self.speed is None:
            yield Problem("velocity", LEFT_OUT, "is wanted (or speed and angle, or speed and aim)")
        elif self.aim is None:
            yield Problem("angle", LEFT_OUT, "is wanted beside speed (or aim)")


def _target(value: object) -> str:
    """Read the id of a ball to aim at."""
    if not isinstance(value, str):
        raise Unfit(NO_TARGET)
    return text(value)


def beside(other: str, **values: object) -> Iterator[Problem]:
    """Find what stands beside ``other``, though it says the same as that."""
    for name, value in values.items():
        if value is not None:
            yield Problem(name, value, f"stands beside {other}: one of the two")
