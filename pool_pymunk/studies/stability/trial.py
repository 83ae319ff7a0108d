"""A trial gives one extreme scene to one solver, and has the reference run to measure it by."""

from __future__ import annotations

import math
import random
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from pool_pymunk.core.motion.times import EPSILON
from pool_pymunk.many.workers import check_halt
from pool_pymunk.model import Scene, State
from pool_pymunk.model.arrays import Array
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import (
    Solver,
    find_shot,
    find_solver,
    reference_solver,
    request,
    simulate,
)
from pool_pymunk.studies.compare import Comparison, contacts

# Starts are nudged NUDGES times to measure amplification. A nudge is this share of the smallest
# radius, or LEAST_NUDGE if that is more. It counts until it has grown to LINEAR radii.
NUDGE, LEAST_NUDGE, NUDGES, LINEAR = 1e-9, 64.0 * EPSILON, 3, 1e-3
ENOUGH = 2000  # A nudged run has this many events at most; no nudge stays small for longer.
# Runs are compared at GRID times, and invariants are checked at SAMPLES contacts, too; chosen.
GRID, SAMPLES = 200, 400
# The table lists breaks under these laws. Tests play the rows under others (test_law_everywhere).
LISTED = ("coulomb", "published")


class Measure(NamedTuple):
    """A measure has a value, a ``bound`` that it must not pass, and a ``size``: there all is wrong.

    All three are in ``unit``; ``words`` say what is wrong if the value passes the bound.
    """

    claim: str
    value: float
    bound: float
    size: float = 1.0
    unit: str = ""
    words: str = "{}"

    @property
    def holds(self) -> bool:
        return self.value <= self.bound

    @property
    def severity(self) -> float:
        """Return how bad it is: 0 where it holds, 1 and more where it is all wrong."""
        return 0.0 if self.holds else self.value / self.size

    def __str__(self) -> str:
        return self.words.format(f"{self.value:.2g} {self.unit}".rstrip())


def wrong(claim: str, words: str, is_so: bool = True) -> Measure:
    """Return the measure of a claim that holds or does not hold."""
    return Measure(claim, float(is_so), 0.0, words=words)


@dataclass(frozen=True)
class Case:
    """A case is one scene of an extreme, and what must hold of it.

    ``ends`` is the status that it must end with ("": ``max_time`` where the scene has one, else
    ``settled``). ``claims`` are those that hold for this case beyond those that always hold.
    ``slow`` cases are left out of the quick form.
    """

    label: str
    scene: Scene
    claims: tuple[Claim, ...] = ()
    max_events: int = 50_000
    ends: str = ""
    slow: bool = False


@dataclass(frozen=True)
class Extreme:
    """An extreme is a row of the table: its cases run from mild to extreme.

    ``steps`` (s) replace the solvers' usual ones. ``because`` says why its law must fail.
    """

    name: str
    about: str
    cases: Callable[[], Iterator[Case]]
    laws: tuple[str, ...] = LISTED
    steps: tuple[float, ...] = ()
    because: str = ""


@dataclass(frozen=True)
class Trial:
    """A trial is a case under a law, for one solver and time step (s)."""

    case: Case
    law: str
    solver: str
    dt: float | None

    @property
    def method(self) -> Solver:
        """Return the solver's record."""
        return find_solver(self.solver)

    @property
    def is_reference(self) -> bool:
        """Tell whether the run is the reference run itself."""
        return self.solver == reference_solver().name

    @cached_property
    def scene(self) -> Scene:
        """Return the case's scene, under the law."""
        scene = self.case.scene
        return replace(scene, physics=replace(scene.physics, law=self.law))

    def of(self, scene: Scene) -> Trial:
        """Return the same trial of another scene."""
        return replace(self, case=replace(self.case, scene=scene))

    @cached_property
    def reference(self) -> ReferenceRun:
        """Return the reference run, and how far it can be relied on."""
        return reference_of(self.scene, self.case.max_events)

    @property
    def exact(self) -> ReferenceRun:
        """Return ``reference``, of which this is the old name."""
        warnings.warn("Trial.exact is now Trial.reference", DeprecationWarning, stacklevel=2)
        return self.reference

    @property
    def is_exact_run(self) -> bool:
        """Return ``is_reference``, of which this is the old name."""
        warnings.warn("is_exact_run is now is_reference", DeprecationWarning, stacklevel=2)
        return self.is_reference

    @cached_property
    def run(self) -> Run:
        """Return the run that is measured."""
        return self.reference.run if self.is_reference else self.simulate(self.scene)

    def simulate(self, scene: Scene, start: State | None = None) -> Run:
        """Run a scene with bounds on events and time, because a solver may never come to rest."""
        play = partial(simulate, scene, solver=self.solver, start=start, on_time=_look_up)
        if self.is_reference:
            return play(max_events=self.case.max_events)
        reference = self.reference.run
        most = min(10 * len(contacts(reference)) + 1000, self.case.max_events)
        latest = scene.physics.max_time or 4.0 * reference.duration + 10.0 * (self.dt or 0.0)
        return play(dt=self.dt, max_events=most, max_time=latest)

    @cached_property
    def contacts(self) -> int:
        """Return how many contacts the run has."""
        return len(contacts(self.run))

    @cached_property
    def times(self) -> Array:
        """Return the times (s) to look at the run: at contacts, and between them."""
        events = np.unique([event.t for event in self.run.events])
        thin = events[:: len(events) // SAMPLES + 1]
        return np.unique(np.concatenate([[0.0], thin, grid(self.run.duration)]))

    @cached_property
    def radii(self) -> Array:
        """The radii (N,) in m."""
        return np.array([ball.radius for ball in self.scene.balls])

    @cached_property
    def smallest(self) -> float:
        """The smallest radius (m)."""
        return float(self.radii.min())

    @cached_property
    def fastest(self) -> float:
        """The largest speed (m/s) at the start."""
        return max(math.hypot(*ball.velocity) for ball in self.scene.balls)

    @property
    def late(self) -> float:
        """Return how far (m) the fastest ball travels in the time by which contacts are late."""
        return self.fastest * self.dt if self.dt and self.method.late else 0.0

    @property
    def rounding(self) -> float:
        """The spacing (m) of floating-point numbers where the balls are."""
        return EPSILON * self.reference.extent


Claim = Callable[[Trial], Measure | None]


@dataclass(frozen=True)
class ReferenceRun:
    """This is the reference run of a scene, and the scene's amplification of its input.

    ``growth`` (T,) is the distance (m) of two runs over the relative difference of their starts:
    of places to the largest coordinate, ``extent`` (m), and of velocities to the speeds. ``times``
    (T,) are those at which runs are compared, while growth is still proportional to the nudge.
    """

    run: Run
    times: Array
    growth: Array
    extent: float


@lru_cache(maxsize=128)
def reference_of(scene: Scene, max_events: int) -> ReferenceRun:
    """Return the reference run, and nudge what moves at the start to measure amplification."""
    asked = request(scene, max_events=max_events, on_time=_look_up)
    run = asked.play(find_shot(scene, None))
    radii = [ball.radius for ball in scene.balls]
    outline = max(map(abs, scene.table.bounds)) if scene.table else 0.0
    extent = max(*radii, outline, *(float(np.abs(each[:, 1:3]).max()) for each in run.knots))
    nudge = max(NUDGE * min(radii) / extent, LEAST_NUDGE)
    times = grid(run.duration)
    growth = np.zeros(len(times))
    settings = asked.settings._replace(max_events=min(max_events, ENOUGH), measures_policies=False)
    for seed in range(NUDGES):
        start = _nudged(scene, nudge, extent, random.Random(seed))
        other = asked._replace(scene=start, settings=settings).play(find_shot(start, None))
        if other.status == "max_events":
            times = times[times <= other.duration]
        growth = np.maximum(growth[: len(times)], Comparison(run, other).apart(times))
    growth = np.maximum.accumulate(growth)
    linear = growth <= LINEAR * min(radii)
    return ReferenceRun(run, times[linear], growth[linear] / nudge, extent)


def _look_up(_: float) -> None:
    """End the run if nobody waits for it any more."""
    check_halt()


def grid(duration: float) -> Array:
    """Return times (s) from the start to the end, evenly."""
    return np.linspace(0.0, duration, GRID + 1)


def _nudged(scene: Scene, nudge: float, extent: float, rng: random.Random) -> Scene:
    """Return the scene with everything that moves at the start moved by a relative ``nudge``."""
    balls = []
    for ball in scene.balls:
        if ball.velocity != (0.0, 0.0):
            (x, y), (vx, vy) = ball.position, ball.velocity
            dx, dy, turn, faster = (nudge * rng.uniform(-1.0, 1.0) for _ in range(4))
            velocity = (vx * (1.0 + faster) - vy * turn, vy * (1.0 + faster) + vx * turn)
            ball = replace(ball, position=(x + extent * dx, y + extent * dy), velocity=velocity)
        balls.append(ball)
    return replace(scene, balls=tuple(balls))
