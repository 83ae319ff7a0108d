"""This module has what one pass of small changes needs, and what Python and numba do differently.

Python works with all inputs at once, in arrays, and numba with one after the other. Each function
that Python and numba must write differently has a twin for numba (:mod:`pool_pymunk.fast`).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.saltation import MORE, MOST, Geometry, saltation_matrix

MOST_SIDES = 4  # of a kink of a law

# A follow has what one pass needs. `rows` are breakpoints (ball, t, x, y, vx, vy, ax, ay, wx, wy)
# with the number of the `following` one of the ball, or -1. `events` have a time (s), a ball, and
# what that meets (physics/changes.py). `walls` and `law` are asked; so many walls are `cushions`,
# and `own` are the walls' own restitution and friction, or -1. `cue` is the cue ball. `discs`,
# `faces` and `corners` are what balls may touch (model/obstacles.py). Each `ball` has its last
# breakpoint `at`, what it `met` there, whether it is `gone`, and its `mass` and `radius`. The
# inputs change numbers of the scene, masses and radii by `of_numbers` (8, P; the last row is 0),
# `of_mass` and `of_radius` (N, P), and the state of each ball at its last breakpoint by `change`
# (N, K, P); `ever` (N, P) tells which inputs have changed it. `late` (P) tells how late the last
# event is. `one` has the numbers of one contact, and `z`, `parts` and `bad` its changes. Errors
# have random `signs` (without errors there are none), and those of errors that are `alike`. The row
# and the kind of event that came last are `drawn`, and `anchors` are points of the walls. What the
# pass has found is `kept`: reasons, how late events are, and changes. Python keeps its paths there,
# too. Patches have `borders`, and a `ground` with decelerations of their own (physics/patches.py).
Follow = namedtuple(
    "Follow",
    "rows following events walls cushions own cue law discs faces corners ball "
    "of_numbers of_mass of_radius change ever late one z parts bad signs alike drawn anchors kept "
    "borders ground",
)

# The numbers of one contact: places of balls, rates of change before and after it, what the law
# is asked and answers there and beside it, and its slopes. The `ends` are the duration of the run
# (s), whether it was cut there, whether its number of events did that, and its first breakpoint.
# The `numbers` are the scene's: restitutions of balls, of the cue ball and of cushions, pull of
# the surface, frictions of cushions and of balls, drag of the surface.
ONE = {
    "place": (4,), "before": (12,), "after": (12,), "asked": (8,), "beside": (8,),
    "answers": (MOST_SIDES + 1, 4), "slopes": (MOST_SIDES, 4, 8),
    "ends": (4,), "numbers": (7,),
}  # fmt: skip


def room(size: int, count: int) -> dict[str, Any]:
    """Return room for the changes of one contact, of states of K numbers by P inputs."""
    shapes = {"z": (2 * size + MORE, count), "parts": (5, count), "bad": (count,)}
    return {name: np.zeros(shape) for name, shape in shapes.items()}


def is_changed(own: Any, p: Any) -> Any:
    """Tell whether an input changes a ball's state."""
    found = own[0, p] != 0.0
    for k in range(1, len(own)):
        found = found | (own[k, p] != 0.0)
    return found


def is_of_errors(g: Any) -> bool:
    """Tell whether the columns are rounding errors."""
    return len(g.signs) > 0


def columns(g: Any) -> Any:
    """Return what to go through to reach all inputs."""
    return (slice(None),)


def is_idle(g: Any, p: Any) -> bool:
    """Tell whether an input surely changes nothing at a contact; numba then leaves it out."""
    return False


def any_of(flag: Any) -> bool:
    """Tell whether a flag is true for some input."""
    return bool(flag.any())


def greater(one: Any, other: Any) -> Any:
    """Return the greater one of two numbers, for each input."""
    return np.maximum(one, other)


def unknown_if(flag: Any) -> Any:
    """Return nan for inputs with this flag, and 0 for others."""
    return np.where(flag, math.nan, 0.0)


def is_unknown(own: Any) -> bool:
    """Tell whether nothing is known of a change."""
    return bool(np.isnan(own).all())


def is_beyond(own: Any) -> bool:
    """Tell whether a change has grown too large."""
    return bool((np.abs(own) > MOST).any())


def warn(g: Any, why: int, t: float) -> None:
    """Note why something is lost at ``t`` (s)."""
    g.kept.found.append((t, why))


def keep(g: Any, k: int, i: int, j: int, t: float) -> None:
    """Keep how late event ``k`` is, and the changes of its balls from ``t`` (s) on."""
    if k >= 0:
        g.kept.lates.append(g.late.copy())
    for n in {i, j}:
        g.kept.changes[n].append((t, g.ball[n].at, g.change[n].copy()))


def path_of(g: Any, i: int) -> Path:
    """Return the present path of a ball."""
    path: Path = g.kept.paths[g.ball[i].at]
    return path


def squared(row: Any) -> float:
    """Return the sum of the squares of a row of changes."""
    return float(row @ row)


def add_sized(g: Any, own: Any, sizes: Any, first: int, source: int) -> None:
    """Add errors of these sizes to the rows of a change, with the signs from row ``first`` on."""
    if any(sizes):
        own += np.array(sizes)[:, np.newaxis] * signs_of(g, len(sizes), first, source)


def add_mixed(g: Any, own: Any, mixed: Any, first: int, source: int) -> None:
    """Add errors to the rows of a change, which are ``mixed`` from rows of signs by a matrix."""
    own += np.array(mixed) @ signs_of(g, len(mixed[0]), first, source)


def signs_of(g: Any, count: int, first: int, source: int) -> Any:
    """Return rows of random signs, plus those of the kind of this event."""
    return g.signs[first : first + count] + g.alike[source, g.drawn[1], :count]


def copy(own: Any, there: Any) -> None:
    """Copy the rows of a change."""
    there[:] = own


def surface_at(g: Any, wall: int, x: float, y: float, radius: float) -> Any:
    """Return the normal and the curvature of a wall where a ball touches it."""
    side = g.walls[wall].nearest(x, y, radius)
    return side.normal(x, y), side.curvature(x, y)


def advance(g: Any, own: Any, by_state: Any, by_pull: Any, of_pull: Any) -> None:
    """Multiply a change by the derivatives of a motion."""
    own[:] = np.array(by_state) @ own
    if not is_of_errors(g) and of_pull.any():
        own += np.multiply.outer(by_pull, of_pull)


def advance_slowing(g: Any, own: Any, by_state: Any, by_pull: Any, of_pull: Any) -> None:
    """Multiply a change of place and velocity, of which a place depends on no other place."""
    advance(g, own, by_state, by_pull, of_pull)


def saltate(g: Any, geometry: Geometry, balls: int, roll: Vector) -> None:
    """Multiply ``z`` by the saltation matrix of a contact."""
    m = saltation_matrix(g, geometry, balls, roll)
    g.z[: len(m)] = np.array(m) @ g.z[: len(m[0])]
