"""This module has what solvers share: settings, the record of what one can do, and steps."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, NamedTuple

from pool_pymunk.core.persistent.scale import TOLERANCE
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.model import Point, Scene, State
from pool_pymunk.results.trace import NEVER_SETTLES, Trace
from pool_pymunk.results.variants import AS_IT_IS, Variant
from pool_pymunk.results.words import step_text

# m; at it, the scenes with known ends (tests/data/press.json) are within 1e-6 m, and a soft break
# has some 500 events. `pool-pymunk tradeoff SCENARIO --contact-tolerance ...` measures others.
CONTACT_TOLERANCE = TOLERANCE

OnTime = Callable[[float], object]
Steps = tuple[float, ...]  # s, from coarse to fine


class Settings(NamedTuple):
    """The settings hold the time step, the bounds of a run, and its law.

    The step ``dt`` is in s, and None for solvers without one. By default the scene's law answers
    the contacts. A solver with steps calls ``on_time`` now and then with its present time (s).
    Solvers with the contact engine play a ``variant``, which shows what depends on policies.
    ``measures_policies`` tells whether a run measures this by playing variants. What is left out at
    a contact that persists, and one piece of its motion, may move a ball by the
    ``contact_tolerance`` (m), if the solver plays to one.
    """

    dt: float | None
    max_time: float | None = None
    max_events: int = NEVER_SETTLES
    law: Law | None = None
    on_time: OnTime | None = None
    variant: Variant = AS_IT_IS
    measures_policies: bool = True
    contact_tolerance: float = CONTACT_TOLERANCE

    def law_of(self, scene: Scene) -> Law:
        """Return the law that answers every contact of the run."""
        return self.law or LAWS[scene.physics.law]


@dataclass(frozen=True)
class InFile:
    """This is the function ``solve`` of a file in this folder, which is imported when it is due."""

    name: str

    def load(self) -> Callable[..., Trace]:
        """Import the file, and return its function."""
        solve: Callable[..., Trace] = import_module(f"pool_pymunk.solvers.{self.name}").solve
        return solve

    def __call__(self, *run: Any, **options: str) -> Trace:
        return self.load()(*run, **options)


@dataclass(frozen=True, kw_only=True)
class Solver:
    """A solver's record says what the solver can do.

    Raises ValueError for a record that contradicts itself.
    """

    name: str
    solve: Callable[..., Trace]  # of a Scene, the State to start from, Settings and the options
    about: str  # It says in a few words what the solver is.
    dt: float | None  # s; the default step. None: the solver has no step.
    options: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # The default comes first.

    # How good it is
    exact: bool = False  # It errs by rounding alone.
    late: bool = False  # It answers contacts at the end of a step, so up to a step late.
    own_law: bool = False  # It does not use the scene's contact law.
    rolls: bool = False  # It plays scenes in which balls roll.
    patches: bool = False  # It plays scenes that have patches.
    tilts: bool = False  # It plays scenes whose balls fall.
    to_tolerance: bool = False  # It plays contacts that persist as exactly as a tolerance asks.
    engine: bool = False  # It has the contact engine, so it can play variants of a run.
    limits: str = ""  # It says why the method must break at extremes. Empty: it must not break.

    # How it is measured
    ladder: Steps = ()  # for the work-precision diagram. Empty: ``dt`` alone.
    stability_steps: Steps = ()  # for the stability check. Empty: ``dt`` alone.
    quick_stability_steps: Steps = ()  # for its quick form. Empty: ``stability_steps``.
    all_pairs: bool = False  # It looks at all pairs of balls one by one: many balls take long.
    published_step: float | None = None  # s; the report's own. None: it is not the report's method.

    # How its step is chosen by a tolerance
    finest: float | None = None  # s; the finest step worth trying. None: none can be chosen.
    no_tolerance: str = "its record names no finest step, so no tolerance can be asked of it"

    # How its line in diagrams looks, as matplotlib names colours and markers
    color: str = "#cc79a7"  # Those in use are Okabe and Ito's, distinguished by the colour-blind.
    marker: str = "o"  # It tells the line apart in grey.

    def __post_init__(self) -> None:
        if self.exact and self.late:
            raise ValueError(f"solver {self.name}: it cannot be exact where its contacts are late")
        steps = self.ladder + self.stability_steps + self.quick_stability_steps
        if self.dt is None and (self.late or self.finest or steps):
            raise ValueError(f"solver {self.name}: it has no step, but its record speaks of steps")

    def load(self) -> None:
        """Import the solver's file, if that is not done yet: no run's time has this in it."""
        if isinstance(self.solve, InFile):
            self.solve.load()

    def plays(self, scene: Scene) -> bool:
        """Tell whether it plays all that a scene has."""
        plays_motion = self.rolls or not scene.surface.rolls
        plays_ground = (self.patches or not scene.patches) and (self.tilts or not scene.is_tilted)
        return plays_motion and plays_ground

    @property
    def is_reference(self) -> bool:
        """Tell whether it is exact and has no step, so that the others are compared with it."""
        return self.exact and self.dt is None


class Stepping(ABC):
    """This is a run in steps of ``dt`` (s); ``moving`` are the numbers of the balls that move."""

    moving: Collection[int]

    def __init__(self, scene: Scene, start: State, dt: float | None) -> None:
        assert dt is not None, "the solver's record has a step"
        self.scene, self.dt = scene, dt
        self.trace = Trace(start)
        self.is_finite = True  # whether what moves is still at finite places

    @property
    def time(self) -> float:
        """The time (s) after the steps that were made."""
        return self.trace.steps * self.dt

    @abstractmethod
    def advance(self, most: float) -> None:
        """Make at least one step, and at most this many; count them in the trace."""

    def cut_off(self) -> None:
        """Write down where the balls are that still move when the run ends."""
        return

    def pocketed(self, i: int, x: float, y: float, vx: float, vy: float) -> Point | None:
        """List it if a pocket takes ball ``i`` in, and return the pocket's centre, or else None."""
        for number, pocket in enumerate(self.scene.pockets):
            if math.dist((x, y), pocket.position) <= pocket.radius:
                self.trace.pocketed(i, number, self.time, (x, y, vx, vy), pocket.position)
                return pocket.position
        return None

    def play(self, settings: Settings) -> Trace:
        """Make steps until every ball rests, or up to the bounds that the settings have."""
        trace, longest = self.trace, settings.max_time
        last = math.inf if longest is None else math.ceil(longest / self.dt)
        while self.moving:
            if trace.steps >= last or len(trace.events) >= settings.max_events:
                trace.status = "max_time" if trace.steps >= last else "max_events"
                trace.duration = self.time
                self.cut_off()
                break
            self.advance(last - trace.steps)
            if settings.on_time is not None:
                settings.on_time(self.time)
            if not self.is_finite:
                trace.status, trace.duration = "non_finite", self.time
                break
        self._warn_of_long_steps()
        return trace

    def _warn_of_long_steps(self) -> None:
        """Warn if a ball moved farther than its radius in one step, once and of the farthest."""
        units, each = self.scene.units, zip(self.scene.balls, self.trace.knots, strict=True)
        moves = (
            (math.hypot(*row[3:5]) * self.dt, row[0], ball) for ball, rows in each for row in rows
        )
        far, t, ball = max(moves, key=lambda move: move[0] / move[2].radius)
        if far > ball.radius:
            self.trace.warn(
                f"a step of {step_text(self.dt)} moves ball {ball.id} by up to "
                f"{units.text(far, '.3g')}, farther than its radius "
                f"({units.text(ball.radius, '.3g')}), so it may pass what it should meet",
                t,
            )
