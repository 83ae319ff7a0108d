"""The solvers, one file each, and :func:`simulate`, which calls them by name.

A solver is a function of a scene, the state to start from and :class:`Settings`; it returns the
:class:`~pool_pymunk.results.trace.Trace` that it kept. Beside it, its :class:`Solver` record says
what it can do, and that is all that studies, diagrams and the command line know of it. So adding
one is a file with its record, and its place in ``SOLVERS``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.results.run import Event, Run
from pool_pymunk.results.trace import Trace
from pool_pymunk.solvers import event_driven, pymunk_builtin, pymunk_space, time_slice
from pool_pymunk.solvers.record import Solver
from pool_pymunk.solvers.settings import Settings

SOLVERS: dict[str, Solver] = {
    solver.name: solver
    for solver in (
        pymunk_space.SWEPT,
        pymunk_space.DISCRETE,
        pymunk_builtin.SOLVER,
        event_driven.SOLVER,
        time_slice.SOLVER,
    )
}


class SettingError(ValueError):
    """A solver, shot or time step that does not exist or makes no sense."""

    __module__ = "pool_pymunk"


def simulate(
    scene: Scene,
    shot: Shot | str | int | None = None,
    *,
    solver: str = "pymunk",
    dt: float | None = None,
    law: str | Law | None = None,
    times: Sequence[float] | None = None,
    start: State | None = None,
    max_time: float | None = None,
    max_events: int | None = None,
    **options: Any,
) -> Run:
    """Simulate one shot of a scene.

    ``shot`` is a Shot of the scene, its name or its number from 0; without one, the first shot, or
    the scene as its velocities have it where it has no shots. ``dt`` (s) is the solver's step,
    ``law`` the contact law, by name or one of your own (:class:`~pool_pymunk.Law`; default: the
    scene's); every contact of every solver is answered by it, but for ``pymunk-builtin``.
    ``times`` (s) where to sample the Run, ``start`` the state before the shot (default: the
    scene's own, or where the shot before ended if the shot goes on from there). ``max_time`` (s;
    default: the scene's) and ``max_events`` bound the run. The pymunk solvers take the options
    ``contacts`` ("swept" or "discrete") and ``friction`` ("joint" or "callback").

    >>> from pool_pymunk import load
    >>> run = simulate(load("report"), "Simulation 3", solver="pymunk", dt=1/240)
    >>> run.status, [event.kind for event in run.events]
    ('settled', ['ball-cushion', 'stop'])

    Raises :class:`SettingError` for an unknown solver or shot, or a step that is not positive.
    """
    chosen = find_shot(scene, shot)
    method = find_solver(solver)
    step = _step(method, dt)
    _check_options(solver, method, options)
    _check_law(solver, method, law)
    if isinstance(law, str):
        scene = replace(scene, physics=replace(scene.physics, law=law))
    own = law if isinstance(law, Law) else None
    before = _before(scene, chosen) if chosen else None
    if start is None and before is not None:
        start = simulate(
            scene, before, solver=solver, dt=dt, law=own, max_events=max_events, **options
        ).end
    settings = Settings(step, max_time or scene.physics.max_time, max_events, own)
    state = scene.start(chosen, start)
    began = time.perf_counter()
    trace = method.solve(scene, state, settings, **options)
    return _run(scene, chosen, trace, solver, step, time.perf_counter() - began, times)


def simulate_all(
    scene: Scene,
    shots: Sequence[Shot | None] | None = None,
    *,
    solver: str = "pymunk",
    dt: float | None = None,
    max_events: int | None = None,
) -> Iterator[Run]:
    """Simulate several shots (default: all of the scene), each Run as soon as it is there."""
    last: Run | None = None
    for shot in shots if shots is not None else scene.shots or (None,):
        goes_on = last and shot and shot.from_previous and last.shot is _before(scene, shot)
        start = last.end if last and goes_on else None
        last = simulate(scene, shot, solver=solver, dt=dt, start=start, max_events=max_events)
        yield last


def _before(scene: Scene, shot: Shot) -> Shot | None:
    """The shot that this one goes on from, if it does."""
    return scene.shots[scene.shots.index(shot) - 1] if shot.from_previous else None


def find_solver(name: str) -> Solver:
    """The solver of that name."""
    if name not in SOLVERS:
        raise SettingError(f"solver = {name}: there is no such solver ({', '.join(SOLVERS)})")
    return SOLVERS[name]


def yardstick() -> Solver:
    """The exact solver without a step, by which the others are measured."""
    return next(solver for solver in SOLVERS.values() if solver.is_yardstick)


def find_shot(scene: Scene, shot: Shot | str | int | None) -> Shot | None:
    """The shot of that name or number (from 0)."""
    if isinstance(shot, Shot):
        return shot
    if shot is None:
        return scene.shots[0] if scene.shots else None
    for k, candidate in enumerate(scene.shots):
        if shot in (k, candidate.name):
            return candidate
    names = ", ".join(candidate.name for candidate in scene.shots) or "none"
    raise SettingError(f"shot = {shot}: there is no such shot ({names})")


def _check_options(solver: str, method: Solver, options: Mapping[str, str]) -> None:
    for name, value in options.items():
        if name not in method.options:
            known = ", ".join(method.options) or "it has none"
            raise SettingError(f"{name} = {value}: {solver} has no such option ({known})")
        if value not in method.options[name]:
            known = ", ".join(method.options[name])
            raise SettingError(f"{name} = {value}: must be one of {known}")


def _check_law(solver: str, method: Solver, law: str | Law | None) -> None:
    if law is None:
        return
    name = law.name if isinstance(law, Law) else law
    if method.own_law:
        raise SettingError(f"law = {name}: {solver} has a law of its own and cannot take another")
    if not isinstance(law, Law) and law not in LAWS:
        known = ", ".join(LAWS)
        raise SettingError(f"law = {law}: must be one of {known}, or an object of the class Law")


def _step(method: Solver, dt: float | None) -> float | None:
    if method.dt is None or dt is None:
        return method.dt
    if not (dt > 0.0 and math.isfinite(dt)):
        raise SettingError(f"dt = {dt}: must be a positive number of seconds")
    return float(dt)


def _run(
    scene: Scene,
    shot: Shot | None,
    trace: Trace,
    solver: str,
    dt: float | None,
    wall_time: float,
    times: Sequence[float] | None,
) -> Run:
    ids = [ball.id for ball in scene.balls]
    events = tuple(
        Event(t, kind, tuple(ids[i] for i in balls), cushion)
        for t, kind, balls, cushion in sorted(trace.events, key=lambda event: event[0])
    )
    return Run(
        scene=scene,
        shot=shot,
        solver=solver,
        dt=dt,
        knots=tuple(np.array(knots) for knots in trace.knots),
        events=events,
        status=trace.status,
        duration=trace.duration,
        steps=trace.steps,
        warnings=trace.warnings,
        wall_time=wall_time,
        sample_times=None if times is None else tuple(times),
    )


__all__ = [
    "SOLVERS",
    "SettingError",
    "Settings",
    "Solver",
    "find_shot",
    "find_solver",
    "simulate",
    "simulate_all",
    "yardstick",
]
