"""Contact laws take the velocities before a contact and return the velocities after it."""

from __future__ import annotations

from typing import Any

from pool_pymunk.laws.law import LAWS as LAWS
from pool_pymunk.laws.law import Coulomb as Coulomb
from pool_pymunk.laws.law import Law as Law
from pool_pymunk.laws.law import Published as Published
from pool_pymunk.physics.contact import (
    NO_BALL,
    NT,
    Contact,
    Pair,
    changed,
    drift_of,
    pair_of,
    relative,
    split,
)

# A slip below this share of the closing speed is rounding, and `published` jumps at zero slip. Half
# or twice of it keeps all ends of tests.halved.
ZERO_SLIP = 1e-9

# The friction of pool balls against their slip (m/s), for `weakening`: mu(s) = LEAST + FADING
# exp(-RATE s). This is Alciatore's fit to Marlow's measurements: Technical Proof A.14, "The effects
# of cut angle, speed, and spin on object ball throw", billiards.colostate.edu.
LEAST, FADING, RATE = 9.951e-3, 0.108, 1.088

Slip = tuple[float, float]  # of A and B along the tangent, as multiples of the least that counts
NO_FRICTION: Slip = (0.0, 0.0)  # This slip stands for an answer without friction.


def coulomb(a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Answer a hit by Eqs. 1-7, with Coulomb friction against the slip.

    J_n = (1 + e) m_eff (a_n - b_n); J_t = m_eff s against the slip s = a_t - b_t, or mu J_n if that
    is less. Momentum is kept, energy never grows, and nothing jumps. Balls that already part keep
    their velocities.

    >>> coulomb(NT(1.0, 0.0), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.0))
    (NT(n=0.0, t=0.0), NT(n=1.0, t=0.0))
    """
    m_a, m_b, e, mu = pair
    share_a, share_b = m_b / (m_a + m_b), m_a / (m_a + m_b)  # m_eff / m_a, m_eff / m_b
    slip = a.t - b.t
    j_n = (1.0 + e) * max(a.n - b.n, 0.0)  # impulses over m_eff
    j_t = clamped(slip, mu * j_n)
    return (
        NT(a.n - j_n * share_a, a.t - j_t * share_a),
        NT(b.n + j_n * share_b, b.t + j_t * share_b),
    )


def clamped(value: float, most: float) -> float:
    """Return a value, or the nearest of ``-most`` and ``most`` if it lies beyond them.

    >>> clamped(0.3, 0.2), clamped(-0.3, 0.2), clamped(0.1, 0.2)
    (0.2, -0.2, 0.1)
    """
    if value > most:
        return most
    return -most if value < -most else value


def decay(x: float) -> float:
    """Return exp(-x) for x of at least 0, to 15 decimals.

    It is made of sums and products, so it has the same bits on every machine, and dual numbers go
    through it. A series gives exp(-x / 1024) - 1, and is squared ten times; beyond 40 the answer
    is 0.

    >>> decay(0.0), round(decay(1.0), 12)
    (1.0, 0.367879441171)
    """
    if x > 40.0:
        return 0.0 * x
    y = x / -1024.0
    less_one = y * (1.0 + y / 2.0 * (1.0 + y / 3.0 * (1.0 + y / 4.0 * (1.0 + y / 5.0))))
    for _ in range(10):
        less_one = less_one * (2.0 + less_one)
    return 1.0 + less_one


def published(a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Answer a hit by Listing 3 to the letter, because it alone gives the published numbers.

    The normal velocities solve momentum and restitution (Eqs. 1-3). Each tangential velocity
    changes by mu times its own change of normal velocity. Two defects are kept: line 132 pushes B
    *with* the slip, and the clamps after it look at each ball's own tangential velocity, not at the
    slip.

    >>> published(NT(1.0, 0.5), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.1))
    (NT(n=0.0, t=0.4), NT(n=1.0, t=-0.1))
    """
    m_a, m_b, e, mu = pair
    momentum = m_a * a.n + m_b * b.n
    closing = e * (a.n - b.n)
    a_n = (momentum - m_b * closing) / (m_a + m_b)
    b_n = (momentum + m_a * closing) / (m_a + m_b)
    a_t = a.t - _sign(a.t - b.t) * (mu * (a.n - a_n))
    b_t = b.t - _sign(b.t - a.t) * (mu * (b.n - b_n))
    return NT(a_n, _not_reversed(a.t, a_t)), NT(b_n, _not_reversed(b.t, b_t))


def cushion(v: NT, restitution: float, friction: float) -> NT:
    """Answer a hit on a cushion by Eq. 9: v_n' = -e v_n.

    The tangential speed shrinks by mu |v_n' - v_n|, never past zero.

    >>> cushion(NT(-2.0, 1.0), restitution=0.5, friction=0.1)
    NT(n=1.0, t=0.7)
    """
    n = -(v.n * restitution)
    return NT(n, _not_reversed(v.t, v.t - _sign(v.t) * (friction * abs(n - v.n))))


def slips_by_rounding(a: NT, b: NT) -> bool:
    """Tell whether the slip is rounding: less than ``ZERO_SLIP`` of the closing speed."""
    return abs(a.t - b.t) < ZERO_SLIP * (a.n - b.n)


def solves_at_once(law: Law) -> bool:
    """Tell whether a law answers contacts of one instant as Coulomb's law does."""
    return type(law).together is Coulomb.together


def slipping(a: NT, b: NT, slip: Slip) -> tuple[NT, NT]:
    """Return velocities that slip by the least that is no rounding; a ball at rest stays at rest.

    ``slip`` says how many times ``ZERO_SLIP`` of the closing speed A and B get along the tangent.

    >>> slipping(NT(2.0, 0.0), NT(0.0, 0.0), (-1.0, 1.0))
    (NT(n=2.0, t=-2e-09), NT(n=0.0, t=0.0))
    """
    least = ZERO_SLIP * (a.n - b.n)
    return _moved_along(a, slip[0] * least), _moved_along(b, slip[1] * least)


def _moved_along(v: NT, by: float) -> NT:
    return NT(v.n, v.t + by) if v.n != 0.0 or v.t != 0.0 else v


def balls_after(law: Law, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Return the velocities of two balls after a hit, by a law; numba asks a law by its number."""
    return law.ball_ball(a, b, pair)


def cushion_after(law: Law, v: NT, restitution: float, friction: float) -> NT:
    """Return the velocity after a hit on a cushion, by a law; numba asks a law by its number."""
    return law.cushion(v, restitution, friction)


def jumps_at(law: Law, a: NT, b: NT, pair: Pair) -> bool:
    """Tell whether a law jumps at a hit of two balls; numba asks a law by its number."""
    return law.jumps(a, b, pair)


def respond(law: Any, contact: Any, velocity: Any, slip: Slip = NO_FRICTION) -> bool:
    """Answer one contact by a law, and change ``velocity`` (m/s).

    Return whether the law jumps there. If it does, leave friction out, or answer with this ``slip``
    (:func:`slipping`) instead of the one that only rounding knows.
    """
    i, j, pair, (nx, ny) = contact.a, contact.b, pair_of(contact), contact.normal
    normal, v = (nx, ny), (velocity[i][0], velocity[i][1])
    if j == NO_BALL:
        a = split(relative(v, drift_of(contact)), normal)
        after = cushion_after(law, a, pair.restitution, pair.friction)
        velocity[i] = changed(v, a, after, normal)
        return False
    u = velocity[j][0], velocity[j][1]
    a, b = split(v, normal), split(u, normal)
    jumps, slips_a, slips_b = jumps_at(law, a, b, pair), a, b
    if jumps and slip == NO_FRICTION:
        pair = Pair(pair.m_a, pair.m_b, pair.restitution, 0.0)
    elif jumps:
        slips_a, slips_b = slipping(a, b, slip)
    new_a, new_b = balls_after(law, slips_a, slips_b, pair)
    velocity[i] = changed(v, a, new_a, normal)
    velocity[j] = changed(u, b, new_b, normal)
    return jumps


def as_listed(contact: Contact) -> tuple[bool, int, int, bool]:
    """Return the place in the listing's order: cushions (across x, then y) before pairs."""
    across = abs(contact.normal[0]) < abs(contact.normal[1])
    return contact.b != NO_BALL, contact.a, contact.b, across


def _sign(x: float) -> float:
    if x > 0.0:
        return 1.0
    return -1.0 if x < 0.0 else 0.0


def _not_reversed(before: float, after: float) -> float:
    return 0.0 if before != 0.0 and _sign(after) != _sign(before) else after
