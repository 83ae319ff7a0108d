"""This module defines a contact, and splits velocities along its normal and its tangent."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pool_pymunk.laws.contact import NO_BALL as NO_BALL
from pool_pymunk.laws.contact import NT as NT
from pool_pymunk.laws.contact import Contact as Contact
from pool_pymunk.laws.contact import Pair as Pair
from pool_pymunk.laws.contact import Respond as Respond
from pool_pymunk.laws.contact import Vector as Vector
from pool_pymunk.laws.contact import Velocities as Velocities
from pool_pymunk.laws.contact import split as split


def pair_of(contact: Contact) -> Pair:
    """Return the pair of a contact; numba reads it from a record."""
    return contact.pair


def drift_of(contact: Contact) -> Vector:
    """Return the drift of a contact; cushions of compiled shots stand still."""
    return contact.drift


def relative(v: Vector, drift: Vector) -> Vector:
    """Return a velocity relative to a cushion that moves with another one (m/s)."""
    return v[0] - drift[0], v[1] - drift[1]


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
        v = relative(velocity[contact.a], drift_of(contact))
        return wall_approach(v, contact.normal)
    return approach(velocity[contact.a], velocity[contact.b], contact.normal)


def slip_of(contact: Contact, velocity: Any) -> float:
    """Return the slip (m/s) of a contact: how fast its far side moves along the tangent."""
    nx, ny, v = contact.normal[0], contact.normal[1], velocity[contact.a]
    slip = v[1] * nx - v[0] * ny
    if contact.b == NO_BALL:
        ux, uy = drift_of(contact)
        return float(slip - (uy * nx - ux * ny))
    v = velocity[contact.b]
    return float((v[1] * nx - v[0] * ny) - slip)


def usual_speed(contacts: Any, count: int, velocity: Any) -> float:
    """Return the highest speed (m/s) of the balls and walls of contacts; 0 if all walls stand."""
    square = 0.0
    for k in range(count):
        ux, uy = drift_of(contacts[k])
        square = max(square, ux * ux + uy * uy)
    return max(math.sqrt(square), speed_in(contacts, count, velocity)) if square > 0.0 else 0.0


def speed_in(contacts: Any, count: int, velocity: Any) -> float:
    """Return the highest speed (m/s) of the balls of contacts."""
    square = 0.0
    for k in range(count):
        for i in (contacts[k].a, contacts[k].b):
            if i != NO_BALL:
                vx, vy = velocity[i][0], velocity[i][1]
                square = max(square, vx * vx + vy * vy)
    return math.sqrt(square)


def groups(contacts: Sequence[Contact]) -> Iterable[list[Contact]]:
    """Sort contacts into groups, so that two contacts that share a ball are in one group."""
    first, found = dict[int, int](), dict[int, list[Contact]]()
    join(contacts, len(contacts), first)
    for contact in contacts:
        found.setdefault(first_of(contact.a, first), []).append(contact)
    return found.values()


def join(contacts: Any, count: int, first: Any) -> None:
    """Join the balls of each contact: the ``first`` of a ball is a lower one of them, or itself."""
    for k in range(count):
        first[contacts[k].a], first[contacts[k].b] = contacts[k].a, contacts[k].b
    for k in range(count):
        if contacts[k].b != NO_BALL:
            one, other = first_of(contacts[k].a, first), first_of(contacts[k].b, first)
            first[max(one, other)] = min(one, other)


def first_of(ball: int, first: Any) -> int:
    """Return the lowest number of the balls that are joined to a ball."""
    while first[ball] != ball:
        ball = first[ball]
    return ball
