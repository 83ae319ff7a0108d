"""What a solver is told beside the scene, and the form that all solvers share."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from pool_pymunk.model import Scene, State
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.results.trace import Trace

NEVER_SETTLES = 1_000_000  # contacts after which a run is given up, unless the user says otherwise


class Settings(NamedTuple):
    """The time step (s; None for solvers without one), the bounds of a run, and its law.

    Without a ``law`` the scene's own, which it knows by name, answers the contacts.
    """

    dt: float | None
    max_time: float | None = None
    max_events: int | None = None
    law: Law | None = None

    def law_of(self, scene: Scene) -> Law:
        """The law that answers every contact of the run."""
        return self.law or LAWS[scene.physics.law]

    @property
    def most(self) -> int:
        """After how many events the run is given up."""
        return NEVER_SETTLES if self.max_events is None else self.max_events


class Solve(Protocol):
    """Every solver's form."""

    def __call__(self, scene: Scene, start: State, settings: Settings) -> Trace: ...
