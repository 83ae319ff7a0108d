"""What is on the table: frozen objects in SI units, checked when they are made.

A :class:`Scene` holds everything a solver may know. What a scene leaves out (a table, surface
friction, a second ball) is physics that no solver computes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from pool_pymunk.contact import LAWS, Pair

Point = tuple[float, float]

STANDARD_GRAVITY = 9.80665  # m/s^2
LEFT_OUT = "(left out)"

# Balls may overlap by this share of the distance between their centres: a frozen rack's
# coordinates are rounded. ROUNDING covers the coordinates themselves, far from the origin.
TOUCHING = 1e-9
ROUNDING = 4 * 2.0**-52

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
        value = self.value if self.value is LEFT_OUT else _shown(self.value)
        return f"{self.key} = {value}: {self.message}"


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
        prefix = f"{source}: " if source else ""
        super().__init__("\n".join(f"{prefix}{problem}" for problem in self.problems))


def _shown(value: object, limit: int = 60) -> str:
    text = repr(value) if not isinstance(value, str) else f'"{value}"'
    text = " ".join(text.split())
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _raise_any(problems: Iterator[Problem]) -> None:
    found = list(problems)
    if found:
        raise SceneError(found)


def _number(key: str, value: float, low: float | None = None, high: float = math.inf,
            above: float | None = None) -> Iterator[Problem]:  # fmt: skip
    """Problems of one number: finite, at least ``low`` or greater than ``above``, at most ``high``."""
    if not math.isfinite(value):
        yield Problem(key, value, "must be a finite number")
    elif above is not None and value <= above:
        yield Problem(key, value, f"must be greater than {above:g}")
    elif low is not None and not low <= value <= high:
        span = f"between {low:g} and {high:g}" if high < math.inf else f"{low:g} or more"
        yield Problem(key, value, f"must be {span}")


def _point(key: str, point: Point) -> Iterator[Problem]:
    if not (math.isfinite(point[0]) and math.isfinite(point[1])):
        yield Problem(key, list(point), "must be two finite numbers")


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
        if not self.id:
            yield Problem("id", self.id, "must not be empty")
        yield from _point("position", self.position)
        yield from _number("radius", self.radius, above=0)
        yield from _number("mass", self.mass, above=0)
        yield from _point("velocity", self.velocity)


class Edge(NamedTuple):
    """One cushion: from ``start`` to ``end``, unit ``tangent`` along it, unit ``normal`` inwards."""

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
            for problem in _number(key, value, above=0)
        )
        return cls(((0.0, 0.0), (length, 0.0), (length, width), (0.0, width)))

    def _problems(self) -> Iterator[Problem]:
        shown = [list(corner) for corner in self.outline]
        if len(self.outline) < 3:
            yield Problem("outline", shown, "must have three corners or more")
            return
        for corner in self.outline:
            yield from _point("outline", corner)
        corners = list(zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True))
        if not all(math.isfinite(x) and math.isfinite(y) for x, y in self.outline):
            return
        if any(math.hypot(b[0] - a[0], b[1] - a[1]) == 0.0 for a, b in corners):
            yield Problem("outline", shown, "has two equal corners in a row")
        elif _first_crossing(corners) is not None:
            i, j = _first_crossing(corners) or (0, 0)
            yield Problem("outline", shown, f"crosses itself (cushion {i} meets cushion {j})")
        elif _area(self.outline) <= 0.0:
            yield Problem("outline", shown, "must run counter-clockwise")

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The cushions, in order along the outline."""
        corners = self.outline
        return tuple(_edge(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))

    @cached_property
    def reflex_corners(self) -> tuple[int, ...]:
        """Corners that stick out into the table (a ball can hit them): k joins cushions k-1 and k."""
        edges = self.edges
        return tuple(
            k
            for k in range(len(edges))
            if _cross(edges[k - 1].tangent, edges[k].tangent) < 0.0
        )  # fmt: skip

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


def _first_crossing(sides: Sequence[tuple[Point, Point]]) -> tuple[int, int] | None:
    """The first two sides of a closed polygon that meet where they should not."""
    count = len(sides)
    for i in range(count):
        (a, b) = sides[i]
        c = sides[(i + 1) % count][1]
        ab, bc = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
        if _cross(ab, bc) == 0.0 and ab[0] * bc[0] + ab[1] * bc[1] < 0.0:
            return i, (i + 1) % count  # turns back on itself
        for j in range(i + 2, count - (i == 0)):
            if _sides_meet(sides[i], sides[j]):
                return i, j
    return None


def _sides_meet(p: tuple[Point, Point], q: tuple[Point, Point]) -> bool:
    def side(a: Point, b: Point, c: Point) -> float:
        return _cross((b[0] - a[0], b[1] - a[1]), (c[0] - a[0], c[1] - a[1]))

    def within(a: Point, b: Point, c: Point) -> bool:
        return min(a[0], b[0]) <= c[0] <= max(a[0], b[0]) and (
            min(a[1], b[1]) <= c[1] <= max(a[1], b[1])
        )

    (a, b), (c, d) = p, q
    s1, s2, s3, s4 = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
    if s1 * s2 < 0.0 and s3 * s4 < 0.0:
        return True
    return any(
        s == 0.0 and within(*ends, corner)
        for s, ends, corner in ((s1, p, c), (s2, p, d), (s3, q, a), (s4, q, b))
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
            for problem in _number(key, value, low=0.0, high=1.0)
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
            for problem in _number(key, getattr(self, key), low=0.0)
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
        yield from _number("gravity", self.gravity, low=0.0)
        if self.max_time is not None:
            yield from _number("max_time", self.max_time, above=0)


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
        if self.velocity is not None:
            yield from _point("velocity", self.velocity)
        elif self.speed is None or self.aim is None:
            yield Problem("velocity", LEFT_OUT, "is wanted (or speed and angle, or speed and aim)")
        if self.speed is not None:
            yield from _number("speed", self.speed, low=0.0)
        for id_, end in self.published.items():
            yield from _point(f"published.{id_}", end)


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
        if not self.balls:
            yield Problem("balls", LEFT_OUT, "one ball or more is wanted")
        yield from ball_problems(self.balls, self.table)
        yield from shot_problems(self.shots, self.balls)
        yield from need_problems(self)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """The place of each ball's id in ``balls``."""
        return {ball.id: i for i, ball in enumerate(self.balls)}

    @property
    def deceleration(self) -> float:
        """What surface friction takes from a moving ball's speed, a = mu_s g (m/s^2, Eq. 10)."""
        return self.friction.surface * self.physics.gravity

    @property
    def cue(self) -> Ball | None:
        """The cue ball, where there is one."""
        return next((ball for ball in self.balls if ball.cue), None)

    def pair(self, i: int, j: int) -> Pair:
        """Masses and coefficients of a hit of ball ``i`` (A) with ball ``j`` (B)."""
        a, b = self.balls[i], self.balls[j]
        e = ball_ball_restitution(self.restitution, a.cue or b.cue)
        assert e is not None, "need_problems saw to it"
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
        target = self.nearest(i, position) if shot.aim == "nearest" else self.index[shot.aim]
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


def ball_problems(balls: Sequence[Ball], table: Table | None) -> Iterator[Problem]:
    """Repeated ids, a second cue ball, balls off the table or in a cushion or in each other."""
    seen: dict[str, int] = {}
    for i, ball in enumerate(balls):
        if ball.id in seen:
            yield Problem(f"balls[{i}].id", ball.id, f"is the id of balls[{seen[ball.id]}] already")
        seen.setdefault(ball.id, i)
    cues = [i for i, ball in enumerate(balls) if ball.cue]
    for i in cues[1:]:
        yield Problem(f"balls[{i}].cue", True, f"balls[{cues[0]}] is the cue ball already")
    if table is not None:
        for i, ball in enumerate(balls):
            yield from _table_problems(i, ball, table)
    yield from _overlaps(balls)


def _table_problems(i: int, ball: Ball, table: Table) -> Iterator[Problem]:
    x, y = ball.position
    slack = TOUCHING * ball.radius + ROUNDING * max(map(abs, table.bounds))
    if not table.contains(x, y):
        yield Problem(f"balls[{i}].position", [x, y], f'ball "{ball.id}" is off the table')
        return
    for k, edge in enumerate(table.edges):
        if edge.distance(x, y) < ball.radius - slack:
            message = f'ball "{ball.id}" overlaps cushion {k}'
            yield Problem(f"balls[{i}].position", [x, y], message)


def _overlaps(balls: Sequence[Ball]) -> Iterator[Problem]:
    """Overlapping balls, by a sweep along x: thousands of balls are checked in a moment."""
    order = sorted(range(len(balls)), key=lambda i: balls[i].position[0] - balls[i].radius)
    found: list[tuple[int, int]] = []
    active: list[int] = []
    for i in order:
        left = balls[i].position[0] - balls[i].radius
        active = [j for j in active if balls[j].position[0] + balls[j].radius > left]
        found += [(min(i, j), max(i, j)) for j in active if _overlap(balls[i], balls[j])]
        active.append(i)
    for i, j in sorted(found):
        message = f'ball "{balls[j].id}" overlaps ball "{balls[i].id}"'
        yield Problem(f"balls[{j}].position", list(balls[j].position), message)


def _overlap(a: Ball, b: Ball) -> bool:
    reach = a.radius + b.radius
    slack = TOUCHING * reach + ROUNDING * max(map(abs, (*a.position, *b.position)))
    return math.dist(a.position, b.position) < reach - slack


def shot_problems(shots: Sequence[Shot], balls: Sequence[Ball]) -> Iterator[Problem]:
    """Shots that name unknown balls, aim at nothing, or go on from no shot."""
    ids = [ball.id for ball in balls]
    for k, shot in enumerate(shots):
        known = f"there is no such ball (there are: {', '.join(ids)})"
        if shot.ball not in ids:
            yield Problem(f"shots[{k}].ball", shot.ball, known)
        if shot.aim == shot.ball:
            yield Problem(f"shots[{k}].aim", shot.aim, "a ball cannot aim at itself")
        elif shot.aim == "nearest" and len(balls) < 2:
            yield Problem(f"shots[{k}].aim", shot.aim, "there is no other ball to aim at")
        elif shot.aim not in (None, "nearest", *ids):
            yield Problem(f"shots[{k}].aim", shot.aim, known)
        for id_ in shot.published:
            if id_ not in ids:
                yield Problem(f"shots[{k}].published.{id_}", list(shot.published[id_]), known)
        if k == 0 and shot.from_previous:
            yield Problem("shots[0].from", "previous", "there is no shot before the first")


def need_problems(scene: Scene) -> Iterator[Problem]:
    """What the scene leaves out although something in it needs it."""
    if scene.table is not None and scene.restitution.cushion is None:
        yield Problem("restitution.cushion", LEFT_OUT, "is wanted where there is a table")
    others = sum(not ball.cue for ball in scene.balls)
    if (others > 1 and scene.restitution.ball_ball is None) or (len(scene.balls) > 1 and ball_ball_restitution(scene.restitution, True) is None):
        yield Problem("restitution.ball_ball", LEFT_OUT, "is wanted where two balls can meet")
    moves = scene.shots or any(ball.velocity != (0.0, 0.0) for ball in scene.balls)
    if moves and scene.deceleration == 0.0 and scene.physics.max_time is None:
        message = "is wanted: without surface friction nothing brings the scene to rest"
        yield Problem("physics.max_time", LEFT_OUT, message)
