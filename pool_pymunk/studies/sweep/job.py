"""This module plays a sweep part by part: here, in other processes, or on a cluster."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from pool_pymunk.fast import simulate_many
from pool_pymunk.model import Scene, Shot
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.laws import Law
from pool_pymunk.studies.sweep.parts import begin, read_manifest, write_part
from pool_pymunk.studies.sweep.plan import Inputs, Plan, make_plan

CHUNK = 50_000
WINDOW = 1_000  # This many parts wait for an executor at most.
PATIENCE = 0.5  # s; so often an interrupt is looked for


class Done(NamedTuple):
    """This says how many shots are done now, and how many of them the exact solver played.

    ``total`` counts all shots of the sweep.
    """

    shots: int
    by_reference: int
    total: int


class Sweep(NamedTuple):
    """A sweep's folder, and what was done in this call: the rest was there already.

    ``shots`` counts all shots of the sweep, ``played`` those of this call, and ``by_reference``
    those that the exact solver played in Python. ``wall_time`` is in s.
    """

    out: Path
    shots: int
    played: int
    by_reference: int
    wall_time: float


def sweep(
    scene: Scene,
    shot: Shot | str | int | None = None,
    *,
    vary: Mapping[str, Any] | None = None,
    grid: Mapping[str, Any] | None = None,
    samples: int | None = None,
    seed: int = 0,
    out: str | Path,
    chunk: int = CHUNK,
    law: str | Law | None = None,
    max_time: float | None = None,
    executor: Executor | None = None,
    resume: bool = True,
    on_done: Callable[[Done], object] | None = None,
) -> Sweep:
    """Play many shots into a folder of Parquet files, and go on where an earlier call ended.

    ``vary`` has the ranges from which inputs are drawn, ``grid`` those that are gone through in
    steps (:class:`~pool_pymunk.studies.sweep.plan.Plan` says how); all in SI, angles in degrees.
    Shots have the same input and the same bits whatever ``chunk`` (shots a file), worker or machine
    plays them. ``executor`` is any ``concurrent.futures.Executor``, such as a process pool or
    ``dask.distributed.Client(...).get_executor()``; its workers must see the folder. Without one,
    all cores of this machine play. With ``resume=False`` a sweep in the folder is begun anew.
    ``on_done(done)`` is called after each part, and first with what was there already.

    Raises SettingError, in one line that names the argument: for what makes no sense, and for a
    folder that has another sweep. A law of your own is known by its name alone, and workers must be
    able to import its class. Needs ``pip install 'pool-pymunk[fast,sweep]'``.

    >>> import tempfile
    >>> from pool_pymunk import load
    >>> found = sweep(load("report"), 1, vary={"angle": (-5, 5), "speed": (1, 6)}, samples=100,
    ...               out=tempfile.mkdtemp())
    >>> found.shots, found.played
    (100, 100)
    """
    if find_spec("pyarrow") is None:
        message = "a sweep needs pyarrow: pip install 'pool-pymunk[fast,sweep]'"
        raise setting_error("out", str(out), message)
    began = time.perf_counter()
    plan = make_plan(scene, shot, vary, grid, samples, seed, chunk, law, max_time)
    folder = Path(out)
    todo, tell = begin(folder, plan, resume), on_done or _nothing
    left = sum(len(plan.shots_of(part)) for part in todo)
    tell(Done(plan.samples - left, 0, plan.samples))
    played = by_reference = 0
    parts = _play_here(plan, folder, todo) if executor is None else _play_there(
        plan, folder, todo, executor
    )  # fmt: skip
    for done in parts:
        played, by_reference = played + done.shots, by_reference + done.by_reference
        tell(done)
    return Sweep(folder, plan.samples, played, by_reference, time.perf_counter() - began)


def play_part(plan: Plan, folder: Path, part: int, threads: int | None = 1) -> Done:
    """Play a part and write it, in whichever process and on whichever machine this is."""
    if read_manifest(folder).get("hash") != plan.manifest["hash"]:
        raise setting_error("out", str(folder), "is not the folder that the sweep began in")
    inputs = plan.draw(plan.shots_of(part))
    return _write(plan, folder, part, inputs, _play(plan, inputs, threads))


def _play(plan: Plan, inputs: Inputs, threads: int | None) -> Any:
    return simulate_many(
        plan.scene, inputs.position, inputs.velocity, law=plan.law, vary=inputs.vary,
        threads=threads,
    )  # fmt: skip


def _write(plan: Plan, folder: Path, part: int, inputs: Inputs, batch: Any) -> Done:
    write_part(folder, plan, part, inputs, batch)
    return Done(len(batch), batch.by_reference, plan.samples)


def _nothing(done: Done) -> None:
    """Take no note that a part is done."""


def _play_here(plan: Plan, folder: Path, todo: list[int]) -> Iterator[Done]:
    """Play parts on all cores; while one is played, the one before is written."""
    with ThreadPoolExecutor(1) as writer:
        before: Future[Done] | None = None
        for part in todo:
            inputs = plan.draw(plan.shots_of(part))
            batch = _play(plan, inputs, None)
            if before is not None:
                yield before.result()
            before = writer.submit(_write, plan, folder, part, inputs, batch)
        if before is not None:
            yield before.result()


def _play_there(
    plan: Plan, folder: Path, todo: list[int], executor: Executor
) -> Iterator[Done]:  # fmt: skip
    """Let an executor play the parts, and yield what is done in whichever order it comes."""
    play = partial(play_part, plan, folder.resolve())
    waiting, running = todo[::-1], set[Future[Done]]()
    try:
        while waiting or running:
            while waiting and len(running) < WINDOW:
                running.add(executor.submit(play, waiting.pop()))
            finished, running = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED)
            yield from (each.result() for each in finished)
    finally:
        for each in running:
            each.cancel()
