"""This module finds when two balls on their paths meet.

A meeting depends on the two paths alone, whenever somebody asks for it. A bound without a square
root excludes many pairs that do not meet. Its margin is far above rounding, so it never excludes a
contact.
"""

from __future__ import annotations

import math

from pool_pymunk.physics.motion import Vector, path_to_disc, time_of_impact, time_to_slide
from pool_pymunk.physics.path import HAIR, NOISE, Path, motion_at, pull_of, speed_of, standing

# A path passes a ball by if its distance squared is this many times that of touching balls. A
# nearer one is looked at in full precision. Half or twice the excess over 1 gives the same ends.
FAR_OFF = 1.001
# Parting is sure if it is faster than this share of the balls' speeds. Rounding is some 1e-16 of
# them; with a larger share more pairs go on to the next bound.
PARTING = 1e-6


def pair_time(
    a: Path,
    b: Path,
    touching: float,
    since: float,
    until: float,
    noise: float = 0.0,
) -> float:
    """Return the time (s) at which two balls meet; infinite if they do not.

    Look between ``since`` and ``until`` (s). Balls meet when they are ``touching`` (m) apart, the
    sum of their radii. Each may stop before and rest. ``noise`` (m/s) is how much of the velocities
    may be rounding, beyond that of their numbers.
    """
    began = a.t if a.t > b.t else b.t
    since = since if since > began else began
    if stay_apart(a, b, touching, since, until):
        return math.inf
    t = _meeting(a, b, touching, began, until, noise)
    # A contact until now was none, or was played: only what closes from now on is another one.
    return t if t > since else _meeting(a, b, touching, since, until, noise)


def _meeting(a: Path, b: Path, touching: float, since: float, until: float, noise: float) -> float:
    """Return the time (s) at which two balls meet, not before ``since`` (s)."""
    first_end = a.end if a.end < b.end else b.end
    if since < first_end:
        t = _both_move(a, b, touching, since, min(until, first_end), noise)
        if t < math.inf:
            return t
    mover, rester = (a, b) if b.end <= a.end else (b, a)
    if rester.end > until or rester.end == math.inf or mover.end <= since or not rester.slows:
        return math.inf
    if mover.slows:
        t = _one_moves(mover, rester, touching)
        return t if since <= t <= until else math.inf
    x, y, _, _ = motion_at(rester, rester.end)
    at_rest, since = standing(rester.end, x, y), max(since, rester.end)
    return _both_move(mover, at_rest, touching, since, min(until, mover.end), noise)


def _one_moves(mover: Path, rester: Path, touching: float) -> float:
    """Return the time (s) at which the mover meets the other, which rests; infinite if never."""
    t, x, y, ux, uy, _, _, _, _, _, _ = mover
    rx, ry, vx, vy = rester.x, rester.y, ux, uy
    if rester.end > rester.t:
        rx, ry, _, _ = motion_at(rester, rester.end)
    if rester.end > t:
        t = rester.end
        x, y, vx, vy = motion_at(mover, t)
    dx, dy = rx - x, ry - y
    across, square = dx * uy - dy * ux, ux * ux + uy * uy
    if dx * ux + dy * uy <= 0.0 or across * across > FAR_OFF * touching * touching * square:
        return math.inf
    speed = math.sqrt(square)
    length = path_to_disc((dx, dy), (ux / speed, uy / speed), touching)
    if length == math.inf:
        return math.inf
    return t + time_to_slide(length, math.sqrt(vx * vx + vy * vy), pull_of(mover))


def _both_move(
    a: Path, b: Path, touching: float, since: float, until: float, noise: float
) -> float:
    offset, velocity, pull = _relative(a, b, since)
    noise += NOISE * (speed_of(a) + speed_of(b))
    return since + time_of_impact(offset, velocity, pull, touching, until - since, noise)


def _relative(a: Path, b: Path, t: float) -> tuple[Vector, Vector, Vector]:
    """Return offset (m), velocity and acceleration of b relative to a; both move at ``t`` (s)."""
    ax, ay, avx, avy = motion_at(a, t)
    bx, by, bvx, bvy = motion_at(b, t)
    return (bx - ax, by - ay), (bvx - avx, bvy - avy), (b.ax - a.ax, b.ay - a.ay)


# -- bounds ----------------------------------------------------------------------------------------


def stay_apart(a: Path, b: Path, touching: float, since: float, until: float) -> bool:
    """Tell whether balls of this sum of radii surely do not meet from ``since`` to ``until``."""
    if _rests(a, since):
        a, b = b, a
    if _rests(a, since):
        return True
    other, end, b_rests = b, a.end, _rests(b, since)
    if b_rests:
        x, y, _, _ = motion_at(b, b.end)
        if a.slows:
            return _passes(a, x, y, touching)
        other = standing(since, x, y)
    else:
        end = min(a.end, b.end)
    if not _keep_apart(a, other, touching, since, min(until, end)):
        return False
    mover, rester = (a, b) if b.end <= a.end else (b, a)
    # After a path that does not slow comes another, with its own predictions.
    if until < end or b_rests or not rester.slows:
        return True
    x, y, _, _ = motion_at(rester, end)
    return mover.slows and _passes(mover, x, y, touching)


def _rests(path: Path, since: float) -> bool:
    """Tell whether a ball rests from a time (s) on."""
    return path.slows and path.end <= since


def _passes(mover: Path, x: float, y: float, touching: float) -> bool:
    """Tell whether a ball that slows surely comes no nearer than ``touching`` (m) to a place."""
    dx, dy, vx, vy = x - mover.x, y - mover.y, mover.vx, mover.vy
    margin = HAIR * (abs(x) + abs(y) + abs(mover.x) + abs(mover.y) + touching)
    along, across, square = dx * vx + dy * vy, dx * vy - dy * vx, vx * vx + vy * vy
    far = touching + margin
    is_behind = along < 0.0 and along * along > margin * margin * square
    return is_behind or across * across > far * far * square


def _keep_apart(a: Path, b: Path, touching: float, since: float, until: float) -> bool:
    """Tell whether balls surely do not meet on two paths.

    They part if their relative velocity widens their first offset at start and end, and turns
    by 90 degrees at most. Else the offset leaves its chord by |a| T^2 / 8 at most.
    """
    time = until - since
    if not 0.0 < time < math.inf:
        return False
    x, y, vx, vy = motion_at(a, since)
    dx, dy, ux, uy = motion_at(b, since)
    dx, dy, vx, vy, ax, ay = dx - x, dy - y, ux - vx, uy - vy, b.ax - a.ax, b.ay - a.ay
    wx, wy = vx + time * ax, vy + time * ay  # the velocity at last
    least = PARTING * (abs(dx) + abs(dy)) * (abs(vx) + abs(vy) + abs(wx) + abs(wy))
    if dx * vx + dy * vy > least and dx * wx + dy * wy > least and vx * wx + vy * wy >= 0.0:
        return True
    cx, cy = time * (vx + time * ax / 2.0), time * (vy + time * ay / 2.0)  # the chord
    length, share = cx * cx + cy * cy, -(dx * cx + dy * cy)
    share = min(max(share / length, 0.0), 1.0) if length > 0.0 else 0.0
    nx, ny = dx + share * cx, dy + share * cy
    bow = time * time * math.sqrt(ax * ax + ay * ay) / 8.0
    size = abs(x) + abs(y) + abs(dx) + abs(dy) + time * (abs(vx) + abs(vy)) + touching
    within = touching + bow + HAIR * size
    return bool(nx * nx + ny * ny > within * within)
