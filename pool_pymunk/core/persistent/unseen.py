"""The tolerance of the user says how far bounces and waits may move a ball unseen."""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact, Disc
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.gathering import gathering_of
from pool_pymunk.core.persistent.gatherings import SOON, WORN, Gatherings
from pool_pymunk.core.persistent.scale import Scale
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due

EACH: Final = 0.15  # Several things go unseen in a run; each is this share of the tolerance.
STRONGEST: Final = 2.0  # Surface friction presses two sides together by no more than so many pulls.
# Once a ball has had FEW hits, each less than SOON after the one before, each further one lets
# GROWTH times as much go unseen, up to MOST times.
FEW: Final = 15
GROWTH: Final = 1.5
MOST: Final = 1000.0
# A bounce of balls that touch others, too, loses at least this share of its energy by them.
SHARED: Final = 0.1
DEEPER: Final = 0.1  # times what may go unseen; what has sunk in may sink in by that, too
CROWD: Final = 8  # balls; where more are together, hits are faint whatever presses
TINY: Final = 1e-6  # Where no energy is lost, bounces of this share of the tolerance are none.


class Unseen(Gatherings):
    """The tolerance says which hits, bounces and presses go unseen; groups and crowds ask it."""

    def __init__(self, scale: Scale) -> None:
        super().__init__(scale)
        self.tolerance = EACH * scale.tolerance

    def _tolerance(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return what may go unseen (m)."""
        return self._wear(present, a, b) * self.tolerance

    def _wear(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return how many times more may go unseen, because these balls have hit often of late."""
        hits, now = a.hits if present.now - a.hit < SOON else 0, present.now
        if b is not None and now - b.hit < SOON:
            hits = max(hits, b.hits)
        times = 1.0
        while hits > FEW and times < MOST:
            times, hits = GROWTH * times, hits - 1
        return times

    def _note_hit(self, present: Present, ball: Ball) -> None:
        now = present.now
        ball.hits = ball.hits + 1 if now - ball.hit < SOON else 1
        ball.hit = now
        ball.creep = self.scale.creep if ball.hits > FEW else 0.0
        if ball.hits > WORN:  # From this speed it rests within the tolerance.
            drag = present.table.surface_of(ball.patch).drag
            ball.creep = max(ball.creep, math.sqrt(2.0 * drag * self.tolerance))

    def _hushed(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return the speed (m/s) below which hits around groups may wait."""
        many = len(self.seeds) + len(self.loose)
        group = gathering_of(a)
        if group is not None:
            many = max(many, len(group.members))
        return self.scale.hushed * (self._wear(present, a, b) if many > CROWD else 1.0)

    def _lost(self, present: Present, one: Contact) -> float:
        """Return the share of the energy of a bounce that is lost, by other contacts, too."""
        e, a, b = one.pair.restitution, one.a.ball, one.b
        alone = len(self.loose) <= (1 if b is None else 2) and a.hit != present.now
        alone = alone and not any(ball is a for ball in self.seeds)
        alone = alone and (b is None or b.ball.hit != present.now)
        return max(1.0 - e * e, TINY if alone else SHARED)

    def _contact(self, present: Present, hit: Due) -> Contact:
        """Return the present contact of the two sides of a hit."""
        b = None if hit.b is None else present.disc(hit.b)
        return present.contact(present.disc(hit.a), b, hit.wall)

    def _exact(self, present: Present, hit: Due) -> Contact:
        """Return the same by the exact states of groups, from which paths deviate a little."""
        return present.contact(
            self._exact_disc(present, hit.a),
            None if hit.b is None else self._exact_disc(present, hit.b),
            hit.wall,
        )

    def _exact_disc(self, present: Present, ball: Ball) -> Disc:
        if ball.group is None:
            return present.disc(ball)
        motion, _roll = ball.group.state_of(ball, present.now)
        return Disc(ball, *motion)

    def _press(self, present: Present, one: Contact) -> float:
        """Return how strongly (m/s^2) the present paths press two sides together."""
        a = one.a.ball.path
        x, y = a.ax, a.ay
        if one.b is not None:
            b = one.b.ball.path
            x, y = b.ax - x, b.ay - y
        return -(x * one.nx + y * one.ny) - self._lift(present, one)

    def _lift(self, present: Present, one: Contact) -> float:
        """Return the rate (m/s^2) at which sides would part ever faster without accelerations."""
        if one.b is not None:
            return 1.0 / (one.a.ball.radius + one.b.ball.radius) * one.slip * one.slip
        if one.wall is None or not one.wall.moves:
            return one.curvature * one.slip * one.slip if one.curvature != 0.0 else 0.0
        ux, uy, spins, lifts = one.wall.sweep(one.a.x, one.a.y, present.now)
        along = (one.a.vy - uy) * one.nx - (one.a.vx - ux) * one.ny
        return (one.curvature * along + 2.0 * spins) * along + lifts

    def _strongest(self, present: Present, one: Contact) -> float:
        """Return how strongly (m/s^2) two sides may be pressed together."""
        bend = self._lift(present, one) if one.b is None else 0.0
        return STRONGEST * present.pull + abs(bend)

    def _shortest_wait(self, present: Present, one: Contact) -> float:
        """Return how long (s) sides take to sink in to be seen, whatever forces act on them."""
        press = max(self._press(present, one), self._strongest(present, one))
        return math.sqrt(2.0 * self.tolerance / max(press, 1e-9))

    def _sinks_in(self, present: Present, hit: Due, one: Contact, t: float) -> float:
        """Return how long (s) from a time (s) on sides take to sink in to be seen, as they move."""
        press = max(self._press(present, one), 0.0)
        closing = max(one.closing, 0.0) + press * (t - present.now)
        room = self.tolerance + (min(present.gap(hit), 0.0) if t <= present.now else 0.0)
        room = max(room, DEEPER * self.tolerance)
        fast = closing + math.sqrt(closing * closing + 2.0 * press * room)
        return 2.0 * room / fast if fast > 0.0 else INF

    def _is_slow(self, present: Present, one: Contact) -> bool:
        """Tell whether two sides close so slowly that they may wait for a moment.

        A wall that moves goes on closing, so it waits only until it has sunk in as far as may be.
        """
        a, b, wall = one.a, None if one.b is None else one.b.ball, one.wall
        if wall is not None and wall.moves:
            r = a.ball.radius
            gap = wall.nearest(a.x, a.y, r, present.now).gap(a.x, a.y, r)
            if gap < -self.tolerance:
                return False
        return one.closing <= self._hushed(present, a.ball, b)

    def _is_loud(self, present: Present, one: Contact, speed: float) -> bool:
        """Tell whether a speed (m/s) is above all that may go unseen."""
        pull = self._strongest(present, one)
        return (
            speed > 0.0
            and speed * speed
            > 4.0 * pull * MOST * self.tolerance + self.scale.noise * self.scale.noise
        )

    def _is_pressed(self, present: Present, one: Contact) -> bool:
        """Tell whether the paths of two sides that hit press them, so that bounces are not seen."""
        press, e, v = self._press(present, one), one.pair.restitution, one.closing
        room = self._tolerance(present, one.a.ball, None if one.b is None else one.b.ball)
        return press > 0.0 and e * e * v * v <= 2.0 * press * self._lost(present, one) * room

    def _is_faint(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit and its bounces go unseen if surface friction presses the sides."""
        press = self._strongest(present, one)
        room = self._tolerance(present, one.a.ball, None if one.b is None else one.b.ball)
        e, lost = one.pair.restitution, self._lost(present, one)
        return self._is_unseen(one.closing, e, lost, 2.0 * press * room)

    def _is_unseen(self, closing: float, e: float, lost: float, most: float) -> bool:
        """Tell whether sides that close at a speed (m/s), or part, move unseen until they stay.

        They do if energy, and what bounces have of it, is at ``most`` so much (m^2/s^2). A bounce
        loses a share of it, the ``lost`` one.
        """
        parting = max(-closing, e * closing)
        return closing <= math.sqrt(most) and parting <= math.sqrt(most * lost) + self.scale.noise

    def _is_dull(self, present: Present, one: Contact) -> bool:
        """Tell whether a hit of balls that hit over and over moves them unseen until the next one.

        Where nothing slows balls, only such hits without bounces end what would have no end.
        """
        b = None if one.b is None else one.b.ball
        dullest = self._dullest(present, one.a.ball, b)
        return -dullest < one.closing < dullest

    def _dullest(self, present: Present, a: Ball, b: Ball | None) -> float:
        """Return the speed (m/s) below which hits of two sides are dull."""
        often = self._wear(present, a, b)
        is_none = present.table.slows or often == 1.0
        return 0.0 if is_none else often * self.tolerance / SOON

    def are_faint(self, present: Present, contacts: list[Contact]) -> bool:
        """Tell whether all these hits are so faint that a group may begin instead."""
        for one in contacts:
            if one.closing <= self.scale.noise or not self._is_faint(present, one):
                return False
        return True
