"""Contacts that persist are a mode of motion: a normal force N >= 0 keeps their gaps closed.

Surface friction, a roll or an arc may press two sides together. The law's hits would then come ever
more often; what they tend to is a contact that persists.
"""

from __future__ import annotations

from pool_pymunk.physics.motion import Vector, closing_acceleration
from pool_pymunk.physics.path import Path, motion_at, pull_of

Four = tuple[float, float, float, float]
# radii; a contact persists once its bounces to come would move the two sides apart by less in all.
UNSEEN = 1e-10
# This share of the accelerations may be rounding: what presses less does not press.
PRESSES = 1e-10


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


def pressing_of_balls(a: Path, b: Path, t: float) -> float:
    """Return how strongly (m/s^2) two touching balls are pressed together; 0 if it is rounding."""
    (ax, ay, au, av), (bx, by, bu, bv) = motion_at(a, t), motion_at(b, t)
    (px, py), (qx, qy) = pull_at(a, t), pull_at(b, t)
    pull = closing_acceleration((bx - ax, by - ay), (bu - au, bv - av), (qx - px, qy - py))
    return pull if pull > PRESSES * (pull_of(a) + pull_of(b)) else 0.0


def pressing_of_wall(path: Path, normal: Vector, curvature: float, moves: Four, t: float) -> float:
    """Return how strongly (m/s^2) a wall is pressed on by a ball that touches it; 0 if rounding.

    The wall ``moves`` evenly: with a velocity (m/s) where the ball is and an angular velocity
    (rad/s), by which a centrifugal acceleration (m/s^2) lifts the ball off the wall.
    """
    (_, _, vx, vy), (nx, ny) = motion_at(path, t), normal
    ux, uy, spins, lifts = moves
    along = (vy - uy) * nx - (vx - ux) * ny
    (ax, ay), turning = pull_at(path, t), curvature * along * along
    turning += 2.0 * spins * along + lifts
    press = -(ax * nx + ay * ny) - turning
    return press if press > PRESSES * (pull_of(path) + abs(turning)) else 0.0


def pull_at(path: Path, t: float) -> Vector:
    """Return the acceleration (m/s^2) on a path at a time (s): none once the ball rests."""
    return (0.0, 0.0) if path.slows and t >= path.end else (path.ax, path.ay)
