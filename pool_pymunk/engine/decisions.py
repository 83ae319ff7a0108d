"""These pure functions of numbers make the engine's decisions."""

from __future__ import annotations

import math

from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE
from pool_pymunk.results.trace import NEVER_SETTLES as NEVER_SETTLES

# ``python -m tests.halved`` plays 54 hard runs with half and with twice such a number. Where no
# comment says more, ends move by less than 3e-9 m (figures of warnings may change).
NEARLY_NOW = 1e-6  # radii; contacts this near in time may be of one instant, and their gaps decide
NEARLY_CLOSED = 16.0  # A gap up to this many times as wide as a closed one closes in a moment.
# radii; balls that touch and press on each other meet sooner than they move so far. Balls of 3 cm
# that 1 m/s^2 presses do so at up to 800 m/s; faster ones hit each other, and then persist.
SOON = 0.01
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
# A wall that moves hits a ball ever more often that has nowhere to go. After so many of these hits
# in one step the ball does not bounce any more, and after so many the wall goes through it. So does
# a wall that MET the ball so often in one step, by hits or without them.
SQUEEZED, JAMMED, MET = 20, 30, 100


def nearly_now(radius: float, speed: float) -> float:
    """Return how far apart in time (s) contacts of one instant may seem to be."""
    return NEARLY_NOW * radius / speed if speed > 0.0 else 0.0


def known_gap(gap: float, x: float, y: float, radius: float) -> float:
    """Return a gap (m) at a place (m), or 0 where rounding hides it."""
    return gap if gap > 2.0 * EPSILON * (abs(x) + abs(y) + radius) else 0.0


def is_closed(gap: float, x: float, y: float, touching: float) -> bool:
    """Tell whether a gap (m) at a place (m) is closed, to rounding."""
    return gap <= 32.0 * EPSILON * (abs(x) + abs(y) + touching)


def late_by(now: float, speed: float, ux: float, uy: float) -> float:
    """Return how far (m) rounding of the time moves a ball, and a wall with a velocity (m/s)."""
    if ux == 0.0 and uy == 0.0:
        return 0.0
    return EPSILON * now * (speed + abs(ux) + abs(uy))


def noise_after(fastest: float, noise: float) -> float:
    """Return the noise (m/s) after a contact, for the square of the fastest velocity in it."""
    return max(NOISE * math.sqrt(fastest), noise)


def instant(now: float, x: float, y: float, radius: float, speed: float) -> float:
    """Return how long (s) one instant is: rounding may move some hundred contacts by as much."""
    crossing = (abs(x) + abs(y) + radius) / speed if speed > 0.0 else 0.0
    return 256.0 * EPSILON * (now + crossing)
