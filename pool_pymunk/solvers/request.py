"""This module checks the arguments of a run, once for all solvers, and plays the run.

Whatever is wrong is one line that names the argument and shows its value.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.engine.policies import AS_IT_IS, Variant
from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.model.plain import argument, size, whole
from pool_pymunk.model.problems import (
    listed,
    setting_error,
    shown,
    suggestion,
)
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.results.run import SURE, Event, Run, read_times
from pool_pymunk.results.trace import FROZEN, ONE_INSTANT, POCKET, ZERO_SLIP, Trace
from pool_pymunk.solvers.doubts import farthest, warn_of_gained_energy
from pool_pymunk.solvers.frozen import DECIDED, TRIED, opened, touching
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.registry import SOLVERS, find_solver
from pool_pymunk.solvers.settings import NEVER_SETTLES, OnTime, Settings

PATIENCE = 2.0  # s; a run that took longer is not played again to measure its policies


class Request(NamedTuple):
    """A request is a run that is asked for, in plain Python values; ``times`` (s) are sampled."""

    scene: Scene
    solver: Solver
    options: Mapping[str, str]
    settings: Settings
    times: tuple[float, ...] | None = None

    @property
    def law(self) -> str:
        """Return the name of the law that answers; a solver with a law of its own gives its own."""
        if self.solver.own_law:
            return self.solver.name
        return str(self.settings.law_of(self.scene).name)

    def play(self, shot: Shot | None, start: State | None = None) -> Run:
        """Simulate a shot from ``start``; by default from the scene's own, or as the shot says."""
        if start is None and shot is not None and shot.from_previous:
            bounds = self.settings._replace(max_time=self.scene.physics.max_time)
            alone = self._replace(settings=bounds, times=None)
            start = alone.play(shot_before(self.scene, shot)).end
        state = self.scene.start(shot, start)
        self._check_that_it_ends(state)
        measures = self.settings.measures_policies and self.solver.engine
        touch = measures and len(touching(self.scene, state)) > 0
        began = time.perf_counter()
        trace = self._solve(state, touch=touch)
        wall_time = time.perf_counter() - began
        trace.touch = touch and wall_time <= PATIENCE
        shift = self._policy_shift(state, trace, wall_time)
        if not self.solver.own_law and not self.settings.law_of(self.scene).hits_are_coulombs:
            warn_of_gained_energy(trace, self.scene)
        return self._run(shot, state, trace, wall_time, shift)

    def _solve(self, state: State, variant: Variant = AS_IT_IS, touch: bool = True) -> Trace:
        settings = self.settings._replace(touch=touch)
        if variant.opened is not None:
            state = opened(state, touching(self.scene, state), variant.opened)
        if variant != AS_IT_IS:
            settings = settings._replace(variant=variant, on_time=None)
        trace = self.solver.solve(self.scene, state, settings, **self.options)
        trace.cut(settings.most)
        trace.complete(self.scene.surface)
        return trace

    def _policy_shift(self, state: State, trace: Trace, wall_time: float) -> float | None:
        """Warn of how far (m) the ends would lie elsewhere if policies had answered otherwise.

        A run that took long is not played again for it; then the answer is None. Nor is a run that
        only met zero slips, because their warning says what they do.
        """
        is_measured = self.settings.measures_policies and wall_time <= PATIENCE
        self._look_at_frozen(state, trace)
        if not trace.policies:
            return 0.0
        if trace.policies == {ZERO_SLIP} or not is_measured:
            return None
        others = [self._solve(state, variant) for variant in trace.variants]
        changed = SURE * max(farthest(trace, other) for other in others)
        shift = min(changed, self.scene.diagonal)
        said = f"{SURE:g} times what other answers change"
        trace.warn(
            f"the ends may lie up to {shift:.2g} m elsewhere, because some contacts have no exact "
            f"answer ({', '.join(sorted(trace.policies))}): this is "
            f"{said if shift == changed else 'the diagonal of the table'}",
            trace.duration,
        )
        return shift

    def _look_at_frozen(self, state: State, trace: Trace) -> None:
        """Warn if gaps that nobody can measure, between balls that touch, decide the ends."""
        if not trace.touch or ONE_INSTANT in trace.policies:
            return
        others = (self._solve(state, Variant(opened=k)) for k in TRIED)
        if any(farthest(trace, other) > DECIDED for other in others):
            trace.policies.add(FROZEN)
            trace.warn("balls touch at the start, and gaps of 1e-13 m would decide the ends", 0.0)

    def _check_that_it_ends(self, state: State) -> None:
        moves = any(v != (0.0, 0.0) for v in (*state.velocity, *(state.roll or ())))
        if moves and not self.scene.always_rests and self.settings.max_time is None:
            friction = "rolling" if self.scene.surface.rolls else "surface"
            never = "the balls of this start never come to rest"
            message = f"is missing: without {friction} friction {never}"
            raise setting_error("max_time", None, message)

    def _run(
        self,
        shot: Shot | None,
        start: State,
        trace: Trace,
        wall_time: float,
        shift: float | None = None,
    ) -> Run:
        ids = [ball.id for ball in self.scene.balls]
        events = tuple([self._event(ids, *event) for event in trace.events])
        taken = {event.balls[0] for event in events if event.pocket is not None}
        return Run(
            scene=self.scene,
            shot=shot,
            solver=self.solver.name,
            law=self.law,
            dt=self.settings.dt,
            knots=tuple(np.array(knots) for knots in trace.knots),
            events=events,
            status=trace.status,
            duration=trace.duration,
            steps=trace.steps,
            warnings=trace.warnings,
            wall_time=wall_time,
            sample_times=self.times,
            off=start.off | taken,
            policies=frozenset(trace.policies),
            known_shift=shift,
            variants=trace.variants,
            again=partial(self._again, shot, start) if self.solver.engine else None,
            law_used=None if self.solver.own_law else self.settings.law_of(self.scene),
        )

    def _event(
        self, ids: Sequence[str], t: float, kind: str, balls: tuple[int, ...], where: int | None
    ) -> Event:
        """Return the event with the balls' ids, and with the pocket's."""
        names = tuple([ids[i] for i in balls])
        if kind == POCKET and where is not None:
            return Event(t, kind, names, pocket=self.scene.pockets[where].id)
        return Event(t, kind, names, where)

    def _again(
        self, shot: Shot | None, start: State, variant: Variant, most: int | None = None
    ) -> Run:
        """Play a variant of the run, of at most this many events."""
        bounds = self.settings._replace(max_events=min(most or NEVER_SETTLES, self.settings.most))
        trace = self._replace(settings=bounds)._solve(start, variant)
        return self._run(shot, start, trace, 0.0)


def request(
    scene: Scene,
    solver: str,
    *,
    dt: object = None,
    law: str | Law | None = None,
    times: object = None,
    max_time: object = None,
    max_events: object = None,
    on_time: OnTime | None = None,
    **options: Any,
) -> Request:
    """Check what a run is asked for, as :func:`~pool_pymunk.simulate` takes it.

    A solver with steps calls ``on_time`` now and then with the time (s) that it has come to.
    """
    _check_scene(scene)
    method = find_solver(solver)
    _check_options(method, options)
    _check_law(method, law)
    if scene.surface.rolls and not method.rolls:
        others = ", ".join(name for name, other in SOLVERS.items() if other.rolls)
        message = (
            f"balls do not roll by it, and the scene has friction.rolling (by these: {others})"
        )
        raise setting_error("solver", solver, message)
    if isinstance(law, str):
        scene = replace(scene, physics=replace(scene.physics, law=law))
    step, latest = _positive("dt", dt), _positive("max_time", max_time)
    settings = Settings(
        dt=None if method.dt is None else step or method.dt,
        max_time=latest or scene.physics.max_time,
        max_events=None if max_events is None else argument("max_events", max_events, whole(1)),
        law=law if isinstance(law, Law) else None,
        on_time=on_time,
    )
    return Request(scene, method, options, settings, None if times is None else sample_times(times))


def find_shot(scene: Scene, shot: Shot | str | int | None) -> Shot | None:
    """Return the scene's shot of that name or number (from 1), or this one; None: the first."""
    _check_scene(scene)
    if shot is None:
        return scene.shots[0] if scene.shots else None
    number = shot if isinstance(shot, Integral) and not isinstance(shot, bool) else None
    if number is None and not isinstance(shot, Shot | str):
        raise setting_error("shot", shot, "must be a Shot, a name or a number from 1")
    if number is not None and number < 1:
        raise setting_error("shot", shot, "shots count from 1")
    for k, each in enumerate(scene.shots, start=1):
        if shot in (each, each.name) or number == k:
            return each
    meant = suggestion(shot, [each.name for each in scene.shots])
    known = listed([f"{k} ({each.name})" for k, each in enumerate(scene.shots, start=1)]) or "none"
    raise setting_error("shot", shot, f"there is no such shot (there are: {known}){meant}")


def shot_before(scene: Scene, shot: Shot) -> Shot | None:
    """Return the shot that this one goes on from, if it does."""
    return scene.shots[scene.shots.index(shot) - 1] if shot.from_previous else None


def sample_times(times: object) -> tuple[float, ...]:
    """Read the times (s) at which a run is to be sampled."""
    found = read_times(times)
    if found.ndim != 1:
        raise setting_error("times", shown(times), "must be a sequence of numbers")
    return tuple(found.tolist())


def _check_scene(scene: Scene) -> None:
    if not isinstance(scene, Scene):
        raise setting_error("scene", scene, "must be a Scene, such as load() gives")


def _check_options(method: Solver, options: Mapping[str, object]) -> None:
    for name, value in options.items():
        if name not in method.options:
            known = ", ".join(method.options) or "it has none"
            raise setting_error(name, value, f"{method.name} has no such option ({known})")
        if not isinstance(value, str) or value not in method.options[name]:
            raise setting_error(name, value, f"must be one of {', '.join(method.options[name])}")


def _check_law(method: Solver, law: str | Law | None) -> None:
    if law is None:
        return
    if isinstance(law, type) and issubclass(law, Law):
        raise setting_error("law", law.__name__, f"is a class; an object is {law.__name__}()")
    if not isinstance(law, Law) and not (isinstance(law, str) and law in LAWS):
        message = f"must be one of {', '.join(LAWS)}, or an object of the class Law"
        raise setting_error("law", law, message + suggestion(law, LAWS))
    if method.own_law:
        name = law.name if isinstance(law, Law) else law
        message = f"{method.name} has a law of its own and cannot take another"
        raise setting_error("law", name, message)


def _positive(key: str, value: object) -> float | None:
    """Read a positive number of seconds."""
    return None if value is None else argument(key, value, size)
