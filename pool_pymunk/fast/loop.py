"""This module plays one shot after the other, in functions that numba can compile.

It does the engine's work: it calls the functions that :mod:`pool_pymunk.engine.contacts` calls with
the same numbers in the same order, so every bit of an end is the same. Contacts that come alone are
answered here, and others by :mod:`pool_pymunk.fast.together`. A shot is ``HARD``, and played by the
engine, if hits at one instant have no end, too many come at once, or a ball is lost.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions, groups
from pool_pymunk.engine.groups import begin_at, go_on, is_slow
from pool_pymunk.engine.near import NOWHERE, box, piece
from pool_pymunk.fast.asked import predict_loose
from pool_pymunk.fast.due import (
    due_next,
    forget,
    look_ahead,
    look_for_walls,
    may_roll,
    meet_others,
    note_next,
    path_of,
    predict,
    put_box,
    refresh,
    slows,
)
from pool_pymunk.fast.instant import gather, latest_of
from pool_pymunk.fast.kinds import ball_ball, curvature, cushion, gap, jumps, normal
from pool_pymunk.fast.moves import (
    begin,
    keep,
    keep_event,
    note_cushion,
    note_hit,
    path_from,
    put_on,
    roll_of,
    squared,
    stop,
)
from pool_pymunk.fast.records import (
    COLUMNS,
    MOST_BALLS,
    MOST_ROWS,
    NOTHING,
    Out,
    Shots,
    Sides,
    TableArrays,
    Tracks,
    Work,
)
from pool_pymunk.fast.together import (
    answer_alone,
    answer_together,
    has_many_rounds,
    note_met,
    take_apart,
)
from pool_pymunk.fast.walls import coefficients, nearest
from pool_pymunk.model.outline import contains
from pool_pymunk.model.places import TOUCHING, is_beside, overlap, sinks
from pool_pymunk.physics.changes import ROLL
from pool_pymunk.physics.contact import Pair, Vector, approach, changed, split, wall_approach
from pool_pymunk.physics.impulses import pushed_along, slowing
from pool_pymunk.physics.path import NOISE, Path, fastest_of, motion_at, sets_off, standing
from pool_pymunk.physics.sides import unit
from pool_pymunk.physics.surface import NO_ROLL, changed_by, roll_on, slowed_by

SETTLED, OUT_OF_TIME, HARD = 0, 1, -1  # how a shot ends; a shot that may not start is hard, too


def play_shots(
    w: Work, table: TableArrays, shots: Shots, out: Out, tracks: Tracks, first: int, last: int
) -> int:
    """Play the shots from ``first`` up to ``last``, and return how many were played.

    They are fewer if ``out.halt`` is set, or if the ``tracks`` have no room for another one.
    """
    rows = events = 0
    for s in range(first, last):
        if out.halt[0] != 0 or (w.scene.keeps and rows + MOST_ROWS > len(tracks.rows)):
            return s - first
        read_shot(w, shots, s)
        status, balls, place, off = HARD, w.scene.balls, shots.position[s], shots.is_off[s]
        may_lie = misplaced(table, place, off, shots.radius, TOUCHING, 0, balls) == balls
        if may_lie and start(w, table.sides, shots, s):
            status = play(w, table.sides)
        out.status[s] = status
        if status >= 0:
            write_shot(w, out, s)
            if w.scene.keeps:
                rows, events = write_track(w, tracks, rows, events)
        if w.scene.keeps:
            tracks.ends[s, 0], tracks.ends[s, 1] = rows, events
    return last - first


def read_shot(w: Work, shots: Shots, s: int) -> None:
    """Read which balls of shot ``s`` are off the table, its masses and its coefficients."""
    scene, c = w.scene, shots.coefficients
    low_x, low_y, high_x, high_y = NOWHERE
    for i in range(scene.balls):
        ball, x, y = w.ball[i], shots.position[s, i, 0], shots.position[s, i, 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        ball.is_off, ball.mass, ball.radius = shots.is_off[s, i], shots.mass[s, i], shots.radius[i]
    scene.ahead = piece(scene.balls, high_x - low_x, high_y - low_y)
    scene.ball_ball, scene.cue_ball, scene.cushion = c[s, 0], c[s, 1], c[s, 2]
    scene.pull, scene.cushion_friction, scene.ball_friction = c[s, 3], c[s, 4], c[s, 5]
    scene.drag = c[s, 6]


def misplaced(
    table: TableArrays, position: Any, is_off: Any, radius: Any, share: float, first: int, last: int
) -> int:
    """Return the first ball from ``first`` on that may not lie where it is, or else ``last``.

    Such a ball is off the table, in a wall or a pocket, or overlaps an earlier ball.
    """
    for i in range(first, last):
        x, y, r = float(position[i, 0]), float(position[i, 1]), float(radius[i])
        if is_off[i]:
            continue
        if len(table.xs) > 0 and not contains(table.xs, table.ys, table.arcs, x, y):
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
    """Write down the result of shot ``s``."""
    count = w.count
    for i in range(w.scene.balls):
        x = y = math.nan
        if not w.ball[i].is_off:
            x, y = last_place(w, i)
        out.final[s, i, 0], out.final[s, i, 1] = x, y
        out.pocketed[s, i], out.met[s, i] = count.pocket[i], count.met[i] != 0
    out.in_doubt[s] = w.in_doubt != 0
    out.duration[s], out.events[s] = count.duration, count.events
    out.hits[s], out.cushions[s], out.first_hit[s] = count.hits, count.cushions, count.first_hit


def last_place(w: Work, i: int) -> Vector:
    """Return where (m) a ball is at the end of a shot."""
    leader, t = w.groups.leader[i], max(w.now, w.count.duration)
    if leader != NOTHING and w.ball[i].moves:
        groups.find_state(w, leader, t)
        p = 6 * w.groups.local[i]
        return w.press.end[p], w.press.end[p + 1]
    x, y, _, _ = motion_at(path_of(w.ball[i]), t)
    return x, y


def write_track(w: Work, tracks: Tracks, rows: int, events: int) -> tuple[int, int]:
    """Write down a shot's track after those of others; return where it ends."""
    track = w.track
    for k in range(track.rows):
        for n in range(COLUMNS):
            tracks.rows[rows + k, n] = track.row[k, n]
    for k in range(track.events):
        for n in range(3):
            tracks.events[events + k, n] = track.event[k, n]
    return rows + track.rows, events + track.events


def play(w: Work, sides: Sides) -> int:
    """Play a shot to its end, and return how it ended."""
    while True:
        i, t, other_t = due_next(w)
        if t == math.inf or t > w.scene.latest:
            return end(w, t)
        w.now = max(t, w.now)
        i = first_of_all(w, i, t) if other_t == t else i
        due, is_sound = w.due[i], True
        if due.stop_t == t:
            is_sound = end_path(w, sides, i, t)
        elif due.piece_t == t:
            due.piece_t = math.inf
            note_next(w, i)
            go_on(w, sides, i)
        elif due.ball_t == t or due.wall_t == t:
            is_sound = answer(w, sides, i, due.ball if due.ball_t == t else NOTHING, other_t)
            is_full = w.track.rows + 4 * MOST_BALLS > MOST_ROWS
            is_sound &= not is_full and w.count.events < decisions.NEVER_SETTLES
        elif due.look_t == t:
            look_ahead(w, i)
            meet_others(w, sides, i, i)
            refresh(w, i)
        else:
            find_press(w, i)
            begin_at(w, sides, i)
        if not is_sound or w.groups.is_full or w.together.unlisted >= decisions.NEVER_SETTLES:
            return HARD


def first_of_all(w: Work, i: int, t: float) -> int:
    """Return the ball whose event at ``t`` (s) comes first: ends of paths, hits, then presses."""
    for k in range(w.scene.balls):
        if w.due[k].stop_t == t or w.due[k].piece_t == t:
            return k
    for k in range(i, w.scene.balls):
        due = w.due[k]
        if due.ball_t == t or due.wall_t == t or due.look_t == t:
            return k
    return i


def find_press(w: Work, i: int) -> None:
    """Find when contacts around a ball are to press after now: when their wait is over."""
    r = w.groups
    w.due[i].press_t = math.inf
    for m in range(r.waits):
        if r.asked[m] and r.wait[m][0] == i and r.until[m] > w.now:
            w.due[i].press_t = min(w.due[i].press_t, r.until[m])
    note_next(w, i)


def end_path(w: Work, sides: Sides, i: int, t: float) -> bool:
    """Let a ball rest at the end of its path, or roll on; return False if it is lost."""
    ball = w.ball[i]
    if slows(ball):
        if ball.moves:
            stop(w, i, t)
        else:  # A path's end may be due twice.
            w.due[i].stop_t = math.inf
            note_next(w, i)
        return True
    path = roll_on(path_of(ball), w.scene.drag)
    is_sound = put_on(w, i, path)
    ball.noise = NOISE * ball.speed
    if sets_off(path):
        w.count.events += 1
        keep_event(w, i, ROLL, t)
        keep(w, i, path)
    else:
        stop(w, i, t)
    predict(w, sides, (i,))
    return is_sound


def answer(w: Work, sides: Sides, i: int, j: int, other_t: float) -> bool:
    """Answer what ball ``i`` meets now, ball ``j`` or a wall; return False where that is hard.

    Other balls have their next event at ``other_t`` (s).
    """
    if may_come_together(w, i, j, other_t):
        if not gather(w, sides, i, j):
            return False
        if w.together.dues > 1:
            return is_absorbed(w, sides) or answer_together(w, sides)
    n = w.due[i].side
    if j < 0 and sides[n].pocket >= 0:
        return take_in(w, sides, i, sides[n])
    w.together.is_asked = w.groups.members
    if w.groups.members:
        if is_absorbed_alone(w, sides, i, j if j >= 0 else -1 - sides[n].first):
            return True
        take_apart(w, i, j)
    return answer_hit(w, sides, i, j) if j >= 0 else answer_cushion(w, sides, i, sides[n])


def is_absorbed(w: Work, sides: Sides) -> bool:
    """Let sides persist that close too slowly to be seen to bounce; tell whether all do so."""
    at = w.together
    for k in range(at.dues):
        i, other = at.due[k, 0], at.due[k, 1]
        is_of_pocket = other < 0 and sides[-1 - other].pocket != NOTHING
        if is_of_pocket or not groups.is_faint(w, sides, i, other):
            return False
    groups.begin_at(w, sides, at.due[0, 0])
    is_over = True
    for k in range(at.dues):
        is_over &= groups.is_absorbed(w, sides, at.due[k, 0], at.due[k, 1])
    if is_over:
        for k in range(at.dues):
            leave_out(w, sides, at.due[k, 0], at.due[k, 1])
    return is_over


def is_absorbed_alone(w: Work, sides: Sides, i: int, other: int) -> bool:
    """Let the two sides of one hit persist, if they close too slowly to be seen to bounce."""
    at = w.together
    at.dues, at.due[0, 0], at.due[0, 1] = 1, i, other
    return is_absorbed(w, sides)


def leave_out(w: Work, sides: Sides, i: int, other: int) -> None:
    """Leave a contact out that is due now."""
    due = w.due[i]
    if other >= 0 and w.pair_t[i, other] <= w.now:
        w.pair_t[i, other] = math.inf
        refresh(w, i)
    elif other < 0 and due.wall_t <= w.now:
        look_for_walls(w, sides, i)
        due.wall_t = due.wall_t if due.wall_t > w.now else math.inf
        note_next(w, i)


def may_come_together(w: Work, i: int, j: int, other_t: float) -> bool:
    """Tell whether something else may come at the instant of this contact."""
    latest, due = latest_of(w, i, j), w.due[i]
    if other_t <= latest or due.second_t <= latest or (j >= 0 and due.wall_t <= latest):
        return True
    if due.ball_t <= latest:
        for m in range(i + 1, w.scene.balls):
            if m != j and w.pair_t[i, m] <= latest:
                return True
    return False


# -- setting up ------------------------------------------------------------------------------------


def start(w: Work, sides: Sides, shots: Shots, s: int) -> bool:
    """Put the balls of shot ``s`` on their paths; tell whether that is an ordinary start."""
    clear(w)
    is_ordinary = bool(not may_roll(w.ball[0]) or w.scene.drag <= w.scene.pull)
    for i in range(w.scene.balls):
        ball, x, y = w.ball[i], shots.position[s, i, 0], shots.position[s, i, 1]
        vx = vy = wx = wy = 0.0
        if not ball.is_off:
            vx, vy = shots.velocity[s, i, 0], shots.velocity[s, i, 1]
            if may_roll(ball):
                wx, wy = shots.roll[s, i, 0], shots.roll[s, i, 1]
        path = path_from(w, 0.0, (x, y), (vx, vy), (wx, wy))
        is_ordinary &= put_on(w, i, path)
        ball.noise = NOISE * fastest_of(path)
        keep(w, i, path)
        ball.moves = sets_off(path)
        put_box(ball, NOWHERE if ball.is_off else box(path, ball.radius, 0.0, math.inf))
    for i in range(w.scene.balls):
        if w.ball[i].moves:
            predict(w, sides, (i,))
    return is_ordinary


def clear(w: Work) -> None:
    """Forget the shot before: nothing is due, and nothing has happened."""
    count, track = w.count, w.track
    w.now, w.instant, w.rounds, count.duration, w.in_doubt = 0.0, -math.inf, 0, 0.0, 0
    count.events = count.hits = count.cushions = track.rows = track.events = 0
    count.first_hit, w.together.mets, w.together.unlisted = NOTHING, 0, 0
    w.groups.coarser, w.groups.is_full = 1.0, 0
    groups.forget_all(w.groups)
    for i in range(w.scene.balls):
        due = w.due[i]
        groups.forget_ball(w.groups, i)
        count.pocket[i], count.met[i], due.ball = NOTHING, 0, NOTHING
        due.wall_t = due.second_t = due.stop_t = due.look_t = due.ball_t = math.inf
        due.piece_t = due.press_t = math.inf
        due.until = w.next_t[i] = math.inf
        for j in range(i + 1, w.scene.balls):
            w.pair_t[i, j] = math.inf


# -- answers ---------------------------------------------------------------------------------------


def answer_hit(w: Work, sides: Sides, i: int, j: int) -> bool:
    """Answer a hit of two balls; return False where that is hard."""
    a, b, scene, r = w.ball[i], w.ball[j], w.scene, w.ball[i].radius
    x, y, ax, ay = motion_at(path_of(a), w.now)
    u, v, bx, by = motion_at(path_of(b), w.now)
    along, noise = unit(u - x, v - y), max(a.noise, b.noise)
    closing = approach((ax, ay), (bx, by), along)
    may_be_faint = not w.together.is_asked and is_slow(closing, scene.pull, r)
    if may_be_faint and is_absorbed_alone(w, sides, i, j):
        return True
    has_many = has_many_rounds(w, b if b.speed > a.speed else a)
    if not note_met(w, i, j):
        return False
    e = scene.cue_ball if scene.cue in (i, j) else scene.ball_ball
    pair = Pair(a.mass, b.mass, e, scene.ball_friction)
    before_a, before_b = split((ax, ay), along), split((bx, by), along)
    if has_many or closing <= noise or jumps(scene, before_a, before_b, pair):
        return answer_alone(w, sides, i, j, has_many)
    parts_a, parts_b = ball_ball(scene, before_a, before_b, pair)
    after_a = changed((ax, ay), before_a, parts_a, along)
    after_b = changed((bx, by), before_b, parts_b, along)
    note_hit(w, i, j)
    fastest = max(squared((ax, ay)), squared((bx, by)), squared(after_a), squared(after_b))
    noise = decisions.noise_after(fastest, noise)
    is_sound = begin(w, i, (x, y), after_a, roll_of(w, i), noise)
    is_sound &= begin(w, j, (u, v), after_b, roll_of(w, j), noise)
    predict(w, sides, (i, j))
    groups.note_hit(w, i)
    groups.note_hit(w, j)
    closing = approach((a.vx, a.vy), (b.vx, b.vy), along)
    if closing >= 0.0 or is_slow(closing, scene.pull, r):
        groups.look_again(w, sides, i, j)
    return is_sound


def answer_cushion(w: Work, sides: Sides, i: int, side: Any) -> bool:
    """Answer a hit on a side of a cushion; return False where that is hard."""
    ball = w.ball[i]
    x, y, vx, vy = motion_at(path_of(ball), w.now)
    met, (e, mu) = nearest(sides, side, x, y, ball.radius), coefficients(side, w.scene)
    across, bends = normal(met, x, y), curvature(met, x, y)
    closing = wall_approach((vx, vy), across)
    strongest = w.scene.pull + abs(bends) * squared((vx, vy))
    may_be_faint = not w.together.is_asked and is_slow(closing, strongest, ball.radius)
    if may_be_faint and is_absorbed_alone(w, sides, i, -1 - side.first):
        return True
    has_many = has_many_rounds(w, ball)
    if not note_met(w, i, -1 - side.first):
        return False
    if has_many or closing <= ball.noise:
        return answer_alone(w, sides, i, -1 - side.first, has_many)
    before = split((vx, vy), across)
    parts = cushion(w.scene, before, e, mu)
    after, roll = changed((vx, vy), before, parts, across), roll_of(w, i)
    noise = decisions.noise_after(max(squared((vx, vy)), squared(after)), ball.noise)
    note_cushion(w, i, side.wall)
    if may_roll(ball):
        impulse = pushed_along(across, ball.mass, (vx, vy), after)
        push = across, slowing(mu, impulse, ball.mass)
        roll = changed_by(slowed_by(push, roll, NO_ROLL), roll)
    is_sound = begin(w, i, (x, y), after, roll, noise)
    predict(w, sides, (i,))
    groups.note_hit(w, i)
    closing = wall_approach((ball.vx, ball.vy), across)
    if closing >= 0.0 or is_slow(closing, strongest, ball.radius):
        groups.look_again(w, sides, i, -1 - side.first)
    return is_sound


def take_in(w: Work, sides: Sides, i: int, side: Any) -> bool:
    """Let a pocket take in a ball; the ball meets nothing any more."""
    ball, count = w.ball[i], w.count
    keep_event(w, i, -1 - side.wall, w.now)
    x, y, vx, vy = motion_at(path_of(ball), w.now)
    if w.groups.members:
        groups.release(w, i, 0.0)
    keep(w, i, Path(w.now, x, y, vx, vy, 0.0, 0.0, w.now, True, 0.0, 0.0))
    path = standing(w.now, side.center[0], side.center[1])
    put_on(w, i, path)
    ball.noise, ball.moves = 0.0, 0
    keep(w, i, path)
    count.events += 1
    count.pocket[i] = side.pocket
    count.duration = max(count.duration, w.now)
    put_box(ball, NOWHERE)
    forget(w, i)
    refresh(w, i)
    w.groups.loose[i] = 0
    predict_loose(w, sides)
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
