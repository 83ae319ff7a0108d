"""A contact as users' laws take it: who touches whom, and the parts of velocities there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import NamedTuple

Vector = tuple[float, float]
Velocities = MutableMapping[int, Vector]  # m/s, by ball number

NO_BALL = -1


class NT(NamedTuple):
    """An NT is a velocity along the normal and along the tangent (m/s)."""

    n: float
    t: float


class Pair(NamedTuple):
    """A pair holds masses (kg), restitution e and friction mu of two balls that hit."""

    m_a: float
    m_b: float
    restitution: float
    friction: float


class Contact(NamedTuple):
    """A contact is a place where ball ``a`` touches ball ``b``, or a cushion.

    ``b`` is ``NO_BALL`` if ball ``a`` touches a cushion. ``normal`` is the unit vector from a to b,
    or from the cushion into the table. A cushion uses ``m_a``, ``restitution`` and ``friction`` of
    ``pair``. ``point`` (m) is the place where the two touch. ``cushion`` is the number by which the
    cushion is reported. ``gap`` (m) is the distance between the two; 0 where rounding hides it.
    ``curvature`` (1/m) is that of a :class:`~pool_pymunk.core.walls.side.Side`. ``drift`` (m/s) is
    the velocity of a cushion that moves, at the point. ``kick`` (m/s) is what a cushion that kicks
    adds to the ball's velocity along the normal.
    """

    a: int
    b: int
    normal: Vector
    pair: Pair
    cushion: int | None = None
    point: Vector = (0.0, 0.0)
    gap: float = 0.0
    curvature: float = 0.0
    drift: Vector = (0.0, 0.0)
    kick: float = 0.0

    @property
    def balls(self) -> tuple[int, ...]:
        """Return the numbers of the balls in the contact, one or two."""
        return (self.a,) if self.b == NO_BALL else (self.a, self.b)


Respond = Callable[[Contact, Velocities], object]  # it answers one contact, in place


def split(v: Vector, normal: Vector) -> NT:
    """Split a velocity along the normal and the tangent (-n_y, n_x).

    >>> split((3.0, 4.0), (0.0, 1.0))
    NT(n=4.0, t=-3.0)
    """
    nx, ny = normal
    return NT(v[0] * nx + v[1] * ny, v[1] * nx - v[0] * ny)


def closing_speed(contact: Contact, velocity: Mapping[int, Vector]) -> float:
    """Return the speed (m/s) at which the two sides approach; it is negative if they part."""
    (nx, ny), (vx, vy) = contact.normal, velocity[contact.a]
    if contact.b == NO_BALL:
        ux, uy = contact.drift
        return -((vx - ux) * nx + (vy - uy) * ny)
    ux, uy = velocity[contact.b]
    return (vx - ux) * nx + (vy - uy) * ny


def fastest(velocity: Mapping[int, Vector]) -> float:
    """Return the speed (m/s) of the fastest ball."""
    return math.sqrt(max(vx * vx + vy * vy for vx, vy in velocity.values()))


class Impulse(NamedTuple):
    """An impulse (N s) is the change of momentum that a contact gives its two sides.

    ``normal`` drives them apart along the normal n. ``tangential`` is along t = (-n_y, n_x), on the
    second ball, or on the ball at a cushion; ``tangential_first`` is that on the first of two
    balls. They are opposite where the law keeps momentum.
    """

    normal: float
    tangential: float
    tangential_first: float | None = None


def impulse_of(contact: Contact, before: Sequence[Vector], after: Sequence[Vector]) -> Impulse:
    """Return the impulse of a contact that has changed the velocities (m/s) of its balls.

    >>> cushion = Contact(0, NO_BALL, (0.0, 1.0), Pair(0.5, 0.0, 0.5, 0.1))
    >>> impulse_of(cushion, [(1.0, -2.0)], [(0.75, 1.0)])
    Impulse(normal=1.5, tangential=0.125, tangential_first=None)
    """
    changes = [(ux - vx, uy - vy) for (vx, vy), (ux, uy) in zip(before, after, strict=True)]
    normal, first = (contact.pair.m_a * part for part in split(changes[0], contact.normal))
    if contact.b == NO_BALL:
        return Impulse(normal, first)
    return Impulse(-normal, contact.pair.m_b * split(changes[1], contact.normal).t, first)
