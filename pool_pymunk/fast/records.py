"""This module has the records and arrays in which compiled shots are played.

A record has a fixed form, so numba passes it on as one pointer. Lengths are in m, times in s.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from pool_pymunk.engine import groups
from pool_pymunk.physics import collapse, together
from pool_pymunk.physics.contact import Pair
from pool_pymunk.physics.pressed import FORM, lengths

Work = Any  # one record of WORKS
Moving = Any  # one record of BALLS
Sides = Any  # an array of one of SIDES

# Records have fixed sizes, and a shot that needs more goes to the engine. With twice of the next
# three numbers, shots of the report are as fast as now.
MOST_BALLS = 64
MOST_TOGETHER = 64  # A shot with more contacts at one instant goes to the engine.
MOST_ROWS = 4096  # A track with more breakpoints goes to the engine.
ROOM = 65_536  # This many breakpoints of some shots are kept together, in 6 MB a thread.
NOTHING = -1  # stands for no ball, no side, no pocket

N, F, I = MOST_BALLS, np.float64, np.int64  # noqa: E741

NUMBERS = 8  # of a side, at most
# The sides of a wall are those from `first` up to `last`. Where walls `differ`, there may be arcs,
# and a wall may have restitution and friction of its `own`, or -1 for the scene's. Other scenes do
# without these numbers. numba compiles a loop for each form, so arcs do not slow down scenes
# without them.
SIDES = {
    differ: np.dtype(
        [("kind", I), ("numbers", F, NUMBERS), ("core", F), ("wall", I), ("first", I), ("last", I),
         ("pocket", I), ("center", F, 2), ("own", F, (2 * differ,))]
    )
    for differ in (False, True)
}  # fmt: skip

# `kind` is the number of the law for single hits, `together` for contacts of one instant.
SCENE = np.dtype(
    [("kind", I), ("together", I), ("balls", I), ("walls", I), ("cue", I), ("watched", I),
     ("latest", F), ("keeps", I),
     ("ahead", F), ("ball_ball", F), ("cue_ball", F), ("cushion", F), ("pull", F), ("drag", F),
     ("cushion_friction", F), ("ball_friction", F)]
)  # fmt: skip

# A ball has its path, a speed that it does not exceed there, how much of a velocity is noise, a box
# around the path, and if it does not move, where it rests. The numbers of `roll` are wx and wy;
# there are none where balls only slide.
BALLS = {
    rolls: np.dtype(
        [("t", F), ("x", F), ("y", F), ("vx", F), ("vy", F), ("ax", F), ("ay", F), ("end", F),
         ("slows", I), ("roll", F, (2 * rolls,)), ("speed", F), ("noise", F), ("box", F, 4),
         ("moves", I), ("rest", F, 2), ("radius", F), ("mass", F), ("is_off", I)]
    )
    for rolls in (False, True)
}  # fmt: skip

# What is due for a ball: when it meets its first and its second wall, stops, looks ahead again, and
# meets the first ball of a higher number; when its group's piece ends, and when contacts around it
# are to press; when its path ends at a wall, and until when the path is looked at.
DUE = np.dtype(
    [("side", I), ("wall_t", F), ("second_t", F), ("stop_t", F), ("look_t", F), ("ball", I),
     ("ball_t", F), ("piece_t", F), ("press_t", F), ("path_end", F), ("until", F)]
)  # fmt: skip

COUNT = np.dtype(
    [("events", I), ("hits", I), ("cushions", I), ("first_hit", I), ("duration", F),
     ("pocket", I, N), ("met", I, N)]
)  # fmt: skip

# A breakpoint is where a ball's path begins anew: ball, t, x, y, vx, vy, ax, ay, wx, wy. An event
# is as in `Follow` (physics/changes.py); at one breakpoint a ball may be hit and come to rest.
COLUMNS = 10
TRACK = np.dtype(
    [
        ("rows", I),
        ("events", I),
        ("row", F, (MOST_ROWS, COLUMNS)),
        ("event", F, (2 * MOST_ROWS, 3)),
    ]
)

# A contact has the fields of physics.contact.Contact, the number of its wall, what becomes of it,
# its place in a round, and the impulse of a cushion.
CONTACT = np.dtype(
    [("a", I), ("b", I), ("normal", F, 2), ("gap", F), ("wall", I), ("curvature", F), ("kind", I),
     ("place", I), ("impulse", F), ("pair", [(name, F) for name in Pair._fields])]
)  # fmt: skip

# `met` (in the rounds of an instant) and `due` have contacts as pairs: a ball, and another ball or
# -1 - the first side of a wall. Arrays by ball have room for the ball -1 at the end.
C = MOST_TOGETHER
TOGETHER = np.dtype(
    [("is_asked", I), ("met", I, (C, 2)), ("mets", I), ("due", I, (C, 2)), ("dues", I),
     ("turn", I, (C, 2)),
     ("missed", I, (C, 2)), ("misses", I), ("unlisted", I),
     ("contact", CONTACT, C), ("answered", CONTACT, C), ("hitting", CONTACT, C + 1),
     ("group", CONTACT, C), ("place", F, (N, 2)), ("velocity", F, (N + 1, 2)),
     ("before", F, (N + 1, 2)),
     ("moved", I, N + 1), ("is_in", I, N + 1), ("changed", I, N + 1),
     ("is_near", I, N), ("queue", I, N), ("first", I, N + 1), ("shares", I, N + 1),
     ("gap", F, C), ("closing", F, C), ("hits", I, C), ("response", F, (C, C)),
     ("factor", F, (C, C)), ("wanted", F, C), ("unit", F, C), ("impulse", F, C), ("rest", F, C),
     ("pushing", I, C), ("chosen", I, C)]
)  # fmt: skip


def form_of(form: Any, **scalars: Any) -> Any:
    """Return the form of a record with these rows and numbers."""
    rows = [(name, kind, lengths(shape, N, C)) for name, (kind, shape) in form.items()]
    return np.dtype([*scalars.items(), *rows])


PRESS = form_of(FORM, balls=I, contacts=I, pull=F, drag=F, rolls=I)
# If a group `is_full`, the shot goes to the engine; `asked` tells which waits wake their balls.
GROUPS = form_of(
    groups.FORM | {"asked": (int, ("C",))}, coarser=F, members=I, loosened=I, waits=I, hits=I,
    todos=I, begun=I, used=I, free=I, begun_t=F, is_full=I,
)  # fmt: skip

COLLAPSE = form_of(
    collapse.FORM, contacts=I, balls=I, noise=F, can_leap=I, most=I, least=F, played=I, spent=I,
    is_over=I, rounds=I, wait=I, pause=I, first=I, period=I, parts=I, movers=I,
)  # fmt: skip
ORDERS = form_of(together.ORDERS, contacts=I, balls=I, orders=I, order=I, at=I, sweeps=I, is_over=I)

WORKS = {
    rolls: np.dtype(
        [("scene", SCENE), ("ball", ball, N), ("now", F), ("instant", F), ("rounds", I),
         ("in_doubt", I),
         ("next_t", F, N), ("due", DUE, N), ("pair_t", F, (N, N)),
         ("count", COUNT), ("track", TRACK), ("together", TOGETHER), ("press", PRESS),
         ("groups", GROUPS)]
    )
    for rolls, ball in BALLS.items()
}  # fmt: skip


# the sides of the walls, and the corners (C,) and arcs (A, 8) of the outline
TableArrays = namedtuple("TableArrays", "sides xs ys arcs")

# The shots to play have positions, velocities, and where balls roll their rolls (S, N, 2), in SI;
# `is_off` and `mass` are (S, N), and `radius` is (N,). The `coefficients` (S, 7) are the
# restitutions of balls, of the cue ball and of cushions, the pull of the surface, the frictions of
# cushions and of balls, and the drag of the surface.
Shots = namedtuple("Shots", "position velocity roll is_off mass radius coefficients")

# the results of the shots, in arrays as in a Batch; `halt` ends the work
Out = namedtuple(
    "Out", "final duration hits cushions first_hit met pocketed events status in_doubt halt"
)

# the breakpoints (K, 10) and events (E, 3) of some shots, one shot after the other; those of shot s
# end where `ends[s]` (S, 2) says, and a hard shot has none
Tracks = namedtuple("Tracks", "rows events ends")


def tracks(count: int, room: int) -> Tracks:
    """Return arrays for the tracks of ``count`` shots, with room for this many breakpoints."""
    return Tracks(np.empty((room, COLUMNS)), np.empty((2 * room, 3)), np.zeros((count, 2), I))
