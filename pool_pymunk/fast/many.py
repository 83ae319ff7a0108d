"""This module plays shots by the compiled loop, and follows small changes through them."""

from __future__ import annotations

import os
import time
import warnings
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast import compiled, loop, single
from pool_pymunk.fast.derivatives import Follower
from pool_pymunk.fast.given import shots_of, work_of
from pool_pymunk.fast.records import NOTHING, ROOM, Out, TableArrays, empty, nothing, tracks
from pool_pymunk.fast.tables import Form, can_compile, loop_form, table_of
from pool_pymunk.many.batch import CANNOT_START, STATUSES
from pool_pymunk.many.source import Source, is_gone
from pool_pymunk.many.workers import results
from pool_pymunk.model import SceneError, inputs
from pool_pymunk.model.plain import argument, whole
from pool_pymunk.results.run import Run

Done = Callable[[int], object]  # Its argument is how many more shots are done.
# A thread plays at most CHUNK shots before it takes the next ones, and at least FEW. With half or
# twice of CHUNK, 40,000 of the report's shot 1 take 1.03 and 1.2 times as long; 1,000 take as long
# with half of FEW, and 1.5 times as long with twice of it.
CHUNK, FEW = 4_096, 512
spent = defaultdict[Form, float](float)  # s, on shots that were played early, in this process
SLOW = "numba is not installed, so many shots take some hundred times longer than with the extra " \
    "fast: pip install 'pool-pymunk[fast]'"  # fmt: skip
# s; Python plays shots that take less time than this where their loop is not compiled yet. It is a
# quarter of the time that compilation takes (`python -m tests.loops`, docs/speed.md).
EARLY = 20.0


def derive(source: Source, names: inputs.Names, threads: int | None) -> dict[str, Any]:
    """Return the derivatives of the ends of all shots, as a Batch has them."""
    out = empty(*source.position.shape[:2])
    follower = Follower(source, names, out)
    play_all(source, out, threads, lambda _: None, follower)
    follower.complete()
    return {
        "derivatives": follower.found, "by": follower.names, "derived_in_python": follower.again
    }  # fmt: skip


def play_all(
    source: Source,
    out: Out,
    threads: int | None,
    done: Callable[[int], object],
    watcher: Any = None,
) -> NDArray[np.bool_]:
    """Play all shots, and tell which of them (S,) the exact solver has played.

    A ``watcher`` may ``watch(part, tracks)`` those that are compiled, and ``see(k, run)`` others.
    """
    cores, compiles = _threads(threads), _is_known(source)
    if compiles and not compiled.is_there():
        compiles = False
        warnings.warn(SLOW, stacklevel=3)
    done(0)
    first = play_early(source, out, done, watcher) if compiles else 0
    if compiles and first < len(out.status):
        play_compiled(source, out, first, cores, done, watcher)
    hard = np.asarray(out.status < 0)
    for k in np.flatnonzero(hard).tolist():
        play_in_python(source, out, k, watcher)
        done(1)
    return hard


def play_in_python(source: Source, out: Out, k: int, watcher: Any) -> None:
    """Play shot ``k`` as a single run, and write down its results."""
    try:
        run = source.run(k, measures_policies=False)
    except SceneError:
        out.status[k] = CANNOT_START
    else:
        _write(source, out, k, run)
        if watcher is not None:
            watcher.see(k, run)


def play_early(source: Source, out: Out, done: Done, watcher: Any) -> int:
    """Play shots in Python where that takes less time than to compile; return how many.

    What shots of this form took in this process before counts, too. Ends have the same bits, and
    derivatives are the same to rounding.
    """
    form, count = loop_form(source.scene), len(out.status)
    wanted = (loop.play_shots, *(watcher.compiles if watcher is not None else ()))
    if all(compiled.has_form(each, form) for each in wanted):
        return 0
    took = ahead = 0.0  # s
    for k in range(count):
        if spent[form] + ahead >= EARLY:
            return k
        began = time.perf_counter()
        play_in_python(source, out, k, watcher)
        done(1)
        now = time.perf_counter() - began
        took, spent[form] = took + now, spent[form] + now
        ahead = (count - k - 1) * took / (k + 1)
    return count


def _is_known(source: Source) -> bool:
    """Tell whether numba can compile ordinary shots."""
    return can_compile(source.scene, source.law) and "radius" not in source.vary


def _threads(asked: int | None) -> int:
    if asked is None:
        has_affinity = hasattr(os, "sched_getaffinity")
        return len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1
    return argument("threads", asked, whole(1))


def play_compiled(
    source: Source, out: Out, first: int, threads: int, done: Done, watcher: Any
) -> None:
    """Play all ordinary shots from the ``first`` one on, in chunks; hard ones keep their mark."""
    form, count = loop_form(source.scene), len(out.status)
    table, play = table_of(source.scene, form.differ), play_of(form)

    def work(part: slice) -> int:
        play_chunk(play, source, table, out, part, watcher)
        return int((out.status[part] >= 0).sum())  # Hard ones are not done yet.

    if watcher is not None:
        watcher.watch(slice(0, 0), tracks(0, 0))
    done(0)
    if first + 1 == count:  # A thread would take longer than the shot.
        done(work(slice(first, count)))
        return
    with ThreadPoolExecutor(threads) as pool:
        try:  # Each thread has one part waiting.
            for played in results(pool, work, _chunks(first, count, threads), 2 * threads):
                done(played)
        except BaseException:
            out.halt[0] = 1
            raise


def play_of(form: Form) -> Any:
    """Return the compiled loop of a form; compile it, or load it, if it is not there yet."""
    play = compiled.play_shots(*form)
    if not play.signatures:
        # To load it, nobody is waited for. This is the thread that an interrupt reaches.
        is_there = compiled.has_form(loop.play_shots, form)
        with nullcontext() if is_there else compiled.turn(play):
            play(np.zeros(1, dtype=form.work), *nothing(form.sides), 0, 0)
    single.remember(form, play)
    compiled.note_form(loop.play_shots, form)
    return play


def _chunks(first: int, count: int, threads: int) -> list[slice]:
    """Share the shots from the ``first`` one on out, so that each thread has some."""
    size = min(CHUNK, max(FEW, -(-(count - first) // threads)))
    return [slice(k, min(k + size, count)) for k in range(first, count, size)]


def play_chunk(
    play: Any, source: Source, table: TableArrays, out: Out, part: slice, watcher: Any = None
) -> int:
    """Play some shots by the compiled loop, and return how many."""
    work, shots, first = work_of(source, keeps=watcher is not None), shots_of(source, part), 0
    own = Out(*(each if each is out.halt else each[part] for each in out))
    count = len(own.status)
    kept = tracks(count, ROOM if watcher is not None else 0)
    while played := play(work, table, shots, own, kept, first, count):
        if watcher is not None:
            now = slice(part.start + first, part.start + first + played)
            watcher.watch(now, kept._replace(ends=kept.ends[first : first + played]))
        first += played
        if first == count:
            break
    if watcher is not None and watcher.replays:
        work[0].scene.keeps = 0
        for s in np.flatnonzero(own.status < 0).tolist():
            play(work, table, shots, own, kept, s, s + 1)
    return first


def _write(source: Source, out: Out, k: int, run: Run) -> None:
    """Write down the results of a run as those of shot ``k``."""
    scene, watched = source.scene, source.watched
    is_off = is_gone(source.position[k])
    out.status[k] = STATUSES.index(run.status)
    out.final[k] = np.where(is_off[:, np.newaxis], np.nan, run.end.position)
    out.duration[k], out.events[k] = run.duration, len(run.events)
    hits = [event for event in run.events if event.kind == "ball-ball"]
    out.hits[k] = len(hits)
    out.cushions[k] = sum(event.kind == "ball-cushion" for event in run.events)
    met = [{scene.index[id_] for id_ in event.balls} - {watched} for event in hits]
    others = [each.pop() for each in met if len(each) == 1]
    out.first_hit[k] = others[0] if others else NOTHING
    out.met[k, others] = True
    pockets = [hole.id for hole in scene.pockets]
    for id_, hole in run.pocketed.items():
        out.pocketed[k, scene.index[id_]] = pockets.index(hole)
