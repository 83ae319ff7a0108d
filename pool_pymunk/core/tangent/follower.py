"""Small changes are followed through the shots of a batch, one after the other."""

from __future__ import annotations

import math
from struct import Struct
from typing import Final, final

from pool_pymunk.core.engine import Engine
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.tangent.course import Course
from pool_pymunk.core.tangent.inputs import Inputs
from pool_pymunk.core.tangent.shot import close, tangent_of
from pool_pymunk.core.tangent.touches import Corner

COUNT: Final = Struct("q")
# An entry is what is not zero of how a start changes: the ball, which of its six numbers, the
# input, and the change.
ENTRY: Final = Struct("4d")
NUMBER: Final = Struct("d")


@final
class Follower:
    """A follower has how the ends of the balls of each shot change by some inputs.

    After each shot there are new ``rows`` (N, 2, P), in which nan stands for what is not there. The
    starts of shots change by ``entries``, of which each shot has its ``count``.
    """

    def __init__(self, corners: list[Corner], inputs: Inputs) -> None:
        self.corners = corners
        self.inputs = inputs
        self.counts = b""
        self.entries = b""
        self.shot = self.entry = 0  # the next ones
        self.rows = bytearray()

    def give(self, counts: bytes, entries: bytes) -> None:
        """Take the changes of the starts of some shots."""
        self.counts = counts
        self.entries = entries
        self.shot = self.entry = 0

    def begin(self, engine: Engine, listener: Recorder) -> Course:
        """Begin a shot, whose balls are on their first paths; return what notes its course."""
        self._read()
        return Course(engine.balls, listener)

    def _read(self) -> None:
        """Read how the start of the next shot changes."""
        (count,) = COUNT.unpack_from(self.counts, self.shot * COUNT.size)
        self.shot += 1
        starts: list[tuple[int, int, int, float]] = []
        for k in range(self.entry, self.entry + count):
            numbers: tuple[float, float, float, float] = ENTRY.unpack_from(
                self.entries, k * ENTRY.size
            )
            ball, which, by, change = numbers
            starts.append((int(ball), int(which), int(by), change))
        self.entry += count
        self.inputs.starts = starts

    def end(self, engine: Engine, course: Course, latest: float) -> None:
        """Follow the changes to the end of a shot, which might have gone on to the latest (s)."""
        duration, is_cut, by_events = close(engine, course, latest)
        tangent = tangent_of(engine, course, self.corners, self.inputs)
        tangent.follow(duration, is_cut, by_events)
        for track in tangent.tracks:
            for change in track.changes:
                self.rows += NUMBER.pack(change.x)
            for change in track.changes:
                self.rows += NUMBER.pack(change.y)

    def skip(self, balls: int) -> None:
        """Leave out a shot that cannot start."""
        self._read()
        for _ in range(2 * balls * self.inputs.count):
            self.rows += NUMBER.pack(math.nan)

    def take(self) -> bytes:
        """Return the rows of the shots since they were taken last."""
        rows, self.rows = bytes(self.rows), bytearray()
        return rows
