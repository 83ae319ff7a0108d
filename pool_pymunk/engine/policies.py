"""A policy answers what has no exact answer; variants of a run have other policies.

The engine asks its policy, and does not know which one it is.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from random import Random
from typing import TYPE_CHECKING, NamedTuple

from pool_pymunk.engine.due import Hit
from pool_pymunk.engine.instant import Cluster
from pool_pymunk.engine.recorder import Motions
from pool_pymunk.engine.resolver import Resolver
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.errors import SURE
from pool_pymunk.physics.laws import Slip
from pool_pymunk.physics.motion import EPSILON
from pool_pymunk.physics.path import NOISE

if TYPE_CHECKING:
    from pool_pymunk.engine.contacts import ContactEngine


class Variant(NamedTuple):
    """A variant of a run shows what policies and rounding decide.

    With ``longer``, balls that press on each other count as touching when another hits them.
    """

    longer: float | None = None  # the factor of the contact times
    seed: int | None = None  # of random errors of places and velocities, of the size of rounding
    nudge: int | None = None  # the number of a nudge of the start (solvers/frozen.py)
    slip: Slip | None = None  # of balls whose slip is rounding, where the law jumps

    @property
    def sure(self) -> float:
        """A figure is this many times the change that this variant shows.

        Variants of a slip are all that there are; other variants are some of many.
        """
        return SURE if self.slip is None else 1.0

    def policy(self, resolver: Resolver) -> Policy:
        """Return this variant's policy."""
        errors = RandomErrors(self.seed) if self.nudge is None else Kicks(self.nudge)
        return Policy(errors) if self.longer is None else Otherwise(errors, resolver, self.longer)


AS_IT_IS = Variant()


class RandomErrors:
    """These are random errors of places and velocities, of rounding size; 0 without a seed."""

    size = EPSILON  # of a number

    def __init__(self, seed: int | None = None) -> None:
        self.random = None if seed is None else Random(seed)

    def places(self, motions: Motions, now: float) -> Motions:
        """Return the motions of balls at a contact."""
        if self.random is None:
            return motions
        found = {}
        for i, (x, y, vx, vy) in motions.items():
            late = self._error(now)
            found[i] = x + self._error(x) + vx * late, y + self._error(y) + vy * late, vx, vy
        return found

    def velocity(self, velocity: Vector, noise: float) -> Vector:
        """Return a new velocity (m/s), of which ``noise`` may be rounding."""
        if self.random is None or velocity == (0.0, 0.0):
            return velocity
        fastest, (vx, vy) = noise / NOISE, velocity
        return vx + self._error(fastest), vy + self._error(fastest)

    def _error(self, number: float) -> float:
        """Return a random error of a number."""
        assert self.random is not None, "there is a seed"
        return 0.5 * self.size * number * self.random.uniform(-1.0, 1.0)


class Kicks(RandomErrors):
    """These are larger errors of velocities alone: balls that a hit leaves together part later."""

    size = 1e-12

    def places(self, motions: Motions, now: float) -> Motions:
        return motions


class Policy:
    """This policy is that of the run itself."""

    def __init__(self, errors: RandomErrors) -> None:
        self.errors = errors

    def takes_over(self, engine: ContactEngine, hits: Collection[Hit]) -> bool:
        """Tell whether this policy has an order of its own for these hits."""
        return False

    def closes(self, hit: Hit, now: float) -> bool:
        """Tell whether two balls touch under this policy although they may be apart."""
        return False

    def cluster(self, engine: ContactEngine, hits: Sequence[Hit]) -> Cluster:
        """Return the cluster of all that touches."""
        return Cluster(*engine.contacts(hits, with_gaps=True))


PLAIN = Policy(RandomErrors())


class Otherwise(Policy):
    """Contact times are longer, and persistent pairs have no gap."""

    def __init__(self, errors: RandomErrors, resolver: Resolver, longer: float) -> None:
        super().__init__(errors)
        self.persistent = resolver.persistent
        self.persistent.longer = longer

    def takes_over(self, engine: ContactEngine, hits: Collection[Hit]) -> bool:
        """Tell whether one of these hits strikes a ball that presses on a third one."""
        met, persistent = {hit.balls for hit in hits}, self.persistent
        pairs = [pair for pair in persistent.history if persistent.is_persistent(pair, engine.now)]
        others = {i for pair in pairs if pair not in met for i in pair}
        near = [hit for hit in hits if not others.isdisjoint(hit.balls)]
        return not all(self.closes(hit, engine.now) for hit in near)

    def closes(self, hit: Hit, now: float) -> bool:
        return hit.kind == "pair" and self.persistent.is_persistent((hit.i, hit.j), now)

    def cluster(self, engine: ContactEngine, hits: Sequence[Hit]) -> Cluster:
        cluster = super().cluster(engine, hits)
        cluster.order.forget()
        return cluster
