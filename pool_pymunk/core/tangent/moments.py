"""The changes of a ball at any time of a run come from the moments that a tangent has kept."""

from __future__ import annotations

from typing import Final, final

from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.core.motion.times import INF
from pool_pymunk.core.tangent.carry import Ground
from pool_pymunk.core.tangent.change import BLUR
from pool_pymunk.core.tangent.encounter import AGREE
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.core.tangent.track import Moment, Track


@final
class Stretch:
    """A stretch of a ball's leg has one change, which is quadratic in the time.

    It counts ``since`` a time (s). ``numbers`` (3, 2, P) are the changes of x and y at the
    ``start`` of the leg (s), and half a ``span`` (s) and a whole one later. Nothing is known after
    the ``end`` (s). Within ``blur`` (s) of the start a hit may come, if that is not negative, by
    which the inputs have ``jumps``.
    """

    def __init__(self, tangent: Tangent, track: Track, moment: Moment, until: float) -> None:
        leg = track.legs[moment.at]
        ground = Ground(leg, tangent.table, tangent.inputs)
        self.since: Final = moment.t
        self.start: Final = leg.path.t
        has_next = moment.at + 1 < len(track.legs)
        self.end: Final = track.legs[moment.at + 1].path.t if has_next else INF
        span = min(self.end, until) - self.start
        self.span: Final = span if span > 0.0 else 1.0
        self.numbers: list[float] = []
        for share in (0.0, 0.5, 1.0):
            changes = [each.copy() for each in moment.changes]
            ground.carry(leg.path, changes, self.start + share * self.span)
            self.numbers += [each.x for each in changes]
            self.numbers += [each.y for each in changes]
        self.blur = -1.0
        self.jumps: list[bool] = []

    def jump(self, track: Track, before: Moment, after: Moment) -> None:
        """Note what changes if the velocity jumps between two moments, as at a hit."""
        path, last = track.legs[after.at].path, track.legs[before.at].path
        if before.at == after.at:
            return
        ux, uy = last.velocity(path.t)
        jump = max(abs(path.vx - ux), abs(path.vy - uy))
        if jump <= AGREE * path.speed + NOISE * last.speed:
            return
        fastest = max(max(abs(path.vx), abs(path.vy)), max(abs(ux), abs(uy)))
        self.blur = BLUR * ((abs(path.x) + abs(path.y)) / fastest + path.t)
        self.jumps = [not (c.is_zero and d.is_zero) for c, d in zip(before.changes, after.changes)]


def stretches_of(tangent: Tangent, ball: int) -> list[Stretch]:
    """Return the stretches of a ball in a run, of which a tangent has kept the changes."""
    track = tangent.tracks[ball]
    moments = sorted(track.moments, key=lambda moment: moment.t)
    found = [Stretch(tangent, track, moment, tangent.duration) for moment in moments]
    for k in range(1, len(moments)):
        found[k].jump(track, moments[k - 1], moments[k])
    return found
