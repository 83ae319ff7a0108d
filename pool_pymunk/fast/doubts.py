"""This module finds where a run may have no derivative: at paths that touch, and at corners.

numba compiles its functions of numbers; :mod:`pool_pymunk.studies.touches` calls them, too.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pool_pymunk.fast.due import path_of
from pool_pymunk.model.scene import Scene
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, motion_at, sets_off, standing
from pool_pymunk.physics.saltation import BLUR, GRAZE, is_now
from pool_pymunk.physics.sides import Arc

if TYPE_CHECKING:
    from pool_pymunk.fast.derivatives import Follow

# Limits are this many times those of `Changes`, because the two round differently. What lies within
# a limit is left to `Changes`, so a wider limit costs time, and is as safe.
# tests/test_many_derivatives.py passes with half or twice of CAREFUL, LAST and EDGE, and fails with
# LAST or EDGE = 0.
CAREFUL = 4.0
UNCLEAR = CAREFUL * BLUR
# Halvings find the time of the least distance to 2**-40 of an interval, and this distance, which is
# flat there, to its square. After 20 that is 1e-12, above `UNCLEAR`; after 52 nothing changes.
HALVINGS = 40
NO_ONE = -(1 << 30)  # stands for neither a ball nor a wall
NEVER = -1.0  # s; no touch has this time
# The last velocity is that at this share of an interval before its end, where it may be zero.
LAST = 1e-9
NO_TOUCH = (False, NEVER)
EDGE = 1e-9  # of a radius; a ball that meets a cushion this near to its end may meet the corner


def around(scene: Scene) -> tuple[list[Any], list[Any], list[Any]]:
    """Return what balls may touch in a scene: discs at rest, faces, and corners.

    A disc has x, y, radius, the factor of a ball's radius (1, 0 at a rim, -1 within an arc), and
    the number of its wall; pockets come after the walls. A face has its start, tangent, normal,
    length and wall. A corner has its place, and the tangent and normal of one side there.
    """
    table, discs, faces, corners = scene.table, list[Any](), list[Any](), list[Any]()
    for k, post in enumerate(scene.posts, start=scene.first_post):
        discs.append((*post.position, post.radius, 1.0, k))
    for k, edge in enumerate(() if table is None else table.edges):
        assert table is not None
        last, side = table.edges[k - 1], edge.side
        if k in table.reflex_corners:
            discs.append((*edge.start, 0.0, 1.0, k))
        if k in table.reflex_corners or last.bulge or edge.bulge:
            for tx, ty in (last.heading(True), edge.heading(False)):
                corners.append((*edge.start, tx, ty, -ty, tx))
        if isinstance(side, Arc):
            discs.append((*side.center, side.radius, side.facing, k))
        else:
            faces.append((*edge.start, *edge.tangent, *edge.normal, edge.length, k))
    for k, hole in enumerate(scene.pockets, start=len(scene.cushions)):
        discs.append((*hole.position, hole.radius, 0.0, k))
    return discs, faces, corners


# -- in a compiled shot ----------------------------------------------------------------------------


def largest(g: Follow, i: int) -> float:
    """Return the largest part of a ball's velocity (m/s)."""
    return float(max(abs(g.w.ball[i].vx), abs(g.w.ball[i].vy)))


def size_of(g: Follow, i: int) -> float:
    """Return how large (m) the numbers of a ball's place are."""
    return float(abs(g.w.ball[i].x) + abs(g.w.ball[i].y) + g.w.ball[i].radius)


def is_doubtful(g: Follow, t: float, met: int) -> bool:
    """Tell whether the present balls may touch anything else by ``t`` (s), or turn just then."""
    i, j = g.balls[0], g.balls[1]
    if may_touch(g, i, t, met, NO_ONE):
        return True
    if met >= 0 and (may_touch(g, j, t, i, i) or may_coincide(g, j, i, t)):
        return True
    return met != NO_ONE and may_coincide(g, i, j, t)


def may_coincide(g: Follow, i: int, other: int, t: float) -> bool:
    """Tell whether the path of ball ``i``, or the shot, may begin or end just at ``t`` (s)."""
    ball, fastest, size = g.w.ball[i], largest(g, i), max(size_of(g, i), size_of(g, other))
    if fastest == 0.0:
        fastest = largest(g, other)
    is_new = g.at[i] > 0 and is_now(ball.t, t, fastest, size, UNCLEAR)
    moved = ball.vx != 0.0 or ball.vy != 0.0 or g.at[i] > 0
    rests = moved and is_now(ball.end, t, fastest, size, UNCLEAR)
    is_first = is_now(t, 0.0, fastest, size, UNCLEAR)
    return is_new or rests or is_first or is_now(t, g.w.scene.latest, fastest, size, UNCLEAR)


def may_touch(g: Follow, i: int, t: float, met: int, done: int) -> bool:
    """Tell whether the path of ball ``i`` up to ``t`` (s) may touch what it does not hit.

    The path ends where the ball has ``met`` something. Ball ``done`` was looked at before.
    """
    ball, path = g.w.ball[i], path_of(g.w.ball[i])
    if g.gone[i]:
        return False
    is_still = not sets_off(path)
    if not is_still and may_touch_table(g, i, t, met):
        return True
    for j in range(g.w.scene.balls):
        other = g.w.ball[j]
        if j in (i, done) or g.gone[j] or (is_still and not sets_off(path_of(other))):
            continue
        have_met = g.met[i] == j and g.met[j] == i and ball.t == other.t
        apart, ends = ball.radius + other.radius, met != j
        begins, other_path = not have_met, path_of(other)
        found = touch_of_discs(path, other_path, t, apart, 1.0, begins, ends, CAREFUL)
        if found != NO_TOUCH:
            return True
    return False


def may_touch_table(g: Follow, i: int, t: float, met: int) -> bool:
    """Tell whether the path of a ball that moves may touch a corner, a rim or a face."""
    path, radius, begun = path_of(g.w.ball[i]), g.w.ball[i].radius, g.met[i]
    for k in range(len(g.discs)):
        d = g.discs[k]
        wall, still = -1 - int(d[4]), standing(0.0, d[0], d[1])
        begins, ends, apart = begun != wall, met != wall, d[2] + d[3] * radius
        if touch_of_discs(path, still, t, apart, d[3], begins, ends, CAREFUL) != NO_TOUCH:
            return True
    for k in range(len(g.faces)):
        wall = -1 - int(g.faces[k][7])
        begins, ends = begun != wall, met != wall
        if touch_of_face(path, g.faces[k], t, radius, begins, ends, CAREFUL) != NO_TOUCH:
            return True
    return False


# -- of paths --------------------------------------------------------------------------------------


def may_be_at_corner(corners: Any, x: float, y: float, radius: float) -> bool:
    """Tell whether a ball may touch the table where a side and a corner join."""
    for k in range(len(corners)):
        c = corners[k]
        dx, dy = x - c[0], y - c[1]
        along, height = dx * c[2] + dy * c[3], dx * c[4] + dy * c[5]
        if abs(along) <= EDGE * radius and abs(height - radius) <= EDGE * radius:
            return True
    return False


def touch_of_face(
    path: Path, face: Any, until: float, radius: float, begins: bool, ends: bool, careful: float
) -> tuple[bool, float]:
    """Tell whether a ball goes along a face at first, and when (s) it turns back or ends there.

    The beginning counts if it ``begins`` without a contact, and the end if it ``ends`` without one.
    The limits are ``careful`` times those of rounding.
    """
    if path.t >= until:
        return NO_TOUCH
    x, y, _, _ = motion_at(path, until)
    blur = careful * BLUR * (abs(path.x) + abs(path.y) + abs(x) + abs(y) + radius)
    rate, pull = path.vx * face[4] + path.vy * face[5], path.ax * face[4] + path.ay * face[5]
    goes_along = abs(rate) <= careful * GRAZE * max(abs(path.vx), abs(path.vy))
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
    a: Path, b: Path, until: float, apart: float, facing: float, begins: bool, ends: bool,
    careful: float,
) -> tuple[bool, float]:  # fmt: skip
    """Tell how discs touch at the distance ``apart`` (m), as :func:`touch_of_face` does.

    If ``facing`` is negative, one disc is within the other. Between its ends, the relative path
    deviates from its chord by |a| T^2 / 8 at most.
    """
    since = max(a.t, b.t)
    if since >= until:
        return NO_TOUCH
    time, (own_x, own_y, own_u, own_v) = until - since, motion_at(a, since)
    its_x, its_y, its_u, its_v = motion_at(b, since)
    dx, dy, vx, vy, ax, ay = (
        its_x - own_x, its_y - own_y, its_u - own_u, its_v - own_v, b.ax - a.ax, b.ay - a.ay
    )  # fmt: skip
    fastest = max(max(abs(own_u), abs(own_v)), max(abs(its_u), abs(its_v)))
    size = abs(own_x) + abs(own_y) + abs(its_x) + abs(its_y) + 4.0 * time * fastest
    blur = careful * BLUR * (size + apart)
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
    goes_along = abs(rate) <= careful * GRAZE * fastest * first
    goes_along &= begins and abs(first - apart) <= blur
    slight = (careful - 1.0) * GRAZE * (abs(vx) + abs(vy) + abs(ux) + abs(uy))
    if sign * rate < slight * first and sign * at_last > -slight * last:
        cx, cy = x - dx, y - dy
        length = math.sqrt(cx * cx + cy * cy)
        bent = far * length + bow * abs(ax * cy - ay * cx)
        if sign < 0.0 or abs(dx * cy - dy * cx) <= bent:
            turns, distance = turning((dx, dy), (vx, vy), (ax, ay), time, sign)
            if abs(distance - apart) <= blur:
                return goes_along, since + turns
    return goes_along, until if ends and abs(last - apart) <= blur else NEVER


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
