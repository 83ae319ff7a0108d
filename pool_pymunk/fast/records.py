"""This module has the records and arrays in which compiled shots are played.

A record has a fixed form, so numba passes it on as one pointer. Lengths are in m, times in s.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from pool_pymunk.engine import answers, groups
from pool_pymunk.physics import collapse, together
from pool_pymunk.physics.contact import Pair
from pool_pymunk.physics.moving import Motion
from pool_pymunk.physics.pressed import FORM, lengths

Work = Any  # one record of WORKS
Moving = Any  # one record of BALLS
Sides = Any  # an array of one of SIDES

# Records have fixed sizes, and a shot that needs more goes to the engine. With twice of the next
# three numbers, shots of the report are as fast as now. Scenes of more balls have larger records.
MOST_BALLS, CROWD = 64, 512
MOST_TOGETHER = 64  # A shot with more contacts at one instant goes to the engine.
MOST_ROWS = 4096  # A track with more breakpoints goes to the engine.
ROOM = 65_536  # This many breakpoints of some shots are kept together, in 6 MB a thread.
HITS, STOPS = 1, 2  # what somebody hears of: hits, pockets and persistent contacts, and stops
NOTHING = -1  # stands for no ball, no side, no pocket

C, F, I = MOST_TOGETHER, np.float64, np.int64  # noqa: E741

NUMBERS = 8  # of a side, at most
# A scene with more borders of patches, or with more patches, goes to the engine.
MOST_BORDERS, MOST_PATCHES = 256, 64

# The sides of a wall are those from `first` up to `last`. Where walls `differ`, there may be arcs,
# and a wall may have restitution and friction of its `own`, or -1 for the scene's. Other scenes do
# without these numbers. numba compiles a loop for each form, so arcs do not slow down scenes
# without them. Where some walls move, each side has the number of its `mover`, or what else it is.
# A mover's first side is that which a ball meets now, where it is now, and has the `motion`; the
# others are those of its body, in the body's frame.
STANDS, OF_BODY = -1, -2
MOST_MOVERS = 16  # A table with more walls that move is played by the engine.
SIDES = {
    (differ, moves): np.dtype(
        [("kind", I), ("numbers", F, NUMBERS), ("core", F), ("wall", I), ("first", I), ("last", I),
         ("pocket", I), ("center", F, 2), ("own", F, (2 * differ,)), ("mover", I, (1 * moves,)),
         ("motion", F, (moves * len(Motion._fields[2:]),))]
    )
    for differ, moves in ((False, False), (True, False), (True, True))
}  # fmt: skip

# `kind` is the number of the law for single hits, `together` for contacts of one instant.
SCENE = np.dtype(
    [("kind", I), ("together", I), ("balls", I), ("walls", I), ("cue", I), ("watched", I),
     ("latest", F), ("most", I), ("keeps", I), ("resumes", I), ("slip", F, 2), ("coarser", F),
     ("hears", I), ("least", F), ("asks", I), ("steps", I), ("longest", F), ("time", F),
     ("answer", F, 4), ("ahead", F), ("ball_ball", F), ("cue_ball", F), ("cushion", F),
     ("pull", F), ("drag", F), ("cushion_friction", F), ("ball_friction", F), ("borders", I),
     ("patches", I)]
)  # fmt: skip

# A ball has its path, a speed that it does not exceed there, how much of a velocity is noise, and a
# box around the path. The numbers of `roll` are wx and wy; there are none where balls only slide.
BALLS = {
    rolls: np.dtype(
        [("t", F), ("x", F), ("y", F), ("vx", F), ("vy", F), ("ax", F), ("ay", F), ("end", F),
         ("slows", I), ("roll", F, (2 * rolls,)), ("speed", F), ("noise", F), ("box", F, 4),
         ("moves", I), ("radius", F), ("mass", F), ("is_off", I)]
    )
    for rolls in (False, True)
}  # fmt: skip

# What is due for a ball: when it meets its first and its second wall, stops, looks ahead again, and
# meets the first ball of a higher number; when its group's piece ends, and when contacts around it
# are to press; when its path ends at a wall or a border, and until when the path is looked at. When
# it crosses a border it looks ahead, too.
# Of the walls that stand, `standing` has the first one, and when the ball meets it and the next.
DUE = {
    moves: np.dtype(
        [("side", I), ("wall_t", F), ("second_t", F), ("stop_t", F), ("look_t", F), ("ball", I),
         ("ball_t", F), ("piece_t", F), ("press_t", F), ("path_end", F), ("until", F),
         ("patch_t", F), ("standing", F, (3 * moves,))]
    )
    for moves in (False, True)
}  # fmt: skip

ERRORS = np.dtype([("share", F), ("state", I), ("of_places", I), ("opens", I)])

# An event has what its ball meets: another ball, or a wall, which is -1 - its number; pockets come
# after the walls. Or the ball comes to rest, begins to roll, or comes OUT of all patches; into
# patch k it comes by OUT - 1 - k.
STOP = -(1 << 30)
ROLL = STOP - 1
OUT = STOP - 3
# What a shot keeps: nothing, its changes of motion, or all that a run tells.
CHANGES, WHOLE = 1, 2
# A breakpoint is where a ball's path begins anew: ball, t, x, y, vx, vy, ax, ay, wx, wy. An event
# has its time, its ball and what that meets, with the impulses of a contact and the number of the
# breakpoints before it; at one breakpoint a ball may be hit and come to rest. A note has its time
# and two balls, or NOTHING twice where the order of contacts was unknown. A persistent contact that
# is over is past: ball and other one, from when until when, its impulse, and where the two were; of
# a wall, when that was (s).
COLUMNS, MOST_NOTES = 10, 1024
# These stand for the second ball in notes of an inelastic collapse: of each of its balls, then of
# the number of its hits, and whether they came to an end.
IN_COLLAPSE, IS_OVER, IS_CUT = -2, -3, -4
TRACK = np.dtype(
    [("rows", I), ("events", I), ("notes", I), ("pasts", I), ("is_heard", I),
     ("row", F, (MOST_ROWS, COLUMNS)), ("event", F, (2 * MOST_ROWS, 7)),
     ("note", F, (MOST_NOTES, 3)), ("past", F, (MOST_NOTES, COLUMNS))]
)  # fmt: skip
# Contacts that persist are held: as those that are past.
HELD: dict[str, tuple[type, tuple[Any, ...]]] = {
    "asked": (int, ("C",)), "held": (float, ("C", COLUMNS)),
}  # fmt: skip

# A contact has fields of physics.contact.Contact, and the number of its wall, and of its mover.
CONTACT = {
    moves: np.dtype(
        [("a", I), ("b", I), ("normal", F, 2), ("wall", I), ("curvature", F),
         ("pair", [(name, F) for name in Pair._fields]), ("drift", F, (2 * moves,)),
         ("mover", I, (1 * moves,))]
    )
    for moves in (False, True)
}  # fmt: skip
# The impulses of a group are found along two lines a contact, of which each has a row here.
# `momentum` is what each ball gets (N s), and `trial` has velocities (m/s).
SHARED: dict[str, tuple[Any, tuple[Any, ...]]] = {
    **together.ROOM, "momentum": (float, ("N", 2)), "trial": (float, ("N", 2)),
}  # fmt: skip


def form_of(form: Any, balls: int, contacts: int, /, **scalars: Any) -> Any:
    """Return the form of a record with these rows, for so many balls and contacts, and numbers."""
    rows = [(name, kind, lengths(shape, balls, contacts)) for name, (kind, shape) in form.items()]
    return np.dtype([*scalars.items(), *rows])


def parts_of(balls: int, moves: bool) -> dict[str, Any]:
    """Return the forms of the parts of a record of so many balls; some walls may move.

    Rows by ball of an instant have room for the ball -1 at the end. There `is_near` and `queue` are
    for what touches, and `listed` is the order in which a listing answers a group. Of groups,
    `asked` tells which waits wake their balls.
    """
    contacts: Any = (CONTACT[moves], ("C",))
    of_instant = answers.BY_BALL | answers.BY_CONTACT | together.ROOM | {
        "contact": contacts, "hitting": contacts, "group": contacts,
        "is_near": (int, ("N",)), "queue": (int, ("N",)), "listed": (int, ("C",)),
    }  # fmt: skip
    return {
        "count": np.dtype(
            [("answered", I), ("events", I), ("hits", I), ("cushions", I), ("first_hit", I),
             ("duration", F), ("pocket", I, balls), ("met", I, balls)]
        ),
        "track": TRACK,
        "instant": form_of(
            of_instant, balls + 1, C, began=F, most=I, rounds=I, mets=I, dues=I, contacts=I,
            misses=I, turns=I, balls=I, is_asked=I, is_played_out=I, unlisted=I,
        ),
        "press": form_of(FORM, balls, C, balls=I, contacts=I, steps=I, rolls=I),
        "collapse": form_of(
            collapse.FORM, balls, C, contacts=I, balls=I, noise=F, can_leap=I, most=I, least=F,
            played=I, spent=I, is_over=I, rounds=I, wait=I, pause=I, first=I, period=I, parts=I,
            movers=I,
        ),
        "collapses": I,
        "shared": form_of(SHARED | {"line": contacts}, balls + 1, 2 * C),
        "orders": form_of(
            together.ORDERS, balls, C, contacts=I, balls=I, orders=I, order=I, at=I, sweeps=I,
            is_over=I,
        ),
        "groups": form_of(
            groups.FORM | groups.OF_PATCHES | HELD, balls, balls, helds=I, coarser=F, members=I,
            loosened=I, waits=I, hits=I, todos=I, begun=I, used=I, free=I, begun_t=F,
        ),
    }  # fmt: skip


def work_of(rolls: bool, balls: int, moves: bool) -> Any:
    """Return the form of the record in which shots of so many balls are played.

    A shot that `is_hard` goes to the engine; balls that are `anew` on their paths are predicted.
    Patches have each `border`, and decelerations of their `own` (physics/patches.py). Walls that
    move have `struck` and `met` balls so often in a step; a row has all movers of a ball.
    """
    fields = [
        ("scene", SCENE), ("ball", BALLS[rolls], balls), ("now", F), ("errors", ERRORS),
        ("is_hard", I), ("in_doubt", I), ("next_t", F, balls), ("due", DUE[moves], balls),
        ("pair_t", F, (balls, balls)), ("anew", I, balls), ("last", F, (balls, 6)),
        *parts_of(balls, moves).items(), ("border", F, (MOST_BORDERS, 6)),
        ("own", F, (MOST_PATCHES, 2)), ("struck", I, (balls * MOST_MOVERS * moves,)),
        ("met", I, (balls * MOST_MOVERS * moves,)),
    ]  # fmt: skip
    return np.dtype((np.record, fields))


# These are the forms of records by whether balls roll, whether they are a crowd, and whether walls
# move. numba compares other forms with them field by field, which takes longer than a shot.
WORKS = {
    (rolls, many, moves): work_of(rolls, CROWD if many else MOST_BALLS, moves)
    for rolls in BALLS for many in (False, True) for moves in (False, True)
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


def empty(count: int, balls: int) -> Out:
    """Return arrays for the results of this many shots."""
    return Out(
        final=np.full((count, balls, 2), np.nan),
        duration=np.zeros(count),
        hits=np.zeros(count, np.int32),
        cushions=np.zeros(count, np.int32),
        first_hit=np.full(count, NOTHING, np.int32),
        met=np.zeros((count, balls), np.bool_),
        pocketed=np.full((count, balls), NOTHING, np.int32),
        events=np.zeros(count, np.int32),
        status=np.full(count, -1, np.int8),
        in_doubt=np.ones(count, np.bool_),
        halt=np.zeros(1, np.int64),
    )


def nothing(of: Any) -> tuple[TableArrays, Shots, Out, Tracks]:
    """Return no walls, no shots, and no results; sides would be ``of`` a form of SIDES."""
    sides, none = np.zeros(0, dtype=of).view(np.recarray), np.empty(0)
    points, rows = np.empty((0, 0, 2)), np.empty((0, 0))
    table = TableArrays(sides, none, none, np.empty((0, NUMBERS)))
    shots = Shots(points, points, points, np.empty((0, 0), I), rows, none, rows)
    return table, shots, empty(0, 0), tracks(0, 0)


# the breakpoints (K, 10) and events (E, 3) of some shots, one shot after the other; those of shot s
# end where `ends[s]` (S, 2) says, and a hard shot has none
Tracks = namedtuple("Tracks", "rows events ends")


def tracks(count: int, room: int) -> Tracks:
    """Return arrays for the tracks of ``count`` shots, with room for this many breakpoints."""
    return Tracks(np.empty((room, COLUMNS)), np.empty((2 * room, 3)), np.zeros((count, 2), I))
