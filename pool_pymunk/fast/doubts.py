"""This module finds what in a compiled shot may have no derivative: touches, and corners."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from pool_pymunk.fast.due import path_of, slows
from pool_pymunk.fast.records import Moving
from pool_pymunk.physics import saltation
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.saltation import BLUR, GRAZE, is_now

if TYPE_CHECKING:
    from pool_pymunk.fast.derivatives import Follow

# Limits are this many times as wide as those of `Changes`, which decides what lies within them: the
# two round differently. A wider limit leaves more shots to `Changes`, and is as safe.
CAREFUL = 4.0
UNCLEAR = CAREFUL * BLUR
# They find a time to 2**-40 of the path, and the distance, which is flat there, to its square.
# After 20 this square would be 1e-12, more than `UNCLEAR`; after 52 nothing changes any more.
HALVINGS = 40
NO_ONE = -(1 << 30)  # stands for neither a ball nor a wall


class Passing(NamedTuple):
    """Two discs pass each other for a ``time`` (s), and touch at the distance ``apart`` (m)."""

    offset: Vector
    velocity: Vector
    pull: Vector
    time: float
    apart: float
    size: float  # m; how large the numbers of the places are
    fastest: float  # m/s
    sign: float  # 1, or -1 if one disc is within the other


def largest(g: Follow, i: int) -> float:
    """Return the largest part of a ball's velocity (m/s)."""
    return float(max(abs(g.w.ball[i].vx), abs(g.w.ball[i].vy)))


def size_of(g: Follow, i: int) -> float:
    """Return how large (m) the numbers of a ball's place are."""
    return float(abs(g.w.ball[i].x) + abs(g.w.ball[i].y) + g.w.ball[i].radius)


def is_doubtful(g: Follow, t: float, met: int) -> bool:
    """Tell whether something else may come to the present balls just at ``t`` (s)."""
    i, j = g.balls[0], g.balls[1]
    if may_touch(g, i, t, met, NO_ONE):
        return True
    if met >= 0 and (may_touch(g, j, t, i, i) or may_coincide(g, j, i, t)):
        return True
    return met != NO_ONE and may_coincide(g, i, j, t)


def may_coincide(g: Follow, i: int, other: int, t: float) -> bool:
    """Tell whether ball ``i`` may start, rest, or have met another one just when it meets one."""
    ball, fastest, size = g.w.ball[i], largest(g, i), max(size_of(g, i), size_of(g, other))
    if fastest == 0.0:
        fastest = largest(g, other)
    is_new = g.at[i] > 0 and is_now(ball.t, t, fastest, size, UNCLEAR)
    moved = ball.vx != 0.0 or ball.vy != 0.0 or g.at[i] > 0
    rests = moved and is_now(ball.end, t, fastest, size, UNCLEAR)
    is_first = is_now(t, 0.0, fastest, size, UNCLEAR)
    return is_new or rests or is_first or is_now(t, g.w.scene.latest, fastest, size, UNCLEAR)


def may_be_at_corner(g: Follow, x: float, y: float, radius: float) -> bool:
    """Tell whether a ball may touch the table where a side and a corner join."""
    for k in range(len(g.corners)):
        c = g.corners[k]
        tangent, across = (c[2], c[3]), (c[4], c[5])
        if saltation.is_at_corner(x - c[0], y - c[1], radius, tangent, across):
            return True
    return False


def may_touch(g: Follow, i: int, t: float, met: int, done: int) -> bool:
    """Tell whether the path of ball ``i`` up to ``t`` (s) may touch what it does not hit.

    It ends where the ball has ``met`` something; ball ``done`` was looked at before.
    """
    ball = g.w.ball[i]
    if g.gone[i]:
        return False
    is_still = not moves_on(ball)
    if not is_still and ball.t < t and may_touch_table(g, i, t, met):
        return True
    for j in range(g.w.scene.balls):
        other = g.w.ball[j]
        since = max(ball.t, other.t)
        both_rest = is_still and not moves_on(other)
        if j in (i, done) or both_rest or g.gone[j] or since >= t:
            continue
        have_met = g.met[i] == j and g.met[j] == i and ball.t == other.t
        x, y, vx, vy = motion_at(path_of(ball), since)
        dx, dy, ux, uy = motion_at(path_of(other), since)
        fastest = max(abs(vx), abs(vy), max(abs(ux), abs(uy)))
        size = abs(x) + abs(y) + abs(dx) + abs(dy) + (t - since) * 4.0 * fastest
        offset, velocity, pull = (
            (dx - x, dy - y),
            (ux - vx, uy - vy),
            (other.ax - ball.ax, other.ay - ball.ay),
        )
        apart = ball.radius + other.radius
        passing = Passing(offset, velocity, pull, t - since, apart, size, fastest, 1.0)
        if are_tangent(passing, not have_met, met != j):
            return True
    return False


def moves_on(ball: Moving) -> bool:
    """Tell whether a ball moves on its path, or sets off."""
    return bool(ball.vx != 0.0 or ball.vy != 0.0 or ball.ax != 0.0 or ball.ay != 0.0)


def may_touch_table(g: Follow, i: int, t: float, met: int) -> bool:
    """Tell whether the path of a ball that moves may touch a corner, a rim or a face."""
    b, begun = g.w.ball[i], g.met[i]
    x, y, _, _ = motion_at(path_of(b), t)
    fastest = max(abs(b.vx), abs(b.vy))
    size = abs(b.x) + abs(b.y) + abs(x) + abs(y) + b.radius
    for k in range(len(g.discs)):
        d = g.discs[k]
        wall, apart = -1 - int(d[4]), d[2] + d[3] * b.radius
        offset, velocity, pull = (d[0] - b.x, d[1] - b.y), (-b.vx, -b.vy), (-b.ax, -b.ay)
        far, sign = size + abs(d[0]) + abs(d[1]), -1.0 if d[3] < 0.0 else 1.0
        passing = Passing(offset, velocity, pull, t - b.t, apart, far, fastest, sign)
        if are_tangent(passing, begun != wall, met != wall):
            return True
    blur = UNCLEAR * size
    for k in range(len(g.faces)):
        f = g.faces[k]
        wall, least = -1 - int(f[7]), CAREFUL * GRAZE * fastest
        goes_along = begun != wall and abs(b.vx * f[4] + b.vy * f[5]) <= least
        if goes_along and on_face(f, b.x, b.y, b.radius, blur):
            return True
        if met != wall and on_face(f, x, y, b.radius, blur):
            return True
        if not slows(b) and may_turn_at(f, b, t, blur):
            return True
    return False


def may_turn_at(f: Any, b: Moving, t: float, blur: float) -> bool:
    """Tell whether a path that bends may be tangent to a face before ``t`` (s)."""
    rate, pull = b.vx * f[4] + b.vy * f[5], b.ax * f[4] + b.ay * f[5]
    if rate >= 0.0 or pull <= 0.0 or b.t - rate / pull >= t:
        return False
    x, y, _, _ = motion_at(path_of(b), b.t - rate / pull)
    return on_face(f, x, y, b.radius, blur)


def on_face(f: Any, x: float, y: float, radius: float, blur: float) -> bool:
    """Tell whether a ball at this place touches a face, or nearly so."""
    dx, dy = x - f[0], y - f[1]
    foot = dx * f[2] + dy * f[3]
    is_beside = -blur <= foot and foot <= f[6] + blur
    return bool(is_beside and abs(dx * f[4] + dy * f[5] - radius) <= blur)


def are_tangent(p: Passing, begins: bool, ends: bool) -> bool:
    """Tell whether discs may touch as they pass each other, and not hit each other.

    Look at the beginning and at the end if they have not met there. In between, the relative path
    deviates from its chord by |a| T^2 / 8 at most.
    """
    (dx, dy), (vx, vy), (ax, ay), time = p.offset, p.velocity, p.pull, p.time
    ux, uy = vx + time * ax, vy + time * ay
    x, y = dx + time * (vx + ux) / 2.0, dy + time * (vy + uy) / 2.0
    blur = UNCLEAR * (p.size + p.apart)
    far, bow, is_outside = p.apart + blur, time * time / 8.0, p.sign > 0.0
    bow_x, bow_y = far + bow * abs(ax), far + bow * abs(ay)
    is_far = min(dx, x) > bow_x or max(dx, x) < -bow_x or min(dy, y) > bow_y or max(dy, y) < -bow_y
    if is_outside and is_far:
        return False
    first, last = math.sqrt(dx * dx + dy * dy), math.sqrt(x * x + y * y)
    rate, at_last = dx * vx + dy * vy, x * ux + y * uy
    is_at_first = abs(first - p.apart) <= blur and abs(rate) <= CAREFUL * GRAZE * p.fastest * first
    if (begins and is_at_first) or (ends and abs(last - p.apart) <= blur):
        return True
    slight = GRAZE * (abs(vx) + abs(vy) + abs(ux) + abs(uy))
    if p.sign * rate > slight * first or p.sign * at_last < -slight * last:
        return False
    cx, cy = x - dx, y - dy
    length = math.sqrt(cx * cx + cy * cy)
    if is_outside and abs(dx * cy - dy * cx) > far * length + bow * abs(ax * cy - ay * cx):
        return False
    return abs(turning_distance(p) - p.apart) <= blur


def turning_distance(p: Passing) -> float:
    """Return the least distance (m) of two paths that near and part, or the largest within one."""
    (dx, dy), (vx, vy), (ax, ay) = p.offset, p.velocity, p.pull
    near, part = 0.0, p.time
    for _ in range(HALVINGS):
        middle = 0.5 * (near + part)
        mx, my = dx + middle * (vx + middle * ax / 2.0), dy + middle * (vy + middle * ay / 2.0)
        if p.sign * (mx * (vx + middle * ax) + my * (vy + middle * ay)) > 0.0:
            part = middle
        else:
            near = middle
    mx, my = dx + part * (vx + part * ax / 2.0), dy + part * (vy + part * ay / 2.0)
    return math.sqrt(mx * mx + my * my)
