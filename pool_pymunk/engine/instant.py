"""The contacts of one instant come in rounds; those of a cluster are answered all at once."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.recorder import Motions
from pool_pymunk.engine.resolver import LED, MISSED, Resolution
from pool_pymunk.physics.collapse import Order
from pool_pymunk.physics.contact import Contact, Vector, Velocities
from pool_pymunk.physics.path import Path


class Instant:
    """An instant is a moment in which rounds of contacts are answered."""

    def __init__(self, began: float = -math.inf) -> None:
        self.began = began  # s
        self.rounds = 0
        self.met: dict[Hit, None] = {}  # what met in these rounds
        self.before: dict[int, Vector] = {}  # m/s; the velocities before them


class Cluster:
    """A cluster is what touches at one instant; it is answered round after round."""

    def __init__(self, motions: Motions, contacts: Sequence[Contact]) -> None:
        self.motions = motions
        self.contacts = contacts
        self.velocity: Velocities = velocities(motions)  # m/s; after the rounds so far
        self.order = Order(contacts)
        self.changed: dict[int, None] = {}  # the balls that the rounds have moved
        self.missed: list[Contact] = []  # These touch, but did not close.
        self.hits = 0

    def take(self, resolution: Resolution, paths: Sequence[Path]) -> None:
        """Take note of what a round has done, and of the new paths of its balls."""
        self.hits += sum(answer.kind not in (LED, MISSED) for answer in resolution.answers)
        self.missed += resolution.missed
        for i in resolution.velocity:
            self.velocity[i] = paths[i].vx, paths[i].vy
            self.changed[i] = None


def velocities(motions: Motions) -> dict[int, Vector]:
    """Return the velocities (m/s) of motions."""
    return {i: (vx, vy) for i, (_, _, vx, vy) in motions.items()}
