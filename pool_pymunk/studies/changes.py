"""This module lets small changes go through an exact run (:mod:`pool_pymunk.core.tangent`).

The run is played once more, with the same bits, and its course is followed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.tangent.course import LASTS, Course
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.moments import Stretch, stretches_of
from pool_pymunk.core.tangent.reasons import CHAOS, FOLLOWED
from pool_pymunk.core.tangent.rounding import RoundingErrors, farthest
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.laws import LAWS, Law
from pool_pymunk.many.play import Hearing
from pool_pymunk.model import State
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.model.problems import SettingError, setting_error
from pool_pymunk.results.run import Run, points
from pool_pymunk.results.trace import NEVER_SETTLES
from pool_pymunk.solvers import find_solver
from pool_pymunk.solvers.by_core import engine_of
from pool_pymunk.solvers.small_changes import (
    check_surface,
    corners_of,
    inputs_of,
    rounding_errors_of,
)

SAME = 1e-9  # s; an event of the run comes at the time of its step


@dataclass(frozen=True)
class Replay:
    """A replay is a run that was played once more, with its course."""

    run: Run
    engine: Engine
    course: Course

    @property
    def is_cut(self) -> bool:
        """Tell whether the run was cut off at a fixed time."""
        run = self.run
        return run.status == "max_time" or run.duration == run.scene.physics.max_time

    def tangent(self, inputs: Inputs) -> Tangent:
        """Return what follows the changes by these inputs."""
        return Tangent(self.engine, self.course, corners_of(self.run.scene), inputs)

    def follow(self, tangent: Tangent) -> str:
        """Follow the changes; return why errors cannot be followed, if so."""
        run = self.run
        return tangent.follow(run.duration, self.is_cut, run.status == "max_events")


class Changes(NamedTuple):
    """Changes say how the balls' states depend on the inputs.

    ``ends`` (N, K, P) are those at the end of the run, and ``times`` (E, P) are the changes of the
    times of the events. ``warnings`` say what has no derivative.
    """

    replay: Replay
    inputs: Inputs
    ends: Array
    times: Array
    warnings: Names
    kept: dict[int, Tracked]

    def at(self, times: Sequence[float] | Array, i: int) -> Array:
        """Return the changes (T, 2, P) of a ball's place at these times (s)."""
        if not self.kept:
            tangent = self.replay.tangent(self.inputs)
            tangent.keeps = True
            self.replay.follow(tangent)
            balls = range(len(self.ends))
            self.kept.update({k: Tracked(tangent, k, self.replay.is_cut) for k in balls})
        return self.kept[i].at(np.asarray(times, float))


class Tracked:
    """The changes of one ball are known at any time of a run."""

    def __init__(self, tangent: Tangent, ball: int, is_cut: bool) -> None:
        self.duration, self.is_cut, self.count = tangent.duration, is_cut, tangent.inputs.count
        self.stretches = stretches_of(tangent, ball)

    @cached_property
    def polynomials(self) -> tuple[Array, Array, Array]:
        """The coefficients (L, 2, P) of the changes on each stretch (Lagrange's polynomials)."""
        found = np.array([each.numbers for each in self.stretches])
        first, half, whole = found.reshape(len(self.stretches), 3, 2, self.count).swapaxes(0, 1)
        return first, 4.0 * half - 3.0 * first - whole, 2.0 * (first + whole) - 4.0 * half

    @cached_property
    def spans(self) -> Array:
        """When (s) each stretch counts and begins, how long it takes, and when it ends (L, 4)."""
        return np.array([(s.since, s.start, s.span, s.end) for s in self.stretches])

    def at(self, times: Array) -> Array:
        """Return the changes (T, 2, P) of the place."""
        t = np.clip(times, 0.0, self.duration)
        since, start, span, end = self.spans.T
        last = np.maximum(np.searchsorted(since, t, side="right") - 1, 0)
        s = ((t - start[last]) / span[last])[:, np.newaxis, np.newaxis]
        first, second, third = (each.take(last, axis=0) for each in self.polynomials)
        found = first + s * (second + s * third)
        found[end[last] < t] = math.nan  # What begins later than its leg is unknown.
        for each in self.stretches:
            if each.blur >= 0.0:
                self._lose_at(each, t, found)
        return np.asarray(found)

    def _lose_at(self, each: Stretch, t: Array, found: Array) -> None:
        """Lose what a hit changes at times within its blur."""
        is_now = abs(t - each.start) <= each.blur
        if not self.is_cut:  # The end is at no fixed time.
            is_now &= t != self.duration
        if is_now.any():
            found[is_now] += np.where(each.jumps, math.nan, 0.0)


def by_names(run: Run, names: Names, some: Collection[str]) -> Array:
    """Return the changes (N, K, P) of the balls' states at the start, by some of the inputs."""
    scene, shot = run.scene, run.shot
    struck = None if run.struck is None else scene.index[run.struck]
    begun = np.array([breakpoints[0] for breakpoints in run.knots])[np.newaxis]
    share = shot.roll if shot and shot.ball == run.struck else None
    roll = begun[..., 7:9] if scene.surface.rolls else None
    found: Array = starts_of(scene, some, struck, begun[..., 3:5], roll, share)[0]
    if some is names:
        return found
    starts = np.zeros((*found.shape[:2], len(names)))
    starts[..., [names.index(name) for name in some]] = found
    return starts


def changes_of(run: Run, names: Names, starts: Array) -> Changes:
    """Follow the changes of the ``starts`` (N, K, P) through a run, up to persistent contacts.

    Raises SettingError for a surface of somebody's own, and for a law that a run does not keep.
    """
    replay = played_again(run)
    inputs = inputs_of(run.scene, starts, changed_numbers(run.scene, names))
    tangent = replay.tangent(inputs)
    replay.follow(tangent)
    found, law = sorted(tangent.found, key=lambda one: one[0]), law_of(run).name
    lost = "what depends on it has no derivative, and is NaN"
    texts = dict.fromkeys(f"{why.format(law)} (at {t:.6g} s): {lost}" for t, why in found)
    size, count = starts.shape[1:]
    ends = np.array(tangent.ends()).reshape(len(starts), size, count)
    times = times_of(run, replay.course, tangent.lates, count)
    return Changes(replay, inputs, ends, times, tuple(texts), {})


def times_of(run: Run, course: Course, lates: list[list[float]], count: int) -> Array:
    """Return the changes (E, P) of the times of a run's events, nan for what is no step of it.

    The solver in a pymunk space may answer contacts that persist in another order.
    """
    found, events = np.array(lates).reshape(len(lates), count), len(run.events)
    if len(found) != events:
        more = np.full((max(events - len(found), 0), count), math.nan)
        found = np.concatenate((found[:events], more))
    steps = [step.t for step in course.steps if step.kind != LASTS][:events]
    for k, (event, t) in enumerate(zip(run.events, steps, strict=False)):
        if abs(event.t - t) > SAME:
            found[k] = math.nan
    return found


def played_again(run: Run) -> Replay:
    """Play a run once more, from its own start to its end, and note its course.

    Raises SettingError for a surface of somebody's own, and for a law that a run does not keep.
    """
    check_surface(run.scene)
    engine = engine_of(run.scene, start_of(run), law_of(run), run.contact_tolerance)
    engine.most_events = len(run.events) if run.status == "max_events" else NEVER_SETTLES
    latest = run.duration if run.status == "max_time" else math.inf
    engine.recorder = course = Course(engine.balls, Hearing())
    engine.begin_run()
    engine.advance(latest)
    course.close(engine, latest)
    return Replay(run, engine, course)


def start_of(run: Run) -> State:
    """Return the state from which a run has set off."""
    rows = np.array([breakpoints[0] for breakpoints in run.knots])
    roll = points(rows[:, 7:9]) if run.scene.surface.rolls else None
    off = run.off - run.pocketed.keys()
    return State(points(rows[:, 1:3]), points(rows[:, 3:5]), off, roll)


def law_of(run: Run) -> Law:
    """Return the law of a run; raise SettingError for one that the run does not keep."""
    law = run.law_used or LAWS.get(run.law)
    if law is None:
        message = "is a law of your own, which a run that was loaded or copied does not keep"
        message += ": play the run again"
        raise setting_error("law", run.law, message)
    return law


def rounding(run: Run) -> float:
    """Return how far (m) rounding may have moved the ends of an exact run, to first order.

    The errors that every path and every contact make (:mod:`pool_pymunk.core.tangent.rounding`) go
    through the run as changes do, in draws of random signs. The answer is four times the
    largest root mean square move of a ball over the draws. It is inf where errors grow until other
    contacts may come, and nan where the run has no derivative, or where contacts persisted.
    """
    if not find_solver(run.solver).exact or run.persistent:
        return math.nan
    try:
        replay = played_again(run)
    except SettingError:
        return math.nan
    tangent = replay.tangent(rounding_errors_of(run.scene))
    tangent.errors = RoundingErrors(replay.engine.table)
    why = replay.follow(tangent)
    if why != FOLLOWED:
        return math.inf if why == CHAOS else math.nan
    return farthest([track.changes for track in tangent.tracks])
