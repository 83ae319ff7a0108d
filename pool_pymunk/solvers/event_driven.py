"""The exact solver: between contacts the motion is closed-form, so jump from contact to contact.

There is no time step and no error but rounding. Every ball has a :class:`Path`, its motion from
one contact to the next. When a path begins, its contacts with cushions and with all other paths
are predicted and put in a queue; an event whose paths are no longer the balls' own is void.

Policies for what is hard:

- *Grazing*: whether a path hits is decided by its distance from the centre, in full precision.
- *One instant*: contacts whose gaps are closed to rounding at one time are answered together
  (:mod:`pool_pymunk.impact`), so the order of the balls does not matter; a corner's two cushions
  both answer.
- *Touching*: approaching is a contact now; receding, or overlapping by rounding, is none.
- *A ball that stops at contact* stops: a closing speed below rounding is no contact.
- *Inelastic collapse* (infinitely many hits in finite time): a ball with more than
  ``COLLAPSE`` hits in a row, each within ``CONTACT_TIME`` of the one before, is squeezed; while it
  is, its hits are elastic (the TC model of Luding and McNamara, Granular Matter 1, 1998, 113), and
  a warning says so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from pool_pymunk.contact import LAWS, Pair
from pool_pymunk.impact import NO_BALL, Impacts, Touch, closing_speed
from pool_pymunk.motion import (
    Vector,
    path_to_disc,
    slide,
    stopping_time,
    time_of_impact,
    time_to_slide,
)
from pool_pymunk.result import Trace
from pool_pymunk.scene import Scene, State
from pool_pymunk.solvers.settings import Settings, slip_warning

EPSILON = 2.0**-52
COLLAPSE = 500  # hits in a row, each within CONTACT_TIME of the last, that mark a collapse
CONTACT_TIME = 1e-3  # in units of radius / speed
SLOWEST = 1e-100  # m/s
MOST_EVENTS = 2_000_000
NEARLY_NOW = 1e-9  # s; contacts so close in time may be of one instant: their gaps decide


def solve(scene: Scene, start: State, settings: Settings) -> Trace:
    """Simulate exactly; ``settings.dt`` has no meaning here.

    Events carry their true times; the Run's positions are closed-form at any time.
    """
    table = EventTable(scene, start)
    trace = table.trace
    latest = math.inf if settings.max_time is None else settings.max_time
    most = MOST_EVENTS if settings.max_events is None else settings.max_events
    while table.queue:
        t = table.queue[0].t
        if t > latest or len(trace.events) >= most:
            trace.status = "max_time" if t > latest else "max_events"
            break
        table.next()
    else:
        if any(path.speed > 0.0 for path in table.paths if path.stop == math.inf):
            trace.status = "max_time" if latest < math.inf else "settled"
    if trace.status != "settled":
        trace.duration = latest if trace.status == "max_time" else table.now
        table.note_moving(trace.duration)
    return trace


class Path:
    """One ball's motion from a contact to the next, in closed form; it may end at rest."""

    __slots__ = ("direction", "end", "position", "reach", "rest", "speed", "stop", "t", "velocity")

    def __init__(self, t: float, position: Vector, velocity: Vector, deceleration: float) -> None:
        self.t = t
        self.position = position
        self.velocity = velocity
        speed = self.speed = math.hypot(*velocity)
        self.stop = t + stopping_time(speed, deceleration)  # when it rests
        self.end = math.inf  # when it meets a cushion
        if speed == 0.0:
            self.direction = (1.0, 0.0)
            self.reach, self.rest = 0.0, position
            return
        self.direction = (velocity[0] / speed, velocity[1] / speed)
        self.reach = speed * speed / (2.0 * deceleration) if deceleration > 0.0 else math.inf
        x, y, _, _ = slide(*position, *velocity, deceleration, self.stop - t if deceleration else 0)
        self.rest = (x, y)


class Event(NamedTuple):
    """What may happen at ``t``: a contact of ``a`` with ``b``, a cushion, or (neither) a stop."""

    t: float
    order: int
    a: int
    b: int
    cushion: int  # a face's number; a corner's number plus the number of faces; NO_CUSHION
    path_a: Path
    path_b: Path


NO_CUSHION = -1


class EventTable:
    """Balls, their paths, and the queue of what may happen next."""

    def __init__(self, scene: Scene, start: State) -> None:
        self.scene = scene
        self.deceleration = scene.deceleration
        self.impacts = Impacts(LAWS[scene.physics.law])
        self.trace = Trace(start)
        self.now = 0.0
        self.order = 0
        self.queue: list[Event] = []
        self.radius = [ball.radius for ball in scene.balls]
        self.edges = scene.table.edges if scene.table else ()
        self.corners = scene.table.reflex_corners if scene.table else ()
        self.boxes = np.zeros((4, len(scene.balls)))  # lowest x, y, highest x, y of each path
        self.hits = [0] * len(scene.balls)  # in a row, each soon after the one before
        self.last_hit = [-math.inf] * len(scene.balls)
        self.paths = [
            Path(0.0, p, v, self.deceleration)
            for p, v in zip(start.position, start.velocity, strict=True)
        ]
        for i in range(len(self.paths)):
            self._meet_cushions(i)
        for i, path in enumerate(self.paths):
            if path.speed > 0.0:
                self._meet_balls(i)

    # -- prediction ------------------------------------------------------------------------------

    def _push(self, t: float, a: int, b: int, cushion: int) -> None:
        self.order += 1
        path_b = self.paths[b] if b != NO_BALL else self.paths[a]
        heappush(self.queue, Event(t, self.order, a, b, cushion, self.paths[a], path_b))

    def _set_off(self, i: int, position: Vector, velocity: Vector) -> None:
        """Ball ``i`` begins a new path now."""
        self.paths[i] = Path(self.now, position, velocity, self.deceleration)
        self._meet_cushions(i)

    def _meet_cushions(self, i: int) -> None:
        """Queue the path's first cushion (in a corner: cushions), or its stop if that is first."""
        path, r = self.paths[i], self.radius[i]
        if path.speed > 0.0:
            lengths = list(self._cushion_lengths(path, r))
            first = min((length for length, _ in lengths), default=math.inf)
            if first <= path.reach and first < math.inf:
                path.end = path.t + time_to_slide(first, path.speed, self.deceleration)
                for length, cushion in lengths:
                    if length - first <= NEARLY_NOW * path.speed and length <= path.reach:
                        t = path.t + time_to_slide(length, path.speed, self.deceleration)
                        self._push(t, i, NO_BALL, cushion)
            elif path.stop < math.inf:
                self._push(path.stop, i, NO_BALL, NO_CUSHION)
        self._box(i)

    def _cushion_lengths(self, path: Path, r: float) -> Iterator[tuple[float, int]]:
        """Path length (m) to each cushion and corner that the path meets."""
        (x, y), (ux, uy) = path.position, path.direction
        faces = len(self.edges)
        for number, edge in enumerate(self.edges):
            sink = -(ux * edge.normal[0] + uy * edge.normal[1])
            if sink <= 0.0:
                continue
            height = edge.height(x, y) - r
            if height <= EPSILON * (abs(x) + abs(y)) and sink < 1e-12:
                continue  # along the cushion, to rounding
            length = max(height / sink, 0.0)
            along = edge.along(x + ux * length, y + uy * length)
            if height > -r and (not self.corners or 0.0 <= along <= edge.length):
                yield length, number
        for number in self.corners:
            cx, cy = self.edges[number].start
            length = path_to_disc((cx - x, cy - y), (ux, uy), r)
            if length < math.inf:
                yield length, faces + number

    def _box(self, i: int) -> None:
        """The box that ball ``i`` does not leave before its path ends."""
        path, r = self.paths[i], self.radius[i]
        x, y = path.position
        if path.end < math.inf:
            ex, ey = self._position(i, path.end)
        elif path.reach < math.inf:
            ex, ey = path.rest
        else:
            vx, vy = path.velocity
            ex = math.copysign(math.inf, vx) if vx else x
            ey = math.copysign(math.inf, vy) if vy else y
        r += 1e-9 * (r + abs(x) + abs(y))
        self.boxes[:, i] = (min(x, ex) - r, min(y, ey) - r, max(x, ex) + r, max(y, ey) + r)

    def _meet_balls(self, i: int) -> None:
        """Queue every contact of ball ``i``'s path with the others' paths."""
        for j in self._in_the_way(i):
            t = self._pair_time(i, j)
            if t < math.inf:
                self._push(t, min(i, j), max(i, j), NO_CUSHION)

    def _in_the_way(self, i: int) -> list[int]:
        """The balls whose boxes overlap that of ball ``i``."""
        lowest_x, lowest_y, highest_x, highest_y = self.boxes
        x0, y0, x1, y1 = self.boxes[:, i].tolist()
        near = (lowest_x <= x1) & (highest_x >= x0) & (lowest_y <= y1) & (highest_y >= y0)
        return [j for j in np.flatnonzero(near).tolist() if j != i]

    def _pair_time(self, i: int, j: int) -> float:
        """When balls ``i`` and ``j`` meet on their paths; infinite if they do not."""
        a, b = self.paths[i], self.paths[j]
        horizon = min(a.end, b.end)
        reach = self.radius[i] + self.radius[j] - self._give(i, j)
        rests_a, rests_b = a.stop <= self.now, b.stop <= self.now
        if rests_a and rests_b:
            return math.inf
        if not (rests_a or rests_b):
            t = self._both_move(a, b, reach, min(horizon, a.stop, b.stop))
            if t < math.inf:
                return t
        mover, rester = (a, b) if b.stop <= a.stop else (b, a)
        if rester.stop == math.inf:
            return math.inf
        t = self._one_moves(mover, rester.rest, reach)
        return t if max(rester.stop, self.now) <= t <= horizon else math.inf

    def _give(self, i: int, j: int) -> float:
        """How far squeezed balls overlap (m) that friction presses together as they move on.

        They would touch infinitely often; so they bounce, twice in a contact time.
        """
        if min(self.hits[i], self.hits[j]) <= COLLAPSE:
            return 0.0
        contact_time = min(self._contact_time(i), self._contact_time(j))
        return self.deceleration * contact_time**2 / 16.0

    def _contact_time(self, i: int) -> float:
        return CONTACT_TIME * self.radius[i] / max(self.paths[i].speed, SLOWEST)

    def _both_move(self, a: Path, b: Path, reach: float, until: float) -> float:
        now, deceleration = self.now, self.deceleration
        ax, ay, avx, avy = slide(*a.position, *a.velocity, deceleration, now - a.t)
        bx, by, bvx, bvy = slide(*b.position, *b.velocity, deceleration, now - b.t)
        pull = (
            deceleration * (a.direction[0] - b.direction[0]),
            deceleration * (a.direction[1] - b.direction[1]),
        )
        noise = 16.0 * EPSILON * (a.speed + b.speed)
        offset, velocity = (bx - ax, by - ay), (bvx - avx, bvy - avy)
        return now + time_of_impact(offset, velocity, pull, reach, until - now, noise)

    def _one_moves(self, mover: Path, rest: Vector, reach: float) -> float:
        x, y = mover.position
        length = path_to_disc((rest[0] - x, rest[1] - y), mover.direction, reach)
        if length >= mover.reach:
            return math.inf
        return mover.t + time_to_slide(length, mover.speed, self.deceleration)

    def _position(self, i: int, t: float) -> Vector:
        path = self.paths[i]
        x, y, _, _ = slide(*path.position, *path.velocity, self.deceleration, t - path.t)
        return (x, y)

    def _state(self, i: int) -> tuple[Vector, Vector]:
        """Position and velocity of ball ``i`` now."""
        path = self.paths[i]
        x, y, vx, vy = slide(*path.position, *path.velocity, self.deceleration, self.now - path.t)
        return (x, y), (vx, vy)

    # -- what happens ----------------------------------------------------------------------------

    def next(self) -> None:
        """Take the next event from the queue and let it happen, if it still can."""
        event = heappop(self.queue)
        if not self._is_current(event):
            return
        self.now = max(event.t, self.now)
        if event.b == NO_BALL and event.cushion == NO_CUSHION:
            path = self.paths[event.a]
            self.trace.stop(event.a, event.t, path.rest)
        else:
            self._contacts([event, *self._at_this_instant(event.t)])

    def _is_current(self, event: Event) -> bool:
        return self.paths[event.a] is event.path_a and (
            event.b == NO_BALL or self.paths[event.b] is event.path_b
        )

    def _at_this_instant(self, t: float) -> list[Event]:
        """Further contacts whose gap is closed, to rounding, at ``t``."""
        same: list[Event] = []
        later: list[Event] = []
        while self.queue and self.queue[0].t <= t + NEARLY_NOW:
            event = heappop(self.queue)
            if not self._is_current(event):
                continue
            stops = event.b == NO_BALL and event.cushion == NO_CUSHION
            closed = not stops and self._gap_is_closed(event)
            (same if closed else later).append(event)
        for event in later:
            heappush(self.queue, event)
        return same

    def _gap_is_closed(self, event: Event) -> bool:
        x, y = self._position(event.a, self.now)
        r = self.radius[event.a]
        if event.b != NO_BALL:
            r += self.radius[event.b]
            gap = math.dist((x, y), self._position(event.b, self.now)) - r
        elif event.cushion < len(self.edges):
            gap = self.edges[event.cushion].height(x, y) - r
        else:
            gap = math.dist((x, y), self.edges[event.cushion - len(self.edges)].start) - r
        return gap <= 32.0 * EPSILON * (abs(x) + abs(y) + r)

    def _contacts(self, events: list[Event]) -> None:
        """Answer the contacts of this instant, and predict what comes of it."""
        states = {i: self._state(i) for event in events for i in (event.a, event.b) if i != NO_BALL}
        velocity = [(0.0, 0.0)] * len(self.paths)
        for i, (_, v) in states.items():
            velocity[i] = v
        touches = [self._touch(event, states) for event in events]
        closing = [
            touch
            for touch in touches
            if closing_speed(touch, velocity) > 16.0 * EPSILON * self._speeds(touch)
        ]
        self.impacts.answer(closing, velocity)
        for touch in closing:
            self._note_contact(touch)
        moved = sorted({i for touch in closing for i in (touch.a, touch.b) if i != NO_BALL})
        for i in moved:
            self._go_on(i, states[i][0], velocity[i])
        for i in moved:
            self._meet_balls(i)
        for i in set(states) - set(moved):
            self._go_on_unless_touching(i, events)

    def _go_on_unless_touching(self, i: int, events: list[Event]) -> None:
        """A cushion met at no speed does not end the path: queue what follows it."""
        if any(event.a == i and event.b == NO_BALL for event in events):
            self._set_off(i, *self._state(i))
            self._meet_balls(i)

    def _speeds(self, touch: Touch) -> float:
        speed = self.paths[touch.a].speed
        return speed if touch.b == NO_BALL else speed + self.paths[touch.b].speed

    def _touch(self, event: Event, states: dict[int, tuple[Vector, Vector]]) -> Touch:
        (x, y), _ = states[event.a]
        if event.b != NO_BALL:
            bx, by = states[event.b][0]
            pair = self.scene.pair(event.a, event.b)
            normal = _unit(bx - x, by - y)
            return Touch(event.a, event.b, normal, self._elastic_if_squeezed(event, pair))
        e = self.scene.restitution.cushion
        assert e is not None
        pair = Pair(self.scene.balls[event.a].mass, math.inf, e, self.scene.friction.cushion)
        pair = self._elastic_if_squeezed(event, pair)
        if event.cushion < len(self.edges):
            number = event.cushion
            return Touch(event.a, NO_BALL, self.edges[number].normal, pair, number)
        number = event.cushion - len(self.edges)
        cx, cy = self.edges[number].start
        return Touch(event.a, NO_BALL, _unit(x - cx, y - cy), pair, number)

    def _note_contact(self, touch: Touch) -> None:
        if touch.b == NO_BALL:
            assert touch.cushion is not None
            self.trace.ball_cushion(self.now, touch.a, touch.cushion)
        else:
            self.trace.ball_ball(self.now, touch.a, touch.b)
        for i, j in self.impacts.zero_slips:
            ids = self.scene.balls[i].id, self.scene.balls[j].id
            self.trace.warn(slip_warning(*ids, self.now))
        self.impacts.zero_slips.clear()

    def _go_on(self, i: int, position: Vector, velocity: Vector) -> None:
        soon = self.now - self.last_hit[i] <= self._contact_time(i)
        self.hits[i] = self.hits[i] + 1 if soon else 0
        self.last_hit[i] = self.now
        if velocity == (0.0, 0.0):
            self.trace.stop(i, self.now, position)
        else:
            self.trace.knot(i, self.now, position, velocity)
        self._set_off(i, position, velocity)

    def _elastic_if_squeezed(self, event: Event, pair: Pair) -> Pair:
        squeezed = [i for i in (event.a, event.b) if i != NO_BALL and self.hits[i] > COLLAPSE]
        if not squeezed or pair.restitution == 1.0:
            return pair
        ids = ", ".join(self.scene.balls[i].id for i in squeezed)
        self.trace.warn(
            f"inelastic collapse of ball {ids} at {self.now:.6g} s: more than {COLLAPSE} hits in a "
            f"row, taken as elastic from there (TC model)"
        )
        return pair._replace(restitution=1.0)

    def note_moving(self, t: float) -> None:
        """Write down where the balls are that still move when the run is cut off."""
        for i, path in enumerate(self.paths):
            if path.stop > t:
                x, y, vx, vy = slide(*path.position, *path.velocity, self.deceleration, t - path.t)
                self.trace.knot(i, t, (x, y), (vx, vy))


def _unit(x: float, y: float) -> Vector:
    length = math.hypot(x, y)
    return (x / length, y / length) if length > 0.0 else (1.0, 0.0)
