"""This is what instants and groups ask of those who play them, and tell them: here the engine.

``w`` is the engine. Compiled shots have a twin of each function (:mod:`pool_pymunk.fast.asked`),
which looks into their records. ``other`` is a ball, or -1 - the number of a wall.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from pool_pymunk.engine.due import What, ends_of, hit_of
from pool_pymunk.engine.policies import velocity_after
from pool_pymunk.engine.recorder import Persisted
from pool_pymunk.physics import collapse
from pool_pymunk.physics.collapse import Collapse
from pool_pymunk.physics.complementarity import decide
from pool_pymunk.physics.contact import (
    NO_BALL,
    Contact,
    Vector,
    Velocities,
    speed_in,
    usual_speed,
)
from pool_pymunk.physics.impulses import Call, Impulse, Shared, numbers_of, slowing
from pool_pymunk.physics.laws import Coulomb, Law, Slip, respond, solves_at_once
from pool_pymunk.physics.patches import crossing
from pool_pymunk.physics.path import Path, motion_at, sets_off, standing
from pool_pymunk.physics.pieces import Piece, part_of, piece_of
from pool_pymunk.physics.pressed import BALL, Press
from pool_pymunk.physics.sides import shape_of, unit
from pool_pymunk.physics.surface import NO_ROLL, Rolling, Sliding
from pool_pymunk.physics.together import Rows, at_once

STANDS = 0.0, 0.0  # m/s; the drift of a wall that does not move
# A ball is jammed if a wall would give it so many times the highest speed before. In a corner that
# closes, the law gives ever higher speeds.
SQUIRTS = 10.0
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


def speed_of(w: Any, i: int) -> float:
    """Return the highest speed (m/s) of a ball on its path."""
    return float(w.speeds[i])


def velocity_of(w: Any, i: int) -> Vector:
    """Return the velocity (m/s) with which a ball began its path."""
    path = w.paths[i]
    return path.vx, path.vy


def rolls(w: Any) -> bool:
    """Tell whether balls roll."""
    return bool(w.surface.rolls)


def pull_of(w: Any) -> float:
    """Return the largest deceleration (m/s^2) of balls that slide anywhere."""
    return float(w.pull)


def pull_and_drag(w: Any, i: int) -> Vector:
    """Return the decelerations (m/s^2) of a ball where it slides, and where it slows to rest."""
    surface = w.surfaces[i]
    return surface.pull, surface.drag if surface.rolls else surface.pull


def path_from(w: Any, i: int, place: Vector, velocity: Vector, roll: Vector) -> Path:
    """Return the path of a ball by itself from now on."""
    path: Path = w.surfaces[i].path(w.now, place, velocity, roll)
    return path


def follower(w: Any, i: int, path: Path) -> Path:
    """Return the path of a ball that follows at the end of one."""
    return w.surfaces[i].then(path) or standing(path.end, path.x, path.y)


def is_at_its_end(w: Any, path: Path) -> bool:
    """Tell whether a ball rests at the end of a path."""
    return w.surface.then(path) is None


def roll_after(w: Any, i: int) -> Vector:
    """Return the roll (m/s) of a ball after the cushions of a round have slowed it."""
    at, surface = w.instant, w.surface
    if not surface.rolls:
        return NO_ROLL
    pushes = []
    for n in range(at.turns):
        k = at.turn[n]
        one = at.contact[k]
        if one.a == i and one.b == NO_BALL and at.kind[k]:
            pushes.append((one.normal, slowing(one.pair.friction, at.impulse[k][0], one.pair.m_a)))
    roll: Vector = surface.roll(w.paths[i], w.now, pushes)
    return roll


# -- contacts and their law ------------------------------------------------------------------------


def law_of(w: Any) -> Law:
    """Return the law that answers the contacts."""
    law: Law = w.law
    return law


def slip_of(w: Any) -> Slip:
    """Return what stands for a slip that is rounding, where the law jumps."""
    slip: Slip = w.slip
    return slip


def kick_of(w: Any, k: int) -> float:
    """Return by how much (m/s) a wall kicks the ball that has hit it."""
    at = w.instant
    at.kick[k] = kick = w.kick_at(at.contact[k])
    return float(kick)


def read_contact(w: Any, sides: Any, k: int, i: int, other: int) -> Contact:
    """Read a contact of balls whose places are known, and return it."""
    at = w.instant
    contact = at.contact[k] = w.contact_at(i, other, at.place)
    return contact  # type: ignore[no-any-return]


def answer_group(w: Any, count: int) -> None:
    """Answer the contacts of a ``group``, which share balls, and keep their impulses."""
    at, calls = w.instant, list[Call]()
    contacts = [at.group[m] for m in range(count)]
    before = {i: at.velocity[i] for contact in contacts for i in contact.balls}
    after = dict(before)
    both = at_once(contacts, after) if solves_at_once(w.law) else None
    is_known = both is not None or not solves_at_once(w.law)
    if has_no_room(contacts, before, after, is_known):
        answer_without_movers(w, count, before)
        return
    if both is not None:
        found = [(normal, along, -along) for normal, along in zip(*both, strict=True)]
    else:
        w.law.together(contacts, after, partial(respond_and_note, w, calls))
        shared = Shared(contacts, before, after, calls)
        found = [numbers_of(shared.impulse(one)) for one in contacts if not at.is_played_out]
    at.velocity.update(after)
    at.impulse.update({at.member[m]: impulse for m, impulse in enumerate(found)})


def has_no_room(
    contacts: list[Contact], before: Velocities, after: Velocities, is_answered: bool
) -> bool:
    """Tell whether walls that move leave balls no room, or throw them out too fast."""
    count = len(contacts)
    usual = usual_speed(contacts, count, before)
    return usual > 0.0 and (not is_answered or speed_in(contacts, count, after) > SQUIRTS * usual)


def answer_without_movers(w: Any, count: int, before: Velocities) -> None:
    """Answer a ``group`` without its walls that move, which go through their balls."""
    at = w.instant
    standing = list[Contact]()
    for m in range(count):
        contact, at.impulse[at.member[m]] = at.group[m], (0.0, 0.0, 0.0)
        if contact.drift == STANDS:
            standing.append(contact)
        elif contact.cushion in w.movers:
            w.jam((contact.a, w.movers[contact.cushion]))
    after = dict(before)
    if standing:
        w.law.together(standing, after, partial(respond, w.law))
    at.velocity.update(after)


def respond_and_note(w: Any, calls: list[Call], contact: Contact, velocity: Velocities) -> None:
    """Answer one contact by the law, and note the call, and whether the law jumps there."""
    at, before = w.instant, [velocity[i] for i in contact.balls]
    jumps = respond(w.law, contact, velocity, w.slip)
    if not at.is_played_out:
        calls.append((contact, before, [velocity[i] for i in contact.balls]))
    for k in range(at.contacts if jumps else 0):
        at.jumped[k] |= at.contact[k][:3] == contact[:3]


def can_leap(w: Any) -> bool:
    """Tell whether cycles of hits may be leapt over, because hits are Coulomb's."""
    at = w.instant
    moves = any(at.contact[k].drift != STANDS for k in range(at.contacts))
    return bool(w.law.hits_are_coulombs) and not moves


def room_to_collapse(w: Any) -> Any:
    """Return room for a collapse of the contacts of this instant."""
    w.collapse = Rows(collapse.FORM, w.instant.contacts)
    return w.collapse


def read_plastic(w: Any, k: int) -> None:
    """Let a contact be ``hitting`` without restitution and friction."""
    contact = w.instant.contact[k]
    plastic = contact.pair._replace(restitution=0.0, friction=0.0)
    w.instant.hitting[k] = contact._replace(pair=plastic)


def squeeze(w: Any, k: int) -> bool:
    """Let a contact of a squeezed ball be plastic; tell whether its wall goes through the ball."""
    at = w.instant
    one = at.contact[k]
    if w.squeezed.intersection(one.balls):
        at.contact[k] = one._replace(pair=one.pair._replace(restitution=0.0))
    is_of_mover = one.b == NO_BALL and one.cushion in w.movers
    return is_of_mover and (one.a, w.movers[one.cushion]) in w.jams


def squeezes(w: Any) -> bool:
    """Tell whether a wall that moves squeezes a ball of this instant."""
    at = w.instant
    return any(at.ball[n] in w.squeezed for n in range(at.balls))


def settle_group(w: Any, count: int) -> None:
    """Answer the plastic contacts of a ``group``; then the impulses of the collapse are known."""
    at = w.instant
    contacts = [at.group[m] for m in range(count)]
    law, own = Coulomb(), [at.contact[at.member[m]] for m in range(count)]
    if any(contact.drift != STANDS for contact in contacts):
        before = {i: at.velocity[i] for contact in contacts for i in contact.balls}
        after = dict(before)
        is_known = at_once(contacts, after) is not None
        if has_no_room(contacts, before, after, is_known):
            answer_without_movers(w, count, before)
            return
    law.together(contacts, at.velocity, partial(respond, law))
    shared = Shared(own, at.before, at.velocity)
    for m, contact in enumerate(own):
        at.impulse[at.member[m]] = numbers_of(shared.impulse(contact))


def may_answer(w: Any) -> bool:
    """Tell whether contacts of one instant can be answered."""
    return True


def may_go_on(w: Any) -> bool:
    """Tell whether the run has not come to its bounds."""
    return w.is_finite and not w.is_over


def give_up(w: Any) -> None:
    """Do nothing: the rows of the engine have room for any number of contacts."""


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


def sweep(w: Any, sides: Any, i: int, other: int) -> Four:
    """Return how a ball's other side moves, if it is a wall.

    That is its velocity (m/s) where the ball is, its angular velocity (rad/s), and the centrifugal
    acceleration (m/s^2) that lifts the ball off it.
    """
    if other >= 0:
        return 0.0, 0.0, 0.0, 0.0
    x, y, _, _ = motion_at(w.paths[i], w.now)
    moves: Four = w.walls[-1 - other].sweep(x, y)
    return moves


def read_drift(w: Any, sides: Any, other: int, row: Any) -> None:
    """Read how a wall moves now: velocity (m/s), time (s), angular velocity, and place (m)."""
    found = w.walls[-1 - other].motion(w.now) if other < 0 else (0.0, 0.0, w.now, 0.0, 0.0, 0.0)
    for n in range(6):
        row[n] = found[n]


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
    what, found = shape_of(w.walls[-1 - other].nearest(x, y, r), x, y, r)
    for n, each in enumerate(found):
        shape[n] = each
    return what


def find_touching(w: Any, sides: Any, i: int) -> None:
    """Find all contacts in the cluster around a ball."""
    found = w.touching((), (i,))
    w.groups.hold(0, len(found))
    w.groups.hits = len(found)
    for k, hit in enumerate(found):
        w.groups.hit[k][:] = hit.i, hit.j if hit.kind == "pair" else -1 - hit.j


def find_cluster(w: Any, sides: Any) -> None:
    """Let all contacts be ``due`` that touch in the cluster of what has met at this instant."""
    at = w.instant
    found = w.touching([hit_of(*at.met[k]) for k in range(at.mets)])
    at.dues = len(found)
    for k, hit in enumerate(found):
        at.due[k] = ends_of(hit)


# -- what follows ----------------------------------------------------------------------------------


def lead(w: Any, i: int, path: Path) -> None:
    """Put a ball on a new path."""
    w.lead(i, path)


def begin(w: Any, i: int, place: Vector, velocity: Vector, roll: Vector, noise: float) -> None:
    """Set a ball off on a new path, or put it to rest if its speed is noise (m/s)."""
    if velocity[0] * velocity[0] + velocity[1] * velocity[1] <= noise * noise:
        velocity = (0.0, 0.0)
    path = w.surfaces[i].path(w.now, place, velocity_after(w.errors, velocity, noise), roll)
    if sets_off(path):
        w.rested[i] = math.inf
        w.recorder.path(i, path)
    elif w.rested[i] == math.inf:
        w.stop(i, w.now, place)
    w.begin(i, path, noise)


def put_to_rest(w: Any, i: int, t: float) -> None:
    """Put a ball to rest at the end of its path, unless it rests already."""
    if w.rested[i] == math.inf:  # A path's end may be due twice.
        path = w.paths[i]
        x, y, _, _ = motion_at(path, t)
        w.stop(i, t, (x, y))
        then = w.surfaces[i].then(path)
        if then is not None:
            w.begin(i, then, 0.0)


def begins_to_rest(w: Any, i: int, x: float, y: float) -> bool:
    """Put a ball to rest at a place (m), if it has moved; tell whether it has."""
    if w.rested[i] < math.inf:
        return False
    w.paths[i], w.speeds[i] = standing(w.now, x, y), 0.0
    w.stop(i, w.now, (x, y))
    return True


def begins_to_roll(w: Any, i: int, t: float) -> None:
    """Take note that a ball begins to roll at a time (s)."""
    w.tally.listed += 1
    w.recorder.roll(i, t)


def crossing_of(w: Any, i: int) -> tuple[float, int]:
    """Return when (s), from now on, a ball crosses into another patch, and its number."""
    borders = w.patches.borders
    return crossing(borders, len(borders), w.paths[i], w.groups.patch[i], w.now)


def enter(w: Any, i: int, patch: int) -> None:
    """Let a ball be in another patch, or in none (-1), from now on."""
    w.put(i, patch)
    w.tally.listed += 1
    w.recorder.crossed(i, patch, w.now)


def take_in(w: Any, sides: Any, i: int, other: int) -> None:
    """Let a pocket take in a ball."""
    w.take_in(i, -1 - other)


def count_unlisted(w: Any) -> None:
    """Count a round or a piece without an event."""
    w.tally.unlisted += 1


def note_contact(w: Any, k: int) -> None:
    """Take note of a hit of this instant."""
    contact, (n, t, first) = w.instant.contact[k], w.instant.impulse[k]
    w.tally.listed += 1
    if contact.b == NO_BALL:
        n += contact.pair.m_a * w.instant.kick[k]
        if contact.cushion in w.movers:
            w.count_hit(contact.a, w.movers[contact.cushion])
    impulse = Impulse(n, t, None if contact.b == NO_BALL else first)
    w.recorder.contact(contact, impulse, w.now)


def note_collapse(w: Any) -> None:
    """Take note of a collapse."""
    at = w.instant
    contacts = [at.contact[k] for k in range(at.contacts)]
    w.recorder.no_end(contacts, Collapse(w.collapse.played, bool(w.collapse.is_over)), w.now)


def note_jump(w: Any, k: int) -> None:
    """Take note that the law jumps at a contact, because its slip is rounding."""
    w.recorder.zero_slip(w.instant.contact[k], w.now)


def note_order(w: Any) -> None:
    """Take note that the order of contacts at this instant is unknown."""
    w.recorder.order_unknown(w.now)


def push_piece(w: Any, i: int, t: float) -> None:
    """Let the piece of a ball's group end at a time (s), or the half of it."""
    w.push(t, What("piece", i))


def push_press(w: Any, i: int, t: float) -> None:
    """Let the contacts around a ball press from a time (s) on, if they persist then."""
    w.push(t, What("press", i))


def predict(w: Any, sides: Any, balls: tuple[int, ...]) -> None:
    """Predict what balls on new paths meet."""
    w.predict(balls)


def predict_changed(w: Any, sides: Any) -> None:
    """Predict what the balls meet that this instant has changed."""
    at = w.instant
    w.predict([at.ball[n] for n in range(at.balls) if at.changed[at.ball[n]]])


def meet(w: Any, sides: Any, i: int, j: int) -> None:
    """Predict when two balls meet."""
    w.meet(i, j)


def use_up(w: Any, sides: Any, i: int, other: int) -> None:
    """Forget the prediction of a contact that is due now; the queue has done so."""


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
        old = Persisted(w.contact(hit), began, began)
    x, y = impulse
    groups.persisted[hit] = old._replace(until=w.now, x=old.x + x, y=old.y + y)


# -- the motion of a group -------------------------------------------------------------------------


def find_piece(w: Any, longest: float) -> Piece:
    """Play a piece of the group in the press, no longer than a time (s)."""
    g = w.press
    return g.piece(longest) if g.is_fixed else piece_of(g, longest)


def finds_forces(w: Any) -> bool:
    """Let the group in the press have the mode whose forces fit; tell whether there is one."""
    g = w.press
    return g.decide() if g.is_fixed else decide(g, g.state)


def find_end(w: Any, steps: int, longest: float, time: float) -> None:
    """Find the state of the group in the press after a time (s) of a piece with so many steps."""
    g = w.press
    if g.is_fixed:
        g.find_end(steps, longest, time)
    else:
        part_of(g, steps, longest, time)


# -- room ------------------------------------------------------------------------------------------


# The compiled loop, once it is loaded, puts in here what gives an engine a faster press, with the
# same bits (pool_pymunk/fast/press.py).
PRESSES: list[Callable[[object], Press]] = []


def has_room(w: Any, balls: int, contacts: int) -> bool:
    """Have room in the press for so many balls and contacts; lists always have."""
    surface = w.surface
    is_own, (n, c) = not isinstance(surface, Sliding | Rolling), w.press.room
    if n == 0 and w.compiled and not is_own:
        w.press = PRESSES[0](w) if PRESSES else Press()
        n, c = w.press.room
    if w.press.is_fixed and (balls > n or contacts > c):
        w.press = Press()
    w.press.hold(balls, contacts)
    w.press.own = surface if is_own else None
    w.press.rolls = surface.rolls
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
