"""This module makes the rounding errors of a run: they are columns of changes, with random signs.

Every path and every contact makes errors of a few units of rounding: of the place, of the time of
the contact, of the normal, of the new velocities. They are injected where they are made, and go
through the run as any other change does (:mod:`pool_pymunk.physics.changes`).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from pool_pymunk.physics.columns import (
    MOST_SIDES,
    add_mixed,
    add_sized,
    columns,
    is_of_errors,
    path_of,
    squared,
)
from pool_pymunk.physics.contact import split
from pool_pymunk.physics.motion import EPSILON, Vector
from pool_pymunk.physics.path import motion_at
from pool_pymunk.physics.saltation import GAP, TURN, Geometry
from pool_pymunk.physics.surface import roll_rate

# A sum or a product errs by up to half a spacing; this is the root mean square, as a share.
UNIT = EPSILON / 2.0 / math.sqrt(3.0)
COLUMNS = 32  # draws of random signs; their root mean square is then right to some 12 %
SIGNS = 4096  # rows of random signs, which are used in turn
SURE = 4.0  # A figure is this many times a root mean square, or the largest change of some runs.
# Contacts of one kind err alike: a ball between two cushions adds the same interval to the time
# again and again, with the same rounding. SURE times this share of UNIT is half a spacing.
ALIKE = 0.43
# time_of_contact shrinks corners by 8 EPSILON of the coordinates; SURE times this is twice that.
CORNER = 4.0 * EPSILON
KINDS = 16  # kinds of contacts, by balls and cushion; each kind errs alike; a free choice
TURNED = 0.5  # rad; where a normal may have turned this far, the first order says nothing
TIMES, PLACES, PATHS, ANSWERS = range(4)  # what errs
MOST_ROWS = 6  # are drawn at once


def begin(g: Any, kind: int) -> None:
    """Begin an event of this kind."""
    if is_of_errors(g):
        g.drawn[1] = kind % KINDS


def misplace(g: Any, i: int, t: float) -> None:
    """Add the errors of a ball's state at a time (s) on its path.

    A coordinate errs by a unit of itself, and the path there, a product, by two. An acceleration
    errs by three where a ball slips: a difference, a root and a quotient.
    """
    if not is_of_errors(g):
        return
    row, own, (x, y, _, _) = g.rows[g.ball[i].at], g.change[i], motion_at(path_of(g, i), t)
    time, (far_x, far_y) = t - row[1], moved(g, i, x, y, t)
    pull = UNIT if g.one.numbers[3] > 0.0 or len(g.borders) > 0 else 0.0
    of_x, of_y = (abs(x) + 2.0 * far_x) * (far_x > 0.0), (abs(y) + 2.0 * far_y) * (far_y > 0.0)
    of_u, of_v = pull * abs(row[4]), pull * abs(row[5])
    if len(own) == 4:
        add(g, own, (UNIT * of_x, UNIT * of_y, of_u, of_v), PLACES)
        return
    turned, (wx, wy) = 3.0 * UNIT * time, roll_rate(row)
    add(g, own, (
        UNIT * of_x, UNIT * of_y, of_u + turned * abs(row[6]), of_v + turned * abs(row[7]),
        UNIT * abs(row[8]) + turned * abs(wx), UNIT * abs(row[9]) + turned * abs(wy),
    ), PLACES)  # fmt: skip


def moved(g: Any, i: int, x: float, y: float, t: float) -> tuple[float, float]:
    """Return how far (m) a ball has moved to (x, y), even if its roll turned it back."""
    row, time = g.rows[g.ball[i].at], t - g.rows[g.ball[i].at][1]
    if len(g.change[i]) == 4:
        return abs(x - row[2]), abs(y - row[3])
    return time * (abs(row[4]) + time / 2.0 * abs(row[6])), time * (
        abs(row[5]) + time / 2.0 * abs(row[7])
    )


def delay(g: Any, row: Any, t: float) -> None:
    """Delay the end of a slide: its time errs by a unit, and by three units of the slide."""
    if is_of_errors(g):
        add(g, g.late.reshape(1, len(g.late)), (UNIT * (t + 3.0 * (t - row[1])),), TIMES)


def may_miss(g: Any, own: Any, velocity: Any, normal: Any, curvature: float) -> bool:
    """Tell whether errors may let a ball miss a pocket."""
    if not is_of_errors(g):
        return False
    (vx, vy), (nx, ny) = velocity, normal
    speed = math.sqrt(vx * vx + vy * vy)
    within = (1.0 - abs(nx * vy - ny * vx) / speed) / curvature
    _, across = sizes_of(g, own, 0, (vx / speed, vy / speed))
    return bool(across >= within)


def with_gap(g: Any, geometry: Geometry, i: int, other: int, t: float) -> Geometry:
    """Add the errors of the gap, of the time and of the normal, and return what they leave.

    The errors before a graze change its closing speed. A gap g changes a closing speed c, at the
    slip s and the curvature k, to the root of c^2 +- 2 s^2 k g. It therefore changes c by
    s^2 k g / c, but by no more than s sqrt(2 k g). The linear map gives this bound for a contact
    that closes at s sqrt(k g / 2). The closing speed is infinite if errors grow so large that other
    contacts may come.
    """
    if not is_of_errors(g):
        return geometry
    (nx, ny), curvature, closing, slip, depth = geometry
    balls, size = 2 if other >= 0 else 1, len(g.change[0])
    gap, rows = gap_error(g, geometry, i, other, t), balls * size
    sizes = gap + UNIT * t * closing, 2.0 * UNIT * abs(nx * ny)
    add(g, g.z[rows + GAP : rows + TURN + 1], sizes, TIMES)
    if curvature <= 0.0:
        return geometry
    far, along = sizes_of(g, g.z, size if balls == 2 else 0, (nx, ny))
    closing = max(closing, abs(slip) * math.sqrt(curvature * max(gap, far) / 2.0))
    turned = curvature * (along + abs(slip) * far / closing)
    closing = closing if turned <= TURNED else math.inf
    return Geometry((nx, ny), curvature, closing, slip, depth)


def sizes_of(g: Any, own: Any, other: int, normal: Vector) -> tuple[float, float]:
    """Return how large (m) the error of a place is along a normal, and across it.

    The place is in the first two rows of a change. If the rows of an ``other`` ball begin later, it
    is the offset of that ball.
    """
    (nx, ny), along, across = normal, 0.0, 0.0
    for p in columns(g):
        x, y = own[other, p], own[other + 1, p]
        if other > 0:
            x, y = x - own[0, p], y - own[1, p]
        along += squared(nx * x + ny * y)
        across += squared(nx * y - ny * x)
    share = SURE / math.sqrt(len(g.late))
    return share * math.sqrt(along), share * math.sqrt(across)


def gap_error(g: Any, geometry: Geometry, i: int, other: int, t: float) -> float:
    """Return the error (m) of a gap that is found closed.

    A gap between balls errs by a unit of their offset at the start of a path, or by four where the
    time is found by an iteration: both move, or one slips. If the ball that set off first still
    moved when the other one set off, its place was rounded then. At a straight side the path along
    the normal counts, and the offset from the start of the side. A circle errs by some units of its
    radius and of the path. A circle that bulges into the table was shrunk by some spacings of the
    coordinates.
    """
    (nx, ny), curvature, _, _, _ = geometry
    radius, row = g.ball[i].radius, g.rows[g.ball[i].at]
    own_x, own_y = g.one.place[0], g.one.place[1]
    far_x, far_y = moved(g, i, own_x, own_y, t)
    if other < 0:
        x, y = g.anchors[-1 - other][0], g.anchors[-1 - other][1]
        far_x, far_y = far_x + abs(own_x - x), far_y + abs(own_y - y)
        if curvature == 0.0:
            return float(UNIT * (far_x * abs(nx) + far_y * abs(ny) + 2.0 * radius))
        corner = CORNER * (abs(row[2]) + abs(row[3]) + radius) if curvature > 0.0 else 0.0
        around = 2.0 * (1.0 / abs(curvature) + radius) + far_x + far_y
        return float(corner + 2.0 * UNIT * around)
    its_x, its_y = g.one.place[2], g.one.place[3]
    its, (its_far_x, its_far_y) = g.rows[g.ball[other].at], moved(g, other, its_x, its_y, t)
    size = far_x + far_y + (its_far_x + its_far_y) + 2.0 * (radius + g.ball[other].radius)
    own_moves, its_moves = moves(row), moves(its)
    was_first = own_moves if row[1] <= its[1] else its_moves
    places = 0.0
    if was_first and row[1] != its[1]:
        places = abs(own_x) + abs(own_y) + abs(its_x) + abs(its_y)
    is_found = own_moves and its_moves
    if len(g.change[i]) > 4:
        is_found = is_found or slips(row) or slips(its)
    return float(UNIT * ((4.0 if is_found else 1.0) * size + places))


def moves(row: Any) -> bool:
    """Tell whether a ball moves, or sets off, from a breakpoint on."""
    return bool(row[4] != 0.0 or row[5] != 0.0 or row[6] != 0.0 or row[7] != 0.0)


def slips(row: Any) -> bool:
    """Tell whether the velocity of a ball is not its roll."""
    return bool(row[4] != row[8] or row[5] != row[9])


def make(g: Any, geometry: Geometry, i: int, other: int) -> None:
    """Add the errors that a contact and the new paths make.

    The parts of the velocities before a contact are sums of products, and so err by a unit of each.
    A part that the law does not change keeps every bit. A normal errs by a unit.
    """
    if not is_of_errors(g):
        return
    balls, size, (nx, ny) = 2 if other >= 0 else 1, len(g.change[0]), geometry.normal
    along = across = 0.0
    for c in range(balls):
        vx, vy = abs(g.one.before[c * size]), abs(g.one.before[c * size + 1])
        along, across = along + abs(nx) * vx + abs(ny) * vy, across + abs(ny) * vx + abs(nx) * vy
    skew = UNIT * (2.0 if nx != 0.0 and ny != 0.0 else 1.0)
    for c in range(balls):
        n, k, share = i if c == 0 else other, c * size, 1.0
        if balls == 2:
            share = g.ball[other if c == 0 else i].mass / (g.ball[i].mass + g.ball[other].mass)
        after, row = g.one.answers[MOST_SIDES], g.rows[g.following[g.ball[n].at]]
        made_n, made_t = split((g.one.after[k], g.one.after[k + 1]), geometry.normal)
        of_n = abs(made_n - after[2 * c]) + skew * share * along * (made_n != g.one.asked[2 * c])
        of_t = abs(made_t - after[2 * c + 1]) + skew * share * across * (
            made_t != g.one.asked[2 * c + 1]
        )
        mixed = (
            (UNIT * abs(row[4]), 0.0, of_n * nx, -of_t * ny),
            (0.0, UNIT * abs(row[5]), of_n * ny, of_t * nx),
        )
        add_mixed(g, g.z[k + 2 : k + 4], mixed, draw(g, 4), ANSWERS)
        if size > 4:
            add(g, g.z[k + 4 : k + 6], (UNIT * abs(row[8]), UNIT * abs(row[9])), PATHS)


def draw(g: Any, count: int) -> int:
    """Draw so many rows of random signs; return the first one."""
    first = int(g.drawn[0])
    g.drawn[0] = first + count if first + count + MOST_ROWS < SIGNS else 0
    return first


def add(g: Any, own: Any, sizes: Any, source: int) -> None:
    """Add errors of these sizes to the rows of a change."""
    add_sized(g, own, sizes, draw(g, len(sizes)), source)


@cache
def random_signs() -> tuple[Any, Any]:
    """Return random signs (SIGNS, COLUMNS), and those of each source and kind of errors."""
    rng = np.random.default_rng(0)
    signs = rng.integers(0, 2, (SIGNS, COLUMNS)) * 2.0 - 1.0
    return signs, ALIKE * (rng.integers(0, 2, (4, KINDS, MOST_ROWS, COLUMNS)) * 2.0 - 1.0)


def room() -> dict[str, Any]:
    """Return what a follow of errors needs."""
    signs, alike = random_signs()
    return {"signs": signs, "alike": alike, "drawn": [0, 0]}
