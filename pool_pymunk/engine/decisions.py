"""These pure functions of numbers make the engine's decisions.

Persistent contacts have a *contact time* (the TC model of Luding and McNamara, Granular Matter 1,
1998, 113): balls hit each other once in it, in micro-collisions, instead of infinitely often.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.physics.motion import EPSILON, Vector
from pool_pymunk.physics.path import (
    BARELY,
    NOISE,
    Path,
    Persistent,
    least_bounce,
    motion_at,
    speed_of,
)

# A run is given up after this many events, unless the user says otherwise, and after this many
# instants of micro-collisions, which are no events. So a run takes some minutes at most.
NEVER_SETTLES = 1_000_000
# ``python -m tests.halved`` plays 54 hard runs with half and with twice such a number. Where no
# comment says more, ends move by less than 3e-9 m (figures of warnings may change).
NEARLY_NOW = 1e-6  # radii; contacts this near in time may be of one instant, and their gaps decide
NEARLY_CLOSED = 16.0  # A gap up to this many times as wide as a closed one closes in a moment.
# After this many rounds of contacts at one instant, what touches is looked at once. With 1 or 6,
# one end moves by up to 1e-6 m.
FEW_ROUNDS = 3
# More hits at one instant are a collapse, and are not listed one by one. With 50 or 200, one end
# moves by up to 3e-6 m, and a run may list half or twice as many events.
LISTED = 100
CONVERGED = 64.0 * EPSILON  # A collapse is over at closing speeds of this share of the speeds.
# After this many collapses of more than two contacts, balls are a pile, in which at most this many
# hits of a collapse are played: both bound the time that a run takes.
PILE, MOST_IN_PILE = 20, 200
# This is a share of the time until both balls stop, or of the time since they met. The error is of
# this order; half or twice as much moves 4 ends by up to 0.2 m, where contacts amplify it.
CONTACT_TIME = 3e-3
# radii; balls in persistent contact sink into each other by this at most. Half or twice as much
# moves 2 ends by up to 3e-6 m.
DEEPEST = 1e-4
# This is a share of the speed that friction gives in a contact time: slower hits come later. Half
# as much moves 2 ends by up to 2e-5 m, twice as much 4 ends by up to 0.02 m.
FAINT = 0.02
# After this many hits the contact time of two balls is not below this share of the longest one.
# Half or twice as much of either moves 2 ends by up to 3e-6 m.
MANY_TIMES, SHORTEST = 200, 1 / 64
# This many contact times after a hit, the next hit may be a micro-collision. Half as much moves 3
# ends by up to 2e-5 m, twice as much 2 ends by up to 1e-4 m.
WINDOW = 3.0


def nearly_now(radius: float, speed: float) -> float:
    """Return how far apart in time (s) contacts of one instant may seem to be."""
    return NEARLY_NOW * radius / speed if speed > 0.0 else 0.0


def known_gap(gap: float, x: float, y: float, radius: float) -> float:
    """Return a gap (m) at a place (m), or 0 where rounding hides it."""
    return gap if gap > 2.0 * EPSILON * (abs(x) + abs(y) + radius) else 0.0


def is_closed(gap: float, x: float, y: float, touching: float) -> bool:
    """Tell whether a gap (m) at a place (m) is closed, to rounding."""
    return gap <= 32.0 * EPSILON * (abs(x) + abs(y) + touching)


def is_hit(closing: float, noise: float, least: float) -> bool:
    """Tell whether two sides that touch hit each other now; slower ones get nearer first."""
    return closing > max(noise, BARELY * least)


def contact_time(since_met: float, to_go: float, radius: float, pull: float, many: bool) -> float:
    """Return the contact time (s) of balls that met ``since_met`` s ago and stop in ``to_go`` s.

    They sink into each other by ``DEEPEST`` radii at most, at this ``pull`` (m/s^2). After ``many``
    hits it is ``SHORTEST`` of the longest one at least, because other balls push these two on.
    """
    shallow = math.sqrt(4.0 * DEEPEST * radius / pull) if pull > 0.0 else math.inf
    least = SHORTEST * shallow if many else 0.0
    return min(max(CONTACT_TIME * max(since_met, to_go), least), shallow)


def persistent(
    past: Any, now: float, to_go: float, radius: float, pull: float, longer: float = 1.0
) -> Persistent:
    """Return the contact time of two sides with a history, ``longer`` times as long in a variant.

    After many hits, sides that have just hit and close faintly hit again later.
    """
    many = past.hits > MANY_TIMES
    time = contact_time(now - past.met, to_go, radius, pull, many) * longer
    is_faint = many and now - past.last < time / 2.0
    return Persistent(time, FAINT * pull * time if is_faint else 0.0)


def least_parting(a: Path, b: Path, now: float, contact_time: float, radius: float) -> float:
    """Return the least bounce (m/s) of two balls that have met; 0 if it moves them by rounding."""
    least = least_bounce(a, b, now, contact_time)
    rounding = 64.0 * EPSILON * (abs(a.x) + abs(a.y) + radius)
    return least if least * contact_time > rounding else 0.0


def noise_after(fastest: float, noise: float) -> float:
    """Return the noise (m/s) after a contact, for the square of the fastest velocity in it."""
    return max(NOISE * math.sqrt(fastest), noise)


def persists(since_last: float, contact_time: float) -> bool:
    """Tell whether a contact persists, because its balls hit each other a moment ago (s)."""
    return since_last <= WINDOW * contact_time


def is_micro(closing: float, contact_time: float, pull: float) -> bool:
    """Tell whether friction alone can make two balls close so fast in one contact time."""
    return closing <= 2.0 * pull * contact_time


def pressing(path: Path, normal: Vector, curvature: float, now: float) -> float:
    """Return how strongly (m/s^2) a ball is pressed on to a wall, by its roll or by an arc."""
    (_, _, vx, vy), (nx, ny) = motion_at(path, now), normal
    along = vy * nx - vx * ny
    return -(path.ax * nx + path.ay * ny) - curvature * along * along


def turning_time(path: Path, curvature: float, press: float) -> float:
    """Return the time (s) in which an arc that presses (m/s^2) on a ball turns it by 1 rad."""
    return speed_of(path) / press if curvature * press < 0.0 else 0.0


def least_off(press: float, time: float, too_slow: float) -> float:
    """Return the speed (m/s) at which a ball leaves a wall and is back in a time (s).

    The wall presses on it (m/s^2). A ball at up to twice the ``too_slow`` speed would rest.
    """
    return max(press * time / 2.0, 2.0 * too_slow) if press > 0.0 else 0.0


def too_slow_to_move(pull: float, x: float, y: float, radius: float) -> float:
    """Return the speed (m/s) at which a ball would stop before its place changes."""
    return math.sqrt(2.0 * pull * EPSILON * (abs(x) + abs(y) + radius))


def instant(now: float, x: float, y: float, radius: float, speed: float) -> float:
    """Return how long (s) one instant is: rounding may move some hundred contacts by as much."""
    return 256.0 * EPSILON * (now + (abs(x) + abs(y) + radius) / speed)
