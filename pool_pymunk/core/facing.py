"""Two sides face each other: their paths tell how fast they close, and what presses them on."""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.motion.path import Path
from pool_pymunk.core.motion.times import Vector, closing_acceleration, unit
from pool_pymunk.core.queue import Due

# This share of the accelerations may be rounding: what presses less does not press.
PRESSES: Final = 1e-10


@final
class Facing:
    """Two sides face each other: a ball on its path, and another one or a wall, as they move now.

    The normal points from the ball to the other one, or from the wall to the ball. ``bends`` (1/m)
    is the curvature of the wall. It moves at (``ux``, ``uy``), in m/s, where the ball is, with an
    angular velocity ``spins`` (rad/s), and ``lifts`` the ball (m/s^2).
    """

    def __init__(self, hit: Due, now: float) -> None:
        a, b, wall = hit.a, hit.b, hit.wall
        x, y, vx, vy = a.path.at(now)
        self.a = a
        self.b = b
        self.wall = wall
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
