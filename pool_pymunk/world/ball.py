"""This module has the objects that users of a table get: balls, pairs, contacts, states."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from operator import attrgetter
from typing import Any, NamedTuple, Protocol

import pymunk

from pool_pymunk.core import ball as core
from pool_pymunk.core.motion.path import Motion, Path
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.laws import Pair
from pool_pymunk.model.plain import argument, between, size
from pool_pymunk.model.problems import setting_error, shown

SHARE, FROM_ZERO = between(0.0, 1.0), between(0.0)
HAIR = 1e-9  # This share of lengths and times is wider than rounding in a step.
Disc = tuple[Vector, float]  # a place and a radius (m)
TYPES = "dynamic", "kinematic", "static"  # as pymunk numbers them
# What stays of a ball, and where it has that. Hits ask for the first four.
IN_HITS = "body.body_type", "body.mass", "circle.radius", "circle.filter"
STAYS = *IN_HITS, "circle.offset", "body.center_of_gravity", "body.position_func"


class Named(Protocol):
    """A ball, a wall or a pocket has a name, by which errors call it."""

    @property
    def name(self) -> str: ...


class AsItCame:
    """This is how a ball, wall or pocket came to the table: nobody may change that there.

    ``places`` say where the ``thing`` has each of its features.
    """

    def __init__(self, what: str, thing: Named, places: Sequence[str]) -> None:
        self._what, self._thing, self._places = what, thing, places
        self._read = attrgetter(*places)
        self._was = self._read(thing)

    def refuse_changed(self) -> None:
        """Refuse what somebody has changed."""
        now = self._read(self._thing)
        if now == self._was:
            return
        each = zip(self._places, now, self._was, strict=True)
        place, new, old = next((place, new, old) for place, new, old in each if new != old)
        what, key = self._what, place.rpartition(".")[2]
        key = place if key in ("position", "angle") else key  # of a wall's body, not of the wall
        message = (
            f"it was {shown(plain(key, old))} when the {what} came to the table; to change it, "
            f"remove the {what} and add {'its circle' if what == 'ball' else 'it'} again"
        )
        raise setting_error(f"{what} {self._thing.name}: {key}", plain(key, new), message)


def plain(key: str, value: object) -> object:
    """Return the value of a feature as errors show it."""
    if isinstance(value, int) and key == "body_type":
        return TYPES[value]
    if callable(value):
        is_own = value != pymunk.Body.update_position
        return "a function of your own" if is_own else "that of all bodies"
    return value


class TablePath(NamedTuple):
    """A ball goes from a place at ``t`` (s) to ``end`` (s), with a constant acceleration.

    (``x``, ``y``) is the place in m, (``vx``, ``vy``) the velocity in m/s, (``ax``, ``ay``) the
    acceleration in m/s^2, and (``wx``, ``wy``) the roll in m/s. On a path that ``slows`` the ball
    comes to rest at the end.
    """

    t: float
    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
    end: float
    slows: bool
    wx: float
    wy: float

    @property
    def speed(self) -> float:
        """The speed (m/s) at the beginning."""
        return math.sqrt(self.vx * self.vx + self.vy * self.vy)

    def at(self, t: float) -> tuple[Vector, Vector]:
        """Return place (m) and velocity (m/s) at a time (s); SettingError before the path began."""
        if t < self.t:
            raise setting_error("t", t, f"this path began at {self.t:g} s")
        x, y, vx, vy = Path(*self).at(t)
        return (x, y), (vx, vy)


class TableBall:
    """A ball has a number, its circle and its body.

    ``id`` is the name that you gave it, or None. ``data`` is for what you want to keep with it; the
    table never reads it.
    """

    __slots__ = ("as_it_came", "body", "body_id", "circle", "core", "data", "follow", "id",
                 "in_hits", "own_filter", "shapes", "stays")  # fmt: skip
    as_it_came: AsItCame
    in_hits: AsItCame

    def __init__(
        self, circle: pymunk.Circle, core: core.Ball, follow: Callable[[], object]
    ) -> None:
        assert circle.body is not None
        self.circle, self.core, self.follow = circle, core, follow
        self.body, self.body_id = circle.body, circle.body.id
        self.id: str | None = None
        self.data: Any = None
        self.stays = True  # on the table
        self.own_filter = circle.filter  # as the user gave it
        self.shapes: tuple[pymunk.Shape, ...] = ()  # what leaves the space with it, and comes back

    def come(self) -> None:
        """Keep what nobody may change of the ball while it is on the table."""
        self.as_it_came = AsItCame("ball", self, STAYS)
        self.in_hits = AsItCame("ball", self, IN_HITS)

    @property
    def number(self) -> int:
        """The number of the ball: that of balls which were added before it."""
        return self.core.number

    @property
    def radius(self) -> float:
        """The radius (m) of the ball."""
        return self.core.radius

    @property
    def is_on_table(self) -> bool:
        """Tell whether the ball is on the table: nobody has pocketed or removed it."""
        return self.stays

    @property
    def name(self) -> str:
        """The number of the ball, and its id if it has one, as errors name it."""
        return f"{self.number}" if self.id is None else f'{self.number} (id "{self.id}")'

    @property
    def path(self) -> TablePath:
        """The ball's exact path; for ``on_contact`` it is the path after the contact."""
        self.follow()
        p = self.core.path
        return TablePath(p.t, p.x, p.y, p.vx, p.vy, p.ax, p.ay, p.end, p.slows, p.wx, p.wy)

    @property
    def sensor(self) -> pymunk.Circle:
        """The ball's circle: a ball has no other shape any more."""
        text = "a ball has no sensor any more: ball.circle is its only shape"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        return self.circle

    def __repr__(self) -> str:
        where = "" if self.is_on_table else ", off the table"
        name = self.number if self.id is None else repr(self.id)
        return f"<Ball {name} at {tuple(self.body.position)}{where}>"


class ContactEvent(NamedTuple):
    """A contact event tells of a hit, and when (s) it was, or that a persistent contact is over.

    ``balls`` are two balls, or one ball that met the wall of number ``wall``. They touched at
    ``point`` (m). ``normal`` is the unit vector from the first ball to the second, or from the wall
    to the ball, ``closing`` (m/s) is how fast they came together, and ``impulse`` (N s) how much
    momentum along the normal each gave to the other. ``tangential`` (N s) is what the second ball,
    or the ball at a wall, got along (-n_y, n_x). Bodies and paths of its balls are those after it.

    A persistent contact lasts from ``since`` (s) to ``t``; for a hit ``since`` is None. Its
    ``point`` and ``normal`` are those at its end, its ``closing`` is 0, and its ``impulse`` and
    ``tangential`` are the parts along this normal and tangent of all momentum that was given.
    """

    t: float
    balls: tuple[TableBall, ...]
    wall: int | None
    point: Vector
    normal: Vector
    closing: float
    impulse: float
    tangential: float
    since: float | None = None


def same_balls(
    restitution: float, friction: float, mass: float | None = None
) -> Callable[[int, int], Pair]:
    """Return the ``pair`` of a table of equal balls, of this ``mass`` (kg) or that of their bodies.

    >>> same_balls(0.9, 0.05, mass=0.2)(0, 1)
    Pair(m_a=0.2, m_b=0.2, restitution=0.9, friction=0.05)
    """
    m = math.nan if mass is None else argument("mass", mass, size)
    e = argument("restitution", restitution, SHARE)
    return partial(of_any_two, Pair(m, m, e, argument("friction", friction, FROM_ZERO)))


def of_any_two(pair: Pair, i: int, j: int) -> Pair:
    """Return the same pair for any two balls; unlike a lambda it can be pickled."""
    return pair


class TableState(NamedTuple):
    """A table's state has the time (s), and each ball's motion (m, m/s).

    Where balls roll, it has their ``rolls`` (m/s). For balls that gravity brings to rest,
    ``bounces`` say how long (s) those still last that are too low to be seen. Balls are numbers,
    so it can be pickled, and kept as JSON with all digits.

    >>> state = TableState(0.5, {0: (0.1, 0.2, 0.0, 0.0)})
    >>> state.to_json()
    '{"time": 0.5, "motions": {"0": [0.1, 0.2, 0.0, 0.0]}, "rolls": null}'
    >>> TableState.from_json(state.to_json()) == state
    True
    """

    time: float
    motions: dict[int, Motion]
    rolls: dict[int, Vector] | None = None
    bounces: dict[int, float] | None = None

    def to_json(self) -> str:
        """Return the state as JSON; it has no ``bounces`` where there are none."""
        found = self._asdict()
        return json.dumps(found if self.bounces else {k: found[k] for k in self._fields[:3]})

    @classmethod
    def from_json(cls, text: str) -> TableState:
        """Return the state of which :meth:`to_json` gave this text; ValueError for another one."""
        try:
            found = json.loads(text)
            motions = {int(i): (x, y, u, v) for i, (x, y, u, v) in found["motions"].items()}
            rolls = found["rolls"] and {int(i): (x, y) for i, (x, y) in found["rolls"].items()}
            bounces = found.get("bounces") and {int(i): t for i, t in found["bounces"].items()}
            rows = [*motions.values(), *(rolls or {}).values(), (bounces or {}).values()]
            is_sound = math.isfinite(sum(map(abs, chain([found["time"]], *rows))))
        except (AttributeError, KeyError, TypeError, ValueError):
            is_sound = False
        if not is_sound:
            raise setting_error("text", shown(text), "must be what to_json of a state gave")
        return cls(found["time"], motions, rolls, bounces)
