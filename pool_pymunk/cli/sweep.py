"""``sweep``: any number of shots into a folder of Parquet files, resumable, on many machines."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pool_pymunk.cli.common import (
    How,
    InputError,
    LawName,
    MaxTime,
    Scenario,
    ShotName,
    input_errors,
    read_scenario,
    read_shots,
)

if TYPE_CHECKING:
    from pool_pymunk.model import Units
    from pool_pymunk.studies.sweep.job import Done

KINDS = {"start": "length", "noise.speed": "speed"}


def sweep(
    scenario: Scenario,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the dataset goes.")],
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="KEY=LOW:HIGH", help="Draw this input; start, noise: =W."),
    ] = None,
    grid: Annotated[
        list[str] | None,
        typer.Option("--grid", metavar="KEY=LOW:HIGH:COUNT", help="Go through this input."),
    ] = None,
    samples: Annotated[
        int | None, typer.Option(metavar="N", help="Shots; where there is a grid, all of it.")
    ] = None,
    shot: ShotName = None,
    seed: Annotated[int, typer.Option(metavar="S", help="Of the random numbers.")] = 0,
    chunk: Annotated[int, typer.Option(metavar="C", help="Shots in one file.")] = 50_000,
    workers: Annotated[
        int | None, typer.Option(metavar="W", help="Processes; default: threads on all cores.")
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler: tcp://host:8786.")
    ] = None,
    restart: Annotated[bool, typer.Option("--restart", help="Begin anew.")] = False,
    law: LawName = None,
    max_time: MaxTime = None,
) -> int:
    """Play many shots into a Parquet dataset; the same command goes on where it was.

    Keys: speed, angle or turn (degrees, relative to the shot's), mass (of the struck ball),
    restitution.*, friction.*, x.ID, y.ID, vx.ID, vy.ID, mass.ID, radius.ID; start (every ball, plus
    or minus one length), noise.speed and noise.angle (standard deviation of the player's error).
    Lengths, speeds and masses may have a unit (0.005in); without one they are in the scenario's.
    """
    from pool_pymunk.studies.sweep import sweep as play

    scene = How(max_time=max_time).scene(read_scenario(scenario))
    if shot is None and len(scene.shots) > 1:
        names = ", ".join(f"{k} ({one.name})" for k, one in enumerate(scene.shots, start=1))
        raise InputError(f"--shot = (left out): is wanted, one of {names}")
    chosen = read_shots(scene, shot)[0]
    with input_errors():
        varied = {
            key: numbers("--vary", key, text, scene.units) for key, text in pairs("--vary", vary)
        }
        steps = {key: _steps(key, text, scene.units) for key, text in pairs("--grid", grid)}
        with _executor(workers, cluster) as executor, Counter() as counter:
            done = play(
                scene, chosen, vary=varied, grid=steps, samples=samples, seed=seed, out=out,
                chunk=chunk, law=law, executor=executor, resume=not restart, on_done=counter.take,
            )  # fmt: skip
    rate = done.played / done.wall_time
    share = 100.0 * done.by_reference / max(done.played, 1)
    typer.echo(
        f"{done.shots:,} shots in {out}: {done.played:,} played in {done.wall_time:.1f} s "
        f"({rate:,.0f} a second), {done.shots - done.played:,} were there; {share:.2g} % by the "
        "exact solver in Python"
    )
    return 0


def pairs(option: str, texts: Sequence[str] | None) -> Iterator[tuple[str, str]]:
    """Split KEY=VALUE."""
    seen = set()
    for text in texts or ():
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"{option} = {text}: must be KEY=LOW:HIGH")
        if key in seen:
            raise InputError(f"{option} = {text}: {key} stands there twice")
        seen.add(key)
        yield key.strip(), value


def numbers(option: str, key: str, text: str, units: Units) -> tuple[float, ...]:
    """Read LOW:HIGH, or one number, in SI."""
    from pool_pymunk.model.inputs import TABLE, parts
    from pool_pymunk.model.quantities import quantity

    row = TABLE.get(parts(key)[0])
    kind = KINDS.get(key) if row is None else row.quantity
    if kind not in (None, "", "angle"):
        return tuple(quantity(f"{option} {key}", part, kind, units) for part in text.split(":"))
    try:
        return tuple(float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"{option} {key} = {text}: must be numbers, LOW:HIGH") from None


def _steps(key: str, text: str, units: Units) -> tuple[Any, ...]:
    """Read LOW:HIGH:COUNT, in SI."""
    rest, _, count = text.rpartition(":")
    if not count.isdecimal() or ":" not in rest:
        raise InputError(f"--grid {key} = {text}: must be LOW:HIGH:COUNT")
    return (*numbers("--grid", key, rest, units), int(count))


@contextmanager
def _executor(workers: int | None, cluster: str | None) -> Iterator[Executor | None]:
    """Yield what plays the parts: processes, a cluster, or None for threads here."""
    if workers is not None and cluster is not None:
        raise InputError("--workers: stands beside --cluster, which has workers of its own")
    if workers is not None and workers < 1:
        raise InputError(f"--workers = {workers}: must be 1 or more")
    if workers is not None:
        import multiprocessing

        with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
            yield pool
    elif cluster is not None:
        with _cluster(cluster) as client:
            yield client.get_executor(retries=3)
    else:
        yield None


def _cluster(address: str) -> Any:
    """Connect to a Dask scheduler."""
    if find_spec("distributed") is None:
        raise InputError("--cluster: needs Dask: pip install 'pool-pymunk[cluster]'")
    client: Any = import_module("distributed").Client
    try:
        return client(address, timeout=10)
    except (OSError, ValueError) as error:
        said = str(error).splitlines()[0]
        raise InputError(f"--cluster = {address}: no scheduler answers ({said})") from None


class Counter:
    """A counter shows on a terminal how many shots are done, how fast, and how long it will take.

    In a pipe it shows nothing.
    """

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        columns = BarColumn(), TextColumn("{task.description}"), TimeRemainingColumn()
        console = Console(stderr=True)
        self.bar = Progress(
            *columns, console=console, transient=True, disable=not sys.stderr.isatty()
        )
        self.task = self.bar.add_task("", total=None)
        self.began = time.perf_counter()
        self.there: int | None = None
        self.played = self.by_reference = 0

    def __enter__(self) -> Counter:
        self.bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.stop()

    def take(self, done: Done) -> None:
        """Count what was there, then each part."""
        if self.there is None:
            self.there = done.shots
        else:
            self.played += done.shots
            self.by_reference += done.by_reference
        rate = self.played / (time.perf_counter() - self.began)
        share = 100.0 * self.by_reference / max(self.played, 1)
        said = f"{self.there + self.played:,} shots, {rate:,.0f} a second, {share:.2g} % in Python"
        self.bar.update(
            self.task, description=said, completed=self.there + self.played, total=done.total
        )
