"""This module plays one shot after the other, in functions that numba can compile.

It is the contact engine for ordinary contacts, which come alone: it calls the functions that
:mod:`pool_pymunk.engine.contacts` calls with the same numbers in the same order, so every bit of an
end is the same. Shots are ``HARD``, and played by the engine, in which contacts of one instant come
together, a contact lasts or comes again and again, rounding decides, or a ball is lost.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions
from pool_pymunk.engine.near import NOWHERE, box, piece
from pool_pymunk.fast.due import (
    contact_time,
    due_next,
    forget,
    look_ahead,
    look_for_walls,
    meet_others,
    note_next,
    path_of,
    put_box,
    refresh,
)
from pool_pymunk.fast.kinds import ball_ball, cushion, gap, jumps, normal
from pool_pymunk.fast.records import (
    KNOT,
    MOST_KNOTS,
    NOTHING,
    Ball,
    Out,
    Shots,
    Sides,
    Table,
    Tracks,
    Work,
)
from pool_pymunk.model.outline import contains
from pool_pymunk.model.places import TOUCHING, is_beside, overlap, sinks
from pool_pymunk.physics.contact import Pair, Vector, approach, changed, split, wall_approach
from pool_pymunk.physics.path import NOISE, Path, motion_at, set_off
from pool_pymunk.physics.sides import unit

MOST_EVENTS = 1_000_000  # A shot with more events goes to the engine, which gives it up.

SETTLED, OUT_OF_TIME, HARD = 0, 1, -1  # how a shot ends; one that may not start is hard, too

is_lost = Path.is_lost


def play_shots(
    w: Work, table: Table, shots: Shots, out: Out, tracks: Tracks, first: int, last: int
) -> int:
    """Play the shots from ``first`` up to ``last``, and return how many were played.

    They are fewer if ``out.halt`` is set, or if the ``tracks`` have no room for another one.
    """
    knots = contacts = 0
    for s in range(first, last):
        if out.halt[0] != 0 or (w.scene.keeps and knots + MOST_KNOTS > len(tracks.knots)):
            return s - first
        read_shot(w, shots, s)
        status, balls, place, off = HARD, w.scene.balls, shots.position[s], shots.is_off[s]
        may_lie = misplaced(table, place, off, shots.radius, TOUCHING, 0, balls) == balls
        if may_lie and start(w, table.sides, place, shots.velocity[s]):
            status = play(w, table.sides)
        out.status[s] = status
        if status >= 0:
            write_shot(w, out, s)
            if w.scene.keeps:
                knots, contacts = write_track(w, tracks, knots, contacts)
        if w.scene.keeps:
            tracks.ends[s, 0], tracks.ends[s, 1] = knots, contacts
    return last - first


def read_shot(w: Work, shots: Shots, s: int) -> None:
    """Read what shot ``s`` has of its own: who is off the table, masses and coefficients."""
    scene, c = w.scene, shots.coefficients
    low_x, low_y, high_x, high_y = NOWHERE
    for i in range(scene.balls):
        ball, x, y = w.ball[i], shots.position[s, i, 0], shots.position[s, i, 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        ball.is_off, ball.mass, ball.radius = shots.is_off[s, i], shots.mass[s, i], shots.radius[i]
    scene.ahead = piece(scene.balls, high_x - low_x, high_y - low_y)
    scene.ball_ball, scene.cue_ball, scene.cushion = c[s, 0], c[s, 1], c[s, 2]
    scene.pull, scene.cushion_friction, scene.ball_friction = c[s, 3], c[s, 4], c[s, 5]


def misplaced(
    table: Table, position: Any, is_off: Any, radius: Any, share: float, first: int, last: int
) -> int:
    """Return the first ball from ``first`` on that may not lie where it is, or else ``last``.

    It is off the table, in a wall or a pocket, or in a ball before it.
    """
    for i in range(first, last):
        x, y, r = float(position[i, 0]), float(position[i, 1]), float(radius[i])
        if is_off[i]:
            continue
        if len(table.xs) > 0 and not contains(table.xs, table.ys, x, y):
            return i
        for k in range(len(table.sides)):
            side = table.sides[k]
            room = gap(side, x, y, r)
            size, own = (side.core, TOUCHING) if side.pocket >= 0 else (r, share)
            if room < 0.0 and is_beside(room, r, side.core) and sinks(room, size, x, y, own):
                return i
        for j in range(i):
            u, v, q = float(position[j, 0]), float(position[j, 1]), float(radius[j])
            is_near = abs(x - u) < r + q and abs(y - v) < r + q
            if is_near and not is_off[j] and overlap(x, y, r, u, v, q, share):
                return i
    return last


def write_shot(w: Work, out: Out, s: int) -> None:
    """Write down what came of shot ``s``."""
    count = w.count
    for i in range(w.scene.balls):
        x = y = math.nan
        if not w.ball[i].is_off:
            x, y, _, _ = motion_at(path_of(w.ball[i]), max(w.now, count.duration))
        out.final[s, i, 0], out.final[s, i, 1] = x, y
        out.pocketed[s, i], out.met[s, i] = count.pocket[i], count.met[i] != 0
    out.duration[s], out.events[s] = count.duration, count.events
    out.hits[s], out.cushions[s], out.first_hit[s] = count.hits, count.cushions, count.first_hit


def write_track(w: Work, tracks: Tracks, knots: int, contacts: int) -> tuple[int, int]:
    """Write down a shot's track after those of others; return where it ends."""
    track = w.track
    for k in range(track.knots):
        for n in range(KNOT):
            tracks.knots[knots + k, n] = track.knot[k, n]
    for k in range(track.contacts):
        for n in range(2):
            tracks.contacts[contacts + k, n] = track.contact[k, n]
    return knots + track.knots, contacts + track.contacts


def play(w: Work, sides: Sides) -> int:
    """Play a shot to its end, and return how it ended."""
    while True:
        i, t, other_t = due_next(w)
        if t == math.inf or t > w.scene.latest:
            return end(w, t)
        w.now = max(t, w.now)
        due = w.due[i]
        is_hit, is_wall = due.ball_t == t, due.wall_t == t
        if is_hit or is_wall:
            j = due.ball if is_hit else NOTHING
            if comes_not_alone(w, sides, i, j, other_t) or not answer(w, sides, i, j):
                return HARD
            if w.count.events >= MOST_EVENTS or w.track.knots + 8 > MOST_KNOTS:
                return HARD
        elif due.stop_t == t:
            stop(w, i, t)
        else:
            look_ahead(w, i)
            meet_others(w, i, i)
            refresh(w, i)


def answer(w: Work, sides: Sides, i: int, j: int) -> bool:
    """Answer what ball ``i`` meets, ball ``j`` or a wall; tell whether it was ordinary."""
    if j >= 0:
        return answer_hit(w, sides, i, j)
    side = sides[w.due[i].side]
    return answer_cushion(w, sides, i, side) if side.pocket < 0 else take_in(w, i, side)


# -- setting up ------------------------------------------------------------------------------------


def start(w: Work, sides: Sides, position: Any, velocity: Any) -> bool:
    """Put the balls on their way; tell whether that is an ordinary start."""
    clear(w)
    is_ordinary = True
    for i in range(w.scene.balls):
        ball, vx, vy = w.ball[i], velocity[i, 0], velocity[i, 1]
        if ball.is_off:
            vx = vy = 0.0
        path = set_off(0.0, (position[i, 0], position[i, 1]), (vx, vy), w.scene.pull)
        is_ordinary &= put_path(ball, path)
        ball.noise = NOISE * ball.speed
        keep(w, i, path)
        ball.moves = vx != 0.0 or vy != 0.0
        put_box(ball, NOWHERE if ball.is_off else box(path, ball.radius, 0.0, math.inf))
    for i in range(w.scene.balls):
        if w.ball[i].moves:
            predict(w, sides, (i,))
    return is_ordinary


def clear(w: Work) -> None:
    """Forget the shot before: nothing is due, and nothing has happened."""
    count, track = w.count, w.track
    w.now, w.instant, w.rounds, count.duration = 0.0, -math.inf, 0, 0.0
    count.events = count.hits = count.cushions = track.knots = track.contacts = 0
    count.first_hit = NOTHING
    for i in range(w.scene.balls):
        due = w.due[i]
        count.pocket[i], count.met[i], due.ball = NOTHING, 0, NOTHING
        due.wall_t = due.second_t = due.stop_t = due.look_t = due.ball_t = math.inf
        due.until = w.next_t[i] = math.inf
        for j in range(i + 1, w.scene.balls):
            w.pair_t[i, j], w.pair[i, j].last = math.inf, -math.inf


def put_path(ball: Ball, path: Path) -> bool:
    """Give a ball a new path; tell whether its contact times mean something."""
    ball.t, ball.x, ball.y, ball.vx, ball.vy, ball.ax, ball.ay, ball.end, _, _, _ = path
    ball.rest[0], ball.rest[1] = path.x, path.y
    ball.speed = math.sqrt(path.vx * path.vx + path.vy * path.vy)
    return not is_lost(path, ball.radius)


def keep(w: Work, i: int, path: Path) -> None:
    """Keep the breakpoint at which a path begins, if tracks are wanted."""
    if w.scene.keeps:
        knot = w.track.knot[w.track.knots]
        knot[0], knot[1], knot[2], knot[3] = i, path.t, path.x, path.y
        knot[4], knot[5], knot[6], knot[7] = path.vx, path.vy, path.ax, path.ay
        w.track.knots += 1


def keep_contact(w: Work, i: int, other: int) -> None:
    """Keep who met whom: a ball, or as -1 - its number a wall."""
    if w.scene.keeps:
        contact = w.track.contact[w.track.contacts]
        contact[0], contact[1] = i, other
        w.track.contacts += 1


# -- contacts of one instant -----------------------------------------------------------------------


def comes_not_alone(w: Work, sides: Sides, i: int, j: int, other_t: float) -> bool:
    """Tell whether another contact comes at the instant of this one."""
    speed = w.ball[i].speed
    if j >= 0:
        speed = max(speed, w.ball[j].speed)
    latest = w.now + decisions.nearly_now(w.ball[i].radius, speed)
    if other_t > latest:
        return has_another(w, sides, i, i, j, latest)
    for k in range(w.scene.balls):
        if w.next_t[k] <= latest and has_another(w, sides, k, i, j, latest):
            return True
    return False


def has_another(w: Work, sides: Sides, k: int, i: int, j: int, latest: float) -> bool:
    """Tell whether ball ``k`` has a contact until ``latest`` (s), besides that of ``i``."""
    due = w.due[k]
    if due.second_t <= latest:
        return True
    is_first = j < 0 and k == i
    if not is_first and due.wall_t <= latest and is_wall_closed(w, sides, k):
        return True
    if due.ball_t <= latest:
        for m in range(k + 1, w.scene.balls):
            is_first = k == i and m == j
            if not is_first and w.pair_t[k, m] <= latest and is_pair_closed(w, k, m):
                return True
    return False


def is_wall_closed(w: Work, sides: Sides, i: int) -> bool:
    """Tell whether a ball touches now the wall that it meets next."""
    ball, due = w.ball[i], w.due[i]
    x, y, _, _ = motion_at(path_of(ball), w.now)
    room = gap(nearest(sides, sides[due.side], x, y, ball.radius), x, y, ball.radius)
    is_now = due.wall_t <= w.now + decisions.nearly_now(ball.radius, ball.speed)
    return is_now and decisions.is_closed(room, x, y, ball.radius)


def is_pair_closed(w: Work, i: int, j: int) -> bool:
    """Tell whether two balls touch now."""
    a, b = w.ball[i], w.ball[j]
    x, y, _, _ = motion_at(path_of(a), w.now)
    u, v, _, _ = motion_at(path_of(b), w.now)
    dx, dy = u - x, v - y
    room = math.sqrt(dx * dx + dy * dy) - a.radius - b.radius
    latest = w.now + decisions.nearly_now(a.radius, max(a.speed, b.speed))
    return w.pair_t[i, j] <= latest and decisions.is_closed(room, x, y, a.radius + b.radius)


def has_many_rounds(w: Work, ball: Ball) -> bool:
    """Count contacts at one instant, by its fastest ball; tell whether there were many."""
    length = decisions.instant(w.now, ball.x, ball.y, ball.radius, ball.speed)
    if w.now - w.instant > length:
        w.instant, w.rounds = w.now, 0
    w.rounds += 1
    return bool(w.rounds > decisions.FEW_ROUNDS)


# -- answers ---------------------------------------------------------------------------------------


def answer_hit(w: Work, sides: Sides, i: int, j: int) -> bool:
    """Answer a hit of two balls; tell whether it was an ordinary one."""
    a, b, scene = w.ball[i], w.ball[j], w.scene
    if has_many_rounds(w, b if b.speed > a.speed else a):
        return False
    x, y, ax, ay = motion_at(path_of(a), w.now)
    u, v, bx, by = motion_at(path_of(b), w.now)
    along, noise = unit(u - x, v - y), max(a.noise, b.noise)
    closing = approach((ax, ay), (bx, by), along)
    e = scene.cue_ball if scene.cue in (i, j) else scene.ball_ball
    if not is_ordinary_hit(w, i, j, closing, noise, e):
        return False
    pair = Pair(a.mass, b.mass, e, scene.ball_friction)
    before_a, before_b = split((ax, ay), along), split((bx, by), along)
    if jumps(scene, before_a, before_b, pair):
        return False
    parts_a, parts_b = ball_ball(scene, before_a, before_b, pair)
    after_a = changed((ax, ay), before_a, parts_a, along)
    after_b = changed((bx, by), before_b, parts_b, along)
    note_hit(w, i, j)
    fastest = max(squared((ax, ay)), squared((bx, by)), squared(after_a), squared(after_b))
    noise = decisions.noise_after(fastest, noise)
    is_sound = begin(w, i, (x, y), after_a, noise)
    is_sound &= begin(w, j, (u, v), after_b, noise)
    predict(w, sides, (i, j))
    return is_sound


def is_ordinary_hit(w: Work, i: int, j: int, closing: float, noise: float, e: float) -> bool:
    """Tell whether two balls hit each other, and in no contact that lasts; note when they met."""
    a, b, pair, least, met = w.ball[i], w.ball[j], w.pair[i, j], 0.0, w.now
    if pair.last > -math.inf:
        time = contact_time(w, i, j, w.now)
        if decisions.lasts(w.now - pair.last, time):
            if decisions.is_micro(closing, time, w.scene.pull):
                return False
            met = pair.met
        least = decisions.least_parting(path_of(a), path_of(b), w.now, time, a.radius)
    if not decisions.is_hit(closing, noise, least) or e * closing < least:
        return False
    if w.scene.pull > 0.0:
        pair.met, pair.last = met, w.now
    return True


def note_hit(w: Work, i: int, j: int) -> None:
    """Count a hit, and note whom the watched ball met."""
    count, watched = w.count, w.scene.watched
    count.events += 1
    count.hits += 1
    keep_contact(w, i, j)
    if watched in (i, j):
        other = j if i == watched else i
        count.met[other] = 1
        if count.first_hit == NOTHING:
            count.first_hit = other


def predict(w: Work, sides: Sides, balls: tuple[int, ...]) -> None:
    """Predict what balls meet, one or two, that have new paths."""
    for i in balls:
        forget(w, i)
        look_for_walls(w, sides, i)
        look_ahead(w, i)
    for i in balls:
        meet_others(w, i, balls[0])
    for i in balls:
        refresh(w, i)


def answer_cushion(w: Work, sides: Sides, i: int, side: Any) -> bool:
    """Answer a hit on a cushion, by a side of it; tell whether it was an ordinary one."""
    ball = w.ball[i]
    if has_many_rounds(w, ball):
        return False
    x, y, vx, vy = motion_at(path_of(ball), w.now)
    across = normal(nearest(sides, side, x, y, ball.radius), x, y)
    if not decisions.is_hit(wall_approach((vx, vy), across), ball.noise, 0.0):
        return False
    before = split((vx, vy), across)
    parts = cushion(w.scene, before, w.scene.cushion, w.scene.cushion_friction)
    after = changed((vx, vy), before, parts, across)
    w.count.events += 1
    w.count.cushions += 1
    keep_contact(w, i, -1 - side.wall)
    noise = decisions.noise_after(max(squared((vx, vy)), squared(after)), ball.noise)
    is_sound = begin(w, i, (x, y), after, noise)
    predict(w, sides, (i,))
    return is_sound


def nearest(sides: Sides, side: Any, x: float, y: float, r: float) -> Any:
    """Return the side of the same wall whose surface is nearest to a ball."""
    found, least = side.first, math.inf
    if side.last > side.first + 1:
        for k in range(side.first, side.last):
            far = abs(gap(sides[k], x, y, r))
            if far < least:
                found, least = k, far
    return sides[found]


def squared(v: Vector) -> float:
    """Return the square of a velocity."""
    return v[0] * v[0] + v[1] * v[1]


def begin(w: Work, i: int, place: Vector, velocity: Vector, noise: float) -> bool:
    """Set a ball off on a new path, or put it to rest; tell whether it is not lost."""
    ball = w.ball[i]
    if squared(velocity) <= noise * noise:
        velocity = (0.0, 0.0)
    path = set_off(w.now, place, velocity, w.scene.pull)
    is_sound = put_path(ball, path)
    ball.noise = noise
    if path.vx != 0.0 or path.vy != 0.0:
        ball.moves = 1
        keep(w, i, path)
    elif ball.moves:
        stop(w, i, w.now)
    return is_sound


def stop(w: Work, i: int, t: float) -> None:
    """Put a ball to rest at the end of its path."""
    ball, count = w.ball[i], w.count
    x, y, _, _ = motion_at(path_of(ball), ball.end)
    ball.moves, ball.rest[0], ball.rest[1], w.due[i].stop_t = 0, x, y, math.inf
    note_next(w, i)
    count.events += 1
    count.duration = max(count.duration, t)
    rests = set_off(t, (x, y), (0.0, 0.0), 0.0)
    put_box(ball, box(rests, ball.radius, t, math.inf))
    keep(w, i, rests)


def take_in(w: Work, i: int, side: Any) -> bool:
    """Let a pocket take a ball in, which meets nothing any more."""
    ball, count = w.ball[i], w.count
    keep_contact(w, i, -1 - side.wall)
    x, y, vx, vy = motion_at(path_of(ball), w.now)
    keep(w, i, Path(w.now, x, y, vx, vy, 0.0, 0.0, w.now))
    path = set_off(w.now, (side.center[0], side.center[1]), (0.0, 0.0), 0.0)
    put_path(ball, path)
    ball.noise, ball.moves = 0.0, 0
    keep(w, i, path)
    count.events += 1
    count.pocket[i] = side.pocket
    count.duration = max(count.duration, w.now)
    put_box(ball, NOWHERE)
    forget(w, i)
    for j in range(w.scene.balls):
        w.pair[min(i, j), max(i, j)].last = -math.inf
    refresh(w, i)
    return True


def end(w: Work, t: float) -> int:
    """End a shot whose next event is at ``t`` (s), and tell whether all balls rest."""
    drifts = False
    for i in range(w.scene.balls):
        drifts |= w.ball[i].end == math.inf
    if t == math.inf and not drifts:
        return SETTLED
    w.now = w.count.duration = w.scene.latest
    return OUT_OF_TIME
