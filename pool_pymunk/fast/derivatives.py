"""This module follows small changes of the inputs through compiled shots.

numba compiles the pass of :mod:`pool_pymunk.physics.changes`. Some of its functions have a *twin*
here: what Python does with all inputs at once, numba does with one after the other, and what Python
asks of objects, numba asks of the laws and sides that it knows.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from pool_pymunk.fast import compiled, kinds
from pool_pymunk.fast.given import shots_of, work_of
from pool_pymunk.fast.loop import OUT_OF_TIME
from pool_pymunk.fast.records import NOTHING, SCENE, F, I, Out, Shots, Tracks
from pool_pymunk.fast.tables import (
    can_compile,
    cue_of,
    law_number,
    loop_form,
    own_of_walls,
    table_of,
    walls_differ,
)
from pool_pymunk.fast.walls import nearest
from pool_pymunk.many.batch import CANNOT_START
from pool_pymunk.many.source import Floats, Source, is_gone
from pool_pymunk.model.inputs import Names, changed_numbers, starts_of
from pool_pymunk.model.obstacles import obstacles
from pool_pymunk.physics import changes, columns, contact_changes, kinks
from pool_pymunk.physics.columns import ONE, Follow
from pool_pymunk.physics.contact import Vector
from pool_pymunk.physics.motion_changes import FOLLOWED, UNCHANGED
from pool_pymunk.physics.path import Path, from_breakpoint
from pool_pymunk.physics.saltation import LAW, MOST, Geometry, taken_off
from pool_pymunk.results.run import Run

BALL = np.dtype([("at", I), ("met", I), ("gone", I), ("mass", F), ("radius", F)])
UNKNOWN = -1  # A shot has not been followed.
FEW = 64  # More touches find room than four for each event; beyond that Python follows the run.
CONTACT = np.dtype([(name, F, shape) for name, shape in ONE.items()])


# The pass keeps how late each event is `lates` (E, P), and what it has `found`: when (s) it lost
# something, and why (F, 2). It keeps when (s) which ball came to which breakpoint `places` (K, 3),
# with its `changes` there (K, K', P). So many rows of both are `used`. Where there is no room for
# places, nothing is kept.
Kept = namedtuple("Kept", "lates found places changes used")


def room_for(events: int, places: int, size: int, inputs: int) -> Kept:
    """Return room for what the pass keeps."""
    empty = np.empty
    return Kept(empty((events, inputs)), empty((places, 2)), empty((places, 3)),
                empty((places, size, inputs)), np.zeros(2, I))  # fmt: skip


class Follower:
    """A follower watches shots, and works out the derivatives of their ends by ``names``.

    ``found`` (S, N, 2, P) has them. ``why`` (S,) is FOLLOWED for shots whose derivatives are there,
    and ``again`` (S,) marks those among them whose derivatives were worked out in Python.
    """

    replays = True  # A shot that is hard while its track is kept is played without one.

    def __init__(self, source: Source, names: Names, out: Out) -> None:
        self.compiles = (follow_shots,)  # besides the shots
        self.source, self.names, self.out = source, names, out
        count, balls, _ = source.position.shape
        self.found = np.full((count, balls, 2, len(names)), math.nan)
        self.why = np.full(count, UNKNOWN, np.int8)
        self.again = np.zeros(count, np.bool_)

    def watch(self, part: slice, tracks: Tracks) -> None:
        """Follow the changes through these shots."""
        scene, duration = self.source.scene, self.out.duration[part]
        is_cut = (self.out.status[part] == OUT_OF_TIME) | (duration == scene.physics.max_time)
        numbers = changed_numbers(scene, self.names, "restitution.cue_ball" in self.source.vary)
        starts, work = self._starts(part), work_of(self.source, keeps=True)
        g = _follow(scene, work[0].scene, tracks, numbers, starts.shape[2])
        pass_ = compiled.follow_shots(follow_shots)
        ends = np.column_stack((tracks.ends, duration, is_cut, np.zeros(len(duration))))
        pass_(g, shots_of(self.source, part), starts, ends, self.found[part], self.why[part])
        compiled.note_form(follow_shots, loop_form(scene))

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
        self.why[k], self.again[k] = FOLLOWED, True

    def complete(self) -> None:
        """Work out the derivatives that are still missing, in Python."""
        for k in np.flatnonzero((self.why < 0) & (self.out.status != CANNOT_START)).tolist():
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
        corners, ball, np.vstack((of_numbers[:UNCHANGED], np.zeros(inputs))), of_mass, of_radius,
        np.empty((count, size, inputs)), np.empty((count, inputs), np.bool_), np.empty(inputs),
        one[0],
        **columns.room(size, inputs), signs=np.empty((0, 0)), alike=np.empty((0, 0, 0, 0)),
        drawn=np.zeros(2, I), anchors=np.empty((0, 2)), kept=room_for(0, 0, size, inputs),
        borders=np.array(scene.ground.borders, float).reshape(-1, 6),
        ground=np.array(scene.ground.own, float).reshape(-1, 2),
    )  # fmt: skip


def follow_run(g: Any, run: Run) -> int | None:
    """Follow the changes through a single run by the compiled pass.

    Return why errors cannot be followed, or None where the pass cannot be asked: this machine has
    not compiled it yet, or the law or a side is somebody's own.
    """
    scene, law = run.scene, g.law
    is_known = law_number(law) != NOTHING and can_compile(scene, law)
    if not is_known or not compiled.has_form(follow_shots, loop_form(scene)):
        return None
    record = np.zeros(1, SCENE).view(np.recarray)[0]
    record.kind, record.cue = law_number(law), cue_of(scene)
    (balls, size, inputs), events = g.change.shape, len(g.events)
    is_of_errors = len(g.signs) > 0
    kept = room_for(events, 0 if is_of_errors else balls + 4 * events + FEW, size, inputs)
    numbers = g.of_numbers, g.of_mass, g.of_radius
    h = _follow(scene, record, Tracks(g.rows, g.events, None), numbers, size)._replace(
        signs=g.signs, alike=g.alike, anchors=np.array(g.anchors, float).reshape(-1, 2), kept=kept
    )
    ends = np.array([[len(g.rows), events, *g.one.ends[:3]]])
    why, places = np.full(1, UNKNOWN, np.int8), np.zeros((1, balls, size, inputs))
    pass_ = compiled.follow_shots(follow_shots)
    pass_(h, _shot_of(g), g.change[np.newaxis], ends, places, why)
    if kept.used[0] > len(kept.places) or kept.used[1] > len(kept.found):
        return None
    g.change[:] = h.change
    take(g, kept)
    return int(why[0])


def _shot_of(g: Any) -> Shots:
    """Return the only shot of a run as the pass asks for it."""
    none = np.empty((1, 0, 2))
    return Shots(
        none, none, none, np.array([[ball.gone for ball in g.ball]], I).reshape(1, -1),
        np.array([[ball.mass for ball in g.ball]]), np.array([ball.radius for ball in g.ball]),
        g.one.numbers[np.newaxis],
    )  # fmt: skip


def take(g: Any, kept: Kept) -> None:
    """Take over what the pass has kept."""
    for k, (t, i, at) in enumerate(kept.places[: kept.used[0]].tolist()):
        g.kept.changes[int(i)].append((t, int(at), kept.changes[k]))
    g.kept.found += [(t, int(why)) for t, why in kept.found[: kept.used[1]].tolist()]
    g.kept.lates += list(kept.lates)


def follow_shots(g: Any, shots: Any, starts: Any, ends: Any, found: Any, why: Any) -> int:
    """Follow changes through some shots; write ``why`` some cannot be followed, or FOLLOWED.

    ``ends`` (S, 5) tell where the breakpoints and the events of a shot end, how long (s) it takes,
    and whether it was cut there, or by the number of its events. Return the number of shots.
    """
    count = row = event = 0
    for s in range(len(why)):
        last, last_event = int(ends[s, 0]), int(ends[s, 1])
        if last > row:
            read(g, shots, starts[s], s)
            for k in range(3):
                g.one.ends[k] = ends[s, 2 + k]
            note_following(g, row, last)
            changes.start(g, row)
            why[s] = changes.follow(g, event, last_event)
            if why[s] == FOLLOWED:
                why[s] = changes.finish(g)
            for i in range(len(g.ball)):
                _copy(g.change[i, :2], found[s, i])
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
    return not _is_changed(g.z, p)


def _is_changed(own: Any, p: int) -> bool:
    for k in range(own.shape[0]):  # noqa: SIM110
        if own[k, p] != 0.0:
            return True
    return False


def _is_unknown(own: Any) -> bool:
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            if own[k, p] == own[k, p]:
                return False
    return True


def _is_beyond(own: Any) -> bool:
    found = False
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            found |= abs(own[k, p]) > MOST
    return found


def _copy(own: Any, there: Any) -> None:
    for k in range(own.shape[0]):
        for p in range(own.shape[1]):
            there[k, p] = own[k, p]


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
    side = nearest(sides[first[wall]], sides, 0.0, x, y, radius)
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
    """Do what the saltation matrix does; the parts are known already, except for errors."""
    if columns.is_of_errors(g):
        for p in range(len(g.late)):
            g.late[p] = contact_changes.put_parts(g, geometry, balls, p)
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


def _warn(g: Any, why: int, t: float) -> None:
    found, used = g.kept.found, g.kept.used
    last = min(used[1], len(found)) - 1
    if last >= 0 and found[last, 0] == t and found[last, 1] == why:
        return
    if used[1] < len(found):
        found[used[1], 0], found[used[1], 1] = t, why
    used[1] += 1


def _keep(g: Any, k: int, i: int, j: int, t: float) -> None:
    kept = g.kept
    if len(kept.places) == 0:
        return
    if k >= 0:
        for p in range(len(g.late)):
            kept.lates[k, p] = g.late[p]
    for c in range(1 if j == i else 2):
        n, row = i if c == 0 else j, kept.used[0]
        if row < len(kept.places):
            kept.places[row, 0], kept.places[row, 1], kept.places[row, 2] = t, n, g.ball[n].at
            _copy(g.change[n], kept.changes[row])
        kept.used[0] += 1


def _squared(number: float) -> float:
    return number * number


def _sign(g: Any, row: int, k: int, p: int, source: int) -> float:
    return float(g.signs[row + k, p] + g.alike[source, g.drawn[1], k, p])


def _add_sized(g: Any, own: Any, sizes: Any, first: int, source: int) -> None:
    for k in range(len(sizes)):
        if sizes[k] != 0.0:
            for p in range(len(g.late)):
                own[k, p] += sizes[k] * _sign(g, first, k, p, source)


def _add_mixed(g: Any, own: Any, mixed: Any, first: int, source: int) -> None:
    for k in range(len(mixed)):
        for p in range(len(g.late)):
            for n in range(len(mixed[k])):
                own[k, p] += mixed[k][n] * _sign(g, first, n, p, source)


TWINS: dict[Any, Any] = {
    columns.columns: _columns, columns.is_idle: _is_idle, columns.any_of: _any_of,
    columns.greater: _greater,
    columns.unknown_if: _unknown_if, columns.is_unknown: _is_unknown,
    columns.is_changed: _is_changed, columns.is_beyond: _is_beyond,
    columns.warn: _warn, columns.keep: _keep, columns.path_of: _path_of,
    columns.copy: _copy, columns.surface_at: _surface_at, columns.saltate: _saltate,
    columns.advance: _advance,
    columns.advance_slowing: _advance_slowing,
    columns.squared: _squared, columns.add_sized: _add_sized, columns.add_mixed: _add_mixed,
    kinks.hit_slopes: kinds.hit_slopes, kinks.bounce_slopes: kinds.cushion_slopes,
}  # fmt: skip
for _function, _twin in TWINS.items():
    _function.compiled = _twin
