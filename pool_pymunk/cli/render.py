"""This command draws films and pictures of every shot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from pool_pymunk.cli import lib, opt, read
from pool_pymunk.cli.common import How, place, read_setting, say, simulate_and_warn, stem

FILM_FORMATS = ("mp4", "gif")


def render(
    scenario: opt.Scenario,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    out: opt.OutDir = None,
    overlay: Annotated[
        str | None, opt.option("Compare with this, shown as a ghost.", "SOLVER[:DT][:LAW]")
    ] = None,
    side_by_side: Annotated[
        bool, opt.option("Show the two runs on two tables.", None, "--side-by-side")
    ] = False,
    films: Annotated[bool, opt.option("Film each shot, and all shots in one film.")] = True,
    form: Annotated[
        str, opt.option("Format of the films.", "|".join(FILM_FORMATS), "--format")
    ] = "mp4",
    size: Annotated[
        str | None, opt.option("Pixels; default: 1600x900, gif: 800x450.", "WxH")
    ] = None,
    fps: Annotated[float | None, opt.option("Frames a second; default: 60, gif: 25.")] = None,
    slow: Annotated[float, opt.option("Slower than life by this factor.")] = 1.0,
    start: Annotated[
        float, opt.option("Film from this time on (s).", None, "--from", for_experts=True)
    ] = 0.0,
    end: Annotated[
        float | None,
        opt.option(
            "Film up to this time (s; default: to the end).", None, "--to", for_experts=True
        ),
    ] = None,
    pictures: opt.StartAndEnd = True,
    picture_format: Annotated[
        str, opt.option("Their format.", "|".join(opt.PICTURES), for_experts=True)
    ] = "png",
    dpi: Annotated[
        float, opt.option("Dots per inch of a png, which is 10 in wide.", for_experts=True)
    ] = 200.0,
) -> int:
    """Film every shot and draw its start and end.

    Files go to renders/<scenario>: for each shot a film and two pictures, and a film of all shots.
    """
    how = How(law, friction, max_time)
    scene = how.scene(scenario)
    runs = [how.setting(scene, solver, dt)]
    shots = read.shots(scene, shot)
    read.one_of("--format", form, FILM_FORMATS)
    typed: dict[str, Any] = {"fps": fps, "slow": slow, "start": start, "end": end}
    if size is not None:
        typed["size"] = read.size(size, "must be width and height in pixels, e.g. 1280x720")
    given = {key: value for key, value in typed.items() if value is not None}
    settings = lib.render.FilmSettings.of(f"film.{form}", **given)
    if side_by_side and overlay is None:
        raise read.InputError("--side-by-side: say with --overlay what to show on the second table")
    if not 10.0 <= dpi <= 2400.0:
        raise read.InputError(f"--dpi = {dpi:g}: must be between 10 and 2400")
    read.one_of("--picture-format", picture_format, opt.PICTURES)
    runs += [] if overlay is None else [read_setting(overlay)]
    folder = place(out, scenario)
    shows = [lib.render.Show(each, side_by_side) for each in simulate_and_warn(scene, shots, runs)]
    suffix = "" if overlay is None else "-side-by-side" if side_by_side else "-overlay"
    written = save_films(shows, folder, f"{suffix}.{form}", settings) if films else []
    if pictures:
        written += save_pictures(shows, folder, f"{suffix}.{picture_format}", dpi)
    say(map(str, written))
    return 0


def save_films(
    shows: Sequence[lib.render.Show], folder: Path, ending: str, settings: lib.render.FilmSettings
) -> list[Path]:
    """Film every shot; several shots become one more film together."""
    start, together = settings.start, folder / f"all{ending}"
    for show in shows:
        if 0.0 < start >= show.duration:
            ended = f"{show.runs[0].name} ends at {show.duration:.4g} s"
            raise read.InputError(f"--from = {start:g}: is beyond the end of the film: {ended}")
    paths = [folder / f"{stem(show.runs[0])}{ending}" for show in shows]
    again = len(shows) > 1 and ending.endswith(".gif")  # a gif of all shots has other colours
    total = sum(lib.render.frame_count(show, settings) for show in shows) * (2 if again else 1)
    with lib.terminal.progress("filming", total) as bar:
        for show, path in zip(shows, paths, strict=True):
            lib.render.film(show, path, settings, bar.step)
        if again:
            lib.render.film(shows, together, settings, bar.step)
        elif len(shows) > 1:
            lib.render.join(paths, together)
    return [*paths, together] if len(shows) > 1 else paths


def save_pictures(
    shows: Sequence[lib.render.Show], folder: Path, ending: str, dpi: float
) -> list[Path]:
    """Draw the start and the end of every shot."""
    paths = []
    with lib.terminal.progress("drawing", 2 * len(shows)) as bar:
        for show in shows:
            for when in ("start", "end"):
                paths.append(folder / f"{stem(show.runs[0])}-{when}{ending}")
                lib.render.picture(show, paths[-1], when=when, dpi=dpi)
                bar.step()
    return paths
