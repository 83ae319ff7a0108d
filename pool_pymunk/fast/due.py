"""This module predicts what is due in a compiled shot, as the contact engine does in its queue."""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions
from pool_pymunk.engine.borders import next_crossing
from pool_pymunk.engine.groups import holds
from pool_pymunk.engine.near import box, horizon
from pool_pymunk.engine.persisting import takes
from pool_pymunk.fast.kinds import where
from pool_pymunk.fast.records import NOTHING, Moving, Sides, Work
from pool_pymunk.fast.walls import does_nothing, meeting_time, standing_time
from pool_pymunk.physics.pairs import pair_time
from pool_pymunk.physics.path import Path


def may_roll(ball: Moving) -> bool:
    """Tell whether balls of this scene roll; numba knows this when it compiles."""
    return len(ball.roll) > 0


def slows(ball: Moving) -> bool:
    """Tell whether a ball's path slows."""
    return bool(ball.slows != 0)


def path_of(ball: Moving) -> Path:
    """Return the path of a ball."""
    b = ball
    if not may_roll(b):
        return Path(b.t, b.x, b.y, b.vx, b.vy, b.ax, b.ay, b.end, slows(b), 0.0, 0.0)
    return Path(b.t, b.x, b.y, b.vx, b.vy, b.ax, b.ay, b.end, slows(b), b.roll[0], b.roll[1])


def put_box(ball: Moving, found: tuple[float, float, float, float]) -> None:
    """Give a ball a new box."""
    ball.box[0], ball.box[1], ball.box[2], ball.box[3] = found


# -- what is due next ------------------------------------------------------------------------------


def due_next(w: Work) -> tuple[int, float, float]:
    """Return the next event's ball and time (s), and the time of any other ball's next event."""
    ball, first, second = NOTHING, math.inf, math.inf
    for i in range(w.scene.balls):
        t = w.next_t[i]
        if t < first:
            ball, first, second = i, t, first
        elif t < second:
            second = t
    return ball, first, second


def note_next(w: Work, i: int) -> None:
    """Note when ball ``i`` has its next event."""
    due = w.due[i]
    soonest = min(min(due.ball_t, due.wall_t), min(due.stop_t, due.look_t))
    w.next_t[i] = min(soonest, min(due.piece_t, due.press_t))


def forget(w: Work, i: int) -> None:
    """Forget what is due for ball ``i``, which has a new path."""
    due = w.due[i]
    due.side = NOTHING
    due.wall_t = due.second_t = due.stop_t = due.look_t = due.patch_t = math.inf
    for k in range(w.scene.balls):
        w.pair_t[min(i, k), max(i, k)] = math.inf


def rescan(w: Work, i: int) -> None:
    """Find the ball of a higher number that ball ``i`` meets first."""
    ball, first = NOTHING, math.inf
    for j in range(i + 1, w.scene.balls):
        t = w.pair_t[i, j]
        if t < first:
            ball, first = j, t
    w.due[i].ball, w.due[i].ball_t = ball, first
    note_next(w, i)


def refresh(w: Work, i: int) -> None:
    """Find again who meets whom first, after predictions for ball ``i`` have changed."""
    rescan(w, i)
    for k in range(i):
        t, due = w.pair_t[k, i], w.due[k]
        if t < due.ball_t:
            due.ball, due.ball_t = i, t
            note_next(w, k)
        elif due.ball == i:
            rescan(w, k)


# -- predictions -----------------------------------------------------------------------------------


def look_for_walls(w: Work, sides: Sides, i: int, after: float) -> None:
    """Predict a path's first wall and when it meets a second; if it meets none, its end.

    Walls that it meets up to ``after`` (s) do not count: they are answered.
    """
    ball, due = w.ball[i], w.due[i]
    path, found, wall, first, second = path_of(ball), NOTHING, NOTHING, math.inf, math.inf
    due.path_end = due.patch_t = math.inf
    if ball.speed > 0.0:
        for k in range(len(sides)):
            if holds(w.groups, i, -1 - sides[k].first):
                continue
            t = standing_time(sides[k], path, ball.radius, w.now)
            if t < first:
                second = second if sides[k].wall == wall else first
                found, wall, first = k, sides[k].wall, t
            elif t < second and sides[k].wall != wall:
                second = t
        if first <= after or (first < math.inf and may_press(w, i, i, first)):
            found, first, second = not_taken(w, sides, i, after)
    found, first, second = with_movers(due, w, sides, i, after, (found, first, second))
    if ball.speed > 0.0:
        if first < math.inf:
            due.path_end = first + decisions.nearly_now(ball.radius, ball.speed)
        elif ball.end < math.inf and w.groups.leader[i] == NOTHING:
            due.stop_t = ball.end
        if w.scene.borders > 0:
            look_for_border(w, i)
    due.side, due.wall_t, due.second_t = found, first, second


def look_for_border(w: Work, i: int) -> None:
    """Predict when a ball crosses into another patch; it does not stop before that."""
    due = w.due[i]
    due.patch_t = next_crossing(w, i)
    if due.patch_t < math.inf:
        due.stop_t = math.inf
        due.path_end, due.look_t = min(due.path_end, due.patch_t), min(due.look_t, due.patch_t)


def not_taken(w: Work, sides: Sides, i: int, after: float) -> tuple[int, float, float]:
    """Return a path's first wall and second wall, without those that a ball is pressed on to."""
    ball = w.ball[i]
    path, found, first, second = path_of(ball), NOTHING, math.inf, math.inf
    for n in range(len(sides)):
        if sides[n].first != n or holds(w.groups, i, -1 - n):
            continue
        side, soonest = n, math.inf
        for k in range(n, sides[n].last):
            t = standing_time(sides[k], path, ball.radius, w.now)
            if t < soonest:
                side, soonest = k, t
        is_taken = soonest < math.inf and may_press(w, i, i, soonest)
        if soonest <= after or (is_taken and takes(w, sides, i, -1 - n, soonest)):
            continue
        if soonest < first:
            found, first, second = side, soonest, first
        elif soonest < second:
            second = soonest
    return found, first, second


# -- walls that move -------------------------------------------------------------------------------


def join_movers(
    due: Any, w: Work, sides: Sides, i: int, after: float, walls: tuple[int, float, float]
) -> tuple[int, float, float]:
    """Return a path's first wall and second wall, of those that stand and those that move.

    Keep those that stand: the others have another motion in the next step.
    """
    found, first, second = walls
    due.standing[0], due.standing[1], due.standing[2] = found, first, second
    ball = w.ball[i]
    path = path_of(ball)
    for n in range(len(sides)):
        if sides[n].mover[0] < 0 or holds(w.groups, i, -1 - n):
            continue
        t = meeting_time(sides[n], sides, path, ball.radius, w.now)
        is_taken = t < math.inf and may_press(w, i, i, t)
        if t <= after or (is_taken and takes(w, sides, i, -1 - n, t)):
            continue
        if t < first:
            found, first, second = n, t, first
        elif t < second:
            second = t
    return found, first, second


def join_none(
    due: Any, w: Work, sides: Sides, i: int, after: float, walls: tuple[int, float, float]
) -> tuple[int, float, float]:
    """Return a path's first wall and second wall, which stand."""
    return walls


def foresee_movers(due: Any, w: Work, sides: Sides, only_resting: bool) -> None:
    """Predict when balls meet walls that move in the step that begins."""
    for i in range(w.scene.balls):
        due, is_there = w.due[i], w.ball[i].box[0] <= w.ball[i].box[2]
        if is_there and not (only_resting and w.ball[i].moves):
            walls = int(due.standing[0]), due.standing[1], due.standing[2]
            due.side, due.wall_t, due.second_t = join_movers(due, w, sides, i, -math.inf, walls)
            note_next(w, i)


def forget_standing(due: Any) -> None:
    """Forget which standing walls a ball meets."""
    due.standing[0], due.standing[1], due.standing[2] = NOTHING, math.inf, math.inf


with_movers = where("standing", join_movers, join_none)
foresee = where("standing", foresee_movers, does_nothing)
forget_standing_walls = where("standing", forget_standing, does_nothing)


# -- other balls -----------------------------------------------------------------------------------


def look_ahead(w: Work, i: int) -> None:
    """Put a box around a path up to its end, or to the length ``ahead`` (m) at most."""
    ball, due = w.ball[i], w.due[i]
    path, end = path_of(ball), due.path_end
    far = horizon(path, w.now, w.scene.ahead)
    due.look_t = due.patch_t
    if far < end and far < ball.end:
        due.look_t = end = far
    due.until = end
    put_box(ball, box(path, ball.radius, w.now, end))


def meet_others(w: Work, sides: Sides, i: int, done: int) -> None:
    """Predict when ball ``i`` meets balls (not ball ``done``) whose boxes overlap its own."""
    own = w.ball[i].box
    x0, y0, x1, y1 = own[0], own[1], own[2], own[3]
    for j in range(w.scene.balls):
        other = w.ball[j].box
        if (
            other[0] <= x1 and other[2] >= x0 and other[1] <= y1 and other[3] >= y0
            and j != i and j != done
        ):  # fmt: skip
            meet(w, sides, min(i, j), max(i, j))


def meet(w: Work, sides: Sides, i: int, j: int) -> None:
    """Predict when two balls meet."""
    if holds(w.groups, i, j):
        return
    a, b = w.ball[i], w.ball[j]
    until, noise = min(w.due[i].until, w.due[j].until), max(a.noise, b.noise)
    t = pair_time(path_of(a), path_of(b), a.radius + b.radius, w.now, until, noise)
    if t < math.inf and not (may_press(w, i, j, t) and takes(w, sides, i, j, t)):
        w.pair_t[i, j] = min(w.pair_t[i, j], t)


def may_press(w: Work, i: int, j: int, t: float) -> bool:
    """Tell whether a hit at ``t`` (s) may be of sides that are held together, or of groups."""
    speed = max(w.ball[i].speed, w.ball[j].speed)
    is_soon = not (t - w.now) * speed > decisions.SOON * w.ball[i].radius
    return is_soon or bool(w.groups.members + w.groups.waits > 0)


def predict(w: Work, sides: Sides, balls: tuple[int, ...]) -> None:
    """Predict what one or two balls on new paths meet, and those of groups that came apart."""
    if w.groups.loosened:
        for i in balls:
            w.anew[i] = 1
        predict_anew(w, sides)
        return
    for i in balls:
        forget(w, i)
        look_for_walls(w, sides, i, -math.inf)
        look_ahead(w, i)
    for i in balls:
        meet_others(w, sides, i, balls[0])
    for i in balls:
        refresh(w, i)


def predict_anew(w: Work, sides: Sides) -> None:
    """Predict what the balls meet that are ``anew`` on their paths, or that came apart."""
    r = w.groups
    for m in range(r.loosened):
        i = r.out[m]
        w.anew[i] |= r.loose[i]
        r.loose[i] = 0
    r.loosened = 0
    for i in range(w.scene.balls):
        if w.anew[i]:
            forget(w, i)
            look_for_walls(w, sides, i, -math.inf)
            look_ahead(w, i)
    for i in range(w.scene.balls):
        if w.anew[i]:
            meet_others(w, sides, i, i)
    for i in range(w.scene.balls):
        if w.anew[i]:
            refresh(w, i)
            w.anew[i] = 0
