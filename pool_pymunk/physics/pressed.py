"""A press has a group of balls in persistent contact: its numbers, and where its sides are.

The functions are loops over the numbers of a :class:`Press`, in lists or in arrays. A state is a
row of six numbers a ball: x, y (m), vx, vy, wx, wy (m/s).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pool_pymunk.physics.surface import GYRATION

REST, SLIP, ROLL = 0, 1, 2  # phases of a ball

STUCK, LET_GO = 1, 2  # It came back to rest as soon as it was let go; it was let go just now.

FLAT, ROUND, BALL = 0, 1, 2  # what a ball touches


NEAR = 1e-9  # of a contact's size; sides that are nearer touch

MOST_STEPS = 16  # of a piece

# These are the rows that a press has, each with its type, and its shape by the most balls N and
# contacts C. `small` has the speed and the acceleration below which there is none, and a factor of
# all tolerances. Each ball has its number in the run (`ball`), its `mass` (kg), `radius` (m), the
# decelerations of sliding and of rolling where it is (`pull`, `drag`, m/s^2), its `phase`, and as
# `push` its f and c (m/s^2); `rate` is the change of the state. A ball is `stuck` that other balls
# and walls hold at rest, because it came back to rest as soon as it was let go.
# Each contact has what its ball touches in the run (`place`: a ball, or -1 - the number of a wall),
# its balls `one` and `other` (-1 for a wall), `what` is touched, its friction `mu`, and its
# `edge`: of two balls the sum of their radii (m); of a flat wall its normal, the height of a
# touching ball's centre along it, and its ends along the tangent (m); of a round one its center, 1
# or -1 for balls that are outside or inside, the distance of the centres (m), and the directions of
# its ends, if it has any, counter-clockwise. `unit` (kg) is that of its forces, in which its own
# response is about 1. `over` tells whether its side has ended, and `on` whether it presses;
# `slides` and `into` have the signs of its slip and of the roll into a cushion, 0 where friction
# holds them. `force` (N) has N, the friction along the tangent, and what slows the roll. `normal`,
# `bend` (1/m) and `slip` (m/s) are those of the present state. `unknown` and `matrix` are the
# linear system. A wall's `drift` is its velocity (m/s), the time (s) of its `edge`, its angular
# velocity (rad/s), and the place (m) around which it turned then; `spin` has the accelerations
# (m/s^2) along the normal and the tangent that come from turning. `at` has the times (s) of the
# step's beginning, of the present state, and of the piece's beginning. `state`, `end` and `total`
# (N s) are those of a piece. At each `stop` one of its steps ends, `stop_t` (s) after its
# beginning. The others are for a step, which begins `here`.
FORM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "small": (float, (3,)),
    "ball": (int, ("N",)), "mass": (float, ("N",)), "radius": (float, ("N",)),
    "pull": (float, ("N",)), "drag": (float, ("N",)),
    "phase": (int, ("N",)), "stuck": (int, ("N",)), "push": (float, ("N", 4)),
    "rate": (float, ("6N",)),
    "place": (int, ("C",)), "one": (int, ("C",)), "other": (int, ("C",)), "what": (int, ("C",)),
    "mu": (float, ("C",)), "edge": (float, ("C", 8)), "unit": (float, ("C",)),
    "drift": (float, ("C", 6)), "spin": (float, ("C", 2)), "at": (float, (3,)),
    "over": (int, ("C",)), "on": (int, ("C",)), "slides": (int, ("C",)), "into": (int, ("C",)),
    "force": (float, ("C", 3)), "normal": (float, ("C", 2)), "bend": (float, ("C",)),
    "slip": (float, ("C",)), "closed": (int, ("C",)), "chosen": (int, ("C",)),
    "was_on": (int, ("C",)),
    "unknown": (int, ("3C", 2)), "matrix": (float, ("3C", "3C+1")), "column": (int, ("3C",)),
    "found": (float, ("3C",)), "free": (float, ("3C", "3C")),
    "state": (float, ("6N",)), "end": (float, ("6N",)), "total": (float, ("C", 3)),
    "rates": (float, (7, "6N")), "forces": (float, (7, "C", 3)),
    "here": (float, ("6N",)), "so_far": (float, ("C", 3)),
    "stop": (float, (MOST_STEPS, "6N")), "stop_t": (float, (MOST_STEPS,)),
    "first": (float, ("6N",)), "held": (float, ("C", 3)),
    "before": (float, ("4C+N",)), "after": (float, ("4C+N",)),
}  # fmt: skip


class Press:
    """A press is a group with the room for its forces and its next piece, in lists."""

    own: Any = None  # a surface of a user's, which accelerates balls without contacts
    is_fixed = False  # Its room is.

    def __init__(self) -> None:
        self.balls = self.contacts = self.steps = 0
        self.rolls = False
        self.room = 0, 0

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...  # the lists of FORM

    def hold(self, balls: int, contacts: int) -> None:
        """Have room for so many balls and contacts."""
        n, c = self.room
        if balls > n or contacts > c:
            self.room = max(balls, 2 * n), max(contacts, 2 * c)
            for name, (kind, shape) in FORM.items():
                setattr(self, name, rows_of(kind, lengths(shape, *self.room)))


def lengths(shape: Sequence[Any], balls: int, contacts: int) -> tuple[int, ...]:
    """Return the lengths of rows for so many balls and contacts.

    >>> lengths((7, "6N"), 2, 1), lengths(("3C", "3C+1"), 2, 1)
    ((7, 12), (3, 4))
    """
    known = {
        "N": balls, "N+1": balls + 1, "6N": 6 * balls, "C": contacts, "3C": 3 * contacts,
        "3C+1": 3 * contacts + 1, "6C": 6 * contacts, "4C+N": 4 * contacts + balls,
    }  # fmt: skip
    return tuple(known.get(each, each) for each in shape)


def rows_of(kind: type, shape: Sequence[int]) -> Any:
    """Return lists of zeros in lists."""
    row = [kind()] * shape[-1]
    if len(shape) == 1:
        return row
    if len(shape) == 2:
        return [row[:] for _ in range(shape[0])]
    return [rows_of(kind, shape[1:]) for _ in range(shape[0])]


def find_units(g: Any) -> None:
    """Find the unit of each contact's forces, and forget how it presses."""
    for k in range(g.contacts):
        m, j = g.mass[g.one[k]], g.other[k]
        g.unit[k] = m if j < 0 else m * g.mass[j] / (m + g.mass[j])


def set_time(g: Any, t: float) -> None:
    """Let the state of a press be that of a time (s), at which a piece begins."""
    g.at[0] = g.at[1] = g.at[2] = t


def unmoved(g: Any, k: int, x: Any, y: Any) -> tuple[Any, Any]:
    """Return a place (m) as the wall of a contact has it, which has moved since its edge was read.

    It is in the wall's frame of that time.
    """
    d, late = g.drift[k], g.at[1] - g.drift[k][2]
    x, y = x - late * d[0], y - late * d[1]
    if d[3] == 0.0:
        return x, y
    x, y = turned(x - d[4], y - d[5], -late * d[3])
    return x + d[4], y + d[5]


def turned(x: Any, y: Any, angle: float) -> tuple[Any, Any]:
    """Return a vector that is turned by an angle."""
    c, s = math.cos(angle), math.sin(angle)
    return x * c - y * s, x * s + y * c


def flow(g: Any, s: Any, k: int) -> tuple[Any, Any]:
    """Return how fast (m/s) the ball of a contact moves in the frame of its wall."""
    i, d = 6 * g.one[k], g.drift[k]
    u, v = s[i + 2] - d[0], s[i + 3] - d[1]
    if d[3] == 0.0:
        return u, v
    x, y = from_center(g, s, k)
    return u + d[3] * y, v - d[3] * x


def from_center(g: Any, s: Any, k: int) -> tuple[Any, Any]:
    """Return where (m) the ball of a contact is from the place around which its wall turns."""
    i, d, late = 6 * g.one[k], g.drift[k], g.at[1] - g.drift[k][2]
    return s[i] - late * d[0] - d[4], s[i + 1] - late * d[1] - d[5]


def gap_of(g: Any, s: Any, k: int) -> Any:
    """Return the gap (m) of a contact."""
    i, shape = 6 * g.one[k], g.edge[k]
    if g.what[k] == BALL:
        j = 6 * g.other[k]
        dx, dy = s[j] - s[i], s[j + 1] - s[i + 1]
        return size_of(dx, dy) - shape[0]
    x, y = unmoved(g, k, s[i], s[i + 1])
    if g.what[k] == FLAT:
        return x * shape[0] + y * shape[1] - shape[2]
    dx, dy = x - shape[0], y - shape[1]
    return shape[2] * (size_of(dx, dy) - shape[3])


def look(g: Any, s: Any) -> None:
    """Find the normal, the bend and the slip of each contact."""
    for k in range(g.contacts):
        i, shape, n = 6 * g.one[k], g.edge[k], g.normal[k]
        g.spin[k][0] = g.spin[k][1] = 0.0
        if g.what[k] == FLAT:
            n[0], n[1], g.bend[k] = shape[0], shape[1], 0.0
            slip_on_wall(g, s, k)
            continue
        if g.what[k] == BALL:
            j = 6 * g.other[k]
            x, y, facing = s[j] - s[i], s[j + 1] - s[i + 1], 1.0
        else:
            x, y = unmoved(g, k, s[i], s[i + 1])
            x, y, facing = x - shape[0], y - shape[1], shape[2]
        distance = size_of(x, y)
        n[0], n[1], g.bend[k] = facing * x / distance, facing * y / distance, facing / distance
        if g.what[k] == BALL:
            u, v = s[j + 2] - s[i + 2], s[j + 3] - s[i + 3]
            g.slip[k] = v * n[0] - u * n[1]
        else:
            slip_on_wall(g, s, k)


def slip_on_wall(g: Any, s: Any, k: int) -> None:
    """Find the slip on a wall whose normal is known as it was when its edge was read.

    In the frame of a wall that turns there are the forces of Coriolis and the centrifugal one. They
    open the gap, and change the slip; ``spin`` has these accelerations.
    """
    n, spins = g.normal[k], g.drift[k][3]
    u, v = flow(g, s, k)
    if spins == 0.0:
        g.slip[k] = v * n[0] - u * n[1]
        return
    n[0], n[1] = turned(n[0], n[1], (g.at[1] - g.drift[k][2]) * spins)
    along = v * n[0] - u * n[1]
    x, y = from_center(g, s, k)
    g.spin[k][0] = spins * (2.0 * along + spins * (x * n[0] + y * n[1]))
    g.spin[k][1] = spins * spins * (y * n[0] - x * n[1])
    g.slip[k] = along + spins * g.radius[g.one[k]]  # that of the ball's surface


def along_wall(g: Any, k: int) -> Any:
    """Return how fast (m/s) the middle of a ball moves along its wall, or along another ball."""
    return g.slip[k] - g.drift[k][3] * g.radius[g.one[k]]


def opening(g: Any, s: Any, k: int) -> Any:
    """Return the speed (m/s) at which the two sides part."""
    i, n = 6 * g.one[k], g.normal[k]
    if g.other[k] < 0:
        u, v = flow(g, s, k)
        return u * n[0] + v * n[1]
    along = s[i + 2] * n[0] + s[i + 3] * n[1]
    j = 6 * g.other[k]
    return s[j + 2] * n[0] + s[j + 3] * n[1] - along


def roll_into(g: Any, s: Any, k: int) -> Any:
    """Return the part of the roll (m/s) along the normal of a wall."""
    i, n = 6 * g.one[k], g.normal[k]
    return s[i + 4] * n[0] + s[i + 5] * n[1]


def energy_of(g: Any, s: Any) -> float:
    """Return the energy (J) of a state."""
    energy = 0.0
    for i in range(g.balls):
        p = 6 * i
        x, y, u, v = s[p + 2], s[p + 3], s[p + 4], s[p + 5]
        energy += 0.5 * g.mass[i] * (x * x + y * y + GYRATION * (u * u + v * v))
    return energy


def is_driven(g: Any) -> bool:
    """Tell whether a wall that moves presses on a ball."""
    found = False
    for k in range(g.contacts):
        d = g.drift[k]
        found |= bool(g.on[k]) and (d[0] != 0.0 or d[1] != 0.0 or d[3] != 0.0)
    return found


def wrings(g: Any, k: int) -> bool:
    """Tell whether a contact's friction slows a roll."""
    return bool(g.rolls) and g.other[k] < 0 and g.mu[k] > 0.0


def smallest(g: Any) -> float:
    """Return the smallest radius (m)."""
    least = math.inf
    for i in range(g.balls):
        least = min(least, g.radius[i])
    return least


def size_of(x: Any, y: Any) -> Any:
    """Return the length of a vector; a square root has the same bits on every machine."""
    return math.sqrt(x * x + y * y)


def sign(x: float, least: float) -> int:
    """Return the sign of a number, or 0 if it is not larger than ``least``."""
    return 0 if abs(x) <= least else (1 if x > 0.0 else -1)


def room(g: Any, k: int, x: float, y: float) -> float:
    """Return how far (m) a ball at a place is from the nearer end of the side that it touches."""
    shape = g.edge[k]
    if g.what[k] == BALL:
        return math.inf
    x, y = unmoved(g, k, x, y)
    if g.what[k] == FLAT:
        foot = y * shape[0] - x * shape[1]
        return float(min(foot - shape[3], shape[4] - foot))
    fx, fy, lx, ly = shape[4], shape[5], shape[6], shape[7]
    if fx == fy == 0.0:
        return math.inf
    x, y = x - shape[0], y - shape[1]
    after, before = fx * y - fy * x, x * ly - y * lx
    is_short = fx * ly - fy * lx >= 0.0  # at most half a turn
    return float(min(after, before) if is_short else max(after, before))
