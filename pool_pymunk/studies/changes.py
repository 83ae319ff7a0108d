"""This module lets small changes go through an exact run (:mod:`pool_pymunk.physics.changes`)."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Collection, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.fast.tables import coefficients_of, cue_of, own_of_walls
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.model.obstacles import obstacles
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics import changes, columns
from pool_pymunk.physics.changes import REASONS, ROLL, STOP
from pool_pymunk.physics.columns import Follow
from pool_pymunk.physics.laws import LAWS, Law
from pool_pymunk.physics.motion import Array
from pool_pymunk.physics.path import NOISE, from_breakpoint
from pool_pymunk.physics.saltation import AGREE
from pool_pymunk.physics.sides import pocket
from pool_pymunk.physics.surface import Rolling, Sliding
from pool_pymunk.results.run import Run
from pool_pymunk.studies.persistent import follow_all


class Changes(NamedTuple):
    """Changes say how the balls' states depend on the inputs.

    ``ends`` (N, K, P) are those at the end of the run, and ``times`` (E, P) are the changes of the
    times of the events. ``warnings`` say what has no derivative.
    """

    run: Run
    pass_: Any
    ends: Array
    times: Array
    warnings: Names

    def at(self, times: Sequence[float], i: int) -> Array:
        """Return the changes (T, 2, P) of a ball's place at these times."""
        g, found = self.pass_, []
        kept = sorted(g.python.kept[i], key=lambda one: one[0])
        for time in times:
            t = min(max(time, 0.0), self.run.duration)
            steps = next(
                (steps for steps in g.python.spells[i] if steps[0][0] < t < steps[-1][0]), ()
            )
            if steps:
                found.append(between(steps, t))
                continue
            last = max(bisect_right([begun for begun, _, _ in kept], t) - 1, 0)
            _, row, change = kept[last]
            following = g.following[row]
            own = change.copy()
            if following >= 0 and g.rows[following][1] < t:  # What began is unknown.
                own[:] = math.nan
            if any(self._is_hit(i, kept, n, t) for n in (last, last + 1) if 0 < n < len(kept)):
                own = np.where(own.any(axis=0), math.nan, own)
            changes.carry(g, g.rows[row], own, t)
            found.append(own[:2])
        return np.array(found).reshape(len(found), 2, len(g.late))

    def _is_hit(self, i: int, kept: Sequence[Any], n: int, t: float) -> bool:
        """Tell whether a ball is hit at this time (s), where its ``n``-th change began."""
        g = self.pass_
        if t == self.run.duration and not g.one.ends[1]:  # The end is at no fixed time.
            return False
        (begun, row, _), path = kept[n], g.python.paths[kept[n - 1][1]]
        before, after = path.at(t)[1], g.rows[row][4:6]
        jump = max(abs(a - b) for a, b in zip(after, before, strict=True))
        is_hit = jump > AGREE * math.hypot(*after) + NOISE * path.speed
        return is_hit and changes.is_at(g, begun, t, i, i)


def between(steps: Sequence[tuple[float, Array]], t: float) -> Array:
    """Return the changes (2, P) of a ball's place at a time (s) between the steps of a group.

    A cubic fits the changes of places and velocities at the steps beside it (Hermite).
    """
    k = bisect_right([when for when, _ in steps], t)
    (since, first), (until, last) = steps[k - 1], steps[k]
    h, s = until - since, (t - since) / (until - since)
    kept = (1.0 + 2.0 * s) * (1.0 - s) ** 2
    by_place = kept * first[:2] + (1.0 - kept) * last[:2]
    return np.asarray(by_place + h * s * (1.0 - s) * ((1.0 - s) * first[2:4] - s * last[2:4]))


def by_names(run: Run, names: Names, some: Collection[str]) -> Array:
    """Return the changes (N, K, P) of the balls' states at the start, by some of the inputs."""
    scene, shot = run.scene, run.shot
    struck = None if run.struck is None else scene.index[run.struck]
    begun = np.array([breakpoints[0] for breakpoints in run.knots])[np.newaxis]
    share = shot.roll if shot and shot.ball == run.struck else None
    roll = begun[..., 7:9] if scene.surface.rolls else None
    found = starts_of(scene, some, struck, begun[..., 3:5], roll, share)[0]
    starts = np.zeros((*found.shape[:2], len(names)))
    starts[..., [names.index(name) for name in some]] = found
    return starts


def changes_of(run: Run, names: Names, starts: Array) -> Changes:
    """Follow the changes of the ``starts`` (N, K, P) through a run.

    Raises SettingError for a law or a surface that has no derivatives.
    """
    g = follow_of(run, starts, changed_numbers(run.scene, names))
    law = g.law.name
    try:
        follow_all(g, run)
    except (TypeError, AttributeError) as error:
        if "dual" not in str(error).lower():
            raise
        message = "cannot be differentiated: it may use + - * / **, abs, min, max, comparisons"
        raise setting_error("law", law, message) from None
    found = sorted(g.python.found, key=lambda one: one[0])
    lost = "what depends on it has no derivative, and is NaN"
    texts = dict.fromkeys(f"{REASONS[k].format(law)} (at {t:.6g} s): {lost}" for t, k in found)
    times = np.array(g.python.kept[-1]).reshape(len(g.events), len(names))
    return Changes(run, g, g.change, times, tuple(texts))


def follow_of(
    run: Run, starts: Array, numbers: Sequence[Array], signs: dict[str, Any] | None = None
) -> Any:
    """Return what a pass through a run needs, with the changes of its starts and its numbers."""
    scene, (count, size, inputs) = run.scene, starts.shape
    if type(scene.surface) not in (Sliding, Rolling):
        message = "is a surface of your own, and has no derivatives"
        raise setting_error("surface", type(scene.surface).__name__, message)
    is_cut = run.status == "max_time" or run.duration == scene.physics.max_time
    rows, following = rows_of(run)
    walls = (*scene.cushions, *(pocket(p.position, p.radius, 0) for p in scene.pockets))
    anchors = [*(scene.table.outline if scene.table else ()), *(p.position for p in scene.posts)]
    discs, faces, corners = obstacles(scene)
    of_numbers, of_mass, of_radius = numbers
    one = room_for_one()
    one.ends = [run.duration, is_cut, run.status == "max_events", 0.0]
    one.numbers = coefficients_of(scene).tolist()
    python = SimpleNamespace(
        paths=[from_breakpoint(*row[1:8]) for row in rows], found=[], anchors=anchors,
        spells=[[] for _ in starts], parted=set(),
        kept=[*([(0.0, i, start.copy())] for i, start in enumerate(starts)), []],
        **(signs or {"signs": None}),
    )  # fmt: skip
    g: Any = Follow(
        rows, following, events_of(run), walls, len(scene.cushions), own_of_walls(scene),
        cue_of(scene), law_of(run), discs, faces,
        corners, [SimpleNamespace(at=0, met=STOP, gone=ball.id in run.off, mass=ball.mass,
                                  radius=ball.radius) for ball in scene.balls],
        of_numbers, of_mass, of_radius, starts.copy(), np.zeros((count, inputs), bool),
        np.zeros(inputs), one, **columns.room(size, inputs), python=python,
    )  # fmt: skip
    changes.start(g, 0)
    return g


def room_for_one() -> SimpleNamespace:
    """Return room for the numbers of one contact: lists, which Python reads fast."""
    found = {name: np.zeros(shape) for name, shape in columns.ONE.items()}
    return SimpleNamespace(**{k: v.tolist() for k, v in found.items()})


def rows_of(run: Run) -> tuple[list[list[float]], list[int]]:
    """Return the breakpoints of a run, the first ones first, and which one follows each."""
    width = run.knots[0].shape[1] if run.knots else 9
    none = [0.0] * (9 - width)
    found = [[[float(i), *row, *none] for row in own.tolist()] for i, own in enumerate(run.knots)]
    rows = [own[0] for own in found]
    following = [-1] * len(rows)
    for i, own in enumerate(found):
        before = i
        for row in own[1:]:
            following[before] = before = len(rows)
            rows.append(row)
            following.append(-1)
    return rows, following


def events_of(run: Run) -> list[tuple[float, int, int]]:
    """Return the time of each event, its ball, and what that meets."""
    scene, found = run.scene, list[tuple[float, int, int]]()
    holes = {hole.id: k for k, hole in enumerate(scene.pockets, start=len(scene.cushions))}
    for event in run.events:
        i, *others = (scene.index[id_] for id_ in event.balls)
        wall = event.cushion if event.pocket is None else holes[event.pocket]
        met = {"stop": STOP, "roll": ROLL}.get(event.kind, -1 - (wall or 0))
        found.append((event.t, i, others[0] if others else met))
    return found


def law_of(run: Run) -> Law:
    """Return the law of a run; raise SettingError for one that the run does not keep."""
    law = run.law_used or LAWS.get(run.law)
    if law is None:
        message = "is a law of your own, and a run that was loaded or copied does not keep it"
        raise setting_error("law", run.law, message)
    return law
