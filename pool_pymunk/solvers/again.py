"""A run is played again: as it was, or by variants that show how far its ends might move.

Variants are played as a batch of the core, with the bits that they have alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from pool_pymunk.core.record import Recorder
from pool_pymunk.model import Point, Scene, State
from pool_pymunk.results.run import Run
from pool_pymunk.results.trace import Trace, farthest, places_at
from pool_pymunk.results.variants import AS_IT_IS, Variant
from pool_pymunk.solvers.frozen import nudged
from pool_pymunk.solvers.record import Settings, Solver


class Waking(Recorder):
    """While this listens, Python hears an interrupt: compiled code never looks for one."""

    def pause(self, t: float) -> None:
        """Do nothing."""


class End(NamedTuple):
    """A variant ended so (a status), at a time (s), with the balls at these places (m)."""

    status: str
    duration: float
    places: Sequence[Point]


class Again(NamedTuple):
    """This has what is needed to play a run again, from its start."""

    scene: Scene
    solver: Solver
    options: Mapping[str, str]
    settings: Settings
    start: State

    def play(self, variant: Variant = AS_IT_IS) -> Trace:
        """Play the run, or a variant of it."""
        settings = self.settings
        if variant != AS_IT_IS:
            settings = settings._replace(variant=variant, on_time=None)
        trace = self.solver.solve(self.scene, self.nudged(variant), settings, **self.options)
        trace.cut(settings.max_events)
        if not self.solver.engine:  # The engine's paths tell all accelerations.
            trace.complete(self.scene.surface)
        return trace

    def nudged(self, variant: Variant) -> State:
        """Return the start of a variant."""
        if variant.nudge is None:
            return self.start
        return nudged(self.scene, self.start, variant.nudge)

    def moves(
        self, one: Trace | Run, variants: Sequence[Variant], known: dict[Variant, float],
        most: int | None = None,
    ) -> Iterator[float]:  # fmt: skip
        """Yield how far (m) variants, cut at ``most`` events, move the ends of a run.

        Those that are not ``known`` are played together, twice as many each time, and then are.
        """
        bounded = min(most or self.settings.max_events, self.settings.max_events)
        cut = self._replace(settings=self.settings._replace(max_events=bounded))
        unknown, count = [each for each in variants if each not in known], 1
        for each in variants:
            if each not in known:
                some, unknown, count = unknown[:count], unknown[count:], 2 * count
                for _, alike in groupby(some, key=lambda variant: variant.coarser):
                    known |= cut._moves(one, [*alike])
            yield known[each]

    def _moves(self, one: Trace | Run, variants: Sequence[Variant]) -> dict[Variant, float]:
        """Return how far (m) variants of one tolerance move the ends of a run.

        The few that do not tell where their balls are when the run ends are played alone.
        """
        found = dict[Variant, float]()
        for variant, end in zip(variants, self._ends(variants), strict=True):
            is_cut = "max_events" in (one.status, end.status)
            at = (min if is_cut else max)(one.duration, end.duration)
            if at == end.duration or (end.status == "settled" and at > end.duration):
                found[variant] = max(map(math.dist, places_at(one, at), end.places))
            else:
                found[variant] = farthest(one, self.play(variant))
        return found

    def _ends(self, variants: Sequence[Variant]) -> Iterator[End]:
        """Play variants of one tolerance together, and yield how they end."""
        # The names of solvers import no engine.
        from pool_pymunk.core.batch import Given
        from pool_pymunk.solvers.by_core import ENDINGS, errors_of, shots_of
        from pool_pymunk.solvers.from_core import floats_in, ints_in

        scene, count = self.scene, len(self.scene.balls)
        shots = shots_of(scene, self.settings._replace(variant=variants[0]))
        shots.errors = [errors_of(each) for each in variants]
        starts = [self.nudged(each) for each in variants]
        columns = [[each.position for each in starts], [each.velocity for each in starts]]
        columns += [] if self.start.roll is None else [[each.roll or () for each in starts]]
        places, velocities, *rolls = (np.array(each, float) for each in columns)
        velocities[:, [scene.index[id_] for id_ in self.start.off]] = np.nan
        listed = [each.tobytes() for each in (places, velocities, *rolls)]
        given = Given([*range(count)], listed, b"", b"")
        ends = shots.play(len(variants), given, Waking())
        places.reshape(-1, 2)[ints_in(ends.moved)] = floats_in(ends.places).reshape(-1, 2)
        which, endings = ints_in(ends.endings).reshape(-1, 2).T
        statuses = dict(zip(which.tolist(), endings.tolist(), strict=True))
        durations = floats_in(ends.durations).tolist()
        for k, (duration, its) in enumerate(zip(durations, places.tolist(), strict=True)):
            yield End(ENDINGS[statuses.get(k, 0)], duration, its)
