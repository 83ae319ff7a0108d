"""A ball of a group in persistent contact: what pushes it, and the friction of the surface.

With f the push of a ball's contacts, c what cushions do to its roll (both as accelerations), the
slip u = v - w and the surface's decelerations ``pull`` of sliding and ``drag`` of rolling:

- A ball that slips has dv/dt = f - pull u/|u| and dw/dt = c + (5/2) pull u/|u|.
- One that rolls has dv/dt = dw/dt = (5/7) f + (2/7) c - drag v/|v|, while (2/7) |f - c| <= pull.
- One that rests stays while |(5/7) f + (2/7) c| <= drag.

Discs have w = 0, and rest while |f| <= pull. A surface of a user's own says by its paths how it
accelerates a ball, and whether it slows it to rest; f and c are added to that.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.surface import GYRATION, Rolling, Sliding, Surface
from pool_pymunk.core.motion.times import INF, Vector, length_of
from pool_pymunk.core.persistent.scale import Scale

# The phases of a ball; friction that does not hold lets it go on to the next one.
REST: Final = 0
ROLL: Final = 1
SLIP: Final = 2
FREE: Final = 3  # a ball that moves on a surface of a user's own

SPENT: Final = 1e-6  # of a piece, or of what friction gives in it; less is spared no more
FADED: Final = 0.01  # of what it was; a smaller slip or speed may be an error of a piece
SHARE: Final = 2.0 / 7.0  # This share of a slip is taken off the velocity until the ball rolls.

Rates = tuple[float, float, float, float]  # dv/dt, dw/dt (m/s^2)
State = tuple[float, float, float, float, float, float]  # x, y (m), vx, vy, wx, wy (m/s)


@final
class Member:
    """A member is a ball of a group, with its state, the pushes on it, and its rates.

    Surface friction points against (``hx``, ``hy``), which was (``gx``, ``gy``) at the beginning of
    a piece. The ``phase`` is that of its state, the ``mode`` what friction makes of it: the next
    phase, if the pushes are too strong to hold. Until ``held`` (s) nothing lets it go. A surface of
    a user's ``own`` accelerates it by (``px``, ``py``), at the beginning of a piece by (``qx``,
    ``qy``), and ``slows`` it to rest or does not.
    Rolling ``resistance`` is less than ``drag`` in a piece while some time (s) of it is ``spared``.
    A group owns it, and touches push it.
    """

    __slots__ = ("ax", "ay", "ball", "bx", "by", "cx", "cy", "drag", "first", "fx", "fy", "glided",
                 "gx", "gy", "held", "hx", "hy", "is_struck", "mass", "mode", "own", "part",
                 "phase", "place", "pull", "px", "py", "qx", "qy", "resistance", "rolls", "scale",
                 "second", "share", "since", "slows", "spared", "start", "third", "time", "ux",
                 "uy", "vx", "vy", "wx", "wy", "x", "y")  # fmt: skip

    def __init__(
        self, ball: Ball, scale: Scale, surface: Surface, motion: Motion, roll: Vector, now: float
    ) -> None:
        self.scale = scale
        self.ball = ball
        self.place = self.part = 0  # among the members, and among the parts of its group
        self.mass = ball.mass
        self.pull = surface.pull
        self.drag = self.resistance = surface.drag
        self.rolls = surface.rolls
        self.x, self.y, self.vx, self.vy = motion
        self.wx, self.wy = roll
        self.own = None if type(surface) is Sliding or type(surface) is Rolling else surface
        self.px = self.py = self.qx = self.qy = 0.0
        self.slows = True
        self.phase = self.mode = SLIP if self.own is None else FREE
        self.held = -INF
        self.is_struck = False
        self.spared = 0.0
        self.ux = self.uy = 0.0  # m/s; the slip that hits without bounces would give
        self.share = 1.0  # of a step of a crowd, in which the surface acts
        self.glided = 0.0  # m/s; its slip or speed at the beginning of the piece
        self.gx, self.gy = 1.0, 0.0
        self.hx, self.hy = 1.0, 0.0
        self.fx = self.fy = self.cx = self.cy = 0.0
        self.ax = self.ay = self.bx = self.by = 0.0
        self.time = self.since = now  # s; of its state, and of the beginning of the piece
        self.start: State = self.state
        self.first: Rates = (0.0, 0.0, 0.0, 0.0)
        self.second: Rates = self.first
        self.third: Rates = self.first

    @property
    def motion(self) -> tuple[Motion, Vector]:
        """Place (m), velocity and roll (m/s) now."""
        return (self.x, self.y, self.vx, self.vy), (self.wx, self.wy)

    @property
    def state(self) -> State:
        """The place (m), the velocity and the roll (m/s)."""
        return self.x, self.y, self.vx, self.vy, self.wx, self.wy

    @property
    def rates(self) -> Rates:
        """The rates of velocity and roll (m/s^2)."""
        return self.ax, self.ay, self.bx, self.by

    @property
    def lightness(self) -> float:
        """The acceleration of the ball by a push of 1 N (1/kg)."""
        if self.mode == REST:
            return 0.0
        return (1.0 - SHARE if self.mode == ROLL else 1.0) / self.mass

    # -- slip and speed ----------------------------------------------------------------------------

    @property
    def gliding(self) -> Vector:
        """The slip (m/s), or the velocity of a ball that rolls; friction acts against it."""
        if self.phase == SLIP:
            return self.vx - self.wx, self.vy - self.wy
        return self.vx, self.vy

    def face(self) -> None:
        """Find the direction of friction; it does not turn back within a piece.

        What has nearly faded has no direction of its own: it stays that of the stage before.
        """
        if self.own is not None:
            self._ask(self.own)
        x, y = self.gliding
        size = math.sqrt(x * x + y * y)
        least = max(self.scale.faded, FADED * self.glided if self.phase == SLIP else 0.0)
        if size > least and x * self.gx + y * self.gy > 0.0:
            self.hx, self.hy = x / size, y / size

    def _ask(self, own: Surface) -> None:
        """Ask a surface of a user's own what it does to the ball as it moves now."""
        path = own.path(self.time, (self.x, self.y), (self.vx, self.vy), (self.wx, self.wy))
        self.px, self.py, self.slows = path.ax, path.ay, path.slows

    def begin(self) -> None:
        """Keep state and direction as those of the beginning of a piece."""
        x, y = self.gliding
        size = self.glided = math.sqrt(x * x + y * y)
        if size > self.scale.faded:
            self.gx, self.gy = x / size, y / size
        self.qx, self.qy = self.px, self.py
        self.start, self.since = self.state, self.time

    def go_back(self) -> None:
        """Let the state be that of the beginning of the piece again."""
        self.x, self.y, self.vx, self.vy, self.wx, self.wy = self.start
        self.time = self.since

    def left(self) -> float:
        """Return the slip or the speed (m/s) as it was directed, negative once it has turned back.

        It falls through 0 smoothly, which its size does not where it turns.
        """
        if self.phase == REST or not self.slows:
            return INF
        x, y = self.gliding
        return x * self.gx + y * self.gy

    def fades_in(self) -> float:
        """Return the time (s) in which slip or speed fade at the present rates."""
        if self.phase == REST or not self.slows:
            return INF
        x, y = self.gliding
        a, b = self.ax, self.ay
        if self.phase == SLIP:
            a, b = a - self.bx, b - self.by
        loss = -(x * a + y * b)
        return (x * x + y * y) / loss if loss > 0.0 else INF

    def settle(self) -> None:
        """Let a ball roll whose slip has faded, or rest whose speed has.

        What remains of a slip fades at once, and momentum is kept. Rolling resistance would not
        have acted until the slip had faded. It has acted too late if the slip has turned back.
        """
        if self.phase == SLIP and self.rolls:
            spared = self._spared()
            self.vx = self.wx = (1.0 - SHARE) * self.vx + SHARE * self.wx
            self.vy = self.wy = (1.0 - SHARE) * self.vy + SHARE * self.wy
            self.phase = self.mode = ROLL
            self.spare_drag(spared)
            if self.vx * self.vx + self.vy * self.vy > self.scale.creep * self.scale.creep:
                return
        self.vx = self.vy = self.wx = self.wy = 0.0
        self.phase = self.mode = REST

    def _spared(self) -> float:
        """Return how long (s) a slip u takes to fade, negative once it has turned back.

        Pushes D drive it: du/dt = D - L u / |u|, with the loss L = 7/2 pull.
        """
        (x, y), a, b = self.gliding, self.fx - self.cx, self.fy - self.cy
        loss = self.pull / SHARE
        spare = loss * loss - a * a - b * b
        return (loss * self.left() + a * x + b * y) / spare if spare > 0.0 else 0.0

    def spare_drag(self, time: float) -> None:
        """Spare a ball that rolls the resistance of a time (s); what is below 0 acts now."""
        if self.drag == 0.0:
            return
        self.spared += time
        speed = math.sqrt(self.vx * self.vx + self.vy * self.vy)
        if self.spared < 0.0 and speed > self.scale.faded:
            part = 1.0 + self.drag * self.spared / speed
            self.vx, self.vy = part * self.vx, part * self.vy
            self.wx, self.wy = self.vx, self.vy
        self.spared = max(self.spared, 0.0)

    def slacken(self, time: float) -> bool:
        """Let rolling resistance in a time (s) be less by what is spared; tell if that is new."""
        was = self.resistance
        self.resistance = self.drag * max(1.0 - self.spared / time, 0.0)
        return self.phase == ROLL and self.resistance != was

    def spend(self, time: float) -> None:
        """Count what rolling resistance has been spared in a time (s)."""
        if self.spared > 0.0 and self.phase == ROLL:
            left = self.spared - (1.0 - self.resistance / self.drag) * time
            self.spared = left if left > SPENT * time else 0.0

    # -- rates -------------------------------------------------------------------------------------

    def move(self) -> None:
        """Find the rates by the pushes, in this mode."""
        if self.mode == SLIP:
            x, y = self.pull * self.hx, self.pull * self.hy
            self.ax, self.ay = self.fx - x, self.fy - y
            if self.rolls:
                self.bx, self.by = self.cx + x / GYRATION, self.cy + y / GYRATION
        elif self.mode == FREE:
            self.ax, self.ay = self.fx + self.px, self.fy + self.py
            self.bx, self.by = self.cx, self.cy
        elif self.mode == ROLL:
            self.ax = self.bx = (
                (1.0 - SHARE) * self.fx + SHARE * self.cx - self.resistance * self.hx
            )
            self.ay = self.by = (
                (1.0 - SHARE) * self.fy + SHARE * self.cy - self.resistance * self.hy
            )
        else:
            self.ax = self.ay = self.bx = self.by = 0.0

    def kick(self, x: float, y: float, p: float, q: float) -> None:
        """Change the velocity and the roll by impulses (N s) in this mode."""
        if self.mode == REST:
            return
        self.is_struck = True
        m = self.mass
        if self.mode == ROLL:
            x, y = (1.0 - SHARE) * x + SHARE * p, (1.0 - SHARE) * y + SHARE * q
            p, q = x, y
        self.vx, self.vy = self.vx + x / m, self.vy + y / m
        self.wx, self.wy = self.wx + p / m, self.wy + q / m

    def slide(self, x: float, y: float) -> None:
        """Count the slip that impulses (N s) would give to a ball that rolls."""
        self.ux, self.uy = self.ux + x / self.mass, self.uy + y / self.mass

    def fade(self) -> None:
        """Spare a ball that rolls the resistance of the time in which such a slip u would fade.

        This is 2 |u| / (7 pull).
        """
        if self.phase == ROLL and self.drag > 0.0:
            self.spare_drag(SHARE * length_of(self.ux, self.uy) / self.pull)
        self.ux = self.uy = 0.0

    def shift(self, x: float, y: float) -> None:
        """Move the ball (m)."""
        self.x, self.y = self.x + x, self.y + y

    @property
    def drive(self) -> Vector:
        """The acceleration (m/s^2) that static friction has to hold."""
        if not self.rolls:
            return self.fx, self.fy
        if self.phase == ROLL:
            return SHARE * (self.fx - self.cx), SHARE * (self.fy - self.cy)
        k = 1.0 - SHARE
        return k * self.fx + SHARE * self.cx, k * self.fy + SHARE * self.cy

    def spare(self, now: float) -> float:
        """Return how much more (m/s^2) static friction could hold."""
        if self.phase >= SLIP or self.mode != self.phase or now < self.held:
            return INF
        x, y = self.drive
        most = self.drag if self.phase == REST and self.rolls else self.pull
        return most - math.sqrt(x * x + y * y)

    def hardly_moves(self, time: float) -> bool:
        """Tell whether the surface could stop the ball, or its slip, in a time (s), and hold it."""
        if self.phase == REST:
            return False
        a, b, loss = self.ax, self.ay, self.resistance if self.phase == ROLL else self.pull
        if self.phase == SLIP and self.rolls:
            a, b, loss = a - self.bx, b - self.by, loss / SHARE
        x, y = a + loss * self.hx, b + loss * self.hy
        return self.left() <= loss * time and x * x + y * y <= loss * loss

    def slips_on(self, time: float) -> bool:
        """Tell whether a slip has not faded in a time (s) as it must where friction could hold it.

        Pushes D drive it, and it loses L (as in ``_spared``): at least L - |D|, half of which shows
        that a piece could follow its direction.
        """
        _x, _y, vx, vy, wx, wy = self.start
        (x, y), (a, b, c, d), loss = self.gliding, self.first, self.pull / SHARE
        before = length_of(a - c + loss * self.gx, b - d + loss * self.gy)
        after = length_of(self.ax - self.bx + loss * self.hx, self.ay - self.by + loss * self.hy)
        spare = loss - max(before, after)
        return spare >= 0.0 and length_of(x, y) > length_of(vx - wx, vy - wy) - 0.5 * spare * time

    @property
    def stays(self) -> bool:
        """This tells whether a ball that rests has nothing but rounding after a piece."""
        most = abs(self.vx) + abs(self.vy) + abs(self.wx) + abs(self.wy)
        return self.ball.rested < INF and most <= self.scale.noise

    def hold(self, now: float) -> None:
        """Let static friction hold the ball as it is, or let it go along its drive."""
        self.mode = self.phase
        if self.spare(now) >= 0.0:
            self.face()
        else:
            x, y = self.drive
            size = math.sqrt(x * x + y * y)
            self.hx, self.hy = x / size, y / size
            if self.own is not None:
                self.mode = FREE
            else:
                self.mode = ROLL if self.phase == REST and self.rolls else SLIP

    # -- in a step of a crowd ----------------------------------------------------------------------

    @property
    def energy(self) -> float:
        """Twice its energy (J), with that of its height where it falls."""
        fall = 0.0 if self.slows else 2.0 * (self.px * self.x + self.py * self.y)
        return self.kinetic(self.state) - self.mass * fall

    def kinetic(self, state: State) -> float:
        """Return twice the kinetic energy (J) of a state."""
        _x, _y, vx, vy, wx, wy = state
        return self.mass * (vx * vx + vy * vy + GYRATION * (wx * wx + wy * wy))

    @property
    def fallen(self) -> float:
        """Twice the energy (J) that a ball has got by falling since the beginning of the piece."""
        if self.slows:
            return 0.0
        x, y, _vx, _vy, _wx, _wy = self.start
        px, py = self.px + self.qx, self.py + self.qy
        return self.mass * (px * (self.x - x) + py * (self.y - y))

    @property
    def stands(self) -> bool:
        """This tells whether the ball stood at the beginning of the piece, too."""
        _x, _y, vx, vy, wx, wy = self.start
        return vx == 0.0 and vy == 0.0 and wx == 0.0 and wy == 0.0

    def brake(self, h: float) -> None:
        """Find the mean rates of a step (s), in which the surface stops what it can.

        The impulse that stops a slip u is 2/7 u; what it leaves rolls, and drag slows that.
        """
        if not self.slows:
            self.phase = self.mode = FREE
            self.move()
            return
        x, y = self.vx + h * (self.fx + self.px), self.vy + h * (self.fy + self.py)
        p, q = self.wx + h * self.cx, self.wy + h * self.cy
        if self.own is not None:
            turns_back = x * self.vx + y * self.vy <= 0.0
            self.phase = REST if turns_back else FREE
            if turns_back:
                x = y = p = q = 0.0
            self._change_by(x, y, p, q, h)
            return
        most, self.phase = h * self.share * self.pull, ROLL
        if self.rolls:
            ux, uy = x - p, y - q
            slip = SHARE * math.sqrt(ux * ux + uy * uy)
            share = SHARE if slip <= most else SHARE * most / slip
            x, y = x - share * ux, y - share * uy
            p, q = p + share * ux / GYRATION, q + share * uy / GYRATION
            if slip <= most:
                most = h * self.share * self.drag
            else:
                most, self.phase = 0.0, SLIP
        speed = math.sqrt(x * x + y * y)
        if speed <= most:
            x = y = p = q = 0.0
            self.phase = REST
        elif most > 0.0:
            keeps = 1.0 - most / speed
            x, y = keeps * x, keeps * y
            if self.rolls:
                p, q = x, y
            else:
                self.phase = SLIP
        self._change_by(x, y, p, q, h)

    def _change_by(self, x: float, y: float, p: float, q: float, h: float) -> None:
        """Let the rates be those that lead to a velocity and a roll (m/s) in a time (s)."""
        self.ax, self.ay = (x - self.vx) / h, (y - self.vy) / h
        self.bx, self.by = (p - self.wx) / h, (q - self.wy) / h

    def land(self, h: float) -> None:
        """Go on for a step (s) at the velocity that it has after it."""
        self.vx, self.vy = self.vx + h * self.ax, self.vy + h * self.ay
        self.wx, self.wy = self.wx + h * self.bx, self.wy + h * self.by
        self.x, self.y = self.x + h * self.vx, self.y + h * self.vy
        self.time = self.since + h

    def advance(self, h: float, share: float, rates: Rates, mean: Rates) -> None:
        """Let the state be that ``share h`` (s) after the beginning.

        Velocities change by these rates, and places by the mean ones.
        """
        x, y, vx, vy, wx, wy = self.start
        ax, ay, bx, by = rates
        mx, my, _x, _y = mean
        s = share * h
        self.time = self.since + s
        self.x, self.y = x + s * (vx + s * mx / 2.0), y + s * (vy + s * my / 2.0)
        self.vx, self.vy = vx + s * ax, vy + s * ay
        self.wx, self.wy = wx + s * bx, wy + s * by
