"""This module sets balls of compiled shots off on new paths, and writes down what they meet."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine.near import box
from pool_pymunk.fast.due import may_roll, note_next, path_of, put_box
from pool_pymunk.fast.records import (
    COLUMNS,
    MOST_NOTES,
    MOST_ROWS,
    NOTHING,
    STOP,
    WHOLE,
    Moving,
    Work,
)
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, bound_of, motion_at, set_off, standing
from pool_pymunk.physics.surface import NO_ROLL, roll_at, slide_or_roll

is_lost = Path.is_lost


def put_on(w: Work, i: int, path: Path) -> None:
    """Put ball ``i`` on a new path, for which nothing is due yet."""
    due, r = w.due[i], w.groups
    due.piece_t = due.press_t = math.inf
    for m in range(r.waits):
        r.asked[m] &= r.wait[m][0] != i
    w.is_hard |= not put_path(w.ball[i], path)


def put_path(ball: Moving, path: Path) -> bool:
    """Give a ball a new path; return False if the ball is lost."""
    ball.t, ball.x, ball.y, ball.vx, ball.vy, ball.ax, ball.ay, ball.end, _, _, _ = path
    ball.slows = path.slows
    if may_roll(ball):
        ball.roll[0], ball.roll[1] = path.wx, path.wy
    ball.speed = bound_of(path)
    return not is_lost(path, ball.radius)


def path_from(w: Work, i: int, t: float, place: Vector, velocity: Vector, roll: Vector) -> Path:
    """Return the path of a ball on the surface where it is."""
    pull, drag = pull_and_drag(w, i)
    if may_roll(w.ball[0]):
        return slide_or_roll(t, place, velocity, roll, pull, drag)
    return set_off(t, place, velocity, pull)


def pull_and_drag(w: Work, i: int) -> Vector:
    """Return the decelerations (m/s^2) of a ball where it slides, and where it slows to rest."""
    patch, pull, drag = w.groups.patch[i], w.scene.pull, w.scene.drag
    if patch != NOTHING:
        pull = w.own[patch][0] if w.own[patch][0] >= 0.0 else pull
        drag = w.own[patch][1] if w.own[patch][1] >= 0.0 else drag
    return pull, drag if may_roll(w.ball[0]) else pull


def roll_of(w: Work, i: int) -> Vector:
    """Return the roll (m/s) of ball ``i`` now."""
    return roll_at(path_of(w.ball[i]), w.now) if may_roll(w.ball[i]) else NO_ROLL


def stop(w: Work, i: int, t: float) -> None:
    """Put a ball to rest at the end of its path."""
    ball, count = w.ball[i], w.count
    x, y, _, _ = motion_at(path_of(ball), ball.end)
    ball.moves, w.due[i].stop_t = 0, math.inf
    note_next(w, i)
    count.events += 1
    count.duration = max(count.duration, t)
    keep_event(w, i, STOP, t)
    rests = standing(t, x, y)
    put_box(ball, box(rests, ball.radius, t, math.inf))
    keep(w, i, rests)


def keep(w: Work, i: int, path: Path) -> None:
    """Keep the breakpoint at which a path begins, if tracks are kept."""
    if w.track.rows == MOST_ROWS:
        w.is_hard = 1
    elif w.scene.keeps:
        row = w.track.row[w.track.rows]
        row[0], row[1], row[2], row[3] = i, path.t, path.x, path.y
        row[4], row[5], row[6], row[7] = path.vx, path.vy, path.ax, path.ay
        row[8], row[9] = path.wx, path.wy
        w.track.rows += 1


def keep_event(w: Work, i: int, other: int, t: float) -> None:
    """Keep what ball ``i`` met at ``t`` (s), with its number."""
    if w.track.events == 2 * MOST_ROWS:
        w.is_hard = 1
    elif w.scene.keeps:
        event = w.track.event[w.track.events]
        event[0], event[1], event[2], event[6] = t, i, other, w.track.rows
        w.track.events += 1


def note_hit(w: Work, i: int, j: int) -> None:
    """Count a hit, and note whom the watched ball met."""
    count, watched = w.count, w.scene.watched
    count.events += 1
    count.hits += 1
    keep_event(w, i, j, w.now)
    if watched in (i, j):
        other = j if i == watched else i
        count.met[other] = 1
        if count.first_hit == NOTHING:
            count.first_hit = other


def note_cushion(w: Work, i: int, wall: int) -> None:
    """Count a hit on a cushion."""
    w.count.events += 1
    w.count.cushions += 1
    keep_event(w, i, -1 - wall, w.now)


def keep_impulse(w: Work, impulse: Any) -> None:
    """Keep the impulses (N s) of the last event."""
    if w.scene.keeps == WHOLE and w.track.events > 0:
        event = w.track.event[w.track.events - 1]
        event[3], event[4], event[5] = impulse[0], impulse[1], impulse[2]


def keep_note(w: Work, i: int, j: int) -> None:
    """Keep a note of two balls, or NOTHING twice, now."""
    track = w.track
    if w.scene.keeps != WHOLE:
        return
    if track.notes == MOST_NOTES:
        w.is_hard = 1
        return
    note = track.note[track.notes]
    note[0], note[1], note[2] = w.now, i, j
    track.notes += 1


def keep_held(w: Work, m: int) -> None:
    """Let a persistent contact be past."""
    track = w.track
    if track.pasts == MOST_NOTES:
        w.is_hard = 1
        return
    for n in range(COLUMNS):
        track.past[track.pasts][n] = w.groups.held[m][n]
    track.pasts += 1
