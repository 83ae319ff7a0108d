"""This module finds when two balls on their paths meet.

A meeting depends on the two paths alone, whenever somebody asks for it. Bounds without a square
root rule most pairs out first. Their margin is far above rounding, so no contact is ruled out.
"""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.motion.path import FAR_OFF, NOISE, Path, standing
from pool_pymunk.core.motion.times import INF, path_to_disc, time_of_impact, time_to_slide

# Parting is sure if it is faster than this share of the balls' speeds. Rounding is some 1e-16 of
# them; with a larger share more pairs go on to the next bound.
PARTING: Final = 1e-6
HAIR: Final = 1e-9  # of coordinates; bounds have this margin, far above rounding


def pair_time(a: Path, b: Path, touching: float, since: float, until: float, noise: float) -> float:
    """Return the time (s) at which two balls meet; infinite if they do not.

    Look between ``since`` and ``until`` (s). Balls meet when they are ``touching`` (m) apart, the
    sum of their radii. Each may stop before and rest. ``noise`` (m/s) is how much of the velocities
    may be rounding, beyond that of their numbers.

    >>> from pool_pymunk.core.motion.path import sliding
    >>> a = sliding(0.0, (0.0, 0.0), (2.0, 0.0), 0.5)
    >>> pair_time(a, standing(0.0, 1.8125, 0.0), 0.0625, 0.0, INF, 0.0)
    1.0
    """
    began = max(a.t, b.t)
    since = max(since, began)
    if a.slows and b.slows and (a.end <= began or b.end <= began):
        return _meeting_of_rester(a, b, touching, since, until)
    if stay_apart(a, b, touching, since, until):
        return INF
    t = _meeting(a, b, touching, began, until, noise)
    # A contact until now was none, or was played: only what closes from now on is another one.
    return t if t > since else _meeting(a, b, touching, since, until, noise)


def _meeting(a: Path, b: Path, touching: float, since: float, until: float, noise: float) -> float:
    """Return the time (s) at which two balls meet, not before ``since`` (s)."""
    first_end = min(a.end, b.end)
    if since < first_end:
        t = _both_move(a, b, touching, since, min(until, first_end), noise)
        if t < INF:
            return t
    mover, rester = (a, b) if b.end <= a.end else (b, a)
    if rester.end > until or rester.end == INF or mover.end <= since or not rester.slows:
        return INF
    if mover.slows:
        return _meeting_of_rester(a, b, touching, since, until)
    x, y = rester.place(rester.end)
    at_rest = standing(rester.end, x, y)
    since = max(since, rester.end)
    return _both_move(mover, at_rest, touching, since, min(until, mover.end), noise)


def _meeting_of_rester(a: Path, b: Path, touching: float, since: float, until: float) -> float:
    """Return the time (s) at which a ball that slows meets one that rests; infinite if never."""
    mover, rester = (a, b) if b.end <= a.end else (b, a)
    t = _one_moves(mover, rester, touching) if mover.end > since else INF
    return t if since <= t <= until else INF


def _one_moves(mover: Path, rester: Path, touching: float) -> float:
    """Return the time (s) at which the mover meets the other, which rests; infinite if never."""
    t, x, y, ux, uy = mover.t, mover.x, mover.y, mover.vx, mover.vy
    rx, ry, vx, vy = rester.x, rester.y, ux, uy
    if rester.end > rester.t:
        rx, ry = rester.place(rester.end)
    if rester.end > t:
        t = rester.end
        x, y, vx, vy = mover.at(t)
    dx, dy = rx - x, ry - y
    across, square = dx * uy - dy * ux, ux * ux + uy * uy
    if dx * ux + dy * uy <= 0.0 or across * across > FAR_OFF * touching * touching * square:
        return INF
    speed = math.sqrt(square)
    length = path_to_disc((dx, dy), (ux / speed, uy / speed), touching)
    if length == INF:
        return INF
    return t + time_to_slide(length, math.sqrt(vx * vx + vy * vy), mover.pull)


def _both_move(
    a: Path, b: Path, touching: float, since: float, until: float, noise: float
) -> float:
    """Return the time (s) at which two balls meet that both move; infinite if they do not."""
    ax, ay, avx, avy = a.at(since)
    bx, by, bvx, bvy = b.at(since)
    noise += NOISE * (a.speed + b.speed)
    offset, velocity, pull = (bx - ax, by - ay), (bvx - avx, bvy - avy), (b.ax - a.ax, b.ay - a.ay)
    return since + time_of_impact(offset, velocity, pull, touching, until - since, noise)


# -- bounds ----------------------------------------------------------------------------------------


def stay_apart(a: Path, b: Path, touching: float, since: float, until: float) -> bool:
    """Tell whether two balls surely do not meet between two times (s)."""
    if _rests(b, since):
        return _rests(a, since) or _stays_off(a, b, touching, since, until)
    if _rests(a, since):
        return _stays_off(b, a, touching, since, until)
    end = min(a.end, b.end)
    if not _keep_apart(a, b, touching, since, min(until, end)):
        return False
    mover, rester = (a, b) if b.end <= a.end else (b, a)
    # After a path that does not slow comes another, with its own predictions.
    if until < end or not rester.slows:
        return True
    x, y = rester.place(end)
    return mover.slows and _passes(mover, x, y, touching)


def _stays_off(mover: Path, rester: Path, touching: float, since: float, until: float) -> bool:
    """Tell whether a ball surely does not meet one that rests, between two times (s)."""
    x, y = rester.place(rester.end)
    if mover.slows:
        return _passes(mover, x, y, touching)
    at_rest = standing(since, x, y)
    return _keep_apart(mover, at_rest, touching, since, min(until, mover.end))


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

    They part if their relative velocity widens their first offset at start and end, and turns by 90
    degrees at most. Else the offset leaves its chord by |a| T^2 / 8 at most.
    """
    time = until - since
    if not 0.0 < time < INF:
        return False
    x, y, vx, vy = a.at(since)
    dx, dy, ux, uy = b.at(since)
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
    return nx * nx + ny * ny > within * within
