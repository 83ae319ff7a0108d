"""This command draws the results of a shot at every angle and speed."""

from __future__ import annotations

import time
from typing import Any

import typer

from pool_pymunk.cli import read
from pool_pymunk.cli.lines import InputError
from pool_pymunk.cli.options import SHOWS, AtlasOptions
from pool_pymunk.cli.terminal import Bar
from pool_pymunk.model import Scene
from pool_pymunk.render.atlas import atlas_picture
from pool_pymunk.studies import atlas as maps

EARLY = 3.0  # s from one picture of an atlas that is not finished to the next


def atlas(asked: AtlasOptions) -> int:
    """Play the pixels from coarse to fine and draw them; after Ctrl-C as far as that went."""
    read.one_of("--show", asked.show, SHOWS)
    scene = read.scene(asked)
    if asked.show == "pocket" and not scene.pockets:
        raise InputError("--show = pocket: the scenario has no pockets")
    chosen, units = read.shots(scene, asked.shot)[0], scene.units
    size = read.size(asked.size, "must be WIDTHxHEIGHT, 2 pixels or more each", smallest=2)
    path = asked.out or read.folder(None, asked.scenario) / f"atlas-{asked.show}.png"
    read.ending("--out", path, read.PICTURES, ".png, .svg or .pdf")
    drawn = began = time.perf_counter()
    count, speed = size[0] * size[1], asked.speed
    how: dict[str, Any] = {
        "angle": read.interval("--angle", asked.angle, units, "angle"),
        "speed": None if speed is None else read.interval("--speed", speed, units, "speed"),
        "axes": _axes(scene, asked.across, asked.up),
    }

    def show_early(so_far: maps.Atlas) -> None:
        """Draw the picture so far now and then, if the whole one takes long."""
        nonlocal drawn
        if time.perf_counter() - drawn > EARLY:
            atlas_picture(so_far, asked.show, path)
            typer.echo(f"the picture so far: {path}", err=True)
            drawn = time.perf_counter()

    with read.players(asked) as workers, Bar("playing", count) as bar:
        try:
            found = maps.atlas(
                scene, chosen, **how, size=size, ball=asked.ball, law=asked.law, show=asked.show,
                aims_anew=asked.aims_anew, workers=workers, on_done=bar.step, on_pass=show_early,
            )  # fmt: skip
        except maps.CutShort as cut:
            atlas_picture(cut.found, asked.show, path)
            typer.echo(f"the picture so far: {path}")
            raise
    atlas_picture(found, asked.show, path)
    typer.echo(f"{count:,} shots in {time.perf_counter() - began:.1f} s: {path}")
    return 0


def _axes(scene: Scene, across: str | None, up: str | None) -> dict[str, Any] | None:
    """Read two inputs with their ranges, named as in a sweep."""
    if across is None and up is None:
        return None
    if across is None or up is None:
        given, missing = ("--up", "--across") if across is None else ("--across", "--up")
        raise InputError(f"{missing}: is missing beside {given}")
    first = read.varied("--across", [across], scene.units)
    second = read.varied("--up", [up], scene.units)
    if first.keys() == second.keys():
        raise InputError(f"--up = {up}: {next(iter(first))} is given to --across already")
    return first | second
