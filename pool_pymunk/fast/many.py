"""This module plays many exact shots at once, on all cores."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, Protocol

import numpy as np

from pool_pymunk.fast import compiled
from pool_pymunk.fast.batch import CANNOT_START, STATUSES, Batch
from pool_pymunk.fast.loop import HARD
from pool_pymunk.fast.records import NOTHING, Out, Table, Tracks, tracks
from pool_pymunk.fast.shots import Source, is_gone, read_source
from pool_pymunk.fast.tables import can_compile, law_number, table_of, work_of
from pool_pymunk.model import Scene, SceneError
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.physics.laws import Law
from pool_pymunk.results.run import Run

# This function is told of the tracks of these shots.
Watch = Callable[[slice, Tracks], object]
CHUNK = 4_096  # A thread plays this many shots at most before it takes the next ones.
FEW = 512  # So few shots are not shared out.
PATIENCE = 0.1  # s; so often an interrupt is looked for
SLOW = "numba is not installed, so each shot takes the Python solver, which gives the same bits " \
    "but is some hundred times slower: pip install 'pool-pymunk[fast]'"  # fmt: skip


def simulate_many(
    scene: Scene,
    position: Any = None,
    velocity: Any = None,
    *,
    law: str | Law | None = None,
    vary: Mapping[str, Any] | None = None,
    max_time: float | None = None,
    threads: int | None = None,
    on_done: Callable[[int], object] | None = None,
) -> Batch:
    """Play many shots exactly, and return where the balls end.

    ``position`` (m) and ``velocity`` (m/s) are arrays (S, N, 2), for S shots and the scene's N
    balls, or (N, 2) for all shots; by default they are the scene's own. NaN as a ball's position
    means that it is off the table. ``law`` is that of every contact (default: the scene's).
    ``vary`` has what else differs from shot to shot: arrays (S,) by the names of the table of
    inputs (:mod:`pool_pymunk.model.inputs`), such as ``restitution.cushion`` or ``mass.C``.
    ``speed``, ``angle`` and ``turn`` are those of the cue ball or, without one, of the first ball
    that moves. ``mass`` (kg) is that of all balls, and may be (S, N) too. ``max_time`` (s) ends
    each shot (default: the scene's). ``threads`` (default: one a core) share the work; the results
    do not depend on them. ``on_done(n)`` is called whenever ``n`` more shots are done.

    Every bit is that of ``simulate(..., solver="event-driven")``. With numba installed (``pip
    install 'pool-pymunk[fast]'``) ordinary shots are compiled. Without it, with more than 64 balls,
    with radii that differ from shot to shot, and with a law of your own that answers single hits
    otherwise than Coulomb, all shots take the Python solver. A shot takes 25 + 21 N bytes in the
    result. Raises SettingError, in one line that names the argument.

    >>> import numpy as np
    >>> from pool_pymunk import load
    >>> scene = load("two-balls")
    >>> velocity = np.zeros((3, 2, 2))
    >>> velocity[:, 0, 0] = [0.5, 1.0, 1.5]
    >>> batch = simulate_many(scene, velocity=velocity, max_time=2.0)
    >>> batch.hits.tolist(), bool((batch.final[1] == batch.run(1).end.position).all())
    ([1, 1, 1], True)
    """
    began = time.perf_counter()
    source = read_source(scene, position, velocity, vary, law, max_time)
    out = empty(*source.position.shape[:2])
    by_reference = play_all(source, out, threads, on_done or (lambda _: None))
    return Batch(
        scene=source.scene,
        law=source.asked.law,
        **{key: values for key, values in out._asdict().items() if key != "halt"},
        by_reference=by_reference,
        wall_time=time.perf_counter() - began,
        source=source,
    )


class Watcher(Protocol):
    """A watcher compares shots with another run: compiled ones by tracks, others by their runs."""

    def watch(self, part: slice, tracks: Tracks) -> None: ...

    def see(self, k: int, run: Run) -> None: ...


def play_all(
    source: Source,
    out: Out,
    threads: int | None,
    done: Callable[[int], object],
    watcher: Watcher | None = None,
) -> int:
    """Play all shots, and count those that the exact solver plays; a ``watcher`` sees all."""
    cores, compiles = _threads(threads), _compiles(source)
    if compiles:
        play_compiled(source, out, cores, done, watcher.watch if watcher else None)
    else:
        out.status[:] = HARD
    hard = np.flatnonzero(out.status < 0).tolist()
    for k in hard:
        run = play_in_python(source, out, k)
        if run is not None and watcher is not None:
            watcher.see(k, run)
        if not compiles:
            done(1)
    return len(hard)


def empty(count: int, balls: int) -> Out:
    """Return arrays for what comes of this many shots."""
    return Out(
        final=np.full((count, balls, 2), np.nan),
        duration=np.zeros(count),
        hits=np.zeros(count, np.int32),
        cushions=np.zeros(count, np.int32),
        first_hit=np.full(count, NOTHING, np.int32),
        met=np.zeros((count, balls), np.bool_),
        pocketed=np.full((count, balls), NOTHING, np.int32),
        events=np.zeros(count, np.int32),
        status=np.full(count, HARD, np.int8),
        halt=np.zeros(1, np.int64),
    )


def _compiles(source: Source) -> bool:
    """Tell whether ordinary shots can be compiled."""
    if not can_compile(source.scene, source.law) or "radius" in source.vary:
        return False
    if not compiled.is_there():
        warnings.warn(SLOW, stacklevel=4)
        return False
    return True


def _threads(asked: int | None) -> int:
    if asked is None:
        has_affinity = hasattr(os, "sched_getaffinity")
        return len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1
    return argument("threads", asked, whole(1))


def play_compiled(
    source: Source,
    out: Out,
    threads: int,
    done: Callable[[int], object],
    watch: Watch | None = None,
) -> None:
    """Play all ordinary shots, chunk by chunk on some threads; what is hard keeps its mark.

    The threads tell ``watch`` of the tracks.
    """
    play, table = compiled.play_shots(), table_of(source.scene)
    if not len(out.status):
        return

    def work(part: slice) -> int:
        return play_chunk(play, source, table, out, part, watch)

    with compiled.in_turn(play):
        work(slice(0, 0))  # This compiles, in the thread that an interrupt reaches.
    if len(out.status) == 1:  # A thread would take longer than the shot.
        done(work(slice(0, 1)))
        return
    with ThreadPoolExecutor(threads) as pool:
        try:
            for finished in _in_turn(pool, work, _chunks(len(out.status), threads), threads):
                done(finished)
        except BaseException:
            out.halt[0] = 1
            raise


def _in_turn(
    pool: ThreadPoolExecutor, work: Callable[[slice], int], parts: list[slice], threads: int
) -> Iterator[int]:
    """Let the threads work, each with one part waiting, and yield what they have done."""
    waiting, running = parts[::-1], set[Future[int]]()
    while waiting or running:
        while waiting and len(running) < 2 * threads:
            running.add(pool.submit(work, waiting.pop()))
        finished, running = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED)
        yield from (each.result() for each in finished)


def _chunks(count: int, threads: int) -> list[slice]:
    """Share the shots out, so that each thread has some."""
    size = min(CHUNK, max(FEW, -(-count // threads)))
    return [slice(first, min(first + size, count)) for first in range(0, count, size)]


def play_chunk(
    play: Callable[..., int],
    source: Source,
    table: Table,
    out: Out,
    part: slice,
    watch: Watch | None = None,
) -> int:
    """Play some shots by the compiled loop, and return how many."""
    latest = source.asked.settings.max_time
    latest, law = np.inf if latest is None else latest, law_number(source.law)
    work = work_of(source.scene, law, source.watched, latest, watch is not None)
    own = Out(*(each if each is out.halt else each[part] for each in out))
    shots, count = source.shots(part), len(own.status)
    if watch is None:
        return play(work, table, shots, own, tracks(0, 0), 0, count)
    first, kept = 0, tracks(count)
    while True:
        played = play(work, table, shots, own, kept, first, count)
        if not played:
            return first
        own_ends = kept.ends[first : first + played]
        now = slice(part.start + first, part.start + first + played)
        watch(now, kept._replace(ends=own_ends))
        first += played


def play_in_python(source: Source, out: Out, k: int) -> Run | None:
    """Play shot ``k`` by the exact solver, and write down what came of it; None: no start."""
    try:
        run = source.run(k, measures_policies=False)
    except SceneError:
        out.status[k] = CANNOT_START
        return None
    out.status[k] = STATUSES.index(run.status)
    _write(source, out, k, run)
    return run


def _write(source: Source, out: Out, k: int, run: Run) -> None:
    """Write down what came of a run."""
    scene, watched = source.scene, source.watched
    is_off = is_gone(source.position[k])
    out.final[k] = np.where(is_off[:, np.newaxis], np.nan, run.end.position)
    out.duration[k], out.events[k] = run.duration, len(run.events)
    hits = [event for event in run.events if event.kind == "ball-ball"]
    out.hits[k] = len(hits)
    out.cushions[k] = sum(event.kind == "ball-cushion" for event in run.events)
    met = [{scene.index[id_] for id_ in event.balls} - {watched} for event in hits]
    others = [each.pop() for each in met if len(each) == 1]
    out.first_hit[k] = others[0] if others else NOTHING
    out.met[k, others] = True
    pockets = {hole.id: number for number, hole in enumerate(scene.pockets)}
    for id_, hole in run.pocketed.items():
        out.pocketed[k, scene.index[id_]] = pockets[hole]
