"""The resolver answers the contacts of one instant, by the law or by a policy.

A policy is needed where there is no closed form:

- *One instant*: the law answers contacts that share a ball together
  (:meth:`~pool_pymunk.physics.laws.Law.together`).
- *A row of touching balls*: a contact that closes only because of a hit is hit next, at the same
  instant.
- *A ball that stops at contact* stops: a closing speed below rounding is no hit, and a speed below
  rounding that a hit leaves is none.
- *Hits without end*: infinitely many hits in finite time come to an end at one instant. A ball
  squeezed between another and a cushion has them, for example. After ``LISTED`` hits at one
  instant the others are played out, until nothing closes but for rounding
  (:mod:`pool_pymunk.physics.collapse`). They are not events; a warning gives their number.
- *Persistent contact*: two moving balls that surface friction presses together would touch without
  end. They hit each other once in a contact time instead, in micro-collisions
  (:mod:`pool_pymunk.engine.decisions`). These are not listed as events; a warning names the balls.
  The error is of second order in the contact time for two balls, and of first order for a cluster.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from pool_pymunk.engine import decisions, orders
from pool_pymunk.engine.orders import Doubt
from pool_pymunk.physics.collapse import MOST_HITS, Collapse, Order, fastest, play_out
from pool_pymunk.physics.contact import (
    NO_BALL,
    NT,
    Contact,
    Vector,
    Velocities,
    closing_speed,
    groups,
)
from pool_pymunk.physics.laws import Law, respond, settle
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE, NOT_MET, Lasting, Path
from pool_pymunk.physics.surface import Surface
from pool_pymunk.physics.together import push_apart

SAME_NORMAL = 1e-12


class History(NamedTuple):
    """A history holds the time (s) at which two balls met, and the time of their last hit.

    Balls that have been apart for more than ``WINDOW`` contact times meet anew. ``hits`` counts
    their micro-collisions.
    """

    met: float
    last: float
    hits: int


class Outcome(NamedTuple):
    """An outcome holds the velocities (m/s) after the contacts of one instant.

    It has the number of hits, and whether they came to an end.
    """

    velocity: Velocities
    hits: int
    is_over: bool


class Resolution:
    """A resolution holds what the contacts of one instant did.

    ``velocity`` (m/s) has the balls that begin a new path, or stop; ``noise`` (m/s) is how much of
    it may be rounding. The other fields sort the contacts. ``hits`` were answered, each as it was
    given to the law. ``listed`` are events. ``micro`` are micro-collisions, each with the time (s)
    of the pair's hit before. ``missed`` touch, but do not close. ``persistent`` are hits that part
    at their least bounce (m/s). ``zero_slips`` are hits whose slip only rounding knew. ``often``
    are hits of balls that have hit each other many times.
    """

    def __init__(self) -> None:
        self.velocity: dict[int, Vector] = {}
        self.noise = 0.0
        self.hits: list[Contact] = []
        self.listed: list[Contact] = []
        self.micro: list[tuple[Contact, float]] = []
        self.missed: list[Contact] = []
        self.persistent: list[tuple[Contact, float]] = []
        self.zero_slips: list[Contact] = []
        self.often: list[Contact] = []


class Resolver:
    """The resolver answers contacts by a law, and keeps the history of persistent contacts."""

    def __init__(self, law: Law, surface: Surface) -> None:
        self.law = law
        self.pull = surface.pull
        self.variant = decisions.Variant()
        self.collapses = 0  # of more than two contacts, so far
        self.spread = 0.0  # m/s; the largest one of the run
        self.doubts = 0  # instants whose order was found to matter
        self.paths: list[Path] = []
        self.radii: list[float] = []
        self.noises: list[float] = []  # m/s; how much of each velocity may be rounding
        self.history: dict[tuple[int, int], History] = {}

    def forget(self, i: int) -> None:
        """Forget ball ``i``, which meets nothing any more."""
        self.history = {pair: past for pair, past in self.history.items() if i not in pair}

    def lasting(self, i: int, j: int, now: float) -> Lasting:
        """Return how long one persistent contact of two balls takes, and what is faint in it."""
        past = self.history.get((i, j)) if self.history else None
        if past is None:
            return NOT_MET
        left = max(self.paths[i].end, self.paths[j].end) - now
        radius = min(self.radii[i], self.radii[j])
        many = past.hits > decisions.MANY_TIMES
        time = decisions.contact_time(now - past.met, left, radius, self.pull, many)
        time *= self.variant.longer
        if not many:
            return Lasting(time)
        return Lasting(time, decisions.faint(now - past.last, time, self.pull))

    def is_pressed(self, pair: tuple[int, int], now: float) -> bool:
        """Tell whether two balls are in persistent contact."""
        past = self.history.get(pair)
        if past is None or past.hits == 0:
            return False
        return decisions.lasts(now - past.last, self.lasting(*pair, now).time)

    def pressed(self, now: float) -> list[tuple[int, int]]:
        """Return the pairs of balls in persistent contact."""
        return [pair for pair in self.history if self.is_pressed(pair, now)]

    def resolve(
        self, contacts: Sequence[Contact], before: Mapping[int, Vector], now: float
    ) -> Resolution:
        """Answer the contacts of this instant; ``before`` (m/s) is the velocity of their balls."""
        resolution, velocity = Resolution(), dict(before)
        for contact in contacts:
            self._look_at(contact, velocity, now, resolution)
        hits = resolution.hits
        self._answer(hits, velocity, resolution)
        for contact, parting in resolution.persistent:
            push_apart(contact, parting, velocity)
        if len(hits) < len(contacts):
            self._leave_out(contacts, velocity, resolution)
        self._conclude(before, velocity, resolution)
        return resolution

    def play_out(
        self, contacts: Sequence[Contact], before: Mapping[int, Vector]
    ) -> tuple[Resolution, Collapse]:
        """Answer hits without end, all at one instant, until nothing closes.

        What closes more slowly than rounding knows does not close. Hits that do not come to their
        end get a plastic one without friction.
        """
        resolution, velocity = Resolution(), dict(before)
        resolution.hits = list(contacts)
        self.collapses += len(contacts) > 2
        most = decisions.MOST_IN_PILE if self.collapses > decisions.PILE else MOST_HITS
        collapse = self._play(contacts, velocity, resolution, most)
        self._conclude(before, velocity, resolution)
        return resolution, collapse

    def doubt(self, contacts: Sequence[Contact], before: Mapping[int, Vector]) -> Doubt:
        """Return what the order decides in which the contacts of one instant come.

        All patterns of gaps are played from the velocities ``before`` (m/s). Strong friction may
        wedge a ball between two others, so that tiny closing speeds grow from hit to hit. So what
        the hits leave gets tiny changes, to see whether these grow.
        """
        speed = fastest(before)
        closing = [closing_speed(contact, before) for contact in contacts]
        if len(contacts) < 2 or self.doubts >= decisions.DOUBTS:
            return Doubt()
        if self.spread > 0.0 and 4.0 * max(closing) <= self.spread:
            return Doubt()  # They cannot spread farther than is known already.
        closed = orders.closed(contacts)
        found = [self._outcome(closed, before)]
        patterns: list[int] = []
        take_turns = len(contacts) == 2 and min(closing) <= 0.0
        for pattern in () if take_turns else orders.patterns(len(contacts)):
            other = self._outcome(orders.with_gaps(contacts, pattern), before)
            rounding = decisions.SAME_OUTCOME * speed * (1 + other.hits)
            if other.is_over and all(_off(each, other) > rounding for each in found):
                found.append(other)
                patterns.append(pattern)
        kick = orders.KICK * speed
        for number in range(orders.KICKS):
            other = self._outcome(closed, orders.kicked(found[0].velocity, kick, number))
            if _off(found[0], other) > orders.GROWS * kick:
                found.append(other)
                patterns.append(orders.UNSTABLE)
        if not patterns:
            return Doubt()
        off = [_off(found[0], each) for each in found[1:]]
        far = sorted(zip(off, patterns, strict=True), reverse=True)
        self.spread, self.doubts = max(self.spread, far[0][0]), self.doubts + 1
        return Doubt(far[0][0], tuple(pattern for _, pattern in far))

    def _outcome(self, contacts: Sequence[Contact], before: Mapping[int, Vector]) -> Outcome:
        """Play the contacts in the order of their gaps; after ``MOST_IN_ORDER`` all are closed."""
        velocity, nothing = dict(before), Resolution()
        order, hits = Order(contacts), 0
        while hits < decisions.MOST_IN_ORDER:
            closing = order.next(velocity, decisions.LEFT * fastest(velocity))
            if not closing:
                return Outcome(velocity, hits, is_over=True)
            self._answer(closing, velocity, nothing)
            hits += len(closing)
        order.forget()
        collapse = self._play(order.left(), velocity, nothing, decisions.MOST_OTHER)
        return Outcome(velocity, hits + collapse.hits, collapse.is_over)

    def _play(
        self,
        contacts: Sequence[Contact],
        velocity: Velocities,
        resolution: Resolution,
        most: int,
    ) -> Collapse:
        """Answer hits without end until nothing closes, and change ``velocity`` (m/s)."""

        def answer(closing: Sequence[Contact], velocity: Velocities) -> None:
            self._answer(closing, velocity, resolution)

        leaps = self.law.hits_are_coulombs
        collapse = play_out(contacts, decisions.LEFT, velocity, answer, leaps, most)
        left = dict(velocity)
        settle(contacts, velocity)  # mostly no more than rounding is left
        if collapse.is_over:
            return collapse
        return collapse._replace(forced=max(math.dist(left[i], velocity[i]) for i in left))

    def _answer(
        self, hits: Sequence[Contact], velocity: Velocities, resolution: Resolution
    ) -> None:
        """Change the velocities (m/s) by the law: contacts that share a ball are one group."""

        def by_law(contact: Contact, velocity: Velocities) -> None:
            if respond(self.law, contact, velocity, jump=self.variant.otherwise):
                resolution.zero_slips.append(contact)

        for group in groups(hits) if len(hits) > 1 else (hits,):
            if len(group) == 1:
                by_law(group[0], velocity)
            elif group:
                self.law.together(group, velocity, by_law)

    def _look_at(
        self, contact: Contact, velocity: Velocities, now: float, resolution: Resolution
    ) -> None:
        """Sort a contact: decide whether it is a hit, and of which kind."""
        closing = closing_speed(contact, velocity)
        least, faint, is_micro, past = self._persistence(contact, closing, now)
        if closing < faint or not decisions.is_hit(closing, self._noise(contact), least):
            return
        if past is not None and is_micro:
            resolution.micro.append((contact, past.last))
        else:
            resolution.listed.append(contact)
        if contact.b != NO_BALL and self.pull > 0.0:
            pair = (contact.a, contact.b)
            hits = self.history[pair].hits if pair in self.history else 0
            hits += past is not None and is_micro
            self.history[pair] = History(now if past is None else past.met, now, hits)
            if hits > decisions.MANY_TIMES:
                resolution.often.append(contact)
        if contact.pair.restitution * closing < least:
            e = decisions.bounce(contact.pair.restitution, closing, least)
            contact = contact._replace(pair=contact.pair._replace(restitution=e))
            resolution.persistent.append((contact, e * closing))
        resolution.hits.append(contact)

    def _leave_out(
        self, contacts: Sequence[Contact], velocity: Velocities, resolution: Resolution
    ) -> None:
        """Sort out the contacts of which no hit has changed a ball.

        A ball that a cushion leads along itself, to rounding, does not sink into it.
        """
        moved = {i for hit in resolution.hits for i in hit.balls}
        for contact in contacts:
            if moved.isdisjoint(contact.balls):
                if contact.b == NO_BALL:
                    velocity[contact.a] = _along(velocity[contact.a], contact.normal)
                    resolution.velocity[contact.a] = velocity[contact.a]
                else:
                    resolution.missed.append(contact)

    def _conclude(
        self, before: Mapping[int, Vector], velocity: Velocities, resolution: Resolution
    ) -> None:
        """Keep the new velocities, and set to zero what rounding alone left of them."""
        moved = {*resolution.velocity, *[i for hit in resolution.hits for i in hit.balls]}
        fastest, noise = 0.0, 0.0
        for i, (wx, wy) in before.items():
            vx, vy = velocity[i]
            fastest = max(fastest, vx * vx + vy * vy, wx * wx + wy * wy)
            noise = max(noise, self.noises[i])
        resolution.noise = noise = decisions.noise_after(fastest, noise)
        pressed = {i for contact, _ in resolution.micro for i in contact.balls}
        for i in sorted(moved):
            vx, vy = velocity[i]
            least = max(noise, self._too_slow_to_move(i)) if i in pressed else noise
            rests = vx * vx + vy * vy <= least * least
            resolution.velocity[i] = (0.0, 0.0) if rests else (vx, vy)

    def _too_slow_to_move(self, i: int) -> float:
        """Return the speed (m/s) at which ball ``i`` would stop before its place changes."""
        path = self.paths[i]
        size = abs(path.x) + abs(path.y) + self.radii[i]
        return math.sqrt(2.0 * self.pull * EPSILON * size)

    def loses_speed(self, contacts: Iterable[Contact]) -> bool:
        """Tell whether any of the contacts parts more slowly than it closes, by this law."""
        return any(self._parting(contact) < 1.0 - NOISE for contact in contacts)

    def _parting(self, contact: Contact) -> float:
        """Return how fast (m/s) the contact parts if it closes head-on at 1 m/s."""
        pair = contact.pair
        if contact.b == NO_BALL:
            return self.law.cushion(NT(-1.0, 0.0), pair.restitution, pair.friction).n
        a, b = self.law.ball_ball(NT(1.0, 0.0), NT(0.0, 0.0), pair)
        return b.n - a.n

    def _noise(self, contact: Contact) -> float:
        """Return how much of the closing speed (m/s) may be rounding."""
        noise = self.noises[contact.a]
        return noise if contact.b == NO_BALL else max(noise, self.noises[contact.b])

    def _persistence(
        self, contact: Contact, closing: float, now: float
    ) -> tuple[float, float, bool, History | None]:
        """Return the least bounce and the faint speed (m/s), and what goes on.

        The last two are whether a hit is micro, and the history that goes on.
        """
        i, j = contact.a, contact.b
        past = self.history.get((i, j)) if self.history else None
        if past is None:
            return 0.0, 0.0, False, None
        time, faint = self.lasting(i, j, now)
        least = decisions.least_parting(self.paths[i], self.paths[j], now, time, self.radii[i])
        if not decisions.lasts(now - past.last, time):
            return least, faint, False, None
        return least, faint, decisions.is_micro(closing, time, self.pull), past


def _off(one: Outcome, other: Outcome) -> float:
    """Return how far (m/s) the velocities of two outcomes lie apart at most."""
    return max(math.dist(one.velocity[i], other.velocity[i]) for i in one.velocity)


def distinct(contacts: Iterable[Contact]) -> list[Contact]:
    """Return the contacts, but each of them once.

    Two cushions that run on straight give the same contact twice.
    """
    kept: list[Contact] = []
    of_sides: dict[tuple[int, int], list[Contact]] = {}
    for contact in contacts:
        others = of_sides.setdefault((contact.a, contact.b), [])
        if not any(_same(contact, other) for other in others):
            others.append(contact)
            kept.append(contact)
    return kept


def _same(one: Contact, other: Contact) -> bool:
    turn = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1]
    return turn > 1.0 - SAME_NORMAL


def _along(v: Vector, normal: Vector) -> Vector:
    """Return the part of a velocity along a wall."""
    n = v[0] * normal[0] + v[1] * normal[1]
    return (v[0] - n * normal[0], v[1] - n * normal[1])
