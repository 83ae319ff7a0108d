"""A run is played again: as it was, or by variants that show how far its ends might move.

Variants are played as a batch of the core, with the bits that they have alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, groupby
from typing import NamedTuple

from pool_pymunk.core.batch import Given
from pool_pymunk.core.record import Recorder
from pool_pymunk.model import Point, Scene, State
from pool_pymunk.results.run import Run
from pool_pymunk.results.trace import Trace, farthest, places_at
from pool_pymunk.results.variants import AS_IT_IS, Variant
from pool_pymunk.solvers.by_core import ENDINGS, errors_of, shots_of
from pool_pymunk.solvers.frozen import nudged
from pool_pymunk.solvers.record import Settings, Solver

GONE = (math.nan, math.nan)  # stands for the velocity of a ball off the table


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
    """This has all that it takes to play a run again, from its start."""

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
        scene, count = self.scene, len(self.scene.balls)
        shots = shots_of(scene, self.settings._replace(variant=variants[0]))
        shots.errors = [errors_of(each) for each in variants]
        starts = [self.nudged(each) for each in variants]
        places = [place for start in starts for place in start.position]
        off = {scene.index[id_] for id_ in self.start.off}
        velocities = [
            GONE if i in off else v for start in starts for i, v in enumerate(start.velocity)
        ]
        columns = [places, velocities]
        if self.start.roll is not None:
            columns.append([roll for start in starts for roll in start.roll or ()])
        listed = [list(chain.from_iterable(each)) for each in columns]
        given = Given([*range(count)], listed, [], [])
        ends = shots.play(len(variants), given, Waking())
        statuses = dict(zip(ends.endings[::2], ends.endings[1::2], strict=True))
        for number, *place in zip(ends.moved, ends.places[::2], ends.places[1::2], strict=True):
            places[number] = (place[0], place[1])
        for k, duration in enumerate(ends.durations):
            status = statuses.get(k, 0)
            said = ENDINGS[status] if status < len(ENDINGS) else "cannot_start"
            yield End(said, duration, places[k * count : (k + 1) * count])
