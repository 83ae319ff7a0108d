"""This module plays one shot after the other, in functions that numba can compile.

It is the contact engine for ordinary contacts, which come alone. Motion, times of impact, laws,
decisions and boxes are the same functions as those of :mod:`pool_pymunk.engine.contacts`, called
with the same numbers in the same order, so every bit of an end is the same. What is not ordinary is
not answered here: the shot is ``HARD``, and the engine plays it.

Shots are hard in which contacts of one instant come together, a contact lasts or comes again and
again, rounding decides, or a ball is lost.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.engine import decisions
from pool_pymunk.engine.near import NOWHERE, box, horizon, piece
from pool_pymunk.model.outline import contains
from pool_pymunk.model.places import TOUCHING, is_beside, overlap, sinks
from pool_pymunk.physics.contact import Pair, Vector, approach, changed, split, wall_approach
from pool_pymunk.physics.laws import COMPILED
from pool_pymunk.physics.path import (
    NOISE,
    Lasting,
    Path,
    motion_at,
    pair_time,
    set_off,
    speed_of,
)
from pool_pymunk.physics.sides import Face, Post, Rim, unit

Work = Any  # one record of WORK
Walls = Any  # an array of WALL
Sides = Any  # an array of SIDE

MOST_BALLS = 64
MOST_EVENTS = 1_000_000  # A shot with more events goes to the engine, which gives it up.
MOST_KNOTS = 4096  # A track with more breakpoints goes to the engine.

# how a shot ends; one that is doubtful may be one that cannot start
SETTLED, OUT_OF_TIME, HARD, DOUBTFUL = 0, 1, -1, -2
NOTHING, STOP, LOOK, MEET = -1, -2, -3, -4  # what is due for a ball; from 0 on it is a wall

is_lost = Path.is_lost


def by_number(methods: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """Return a function that calls the law with a number, in place of ``self``, of these."""
    first, *others = methods
    if not others:
        return first
    other = by_number(others)

    def called(law: int, *told: Any) -> Any:
        return first(law, *told) if law == 0 else other(law - 1, *told)

    return called


ball_ball = by_number([law.ball_ball for law in COMPILED])
cushion = by_number([law.cushion for law in COMPILED])
jumps = by_number([law.jumps for law in COMPILED])


# These kinds of sides are compiled, each with how it is read from its numbers.
KINDS: dict[type, Callable[[Any], Any]] = {
    Face: lambda p: Face((p[0], p[1]), (p[2], p[3]), (p[4], p[5]), p[6], p[7]),
    Post: lambda p: Post((p[0], p[1]), p[2]),
    Rim: lambda p: Rim((p[0], p[1]), p[2]),
}


def by_kind(question: str) -> Callable[..., Any]:
    """Return a function that asks a record of SIDE what its kind of side answers."""

    def asks(read: Callable[[Any], Any], ask: Callable[..., Any]) -> Callable[..., Any]:
        def asked(kind: int, side: Any, *told: Any) -> Any:
            return ask(read(side.numbers), *told)

        return asked

    answer = by_number([asks(read, getattr(kind, question)) for kind, read in KINDS.items()])

    def answered(side: Any, *told: Any) -> Any:
        return answer(side.kind, side, *told)

    return answered


gap, normal_of = by_kind("gap"), by_kind("normal")
time_of_contact = by_kind("time_of_contact")


class Table(NamedTuple):
    """A table has the walls, their sides, and the corners (C,) of the outline, in arrays."""

    walls: Walls
    sides: Sides
    xs: Any
    ys: Any


class Shots(NamedTuple):
    """These are the shots to play.

    The positions and velocities are (S, N, 2), in SI; ``is_off`` and ``mass`` are (S, N). The
    ``coefficients`` (S, 6) are the restitutions of balls, of the cue ball and of cushions, the
    pull of the surface, and the frictions of cushions and of balls.
    """

    position: Any
    velocity: Any
    is_off: Any
    mass: Any
    coefficients: Any


class Model(NamedTuple):
    """A model is a run with which others are compared.

    Its balls are at ``path`` (T, N, 2) at the ``times`` (T,). A ball has left it that is more than
    ``agree`` (m) off. Contact c of ball i is with ``other[i, c]``, a ball or as -1 - its number a
    wall; it is contact number ``place[i, c]`` of the other ball, and ``contacts[i]`` is how many
    there are.
    """

    times: Any
    path: Any
    agree: float
    other: Any
    place: Any
    contacts: Any


class Out(NamedTuple):
    """This is what comes of the shots, in arrays as in a Batch.

    If a model is given, ``left`` (S, N) is when (s; inf: never) each ball left it, and ``same``
    (S,) whether every ball met the same others in the same order. Not zero, ``halt`` ends the work.
    """

    final: Any
    duration: Any
    hits: Any
    cushions: Any
    first_hit: Any
    met: Any
    pocketed: Any
    events: Any
    status: Any
    left: Any
    same: Any
    halt: Any


N, F, I = MOST_BALLS, np.float64, np.int64  # noqa: E741
NUMBERS = 8  # of a side, at most
SIDE = np.dtype([("kind", I), ("numbers", F, NUMBERS), ("core", F)])
WALL = np.dtype([("first", I), ("count", I), ("pocket", I), ("center", F, 2)])
# A ball's breakpoints are where its path begins anew: ball, t, x, y, vx, vy, ax, ay.
KNOT = 8
WORK = np.dtype(
    [
        # the shot
        ("balls", I), ("cue", I), ("watched", I), ("law", I), ("latest", F),
        ("pull", F), ("ahead", F),
        ("ball_ball", F), ("cue_ball", F), ("ball_friction", F), ("cushion", F),
        ("cushion_friction", F), ("radius", F, N), ("mass", F, N), ("is_off", I, N),
        # what happens
        ("now", F), ("instant", F), ("rounds", I), ("path", F, (N, 8)), ("noise", F, N),
        ("rested", F, N),
        ("met", F, (N, N)), ("last", F, (N, N)), ("box", F, (N, 4)),
        # what is due: a wall's, the second wall's, a stop's, a look's time; until when it is known
        ("wall", I, N), ("wall_t", F, N), ("second_t", F, N), ("stop_t", F, N), ("look_t", F, N),
        ("path_end", F, N), ("end", F, N), ("due", F, (N, N)), ("best", I, N), ("best_t", F, N),
        # what came of it
        ("events", I), ("hits", I), ("cushions", I), ("first_hit", I), ("duration", F),
        ("pocketed", I, N), ("meets", I, N), ("keeps", I), ("knots", I),
        ("knot", F, (MOST_KNOTS, KNOT)),
        ("contacts", I), ("contact", I, (MOST_KNOTS, 2)), ("count", I, N),
    ]
)  # fmt: skip


def play_shots(
    w: Work, table: Table, shots: Shots, out: Out, model: Model, first: int, last: int
) -> int:
    """Play the shots from ``first`` up to ``last``, and return how many were played.

    They are fewer if ``out.halt`` is set meanwhile. If ``w`` keeps tracks, they are compared with
    the ``model``.
    """
    for s in range(first, last):
        if out.halt[0] != 0:
            return s - first
        read_shot(w, shots, s)
        status = DOUBTFUL
        place = shots.position[s]
        if misplaced(table, place, w.is_off, w.radius, TOUCHING, 0, w.balls) == w.balls:
            status = HARD
            if start(w, table.walls, table.sides, shots.position[s], shots.velocity[s]):
                status = play(w, table.walls, table.sides)
        out.status[s] = status
        if status >= 0:
            write_shot(w, out, s)
            if w.keeps:
                compare(w, model, out, s)
    return last - first


def read_shot(w: Work, shots: Shots, s: int) -> None:
    """Read what shot ``s`` has of its own: who is off the table, masses and coefficients."""
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for i in range(w.balls):
        x, y = shots.position[s, i, 0], shots.position[s, i, 1]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        w.is_off[i], w.mass[i] = shots.is_off[s, i], shots.mass[s, i]
    w.ahead = piece(w.balls, high_x - low_x, high_y - low_y)
    c = shots.coefficients
    w.ball_ball, w.cue_ball, w.cushion = c[s, 0], c[s, 1], c[s, 2]
    w.pull, w.cushion_friction, w.ball_friction = c[s, 3], c[s, 4], c[s, 5]


def misplaced(
    table: Table, position: Any, is_off: Any, radius: Any, share: float, first: int, last: int
) -> int:
    """Return the first ball, from ``first`` up to ``last``, that may not lie where it is.

    It is off the table, in a wall or a pocket, or in a ball before it. If there is none, ``last``
    is returned.
    """
    for i in range(first, last):
        x, y, r = float(position[i, 0]), float(position[i, 1]), float(radius[i])
        if is_off[i]:
            continue
        if len(table.xs) > 0 and not contains(table.xs, table.ys, x, y):
            return i
        for wall in table.walls:
            for k in range(wall.first, wall.first + wall.count):
                side = table.sides[k]
                room = gap(side, x, y, r)
                size, own = (side.core, TOUCHING) if wall.pocket >= 0 else (r, share)
                if room < 0.0 and is_beside(room, r, side.core) and sinks(room, size, x, y, own):
                    return i
        for j in range(i):
            u, v, q = float(position[j, 0]), float(position[j, 1]), float(radius[j])
            if not is_off[j] and overlap(x, y, r, u, v, q, share):
                return i
    return last


def write_shot(w: Work, out: Out, s: int) -> None:
    """Write down what came of shot ``s``."""
    for i in range(w.balls):
        if w.is_off[i]:
            x = y = math.nan
        else:
            x, y, _, _ = motion_at(path_of(w, i), max(w.now, w.duration))
        out.final[s, i, 0], out.final[s, i, 1] = x, y
        out.pocketed[s, i], out.met[s, i] = w.pocketed[i], w.meets[i] != 0
    out.duration[s], out.events[s] = w.duration, w.events
    out.hits[s], out.cushions[s], out.first_hit[s] = w.hits, w.cushions, w.first_hit


def play(w: Work, walls: Walls, sides: Sides) -> int:
    """Play a shot to its end, and return how it ended."""
    while True:
        i, what, t = due_next(w)
        if t == math.inf:
            return SETTLED if not drifts(w) else out_of_time(w)
        if t > w.latest:
            return out_of_time(w)
        w.now = max(t, w.now)
        if what == LOOK:
            look_ahead(w, i)
            meet_others(w, i, i)
            refresh(w, i)
        elif what == STOP:
            stop(w, i, w.stop_t[i])
            w.stop_t[i] = math.inf
        else:
            j = w.best[i] if what == MEET else NOTHING
            if comes_not_alone(w, walls, sides, i, j):
                return HARD
            if what == MEET:
                is_answered = answer_hit(w, walls, sides, i, j)
            elif walls[what].pocket >= 0:
                is_answered = take_in(w, i, what, walls[what])
            else:
                is_answered = answer_cushion(w, walls, sides, i, what)
            if not is_answered or w.events >= MOST_EVENTS or w.knots + 8 > MOST_KNOTS:
                return HARD


# -- setting up ------------------------------------------------------------------------------------


def start(w: Work, walls: Walls, sides: Sides, position: Any, velocity: Any) -> bool:
    """Put the balls on their way; tell whether that is an ordinary start."""
    w.now, w.instant, w.rounds, w.duration = 0.0, -math.inf, 0, 0.0
    w.events = w.hits = w.cushions = w.knots = w.contacts = 0
    w.first_hit = NOTHING
    for i in range(w.balls):
        w.pocketed[i], w.meets[i] = NOTHING, 0
        for j in range(w.balls):
            w.due[i, j], w.last[i, j] = math.inf, -math.inf
    is_ordinary = True
    for i in range(w.balls):
        vx, vy = velocity[i, 0], velocity[i, 1]
        if w.is_off[i]:
            vx = vy = 0.0
        path = set_off(0.0, (position[i, 0], position[i, 1]), (vx, vy), w.pull)
        is_ordinary &= put_path(w, i, path, NOISE * speed_of(path))
        keep(w, i, path)
        w.rested[i] = math.inf if moves(path) else -math.inf
        w.best[i], w.best_t[i] = NOTHING, math.inf
        forget(w, i)
        put_box(w, i, NOWHERE if w.is_off[i] else box(path, w.radius[i], 0.0, math.inf))
        w.end[i] = w.path_end[i] = math.inf
    for i in range(w.balls):
        if moves(path_of(w, i)):
            look_for_walls(w, walls, sides, i)
    for i in range(w.balls):
        if moves(path_of(w, i)):
            look_ahead(w, i)
    for i in range(w.balls):
        if moves(path_of(w, i)):
            meet_others(w, i, i)
    for i in range(w.balls):
        rescan(w, i)
    return is_ordinary


def path_of(w: Work, i: int) -> Path:
    """Return the path of ball ``i``."""
    p = w.path
    return Path(p[i, 0], p[i, 1], p[i, 2], p[i, 3], p[i, 4], p[i, 5], p[i, 6], p[i, 7])


def put_path(w: Work, i: int, path: Path, noise: float) -> bool:
    """Give ball ``i`` a new path; tell whether its contact times mean something."""
    for k in range(8):
        w.path[i, k] = path[k]
    w.noise[i] = noise
    return not is_lost(path, w.radius[i])


def put_box(w: Work, i: int, found: tuple[float, float, float, float]) -> None:
    """Give ball ``i`` a new box."""
    w.box[i, 0], w.box[i, 1], w.box[i, 2], w.box[i, 3] = found


def keep(w: Work, i: int, path: Path) -> None:
    """Keep the breakpoint at which a path begins, if tracks are wanted."""
    if w.keeps:
        w.knot[w.knots, 0] = i
        for k in range(7):
            w.knot[w.knots, 1 + k] = path[k]
        w.knots += 1


def moves(path: Path) -> bool:
    """Tell whether a ball moves at the beginning of its path."""
    return path.vx != 0.0 or path.vy != 0.0


def standing(t: float, x: float, y: float) -> Path:
    """Return the path of a ball that rests."""
    return Path(t, x, y, 0.0, 0.0, 0.0, 0.0, t)


def keep_contact(w: Work, i: int, other: int) -> None:
    """Keep who met whom: a ball, or as -1 - its number a cushion."""
    if w.keeps:
        w.contact[w.contacts, 0], w.contact[w.contacts, 1] = i, other
        w.contacts += 1


# -- what is due -----------------------------------------------------------------------------------


def due_next(w: Work) -> tuple[int, int, float]:
    """Return which ball has the next event, what it is, and when (s)."""
    ball, what, first = NOTHING, NOTHING, math.inf
    for i in range(w.balls):
        if w.best_t[i] < first:
            ball, what, first = i, MEET, w.best_t[i]
        if w.wall_t[i] < first:
            ball, what, first = i, w.wall[i], w.wall_t[i]
        if w.stop_t[i] < first:
            ball, what, first = i, STOP, w.stop_t[i]
        if w.look_t[i] < first:
            ball, what, first = i, LOOK, w.look_t[i]
    return ball, what, first


def forget(w: Work, i: int) -> None:
    """Forget what is due for ball ``i``, which has a new path."""
    w.wall[i] = NOTHING
    w.wall_t[i] = w.second_t[i] = w.stop_t[i] = w.look_t[i] = math.inf
    for j in range(w.balls):
        w.due[min(i, j), max(i, j)] = math.inf


def look_for_walls(w: Work, walls: Walls, sides: Sides, i: int) -> None:
    """Predict which wall a path meets first, or where it ends."""
    path, radius = path_of(w, i), w.radius[i]
    end = math.inf
    if moves(path):
        for k in range(len(walls)):
            t = first_contact(walls[k], sides, path, radius, w.now)
            if t < w.wall_t[i]:
                w.second_t[i] = w.wall_t[i]
                w.wall_t[i], w.wall[i] = t, k
            elif t < w.second_t[i]:
                w.second_t[i] = t
        end = w.wall_t[i]
        if end < math.inf:
            end += decisions.nearly_now(radius, speed_of(path))
        elif path.end < math.inf:
            w.stop_t[i] = path.end
    w.path_end[i] = end


def look_ahead(w: Work, i: int) -> None:
    """Look at a path as far as the balls lie apart, or to its end."""
    path, end = path_of(w, i), w.path_end[i]
    far = horizon(path, w.now, w.ahead)
    w.look_t[i] = math.inf
    if far < end and far < path.end:
        w.look_t[i] = end = far
    w.end[i] = end
    put_box(w, i, box(path, w.radius[i], w.now, end))


def meet_others(w: Work, i: int, done: int) -> None:
    """Predict when ball ``i`` meets the balls whose boxes overlap its own, but not ``done``."""
    x0, y0, x1, y1 = w.box[i, 0], w.box[i, 1], w.box[i, 2], w.box[i, 3]
    b = w.box
    for j in range(w.balls):
        if j != i and j != done and b[j, 0] <= x1 and b[j, 2] >= x0:  # noqa: SIM102
            if b[j, 1] <= y1 and b[j, 3] >= y0:
                meet(w, min(i, j), max(i, j))


def meet(w: Work, i: int, j: int) -> None:
    """Predict when two balls meet on their present paths."""
    a, b = path_of(w, i), path_of(w, j)
    since = max(w.now, a.t, b.t)
    until = min(w.end[i], w.end[j])
    lasting = Lasting(contact_time(w, i, j, since), 0.0)
    noise = max(w.noise[i], w.noise[j])
    t = pair_time(a, b, w.radius[i] + w.radius[j], since, until, lasting, noise)
    w.due[i, j] = min(w.due[i, j], t)


def contact_time(w: Work, i: int, j: int, now: float) -> float:
    """Return how long (s) a persistent contact of two balls takes; 0 if they have not met."""
    if w.last[i, j] == -math.inf:
        return 0.0
    left = max(path_of(w, i).end, path_of(w, j).end) - now
    radius = min(w.radius[i], w.radius[j])
    return decisions.contact_time(now - w.met[i, j], left, radius, w.pull, False)


def rescan(w: Work, i: int) -> None:
    """Find the ball of a higher number that ball ``i`` meets first."""
    best, first = NOTHING, math.inf
    for j in range(i + 1, w.balls):
        if w.due[i, j] < first:
            best, first = j, w.due[i, j]
    w.best[i], w.best_t[i] = best, first


def refresh(w: Work, i: int) -> None:
    """Find again who meets whom first, after predictions for ball ``i`` have changed."""
    rescan(w, i)
    for k in range(i):
        if w.due[k, i] < w.best_t[k]:
            w.best[k], w.best_t[k] = i, w.due[k, i]
        elif w.best[k] == i:
            rescan(w, k)


# -- contacts of one instant -----------------------------------------------------------------------


def comes_not_alone(w: Work, walls: Walls, sides: Sides, i: int, j: int) -> bool:
    """Tell whether another contact comes at the instant of this one."""
    speed = speed_of(path_of(w, i))
    if j >= 0:
        speed = max(speed, speed_of(path_of(w, j)))
    latest = w.now + decisions.nearly_now(w.radius[i], speed)
    for k in range(w.balls):
        if w.second_t[k] <= latest:
            return True
        is_first = j < 0 and k == i
        if not is_first and w.wall_t[k] <= latest and is_wall_closed(w, walls, sides, k):
            return True
        if w.best_t[k] <= latest:
            for m in range(k + 1, w.balls):
                is_first = k == i and m == j
                if not is_first and w.due[k, m] <= latest and is_pair_closed(w, k, m):
                    return True
    return False


def is_wall_closed(w: Work, walls: Walls, sides: Sides, i: int) -> bool:
    """Tell whether a ball touches now the wall that it meets next."""
    path, radius = path_of(w, i), w.radius[i]
    if w.wall_t[i] > w.now + decisions.nearly_now(radius, speed_of(path)):
        return False
    x, y, _, _ = motion_at(path, w.now)
    side = nearest(walls[w.wall[i]], sides, x, y, radius)
    return decisions.is_closed(gap(sides[side], x, y, radius), x, y, radius)


def is_pair_closed(w: Work, i: int, j: int) -> bool:
    """Tell whether two balls touch now."""
    a, b, reach = path_of(w, i), path_of(w, j), w.radius[i] + w.radius[j]
    if w.due[i, j] > w.now + decisions.nearly_now(w.radius[i], max(speed_of(a), speed_of(b))):
        return False
    x, y, _, _ = motion_at(a, w.now)
    u, v, _, _ = motion_at(b, w.now)
    dx, dy = u - x, v - y
    return decisions.is_closed(
        math.sqrt(dx * dx + dy * dy) - w.radius[i] - w.radius[j], x, y, reach
    )


def has_many_rounds(w: Work, i: int) -> bool:
    """Count contacts at one instant, by its fastest ball; tell whether there were many."""
    path = path_of(w, i)
    length = decisions.instant(w.now, path.x, path.y, w.radius[i], speed_of(path))
    if w.now - w.instant > length:
        w.instant, w.rounds = w.now, 0
    w.rounds += 1
    return bool(w.rounds > decisions.FEW_ROUNDS)


# -- answers ---------------------------------------------------------------------------------------


def answer_hit(w: Work, walls: Walls, sides: Sides, i: int, j: int) -> bool:
    """Answer a hit of two balls; tell whether it was an ordinary one."""
    a, b = path_of(w, i), path_of(w, j)
    if has_many_rounds(w, j if speed_of(b) > speed_of(a) else i):
        return False
    x, y, ax, ay = motion_at(a, w.now)
    u, v, bx, by = motion_at(b, w.now)
    normal = unit(u - x, v - y)
    closing = approach((ax, ay), (bx, by), normal)
    least, noise, met = 0.0, max(w.noise[i], w.noise[j]), w.now
    if w.last[i, j] > -math.inf:
        time = contact_time(w, i, j, w.now)
        if decisions.lasts(w.now - w.last[i, j], time):
            if decisions.is_micro(closing, time, w.pull):
                return False
            met = w.met[i, j]
        least = decisions.least_parting(a, b, w.now, time, w.radius[i])
    e = w.cue_ball if w.cue in (i, j) else w.ball_ball
    if closing < 0.0 or not decisions.is_hit(closing, noise, least) or e * closing < least:
        return False
    pair = Pair(w.mass[i], w.mass[j], e, w.ball_friction)
    before_a, before_b = split((ax, ay), normal), split((bx, by), normal)
    if jumps(w.law, before_a, before_b, pair):
        return False
    parts_a, parts_b = ball_ball(w.law, before_a, before_b, pair)
    after_a = changed((ax, ay), before_a, parts_a, normal)
    after_b = changed((bx, by), before_b, parts_b, normal)
    if w.pull > 0.0:
        w.met[i, j], w.last[i, j] = met, w.now
    note_hit(w, i, j)
    fastest = max(squared((ax, ay)), squared((bx, by)), squared(after_a), squared(after_b))
    noise = decisions.noise_after(fastest, noise)
    is_sound = begin(w, i, (x, y), after_a, noise)
    is_sound &= begin(w, j, (u, v), after_b, noise)
    predict_two(w, walls, sides, i, j)
    return is_sound


def note_hit(w: Work, i: int, j: int) -> None:
    """Count a hit, and note whom the watched ball met."""
    w.events += 1
    w.hits += 1
    keep_contact(w, i, j)
    if w.watched in (i, j):
        other = j if i == w.watched else i
        w.meets[other] = 1
        if w.first_hit == NOTHING:
            w.first_hit = other


def predict_two(w: Work, walls: Walls, sides: Sides, i: int, j: int) -> None:
    """Predict what two balls meet that have new paths."""
    for k in (i, j):
        forget(w, k)
    for k in (i, j):
        look_for_walls(w, walls, sides, k)
    for k in (i, j):
        look_ahead(w, k)
    meet_others(w, i, i)
    meet_others(w, j, i)
    for k in (i, j):
        refresh(w, k)


def answer_cushion(w: Work, walls: Walls, sides: Sides, i: int, wall: int) -> bool:
    """Answer a hit on a cushion; tell whether it was an ordinary one."""
    if has_many_rounds(w, i):
        return False
    path = path_of(w, i)
    x, y, vx, vy = motion_at(path, w.now)
    normal = normal_of(sides[nearest(walls[wall], sides, x, y, w.radius[i])], x, y)
    closing = wall_approach((vx, vy), normal)
    if closing < 0.0 or not decisions.is_hit(closing, w.noise[i], 0.0):
        return False
    before = split((vx, vy), normal)
    parts = cushion(w.law, before, w.cushion, w.cushion_friction)
    after = changed((vx, vy), before, parts, normal)
    w.events += 1
    w.cushions += 1
    keep_contact(w, i, -1 - wall)
    noise = decisions.noise_after(max(squared((vx, vy)), squared(after)), w.noise[i])
    is_sound = begin(w, i, (x, y), after, noise)
    forget(w, i)
    look_for_walls(w, walls, sides, i)
    look_ahead(w, i)
    meet_others(w, i, i)
    refresh(w, i)
    return is_sound


def squared(v: Vector) -> float:
    """Return the square of a velocity."""
    return v[0] * v[0] + v[1] * v[1]


def begin(w: Work, i: int, place: Vector, velocity: Vector, noise: float) -> bool:
    """Set a ball off on a new path, or put it to rest; tell whether it is not lost."""
    if squared(velocity) <= noise * noise:
        velocity = (0.0, 0.0)
    path = set_off(w.now, place, velocity, w.pull)
    if moves(path):
        w.rested[i] = math.inf
        keep(w, i, path)
    elif w.rested[i] == math.inf:
        put_path(w, i, path, noise)
        stop(w, i, w.now)
    return put_path(w, i, path, noise)


def stop(w: Work, i: int, t: float) -> None:
    """Put a ball to rest at the end of its path."""
    path = path_of(w, i)
    w.events += 1
    w.rested[i] = t
    w.duration = max(w.duration, t)
    x, y, _, _ = motion_at(path, path.end)
    keep(w, i, standing(t, x, y))


def take_in(w: Work, i: int, wall: int, hole: Any) -> bool:
    """Let a pocket take a ball in, which meets nothing any more."""
    keep_contact(w, i, -1 - wall)
    x, y, vx, vy = motion_at(path_of(w, i), w.now)
    keep(w, i, Path(w.now, x, y, vx, vy, 0.0, 0.0, w.now))
    path = standing(w.now, hole.center[0], hole.center[1])
    put_path(w, i, path, 0.0)
    keep(w, i, path)
    w.events += 1
    w.pocketed[i] = hole.pocket
    w.rested[i] = w.now
    w.duration = max(w.duration, w.now)
    put_box(w, i, NOWHERE)
    forget(w, i)
    for j in range(w.balls):
        w.last[min(i, j), max(i, j)] = -math.inf
    refresh(w, i)
    return True


# -- the end ---------------------------------------------------------------------------------------


def drifts(w: Work) -> bool:
    """Tell whether a ball moves without end."""
    for i in range(w.balls):  # noqa: SIM110
        if path_of(w, i).end == math.inf:
            return True
    return False


def out_of_time(w: Work) -> int:
    """End the shot at its latest time."""
    w.now = w.duration = w.latest
    return OUT_OF_TIME


# -- beside a model --------------------------------------------------------------------------------


def compare(w: Work, model: Model, out: Out, s: int) -> None:
    """Compare the track of shot ``s`` with the model."""
    for i in range(w.balls):
        out.left[s, i] = leaves(w, model, i)
    out.same[s] = has_same_contacts(w, model)


def leaves(w: Work, model: Model, i: int) -> float:
    """Return when (s) ball ``i`` is first seen off the model's path; infinite if never."""
    knot, last = w.knot, i  # The first breakpoints are those of the start, one a ball.
    coming = following(w, last, i)
    for n in range(len(model.times)):
        t = min(model.times[n], w.duration)
        while coming < w.knots and knot[coming, 1] <= t:
            last, coming = coming, following(w, coming, i)
        k = knot[last]
        path = Path(k[1], k[2], k[3], k[4], k[5], k[6], k[7], math.inf)
        x, y, _, _ = motion_at(path, t)
        dx, dy = x - model.path[n, i, 0], y - model.path[n, i, 1]
        if math.sqrt(dx * dx + dy * dy) > model.agree:
            return float(model.times[n])
    return math.inf


def following(w: Work, last: int, i: int) -> int:
    """Return the number of the next breakpoint of ball ``i``, or that after all of them."""
    k = last + 1
    while k < w.knots and w.knot[k, 0] != i:
        k += 1
    return k


def has_same_contacts(w: Work, model: Model) -> bool:
    """Tell whether every ball met the same others in the same order as in the model."""
    for i in range(w.balls):
        w.count[i] = 0
    for c in range(w.contacts):
        i, j = w.contact[c, 0], w.contact[c, 1]
        w.count[i] += 1
        if j >= 0:
            w.count[j] += 1
            if not is_as_in(w, model, j, i, w.count[i]) or not is_as_in(w, model, i, j, w.count[j]):
                return False
        elif not is_as_in(w, model, i, j, 0):
            return False
    for i in range(w.balls):  # noqa: SIM110
        if w.count[i] != model.contacts[i]:
            return False
    return True


def is_as_in(w: Work, model: Model, i: int, other: int, place: int) -> bool:
    """Tell whether the last contact of ball ``i`` is the same in the model."""
    c = w.count[i] - 1
    if c >= model.contacts[i]:
        return False
    return bool(model.other[i, c] == other and model.place[i, c] == place)


# -- walls -----------------------------------------------------------------------------------------


def first_contact(wall: Any, sides: Sides, path: Path, r: float, now: float) -> float:
    """Return the time (s), not before now, at which a ball meets the first side of a wall."""
    first = math.inf
    for k in range(wall.first, wall.first + wall.count):
        first = min(first, time_of_contact(sides[k], path, r, now))
    return first


def nearest(wall: Any, sides: Sides, x: float, y: float, r: float) -> int:
    """Return the number of the side whose surface is nearest to a ball."""
    found, least = int(wall.first), math.inf
    if wall.count > 1:
        for k in range(wall.first, wall.first + wall.count):
            far = abs(gap(sides[k], x, y, r))
            if far < least:
                found, least = k, far
    return found
