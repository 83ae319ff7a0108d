"""This module answers contacts of one instant that share a ball.

In a real rack the outcome depends on the order of the hits, and a gap of 1e-9 m decides that order.
The two answers here do not depend on the order in which balls are listed:

- :func:`at_once` is for Coulomb's law. It solves for all normal impulses J >= 0 at once, such that
  every contact leaves with -e times its closing speed or faster (Newton's law of restitution for
  simultaneous impact). Where the contacts are redundant, it takes the smallest such impulses. Then
  every contact takes its friction, min(mu J_n, m_eff |slip|). A ball with several contacts shares
  this out among them, so that no slip is reversed and energy cannot grow.
- :func:`mean_over_orders` is for any law. It answers the contacts in every order in which they
  could have come, takes the mean, and repeats this until nothing closes. It keeps momentum where
  the law does. By convexity it leaves no more energy than the orders do on average.

A contact may close only because of this answer. It is then the next impact at the same instant: a
hit runs through a row of touching balls one after the other, as in Newton's cradle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.contact import NO_BALL, Contact, Respond, Velocities, closing_speed
from pool_pymunk.physics.motion import Array

ALL_ORDERS = 4  # For up to this many contacts all their orders are tried.
MOST_SWEEPS = 200  # After this many sweeps of the mean, what still closes is a next impact.
TIE_DIGITS = 9  # Normals that agree to this many digits are the same.
SPEED_ROUNDING = 64.0 * 2.0**-52  # This share of the speeds, or of the impulses, may be rounding.
MOST_EXCHANGES = 20  # This many exchanges are tried for each contact.
TOO_SLOW = 0.5  # of the parting speed: a law of your own may leave a contact slower than this share


# -- any law: the mean over orders -------------------------------------------------------------


def mean_over_orders(contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
    """Answer the contacts in every order in which they could come, and take the mean.

    For up to ``ALL_ORDERS`` contacts all orders count. For more, each order is that in which a
    front runs over the contacts along the normal of one of them. Where the front reaches contacts
    together, one order begins at either end of them. Repeat this until nothing closes.
    """
    balls = sorted({i for contact in contacts for i in contact.balls})
    orders = list(_orders(contacts))
    for _ in range(MOST_SWEEPS):
        noise = SPEED_ROUNDING * max(math.hypot(*velocity[i]) for i in balls)
        if all(closing_speed(contact, velocity) <= noise for contact in contacts):
            return
        ends = [_in_order(order, {i: velocity[i] for i in balls}, respond) for order in orders]
        for i in balls:
            x, y = (math.fsum(end[i][axis] for end in ends) / len(ends) for axis in (0, 1))
            velocity[i] = (x, y)


def _in_order(order: Iterable[Contact], velocity: Velocities, respond: Respond) -> Velocities:
    """Answer the closing contacts one after the other, and return the velocities."""
    for contact in order:
        if closing_speed(contact, velocity) > 0.0:
            respond(contact, velocity)
    return velocity


def _orders(contacts: Sequence[Contact]) -> Iterator[Sequence[Contact]]:
    """Yield all orders of a few contacts, or for many the orders in which fronts reach them."""
    if len(contacts) <= ALL_ORDERS:
        yield from permutations(contacts)
        return
    places = np.array([contact.point for contact in contacts])
    places = places - places.mean(axis=0)
    size = np.abs(places).max() or 1.0
    along = {(round(x, TIE_DIGITS), round(y, TIE_DIGITS)) for x, y in (c.normal for c in contacts)}
    for nx, ny in sorted(along | {(-x, -y) for x, y in along}):
        reached = np.round(places @ (nx, ny) / size, TIE_DIGITS)
        across = places @ (-ny, nx)
        for end in (across, -across):
            yield [contacts[k] for k in np.lexsort((end, reached))]


# -- Coulomb's law: all at once ----------------------------------------------------------------


def at_once(contacts: Sequence[Contact], velocity: Velocities) -> list[float] | None:
    """Give contacts all impulses at once; return the normal ones (N s), or None if unknown."""
    balls = sorted({i for contact in contacts for i in contact.balls})
    normals, tangents, lightness = directions(contacts, balls)
    v = np.array([velocity[i] for i in balls]).ravel()
    wanted = [(1.0 + c.pair.restitution) * closing_speed(c, velocity) for c in contacts]
    j_n = _normal_impulses(normals * lightness @ normals.T, np.array(wanted))
    if j_n is None:
        return None
    v = v + lightness * (normals.T @ j_n)
    slip = tangents @ v
    inverse_mass = (tangents * lightness * tangents).sum(axis=1)  # 1 / m_eff
    touched = (normals != 0.0) | (tangents != 0.0)
    shares = np.where(touched, touched[j_n > 0.0].sum(axis=0), 1).max(axis=1)
    friction = np.array([contact.pair.friction for contact in contacts])
    j_t = np.minimum(friction * j_n, np.abs(slip) / (np.maximum(shares, 1) * inverse_mass))
    v = v - lightness * (tangents.T @ np.copysign(j_t, slip))
    for i, (vx, vy) in zip(balls, v.reshape(-1, 2).tolist(), strict=True):
        velocity[i] = (vx, vy)
    return list(map(float, j_n))


def push_apart(contact: Contact, parting: float, velocity: Velocities) -> float:
    """Make two balls part at ``parting`` (m/s) if much slower; return the impulse (N s)."""
    lacking = parting + closing_speed(contact, velocity)
    if lacking <= TOO_SLOW * parting:
        return 0.0
    a, b, (nx, ny), (m_a, m_b, _, _), *_ = contact
    (ax, ay), (bx, by), share = velocity[a], velocity[b], lacking / (m_a + m_b)
    velocity[a] = (ax - share * m_b * nx, ay - share * m_b * ny)
    velocity[b] = (bx + share * m_a * nx, by + share * m_a * ny)
    return share * m_a * m_b


def directions(contacts: Sequence[Contact], balls: Sequence[int]) -> tuple[Array, Array, Array]:
    """Return how each contact depends on the velocities, and the inverse masses.

    The first two arrays (C, 2N) say how fast each contact opens and slips for each component of
    velocity. The third (2N,) is 1 / mass (1/kg).
    """
    normals, tangents = np.zeros((2, len(contacts), 2 * len(balls)))
    lightness = np.empty(2 * len(balls))
    for k, contact in enumerate(contacts):
        nx, ny = contact.normal
        sides = [(contact.a, contact.pair.m_a, 1.0 if contact.b == NO_BALL else -1.0)]
        if contact.b != NO_BALL:
            sides.append((contact.b, contact.pair.m_b, 1.0))
        for i, mass, sign in sides:
            at = 2 * balls.index(i)
            normals[k, at : at + 2] = sign * nx, sign * ny
            tangents[k, at : at + 2] = -sign * ny, sign * nx
            lightness[at : at + 2] = 1.0 / mass
    return normals, tangents, lightness


def _normal_impulses(response: Array, wanted: Array) -> Array | None:
    """Return the impulses J >= 0 (kg m/s) that open every contact by ``wanted`` (m/s) or more.

    ``response[k, l]`` is the speed by which a unit impulse at contact l opens contact k (1/kg). A
    contact that pushes opens by exactly ``wanted``: J (response J - wanted) = 0. This is a linear
    complementarity problem. Masses may differ widely, so the units are chosen such that each
    contact's own response is 1. The answer is None where rounding hides which contacts push.

    All contacts on the wrong side change sides at once, so that their order does not matter. If
    that does not end, only the last of them changes (Murty, Linear Complementarity, 1988, section
    3.2).
    """
    unit = np.sqrt(response.diagonal())
    response, wanted = response / np.outer(unit, unit), wanted / unit
    pushing = wanted > 0.0
    for exchange in range(MOST_EXCHANGES * len(wanted)):
        impulses = _pushed(response, wanted, pushing)
        lacking, slack = wanted - response @ impulses, _slack(response, wanted, impulses)
        wrong = np.where(pushing, (impulses < 0.0) | (lacking < -slack), lacking > slack)
        changing = np.flatnonzero(wrong)
        if not len(changing):
            return np.asarray(impulses / unit)
        pushing[changing if exchange <= len(wanted) else changing[-1]] ^= True
    return None


def _pushed(response: Array, wanted: Array, pushing: NDArray[np.bool_]) -> Array:
    """Return the smallest impulses that open the pushing contacts by what is needed."""
    impulses = np.zeros(len(wanted))
    part = response[np.ix_(pushing, pushing)]
    impulses[pushing] = np.linalg.lstsq(part, wanted[pushing], rcond=1e-12)[0]
    return impulses


def _slack(response: Array, wanted: Array, impulses: Array) -> float:
    """Return how much of an opening speed (m/s) rounding may hide."""
    pushed = np.abs(response) @ np.abs(impulses)
    return float(1e-12 * np.abs(wanted).max() + SPEED_ROUNDING * pushed.max())
