"""A disc moves by slices of time, as in the report's listing.

In each slice the listing turns a velocity into an angle and a speed, and back. The published ends
depend on the rounding of that. So the arithmetic here is the listing's, and ``hypot`` is Python's,
because a square root has other bits.
"""

from __future__ import annotations

import math
from math import cos, sin
from typing import Final, final

from pool_pymunk.core.motion.path import Motion
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import Vector

# k / (1 + k), k = GYRATION: this share of a slip is taken off the velocity until the ball rolls
SHARE: Final = 2.0 / 7.0


@final
class SlicedDisc:
    """A sliced disc has a place (m), a velocity and a roll (m/s), and moves by slices of time.

    The roll is the velocity at which it would roll; it stays 0 where balls only slide. ``slide``,
    ``slip`` and ``roll_on`` move the disc by a number of ``slices`` of ``dt`` (s), or until it does
    something else, and return how many slices it took. The solver ``time-slice`` asks it for that,
    and changes its velocity where it meets something.

    With 1 m/s and a loss of 0.25 m/s in a slice it rests after four slices of 1 s, 2 m away:

    >>> disc = SlicedDisc(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    >>> disc.slide(0.25, 1.0, slices=9), disc.motion, disc.moves
    (4, (2.0, 0.0, 0.0, 0.0), False)
    """

    def __init__(self, x: float, y: float, vx: float, vy: float, wx: float, wy: float) -> None:
        self.x, self.y = x, y
        self.vx, self.vy = vx, vy
        self.wx, self.wy = wx, wy

    @property
    def motion(self) -> Motion:
        """The place (m) and the velocity (m/s)."""
        return self.x, self.y, self.vx, self.vy

    @property
    def place(self) -> Vector:
        """The place (m)."""
        return self.x, self.y

    @property
    def velocity(self) -> Vector:
        """The velocity (m/s)."""
        return self.vx, self.vy

    @property
    def roll(self) -> Vector:
        """The roll (m/s)."""
        return self.wx, self.wy

    @property
    def moves(self) -> bool:
        """This tells whether it moves, or will set off because it has a roll."""
        return self.vx != 0.0 or self.vy != 0.0 or self.wx != 0.0 or self.wy != 0.0

    @property
    def slips(self) -> bool:
        """This tells whether its velocity is not its roll."""
        return self.vx != self.wx or self.vy != self.wy

    def rest(self) -> None:
        """Come to rest in this place."""
        self.vx = self.vy = self.wx = self.wy = 0.0

    def slide(self, loss: float, dt: float, slices: int) -> int:
        """Slide by slices of Eq. 10, or to rest; a slice takes ``loss`` (m/s) off the speed."""
        if not loss > 0.0:
            return self._drift(dt, slices)
        x, y, vx, vy = self.x, self.y, self.vx, self.vy
        # Names of the function itself are found faster: a compiled slice takes 0.88 of the time.
        atan2, hypot = math.atan2, math.hypot
        for used in range(1, slices + 1):
            angle = atan2(vy, vx)
            old = hypot(vx, vy)
            new = old - loss
            if new < 0.0:
                new = 0.0
            c = cos(angle)
            s = sin(angle)
            x += c * (old + new) / 2 * dt
            y += s * (old + new) / 2 * dt
            vx = c * new
            vy = s * new
            if new == 0.0:
                self.x, self.y = x, y
                self.rest()
                return used
        self.x, self.y, self.vx, self.vy = x, y, vx, vy
        return slices

    def roll_on(self, loss: float, dt: float, slices: int) -> int:
        """Roll by slices, or to rest; the roll stays the velocity."""
        used = self.slide(loss, dt, slices)
        self.wx, self.wy = self.vx, self.vy
        return used

    def slip(self, loss: float, dt: float, slices: int) -> int:
        """Slip by slices, or until it rolls.

        A slice takes ``loss`` (m/s) off the velocity along the slip, and adds 5/2 of that to the
        roll. The slice that would reverse the slip ends it.
        """
        if not loss > 0.0:
            return self._drift(dt, slices)
        x, y, vx, vy, wx, wy = self.x, self.y, self.vx, self.vy, self.wx, self.wy
        hypot = math.hypot
        for used in range(1, slices + 1):
            ux = vx - wx
            uy = vy - wy
            share = min(loss / hypot(ux, uy), SHARE)
            x += (vx - share * ux / 2) * dt
            y += (vy - share * uy / 2) * dt
            vx -= share * ux
            vy -= share * uy
            if share == SHARE:
                self.x, self.y, self.vx, self.vy, self.wx, self.wy = x, y, vx, vy, vx, vy
                return used
            wx += share * ux / GYRATION
            wy += share * uy / GYRATION
        self.x, self.y, self.vx, self.vy, self.wx, self.wy = x, y, vx, vy, wx, wy
        return slices

    def _drift(self, dt: float, slices: int) -> int:
        """Move by slices without friction, in which no velocity changes."""
        x, y, vx, vy = self.x, self.y, self.vx, self.vy
        for _slice in range(slices):  # Compiled, a plain `_` is an object, and four times as slow.
            x += vx * dt
            y += vy * dt
        self.x, self.y = x, y
        return slices
