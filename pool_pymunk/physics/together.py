"""Contacts of one instant that share a ball: the velocities that they leave.

In a real rack the outcome hangs on the order of the hits, which a gap of 1e-9 m decides.
There are two answers here that do not depend on the order in which balls are listed:

- :func:`at_once`, for Coulomb's law. Normal impulses J >= 0 are solved for at once, such that every
  contact leaves with -e times the speed it closed with (Newton's law of restitution for
  simultaneous impact; where the contacts are redundant, the smallest such impulses). Then every
  contact takes its friction, min(mu J_n, m_eff |slip|), shared out where a ball has several
  contacts, so that no slip is reversed and energy cannot grow.
- :func:`mean_over_orders`, for any law: the mean of what comes of the orders in which the contacts
  could have come, again and again until nothing closes. It keeps momentum where the law does, and
  by convexity has no more energy than the orders have on average.

Contacts that close only because of this are a next impact at the same instant: a hit runs through
a row of touching balls one after the other, as in Newton's cradle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.contact import NO_BALL, Contact, Vector, Velocities, closing_speed

Array = NDArray[np.float64]

ALL_ORDERS = 4  # contacts, up to which all their orders are tried
MOST_SWEEPS = 200  # of the mean over orders; what closes then is a next impact
TIE_DIGITS = 9  # to which two normals are the same, and a front reaches two contacts together
SPEED_ROUNDING = 64.0 * 2.0**-52  # share of the speeds, or of the impulses, that may be rounding
MOST_EXCHANGES = 20  # for each contact
TOO_SLOW = 0.5  # share of a parting speed; a law of one's own may leave a contact slower than that


# -- any law: the mean over orders -------------------------------------------------------------


def mean_over_orders(
    contacts: Sequence[Contact],
    velocity: Velocities,
    respond: Callable[[Contact, Velocities], object],
) -> None:
    """Answer the contacts in every order that they could come in, and take the mean.

    Up to ``ALL_ORDERS`` contacts all orders count; beyond, those in which a front runs over the
    contacts along the normal of one of them; of contacts that it reaches together, either end comes
    first. This goes on until nothing closes.
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


def _in_order(
    order: Iterable[Contact],
    velocity: dict[int, Vector],
    respond: Callable[[Contact, Velocities], object],
) -> dict[int, Vector]:
    """The velocities after the contacts that close were answered one after the other."""
    for contact in order:
        if closing_speed(contact, velocity) > 0.0:
            respond(contact, velocity)
    return velocity


def _orders(contacts: Sequence[Contact]) -> Iterator[Sequence[Contact]]:
    """All orders of a few contacts; of many, those in which fronts along their normals run."""
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


def at_once(contacts: Sequence[Contact], velocity: Velocities) -> bool:
    """Give every contact its normal impulse at once, then its friction, where it pushes.

    Returns False, with nothing done, where rounding hides which contacts push.
    """
    balls = sorted({i for contact in contacts for i in contact.balls})
    normals, tangents, lightness = _directions(contacts, balls)
    v = np.array([velocity[i] for i in balls]).ravel()
    wanted = [(1.0 + c.pair.restitution) * closing_speed(c, velocity) for c in contacts]
    j_n = _normal_impulses(normals * lightness @ normals.T, np.array(wanted))
    if j_n is None:
        return False
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
    return True


def push_apart(contact: Contact, parting: float, velocity: Velocities) -> None:
    """Make two balls part at ``parting`` (m/s), by a normal impulse, if they are much slower."""
    lacking = parting + closing_speed(contact, velocity)
    if lacking > TOO_SLOW * parting:
        a, b, (nx, ny), (m_a, m_b, _, _), *_ = contact
        (ax, ay), (bx, by), share = velocity[a], velocity[b], lacking / (m_a + m_b)
        velocity[a] = (ax - share * m_b * nx, ay - share * m_b * ny)
        velocity[b] = (bx + share * m_a * nx, by + share * m_a * ny)


def _directions(contacts: Sequence[Contact], balls: Sequence[int]) -> tuple[Array, Array, Array]:
    """How fast each contact opens (C, 2N) and slips (C, 2N) by each velocity; 1 / mass (2N,)."""
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
    """The impulses J >= 0 (kg m/s) that open every contact by ``wanted`` (m/s) or more.

    ``response[k, l]`` is by how much a unit impulse at contact l opens contact k (1/kg). A contact
    that pushes opens by just what is wanted: J (response J - wanted) = 0, a linear complementarity
    problem. It is solved in units in which each contact's own response is 1, as masses may differ
    widely.

    All contacts that are wrong change sides at once, so that their order does not matter; where
    this goes in circles, only the last one does (Murty, Linear Complementarity, 1988, section 3.2).
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
    """The (smallest) impulses of the pushing contacts that open these by what is wanted."""
    impulses = np.zeros(len(wanted))
    part = response[np.ix_(pushing, pushing)]
    impulses[pushing] = np.linalg.lstsq(part, wanted[pushing], rcond=1e-12)[0]
    return impulses


def _slack(response: Array, wanted: Array, impulses: Array) -> float:
    """How much of an opening speed (m/s) rounding may hide."""
    pushed = np.abs(response) @ np.abs(impulses)
    return float(1e-12 * np.abs(wanted).max() + SPEED_ROUNDING * pushed.max())
