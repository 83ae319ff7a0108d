"""This module refuses, in one sentence, what the contact engine cannot do in a pymunk space."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from inspect import signature
from operator import attrgetter
from typing import Any

import pymunk

from pool_pymunk.core.motion.path import LOST, Motion
from pool_pymunk.core.motion.surface import Rolling, Sliding, Surface
from pool_pymunk.core.motion.times import EPSILON, Vector
from pool_pymunk.laws import Pair
from pool_pymunk.model.plain import argument, check_choice, finite, number, point, size
from pool_pymunk.model.plain import read_law as read_law
from pool_pymunk.model.problems import LARGEST, setting_error, shown
from pool_pymunk.world.ball import FROM_ZERO, HAIR, SHARE, TableBall

# Balls and walls of a table are in this group of filters, so that pymunk leaves their pairs out.
GROUP = 0x42616C6C

OF_SPACES = "gravity", "damping"
OF_CIRCLES = "body.position", "body.velocity"
OF_WALLS = "position", "velocity", "angle", "angular_velocity"
OF_BALLS = "position", "velocity", "force", "angular_velocity", "torque"

ELSEWHERE = "its body is in another space"

Drawn = pymunk.Segment | pymunk.Circle | pymunk.Poly


def check_settings(space: Any, pair: Any) -> None:
    """Refuse impossible settings of a table."""
    if not isinstance(space, pymunk.Space):
        raise setting_error("space", shown(space), "must be a pymunk.Space")
    if space.threaded:
        raise setting_error("space", "threaded", "Billiards needs a space without threads")
    if "step" in vars(space):
        raise setting_error("space", "taken", "this space has a Billiards already")
    if not callable(pair) or not _takes_two(pair):
        raise setting_error("pair", shown(pair), "must be a function of two balls' numbers")


def refuse_contacts(contacts: Any, stacklevel: int = 3) -> None:
    """Refuse the former setting ``contacts`` unless it is "swept", which warns and does nothing."""
    if contacts is None:
        return
    check_choice("contacts", contacts, ("swept", "discrete"))
    if contacts == "discrete":
        message = 'is a solver of its own now; ask for solver="pymunk-discrete"'
        raise setting_error("contacts", contacts, message)
    text = 'contacts="swept" does nothing: every contact is at its true time'
    warnings.warn(text, DeprecationWarning, stacklevel=stacklevel)


def _takes_two(function: Callable[..., object]) -> bool:
    """Tell whether a function takes two arguments, or has no signature that could say so."""
    try:
        signature(function).bind(0, 1)
    except TypeError:
        return False
    except ValueError:  # A built-in function may have no signature.
        return True
    return True


def check_function(name: str, value: object) -> None:
    """Refuse a callback that cannot be called."""
    if value is not None and not callable(value):
        raise setting_error(name, shown(value), "must be a function, or None")


def read_surface(deceleration: Any, rolling: Any) -> Surface:
    """Return the surface on which balls slide, or slide and roll (m/s^2)."""
    pull = argument("deceleration", deceleration, FROM_ZERO)
    if rolling is None:
        return Sliding(pull)
    drag = argument("rolling", rolling, FROM_ZERO)
    if drag > pull:
        message = f"must not be above the deceleration of sliding, {pull:g}"
        raise setting_error("rolling", drag, message)
    return Rolling(pull, drag)


def read_strike(velocity: Any, roll: Any, surface: Surface) -> tuple[Vector, Vector]:
    """Return the velocity (m/s) of a strike, and the roll (m/s), given as a share of it."""
    (vx, vy), share = argument("velocity", velocity, point), argument("roll", roll, finite)
    if share and not surface.rolls:
        raise setting_error("roll", share, "balls do not roll on a table without rolling")
    return (vx, vy), argument("roll", (share * vx, share * vy), point)


def check_pair(pair: Pair, masses: tuple[float, float], numbers: tuple[int, int]) -> Pair:
    """Return the pair with the masses of the bodies; refuse other masses, and what is no Pair."""
    if not isinstance(pair, Pair):
        message = (
            f"must be a Pair for balls {numbers[0]} and {numbers[1]}, such as same_balls gives"
        )
        raise setting_error("pair", shown(pair), message)
    argument("pair: restitution", pair.restitution, SHARE)
    argument("pair: friction", pair.friction, FROM_ZERO)
    for mass, own, i in zip((pair.m_a, pair.m_b), masses, numbers, strict=True):
        if not math.isnan(mass) and mass != own:
            message = f"the body of ball {i} has a mass of {own:g}"
            raise setting_error("pair", f"a mass of {mass:g}", message)
    return pair._replace(m_a=masses[0], m_b=masses[1])


def check_circle(circle: Any, t: float, space: pymunk.Space) -> None:
    """Refuse what cannot be a ball of a space; a step ends at ``t`` (s)."""
    body: Any = getattr(circle, "body", None)
    message = ""
    if not isinstance(circle, pymunk.Circle):
        message = "a ball must be a pymunk.Circle"
    elif body is None:
        message = "a ball's circle must have a body"
    elif body.body_type != pymunk.Body.DYNAMIC:
        message = "a ball's body must be dynamic"
    elif circle.sensor:
        message = "a ball's circle must not be a sensor, which nothing in a space meets"
    if message:
        raise setting_error("circle", type(circle).__name__, message)
    if tuple(circle.offset) != (0.0, 0.0):
        message = "a ball's circle must lie in the middle of its body"
        raise setting_error("circle.offset", list(circle.offset), message)
    if body.mass == 0.0 and circle.mass > 0.0:
        message = "must be greater than 0: the circle's own mass counts once it is in a space"
        raise setting_error("circle.body.mass", 0.0, message)
    argument("circle.radius", circle.radius, size)
    argument("circle.body.mass", body.mass, size)
    check_numbers("circle.", circle, OF_CIRCLES)
    check_speed("circle.body.velocity", body.velocity, circle.radius, t)
    _check_filter("circle", circle)
    if body.space not in (None, space):
        raise setting_error("circle", type(circle).__name__, ELSEWHERE)


def check_numbers(name: str, thing: object, keys: Iterable[str]) -> None:
    """Refuse numbers and points of a thing that are not finite; its ``name`` stands before keys."""
    for key in keys:
        value = attrgetter(key)(thing)
        is_point = isinstance(value, tuple)
        argument(name + key, tuple(value) if is_point else value, point if is_point else finite)


def is_too_fast(velocity: Vector, radius: float, t: float) -> bool:
    """Tell whether a rounding error of the time (s) moves a ball (m, m/s) by ``LOST`` radii."""
    speed = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1])
    return not (speed * EPSILON * t <= LOST * radius and speed < math.inf)


def check_speed(key: str, velocity: Vector, radius: float, t: float) -> None:
    """Refuse a velocity (m/s) at which a time (s) does not tell where a ball is."""
    if is_too_fast(velocity, radius, t):
        message = f"is so fast that the clock, at {t:g} s, cannot tell when the ball meets a wall"
        raise setting_error(key, list(velocity), message)


def check_sound(ball: TableBall, t: float) -> None:
    """Refuse numbers of a ball's body that are not finite, or too large; a step ends at ``t`` s."""
    name = f"ball {ball.name}: "
    check_numbers(name, ball.body, OF_BALLS)
    check_speed(name + "velocity", ball.body.velocity, ball.radius, t)


def check_space(space: pymunk.Space) -> None:
    """Refuse gravity and damping of a space that are not finite, or too large."""
    (gx, gy), damping = space.gravity, space.damping
    if not abs(gx) + abs(gy) + abs(damping) <= LARGEST:
        check_numbers("", space, OF_SPACES)


def check_motion(wall: int, body: pymunk.Body) -> None:
    """Refuse a wall whose body has a number that is not finite, or too large."""
    (x, y), (vx, vy), angle, turns = body.position, body.velocity, body.angle, body.angular_velocity
    if not abs(x) + abs(y) + abs(vx) + abs(vy) + abs(angle) + abs(turns) <= LARGEST:
        check_numbers(f"wall {wall}: ", body, OF_WALLS)


def is_sound(ball: TableBall, motion: Motion, t: float) -> bool:
    """Tell whether a place and a velocity are finite, and not too large at a time (s)."""
    is_small = sum(map(abs, motion)) <= LARGEST
    return is_small and not is_too_fast(motion[2:], ball.radius, t)


def check_wall(shape: Any, space: pymunk.Space, has_sides: bool) -> Drawn:
    """Return the shape of a wall, which may have other sides; refuse what cannot be one."""
    message = ""
    if not isinstance(shape, pymunk.Segment | pymunk.Circle | pymunk.Poly):
        message = "a wall must be a pymunk.Segment, Circle or Poly"
    elif shape.body is None:
        message = "its body is gone, because a shape does not keep its body: keep the body yourself"
    elif shape.body.body_type == pymunk.Body.DYNAMIC:
        message = "a wall's body must be static, or kinematic for a wall that moves"
    elif shape.sensor and not has_sides:
        message = "balls do not bounce off a sensor: set sensor to False, or give sides"
    elif isinstance(shape, pymunk.Segment) and shape.a == shape.b:
        message = "a segment must have two ends"
    elif not all(map(math.isfinite, (*shape.cache_bb(), shape.radius, shape.body.angle))):
        message = "its place and size must be finite numbers"
    else:
        _check_filter("shape", shape)
        if shape.body.space in (None, space):
            return shape
        message = ELSEWHERE
    raise setting_error("shape", type(shape).__name__, message)


def _check_filter(key: str, shape: pymunk.Shape) -> None:
    """Refuse a group of filters of the user's, because Billiards needs its own."""
    if shape.filter.group == GROUP:
        message = "this shape is a ball, a wall or a pocket of a table already"
        raise setting_error(key, "taken", message)
    if shape.filter.group != 0:
        message = "Billiards needs a group of its own: use categories and masks"
        raise setting_error(f"{key}.filter.group", shape.filter.group, message)


def set_apart(shape: pymunk.Shape) -> None:
    """Let pymunk leave out the pairs of a ball or wall with others of the table."""
    own = shape.filter
    shape.filter = pymunk.ShapeFilter(GROUP, own.categories, own.mask)


def check_id(id_: Any, balls: Iterable[TableBall]) -> None:
    """Refuse an id of a new ball that is no text, or is that of a ball on the table."""
    if not isinstance(id_, str | None):
        raise setting_error("id", shown(id_), "must be a text")
    if id_ is not None and id_ in [ball.id for ball in balls]:
        raise setting_error("id", id_, "another ball on the table has this id")


def check_return(ball: TableBall, ball_of: Mapping[int, TableBall], space: pymunk.Space) -> None:
    """Refuse that a ball comes back whose body is another ball's, or whose id is."""
    if (other := ball_of.get(ball.body.id)) is not None:
        message = f"the ball cannot come back: its body is that of ball {other.name} now"
        raise setting_error("ball", ball.name, message)
    if ball.body.space not in (None, space):
        raise setting_error("ball", ball.name, "its body is in another space now")
    check_id(ball.id, ball_of.values())


def check_step(dt: float, longest: float) -> None:
    """Refuse a step (s) that is not above 0, or that is above the ``longest`` one."""
    if not argument("dt", dt, number) > 0.0:
        raise setting_error("dt", dt, "a step must be greater than 0")
    if dt > (1.0 + HAIR) * longest:
        raise setting_error("dt", dt, f"a step may be {longest!r} s long at most (max_dt)")
