"""Contacts of one instant, put into the core and answered there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.contact.contact import Disc, groups
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.contact.laws import HitsByLaw
from pool_pymunk.core.contact.laws import Law as CoreLaw
from pool_pymunk.core.motion.path import standing
from pool_pymunk.core.variant import NO_SLIP
from pool_pymunk.core.walls.wall import Wall
from pool_pymunk.laws import Law, law_in_core
from pool_pymunk.laws.contact import NO_BALL, Contact, Vector


class InCore:
    """These are contacts and discs in the core; discs are by the numbers of their balls."""

    def __init__(self, contacts: Sequence[Contact], velocity: Mapping[int, Vector]) -> None:
        balls = {i: Ball(i, 0.5, 1.0, standing(0.0, 0.0, 0.0)) for i in velocity}
        self.discs = {i: Disc(balls[i], 0.0, 0.0, *v) for i, v in velocity.items()}
        self.contacts = [self._contact(one) for one in contacts]

    def _contact(self, one: Contact) -> CoreContact:
        wall = Wall([], one.pair.restitution, one.pair.friction, one.cushion or 0)
        other = None if one.b == NO_BALL else self.discs[one.b]
        m_b = math.inf if other is None else one.pair.m_b
        pair = CorePair(one.pair.m_a, m_b, one.pair.restitution, one.pair.friction)
        a = self.discs[one.a]
        found = CoreContact(a, other, wall if other is None else None, *one.normal, pair)
        found.px, found.py, found.gap = *one.point, one.gap
        a.ball.mass = one.pair.m_a
        if other is not None:
            other.ball.mass = m_b
        return found

    @property
    def velocity(self) -> dict[int, Vector]:
        """The velocities (m/s) of the balls now."""
        return {i: (disc.vx, disc.vy) for i, disc in self.discs.items()}

    def answer(self, contacts: list[CoreContact], law: CoreLaw) -> None:
        """Answer contacts by a law, group by group of those that share a ball."""
        hits = HitsByLaw(law, NO_SLIP)
        for group in groups(contacts):
            if len(group) == 1:
                hits.answer(group[0])
            else:
                law.together(group, hits)


def answered_in_core(
    contacts: Sequence[Contact], velocity: Mapping[int, Vector], law: Law
) -> dict[int, Any]:
    """Return the velocities after contacts of one instant, as the core answers them."""
    found = InCore(contacts, velocity)
    found.answer(found.contacts, law_in_core(law))
    return found.velocity
