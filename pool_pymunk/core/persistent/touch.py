"""Balls that touch press on each other, or on walls; a touch has its forces, with friction."""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Pair
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import INF, Vector
from pool_pymunk.core.persistent.member import REST, ROLL, SHARE, SPENT, Member
from pool_pymunk.core.queue import Due, hit_at
from pool_pymunk.core.walls.moving import Carried
from pool_pymunk.core.walls.side import Side
from pool_pymunk.core.walls.wall import Wall

NORMAL: Final = 0  # kinds of forces: N, friction along the contact, friction that slows the roll
ALONG: Final = 1
INTO: Final = 2
LEAST: Final = 0.1  # Where friction on a roll takes more of a push, a bit closes again.
SLOW: Final = 1.0  # times what the surface takes in a step of a crowd; bounces are not slower


@final
class Touch:
    """A touch is a contact of a group: of two members, or of one and a side of a wall.

    Its forces (N) are ``n`` along the normal, ``t`` along the tangent, and ``i``, which slows the
    roll into a cushion. ``slides`` and ``turns`` have the signs of the slip and of that roll; where
    they are 0, friction holds them. What has opened is no contact until ``later`` (s). What hits
    without bounces have given to the last ball is ``struck`` (N s). Friction does not act while N
    gives the ``spared`` impulse (N s), or is less in a piece that is longer. Bounces that go unseen
    end at ``bounces`` (s). Sides that hit over and over are joined though nothing presses them:
    then the touch ``is_dull``.

    In a step of a crowd, if no ball had an acceleration, the gap would open by the ``excess``
    (m/s^2) faster than it should, and the slip would be too large by the ``skew``.

    The normal turns at ``swing`` (rad/s). A wall that moves has the ``drift`` (m/s) along the
    normal, and the ``shear`` along the tangent. If the ball had no acceleration, the speed at which
    the gap opens would change by ``lift`` (m/s^2), and the slip by ``tug``.
    """

    __slots__ = ("a", "at_start", "b", "bounces", "closed", "drift", "excess", "halfway", "i",
                 "is_dull", "kept", "later", "lift", "members", "mu", "n", "nx", "ny", "on",
                 "pair", "shear", "side", "skew", "slides", "slip", "spared", "struck", "swing",
                 "t", "tug", "turns", "unit", "wall", "wrings")  # fmt: skip

    def __init__(
        self, a: Member, b: Member | None, wall: Wall | None, side: Side | None, pair: Pair
    ) -> None:
        self.a = a
        self.b = b
        self.members = [a] if b is None else [a, b]
        self.wall = wall
        self.side = side
        self.pair = pair
        self.mu = pair.friction
        self.unit = a.mass if b is None else a.mass * b.mass / (a.mass + b.mass)
        self.wrings = b is None and a.rolls and pair.friction > 0.0
        self.on = self.closed = self.is_dull = False
        self.later = -INF
        self.excess = self.skew = 0.0
        self.slides = self.turns = 0.0
        self.n = self.t = self.i = 0.0
        self.nx, self.ny, self.slip = 1.0, 0.0, 0.0
        self.swing = self.lift = self.tug = self.drift = self.shear = 0.0
        self.at_start: Vector = (0.0, 0.0)
        self.halfway: Vector = (0.0, 0.0)
        self.struck: Vector = (0.0, 0.0)
        self.kept: Vector = (0.0, 0.0)  # what was struck before the present piece
        self.spared = 0.0
        self.bounces = -INF

    # -- where it is ---------------------------------------------------------------------------

    def look(self) -> None:
        """Find the normal, the slip (m/s), and how both change."""
        a, b, side = self.a, self.b, self.side
        u, v, bend = a.vx, a.vy, 0.0
        if b is not None:
            dx, dy = b.x - a.x, b.y - a.y
            distance = math.sqrt(dx * dx + dy * dy)
            self.nx, self.ny, bend = dx / distance, dy / distance, 1.0 / distance
            u, v = b.vx - u, b.vy - v
        elif isinstance(side, Carried):
            self._look_at_carried(side)
            return
        elif side is not None:
            self.nx, self.ny = side.normal(a.x, a.y)
            bend = side.curvature(a.x, a.y)
        self.slip = v * self.nx - u * self.ny
        self.swing = bend * self.slip
        self.lift = self.swing * self.slip

    def _look_at_carried(self, side: Carried) -> None:
        """Do so for a wall that moves: Coriolis and centrifugal forces act in its frame."""
        a, turns = self.a, side.body.turns
        side.set_to(a.time)
        nx, ny = self.nx, self.ny = side.normal(a.x, a.y)
        ux, uy, cx, cy = side.flow(a.x, a.y)
        along = (a.vy - uy) * nx - (a.vx - ux) * ny
        bend = side.curvature(a.x, a.y) * along
        self.swing = bend + turns
        self.lift = (bend + 2.0 * turns) * along + cx * nx + cy * ny
        self.tug = cy * nx - cx * ny
        self.drift = ux * nx + uy * ny
        self.shear = uy * nx - ux * ny - turns * a.ball.radius
        self.slip = self._present_slip

    @property
    def mode(self) -> int:
        """A number that tells whether it presses, and which friction is at its bound."""
        return int(self.slides) + 3 * int(self.turns) + 5 if self.on else 0

    @property
    def push(self) -> Vector:
        """The force (N) on the last ball."""
        return self.n * self.nx - self.t * self.ny, self.n * self.ny + self.t * self.nx

    @property
    def gap(self) -> float:
        a, side = self.a, self._present_side()
        return self._gap_of_balls if side is None else side.gap(a.x, a.y, a.ball.radius)

    @property
    def gap_beyond(self) -> float:
        """The same, where a ball has just come to the end of its side, too."""
        a, side = self.a, self._present_side()
        return self._gap_of_balls if side is None else side.gap_beyond(a.x, a.y, a.ball.radius)

    @property
    def _gap_of_balls(self) -> float:
        a, b = self.a, self.b
        assert b is not None, "a touch has another side"
        dx, dy = b.x - a.x, b.y - a.y
        return math.sqrt(dx * dx + dy * dy) - a.ball.radius - b.ball.radius

    def _present_side(self) -> Side | None:
        """Return the side where it is at the time of the ball's state."""
        side = self.side
        if isinstance(side, Carried):
            side.set_to(self.a.time)
        return side

    @property
    def opening(self) -> float:
        """The speed (m/s) at which the sides part."""
        a, b = self.a, self.b
        along = a.vx * self.nx + a.vy * self.ny
        return along - self.drift if b is None else b.vx * self.nx + b.vy * self.ny - along

    @property
    def _present_slip(self) -> float:
        a, b = self.a, self.b
        along = a.vy * self.nx - a.vx * self.ny
        return along - self.shear if b is None else b.vy * self.nx - b.vx * self.ny - along

    @property
    def roll_in(self) -> float:
        """The part of the roll (m/s) along the normal, if friction slows it there."""
        return self.a.wx * self.nx + self.a.wy * self.ny if self.wrings else 0.0

    @property
    def room(self) -> float:
        """The distance (m) to the end of the side."""
        side = self.side
        return INF if side is None else side.room(self.a.x, self.a.y) + 2e-8 * self.a.ball.radius

    @property
    def until(self) -> float:
        """The time (s) until which a wall moves as it does now."""
        return self.side.body.until if isinstance(self.side, Carried) else INF

    @property
    def is_carried(self) -> bool:
        """This tells whether the side is one of a wall that may move."""
        return isinstance(self.side, Carried)

    @property
    def is_jammed(self) -> bool:
        """This tells whether a wall that moves closes, although the sides are in contact."""
        return self.on and self.is_carried and self.opening < -100.0 * self.a.scale.none

    @property
    def softness(self) -> float:
        """The acceleration at which a push of 1 N drives the two sides apart (1/kg)."""
        return self.a.lightness + (0.0 if self.b is None else self.b.lightness)

    def hit_at(self, t: float) -> Due:
        """Return the hit of its sides at a time (s)."""
        return hit_at(t, self.a.ball, None if self.b is None else self.b.ball, self.wall)

    def has(self, member: Member) -> bool:
        return self.a is member or self.b is member

    @property
    def rests_in_part(self) -> bool:
        """This tells whether its balls rest, and are of one part, in which it may press soon."""
        part = self.a.part
        return all(each.phase == REST and each.part == part for each in self.members)

    def shift(self, gap: float, opening: float) -> None:
        """Move the sides apart by a length (m) and a speed (m/s); no momentum is lost."""
        total = self.softness
        if total == 0.0:
            return
        for each in self.members:
            far = gap * each.lightness / total
            far = far if each is self.members[-1] else -far
            each.shift(far * self.nx, far * self.ny)
        self._hit(opening / total, 0.0, 0.0)

    @property
    def hardness(self) -> float:
        """The speed (m/s) that a hit without a bounce takes away; no contact only closes."""
        return abs(self.opening) if self.on else -self.opening

    def impulses(self) -> tuple[float, float, float]:
        """Return the impulses (N s) of a hit without a bounce, after which the sides stay together.

        Its friction slows the slip, and the roll into a cushion, and turns neither round.
        """
        soft = self.softness
        if soft == 0.0:
            return 0.0, 0.0, 0.0
        a = self.a
        rolls_in = self.wrings and a.mode == ROLL
        opening, slip, roll = self.opening, self._present_slip, self.roll_in
        wrings = self.mu
        if rolls_in and roll > 0.0 > opening:  # A wall that moves drives it on.
            soft *= max(1.0 - wrings, LEAST)
        elif rolls_in:
            wrings = min(wrings, GYRATION)  # The roll into it ends with the motion into it.
            soft *= 1.0 + wrings
        n = -opening / soft
        most = self.mu * max(n, 0.0)
        t = -math.copysign(1.0, slip) * most
        i = -math.copysign(1.0, roll) * wrings * max(n, 0.0) / GYRATION
        if abs(t) * self.softness > abs(slip):
            t = -slip / self.softness
        if not self.wrings:
            i = 0.0
        elif not rolls_in and abs(i) > a.mass * abs(roll):
            i = -a.mass * roll
        return n, t, i

    def strike(self, n: float, t: float, i: float) -> None:
        """Let the sides hit each other by these impulses (N s).

        Sides that part come back later, and do not press until then: friction is spared for as
        much.
        """
        self.spared -= min(n, 0.0)
        if self.pair.restitution == 0.0:
            x, y = n * self.nx - t * self.ny, n * self.ny + t * self.nx
            if self.b is None:
                self.a.slide(x - i * self.nx, y - i * self.ny)
            else:
                self.a.slide(-x, -y)
                self.b.slide(x, y)
        self._hit(n, t, i)

    def _hit(self, n: float, t: float, i: float) -> None:
        """Kick the balls, and note it as what hits without bounces give."""
        x, y = self.struck
        self.struck = x + n * self.nx - t * self.ny, y + n * self.ny + t * self.nx
        self._kick(n, t, i)

    def _kick(self, n: float, t: float, i: float) -> None:
        """Give impulses (N s) along the normal, along the tangent, and to the roll."""
        x, y = n * self.nx - t * self.ny, n * self.ny + t * self.nx
        if self.b is None:
            self.a.kick(x, y, i * self.nx, i * self.ny)
        else:
            self.a.kick(-x, -y, 0.0, 0.0)
            self.b.kick(x, y, 0.0, 0.0)

    @property
    def spares_for(self) -> float:
        """The time (s) in which N gives the impulse that is spared."""
        return self.spared / self.n if self.n > 0.0 and self.mu > 0.0 else 0.0

    def slacken(self, time: float) -> bool:
        """Let friction in a time (s) be less by what is spared; tell whether that is new."""
        was = self.mu
        self.mu = self.pair.friction
        if self.slides != 0.0 or self.turns != 0.0:
            self.mu *= max(1.0 - self.spares_for / time, LEAST)
        if self.mu != was:
            most = self.mu * self.n
            i = self.i if self.turns == 0.0 else -self.turns * most / GYRATION
            self.press(self.n, self.t if self.slides == 0.0 else -self.slides * most, i)
        return self.mu != was

    def spend(self, time: float) -> None:
        """Count what friction has been spared in a time (s); where sides stick, it is over, too."""
        if self.spared > 0.0 and self.mu > 0.0:
            slips = self.slides != 0.0 or self.turns != 0.0
            share, most = 1.0 - self.mu / self.pair.friction if slips else 1.0, self.n * time
            left = self.spared - share * most
            self.spared = left if left > SPENT * most else 0.0

    @property
    def press_on(self) -> float:
        """It is how strongly (m/s^2) the sides would close without their forces."""
        a = self.a
        rolls_in = self.wrings and a.phase == ROLL
        return self.n * self.softness + (SHARE * self.i / a.mass if rolls_in else 0.0)

    def rub(self, n: float) -> None:
        """Slow the slip as an impulse N (N s) along the normal does, and do not turn it round."""
        if self.slides != 0.0 and self.softness > 0.0:
            t = min(self.mu * n, abs(self._present_slip) / self.softness)
            self._kick(0.0, -self.slides * t, 0.0)

    def stick(self) -> None:
        """Let a slip that has faded, or nearly so, be 0; no momentum is lost."""
        if self.softness > 0.0:
            self._kick(0.0, -self._present_slip / self.softness, 0.0)

    def stop_turning(self) -> None:
        """Let a roll into the cushion that has faded, or nearly so, be 0."""
        self._kick(0.0, 0.0, -self.a.mass * self.roll_in)

    # -- in a step of a crowd ------------------------------------------------------------------

    def aim(self, h: float, bounces: float) -> None:
        """Find excess and skew in a step (s) after which the sides are to slip no more.

        They are to part at e times the speed at which they close. Slower ones, which bounce unseen,
        come to touch.
        """
        gap, opening = self.gap, self.opening
        touches = -max(gap, 0.0) / h
        parting = -bounces * self.pair.restitution * opening
        bounce = parting > SLOW * h * self.a.pull and gap + h * opening <= 0.0
        self.excess = self.lift + (opening - (parting if bounce else touches)) / h
        self.skew = self.tug + self.slip / h

    def carry(self, h: float) -> float:
        """Press as much as the sides need to part, and to stop the slips, as far as friction can.

        It returns how much the speed (m/s) changes by that.
        """
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        ax, ay = a.ax, a.ay
        if b is not None:
            ax, ay = b.ax - ax, b.ay - ay
        n = max(self.n - self.unit * (ax * nx + ay * ny + self.excess), 0.0)
        if n == 0.0 and self.n == 0.0:
            return 0.0
        t, i, most = self.t, self.i, self.mu * n
        if most > 0.0 or t != 0.0:
            t = max(-most, min(t - self.unit * (ay * nx - ax * ny + self.skew), most))
        if self.wrings:
            most /= GYRATION
            i -= a.mass * (a.bx * nx + a.by * ny + self.roll_in / h)
            i = max(-most, min(i, most))
        change = (abs(n - self.n) + abs(t - self.t)) * h / self.unit
        self.press(n, t, i)
        for each in self.members:
            each.brake(h)
        return change

    def comes(self, far: float, soon: float) -> bool:
        """Tell whether the sides come nearer than a length (m) in a time (s)."""
        return self.gap <= far + max(-self.opening, 0.0) * soon

    def has_sunk(self, depth: float) -> bool:
        """Tell whether the sides have sunk into each other by so many radii."""
        return self.gap < -depth * self.a.ball.radius

    def part(self, times: float, evenly: bool) -> float:
        """Move sides apart by so many times what they have sunk in; return that, in radii.

        The lighter ball moves farther, unless both move evenly.
        """
        a, b = self.a, self.b
        if b is not None:
            dx, dy, near = b.x - a.x, b.y - a.y, a.ball.radius + b.ball.radius
            if dx * dx + dy * dy >= near * near:
                return 0.0
        gap = self.gap
        if gap >= 0.0:
            return 0.0
        far = -times * gap
        if b is None:
            a.shift(far * self.nx, far * self.ny)
        else:
            share = 0.5 if evenly else self.unit / a.mass
            a.shift(-share * far * self.nx, -share * far * self.ny)
            far *= 1.0 - share
            b.shift(far * self.nx, far * self.ny)
        return -gap / a.ball.radius

    # -- forces --------------------------------------------------------------------------------

    def press(self, n: float, t: float, i: float) -> None:
        """Let the forces (N) be these: change the pushes on the balls."""
        dn, dt, di = n - self.n, t - self.t, i - self.i
        self.n, self.t, self.i = n, t, i
        x, y = dn * self.nx - dt * self.ny, dn * self.ny + dt * self.nx
        a, b = self.a, self.b
        m = a.mass
        if b is None:
            a.fx, a.fy = a.fx + x / m, a.fy + y / m
            a.cx, a.cy = a.cx + di / m * self.nx, a.cy + di / m * self.ny
        else:
            a.fx, a.fy = a.fx - x / m, a.fy - y / m
            m = b.mass
            b.fx, b.fy = b.fx + x / m, b.fy + y / m

    def rate(self, kind: int) -> float:
        """Return what a force is to bring to 0 (m/s^2): how fast the gap, or a slip, changes."""
        a, b, nx, ny = self.a, self.b, self.nx, self.ny
        if kind == INTO:
            if a.mode == ROLL:
                return (a.cx - a.fx) * nx + (a.cy - a.fy) * ny
            return a.bx * nx + a.by * ny + self.swing * (a.wy * nx - a.wx * ny)
        ax, ay = a.ax, a.ay
        if b is not None:
            ax, ay = b.ax - ax, b.ay - ay
        if kind == ALONG:
            return ay * nx - ax * ny + self.tug
        return ax * nx + ay * ny + self.lift

    def speed(self, kind: int) -> float:
        """Return the speed (m/s) whose rate that is."""
        if kind == INTO:
            return 0.0 if self.a.mode == ROLL else self.roll_in
        return self.slip if kind == ALONG else self.opening

    def add(self, kind: int, much: float) -> None:
        """Press more (N) by a force; friction that is at its bound goes with N."""
        if kind == ALONG:
            self.press(self.n, self.t + much, self.i)
        elif kind == INTO:
            self.press(self.n, self.t, self.i + much)
        else:
            most = self.mu * much
            self.press(
                self.n + much, self.t - self.slides * most, self.i - self.turns * most / GYRATION
            )

    def move(self) -> None:
        for each in self.members:
            each.move()

    def relax(self, now: float, slides: float, turns: float) -> None:
        """Press as much as closes the gap and stops the slips, as far as friction can."""
        soft = self.softness
        if soft == 0.0:
            return
        n = max(self.n - self.rate(NORMAL) / soft, 0.0)
        most = self.mu * n
        t, i = -slides * most, -turns * most / GYRATION
        if slides == 0.0 and most > 0.0:
            t = max(-most, min(self.t - self.rate(ALONG) / soft, most))
        if turns == 0.0 and self.wrings and self.a.mode != REST:
            most /= GYRATION
            i = max(-most, min(self.i - self.rate(INTO) * self.a.mass, most))
        self.press(n, t, i)
        for each in self.members:
            each.hold(now)
            each.move()


def is_of(one: Touch, a: Ball, b: Ball | None, wall: Wall | None) -> bool:
    """Tell whether a touch is that of two balls, or of a ball and a wall."""
    if one.b is None:
        return b is None and one.a.ball is a and one.wall is wall
    return (one.a.ball is a and one.b.ball is b) or (one.a.ball is b and one.b.ball is a)
