"""This module finds the impulses of contacts of one instant, once their velocities are known.

In a single hit the changes of velocity tell the impulse. For contacts that a law has answered
together there are three methods, and the first one that explains all changes of velocity counts:

1. The law has answered single hits, perhaps in several orders, of which it has taken the mean. So
   their impulses are added up, and divided by a common number.
2. The law has solved for all impulses at once, and so does this module.
3. Otherwise the impulses are those of least norm, along the normals and the tangents.
"""

from __future__ import annotations

import math
from typing import Final, final

from pool_pymunk.core.contact.contact import Contact, Disc, Pair
from pool_pymunk.core.contact.laws import HitsByLaw
from pool_pymunk.core.contact.together import (
    Row,
    at_once,
    coupling,
    discs_of,
    least_impulses,
    set_velocities,
    velocities_of,
)

# A method explains a change of velocities if it errs by less than this share. Rounding in some
# thousand hits is less, and a wrong method errs by hundredths, so half or twice this would do.
EXPLAINED: Final = 1e-9


@final
class NotedHits(HitsByLaw):
    """These single hits are answered by a law, and their impulses are added up."""

    def answer(self, one: Contact) -> None:
        a, b = one.a, one.b
        ax, ay, bx, by = a.vx, a.vy, 0.0, 0.0
        if b is not None:
            bx, by = b.vx, b.vy
        super().answer(one)
        self.note(one, ax, ay, bx, by)

    def note(self, one: Contact, ax: float, ay: float, bx: float, by: float) -> None:
        a, b = one.a, one.b
        one.measure(ax, ay, bx, by)
        one.called += one.normal
        one.called_along += one.along
        a.sum_x, a.sum_y = a.sum_x - (ax - a.vx), a.sum_y - (ay - a.vy)
        if b is not None:
            one.called_first += one.along_first
            b.sum_x, b.sum_y = b.sum_x - (bx - b.vx), b.sum_y - (by - b.vy)


def begin(contacts: list[Contact]) -> None:
    """Begin an answer of contacts that share balls."""
    for one in contacts:
        one.called = one.called_along = one.called_first = 0.0
        for each in one.discs:
            start(each, each.vx, each.vy)


def begin_before(contacts: list[Contact]) -> None:
    """Let an answer begin at the velocities before the round."""
    for one in contacts:
        for each in one.discs:
            start(each, each.before_x, each.before_y)


def start(disc: Disc, vx: float, vy: float) -> None:
    """Begin an answer of a disc's contacts at a velocity (m/s)."""
    disc.start_x, disc.start_y = vx, vy
    disc.sum_x = disc.sum_y = 0.0


def explain(group: list[Contact]) -> None:
    """Find the impulses of contacts that share balls, and that a law has answered."""
    discs = discs_of(group)
    if is_explained_by_hits(group, discs):
        return
    after = velocities_of(discs)
    set_velocities(discs, [(each.start_x, each.start_y) for each in discs])
    is_explained = at_once(group) and velocities_of(discs) == after
    set_velocities(discs, after)
    if not is_explained:
        find_least(group, discs)


def is_explained_by_hits(group: list[Contact], discs: list[Disc]) -> bool:
    """Tell whether the single hits explain all changes, divided by a common number."""
    sums: Row = []
    changes: Row = []
    for each in discs:
        sums += [each.sum_x, each.sum_y]
        changes += [each.vx - each.start_x, each.vy - each.start_y]
    size = math.fsum([x * x for x in sums])
    products = math.fsum([x * y for x, y in zip(sums, changes)])
    fitted = products / size if size > 0.0 else 0.0
    slack = EXPLAINED * max([abs(y) for y in changes])
    for share in [1.0, fitted]:
        if max([abs(share * x - y) for x, y in zip(sums, changes)]) <= slack:
            for one in group:
                one.normal, one.along = share * one.called, share * one.called_along
                one.along_first = one.along if one.b is None else share * one.called_first
            return True
    return False


def find_least(group: list[Contact], discs: list[Disc]) -> None:
    """Find the impulses of least norm that explain the changes of velocity (m/s)."""
    unit = Pair(1.0, 1.0, 0.0, 0.0)  # The masses are in the momenta.
    lines: list[Contact] = []
    for one in group:
        lines.append(Contact(one.a, one.b, one.wall, one.nx, one.ny, unit))
        lines.append(Contact(one.a, one.b, one.wall, -one.ny, one.nx, unit))
    after = velocities_of(discs)
    for each, mass in zip(discs, masses_of(group, discs)):
        each.vx, each.vy = mass * (each.vx - each.start_x), mass * (each.vy - each.start_y)
    wanted = [-line.closing for line in lines]
    set_velocities(discs, after)
    response = [[coupling(line, other) for other in lines] for line in lines]
    pushes = least_impulses(response, wanted, [True] * len(lines))
    for k, one in enumerate(group):
        one.set_impulses(pushes[2 * k], pushes[2 * k + 1])


def masses_of(group: list[Contact], discs: list[Disc]) -> Row:
    """Return the masses (kg) of discs, as their contacts have them."""
    found = [each.ball.mass for each in discs]
    for one in group:
        for k, each in enumerate(discs):
            if each is one.a:
                found[k] = one.pair.m_a
            elif each is one.b:
                found[k] = one.pair.m_b
    return found
