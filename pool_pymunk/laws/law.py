"""Contact laws take the velocities before a contact and return the velocities after it.

A :class:`Law` answers every contact of every solver, so a comparison of solvers differs in time
integration only. To write a law of your own, make a subclass and override what you want to change.
What you do not override stays Coulomb's. The equations of the package's laws stand in
:mod:`pool_pymunk.core.contact.laws`.

>>> class Smooth(Law):
...     def ball_ball(self, a, b, pair):
...         return super().ball_ball(a, b, pair._replace(friction=0.0))
>>> Smooth().ball_ball(NT(1.0, 0.5), NT(0.0, 0.0), Pair(0.2, 0.2, 1.0, 0.1))
(NT(n=0.0, t=0.5), NT(n=1.0, t=0.0))
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from inspect import isfunction, signature
from typing import ClassVar

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact import contact as core
from pool_pymunk.core.contact import laws
from pool_pymunk.core.contact.together import Hits
from pool_pymunk.core.motion.path import standing
from pool_pymunk.laws.contact import NO_BALL, NT, Contact, Pair, Respond, Velocities

NO_FRICTION = (0.0, 0.0)  # This slip stands for an answer without friction.


class Law:
    """A law answers contacts; this base class is Coulomb's law for a single hit.

    For contacts of one instant it takes the mean over their orders. ``name`` is the name that a run
    reports. A subclass that gives no name is called by its class's name. TypeError names a method
    of a subclass that cannot take what it is asked with.
    """

    name = "law"
    equations: ClassVar[laws.Law] = laws.Law()  # They answer what nobody overrides.

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in vars(cls):
            cls.name = cls.__name__
        for method in (Law.ball_ball, Law.cushion, Law.together, Law.jumps):
            _refuse_other_arguments(cls, method)

    def ball_ball(self, a: NT, b: NT, pair: Pair) -> tuple[NT, NT]:
        """Return the velocities of A and B after their hit; the normal points from A to B."""
        new_a, new_b = self.equations.ball_ball(a, b, core.Pair(*pair))
        return NT(*new_a), NT(*new_b)

    def cushion(self, v: NT, restitution: float, friction: float) -> NT:
        """Return the velocity after a hit on a cushion; the normal points into the table."""
        return NT(*self.equations.cushion(v, restitution, friction))

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        """Answer closing contacts of one instant that share balls, and change ``velocity`` (m/s).

        ``respond(contact, velocity)`` answers one contact by this law, in place. In a real rack the
        outcome depends on the order of the hits. This method therefore takes the mean over the
        orders in which the hits could have come
        (:func:`~pool_pymunk.core.contact.together.mean_over_orders`).
        """
        Copied(contacts, velocity, respond).answer_by(self.equations)

    @property
    def hits_are_coulombs(self) -> bool:
        """Tell whether single hits follow Coulomb's law, so that their cycles may be leapt over."""
        own = type(self)
        is_plain = own.ball_ball is Law.ball_ball and own.cushion is Law.cushion
        return is_plain and type(self.equations) in (laws.Law, laws.Coulomb)

    @property
    def may_gain_energy(self) -> bool:
        """Tell whether energy may grow at a hit; at Coulomb's it never does."""
        return not self.hits_are_coulombs

    def jumps(self, a: NT, b: NT, pair: Pair) -> bool:
        """Tell whether the law jumps here, so that rounding would decide its answer."""
        return self.equations.jumps(a, b, core.Pair(*pair))


def _refuse_other_arguments(kind: type[Law], method: Callable[..., object]) -> None:
    """Refuse a method of a law of one's own that cannot take what Law's own takes."""
    own, (_, *takes) = vars(kind).get(method.__name__), signature(method).parameters
    if not isfunction(own):
        return
    try:
        signature(own).bind(kind, *takes)
    except TypeError:
        message = f"its {method.__name__} must take {', '.join(takes)} after self"
        raise TypeError(f"law {kind.name}: {message}") from None


class Coulomb(Law):
    """This is the default law; it solves contacts of one instant for all impulses at once."""

    name = "coulomb"
    equations = laws.Coulomb()

    def together(self, contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
        Copied(contacts, velocity, respond).answer_by(Coulomb.equations)


class Published(Law):
    """This law is Listing 3 of the report; it answers contacts in the listing's order."""

    name = "published"
    equations = laws.Published()


class Weakening(Law):
    """This law is Coulomb's, but friction of two balls falls with their slip, as measured.

    The scene's friction is that without slip: mu(s) = mu (0.009951 + 0.108 exp(-1.088 s)) /
    0.117951, with the slip s before the hit in m/s. The slip does not turn round, and energy never
    grows.
    """

    name = "weakening"
    equations = laws.Weakening()

    @property
    def may_gain_energy(self) -> bool:
        return False


BUILT_IN = (Coulomb, Published, Weakening)
# A scenario file, an option and an argument may name these laws. You may add a law of your own.
LAWS: dict[str, Law] = {law.name: law for law in (kind() for kind in BUILT_IN)}


def find_law(law: str | Law) -> Law:
    """Return the law of that name, or the law itself if it is one.

    >>> find_law("coulomb").name
    'coulomb'
    """
    return law if isinstance(law, Law) else LAWS[law]


class Copied(Hits):
    """Contacts and the velocities of their balls are here as the core has them.

    A single hit is answered by ``respond``, which may be a user's.
    """

    def __init__(
        self,
        contacts: Sequence[Contact],
        velocity: Velocities,
        respond: Respond = lambda *_: None,
    ) -> None:
        super().__init__(NO_FRICTION)
        self.velocity, self.respond = velocity, respond
        self.discs: dict[int, core.Disc] = {}
        for each in contacts:
            for i, mass in zip(each.balls, each.pair, strict=False):
                if i not in self.discs:
                    ball = Ball(i, 1.0, mass, standing(0.0, *each.point))
                    self.discs[i] = core.Disc(ball, *each.point, *velocity[i][:2])
        self.contacts = [self.copy(each) for each in contacts]
        self.known = dict(zip(self.contacts, contacts, strict=True))

    def copy(self, contact: Contact) -> core.Contact:
        """Return a contact as the core has it."""
        a, b = self.discs[contact.a], None if contact.b == NO_BALL else self.discs[contact.b]
        one = core.Contact(a, b, None, *contact.normal, core.Pair(*contact.pair))
        one.gap, one.curvature, one.kick = contact.gap, contact.curvature, contact.kick
        (one.px, one.py), (one.ux, one.uy) = contact.point, contact.drift
        return one

    def answer_by(self, law: laws.Law) -> None:
        """Let a law of the core answer the contacts, of which single hits are answered here."""
        law.together(self.contacts, self)
        self.write()

    def answer(self, one: core.Contact) -> None:
        self.write()
        self.respond(self.known[one], self.velocity)
        for i, disc in self.discs.items():
            disc.vx, disc.vy = self.velocity[i]

    def write(self) -> None:
        """Write the velocities that the balls have now."""
        for i, disc in self.discs.items():
            self.velocity[i] = disc.vx, disc.vy
