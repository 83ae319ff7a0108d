"""Laws, pairs, sides and surfaces of a user's own play in the core by these adapters.

A user's classes take and return the named tuples of the package; the core takes and hands plain
numbers. So what they return is checked here: what is no number is refused by an error that names
its type, as it comes where such a thing is first reckoned with.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

from pool_pymunk.core.ball import Ball
from pool_pymunk.core.contact import laws as core_laws
from pool_pymunk.core.contact.contact import Contact as CoreContact
from pool_pymunk.core.contact.contact import Disc
from pool_pymunk.core.contact.contact import Pair as CorePair
from pool_pymunk.core.contact.together import Hits
from pool_pymunk.core.motion.path import Path as CorePath
from pool_pymunk.core.motion.surface import Push, Surface
from pool_pymunk.core.table import Table
from pool_pymunk.core.walls.side import Side
from pool_pymunk.model import Scene
from pool_pymunk.physics.contact import NO_BALL, NT, Contact, Pair, Vector, Velocities
from pool_pymunk.physics.laws import LAWS, Coulomb, Law, balls_after, jumps_at, respond
from pool_pymunk.physics.path import Path, fastest_of, motion_at
from pool_pymunk.physics.sides import core_of

Plain = tuple[float, float]  # a velocity (m/s) along the normal and the tangent, or a place


class OwnLaw(core_laws.Law):
    """This law of the core asks a law of a user's own."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self.name = str(law.name)
        self.is_coulomb = bool(law.hits_are_coulombs)
        self.solves_at_once = type(law).together is Coulomb.together

    def ball_ball(self, a: Plain, b: Plain, pair: CorePair) -> tuple[Plain, Plain]:
        new_a, new_b = self.law.ball_ball(NT(*a), NT(*b), pair_of(pair))
        return parts_of(new_a, a), parts_of(new_b, b)

    def cushion(self, v: Plain, restitution: float, friction: float) -> Plain:
        return parts_of(self.law.cushion(NT(*v), restitution, friction), v)

    def jumps(self, a: Plain, b: Plain, pair: CorePair) -> bool:
        jumps: Any = self.law.jumps(NT(*a), NT(*b), pair_of(pair))
        said = 0
        if jumps:
            said |= jumps  # What is neither a truth value nor a whole number is refused.
        return bool(said)

    def together(self, contacts: list[CoreContact], hits: Hits) -> bool:
        """Let the law answer contacts as it knows them; its single hits are noted."""
        own = OwnRound(self.law, contacts, hits)
        self.law.together(own.contacts, own.velocity, own.answer)
        own.carry_out()
        return False


def parts_of(after: Any, before: Plain) -> Plain:
    """Return the parts (m/s) of a velocity that a law gives; it must have n and t, as an NT has."""
    changes(after.n, before[0])
    changes(after.t, before[1])
    return float(after.n), float(after.t)


def changes(after: Any, before: Any) -> None:
    """Raise the error of a difference of two numbers, if one is none."""
    after - before


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


class ScenePairs(Table):
    """This table asks a scene for the coefficients of two balls, because it has its own.

    It asks once for each two balls of a run.
    """

    scene: Scene

    def begin(self, scene: Scene) -> None:
        """Begin a run of a scene."""
        self.scene = scene
        self.known: dict[tuple[int, int], CorePair] = {}

    def pair(self, a: Ball, b: Ball) -> CorePair:
        both = a.number, b.number
        if both not in self.known:
            self.known[both] = CorePair(*numbers_of(self.scene.pair(*both), self.scene))
        return self.known[both]


def numbers_of(pair: Any, scene: Scene) -> tuple[float, float, float, float]:
    """Return the numbers of a pair; the scene's law says what is wrong with what is no pair."""
    if not isinstance(pair, Pair) or not all(isinstance(number, Real) for number in pair):
        law, a, b = LAWS[scene.physics.law], NT(1.0, 0.5), NT(0.0, 0.0)
        jumps_at(law, a, b, pair)
        balls_after(law, a, b, pair)
    return float(pair.m_a), float(pair.m_b), float(pair.restitution), float(pair.friction)


class OwnSide(Side):
    """This side of the core asks a side of a user's own, which may answer lengths or times."""

    def __init__(self, side: Any) -> None:
        super().__init__(core_of(side))
        self.side = side

    def time_of_contact(self, path: CorePath, r: float, now: float) -> float:
        t = self.side.time_of_contact(path_of(path), r, now)
        return float(t) if t < math.inf else math.inf

    def gap(self, x: float, y: float, r: float) -> float:
        return float(self.side.gap(x, y, r) / 1.0)

    def normal(self, x: float, y: float) -> Vector:
        nx, ny = self.side.normal(x, y)
        return float(1.0 * nx), float(1.0 * ny)

    def curvature(self, x: float, y: float) -> float:
        bends = self.side.curvature(x, y)
        return math.copysign(abs(bends), bends)


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
        return roll_in_core(self.surface.roll(path_of(path), t))

    def roll_after(self, path: CorePath, t: float, pushes: list[Push]) -> Vector:
        own = [((nx, ny), slows) for nx, ny, slows in pushes]
        return roll_in_core(self.surface.roll(path_of(path), t, own))


def roll_in_core(roll: Any) -> Vector:
    """Return a roll (m/s) that a user's surface gives."""
    wx, wy = roll
    changes(0.0, wx)
    changes(0.0, wy)
    return float(wx), float(wy)


def path_of(path: CorePath) -> Path:
    """Return a path of the core as a user's classes take it."""
    return Path(
        path.t, path.x, path.y, path.vx, path.vy, path.ax, path.ay, path.end, path.slows,
        path.wx, path.wy,
    )  # fmt: skip


def path_in_core(path: Path) -> CorePath:
    """Return a path of a user's class as the core has it."""
    fastest_of(path)
    path.is_lost(1.0)
    motion_at(path, path.t)
    *numbers, end, slows, wx, wy = path
    changes(wx, 0.0)
    changes(wy, 0.0)
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
