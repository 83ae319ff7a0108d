"""This module finds contacts that persist in compiled shots; the engine plays these shots.

It applies the rule of :mod:`pool_pymunk.physics.persistent` to the contacts of a round once their
balls have new paths. Nearly all of them part too fast for the strongest pressing that there may be.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pool_pymunk.fast.due import may_roll, path_of
from pool_pymunk.fast.records import Work
from pool_pymunk.physics.contact import NO_BALL, Vector, closing_speed
from pool_pymunk.physics.persistent import UNSEEN, persists, pressing_of_balls, pressing_of_wall


class Place(NamedTuple):
    """A place of a wall has a normal and a curvature (1/m), as in a contact."""

    normal: Vector
    curvature: float


def parting_at(closing: float, noise: float) -> float:
    """Return how fast (m/s) two sides part: 0 if that is noise, and less if they close."""
    return -closing if abs(closing) > noise else 0.0


def is_slow(parting: float, strongest: float, radius: float) -> bool:
    """Tell whether sides part so slowly that the ``strongest`` pressing (m/s^2) may hold them."""
    return parting >= 0.0 and parting * parting < 2.0 * strongest * UNSEEN * radius


def balls_persist(w: Work, i: int, j: int, parting: float, e: float) -> bool:
    """Tell whether two balls that part at a speed (m/s) on new paths stay in contact."""
    radius = min(w.ball[i].radius, w.ball[j].radius)
    return is_slow(parting, 2.0 * w.scene.pull, radius) and are_held(w, i, j, parting, e)


def are_held(w: Work, i: int, j: int, parting: float, e: float) -> bool:
    """Tell whether what presses two balls together holds them in contact."""
    a, b = w.ball[i], w.ball[j]
    pressing = pressing_of_balls(path_of(a), path_of(b), w.now)
    return persists(parting, pressing, e, min(a.radius, b.radius))


def wall_persists(w: Work, i: int, at: Place, parting: float, e: float) -> bool:
    """Tell whether a ball that leaves a wall at a speed (m/s) on a new path stays in contact.

    A ball that only slides is pressed on to a wall only along the inside of an arc.
    """
    ball = w.ball[i]
    if at.curvature >= 0.0 and not may_roll(ball):
        return False
    strongest = w.scene.pull + abs(at.curvature) * (ball.vx * ball.vx + ball.vy * ball.vy)
    return is_slow(parting, strongest, ball.radius) and is_held(w, i, at, parting, e)


def is_held(w: Work, i: int, at: Place, parting: float, e: float) -> bool:
    """Tell whether what presses a ball on to a wall holds it in contact."""
    pressing = pressing_of_wall(path_of(w.ball[i]), at.normal, at.curvature, w.now)
    return persists(parting, pressing, e, w.ball[i].radius)


def any_persists(w: Work, contacts: Any, count: int) -> bool:
    """Tell whether one of these contacts, whose balls have new paths, persists."""
    noise = 0.0
    for k in range(count):
        for i in (contacts[k].a, contacts[k].b):
            noise = max(noise, w.ball[i].noise if i != NO_BALL else 0.0)
    for k in range(count):
        one = contacts[k]
        at, e = Place((one.normal[0], one.normal[1]), one.curvature), one.pair.restitution
        parting = parting_at(closing_speed(one, w.together.velocity), noise)
        if one.b != NO_BALL:
            if balls_persist(w, one.a, one.b, parting, e):
                return True
        elif wall_persists(w, one.a, at, parting, e):
            return True
    return False
