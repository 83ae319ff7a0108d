"""This module plays many exact shots at once."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from pool_pymunk.laws import Law
from pool_pymunk.many.batch import Batch
from pool_pymunk.many.play import Done, play_all
from pool_pymunk.many.source import NOTHING, Source, read_source, refuse_given
from pool_pymunk.many.workers import Workers, renamed, workers_of
from pool_pymunk.model import Scene, Shot, inputs
from pool_pymunk.results.run import FIGURES
from pool_pymunk.solvers import find_shot, request
from pool_pymunk.solvers.small_changes import check_surface


def simulate_many(
    scene: Scene,
    position: Any = None,
    velocity: Any = None,
    *,
    shot: Shot | str | int | None = None,
    roll: Any = None,
    law: str | Law | None = None,
    vary: Mapping[str, Any] | None = None,
    max_time: float | None = None,
    workers: int | Executor | Workers | None = None,
    on_done: Done | None = None,
    derivatives: str | Sequence[str] | None = None,
    figures: bool = False,
    contact_tolerance: float | None = None,
    threads: int | None = None,
) -> Batch:
    """Play many shots exactly, and return where the balls end.

    ``position`` (m) and ``velocity`` (m/s) are arrays (S, N, 2), for S shots and the scene's N
    balls, or (N, 2) for all shots (default: the scene's own). NaN as a position means that the ball
    is off the table. ``shot`` takes the place of both: a Shot of the scene, its name or its number
    from 1. All shots then begin as in :func:`simulate`; ``simulate_many(scene, 1)`` is enough.

    ``vary`` has what else differs from shot to shot: arrays (S,) by the names of the table of
    inputs (:mod:`pool_pymunk.model.inputs`), such as ``mass.C``; a :class:`~pool_pymunk.Variation`
    draws such arrays. ``speed``, ``angle``, ``turn`` and ``roll`` are those of the shot's ball;
    without a shot, of the cue ball or else of the first ball that moves. ``mass`` (kg) is that of
    all balls, and may be (S, N) too. The argument ``roll`` has the rolls (m/s) in an array like
    ``velocity``. By default a ball's roll is its own share of its velocity; for the ball of the
    shot, or of the scene's first shot, it is the share of that shot.
    ``law`` and ``max_time`` (s) are by default the scene's. ``workers`` share the work and change
    no bit: so many processes of this machine, or any ``concurrent.futures.Executor``; by default
    this process plays. ``on_done(n)`` is called with 0 when the first shots begin, and whenever
    ``n`` more are done. ``derivatives`` names the inputs of ``batch.derivatives``, as
    :meth:`Run.derivatives` does. With ``figures``, ``batch.rounding``, ``batch.policy_shift`` and
    ``batch.persistent_shift`` say how far off the ends may be; a shot then takes several times as
    long, and more where further runs tell them.

    Every bit is that of ``simulate(..., solver="event-driven")``; contacts persist to a
    ``contact_tolerance`` (m), as there. Laws, sides and surfaces of your own take longer, and so do
    radii that vary. A shot takes 27 + 21 N bytes in the result. Raises SettingError, in one line
    that names the argument.

    >>> import numpy as np
    >>> from pool_pymunk import load
    >>> scene = load("two-balls")
    >>> velocity = np.zeros((3, 2, 2))
    >>> velocity[:, 0, 0] = [0.5, 1.0, 1.5]
    >>> batch = simulate_many(scene, velocity=velocity, max_time=2.0)
    >>> batch.hits.tolist(), bool((batch.final[1] == batch.run(1).end.position).all())
    ([1, 1, 1], True)
    """
    began = time.perf_counter()
    workers = renamed(workers, threads=threads)
    if shot is not None:
        refuse_given("the shot has its own", position=position)
        position = find_shot(scene, shot)
    asked = request(scene, law=law, max_time=max_time, contact_tolerance=contact_tolerance)
    source = read_source(asked, position, velocity, vary, roll)
    if derivatives is not None:
        source = derived_by(source, derivatives)
    source = source._replace(has_figures=figures)
    done = on_done or (lambda _: None)
    with workers_of(workers) as several:
        done(0)
        found = play_all(source, done, several)._asdict()
    del found["beside"]
    measured, none = found.pop("figures").T, np.zeros(len(source.position), np.bool_)
    more: dict[str, Any] = dict(zip(FIGURES, measured, strict=True)) if figures else {}
    if derivatives is None:
        found["derivatives"] = None
    else:
        more |= {"by": source.by, "derived_in_python": none.copy()}
    return Batch(
        source.scene, source.asked.law, **found, **more, by_reference=0, handed_back=none,
        wall_time=time.perf_counter() - began, source=source,
    )  # fmt: skip


def derived_by(source: Source, names: str | Sequence[str]) -> Source:
    """Return a source whose ends are to be derived by inputs; raises SettingError."""
    begun = source.scene_of(0) if len(source.position) else source.scene
    groups = inputs.derivable(begun, source.watched != NOTHING)
    check_surface(source.scene)
    return source._replace(by=inputs.chosen("derivatives", names, groups))
