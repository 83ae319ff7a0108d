"""A course is what a run has done to its balls: their paths, and the steps between these."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact, Pair
from pool_pymunk.core.motion.path import Motion, Path, standing
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.persistent.persistence import Persisted
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.walls.wall import Pocket, Wall

# what happens at a step
HIT: Final = 0  # Two balls hit, or a ball hits a wall.
FALL: Final = 1  # A pocket takes a ball in.
STOP: Final = 2  # A ball comes to rest.
ROLL: Final = 3  # A ball begins to roll.
CROSS: Final = 4  # A ball crosses the border of a patch.
LASTS: Final = 5  # A ball comes to a persistent contact; this is no event.

# what a ball has met, if no other ball: a wall is -1 - its place
NOTHING: Final = -1_000_000_000
ANYTHING: Final = -1_000_000_001


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Leg:
    """A leg is a path of a ball, in a patch of the table or outside of all (-1)."""

    __slots__ = ("patch", "path")

    def __init__(self, path: Path, patch: int) -> None:
        self.path = path
        self.patch = patch


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Step:
    """A step of a course comes at a time (s) to ball ``a``, and maybe to ball ``b`` (or -1).

    At a hit the normal points from ``a`` to ``b``, or from the wall to the ball. ``curvature``
    (1/m) is that of the wall's side, and ``kick`` (m/s) is what the wall adds along the normal.
    """

    __slots__ = ("a", "b", "curvature", "drifts", "kick", "kind", "nx", "ny", "pair", "t", "wall")

    def __init__(self, t: float, kind: int, a: int) -> None:
        self.t = t
        self.kind = kind
        self.a = a
        self.b = -1
        self.wall: Wall | None = None
        self.pair: Pair | None = None
        self.nx = 0.0
        self.ny = 0.0
        self.curvature = 0.0
        self.kick = 0.0
        self.drifts = False

    @property
    def met(self) -> int:
        """The other ball, -1 - the place of a wall, or nothing: ball ``a`` meets it."""
        if self.b >= 0:
            return self.b
        return NOTHING if self.wall is None else -1 - self.wall.place

    @property
    def other(self) -> int:
        """The other ball of a hit, or the only ball."""
        return self.b if self.b >= 0 else self.a

    def has(self, ball: int) -> bool:
        """Tell whether the step is one of a ball."""
        return ball in (self.a, self.b)


@final
class Course(Recorder):
    """This recorder notes the course of a run, and tells ``inner`` all that it hears.

    Balls are those of the engine. A :class:`~pool_pymunk.core.tangent.tangent.Tangent` follows
    small changes along a course, as often as somebody asks.
    """

    def __init__(self, balls: list[Ball], inner: Recorder) -> None:
        self.inner = inner
        self.steps: list[Step] = []
        self.legs: list[list[Leg]] = [[Leg(ball.path, ball.patch)] for ball in balls]
        self.is_off = [ball.is_off for ball in balls]
        self.duration = 0.0  # s; when the last ball came to rest, or into a pocket

    def contact(self, one: Contact, t: float) -> None:
        self.inner.contact(one, t)
        step = Step(t, HIT, one.a.ball.number)
        if one.b is not None:
            step.b = one.b.ball.number
        step.wall, step.pair = one.wall, one.pair
        step.nx, step.ny, step.curvature = one.nx, one.ny, one.curvature
        step.kick, step.drifts = one.kicked, one.drifts
        self.steps.append(step)

    def path(self, ball: Ball, path: Path) -> None:
        self.inner.path(ball, path)
        self.legs[ball.number].append(Leg(path, ball.patch))

    def roll(self, ball: Ball, t: float) -> None:
        self.inner.roll(ball, t)
        self.steps.append(Step(t, ROLL, ball.number))

    def crossed(self, ball: Ball, patch: int, t: float) -> None:
        self.inner.crossed(ball, patch, t)
        self.steps.append(Step(t, CROSS, ball.number))

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        self.inner.stop(ball, t, place)
        self._rest(ball, t, place)
        self.steps.append(Step(t, STOP, ball.number))

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        self.inner.pocketed(ball, pocket, t, motion)
        self._rest(ball, t, pocket.center)
        step = Step(t, FALL, ball.number)
        step.wall = pocket
        self.steps.append(step)

    def _rest(self, ball: Ball, t: float, place: Vector) -> None:
        x, y = place
        self.duration = max(self.duration, t)
        self.legs[ball.number].append(Leg(standing(t, x, y), ball.patch))

    def jammed(self, ball: Ball, wall: Wall, t: float) -> None:
        self.inner.jammed(ball, wall, t)

    def zero_slip(self, one: Contact, t: float) -> None:
        self.inner.zero_slip(one, t)

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        self.inner.collapse(contacts, hits, is_over, t)

    def order_unknown(self, t: float) -> None:
        self.inner.order_unknown(t)

    def pause(self, t: float) -> None:
        self.inner.pause(t)

    def close(self, persisted: list[Persisted], duration: float, most: int) -> None:
        """End the course at a time (s), after at most so many events.

        Contacts that have ``persisted`` become steps: a ball comes to its first one after its hits
        of that instant. Where it has none, that is after what else it does then, such as to stop.
        """
        self.steps.sort(key=time_of)
        del self.steps[most:]
        firsts: dict[int, float] = {}
        for a, b, _cushion, since, _until, _x, _y in persisted:
            firsts[a] = min(since, firsts.get(a, INF))
            if b >= 0:
                firsts[b] = min(since, firsts.get(b, INF))
        begun = [(self._begins_before(i, t), t, i) for i, t in firsts.items() if t <= duration]
        begun.sort()
        for k, t, i in reversed(begun):
            self.steps.insert(k, Step(t, LASTS, i))

    def _begins_before(self, ball: int, t: float) -> int:
        """Return before which step a ball comes to persistent contacts at a time (s)."""
        first = 0
        while first < len(self.steps) and self.steps[first].t < t:
            first += 1
        does = hits = -1
        k = first
        while k < len(self.steps) and self.steps[k].t == t:
            if self.steps[k].has(ball):
                does = k
                if self.steps[k].kind == HIT:
                    hits = k
            k += 1
        last = hits if hits >= 0 else does
        return 1 + (last if last >= 0 else first - 1)


def time_of(step: Step) -> float:
    """Return when (s) a step comes."""
    return step.t
