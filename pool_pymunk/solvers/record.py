"""The record of a solver says all that the studies and the command line know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from pool_pymunk.solvers.settings import Solve

Steps = tuple[float, ...]  # s, from coarse to fine


@dataclass(frozen=True, kw_only=True)
class Solver:
    """A solver's record says what the solver can do with its default options.

    A fact that a record leaves out does not hold. Raises ValueError for a record that contradicts
    itself.
    """

    name: str
    solve: Solve  # It is the solver's function.
    about: str  # It says in a few words what the solver is.
    dt: float | None  # s; the default step. None: the solver has no step.
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # The default comes first.

    # How good it is
    exact: bool = False  # It errs by rounding alone.
    late: bool = False  # It answers contacts at the end of a step, so up to a step late.
    own_law: bool = False  # It does not use the scene's contact law.
    rolls: bool = False  # It plays scenes in which balls roll.
    engine: bool = False  # It has the contact engine, so it can play variants of a run.
    limits: str = ""  # It says why the method must break at extremes. Empty: it must not break.

    # How it is measured
    ladder: Steps = ()  # These are the work-precision diagram's. Empty: ``dt`` alone.
    stability_steps: Steps = ()  # These are the stability check's. Empty: ``dt`` alone.
    quick_stability_steps: Steps = ()  # These are its quick form's. Empty: ``stability_steps``.
    all_pairs: bool = False  # It looks at all pairs of balls one by one: many balls take long.
    published_step: float | None = None  # s; the report's own. None: it is not the report's method.

    # How its step is chosen by a tolerance
    finest: float | None = None  # s; the finest step worth trying. None: none can be chosen.
    no_tolerance: str = "its record names no finest step, so no tolerance can be asked of it"

    # How its line in diagrams looks, as matplotlib names colours and markers
    color: str = "#cc79a7"  # Those in use are Okabe and Ito's, told apart by the colour-blind.
    marker: str = "o"  # It tells the line apart in grey.

    def __post_init__(self) -> None:
        if self.exact and self.late:
            raise ValueError(f"solver {self.name}: it cannot be exact where its contacts are late")
        steps = self.ladder + self.stability_steps + self.quick_stability_steps
        if self.dt is None and (self.late or self.finest or steps):
            raise ValueError(f"solver {self.name}: it has no step, but its record speaks of steps")

    @property
    def is_yardstick(self) -> bool:
        """Tell whether it is exact and has no step, so that the others can be measured by it."""
        return self.exact and self.dt is None
