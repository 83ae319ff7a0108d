"""Random clusters of discs at one instant, and what the core makes of them."""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from pool_pymunk.laws import LAWS, Law
from pool_pymunk.laws.contact import NO_BALL, Contact, Pair, Vector, closing_speed
from tests.shared.core_clusters import answered_in_core

ROUNDING = 1e-13  # This is for some hundred operations on numbers of the size of the speeds.


class Cluster(NamedTuple):
    """A cluster is discs of diameter 1 that contact each other and cushions, and move."""

    masses: list[float]
    contacts: list[Contact]
    velocity: dict[int, Vector]

    def closing(self) -> list[Contact]:
        return [
            contact for contact in self.contacts if closing_speed(contact, self.velocity) > 1e-9
        ]


def random_cluster(seed: int, widest: float = 3.0) -> Cluster:
    """Return two to twelve discs on a lattice or anywhere, masses over ``widest`` decades."""
    rnd = random.Random(seed)
    places = [(0.0, 0.0)]
    on_lattice = rnd.random() < 0.6
    while len(places) < rnd.randint(2, 12):
        x, y = rnd.choice(places)
        angle = rnd.randrange(6) * math.pi / 3 if on_lattice else rnd.uniform(0, 2 * math.pi)
        place = (x + math.cos(angle), y + math.sin(angle))
        if all(math.dist(place, other) > 1 - 1e-9 for other in places):
            places.append(place)
    masses = [10 ** rnd.uniform(-1, widest - 1) for _ in places]
    e, mu = rnd.choice([0.0, 0.5, 0.9, 1.0]), rnd.choice([0.0, 0.1, 1.0])
    contacts = []
    for i, (x, y) in enumerate(places):
        for j in range(i + 1, len(places)):
            nx, ny = places[j][0] - x, places[j][1] - y
            if abs(math.hypot(nx, ny) - 1) < 1e-9:
                pair, point = Pair(masses[i], masses[j], e, mu), (x + nx / 2, y + ny / 2)
                contacts.append(Contact(i, j, (nx, ny), pair, None, point))
        for cushion in range(rnd.choice([0, 0, 0, 1, 2])):
            turn = rnd.choice([0.0, math.pi / 2, rnd.uniform(0, 6.28)])
            normal = (math.cos(turn), math.sin(turn))
            point = (x - normal[0] / 2, y - normal[1] / 2)
            pair = Pair(masses[i], math.inf, e, mu)
            contacts.append(Contact(i, NO_BALL, normal, pair, cushion, point))
    velocity = {i: (rnd.gauss(0, 1), rnd.gauss(0, 1)) for i in range(len(places))}
    return Cluster(masses, contacts, velocity)


def energy(masses: Sequence[float], velocity: Mapping[int, Vector]) -> float:
    return sum(m * (velocity[i][0] ** 2 + velocity[i][1] ** 2) for i, m in enumerate(masses))


def answered(
    contacts: Sequence[Contact], velocity: Mapping[int, Vector], law: Law = LAWS["coulomb"]
) -> dict[int, Vector]:
    """Return the velocities after contacts of one instant."""
    return answered_in_core(contacts, velocity, law)
