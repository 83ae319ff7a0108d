"""This module finds the impulses of contacts of one instant, once their velocities are known.

A contact's impulse is the change of momentum that it gives its two sides along its normal. A single
hit's follows from the change of one velocity. For contacts that a law has answered together there
are three ways, and the first one that explains the change of all velocities holds:

1. The law has called ``respond`` for each contact, perhaps in several orders, of which it has taken
   the mean. So the impulses of its calls are added up, and divided by a common number.
2. The law has solved for all impulses at once, and so does this module.
3. Otherwise the impulses are those of least norm, along the normals and the tangents.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pool_pymunk.physics.contact import NO_BALL, Contact, Vector, groups
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.together import at_once, directions

# of the change of velocities; what explains all but this share of it explains it. Rounding of some
# thousand calls is less than that, and a wrong way errs by parts in a hundred.
EXPLAINED = 1e-9

Call = tuple[Contact, Sequence[Vector], Sequence[Vector]]  # its balls' velocities before and after


def along_normal(contact: Contact, before: Vector, after: Vector) -> float:
    """Return the impulse (N s) of a contact that has changed the velocity (m/s) of its ball a.

    >>> from pool_pymunk.physics.contact import Pair
    >>> cushion = Contact(0, NO_BALL, (0.0, 1.0), Pair(0.2, 0.0, 0.5, 0.1))
    >>> along_normal(cushion, (1.0, -2.0), (0.7, 1.0))
    0.6000000000000001
    """
    nx, ny = contact.normal
    change = (after[0] - before[0]) * nx + (after[1] - before[1]) * ny
    return contact.pair.m_a * (change if contact.b == NO_BALL else -change)


class Shared:
    """This finds the impulses of contacts that a law answered together, when asked for."""

    def __init__(
        self,
        contacts: Sequence[Contact],
        before: Mapping[int, Vector],
        after: Mapping[int, Vector],
        calls: Sequence[Call] = (),
    ) -> None:
        self.contacts, self.before, self.after, self.calls = contacts, before, after, calls
        self._found: dict[Contact, float] = {}

    def impulse(self, contact: Contact) -> float:
        """Return the impulse (N s) along the normal of one of the contacts."""
        if not self._found:
            for group in groups(self.contacts):
                self._found.update(zip(group, self._of_group(group), strict=True))
        return self._found[contact]

    def _of_group(self, group: Sequence[Contact]) -> list[float]:
        """Return the impulses (N s) of contacts that hang together."""
        balls = sorted({i for contact in group for i in contact.balls})
        change = _row(self.after, balls) - _row(self.before, balls)
        found = self._of_calls(group, balls, change)
        if found is not None:
            return found
        solved = dict(self.before)
        found = at_once(group, solved)
        if found is not None and all(solved[i] == self.after[i] for i in balls):
            return found
        return _least(group, balls, change)

    def _of_calls(
        self, group: Sequence[Contact], balls: Sequence[int], change: Array
    ) -> list[float] | None:
        """Return the sums of the calls' impulses, divided by a common number that explains all."""
        impulses = dict.fromkeys([contact[:3] for contact in group], 0.0)
        total = {i: np.zeros(2) for i in balls}
        for contact, before, after in self.calls:
            if contact[:3] in impulses:
                impulses[contact[:3]] += along_normal(contact, before[0], after[0])
                for i, old, new in zip(contact.balls, before, after, strict=True):
                    total[i] += np.subtract(new, old)
        sums = np.concatenate([total[i] for i in balls])
        share = float(sums @ change / (sums @ sums)) if sums.any() else 0.0
        if np.abs(share * sums - change).max() > EXPLAINED * np.abs(change).max():
            return None
        return [share * impulse for impulse in impulses.values()]


def _least(group: Sequence[Contact], balls: Sequence[int], change: Array) -> list[float]:
    """Return the impulses of least norm that explain the change of velocity."""
    normals, tangents, lightness = directions(group, balls)
    pushes = np.concatenate((normals, tangents)).T
    found = np.linalg.lstsq(pushes, change / lightness, rcond=1e-12)[0]
    return list(map(float, found[: len(group)]))


def _row(velocity: Mapping[int, Vector], balls: Sequence[int]) -> Array:
    """Return the velocities of these balls in one row."""
    return np.array([velocity[i] for i in balls]).ravel()
