"""The solvers, one file each, and :func:`simulate`, which calls them by name.

A solver is a function of a scene, the state to start from and :class:`Settings`; it returns the
:class:`~pool_pymunk.results.trace.Trace` that it kept. Its :class:`Solver` record stands in
:mod:`pool_pymunk.solvers.registry`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from typing import Any

from pool_pymunk.laws import Law
from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.model import SettingError as SettingError
from pool_pymunk.model.arrays import Array
from pool_pymunk.results.run import Run
from pool_pymunk.solvers.record import OnTime
from pool_pymunk.solvers.record import Settings as Settings
from pool_pymunk.solvers.record import Solver as Solver
from pool_pymunk.solvers.request import SOLVERS as SOLVERS
from pool_pymunk.solvers.request import find_shot as find_shot
from pool_pymunk.solvers.request import find_solver as find_solver
from pool_pymunk.solvers.request import options_for as options_for
from pool_pymunk.solvers.request import reference_solver as reference_solver
from pool_pymunk.solvers.request import request as request
from pool_pymunk.solvers.request import shot_before


def simulate(
    scene: Scene,
    shot: Shot | str | int | None = None,
    *,
    solver: str = "pymunk",
    dt: float | None = None,
    law: str | Law | None = None,
    times: Sequence[float] | Array | None = None,
    start: State | Sequence[Any] | Array | None = None,
    max_time: float | None = None,
    max_events: int | None = None,
    contact_tolerance: float | None = None,
    compiled: bool = True,
    **options: Any,
) -> Run:
    """Simulate one shot of a scene.

    ``shot`` is a Shot of the scene, its name or its number from 1; by default the first shot, or in
    a scene without shots the balls' own velocities. ``dt`` (s) is the solver's step, if it has one;
    ``times`` (s) are those at which to sample the Run. The contact ``law``, by name or
    one of your own (:class:`~pool_pymunk.Law`; default: the scene's), answers every contact of
    every solver except ``pymunk-builtin``. ``start`` is the state before the shot, a
    :class:`~pool_pymunk.State` or positions and velocities (default: the scene's own, or where the
    shot before ended if the shot goes on from there). ``max_time`` (s; default: the scene's) and
    ``max_events`` bound the run; the latter counts ``Run.events``, stops included, and the run ends
    at the instant of the last of them. What ``event-driven`` leaves out at a contact that persists,
    and one piece of its motion, may move a ball by the ``contact_tolerance`` (m; default: 1e-7);
    solvers that do not play to a tolerance take no notice of it, as of ``dt`` one without a step.
    ``compiled`` has no effect any more. The option ``friction`` of ``pymunk`` is
    "joint" or "callback", and that of ``pymunk-discrete`` is "callback". Numbers and points may be
    NumPy's.

    >>> from pool_pymunk import load
    >>> run = simulate(load("report"), "Simulation 3", solver="pymunk", dt=1/240)
    >>> run.status, [event.kind for event in run.events]
    ('settled', ['ball-cushion', 'stop'])

    Raises ValueError with one line that names the argument: SettingError, or SceneError if
    the start is impossible.
    """
    asked = request(
        scene, solver, dt=dt, law=law, times=times, max_time=max_time, max_events=max_events,
        contact_tolerance=contact_tolerance, compiled=compiled, **options,
    )  # fmt: skip
    return asked.play(find_shot(scene, shot), None if start is None else scene.state(start))


def simulate_all(
    scene: Scene,
    shots: Sequence[Shot | str | int | None] | None = None,
    *,
    solver: str = "pymunk",
    on_time: OnTime | None = None,
    **options: Any,
) -> Iterator[Run]:
    """Simulate several shots (default: all of the scene), and yield each Run when it is done.

    The arguments are those of :func:`simulate`, without ``start``; a solver with steps calls
    ``on_time`` now and then with the present time (s) of the shot.
    """
    asked = request(scene, solver, on_time=on_time, **options)
    last: Run | None = None
    for one in shots if shots is not None else scene.shots or (None,):
        shot = find_shot(scene, one)
        goes_on = last and shot and shot.from_previous and last.shot == shot_before(scene, shot)
        last = asked.play(shot, last.end if last and goes_on else None)
        yield last


def __getattr__(name: str) -> object:
    if name != "yardstick":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn("yardstick is now reference_solver", DeprecationWarning, stacklevel=2)
    return reference_solver
