"""Balls cross the borders of patches, where they go on with other friction.

A crossing is due as a hit is, but it is no contact. Which patch a ball is in belongs to its state
(``patch`` of :class:`~pool_pymunk.engine.groups.Groups`) and changes at crossings alone, so
rounding does not decide it anew at each hit. Python and numba run these functions.
"""

from __future__ import annotations

import math
from typing import Any

from pool_pymunk.engine import asked, modes, persisting
from pool_pymunk.engine.groups import NONE

# A ball crosses at most so many times at one instant. More would come only where each of two
# patches turns a path into the other one, just where it is tangent to their border.
MOST = 4


def next_crossing(w: Any, i: int) -> float:
    """Return when (s) a ball crosses into another patch, or infinity."""
    r, (t, _) = w.groups, asked.crossing_of(w, i)
    if t == math.inf:
        return t
    is_stuck = t <= w.now == r.crossed[i] and r.crossings[i] >= MOST
    # The piece of a ball in persistent contact ends shortly before, and the next one crosses.
    return math.inf if is_stuck or persisting.is_cut_for(w, i, t) else t


def cross(w: Any, sides: Any, i: int) -> None:
    """Let a ball go on in the patch into which its path leads now."""
    r, (t, patch) = w.groups, asked.crossing_of(w, i)
    if t > w.now:
        asked.predict(w, sides, (i,))
        return
    r.crossings[i] = r.crossings[i] + 1 if r.crossed[i] == w.now else 1
    r.crossed[i] = w.now
    if r.leader[i] != NONE:
        modes.cross(w, i, patch)
        asked.predict_loose(w, sides)
        return
    (x, y, vx, vy), roll = asked.motion(w, i), asked.roll_of(w, i)
    asked.enter(w, i, patch)
    path = asked.path_from(w, i, (x, y), (vx, vy), roll)
    if asked.moves_on(path):
        asked.lead(w, i, path)
    else:
        asked.begins_to_rest(w, i, x, y)
    asked.predict(w, sides, (i,))
