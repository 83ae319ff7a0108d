"""This module tells which two sides would stay in contact: before a hit is due, and after it.

Surface friction, a roll or an arc may press two sides together. The law's hits would then come ever
more often; what they tend to is a contact that persists. Two sides stay in contact if nothing that
they still do by themselves is to be seen.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact
from pool_pymunk.core.motion.path import Path, standing
from pool_pymunk.core.motion.times import INF, Vector, closing_acceleration, unit
from pool_pymunk.core.present import Present
from pool_pymunk.core.queue import Due, hit_at

# radii; a contact persists once its bounces to come would move the two sides apart by less in all.
UNSEEN: Final = 1e-10
# This share of the accelerations may be rounding: what presses less does not press.
PRESSES: Final = 1e-10
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
class Touch:
    """Two sides touch: a ball on its path, and another one or a wall, as they move now (s).

    The normal points from the ball to the other one, or from the wall to the ball. ``bends`` (1/m)
    is the curvature of the wall. It moves at (``ux``, ``uy``), in m/s, where the ball is, with an
    angular velocity ``spins`` (rad/s), and ``lifts`` the ball (m/s^2).
    """

    def __init__(self, present: Present, hit: Due) -> None:
        now, a, b, wall = present.now, hit.a, hit.b, hit.wall
        x, y, vx, vy = a.path.at(now)
        self.a = a
        self.b = b
        self.ux = self.uy = self.spins = self.lifts = self.bends = 0.0
        if b is not None:
            px, py, ux, uy = b.path.at(now)
            self.nx, self.ny = unit(px - x, py - y)
            self.closing = vx * self.nx + vy * self.ny - (ux * self.nx + uy * self.ny)
        else:
            assert wall is not None, "a touch has another side"
            side = wall.nearest(x, y, a.radius, now)
            self.nx, self.ny = side.normal(x, y)
            self.bends = side.curvature(x, y)
            self.ux, self.uy, self.spins, self.lifts = wall.sweep(x, y, now)
            self.closing = -((vx - self.ux) * self.nx + (vy - self.uy) * self.ny)
        self.restitution = 0.0 if wall is None else wall.restitution
        if b is not None:
            self.restitution = present.table.pair(a, b).restitution

    @property
    def noise(self) -> float:
        """The part (m/s) of the velocities that may be rounding."""
        return self.a.noise if self.b is None else max(self.a.noise, self.b.noise)

    @property
    def least_radius(self) -> float:
        """The smaller radius (m)."""
        return self.a.radius if self.b is None else min(self.a.radius, self.b.radius)

    def pressing(self, a: Path, b: Path, t: float) -> float:
        """Return how strongly (m/s^2) the sides are pressed together on these paths at ``t`` (s).

        It is 0 if it is rounding.
        """
        if self.b is not None:
            return pressing_of_balls(a, b, t)
        nx, ny = self.nx, self.ny
        vx, vy = a.velocity(t)
        ax, ay = pull_at(a, t)
        along = (vy - self.uy) * nx - (vx - self.ux) * ny
        turning = self.bends * along * along
        turning += 2.0 * self.spins * along + self.lifts
        press = -(ax * nx + ay * ny) - turning
        return press if press > PRESSES * (a.pull + abs(turning)) else 0.0

    def closing_on(self, a: Path, b: Path, t: float) -> float:
        """Return how fast (m/s) the sides close on these paths at a time (s)."""
        vx, vy = a.velocity(t)
        vx, vy = vx - self.ux, vy - self.uy
        closing = vx * self.nx + vy * self.ny
        if self.b is None:
            return -closing
        ux, uy = b.velocity(t)
        return closing - (ux * self.nx + uy * self.ny)


def pressing_of_balls(a: Path, b: Path, t: float) -> float:
    """Return how strongly (m/s^2) two touching balls are pressed together; 0 if it is rounding."""
    ax, ay, au, av = a.at(t)
    bx, by, bu, bv = b.at(t)
    px, py = pull_at(a, t)
    qx, qy = pull_at(b, t)
    pull = closing_acceleration((bx - ax, by - ay), (bu - au, bv - av), (qx - px, qy - py))
    return pull if pull > PRESSES * (a.pull + b.pull) else 0.0


def pull_at(path: Path, t: float) -> Vector:
    """Return the acceleration (m/s^2) on a path at a time (s): none once the ball rests."""
    return (0.0, 0.0) if path.slows and t >= path.end else (path.ax, path.ay)


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


# -- before a hit ----------------------------------------------------------------------------------


def takes(present: Present, hit: Due) -> bool:
    """Tell whether a predicted hit is no hit: its sides stay in contact, or rub without closing."""
    if not may_press(present, hit):
        return False
    if look_at(present, hit):
        return True
    if hit.t > present.now:
        return False
    touch = Touch(present, hit)
    if not (touch.closing <= touch.noise and present.is_closed(hit, 1.0)):
        return False
    if touch.bends < 0.0:  # It would wait: a path leads out of an arc later.
        present.begins_to_persist = True
    return True


def may_press(present: Present, hit: Due) -> bool:
    """Tell whether a hit is so soon that its balls hardly move until it comes."""
    speed = hit.a.speed
    if hit.b is not None:
        speed = max(speed, hit.b.speed)
    return not (hit.t - present.now) * speed > SOON * hit.a.radius


def look_at(present: Present, hit: Due) -> bool:
    """Look whether two sides touch that persist from now on."""
    if (hit.wall is not None and hit.wall.is_pocket) or not present.is_closed(hit, 1.0):
        return False
    touch = Touch(present, hit)
    parting, noise = -touch.closing, touch.noise
    if parting < -noise:
        return False
    if not stays_after(present, touch, parting if parting > noise else 0.0):
        return False
    present.begins_to_persist = True
    return True


def absorbs(present: Present, hits: list[Due]) -> bool:
    """Tell whether all these hits are so faint that their sides stay in contact instead."""
    for hit in hits:
        if not is_faint(present, hit):
            return False
    present.begins_to_persist = True
    return True


def is_faint(present: Present, hit: Due) -> bool:
    """Tell whether two sides would bounce too low to be seen."""
    touch, a = Touch(present, hit), hit.a
    vx, vy = a.path.velocity(present.now)
    vx, vy = vx - touch.ux, vy - touch.uy
    square = vx * vx + vy * vy
    strongest = 2.0 * present.pull + abs(touch.bends) * square
    if touch.spins != 0.0:
        strongest += 2.0 * abs(touch.spins) * math.sqrt(square) + abs(touch.lifts)
    radius = a.radius * wear(present, a, hit.b)
    is_slow = touch.closing * touch.closing < 2.0 * strongest * UNSEEN * radius
    return is_slow and stays_after(present, touch, touch.closing)


def stays_after(present: Present, touch: Touch, parting: float) -> bool:
    """Tell whether two sides that part at this speed (m/s) stay in contact, to the eye.

    What presses them now presses them at the end of a slip, too, if it ends before the bounces.
    """
    a, now, e = touch.a.path, present.now, touch.restitution
    b = a if touch.b is None else touch.b.path
    radius = touch.least_radius * wear(present, touch.a, touch.b)
    pressing = touch.pressing(a, b, now)
    if parting <= 0.0 or not persists(parting, pressing, 0.0, radius):
        return parting <= 0.0 and pressing > 0.0
    if not persists(parting, pressing, e, radius):
        return False
    bounces = 2.0 * parting / (pressing * (1.0 - e))
    soonest = min(INF if a.slows else a.end, INF if b.slows else b.end)
    if soonest >= now + bounces:
        return True
    a = follower(present, touch.a, a) if a.end == soonest else a
    b = follower(present, touch.a if touch.b is None else touch.b, b) if b.end == soonest else b
    closing = touch.closing_on(a, b, soonest)
    return persists(max(-closing, 0.0), touch.pressing(a, b, soonest), e, radius)


def follower(present: Present, ball: Ball, path: Path) -> Path:
    """Return the path of a ball that follows at the end of one."""
    then = present.table.surface_of(ball.patch).then(path)
    return standing(path.end, path.x, path.y) if then is None else then


# -- after a hit -----------------------------------------------------------------------------------


def slow_speed(present: Present, one: Contact) -> float:
    """Return the square of a speed (m^2/s^2): at lower ones bounces may be too low to be seen."""
    strongest = present.pull
    if one.b is None:
        vx, vy = one.a.vx - one.ux, one.a.vy - one.uy
        strongest += abs(one.curvature) * (vx * vx + vy * vy)
    return 4.0 * strongest * UNSEEN * WORN * one.a.ball.radius


def look_after(present: Present, one: Contact, slow: float) -> None:
    """Look whether two sides persist that have hit alone, and count the hit.

    ``slow`` (m^2/s^2) is the square of a speed that bounces have which may not be seen.
    """
    note_hit(present, one.a.ball)
    if one.b is not None:
        note_hit(present, one.b.ball)
    a, b = one.a, one.b
    a.vx, a.vy = a.ball.path.vx, a.ball.path.vy
    if b is not None:
        b.vx, b.vy = b.ball.path.vx, b.ball.path.vy
    closing = one.closing
    if closing >= 0.0 or closing * closing < slow:
        look_again(present, hit_at(present.now, a.ball, None if b is None else b.ball, one.wall))


def look_after_round(present: Present, hit: Due) -> None:
    """Look whether two sides persist that a round has answered, and count the hit."""
    note_hit(present, hit.a)
    if hit.b is not None:
        note_hit(present, hit.b)
    look_again(present, hit)


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


def look_again(present: Present, hit: Due) -> None:
    """Look whether two sides persist that have just hit."""
    if may_persist(present, hit):
        look_at(present, hit)


def may_persist(present: Present, hit: Due) -> bool:
    """Tell whether the strongest pressing could hold two sides that have just hit.

    Sliding alone presses no ball on to a straight wall.
    """
    own, other = hit.a.path, hit.b
    if other is None:
        touch = Touch(present, hit)
        is_still = touch.ux == 0.0 and touch.uy == 0.0 and touch.spins == 0.0
        rolls = present.table.surface.rolls
        return rolls or touch.bends < 0.0 or not own.slows or not is_still
    its = other.path
    dx, dy = its.x - own.x, its.y - own.y
    parting = dx * (its.vx - own.vx) + dy * (its.vy - own.vy)
    square, radius = parting * parting / (dx * dx + dy * dy), hit.a.radius
    strongest = 4.0 * present.pull * UNSEEN * radius * wear(present, hit.a, other)
    return parting <= 0.0 or square < strongest
