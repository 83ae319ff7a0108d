"""This is what groups ask of those who play them, and tell them: here the contact engine.

``w`` is the engine. Compiled shots have a twin of each function (:mod:`pool_pymunk.fast.asked`),
which looks into their records. ``other`` is a ball, or -1 - the number of a wall.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine.due import What, hit_of
from pool_pymunk.engine.recorder import Begun, Persisted
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, motion_at, sets_off, standing
from pool_pymunk.physics.pieces import Piece
from pool_pymunk.physics.pressed import BALL, copy_of, look
from pool_pymunk.physics.sides import shape_of, unit
from pool_pymunk.physics.surface import Rolling, Sliding

Four = tuple[float, float, float, float]

moves_on = sets_off


# -- balls and their surface -----------------------------------------------------------------------


def path_of(w: Any, i: int) -> Path:
    """Return the path of a ball."""
    path: Path = w.paths[i]
    return path


def motion(w: Any, i: int) -> Four:
    """Return place (m) and velocity (m/s) of a ball now."""
    return motion_at(w.paths[i], w.now)


def roll_of(w: Any, i: int) -> Vector:
    """Return the roll (m/s) of a ball now."""
    roll: Vector = w.surface.roll(w.paths[i], w.now)
    return roll


def noise_of(w: Any, i: int) -> float:
    """Return how much of a ball's velocity (m/s) may be rounding."""
    return float(w.noises[i])


def radius_of(w: Any, i: int) -> float:
    """Return the radius (m) of a ball."""
    return float(w.radii[i])


def mass_of(w: Any, i: int) -> float:
    """Return the mass (kg) of a ball."""
    return float(w.masses[i])


def rolls(w: Any) -> bool:
    """Tell whether balls roll."""
    return bool(w.surface.rolls)


def pull_and_drag(w: Any) -> Vector:
    """Return the decelerations (m/s^2) of balls that slide, and of those that slow to rest."""
    return w.surface.pull, w.surface.drag if w.surface.rolls else w.surface.pull


def path_from(w: Any, place: Vector, velocity: Vector, roll: Vector) -> Path:
    """Return the path of a ball by itself from now on."""
    path: Path = w.surface.path(w.now, place, velocity, roll)
    return path


def follower(w: Any, path: Path) -> Path:
    """Return the path that follows at the end of one."""
    return w.surface.then(path) or standing(path.end, path.x, path.y)


# -- sides -----------------------------------------------------------------------------------------


def is_pocket(w: Any, sides: Any, other: int) -> bool:
    """Tell whether a ball's other side is a pocket."""
    return other < 0 and bool(w.walls[-1 - other].is_pocket)


def facing(w: Any, sides: Any, i: int, other: int) -> tuple[float, float, float]:
    """Return the normal between two sides, and how the wall bends (1/m)."""
    x, y, _, _ = motion_at(w.paths[i], w.now)
    if other >= 0:
        u, v, _, _ = motion_at(w.paths[other], w.now)
        return (*unit(u - x, v - y), 0.0)
    side = w.walls[-1 - other].nearest(x, y, w.radii[i])
    return (*side.normal(x, y), side.curvature(x, y))


def coefficients(w: Any, sides: Any, i: int, other: int) -> Vector:
    """Return restitution and friction of a contact."""
    pair = w.pair(i, other) if other >= 0 else w.walls[-1 - other]
    return pair.restitution, pair.friction


def gap_between(w: Any, sides: Any, i: int, other: int) -> float:
    """Return the distance (m) between two surfaces."""
    hit = hit_of(i, other)
    return float(w.gap(hit, w.motions([hit])))


def is_closed(w: Any, sides: Any, i: int, other: int) -> bool:
    """Tell whether a gap is closed, to rounding."""
    hit = hit_of(i, other)
    return bool(w.is_closed(hit, w.motions([hit])))


def read_shape(w: Any, sides: Any, i: int, other: int, shape: Any) -> int:
    """Read the ``shape`` of what a ball touches, and return what that is."""
    x, y, _, _ = motion_at(w.paths[i], w.now)
    r = w.radii[i]
    if other >= 0:
        shape[0] = r + w.radii[other]
        return BALL
    what, shape[:] = shape_of(w.walls[-1 - other].nearest(x, y, r), x, y, r)
    return what


def find_touching(w: Any, sides: Any, i: int) -> None:
    """Find all contacts in the cluster around a ball."""
    found = w.touching((), (i,))
    w.groups.hold(0, len(found))
    w.groups.hits = len(found)
    for k, hit in enumerate(found):
        w.groups.hit[k][:] = hit.i, hit.j if hit.kind == "pair" else -1 - hit.j


# -- what follows ----------------------------------------------------------------------------------


def lead(w: Any, i: int, path: Path) -> None:
    """Put a ball on a new path."""
    w.lead(i, path)


def begins_to_rest(w: Any, i: int, x: float, y: float) -> bool:
    """Put a ball to rest at a place (m), if it has moved; tell whether it has."""
    if w.rested[i] < math.inf:
        return False
    w.paths[i], w.speeds[i] = standing(w.now, x, y), 0.0
    w.stop(i, w.now, (x, y))
    return True


def begins_to_roll(w: Any, i: int) -> None:
    """Take note that a ball begins to roll."""
    w.tally.listed += 1
    w.recorder.roll(i, w.now)


def count_piece(w: Any) -> None:
    """Count a piece, which is no event."""
    w.tally.unlisted += 1


def push_piece(w: Any, i: int, t: float) -> None:
    """Let the piece of a ball's group end at a time (s), or the half of it."""
    w.push(t, What("piece", i))


def push_press(w: Any, i: int, t: float) -> None:
    """Let the contacts around a ball press from a time (s) on, if they persist then."""
    w.push(t, What("press", i))


def predict_loose(w: Any, sides: Any) -> None:
    """Predict what balls meet that are on new paths."""
    if w.groups.loosened:
        w.predict(())


def note_impulse(w: Any, i: int, other: int, began: float, impulse: Vector) -> None:
    """Note the impulse (N s) of a contact until now, in a piece that ``began`` at a time (s)."""
    hit, groups = hit_of(i, other), w.groups
    old = groups.persisted.get(hit)
    if old is None or old.until < began:
        w.tell(hit)
        old = Persisted(w.contact(hit, w.motions([hit])), began, began)
    x, y = impulse
    groups.persisted[hit] = old._replace(until=w.now, x=old.x + x, y=old.y + y)


def note_piece(w: Any, leader: int, piece: Piece) -> None:
    """Tell the recorder about the piece of the group in the press that begins, if it listens."""
    g, r = w.press, w.groups
    if not w.recorder.hears_pieces:
        return
    if r.is_new[leader]:
        hits = [hit_of(g.ball[g.one[k]], g.place[k]) for k in range(g.contacts)]
        contacts = [w.contact(hit, w.motions([hit])) for hit in hits]
        r.modes[leader], r.is_new[leader] = (copy_of(g), contacts), 0
    press, contacts = r.modes[leader]
    balls, state = tuple(g.ball[: g.balls]), g.state[: 6 * g.balls]
    until, ends = w.now + piece.time, (piece.fell, piece.faded)
    w.recorder.begun(Begun(w.now, until, balls, contacts, press, state, *ends))


def note_let_go(w: Any, i: int) -> None:
    """Tell the recorder that a ball has left its group."""
    w.recorder.let_go(i, w.now)


def open_gaps(g: Any, gap: float) -> None:
    """Move the balls of a press away from a wall that one of them touches, or from each other."""
    x, y = (sum(g.state[p : 6 * g.balls : 6]) / g.balls for p in (0, 1))
    look(g, g.state)
    for k in range(g.contacts - 1, -1, -1):
        if g.other[k] < 0:
            p, r = 6 * g.one[k], g.radius[g.one[k]]
            x, y = g.state[p] - r * g.normal[k][0], g.state[p + 1] - r * g.normal[k][1]
    share = gap / (2.0 * min(g.radius[: g.balls]))
    for p in range(0, 6 * g.balls, 6):
        g.state[p] += share * (g.state[p] - x)
        g.state[p + 1] += share * (g.state[p + 1] - y)


# -- room ------------------------------------------------------------------------------------------


def has_room(w: Any, balls: int, contacts: int) -> bool:
    """Have room in the press for so many balls and contacts; lists always have."""
    surface = w.surface
    w.press.hold(balls, contacts)
    w.press.own = None if isinstance(surface, Sliding | Rolling) else surface
    w.press.rolls, (w.press.pull, w.press.drag) = surface.rolls, pull_and_drag(w)
    return True


def has_room_to_wait(w: Any) -> bool:
    """Have room for another contact that waits."""
    w.groups.hold(0, w.groups.waits + 1)
    return True


def next_place(w: Any) -> int:
    """Return a new place for a contact of a group."""
    place = w.groups.used
    w.groups.used += 1
    w.groups.hold(0, w.groups.used)
    return int(place)
