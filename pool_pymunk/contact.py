"""Contact laws: velocities in, velocities out; no solver, no pymunk.

Velocities are split along the unit normal n (from ball A to ball B, or from the cushion into the
table) and the tangent t = (-n_y, n_x). Both laws have the same form, so that every solver calls
the same one and solvers differ in how they move through time only.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple, Protocol


class NT(NamedTuple):
    """A velocity along the normal and along the tangent (m/s)."""

    n: float
    t: float


class Pair(NamedTuple):
    """Two balls that meet: their masses (kg), restitution e and coefficient of friction mu."""

    m_a: float
    m_b: float
    restitution: float
    friction: float


class Law(Protocol):
    """A contact law: velocities of A and B before the hit -> velocities after it."""

    def __call__(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]: ...


# Slips below this share of the closing speed are rounding: `published` jumps at zero slip.
ZERO_SLIP = 1e-9


def coulomb(a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Eqs. 1-7 as physics: momentum is kept, energy never grows, nothing jumps at zero slip.

    J_n = (1 + e) m_eff (a_n - b_n); J_t = min(mu J_n, m_eff |s|) against the slip s = a_t - b_t.
    Balls that part already are left alone.

    >>> coulomb(NT(1.0, 0.0), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.0))
    (NT(n=0.0, t=0.0), NT(n=1.0, t=0.0))
    """
    m_a, m_b, e, mu = pair
    share_a, share_b = m_b / (m_a + m_b), m_a / (m_a + m_b)  # m_eff / m_a, m_eff / m_b
    slip = a.t - b.t
    j_n = (1.0 + e) * max(a.n - b.n, 0.0)  # impulses over m_eff
    j_t = math.copysign(min(mu * j_n, abs(slip)), slip)
    return (
        NT(a.n - j_n * share_a, a.t - j_t * share_a),
        NT(b.n + j_n * share_b, b.t + j_t * share_b),
    )


def published(a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Listing 3 to the letter, defects included: it alone gives the published numbers.

    The normal velocities solve momentum and restitution (Eqs. 1-3). Each tangential velocity
    changes by mu times its own change of normal velocity; line 132 pushes B *with* the slip, and
    the clamps that follow it look at each ball's own tangential velocity, not at the slip.

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


LAWS: Mapping[str, Law] = {"coulomb": coulomb, "published": published}


def cushion(v: NT, restitution: float, friction: float) -> NT:
    """Eq. 9: v_n' = -e v_n; the tangential speed shrinks by mu |v_n' - v_n|, never past zero.

    >>> cushion(NT(-2.0, 1.0), restitution=0.5, friction=0.1)
    NT(n=1.0, t=0.7)
    """
    n = -(v.n * restitution)
    return NT(n, _not_reversed(v.t, v.t - _sign(v.t) * (friction * abs(n - v.n))))


def slips_by_rounding(a: NT, b: NT) -> bool:
    """Whether the slip is so small beside the closing speed that only rounding gave it a sign."""
    return abs(a.t - b.t) < ZERO_SLIP * (a.n - b.n)


def _sign(x: float) -> float:
    return (x > 0.0) - (x < 0.0)


def _not_reversed(before: float, after: float) -> float:
    return 0.0 if before != 0.0 and _sign(after) != _sign(before) else after
