"""This module finds where a path touches something, to rounding, without a contact.

A path may be tangent to a ball, a corner, an arc or the rim of a pocket. It may run along a
cushion, or end just where it touches.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.saltation import BLUR, GRAZE
from pool_pymunk.physics.sides import within_sector

# Halvings find the time of the least distance to 2**-40 of an interval, and this distance, which is
# flat there, to its square. After 20 that is 1e-12, near rounding; after 52 nothing changes.
HALVINGS = 40
NEVER = -1.0  # s; no touch has this time
# The last velocity is that at this share of an interval before its end, where it may be zero.
LAST = 1e-9
NO_TOUCH = (False, NEVER)
EDGE = 1e-9  # of a radius; a ball that meets a cushion this near to its end may meet the corner


def is_beside(disc: Any, x: float, y: float) -> bool:
    """Tell whether a ball is within the sector of an arc; True for any other disc."""
    first, last = (disc[5], disc[6]), (disc[7], disc[8])
    is_whole = disc[5] == 0.0 and disc[6] == 0.0
    return is_whole or within_sector(x - disc[0], y - disc[1], first, last)


def is_at_corner(corners: Any, x: float, y: float, radius: float) -> bool:
    """Tell whether a ball may touch the table where a side and a corner join."""
    for k in range(len(corners)):
        c = corners[k]
        dx, dy = x - c[0], y - c[1]
        along, height = dx * c[2] + dy * c[3], dx * c[4] + dy * c[5]
        if abs(along) <= EDGE * radius and abs(height - radius) <= EDGE * radius:
            return True
    return False


def touch_of_face(
    path: Path, face: Any, until: float, radius: float, free: tuple[bool, bool]
) -> tuple[bool, float]:
    """Tell whether a ball goes along a face at first, and when (s) it turns back or ends there.

    The beginning counts if it is ``free`` of a contact, and so does the end.
    """
    if path.t >= until:
        return NO_TOUCH
    (begins, ends), (x, y, _, _) = free, motion_at(path, until)
    blur = BLUR * (abs(path.x) + abs(path.y) + abs(x) + abs(y) + radius)
    rate, pull = path.vx * face[4] + path.vy * face[5], path.ax * face[4] + path.ay * face[5]
    goes_along = abs(rate) <= GRAZE * max(abs(path.vx), abs(path.vy))
    goes_along &= begins and is_on_face(face, path.x, path.y, radius, blur)
    if rate < 0.0 and pull > 0.0 and path.t - rate / pull < until and bends(path):
        turns = path.t - rate / pull
        turn_x, turn_y, _, _ = motion_at(path, turns)
        if is_on_face(face, turn_x, turn_y, radius, blur):
            return goes_along, turns
    return goes_along, until if ends and is_on_face(face, x, y, radius, blur) else NEVER


def bends(path: Path) -> bool:
    """Tell whether a path is curved, as that of a ball which slides before it rolls may be."""
    left, right = path.vx * path.ay, path.vy * path.ax
    return abs(left - right) > BLUR * (abs(left) + abs(right))


def is_on_face(f: Any, x: float, y: float, radius: float, blur: float) -> bool:
    """Tell whether a ball at this place touches a face, or nearly so."""
    dx, dy = x - f[0], y - f[1]
    foot = dx * f[2] + dy * f[3]
    is_beside = -blur <= foot and foot <= f[6] + blur
    return bool(is_beside and abs(dx * f[4] + dy * f[5] - radius) <= blur)


def touch_of_discs(
    a: Path, b: Path, until: float, apart: float, facing: float, free: tuple[bool, bool]
) -> tuple[bool, float]:
    """Tell how discs touch at the distance ``apart`` (m), as :func:`touch_of_face` does.

    If ``facing`` is negative, one disc is within the other. Between its ends, the relative path
    deviates from its chord by |a| T^2 / 8 at most.
    """
    since, (begins, ends) = max(a.t, b.t), free
    if since >= until:
        return NO_TOUCH
    time, (own_x, own_y, own_u, own_v) = until - since, motion_at(a, since)
    its_x, its_y, its_u, its_v = motion_at(b, since)
    dx, dy, vx, vy, ax, ay = (
        its_x - own_x, its_y - own_y, its_u - own_u, its_v - own_v, b.ax - a.ax, b.ay - a.ay
    )  # fmt: skip
    fastest = max(max(abs(own_u), abs(own_v)), max(abs(its_u), abs(its_v)))
    size = abs(own_x) + abs(own_y) + abs(its_x) + abs(its_y) + 4.0 * time * fastest
    blur = BLUR * (size + apart)
    ux, uy = vx + time * ax, vy + time * ay
    x, y = dx + time * (vx + ux) / 2.0, dy + time * (vy + uy) / 2.0
    far, bow, sign = apart + blur, time * time / 8.0, -1.0 if facing < 0.0 else 1.0
    bow_x, bow_y = far + bow * abs(ax), far + bow * abs(ay)
    is_far = min(dx, x) > bow_x or max(dx, x) < -bow_x or min(dy, y) > bow_y or max(dy, y) < -bow_y
    if sign > 0.0 and is_far:
        return NO_TOUCH
    first, last = math.sqrt(dx * dx + dy * dy), math.sqrt(x * x + y * y)
    late = (1.0 - LAST) * time
    rate, at_last = dx * vx + dy * vy, x * (vx + late * ax) + y * (vy + late * ay)
    cx, cy = x - dx, y - dy
    is_still = abs(rate) <= GRAZE * fastest * first
    goes_along = is_still and begins and abs(first - apart) <= blur
    # Discs that have just met may seem to approach, by rounding.
    if sign * rate < 0.0 and sign * at_last > 0.0 and (begins or not is_still):
        length = math.sqrt(cx * cx + cy * cy)
        bent = far * length + bow * abs(ax * cy - ay * cx)
        if sign < 0.0 or abs(dx * cy - dy * cx) <= bent:
            turns, distance = turning((dx, dy), (vx, vy), (ax, ay), time, sign)
            if abs(distance - apart) <= blur:
                return goes_along, since + turns
    # Discs that have just met may never be seen to part.
    is_bent = bow * abs(ax * cy - ay * cx) > blur * max(abs(cx), abs(cy))
    stay = not begins and abs(first - apart) <= blur and not is_bent
    return goes_along, until if ends and not stay and abs(last - apart) <= blur else NEVER


def turning(
    offset: Vector, velocity: Vector, pull: Vector, time: float, sign: float
) -> tuple[float, float]:
    """Return when (s) discs cease to approach, or with ``sign`` -1 to part, and how far apart."""
    (dx, dy), (vx, vy), (ax, ay) = offset, velocity, pull
    near, part = 0.0, time
    for _ in range(HALVINGS):
        middle = 0.5 * (near + part)
        mx, my = dx + middle * (vx + middle * ax / 2.0), dy + middle * (vy + middle * ay / 2.0)
        if sign * (mx * (vx + middle * ax) + my * (vy + middle * ay)) > 0.0:
            part = middle
        else:
            near = middle
    mx, my = dx + part * (vx + part * ax / 2.0), dy + part * (vy + part * ay / 2.0)
    return part, math.sqrt(mx * mx + my * my)
