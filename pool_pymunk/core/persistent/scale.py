"""The scale of a table tells what is small: tiny speeds and times, for balls of any size."""

from __future__ import annotations

import math
from typing import Final, final

TOLERANCE: Final = 1e-7  # m; unless the user asks for another one
# The other numbers are shares of the speed and the time in which friction moves a ball by its
# radius. For a pool ball on cloth these are 0.24 m/s and 0.12 s.
NONE: Final = 4e-9
FADED: Final = 4e-10
CREEP: Final = 4e-8
NOISE: Final = 4e-12
FIRST: Final = 0.16
LEAST: Final = 8e-6
HUSHED: Final = 1.2  # tolerances in that time


@final
class Scale:
    """A scale has the tolerance (m) of contacts that persist, and what is small beside it.

    ``pull`` (m/s^2) is the surface's, and ``speed`` (m/s) is usual there. Where the surface has
    none, a usual speed says what ``pull`` is: one by which a ball of this ``radius`` (m) goes round
    a place at the distance of its radius (:func:`scale_of_speed`). A slip (m/s) that is not larger
    than ``none`` is none, and it has fallen to 0 by ``faded``. A ball slower than ``creep`` rests,
    if it was hit often of late. So much of the velocities of a group is ``noise``. Slower hits
    around groups than ``hushed`` (m/s) wait for a moment. The first piece that is tried has
    ``first`` (s), and none that is tried is shorter than ``least`` (s). In the time ``seen`` (s) a
    wrong mode moves a ball by the tolerance. Groups and their members ask it.
    """

    def __init__(self, tolerance: float, radius: float, pull: float) -> None:
        speed, time = math.sqrt(pull * radius), math.sqrt(radius / pull)
        self.tolerance = tolerance
        self.radius = radius
        self.speed = speed
        self.pull = pull
        self.none = NONE * speed
        self.faded = FADED * speed
        self.creep = CREEP * speed
        self.noise = NOISE * speed
        self.hushed = HUSHED * tolerance / time
        self.first = FIRST * time
        self.least = LEAST * time
        self.seen = math.sqrt(2.0 * tolerance / pull)


def scale_of_speed(tolerance: float, radius: float, speed: float) -> Scale:
    """Return the scale of a surface without friction, where balls are as fast as this (m/s).

    The speed is rounded up to a power of two, so that rounding does not change the scale. Where
    nothing moves, 1 m/s is usual.

    >>> scale_of_speed(1e-7, 0.03, 3.0).speed, scale_of_speed(1e-7, 0.03, 4.1).speed
    (4.0, 8.0)
    """
    _share, exponent = math.frexp(speed if 0.0 < speed < math.inf else 0.5)
    usual = math.ldexp(1.0, exponent)
    return Scale(tolerance, radius, usual * usual / radius)
