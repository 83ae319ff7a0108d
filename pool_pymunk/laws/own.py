"""Laws of a user's own play in the core by these adapters.

A user's law takes and returns the named tuples of :mod:`pool_pymunk.laws.contact`; the core takes
and hands plain numbers. So what a law returns is checked here: what is no number is refused by an
error that names its type.
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.contact.contact import Disc
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.contact.together import Hits
from pool_pymunk.laws.contact import NO_BALL, NT, Contact, Pair, Velocities
from pool_pymunk.laws.law import BUILT_IN, NO_FRICTION, Copied, Coulomb, Law

Plain = tuple[float, float]  # a velocity (m/s) along the normal and the tangent, or a place


def law_in_core(law: Law) -> core_laws.Law:
    """Return a law as the core takes it; those of the package are the core's own."""
    return law.equations if type(law) in BUILT_IN else OwnLaw(law)


def respond(law: Law, contact: Contact, velocity: Velocities) -> bool:
    """Answer one contact by a law, and change ``velocity`` (m/s).

    Return whether the law jumps there; if it does, friction is left out.
    """
    return answer(law_in_core(law), contact, velocity, NO_FRICTION)


def answer(law: core_laws.Law, contact: Contact, velocity: Velocities, slip: Plain) -> bool:
    """Answer one contact by a law of the core, and change ``velocity`` (m/s); return if it jumps.

    Where it jumps, the contact has this ``slip`` of A and B along the tangent (as multiples of the
    least that counts) instead of the one that only rounding knows.
    """
    copied = Copied([contact], velocity)
    jumps = law.respond(copied.contacts[0], slip)
    copied.write()
    return jumps


class OwnLaw(core_laws.Law):
    """This law of the core asks a law of a user's own."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self.name = str(law.name)
        self.is_coulomb = bool(law.hits_are_coulombs)
        self.solves_at_once = type(law).together is Coulomb.together

    def ball_ball(self, a: Plain, b: Plain, pair: CorePair) -> tuple[Plain, Plain]:
        new_a, new_b = ball_ball_by(self.law, NT(*a), NT(*b), pair_of(pair))
        return parts_of(new_a, a), parts_of(new_b, b)

    def cushion(self, v: Plain, restitution: float, friction: float) -> Plain:
        return parts_of(cushion_by(self.law, NT(*v), restitution, friction), v)

    def jumps(self, a: Plain, b: Plain, pair: CorePair) -> bool:
        jumps: Any = self.law.jumps(NT(*a), NT(*b), pair_of(pair))
        said = 0
        if jumps:
            said |= jumps  # What is neither a truth value nor a whole number is refused.
        return bool(said)

    def together(self, contacts: list[CoreContact], hits: Hits) -> bool:
        """Let the law answer contacts as it knows them; its single hits are noted."""
        if type(self.law).together is Law.together:
            return self.law.equations.together(contacts, hits)
        own = OwnRound(self, contacts, hits)
        self.law.together(own.contacts, own.velocity, own.answer)
        own.carry_out()
        return False


def ball_ball_by(law: Law, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
    """Return what a law answers to a hit of two balls; raises TypeError if that is no two NT."""
    after: object = law.ball_ball(a, b, pair)
    if not (isinstance(after, tuple | list) and len(after) == 2 and all(map(is_velocity, after))):
        what = "ball_ball must return the velocities of A and B after the hit, as two NT"
        raise TypeError(f"law {law.name} returned {after!r}: its {what}")
    new_a, new_b = after
    return new_a, new_b


def cushion_by(law: Law, v: NT, restitution: float, friction: float) -> NT:
    """Return what a law answers to a hit on a cushion; raises TypeError if that is no NT."""
    after = law.cushion(v, restitution, friction)
    if not is_velocity(after):
        what = "cushion must return the velocity after the hit, as an NT"
        raise TypeError(f"law {law.name} returned {after!r}: its {what}")
    return after


def is_velocity(after: object) -> bool:
    """Tell whether something has the parts n and t, as an NT has."""
    return hasattr(after, "n") and hasattr(after, "t")


def parts_of(after: Any, before: Plain) -> Plain:
    """Return the parts (m/s) of a velocity that a law gives, which must be numbers."""
    changes(after.n, before[0])
    changes(after.t, before[1])
    return float(after.n), float(after.t)


def changes(after: Any, before: Any) -> None:
    """Raise the error of a difference of two numbers, if one is none."""
    after - before


class OwnRound:
    """Contacts that share balls, and the balls' velocities, are here as a user's law takes them."""

    def __init__(self, law: OwnLaw, contacts: list[CoreContact], hits: Hits) -> None:
        self.law, self.hits = law, hits
        self.discs = {disc.ball.number: disc for one in contacts for disc in discs_of(one)}
        self.velocity: Velocities = {i: (disc.vx, disc.vy) for i, disc in self.discs.items()}
        self.contacts = [contact_of(one) for one in contacts]
        self.known = {each[:3]: one for each, one in zip(self.contacts, contacts, strict=True)}

    def answer(self, contact: Contact, velocity: Velocities) -> None:
        """Answer one contact by the law, and note what it has changed."""
        before = [velocity[i] for i in contact.balls]
        jumps = answer(self.law, contact, velocity, self.hits.slip)
        one = self.known.get(contact[:3])
        if one is None:
            return
        one.jumped = one.jumped or bool(jumps)
        for i in contact.balls:
            self._set(i, velocity[i])
        (ax, ay), (bx, by) = self._plain(before[0]), self._plain(before[-1])
        self.hits.note(one, ax, ay, bx, by)

    def carry_out(self) -> None:
        """Give the balls the velocities that the law has left."""
        for i in sorted(self.discs):
            v, disc = self.velocity[i], self.discs[i]
            changes(v[0], disc.vx)
            changes(v[1], disc.vy)
        for i in self.discs:
            self._set(i, self.velocity[i])

    def _set(self, i: int, v: Any) -> None:
        """Give a ball a velocity (m/s)."""
        self.discs[i].vx, self.discs[i].vy = self._plain(v)

    def _plain(self, v: Any) -> Plain:
        """Return the first two numbers of a velocity (m/s)."""
        return float(v[0]), float(v[1])


def contact_of(one: CoreContact) -> Contact:
    """Return a contact as a user's law takes it."""
    b = NO_BALL if one.b is None else one.b.ball.number
    cushion = None if one.wall is None else one.wall.number
    return Contact(
        one.a.ball.number, b, (one.nx, one.ny), pair_of(one.pair), cushion, (one.px, one.py),
        one.gap, one.curvature, (one.ux, one.uy), one.kick,
    )  # fmt: skip


def discs_of(one: CoreContact) -> tuple[Disc, ...]:
    """Return the discs of a contact, one or two."""
    return (one.a,) if one.b is None else (one.a, one.b)


def pair_of(pair: CorePair) -> Pair:
    """Return a pair as a user's law takes it."""
    return Pair(pair.m_a, pair.m_b, pair.restitution, pair.friction)
