"""Contacts of one instant that share balls are answered here, in no order.

In a real rack the outcome depends on the order of the hits, and a gap of 1e-9 m decides that order.
The two answers here do not depend on the order in which balls are listed:

- :func:`at_once` is for Coulomb's law. It solves for all normal impulses J >= 0 at once, such that
  every contact opens at e times its closing speed or faster (Newton's law of restitution for
  simultaneous impact). Where the contacts are redundant, it takes the smallest such impulses. Then
  every contact takes its friction, min(mu J_n, m_eff |slip|). The contacts of a ball share the slip
  among them, so that no slip is reversed and energy cannot grow.
- :func:`mean_over_orders` is for any law. It answers the contacts in every order in which they
  could have come, takes the mean, and repeats this until nothing closes. It keeps momentum where
  the law does. By convexity it leaves no more energy than the orders do on average.

A contact may close only because of this answer. It is then the next impact at the same instant: a
hit runs through a row of touching balls one after the other, as in Newton's cradle.
"""

from __future__ import annotations

import math
from typing import Final

from mypy_extensions import mypyc_attr

from pool_pymunk.core.contact.contact import Contact, Disc
from pool_pymunk.core.motion.times import Vector

# For up to this many contacts all 24 orders are tried. Eight contacts would have 40,320.
ALL_ORDERS: Final = 4
# After this many sweeps of the mean, what still closes is a next impact. Half or twice as many move
# no ball that was tried.
MOST_SWEEPS: Final = 200
DIGITS: Final = 1e9  # Normals that agree to nine digits are the same; rounding moves the 15th.
# This share of the speeds, or of the impulses, may be rounding, in sums over some 30 contacts.
SPEED_ROUNDING: Final = 64.0 * 2.0**-52
# So many exchanges are tried for each contact; 2,000 random problems needed seven at most.
MOST_EXCHANGES: Final = 20
# A contact is redundant if less than this share of its response is independent: rounding leaves
# some 1e-15. In breaks of a frozen rack of fifteen the least share is 0.75.
REDUNDANT: Final = 1e-12

Row = list[float]


@mypyc_attr(allow_interpreted_subclasses=True)
class Hits:
    """Single hits answer several contacts one by one; a law gives the answer to each.

    ``slip`` is that of A and B along the tangent where the law jumps and only rounding knows it, as
    multiples of the least that counts; (0, 0) leaves friction out.
    """

    def __init__(self, slip: Vector) -> None:
        self.slip = slip

    def answer(self, one: Contact) -> None:
        """Answer one of the contacts."""
        raise NotImplementedError

    def note(self, one: Contact, ax: float, ay: float, bx: float, by: float) -> None:
        """Note what an answer has changed, before which its balls had these velocities (m/s)."""


def discs_of(contacts: list[Contact]) -> list[Disc]:
    """List the balls of contacts, each of them once."""
    found: list[Disc] = []
    for one in contacts:
        for each in one.discs:
            each.plays = False
    for one in contacts:
        for each in one.discs:
            if not each.plays:
                each.plays = True
                found.append(each)
    return found


def velocities_of(discs: list[Disc]) -> list[Vector]:
    return [(each.vx, each.vy) for each in discs]


def set_velocities(discs: list[Disc], velocities: list[Vector]) -> None:
    for each, v in zip(discs, velocities):
        each.vx, each.vy = v


def fastest_of(discs: list[Disc]) -> float:
    """Return the speed (m/s) of the fastest ball."""
    most = 0.0
    for each in discs:
        most = max(most, each.vx * each.vx + each.vy * each.vy)
    return math.sqrt(most)


# -- any law: the mean over orders -----------------------------------------------------------------


def mean_over_orders(contacts: list[Contact], hits: Hits) -> None:
    """Answer the contacts in every order in which they could come, and take the mean.

    For up to ``ALL_ORDERS`` contacts all orders count. For more, fronts run along the normals and
    back, and give the orders in which they reach contacts. Those that one reaches together come
    from left to right and from right to left. Repeat this until nothing closes.
    """
    discs = discs_of(contacts)
    orders = all_orders(len(contacts)) if len(contacts) <= ALL_ORDERS else fronts(contacts)
    for _ in range(MOST_SWEEPS):
        noise = SPEED_ROUNDING * fastest_of(discs)
        if not any(one.closing > noise for one in contacts):
            return
        start = velocities_of(discs)
        ends_x: list[Row] = [[] for _ in discs]
        ends_y: list[Row] = [[] for _ in discs]
        for order in orders:
            for k in order:
                if contacts[k].closing > 0.0:
                    hits.answer(contacts[k])
            for p, each in enumerate(discs):
                ends_x[p].append(each.vx)
                ends_y[p].append(each.vy)
            set_velocities(discs, start)
        for p, each in enumerate(discs):
            each.vx = math.fsum(ends_x[p]) / len(orders)
            each.vy = math.fsum(ends_y[p]) / len(orders)


def all_orders(count: int) -> list[list[int]]:
    """Return all orders of a few contacts: each contact goes in at one of the places so far.

    >>> all_orders(3)
    [[2, 1, 0], [2, 0, 1], [1, 2, 0], [0, 2, 1], [1, 0, 2], [0, 1, 2]]
    """
    orders: list[list[int]] = [[]]
    for k in range(count):
        orders = [[*turn[:p], k, *turn[p:]] for p in range(k + 1) for turn in orders]
    return orders


def fronts(contacts: list[Contact]) -> list[list[int]]:
    """Return the orders in which fronts reach contacts, along each normal once and back."""
    count = len(contacts)
    mean_x = math.fsum([one.px for one in contacts]) / count
    mean_y = math.fsum([one.py for one in contacts]) / count
    xs, ys = [one.px - mean_x for one in contacts], [one.py - mean_y for one in contacts]
    size = max([max(abs(x), abs(y)) for x, y in zip(xs, ys)])
    size = size if size > 0.0 else 1.0
    orders: list[list[int]] = []
    seen: list[tuple[int, int]] = []
    for one in contacts:
        nx, ny = round(one.nx * DIGITS), round(one.ny * DIGITS)
        if (nx, ny) in seen or (-nx, -ny) in seen:
            continue
        seen.append((nx, ny))
        for sign in [1.0, -1.0]:
            x, y = sign * nx / DIGITS, sign * ny / DIGITS
            reached = [round((xs[k] * x + ys[k] * y) / size * DIGITS) for k in range(count)]
            for end in [1.0, -1.0]:
                across = [end * (ys[k] * x - xs[k] * y) for k in range(count)]
                order = sorted([(reached[k], across[k], k) for k in range(count)])
                orders.append([k for _reached, _across, k in order])
    return orders


# -- Coulomb's law: all at once ----------------------------------------------------------------


def at_once(contacts: list[Contact]) -> bool:
    """Give contacts all impulses at once, and note them.

    Return False, with all velocities as they were, if rounding hides which contacts push.
    """
    wanted = [(1.0 + one.pair.restitution) * one.closing for one in contacts]
    response = [[coupling(one, other) for other in contacts] for one in contacts]
    for one in contacts:
        for each in one.discs:
            each.shares = 0
    pushes = find_impulses(response, wanted)
    if pushes is None:
        return False
    for one, impulse in zip(contacts, pushes):
        one.normal = impulse
        if impulse > 0.0:
            one.push(impulse, 0.0)
            for each in one.discs:
                each.shares += 1
    for one in contacts:
        one.set_impulses(one.normal, friction(one))
    for one in contacts:
        if one.along != 0.0:
            one.push(0.0, one.along)
    return True


def coupling(one: Contact, other: Contact) -> float:
    """Return the speed (m/s) by which a unit impulse at one contact opens another."""
    shared = push_sign(other, one.a) / one.pair.m_a  # 1/kg
    if one.b is not None:
        shared = push_sign(other, one.b) / one.pair.m_b - shared
    if shared == 0.0:
        return 0.0
    return shared * (one.nx * other.nx + one.ny * other.ny)


def push_sign(one: Contact, ball: Disc) -> float:
    """Return the sign with which a contact pushes a ball along its normal; 0: not at all."""
    if ball is one.b:
        return 1.0
    if ball is not one.a:
        return 0.0
    return 1.0 if one.b is None else -1.0


def friction(one: Contact) -> float:
    """Return the impulse (N s) of friction; a ball's contacts share in ending its slip."""
    most = one.pair.friction * one.normal
    if most <= 0.0:
        return 0.0
    among, slip = one.a.shares, one.slip
    if one.b is not None:
        among = max(among, one.b.shares)
    return math.copysign(min(most, abs(slip) / (among * one.lightness)), -slip)


# -- the complementarity problem -----------------------------------------------------------------


def find_impulses(response: list[Row], wanted: Row) -> Row | None:
    """Find the impulses J >= 0 (N s) that open every contact by ``wanted`` (m/s) or more.

    A contact that pushes opens by exactly that: J (response J - wanted) = 0. All contacts on the
    wrong side change sides at once; if that does not end, only the last of them changes (Murty,
    Linear Complementarity, 1988, section 3.2). Return None where rounding hides which ones push.
    """
    count = len(wanted)
    unit = [math.sqrt(response[k][k]) for k in range(count)]
    for k in range(count):
        wanted[k] /= unit[k]
        row = response[k]
        for m in range(count):
            if row[m] != 0.0:
                row[m] /= unit[k] * unit[m]
    pushing = [w > 0.0 for w in wanted]
    for exchange in range(MOST_EXCHANGES * count):
        pushes = least_impulses(response, wanted, pushing)
        if not exchange_sides(response, wanted, pushes, pushing, exchange <= count):
            return [push / u for push, u in zip(pushes, unit)]
    return None


def exchange_sides(
    response: list[Row], wanted: Row, pushes: Row, pushing: list[bool], all_at_once: bool
) -> bool:
    """Let contacts on the wrong side change sides, all or the last; tell whether any did."""
    count, last, widest, pushed = len(wanted), -1, 0.0, 0.0
    lacking: Row = []
    for k in range(count):
        opened = total = 0.0
        row = response[k]
        for m in range(count):
            part = row[m] * pushes[m]
            opened += part
            total += abs(part)
        lacking.append(wanted[k] - opened)
        widest, pushed = max(widest, abs(wanted[k])), max(pushed, total)
    slack = 1e-12 * widest + SPEED_ROUNDING * pushed  # m/s; how much may be rounding
    for k in range(count):
        is_wrong = lacking[k] > slack
        if pushing[k]:
            is_wrong = pushes[k] < 0.0 or lacking[k] < -slack
        if is_wrong:
            last = k
            if all_at_once:
                pushing[k] = not pushing[k]
    if last >= 0 and not all_at_once:
        pushing[last] = not pushing[last]
    return last >= 0


def least_impulses(response: list[Row], wanted: Row, pushing: list[bool]) -> Row:
    """Find the impulses of least norm that open the pushing contacts by ``wanted``.

    The response of the contacts that are not redundant is L L^T. Where some are redundant, there
    are impulses that open nothing; the answer has no part along these.
    """
    count = len(wanted)
    chosen = [k for k in range(count) if pushing[k]]
    many = len(chosen)
    factor = [[0.0] * count for _ in range(count)]
    rank = decompose(response, chosen, factor)
    for q in range(rank, many):
        free = factor[chosen[q]]
        backwards(factor, chosen, rank, free)
        for p in range(rank, many):
            free[p] = -1.0 if p == q else 0.0
        project(factor, chosen, rank, q, free)
    found = [wanted[k] for k in chosen]
    project(factor, chosen, rank, many, found)
    for p in range(rank):
        row = factor[chosen[p]]
        found[p] = (found[p] - product(row, found, p)) / row[p]
    backwards(factor, chosen, rank, found)
    for p in range(rank, many):
        found[p] = 0.0
    project(factor, chosen, rank, many, found)
    pushes = [0.0] * count
    for p in range(many):
        pushes[chosen[p]] = found[p]
    return pushes


def decompose(response: list[Row], chosen: list[int], factor: list[Row]) -> int:
    """Find the rows of L, with pivots, and return its rank; put redundant contacts at the end."""
    many = len(chosen)
    rest = [response[k][k] for k in range(len(response))]
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


def backwards(factor: list[Row], chosen: list[int], rank: int, found: Row) -> None:
    """Solve L^T x = b, where ``found`` has first b, then x."""
    for p in range(rank - 1, -1, -1):
        row = factor[chosen[p]]
        found[p] /= row[p]
        for q in range(p):
            found[q] -= row[q] * found[p]


def project(factor: list[Row], chosen: list[int], first: int, last: int, found: Row) -> None:
    """Take away what lies along the vectors in some rows of ``factor``."""
    many = len(chosen)
    for q in range(first, last):
        row = factor[chosen[q]]
        part = product(row, found, many) / product(row, row, many)
        for p in range(many):
            found[p] -= part * row[p]


def product(one: Row, other: Row, many: int) -> float:
    """Return the scalar product of the first ``many`` numbers, added up in their order."""
    total = 0.0
    for p in range(many):
        total += one[p] * other[p]
    return total
