"""The exact solver: between contacts the motion is closed-form, so jump from contact to contact.

There is no time step and no error but rounding. Every ball has a :class:`~pool_pymunk.path.Path`,
its motion from one contact to the next. When a path begins, its contacts with cushions and with
all other paths are predicted and put in a queue; an event whose paths are no longer the balls' own
is void.

What is hard has a policy. Those for contacts of one instant, rows of touching balls, inelastic
collapse and balls that friction presses together stand in :mod:`pool_pymunk.hits`; further:

- *Grazing*: whether a path hits is decided by its distance from the centre, in full precision. A
  path that is tangent to rounding misses a corner; on a ball it changes nothing but rounding.
- *One instant*: contacts are of one instant if their gaps are closed, to rounding, at the time of
  the first. A corner's two cushions both answer.
- *Touching*: approaching is a contact now; receding, or overlapping by rounding, is none.
- *A ball that stops at contact* stops.
- *Out of range*: a run ends as non-finite when a number overflows, or a ball is so fast that in a
  rounding error of the time it comes as far as a share of its radius. With law ``published``, which
  may gain energy in a hit, hits can feed each other until then.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.contact import LAWS, Pair
from pool_pymunk.hits import Hits
from pool_pymunk.impact import NO_BALL, Touch
from pool_pymunk.motion import Array, Vector
from pool_pymunk.path import EPSILON, Face, Path, Post, face_length, pair_time, post_length
from pool_pymunk.result import Trace
from pool_pymunk.scene import Scene, State
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.settings import NEVER_SETTLES, Settings, slip_warning

NEARLY_NOW = 1e-6  # radii; contacts so near each other may be of one instant: their gaps decide
CROWD = 24  # balls in the way, from which on they are sifted all at once
LEAPS = 3  # of a sifting
NO_WALL = -1
X, Y, VX, VY, AX, AY, T, R, STOP, END = range(10)  # what a row of ``lines`` holds

Indices = NDArray[np.intp]
Key = tuple[int, int, int]  # a contact: two balls and NO_WALL, or a ball, NO_BALL, and a wall


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here.

    Events carry their true times; the Run's positions are closed-form at any time.
    """
    table = EventTable(scene, start)
    trace = table.trace
    latest = math.inf if settings.max_time is None else settings.max_time
    most = NEVER_SETTLES if settings.max_events is None else settings.max_events
    while table.is_finite:
        t = table.upcoming()
        if t == math.inf and not table.drifts():
            return trace
        if t > latest or t == math.inf:
            trace.status = "max_time"
            table.now = latest if latest < math.inf else table.now
            break
        if max(len(trace.events), trace.steps) >= most:
            trace.status = "max_events"
            break
        table.next()
    else:
        trace.status = "non_finite"
    trace.duration = table.now
    table.note_moving()
    return trace


class Event(NamedTuple):
    """What may happen at ``t``: a contact of ``a`` with ``b``, a wall, or (neither) a stop."""

    t: float
    order: int
    a: int
    b: int
    wall: int  # its place in the table's walls; NO_WALL
    path_a: Path
    path_b: Path

    @property
    def key(self) -> Key:
        return self.a, self.b, self.wall

    @property
    def balls(self) -> tuple[int, ...]:
        return (self.a,) if self.b == NO_BALL else (self.a, self.b)

    @property
    def is_stop(self) -> bool:
        return self.b == NO_BALL and self.wall == NO_WALL


class EventTable:
    """Balls, their paths, and the queue of what may happen next."""

    def __init__(self, scene: Scene, start: State) -> None:
        self.scene = scene
        self.deceleration = scene.deceleration
        self.trace = Trace(start)
        self.now = 0.0
        self.order = 0
        self.queue: list[Event] = []
        self.radius = [ball.radius for ball in scene.balls]
        self.walls = list(_walls(scene))
        self.paths = [
            Path(0.0, p, v, self.deceleration)
            for p, v in zip(start.position, start.velocity, strict=True)
        ]
        count = range(len(self.paths))
        self.hits: Hits[Key] = Hits(LAWS[scene.physics.law], self)
        for i in count:
            self.hits.strike(i, start.velocity[i])
        self.rested = [math.inf if path.speed > 0.0 else -math.inf for path in self.paths]  # since
        self.end = [math.inf for _ in count]  # when each path meets a wall
        self.boxes = np.array([self._box(i) for i in count]).T.copy()
        self.lines = np.array([self._line(i) for i in count]).T.copy()
        self.is_finite = bool(np.isfinite(self.lines[:T]).all())
        moving = [i for i in count if self.paths[i].speed > 0.0]
        for i in moving:
            self._meet_walls(i)
        self._meet_balls(moving)

    # -- prediction ------------------------------------------------------------------------------

    def _push(self, t: float, a: int, b: int, wall: int) -> None:
        self.order += 1
        path_b = self.paths[b] if b != NO_BALL else self.paths[a]
        heappush(self.queue, Event(t, self.order, a, b, wall, self.paths[a], path_b))

    def _meet_walls(self, i: int) -> None:
        """Queue the first wall on ball ``i``'s path (in a corner: walls), or else its stop."""
        path, r = self.paths[i], self.radius[i]
        lengths = [
            face_length(path, r, wall) if isinstance(wall, Face) else post_length(path, r, wall)
            for wall, _ in self.walls
        ]
        first = min(lengths, default=math.inf)
        self.end[i] = math.inf
        if first < path.reach:
            self.end[i] = path.time_at(first) + NEARLY_NOW * r / path.speed
            for wall, length in enumerate(lengths):
                if length - first <= NEARLY_NOW * r:
                    self._push(path.time_at(length), i, NO_BALL, wall)
        elif path.speed > 0.0 and path.stop < math.inf:
            self._push(path.stop, i, NO_BALL, NO_WALL)
        self.boxes[:, i] = self._box(i)
        self.lines[:, i] = self._line(i)

    def _meet_balls(self, balls: Iterable[int]) -> None:
        """Queue every contact of the paths of these balls with all others."""
        done: set[int] = set()
        for i in balls:
            for j in self._in_the_way(i):
                if j not in done:
                    self._meet(min(i, j), max(i, j))
            done.add(i)

    def _meet(self, i: int, j: int) -> None:
        t = pair_time(
            self.paths[i],
            self.paths[j],
            self.radius[i] + self.radius[j],
            self.now,
            min(self.end[i], self.end[j]),
            self.hits.past(i, j, self.now),
        )
        if t < math.inf:
            self._push(t, i, j, NO_WALL)

    # -- what is in the way ----------------------------------------------------------------------

    def _box(self, i: int) -> tuple[float, float, float, float]:
        """Lowest x and y, highest x and y (m) of the disc on its path."""
        path, r = self.paths[i], self.radius[i]
        x, y = path.position
        if self.end[i] < math.inf:
            ex, ey = path.at(self.end[i])[0]
        elif path.reach < math.inf:
            ex, ey = path.rest
        else:
            ex, ey = (
                math.copysign(math.inf, v) if v else p
                for p, v in zip(path.position, path.velocity, strict=True)
            )
        r += 2.0 * NEARLY_NOW * r + 1e-9 * (abs(x) + abs(y))
        return min(x, ex) - r, min(y, ey) - r, max(x, ex) + r, max(y, ey) + r

    def _line(self, i: int) -> tuple[float, ...]:
        """The path as :meth:`_sift` wants it: position, velocity, deceleration, times, radius."""
        path, a = self.paths[i], self.deceleration
        ux, uy = path.direction
        return (*path.position, *path.velocity, a * ux, a * uy,
                path.t, self.radius[i], path.stop, self.end[i])  # fmt: skip

    def _in_the_way(self, i: int) -> list[int]:
        """The balls that ball ``i`` may meet on its path: those whose boxes overlap, or fewer."""
        low_x, low_y, high_x, high_y = self.boxes
        x0, y0, x1, y1 = self.boxes[:, i].tolist()
        near = (low_x <= x1) & (high_x >= x0) & (low_y <= y1) & (high_y >= y0)
        if self.paths[i].stop <= self.now:
            near &= self.lines[STOP] > self.now
        near[i] = False
        others = np.flatnonzero(near)
        found: list[int] = (others if len(others) < CROWD else self._sift(i, others)).tolist()
        return found

    def _sift(self, i: int, others: Indices) -> Indices:
        """Those of the others that ball ``i`` may meet.

        Leaps in time that provably pass no contact, as :func:`~pool_pymunk.motion.time_of_impact`
        does, but all at once; who leaps beyond the end of a path, or both stops, meets nothing.
        """
        own, lines = self.lines[:, [i]], self.lines[:, others]
        until = np.minimum(np.minimum(own[END], lines[END]), np.maximum(own[STOP], lines[STOP]))
        t = np.full(len(others), self.now)
        for _ in range(LEAPS):
            t = t + _leap(own, lines, t)
            left = t <= until
            others, lines, until, t = others[left], lines[:, left], until[left], t[left]
        return others

    # -- what happens ----------------------------------------------------------------------------

    def upcoming(self) -> float:
        """When something happens next (s); infinite if nothing does."""
        while self.queue and not self._is_current(self.queue[0]):
            heappop(self.queue)
        return self.queue[0].t if self.queue else math.inf

    def next(self) -> None:
        """Let happen what is upcoming."""
        event = heappop(self.queue)
        self.now = max(event.t, self.now)
        self.trace.steps += 1
        if event.is_stop:
            self._note_stop(event.a, event.path_a.rest)
        else:
            self._contacts({event.key: None for event in (event, *self._at_this_instant(event))})

    def _is_current(self, event: Event) -> bool:
        return self.paths[event.a] is event.path_a and (
            event.b == NO_BALL or self.paths[event.b] is event.path_b
        )

    def _at_this_instant(self, first: Event) -> list[Event]:
        """Further contacts whose gap is closed, to rounding, now."""
        speed = max(self.paths[i].speed for i in first.balls)
        latest = self.now + NEARLY_NOW * self.radius[first.a] / speed
        same: list[Event] = []
        later: list[Event] = []
        while self.queue and self.queue[0].t <= latest:
            event = heappop(self.queue)
            if self._is_current(event):
                closed = not event.is_stop and self._gap_is_closed(event)
                (same if closed else later).append(event)
        for event in later:
            heappush(self.queue, event)
        return same

    def _gap_is_closed(self, event: Event) -> bool:
        (x, y), r = self.paths[event.a].at(self.now)[0], self.radius[event.a]
        if event.b != NO_BALL:
            r += self.radius[event.b]
            gap = math.dist((x, y), self.paths[event.b].at(self.now)[0]) - r
        else:
            wall = self.walls[event.wall][0]
            if isinstance(wall, Face):
                gap = wall.height((x, y)) - r
            else:
                gap = math.dist((x, y), wall.center) - r
        return gap <= 32.0 * EPSILON * (abs(x) + abs(y) + r)

    # -- contacts --------------------------------------------------------------------------------

    def _contacts(self, keys: Collection[Key]) -> None:
        """Answer the contacts of this instant, and predict what comes of it."""
        answer = self.hits.answer(keys, self.now)
        for touch in answer.listed:
            self._note_contact(touch)
        for touch in answer.pressed:
            self._forget_stops(touch)
        self._note_zero_slips()
        for i, velocity in answer.velocity.items():
            self._set_off(i, velocity)
        self._meet_balls(answer.velocity)
        for touch in answer.missed:
            if all(self.paths[i].stop > self.now for i in touch.balls):
                self._meet(touch.a, touch.b)

    def _set_off(self, i: int, velocity: Vector) -> None:
        """Ball ``i`` begins a new path now, or stays where it is."""
        position = self.paths[i].at(self.now)[0]
        if velocity != (0.0, 0.0):
            self.trace.knot(i, self.now, position, velocity)
            self.rested[i] = math.inf
        elif self.rested[i] > self.now:
            self._note_stop(i, position)
        path = self.paths[i] = Path(self.now, position, velocity, self.deceleration)
        self.is_finite = self.is_finite and not path.is_lost(self.radius[i])
        self._meet_walls(i)

    def touch(self, key: Key, t: float) -> Touch:
        """The contact of that key at the time ``t`` (s)."""
        i, j, wall = key
        x, y = self.paths[i].at(t)[0]
        if j != NO_BALL:
            bx, by = self.paths[j].at(t)[0]
            return Touch(i, j, _unit(bx - x, by - y), self.scene.pair(i, j))
        e = self.scene.restitution.cushion
        assert e is not None, "the scene saw to it"
        pair = Pair(self.scene.balls[i].mass, math.inf, e, self.scene.friction.cushion)
        side, cushion = self.walls[wall]
        if isinstance(side, Post):
            return Touch(i, j, _unit(x - side.center[0], y - side.center[1]), pair, cushion)
        return Touch(i, j, side.normal, pair, cushion)

    def path_of(self, i: int) -> Path:
        """The path of ball ``i``."""
        return self.paths[i]

    def radius_of(self, i: int) -> float:
        """The radius (m) of ball ``i``."""
        return self.radius[i]

    def name_of(self, i: int) -> str:
        """The id of ball ``i``."""
        return self.scene.balls[i].id

    # -- notes -----------------------------------------------------------------------------------

    def warn(self, text: str, t: float) -> None:
        """Note what the user should know about this run."""
        self.trace.warn(text, t)

    def _note_contact(self, touch: Touch) -> None:
        if touch.cushion is None:
            self.trace.ball_ball(self.now, touch.a, touch.b)
        else:
            self.trace.ball_cushion(self.now, touch.a, touch.cushion)

    def _note_zero_slips(self) -> None:
        for i, j in self.hits.impacts.zero_slips:
            self.trace.warn(slip_warning(self.name_of(i), self.name_of(j)), self.now)
        self.hits.impacts.zero_slips.clear()

    def _note_stop(self, i: int, position: Vector) -> None:
        self.trace.stop(i, self.now, position)
        self.rested[i] = self.now

    def _forget_stops(self, touch: Touch) -> None:
        """A ball that stopped for a moment between two kicks has not come to rest."""
        events = self.trace.events
        for i in touch.balls:
            if self.hits.was_kicked(i, self.rested[i], self.now):
                stop = (self.rested[i], "stop", (i,), None)
                del events[len(events) - 1 - events[::-1].index(stop)]
                self.rested[i] = math.inf

    def drifts(self) -> bool:
        """Whether a ball moves that nothing will ever stop."""
        return any(path.stop == math.inf for path in self.paths)

    def note_moving(self) -> None:
        """Write down where the balls are that still move when the run is cut off."""
        for i, path in enumerate(self.paths):
            if path.stop > self.now:
                self.trace.knot(i, self.now, *path.at(self.now))


def _walls(scene: Scene) -> Iterator[tuple[Face | Post, int]]:
    """What a ball can meet of the table, and the number it is reported by."""
    if scene.table is not None:
        for number, edge in enumerate(scene.table.edges):
            yield Face(edge.start, edge.tangent, edge.normal, edge.length), number
        for number in scene.table.reflex_corners:
            yield Post(scene.table.outline[number]), number


def _leap(own: Array, lines: Array, t: Array) -> Array:
    """How far (s) from the times ``t`` there is provably no contact."""
    ax, ay, avx, avy = _slid(own, t)
    bx, by, bvx, bvy = _slid(lines, t)
    x, y = bx - ax, by - ay
    distance = np.hypot(x, y)
    rate = (x * (bvx - avx) + y * (bvy - avy)) / distance
    reach = own[R] + lines[R]
    gap = np.maximum(distance - reach * (1.0 + 1e-9), 0.0)
    pull = np.hypot(own[AX], own[AY]) + np.hypot(lines[AX], lines[AY])
    root = np.sqrt(rate * rate + 2.0 * pull * gap)
    with np.errstate(divide="ignore", invalid="ignore"):
        leap: Array = np.where(rate < 0.0, 2.0 * gap / (root - rate), (rate + root) / pull)
    return leap


def _slid(lines: Array, t: Array) -> tuple[Array, Array, Array, Array]:
    """Where the balls are (m) and how they move (m/s) at the times ``t``."""
    dt = np.minimum(t, lines[STOP]) - lines[T]
    vx, vy = lines[VX] - lines[AX] * dt, lines[VY] - lines[AY] * dt
    x = lines[X] + (lines[VX] + vx) * (0.5 * dt)
    return x, lines[Y] + (lines[VY] + vy) * (0.5 * dt), vx, vy


def _unit(x: float, y: float) -> Vector:
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)


SOLVER = Solver(
    name="event-driven", solve=solve, about="exact: from contact to contact", dt=None, exact=True,
    no_tolerance="it is exact and has no step: no tolerance is needed",
    color="#000000", marker="*",
)  # fmt: skip
