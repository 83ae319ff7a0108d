"""Many shots are given to the core here, as bytes of arrays, and what it gives is read."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core import batch, layouts
from pool_pymunk.core.beside import Beside
from pool_pymunk.core.record import Recorder
from pool_pymunk.core.table import Table
from pool_pymunk.core.tangent.follower import Follower
from pool_pymunk.many.batch import CANNOT_START, NON_FINITE, SETTLED
from pool_pymunk.many.source import NOTHING, Begun, Floats, Ints, Source, is_gone, rows_of
from pool_pymunk.many.workers import EACH as PIECES
from pool_pymunk.many.workers import Workers, check_halt
from pool_pymunk.model import Scene, SceneError, inputs
from pool_pymunk.results.run import FIGURES
from pool_pymunk.solvers.by_core import shots_of
from pool_pymunk.solvers.from_core import floats_in, ints_in
from pool_pymunk.solvers.in_core import floor_of, new_table_of, table_of
from pool_pymunk.solvers.small_changes import (
    corners_of,
    has_derivatives,
    inputs_of,
    rounding_errors_of,
)

Done = Callable[[int], object]  # Its argument is how many more shots are done.
Make = Callable[[], Beside]  # It returns a reference, with which shots are compared.

# The core plays so many shots at first, and then four times as many each time up to the most, while
# that takes less than SHORT (s). A call of the core costs as much as fifty shots of two events.
FEWEST, MOST = 256, 2048
SHORT = 0.1
HANDFUL = 16  # at first, and for a worker, where each is played as a run, too
LARGEST = 8_192  # shots are sent to a worker at once, at most
MANY = 16  # processes, where their number is not known
GONE = (np.nan, 0.0)  # stand for the velocity and the roll of a ball off the table
COLUMNS = inputs.column_of("coefficients")
CLOSE, ROUNDED = 1e-6, 1e-12  # of a radius, and of a place; balls with wider gaps do not touch
OF_SURFACE = ("friction.surface", "friction.rolling")


class Results(NamedTuple):
    """These are the results of shots, in arrays as in a :class:`~pool_pymunk.Batch`."""

    final: Floats
    duration: Floats
    events: Ints
    hits: Ints
    cushions: Ints
    first_hit: Ints
    pocketed: Ints
    met: NDArray[np.bool_]
    status: NDArray[np.int8]
    in_doubt: NDArray[np.bool_]
    derivatives: Floats  # (S, N, 2, P), by the inputs of the source
    beside: Floats  # (S, 1 + N): what was found beside a reference, or (S, 0)
    figures: Floats  # (S, 3): how far (m) ends may have been moved, by each of ``FIGURES``, or none

    def part(self, which: slice) -> Results:
        """Return views of the results of some shots."""
        arrays: Sequence[NDArray[Any]] = self
        return Results(*(each[which] for each in arrays))

    def put(self, part: slice, other: Results) -> None:
        """Put the results of some shots in their place."""
        arrays: Sequence[NDArray[Any]] = self.part(part)
        for own, each in zip(arrays, other, strict=True):
            own[:] = each


def no_results(source: Source, count: int, has_reference: bool) -> Results:
    """Return the results of so many shots that were not played, perhaps beside a reference.

    Whoever plays them puts all ends in.
    """
    balls = source.position.shape[1]
    whole = np.zeros((4, count), np.int32)
    return Results(
        final=np.empty((count, balls, 2)), duration=np.zeros(count), events=whole[0],
        hits=whole[1], cushions=whole[2], first_hit=whole[3] + NOTHING,
        pocketed=np.full((count, balls), NOTHING, np.int32), met=np.zeros((count, balls), np.bool_),
        status=np.full(count, CANNOT_START, np.int8), in_doubt=np.zeros(count, np.bool_),
        derivatives=np.full((count, balls, 2, len(source.by)), np.nan),
        beside=np.zeros((count, (1 + balls) * has_reference)),
        figures=np.full((count, len(FIGURES) * source.has_figures), np.nan),
    )  # fmt: skip


class Hearing(Recorder):
    """While this listens, Python hears an interrupt: compiled code never looks for one."""

    def pause(self, t: float) -> None:
        """End the work of a worker for which nobody waits any more."""
        check_halt()


def play_all(
    source: Source, done: Done, workers: Workers | None = None, make: Make | None = None
) -> Results:
    """Play all shots of a source, here or by workers; compare them with what ``make`` returns."""
    count = len(source.position)
    found = no_results(source, count, make is not None)
    first = began = time.perf_counter()
    for part in play_parts(source, found, make):
        done(part.stop - part.start)
        took, began = time.perf_counter() - began, time.perf_counter()
        ahead = (count - part.stop) * took / (part.stop - part.start)
        if began - first < SHORT < ahead:
            continue  # Much of that was to lay the table: the next parts tell more.
        if workers is not None and part.stop < count and workers.are_worth(ahead):
            for its, there in share_out(source, workers, part.stop, make):
                found.put(its, there)
                done(its.stop - its.start)
            break
    return found


def share_out(
    source: Source, workers: Workers, first: int, make: Make | None
) -> Iterator[tuple[slice, Results]]:
    """Let workers play the shots from the ``first`` one on; yield what comes of some of them."""
    count, fewest = len(source.position), HANDFUL if source.has_figures else FEWEST
    size = min(LARGEST, max(fewest, (count - first) // (PIECES * (workers.count or MANY))))
    parts = (slice(k, min(k + size, count)) for k in range(first, count, size))
    begun = Begun(source.position, source.velocity, dict(source.vary), source.roll)
    none = changed(begun, lambda each: each[:0])
    head = source._replace(**none._asdict(), struck=source.watched)

    def some(part: slice) -> tuple[slice, Begun]:  # One row stands for many that are alike.
        return part, changed(begun, lambda each: each[:1] if each.strides[0] == 0 else each[part])

    return workers.share(play_some, (head, make), map(some, parts))


def changed(begun: Begun, change: Callable[[Floats], Floats]) -> Begun:
    """Return how shots begin, with all arrays changed."""
    position, velocity, vary, roll = begun
    others = {key: change(each) for key, each in vary.items()}
    return Begun(change(position), change(velocity), others, None if roll is None else change(roll))


def play_some(
    common: tuple[Source, Make | None], some: tuple[slice, Begun]
) -> tuple[slice, Results]:
    """Play some shots of a source, in any process."""
    (head, make), (part, begun), count = common, some, some[0].stop - some[0].start
    whole = changed(begun, lambda each: np.broadcast_to(each, (count, *each.shape[1:])))
    return part, play_all(head._replace(**whole._asdict()), lambda _: None, None, make)


def play_parts(source: Source, found: Results, make: Make | None) -> Iterator[slice]:
    """Play the shots of a source, put what comes of them into results, and yield which ones."""
    count, first = len(source.position), 0
    size = HANDFUL if source.has_figures else FEWEST
    beside = None if make is None else make()
    one_by_one = partial(play_singly, beside)
    play = one_by_one if has_scenes_of_its_own(source) else Player(source, beside).play
    while first < count:
        began = time.perf_counter()
        part = slice(first, min(first + size, count))
        play(source, part, found.part(part))
        yield part
        first = part.stop
        size = min(MOST, 4 * size) if time.perf_counter() - began < SHORT else size


def has_scenes_of_its_own(source: Source) -> bool:
    """Tell whether each shot has a scene of its own, which the core cannot set by numbers.

    Larger balls may not fit, and a scene of a user's own class has what its numbers make of it.
    """
    return "radius" in source.vary or (bool(source.vary) and type(source.scene) is not Scene)


def play_singly(beside: Beside | None, source: Source, part: slice, found: Results) -> None:
    """Play each shot on a table of its own; a shot without a sound scene cannot start."""
    found.final[:] = np.nan
    for k in range(part.start, part.stop):
        with suppress(SceneError):
            one = source._replace(scene=source.scene_of(k), vary={}, struck=source.watched)
            own = found.part(slice(k - part.start, k - part.start + 1))
            Player(one, beside).play(one, slice(k, k + 1), own)


class Player:
    """A player has the table, the balls and the engine by which the core plays shots."""

    def __init__(self, source: Source, beside: Beside | None = None) -> None:
        scene = source.scene
        self.has_coefficients = not source.vary.keys() <= {"mass"}
        table = new_table_of(scene) if self.has_coefficients else table_of(scene)
        self.shots = shots_of(scene, source.asked.settings, table)
        self.shots.watched = source.watched
        self.beside = self.shots.beside = beside
        self.follower = follower_of(source) if source.by or source.has_figures else None
        self.shots.follower = self.follower
        if self.has_coefficients:
            self.shots.coefficients = coefficients_in_core(scene, table)

    def play(self, source: Source, part: slice, found: Results) -> None:
        """Play some shots, and put what comes of them into results."""
        scene, count = source.scene, part.stop - part.start
        is_off, places = layout_of(source, part)
        coefficients, is_sound = np.empty(0), None
        if self.has_coefficients:
            coefficients, is_sound = coefficients_of(scene, source.vary, part)
        masses = source.vary["mass"][part] if "mass" in source.vary else np.empty(0)
        changing, starts = starts_of(source, part, places, is_off)
        if self.follower is not None:
            self.follower.give(*changes_of_starts(source, part, is_off))
        given = batch.Given(changing, starts, coefficients.tobytes(), masses.tobytes())
        ends = self.shots.play(count, given, Hearing())
        read_ends(found, ends, places, is_off)
        if self.follower is not None and source.by:
            read_changes(found.derivatives, self.follower)
        if self.beside is not None:
            found.beside[:] = np.frombuffer(self.beside.take()).reshape(count, -1)
        if is_sound is not None:
            found.status[~is_sound], found.derivatives[~is_sound] = CANNOT_START, np.nan
        if self.follower is not None and source.has_figures:
            is_open = found.in_doubt | touch_at_first(scene, places, is_off)
            is_open[ints_in(ends.guesses)] = True
            put_figures(found, source, part.start, floats_in(self.follower.roundings), is_open)


def layout_of(source: Source, part: slice) -> tuple[NDArray[np.bool_], Floats]:
    """Return which balls of some shots are off the table (S, N), and all places (S, N, 2).

    One row stands for all shots if their balls lie where those of the first one do.
    """
    some = rows_of(source.position[part])
    is_off = is_gone(some)
    if not is_off.any():
        return is_off, some
    return is_off, source.places(slice(part.start, part.start + len(some)), is_off)


def starts_of(
    source: Source, part: slice, places: Floats, is_off: NDArray[np.bool_]
) -> tuple[list[int], list[bytes]]:
    """Return which balls begin otherwise in some of these shots than in the first, and how.

    Places, velocities and rolls are bytes of arrays, as the core reads them.
    """
    columns = [places, source.velocity[part]]
    if source.roll is not None:
        columns.append(source.roll[part])
    if is_off.any():
        for k, gone in zip(range(1, len(columns)), GONE, strict=False):
            columns[k] = np.where(is_off[..., np.newaxis], gone, columns[k])
    changes = [changes_in(each) for each in columns]
    changing = np.flatnonzero(np.any(changes, axis=0))
    starts = [each[0].tobytes() for each in columns]
    for k, (each, its) in enumerate(zip(columns, changes, strict=True)):
        if its.any():
            starts[k] += each[1:].take(changing, axis=1).tobytes()
    return changing.tolist(), starts


def changes_in(column: Floats) -> NDArray[np.bool_]:
    """Tell of which balls (N,) some pair of numbers (S, N, 2) is not that of the first shot."""
    column = rows_of(column)
    bits = column.reshape(len(column), -1).view(np.int64)
    changes: NDArray[np.bool_] = (bits[1:] != bits[:-1]).any(axis=0).reshape(-1, 2).any(axis=1)
    return changes


def read_ends(found: Results, ends: batch.Ends, places: Floats, is_off: NDArray[np.bool_]) -> None:
    """Put into results what the core says has become of shots."""
    counts = ints_in(ends.counts).reshape(-1, 4)
    for k, each in enumerate((found.events, found.hits, found.cushions, found.first_hit)):
        each[:] = counts[:, k]
    found.status[:] = SETTLED
    which, endings = ints_in(ends.endings).reshape(-1, 2).T
    found.status[which], found.in_doubt[ints_in(ends.doubts)] = endings, True
    found.duration[:] = floats_in(ends.durations)
    found.final[:] = places
    if is_off.any():
        found.final[np.broadcast_to(is_off, found.met.shape)] = np.nan
    # A place is written at once, as a complex number of 16 bytes: that is six times as fast.
    there = floats_in(ends.places).view(complex)
    found.final.reshape(-1).view(complex)[ints_in(ends.moved)] = there
    found.met.reshape(-1)[ints_in(ends.met)] = True
    which, pockets = ints_in(ends.pocketed).reshape(-1, 2).T
    found.pocketed.reshape(-1)[which] = pockets


# -- figures ---------------------------------------------------------------------------------------


def put_figures(
    found: Results, source: Source, first: int, roundings: Floats, is_open: NDArray[np.bool_]
) -> None:
    """Put the figures of shots from the ``first`` one on into results.

    A shot is played as a run where policies may have decided something (it ``is_open``), and where
    its course does not tell what rounding does: to less than a radius.
    """
    found.figures[:] = 0.0
    found.figures[:, FIGURES.index("rounding")] = roundings
    small = min(ball.radius for ball in source.scene.balls)
    has_ended = found.status < NON_FINITE
    found.figures[~has_ended] = np.nan
    for k in np.flatnonzero(has_ended & (is_open | ~(roundings < small))).tolist():
        check_halt()
        run = source.run(first + k)
        found.figures[k] = [getattr(run, name) for name in FIGURES]


def touch_at_first(scene: Scene, places: Floats, is_off: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell in which shots (S,) balls may touch each other or a wall as they begin."""
    close = ROUNDED * np.abs(places).max(initial=0.0)
    radii = [(1.0 + CLOSE) * ball.radius + close for ball in scene.balls]
    there = np.where(is_off[..., np.newaxis], np.nan, places)
    free = layouts.may_lie(floor_of(scene), radii, there.tobytes(), 0.0)
    return np.asarray(~np.frombuffer(free, np.bool_).reshape(is_off.shape).all(axis=1))


# -- small changes ---------------------------------------------------------------------------------


def follower_of(source: Source) -> Follower:
    """Return what follows small changes of the inputs ``by`` which a source is to be derived.

    Where figures are asked for it follows rounding errors, too, unless a surface is somebody's own.
    """
    scene = source.scene
    numbers = inputs.changed_numbers(scene, source.by, "restitution.cue_ball" in source.vary)
    none = np.empty((0, 0, len(source.by)))
    found = Follower(corners_of(scene), inputs_of(scene, none, numbers))
    if source.has_figures and has_derivatives(scene):
        found.errors = rounding_errors_of(scene)
    return found


def read_changes(derivatives: Floats, follower: Follower) -> None:
    """Put what a follower has found into derivatives (S, N, 2, P)."""
    which, its = ints_in(follower.changed), derivatives.shape[2:]
    derivatives[:] = 0.0
    derivatives.reshape(-1, *its)[which] = floats_in(follower.rows).reshape(-1, *its)
    derivatives[ints_in(follower.missing)] = np.nan


def changes_of_starts(
    source: Source, part: slice, is_off: NDArray[np.bool_]
) -> tuple[list[int], list[int], list[float]]:
    """Return how many numbers of each shot's start change, and which ones by how much."""
    struck = source.watched if source.watched >= 0 else None
    velocity = np.where(is_off[..., np.newaxis], 0.0, source.velocity[part])
    roll = None
    if source.roll is not None:
        roll = np.where(is_off[..., np.newaxis], 0.0, source.roll[part])
    changes = inputs.starts_of(source.scene, source.by, struck, velocity, roll)
    shots, *which = np.nonzero(changes)
    counts = np.bincount(shots, minlength=len(changes))
    values = changes[shots, *which]
    return counts.tolist(), np.stack(which, axis=-1).ravel().tolist(), values.tolist()


# -- coefficients ----------------------------------------------------------------------------------


def coefficients_in_core(scene: Scene, table: Table) -> batch.Coefficients:
    """Return what puts coefficients on a table of a scene: walls without their own have them."""
    count, posts = scene.first_post, [*enumerate(scene.posts, start=scene.first_post)]
    bounce = table.walls[:count] + [table.walls[k] for k, p in posts if p.restitution is None]
    rub = table.walls[:count] + [table.walls[k] for k, p in posts if p.friction is None]
    return batch.Coefficients(table, bounce, rub, scene.patch_rates)


def coefficients_of(
    scene: Scene, vary: Mapping[str, Floats], part: slice
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the coefficients of some shots (S, 7), and which of these shots have sound ones.

    The others have the scene's.
    """
    r, f, surface = scene.restitution, scene.friction, scene.surface
    cue = r.ball_ball if r.cue_ball is None else r.cue_ball
    own = [r.ball_ball, cue, r.cushion, surface.pull, f.cushion, f.ball_ball, surface.drag]
    count = len(next(iter(vary.values()))[part])
    rows = np.tile(np.nan_to_num(np.array(own, float)), (count, 1))
    for key, values in vary.items():
        if key in COLUMNS:
            unit = scene.physics.gravity if key in OF_SURFACE else 1.0
            rows[:, COLUMNS[key]] = values[part] * unit
    if "restitution.cue_ball" not in vary and r.cue_ball is None:
        rows[:, 1] = rows[:, 0]  # The cue ball is as any other.
    is_sound = np.ones(count, np.bool_)
    if surface.rolls:
        sliding, rolling = (
            vary[key][part] if key in vary else getattr(f, key.split(".")[1]) for key in OF_SURFACE
        )
        for patch in (None, *scene.patches):
            pull, drag = (None, None) if patch is None else (patch.surface, patch.rolling)
            is_sound &= (rolling if drag is None else drag) <= (sliding if pull is None else pull)
    rows[~is_sound] = np.nan_to_num(np.array(own, float))
    return rows, is_sound
