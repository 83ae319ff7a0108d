"""This module writes and checks the files of a sweep: a manifest, and one Parquet file a part.

A file gets its name only when it is complete. All else in the folder begins with ``_`` or ``.``.
The manifest is a Parquet file, too, of no rows, because some readers take every file of a folder.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pool_pymunk.fast import Batch, simulate_many
from pool_pymunk.model.problems import setting_error
from pool_pymunk.safety.files import whole
from pool_pymunk.studies.sweep.plan import UNITS, Inputs, Plan

if TYPE_CHECKING:
    import pyarrow

MANIFEST = "_manifest.parquet"
HASH = b"pool_pymunk"  # A file's metadata has the plan's hash under this key,
PLAN = b"pool_pymunk.sweep"  # and the manifest's has all of it under this one, as JSON.
FAST = 1  # the level of zstd's compression


def part_path(folder: Path, part: int) -> Path:
    """Return where a part lies."""
    return folder / f"part-{part:08d}.parquet"


def begin(folder: Path, plan: Plan, resume: bool) -> list[int]:
    """Make the folder ready, and return the parts that are missing.

    Raises SettingError if the folder has another sweep, or other files. Without ``resume``, a sweep
    that is there is taken away first.
    """
    folder.mkdir(parents=True, exist_ok=True)
    manifest = folder / MANIFEST
    if not resume:
        for path in [manifest, *folder.glob("part-*.parquet")]:
            path.unlink(missing_ok=True)
    for path in folder.glob(".part-*.parquet"):  # They were cut.
        path.unlink(missing_ok=True)
    if manifest.exists():
        _check_same(folder, read_manifest(folder), plan.manifest)
    else:
        strangers = [path.name for path in folder.iterdir() if path.name[0] not in "._"]
        if strangers:
            message = f"has files that are no sweep's, such as {min(strangers)}"
            raise setting_error("out", str(folder), message)
        _write_manifest(manifest, plan)
    return list(missing(folder, plan))


def _write_manifest(path: Path, plan: Plan) -> None:
    """Write a dataset of no rows, which says what the sweep is."""
    from pyarrow import parquet

    inputs = plan.draw(range(1))
    batch = simulate_many(plan.scene, inputs.position, 0.0 * inputs.velocity, law=plan.law)
    table = table_of(plan, range(1), inputs, batch).slice(0, 0)
    said = {**(table.schema.metadata or {}), PLAN: json.dumps(plan.manifest).encode()}
    with whole(path) as part:
        parquet.write_table(table.replace_schema_metadata(said), part)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return what a folder says of its sweep."""
    import pyarrow
    from pyarrow import parquet

    try:
        schema = parquet.read_schema(folder / MANIFEST)
        found = json.loads((schema.metadata or {})[PLAN])
    except (ValueError, KeyError, pyarrow.ArrowException):
        message = f"{MANIFEST} cannot be read: begin anew with --restart (resume=False)"
        raise setting_error("out", str(folder), message) from None
    return found if isinstance(found, dict) else {}


def _check_same(folder: Path, there: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Refuse to go on with another sweep, and say what differs first."""
    for key in wanted:
        if there.get(key) != wanted[key]:
            what = f"another {key}" if key != "format" else "another format"
            short = f" ({there.get(key)})" if key in ("version", "law", "seed", "chunk") else ""
            message = f"has a sweep with {what}{short}: begin anew with --restart (resume=False)"
            raise setting_error("out", str(folder), message)


def missing(folder: Path, plan: Plan) -> Iterator[int]:
    """Yield the parts that are not there, or not whole."""
    for part in range(plan.parts):
        if not is_whole(part_path(folder, part), len(plan.shots_of(part)), plan.manifest["hash"]):
            yield part


def is_whole(path: Path, rows: int, digest: str) -> bool:
    """Tell whether a part is there, complete, and of this plan."""
    import pyarrow
    from pyarrow import parquet

    try:
        found = parquet.read_metadata(path)
    except (OSError, pyarrow.ArrowException):
        return False
    said = (found.metadata or {}).get(HASH, b"").decode()
    return bool(found.num_rows == rows and said == digest)


def write_part(folder: Path, plan: Plan, part: int, inputs: Inputs, batch: Batch) -> None:
    """Write what came of the shots of a part."""
    from pyarrow import parquet

    table = table_of(plan, plan.shots_of(part), inputs, batch)
    floats = [field.name for field in table.schema if str(field.type) == "double"]
    others = [field.name for field in table.schema if field.name not in floats]
    with whole(part_path(folder, part)) as path:
        parquet.write_table(
            table, path, compression="zstd", compression_level=FAST, use_dictionary=others,
            use_byte_stream_split=floats, write_statistics=True,
        )  # fmt: skip
        with path.open("rb") as file:
            os.fsync(file.fileno())


def table_of(plan: Plan, shots: range, inputs: Inputs, batch: Batch) -> pyarrow.Table:
    """Return inputs and results as a table, with the unit of each column."""
    import pyarrow

    columns: dict[str, tuple[Any, str]] = {
        "shot": (np.arange(shots.start, shots.stop, dtype=np.int64), "")
    }
    for name, values in inputs.columns.items():
        columns[name] = values, UNITS.get(name) or UNITS.get(name.partition("_")[0], "")
    ids = [ball.id for ball in plan.scene.balls]
    for i, id_ in enumerate(ids):
        columns[f"x_{id_}"] = batch.final[:, i, 0], "m"
        columns[f"y_{id_}"] = batch.final[:, i, 1], "m"
    if plan.scene.pockets:
        for i, id_ in enumerate(ids):
            columns[f"pocketed_{id_}"] = batch.pocketed[:, i].astype(np.int16), ""
    columns["duration"] = batch.duration, "s"
    for name in ("hits", "cushions", "first_hit", "status"):
        columns[name] = getattr(batch, name), ""
    fields = [
        pyarrow.field(name, pyarrow.from_numpy_dtype(values.dtype), metadata={"unit": unit})
        for name, (values, unit) in columns.items()
    ]
    schema = pyarrow.schema(fields, metadata={HASH: plan.manifest["hash"].encode()})
    arrays = [pyarrow.array(np.ascontiguousarray(values)) for values, _ in columns.values()]
    return pyarrow.Table.from_arrays(arrays, schema=schema)
