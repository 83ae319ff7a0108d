"""This module finds the impulses of contacts of one instant, once their velocities are known.

A contact's impulse is the change of momentum that it gives its two sides. In a single hit the
changes of their velocities tell it. For contacts that a law has answered together there
are three methods, and the first one that explains the change of all velocities counts:

1. The law has called ``respond`` for each contact, perhaps in several orders, of which it has taken
   the mean. So the impulses of its calls are added up, and divided by a common number.
2. The law has solved for all impulses at once, and so does this module.
3. Otherwise the impulses are those of least norm, along the normals and the tangents.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from pool_pymunk.laws.contact import Impulse as Impulse
from pool_pymunk.physics.contact import NO_BALL, Contact, Pair, Vector, closing_speed, groups
from pool_pymunk.physics.together import at_once, coupling, least_impulses, lines, room

# A method explains a change of velocities if it errs by less than this share. Rounding in some
# thousand calls is less, and a wrong method errs by hundredths, so half or twice this would do.
EXPLAINED = 1e-9

UNIT = Pair(1.0, 1.0, 0.0, 0.0)  # The masses are in the momenta.

Call = tuple[Contact, Sequence[Vector], Sequence[Vector]]  # its balls' velocities before and after


def impulse_of(contact: Contact, before: Sequence[Vector], after: Sequence[Vector]) -> Impulse:
    """Return the impulse of a contact that has changed the velocities (m/s) of its balls.

    >>> from pool_pymunk.physics.contact import Pair
    >>> cushion = Contact(0, NO_BALL, (0.0, 1.0), Pair(0.5, 0.0, 0.5, 0.1))
    >>> impulse_of(cushion, [(1.0, -2.0)], [(0.75, 1.0)])
    Impulse(normal=1.5, tangential=0.125, tangential_first=None)
    """
    normal, tangential, first = pushes_of(contact, before, after)
    return Impulse(normal, tangential, None if contact.b == NO_BALL else first)


def pushes_of(contact: Any, before: Any, after: Any) -> tuple[float, float, float]:
    """Return a contact's impulses (N s): the fields of :class:`Impulse`, all of them numbers."""
    (nx, ny), m_a = contact.normal, contact.pair.m_a
    (vx, vy), (ux, uy) = before[0], after[0]
    x, y = ux - vx, uy - vy
    normal, first = m_a * (x * nx + y * ny), m_a * (y * nx - x * ny)
    if contact.b == NO_BALL:
        return normal, first, first
    (vx, vy), (ux, uy) = before[1], after[1]
    return -normal, contact.pair.m_b * ((uy - vy) * nx - (ux - vx) * ny), first


def numbers_of(impulse: Impulse) -> tuple[float, float, float]:
    """Return the fields of an impulse, all of them numbers."""
    normal, tangential, first = impulse
    return normal, tangential, tangential if first is None else first


def slowing(friction: float, impulse: float, mass: float) -> float:
    """Return mu |v_n' - v_n| (m/s) of a cushion that gave a ball this impulse (N s)."""
    return friction * impulse / mass


class Shared:
    """This finds, when asked, the impulses of contacts that a law answered together."""

    def __init__(
        self,
        contacts: Sequence[Contact],
        before: Mapping[int, Vector],
        after: Mapping[int, Vector],
        calls: Sequence[Call] = (),
    ) -> None:
        self.contacts, self.before, self.after, self.calls = contacts, before, after, calls
        self._found: dict[Contact, Impulse] = {}

    def impulse(self, contact: Contact) -> Impulse:
        """Return the impulse of one of the contacts."""
        if not self._found:
            for group in groups(self.contacts):
                self._found.update(zip(group, self._of_group(group), strict=True))
        return self._found[contact]

    def _of_group(self, group: Sequence[Contact]) -> list[Impulse]:
        """Return the impulses of contacts that share balls."""
        balls = sorted({i for contact in group for i in contact.balls})
        change = {i: _less(self.after[i], self.before[i]) for i in balls}
        found = self._of_calls(group, change)
        if found is not None:
            return found
        solved = dict(self.before)
        both = at_once(group, solved)
        if both is not None and all(solved[i] == self.after[i] for i in balls):
            return _opposite(group, *both)
        return _least(group, change)

    def _of_calls(
        self, group: Sequence[Contact], change: Mapping[int, Vector]
    ) -> list[Impulse] | None:
        """Return the calls' summed impulses over the common number that explains all changes."""
        impulses = {contact[:3]: (0.0, 0.0, 0.0) for contact in group}
        total: dict[int, Vector] = dict.fromkeys(change, (0.0, 0.0))
        for contact, before, after in self.calls:
            if contact[:3] in impulses:
                one, (n, t, first) = impulse_of(contact, before, after), impulses[contact[:3]]
                more = one.tangential_first or 0.0
                impulses[contact[:3]] = n + one.normal, t + one.tangential, first + more
                for i, old, new in zip(contact.balls, before, after, strict=True):
                    total[i] = _less(total[i], _less(old, new))
        pairs = [(x, y) for i in change for x, y in zip(total[i], change[i], strict=True)]
        size = math.fsum(x * x for x, _ in pairs)
        fitted = math.fsum(x * y for x, y in pairs) / size if size > 0.0 else 0.0
        slack = EXPLAINED * max(abs(y) for _, y in pairs)
        shares = [s for s in (1.0, fitted) if max(abs(s * x - y) for x, y in pairs) <= slack]
        if not shares:
            return None
        share = shares[0]
        scaled = [(share * n, share * t, share * first) for n, t, first in impulses.values()]
        return [_impulse(contact, *each) for contact, each in zip(group, scaled, strict=True)]


def _impulse(contact: Contact, normal: float, tangential: float, first: float) -> Impulse:
    """Return an impulse; one of a cushion has no first ball."""
    return Impulse(normal, tangential, None if contact.b == NO_BALL else first)


def _opposite(
    group: Sequence[Contact], normal: Sequence[float], tangential: Sequence[float]
) -> list[Impulse]:
    """Return impulses (N s) that push two balls by as much, in opposite directions."""
    each = zip(group, normal, tangential, strict=True)
    return [_impulse(contact, n, t, -t) for contact, n, t in each]


def _less(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1]


def _least(group: Sequence[Contact], change: Mapping[int, Vector]) -> list[Impulse]:
    """Return the impulses of least norm that explain the changes of velocity (m/s)."""
    masses = {i: m for contact in group for i, m in zip(contact.balls, contact.pair, strict=False)}
    momentum = {i: (masses[i] * x, masses[i] * y) for i, (x, y) in change.items()}
    both = lines([contact._replace(pair=UNIT, drift=(0.0, 0.0)) for contact in group])
    own = room(len(both))
    explain(both, len(both), momentum, own)
    return _opposite(group, own.pushes[::2], own.pushes[1::2])


def explain(both: Any, count: int, momentum: Any, room: Any) -> None:
    """Find the impulses of least norm along lines that explain changes of ``momentum`` (N s)."""
    for k in range(count):
        for m in range(count):
            room.response[k][m] = coupling(both[k], both[m])
        room.wanted[k], room.pushing[k] = -closing_speed(both[k], momentum), True
    least_impulses(room, count)
