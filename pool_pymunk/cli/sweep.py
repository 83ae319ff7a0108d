"""This command plays any number of shots into Parquet files, on one machine or many."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How
from pool_pymunk.cli.workers import players


def sweep(
    scenario: opt.Scenario,
    out: Annotated[Path, opt.option("Where the dataset goes.", "DIR", "--out")],
    vary: Annotated[
        list[str] | None,
        opt.option("Vary this at random; start and noise: KEY=WIDTH.", "KEY=LOW:HIGH"),
    ] = None,
    grid: Annotated[
        list[str] | None, opt.option("Vary this in even steps.", "KEY=LOW:HIGH:COUNT")
    ] = None,
    samples: Annotated[
        int | None, opt.option("Number of shots; default: the whole grid.", "N")
    ] = None,
    shot: opt.ShotName = None,
    seed: Annotated[int, opt.option("Seed of the random numbers.", "S", for_experts=True)] = 0,
    chunk: Annotated[int, opt.option("Shots in one file.", "C", for_experts=True)] = 50_000,
    workers: opt.Workers = None,
    cluster: opt.Cluster = None,
    restart: Annotated[bool, opt.option("Replace what is there.", None, "--restart")] = False,
    aims_anew: opt.AimAnew = False,
    law: opt.LawName = None,
    max_time: opt.MaxTime = None,
) -> int:
    """Play many shots into a Parquet dataset; the same command resumes a sweep.

    Keys: speed, angle or turn (degrees, relative to the shot's), roll, mass (of the struck ball),
    restitution.*, friction.*, x.ID, y.ID, vx.ID, vy.ID, mass.ID, radius.ID; start (every ball, by
    up to WIDTH), noise.speed and noise.angle (standard deviations of the player's errors).
    Lengths, speeds and masses may have a unit (0.005in); without one they are in the scenario's.
    """
    scene = How(max_time=max_time).scene(scenario)
    if shot is None and len(scene.shots) > 1:
        raise read.InputError(f"--shot: is missing; there are {read.shot_names(scene)}")
    if samples is None and not grid:
        raise read.InputError("--samples: is missing, and there is no --grid")
    chosen = read.shots(scene, shot)[0]
    varied = read.inputs("--vary", vary, scene.units)
    steps = {key: _steps(key, text, scene.units) for key, text in read.pairs("--grid", grid)}
    with players(workers, cluster) as (asked, count), lib.terminal.Counter(count) as counter:
        try:
            done = lib.sweep.sweep(
                scene, chosen, vary=varied, grid=steps, samples=samples, seed=seed, out=out,
                chunk=chunk, law=law, aims_anew=aims_anew, workers=asked, resume=not restart,
                on_done=counter.take, on_shots=counter.take_shots,
            )  # fmt: skip
        except lib.problems.SettingError as error:
            raise read.InputError(str(error).replace("resume=False", "--restart")) from None
    share = 100.0 * done.by_reference / max(done.played, 1)
    typer.echo(
        f"{done.shots:,} shots in {out}: {done.played:,} played in {done.wall_time:.1f} s "
        f"({done.played / done.wall_time:,.0f} a second), {done.shots - done.played:,} were there; "
        f"{share:.2g} % by the exact solver in Python"
    )
    return 0


def _steps(key: str, text: str, units: lib.Units) -> tuple[Any, ...]:
    """Read LOW:HIGH:COUNT, in SI."""
    rest, _, count = text.rpartition(":")
    if not count.isdecimal() or ":" not in rest:
        raise read.InputError(f"--grid {key} = {text}: must be LOW:HIGH:COUNT")
    return (*read.input_values("--grid", key, rest, units), int(count))
