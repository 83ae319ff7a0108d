"""This module refuses, in one sentence, what the contact engine cannot do in a pymunk space."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import pymunk

from pool_pymunk.model.places import TOUCHING, lies_in, overlap, room_beside_ball, said
from pool_pymunk.model.plain import Unfit, argument, between, pair, size
from pool_pymunk.model.problems import (
    setting_error,
    shown,
    suggestion,
)
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.laws import LAWS, Law, find_law
from pool_pymunk.physics.sides import Wall
from pool_pymunk.world.ball import Ball
from pool_pymunk.world.outlook import room

LONGEST = 1.0 + 1e-9  # of the longest step; rounding may make a step so much longer


def check_space(space: Any) -> None:
    """Refuse what is no space, and a space of threads."""
    if not isinstance(space, pymunk.Space):
        raise setting_error("space", shown(space), "must be a pymunk.Space")
    if space.threaded:
        raise setting_error("space", "threaded", "Billiards needs a space without threads")


def read_size(key: str, value: Any) -> float:
    """Read a number greater than 0."""
    return argument(key, value, size)


def read_share(key: str, value: Any) -> float:
    """Read a number between 0 and 1."""
    return argument(key, value, between(0.0, 1.0))


def read_from_zero(key: str, value: Any) -> float:
    """Read a number from 0 on."""
    return argument(key, value, between(0.0))


def read_vector(key: str, value: Any) -> Vector:
    """Read two finite numbers."""
    try:
        x, y = pair(tuple(value) if isinstance(value, pymunk.Vec2d) else value)
    except Unfit as unfit:
        raise setting_error(key, shown(value), str(unfit)) from None
    if not math.isfinite(x + y):
        raise setting_error(key, shown(value), "must be two finite numbers")
    return x, y


def check_choice(key: str, value: Any, choices: Sequence[str]) -> None:
    """Refuse what is none of the choices."""
    if value not in choices:
        message = f"must be one of {', '.join(choices)}{suggestion(value, choices)}"
        raise setting_error(key, value, message)


def read_law(law: Any) -> Law:
    """Return the law of that name, or the law itself."""
    if isinstance(law, Law):
        return law
    if not isinstance(law, str) or law not in LAWS:
        message = f"must be one of {', '.join(LAWS)}, or an object of the class Law"
        raise setting_error("law", shown(law), message + suggestion(law, LAWS))
    return find_law(law)


def check_circle(circle: Any) -> None:
    """Refuse what cannot be a ball."""
    if not isinstance(circle, pymunk.Circle):
        raise setting_error("circle", _kind(circle), "a ball must be a pymunk.Circle")
    body = circle.body
    if body is None:
        raise setting_error("circle", _kind(circle), "a ball's circle must have a body")
    if body.body_type != pymunk.Body.DYNAMIC:
        raise setting_error("circle", _kind(circle), "a ball's body must be dynamic")
    if tuple(circle.offset) != (0.0, 0.0):
        message = "a ball's circle must lie in the middle of its body"
        raise setting_error("circle.offset", list(circle.offset), message)
    read_size("circle.radius", circle.radius)
    if body.mass == 0.0 and circle.mass > 0.0:
        message = "must be greater than 0: the circle's own mass counts once it is in a space"
        raise setting_error("circle.body.mass", 0.0, message)
    read_size("circle.body.mass", body.mass)
    read_vector("circle.body.position", body.position)
    read_vector("circle.body.velocity", body.velocity)
    _check_type("circle", circle)


def check_unchanged(ball: Ball, mass: float) -> None:
    """Refuse a ball of which something is not what it was when it came to the table."""
    circle, body = ball.circle, ball.body
    said: list[tuple[str, Any, Any]] = [
        ("body_type", body.body_type, pymunk.Body.DYNAMIC),
        ("mass", body.mass, mass),
        ("collision_type", circle.collision_type, ball.type),
        ("offset", tuple(circle.offset), (0.0, 0.0)),
    ]
    if circle is not ball.sensor:
        said.append(("radius", circle.radius, ball.radius))
        said.append(("filter", circle.filter, ball.sensor.filter))
    for key, now, was in said:
        if now != was:
            message = (
                f"it was {was} when the ball came to the table; to change it, remove the ball "
                "and add its circle again"
            )
            raise setting_error(f"ball {ball.number}: {key}", now, message)


def warn_of_lengths(sides: Iterable[object]) -> None:
    """Warn of sides of one's own that answer after which length of a straight path, not when."""
    for side in sides:
        if not hasattr(side, "time_of_contact"):
            text = f"{type(side).__name__}.length_along: define time_of_contact(path, r, now)"
            warnings.warn(text, DeprecationWarning, stacklevel=3)


def check_wall(shape: Any) -> None:
    """Refuse what cannot be a wall."""
    if not isinstance(shape, pymunk.Segment | pymunk.Circle | pymunk.Poly):
        message = "a wall must be a pymunk.Segment, Circle or Poly"
        raise setting_error("shape", _kind(shape), message)
    if shape.body is None or shape.body.body_type != pymunk.Body.STATIC:
        raise setting_error("shape", _kind(shape), "a wall's body must be static, as walls stand")
    if isinstance(shape, pymunk.Segment) and shape.a == shape.b:
        raise setting_error("shape", _kind(shape), "a segment must have two ends")
    _check_type("shape", shape)


def _check_type(key: str, shape: pymunk.Shape) -> None:
    """Refuse a collision type of the user's, because Billiards needs its own."""
    if shape.collision_type != 0:
        message = "Billiards needs a collision type of its own: use on_contact instead of handlers"
        raise setting_error(f"{key}.collision_type", shape.collision_type, message)


def check_place(
    center: Vector,
    radius: float,
    discs: Mapping[int, tuple[Vector, float]],
    obstacles: Sequence[tuple[pymunk.Shape | None, Wall]],
) -> None:
    """Refuse a ball that lies in another ball, a wall or a pocket."""
    for shape, wall in obstacles:
        left = room(center, radius, shape, wall)
        if lies_in(wall, left, *center, radius):
            how, what = ("is within", "pocket") if wall.is_pocket else ("overlaps", "wall")
            message = said("the ball", f"{what} {wall.number}", left, radius, how=how)
            raise setting_error("position", list(center), message)
    for number, (place, other) in discs.items():
        if overlap(*center, radius, *place, other, TOUCHING):
            left = room_beside_ball(*center, radius, *place, other)
            message = said("the ball", f"ball {number}", left, min(radius, other))
            raise setting_error("position", list(center), message)


def check_step(dt: float, longest: float) -> None:
    """Refuse a step (s) that is no time, or a longer one than was agreed."""
    if not dt > 0.0:
        raise setting_error("dt", dt, "a step must be greater than 0")
    if dt > LONGEST * longest:
        raise setting_error("dt", dt, f"a step may be {longest:g} s long at most (max_dt)")


def _kind(thing: object) -> str:
    return type(thing).__name__
