"""Laws, sides and surfaces of a user's own play in the core by these adapters.

A user's classes take and return the named tuples of the package; the core hands plain numbers.
"""

from __future__ import annotations

from typing import Any

from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.contact.contact import Disc
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.contact.together import Hits
from pool_pymunk.core.motion.path import Path as CorePath
from pool_pymunk.core.motion.surface import Surface
from pool_pymunk.core.walls.side import Side
from pool_pymunk.physics.contact import NO_BALL, NT, Contact, Pair, Vector, Velocities
from pool_pymunk.physics.laws import Coulomb, Law, respond
from pool_pymunk.physics.path import Path
from pool_pymunk.physics.sides import core_of

Plain = tuple[float, float]  # a velocity (m/s) along the normal and the tangent, or a place


class OwnLaw(core_laws.Law):
    """This law of the core asks a law of a user's own."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self.name = str(law.name)
        self.is_coulomb = law.hits_are_coulombs
        self.solves_at_once = type(law).together is Coulomb.together

    def ball_ball(self, a: Plain, b: Plain, pair: CorePair) -> tuple[Plain, Plain]:
        (an, at), (bn, bt) = self.law.ball_ball(NT(*a), NT(*b), pair_of(pair))
        return (an, at), (bn, bt)

    def cushion(self, v: Plain, restitution: float, friction: float) -> Plain:
        n, t = self.law.cushion(NT(*v), restitution, friction)
        return n, t

    def jumps(self, a: Plain, b: Plain, pair: CorePair) -> bool:
        return self.law.jumps(NT(*a), NT(*b), pair_of(pair))

    def together(self, contacts: list[CoreContact], hits: Hits) -> bool:
        """Let the law answer contacts as it knows them; its single hits are noted."""
        own = OwnRound(self.law, contacts, hits)
        self.law.together(own.contacts, own.velocity, own.answer)
        own.carry_out()
        return False


class OwnRound:
    """Contacts that share balls, and the balls' velocities, are here as a user's law takes them."""

    def __init__(self, law: Law, contacts: list[CoreContact], hits: Hits) -> None:
        self.law, self.hits = law, hits
        self.discs = {disc.ball.number: disc for one in contacts for disc in discs_of(one)}
        self.velocity: Velocities = {i: (disc.vx, disc.vy) for i, disc in self.discs.items()}
        self.contacts = [contact_of(one) for one in contacts]
        self.known = {each[:3]: one for each, one in zip(self.contacts, contacts, strict=True)}

    def answer(self, contact: Contact, velocity: Velocities) -> None:
        """Answer one contact by the law, and note what it has changed."""
        before = [velocity[i] for i in contact.balls]
        jumps = respond(self.law, contact, velocity, self.hits.slip)
        one = self.known.get(contact[:3])
        if one is None:
            return
        one.jumped = one.jumped or jumps
        for i in contact.balls:
            self.discs[i].vx, self.discs[i].vy = velocity[i]
        self.hits.note(one, *before[0], *before[-1])

    def carry_out(self) -> None:
        """Give the balls the velocities that the law has left."""
        for i, disc in self.discs.items():
            disc.vx, disc.vy = self.velocity[i]


class OwnSide(Side):
    """This side of the core asks a side of a user's own, which may answer lengths or times."""

    def __init__(self, side: Any) -> None:
        super().__init__(core_of(side))
        self.side = side

    def time_of_contact(self, path: CorePath, r: float, now: float) -> float:
        return float(self.side.time_of_contact(path_of(path), r, now))

    def gap(self, x: float, y: float, r: float) -> float:
        return float(self.side.gap(x, y, r))

    def normal(self, x: float, y: float) -> Vector:
        nx, ny = self.side.normal(x, y)
        return float(nx), float(ny)

    def curvature(self, x: float, y: float) -> float:
        return float(self.side.curvature(x, y))


class OwnSurface(Surface):
    """This surface of the core asks a surface of a user's own."""

    def __init__(self, surface: Any) -> None:
        drag = getattr(surface, "drag", surface.pull)
        super().__init__(float(surface.pull), float(drag), bool(surface.rolls))
        self.surface = surface

    def path(self, t: float, place: Vector, velocity: Vector, roll: Vector) -> CorePath:
        return path_in_core(self.surface.path(t, place, velocity, roll))

    def then(self, path: CorePath) -> CorePath | None:
        then = self.surface.then(path_of(path))
        return None if then is None else path_in_core(then)

    def roll(self, path: CorePath, t: float) -> Vector:
        x, y = self.surface.roll(path_of(path), t)
        return float(x), float(y)


def path_of(path: CorePath) -> Path:
    """Return a path of the core as a user's classes take it."""
    return Path(
        path.t, path.x, path.y, path.vx, path.vy, path.ax, path.ay, path.end, path.slows,
        path.wx, path.wy,
    )  # fmt: skip


def path_in_core(path: Path) -> CorePath:
    """Return a path of a user's class as the core has it."""
    *numbers, end, slows, wx, wy = path
    t, x, y, vx, vy, ax, ay = map(float, numbers)
    return CorePath(t, x, y, vx, vy, ax, ay, float(end), bool(slows), float(wx), float(wy))


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
