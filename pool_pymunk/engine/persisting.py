"""This module tells which contacts persist: it is asked before a hit, and after it.

Two sides stay in contact if nothing that they still do by themselves is to be seen. What presses
them is that of their exact paths. The groups that they join are those of
:mod:`pool_pymunk.engine.groups`.
"""

from __future__ import annotations

import math
from itertools import accumulate
from operator import mul
from typing import Any

from pool_pymunk.engine.asked import (
    coefficients,
    facing,
    follower,
    gap_between,
    has_room_to_wait,
    is_closed,
    is_pocket,
    motion,
    noise_of,
    path_of,
    pull_of,
    push_piece,
    push_press,
    radius_of,
    rolls,
    sweep,
)
from pool_pymunk.engine.groups import NONE, contact_of, find_state, wait_of
from pool_pymunk.physics.contact import relative
from pool_pymunk.physics.forces import find_forces
from pool_pymunk.physics.path import Path, motion_at
from pool_pymunk.physics.persistent import (
    UNSEEN,
    Four,
    persists,
    pressing_of_balls,
    pressing_of_wall,
)
from pool_pymunk.physics.pieces import DEVIATION
from pool_pymunk.physics.pressed import NEAR, REST

STILL = 1e-10  # of a speed that friction gives within a radius: slower sides do not part or close
# Once a ball has had more than FEW hits, each less than AGO (s) after the one before, each further
# one lets GROWTH times as much go unseen, for MOST hits at most.
GROWTH, FEW, MOST, AGO = 1.3, 30, 50, 0.05
WEAR = tuple(accumulate([GROWTH] * MOST, mul, initial=1.0))
SHORTLY = 1e-3  # of the time from its beginning to a hit; a piece is cut so much before it


def takes(w: Any, sides: Any, i: int, other: int, t: float) -> bool:
    """Tell whether a hit at ``t`` (s) is no hit: a contact persists, or is predicted later."""
    k = contact_of(w.groups, i, other)
    if k != NONE and (w.groups.on[k] or is_idle(w, sides, i, other)):
        return True
    m = wait_of(w.groups, i, other)
    if m != NONE and w.groups.until[m] > max(t, w.now):  # A later hit comes after the wait.
        left = w.groups.until[m] - w.now
        if closing_of(w, sides, i, other) * left <= DEVIATION * least_radius(w, i, other):
            push_press(w, i, w.groups.until[m])
            return True
    if look_at(w, sides, i, other) or cuts(w, i, other, t):
        return True
    if t > w.now or not rubs(w, sides, i, other):
        return False
    if other < 0 and facing(w, sides, i, other)[2] < 0.0:  # A path leads out of an arc later.
        wait(w, i, other)
    return True


def wait(w: Any, i: int, other: int) -> None:
    """Let a contact have no force for a moment, in which no ball sinks in to be seen.

    Each time the moment is twice as long, because what presses so weakly hardly moves a ball.
    """
    r, m = w.groups, wait_of(w.groups, i, other)
    if m == NONE:
        m = new_wait(w)
        r.wait[m][0], r.wait[m][1], r.until[m], r.ended[m] = i, other, -math.inf, -math.inf
    if r.until[m] > w.now:
        return
    first = math.sqrt(2.0 * DEVIATION * least_radius(w, i, other) / max(pull_of(w), 1.0))
    ended = max(r.until[m], r.ended[m])
    r.length[m] = first if ended == -math.inf or ended < w.now - r.length[m] else 2.0 * r.length[m]
    r.until[m] = w.now + r.length[m]
    push_press(w, i, r.until[m])


def new_wait(w: Any) -> int:
    """Return the number of a new wait; it takes that of the oldest one if there is no room."""
    r = w.groups
    if has_room_to_wait(w):
        r.waits += 1
        return int(r.waits - 1)
    oldest = 0
    for m in range(r.waits):
        if max(r.until[m], r.ended[m]) < max(r.until[oldest], r.ended[oldest]):
            oldest = m
    return oldest


def look_at(w: Any, sides: Any, i: int, other: int) -> bool:
    """Look whether two sides touch that persist from now on: a group begins at this instant."""
    if is_pocket(w, sides, other) or not is_closed(w, sides, i, other):
        return False
    if persists_now(w, sides, i, other):
        push_press(w, i, w.now)
        return True
    return False


def persists_now(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides are in persistent contact from now on, by their present paths."""
    parting, noise = -closing_of(w, sides, i, other), noise_between(w, i, other)
    if parting < -noise:
        return False
    return stays_after(w, sides, i, other, parting if parting > noise else 0.0)


def closing_of(w: Any, sides: Any, i: int, other: int) -> float:
    """Return how fast (m/s) two sides close now."""
    nx, ny, _ = facing(w, sides, i, other)
    _, _, vx, vy = motion(w, i)
    if other < 0:
        ux, uy, _, _ = sweep(w, sides, i, other)
        vx, vy = relative((vx, vy), (ux, uy))
        return -(vx * nx + vy * ny)
    _, _, ux, uy = motion(w, other)
    return vx * nx + vy * ny - (ux * nx + uy * ny)


def noise_between(w: Any, i: int, other: int) -> float:
    """Return how much of the velocities in a contact (m/s) may be rounding."""
    return max(noise_of(w, i), noise_of(w, other)) if other >= 0 else noise_of(w, i)


def least_radius(w: Any, i: int, other: int) -> float:
    """Return the smaller radius (m) in a contact."""
    return min(radius_of(w, i), radius_of(w, other)) if other >= 0 else radius_of(w, i)


def stays_after(w: Any, sides: Any, i: int, other: int, parting: float) -> bool:
    """Tell whether two sides that part at this speed (m/s) stay in contact, to the eye.

    What presses them now presses them at the end of a slip, too, if it ends before the bounces. The
    restitution is asked for only where it matters.
    """
    nx, ny, bends = facing(w, sides, i, other)
    a, b = tangent_of(w, i), tangent_of(w, other if other >= 0 else i)
    radius = least_radius(w, i, other) * wear(w, i, other)
    face, moves = (nx, ny, bends), sweep(w, sides, i, other)
    pressing = pressing_of(a, b, other, face, moves, w.now)
    if parting <= 0.0 or not persists(parting, pressing, 0.0, radius):
        return parting <= 0.0 < pressing
    e, _ = coefficients(w, sides, i, other)
    if not persists(parting, pressing, e, radius):
        return False
    bounces = 2.0 * parting / (pressing * (1.0 - e))
    soonest = min(math.inf if a.slows else a.end, math.inf if b.slows else b.end)
    is_grouped = w.groups.leader[i] != NONE or (other >= 0 and w.groups.leader[other] != NONE)
    if soonest >= w.now + bounces or is_grouped:
        return True
    a = follower(w, i, a) if a.end == soonest else a
    b = follower(w, max(other, 0), b) if b.end == soonest else b
    _, _, vx, vy = motion_at(a, soonest)
    vx, vy = relative((vx, vy), (moves[0], moves[1]))
    closing = vx * nx + vy * ny
    if other >= 0:
        _, _, ux, uy = motion_at(b, soonest)
        closing -= ux * nx + uy * ny
    else:
        closing = -closing
    pressing = pressing_of(a, b, other, face, moves, soonest)
    return persists(max(-closing, 0.0), pressing, e, radius)


def pressing_of(
    a: Path, b: Path, other: int, face: tuple[float, float, float], moves: Four, t: float
) -> float:
    """Return how strongly (m/s^2) two sides are pressed together on these paths.

    ``moves`` is how a wall does (:func:`~pool_pymunk.physics.persistent.pressing_of_wall`).
    """
    if other >= 0:
        return pressing_of_balls(a, b, t)
    return pressing_of_wall(a, (face[0], face[1]), face[2], moves, t)


def tangent_of(w: Any, i: int) -> Path:
    """Return a path with the exact motion of a ball now; those of groups are mean ones."""
    r = w.groups
    if r.leader[i] == NONE:
        return path_of(w, i)
    find_state(w, r.leader[i], w.now)
    g = w.press
    find_forces(g, g.end)
    s, p, d = g.end, 6 * r.local[i], g.rate
    return Path(
        w.now, s[p], s[p + 1], s[p + 2], s[p + 3], d[p + 2], d[p + 3], math.inf, False,
        s[p + 4], s[p + 5],
    )  # fmt: skip


def wear(w: Any, i: int, other: int) -> float:
    """Return how many times as much as UNSEEN the bounces of this contact may be."""
    many = many_of(w, i) if other < 0 else max(many_of(w, i), many_of(w, other))
    return float(w.groups.coarser * WEAR[min(max(many - FEW, 0), MOST)])


def many_of(w: Any, i: int) -> int:
    """Return how many hits a ball has had, each less than ``AGO`` (s) before the next and now."""
    return int(w.groups.many[i]) if w.now - w.groups.hit_t[i] < AGO else 0


def note_hit(w: Any, i: int) -> None:
    """Count a hit of a ball."""
    w.groups.many[i], w.groups.hit_t[i] = many_of(w, i) + 1, w.now


def is_idle(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides of a group touch, but do not visibly move."""
    near = NEAR * least_radius(w, i, other)
    is_still = abs(closing_of(w, sides, i, other)) <= stillness(w, i, other)
    return is_still and abs(gap_between(w, sides, i, other)) <= near


def stillness(w: Any, i: int, other: int) -> float:
    """Return the speed (m/s) at which two sides do not yet visibly part or close."""
    return STILL * math.sqrt(pull_of(w) * least_radius(w, i, other))


def rubs(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides that touch close no faster than rounding explains."""
    is_slow = closing_of(w, sides, i, other) <= noise_between(w, i, other)
    return is_slow and is_closed(w, sides, i, other)


def cuts(w: Any, i: int, other: int, t: float) -> bool:
    """Cut the pieces of balls that are to hit at ``t`` (s) shortly before that.

    Within a piece places are off by its deviation; at the beginning of the next one they are not.
    """
    is_cut = is_cut_for(w, i, t)
    if other >= 0:
        is_cut |= is_cut_for(w, other, t)
    return is_cut


def is_cut_for(w: Any, i: int, t: float) -> bool:
    """Cut the piece of a ball shortly before ``t`` (s), unless it is too near."""
    r, leader = w.groups, w.groups.leader[i]
    if leader == NONE or r.phase[i] == REST:  # A ball at rest does not leave its place.
        return False
    wait = t - r.began[leader]  # It is the same whenever the hit is predicted.
    if t - SHORTLY * wait <= w.now or not wait > 2.0 * SHORTLY * r.span[leader]:
        return False
    push_piece(w, i, t - SHORTLY * wait)
    return True


def look_after(w: Any, sides: Any, i: int, other: int) -> None:
    """Look at a contact that was answered at this instant."""
    note_hit(w, i)
    if other >= 0:
        note_hit(w, other)
    look_again(w, sides, i, other)


def look_again(w: Any, sides: Any, i: int, other: int) -> None:
    """Look whether two sides persist that have just hit."""
    if may_persist(w, sides, i, other):
        look_at(w, sides, i, other)


def is_slow(speed: float, strongest: float, radius: float) -> bool:
    """Tell whether bounces at a speed (m/s) may ever be too low to be seen.

    No more than the ``strongest`` acceleration (m/s^2) presses their sides together.
    """
    return speed * speed < 4.0 * strongest * UNSEEN * WEAR[MOST] * radius


def may_persist(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether the strongest pressing could hold two sides that have just hit.

    Sliding alone presses no ball on to a straight wall.
    """
    own, pull = path_of(w, i), pull_of(w)
    if other < 0:
        _, _, bends = facing(w, sides, i, other)
        ux, uy, spins, _ = sweep(w, sides, i, other)
        is_still = ux == 0.0 and uy == 0.0 and spins == 0.0
        return rolls(w) or bends < 0.0 or not own.slows or not is_still
    its = path_of(w, other)
    dx, dy = its.x - own.x, its.y - own.y
    parting = dx * (its.vx - own.vx) + dy * (its.vy - own.vy)
    square = parting * parting / (dx * dx + dy * dy)
    return parting <= 0.0 or square < 4.0 * pull * UNSEEN * radius_of(w, i) * wear(w, i, other)


def is_faint(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides would bounce too low to be seen."""
    (_, _, bends), closing = facing(w, sides, i, other), closing_of(w, sides, i, other)
    _, _, vx, vy = motion(w, i)
    ux, uy, spins, lifts = sweep(w, sides, i, other)
    vx, vy = relative((vx, vy), (ux, uy))
    square = vx * vx + vy * vy
    strongest = 2.0 * pull_of(w) + abs(bends) * square
    if spins != 0.0:
        strongest += 2.0 * abs(spins) * math.sqrt(square) + abs(lifts)
    radius = radius_of(w, i) * wear(w, i, other)
    is_slow = closing * closing < 2.0 * strongest * UNSEEN * radius
    return is_slow and stays_after(w, sides, i, other, closing)


def is_absorbed(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether a faint hit has become part of a group, or does not close any more."""
    r = w.groups
    is_in = r.leader[i] != NONE and (other < 0 or r.leader[other] != NONE)
    return is_in or rubs(w, sides, i, other)


def stays(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether two sides that touch neither part nor close, to the eye."""
    k = contact_of(w.groups, i, other)
    if k != NONE and w.groups.on[k]:
        return True
    speed = abs(closing_of(w, sides, i, other))
    if speed <= max(noise_between(w, i, other), stillness(w, i, other)):
        return True
    return stays_after(w, sides, i, other, speed)
