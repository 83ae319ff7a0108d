"""This command draws films and pictures of every shot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pool_pymunk import render as draw
from pool_pymunk.cli import beside, read
from pool_pymunk.cli.lines import InputError, say
from pool_pymunk.cli.options import FILMS, PICTURES, RenderOptions
from pool_pymunk.cli.runs import stem
from pool_pymunk.cli.terminal import Bar

NOTHING = "name a second scenario, or say with --overlay what to show on the second table"


def render(asked: RenderOptions) -> int:
    """Play the shots, film and draw them."""
    scene = read.scene(asked)
    setting, shots = read.column(asked, scene), read.shots(scene, asked.shot)
    read.one_of("--format", asked.form, FILMS)
    settings = _settings(asked)
    if not 10.0 <= asked.dpi <= 2400.0:
        raise InputError(f"--dpi = {asked.dpi:g}: must be between 10 and 2400")
    read.one_of("--picture-format", asked.picture_format, PICTURES)
    overlays = [] if asked.overlay is None else [asked.overlay]
    if asked.other is not None and overlays:
        raise InputError(f"--overlay = {asked.overlay}: {asked.other} is compared with already")
    ghosts, others = beside.compared(asked, scene, overlays, asked.other)
    if asked.side_by_side and not ghosts and not others:
        raise InputError(f"--side-by-side: {NOTHING}")
    folder = read.folder(asked.out, asked.scenario)
    rows = beside.play_beside(scene, shots, [setting, *ghosts], others)
    shows = [draw.Show(each, asked.side_by_side) for each in rows]
    how = "-side-by-side" if asked.side_by_side else "-overlay"
    suffix = "" if len(shows[0].runs) < 2 else how
    written = save_films(shows, folder, f"{suffix}.{asked.form}", settings) if asked.films else []
    if asked.pictures:
        written += save_pictures(shows, folder, f"{suffix}.{asked.picture_format}", asked.dpi)
    say(map(str, written))
    return 0


def _settings(asked: RenderOptions) -> draw.FilmSettings:
    """Return the settings of films as typed."""
    typed = {key: getattr(asked, key) for key in ("fps", "slow", "start", "end")}
    given: dict[str, Any] = {key: value for key, value in typed.items() if value is not None}
    if asked.size is not None:
        given["size"] = read.size(asked.size, "must be width and height in pixels, e.g. 1280x720")
    return draw.FilmSettings.of(f"film.{asked.form}", **given)


def save_films(
    shows: Sequence[draw.Show], folder: Path, ending: str, settings: draw.FilmSettings
) -> list[Path]:
    """Film every shot; several shots become one more film together."""
    start, together = settings.start, folder / f"all{ending}"
    for show in shows:
        if 0.0 < start >= show.duration:
            ended = f"{show.runs[0].name} ends at {show.duration:.4g} s"
            raise InputError(f"--from = {start:g}: is beyond the end of the film: {ended}")
    paths = [folder / f"{stem(show.runs[0])}{ending}" for show in shows]
    again = len(shows) > 1 and ending.endswith(".gif")  # a gif of all shots has other colours
    total = sum(draw.frame_count(show, settings) for show in shows) * (2 if again else 1)
    with Bar("filming", total) as bar:
        for show, path in zip(shows, paths, strict=True):
            draw.film(show, path, settings, bar.step)
        if again:
            draw.film(shows, together, settings, bar.step)
        elif len(shows) > 1:
            draw.join(paths, together)
    return [*paths, together] if len(shows) > 1 else paths


def save_pictures(shows: Sequence[draw.Show], folder: Path, ending: str, dpi: float) -> list[Path]:
    """Draw the start and the end of every shot."""
    paths = []
    with Bar("drawing", 2 * len(shows)) as bar:
        for show in shows:
            for when in ("start", "end"):
                paths.append(folder / f"{stem(show.runs[0])}-{when}{ending}")
                draw.picture(show, paths[-1], when=when, dpi=dpi)
                bar.step()
    return paths
