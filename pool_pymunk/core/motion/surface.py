"""A surface says how balls move between contacts. A new kind of surface is one class."""

from __future__ import annotations

import math
from typing import Final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.motion.path import Path, sliding, standing
from pool_pymunk.core.motion.times import EPSILON, INF, Vector

GYRATION: Final = 2.0 / 5.0  # I / (m r^2) of a solid sphere
NO_ROLL: Vector = (0.0, 0.0)  # Compiled code cannot read a Final tuple of floats.
# of a cushion that a ball has hit: its normal, and mu |v_n' - v_n| (m/s)
Push = tuple[float, float, float]
# A slip of this share of the speeds is none: rounding leaves as much.
NO_SLIP: Final = 8.0 * EPSILON


@mypyc_attr(allow_interpreted_subclasses=True)
class Surface:
    """A surface gives a ball the path on which it sets off, and the path that follows.

    ``pull`` (m/s^2) is the largest acceleration of a ball, ``drag`` the deceleration of one that
    slows straight to rest. ``rolls`` tells whether balls have a roll (m/s): the velocity at which
    they would roll. The engine asks it whenever a ball sets off, and at the end of a path.
    """

    def __init__(self, pull: float, drag: float, rolls: bool) -> None:
        self.pull = pull
        self.drag = drag
        self.rolls = rolls

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        """Return the path of a ball that sets off at a time (s), or rests there."""
        raise NotImplementedError

    def then(self, path: Path) -> Path | None:
        """Return the path that follows at the end of one, or None if the ball rests there."""
        return None

    def roll(self, path: Path, t: float) -> Vector:
        """Return the roll (m/s) of a ball on its path at a time (s)."""
        return 0.0, 0.0

    def roll_after(self, path: Path, t: float, pushes: list[Push]) -> Vector:
        """Return the roll (m/s) of a ball at a time (s) after cushions have slowed it.

        The surface of the ball slips over the cushion up or down. Friction takes (5/2) mu
        |v_n' - v_n| off the part of the roll along the normal, which does not change its sign. Two
        cushions at once take no more energy than there is.
        """
        wx, wy = self.roll(path, t)
        wx, wy, dx, dy = wx + 0.0, wy + 0.0, 0.0, 0.0
        for nx, ny, slows in pushes:
            n = wx * nx + wy * ny
            less = -math.copysign(min(slows / GYRATION, abs(n)), n)
            dx, dy = dx + less * nx, dy + less * ny
        along, square = wx * dx + wy * dy, dx * dx + dy * dy
        share = min(1.0, -2.0 * along / square) if square > 0.0 else 0.0
        return wx + share * dx, wy + share * dy


class Sliding(Surface):
    """Balls slide straight on, and lose speed at ``pull`` (m/s^2) until they rest (Eq. 10).

    >>> Sliding(0.5).path(1.0, (0.0, 0.0), (2.0, 0.0), (0.0, 0.0)).at(5.0)
    (4.0, 0.0, 0.0, 0.0)
    """

    def __init__(self, pull: float) -> None:
        super().__init__(pull, pull, False)

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        return sliding(t, place, velocity, self.pull)


class Rolling(Surface):
    """Balls slide until they roll, and roll until they rest; they are solid spheres.

    ``pull`` and ``drag`` (m/s^2) are the decelerations of sliding and of rolling. With the velocity
    v and the roll w, the slip is u = v - w. While a ball slides, dv/dt = -pull u/|u| and
    dw/dt = +(5/2) pull u/|u|: the slip keeps its direction, and is 0 after 2 |u| / (7 pull). Then
    the ball rolls: w = v, and dv/dt = -drag v/|v|.

    A ball that slides at 7 m/s without roll rolls at 5 m/s:

    >>> surface = Rolling(2.0, 0.1)
    >>> slides = surface.path(0.0, (0.0, 0.0), (7.0, 0.0), (0.0, 0.0))
    >>> rolls = surface.then(slides)
    >>> rolls.t, rolls.x, rolls.vx, rolls.ax, rolls.end
    (1.0, 6.0, 5.0, -0.1, 51.0)
    """

    def __init__(self, pull: float, drag: float) -> None:
        super().__init__(pull, drag, True)

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
        x, y = place
        vx, vy = velocity
        wx, wy = roll
        ux, uy = vx - wx, vy - wy
        slip = math.sqrt(ux * ux + uy * uy)
        if slip <= NO_SLIP * (abs(vx) + abs(vy) + abs(wx) + abs(wy)):
            return self._rolling(t, place, velocity)
        if self.pull == 0.0:
            return Path(t, x, y, vx, vy, 0.0, 0.0, INF, False, wx, wy)
        share, time = self.pull / slip, 2.0 * slip / (7.0 * self.pull)
        return Path(t, x, y, vx, vy, -share * ux, -share * uy, t + time, False, wx, wy)

    def then(self, path: Path) -> Path | None:
        if path.slows:
            return None
        x, y, vx, vy = path.at(path.end)
        least = NO_SLIP * (abs(path.vx) + abs(path.vy) + abs(path.wx) + abs(path.wy))
        if abs(vx) + abs(vy) <= least:
            return standing(path.end, x, y)
        return self._rolling(path.end, (x, y), (vx, vy))

    def roll(self, path: Path, t: float) -> Vector:
        if path.slows:
            return path.velocity(t)
        time = min(t, path.end) - path.t
        return path.wx - time * path.ax / GYRATION, path.wy - time * path.ay / GYRATION

    def _rolling(self, t: float, place: Vector, velocity: Vector) -> Path:
        path = sliding(t, place, velocity, self.drag)
        path.wx, path.wy = velocity
        return path
