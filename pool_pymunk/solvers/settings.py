"""This module defines the settings that every solver gets, and the form that all solvers share."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

from pool_pymunk.engine.policies import AS_IT_IS, Variant
from pool_pymunk.model import Scene, State
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.results.trace import Trace

# After this many events a run is given up, unless the user says otherwise. After this many
# instants of micro-collisions, which are no events, it is given up as well.
NEVER_SETTLES = 1_000_000

OnTime = Callable[[float], object]


class Settings(NamedTuple):
    """The settings hold the time step, the bounds of a run, and its law.

    The step ``dt`` is in s, and None for solvers without one. Without a ``law``, the law that the
    scene names answers the contacts. A solver with steps calls ``on_time`` now and then with the
    time (s) that it has come to. ``variant`` is for solvers with the contact engine: it shows what
    depends on their policies. A run that used one ``measures_policies`` by a variant. ``touch`` is
    False if nothing touches at the start.
    """

    dt: float | None
    max_time: float | None = None
    max_events: int | None = None
    law: Law | None = None
    on_time: OnTime | None = None
    variant: Variant = AS_IT_IS
    measures_policies: bool = True
    touch: bool = True

    def law_of(self, scene: Scene) -> Law:
        """Return the law that answers every contact of the run."""
        return self.law or LAWS[scene.physics.law]

    @property
    def most(self) -> int:
        """Return the number of events after which the run is given up."""
        return NEVER_SETTLES if self.max_events is None else self.max_events

    @property
    def most_unlisted(self) -> int:
        """Return the number of instants without an event after which the run is given up."""
        return NEVER_SETTLES


class Solve(Protocol):
    """Every solver is a function of this form."""

    def __call__(self, scene: Scene, start: State, settings: Settings) -> Trace: ...
