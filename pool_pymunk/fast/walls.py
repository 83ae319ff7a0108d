"""This module answers arcs, and posts of their own material, in compiled shots.

An arc presses on a ball that runs along its inside, and a roll presses a ball to any wall. Such a
ball hits the wall once in a contact time (:mod:`pool_pymunk.engine.persistent`), so each ball has a
history with each wall. A scene without arcs and such posts has no histories (``at_wall`` is empty),
and there a shot is hard if a roll may hold its ball to a cushion.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pool_pymunk.engine import decisions
from pool_pymunk.fast.due import may_roll, path_of
from pool_pymunk.fast.moves import may_be_held
from pool_pymunk.fast.records import Work
from pool_pymunk.physics.contact import Vector, closing_speed
from pool_pymunk.physics.path import NOT_MET, Persistent

# what becomes of a contact, as in the resolver; HELD: a roll may hold the ball to its cushion
MISSED, HIT, MICRO, LED, HELD = 0, 1, 2, 3, 4


class WallStage(NamedTuple):
    """A stage says how far a ball's contact with a wall has come, as in engine/persistent.py."""

    least: float  # m/s; the least bounce
    faint: float  # m/s; slower closing is no hit yet
    met: float  # s; when the ball met the wall
    last: float  # s; when it hit the wall last, 0 if it meets anew
    is_micro: bool
    time: float  # s; the contact time


class Bounce(NamedTuple):
    """A bounce says of which kind a contact with a wall is, and its restitution."""

    kind: int
    restitution: float
    parting: float  # m/s; the ball parts at this speed at least
    stage: WallStage


# -- coefficients ----------------------------------------------------------------------------------


def owns(side: Any) -> tuple[bool, bool]:
    """Tell whether a wall has its own restitution, and whether it has its own friction."""
    return len(side.own) > 0 and side.own[0] >= 0.0, len(side.own) > 0 and side.own[1] >= 0.0


def coefficients(side: Any, scene: Any) -> tuple[float, float]:
    """Return restitution and friction of a wall: its own, or those of the scene."""
    has_e, has_mu = owns(side)
    e, mu = scene.cushion, scene.cushion_friction
    return side.own[0] if has_e else e, side.own[1] if has_mu else mu


# -- histories -------------------------------------------------------------------------------------


def has_histories(w: Work) -> bool:
    """Tell whether balls have histories with walls; numba knows this when it compiles."""
    return len(w.at_wall) > 0


def forget_walls(w: Work, i: int) -> None:
    """Forget which walls ball ``i`` has met."""
    for k in range(w.scene.walls if has_histories(w) else 0):
        w.at_wall[i, k].last, w.at_wall[i, k].hits = -math.inf, 0


def may_press(w: Work, i: int, bends: float) -> bool:
    """Tell whether a wall may press on a ball for long; a straight one does where balls roll."""
    return has_histories(w) and (may_roll(w.ball[i]) or bends < 0.0)


def persistent_at(w: Work, i: int, past: Any, press: float, bends: float) -> Persistent:
    """Return how long one persistent contact with a wall takes, and what is faint in it."""
    ball, pull = w.ball[i], max(w.scene.pull, press)
    if pull == 0.0:
        return NOT_MET
    to_go = max(
        (ball.end if ball.end < math.inf else w.now) - w.now,
        decisions.turning_time(path_of(ball), bends, press),
    )
    return decisions.persistent(past, w.now, to_go, ball.radius, pull)


def stage_at(w: Work, i: int, wall: int, across: Vector, bends: float, closing: float) -> WallStage:
    """Return how far the contact of ball ``i`` with a wall has come."""
    if not may_press(w, i, bends) or w.at_wall[i, wall].last == -math.inf:
        return WallStage(0.0, 0.0, w.now, 0.0, False, 0.0)
    return stage_of_past(w, i, w.at_wall[i, wall], across, bends, closing)


def stage_of_past(
    w: Work, i: int, past: Any, across: Vector, bends: float, closing: float
) -> WallStage:
    """Return how far the contact of ball ``i`` with a wall has come, by their history."""
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


def note_bounce(w: Work, i: int, wall: int, stage: WallStage, bends: float) -> None:
    """Note a hit of a ball on a wall that may press on it."""
    if may_press(w, i, bends) and (w.scene.pull != 0.0 or bends < 0.0):
        past = w.at_wall[i, wall]
        past.hits += stage.is_micro
        past.met, past.last = stage.met, w.now


# -- hits ------------------------------------------------------------------------------------------


def bounce_of(
    w: Work, i: int, wall: int, across: Vector, bends: float, closing: float, e: float
) -> Bounce:
    """Decide whether ball ``i`` hits a wall, and whether that is a micro-collision."""
    stage, ball = stage_at(w, i, wall, across, bends, closing), w.ball[i]
    if e == 1.0 and bends < 0.0:  # Hits along an arc do not converge then.
        stage = WallStage(0.0, 0.0, stage.met, stage.last, False, stage.time)
    if not has_histories(w) and may_be_held(w, ball, across, closing, e):
        return Bounce(HELD, e, 0.0, stage)
    if closing < stage.faint or not decisions.is_hit(closing, ball.noise, stage.least):
        return Bounce(MISSED, e, 0.0, stage)
    if e * closing >= stage.least:
        return Bounce(HIT, e, 0.0, stage)
    e = max(e, min(stage.least / closing, 1.0))
    return Bounce(MICRO if stage.is_micro else HIT, e, e * closing, stage)


def look_at_wall(w: Work, one: Any) -> bool:
    """Decide what becomes of a contact with a wall; False if a roll may hold the ball there."""
    i, bends, (nx, ny) = one.a, one.curvature, one.normal
    closing = closing_speed(one, w.together.velocity)
    bounce = bounce_of(w, i, one.wall, (nx, ny), bends, closing, one.pair.restitution)
    stage = bounce.stage
    one.kind, one.parting, one.impulse = bounce.kind, bounce.parting, 0.0
    one.last, one.time, one.pair.restitution = stage.last, stage.time, bounce.restitution
    touches = closing >= -max(w.ball[i].noise, stage.least)
    if bounce.kind != MISSED:
        note_bounce(w, i, one.wall, stage, bends)
    elif touches and may_press(w, i, bends):
        begin_at_wall(w, one, (nx, ny))
    return bool(bounce.kind != HELD)


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
