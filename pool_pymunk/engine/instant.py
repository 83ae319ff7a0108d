"""The contacts of one instant come in rounds; those of a cluster are answered all at once."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from pool_pymunk.engine import decisions
from pool_pymunk.engine.balls import Motions
from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.resolver import LED, MISSED, Resolution
from pool_pymunk.physics.collapse import Order
from pool_pymunk.physics.contact import Contact, Vector, Velocities
from pool_pymunk.physics.path import Path


class Instant:
    """An instant is a moment in which rounds of contacts are answered.

    ``met`` has what met in these rounds, and ``before`` the velocities (m/s) of the balls before
    them. ``is_measured`` tells whether it is known what the order of the contacts decides.
    """

    def __init__(self) -> None:
        self.met: dict[Hit, None] = {}
        self.before: dict[int, Vector] = {}
        self.begin(-math.inf)

    def begin(self, now: float) -> None:
        """Begin another instant now (s)."""
        self.began = now
        self.is_measured = False
        self.rounds = 0
        self.met.clear()
        self.before.clear()

    def add(self, hits: Iterable[Hit], velocity: Mapping[int, Vector]) -> None:
        """Begin another round, of these hits of balls with these velocities (m/s)."""
        self.rounds += 1
        self.met.update(dict.fromkeys(hits))
        for ball, v in velocity.items():
            self.before.setdefault(ball, v)

    def leave_out(self, balls: Collection[int]) -> None:
        """Leave out what met these balls, which have left the table."""
        self.met = {hit: None for hit in self.met if set(balls).isdisjoint(hit.balls)}

    def start_over(self) -> None:
        """Forget the rounds that have been answered as one cluster."""
        self.rounds = 0
        self.met.clear()


class Cluster:
    """A cluster is what touches at one instant; it is answered round after round.

    ``velocity`` (m/s) has what the rounds have left until now, ``changed`` the balls that they have
    moved, and ``missed`` the balls that touch, but did not close. A policy may know what hits
    ``first``.
    """

    def __init__(self, motions: Motions, contacts: Sequence[Contact]) -> None:
        self.motions = motions
        self.contacts = contacts
        self.velocity: Velocities = velocities(motions)
        self.order = Order(contacts)
        self.changed: dict[int, None] = {}
        self.missed: list[Contact] = []
        self.first: list[Contact] = []
        self.hits = 0

    @property
    def has_many_hits(self) -> bool:
        """Tell whether there have been so many hits that they may have no end."""
        return self.hits > decisions.LISTED

    def moving(self, contacts: Iterable[Contact]) -> dict[int, Vector]:
        """Return the velocities (m/s) of the balls in these contacts."""
        return {i: self.velocity[i] for contact in contacts for i in contact.balls}

    def take(self, resolution: Resolution, paths: Sequence[Path]) -> None:
        """Take note of what a round has done, and of the new paths of its balls."""
        self.hits += sum(answer.kind not in (LED, MISSED) for answer in resolution.answers)
        self.missed += resolution.missed
        for i in resolution.velocity:
            self.velocity[i] = paths[i].vx, paths[i].vy
            self.changed[i] = None

    def left_to_meet(self) -> list[Contact]:
        """Return the missed contacts of balls that have not been moved."""
        return [each for each in self.missed if self.changed.keys().isdisjoint(each.balls)]


def velocities(motions: Motions) -> dict[int, Vector]:
    """Return the velocities (m/s) of motions."""
    return {i: (vx, vy) for i, (_, _, vx, vy) in motions.items()}
