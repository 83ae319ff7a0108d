"""This module plays a sweep part by part: here, in other processes, or on a cluster.

It writes a manifest, and one Parquet file a part. A file gets its name only when it is complete.
All else in the folder begins with ``_`` or ``.``. The manifest is a Parquet file of no rows,
because some readers take every file of a folder.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pool_pymunk.core import compiled
from pool_pymunk.laws import Law
from pool_pymunk.many import Batch
from pool_pymunk.many.workers import Workers, renamed, workers_of
from pool_pymunk.model import Scene, Shot
from pool_pymunk.model.problems import setting_error
from pool_pymunk.safety.files import whole
from pool_pymunk.studies.sweep.plan import UNITS, Drawn, Plan, as_begun, make_plan

if TYPE_CHECKING:
    import pyarrow

MANIFEST, PART = "_manifest.parquet", "part-{:08d}.parquet"
HASH = b"pool_pymunk"  # A file's metadata has the plan's hash under this key,
PLAN = b"pool_pymunk.sweep"  # and the manifest's the whole plan under this, as JSON.
ANEW = "begin anew with resume=False"
SAID = "version", "law", "seed", "chunk", "samples"  # Errors say what these are in a folder.
FAST = 1  # the level of zstd's compression
CHUNK = 50_000
PARTS = 2  # Where there are fewer parts for each worker, the shots of a part are shared out.
TRIED, TRIED_SLOWLY = 1_000, 20  # shots that tell how long the others take


class Done(NamedTuple):
    """This counts the shots that are done now, those of them played in Python, and all shots."""

    shots: int
    by_reference: int
    total: int


class Sweep(NamedTuple):
    """A sweep has its folder ``out``, and the number of all its ``shots``.

    This call ``played`` so many of them, ``by_reference`` of these in Python, in ``wall_time`` (s).
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
    aims_anew: bool = False,
    workers: int | Executor | Workers | None = None,
    resume: bool = True,
    on_done: Callable[[Done], object] | None = None,
    on_shots: Callable[[int], object] | None = None,
    executor: Executor | None = None,
) -> Sweep:
    """Play many shots into a folder of Parquet files, and go on where an earlier call ended.

    A call with more ``samples`` goes on, too: the shots that are there stay as they are.
    ``vary`` has the ranges from which inputs are drawn, ``grid`` those taken in equal
    steps (:class:`~pool_pymunk.studies.sweep.plan.Plan` says how); all in SI, angles in degrees.
    A shot that aims at a ball is aimed once, in the scene as it is; with ``aims_anew`` it is aimed
    at where the ball lies in each of the shots.
    Each shot has the same input and the same bits, whatever ``chunk`` (shots a file), worker or
    machine plays it. ``workers`` are so many processes of this machine, or any
    ``concurrent.futures.Executor``, such as a process pool or
    ``dask.distributed.Client(...).get_executor()``; its workers must see the folder and be able to
    import a law of your own, which is known by its name. By default this process plays.
    With ``resume=False`` a sweep in the folder is begun anew. ``on_done(done)`` is called
    after each part, and first with what was there already; ``on_shots(n)`` is called whenever ``n``
    more shots are played. An interrupt leaves the parts that are done. Raises SettingError for what
    makes no sense, and for a folder that has another sweep. It needs ``pip install
    'pool-pymunk[sweep]'``.

    >>> import tempfile
    >>> from pool_pymunk import load
    >>> found = sweep(load("report"), 1, vary={"angle": (-5, 5), "speed": (1, 6)}, samples=100,
    ...               out=tempfile.mkdtemp())
    >>> found.shots, found.played
    (100, 100)
    """
    if find_spec("pyarrow") is None:
        message = "a sweep needs pyarrow: pip install 'pool-pymunk[sweep]'"
        raise setting_error("out", str(out), message)
    began = time.perf_counter()
    begun = as_begun(scene, shot, law, max_time, aims_anew)
    plan = make_plan(begun, vary, grid, samples, seed, chunk)
    folder, tell = Path(out), on_done or (lambda done: None)
    todo = begin(folder, plan, resume)
    missing = sum(len(plan.shots_of(part)) for part in todo)
    workers = renamed(workers, executor=executor)
    with workers_of(workers) as several:
        is_far = bool(todo) and (several.executor is not None or several.count > 1)
        one_alone = missing * _trial(plan, todo[0]) if is_far else 0.0  # s
        tell(Done(plan.samples - missing, 0, plan.samples))
        sends = len(todo) >= PARTS * (several.count or 1) and several.are_worth(one_alone)
        if sends:
            finished = several.share(_play_part, (plan, folder.resolve()), todo)
        else:
            finished = _play_here(plan, folder, todo, {"workers": several, "on_done": on_shots})
        played = by_reference = 0
        for done in finished:
            played, by_reference = played + done.shots, by_reference + done.by_reference
            tell(done)
            if sends and on_shots is not None:
                on_shots(done.shots)
    return Sweep(folder, plan.samples, played, by_reference, time.perf_counter() - began)


def play_part(plan: Plan, folder: Path, part: int) -> Done:
    """Play a part and write it; any process on any machine may call this."""
    if read_manifest(folder).get("hash") != plan.manifest["hash"]:
        raise setting_error("out", str(folder), "is not the folder that the sweep began in")
    drawn = plan.draw(plan.shots_of(part))
    return _write(plan, folder, part, drawn, plan.play(drawn))


def _play_part(common: tuple[Plan, Path], part: int) -> Done:
    return play_part(*common, part)


def _trial(plan: Plan, part: int) -> float:
    """Return about how long (s) a shot takes: the mean of the first ones of a part."""
    shots = plan.shots_of(part)[: TRIED if compiled else TRIED_SLOWLY]
    return plan.play(plan.draw(shots)).wall_time / len(shots)


def _play_here(plan: Plan, folder: Path, todo: list[int], how: Mapping[str, Any]) -> Iterator[Done]:
    """Play parts one after the other as ``how`` says; the one before is written meanwhile."""
    with ThreadPoolExecutor(1) as writer:
        before: list[Future[Done]] = []
        for part in todo:
            drawn = plan.draw(plan.shots_of(part))
            batch = plan.play(drawn, **how)
            yield from (each.result() for each in before)
            before = [writer.submit(_write, plan, folder, part, drawn, batch)]
        yield from (each.result() for each in before)


def begin(folder: Path, plan: Plan, resume: bool) -> list[int]:
    """Make the folder ready (delete its sweep unless ``resume``), and return the missing parts."""
    folder.mkdir(parents=True, exist_ok=True)
    manifest = folder / MANIFEST
    if not resume:
        for path in [manifest, *folder.glob("part-*.parquet")]:
            path.unlink(missing_ok=True)
    for path in folder.glob(".part-*.parquet"):  # They were not finished.
        path.unlink(missing_ok=True)
    if manifest.exists():
        there = read_manifest(folder)
        had = there.get("samples")
        grows = isinstance(had, int) and had < plan.samples
        for key, value in plan.manifest.items():
            if there.get(key) != value and not (grows and key == "samples"):
                said = f" ({there.get(key)})" if key in SAID else ""
                another = "other" if key.endswith("s") else "another"
                message = f"has a sweep with {another} {key}{said}: {ANEW}"
                raise setting_error("out", str(folder), message)
        if grows:
            _write_manifest(manifest, plan)
    elif strangers := [path.name for path in folder.iterdir() if path.name[0] not in "._"]:
        message = f"has files that no sweep has written, such as {min(strangers)}"
        raise setting_error("out", str(folder), message)
    else:
        _write_manifest(manifest, plan)
    return [part for part in range(plan.parts) if not _is_whole(folder, plan, part)]


def _write_manifest(path: Path, plan: Plan) -> None:
    """Write a dataset of no rows, which says what the sweep is."""
    from pyarrow import parquet

    drawn = plan.draw(range(1))
    still = drawn._replace(velocity=0.0 * drawn.velocity, vary={}, roll=None)
    table = _table(plan, range(1), drawn, plan.play(still)).slice(0, 0)
    said = {**(table.schema.metadata or {}), PLAN: json.dumps(plan.manifest).encode()}
    with whole(path) as part:
        parquet.write_table(table.replace_schema_metadata(said), part)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what a folder says of its sweep."""
    from pyarrow import ArrowException, parquet

    try:
        found = json.loads((parquet.read_schema(folder / MANIFEST).metadata or {})[PLAN])
    except (ValueError, KeyError, ArrowException):
        message = f"{MANIFEST} cannot be read: {ANEW}"
        raise setting_error("out", str(folder), message) from None
    return found if isinstance(found, dict) else {}


def _is_whole(folder: Path, plan: Plan, part: int) -> bool:
    """Tell whether a part is there, complete, and of this plan."""
    from pyarrow import ArrowException, parquet

    try:
        found = parquet.read_metadata(folder / PART.format(part))
    except (OSError, ArrowException):
        return False
    said = (found.metadata or {}).get(HASH, b"").decode()
    return bool(found.num_rows == len(plan.shots_of(part)) and said == plan.manifest["hash"])


def _write(plan: Plan, folder: Path, part: int, drawn: Drawn, batch: Batch) -> Done:
    """Write the outcomes of the shots of a part."""
    from pyarrow import parquet

    table = _table(plan, plan.shots_of(part), drawn, batch)
    floats = [field.name for field in table.schema if str(field.type) == "double"]
    others = [name for name in table.column_names if name not in floats]
    with whole(folder / PART.format(part)) as path:
        parquet.write_table(
            table, path, compression="zstd", compression_level=FAST, use_dictionary=others,
            use_byte_stream_split=floats, write_statistics=True,
        )  # fmt: skip
        with path.open("rb") as file:
            os.fsync(file.fileno())
    return Done(len(batch), batch.by_reference, plan.samples)


def _table(plan: Plan, shots: range, drawn: Drawn, batch: Batch) -> pyarrow.Table:
    """Return inputs and results as a table, with the unit of each column."""
    import pyarrow

    columns: dict[str, Any] = {"shot": np.arange(shots.start, shots.stop, dtype=np.int64)}
    columns |= drawn.columns
    for i, id_ in enumerate(plan.scene.index):
        columns |= {f"x_{id_}": batch.final[:, i, 0], f"y_{id_}": batch.final[:, i, 1]}
    for i, id_ in enumerate(plan.scene.index if plan.scene.pockets else ()):
        columns[f"pocketed_{id_}"] = batch.pocketed[:, i].astype(np.int16)
    for key in ("duration", "hits", "cushions", "first_hit", "status"):
        columns[key] = getattr(batch, key)
    units = {key: UNITS.get(key) or UNITS.get(key.partition("_")[0], "") for key in columns}
    fields = [
        pyarrow.field(key, pyarrow.from_numpy_dtype(each.dtype), metadata={"unit": units[key]})
        for key, each in columns.items()
    ]
    schema = pyarrow.schema(fields, metadata={HASH: plan.manifest["hash"].encode()})
    arrays = [pyarrow.array(np.ascontiguousarray(each)) for each in columns.values()]
    return pyarrow.Table.from_arrays(arrays, schema=schema)
