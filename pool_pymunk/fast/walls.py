"""This module finds the side of a wall that a ball meets, and coefficients, in compiled shots.

numba knows whether walls of a form may move when it compiles, and compiles one of two functions.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import decisions
from pool_pymunk.fast.kinds import FACE, gap, read_face, read_round, time_of_contact, where
from pool_pymunk.fast.records import MOST_MOVERS, STANDS, Sides, Work
from pool_pymunk.physics.contact import NO_BALL, Vector, usual_speed
from pool_pymunk.physics.moving import (
    Motion,
    drift_at,
    frame_at,
    nearest_at,
    put_face,
    put_round,
    sweep_at,
    time_of_meeting,
)
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.sides import away

Four = tuple[float, float, float, float]
STILL = 0.0, 0.0, 0.0, 0.0


def nearest_standing(side: Any, sides: Sides, now: float, x: float, y: float, r: float) -> Any:
    """Return the side of the same wall whose surface is nearest to a ball."""
    found, least = side.first, math.inf
    if side.last > side.first + 1:
        for k in range(side.first, side.last):
            far = away(gap(sides[k], x, y, r), sides[k].core + r)
            if far < least:
                found, least = k, far
    return sides[found]


def nearest_of_any(side: Any, sides: Sides, now: float, x: float, y: float, r: float) -> Any:
    """Return the side of a wall that is nearest; of one that moves, where it is now."""
    if side.mover[0] < 0:
        return nearest_standing(side, sides, now, x, y, r)
    how = motion_of(side)
    put(side, sides[nearest_at(sides, how, now, x, y)], frame_at(how, now))
    return side


def put(side: Any, of_body: Any, frame: Four) -> None:
    """Let the first side of a mover be one of its body's, where its frame is."""
    p, side.kind, side.core = side.numbers, of_body.kind, of_body.core
    if of_body.kind == FACE:
        (p[0], p[1]), (p[2], p[3]), (p[4], p[5]), p[6], p[7] = put_face(
            read_face(of_body.numbers), frame
        )
    else:
        (p[0], p[1]), p[2], (p[3], p[4]), (p[5], p[6]) = put_round(
            read_round(of_body.numbers), frame
        )


def motion_of(side: Any) -> Motion:
    """Return how the wall of a mover's first side moves."""
    m = side.motion
    return Motion(
        side.first + 1, side.last, m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8], m[9]
    )


# -- when a ball meets a wall ----------------------------------------------------------------------


def time_if_it_stands(side: Any, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball meets a side; never if its wall moves."""
    return float(time_of_contact(side, path, r, now)) if side.mover[0] == STANDS else math.inf


def time_at_any(side: Any, sides: Sides, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball meets a side, or a wall that moves, of which this is the first one."""
    if side.mover[0] >= 0:
        return time_of_meeting(sides, motion_of(side), path, r, now)
    return time_if_it_stands(side, path, r, now)


def time_at_one(side: Any, sides: Sides, path: Path, r: float, now: float) -> float:
    """Return when (s) a ball meets a side."""
    return float(time_of_contact(side, path, r, now))


# -- how a wall moves ------------------------------------------------------------------------------


def sweep_of_any(side: Any, sides: Sides, now: float, x: float, y: float) -> Four:
    """Return how a wall moves at a place (m)."""
    return sweep_at(sides, motion_of(side), now, x, y) if side.mover[0] >= 0 else STILL


def sweep_of_standing(side: Any, sides: Sides, now: float, x: float, y: float) -> Four:
    """Return that a wall stands."""
    return STILL


def read_motion(side: Any, now: float, row: Any) -> None:
    """Read how a wall moves now, as `read_drift` does."""
    if side.mover[0] >= 0:
        how = motion_of(side)
        x, y, _, _ = frame_at(how, now)
        row[0], row[1], row[2], row[3], row[4], row[5] = how.ux, how.uy, now, how.turns, x, y


def read_no_motion(side: Any, now: float, row: Any) -> None:
    """Do nothing: the wall stands."""


def rounding_of_any(side: Any, sides: Sides, w: Work, i: int, x: float, y: float) -> float:
    """Return how far (m) the rounding of the time may have moved a ball and a wall."""
    ux, uy, _, _ = sweep_of_any(side, sides, w.now, x, y)
    return decisions.late_by(w.now, w.ball[i].speed, ux, uy)


def no_rounding(side: Any, sides: Sides, w: Work, i: int, x: float, y: float) -> float:
    """Return that a wall stands."""
    return 0.0


nearest = where("mover", nearest_of_any, nearest_standing)
standing_time = where("mover", time_if_it_stands, time_of_contact)
meeting_time = where("mover", time_at_any, time_at_one)
sweep_of = where("mover", sweep_of_any, sweep_of_standing)
read_how = where("mover", read_motion, read_no_motion)
rounding = where("mover", rounding_of_any, no_rounding)


# -- contacts of walls that move -------------------------------------------------------------------


def drift_of_any(one: Any) -> Vector:
    """Return the drift of a contact."""
    return one.drift[0], one.drift[1]


def no_drift(one: Any) -> Vector:
    """Return that the wall of a contact stands."""
    return 0.0, 0.0


def stand(one: Any) -> None:
    """Let the wall of a contact stand."""
    one.drift[0], one.drift[1], one.mover[0] = 0.0, 0.0, STANDS


def read_mover(one: Any, w: Work, sides: Sides, i: int, other: int) -> None:
    """Read how the wall of a contact moves."""
    stand(one)
    if other < 0 and sides[-1 - other].mover[0] >= 0:
        side, place = sides[-1 - other], w.instant.place[i]
        how, here = motion_of(side), (place[0], place[1])
        one.drift[0], one.drift[1] = drift_at(sides, how, w.now, here, w.ball[i].radius)
        one.mover[0] = side.mover[0]


def reads_none(one: Any, w: Work, sides: Sides, i: int, other: int) -> None:
    """Do nothing: all walls stand."""


def speed_of_any(one: Any, at: Any, count: int) -> float:
    """Return the highest speed (m/s) in a group with walls that move, as `usual_speed` does."""
    return usual_speed(at.group, count, at.velocity)


def no_speed(one: Any, at: Any, count: int) -> float:
    """Return that no wall moves."""
    return 0.0


def drives_any(one: Any, at: Any) -> bool:
    """Tell whether a wall moves in a contact of this instant."""
    found = False
    for k in range(at.contacts):
        found |= at.contact[k].drift[0] != 0.0 or at.contact[k].drift[1] != 0.0
    return found


def drives_none(one: Any, at: Any) -> bool:
    """Tell that no wall moves."""
    return False


def count_hit(one: Any, w: Work) -> None:
    """Count a hit on a wall that moves; the engine plays on where a ball is squeezed."""
    if one.b == NO_BALL and one.mover[0] >= 0:
        k = one.a * MOST_MOVERS + one.mover[0]
        w.struck[k] += 1
        w.is_hard |= w.struck[k] >= decisions.SQUEEZED


def count_meeting(side: Any, w: Work, i: int) -> None:
    """Count that a ball meets a wall that moves; the engine plays on where that is too often."""
    if side.mover[0] >= 0:
        k = i * MOST_MOVERS + side.mover[0]
        w.met[k] += 1
        w.is_hard |= w.met[k] >= decisions.MET


def does_nothing(one: Any, *more: Any) -> None:
    """Do nothing: all walls stand."""


drift_of = where("drift", drift_of_any, no_drift)
let_stand = where("drift", stand, does_nothing)
read_moving = where("drift", read_mover, reads_none)
speed_with_walls = where("drift", speed_of_any, no_speed)
drives = where("drift", drives_any, drives_none)
note_struck = where("drift", count_hit, does_nothing)
note_meeting = where("mover", count_meeting, does_nothing)


# -- coefficients ----------------------------------------------------------------------------------


def coefficients(side: Any, scene: Any) -> tuple[float, float]:
    """Return restitution and friction of a wall: its own, or those of the scene."""
    has_e, has_mu = owns(side)
    e, mu = scene.cushion, scene.cushion_friction
    return side.own[0] if has_e else e, side.own[1] if has_mu else mu


def owns(side: Any) -> tuple[bool, bool]:
    """Tell whether a wall has its own restitution, and whether it has its own friction."""
    return len(side.own) > 0 and side.own[0] >= 0.0, len(side.own) > 0 and side.own[1] >= 0.0
