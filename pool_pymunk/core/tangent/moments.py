"""The changes of a ball at any time of a run come from the moments that a tangent has kept."""

from __future__ import annotations

import math

from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.core.tangent.carry import Ground
from pool_pymunk.core.tangent.meeting import AGREE
from pool_pymunk.core.tangent.tangent import Tangent
from pool_pymunk.core.tangent.touches import BLUR
from pool_pymunk.core.tangent.track import Moment, Track


def changes_at(tangent: Tangent, ball: int, times: list[float]) -> list[list[float]]:
    """Return the changes (T, 2 P) of a ball's place at these times (s): x, then y, by each input.

    The times are within the run. Just at a hit they are nan, and where a leg begins later than it
    is known.
    """
    track = tangent.tracks[ball]
    moments = sorted(track.moments, key=begun)
    found = [changes_on(tangent, track, last_of(moments, t), t) for t in times]
    for k in range(len(moments) - 1):
        before, after = moments[k], moments[k + 1]
        width, now = width_of(tangent, track, before, after), track.legs[after.at].path.t
        for n, t in enumerate(times):
            # The end of a run is at no fixed time, unless it was cut off there.
            if abs(t - now) <= width and (t != tangent.duration or tangent.is_cut):
                lose(found[n], before, after)
    return found


def begun(moment: Moment) -> float:
    """Return when (s) a moment begins."""
    return moment.t


def last_of(moments: list[Moment], t: float) -> Moment:
    """Return the last moment that has begun by a time (s), or the first one."""
    low, high = 0, len(moments)
    while low < high:
        middle = (low + high) // 2
        if moments[middle].t <= t:
            low = middle + 1
        else:
            high = middle
    return moments[max(low - 1, 0)]


def changes_on(tangent: Tangent, track: Track, moment: Moment, t: float) -> list[float]:
    """Return the changes of the place at a time (s), by those at a moment before."""
    leg = track.legs[moment.at]
    changes = [each.copy() for each in moment.changes]
    Ground(leg, tangent.table, tangent.inputs).carry(leg.path, changes, t)
    is_over = moment.at + 1 < len(track.legs) and track.legs[moment.at + 1].path.t < t
    if is_over:
        return [math.nan] * (2 * len(changes))
    return [each.x for each in changes] + [each.y for each in changes]


def width_of(tangent: Tangent, track: Track, before: Moment, after: Moment) -> float:
    """Return how far (s) from the beginning of a moment rounding may put its hit; -1: it is none.

    At a hit the velocity jumps.
    """
    path, last = track.legs[after.at].path, track.legs[before.at].path
    if before.at == after.at:
        return -1.0
    ux, uy = last.velocity(path.t)
    jump = max(abs(path.vx - ux), abs(path.vy - uy))
    if jump <= AGREE * path.speed + NOISE * last.speed:
        return -1.0
    fastest = max(max(abs(path.vx), abs(path.vy)), max(abs(ux), abs(uy)))
    return BLUR * ((abs(path.x) + abs(path.y)) / fastest + path.t)


def lose(found: list[float], before: Moment, after: Moment) -> None:
    """Lose what inputs change that have changed the ball before or after."""
    count = len(before.changes)
    for p in range(count):
        if not (before.changes[p].is_zero and after.changes[p].is_zero):
            found[p] = found[count + p] = math.nan
