"""This module plays one shot after the other, in functions that numba can compile.

It finds what happens next in a table of pairs, as the engine does in its queue. What happens then
is answered by the engine's own functions (:mod:`pool_pymunk.engine.instants` and
:mod:`pool_pymunk.engine.modes`), so every bit of an end is the same. A shot is ``HARD``, and goes
to the engine, if too many contacts come at once, if a law answers those of rolling balls in all
orders, or if a ball is lost.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.core.floor import TOUCHING
from pool_pymunk.engine import decisions, groups, modes
from pool_pymunk.engine.borders import cross
from pool_pymunk.engine.instants import answer, end_path
from pool_pymunk.engine.modes import begin_at, go_on
from pool_pymunk.engine.near import NOWHERE, box, piece
from pool_pymunk.fast import asked  # noqa: F401  It gives functions their twins.
from pool_pymunk.fast.due import (
    due_next,
    foresee,
    forget_standing_walls,
    look_ahead,
    may_roll,
    meet_others,
    note_next,
    path_of,
    predict,
    predict_anew,
    put_box,
    refresh,
)
from pool_pymunk.fast.instant import gather, latest_of
from pool_pymunk.fast.kinds import gap
from pool_pymunk.fast.moves import keep, keep_held, path_from, put_on
from pool_pymunk.fast.places import contains, is_beside, overlap, sinks
from pool_pymunk.fast.records import (
    CHANGES,
    COLUMNS,
    HITS,
    MOST_NOTES,
    MOST_ROWS,
    MOST_TOGETHER,
    NOTHING,
    STOP,
    STOPS,
    WHOLE,
    Out,
    Shots,
    Sides,
    TableArrays,
    Tracks,
    Work,
)
from pool_pymunk.fast.walls import note_meeting
from pool_pymunk.physics.complementarity import decide
from pool_pymunk.physics.patches import patch_at
from pool_pymunk.physics.path import NOISE, fastest_of, motion_at, sets_off
from pool_pymunk.physics.pieces import part_of, piece_of
from pool_pymunk.physics.surface import NO_ROLL, roll_at

# How a shot ends. A shot that may not start is hard, too, and one that keeps all that a run tells
# is paused where there is no more room for it.
SETTLED, OUT_OF_TIME, OUT_OF_EVENTS, PAUSED, HARD = 0, 1, 2, 3, -1
# what the engine asks the press for (fast/press.py), and a table the loop (fast/live.py)
PIECE, DECIDE, END, ENTER, GO_ON, FORESEE, STATE = 1, 2, 3, 4, 5, 6, 7
Six = tuple[float, float, float, float, float, float]
ALMOST = 0.75  # of the room for tracks; what happens at one instant takes less than the rest


def play_shots(
    work: Any, table: TableArrays, shots: Shots, out: Out, tracks: Tracks, first: int, last: int
) -> int:
    """Play the shots from ``first`` up to ``last``, and return how many were played.

    They are fewer if ``out.halt`` is set, or if the ``tracks`` have no room for another one. The
    record is the only one of an array (1,), because numba takes an array over in a microsecond, and
    a record in forty.
    """
    w: Work = work[0]
    if w.scene.asks >= ENTER:
        answer_table(w, table.sides)
        return 0
    if w.scene.asks:
        answer_press(w)
        return 0
    rows = events = 0
    for s in range(first, last):
        if out.halt[0] != 0 or (w.scene.keeps == CHANGES and rows + MOST_ROWS > len(tracks.rows)):
            return s - first
        if not w.scene.resumes:
            read_shot(w, shots, s)
        status, balls, place, off = HARD, w.scene.balls, shots.position[s], shots.is_off[s]
        may_lie = misplaced(table, place, off, shots.radius, TOUCHING, 0, balls) == balls
        if w.scene.resumes or (may_lie and start(w, table.sides, shots, s)):
            status = play(w, table.sides)
        out.status[s] = status
        if status >= 0:
            write_shot(w, out, s)
            if w.scene.keeps == CHANGES:
                rows, events = write_track(w, tracks, rows, events)
        if w.scene.keeps == CHANGES:
            tracks.ends[s, 0], tracks.ends[s, 1] = rows, events
    return last - first


def answer_press(w: Work) -> None:
    """Answer what the engine asks the press, which is all that it uses of the record."""
    g, scene, found = w.press, w.scene, w.scene.answer
    if scene.asks == PIECE:
        found[0], found[1], found[2], found[3] = piece_of(g, scene.longest)
    elif scene.asks == DECIDE:
        found[0] = decide(g, g.state)
    else:
        part_of(g, scene.steps, scene.longest, scene.time)


def answer_table(w: Work, sides: Sides) -> None:
    """Enter the balls of a table, which are on their paths, or go on until a time (s).

    Where walls move, foresee whom they meet in a step. Answer with the status, with the time (s) of
    what is due next, and whether somebody is to hear; or keep the state of a ball of a group.
    """
    found, asks = w.scene.answer, w.scene.asks
    if asks == ENTER:
        clear_dues(w)
        for i in range(w.scene.balls):
            ball = w.ball[i]
            w.anew[i] = ball.moves
            if not ball.is_off:
                put_box(ball, box(path_of(ball), ball.radius, w.now, math.inf))
        predict_anew(w, sides)
    if asks == STATE:
        keep_state(w, w.scene.steps, state_in_group(w, w.scene.steps, w.scene.time))
    elif asks != GO_ON:
        foresee(w.due[0], w, sides, asks == ENTER)
    found[0] = play(w, sides) if asks == GO_ON else PAUSED
    found[0] = HARD if w.is_hard else found[0]
    _, found[1], _ = due_next(w)
    found[2] = has_told(w, found[1])


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
            x, y, _, _, _, _ = state_at(w, i, max(w.now, count.duration))
        out.final[s, i, 0], out.final[s, i, 1] = x, y
        out.pocketed[s, i], out.met[s, i] = count.pocket[i], count.met[i] != 0
    out.in_doubt[s] = w.in_doubt != 0
    out.duration[s], out.events[s] = count.duration, count.events
    out.hits[s], out.cushions[s], out.first_hit[s] = count.hits, count.cushions, count.first_hit


def state_at(w: Work, i: int, t: float) -> Six:
    """Return x, y (m), vx, vy, wx, wy (m/s) of a ball at a time (s)."""
    if w.groups.leader[i] != NOTHING and w.ball[i].moves:
        return state_in_group(w, i, t)
    x, y, vx, vy = motion_at(path_of(w.ball[i]), t)
    wx, wy = roll_at(path_of(w.ball[i]), t) if may_roll(w.ball[i]) else NO_ROLL
    return x, y, vx, vy, wx, wy


def state_in_group(w: Work, i: int, t: float) -> Six:
    """Return the same of a ball of a group."""
    groups.find_state(w, w.groups.leader[i], t)
    p, end = 6 * w.groups.local[i], w.press.end
    return end[p], end[p + 1], end[p + 2], end[p + 3], end[p + 4], end[p + 5]


def keep_state(w: Work, i: int, state: Six) -> None:
    """Keep how a ball moves."""
    last = w.last[i]
    last[0], last[1], last[2], last[3], last[4], last[5] = state


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
    track, has_played = w.track, False
    while True:
        i, t, other_t = due_next(w)
        if w.scene.asks and (t > w.scene.time or (has_played and has_told(w, t))):
            return PAUSED
        has_played = True
        if t == math.inf or t > w.scene.latest:
            return end(w, t)
        if w.count.events >= w.scene.most:
            tell_all(w)
            return OUT_OF_EVENTS
        if track.rows > ALMOST * MOST_ROWS or max(track.notes, track.pasts) > ALMOST * MOST_NOTES:
            return PAUSED if w.scene.keeps == WHOLE else HARD
        w.now = max(t, w.now)
        i = first_of_all(w, i, t) if other_t == t else i
        due = w.due[i]
        w.count.answered += due.look_t != t or due.patch_t == t
        if due.stop_t == t:
            end_path(w, sides, i)
        elif due.piece_t == t:
            due.piece_t = math.inf
            note_next(w, i)
            go_on(w, sides, i)
        elif due.patch_t == t:
            due.patch_t = due.look_t = math.inf
            note_next(w, i)
            cross(w, sides, i)
        elif due.ball_t == t or due.wall_t == t:
            answer_due(w, sides, i, due.ball if due.ball_t == t else NOTHING, other_t)
        elif due.look_t == t:
            look_ahead(w, i)
            meet_others(w, sides, i, i)
            refresh(w, i)
        else:
            find_press(w, i)
            begin_at(w, sides, i)
        if w.is_hard or w.instant.unlisted >= decisions.NEVER_SETTLES:
            return HARD


def has_told(w: Work, t: float) -> bool:
    """Tell whether somebody is to hear of what has happened, before what is due at ``t`` (s)."""
    track, r, is_told = w.track, w.groups, w.track.is_heard != 0
    if w.scene.hears & HITS and w.scene.least == 0.0:
        is_told |= track.pasts > 0
        for m in range(r.helds if t > w.now else 0):
            is_told |= not groups.holds(r, int(r.held[m][0]), int(r.held[m][1]))
    for k in range(track.events if w.scene.hears & STOPS else 0):
        is_told |= track.event[k][2] == STOP
    return bool(is_told)


def first_of_all(w: Work, i: int, t: float) -> int:
    """Return the ball whose event at ``t`` (s) comes first: ends of paths, hits, then presses."""
    for k in range(w.scene.balls):
        due = w.due[k]
        if due.stop_t == t or due.piece_t == t or due.patch_t == t:
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


def answer_due(w: Work, sides: Sides, i: int, j: int, other_t: float) -> None:
    """Answer what ball ``i`` meets now, ball ``j`` or a wall.

    Other balls have their next event at ``other_t`` (s).
    """
    at = w.instant
    at.dues, at.due[0, 0], at.due[0, 1] = 1, i, j if j >= 0 else -1 - sides[w.due[i].side].first
    if j < 0:
        note_meeting(sides[w.due[i].side], w, i)
    if may_come_together(w, i, j, other_t):
        gather(w, sides, i, j)
    if not w.is_hard:
        answer(w, sides)


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
    w.is_hard = bool(may_roll(w.ball[0]) and w.scene.drag > w.scene.pull)
    for k in range(w.scene.patches if may_roll(w.ball[0]) else 0):
        pull, drag = w.own[k][0], w.own[k][1]
        pull, drag = pull if pull >= 0.0 else w.scene.pull, drag if drag >= 0.0 else w.scene.drag
        w.is_hard |= drag > pull
    for i in range(w.scene.balls):
        ball, x, y = w.ball[i], shots.position[s, i, 0], shots.position[s, i, 1]
        vx = vy = wx = wy = 0.0
        if not ball.is_off:
            vx, vy = shots.velocity[s, i, 0], shots.velocity[s, i, 1]
            if may_roll(ball):
                wx, wy = shots.roll[s, i, 0], shots.roll[s, i, 1]
        w.groups.patch[i] = NOTHING
        if w.scene.borders > 0:
            w.groups.patch[i] = patch_at(w.border, w.scene.borders, x, y)
            w.groups.crossed[i] = -math.inf
        path = path_from(w, i, 0.0, (x, y), (vx, vy), (wx, wy))
        put_on(w, i, path)
        ball.noise = NOISE * fastest_of(path)
        keep(w, i, path)
        ball.moves = sets_off(path)
        put_box(ball, NOWHERE if ball.is_off else box(path, ball.radius, 0.0, math.inf))
    for i in range(w.scene.balls):
        if w.ball[i].moves:
            predict(w, sides, (i,))
    return bool(not w.is_hard)


def clear(w: Work) -> None:
    """Forget the shot before: nothing is due, and nothing has happened."""
    clear_dues(w)
    w.now, w.groups.helds = 0.0, 0
    w.groups.coarser, w.collapses = w.scene.coarser, 0
    groups.forget_all(w.groups)
    for i in range(w.scene.balls):
        groups.forget_ball(w.groups, i)
        w.count.pocket[i], w.count.met[i] = NOTHING, 0


def clear_dues(w: Work) -> None:
    """Let nothing be due, and nothing have happened, whatever presses."""
    count, track, at = w.count, w.track, w.instant
    at.began, count.duration, w.in_doubt, w.is_hard = -math.inf, 0.0, 0, 0
    count.answered = count.events = count.hits = count.cushions = 0
    track.rows = track.events = track.notes = track.pasts = 0
    count.first_hit, at.mets, at.rounds, at.unlisted, at.most = NOTHING, 0, 0, 0, MOST_TOGETHER
    at.is_played_out = 0
    for n in range(at.balls):
        at.is_in[at.ball[n]] = at.changed[at.ball[n]] = 0
    at.balls = 0
    for i in range(w.scene.balls):
        due = w.due[i]
        due.ball = NOTHING
        due.wall_t = due.second_t = due.stop_t = due.look_t = due.ball_t = math.inf
        due.piece_t = due.press_t = due.patch_t = math.inf
        due.until = w.next_t[i] = math.inf
        forget_standing_walls(due)
        w.anew[i] = 0
        for j in range(i + 1, w.scene.balls):
            w.pair_t[i, j] = math.inf


def end(w: Work, t: float) -> int:
    """End a shot whose next event is at ``t`` (s), and tell whether all balls rest."""
    drifts = False
    for i in range(w.scene.balls):
        drifts |= w.ball[i].end == math.inf
    is_settled = t == math.inf and not drifts
    if not is_settled:
        w.now = w.count.duration = w.scene.latest
    tell_all(w)
    return SETTLED if is_settled else OUT_OF_TIME


def tell_all(w: Work) -> None:
    """Let what lasts until the end be past, and keep how balls move then, if a run needs it."""
    if w.scene.keeps != WHOLE:
        return
    for i in range(w.scene.balls):
        if w.groups.leader[i] == i:
            groups.find_state(w, i, w.now)
            modes.note_impulses(w, w.groups.began[i])
    for m in range(w.groups.helds):
        keep_held(w, m)
    for i in range(w.scene.balls):
        keep_state(w, i, state_at(w, i, w.now))
