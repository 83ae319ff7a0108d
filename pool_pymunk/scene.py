"""What is on the table: frozen objects in SI units, checked when they are made.

A :class:`Scene` holds everything a solver may know. What a scene leaves out (a table, surface
friction, a second ball) is physics that no solver computes.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import NamedTuple

from pool_pymunk.physics.contact import Pair
from pool_pymunk.physics.laws import LAWS

Point = tuple[float, float]

STANDARD_GRAVITY = 9.80665  # m/s^2
LEFT_OUT = "(left out)"
NEAREST = "nearest"  # what a shot may aim at instead of a ball's id

# Balls may overlap by this share of the distance between their centres: a frozen rack's
# coordinates are rounded. ROUNDING covers the coordinates themselves, far from the origin.
TOUCHING = 1e-9
ROUNDING = 4 * 2.0**-52

# Numbers (SI) stay within these bounds, sizes within both: squares and products of a few of them
# stay in the range of floating point.
SMALLEST, LARGEST = 1e-100, 1e100
TOO_SMALL = f"is too small (less than {SMALLEST:g} in SI units)"
TOO_LARGE = f"is too large (more than {LARGEST:g} in SI units)"

MOST_SHOWN = 60  # characters of a value in a message
MOST_LISTED = 12  # names in a message
MOST_OVERLAPS = 100  # reported of one scene

UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 0.001},
    "speed": {"m/s": 1.0, "in/s": 0.0254},
}


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with a scene: where, what stands there, and what would be right."""

    key: str
    value: object
    message: str

    def __str__(self) -> str:
        value = LEFT_OUT if self.value is LEFT_OUT else shown(self.value)
        return _one_line(f"{self.key} = {value}: {self.message}")


class SceneError(ValueError):
    """A scene that cannot be simulated; ``problems`` lists everything that is wrong with it.

    >>> Ball("1", (0.0, 0.0), radius=-1.0, mass=math.nan)
    Traceback (most recent call last):
        ...
    pool_pymunk.scene.SceneError: radius = -1.0: must be greater than 0
    mass = nan: must be a finite number
    """

    def __init__(self, problems: Sequence[Problem], source: str = "") -> None:
        self.problems = tuple(problems)
        self.source = source
        prefix = _one_line(f"{source}: ") if source else ""
        super().__init__("\n".join(f"{prefix}{problem}" for problem in self.problems))


def shown(value: object) -> str:
    """A value as a scenario file writes it, shortened.

    >>> shown([True, "a", {"b": math.inf}])
    '[true, "a", {b = inf}]'
    """
    text = _toml(value, depth=3)
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."


def _toml(value: object, depth: int) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > 4 * MOST_SHOWN:
        return f"(a number of about {int(value.bit_length() * math.log10(2)) + 1} digits)"
    if isinstance(value, str):
        return f'"{_clipped(value)}"'
    if not isinstance(value, list | tuple | Mapping):
        return str(value)
    if depth == 0:
        return "..."
    if isinstance(value, Mapping):
        items = islice(value.items(), MOST_SHOWN)
        return "{" + ", ".join(f"{key_of(k)} = {_toml(v, depth - 1)}" for k, v in items) + "}"
    return "[" + ", ".join(_toml(v, depth - 1) for v in value[:MOST_SHOWN]) + "]"


def _clipped(text: str) -> str:
    return text if len(text) <= MOST_SHOWN - 2 else text[: MOST_SHOWN - 5] + "..."


def key_of(name: str) -> str:
    """A key as a scenario file writes it: bare where it can be, else in quotes.

    >>> key_of("8"), key_of("ball 8")
    ('8', '"ball 8"')
    """
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def listed(names: Collection[str]) -> str:
    """Names in a row; of many, the first."""
    first = ", ".join(_clipped(name) for name in islice(names, MOST_LISTED))
    more = len(names) - MOST_LISTED
    return first if more <= 0 else f"{first} and {more} more"


def _one_line(text: str) -> str:
    """Line breaks, tabs and what else does not print, as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _raise_any(problems: Iterable[Problem]) -> None:
    found = list(problems)
    if found:
        raise SceneError(found)


def number_problems(key: str, value: float, low: float, high: float = LARGEST) -> Iterator[Problem]:
    """What is wrong with a number that must be finite and lie between ``low`` and ``high``."""
    if not math.isfinite(value):
        yield Problem(key, value, "must be a finite number")
    elif high < LARGEST and not low <= value <= high:
        yield Problem(key, value, f"must be between {low:g} and {high:g}")
    elif value < low:
        yield Problem(key, value, f"must be {low:g} or more")
    elif value > high:
        yield Problem(key, value, TOO_LARGE)


def size_problems(key: str, value: float) -> Iterator[Problem]:
    """What is wrong with a number that must be greater than zero."""
    if value <= 0.0:
        message = "must be greater than 0" if math.isfinite(value) else "must be a finite number"
        yield Problem(key, value, message)
    elif value < SMALLEST:
        yield Problem(key, value, TOO_SMALL)
    else:
        yield from number_problems(key, value, 0.0)


def _point_problems(key: str, point: Point) -> Iterator[Problem]:
    if not (math.isfinite(point[0]) and math.isfinite(point[1])):
        yield Problem(key, list(point), "must be two finite numbers")
    elif max(map(abs, point)) > LARGEST:
        yield Problem(key, list(point), TOO_LARGE)


@dataclass(frozen=True, slots=True)
class Units:
    """The units a scenario is written and reported in; numbers inside are SI.

    >>> Units(length="in").from_si(0.0254, "length")
    1.0
    """

    length: str = "m"
    mass: str = "kg"
    speed: str = "m/s"

    def __post_init__(self) -> None:
        _raise_any(
            Problem(kind, getattr(self, kind), f"must be one of {', '.join(known)}")
            for kind, known in UNITS.items()
            if getattr(self, kind) not in known
        )

    def to_si(self, value: float, kind: str) -> float:
        """``value`` in this file's unit of ``kind`` (length, mass or speed), in SI."""
        return value * UNITS[kind][getattr(self, kind)]

    def from_si(self, value: float, kind: str) -> float:
        """The SI ``value`` in this file's unit of ``kind``."""
        return value / UNITS[kind][getattr(self, kind)]


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
        _raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("id", self.id)
        if self.id == NEAREST:
            yield Problem("id", self.id, "means the nearest ball in a shot: choose another id")
        yield from _point_problems("position", self.position)
        yield from size_problems("radius", self.radius)
        yield from size_problems("mass", self.mass)
        yield from _point_problems("velocity", self.velocity)
        if self.color is not None and not re.fullmatch("#[0-9A-Fa-f]{6}", self.color):
            yield Problem("color", self.color, 'must be "#rrggbb", six hexadecimal digits')


def name_problems(key: str, name: str) -> Iterator[Problem]:
    """What is wrong with a name that is to be printed in a line."""
    if not name.strip():
        yield Problem(key, name, "must not be empty")
    elif any(unicodedata.category(c) in ("Cc", "Cs", "Zl", "Zp") for c in name):
        yield Problem(key, name, "must be one line of text without control characters")


class Edge(NamedTuple):
    """One cushion from ``start`` to ``end``, its unit ``tangent``, its unit ``normal`` inwards."""

    start: Point
    end: Point
    tangent: Point
    normal: Point
    length: float

    def height(self, x: float, y: float) -> float:
        """Distance (m) of a point from the cushion's line, positive on the table's side."""
        return (x - self.start[0]) * self.normal[0] + (y - self.start[1]) * self.normal[1]

    def along(self, x: float, y: float) -> float:
        """Where the point's foot lies on the cushion: 0 at ``start``, ``length`` at ``end`` (m)."""
        return (x - self.start[0]) * self.tangent[0] + (y - self.start[1]) * self.tangent[1]

    def distance(self, x: float, y: float) -> float:
        """Distance (m) of a point from the cushion itself, ends included."""
        s = min(max(self.along(x, y), 0.0), self.length)
        foot_x = self.start[0] + s * self.tangent[0]
        foot_y = self.start[1] + s * self.tangent[1]
        return math.hypot(x - foot_x, y - foot_y)


def _edge(start: Point, end: Point) -> Edge:
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    tangent = (dx / length, dy / length)
    return Edge(start, end, tangent, (-tangent[1], tangent[0]), length)


@dataclass(frozen=True)
class Table:
    """A table: any simple polygon, counter-clockwise; cushion k runs from corner k to the next.

    >>> table = Table.rectangle(2.0, 1.0)
    >>> [edge.normal for edge in table.edges][1]
    (-1.0, 0.0)
    >>> table.contains(1.0, 0.5), table.contains(3.0, 0.5)
    (True, False)
    """

    outline: tuple[Point, ...]

    def __post_init__(self) -> None:
        _raise_any(self._problems())

    @classmethod
    def rectangle(cls, length: float, width: float) -> Table:
        """The report's table: x from 0 to ``length``, y from 0 to ``width`` (m)."""
        _raise_any(
            problem
            for key, value in (("length", length), ("width", width))
            for problem in size_problems(key, value)
        )
        return cls(((0.0, 0.0), (length, 0.0), (length, width), (0.0, width)))

    def _problems(self) -> Iterator[Problem]:
        if len(self.outline) < 3:
            yield self._problem("must have three corners or more")
            return
        astray = [p for corner in self.outline for p in _point_problems("outline", corner)]
        yield from astray
        if not astray:
            yield from self._shape_problems()

    def _shape_problems(self) -> Iterator[Problem]:
        slack = ROUNDING * max(map(abs, self.bounds))
        for k, corner in enumerate(self.outline):
            if math.dist(self.outline[k - 1], corner) <= slack:
                k_before = (k - 1) % len(self.outline)
                yield self._problem(f"has two equal corners in a row ({k_before} and {k})")
                return
        meeting = _meeting(self.edges, slack)
        if meeting is not None:
            yield self._problem("crosses itself (cushion {} meets cushion {})".format(*meeting))
        elif _area(self.outline) <= 0.0:
            yield self._problem("must run counter-clockwise")

    def _problem(self, message: str) -> Problem:
        return Problem("outline", [list(corner) for corner in self.outline], message)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The cushions, in order along the outline."""
        corners = self.outline
        return tuple(_edge(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))

    @cached_property
    def reflex_corners(self) -> tuple[int, ...]:
        """Corners that stick out into the table, so that a ball can hit them.

        Corner k joins cushions k - 1 and k.
        """
        tangents = [edge.tangent for edge in self.edges]
        return tuple(k for k, t in enumerate(tangents) if _cross(tangents[k - 1], t) < 0.0)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y (m)."""
        xs, ys = zip(*self.outline, strict=True)
        return min(xs), min(ys), max(xs), max(ys)

    @cached_property
    def is_rectangle(self) -> bool:
        """Whether the table is x0..x1 times y0..y1 with cushions 0 to 3 as the report has them."""
        x0, y0, x1, y1 = self.bounds
        return self.outline == ((x0, y0), (x1, y0), (x1, y1), (x0, y1))

    def contains(self, x: float, y: float) -> bool:
        """Whether a point is on the table (even-odd rule)."""
        inside = False
        for edge in self.edges:
            (ax, ay), (bx, by) = edge.start, edge.end
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
        return inside


def _cross(a: Point, b: Point) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _area(outline: Sequence[Point]) -> float:
    x0, y0 = outline[0]  # relative to a corner: a table far from the origin keeps its digits
    shifted = [(x - x0, y - y0) for x, y in outline]
    return sum(_cross(a, b) for a, b in zip(shifted, shifted[1:] + shifted[:1], strict=True)) / 2


def _meeting(edges: Sequence[Edge], slack: float) -> tuple[int, int] | None:
    """Two sides of a closed polygon that meet where they should not, by a sweep along x."""
    active: list[int] = []
    for i in sorted(range(len(edges)), key=lambda k: min(edges[k].start[0], edges[k].end[0])):
        left = min(edges[i].start[0], edges[i].end[0]) - slack
        active = [j for j in active if max(edges[j].start[0], edges[j].end[0]) >= left]
        for j in active:
            if _sides_meet(edges, min(i, j), max(i, j), slack):
                return min(i, j), max(i, j)
        active.append(i)
    return None


def _sides_meet(edges: Sequence[Edge], i: int, j: int, slack: float) -> bool:
    p, q = edges[i], edges[j]
    if min(p.start[1], p.end[1]) - slack > max(q.start[1], q.end[1]) or (
        min(q.start[1], q.end[1]) - slack > max(p.start[1], p.end[1])
    ):
        return False
    if j - i in (1, len(edges) - 1):  # neighbours meet at their corner, and may do so only there
        first, second = (p, q) if p.end == q.start else (q, p)
        return first.distance(*second.end) <= slack or second.distance(*first.start) <= slack
    if (
        min(p.distance(*q.start), p.distance(*q.end), q.distance(*p.start), q.distance(*p.end))
        <= slack
    ):
        return True
    return (p.height(*q.start) > 0.0) != (p.height(*q.end) > 0.0) and (
        (q.height(*p.start) > 0.0) != (q.height(*p.end) > 0.0)
    )


@dataclass(frozen=True, slots=True)
class Restitution:
    """Coefficients of restitution, each in [0, 1]; None where the scene never needs one."""

    ball_ball: float | None = None
    cue_ball: float | None = None
    cushion: float | None = None

    def __post_init__(self) -> None:
        _raise_any(
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
        _raise_any(
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
        _raise_any(self._problems())

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
        _raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        yield from name_problems("name", self.name)
        if self.velocity is not None:
            yield from _point_problems("velocity", self.velocity)
            if self.aim is not None:
                yield Problem("aim", self.aim, "stands beside velocity: one of the two")
        elif self.speed is None or self.aim is None:
            yield Problem("velocity", LEFT_OUT, "is wanted (or speed and angle, or speed and aim)")
        if self.speed is not None:
            yield from number_problems("speed", self.speed, 0.0)
        for id_, end in self.published.items():
            yield from _point_problems(f"published.{key_of(id_)}", end)


@dataclass(frozen=True)
class Scene:
    """Everything a solver may know: balls, table, materials, law, and the shots to play.

    >>> scene = Scene(
    ...     balls=(Ball("C", (1.0, 1.0), 0.05, 0.2, cue=True), Ball("1", (2.0, 1.0), 0.05, 0.2)),
    ...     restitution=Restitution(ball_ball=0.9),
    ...     friction=Friction(surface=0.1),
    ...     shots=(Shot("straight", "C", speed=2.0, aim="nearest"),),
    ... )
    >>> round(scene.deceleration, 6), scene.index["1"], scene.start(scene.shots[0]).velocity[0]
    (0.980665, 1, (2.0, 0.0))
    """

    balls: tuple[Ball, ...]
    table: Table | None = None
    restitution: Restitution = Restitution()
    friction: Friction = Friction()
    physics: Physics = Physics()
    shots: tuple[Shot, ...] = ()
    title: str = ""
    units: Units = Units()

    def __post_init__(self) -> None:
        _raise_any(self._problems())

    def _problems(self) -> Iterator[Problem]:
        balls, shots = dict(enumerate(self.balls)), dict(enumerate(self.shots))
        cues = [k for k, ball in balls.items() if ball.cue]
        moves = bool(shots) or any(ball.velocity != (0.0, 0.0) for ball in self.balls)
        if not self.balls:
            yield Problem("balls", LEFT_OUT, "one ball or more is wanted")
        yield from id_problems({k: ball.id for k, ball in balls.items()}, cues)
        yield from place_problems(balls, self.table)
        yield from shot_problems(shots, [ball.id for ball in self.balls])
        yield from restitution_needs(self.restitution, self.table is not None, len(balls), cues)
        yield from rest_needs(self.friction, self.physics, moves)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The place of each ball's id in ``balls``."""
        return {ball.id: i for i, ball in enumerate(self.balls)}

    @property
    def deceleration(self) -> float:
        """What surface friction takes from a moving ball's speed, a = mu_s g (m/s^2, Eq. 10)."""
        return _deceleration(self.friction, self.physics)

    @property
    def cue(self) -> Ball | None:
        """The cue ball, where there is one."""
        return next((ball for ball in self.balls if ball.cue), None)

    def pair(self, i: int, j: int) -> Pair:
        """Masses and coefficients of a hit of ball ``i`` (A) with ball ``j`` (B)."""
        a, b = self.balls[i], self.balls[j]
        e = ball_ball_restitution(self.restitution, a.cue or b.cue)
        assert e is not None, "restitution_needs saw to it"
        return Pair(a.mass, b.mass, e, self.friction.ball_ball)

    def start(self, shot: Shot | None, before: State | None = None) -> State:
        """Positions and velocities at the moment of a shot, from ``before`` or the scene's own."""
        state = before or State(
            tuple(ball.position for ball in self.balls), tuple(ball.velocity for ball in self.balls)
        )
        if shot is None:
            return state
        i = self.index[shot.ball]
        velocity = shot.velocity or self._aimed(shot, i, state.position)
        velocities = (*state.velocity[:i], velocity, *state.velocity[i + 1 :])
        return State(state.position, velocities)

    def _aimed(self, shot: Shot, i: int, position: Sequence[Point]) -> Point:
        assert shot.speed is not None and shot.aim is not None
        x, y = position[i]
        target = self.nearest(i, position) if shot.aim == NEAREST else self.index[shot.aim]
        angle = math.atan2(position[target][1] - y, position[target][0] - x)
        return (math.cos(angle) * shot.speed, math.sin(angle) * shot.speed)

    def nearest(self, i: int, position: Sequence[Point] | None = None) -> int:
        """The ball whose centre is nearest to that of ball ``i`` (the first of equals)."""
        at = position or [ball.position for ball in self.balls]
        others = (j for j in range(len(at)) if j != i)
        return min(others, key=lambda j: math.dist(at[i], at[j]))


class State(NamedTuple):
    """Where the balls are (m) and how they move (m/s), in the scene's order."""

    position: tuple[Point, ...]
    velocity: tuple[Point, ...]


def ball_ball_restitution(restitution: Restitution, with_cue: bool) -> float | None:
    """The coefficient of a hit between two balls; ``cue_ball`` defaults to ``ball_ball``."""
    if with_cue and restitution.cue_ball is not None:
        return restitution.cue_ball
    return restitution.ball_ball


def _deceleration(friction: Friction, physics: Physics) -> float:
    return friction.surface * physics.gravity


# What can be wrong between the parts of a scene. Balls and shots come with their numbers: a
# scenario file of which some are unsound is checked as far as it is sound.


def id_problems(ids: Mapping[int, str], cues: Sequence[int]) -> Iterator[Problem]:
    """Repeated ids, a second cue ball."""
    yield from _repeated("balls", "id", ids)
    for k in cues[1:]:
        yield Problem(f"balls[{k}].cue", True, f"balls[{cues[0]}] is the cue ball already")


def _repeated(key: str, field: str, names: Mapping[int, str]) -> Iterator[Problem]:
    seen: dict[str, int] = {}
    for k, name in names.items():
        if seen.setdefault(name, k) != k:
            yield Problem(
                f"{key}[{k}].{field}", name, f"is the {field} of {key}[{seen[name]}] already"
            )


def place_problems(balls: Mapping[int, Ball], table: Table | None) -> Iterator[Problem]:
    """Balls off the table, in a cushion, in each other."""
    if table is not None:
        for k, ball in balls.items():
            yield from _table_problems(k, ball, table)
    for i, j in sorted(islice(_overlaps(balls), MOST_OVERLAPS)):
        message = f"ball {shown(balls[j].id)} overlaps ball {shown(balls[i].id)}"
        yield Problem(f"balls[{j}].position", list(balls[j].position), message)


def _table_problems(k: int, ball: Ball, table: Table) -> Iterator[Problem]:
    x, y = ball.position
    slack = TOUCHING * ball.radius + ROUNDING * max(map(abs, table.bounds))
    key, name = f"balls[{k}].position", f"ball {shown(ball.id)}"
    if not table.contains(x, y):
        yield Problem(key, [x, y], f"{name} is off the table")
        return
    reach = ball.radius - slack
    touched = [str(n) for n, edge in enumerate(table.edges) if edge.distance(x, y) < reach]
    if touched:
        cushions = "cushion" if len(touched) == 1 else "cushions"
        yield Problem(key, [x, y], f"{name} overlaps {cushions} {listed(touched)}")


def _overlaps(balls: Mapping[int, Ball]) -> Iterator[tuple[int, int]]:
    """Overlapping balls, by a sweep along the longer side of what the balls cover."""
    if not balls:
        return
    spread = [max(s) - min(s) for s in zip(*(b.position for b in balls.values()), strict=True)]
    axis = spread.index(max(spread))
    active: list[int] = []
    for i in sorted(balls, key=lambda k: balls[k].position[axis] - balls[k].radius):
        near = balls[i].position[axis] - balls[i].radius
        active = [j for j in active if balls[j].position[axis] + balls[j].radius > near]
        yield from ((min(i, j), max(i, j)) for j in active if _overlap(balls[i], balls[j]))
        active.append(i)


def _overlap(a: Ball, b: Ball) -> bool:
    reach = a.radius + b.radius
    slack = TOUCHING * reach + ROUNDING * max(map(abs, (*a.position, *b.position)))
    return math.dist(a.position, b.position) < reach - slack


def shot_problems(shots: Mapping[int, Shot], ids: Collection[str]) -> Iterator[Problem]:
    """Repeated names, unknown balls, shots that aim at nothing or go on from no shot."""
    yield from _repeated("shots", "name", {k: shot.name for k, shot in shots.items()})
    known = set(ids)
    unknown = f"there is no such ball (there are: {listed(ids)})"
    for k, shot in shots.items():
        if shot.ball not in known:
            yield Problem(f"shots[{k}].ball", shot.ball, unknown)
        yield from _aim_problems(f"shots[{k}].aim", shot, known, unknown)
        for id_, end in shot.published.items():
            if id_ not in known:
                yield Problem(f"shots[{k}].published.{key_of(id_)}", list(end), unknown)
        if k == 0 and shot.from_previous:
            yield Problem("shots[0].from", "previous", "there is no shot before the first")


def _aim_problems(key: str, shot: Shot, ids: set[str], unknown: str) -> Iterator[Problem]:
    if shot.aim is None:
        return
    if shot.aim == shot.ball:
        yield Problem(key, shot.aim, "a ball cannot aim at itself")
    elif shot.aim == NEAREST and len(ids) < 2:
        yield Problem(key, shot.aim, "there is no other ball to aim at")
    elif shot.aim != NEAREST and shot.aim not in ids:
        yield Problem(key, shot.aim, unknown)


def restitution_needs(
    restitution: Restitution, has_table: bool, balls: int, cues: Sequence[int]
) -> Iterator[Problem]:
    """Coefficients of restitution that the scene needs and leaves out."""
    if has_table and restitution.cushion is None:
        yield Problem("restitution.cushion", LEFT_OUT, "is wanted where there is a table")
    plain_pairs = balls - len(cues) > 1
    cue_pairs = balls > 1 and len(cues) > 0
    if (plain_pairs and ball_ball_restitution(restitution, False) is None) or (
        cue_pairs and ball_ball_restitution(restitution, True) is None
    ):
        yield Problem("restitution.ball_ball", LEFT_OUT, "is wanted where two balls can meet")


def rest_needs(friction: Friction, physics: Physics, moves: bool) -> Iterator[Problem]:
    """A bound in time, where something moves and nothing slows it."""
    if moves and _deceleration(friction, physics) == 0.0 and physics.max_time is None:
        message = "is wanted: without surface friction and gravity the balls never come to rest"
        yield Problem("physics.max_time", LEFT_OUT, message)
