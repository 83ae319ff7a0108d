"""A law of a user's own is asked a little beside a hit, and its slopes are checked differences.

A difference over steps to both sides has an error of the second order in the step, and two steps
have all but one of the fourth (Richardson's extrapolation). The law has a kink where the slopes to
the two sides do not come together as the steps shrink. At a limit, such as no friction, there is
only one side.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.contact.contact import NT, Pair
from pool_pymunk.core.contact.laws import Law
from pool_pymunk.core.tangent.slopes import Four, Hit, Nudge, answer_of, largest

FIRST: Final = 2.0**-7  # the first step, as a share of the speeds or of the number
LESS: Final = 0.125  # The next step is this share of the last one.
SMALLEST: Final = 2.0**-20
SURE: Final = 1e-7  # Slopes of two steps agree to this share, or a smaller step is tried.
COUNT: Final = 8  # numbers that a law may be asked with
UNKNOWN: Four = (math.nan, math.nan, math.nan, math.nan)  # the slope where there is none


@final
class OwnHit(Hit):
    """This is a hit of a law of somebody's own.

    The slopes by each number that the law is asked with are kept. A sum of them is right where all
    are known. Else the law may be smooth along a nudge alone, and is asked along it. Where a kink
    does not matter, as for rounding, the mean of both sides counts.
    """

    def __init__(
        self, law: Law, a: NT, b: NT, pair: Pair, is_wall: bool, minds_kinks: bool = True
    ) -> None:
        super().__init__(law, a, b, pair, is_wall)
        an, at = a
        bn, bt = b
        self.minds_kinks = minds_kinks
        self.speed: Final = max(max(abs(an - bn), abs(at - bt)), largest(an, at, bn, bt))
        self.slopes: Final[list[Four | None]] = [None] * COUNT

    def slope(self, by: Nudge) -> Four:
        n = t = m = r = 0.0
        for k in range(COUNT):
            part = part_of(by, k)
            if part != 0.0:
                n1, t1, m1, r1 = self._slope_by_one(k)
                n, t, m, r = n + part * n1, t + part * t1, m + part * m1, r + part * r1
        if n == n or not by.is_known:
            return n, t, m, r
        return self._difference(by, self._share(by))

    def _slope_by_one(self, k: int) -> Four:
        """Return the slope by one of the numbers."""
        known = self.slopes[k]
        if known is None:
            by = Nudge()
            put_part(by, k)
            known = self.slopes[k] = self._difference(by, self._share(by))
        return known

    def _share(self, by: Nudge) -> float:
        """Return how large a nudge is as a share of the numbers that it changes."""
        share = largest(by.an, by.at, by.bn, by.bt) / self.speed
        share = max(share, max(abs(by.e), abs(by.mu)))
        of_b = 0.0 if self.is_wall else abs(by.m_b) / self.pair.m_b
        return share if self.is_wall else max(share, max(abs(by.m_a) / self.pair.m_a, of_b))

    def _difference(self, by: Nudge, share: float) -> Four:
        """Return the slope along a nudge; nan where there is none."""
        step = FIRST
        while step >= SMALLEST:
            found = self._extrapolated(by, step / share, SURE * share * self.speed)
            if found[0] == found[0]:
                return found
            step *= LESS
        return UNKNOWN

    def _extrapolated(self, by: Nudge, h: float, least: float) -> Four:
        """Return the slope by steps of this size and half of it; nan if they do not agree."""
        side = self._only_side(by, h)
        if side != 0.0:
            whole, half = self._to_side(by, side * h), self._to_side(by, side * h / 2.0)
        else:
            if self.minds_kinks and self._is_bent(by, h, least):
                return UNKNOWN
            whole, half = self._central(by, h), self._central(by, h / 2.0)
        if not off_of(whole, half) <= least:
            return UNKNOWN
        return mixed(half, 4.0 / 3.0, whole, -1.0 / 3.0)

    def _only_side(self, by: Nudge, h: float) -> float:
        """Return to which side (1 or -1) alone a step may go, or 0.

        Friction is not below 0, and restitution is from 0 to 1.
        """
        mu, e = self.pair.friction, self.pair.restitution
        if mu < 2.0 * h * abs(by.mu):
            return math.copysign(1.0, by.mu)
        if e < 2.0 * h * abs(by.e):
            return math.copysign(1.0, by.e)
        return -math.copysign(1.0, by.e) if e + 2.0 * h * abs(by.e) > 1.0 else 0.0

    def _is_bent(self, by: Nudge, h: float, least: float) -> bool:
        """Tell whether the slopes to both sides do not come together as the step shrinks."""
        wide = off_of(self._to_side(by, h), self._to_side(by, -h))
        near = off_of(self._to_side(by, h / 2.0), self._to_side(by, -h / 2.0))
        return not near <= max(least, wide / 2.0)

    def _central(self, by: Nudge, h: float) -> Four:
        return mixed(self._at(by, h), 0.5 / h, self._at(by, -h), -0.5 / h)

    def _to_side(self, by: Nudge, h: float) -> Four:
        """Return the slope to one side, by steps of one size and twice of it."""
        far = mixed(self._at(by, 2.0 * h), -0.5 / h, self.after, -1.5 / h)
        return mixed(self._at(by, h), 2.0 / h, far, 1.0)

    def _at(self, by: Nudge, h: float) -> Four:
        """Return the answer to a hit that is nudged so many times."""
        an, at = self.a
        bn, bt = self.b
        pair = self.pair
        a, b = (an + h * by.an, at + h * by.at), (bn + h * by.bn, bt + h * by.bt)
        m_a, m_b = pair.m_a + h * by.m_a, pair.m_b + h * by.m_b
        new = Pair(m_a, m_b, pair.restitution + h * by.e, pair.friction + h * by.mu)
        return answer_of(self.law, a, b, new, self.is_wall)


def part_of(by: Nudge, k: int) -> float:
    """Return one of the numbers of a nudge."""
    if k < 4:
        return by.an if k == 0 else by.at if k == 1 else by.bn if k == 2 else by.bt
    return by.m_a if k == 4 else by.m_b if k == 5 else by.e if k == 6 else by.mu


def put_part(by: Nudge, k: int) -> None:
    """Let one of the numbers of a nudge be 1."""
    by.an, by.at, by.bn, by.bt = float(k == 0), float(k == 1), float(k == 2), float(k == 3)
    by.m_a, by.m_b, by.e, by.mu = float(k == 4), float(k == 5), float(k == 6), float(k == 7)


def mixed(p: Four, by: float, q: Four, its: float) -> Four:
    """Return so many times the one and the other, added up."""
    a, b, c, d = p
    e, f, g, h = q
    return by * a + its * e, by * b + its * f, by * c + its * g, by * d + its * h


def off_of(p: Four, q: Four) -> float:
    """Return how far (m/s) two answers are apart."""
    a, b, c, d = p
    e, f, g, h = q
    return largest(a - e, b - f, c - g, d - h)
