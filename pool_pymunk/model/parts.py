"""The parts of a scene: balls, coefficients, physics and shots, each checked when it is made."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

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
)
from pool_pymunk.physics.laws import LAWS

STANDARD_GRAVITY = 9.80665  # m/s^2
NEAREST = "nearest"  # what a shot may aim at instead of a ball's id


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
class Restitution:
    """Coefficients of restitution, each in [0, 1]; None where the scene never needs one."""

    ball_ball: float | None = None
    cue_ball: float | None = None
    cushion: float | None = None

    def __post_init__(self) -> None:
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
        raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        if self.law not in LAWS:
            yield Problem("law", self.law, f"must be one of {', '.join(LAWS)}")
        yield from number_problems("gravity", self.gravity, 0.0)
        if self.max_time is not None:
            yield from size_problems("max_time", self.max_time)


@dataclass(frozen=True, slots=True)
class Shot:
    """What is done to one ball: a ``velocity`` (m/s), or a ``speed`` and a ball to ``aim`` at.

    ``aim`` is a ball's id or "nearest". ``from_previous`` goes on from where the shot before
    ended. ``published`` are reference ends to compare with (m).
    """

    name: str
    ball: str
    velocity: Point | None = None
    speed: float | None = None
    aim: str | None = None
    from_previous: bool = False
    published: Mapping[str, Point] = field(default_factory=dict)

    def __post_init__(self) -> None:
        raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("name", self.name)
        if self.velocity is not None:
            yield from point_problems("velocity", self.velocity)
            if self.aim is not None:
                yield Problem("aim", self.aim, "stands beside velocity: one of the two")
        elif self.speed is None or self.aim is None:
            yield Problem("velocity", LEFT_OUT, "is wanted (or speed and angle, or speed and aim)")
        if self.speed is not None:
            yield from number_problems("speed", self.speed, 0.0)
        for id_, end in self.published.items():
            yield from point_problems(f"published.{key_of(id_)}", end)
