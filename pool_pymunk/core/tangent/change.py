"""A change tells how the state of a ball depends on one input, to first order."""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.surface import GYRATION
from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.core.tangent.slopes import Nudge

# A derivative (SI) beyond this means nothing in floating-point numbers. It is near the root of the
# largest number, so a square of it, or its product with what one contact does, does not overflow.
MOST: Final = 1e150
# Rounding moves a place by less than this share of its coordinates.
BLUR: Final = 256.0 * EPSILON
# A contact that closes more slowly than this share of the speeds is a graze. It sinks in by half
# the square of it, 5e-13 radii, so rounding may decide whether it comes at all.
GRAZE: Final = 1e-6
SAME: Final = 1e-6  # Numbers that differ by less than this share are equal.
ROUNDED: Final = 64.0 * EPSILON  # of a unit of an input; rounding changes a gap by as much


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Rates:
    """These are the rates at which the state of a ball changes on its path at some time.

    They are the velocity (m/s), the acceleration and the rate of the roll (m/s^2).
    """

    def __init__(self, path: Path, vx: float, vy: float, rolls: bool) -> None:
        self.vx, self.vy = vx, vy
        self.ax, self.ay = path.ax, path.ay
        self.px = self.py = 0.0
        if rolls and path.slows:
            self.px, self.py = path.ax, path.ay
        elif rolls:
            self.px, self.py = -path.ax / GYRATION, -path.ay / GYRATION


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Change:
    """A change has the derivatives of place, velocity and roll by one input.

    They are those at the beginning of the ball's path, in m and m/s by the unit of the input.
    ``ever`` tells whether the input has ever changed the ball.

    >>> change = Change()
    >>> change.x = 1.0
    >>> change.is_zero, change.is_lost
    (False, False)
    """

    def __init__(self) -> None:
        self.x = self.y = self.vx = self.vy = self.wx = self.wy = 0.0
        self.ever = False

    def add(self, k: int, by: float) -> None:
        """Add to one of the six numbers: those of the place, of the velocity and of the roll."""
        if k == 0:
            self.x += by
        elif k == 1:
            self.y += by
        elif k == 2:
            self.vx += by
        elif k == 3:
            self.vy += by
        elif k == 4:
            self.wx += by
        else:
            self.wy += by

    def copy(self) -> Change:
        """Return another change with the same numbers."""
        other = Change()
        other.x, other.y, other.vx = self.x, self.y, self.vx
        other.vy, other.wx, other.wy = self.vy, self.wx, self.wy
        other.ever = self.ever
        return other

    @property
    def is_zero(self) -> bool:
        """This tells whether the input does not change the ball."""
        place = self.x == 0.0 and self.y == 0.0
        velocity = self.vx == 0.0 and self.vy == 0.0
        return place and velocity and self.wx == 0.0 and self.wy == 0.0

    @property
    def is_lost(self) -> bool:
        """This tells whether nothing is known of the change."""
        place = self.x != self.x and self.y != self.y
        velocity = self.vx != self.vx and self.vy != self.vy
        return place and velocity and self.wx != self.wx and self.wy != self.wy

    @property
    def is_beyond(self) -> bool:
        """This tells whether the change has grown so large that it means nothing."""
        place, velocity = abs(self.x) + abs(self.y), abs(self.vx) + abs(self.vy)
        return place + velocity + abs(self.wx) + abs(self.wy) > MOST

    def advance(self, rates: Rates, s: float) -> None:
        """Let the ball go on for ``s`` (by the unit of the input) at these rates."""
        self.x += s * rates.vx
        self.y += s * rates.vy
        self.vx += s * rates.ax
        self.vy += s * rates.ay
        self.wx += s * rates.px
        self.wy += s * rates.py

    def lose(self) -> None:
        """Let nothing be known of the change."""
        self.x = self.y = self.vx = self.vy = self.wx = self.wy = math.nan

    def stop(self) -> None:
        """Let the change of the velocity and of the roll vanish; what is unknown stays so."""
        self.vx *= 0.0
        self.vy *= 0.0
        self.wx *= 0.0
        self.wy *= 0.0

    def hold(self) -> None:
        """Let the whole change vanish; what is unknown stays so."""
        self.x *= 0.0
        self.y *= 0.0
        self.stop()

    def moves_across(self, radius: float, nx: float, ny: float) -> bool:
        """Tell whether it moves the ball across a face, whose normal this is, or away from it.

        ``radius`` is the change of the ball's radius.
        """
        if self.x != self.x:
            return True
        return (
            is_across(self.x, self.y, radius, nx, ny)
            or is_across(self.vx, self.vy, 0.0, nx, ny)
            or is_across(self.wx, self.wy, 0.0, nx, ny)
        )


def is_across(x: float, y: float, radius: float, nx: float, ny: float) -> bool:
    """Tell whether a vector has a part along a normal, beyond that of a changed radius."""
    return abs(nx * x + ny * y - radius) > SAME * (abs(x) + abs(y)) + ROUNDED


@final
class Column:
    """A column has what one contact, or another event, does by one input.

    The event comes ``late`` (s by the unit of the input), and its normal has turned by ``turn``
    (rad). ``by`` is what the law is asked with otherwise then. By rounding, the contact is found
    when the gap is wider by ``gap`` (m), and its normal errs by ``turned`` (rad).
    """

    def __init__(self) -> None:
        self.by: Final = Nudge()
        self.late = self.turn = 0.0
        self.gap = self.turned = 0.0
        self.is_bent = False
