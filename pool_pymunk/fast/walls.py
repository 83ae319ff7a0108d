"""This module answers walls that differ in compiled shots: arcs, and posts of their own material.

An arc presses on a ball that runs along its inside, and a roll presses a ball to any wall. Such a
ball hits the wall once in a contact time (:mod:`pool_pymunk.engine.persistent`), so each ball has a
history with each wall. A scene without arcs and such posts has no histories (``at_wall`` is empty),
and there a shot is hard in which a roll may hold its ball to a cushion.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pool_pymunk.engine import decisions
from pool_pymunk.fast.due import may_roll, path_of
from pool_pymunk.fast.kinds import curvature, where
from pool_pymunk.fast.moves import may_be_held
from pool_pymunk.fast.records import Moving, Work
from pool_pymunk.physics.contact import Vector, closing_speed
from pool_pymunk.physics.path import NOT_MET, Persistent

MISSED, HIT, MICRO, LED = 0, 1, 2, 3  # what becomes of a contact, as in the resolver


class WallStage(NamedTuple):
    """A stage says how far a ball's contact with a wall has come, as in engine/persistent.py."""

    least: float  # m/s; the least bounce
    faint: float  # m/s; slower closing is no hit yet
    met: float  # s; when the ball met the wall
    last: float  # s; when it hit the wall last, 0 if it meets anew
    is_micro: bool
    time: float  # s; the contact time


# -- coefficients ----------------------------------------------------------------------------------


def of_side(side: Any, scene: Any) -> tuple[float, float]:
    """Return restitution and friction of a wall: its own, or those of the scene."""
    e, mu = side.own[0], side.own[1]
    return e if e >= 0.0 else scene.cushion, mu if mu >= 0.0 else scene.cushion_friction


def of_scene(side: Any, scene: Any) -> tuple[float, float]:
    """Return restitution and friction of a wall, which are those of the scene."""
    return scene.cushion, scene.cushion_friction


def its_own(side: Any) -> tuple[bool, bool]:
    """Tell whether a wall has its own restitution, and whether it has its own friction."""
    return side.own[0] >= 0.0, side.own[1] >= 0.0


def the_scenes(side: Any) -> tuple[bool, bool]:
    """Tell that a wall has no coefficients of its own."""
    return False, False


# -- histories -------------------------------------------------------------------------------------


def forget_histories(w: Work, i: int) -> None:
    """Forget what walls ball ``i`` has met."""
    for k in range(w.scene.walls):
        w.at_wall[i, k].last, w.at_wall[i, k].hits = -math.inf, 0


def forget_nothing(w: Work, i: int) -> None:
    """Forget nothing, as there are no histories."""


def may_press(ball: Moving, bends: float) -> bool:
    """Tell whether a wall may press on a ball; a straight one does where balls roll."""
    return may_roll(ball) or bends < 0.0


def persistent_at(w: Work, i: int, past: Any, press: float, bends: float) -> Persistent:
    """Return how long one persistent contact with a wall takes, and what is faint in it."""
    ball, pull, many = w.ball[i], max(w.scene.pull, press), past.hits > decisions.MANY_TIMES
    if pull == 0.0:
        return NOT_MET
    to_go = max(
        (ball.end if ball.end < math.inf else w.now) - w.now,
        decisions.turning_time(path_of(ball), bends, press),
    )
    time = decisions.contact_time(w.now - past.met, to_go, ball.radius, pull, many)
    return Persistent(time, decisions.faint(w.now - past.last, time, pull) if many else 0.0)


def stage_at(w: Work, i: int, wall: int, across: Vector, bends: float, closing: float) -> WallStage:
    """Return how far the contact of ball ``i`` with a wall has come."""
    past = w.at_wall[i, wall]
    if past.last == -math.inf or not may_press(w.ball[i], bends):
        return WallStage(0.0, 0.0, w.now, 0.0, False, 0.0)
    press = decisions.pressing(path_of(w.ball[i]), across, bends, w.now)
    time, faint = persistent_at(w, i, past, press, bends)
    least = decisions.least_off(press, time, too_slow(w, i))
    if not decisions.persists(w.now - past.last, time):
        return WallStage(least, faint, w.now, 0.0, False, time)
    is_micro = decisions.is_micro(closing, time, max(w.scene.pull, press))
    return WallStage(least, faint, past.met, past.last, is_micro, time)


def too_slow(w: Work, i: int) -> float:
    """Return the speed (m/s) at which a ball would stop before its place changes."""
    ball = w.ball[i]
    return decisions.too_slow_to_move(w.scene.pull, ball.x, ball.y, ball.radius)


def note_at_wall(w: Work, i: int, wall: int, stage: WallStage, bends: float) -> None:
    """Note a hit of a ball on a wall that may press on it."""
    if may_press(w.ball[i], bends) and (w.scene.pull != 0.0 or bends < 0.0):
        past = w.at_wall[i, wall]
        past.hits += stage.is_micro
        past.met, past.last = stage.met, w.now


# -- hits ------------------------------------------------------------------------------------------


def is_plain_bounce(
    w: Work, i: int, side: Any, place: Vector, across: Vector, closing: float, e: float
) -> bool:
    """Tell whether a ball hits a wall, and nothing presses it there; note when they met."""
    ball, (x, y) = w.ball[i], place
    bends = curvature(side, x, y)
    stage = stage_at(w, i, side.wall, across, bends, closing)
    is_lossless = e == 1.0 and bends < 0.0  # Hits along an arc do not converge then.
    least, faint = (0.0, 0.0) if is_lossless else (stage.least, stage.faint)
    if closing < faint or e * closing < least or not decisions.is_hit(closing, ball.noise, least):
        return False
    note_at_wall(w, i, side.wall, stage, bends)
    return True


def is_free_bounce(
    w: Work, i: int, side: Any, place: Vector, across: Vector, closing: float, e: float
) -> bool:
    """Tell whether a ball hits a wall, and its roll cannot hold it there."""
    ball = w.ball[i]
    is_hit = decisions.is_hit(closing, ball.noise, 0.0)
    return is_hit and not may_be_held(w, ball, across, closing, e)


def look_at_differing(w: Work, one: Any) -> bool:
    """Decide whether a contact with a wall is a hit, of which kind, and note when."""
    i, bends, e, closing = one.a, one.curvature, one.pair.restitution, closing_of(w, one)
    nx, ny = one.normal
    stage, noise = stage_at(w, i, one.wall, (nx, ny), bends, closing), w.ball[i].noise
    least, faint, is_micro = stage.least, stage.faint, stage.is_micro
    if e == 1.0 and bends < 0.0:  # Hits along an arc do not converge then.
        least, faint, is_micro = 0.0, 0.0, False
    one.kind, one.parting, one.impulse, one.last = MISSED, 0.0, 0.0, stage.last
    one.time = stage.time
    if closing < faint or not decisions.is_hit(closing, noise, least):
        if may_press(w.ball[i], bends) and closing >= -max(noise, least):
            begin_at_wall(w, one, (nx, ny))
        return True
    is_least = e * closing < least
    one.kind = MICRO if is_micro and is_least else HIT
    if is_least:
        one.pair.restitution = max(e, min(least / closing, 1.0))
        one.parting = one.pair.restitution * closing
    note_at_wall(w, i, one.wall, stage, bends)
    return True


def begin_at_wall(w: Work, one: Any, across: Vector) -> None:
    """Begin the contact of a ball that lies at a wall, if something presses it there."""
    past = w.at_wall[one.a, one.wall]
    if past.last == -math.inf:
        past.met, past.last, past.hits = w.now, w.now, 0
    press = decisions.pressing(path_of(w.ball[one.a]), across, one.curvature, w.now)
    one.time, _ = persistent_at(w, one.a, past, press, one.curvature)
    one.parting = decisions.least_off(press, one.time, too_slow(w, one.a))
    if one.parting > 0.0:
        one.kind, one.last = MICRO, w.now


def look_at_alike(w: Work, one: Any) -> bool:
    """Decide whether a contact with a wall is a hit; False if a roll may hold the ball there."""
    (nx, ny), closing, ball = one.normal, closing_of(w, one), w.ball[one.a]
    is_hit = decisions.is_hit(closing, ball.noise, 0.0)
    one.kind, one.parting = HIT if is_hit else MISSED, 0.0
    return not may_be_held(w, ball, (nx, ny), closing, one.pair.restitution)


def closing_of(w: Work, one: Any) -> float:
    """Return how fast (m/s) the two sides of a contact near each other."""
    return closing_speed(one, w.together.velocity)


coefficients = where("own", of_side, of_scene)
owns = where("own", its_own, the_scenes)
forget_walls = where("at_wall", forget_histories, forget_nothing)
is_bounce = where("at_wall", is_plain_bounce, is_free_bounce)
look_at_wall = where("at_wall", look_at_differing, look_at_alike)
