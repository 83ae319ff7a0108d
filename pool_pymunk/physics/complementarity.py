"""The mode of a group says what presses, slips and rolls; :func:`decide` finds it.

Of each contact either the force is 0 or the gap stays closed, and of each slip either friction is
at its bound or the slip stays 0: a complementarity problem, whose matrix is not symmetric. A guess
is mended until all fits; the forces are those of :mod:`pool_pymunk.physics.forces`.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.physics.forces import find_forces, is_own, opening_rate
from pool_pymunk.physics.pressed import (
    LET_GO,
    NEAR,
    REST,
    ROLL,
    SLIP,
    STUCK,
    flow,
    gap_of,
    look,
    opening,
    roll_into,
    room,
    sign,
    size_of,
    smallest,
    wrings,
)
from pool_pymunk.physics.surface import GYRATION, SHARE

# of the largest speed and acceleration of a group: smaller ones are none
SLOW, WEAK = 1e-13, 1e-12
TINY = 1e-8  # of the largest speed; slower slips at the beginning are none
# A slip or a speed has faded that is not larger than this many times what is none; a ball that is
# let go begins with as much.
FADED = 1e5
EXCHANGES = 20  # This many changes of what presses, slips and rolls are tried for each contact.


def guess(g: Any, s: Any) -> None:
    """Guess the mode of a state: everything that could be held is held."""
    set_phases(g, s)
    look(g, s)
    for k in range(g.contacts):
        freshen(g, s, k)


def set_scale(g: Any, s: Any) -> None:
    """Set the speed and the acceleration below which there is none."""
    fastest = strongest = 0.0
    for number in range(g.balls):
        strongest = max(strongest, max(g.pull[number], g.drag[number]))
        p = 6 * number
        fastest = max(fastest, size_of(s[p + 2], s[p + 3]), size_of(s[p + 4], s[p + 5]))
    look(g, s)
    for k in range(g.contacts):
        strongest = max(strongest, abs(g.bend[k]) * g.slip[k] * g.slip[k], abs(g.spin[k][0]))
    fastest = max(fastest, math.sqrt(strongest * smallest(g)))
    g.small[0], g.small[1] = SLOW * fastest, WEAK * strongest


def set_phases(g: Any, s: Any) -> None:
    """Set the phases of balls; tiny slips and speeds are none."""
    fastest = g.small[0] / SLOW
    for i in range(g.balls):
        g.phase[i] = phase_of(g, s, i, TINY * g.small[2] * fastest)
        if g.phase[i] == ROLL:
            begin_to_roll(g, s, i)
        elif g.phase[i] == REST:
            put_to_rest(g, s, i)


def begin_to_roll(g: Any, s: Any, i: int) -> None:
    """Let a ball roll whose slip is none."""
    for q in (6 * i + 2, 6 * i + 3):
        s[q] = s[q + 2] = (1.0 - SHARE) * s[q] + SHARE * s[q + 2]
    g.phase[i] = ROLL


def put_to_rest(g: Any, s: Any, i: int) -> None:
    """Let a ball rest."""
    p = 6 * i
    s[p + 2] = s[p + 3] = s[p + 4] = s[p + 5] = 0.0
    g.phase[i] = REST


def phase_of(g: Any, s: Any, i: int, least: float) -> int:
    """Return the phase of a ball; slower slips and speeds than ``least`` (m/s) are none."""
    p = 6 * i
    vx, vy, wx, wy = s[p + 2], s[p + 3], s[p + 4], s[p + 5]
    if is_own(g):
        return SLIP
    if size_of(vx, vy) <= least and size_of(wx, wy) <= least:
        return REST
    return ROLL if g.rolls and size_of(vx - wx, vy - wy) <= least else SLIP


def freshen(g: Any, s: Any, k: int) -> None:
    """Let a contact press, with the signs of its slip and of the roll into it."""
    g.on[k] = 1
    g.slides[k] = sign(g.slip[k], g.small[0]) if g.mu[k] > 0.0 else 0
    g.into[k] = sign(roll_into(g, s, k), g.small[0]) if wrings(g, k) else 0


def touches(g: Any, s: Any, k: int) -> bool:
    """Tell whether two sides touch and do not part."""
    if g.over[k] or gap_of(g, s, k) > NEAR * g.radius[g.one[k]] or leaves(g, s, k):
        return False
    return bool(opening(g, s, k) <= 10.0 * g.small[0])


def leaves(g: Any, s: Any, k: int) -> bool:
    """Tell whether a ball at the end of a side moves on beyond it."""
    p, near = 6 * g.one[k], NEAR * g.radius[g.one[k]]
    vx, vy = flow(g, s, k)
    left, speed = room(g, k, s[p], s[p + 1]), size_of(vx, vy)
    if left > near or speed == 0.0:
        return False
    x, y = s[p] + near / speed * vx, s[p + 1] + near / speed * vy
    return room(g, k, x, y) < left


def decide(g: Any, s: Any) -> bool:
    """Find what presses, slips and rolls, from a guess; tell whether all fits then."""
    look(g, s)
    for k in range(g.contacts):
        g.closed[k] = touches(g, s, k)
        g.on[k] = g.on[k] and g.closed[k]
    for number in range(EXCHANGES * (g.contacts + g.balls)):
        misfit = find_forces(g, s)
        if not mend(g, s, misfit, number < g.contacts + 3):
            return True
    return False


def mend(g: Any, s: Any, misfit: float, all_at_once: bool) -> bool:
    """Change what does not fit, all of a kind or the worst of it; tell whether anything did."""
    if misfit > 1e3 * g.small[1]:
        return let_slip(g, False) or open_widest(g)
    return (
        (not all_at_once and let_slip(g, False))
        or open_pulling(g, all_at_once)
        or let_slip(g, all_at_once)
        or close_closing(g, s, all_at_once)
        or let_go(g, s)
    )


def open_widest(g: Any) -> bool:
    """Open the contact whose sides part fastest, where no forces fit."""
    widest, which = -math.inf, -1
    for k in range(g.contacts):
        if g.on[k] and opening_rate(g, k) > widest:
            widest, which = opening_rate(g, k), k
    if which >= 0:
        g.on[which] = 0
    return which >= 0


def open_pulling(g: Any, all_at_once: bool) -> bool:
    """Open contacts that would pull."""
    least, which = -g.small[1], -1
    for k in range(g.contacts):
        if g.on[k]:
            press = g.force[k][0] / g.unit[k]
            if press < (-g.small[1] if all_at_once else least):
                least, which = press, k
                if all_at_once:
                    g.on[k] = 0
    if which >= 0:
        g.on[which] = 0
    return which >= 0


def let_slip(g: Any, all_at_once: bool) -> bool:
    """Let sides slip that friction cannot hold."""
    found = False
    for k in range(g.contacts):
        if g.on[k] and (all_at_once or not found):
            most, slack = g.mu[k] * g.force[k][0], g.small[1] * g.unit[k]
            if g.slides[k] == 0 and abs(g.force[k][1]) > most + slack:
                g.slides[k], found = (-1 if g.force[k][1] > 0.0 else 1), True
            if g.into[k] == 0 and abs(g.force[k][2]) > most / GYRATION + slack:
                g.into[k], found = (-1 if g.force[k][2] > 0.0 else 1), True
    return found


def close_closing(g: Any, s: Any, all_at_once: bool) -> bool:
    """Let contacts press that would close."""
    least, which = -4.0 * g.small[1], -1
    for k in range(g.contacts):
        if g.closed[k] and not g.on[k]:
            rate = opening_rate(g, k)
            if rate < (-4.0 * g.small[1] if all_at_once else least):
                least, which = rate, k
                if all_at_once:
                    freshen(g, s, k)
    if which >= 0:
        freshen(g, s, which)
    return which >= 0


def drive(g: Any, i: int) -> tuple[float, float]:
    """Return what surface friction has to hold of the pushes on a ball (m/s^2).

    That is what would move a ball at rest, without what walls and their friction take, or what
    would make one slip that rolls.
    """
    f = g.push[i]
    fx, fy, cx, cy = f[0], f[1], f[2], f[3]
    if g.phase[i] == ROLL:
        return SHARE * (fx - cx), SHARE * (fy - cy)
    if g.rolls:
        fx, fy = (1.0 - SHARE) * fx + SHARE * cx, (1.0 - SHARE) * fy + SHARE * cy
    for k in range(g.contacts):
        if g.on[k] and g.one[k] == i and g.other[k] < 0:
            nx, ny = g.normal[k][0], g.normal[k][1]
            into, along = min(fx * nx + fy * ny, 0.0), fy * nx - fx * ny
            held = min(max(along, g.mu[k] * into), -g.mu[k] * into)
            fx, fy = fx - into * nx + held * ny, fy - into * ny - held * nx
    return fx, fy


def spare_hold(g: Any, i: int) -> float:
    """Return how much more (m/s^2) the surface friction that holds a ball could hold."""
    if g.phase[i] == SLIP or g.stuck[i] == STUCK:
        return math.inf
    x, y = drive(g, i)
    most = g.drag[i] if g.rolls and g.phase[i] == REST else g.pull[i]
    return float(most - math.sqrt(x * x + y * y))


def let_go(g: Any, s: Any) -> bool:
    """Let a ball slip that cannot roll on, or move that cannot rest."""
    for i in range(g.balls):
        if spare_hold(g, i) < -g.small[1]:
            set_free(g, s, i)
            return True
    return False


def set_free(g: Any, s: Any, i: int) -> None:
    """Let a ball slip that rolls, or move that rests, with a small speed along its drive."""
    p, (x, y) = 6 * i, drive(g, i)
    least = FADED * g.small[2] * g.small[0] / math.sqrt(x * x + y * y)
    x, y, g.stuck[i] = least * x, least * y, LET_GO
    if g.phase[i] == ROLL:
        s[p + 4], s[p + 5] = s[p + 2] - x, s[p + 3] - y
        g.phase[i] = SLIP
        return
    s[p + 2], s[p + 3] = x, y
    s[p + 4], s[p + 5] = (x, y) if g.rolls else (0.0, 0.0)
    g.phase[i] = ROLL if g.rolls else SLIP
