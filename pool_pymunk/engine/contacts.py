"""The contact engine moves balls along their paths and answers what is due, in order.

When a ball sets off on a new path, the engine predicts its contacts with walls and with the paths
of other balls, and puts them in a queue. The earliest prediction in the queue happens next. A
prediction is void if a ball in it has a new path by then. Two things come from outside: a
:class:`~pool_pymunk.engine.near.Near` tells what is near a ball (by boxes around paths, or by the
broad phase of a pymunk space), and a :class:`Recorder` listens.

- *Grazing*: the distance of the centre from the path decides, in full precision, whether the path
  hits. A path that is tangent to rounding misses a corner. On a ball, such a graze changes nothing
  beyond rounding.
- *One instant*: contacts belong to one instant if their gaps are closed, to rounding, at the time
  of the first. At a corner, for example, both cushions answer.
- *Touching*: two balls that touch and approach have a contact now. Two that recede, or that overlap
  by rounding, have none.
- *Pockets*: a ball leaves the table at the instant at which its centre comes to a pocket's rim. It
  has no part in contacts of that instant.
- *Lost*: a ball is lost if within one rounding error of the time it travels more than ``LOST``
  radii, so that contact times mean nothing, or if a number has overflowed. ``is_finite`` is False
  from then on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from heapq import heapify, heappop, heappush
from random import Random

from pool_pymunk.engine import decisions
from pool_pymunk.engine.near import Near
from pool_pymunk.engine.orders import Doubt, Motions, moved, with_gaps
from pool_pymunk.engine.resolver import Resolution, Resolver, distinct
from pool_pymunk.physics.collapse import Collapse, Order
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair, Vector, closing_speed
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE, Path, motion_at, pair_time
from pool_pymunk.physics.sides import Wall, unit
from pool_pymunk.physics.surface import Surface

# This is two balls, lower number first; or a ball and -1 - a wall; or a ball twice, for its stop or
# for another look ahead.
Key = tuple[int, int]
Motion = tuple[float, float, float, float]  # x, y (m), vx, vy (m/s)
SHORT = 1000  # A shorter queue is not looked through for void predictions: that takes 0.1 ms.


class Recorder:
    """A recorder listens to the engine; this one does nothing.

    Balls are numbers, times are in s and places in m.
    """

    def contact(self, contact: Contact, t: float) -> None:
        """Take note that two balls, or a ball and a cushion, hit each other."""

    def path(self, i: int, path: Path) -> None:
        """Take note that ball ``i`` begins a new path."""

    def stop(self, i: int, t: float, position: Vector) -> None:
        """Take note that ball ``i`` comes to rest."""

    def pocketed(self, i: int, pocket: int, t: float, motion: Motion, center: Vector) -> None:
        """Take note that a pocket has taken ball ``i`` in.

        It came to the rim with this ``motion``, and lies at the pocket's ``center`` from now on.
        """

    def stop_revoked(self, i: int, t: float) -> None:
        """Take note that ball ``i`` was not at rest at ``t``: a persistent contact drives it on."""

    def zero_slip(self, contact: Contact, t: float) -> None:
        """Take note that the law jumps at zero slip, and that this slip was taken for zero.

        Only rounding knew whether it was zero.
        """

    def persistent(self, contact: Contact, t: float) -> None:
        """Take note that friction presses two balls together.

        They hit each other once in a contact time.
        """

    def no_end(self, contacts: Collection[Contact], collapse: Collapse, t: float) -> None:
        """Take note of hits without end, which are not listed one by one."""

    def order_unknown(self, doubt: Doubt, t: float) -> None:
        """Take note that the order of the contacts of one instant matters, and is unknown."""


Due = tuple[float, int, Key, Path, Path]  # when (s), in which order, what, on which paths


class ContactEngine:
    """The contact engine holds the balls, their paths, and the queue of what happens next."""

    def __init__(
        self,
        law: Law,
        pair: Callable[[int, int], Pair],
        surface: Surface,
        recorder: Recorder,
    ) -> None:
        self.resolver = Resolver(law, surface)
        self.pair = pair
        self.surface = surface
        self.recorder = recorder
        self.near: Near
        self.paths = self.resolver.paths
        self.radii = self.resolver.radii
        self.noises = self.resolver.noises
        self.masses: list[float] = []
        self.walls: list[Wall] = []
        # the time (s) since when the ball rests; infinite for a ball that moves
        self.rested: list[float] = []
        self.path_ends: list[float] = []  # the time (s) at which each path meets a wall
        self.ends: list[float] = []  # the time (s) until which each path is looked at
        self.now = 0.0
        self.answered = 0  # instants and stops, micro-collisions included
        self.listed = 0  # contacts and stops that are events
        self.unlisted = 0  # instants without an event, such as those of micro-collisions
        self.most = math.inf  # events after which the engine goes no further
        self.most_unlisted = math.inf  # unlisted instants after which it is given up
        self.is_finite = True
        self.errors: Random | None = None  # If given, every new path gets some of these.
        self._queue: list[Due] = []
        self._full = SHORT  # From this length on void predictions leave the queue.
        self._order = 0
        self._instant = -math.inf  # the time at which the present rounds of contacts began
        self._rounds = 0
        self._met_now: dict[Key, None] = {}  # what met in these rounds
        self._before: dict[int, Vector] = {}  # velocities (m/s) before these rounds
        self.measures_orders = False  # whether to find out what the order in rounds decides
        self._is_measured = False  # whether that has been done for these rounds

    # -- setting up ----------------------------------------------------------------------------

    def vary(self, variant: decisions.Variant) -> None:
        """Play this variant of the run."""
        self.resolver.variant = variant
        self.errors = None if variant.seed is None else Random(variant.seed)

    def add_ball(self, path: Path, radius: float, mass: float) -> int:
        """Put a ball on the table, and return its number."""
        self.paths.append(path)
        self.noises.append(NOISE * path.speed)
        self.radii.append(radius)
        self.masses.append(mass)
        self.rested.append(math.inf if path.moves else -math.inf)
        self.path_ends.append(math.inf)
        self.ends.append(math.inf)
        self.is_finite = self.is_finite and not path.is_lost(radius)
        return len(self.paths) - 1

    def remove(self, i: int, at: Vector | None = None) -> None:
        """Take ball ``i`` off the table, so that it meets nothing any more.

        It lies where it is, or ``at`` a place (m).
        """
        path = self.paths[i]
        x, y, _, _ = motion_at(path, max(self.now, path.t))
        self.paths[i] = self.surface.path(self.now, at or (x, y), (0.0, 0.0))
        self.rested[i] = self.now
        self.near.remove(i)
        self.resolver.forget(i)

    def turn_back(self, t: float) -> None:
        """Go back to an earlier time (s): what was due is forgotten, and all paths must be new."""
        self.now, self._instant, self._rounds = t, -math.inf, 0
        self._met_now.clear()
        self._queue.clear()

    def set_off(self, i: int, path: Path) -> None:
        """Put ball ``i`` on a new path that somebody else gave it."""
        if path.moves:
            self.rested[i] = math.inf
        self._begin(i, path, NOISE * path.speed)
        self.recorder.path(i, path)

    # -- what is due -----------------------------------------------------------------------------

    def predict(self, balls: Collection[int]) -> None:
        """Predict where the paths of these balls lead: to walls, to their ends, to other balls."""
        near = self.near
        for i in balls:
            path, end = self.paths[i], math.inf
            if path.moves:
                for wall in near.walls(i):
                    t = self.meet_wall(i, wall)
                    if t < end:
                        end = t
                if end < math.inf:
                    end += decisions.nearly_now(self.radii[i], path.speed)
                elif path.end < math.inf:
                    self.push(path.end, (i, i))
            self.path_ends[i] = end
        self._look_ahead(balls)

    def _look_ahead(self, balls: Collection[int]) -> None:
        """Predict which others these balls meet, as far as their paths are looked at."""
        near = self.near
        for i in balls:
            path, end = self.paths[i], self.path_ends[i]
            horizon = near.horizon(path, self.now)
            if horizon < end and horizon < path.end:
                end = horizon
                self.push(end, (i, i))
            self.ends[i] = end
            near.begin(i, path, self.radii[i], self.now, end)
        done: set[int] = set()
        for i in balls:
            for j in near.balls(i, self.now):
                if j not in done:
                    self.meet(i, j)
            done.add(i)

    def meet(self, i: int, j: int, just_missed: bool = False) -> None:
        """Predict when two balls meet on their present paths.

        Balls in a lasting contact that close faintly, or that have just missed each other by
        rounding, meet a contact time later.
        """
        if i > j:
            i, j = j, i
        a, b, radii, ends = self.paths[i], self.paths[j], self.radii, self.ends
        since = max(self.now, a.t, b.t)
        until = ends[i] if ends[i] < ends[j] else ends[j]
        lasting = self.resolver.lasting(i, j, since)
        noise, other = self.noises[i], self.noises[j]
        noise = noise if noise > other else other
        t = pair_time(a, b, radii[i] + radii[j], since, until, lasting, noise)
        if t <= since and (
            (just_missed and lasting.time > 0.0)
            or (lasting.faint > 0.0 and self._is_faint((i, j), lasting.faint))
        ):
            t = since + lasting.time
            if t > min(until, max(a.end, b.end)):
                return
        if t < math.inf:
            self.push(t, (i, j))

    def _is_faint(self, key: Key, faint: float) -> bool:
        """Tell whether two balls that touch close more slowly than ``faint`` (m/s)."""
        motions, [contact] = self._contacts([key])
        return closing_speed(contact, _velocities(motions)) < faint

    def meet_wall(self, i: int, wall: int) -> float:
        """Predict when a ball meets a wall, and return that time (s).

        It is never before now, and infinite if the ball does not meet the wall.
        """
        path = self.paths[i]
        t = self.walls[wall].time_of_contact(path, self.radii[i], self.now)
        if t < math.inf:
            self.push(t, (i, -1 - wall))
        return t

    def push(self, t: float, key: Key) -> None:
        """Put into the queue what is due at ``t`` (s)."""
        self._order += 1
        i, j = key
        path = self.paths[i]
        heappush(self._queue, (t, self._order, key, path, self.paths[j] if j >= 0 else path))
        if len(self._queue) > self._full:
            self._leave_out_void()

    def _leave_out_void(self) -> None:
        """Leave out of the queue what is void, and what is in it twice.

        The queue may then double its length until the next time, so that a push stays cheap.
        """
        queue = self._queue
        current = [due for due in queue if self._is_current(due)]
        queue[:] = {(due[0], due[2]): due for due in sorted(current, reverse=True)}.values()
        heapify(queue)
        self._full = max(SHORT, 2 * len(queue))

    def _is_current(self, due: Due) -> bool:
        _, _, (i, j), path, other = due
        return self.paths[i] is path and (j < 0 or self.paths[j] is other)

    def upcoming(self) -> float:
        """Return the time (s) at which something happens next; infinite if nothing does."""
        queue = self._queue
        while queue and not self._is_current(queue[0]):
            heappop(queue)
        return queue[0][0] if queue else math.inf

    # -- what happens ----------------------------------------------------------------------------

    def advance(self, until: float) -> None:
        """Play what is due up to ``until`` (s), within the engine's bounds."""
        while self.is_finite and not self.is_over:
            if self.upcoming() > until or not self._queue:
                return
            self.next()

    @property
    def is_over(self) -> bool:
        """Tell whether as much has happened as may happen."""
        return self.listed >= self.most or self.is_given_up

    @property
    def is_given_up(self) -> bool:
        """Tell whether micro-collisions went on for so long that they are taken to have no end."""
        return self.unlisted >= self.most_unlisted

    def next(self) -> None:
        """Play what is due next: a stop, or the contacts and pockets of one instant."""
        t, _, key, path, other = heappop(self._queue)
        self.now = max(t, self.now)
        if key[0] == key[1] and t < path.end:
            self._look_ahead(key[:1])
            return
        self.answered += 1
        if key[0] == key[1]:
            if self.rested[key[0]] == math.inf:  # A path may have been predicted twice.
                self._stop(key[0], path.end, path.rest)
        else:
            speed = max(path.speed, other.speed)
            latest = self.now + decisions.nearly_now(self.radii[key[0]], speed)
            same = self._queue and self._queue[0][0] <= latest
            keys = [key, *self._at_this_instant(key, latest)] if same else [key]
            keys = self._pocket(keys)
            if keys:
                self._answer(keys)

    def _pocket(self, keys: list[Key]) -> list[Key]:
        """Let pockets take in the balls that have come to them, and return the other contacts.

        These are contacts of balls that are still on the table.
        """
        walls = self.walls
        gone = {i: walls[-1 - j] for i, j in keys if j < 0 and walls[-1 - j].center is not None}
        if not gone:
            return keys
        for i, wall in gone.items():
            motion = motion_at(self.paths[i], self.now)
            self.listed += 1
            self.remove(i, wall.center)
            assert wall.center is not None, "it is a pocket"
            self.recorder.pocketed(i, wall.number, self.now, motion, wall.center)
        self._met_now = {key: None for key in self._met_now if gone.keys().isdisjoint(key)}
        return [key for key in keys if gone.keys().isdisjoint(key)]

    def _at_this_instant(self, first: Key, latest: float) -> list[Key]:
        """Return further contacts that are due until ``latest`` (s) and already closed."""
        queue = self._queue
        same: dict[Key, None] = {}
        later: list[Due] = []
        while queue and queue[0][0] <= latest:
            due = heappop(queue)
            if self._is_current(due):
                t, _, key, path, other = due
                speed = path.speed if path.speed > other.speed else other.speed
                is_near = t <= self.now + decisions.nearly_now(self.radii[key[0]], speed)
                if is_near and key[0] != key[1] and self._is_closed(key):
                    same[key] = None
                else:
                    later.append(due)
        for due in later:
            heappush(queue, due)
        return [key for key in same if key != first]

    def _is_closed(self, key: Key, times: float = 1.0) -> bool:
        motions = {i: motion_at(self.paths[i], self.now) for i in key if i >= 0}
        x, y, _, _ = motions[key[0]]
        reach = sum(self.radii[i] for i in motions)
        return decisions.is_closed(self.gap(key, motions) / times, x, y, reach)

    def gap(self, key: Key, motions: Motions) -> float:
        """Return the distance (m) between two surfaces; it is negative where they overlap."""
        i, j = key
        x, y, _, _ = motions[i]
        if j < 0:
            return self.walls[-1 - j].nearest(x, y, self.radii[i]).gap(x, y, self.radii[i])
        dx, dy = motions[j][0] - x, motions[j][1] - y
        return math.sqrt(dx * dx + dy * dy) - self.radii[i] - self.radii[j]

    def _known_gap(self, key: Key, motions: Motions) -> float:
        """Return a gap (m), or 0 where rounding hides it."""
        if self._is_taken_to_touch(key):
            return 0.0
        x, y, _, _ = motions[key[0]]
        gap = self.gap(key, motions)
        return gap if gap > 2.0 * EPSILON * (abs(x) + abs(y) + self.radii[key[0]]) else 0.0

    # -- contacts --------------------------------------------------------------------------------

    def _answer(self, keys: Collection[Key]) -> None:
        """Answer the contacts of this instant, and predict what follows from them."""
        motions, contacts = self._contacts(keys)
        rounds = self._rounds_here(keys, motions)
        if self.measures_orders and (rounds > 1 or len(contacts) > 1):
            self._measure_order()
        if rounds > decisions.FEW_ROUNDS or self._is_varied(keys):
            self._answer_cluster(contacts)
            return
        resolution = self.resolver.resolve(contacts, _velocities(motions), self.now)
        if self.measures_orders and resolution.missed:
            self._measure_order()
        self._report(resolution)
        self._set_off(resolution, motions)
        self.predict(resolution.velocity)
        self._meet_later(resolution.missed)

    def _measure_order(self) -> None:
        """Measure once what the order of the contacts of this instant decides."""
        if self._is_measured:
            return
        self._is_measured = True
        self._doubt(self._touching(self._met_now), self._before)

    def look_at_start(self) -> None:
        """Look at what touches at the start and moves, because rounding may hide that it closes.

        Measure what hits would decide, or answer them if this variant of the run has its own order.
        """
        for i, path in enumerate(self.paths):
            if not path.moves:
                continue
            keys = self._touching((), [i])
            if self.measures_orders:
                self._doubt(keys, {})
            elif len(keys) > 1:
                self._met_now = dict.fromkeys(keys)
                self._answer_cluster(())

    def _doubt(self, keys: Collection[Key], before: Mapping[int, Vector]) -> None:
        """Find out what the order of these contacts decides, and tell the recorder."""
        motions, contacts = self._contacts(keys)
        if len(contacts) > 1:
            doubt = self.resolver.doubt(contacts, {**_velocities(motions), **before})
            if doubt.orders:
                self.recorder.order_unknown(doubt, self.now)

    def _is_varied(self, keys: Collection[Key]) -> bool:
        """Tell whether this variant of the run has an order of its own for these contacts."""
        variant = self.resolver.variant
        if variant.gaps is not None:
            return len(self._touching(keys)) > 1
        return variant.otherwise and self._strikes_pressed(keys)

    def _strikes_pressed(self, keys: Collection[Key]) -> bool:
        """Tell whether a ball is hit that presses on yet another one.

        Tiny gaps of a persistent contact decide the order of hits then. A variant of the run closes
        them, to see what hangs on it.
        """
        is_pressed, now = self.resolver.is_pressed, self.now
        pressed = [pair for pair in self.resolver.pressed(now) if pair not in keys]
        others = {i for pair in pressed for i in pair}
        return any(not others.isdisjoint(key) and not is_pressed(key, now) for key in keys)

    def _answer_cluster(self, closing: Collection[Contact]) -> None:
        """Answer round after round of this instant, until nothing closes.

        The balls are near each other, so that one look at what touches serves for all rounds.
        """
        keys = self._touching(self._met_now)
        motions, contacts = self._contacts(keys, with_gaps=True)
        variant = self.resolver.variant
        if variant.gaps is not None:
            motions, contacts = self._opened(keys, motions, variant.gaps)
        velocity = _velocities(motions)
        order = Order(contacts)
        if variant.otherwise:
            order.forget()
        elif variant.gaps is not None:
            closing = order.next(velocity, self._noise(velocity)) or closing
        changed: dict[int, None] = {}
        missed: list[Contact] = []
        hits = 0
        endless = False
        while closing and not endless and not self.is_over and self.is_finite:
            endless = hits > decisions.LISTED and self.resolver.loses_speed(contacts)
            if endless:
                left = order.left()
                resolution, collapse = self.resolver.play_out(left, velocity)
                self.recorder.no_end(contacts, collapse, self.now)
            else:
                balls = {i: velocity[i] for contact in closing for i in contact.balls}
                resolution = self.resolver.resolve(list(closing), balls, self.now)
            hits += len(resolution.hits)
            missed += resolution.missed
            self._report(resolution)
            self._set_off(resolution, motions)
            for i in resolution.velocity:
                velocity[i] = self.paths[i].vx, self.paths[i].vy
                changed[i] = None
            noise = self._noise(velocity)
            closing = order.next(velocity, noise) if resolution.velocity else []
        self._rounds = 0
        self._met_now.clear()
        self.predict(changed)
        self._meet_later([each for each in missed if changed.keys().isdisjoint(each.balls)])

    def _opened(
        self, keys: Collection[Key], motions: Motions, pattern: int
    ) -> tuple[Motions, list[Contact]]:
        """Return the motions and contacts with the gaps of a pattern."""
        if self.errors is not None:
            motions = moved(motions, self.errors)
        contacts = distinct([self.contact(key, motions) for key in keys])
        return motions, with_gaps(contacts, pattern)

    def _noise(self, balls: Iterable[int]) -> float:
        return max(self.noises[i] for i in balls)

    def _touching(self, keys: Iterable[Key], balls: Iterable[int] = ()) -> list[Key]:
        """Return these contacts, and what touches their balls or the others now, and so on."""
        found: dict[Key, None] = dict.fromkeys(keys)
        balls = list(dict.fromkeys([*balls, *(i for key in found for i in key if i >= 0)]))
        seen = set(balls)
        for i in balls:  # This list grows.
            for j in self.near.touching(i, self.now):
                key = (i, j) if j < 0 or i < j else (j, i)
                if j < 0 and self.walls[-1 - j].is_pocket:
                    continue
                if key not in found and self._touches(key):
                    found[key] = None
                    if j >= 0 and j not in seen:
                        seen.add(j)
                        balls.append(j)
        return list(found)

    def _touches(self, key: Key) -> bool:
        """Tell whether two sides touch now, or nearly so."""
        return self._is_closed(key, decisions.NEARLY_CLOSED) or self._is_taken_to_touch(key)

    def _is_taken_to_touch(self, key: Key) -> bool:
        """Tell whether this variant of the run has these balls touch, because they press."""
        return self.resolver.variant.otherwise and self.resolver.is_pressed(key, self.now)

    def _meet_later(self, missed: Iterable[Contact]) -> None:
        """Predict when balls hit that touch, but do not close fast enough now."""
        for contact in missed:
            if contact.b != NO_BALL and all(self.paths[i].end > self.now for i in contact.balls):
                self.meet(contact.a, contact.b, just_missed=True)

    def _contacts(
        self, keys: Collection[Key], with_gaps: bool = False
    ) -> tuple[Motions, list[Contact]]:
        """Return how the balls move now, and their contacts, each of them once."""
        motions = {i: motion_at(self.paths[i], self.now) for key in keys for i in key if i >= 0}
        if self.errors is not None:
            motions = {i: self._misplaced(each) for i, each in motions.items()}
        found = [self.contact(key, motions) for key in keys]
        if with_gaps:
            gaps = [self._known_gap(key, motions) for key in keys]
            found = [hit._replace(gap=gap) for hit, gap in zip(found, gaps, strict=True)]
        return motions, distinct(found) if len(found) > 1 else found

    def contact(self, key: Key, motions: Motions) -> Contact:
        """Return the contact of two balls, or of a ball and a wall."""
        i, j = key
        x, y, _, _ = motions[i]
        r = self.radii[i]
        if j < 0:
            wall = self.walls[-1 - j]
            nx, ny = normal = wall.nearest(x, y, r).normal(x, y)
            pair = Pair(self.masses[i], math.inf, wall.restitution, wall.friction)
            return Contact(i, NO_BALL, normal, pair, wall.number, (x - r * nx, y - r * ny))
        bx, by, _, _ = motions[j]
        nx, ny = normal = unit(bx - x, by - y)
        return Contact(i, j, normal, self.pair(i, j), None, (x + r * nx, y + r * ny))

    def _rounds_here(self, keys: Iterable[Key], balls: Motions) -> int:
        """Count this round of contacts at one instant, and return how many there were."""
        i = max(balls, key=lambda ball: self.paths[ball].speed)
        path = self.paths[i]
        length = decisions.instant(self.now, path.x, path.y, self.radii[i], path.speed)
        if self.now - self._instant > length:
            self._instant, self._rounds = self.now, 0
            self._met_now.clear()
            self._before.clear()
            self._is_measured = False
        self._rounds += 1
        for ball in balls:
            self._before.setdefault(ball, balls[ball][2:])
        self._met_now.update(dict.fromkeys(keys))
        return self._rounds

    def _set_off(self, resolution: Resolution, motions: Motions) -> None:
        """Give the balls their new paths."""
        for i, velocity in resolution.velocity.items():
            x, y, _, _ = motions[i]
            if self.errors is not None and velocity != (0.0, 0.0):
                fastest, (vx, vy) = resolution.noise / NOISE, velocity
                velocity = vx + self._error(fastest), vy + self._error(fastest)
            path = self.surface.path(self.now, (x, y), velocity)
            if path.moves:
                self.rested[i] = math.inf
                self.recorder.path(i, path)
            elif self.rested[i] == math.inf:
                self._stop(i, self.now, (x, y))
            self._begin(i, path, resolution.noise)

    def _misplaced(self, motion: Motion) -> Motion:
        """Return a motion whose place (m) has random errors of the size of rounding.

        The place is that at the present time, which is rounded as well.
        """
        x, y, vx, vy = motion
        late = self._error(self.now)
        return x + self._error(x) + vx * late, y + self._error(y) + vy * late, vx, vy

    def _error(self, number: float) -> float:
        """Return a random rounding error of a number."""
        assert self.errors is not None
        return 0.5 * EPSILON * number * self.errors.uniform(-1.0, 1.0)

    def _begin(self, i: int, path: Path, noise: float) -> None:
        self.paths[i], self.noises[i] = path, noise
        if path.is_lost(self.radii[i]):
            self.is_finite = False

    def _report(self, resolution: Resolution) -> None:
        """Tell the recorder about the contacts of this instant."""
        self.listed += len(resolution.listed)
        self.unlisted += not resolution.listed
        for contact in resolution.listed:
            self.recorder.contact(contact, self.now)
        for contact, last in resolution.micro:
            self._revoke_stops(contact, last)
        for contact in resolution.zero_slips:
            self.recorder.zero_slip(contact, self.now)
        for contact in (*[hit for hit, _ in resolution.persistent], *resolution.often):
            self.recorder.persistent(contact, self.now)

    def _stop(self, i: int, t: float, position: Vector) -> None:
        self.listed += 1
        self.rested[i] = t
        self.recorder.stop(i, t, position)

    def _revoke_stops(self, contact: Contact, last: float) -> None:
        """Revoke stops between two micro-collisions of a pair: these balls are not at rest."""
        for i in contact.balls:
            if last <= self.rested[i] < math.inf:
                self.listed -= 1
                self.recorder.stop_revoked(i, self.rested[i])
                self.rested[i] = math.inf


def _velocities(motions: Motions) -> dict[int, Vector]:
    return {i: (vx, vy) for i, (_, _, vx, vy) in motions.items()}
