"""A track follows one ball along its legs, with the changes at the beginning of the present one."""

from __future__ import annotations

from typing import Final, final

from mypy_extensions import i64

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.carry import Ground
from pool_pymunk.core.tangent.change import BLUR, Change
from pool_pymunk.core.tangent.course import NOTHING, Leg
from pool_pymunk.core.tangent.inputs import Inputs


@final
class Moment:
    """From a moment (s) on, a ball is on a leg, at whose beginning it has these changes."""

    def __init__(self, t: float, at: i64, changes: list[Change]) -> None:
        self.t = t
        self.at: i64 = at
        self.changes: Final = [each.copy() for each in changes]


@final
class Track:
    """A track has the ``changes`` (P) of a ball at the beginning of its leg ``at``.

    ``met`` is what the ball met there. ``moves`` tells whether it moves on its leg, or sets off,
    and ``is_gone`` whether it has left the table. If it ``keeps`` its changes, there are moments of
    them.
    """

    def __init__(self, ball: Ball, legs: list[Leg], changes: list[Change], is_gone: bool) -> None:
        self.number: Final = ball.number
        self.radius: Final = ball.radius
        self.mass: Final = ball.mass
        self.is_cue: Final = ball.is_cue
        self.legs: Final = legs
        self.changes: Final = changes
        self.at: i64 = 0
        self.path = legs[0].path
        self.moves = self.path.moves
        self.met: i64 = NOTHING
        self.is_gone = is_gone
        self.keeps = False
        self.moments: Final[list[Moment]] = []

    @property
    def is_lost(self) -> bool:
        """This tells whether nothing is known of the changes."""
        return all(each.is_lost for each in self.changes)

    @property
    def is_changed(self) -> bool:
        """This tells whether an input has ever changed the ball."""
        return any(each.ever or not each.is_zero for each in self.changes)

    @property
    def is_beyond(self) -> bool:
        """This tells whether changes have grown so large that they mean nothing."""
        return any(each.is_beyond for each in self.changes)

    @property
    def following(self) -> Path | None:
        """The path of the next leg, if there is one."""
        return self.legs[self.at + 1].path if self.at + 1 < len(self.legs) else None

    def goes_on_at(self, t: float) -> bool:
        """Tell whether the next leg begins at a time (s)."""
        then = self.following
        return then is not None and then.t == t

    def go_on(self, met: i64) -> None:
        """Go on to the next leg, where the ball has met something."""
        self.at += 1
        self.path = self.legs[self.at].path
        self.moves = self.path.moves
        self.met = met

    def come_to(self, t: float) -> None:
        """Go on to the last leg that has begun by a time (s)."""
        then = self.following
        while then is not None and then.t <= t:
            self.go_on(NOTHING)
            then = self.following

    def ground(self, table: Table, inputs: Inputs) -> Ground:
        """Return what slows the ball on its leg."""
        return Ground(self.legs[self.at], table, inputs)

    @property
    def fastest(self) -> float:
        """The largest part of the velocity (m/s) at the beginning of the leg."""
        return max(abs(self.path.vx), abs(self.path.vy))

    @property
    def size(self) -> float:
        """The size (m) of its place at the beginning of the leg, and its radius."""
        return abs(self.path.x) + abs(self.path.y) + self.radius

    def rests_just_at(self, t: float) -> bool:
        """Tell whether the path of a ball that has moved ends at a time (s)."""
        moved = self.at > 0 or self.path.vx != 0.0 or self.path.vy != 0.0
        return moved and is_now(self.path.end, t, self.fastest, self.size)

    def lose(self, t: float) -> None:
        """Let nothing be known of the ball from a time (s) on."""
        for each in self.changes:
            each.lose()
        self.come_to(t)

    def note_ever(self, always: bool) -> None:
        """Note which inputs have changed the ball, or that all may have."""
        for each in self.changes:
            if not each.ever and (always or not each.is_zero):
                each.ever = True

    def keep(self, t: float) -> None:
        """Keep the changes from a time (s) on, if that is asked for."""
        if self.keeps:
            self.moments.append(Moment(t, self.at, self.changes))


def is_now(t: float, now: float, fastest: float, size: float) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of balls.

    ``fastest`` (m/s) is the largest part of a velocity, and ``size`` (m) that of a place.
    """
    if t == now:
        return True
    if fastest == 0.0 or t == INF:
        return False
    return abs(t - now) * fastest < BLUR * (size + now * fastest)


def are_now(t: float, now: float, a: Track, b: Track) -> bool:
    """Tell whether a time (s) is that of an instant, to rounding, in the motion of two balls."""
    return is_now(t, now, max(a.fastest, b.fastest), max(a.size, b.size))
