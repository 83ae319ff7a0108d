"""Contacts of one instant that share a ball: the velocities that they leave.

In a real rack the outcome hangs on the order of the hits, which a millionth of a millimetre decides.
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
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.physics.contact import NO_BALL, Contact, Vector, Velocities, closing_speed, split

Array = NDArray[np.float64]

ALL_ORDERS = 4  # contacts, up to which all their orders are tried
MOST_SWEEPS = 200  # of the mean over orders; what closes then is a next impact
DIRECTIONS = tuple((math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(16))
ROUNDING = 64.0 * 2.0**-52  # share of the speeds, or of the impulses, that may be rounding
MOST_EXCHANGES = 10  # for each contact
TOO_SLOW = 0.5  # share of a parting speed; a law of one's own may leave a contact slower than that
NOTHING = 1e-14  # share of the largest impulse, below which a contact does not push


# -- any law: the mean over orders -------------------------------------------------------------


def mean_over_orders(
    contacts: Sequence[Contact],
    velocity: Velocities,
    respond: Callable[[Contact, Velocities], None],
) -> None:
    """Answer the contacts in every order that they could come in, and take the mean.

    Up to ``ALL_ORDERS`` contacts all orders count; beyond, those in which a front sweeps over the
    contacts from one of sixteen directions. This goes on until nothing closes.
    """
    balls = sorted({i for contact in contacts for i in contact.balls})
    orders = list(_orders(contacts))
    for _ in range(MOST_SWEEPS):
        noise = ROUNDING * max(math.hypot(*velocity[i]) for i in balls)
        if all(closing_speed(contact, velocity) <= noise for contact in contacts):
            return
        ends = [_in_order(order, {i: velocity[i] for i in balls}, respond) for order in orders]
        for i in balls:
            x, y = (math.fsum(end[i][axis] for end in ends) / len(ends) for axis in (0, 1))
            velocity[i] = (x, y)


def _in_order(
    order: Iterable[Contact],
    velocity: dict[int, Vector],
    respond: Callable[[Contact, Velocities], None],
) -> dict[int, Vector]:
    """The velocities after the contacts that close were answered one after the other."""
    for contact in order:
        if closing_speed(contact, velocity) > 0.0:
            respond(contact, velocity)
    return velocity


def _orders(contacts: Sequence[Contact]) -> Iterator[Sequence[Contact]]:
    """All orders of a few contacts; of many, one for every direction in which a front may run."""
    if len(contacts) <= ALL_ORDERS:
        yield from permutations(contacts)
        return
    for cos, sin in DIRECTIONS:

        def front(contact: Contact, cos: float = cos, sin: float = sin) -> Vector:
            x, y = contact.point
            return (x * cos + y * sin, y * cos - x * sin)

        yield sorted(contacts, key=front)


# -- Coulomb's law: all at once ----------------------------------------------------------------


def at_once(contacts: Sequence[Contact], velocity: Velocities) -> None:
    """Give every contact its normal impulse at once, then its friction, where it pushes."""
    wanted = [(1.0 + c.pair.restitution) * closing_speed(c, velocity) for c in contacts]
    impulses = _push_normally(contacts, wanted, velocity)
    pushing = [contact for contact, j_n in zip(contacts, impulses, strict=True) if j_n > 0.0]
    shares = Counter(i for contact in pushing for i in contact.balls)
    slips = [_slip(contact, velocity) for contact in contacts]
    for contact, j_n, slip in zip(contacts, impulses, slips, strict=True):
        share = max(shares[i] for i in contact.balls)
        most = abs(slip) / (max(share, 1) * _inverse_mass(contact))
        j_t = math.copysign(min(contact.pair.friction * j_n, most), slip)
        nx, ny = contact.normal
        _push(contact, (-j_t * ny, j_t * nx), velocity)


def push_apart(contact: Contact, parting: float, velocity: Velocities) -> None:
    """Make a contact part at ``parting`` (m/s), by a normal impulse, if it is much slower."""
    lacking = parting + closing_speed(contact, velocity)
    if lacking > TOO_SLOW * parting:
        nx, ny = contact.normal
        j_n = lacking / _inverse_mass(contact)
        _push(contact, (j_n * nx, j_n * ny), velocity)


def settle(contacts: Sequence[Contact], velocity: Velocities) -> None:
    """Take the limit of hits without end: no contact closes any more (plastic, no friction)."""
    _push_normally(contacts, [closing_speed(contact, velocity) for contact in contacts], velocity)


def _push_normally(
    contacts: Sequence[Contact], wanted: Sequence[float], velocity: Velocities
) -> list[float]:
    """Open every contact by what is wanted (m/s) or more; return the impulses (kg m/s)."""
    impulses: list[float] = _normal_impulses(_response(contacts), np.array(wanted)).tolist()
    for contact, j_n in zip(contacts, impulses, strict=True):
        nx, ny = contact.normal
        _push(contact, (j_n * nx, j_n * ny), velocity)
    return impulses


def _inverse_mass(contact: Contact) -> float:
    """1 / m_eff (1/kg)."""
    return 1.0 / contact.pair.m_a + (0.0 if contact.b == NO_BALL else 1.0 / contact.pair.m_b)


def _sides(contact: Contact) -> Iterator[tuple[int, float, float]]:
    """Each ball of a contact, its mass, and the sign with which an impulse along n acts on it."""
    if contact.b == NO_BALL:
        yield contact.a, contact.pair.m_a, 1.0
    else:
        yield contact.a, contact.pair.m_a, -1.0
        yield contact.b, contact.pair.m_b, 1.0


def _push(contact: Contact, impulse: Vector, velocity: Velocities) -> None:
    """Apply an impulse (kg m/s): to B and its opposite to A, or from the cushion to its ball."""
    jx, jy = impulse
    for i, mass, sign in _sides(contact):
        vx, vy = velocity[i]
        velocity[i] = (vx + sign * jx / mass, vy + sign * jy / mass)


def _slip(contact: Contact, velocity: Velocities) -> float:
    """Slip (m/s) that friction acts on: of A past B; of a cushion past its ball."""
    a = split(velocity[contact.a], contact.normal).t
    return -a if contact.b == NO_BALL else a - split(velocity[contact.b], contact.normal).t


def _response(contacts: Sequence[Contact]) -> Array:
    """G[k, l]: by how much a unit normal impulse at contact l opens contact k (1/kg)."""
    response = np.zeros((len(contacts), len(contacts)))
    for k, one in enumerate(contacts):
        for m, other in enumerate(contacts):
            turn = one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1]
            for ball, mass, sign in _sides(one):
                for also, _, other_sign in _sides(other):
                    if also == ball:
                        response[k, m] += sign * other_sign * turn / mass
    return response


def _normal_impulses(response: Array, wanted: Array) -> Array:
    """The impulses J >= 0 (kg m/s) that open every contact by ``wanted`` (m/s) or more.

    A contact that pushes opens by just that: J (response J - wanted) = 0, a linear
    complementarity problem. It is solved in units in which each contact's own response is 1, as
    masses may differ widely.
    """
    unit = np.sqrt(response.diagonal())
    impulses: Array = _complementary(response / np.outer(unit, unit), wanted / unit) / unit
    return impulses


def _complementary(response: Array, wanted: Array) -> Array:
    """All contacts that are wrong change sides at once, so that their order does not matter.

    Where this goes in circles, they do so one by one.
    """
    pushing = wanted > 0.0
    for _ in range(len(wanted) + 1):
        impulses = _pushed(response, wanted, pushing)
        lacking = wanted - response @ impulses
        slack = _slack(response, wanted, impulses)
        wrong = np.where(pushing, (impulses < 0.0) | (lacking < -slack), lacking > slack)
        if not wrong.any():
            return impulses
        pushing ^= wrong
    return _one_by_one(response, wanted)


def _pushed(response: Array, wanted: Array, pushing: NDArray[np.bool_]) -> Array:
    """The (smallest) impulses of the pushing contacts that open these by what is wanted."""
    impulses = np.zeros(len(wanted))
    part = response[np.ix_(pushing, pushing)]
    impulses[pushing] = np.linalg.lstsq(part, wanted[pushing], rcond=1e-12)[0]
    return impulses


def _slack(response: Array, wanted: Array, impulses: Array) -> float:
    """What an opening speed (m/s) may lack by rounding."""
    pushed = np.abs(response) @ np.abs(impulses)
    return float(1e-12 * np.abs(wanted).max() + ROUNDING * pushed.max())


def _one_by_one(response: Array, wanted: Array) -> Array:
    """The same by an active set (Lawson and Hanson, 1974, for non-negative least squares).

    Every exchange lowers the energy J response J / 2 - wanted J. Should rounding keep it from an
    end, contacts that still close are a next impact.
    """
    impulses = np.zeros(len(wanted))
    pushing = np.zeros(len(wanted), dtype=bool)
    for _ in range(MOST_EXCHANGES * len(wanted)):
        lacking = np.where(pushing, 0.0, wanted - response @ impulses)
        if lacking.max() <= _slack(response, wanted, impulses):
            break
        pushing[lacking.argmax()] = True
        impulses = _towards(impulses, response, wanted, pushing)
    return impulses


def _towards(impulses: Array, response: Array, wanted: Array, pushing: NDArray[np.bool_]) -> Array:
    """Go to the impulses of the pushing contacts; who would have to pull drops out on the way."""
    while True:
        target = _pushed(response, wanted, pushing)
        pulls = pushing & (target <= 0.0)
        if not pulls.any():
            return target
        share = (impulses[pulls] / (impulses[pulls] - target[pulls])).min()
        impulses = impulses + share * (target - impulses)
        pushing &= impulses > NOTHING * impulses.max()
        impulses[~pushing] = 0.0
