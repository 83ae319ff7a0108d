"""``atlas``: a picture of what comes of a shot at every angle and speed."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pool_pymunk.cli.choices import SHOWS
from pool_pymunk.cli.common import (
    How,
    InputError,
    LawName,
    MaxTime,
    Scenario,
    ShotName,
    input_errors,
    progress,
    read_scenario,
    read_shots,
)

if TYPE_CHECKING:
    from pool_pymunk.model import Scene, Units


def atlas(
    scenario: Scenario,
    shot: ShotName = None,
    angle: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help="Degrees, relative to the shot's.")
    ] = "-30:30",
    speed: Annotated[
        str | None, typer.Option(metavar="LOW:HIGH", help="Default: 0.25 to 1.5 of the shot's.")
    ] = None,
    across: Annotated[
        str | None, typer.Option(metavar="KEY=LOW:HIGH", help="In place of the angle.")
    ] = None,
    up: Annotated[
        str | None, typer.Option(metavar="KEY=LOW:HIGH", help="In place of the speed.")
    ] = None,
    size: Annotated[str, typer.Option(metavar="WxH", help="Pixels; each is a shot.")] = "1200x800",
    ball: Annotated[
        str | None, typer.Option(metavar="ID", help="Whose end; default: the aimed or nearest.")
    ] = None,
    show: Annotated[str, typer.Option(metavar="|".join(SHOWS), help="What is drawn.")] = "end",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="png, svg or pdf.")
    ] = None,
    law: LawName = None,
    max_time: MaxTime = None,
) -> int:
    """Draw what comes of a shot at every angle and speed: one shot a pixel, all of them exact.

    A narrower --angle and --speed show where the outcome is fractal, and where it is safe. --across
    and --up take the keys of a sweep, such as mass.8 or restitution.cushion.
    """
    from pool_pymunk.studies.atlas import atlas as play

    if show not in SHOWS:
        raise InputError(f"--show = {show}: must be one of {', '.join(SHOWS)}")
    scene = How(max_time=max_time).scene(read_scenario(scenario))
    if show == "pocket" and not scene.pockets:
        raise InputError("--show = pocket: the scenario has no pockets")
    chosen = read_shots(scene, shot)[0]
    width, height = _size(size)
    path = out or Path("renders") / Path(scenario).stem / f"atlas-{show}.png"
    if path.suffix not in (".png", ".svg", ".pdf"):
        raise InputError(f"--out = {path}: must end in .png, .svg or .pdf")
    began = time.perf_counter()
    with input_errors(), progress("playing", width * height) as bar:
        found = play(
            scene, chosen, angle=_range("--angle", angle), size=(width, height), ball=ball, law=law,
            speed=None if speed is None else _range("--speed", speed, scene.units),
            axes=_axes(scene, across, up),
            show=show, on_done=lambda done: bar.update(bar.task_ids[0], advance=done),
        )  # fmt: skip
    from pool_pymunk.render.atlas import atlas_picture

    atlas_picture(found, show, path)
    seconds = time.perf_counter() - began
    typer.echo(f"{width * height:,} shots in {seconds:.1f} s: {path}")
    return 0


def _axes(scene: Scene, across: str | None, up: str | None) -> dict[str, Any] | None:
    """Read two inputs with their ranges, named as in a sweep."""
    from pool_pymunk.cli.sweep import numbers, pairs

    if across is None and up is None:
        return None
    if across is None or up is None:
        given, missing = ("--up", "--across") if across is None else ("--across", "--up")
        raise InputError(f"{missing} = (left out): is missing beside {given}")
    ((x, first),) = pairs("--across", [across])
    ((y, second),) = pairs("--up", [up])
    if x == y:
        raise InputError(f"--up = {up}: {x} is across already")
    ranges = ("--across", x, first), ("--up", y, second)
    return {key: numbers(option, key, text, scene.units) for option, key, text in ranges}


def _range(option: str, text: str, units: Units | None = None) -> tuple[float, float]:
    """Read LOW:HIGH; with units it is a speed."""
    from pool_pymunk.model.quantities import quantity

    parts = text.split(":")
    try:
        low, high = (
            float(part) if units is None else quantity(option, part, "speed", units)
            for part in parts
        )
    except ValueError as error:
        said = str(error) if "=" in str(error) else f"{option} = {text}: must be LOW:HIGH"
        raise InputError(said) from None
    if not low < high:
        raise InputError(f"{option} = {text}: LOW must be less than HIGH")
    return low, high


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and min(int(width), int(height)) >= 2):
        raise InputError(f"--size = {text}: must be WIDTHxHEIGHT, 2 pixels or more each")
    return int(width), int(height)
