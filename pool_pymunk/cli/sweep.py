"""This command plays any number of shots into Parquet files, on one machine or many."""

from __future__ import annotations

from typing import Any

import typer

from pool_pymunk.cli import read
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import SweepOptions
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Units
from pool_pymunk.model.problems import SettingError
from pool_pymunk.studies import sweep as sweeps
from pool_pymunk.studies.sweep.job import Done


def sweep(asked: SweepOptions) -> int:
    """Play the shots that are not in the dataset yet."""
    scene, out = read.scene(asked), asked.out
    if asked.shot is None and len(scene.shots) > 1:
        raise InputError(f"--shot: is missing; there are {read.shot_names(scene)}")
    if asked.samples is None and not asked.grid:
        raise InputError("--samples: is missing, and there is no --grid")
    chosen = read.shots(scene, asked.shot)[0]
    varied = read.varied("--vary", asked.vary, scene.units)
    pairs = read.pairs("--grid", asked.grid)
    steps = {key: _steps(key, text, scene.units) for key, text in pairs}
    with read.players(asked) as workers, Bar("playing") as bar:

        def begin(first: Done) -> None:
            if bar.tasks[0].total is None:  # It counts the shots that are there.
                bar.come_to(first.shots, first.total)

        try:
            done = sweeps.sweep(
                scene, chosen, vary=varied, grid=steps, samples=asked.samples, seed=asked.seed,
                out=out, law=asked.law, aims_anew=asked.aims_anew, workers=workers,
                resume=not asked.restart, on_done=begin, on_shots=bar.step,
            )  # fmt: skip
        except SettingError as error:
            raise InputError(str(error).replace("resume=False", "--restart")) from None
    share = 100.0 * done.by_reference / max(done.played, 1)
    typer.echo(
        f"{done.shots:,} shots in {out}: {done.played:,} played in {done.wall_time:.1f} s "
        f"({done.played / done.wall_time:,.0f} a second), {done.shots - done.played:,} were there; "
        f"{share:.2g} % by the exact solver in Python"
    )
    return 0


def _steps(key: str, text: str, units: Units) -> tuple[Any, ...]:
    """Read LOW:HIGH:COUNT, in SI."""
    rest, _, count = text.rpartition(":")
    if not count.isdecimal() or ":" not in rest:
        raise InputError(f"--grid {key} = {text}: must be LOW:HIGH:COUNT")
    return (*read.input_values("--grid", key, rest, units), int(count))
