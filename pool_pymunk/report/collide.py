"""This module is Part 1 of the report: two balls meet at an offset (Figs. 1 and 2).

Seen from B, A comes along a straight line, in the direction of approach u. The *offset* e is the
distance of B's centre from that line, positive if it lies to its left. When the balls touch, the
centres are e apart across u, and sqrt(R^2 - e^2) along it, where R is the sum of the radii. So the
normal n from A to B is turned from u by asin(e / R): at e = 0 the hit is head-on, and at |e| = R
the balls just miss. The velocities change along n and t = (-n_y, n_x) by the law of every solver.

The report turns velocities through the impact angle instead (Eqs. 4 to 7). This is the same with
atan2(d_y, d_x) of the line of centres; docs/report.md says where its atan and its signs break down.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass

from pool_pymunk.laws import LAWS, Law, find_law, respond
from pool_pymunk.laws.contact import NT, Contact, Pair, split
from pool_pymunk.model import Point, Problem
from pool_pymunk.model.plain import between, choice, finite, number, point, problems_of, size
from pool_pymunk.model.problems import raise_any
from pool_pymunk.results.words import without_slip


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc is one of two balls that meet: mass (kg), radius (m), velocity (m/s).

    >>> Disc("0.1", 0.03)
    Traceback (most recent call last):
        ...
    pool_pymunk.SceneError: mass = "0.1": must be a number
    """

    mass: float
    radius: float
    velocity: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        for key, read in (("mass", number), ("radius", number), ("velocity", point)):
            raise_any(problems_of(getattr(self, key), read, key))


@dataclass(frozen=True, slots=True)
class Material:
    """A material has a restitution, a coefficient of friction, and a law (a name or an object)."""

    restitution: float = 1.0
    friction: float = 0.0
    law: str | Law = "coulomb"

    def __post_init__(self) -> None:
        for key in ("restitution", "friction"):
            raise_any(problems_of(getattr(self, key), number, key))


ELASTIC = Material()


@dataclass(frozen=True, slots=True)
class Collision:
    """A collision of balls ``a`` and ``b`` holds what came in, and the velocities after it (m/s).

    ``normal`` is the unit vector from A's centre to B's when they touch.
    """

    a: Disc
    b: Disc
    material: Material
    normal: Point
    velocity_a: Point
    velocity_b: Point
    warnings: tuple[str, ...] = ()

    @property
    def angle(self) -> float:
        """The impact angle (rad), which is the direction of the line of centres from A to B."""
        return math.atan2(self.normal[1], self.normal[0])

    @property
    def contact_distance(self) -> float:
        """The distance of the centres (m), which is the sum of the radii."""
        return self.a.radius + self.b.radius

    @property
    def reach(self) -> float:
        """The former name of ``contact_distance``."""
        warnings.warn("reach is now contact_distance", DeprecationWarning, stacklevel=2)
        return self.contact_distance

    @property
    def approach(self) -> Point:
        """The velocity of A seen from B before the collision (m/s)."""
        return self.a.velocity[0] - self.b.velocity[0], self.a.velocity[1] - self.b.velocity[1]

    @property
    def offset(self) -> float:
        """Return how far B's centre lies left of the line on which A comes, seen from B (m)."""
        ux, uy = _direction(self.a, self.b)
        return self.contact_distance * (ux * self.normal[1] - uy * self.normal[0])

    @property
    def before(self) -> tuple[NT, NT]:
        """The velocities of A and of B before the collision, along n and t (m/s)."""
        return split(self.a.velocity, self.normal), split(self.b.velocity, self.normal)

    @property
    def after(self) -> tuple[NT, NT]:
        """The velocities of A and of B after the collision, along n and t (m/s)."""
        return split(self.velocity_a, self.normal), split(self.velocity_b, self.normal)

    @property
    def impulses(self) -> tuple[NT, NT]:
        """The impulses on A and B along n and t (N s); by `published` they differ along t."""
        a, b = (
            NT(ball.mass * (after.n - before.n), ball.mass * (after.t - before.t))
            for ball, before, after in zip((self.a, self.b), self.before, self.after, strict=True)
        )
        return a, b

    @property
    def momentum(self) -> tuple[Point, Point]:
        """Momentum of both balls along x and y, before and after (N s)."""
        m_a, m_b = self.a.mass, self.b.mass
        before, after = (
            (m_a * v[0] + m_b * w[0], m_a * v[1] + m_b * w[1])
            for v, w in ((self.a.velocity, self.b.velocity), (self.velocity_a, self.velocity_b))
        )
        return before, after

    @property
    def energy(self) -> tuple[float, float]:
        """Kinetic energy of both balls before and after (J)."""
        before, after = (
            _energy(self.a.mass, *v) + _energy(self.b.mass, *w)
            for v, w in ((self.a.velocity, self.b.velocity), (self.velocity_a, self.velocity_b))
        )
        return before, after

    def as_dict(self) -> dict[str, object]:
        """Return the collision as in the JSON of ``collide --json``, in SI and degrees."""
        ends, times = (self.velocity_a, self.velocity_b), ("before", "after")
        balls = zip(
            "AB", (self.a, self.b), ends, self.before, self.after, self.impulses, strict=True
        )
        return {
            "material": asdict(self.material),
            "offset": self.offset,
            "normal": list(self.normal),
            "angle": math.degrees(self.angle),
            "balls": {
                name: {
                    "mass": ball.mass,
                    "radius": ball.radius,
                    "before": {"xy": list(ball.velocity), "nt": list(before)},
                    "after": {"xy": list(end), "nt": list(after)},
                    "impulse": list(impulse),
                }
                for name, ball, end, before, after, impulse in balls
            },
            "momentum": dict(zip(times, map(list, self.momentum), strict=True)),
            "energy": dict(zip(times, self.energy, strict=True)),
            "warnings": list(self.warnings),
        }


def collide(a: Disc, b: Disc, offset: float = 0.0, material: Material = ELASTIC) -> Collision:
    """Return the collision of two balls whose centres are ``offset`` (m) apart across the approach.

    Raises :class:`~pool_pymunk.SceneError` for sizes and coefficients that make no sense, for an
    offset as large as the sum of the radii, and for balls that keep their distance.

    >>> hit = collide(Disc(0.2, 0.03, (1.0, 0.0)), Disc(0.2, 0.03), offset=0.03)
    >>> round(math.degrees(hit.angle), 9), [round(v, 9) for v in hit.velocity_b]
    (30.0, [0.75, 0.433012702])
    >>> collide(Disc(0.2, 0.03, (1.0, 0.0)), Disc(0.2, 0.03), offset=-0.07)
    Traceback (most recent call last):
        ...
    pool_pymunk.SceneError: offset = -0.07: the balls miss: the radii add up to less
    """
    raise_any(_problems(a, b, material, offset=offset))
    touching = a.radius + b.radius
    if abs(offset) >= touching:
        raise_any([Problem("offset", offset, "the balls miss: the radii add up to less")])
    if a.velocity == b.velocity:
        message = "is that of ball a: the balls never meet"
        raise_any([Problem("b.velocity", list(b.velocity), message)])
    ux, uy = _direction(a, b)
    along = math.sqrt((touching - offset) * (touching + offset)) / touching
    across = offset / touching
    return _answered(a, b, material, (along * ux - across * uy, along * uy + across * ux))


def collide_at(a: Disc, b: Disc, angle: float, material: Material = ELASTIC) -> Collision:
    """Return the collision of two balls that touch, with the line from A to B at ``angle`` (rad).

    Raises SceneError as :func:`collide` does, and for balls that recede.

    >>> hit = collide_at(Disc(0.2, 0.03, (1.0, 0.0)), Disc(0.2, 0.03), math.radians(30.0))
    >>> round(hit.offset, 9)
    0.03
    """
    raise_any(_problems(a, b, material, angle=angle))
    hit = _answered(a, b, material, (math.cos(angle), math.sin(angle)))
    before_a, before_b = hit.before
    if before_a.n <= before_b.n:
        raise_any([Problem("angle", angle, "the balls recede along this line of centres")])
    return hit


def _answered(a: Disc, b: Disc, material: Material, normal: Point) -> Collision:
    """Answer the collision by the contact law, as every solver does."""
    law, velocity = find_law(material.law), {0: a.velocity, 1: b.velocity}
    pair = Pair(a.mass, b.mass, material.restitution, material.friction)
    jumps = respond(law, Contact(0, 1, normal, pair), velocity)
    warning = without_slip(law.name, "this hit")
    return Collision(a, b, material, normal, velocity[0], velocity[1], (warning,) * bool(jumps))


def _problems(a: Disc, b: Disc, material: Material, **place: float) -> Iterator[Problem]:
    for name, ball in (("a", a), ("b", b)):
        yield from problems_of(ball.mass, size, name, "mass")
        yield from problems_of(ball.radius, size, name, "radius")
    yield from problems_of(material.restitution, between(0.0, 1.0), "restitution")
    yield from problems_of(material.friction, between(0.0), "friction")
    if not isinstance(material.law, Law):
        yield from problems_of(material.law, choice(LAWS), "law")
    for key, value in place.items():
        yield from problems_of(value, finite, key)


def _direction(a: Disc, b: Disc) -> Point:
    """Return the unit vector along which A approaches, seen from B."""
    x, y = a.velocity[0] - b.velocity[0], a.velocity[1] - b.velocity[1]
    return x / math.hypot(x, y), y / math.hypot(x, y)


def _energy(mass: float, vx: float, vy: float) -> float:
    """Return m v^2 / 2 (J)."""
    return 0.5 * mass * (vx * vx + vy * vy)
