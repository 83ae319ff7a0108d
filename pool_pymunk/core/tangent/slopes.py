"""Slopes tell how a law's answer to one hit changes with all that the law is asked with.

Those of the package's laws are written down. Another law is asked a little beside the hit
(:mod:`pool_pymunk.core.tangent.differences`).
"""

from __future__ import annotations

import math
from typing import Final, final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.contact.contact import NT, Pair
from pool_pymunk.core.contact.laws import (
    FADING,
    LEAST,
    RATE,
    Coulomb,
    Law,
    Published,
    Weakening,
    decay,
    sign,
)

Four = tuple[float, float, float, float]  # parts of a and b along the normal and the tangent (m/s)


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Nudge:
    """A nudge changes what a law is asked with, to first order.

    It changes the parts of the velocities of a and b along the normal and the tangent (m/s), their
    masses (kg), restitution and friction.
    """

    def __init__(self) -> None:
        self.an = self.at = self.bn = self.bt = 0.0
        self.m_a = self.m_b = self.e = self.mu = 0.0

    @property
    def is_known(self) -> bool:
        """This tells whether all of its numbers are known."""
        total = self.an + self.at + self.bn + self.bt + self.m_a + self.m_b + self.e + self.mu
        return total == total

    @property
    def is_zero(self) -> bool:
        """This tells whether it changes nothing."""
        velocities = self.an == 0.0 and self.at == 0.0 and self.bn == 0.0 and self.bt == 0.0
        masses = self.m_a == 0.0 and self.m_b == 0.0
        return velocities and masses and self.e == 0.0 and self.mu == 0.0

    @property
    def size(self) -> float:
        """The largest of its numbers."""
        of_masses, of_pair = max(abs(self.m_a), abs(self.m_b)), max(abs(self.e), abs(self.mu))
        return max(largest(self.an, self.at, self.bn, self.bt), max(of_masses, of_pair))


@mypyc_attr(acyclic=True, free_list_len=1)
class Hit:
    """A hit has the velocities and the numbers with which a law is asked, and its answer.

    >>> from pool_pymunk.core.contact.laws import Coulomb
    >>> hit = CoulombHit(Coulomb(), (1.0, 0.0), (0.0, 0.0), Pair(1.0, 1.0, 1.0, 0.0), False)
    >>> nudge = Nudge()
    >>> nudge.an = 1.0
    >>> hit.after, hit.slope(nudge)
    ((0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 1.0, 0.0))
    """

    def __init__(self, law: Law, a: NT, b: NT, pair: Pair, is_wall: bool) -> None:
        self.law: Final = law
        self.a: Final = a
        self.b: Final = b
        self.pair = pair
        self.is_wall = is_wall
        self.after: Final = answer_of(law, a, b, pair, is_wall)

    def slope(self, by: Nudge) -> Four:
        """Return how the answer changes (m/s); nan if the law has a kink here."""
        raise NotImplementedError

    def answer_beside(self, n: float, a_t: float, b_t: float) -> Four:
        """Return the answer to a hit whose a_n, a_t and b_t are other by these (m/s)."""
        an, at = self.a
        bn, bt = self.b
        return answer_of(self.law, (an + n, at + a_t), (bn, bt + b_t), self.pair, self.is_wall)


@mypyc_attr(acyclic=True, free_list_len=1)
class CoulombHit(Hit):
    """With the shares s_a = m_b / (m_a + m_b), s_b = 1 - s_a, velocities change by -s_a j, s_b j.

    Here j = (1 + e) (a_n - b_n) along the normal, and across it the slip, or mu j if that is less.
    """

    def __init__(self, law: Law, a: NT, b: NT, pair: Pair, is_wall: bool) -> None:
        super().__init__(law, a, b, pair, is_wall)
        an, at = a
        bn, bt = b
        self.total = pair.m_a + pair.m_b
        self.share_a, self.share_b = pair.m_b / self.total, pair.m_a / self.total
        self.closing, self.slip = an - bn, at - bt
        self.j_n = (1.0 + pair.restitution) * self.closing
        self.mu = pair.friction

    def slope(self, by: Nudge) -> Four:
        return self.slope_by(by, by.mu)

    def slope_by(self, by: Nudge, of_mu: float) -> Four:
        """Return the slope, where the friction that acts changes by ``of_mu``."""
        share = (by.m_b * self.share_b - by.m_a * self.share_a) / self.total  # that of share_a
        n = by.e * self.closing + (1.0 + self.pair.restitution) * (by.an - by.bn)
        t, j_t, most = by.at - by.bt, self.slip, self.mu * self.j_n
        if abs(j_t) > most:
            j_t = math.copysign(most, j_t)
            t = math.copysign(1.0, j_t) * (of_mu * self.j_n + self.mu * n)
        return (
            by.an - n * self.share_a - self.j_n * share,
            by.at - t * self.share_a - j_t * share,
            by.bn + n * self.share_b - self.j_n * share,
            by.bt + t * self.share_b - j_t * share,
        )


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class WeakeningHit(CoulombHit):
    """Friction falls with the slip s: mu(s) = mu (LEAST + FADING exp(-RATE |s|)) / their sum."""

    def __init__(self, law: Law, a: NT, b: NT, pair: Pair, is_wall: bool) -> None:
        super().__init__(law, a, b, pair, is_wall)
        fading = FADING * decay(RATE * abs(self.slip))
        self.share = (LEAST + fading) / (LEAST + FADING)
        self.fades = -math.copysign(RATE * fading / (LEAST + FADING), self.slip)
        self.mu = pair.friction * self.share

    def slope(self, by: Nudge) -> Four:
        fades = self.pair.friction * self.fades * (by.at - by.bt)
        return self.slope_by(by, by.mu * self.share + fades)


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class PublishedHit(Hit):
    """Each tangential velocity changes by mu times its own change of normal velocity."""

    def slope(self, by: Nudge) -> Four:
        a_n, a_t = self.a
        b_n, b_t = self.b
        new_an, new_at, new_bn, new_bt = self.after
        pair = self.pair
        total, closing = pair.m_a + pair.m_b, pair.restitution * (a_n - b_n)
        of_closing = by.e * (a_n - b_n) + pair.restitution * (by.an - by.bn)
        momentum = by.m_a * a_n + pair.m_a * by.an + by.m_b * b_n + pair.m_b * by.bn
        heavier = by.m_a + by.m_b
        n_a = momentum - by.m_b * closing - pair.m_b * of_closing - new_an * heavier
        n_b = momentum + by.m_a * closing + pair.m_a * of_closing - new_bn * heavier
        n_a, n_b, along = n_a / total, n_b / total, sign(a_t - b_t)
        t_a = by.at - along * (by.mu * (a_n - new_an) + pair.friction * (by.an - n_a))
        t_b = by.bt + along * (by.mu * (b_n - new_bn) + pair.friction * (by.bn - n_b))
        # What would turn round is held at zero.
        t_a = 0.0 if new_at == 0.0 and a_t != 0.0 else t_a
        t_b = 0.0 if new_bt == 0.0 and b_t != 0.0 else t_b
        return n_a, t_a, n_b, t_b


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class CushionHit(Hit):
    """v_n' = -e v_n, and friction takes mu |v_n' - v_n| off v_t."""

    def slope(self, by: Nudge) -> Four:
        v_n, v_t = self.a
        new_n, new_t, _, _ = self.after
        n = -(self.pair.restitution * by.an + by.e * v_n)
        if new_t == 0.0 and v_t != 0.0:
            return n, 0.0, 0.0, 0.0
        push = new_n - v_n
        more = n - by.an if push >= 0.0 else by.an - n
        slows = by.mu * abs(push) + self.pair.friction * more
        return n, by.at - sign(v_t) * slows, 0.0, 0.0


def answer_of(law: Law, a: NT, b: NT, pair: Pair, is_wall: bool) -> Four:
    """Return the parts of the velocities after a hit."""
    if is_wall:
        n, t = law.cushion(a, pair.restitution, pair.friction)
        return n, t, 0.0, 0.0
    new_a, new_b = law.ball_ball(a, b, pair)
    an, at = new_a
    bn, bt = new_b
    return an, at, bn, bt


def largest(p: float, q: float, r: float, s: float) -> float:
    """Return the largest size of four numbers."""
    return max(max(abs(p), abs(q)), max(abs(r), abs(s)))


def is_known(law: Law) -> bool:
    """Tell whether the slopes of a law are written down."""
    kind = type(law)
    return kind is Coulomb or kind is Published or kind is Weakening


def known_hit(law: Law, a: NT, b: NT, pair: Pair, is_wall: bool) -> Hit:
    """Return a hit of a law whose slopes are written down."""
    kind = type(law)
    if is_wall:
        return CushionHit(law, a, b, pair, is_wall)
    if kind is Coulomb:
        return CoulombHit(law, a, b, pair, is_wall)
    if kind is Published:
        return PublishedHit(law, a, b, pair, is_wall)
    return WeakeningHit(law, a, b, pair, is_wall)
