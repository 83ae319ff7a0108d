"""This command draws the results of a shot at every angle and speed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, place
from pool_pymunk.cli.workers import players


def atlas(
    scenario: opt.Scenario,
    shot: opt.ShotName = None,
    angle: Annotated[str, opt.option("Degrees, from the shot's angle.", "LOW:HIGH")] = "-30:30",
    speed: Annotated[
        str | None, opt.option("Speeds; default: 0.25 to 1.5 of the shot's.", "LOW:HIGH")
    ] = None,
    across: Annotated[str | None, opt.option("Vary this, not the angle.", "KEY=LOW:HIGH")] = None,
    up: Annotated[str | None, opt.option("Vary this, not the speed.", "KEY=LOW:HIGH")] = None,
    size: Annotated[str, opt.option("Pixels; each is a shot.", "WxH")] = "1200x800",
    ball: Annotated[
        str | None, opt.option("Draw this ball's end; default: the one aimed at or nearest.", "ID")
    ] = None,
    show: Annotated[str, opt.option("What is drawn.", "|".join(opt.SHOWS))] = "end",
    out: Annotated[Path | None, opt.option("A png, svg or pdf file.", "FILE", "--out")] = None,
    aims_anew: opt.AimAnew = False,
    law: opt.LawName = None,
    max_time: opt.MaxTime = None,
    workers: opt.Workers = None,
    cluster: opt.Cluster = None,
) -> int:
    """Draw the results of a shot at every angle and speed: each pixel is an exact shot.

    Narrower ranges show where the result is fractal, and where it is safe. --across and --up take
    the keys of a sweep, such as mass.8 or restitution.cushion.
    """
    read.one_of("--show", show, opt.SHOWS)
    scene = How(max_time=max_time).scene(scenario)
    if show == "pocket" and not scene.pockets:
        raise read.InputError("--show = pocket: the scenario has no pockets")
    chosen, units = read.shots(scene, shot)[0], scene.units
    pixels = read.size(size, "must be WIDTHxHEIGHT, 2 pixels or more each", smallest=2)
    path = out or place(None, scenario) / f"atlas-{show}.png"
    read.ending("--out", path, read.PICTURES, ".png, .svg or .pdf")
    began = time.perf_counter()
    count = pixels[0] * pixels[1]
    how: dict[str, Any] = {
        "angle": read.interval("--angle", angle, units, "angle"),
        "speed": None if speed is None else read.interval("--speed", speed, units, "speed"),
        "axes": _axes(scene, across, up),
    }
    with players(workers, cluster) as (asked, _), lib.terminal.Bar("playing", count) as bar:
        try:
            found = lib.atlas.atlas(
                scene, chosen, **how, size=pixels, ball=ball, law=law, aims_anew=aims_anew,
                show=show, workers=asked, on_done=bar.step,
            )  # fmt: skip
        except lib.atlas.CutShort as cut:
            lib.maps.atlas_picture(cut.found, show, path)
            typer.echo(f"the picture so far: {path}")
            raise
    lib.maps.atlas_picture(found, show, path)
    typer.echo(f"{count:,} shots in {time.perf_counter() - began:.1f} s: {path}")
    return 0


def _axes(scene: lib.Scene, across: str | None, up: str | None) -> dict[str, Any] | None:
    """Read two inputs with their ranges, named as in a sweep."""
    if across is None and up is None:
        return None
    if across is None or up is None:
        given, missing = ("--up", "--across") if across is None else ("--across", "--up")
        raise read.InputError(f"{missing}: is missing beside {given}")
    first = read.inputs("--across", [across], scene.units)
    second = read.inputs("--up", [up], scene.units)
    if first.keys() == second.keys():
        raise read.InputError(f"--up = {up}: {next(iter(first))} is given to --across already")
    return first | second
