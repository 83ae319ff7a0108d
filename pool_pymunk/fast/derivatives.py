"""This module follows small changes of the inputs through compiled shots.

numba compiles the pass of :mod:`pool_pymunk.physics.changes`. Some of its functions have a *twin*
here: what Python does with all inputs at once, numba does with one after the other, and what Python
asks of objects, numba asks of the laws and sides that it knows.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pool_pymunk.fast import compiled, kinds, rows
from pool_pymunk.fast.batch import CANNOT_START
from pool_pymunk.fast.loop import OUT_OF_TIME
from pool_pymunk.fast.records import F, I, Out, Tracks
from pool_pymunk.fast.shots import Floats, Source, is_gone
from pool_pymunk.fast.tables import own_of_walls, table_of, walls_differ
from pool_pymunk.fast.walls import nearest
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.model.obstacles import obstacles
from pool_pymunk.physics import changes, columns, errors, kinks
from pool_pymunk.physics.columns import ONE, Follow
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.path import Path, from_breakpoint
from pool_pymunk.physics.saltation import LAW, Geometry, taken_off
from pool_pymunk.results.run import Run

BALL = np.dtype([("at", I), ("met", I), ("gone", I), ("mass", F), ("radius", F)])
CONTACT = np.dtype([(name, F, shape) for name, shape in ONE.items()])


class Follower:
    """A follower watches shots, and works out the derivatives of their ends by ``names``.

    ``found`` (S, N, 2, P) has them. ``known`` (S,) marks the shots whose derivatives are there, and
    ``again`` (S,) those among them whose derivatives were worked out in Python.
    """

    replays = True  # A shot that is hard while its track is kept is played without one.

    def __init__(self, source: Source, names: Names, out: Out) -> None:
        self.source, self.names, self.out = source, names, out
        count, balls, _ = source.position.shape
        self.found = np.full((count, balls, 2, len(names)), math.nan)
        self.known = np.zeros(count, np.bool_)
        self.again = self.known.copy()

    def watch(self, part: slice, tracks: Tracks) -> None:
        """Follow the changes through these shots."""
        scene, duration = self.source.scene, self.out.duration[part]
        is_cut = (self.out.status[part] == OUT_OF_TIME) | (duration == scene.physics.max_time)
        numbers = changed_numbers(scene, self.names, "restitution.cue_ball" in self.source.vary)
        starts, work = self._starts(part), self.source.work(keeps=True)
        g = _follow(scene, work.scene, tracks, numbers, starts.shape[2])
        pass_ = compiled.follow_shots(follow_shots)
        ends = np.column_stack((tracks.ends, duration, is_cut))
        pass_(g, self.source.shots(part), starts, ends, self.found[part], self.known[part])

    def _starts(self, part: slice) -> Floats:
        """Return what the inputs change of the starts of some shots (S, N, K, P)."""
        source, is_off = self.source, is_gone(self.source.position[part])
        velocity, roll = (
            None if each is None else np.where(is_off[..., np.newaxis], 0.0, each[part])
            for each in (source.velocity, source.roll)
        )
        assert velocity is not None
        struck = source.watched if source.watched >= 0 else None
        return starts_of(source.scene, self.names, struck, velocity, roll)

    def see(self, k: int, run: Run) -> None:
        """Work out the derivatives of shot ``k``, which was not compiled."""
        self.found[k] = run.derivatives(self.names).final
        self.known[k] = self.again[k] = True

    def complete(self) -> None:
        """Work out the derivatives that are still missing, in Python."""
        for k in np.flatnonzero(~self.known & (self.out.status != CANNOT_START)).tolist():
            self.see(k, self.source.run(k, measures_policies=False))


def _follow(scene: Any, law: Any, tracks: Tracks, numbers: Any, size: int) -> Any:
    """Return what the compiled pass needs, in arrays."""
    (of_numbers, of_mass, of_radius), count = numbers, len(scene.balls)
    inputs, sides = of_mass.shape[1], table_of(scene, walls_differ(scene)).sides
    grids = zip(obstacles(scene), (9, 8, 6), strict=True)
    discs, faces, corners = (np.array(row, float).reshape(-1, width) for row, width in grids)
    own = np.array(own_of_walls(scene), float).reshape(-1, 2)
    ball, one = (np.zeros(n, dtype).view(np.recarray) for n, dtype in ((count, BALL), (1, CONTACT)))
    return Follow(
        tracks.rows, np.empty(len(tracks.rows), np.int64), tracks.events,
        (sides, np.unique(sides.first)), len(scene.cushions), own, law.cue, law, discs, faces,
        corners, ball, of_numbers, of_mass, of_radius, np.empty((count, size, inputs)),
        np.empty((count, inputs), np.bool_), np.empty(inputs), one[0],
        **columns.room(size, inputs), python=0,
    )  # fmt: skip


def follow_shots(g: Any, shots: Any, starts: Any, ends: Any, found: Any, known: Any) -> int:
    """Follow changes through some shots; mark the ``known`` ones, and return their number.

    ``ends`` (S, 4) tell where the breakpoints and the events of a shot end, how long (s) it takes,
    and whether it was cut there.
    """
    count = row = event = 0
    for s in range(len(known)):
        last, last_event = int(ends[s, 0]), int(ends[s, 1])
        if last > row:
            read(g, shots, starts[s], s)
            g.one.ends[0], g.one.ends[1] = ends[s, 2], ends[s, 3]
            note_following(g, row, last)
            changes.start(g, row)
            changes.follow(g, event, last_event)
            changes.finish(g)
            for i in range(len(g.ball)):
                rows.copy(g.change[i, :2], found[s, i])
            known[s] = True
            count += 1
        row, event = last, last_event
    return count


def read(g: Any, shots: Any, starts: Any, s: int) -> None:
    """Read the numbers of shot ``s``, and the changes of its start."""
    for k in range(len(g.one.numbers)):
        g.one.numbers[k] = shots.coefficients[s, k]
    for i in range(len(g.ball)):
        g.ball[i].mass, g.ball[i].radius = shots.mass[s, i], shots.radius[i]
        g.ball[i].gone = shots.is_off[s, i]
        for k in range(len(starts[i])):
            for p in range(len(g.late)):
                g.change[i, k, p] = starts[i, k, p]


def note_following(g: Any, first: int, last: int) -> None:
    """Note which breakpoint follows each one of a shot."""
    for i in range(len(g.ball)):
        g.ball[i].at = -1
    for k in range(last - 1, first - 1, -1):
        i = int(g.rows[k, 0])
        g.following[k], g.ball[i].at = g.ball[i].at, k


# -- twins -----------------------------------------------------------------------------------------


def _columns(g: Any) -> Any:
    return range(len(g.late))


def _is_idle(g: Any, p: int) -> bool:
    return not rows.is_changed(g.z, p)


def _any_of(flag: Any) -> Any:
    return flag


def _greater(one: float, other: float) -> float:
    return max(one, other)


def _unknown_if(flag: Any) -> float:
    return math.nan if flag else 0.0


def _path_of(g: Any, i: int) -> Path:
    row = g.rows[g.ball[i].at]
    return from_breakpoint(row[1], row[2], row[3], row[4], row[5], row[6], row[7])


def _surface_at(g: Any, wall: int, x: float, y: float, radius: float) -> Any:
    sides, first = g.walls
    side = nearest(sides, sides[first[wall]], x, y, radius)
    return kinds.normal(side, x, y), kinds.curvature(side, x, y)


def _advance(g: Any, own: Any, by_state: Any, by_pull: Any, of_pull: Any) -> None:
    for p in range(len(of_pull)):
        place = own[0, p], own[1, p]
        u, v, w, z, of = own[2, p], own[3, p], own[4, p], own[5, p], of_pull[p]
        for k in range(6):
            row = by_state[k]
            own[k, p] = row[2] * u + row[3] * v + row[4] * w + row[5] * z + by_pull[k] * of
        own[0, p] += place[0]
        own[1, p] += place[1]


def _advance_slowing(g: Any, own: Any, by_state: Any, by_pull: Any, of_pull: Any) -> None:
    x, y, u, v = by_state
    for p in range(len(of_pull)):
        by_u, by_v, of = own[2, p], own[3, p], of_pull[p]
        own[0, p] += x[2] * by_u + x[3] * by_v + by_pull[0] * of
        own[1, p] += y[2] * by_u + y[3] * by_v + by_pull[1] * of
        own[2, p] = u[2] * by_u + u[3] * by_v + by_pull[2] * of
        own[3, p] = v[2] * by_u + v[3] * by_v + by_pull[3] * of


def _saltate(g: Any, geometry: Geometry, balls: int, roll: Vector) -> None:
    """Do what the saltation matrix does, with the parts that are known already."""
    (nx, ny), (wx, wy), size, of = geometry.normal, roll, len(g.change[0]), g.one.slopes[0]
    z, before, after, law, count = g.z, g.one.before, g.one.after, balls * size + LAW, 2 * balls
    taken, of_roll, of_push, of_mu = taken_off(g, geometry, roll)
    for p in range(len(g.late)):
        if _is_idle(g, p):
            continue
        late, turn = g.late[p], g.parts[4, p]
        for c in range(balls):
            k, n, t = c * size, 0.0, 0.0
            for j in range(2 * count):
                part = g.parts[j, p] if j < count else z[law + j - count, p]
                n, t = n + of[2 * c, j] * part, t + of[2 * c + 1, j] * part
            for j in range(size):
                z[k + j, p] += before[k + j] * late
            z[k + 2, p] = nx * n - ny * t - after[k + 1] * turn
            z[k + 3, p] = ny * n + nx * t + after[k] * turn
            if size > 4 and balls == 1:
                part = nx * z[4, p] + ny * z[5, p] + (wy * nx - wx * ny) * turn
                less = of_roll * part + of_push * (n - g.parts[0, p]) + of_mu * z[law + 1, p]
                z[4, p] -= nx * less - ny * taken * turn
                z[5, p] -= ny * less + nx * taken * turn
            for j in range(size):
                z[k + j, p] -= after[k + j] * late


def _nothing(*_: Any) -> None:
    return


def _no(*_: Any) -> bool:
    return False


def _with_gap(g: Any, geometry: Any, i: int, other: int, t: float) -> Any:
    return geometry


TWINS: dict[Any, Any] = {
    columns.columns: _columns, columns.is_idle: _is_idle, columns.any_of: _any_of,
    columns.greater: _greater,
    columns.unknown_if: _unknown_if, columns.is_unknown: rows.is_unknown,
    columns.is_changed: rows.is_changed, columns.is_beyond: rows.is_beyond,
    columns.warn: _nothing, columns.keep: _nothing, columns.path_of: _path_of,
    columns.copy: rows.copy, columns.surface_at: _surface_at, columns.saltate: _saltate,
    columns.has_parted: _no, columns.advance: _advance,
    columns.advance_slowing: _advance_slowing,
    columns.is_of_errors: _no, errors.begin: _nothing, errors.misplace: _nothing,
    errors.delay: _nothing, errors.may_miss: _no, errors.with_gap: _with_gap,
    errors.make: _nothing, kinks.hit: kinds.ball_ball, kinks.bounce: kinds.cushion,
    kinks.jumps: kinds.jumps, kinks.hit_slopes: kinds.hit_slopes,
    kinks.bounce_slopes: kinds.cushion_slopes,
}  # fmt: skip
for _function, _twin in TWINS.items():
    _function.compiled = _twin
