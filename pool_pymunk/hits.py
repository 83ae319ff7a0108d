"""Which contacts of one instant are hits, and what they do: the policies for what is hard.

A solver finds what touches at an instant; :class:`Hits` answers it, for every solver alike:

- *One instant*: contacts of one instant are answered together (:mod:`pool_pymunk.impact`), so the
  order of the balls does not matter (law ``published`` apart, which depends on it).
- *A row of touching balls*: what closes only because of a hit is hit next, at the same instant.
- *A ball that stops at contact* stops: a closing speed below rounding is no contact, and a speed
  below rounding that a hit leaves is none.
- *Inelastic collapse*: infinitely many hits in finite time, as of a ball squeezed between another
  and a cushion, come to an end at one instant. After ``ROUNDS`` rounds of hits at one instant the
  contacts get the limit of what would follow, no more closing
  (:meth:`~pool_pymunk.impact.Impacts.settle`), and a warning says so. Where all are elastic there
  is no collapse: the hits have an end.
- *Balls pressed together by surface friction*, both moving, would touch without end, or after
  infinitely many hits. These hits are spread out to one in a contact time, ``CONTACT_TIME`` of the
  time in which the balls would stop, or shorter, lest they sink ``DEEPEST`` into each other: they
  part at no less than
  :func:`~pool_pymunk.path.least_bounce`, elastically if need be (the TC model of Luding and
  McNamara, Granular Matter 1, 1998, 113, for contacts that last). For two balls the error is of
  second order in the contact time, in a cluster of first order. A warning says so, and the kicks
  that such balls give each other and their neighbours are not listed as events.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Generic, NamedTuple, Protocol, TypeVar

from pool_pymunk.contact import Law
from pool_pymunk.impact import NO_BALL, Impacts, Touch, Velocities, closing_speed, distinct
from pool_pymunk.motion import Vector
from pool_pymunk.path import EPSILON, Past, Path, least_bounce

NOISE = 16.0 * EPSILON  # share of a hit's speeds that may be rounding
INSTANT = 1e-12  # radii that a ball comes in what counts as one instant
ROUNDS = 300  # of hits at one instant, after which they are taken to have no end
FEW_ROUNDS = 10  # the same, where it is but the hits of balls that are pressed together
CONTACT_TIME = 3e-3  # of the balls' stopping time when they met, or of the time since then
DEEPEST = 1e-4  # radii that pressed balls may sink into each other before it is a hit
MANY_KICKS = 1000  # of a press, in which its contact time doubles
WINDOW = 3.0  # contact times after the last kick of a press, in which a ball counts as kicked

Key = TypeVar("Key")  # what a solver calls a pair that may touch
Key_contra = TypeVar("Key_contra", contravariant=True)


class Table(Protocol[Key_contra]):
    """What knows the balls, by their numbers."""

    deceleration: float

    def path_of(self, i: int, /) -> Path: ...

    def radius_of(self, i: int, /) -> float: ...

    def name_of(self, i: int, /) -> str: ...

    def touch(self, key: Key_contra, t: float, /) -> Touch: ...

    def warn(self, text: str, t: float, /) -> None: ...


class Answer(NamedTuple):
    """What contacts of one instant did.

    ``velocity`` (m/s) is that of the balls that begin a new path, or stop. Of the contacts,
    ``listed`` are events, ``pressed`` are hits of balls that surface friction presses together,
    and ``missed`` touch, but do not close.
    """

    velocity: Mapping[int, Vector]
    listed: Sequence[Touch]
    pressed: Sequence[Touch]
    missed: Sequence[Touch]


class Meeting(NamedTuple):
    """When two balls met, the time (s) in which both would have stopped, and kicks since then."""

    t: float
    stopping: float
    kicks: int = 0


class Kick(NamedTuple):
    """What a ball had from a press: when, how fast (m/s) at most, and how long (s) it counts."""

    t: float
    speed: float
    window: float


NO_KICK = Kick(-math.inf, 0.0, 0.0)


class Hits(Generic[Key]):
    """Answers contacts by a law, and remembers what that takes."""

    def __init__(self, law: Law, table: Table[Key]) -> None:
        self.table = table
        self.impacts = Impacts(law)
        self.noise: dict[int, float] = {}  # m/s, of each ball's velocity
        self.meetings: dict[tuple[int, int], Meeting] = {}  # the last of a pair, but for kicks
        self.presses: set[tuple[int, int]] = set()
        self.kicks: dict[int, Kick] = {}  # the last that a ball had
        self.instant = -math.inf  # when the present rounds of hits began
        self.rounds = 0
        self.hit_now: dict[Key, None] = {}  # in these rounds

    def strike(self, i: int, velocity: Vector) -> None:
        """Somebody else gave a ball this velocity (m/s)."""
        self.noise[i] = NOISE * math.hypot(*velocity)

    def noise_of(self, i: int, j: int) -> float:
        """How much of the balls' velocities (m/s) may be rounding."""
        return max(self.noise.get(i, 0.0), self.noise.get(j, 0.0))

    def past(self, i: int, j: int, now: float) -> Past:
        """What earlier hits left of two balls."""
        return Past(self.noise_of(i, j), self.contact_time(i, j, now))

    def contact_time(self, i: int, j: int, now: float) -> float:
        """The time (s) that one contact of the balls takes where friction presses them together.

        It grows while they stay together, as long as they sink ``DEEPEST`` into each other at most;
        and with the number of their hits, so that this number stays within bounds. Before they met
        it is 0.
        """
        met = self.meetings.get((i, j))
        if met is None:
            return 0.0
        radius = min(self.table.radius_of(i), self.table.radius_of(j))
        shallow = math.sqrt(4.0 * DEEPEST * radius / self.table.deceleration)
        lasting = CONTACT_TIME * max(met.stopping, now - met.t)
        return min(lasting, shallow) * (1.0 + met.kicks / MANY_KICKS)

    def was_kicked(self, i: int, since: float, now: float) -> bool:
        """Whether a kick of a press that ball ``i`` had counts now and at the time ``since``."""
        kick = self.kicks.get(i, NO_KICK)
        return now - kick.t <= kick.window and now - kick.window <= since <= now

    def answer(self, keys: Collection[Key], now: float) -> Answer:
        """What the contacts of this instant do."""
        touches = self._touches(keys, now)
        before = self._velocities(touches, now)
        if self._has_no_end(keys, touches, before, now):
            hits = self._touches(self.hit_now, now)
            before = self._velocities(hits, now)
            velocity = dict(before)
            self._settle(hits, velocity, now)
            return self._outcome(before, velocity, touches, _Sorted(hits, [], hits))
        velocity = dict(before)
        found = self._sort(touches, velocity, now)
        self.impacts.answer(found.hits, velocity)
        return self._outcome(before, velocity, touches, found)

    def _touches(self, keys: Iterable[Key], now: float) -> list[Touch]:
        return distinct(self.table.touch(key, now) for key in keys)

    def _velocities(self, touches: Iterable[Touch], now: float) -> dict[int, Vector]:
        balls = {i for touch in touches for i in touch.balls}
        return {i: self.table.path_of(i).at(now)[1] for i in balls}

    # -- which of them are hits ------------------------------------------------------------------

    def _sort(self, touches: Iterable[Touch], velocity: Velocities, now: float) -> _Sorted:
        """Those that close, each as it is to be answered, and what of them is to be listed."""
        found = _Sorted([], [], [])
        kicks = [(touch, self._kick(touch, now)) for touch in touches]  # before these add to them
        for touch, kick in kicks:
            closing = closing_speed(touch, velocity)
            least = self._least_bounce(touch, now)
            if closing <= max(self.noise_of(*touch[:2]), 0.98 * least):
                continue
            if touch[:2] in self.meetings and closing <= kick.speed:
                self._pass_on(kick, touch, now)
                found.pressed.append(touch)
            else:
                self._meet(touch, now)
                found.listed.append(touch)
            if touch.pair.restitution * closing < least:
                self._note_press(touch, now)
                e = min(least / closing, 1.0)
                touch = touch._replace(pair=touch.pair._replace(restitution=e))
            found.hits.append(touch)
        return found

    def _least_bounce(self, touch: Touch, now: float) -> float:
        if touch.b == NO_BALL:
            return 0.0
        a, b = map(self.table.path_of, touch.balls)
        return least_bounce(a, b, now, self.contact_time(*touch[:2], now))

    def _meet(self, touch: Touch, now: float) -> None:
        """Two balls meet, or meet anew: from now on this is their contact time."""
        if touch.b != NO_BALL and self.table.deceleration > 0.0:
            stopping = max(self.table.path_of(i).stop for i in touch.balls) - now
            self.meetings[touch[:2]] = Meeting(now, stopping)

    def _kick(self, touch: Touch, now: float) -> Kick:
        """The strongest kick that the balls of a contact had lately."""
        if not self.kicks:
            return NO_KICK
        kicks = [self.kicks.get(i, NO_KICK) for i in touch.balls]
        recent = [kick for kick in kicks if now - kick.t <= kick.window]
        return max(recent, key=lambda kick: kick.speed, default=NO_KICK)

    def _pass_on(self, kick: Kick, touch: Touch, now: float) -> None:
        for i in touch.balls:
            own = self.kicks.get(i, NO_KICK)
            if now - own.t > own.window or own.speed <= kick.speed:
                self.kicks[i] = kick._replace(t=now)

    def _note_press(self, touch: Touch, now: float) -> None:
        met = self.meetings[touch[:2]]
        self.meetings[touch[:2]] = met._replace(kicks=met.kicks + 1)
        contact_time = self.contact_time(*touch[:2], now)
        kick = Kick(now, 2.0 * self.table.deceleration * contact_time, WINDOW * contact_time)
        self._pass_on(kick, touch, now)
        if touch[:2] not in self.presses:
            self.presses.add(touch[:2])
            self.table.warn(
                f"surface friction presses balls {self._names(touch.balls)} together: their "
                f"endless hits were spread out to one in {contact_time:.2g} s",
                now,
            )

    # -- hits without end ------------------------------------------------------------------------

    def _has_no_end(
        self, keys: Iterable[Key], touches: Sequence[Touch], velocity: Velocities, now: float
    ) -> bool:
        """Count and remember this round of hits at one instant; whether there are too many."""
        fastest = max(touches, key=lambda touch: closing_speed(touch, velocity))
        speed = max(self.table.path_of(i).speed for i in fastest.balls)
        x, y = self.table.path_of(fastest.a).position
        rounding = ROUNDS * EPSILON * (now + (abs(x) + abs(y)) / speed)
        instant = INSTANT * self.table.radius_of(fastest.a) / speed + 16.0 * rounding
        if now - self.instant > instant:
            self.instant, self.rounds = now, 0
            self.hit_now.clear()
        self.rounds += 1
        self.hit_now.update(dict.fromkeys(keys))
        if self.rounds <= FEW_ROUNDS:
            return False
        is_kick = closing_speed(fastest, velocity) <= self._kick(fastest, now).speed
        return self.rounds > (FEW_ROUNDS if is_kick else ROUNDS) and any(
            touch.pair.restitution < 1.0 for touch in self._touches(self.hit_now, now)
        )

    def _settle(self, touches: Sequence[Touch], velocity: Velocities, now: float) -> None:
        """Inelastic collapse: the limit of hits without end."""
        self.impacts.settle(touches, velocity)
        if self.rounds > ROUNDS:
            names = self._names(i for touch in touches for i in touch.balls)
            self.table.warn(
                f"inelastic collapse of balls {names}: hits without end at one instant were given "
                "their limit, no more closing",
                now,
            )
        self.rounds = 0

    def _names(self, balls: Iterable[int]) -> str:
        return ", ".join(map(self.table.name_of, sorted(set(balls))))

    # -- what they do ----------------------------------------------------------------------------

    def _outcome(
        self,
        before: Mapping[int, Vector],
        velocity: dict[int, Vector],
        touches: Iterable[Touch],
        found: _Sorted,
    ) -> Answer:
        """New velocities, without what rounding alone left of them."""
        moved = {i for hit in found.hits for i in hit.balls}
        missed = [touch for touch in touches if moved.isdisjoint(touch.balls)]
        for touch in missed:
            if touch.b == NO_BALL:
                velocity[touch.a] = _along(velocity[touch.a], touch.normal)
                moved.add(touch.a)
        fastest = max(math.hypot(*v) for v in (*before.values(), *velocity.values()))
        noise = max(NOISE * fastest, *(self.noise.get(i, 0.0) for i in before))
        for i in moved:
            self.noise[i] = noise
            if math.hypot(*velocity[i]) <= noise:
                velocity[i] = (0.0, 0.0)
        missed = [touch for touch in missed if moved.isdisjoint(touch.balls)]
        return Answer({i: velocity[i] for i in sorted(moved)}, found.listed, found.pressed, missed)


class _Sorted(NamedTuple):
    """Contacts that are hits; those that are listed, and those of balls that are pressed."""

    hits: list[Touch]
    listed: list[Touch]
    pressed: list[Touch]


def _along(v: Vector, normal: Vector) -> Vector:
    """What a velocity has along a wall."""
    n = v[0] * normal[0] + v[1] * normal[1]
    return (v[0] - n * normal[0], v[1] - n * normal[1])
