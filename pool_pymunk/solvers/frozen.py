"""Balls that lie frozen together, or to a cushion: the starts that tiny gaps make of theirs.

Nobody can place balls without gaps. What a run says of frozen balls comes from runs with gaps of
1e-6 m and less, which nobody sees.
"""

from __future__ import annotations

import math
from random import Random

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.engine.decisions import NEARLY_CLOSED, is_closed
from pool_pymunk.model import Scene, State

# m; gaps of the starts, in turn. Nobody sees a gap of 1e-6 m; some gaps are four times as wide,
# because a few draws seldom meet the worst one.
WIDTHS = (1e-13, 4e-6, 1e-9, 1e-6)
# A gap of 1e-13 m decides the ends if these lie this far (m) elsewhere. Runs that tell so much from
# so little amplify their rounding errors as much.
DECIDED = 1e-6
TRIED = (0, 4, 8)  # the first starts with the smallest gaps
PASSES = 8  # The gaps of a closed ring depend on each other; after a few passes no balls overlap.

Rows = NDArray[np.float64]


def touching(scene: Scene, start: State) -> Rows:
    """Return how each gap that is closed at the start changes as balls move: (contacts, 2 N)."""
    on = [i for i, ball in enumerate(scene.balls) if ball.id not in start.off]
    found: list[dict[int, tuple[float, float]]] = []
    for k, i in enumerate(on):
        x, y = start.position[i]
        r = scene.balls[i].radius
        for j in on[:k]:
            dx, dy = x - start.position[j][0], y - start.position[j][1]
            distance = math.hypot(dx, dy)
            gap = distance - r - scene.balls[j].radius
            if is_closed(gap / NEARLY_CLOSED, x, y, r):
                n = dx / distance, dy / distance
                found.append({i: n, j: (-n[0], -n[1])})
        for wall in scene.table.walls if scene.table is not None else ():
            side = wall.nearest(x, y, r)
            if -r < side.gap(x, y, r) and is_closed(side.gap(x, y, r) / NEARLY_CLOSED, x, y, r):
                found.append({i: side.normal(x, y)})
    rows = np.zeros((len(found), 2 * len(scene.balls)))
    for row, normals in zip(rows, found, strict=True):
        for i, n in normals.items():
            row[2 * i : 2 * i + 2] = n
    return rows


def opened(start: State, rows: Rows, number: int) -> State:
    """Return a start in which these contacts have gaps: other ones for each number."""
    gaps = WIDTHS[number % len(WIDTHS)] * np.array(_shares(len(rows), Random(number)))
    open_ = np.linalg.pinv(rows)
    moves = open_ @ gaps
    for _ in range(PASSES):
        moves += open_ @ np.maximum(-(rows @ moves), 0.0)
    places = np.array(start.position) + moves.reshape(-1, 2)
    return start._replace(position=tuple(map(tuple, places.tolist())))


def _shares(count: int, rnd: Random) -> list[float]:
    """Return the shares of a gap: any, or the whole of it for some contacts and none for others."""
    if rnd.random() < 0.5:
        return [rnd.random() for _ in range(count)]
    return [rnd.choice((0.0, 1.0)) for _ in range(count)]
