"""This module defines a contact, and splits velocities along its normal and its tangent."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
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
    cushion is reported. ``gap`` (m) is what is left between the two, as far as
    rounding lets it be known.
    """

    a: int
    b: int
    normal: Vector
    pair: Pair
    cushion: int | None = None
    point: Vector = (0.0, 0.0)
    gap: float = 0.0

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


def changed(v: Vector, before: NT, after: NT, normal: Vector) -> Vector:
    """Return the velocity with its two parts changed.

    A part that the law did not change keeps every bit.

    >>> changed((3.0, 4.0), NT(4.0, -3.0), NT(-2.0, -3.0), (0.0, 1.0))
    (3.0, -2.0)
    """
    nx, ny = normal
    dn, dt = after.n - before.n, after.t - before.t
    return (v[0] + dn * nx - dt * ny, v[1] + dn * ny + dt * nx)


def approach(a: Vector, b: Vector, normal: Vector) -> float:
    """Return the speed (m/s) at which ball A nears ball B, along the normal from A to B."""
    nx, ny = normal
    return (a[0] - b[0]) * nx + (a[1] - b[1]) * ny


def wall_approach(v: Vector, normal: Vector) -> float:
    """Return the speed (m/s) at which a ball nears a wall; the normal points into the table."""
    return -(v[0] * normal[0] + v[1] * normal[1])


def closing_speed(contact: Contact, velocity: Mapping[int, Vector]) -> float:
    """Return the speed (m/s) at which the two sides approach; it is negative if they part."""
    if contact.b == NO_BALL:
        return wall_approach(velocity[contact.a], contact.normal)
    return approach(velocity[contact.a], velocity[contact.b], contact.normal)


def groups(contacts: Sequence[Contact]) -> Iterator[list[Contact]]:
    """Sort contacts into groups, so that two contacts that share a ball are in one group."""
    with_ball: dict[int, list[int]] = {}
    for k, contact in enumerate(contacts):
        for ball in contact.balls:
            with_ball.setdefault(ball, []).append(k)
    sorted_in: set[int] = set()
    for first in range(len(contacts)):
        group: list[int] = []
        joined = [first] if first not in sorted_in else []
        while joined:
            sorted_in.update(joined)
            group += joined
            near = {k for j in joined for ball in contacts[j].balls for k in with_ball[ball]}
            joined = sorted(near - sorted_in)
        if group:
            yield [contacts[k] for k in group]
