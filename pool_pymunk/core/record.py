"""A recorder listens to the engine while it plays; a record keeps what it hears as plain data."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import Motion, Path, standing
from pool_pymunk.core.motion.times import Vector
from pool_pymunk.core.walls.wall import Pocket, Wall

# The kinds of events.
BALL_BALL: Final = "ball-ball"
BALL_CUSHION: Final = "ball-cushion"
STOP: Final = "stop"
ROLL: Final = "roll"  # A ball that slid begins to roll.
PATCH: Final = "patch"  # A ball crosses the border of a patch.
POCKET: Final = "pocket"  # A pocket takes a ball in.

# t (s), x, y (m), vx, vy (m/s), ax, ay (m/s^2), and where balls roll wx, wy (m/s)
Breakpoint = tuple[float, ...]
# the impulses (N s) along the normal, and along the tangent on the second and the first ball
Push = tuple[float, float, float | None]
# the time, the kind, the balls, the number of the cushion, pocket or patch, a contact's impulses
Row = tuple[float, str, tuple[int, ...], int | None, Push | None]


@mypyc_attr(allow_interpreted_subclasses=True)
class Recorder:
    """A recorder listens to the engine; this one does nothing. Times are in s, places in m."""

    def contact(self, one: Contact, t: float) -> None:
        """Take note of a hit of two balls, or of a ball and a cushion."""

    def path(self, ball: Ball, path: Path) -> None:
        """Take note that a ball begins a new path."""

    def roll(self, ball: Ball, t: float) -> None:
        """Take note that a ball begins to roll."""

    def crossed(self, ball: Ball, patch: int, t: float) -> None:
        """Take note that a ball comes into a patch, or out of all patches (-1)."""

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        """Take note that a ball comes to rest at a place."""

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        """Take note that a pocket has taken in a ball, which came with this motion."""

    def jammed(self, ball: Ball, wall: Wall, t: float) -> None:
        """Take note that a wall moves into a ball, which has nowhere to go."""

    def zero_slip(self, one: Contact, t: float) -> None:
        """Take note that the law jumps at zero slip, and that the slip was rounding alone."""

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        """Take note of an inelastic collapse, whose hits are not listed one by one."""

    def order_unknown(self, t: float) -> None:
        """Take note of several contacts at one instant, whose order may matter."""

    def crowd(self, balls: int, since: float, until: float, overlap: float) -> None:
        """Take note that so many balls hit each other over and over, and go on by a step.

        They were moved apart after it where they overlapped, at most by so many radii.
        """

    def pause(self, t: float) -> None:
        """Do something else for a moment, every 10 ms or so: the run has come to this time."""


@final
class Note:
    """A note says what no event does: a zero slip of some balls, or the ``hits`` of a collapse."""

    def __init__(self, t: float, balls: set[int], hits: int | None, is_over: bool) -> None:
        self.t = t
        self.balls = sorted(balls)
        self.hits = hits  # None: it is a zero slip
        self.is_over = is_over


@final
class Crowded:
    """This says from when until when (s) balls have gone on by steps, and how these were."""

    def __init__(self, since: float) -> None:
        self.since = since
        self.until = since
        self.balls = 0  # at most
        self.step = 0.0  # s, at most
        self.overlap = 0.0  # radii, at most


@mypyc_attr(allow_interpreted_subclasses=True)
class Record(Recorder):
    """This recorder keeps the events of a run, and the breakpoints of all balls, as plain data."""

    def __init__(self, starts: list[list[Breakpoint]], rolls: bool) -> None:
        self.rolls = rolls
        self.events: list[Row] = []
        self.knots = starts  # the rows of each ball, which has one at the start
        self.instants: dict[float, None] = {}
        self.notes: list[Note] = []
        self.crowded: Crowded | None = None
        self.duration = 0.0

    def _keep(self, ball: Ball, path: Path) -> None:
        """Keep a breakpoint of a ball, at which a path begins."""
        t, x, y, vx, vy, ax, ay = path.t, path.x, path.y, path.vx, path.vy, path.ax, path.ay
        if self.rolls:
            self.knots[ball.number].append((t, x, y, vx, vy, ax, ay, path.wx, path.wy))
        else:
            self.knots[ball.number].append((t, x, y, vx, vy, ax, ay))

    def contact(self, one: Contact, t: float) -> None:
        a, b, wall = one.a.ball.number, one.b, one.wall
        if b is not None:
            push: Push = one.normal, one.along, one.along_first
            self.events.append((t, BALL_BALL, (a, b.ball.number), None, push))
        elif wall is not None:
            push = one.normal, one.along, None
            self.events.append((t, BALL_CUSHION, (a,), wall.number, push))

    def path(self, ball: Ball, path: Path) -> None:
        self._keep(ball, path)

    def roll(self, ball: Ball, t: float) -> None:
        self.events.append((t, ROLL, (ball.number,), None, None))

    def crossed(self, ball: Ball, patch: int, t: float) -> None:
        self.events.append((t, PATCH, (ball.number,), None if patch < 0 else patch, None))

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        x, y = place
        self._keep(ball, standing(t, x, y))
        self.events.append((t, STOP, (ball.number,), None, None))
        self.duration = max(self.duration, t)

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        x, y, vx, vy = motion
        self._keep(ball, Path(t, x, y, vx, vy, 0.0, 0.0, t, True, 0.0, 0.0))
        x, y = pocket.center
        self._keep(ball, standing(t, x, y))
        self.events.append((t, POCKET, (ball.number,), pocket.number, None))
        self.duration = max(self.duration, t)

    def zero_slip(self, one: Contact, t: float) -> None:
        self.notes.append(Note(t, numbers_of([one]), None, True))

    def collapse(self, contacts: list[Contact], hits: int, is_over: bool, t: float) -> None:
        self.notes.append(Note(t, numbers_of(contacts), hits, is_over))

    def order_unknown(self, t: float) -> None:
        self.instants[t] = None

    def crowd(self, balls: int, since: float, until: float, overlap: float) -> None:
        if self.crowded is None:
            self.crowded = Crowded(since)
        crowded = self.crowded
        crowded.until = max(crowded.until, until)
        crowded.balls = max(crowded.balls, balls)
        crowded.step = max(crowded.step, until - since)
        crowded.overlap = max(crowded.overlap, overlap)


def numbers_of(contacts: list[Contact]) -> set[int]:
    """Return the numbers of the balls of contacts."""
    balls: set[int] = set()
    for one in contacts:
        balls.add(one.a.ball.number)
        if one.b is not None:
            balls.add(one.b.ball.number)
    return balls
