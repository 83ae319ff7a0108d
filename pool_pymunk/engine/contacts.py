"""The contact engine moves balls along their paths and answers what is due, in order.

When a ball sets off on a new path, the engine predicts its contacts with walls and with the paths
of other balls, and puts them in a queue (:mod:`~pool_pymunk.engine.due`). The earliest prediction
happens next. Two things come from outside: a :class:`~pool_pymunk.engine.near.Near` tells what is
near a ball (by boxes around paths, or by the broad phase of a pymunk space), and a
:class:`~pool_pymunk.engine.recorder.Recorder` listens.

- *Grazing*: the distance of the centre from the path decides, in full precision, whether the path
  hits. A path that is tangent to rounding misses a corner. On a ball, such a graze changes nothing
  beyond rounding.
- *One instant*: contacts belong to one instant if their gaps are closed, to rounding, at the time
  of the first. At a corner, for example, both cushions answer.
- *Touching*: two balls that touch and approach have a contact now. Two that recede, or that overlap
  by rounding, have none.
- *Pockets*: a ball leaves the table at the instant at which its centre comes to a pocket's rim. It
  has no part in contacts of that instant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from heapq import heappop, heappush

from pool_pymunk.engine import decisions
from pool_pymunk.engine.balls import Balls, Motions
from pool_pymunk.engine.due import Due, Hit, Look, PairHit, Queue, Stop, WallHit, hit_of
from pool_pymunk.engine.instant import Instant, velocities
from pool_pymunk.engine.near import Near
from pool_pymunk.engine.persistent import PersistentContacts
from pool_pymunk.engine.policies import Exact, Policy, Variant
from pool_pymunk.engine.recorder import Motion, Recorder
from pool_pymunk.engine.resolver import (
    HIT,
    MICRO,
    Answer,
    Resolution,
    Resolver,
    cushion_pushes,
    distinct,
)
from pool_pymunk.physics.contact import Contact, Pair, Vector, closing_speed
from pool_pymunk.physics.laws import Law
from pool_pymunk.physics.path import NOISE, NOT_MET, Path, motion_at, pair_time
from pool_pymunk.physics.sides import Wall
from pool_pymunk.physics.surface import Surface

__all__ = ["ContactEngine", "Motion", "Recorder"]


class Tally:
    """A tally counts instants, events, and instants without an event, and knows how many may be."""

    def __init__(self, most: float = math.inf, most_unlisted: float = math.inf) -> None:
        self.answered = self.listed = self.unlisted = 0
        self.most, self.most_unlisted = most, most_unlisted

    @property
    def is_given_up(self) -> bool:
        """Tell whether micro-collisions are taken to have no end."""
        return self.unlisted >= self.most_unlisted


class ContactEngine(Balls):
    """The contact engine knows what happens to the balls next, and lets it happen."""

    near: Near

    def __init__(
        self, law: Law, pair: Callable[[int, int], Pair], surface: Surface, recorder: Recorder
    ) -> None:
        super().__init__(pair, surface)
        persistent = PersistentContacts(self.paths, self.radii, surface.pull)
        self.resolver = Resolver(law, persistent, self.noises)
        self.history = persistent.history
        self.recorder = recorder
        self.tally = Tally()
        self.queue = Queue(self.paths)
        self.push = self.queue.push
        self.upcoming = self.queue.upcoming
        self.instant = Instant()
        self.policy: Policy = Policy(Exact())
        self._told: tuple[Answer, ...] = ()  # that of the contact of which the recorder is told

    # -- setting up ----------------------------------------------------------------------------

    def vary(self, variant: Variant, measures: bool, touch: bool = True) -> None:
        """Play this variant of the run, whose policy looks at what may ``touch`` at the start."""
        self.policy = variant.policy(self.resolver, measures)
        if touch and self.is_finite:
            self.policy.begin(self)

    def remove(self, i: int, at: Vector | None = None) -> None:
        """Take ball ``i`` off the table, and let it lie where it is, or ``at`` a place (m)."""
        path = self.paths[i]
        x, y, _, _ = motion_at(path, max(self.now, path.t))
        self.paths[i], self.speeds[i] = self.surface.path(self.now, at or (x, y), (0.0, 0.0)), 0.0
        self.rested[i] = self.now
        self.near.remove(i)
        self.resolver.persistent.forget(i)

    def turn_back(self, t: float) -> None:
        """Go back to an earlier time (s): what was due is forgotten, and all paths must be new."""
        self.now, self.instant = t, Instant()
        self.queue.clear()

    def set_off(self, i: int, path: Path) -> None:
        """Put ball ``i`` on a new path that somebody else gave it."""
        if path.moves:
            self.rested[i] = math.inf
        self._begin(i, path, NOISE * path.fastest)
        self.recorder.path(i, path)

    # -- what is due -----------------------------------------------------------------------------

    def predict(self, balls: Collection[int]) -> None:
        """Predict where the paths of these balls lead: to walls, to their ends, to other balls."""
        walls, now, push = self.walls, self.now, self.push
        for i in balls:
            path, end, radius = self.paths[i], math.inf, self.radii[i]
            if path.moves:
                for wall in self.near.walls(i):
                    t = walls[wall].time_of_contact(path, radius, now)
                    if t < math.inf:
                        push(t, WallHit(i, wall))
                        if t < end:
                            end = t
                if end < math.inf:
                    end += decisions.nearly_now(radius, self.speeds[i])
                elif path.end < math.inf:
                    push(path.end, Stop(i))
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
                self.push(end, Look(i))
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

        Balls in a persistent contact that close faintly, or that have just missed each other by
        rounding, meet a contact time later.
        """
        if i > j:
            i, j = j, i
        a, b, radii, since = self.paths[i], self.paths[j], self.radii, self.now
        if a.t > since or b.t > since:
            since = max(a.t, b.t)
        until, other = self.ends[i], self.ends[j]
        until = until if until < other else other
        noise, other = self.noises[i], self.noises[j]
        noise = noise if noise > other else other
        history, lasting = self.history, NOT_MET
        if (i, j) in history:
            lasting = self.resolver.persistent.lasting(i, j, since)
        t = pair_time(a, b, radii[i] + radii[j], since, until, lasting, noise)
        if t == math.inf:
            return
        waits = t <= since and lasting.time > 0.0
        if waits and (just_missed or self._is_faint(PairHit(i, j), lasting.faint)):
            t = since + lasting.time
            if t > min(until, max(a.end, b.end)):
                return
        self.push(t, PairHit(i, j))

    def _is_faint(self, hit: Hit, faint: float) -> bool:
        """Tell whether two balls that touch close more slowly than ``faint`` (m/s)."""
        if faint == 0.0:
            return False
        motions, [contact] = self.contacts([hit])
        return closing_speed(contact, velocities(motions)) < faint

    def meet_wall(self, i: int, wall: int) -> float:
        """Predict when a ball meets a wall, and return that time (s), or infinity."""
        t = self.walls[wall].time_of_contact(self.paths[i], self.radii[i], self.now)
        if t < math.inf:
            self.push(t, WallHit(i, wall))
        return t

    def _meet_later(self, missed: Iterable[Contact]) -> None:
        """Predict when balls hit that touch, but do not close fast enough now."""
        for contact in missed:
            if all(self.paths[i].end > self.now for i in contact.balls):
                self.meet(contact.a, contact.b, just_missed=True)

    # -- what happens ----------------------------------------------------------------------------

    @property
    def is_over(self) -> bool:
        """Tell whether as much has happened as may happen."""
        tally = self.tally
        return tally.listed >= tally.most or tally.unlisted >= tally.most_unlisted

    def advance(self, until: float) -> None:
        """Play what is due up to ``until`` (s), within the engine's bounds."""
        while self.is_finite and not self.is_over:
            if self.upcoming() > until or not self.queue:
                return
            self.next()

    def next(self) -> None:
        """Play what is due next: a look ahead, a stop, or the contacts of one instant."""
        t, _, what, path, _ = heappop(self.queue)
        if t > self.now:
            self.now = t
        if what.kind == "look":
            self._look_ahead(what[:1])
            return
        self.tally.answered += 1
        if what.kind == "stop":
            self._end(what.i, path)
            return
        latest = self._latest(what)
        is_alone = not self.queue or self.queue[0][0] > latest
        hits = [what] if is_alone else [what, *self._at_this_instant(what, latest)]
        if not is_alone or what.kind == "wall":
            hits = self._pocket(hits)
        if hits:
            self._answer(hits)

    def _end(self, i: int, path: Path) -> None:
        """Let ball ``i`` rest at the end of its path, or go on as the surface says."""
        then = self.surface.then(path)
        if then is not None and then.moves:
            self.tally.listed += 1
            self.recorder.roll(i, then)
            self.set_off(i, then)
            self.predict([i])
        elif self.rested[i] == math.inf:  # A path may have been predicted twice.
            self._stop(i, path.end, path.rest)
            if then is not None:
                self._begin(i, then, 0.0)
                self.predict([i])

    def _latest(self, hit: Hit) -> float:
        """Return up to when (s) contacts may be of the instant of this one."""
        speed = self.speeds[hit.i]
        if hit.kind == "pair":
            speed = max(speed, self.speeds[hit.j])
        return self.now + decisions.nearly_now(self.radii[hit.i], speed)

    def _at_this_instant(self, first: Hit, latest: float) -> list[Hit]:
        """Return further contacts that are due until ``latest`` (s) and already closed."""
        same: dict[Hit, None] = {}
        later: list[Due] = []
        for due in self.queue.take_until(latest):
            t, _, what, _, _ = due
            if what.kind == "stop" or what.kind == "look":
                later.append(due)
            elif t <= self._latest(what) and self.is_closed(what, self.motions([what])):
                same[what] = None
            else:
                later.append(due)
        for due in later:
            heappush(self.queue, due)
        return [hit for hit in same if hit != first]

    def _pocket(self, hits: list[Hit]) -> list[Hit]:
        """Let pockets take balls in, and return the contacts of those still on the table."""
        walls, gone = self.walls, dict[int, Wall]()
        for hit in hits:
            if hit.kind == "wall" and walls[hit.wall].center is not None:
                gone[hit.i] = walls[hit.wall]
        if not gone:
            return hits
        for i, wall in gone.items():
            motion = motion_at(self.paths[i], self.now)
            self.tally.listed += 1
            self.remove(i, wall.center)
            assert wall.center is not None, "it is a pocket"
            self.recorder.pocketed(i, wall.number, self.now, motion, wall.center)
        self.instant.leave_out(gone)
        return [hit for hit in hits if gone.keys().isdisjoint(hit.balls)]

    # -- contacts --------------------------------------------------------------------------------

    def contacts(
        self, hits: Collection[Hit], with_gaps: bool = False
    ) -> tuple[Motions, list[Contact]]:
        """Return how the balls move now, and their contacts, each of them once."""
        motions = self.policy.errors.places(self.motions(hits), self.now)
        found = [self.contact(hit, motions) for hit in hits]
        if with_gaps:
            closes = self.policy.closes
            gaps = [0.0 if closes(hit, self.now) else self.known_gap(hit, motions) for hit in hits]
            found = [each._replace(gap=gap) for each, gap in zip(found, gaps, strict=True)]
        return motions, distinct(found) if len(found) > 1 else found

    def touching(self, hits: Iterable[Hit], balls: Iterable[int] = ()) -> list[Hit]:
        """Return these hits, and what touches their balls or the others now, and so on."""
        found: dict[Hit, None] = dict.fromkeys(hits)
        balls = list(dict.fromkeys([*balls, *(i for hit in found for i in hit.balls)]))
        for i in balls:  # This list grows.
            for j in self.near.touching(i, self.now):
                if j < 0 and self.walls[-1 - j].is_pocket:
                    continue
                hit = hit_of(i, j)
                if hit not in found and self._touches(hit):
                    found[hit] = None
                    balls += [k for k in hit.balls if k not in balls]
        return list(found)

    def _touches(self, hit: Hit) -> bool:
        """Tell whether two sides touch now, or nearly so."""
        is_closed = self.is_closed(hit, self.motions([hit]), decisions.NEARLY_CLOSED)
        return is_closed or self.policy.closes(hit, self.now)

    def _answer(self, hits: Collection[Hit]) -> None:
        """Answer the contacts of this instant, and predict what follows from them."""
        motions, contacts = self.contacts(hits)
        before = velocities(motions)
        instant = self._add_round(hits, before)
        if instant.rounds > 1 or len(contacts) > 1:
            self.policy.look(self)
        if instant.rounds > decisions.FEW_ROUNDS or self.policy.takes_over(self, hits):
            self.answer_cluster(contacts)
            return
        resolution = self.resolver.resolve(contacts, before, self.now)
        missed = resolution.missed
        if missed:
            self.policy.look(self)
        self._carry_out(resolution, motions)
        self.predict(resolution.velocity)
        if missed:
            self._meet_later(missed)

    def _add_round(self, hits: Iterable[Hit], before: Mapping[int, Vector]) -> Instant:
        """Add a round of hits to the present instant, or begin another one."""
        i = max(before, key=self.speeds.__getitem__)
        path = self.paths[i]
        length = decisions.instant(self.now, path.x, path.y, self.radii[i], self.speeds[i])
        instant = self.instant
        if self.now - instant.began > length:
            instant.begin(self.now)
        instant.add(hits, before)
        return instant

    def answer_cluster(self, closing: Collection[Contact]) -> None:
        """Answer round after round of all that touches here, until nothing closes."""
        hits = self.touching(self.instant.met)
        cluster = self.policy.cluster(self, hits)
        closing = cluster.first or closing
        velocity, order, is_played_out = cluster.velocity, cluster.order, False
        while closing and not is_played_out and not self.is_over and self.is_finite:
            is_played_out = cluster.has_many_hits and self.resolver.loses_speed(cluster.contacts)
            if is_played_out:
                resolution, collapse = self.resolver.play_out(order.left(), velocity)
                self.recorder.no_end(cluster.contacts, collapse, self.now)
            else:
                resolution = self.resolver.resolve(list(closing), cluster.moving(closing), self.now)
            self._carry_out(resolution, cluster.motions)
            cluster.take(resolution, self.paths)
            closing = order.next(velocity, self.noise(velocity)) if resolution.velocity else []
        self.instant.start_over()
        self.predict(cluster.changed)
        self._meet_later(cluster.left_to_meet())

    # -- what follows ----------------------------------------------------------------------------

    def _carry_out(self, resolution: Resolution, motions: Motions) -> None:
        """Tell the recorder about the contacts, and give the balls their new paths."""
        self._report(resolution)
        rounded, noise = self.policy.errors.velocity, resolution.noise
        pushes = cushion_pushes(resolution) if self.surface.rolls else {}
        for i, found in resolution.velocity.items():
            x, y, _, _ = motions[i]
            roll = self.surface.roll(self.paths[i], self.now, pushes.get(i, ()))
            path = self.surface.path(self.now, (x, y), rounded(found, noise), roll)
            if path.moves:
                self.rested[i] = math.inf
                self.recorder.path(i, path)
            elif self.rested[i] == math.inf:
                self._stop(i, self.now, (x, y))
            self._begin(i, path, noise)

    def _begin(self, i: int, path: Path, noise: float) -> None:
        self.paths[i], self.speeds[i], self.noises[i] = path, path.fastest, noise
        if path.is_lost(self.radii[i]):
            self.is_finite = False

    def _report(self, resolution: Resolution) -> None:
        """Tell the recorder about the contacts of this instant."""
        tally, listed = self.tally, self.tally.listed
        for answer in resolution.answers:
            if answer.kind == HIT:
                tally.listed += 1
                self._told = (answer,)
                self.recorder.contact(answer.contact, self.now)
        tally.unlisted += tally.listed == listed
        for answer in resolution.answers:
            if answer.kind == MICRO:
                self._revoke_stops(answer)
            for note in answer.notes:
                getattr(self.recorder, note)(answer.contact, self.now)

    @property
    def impulse(self) -> float:
        """The impulse (N s) of the contact of which the recorder is told, along its normal."""
        return self._told[0].impulse

    def _stop(self, i: int, t: float, position: Vector) -> None:
        self.tally.listed += 1
        self.rested[i] = t
        self.recorder.stop(i, t, position)

    def _revoke_stops(self, answer: Answer) -> None:
        """Revoke stops between two micro-collisions of a pair: these balls are not at rest."""
        for i in answer.contact.balls:
            if answer.last <= self.rested[i] < math.inf:
                self.tally.listed -= 1
                self.recorder.stop_revoked(i, self.rested[i])
                self.rested[i] = math.inf
