"""This module finds where a path of an exact run touches something, to rounding, without a contact.

A path may be tangent to a ball, a corner, an arc or the rim of a pocket. It may run along a
cushion, or end just where it touches. A small change of an input makes a contact there or leaves
a gap, so the ends have a kink.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from pool_pymunk.fast.doubts import NEVER, around, touch_of_discs, touch_of_face
from pool_pymunk.model import Scene
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, from_breakpoint, motion_at, sets_off, standing
from pool_pymunk.physics.sides import Arc, within_sector
from pool_pymunk.results.run import Run

# times (s) of contacts, by a ball and what it met: a ball of higher number, or -1 - a wall's
Times = dict[tuple[int, int], set[float]]
GONE = standing(math.inf, 0.0, 0.0)  # the path of a ball that is not on the table


class Touch(NamedTuple):
    """At a touch ball ``i`` touches ball ``j``, or something at rest (-1), at ``t`` (s).

    ``begins`` tells whether a path begins there, along what it touches.
    """

    t: float
    begins: bool
    i: int
    j: int


def touches(run: Run) -> list[Touch]:
    """Return the touches of a run that are no contacts, in the order of time.

    The paths are looked at from breakpoint to breakpoint, as long as the balls are on the table.
    """
    leaves = {event.balls[0]: event.t for event in run.events if event.pocket is not None}
    paths, ends = list[list[Path]](), list[tuple[float, int, int]]()
    for i, (ball, breakpoints) in enumerate(zip(run.scene.balls, run.knots, strict=True)):
        last = leaves.get(ball.id, -1.0 if ball.id in run.off else run.duration)
        own = [from_breakpoint(*row) for row in breakpoints[:, :7].tolist() if row[0] < last]
        ends += [(path.t, i, k) for k, path in enumerate(own) if k > 0] + [(last, i, len(own))]
        paths.append([*own, GONE])
    now, met, around_ = [own[0] for own in paths], _met(run), around(run.scene)[:2]
    radii, found = [ball.radius for ball in run.scene.balls], list[Touch]()
    for t, i, k in sorted(ends):
        found += _of_balls(now, radii, i, t, met)
        if sets_off(now[i]):
            found += _of_table(run.scene, around_, now[i], radii[i], i, t, met)
        now[i] = paths[i][k]
    return sorted(found)


def _met(run: Run) -> Times:
    """Return when (s) balls met each other and walls; pockets are numbered as the last walls."""
    scene, met = run.scene, Times()
    holes = {hole.id: k for k, hole in enumerate(scene.pockets, start=len(scene.cushions))}
    for event in run.events:
        i, *others = sorted(scene.index[id_] for id_ in event.balls)
        wall = event.cushion if event.pocket is None else holes[event.pocket]
        if others or wall is not None:
            met.setdefault((i, others[0] if others else -1 - (wall or 0)), set()).add(event.t)
    return met


def _of_balls(
    now: Sequence[Path], radii: Sequence[float], i: int, t: float, met: Times
) -> Iterator[Touch]:
    """Yield where a ball touches another one on its present path, until ``t`` (s)."""
    own, is_still = now[i], not sets_off(now[i])
    for j, other in enumerate(now):
        since = max(own.t, other.t)
        if j == i or since >= t or (is_still and not sets_off(other)):
            continue
        times, apart = met.get((min(i, j), max(i, j)), ()), radii[i] + radii[j]
        begins, ends = since not in times, t not in times
        found = touch_of_discs(own, other, t, apart, 1.0, begins, ends, 1.0)
        yield from _touches(found, since, i, j)


def _of_table(
    scene: Scene, around_: Any, path: Path, radius: float, i: int, t: float, met: Times
) -> Iterator[Touch]:
    """Yield where a ball touches something at rest on its path, until ``t`` (s)."""
    discs, faces = around_
    for disc in discs:
        x, y, size, facing, wall = disc
        times = met.get((i, -1 - wall), ())
        begins, ends, still = path.t not in times, t not in times, standing(0.0, x, y)
        apart = size + facing * radius
        found = touch_of_discs(path, still, t, apart, facing, begins, ends, 1.0)
        for touch in _touches(found, path.t, i, -1):
            if _is_beside(scene, wall, (x, y), path, touch.t):
                yield touch
    for face in faces:
        times = met.get((i, -1 - face[-1]), ())
        found = touch_of_face(path, face, t, radius, path.t not in times, t not in times, 1.0)
        yield from _touches(found, path.t, i, -1)


def _touches(found: tuple[bool, float], since: float, i: int, j: int) -> Iterator[Touch]:
    """Yield the touches of a path since a time (s): at its beginning, and later."""
    begins, t = found
    if begins:
        yield Touch(since, True, i, j)
    if t != NEVER:
        yield Touch(t, False, i, j)


def _is_beside(scene: Scene, wall: int, center: Vector, path: Path, t: float) -> bool:
    """Tell whether a ball is within the sector of an arc at ``t`` (s); True for any other disc."""
    edges = scene.table.edges if scene.table is not None else ()
    side = edges[wall].side if wall < len(edges) else None
    if not isinstance(side, Arc) or side.center != center:
        return True
    x, y, _, _ = motion_at(path, t)
    return within_sector(x - center[0], y - center[1], side.first, side.last)
