"""The parts of a scene: balls, coefficients, physics and shots, each checked when it is made."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any

from pool_pymunk.model.keys import (
    Angle,
    Color,
    Ends,
    Factor,
    Flag,
    Gap,
    Key,
    Length,
    Mass,
    Name,
    Number,
    Part,
    Place,
    Share,
    Speed,
    Text,
    Time,
    Velocity,
)
from pool_pymunk.model.plain import Unfit, choice, name, text
from pool_pymunk.model.problems import LEFT_OUT, Point, Problem
from pool_pymunk.physics.laws import LAWS

STANDARD_GRAVITY = 9.80665  # m/s^2
NEAREST = "nearest"  # what a shot may aim at instead of a ball's id
LAUNCH = ("velocity", "speed", "angle", "aim")  # what a shot may say about its start


def _ball_id(value: Any) -> str:
    if value == NEAREST:
        raise Unfit("means the nearest ball in a shot: choose another id")
    return name(value)


def _target(value: Any) -> str:
    if not isinstance(value, str):
        raise Unfit('must be the id of a ball, in "quotes"; for a direction in degrees write angle')
    return text(value)


@dataclass(frozen=True, slots=True)
class Ball(Part):
    """A disc that slides without turning: position (m), radius (m), mass (kg), velocity (m/s).

    Where the scene has ``Friction.rolling``, it is a solid sphere. Its ``roll`` is a share of its
    velocity: 1 rolls, 0 slides without rotation, and a negative one draws.
    """

    id: Annotated[str, Key(_ball_id)]
    position: Place
    radius: Length
    mass: Mass
    cue: Flag = False
    velocity: Velocity = (0.0, 0.0)
    color: Color | None = None
    roll: Factor = 0.0


@dataclass(frozen=True, slots=True)
class Pocket(Part):
    """A pocket is a circle on the plane: position (m), radius (m).

    A ball whose centre comes within the radius is pocketed at that instant: it leaves the table,
    rests at the pocket's position, and meets nothing any more.
    """

    id: Name
    position: Place
    radius: Length


@dataclass(frozen=True, slots=True)
class Post(Part):
    """A post is a round obstacle that balls bounce off as off a cushion: position (m), radius (m).

    With radius 0 it is a pin. It has the coefficients of the cushions unless it has its own.

    >>> Post((1.0, 0.5), 0.05, restitution=0.9).friction is None
    True
    """

    position: Place
    radius: Gap
    restitution: Share | None = None
    friction: Number | None = None


@dataclass(frozen=True, slots=True)
class Restitution(Part):
    """Coefficients of restitution, each in [0, 1]; None where the scene never needs one."""

    ball_ball: Share | None = None
    cue_ball: Share | None = None
    cushion: Share | None = None


@dataclass(frozen=True, slots=True)
class Friction(Part):
    """Coefficients of friction, each >= 0; 0 is not modelled.

    With ``rolling`` balls slide, then roll; ``surface`` is that of sliding, and not below it.
    """

    surface: Number = 0.0
    cushion: Number = 0.0
    ball_ball: Number = 0.0
    rolling: Number | None = None

    def _problems(self) -> Iterator[Problem]:
        """Find friction of rolling that is above that of sliding."""
        if self.rolling is not None and self.rolling > self.surface:
            message = f"must not be above surface ({self.surface:g})"
            yield Problem("rolling", self.rolling, message)


@dataclass(frozen=True, slots=True)
class Physics(Part):
    """The contact law's name, gravity (m/s^2), and when to stop at the latest (s)."""

    law: Annotated[str, Key(choice(LAWS))] = "coulomb"
    gravity: Number = STANDARD_GRAVITY
    max_time: Time | None = None


@dataclass(frozen=True, slots=True)
class Shot(Part):
    """A shot gives one ball a ``velocity`` (m/s), or a ``speed`` (m/s) and where it goes.

    Beside the speed stands an ``angle`` (degrees, counter-clockwise from +x), or a ball to ``aim``
    at, by its id or as "nearest". ``from_previous`` goes on from where the shot before ended.
    ``published`` are reference ends to compare with (m). ``roll`` is a share of the ball's velocity
    (follow is positive, draw negative), in a scene with ``Friction.rolling``. With a ``place`` (m)
    the ball begins there (ball in hand), even if it was pocketed before.

    >>> Shot("break", "C", speed=2.0, angle=0.0).launch
    (2.0, 0.0)
    """

    name: Name
    ball: Text
    velocity: Velocity | None = None
    speed: Speed | None = None
    aim: Annotated[str, Key(_target)] | None = None
    from_previous: Flag = False
    published: Ends = field(default_factory=dict, hash=False)
    angle: Angle | None = None
    roll: Factor = 0.0
    place: Place | None = None

    def __repr__(self) -> str:
        said = {key: getattr(self, key) for key in LAUNCH}
        parts = [f"{key}={value!r}" for key, value in said.items() if value is not None]
        if self.roll != 0.0:
            parts.append(f"roll={self.roll!r}")
        if self.place is not None:
            parts.append(f"place={self.place!r}")
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
        """Find out whether the shot says once how it starts."""
        if self.velocity is not None:
            yield from beside("velocity", speed=self.speed, angle=self.angle, aim=self.aim)
        elif self.angle is not None and self.speed is not None:
            yield from beside("angle", aim=self.aim)
        elif self.speed is None and (self.angle is not None or self.aim is not None):
            turned = "aim" if self.angle is None else "angle"
            yield Problem("speed", LEFT_OUT, f"is missing beside {turned}")
        elif self.speed is None:
            yield Problem("velocity", LEFT_OUT, "is missing (or speed and angle, or speed and aim)")
        elif self.aim is None:
            yield Problem("angle", LEFT_OUT, "is missing beside speed (or aim)")


def beside(other: str, **values: object) -> Iterator[Problem]:
    """Find what stands beside ``other``, though it says the same as that."""
    for key, value in values.items():
        if value is not None:
            yield Problem(key, value, f"stands beside {other}: one of the two")
