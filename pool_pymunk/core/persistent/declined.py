"""Where a contact would persist, a run may be declined: somebody else plays it again.

This module finds these runs. Surface friction, a roll or an arc may press two sides together. The
law's hits would then come ever more often; what they tend to is a contact that persists. Two sides
stay in contact if nothing that they still do by themselves is to be seen.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.facing import Facing
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.persistent.persistence import Persistence
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due, hit_at

# radii; a contact persists once its bounces to come would move the two sides apart by less in all.
UNSEEN: Final = 1e-10
# Once a ball has had more than FEW hits, each less than AGO (s) after the one before, each further
# one lets GROWTH times as much go unseen, for MOST hits at most.
GROWTH: Final = 1.3
FEW: Final = 30
MOST: Final = 50
AGO: Final = 0.05
WORN: Final = 5e5  # GROWTH to the power MOST, or a little more
# radii; balls that touch and press on each other meet sooner than they move so far. Balls of 3 cm
# that 1 m/s^2 presses do so at up to 800 m/s; faster ones hit each other, and then persist.
SOON: Final = 0.01


@final
class Declined(Persistence):
    """This declines a run as soon as two sides are to stay in contact."""

    def __init__(self) -> None:
        super().__init__()
        self.slow = (
            0.0  # m^2/s^2; at lower squares of a speed bounces of the last hit may be unseen
        )

    def allows(self, present: Present, hit: Due) -> float:
        """Return when (s) a predicted hit is due, or infinity if its sides stay in contact."""
        if not may_press(present, hit):
            return hit.t
        if self._look_at(present, hit):
            return INF
        if hit.t <= present.now and present.rubs(hit) and Facing(hit, present.now).bends < 0.0:
            self.declines = True  # A path leads out of an arc later.
        return hit.t

    def concerns(self, present: Present, one: Contact) -> bool:
        closing = one.closing
        self.slow = slow_speed(present, one)
        if closing * closing < self.slow:
            self._absorb(present, [hit_of(present, one)])
        return self.declines

    def loud(self, present: Present, dues: list[Due]) -> list[Due]:
        if len(dues) > 1:
            self._absorb(present, dues)
        return [] if self.declines else dues

    def _absorb(self, present: Present, hits: list[Due]) -> None:
        """Decline the run if all these hits are so faint that their sides stay in contact."""
        for hit in hits:
            if not is_faint(present, hit):
                return
        self.declines = True

    def go_after_lone(self, present: Present, one: Contact) -> None:
        a, b = one.a, one.b
        note_hit(present, a.ball)
        a.vx, a.vy = a.ball.path.vx, a.ball.path.vy
        if b is not None:
            note_hit(present, b.ball)
            b.vx, b.vy = b.ball.path.vx, b.ball.path.vy
        closing = one.closing
        if closing >= 0.0 or closing * closing < self.slow:
            self._look_again(present, hit_of(present, one))

    def go_after(self, present: Present, contacts: list[Contact], changed: list[Ball]) -> None:
        for one in contacts:
            note_hit(present, one.a.ball)
            if one.b is not None:
                note_hit(present, one.b.ball)
            self._look_again(present, hit_of(present, one))

    def _look_again(self, present: Present, hit: Due) -> None:
        """Look whether two sides persist that have just hit."""
        if may_persist(present, hit):
            self._look_at(present, hit)

    def _look_at(self, present: Present, hit: Due) -> bool:
        """Look whether two sides touch that persist from now on."""
        if (hit.wall is not None and hit.wall.is_pocket) or not present.is_closed(hit, 1.0):
            return False
        facing = Facing(hit, present.now)
        parting, noise = -facing.closing, facing.noise
        if parting < -noise:
            return False
        if not stays_after(present, facing, parting if parting > noise else 0.0):
            return False
        self.declines = True
        return True


def hit_of(present: Present, one: Contact) -> Due:
    """Return a contact as a hit that is due now."""
    b = one.b
    return hit_at(present.now, one.a.ball, None if b is None else b.ball, one.wall)


def persists(parting: float, pressing: float, restitution: float, radius: float) -> bool:
    """Tell whether two sides that part at a speed (m/s) stay in contact, to the eye.

    They are pressed together (m/s^2), so each bounce is ``restitution`` squared times as high as
    the one before. Sides that do not part are in contact whatever their restitution is.

    >>> [persists(parting, 1.0, 0.5, 0.03) for parting in (0.0, 1e-6, 1e-5)]
    [True, True, False]
    """
    if pressing <= 0.0:
        return False
    lost = 1.0 - restitution * restitution
    return parting <= 0.0 or parting * parting < 2.0 * pressing * lost * UNSEEN * radius


def may_press(present: Present, hit: Due) -> bool:
    """Tell whether a hit is so soon that its balls hardly move until it comes."""
    speed = hit.a.speed
    if hit.b is not None:
        speed = max(speed, hit.b.speed)
    return not (hit.t - present.now) * speed > SOON * hit.a.radius


def is_faint(present: Present, hit: Due) -> bool:
    """Tell whether two sides would bounce too low to be seen."""
    facing, a = Facing(hit, present.now), hit.a
    vx, vy = a.path.velocity(present.now)
    vx, vy = vx - facing.ux, vy - facing.uy
    square = vx * vx + vy * vy
    strongest = 2.0 * present.pull + abs(facing.bends) * square
    if facing.spins != 0.0:
        strongest += 2.0 * abs(facing.spins) * math.sqrt(square) + abs(facing.lifts)
    radius = a.radius * wear(present, a, hit.b)
    is_slow = facing.closing * facing.closing < 2.0 * strongest * UNSEEN * radius
    return is_slow and stays_after(present, facing, facing.closing)


def stays_after(present: Present, facing: Facing, parting: float) -> bool:
    """Tell whether two sides that part at this speed (m/s) stay in contact, to the eye.

    What presses them now presses them at the end of a slip, too, if it ends before the bounces.
    """
    a, now, e = facing.a.path, present.now, restitution_of(present, facing)
    b = a if facing.b is None else facing.b.path
    radius = facing.least_radius * wear(present, facing.a, facing.b)
    pressing = facing.pressing(a, b, now)
    if parting <= 0.0 or not persists(parting, pressing, 0.0, radius):
        return parting <= 0.0 and pressing > 0.0
    if not persists(parting, pressing, e, radius):
        return False
    bounces = 2.0 * parting / (pressing * (1.0 - e))
    soonest = min(INF if a.slows else a.end, INF if b.slows else b.end)
    if soonest >= now + bounces:
        return True
    a = follower(present, facing.a, a) if a.end == soonest else a
    b = follower(present, facing.a if facing.b is None else facing.b, b) if b.end == soonest else b
    closing = facing.closing_on(a, b, soonest)
    return persists(max(-closing, 0.0), facing.pressing(a, b, soonest), e, radius)


def follower(present: Present, ball: Ball, path: Path) -> Path:
    """Return the path of a ball that follows at the end of one."""
    then = present.table.surface_of(ball.patch).then(path)
    return standing(path.end, path.x, path.y) if then is None else then


def slow_speed(present: Present, one: Contact) -> float:
    """Return the square of a speed (m^2/s^2): at lower ones bounces may be too low to be seen."""
    strongest = present.pull
    if one.b is None:
        vx, vy = one.a.vx - one.ux, one.a.vy - one.uy
        strongest += abs(one.curvature) * (vx * vx + vy * vy)
    return 4.0 * strongest * UNSEEN * WORN * one.a.ball.radius


def note_hit(present: Present, ball: Ball) -> None:
    """Count a hit of a ball."""
    ball.hits, ball.hit = many_of(present, ball) + 1, present.now


def many_of(present: Present, ball: Ball) -> int:
    """Return how many hits a ball has had, each less than ``AGO`` (s) before the next and now."""
    return ball.hits if present.now - ball.hit < AGO else 0


def wear(present: Present, a: Ball, b: Ball | None) -> float:
    """Return how many times as much as ``UNSEEN`` the bounces of two sides may be."""
    many = many_of(present, a)
    if b is not None:
        many = max(many, many_of(present, b))
    worn = 1.0
    for _ in range(min(many - FEW, MOST)):
        worn *= GROWTH
    return worn


def may_persist(present: Present, hit: Due) -> bool:
    """Tell whether the strongest pressing could hold two sides that have just hit.

    Sliding alone presses no ball on to a straight wall.
    """
    own, other = hit.a.path, hit.b
    if other is None:
        facing = Facing(hit, present.now)
        is_still = facing.ux == 0.0 and facing.uy == 0.0 and facing.spins == 0.0
        rolls = present.table.surface.rolls
        return rolls or facing.bends < 0.0 or not own.slows or not is_still
    its = other.path
    dx, dy = its.x - own.x, its.y - own.y
    parting = dx * (its.vx - own.vx) + dy * (its.vy - own.vy)
    square, radius = parting * parting / (dx * dx + dy * dy), hit.a.radius
    strongest = 4.0 * present.pull * UNSEEN * radius * wear(present, hit.a, other)
    return parting <= 0.0 or square < strongest


def restitution_of(present: Present, facing: Facing) -> float:
    """Return the restitution of two sides."""
    if facing.b is not None:
        return present.table.pair(facing.a, facing.b).restitution
    wall = facing.wall
    return 0.0 if wall is None else wall.restitution
