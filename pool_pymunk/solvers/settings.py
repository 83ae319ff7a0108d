"""What a solver is told beside the scene, and the form all solvers share."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from pool_pymunk.result import Trace
from pool_pymunk.scene import Scene, State

NEVER_SETTLES = 1_000_000  # contacts after which a run is given up, unless the user says otherwise


class Settings(NamedTuple):
    """Time step (s; None for solvers without one) and the bounds of a run."""

    dt: float | None
    max_time: float | None = None
    max_events: int | None = None


class Solve(Protocol):
    """Every solver's form."""

    def __call__(self, scene: Scene, start: State, settings: Settings) -> Trace: ...


def slip_warning(a: str, b: str) -> str:
    """What users are told where the law `published` meets a slip that is only rounding."""
    return (
        f"law published jumps at zero slip: in the head-on hit of balls {a} and {b} the slip was "
        "below 1e-9 of the closing speed and was taken for zero (no friction); rounding would have "
        "decided"
    )


def sign_warning(a: str, b: str, slip: float) -> str:
    """What users are told where the listing's arithmetic lets rounding decide."""
    return (
        f"law published jumps at zero slip: in the head-on hit of balls {a} and {b} the slip was "
        f"{slip:.0e} m/s, a rounding error, and its sign decided, as in the report"
    )
