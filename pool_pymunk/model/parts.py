"""A scene has parts: balls, coefficients, physics and shots; each is checked when it is made."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any

from pool_pymunk.laws import LAWS
from pool_pymunk.model import plain
from pool_pymunk.model.outline import misdrawn
from pool_pymunk.model.plain import Key, Part, Unfit, name, one_of, text
from pool_pymunk.model.problems import LEFT_OUT, Point, Problem

STANDARD_GRAVITY = 9.80665  # m/s^2; the standard value (CGPM 1901), as in the report
NEAREST = "nearest"  # what a shot may aim at instead of a ball's id
LAUNCH = ("velocity", "speed", "angle", "aim")  # what a shot may say about its start


def _ball_id(value: Any) -> str:
    if value == NEAREST:
        raise Unfit("must be another id: in a shot it means the nearest ball")
    return name(value)


def _target(value: Any) -> str:
    if not isinstance(value, str):
        raise Unfit('must be the id of a ball, in "quotes"; for a direction in degrees write angle')
    return text(value)


@dataclass(frozen=True, slots=True)
class Ball(Part):
    """A ball is a disc that slides: position (m), radius (m), mass (kg), velocity (m/s).

    In a scene with ``Friction.rolling`` it is a solid sphere. Its ``roll`` is a share of its
    velocity: with 1 it rolls, with 0 it does not rotate, with less it rotates backwards (draw).
    """

    id: Annotated[str, Key(_ball_id), "The name by which shots and results know it."]
    position: Annotated[plain.Place, "The place of its centre."]
    radius: Annotated[plain.Length, "Its radius; default: that of [ball]."]
    mass: Annotated[plain.Mass, "Its mass; default: that of [ball]."]
    cue: Annotated[plain.Flag, "True for the cue ball, which shots strike by default."] = False
    velocity: Annotated[plain.Velocity, "How it moves at the start; default: it rests."] = (
        0.0,
        0.0,
    )
    color: Annotated[plain.Color, "Its colour in pictures; default: that of [ball]."] | None = None
    roll: Annotated[plain.Factor, "Its roll, as a share of its velocity: 1 rolls, 0 not."] = 0.0


@dataclass(frozen=True, slots=True)
class Pocket(Part):
    """A pocket is a circle on the plane: position (m), radius (m).

    A ball whose centre comes within the radius is pocketed at that instant: it leaves the table,
    rests at the pocket's position, and meets nothing any more.
    """

    id: Annotated[plain.Name, 'Its name; default: "1", "2" and so on.']
    position: Annotated[plain.Place, "The place of its middle."]
    radius: Annotated[plain.Length, "A ball whose centre comes within it is pocketed."]


@dataclass(frozen=True, slots=True)
class Post(Part):
    """A post is a round obstacle that balls bounce off as off a cushion: position (m), radius (m).

    With radius 0 it is a pin. It has the coefficients of the cushions unless it has its own.

    >>> Post((1.0, 0.5), 0.05, restitution=0.9).friction is None
    True
    """

    position: Annotated[plain.Place, "The place of its middle."]
    radius: Annotated[plain.Gap, "Its radius; 0: a pin."]
    restitution: Annotated[plain.Share, "Default: that of cushions."] | None = None
    friction: Annotated[plain.Number, "Default: that of cushions."] | None = None


@dataclass(frozen=True, slots=True)
class Patch(Part):
    """A patch is a region of the table with other friction, such as sand or ice.

    It has ``corners`` (m), or a ``center`` and a ``radius`` (m). ``surface`` and ``rolling`` are
    the coefficients of friction there; those that are None are the scene's. Where patches overlap,
    the last one holds a ball. The place of the ball's centre decides.

    >>> Patch(((1.0, 0.0), (2.0, 0.0), (2.0, 1.0)), surface=0.6).rolling is None
    True
    """

    corners: Annotated[plain.Corners, "The corners of a polygon; or: center and radius."] = ()
    center: Annotated[plain.Place, "The middle of a round patch."] | None = None
    radius: Annotated[plain.Length, "The radius of a round patch."] | None = None
    surface: Annotated[plain.Number, "Friction of sliding; default: that of [friction]."] | None = (
        None
    )
    rolling: Annotated[plain.Number, "Friction of rolling; default: that of [friction]."] | None = (
        None
    )

    def _problems(self) -> Iterator[Problem]:
        """Find a form that is missing, given twice, or no polygon."""
        if self.corners:
            yield from beside("corners", center=self.center, radius=self.radius)
            message = misdrawn(self.corners)
            if message:
                yield Problem("corners", [list(corner) for corner in self.corners], message)
            return
        lacks = [key for key in ("center", "radius") if getattr(self, key) is None]
        if len(lacks) == 2:
            yield Problem("corners", LEFT_OUT, "is missing (or center and radius)")
        elif lacks:
            message = "is missing (a round patch has center and radius)"
            yield Problem(lacks[0], LEFT_OUT, message)


@dataclass(frozen=True, slots=True)
class Restitution(Part):
    """These are coefficients of restitution, each in [0, 1]; None where none is needed."""

    ball_ball: Annotated[plain.Share, "Of hits of two balls; two balls need it."] | None = None
    cue_ball: Annotated[plain.Share, "Of hits of the cue ball; default: ball_ball."] | None = None
    cushion: Annotated[plain.Share, "Of hits on cushions; a table needs it."] | None = None


@dataclass(frozen=True, slots=True)
class Friction(Part):
    """These are coefficients of friction, each >= 0; 0 leaves that friction out.

    If ``rolling`` is given, balls slide and then roll; ``surface`` (sliding) is not below it.
    """

    surface: Annotated[plain.Number, "Of balls that slide on the table; default: 0."] = 0.0
    cushion: Annotated[plain.Number, "Of hits on cushions; default: 0."] = 0.0
    ball_ball: Annotated[plain.Number, "Of hits of two balls; default: 0."] = 0.0
    rolling: Annotated[plain.Number, "Of balls that roll; default: they slide."] | None = None

    def _problems(self) -> Iterator[Problem]:
        """Find friction of rolling that is above that of sliding."""
        if self.rolling is not None and self.rolling > self.surface:
            message = f"must not be above surface ({self.surface:g})"
            yield Problem("rolling", self.rolling, message)


@dataclass(frozen=True, slots=True)
class Physics(Part):
    """These are the contact law's name, gravity (m/s^2), and a run's latest end (s)."""

    law: Annotated[str, one_of(LAWS), "The contact law; default: coulomb."] = "coulomb"
    gravity: Annotated[plain.Number, "m/s^2; default: 9.80665."] = STANDARD_GRAVITY
    max_time: Annotated[plain.Time, "The latest end of a run (s); default: none."] | None = None


@dataclass(frozen=True, slots=True)
class Shot(Part):
    """A shot gives one ball a ``velocity`` (m/s), or a ``speed`` (m/s) and a direction.

    The direction is an ``angle`` (degrees, counter-clockwise from +x), or a ball to ``aim`` at, by
    its id or as "nearest". With ``from_previous`` it begins where the shot before it ended.
    ``published`` are reference ends (m). In a scene with ``Friction.rolling``, ``roll`` is a
    share of the ball's velocity (follow is positive, draw negative). With a ``place`` (m) the ball
    begins there (ball in hand), even if it was pocketed before.

    >>> Shot("break", "C", speed=2.0, angle=0.0).launch
    (2.0, 0.0)
    """

    name: Annotated[plain.Name, 'Its name; default: "Shot 1", "Shot 2" and so on.']
    ball: Annotated[plain.Text, "The ball that it strikes; default: the cue ball."]
    velocity: Annotated[plain.Velocity, "Or: speed and angle, or speed and aim."] | None = None
    speed: Annotated[plain.Speed, "Goes with an angle, or with aim."] | None = None
    aim: Annotated[str, Key(_target), 'The id of a ball, or "nearest".'] | None = None
    from_previous: plain.Flag = False
    published: Annotated[plain.Ends, "Reference ends to compare with."] = field(
        default_factory=dict, hash=False
    )
    angle: Annotated[plain.Angle, "In degrees, counter-clockwise from +x."] | None = None
    roll: Annotated[plain.Factor, "A share of the velocity: 1 follows, -1 draws, 0 not."] = 0.0
    place: Annotated[plain.Place, "The struck ball begins here: ball in hand."] | None = None

    def __repr__(self) -> str:
        usual = {"roll": 0.0, "from_previous": False}  # Others are usually None.
        parts = [repr(self.name), repr(self.ball)]
        for key in (*LAUNCH, "roll", "place", "from_previous"):
            if (value := getattr(self, key)) != usual.get(key):
                parts.append(f"{key}={value!r}")
        parts += [f"published=<ends: {len(self.published)}>"] if self.published else []
        return f"Shot({', '.join(parts)})"

    @property
    def launch(self) -> Point | None:
        """Return the velocity (m/s) at the start; None if it depends on where the balls are."""
        if self.speed is None or self.angle is None:
            return self.velocity
        angle = math.radians(self.angle)
        return (math.cos(angle) * self.speed, math.sin(angle) * self.speed)

    def _problems(self) -> Iterator[Problem]:
        """Find a start that is missing or given twice."""
        if self.velocity is not None:
            yield from beside("velocity", speed=self.speed, angle=self.angle, aim=self.aim)
        elif self.angle is not None and self.speed is not None:
            yield from beside("angle", aim=self.aim)
        elif self.speed is None and (self.angle is not None or self.aim is not None):
            turned = "aim" if self.angle is None else "angle"
            yield Problem("speed", LEFT_OUT, f"is missing ({turned} needs it)")
        elif self.speed is None:
            yield Problem("velocity", LEFT_OUT, "is missing (or speed and angle, or speed and aim)")
        elif self.aim is None:
            yield Problem("angle", LEFT_OUT, "is missing, or aim (speed needs one of them)")


def beside(other: str, **values: object) -> Iterator[Problem]:
    """Find each value that says the same as ``other``, which is also given."""
    for key, value in values.items():
        if value is not None:
            yield Problem(key, value, f"give either {other} or {key}")
