"""Small changes are followed through the shots of a batch, one after the other."""

from __future__ import annotations

import math
from typing import Final, final

from librt.strings import BytesWriter, write_f64_le, write_i64_le
from mypy_extensions import i64

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.tangent.course import Course, End
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.reasons import FOLLOWED
from pool_pymunk.core.tangent.rounding import RoundingErrors, farthest
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.core.tangent.touches import Corner


@final
class Follower:
    """A follower has how the ends of the balls of each shot change by some inputs.

    The balls that have ``changed`` have numbers that go on from shot to shot. Each has new ``rows``
    (2, P): how its x, and its y, changes by the inputs; nan stands for what is not there. Shots
    that cannot start are ``missing``. If it has columns of ``errors``, ``roundings`` tell how far
    (m) rounding may have moved the ends of each shot; nan is what they do not tell. These four are
    the bytes of arrays.
    """

    def __init__(self, corners: list[Corner], inputs: Inputs) -> None:
        self.corners: Final = corners
        self.inputs: Final = inputs
        self.errors: Inputs | None = None
        self.course = Course([], Recorder())
        self.give([], [], [])

    def give(self, counts: list[int], places: list[int], values: list[float]) -> None:
        """Take what is not zero of the changes of some shots' starts.

        Each shot has so many of them. Of each, ``places`` are three numbers: those of the ball, of
        its six numbers, and of the input.
        """
        self.counts, self.places, self.values = counts, places, values
        self.shot = self.entry = 0  # the next ones
        self.changed = BytesWriter()
        self.rows = BytesWriter()
        self.missing = BytesWriter()
        self.roundings = BytesWriter()

    def begin(self, engine: Engine) -> None:
        """Begin a shot, whose balls are on their first paths, and let its course be noted."""
        self._read()
        engine.recorder = self.course = Course(engine.balls, engine.recorder)

    def _read(self) -> None:
        """Read how the start of the next shot changes."""
        places, first = self.places, self.entry
        self.entry += self.counts[self.shot]
        self.shot += 1
        self.inputs.starts = [
            (places[3 * k], places[3 * k + 1], places[3 * k + 2], self.values[k])
            for k in range(first, self.entry)
        ]

    def end(self, engine: Engine, latest: float) -> None:
        """Follow the changes to the end of a shot, which might have gone on to the latest (s)."""
        end = self.course.close(engine, latest)
        if self.inputs.count > 0:
            self._differentiate(engine, end)
        if self.errors is not None:
            write_f64_le(self.roundings, self._rounding(engine, end, self.errors))

    def _differentiate(self, engine: Engine, end: End) -> None:
        tangent = Tangent(engine, self.course, self.corners, self.inputs)
        tangent.times = False
        tangent.follow(*end)
        number: i64 = (self.shot - 1) * len(tangent.tracks)
        for track in tangent.tracks:
            if track.is_changed:
                write_i64_le(self.changed, number + track.number)
                for change in track.changes:
                    write_f64_le(self.rows, change.x)
                for change in track.changes:
                    write_f64_le(self.rows, change.y)

    def _rounding(self, engine: Engine, end: End, errors: Inputs) -> float:
        if len(engine.persistence.persisted(engine)) > 0:
            return math.nan
        tangent = Tangent(engine, self.course, self.corners, errors)
        tangent.errors = RoundingErrors(engine.table)
        if tangent.follow(*end) != FOLLOWED:
            return math.nan
        return farthest([track.changes for track in tangent.tracks])

    def skip(self) -> None:
        """Leave out a shot that cannot start."""
        write_i64_le(self.missing, self.shot)
        write_f64_le(self.roundings, math.nan)
        self._read()
