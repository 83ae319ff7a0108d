"""A law has a kink where it changes from one branch to another, as from sticking to slipping.

Rounding may put a hit on either side, so the law is also asked a little beside it.
"""

from __future__ import annotations

import math
from typing import Final

from pool_pymunk.core.contact.contact import NT, Pair
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.motion.times import EPSILON, INF
from pool_pymunk.core.tangent.change import SAME
from pool_pymunk.core.tangent.differences import OwnHit, off_of
from pool_pymunk.core.tangent.slopes import Hit, is_known, known_hit, largest

# A law is also asked at velocities that are off by this share of the speeds. Splitting a velocity
# along the normal takes a dozen roundings, and the velocity itself comes from dozens more.
BESIDE: Final = 256.0 * EPSILON
# At velocities this many times as far off the law gives only its answer, at little cost. A kink
# bends that answer by WIDE BESIDE = 4e-12 of the speeds, far more than ``STRAIGHT``.
WIDE: Final = 64.0
STRAIGHT: Final = 64.0 * EPSILON  # of the speeds; answers that bend by less do so by rounding


def hit_of(law: Law, a: NT, b: NT, pair: Pair, is_wall: bool, minds_kinks: bool) -> Hit:
    """Return a hit of a law, with slopes that are written down or those of differences."""
    if is_known(law):
        return known_hit(law, a, b, pair, is_wall)
    return OwnHit(law, a, b, pair, is_wall, minds_kinks)


def beside(hit: Hit, n: float, a_t: float, b_t: float) -> Hit:
    """Return a hit whose velocities a_n, a_t and b_t are other by these (m/s)."""
    an, at = hit.a
    bn, bt = hit.b
    return hit_of(hit.law, (an + n, at + a_t), (bn, bt + b_t), hit.pair, hit.is_wall, True)


def sides_of(
    hit: Hit, moves_a: bool, moves_b: bool, fastest: float, minds_kinks: bool
) -> list[Hit]:
    """Return the hits on all sides of a kink, one where there is none, none at all at a jump.

    ``moves_a`` and ``moves_b`` tell whether inputs change a_t, and b_t: a law may jump where a
    tangential velocity is zero, as that of a resting ball is. ``fastest`` (m/s) is the largest
    speed in the contact. Without minding kinks, they are looked for where the slip is zero alone.
    The differences of a law of somebody's own find its kinks by themselves.
    """
    an, at = hit.a
    bn, bt = hit.b
    pair = hit.pair
    if not hit.is_wall and hit.law.jumps(hit.a, hit.b, pair):
        return []
    size = largest(an, at, bn, bt)
    step, slip = BESIDE * max(fastest, size), at - bt
    closer = -step if hit.is_wall else step  # What makes the slip smaller is tried.
    less_a = math.copysign(step, -slip) if moves_a else 0.0
    less_b = math.copysign(step, slip) if moves_b and not moves_a else 0.0
    turns = (moves_a and min(abs(slip), abs(at)) <= WIDE * step) or (
        moves_b and min(abs(slip), abs(bt)) <= WIDE * step
    )
    most = max(max(size, pair.restitution), max(pair.friction, 0.0 if hit.is_wall else pair.m_a))
    most = most if pair.m_b == INF else max(most, pair.m_b)
    if not turns:
        bent = bend(hit, WIDE * closer, WIDE * less_a, WIDE * less_b) if minds_kinks else 0.0
        if bent <= STRAIGHT * most:
            return [hit]
    found = [beside(hit, closer, less_a, less_b), beside(hit, -closer, -less_a, -less_b)]
    if moves_a and moves_b and abs(bt) <= step < abs(slip):
        found += [beside(hit, 0.0, 0.0, step), beside(hit, 0.0, 0.0, -step)]
    for other in found:
        if not off_of(found[0].after, other.after) <= SAME * most:
            return []
    return found if is_known(hit.law) else [hit]


def bend(hit: Hit, n: float, a_t: float, b_t: float) -> float:
    """Return how far (m/s) the answers on either side and at the hit are from a line."""
    p, q, r, s = hit.answer_beside(n, a_t, b_t)
    a, b, c, d = hit.after
    e, f, g, h = hit.answer_beside(-n, -a_t, -b_t)
    return largest(p - 2.0 * a + e, q - 2.0 * b + f, r - 2.0 * c + g, s - 2.0 * d + h)
