"""A course is what a run has done to its balls: their paths, and the steps between these."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import i64, mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact, Pair
from pool_pymunk.core.engine import NON_FINITE, OUT_OF_EVENTS, OUT_OF_TIME, SETTLED, Engine
from pool_pymunk.core.motion.path import Motion, Path, standing
from pool_pymunk.core.motion.times import INF, Vector
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

# when (s) a run ended, whether it was cut off there, and whether its number of events did that
End = tuple[float, bool, bool]


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Leg:
    """A leg is a path of a ball, in a patch of the table or outside of all (-1)."""

    def __init__(self, path: Path, patch: int) -> None:
        self.path: Final = path
        self.patch = patch


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Step:
    """A step of a course comes at a time (s) to ball ``a``, and maybe to ball ``b`` (or -1).

    At a hit the normal points from ``a`` to ``b``, or from the wall to the ball. ``curvature``
    (1/m) is that of the wall's side, and ``kick`` (m/s) is what the wall adds along the normal.
    """

    def __init__(self, t: float, kind: i64, a: i64) -> None:
        self.t = t
        self.kind: i64 = kind
        self.a: i64 = a
        self.b: i64 = -1
        self.wall: Wall | None = None
        self.pair: Pair | None = None
        self.nx = self.ny = self.curvature = 0.0
        self.kick = 0.0
        self.drifts = False

    @property
    def met(self) -> i64:
        """The other ball, -1 - the place of a wall, or nothing: ball ``a`` meets it."""
        if self.b >= 0:
            return self.b
        return NOTHING if self.wall is None else -1 - self.wall.place

    @property
    def other(self) -> i64:
        """The other ball of a hit, or the only ball."""
        return self.b if self.b >= 0 else self.a

    def has(self, ball: i64) -> bool:
        """Tell whether the step is one of a ball."""
        return ball == self.a or ball == self.b


@final
class Course(Recorder):
    """This recorder notes the course of a run, and tells ``inner`` what a tally counts.

    Balls are those of the engine. A :class:`~pool_pymunk.core.tangent.tangent.Tangent` follows
    small changes along a course, as often as somebody asks.
    """

    def __init__(self, balls: list[Ball], inner: Recorder) -> None:
        self.inner: Final = inner
        self.steps: Final[list[Step]] = []
        self.legs: Final[list[list[Leg]]] = [[Leg(ball.path, ball.patch)] for ball in balls]
        self.is_off: Final = [ball.is_off for ball in balls]
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
        self.steps.append(Step(t, ROLL, ball.number))

    def crossed(self, ball: Ball, patch: int, t: float) -> None:
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

    def order_unknown(self, t: float) -> None:
        self.inner.order_unknown(t)

    def zero_slip(self, one: Contact, t: float) -> None:
        self.inner.zero_slip(one, t)

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        self.inner.collapse(contacts, hits, is_over, t)

    def pause(self, t: float) -> None:
        self.inner.pause(t)

    def close(self, engine: Engine, latest: float) -> End:
        """End the course of a run that might go on to the ``latest`` (s), and return how it ended.

        Contacts that have persisted become steps: a ball comes to its first one after its hits of
        that instant. Where it has none, that is after what else it does then, such as to stop.
        """
        ending = engine.end(latest)
        if ending == SETTLED:
            engine.now = self.duration
        if not self._is_in_order():
            self.steps.sort(key=lambda step: step.t)
        del self.steps[engine.most_events :]
        firsts: dict[int, float] = {}
        for a, b, _cushion, since, _until, _x, _y in engine.persistence.persisted(engine):
            for ball in [a, b]:
                firsts[ball] = min(since, firsts.get(ball, INF))
        there = [(i, t) for i, t in firsts.items() if i >= 0 and t <= engine.now]
        begun = [(self._begins_before(i, t), t, i) for i, t in there]
        for k, t, i in sorted(begun, reverse=True):
            self.steps.insert(k, Step(t, LASTS, i))
        is_cut = ending == OUT_OF_TIME or (ending == SETTLED and engine.now == latest)
        return engine.now, is_cut, ending in (OUT_OF_EVENTS, NON_FINITE)

    def _is_in_order(self) -> bool:
        """Tell whether no step is earlier than the one before, as mostly."""
        last = -INF
        for step in self.steps:
            if step.t < last:
                return False
            last = step.t
        return True

    def _begins_before(self, ball: int, t: float) -> int:
        """Return before which step a ball comes to persistent contacts at a time (s)."""
        now = [k for k, step in enumerate(self.steps) if step.t == t and step.has(ball)]
        hits = [k for k in now if self.steps[k].kind == HIT]
        if len(now) > 0:
            return 1 + (hits if len(hits) > 0 else now)[-1]
        return len([step for step in self.steps if step.t < t])
