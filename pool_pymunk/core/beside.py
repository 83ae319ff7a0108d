"""Shots are compared with a reference run while they are played: when a ball leaves it, if any."""

from __future__ import annotations

import math
from typing import final

from librt.strings import BytesWriter, write_f64_le

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import Motion, Path, standing
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.walls.wall import Pocket


@final
class Companion:
    """A companion follows a ball of a shot along the places (m) of the same ball in the reference.

    It meets the ``others`` in their order there: the numbers of balls, or -1 - the place of a wall.
    """

    def __init__(self, places: list[Vector], others: list[int]) -> None:
        self.places = places
        self.others = others
        self.begin(standing(0.0, 0.0, 0.0))

    def begin(self, path: Path) -> None:
        """Begin a shot on a path."""
        self.path = path
        self.coming = 0  # the next of the times at which the two are compared
        self.met = 0
        self.left = INF  # s; when the ball leaves the reference


@final
class Beside(Recorder):
    """This recorder compares a shot with a reference at some times (s).

    A ball leaves the reference where it is more than ``agree`` (m) off. After each shot there are
    new ``rows``: whether all balls met the same others in the same order, and when (s) each ball
    has left the reference, or infinity.
    """

    def __init__(self, times: list[float], agree: float, companions: list[Companion]) -> None:
        self.times = times
        self.agree = agree
        self.companions = companions
        self.is_same = True
        self.rows = BytesWriter()

    def begin(self, balls: list[Ball]) -> None:
        """Begin a shot, whose balls are on their first paths."""
        self.is_same = True
        for ball in balls:
            self.companions[ball.number].begin(ball.path)

    def end(self, duration: float) -> None:
        """Compare up to the end of a shot (s), and write down what was found."""
        for one in self.companions:
            self._compare(one, INF, duration)
            self.is_same = self.is_same and one.met == len(one.others)
        write_f64_le(self.rows, 1.0 if self.is_same else 0.0)
        for one in self.companions:
            write_f64_le(self.rows, one.left)

    def take(self) -> bytes:
        """Return the rows of the shots since they were taken last."""
        rows, self.rows = self.rows, BytesWriter()
        return rows.getvalue()

    # -- what is heard -----------------------------------------------------------------------------

    def contact(self, one: Contact, t: float) -> None:
        a, b, wall = one.a.ball.number, one.b, one.wall
        if b is not None:
            self._meet(a, b.ball.number)
            self._meet(b.ball.number, a)
        elif wall is not None:
            self._meet(a, -1 - wall.place)

    def path(self, ball: Ball, path: Path) -> None:
        self._go_on(ball, path)

    def stop(self, ball: Ball, t: float, place: Vector) -> None:
        x, y = place
        self._go_on(ball, standing(t, x, y))

    def pocketed(self, ball: Ball, pocket: Pocket, t: float, motion: Motion) -> None:
        self._meet(ball.number, -1 - pocket.place)
        x, y = pocket.center
        self._go_on(ball, standing(t, x, y))

    def _meet(self, number: int, other: int) -> None:
        """Note whom a ball meets: it should be the next one of the reference."""
        one = self.companions[number]
        if one.met >= len(one.others) or one.others[one.met] != other:
            self.is_same = False
        one.met += 1

    def _go_on(self, ball: Ball, path: Path) -> None:
        """Compare a ball up to a new path, and go on along that."""
        one = self.companions[ball.number]
        self._compare(one, path.t, path.t)
        one.path = path

    def _compare(self, one: Companion, before: float, latest: float) -> None:
        """Compare the places of a ball at all times ``before`` (s) another, or at the latest."""
        while one.left == INF and one.coming < len(self.times):
            t = self.times[one.coming]
            if t >= before:
                return
            x, y = one.path.place(min(t, latest))
            u, v = one.places[one.coming]
            dx, dy = x - u, y - v
            if math.sqrt(dx * dx + dy * dy) > self.agree:
                one.left = t
            one.coming += 1
