"""A solver writes down a trace while it runs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeAlias

from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.record import BALL_BALL, BALL_CUSHION, PATCH, POCKET, ROLL, STOP, Breakpoint
from pool_pymunk.core.record import Push as Impulses
from pool_pymunk.results.events import Event
from pool_pymunk.results.variants import Variant

if TYPE_CHECKING:
    from pool_pymunk.model import Point, Scene, State
    from pool_pymunk.results.run import Run

# A run is given up after this many events, unless the user says otherwise, and after this many
# instants and pieces without one. So a run takes some minutes at most.
NEVER_SETTLES = 1_000_000

UNKNOWN = (math.nan, math.nan)  # an acceleration that the surface determines
NONE = (0.0, 0.0)

# the impulse of a contact; what adds it up is asked for it at the end
Push: TypeAlias = "Impulses | Callable[[], Impulses] | None"
# the time, the kind, the balls, the number of the cushion, pocket or patch, a contact's impulse
Row: TypeAlias = "tuple[float, str, tuple[int, ...], int | None, Push]"

# Balls a and b (-1: a cushion), the cushion (-1: a ball), from when to when (s) they stayed in
# contact, and the impulse (x, y) in N s that this gave to the last ball.
Persisted = tuple[int, int, int, float, float, float, float]

# These are the policies that answer what has no exact answer.
ZERO_SLIP = "zero slip"
ONE_INSTANT = "one instant"
COLLAPSE = "collapse cut off"
FROZEN = "frozen balls"

# These variants have both signs of a slip that is rounding: of balls that move against each other
# along the tangent, and of balls that both move to one side. So `published` gives all its answers.
SLIPS = tuple(Variant(slip=slip) for slip in ((1.0, -1.0), (-1.0, 1.0), (-1.0, -2.0), (1.0, 2.0)))
# Runs with nudged starts show what an unknown order of contacts changes: up to MOST_NUDGES of each
# kind, or fewer with EVENTS events in all.
FEWEST_NUDGES, MOST_NUDGES = 4, 16
EVENTS = 2_000
PIECES = 2  # So many short paths of persistent contacts take as long as an event.


class Trace:
    """A solver writes down a trace while it runs; balls are numbers, as in ``scene.balls``."""

    def __init__(self, start: State, known: Sequence[Point] = ()) -> None:
        """Begin with a start, and with the accelerations (m/s^2) if they are ``known``."""
        rolls = start.roll or ((),) * len(start.position)
        pulls = known or (UNKNOWN,) * len(start.position)
        self.knots: list[list[Breakpoint]] = [
            [(0.0, *p, *v, *a, *w)]
            for p, v, a, w in zip(start.position, start.velocity, pulls, rolls, strict=True)
        ]
        self.no_roll = () if start.roll is None else NONE  # what a ball at rest has for a roll
        self.events: list[Row] = []
        self.persisted: list[Persisted] = []  # the contacts that persisted and are over
        self.warned: dict[str, tuple[float, int]] = {}  # when first, and how often
        self.policies: set[str] = set()  # those that answered something that has no exact answer
        self.instants: dict[float, None] = {}  # s; several contacts came at each of these instants
        self.status = "settled"
        self.is_crowded = False  # Balls have gone on by steps, which decide more than policies.
        self.duration = 0.0
        self.steps = 0

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The variants of the run that show what its policies decide."""
        nudges = (*self.nudges(0), *self.nudges(1)) if self.policies & {ONE_INSTANT, FROZEN} else ()
        slips = SLIPS if ZERO_SLIP in self.policies else ()
        return (*nudges, *slips)

    def nudges(self, kind: int) -> list[Variant]:
        """Return variants with nudged starts: narrow ones are of kind 0, wide ones of kind 1."""
        events = len(self.events)
        pieces = max(sum(map(len, self.knots)) - 4 * events - len(self.knots), 0)
        most = min(max(EVENTS // max(events + pieces // PIECES, 1), FEWEST_NUDGES), MOST_NUDGES)
        return [Variant(nudge=2 * k + kind) for k in range(most)]

    def order_decides(self) -> None:
        """Warn of an order of contacts that nobody knows."""
        for t in self.instants:
            self.warn("several contacts came at one instant, in an unknown order", t, ONE_INSTANT)
        if not self.instants:
            self.warn("balls touch at the start, and gaps of 1e-13 m decide the ends", 0.0, FROZEN)

    def breakpoint(
        self,
        i: int,
        t: float,
        position: Point,
        velocity: Point,
        acceleration: Point = UNKNOWN,
        roll: Point = NONE,
    ) -> None:
        """Ball ``i`` moves on with a new ``velocity``, by default accelerated by the surface."""
        turns = roll if self.no_roll else ()
        self.knots[i].append((t, *position, *velocity, *acceleration, *turns))

    def roll(self, i: int, t: float) -> None:
        """Ball ``i`` began to roll."""
        self.events.append((t, ROLL, (i,), None, None))

    def ball_ball(self, t: float, i: int, j: int, push: Push = None) -> None:
        """Balls ``i`` and ``j`` met."""
        self.events.append((t, BALL_BALL, (i, j), None, push))

    def ball_cushion(self, t: float, i: int, cushion: int, push: Push = None) -> None:
        """Ball ``i`` met a cushion."""
        self.events.append((t, BALL_CUSHION, (i,), cushion, push))

    def stop(self, i: int, t: float, position: Point) -> None:
        """Ball ``i`` came to rest."""
        self.breakpoint(i, t, position, NONE, NONE)
        self.events.append((t, STOP, (i,), None, None))
        self.duration = max(self.duration, t)

    def pocketed(
        self,
        i: int,
        pocket: int,
        t: float,
        motion: tuple[float, float, float, float],
        center: Point,
    ) -> None:
        """Ball ``i`` came to a pocket with this ``motion`` (m, m/s), and lies at its ``center``."""
        self.breakpoint(i, t, motion[:2], motion[2:], NONE)
        self.breakpoint(i, t, center, NONE, NONE)
        self.events.append((t, POCKET, (i,), pocket, None))
        self.duration = max(self.duration, t)

    def cut(self, most: int) -> None:
        """Sort the events; if there are more than ``most``, end the run at the last one kept."""
        self.events.sort(key=lambda event: event[0])
        if len(self.events) > most:
            del self.events[most:]
            self.status = "max_events"
        if len(self.events) < most or self.status != "max_events":
            return
        self.duration = self.events[-1][0]
        for rows in self.knots:
            while rows[-1][0] > self.duration:
                rows.pop()

    def complete(self, surface: Surface) -> None:
        """Fill in the accelerations that are not known: they are those of the surface."""
        for i, rows in enumerate(self.knots):
            if any(math.isnan(row[5]) for row in rows):
                self.knots[i] = completed(rows, surface, self.duration)

    def warn(self, text: str, t: float, policy: str | None = None) -> None:
        """Note a warning of the time ``t`` (s), and the policy that answered then."""
        self.policies.update([policy] if policy else [])
        first, times = self.warned.get(text, (t, 0))
        self.warned[text] = first, times + 1

    def events_of(self, scene: Scene) -> tuple[Event, ...]:
        """Return the events with the ids of balls and pockets, and with the impulses."""
        ids, pockets = tuple(scene.index), scene.pockets
        found = []
        for t, kind, balls, where, push in self.events:
            names = tuple([ids[i] for i in balls])
            if kind == POCKET and where is not None:
                found.append(Event(t, kind, names, pocket=pockets[where].id))
            elif kind == PATCH:
                found.append(Event(t, kind, names, patch=where))
            else:
                pushes = (push() if callable(push) else push) or ()
                found.append(Event(t, kind, names, where, None, *pushes))
        return tuple(found)

    @property
    def warnings(self) -> tuple[str, ...]:
        """All warnings, each once."""
        return tuple(
            f"{text} ({f'{times} times, first ' if times > 1 else ''}at {first:.6g} s)"
            for text, (first, times) in self.warned.items()
        )


def completed(rows: Sequence[Sequence[float]], surface: Surface, end: float) -> list[Breakpoint]:
    """Return breakpoints with accelerations: where ``rows`` have none, that of the surface.

    Such rows may have five numbers, and breakpoints may follow them. The run ends at ``end`` (s).
    """
    found: list[Breakpoint] = []
    for row, until in zip(rows, [*(later[0] for later in rows[1:]), end], strict=True):
        t, x, y, vx, vy, *known = row
        if known and not math.isnan(known[0]):
            found.append(tuple(row))
            continue
        roll = known[2:]
        path = surface.path(t, (x, y), (vx, vy), (roll[0], roll[1]) if roll else NONE)
        found.append((t, x, y, vx, vy, path.ax, path.ay, *roll))
        while path.t < path.end < until:
            path = surface.then(path) or standing(path.end, *path.place(path.end))
            found.append(breakpoint_of(path, bool(roll)))
    return found


def path_of(row: Sequence[float]) -> Path:
    """Return the path from a breakpoint on, without an end."""
    t, x, y, vx, vy, ax, ay = row[:7]
    return Path(t, x, y, vx, vy, ax, ay, math.inf, False, 0.0, 0.0)


def farthest(one: Trace | Run, other: Trace | Run) -> float:
    """Return the largest distance (m) of a ball's ends; where one run was cut, both end there."""
    is_cut = "max_events" in (one.status, other.status)
    at = (min if is_cut else max)(one.duration, other.duration)
    return max(map(math.dist, places_at(one, at), places_at(other, at)))


def places_at(run: Trace | Run, t: float) -> list[Point]:
    """Return where the balls are (m) at a time (s)."""
    last = [next(row for row in rows[::-1] if row[0] <= t) for rows in run.knots]
    return [path_of(row).place(t) for row in last]


def breakpoint_of(path: Path, rolls: bool) -> Breakpoint:
    """Return the breakpoint at the beginning of a path, of a ball that may roll."""
    roll = (path.wx, path.wy) if rolls else ()
    return (path.t, path.x, path.y, path.vx, path.vy, path.ax, path.ay, *roll)
