"""This module sets balls of compiled shots off on new paths, and writes down what they meet."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine.near import box
from pool_pymunk.fast.due import note_next, path_of, put_box
from pool_pymunk.fast.kinds import gap
from pool_pymunk.fast.records import NOTHING, Moving, Sides, Work
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, motion_at, set_off

is_lost = Path.is_lost


def put_path(ball: Moving, path: Path) -> bool:
    """Give a ball a new path; tell whether its contact times mean something."""
    ball.t, ball.x, ball.y, ball.vx, ball.vy, ball.ax, ball.ay, ball.end, _, _, _ = path
    ball.rest[0], ball.rest[1] = path.x, path.y
    ball.speed = math.sqrt(path.vx * path.vx + path.vy * path.vy)
    return not is_lost(path, ball.radius)


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
    ball.rested = t
    count.events += 1
    count.duration = max(count.duration, t)
    rests = set_off(t, (x, y), (0.0, 0.0), 0.0)
    put_box(ball, box(rests, ball.radius, t, math.inf))
    keep(w, i, rests)


def keep(w: Work, i: int, path: Path) -> None:
    """Keep the breakpoint at which a path begins, if tracks are wanted."""
    if w.scene.keeps:
        row = w.track.row[w.track.rows]
        row[0], row[1], row[2], row[3] = i, path.t, path.x, path.y
        row[4], row[5], row[6], row[7] = path.vx, path.vy, path.ax, path.ay
        w.track.rows += 1


def keep_contact(w: Work, i: int, other: int) -> None:
    """Keep who met whom: a ball, or as -1 - its number a wall."""
    if w.scene.keeps:
        contact = w.track.contact[w.track.contacts]
        contact[0], contact[1] = i, other
        w.track.contacts += 1


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
