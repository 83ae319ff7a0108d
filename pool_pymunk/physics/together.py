"""This module answers contacts of one instant that share a ball.

In a real rack the outcome depends on the order of the hits, and a gap of 1e-9 m decides that order.
The two answers here do not depend on the order in which balls are listed:

- :func:`at_once` is for Coulomb's law. It solves for all normal impulses J >= 0 at once, such that
  every contact opens at e times its closing speed or faster (Newton's law of restitution for
  simultaneous impact). Where the contacts are redundant, it takes the smallest such impulses. Then
  every contact takes its friction, min(mu J_n, m_eff |slip|). The contacts of a ball
  share the slip among them, so that no slip is reversed and energy cannot grow.
- :func:`mean_over_orders` is for any law. It answers the contacts in every order in which they
  could have come, takes the mean, and repeats this until nothing closes. It keeps momentum where
  the law does. By convexity it leaves no more energy than the orders do on average.

A contact may close only because of this answer. It is then the next impact at the same instant: a
hit runs through a row of touching balls one after the other, as in Newton's cradle.

The impulses are found in plain loops over numbers, which round alike on every machine. numba can
compile them for arrays of records with the fields of contacts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pool_pymunk.physics.contact import (
    NO_BALL,
    Contact,
    Respond,
    Vector,
    Velocities,
    closing_speed,
    slip_of,
)
from pool_pymunk.physics.pressed import lengths, rows_of

# For up to this many contacts all 24 orders are tried. Eight contacts would have 40,320.
ALL_ORDERS = 4
# After this many sweeps of the mean, what still closes is a next impact. Half or twice as many move
# no ball in tests.halved.
MOST_SWEEPS = 200
DIGITS = 1e9  # Normals that agree to nine digits are the same; rounding moves the 15th.
# This share of the speeds, or of the impulses, may be rounding, in sums over some 30 contacts.
SPEED_ROUNDING = 64.0 * 2.0**-52
# This many exchanges are tried for each contact; 2,000 random problems needed seven at most.
MOST_EXCHANGES = 20
# A contact is redundant if less than this share of its response is independent: rounding leaves
# some 1e-15. In breaks of a frozen rack of fifteen the least share is 0.75.
REDUNDANT = 1e-12


# -- rows ----------------------------------------------------------------------------------------


class Rows:
    """These are the numbers of a form for some contacts, in lists; those by ball are in dicts."""

    def __init__(self, form: Mapping[str, tuple[type, tuple[Any, ...]]], contacts: int) -> None:
        for name, (kind, shape) in form.items():
            made = lengths(shape, 2 * contacts, contacts)
            setattr(self, name, {} if shape[0] == "N+1" else rows_of(kind, made))

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...


def list_balls(rows: Any, contacts: Any, count: int) -> None:
    """List the balls of contacts, each of them once."""
    rows.balls = 0
    for k in range(count):
        rows.is_in[contacts[k].a] = rows.is_in[contacts[k].b] = 0
    for k in range(count):
        for i in (contacts[k].a, contacts[k].b):
            if i != NO_BALL and not rows.is_in[i]:
                rows.is_in[i], rows.ball[rows.balls] = 1, i
                rows.balls += 1


def fastest_of(rows: Any, velocity: Any) -> float:
    """Return the speed (m/s) of the fastest of the balls."""
    most = 0.0
    for p in range(rows.balls):
        v = velocity[rows.ball[p]]
        most = max(most, v[0] * v[0] + v[1] * v[1])
    return math.sqrt(most)


# -- any law: the mean over orders -------------------------------------------------------------

# These are the rows of the orders, each with its type, and its shape by the most balls N and
# contacts C. `ball` lists the balls. Contacts touch at a `point` (m), which many contacts need.
# Each order is a `turn` of contacts; `reached` and `across` are where a front finds them. The
# velocities (m/s) of the balls are those at the `start` of a sweep; after each order, theirs are
# added to sums that are exact: each is `many` numbers in `parts`, which do not overlap.
ORDERS: dict[str, tuple[type, tuple[Any, ...]]] = {
    "ball": (int, ("N",)), "is_in": (int, ("N+1",)),
    "point": (float, ("C", 2)), "reached": (int, ("C",)), "across": (float, ("C",)),
    "turn": (int, ("6C", "C")), "start": (float, ("N+1", 2)),
    "parts": (float, ("N", 2, "6C")), "many": (int, ("N", 2)),
}  # fmt: skip


def mean_over_orders(contacts: Sequence[Contact], velocity: Velocities, respond: Respond) -> None:
    """Answer the contacts in every order in which they could come, and take the mean.

    For up to ``ALL_ORDERS`` contacts all orders count. For more, fronts run along the
    normals and back, and give the orders in which they reach contacts. Those that one reaches
    together come from left to right and from right to left. Repeat this until nothing closes.
    """
    o = Rows(ORDERS, len(contacts))
    for k, contact in enumerate(contacts):
        o.point[k] = list(contact.point)
    begin_orders(o, contacts, len(contacts), velocity)
    while (k := next_in_order(o, contacts, velocity)) >= 0:
        respond(contacts[k], velocity)


def begin_orders(o: Any, contacts: Any, count: int, velocity: Any) -> None:
    """Find the orders of contacts, and begin a sweep over all of them."""
    o.contacts, o.orders, o.sweeps, o.is_over = count, 0, 0, 0
    list_balls(o, contacts, count)
    if count <= ALL_ORDERS:
        find_all_orders(o, count)
    else:
        find_fronts(o, contacts, count)
    begin_sweep(o, contacts, velocity)


def next_in_order(o: Any, contacts: Any, velocity: Any) -> int:
    """Return the contact that the caller answers next; -1 if ``velocity`` (m/s) is the mean."""
    while not o.is_over:
        while o.at < o.contacts:
            k = o.turn[o.order][o.at]
            o.at += 1
            if closing_speed(contacts[k], velocity) > 0.0:
                return int(k)
        end_order(o, velocity)
        if o.order == o.orders:
            take_mean(o, velocity)
            begin_sweep(o, contacts, velocity)
    return -1


def begin_sweep(o: Any, contacts: Any, velocity: Any) -> None:
    """Begin a sweep over all orders, if contacts close and there were not too many sweeps."""
    noise, closes = SPEED_ROUNDING * fastest_of(o, velocity), False
    for k in range(o.contacts):
        closes |= closing_speed(contacts[k], velocity) > noise
    o.order, o.at, o.is_over = 0, 0, o.sweeps == MOST_SWEEPS or not closes
    o.sweeps += 1
    for p in range(o.balls):
        v = velocity[o.ball[p]]
        o.start[o.ball[p]] = (v[0], v[1])
        o.many[p][0] = o.many[p][1] = 0


def end_order(o: Any, velocity: Any) -> None:
    """Add the velocities to the sums, and let the next order begin at the start of the sweep."""
    for p in range(o.balls):
        i = o.ball[p]
        for axis in range(2):
            o.many[p][axis] = add(velocity[i][axis], o.parts[p][axis], o.many[p][axis])
        velocity[i] = (o.start[i][0], o.start[i][1])
    o.order, o.at = o.order + 1, 0


def take_mean(o: Any, velocity: Any) -> None:
    """Give each ball the mean of its velocities after the orders."""
    for p in range(o.balls):
        x, y = total(o.parts[p][0], o.many[p][0]), total(o.parts[p][1], o.many[p][1])
        velocity[o.ball[p]] = (x / o.orders, y / o.orders)


def find_all_orders(o: Any, count: int) -> None:
    """Find all orders of a few contacts: each contact goes in at one of the places so far."""
    o.orders = 1
    for k in range(count):
        o.orders *= k + 1
    for order in range(o.orders):
        turn, rest = o.turn[order], order
        for k in range(count):
            place, rest = rest % (k + 1), rest // (k + 1)
            for m in range(k, place, -1):
                turn[m] = turn[m - 1]
            turn[place] = k


def find_fronts(o: Any, contacts: Any, count: int) -> None:
    """Find the orders in which fronts reach contacts, along each normal once and back."""
    size = centre(o, count)
    for k in range(count):
        nx, ny = digits(contacts[k].normal[0]), digits(contacts[k].normal[1])
        is_new = True
        for m in range(k):
            x, y = digits(contacts[m].normal[0]), digits(contacts[m].normal[1])
            is_new &= (x != nx or y != ny) and (x != -nx or y != -ny)
        for back in range(4 if is_new else 0):
            sign, end = 1 - 2 * (back // 2), 1 - 2 * (back % 2)
            find_front(o, (sign * nx / DIGITS, sign * ny / DIGITS), size, end)


def find_front(o: Any, normal: Vector, size: float, end: int) -> None:
    """Sort the contacts by when a front reaches them, and across it from one of its ends."""
    turn, (nx, ny) = o.turn[o.orders], normal
    for k in range(o.contacts):
        x, y = o.point[k][0], o.point[k][1]
        o.reached[k], o.across[k] = digits((x * nx + y * ny) / size), end * (y * nx - x * ny)
        m = k
        while m > 0 and comes_before(o, k, turn[m - 1]):
            turn[m] = turn[m - 1]
            m -= 1
        turn[m] = k
    o.orders += 1


def comes_before(o: Any, k: int, other: int) -> bool:
    """Tell whether a front reaches contact k before another one."""
    if o.reached[k] != o.reached[other]:
        return bool(o.reached[k] < o.reached[other])
    return bool(o.across[k] < o.across[other])


def centre(o: Any, count: int) -> float:
    """Move the points such that their mean is 0, and return their largest coordinate (m)."""
    size, parts = 0.0, o.parts[0][0]
    for axis in range(2):
        many = 0
        for k in range(count):
            many = add(o.point[k][axis], parts, many)
        mean = total(parts, many) / count
        for k in range(count):
            o.point[k][axis] -= mean
            size = max(size, abs(o.point[k][axis]))
    return size if size > 0.0 else 1.0


def digits(x: float) -> int:
    """Return a number in units of 1e-9, rounded: numbers with the same digits are the same.

    >>> digits(0.1), digits(-0.5 + 1e-15)
    (100000000, -500000000)
    """
    return round(x * DIGITS)


# -- exact sums ----------------------------------------------------------------------------------


def add(x: float, parts: Any, many: int) -> int:
    """Add a number to an exact sum, and return of how many parts this is now.

    The parts do not overlap, and the last is the largest. Each number adds one part at most
    (Shewchuk, Adaptive precision floating-point arithmetic, 1997, theorem 10).
    """
    kept = 0
    for p in range(many):
        part = parts[p]
        if abs(x) < abs(part):
            x, part = part, x
        high = x + part
        low = part - (high - x)
        if low != 0.0:
            parts[kept] = low
            kept += 1
        x = high
    parts[kept] = x
    return kept + 1


def total(parts: Any, many: int) -> float:
    """Return the number that is nearest to an exact sum; it is that of :func:`math.fsum`.

    >>> parts = [0.0] * 4
    >>> many = 0
    >>> for x in (1e16, 1.0, 1e-16, -1e16):
    ...     many = add(x, parts, many)
    >>> total(parts, many)
    1.0
    """
    p = many - 1
    high, low = 0.0 + parts[p], 0.0  # never -0.0
    while p > 0 and low == 0.0:
        p -= 1
        x, part = high, parts[p]
        high = x + part
        low = part - (high - x)
    # Half a unit of the last place was rounded to even; what is below it decides.
    if p > 0 and (low < 0.0) == (parts[p - 1] < 0.0) and low != 0.0:
        twice = 2.0 * low
        further = high + twice
        if further - high == twice:
            high = further
    return float(high)


# -- Coulomb's law: all at once ----------------------------------------------------------------


# These rows a room has for contacts C. `response[k][m]` is the speed by which a unit impulse at
# contact m opens contact k (1/kg), `wanted` (m/s) the speed by which each has to open, and `pushes`
# (N s) the answer. The others are work space. `shares` counts the contacts that push each ball.
ROOM: dict[str, tuple[type, tuple[Any, ...]]] = {
    "response": (float, ("C", "C")), "factor": (float, ("C", "C")), "wanted": (float, ("C",)),
    "unit": (float, ("C",)), "pushes": (float, ("C",)), "rest": (float, ("C",)),
    "pushing": (int, ("C",)), "chosen": (int, ("C",)),
}  # fmt: skip


def room(count: int) -> Rows:
    """Return room for the impulses of this many contacts."""
    own = Rows(ROOM, count)
    own.shares = {}
    return own


def at_once(
    contacts: Sequence[Contact], velocity: Velocities
) -> tuple[list[float], list[float]] | None:
    """Give contacts all impulses at once; return those along n and t (N s), or None if unknown."""
    own = room(len(contacts))
    is_known = push_at_once(contacts, len(contacts), velocity, own)
    return (list(own.pushes), list(own.rest)) if is_known else None


def push_at_once(contacts: Any, count: int, velocity: Any, room: Any) -> bool:
    """Give contacts all impulses at once; return False if they are unknown.

    ``room.pushes`` keeps those along the normals, ``room.rest`` those along the tangents.
    """
    shares, impulse, rest = room.shares, room.pushes, room.rest
    for k in range(count):
        one = contacts[k]
        room.wanted[k] = (1.0 + one.pair.restitution) * closing_speed(one, velocity)
        for m in range(k + 1):
            room.response[k][m] = room.response[m][k] = coupling(one, contacts[m])
        shares[one.a] = shares[one.b] = 0
    if not find_impulses(room, count):
        return False
    for k in range(count):
        one = contacts[k]
        if impulse[k] > 0.0:
            push(one, impulse[k], 0.0, velocity)
            shares[one.a] += 1
            shares[one.b] += 1
    for k in range(count):
        rest[k] = friction(contacts[k], impulse[k], velocity, shares)
    for k in range(count):
        if rest[k] != 0.0:
            push(contacts[k], 0.0, rest[k], velocity)
    return True


def coupling(one: Contact, other: Contact) -> float:
    """Return the speed (m/s) by which a unit impulse at one contact opens another."""
    shared = push_sign(other, one.a) / one.pair.m_a  # 1/kg
    if one.b != NO_BALL:
        shared = push_sign(other, one.b) / one.pair.m_b - shared
    if shared == 0.0:
        return 0.0
    return shared * (one.normal[0] * other.normal[0] + one.normal[1] * other.normal[1])


def lines(contacts: Iterable[Contact]) -> list[Contact]:
    """Return each contact twice: as it is, and with its tangent in place of its normal."""
    return [
        contact._replace(normal=along)
        for contact in contacts
        for along in (contact.normal, (-contact.normal[1], contact.normal[0]))
    ]


def push_sign(contact: Contact, ball: int) -> float:
    """Return the sign with which a contact pushes a ball along its normal; 0: not at all."""
    if ball == contact.b:
        return 1.0
    if ball != contact.a:
        return 0.0
    return 1.0 if contact.b == NO_BALL else -1.0


def push(contact: Contact, along: float, across: float, velocity: Any) -> None:
    """Drive the sides of a contact apart by impulses (N s) along its normal and its tangent."""
    nx, ny = contact.normal[0], contact.normal[1]
    x, y = along * nx - across * ny, along * ny + across * nx
    a, b, m_a = contact.a, contact.b, contact.pair.m_a
    if b == NO_BALL:
        velocity[a] = (velocity[a][0] + x / m_a, velocity[a][1] + y / m_a)
        return
    velocity[a] = (velocity[a][0] - x / m_a, velocity[a][1] - y / m_a)
    velocity[b] = (velocity[b][0] + x / contact.pair.m_b, velocity[b][1] + y / contact.pair.m_b)


def friction(contact: Contact, impulse: float, velocity: Any, shares: Any) -> float:
    """Return the impulse (N s) of friction; a ball's contacts share in ending its slip.

    ``shares`` has the number of contacts that push each ball.
    """
    most = contact.pair.friction * impulse
    if most <= 0.0:
        return 0.0
    lightness, among = 1.0 / contact.pair.m_a, shares[contact.a]
    if contact.b != NO_BALL:
        lightness += 1.0 / contact.pair.m_b
        among = max(among, shares[contact.b])
    slip = slip_of(contact, velocity)
    return math.copysign(min(most, abs(slip) / (among * lightness)), -slip)


# -- the complementarity problem -----------------------------------------------------------------


def find_impulses(room: Any, count: int) -> bool:
    """Find the impulses J >= 0 (N s) that open every contact by ``wanted`` (m/s) or more.

    A contact that pushes opens by exactly ``wanted``: J (response J - wanted) = 0. This is a linear
    complementarity problem. Masses may differ widely, so the units are chosen such that each
    contact's own response is 1. Return False where rounding hides which contacts push.

    All contacts on the wrong side change sides at once, so that their order does not matter. If
    that does not end, only the last of them changes (Murty, Linear Complementarity, 1988, section
    3.2).
    """
    response, wanted, unit = room.response, room.wanted, room.unit
    for k in range(count):
        unit[k] = math.sqrt(response[k][k])
    for k in range(count):
        wanted[k] /= unit[k]
        room.pushing[k] = wanted[k] > 0.0
        row = response[k]
        for m in range(count):
            if row[m] != 0.0:
                row[m] /= unit[k] * unit[m]
    for exchange in range(MOST_EXCHANGES * count):
        least_impulses(room, count)
        if not exchange_sides(room, count, exchange <= count):
            for k in range(count):
                room.pushes[k] /= unit[k]
            return True
    return False


def exchange_sides(room: Any, count: int, all_at_once: bool) -> bool:
    """Let contacts on the wrong side change sides, all or the last; tell whether any did."""
    lacking, impulse, pushing, last = room.rest, room.pushes, room.pushing, -1
    widest = pushed = 0.0
    for k in range(count):
        opened = total = 0.0
        row = room.response[k]
        for m in range(count):
            if row[m] != 0.0:
                part = row[m] * impulse[m]
                opened += part
                total += abs(part)
        lacking[k] = room.wanted[k] - opened
        widest, pushed = max(widest, abs(room.wanted[k])), max(pushed, total)
    slack = 1e-12 * widest + SPEED_ROUNDING * pushed  # m/s; how much may be rounding
    for k in range(count):
        is_wrong = lacking[k] > slack
        if pushing[k]:
            is_wrong = impulse[k] < 0.0 or lacking[k] < -slack
        if is_wrong:
            last = k
            if all_at_once:
                pushing[k] = not pushing[k]
    if last >= 0 and not all_at_once:
        pushing[last] = not pushing[last]
    return last >= 0


def least_impulses(room: Any, count: int) -> None:
    """Find the impulses of least norm that open the pushing contacts by ``wanted``.

    The response of the contacts that are not redundant is L L^T. Where some are
    redundant, there are impulses that open nothing; the answer has no part along these.
    """
    factor, chosen, found, many = room.factor, room.chosen, room.rest, 0
    for k in range(count):
        room.pushes[k] = 0.0
        if room.pushing[k]:
            chosen[many] = k
            many += 1
    rank = decompose(room.response, chosen, many, factor, found)
    for q in range(rank, many):
        free = factor[chosen[q]]
        backwards(factor, chosen, rank, free)
        for p in range(rank, many):
            free[p] = -1.0 if p == q else 0.0
        project(factor, chosen, rank, q, many, free)
    for p in range(many):
        found[p] = room.wanted[chosen[p]]
    project(factor, chosen, rank, many, many, found)
    for p in range(rank):
        row = factor[chosen[p]]
        found[p] = (found[p] - product(row, found, p)) / row[p]
    backwards(factor, chosen, rank, found)
    for p in range(rank, many):
        found[p] = 0.0
    project(factor, chosen, rank, many, many, found)
    for p in range(many):
        room.pushes[chosen[p]] = found[p]


def decompose(response: Any, chosen: Any, many: int, factor: Any, rest: Any) -> int:
    """Find the rows of L, with pivots, and return its rank; put redundant contacts at the end.

    ``rest`` has the part of each contact's own response that no row explains yet.
    """
    for p in range(many):
        rest[chosen[p]] = response[chosen[p]][chosen[p]]
    for p in range(many):
        best = p
        for q in range(p + 1, many):
            if rest[chosen[q]] > rest[chosen[best]]:
                best = q
        if rest[chosen[best]] <= REDUNDANT:
            return p
        chosen[p], chosen[best] = chosen[best], chosen[p]
        k = chosen[p]
        row, pivot = factor[k], math.sqrt(rest[k])
        row[p] = pivot
        for q in range(p + 1, many):
            m = chosen[q]
            part = (response[m][k] - product(factor[m], row, p)) / pivot
            factor[m][p] = part
            rest[m] -= part * part
    return many


def backwards(factor: Any, chosen: Any, rank: int, found: Any) -> None:
    """Solve L^T x = b, where ``found`` has first b, then x."""
    for p in range(rank - 1, -1, -1):
        row = factor[chosen[p]]
        found[p] /= row[p]
        for q in range(p):
            found[q] -= row[q] * found[p]


def project(factor: Any, chosen: Any, first: int, last: int, many: int, found: Any) -> None:
    """Take away what lies along the vectors in some rows of ``factor``."""
    for q in range(first, last):
        row = factor[chosen[q]]
        part = product(row, found, many) / product(row, row, many)
        for p in range(many):
            found[p] -= part * row[p]


def product(one: Any, other: Any, many: int) -> float:
    """Return the scalar product of the first ``many`` numbers, added up in their order."""
    total = 0.0
    for p in range(many):
        total += one[p] * other[p]
    return total
