"""The options of the command line that say who plays many shots are read here."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from pool_pymunk.cli import lib, read


@contextmanager
def players(workers: int | None, cluster: str | None = None) -> Iterator[tuple[Any, int]]:
    """Yield what plays, and how many they are: processes on all cores, or a Dask cluster."""
    if workers is not None and cluster is not None:
        raise read.InputError("--workers: a --cluster has workers of its own")
    if workers is not None and workers < 1:
        raise read.InputError(f"--workers = {workers}: must be 1 or more")
    if cluster is None:
        with lib.workers.Workers(workers or lib.workers.cores()) as found:
            yield found, found.count
    else:
        with _cluster(cluster) as executor:
            yield executor, 1


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    """Yield the workers of a Dask cluster."""
    if find_spec("distributed") is None:
        raise read.InputError("--cluster: needs Dask: pip install 'pool-pymunk[cluster]'")
    try:
        client: Any = import_module("distributed").Client(address, timeout=10)
    except (OSError, ValueError) as error:
        said = str(error).splitlines()[0]
        raise read.InputError(f"--cluster = {address}: no scheduler answers ({said})") from None
    with client:
        yield client.get_executor(retries=3)
