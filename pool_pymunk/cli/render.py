"""This command draws films and pictures of every shot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from pool_pymunk.cli import common, lib, opt, read

NOTHING = "name a second scenario, or say with --overlay what to show on the second table"
FILM_FORMATS = ("mp4", "gif")
Other = Annotated[
    str | None,
    typer.Argument(metavar="OTHER", help="A scenario to compare with, as with --overlay."),
]
Overlay = Annotated[
    str | None,
    opt.option(
        "Compare with this solver or scenario, shown as a ghost.", "SOLVER[:DT][:LAW]|SCENARIO"
    ),
]
SideBySide = Annotated[bool, opt.option("Show the two runs on two tables.", None, "--side-by-side")]


def render(
    scenario: opt.Scenario,
    other: Other = None,
    solver: opt.SolverName = "pymunk",
    dt: opt.Step = None,
    shot: opt.ShotName = None,
    law: opt.LawName = None,
    friction: opt.FrictionBy = None,
    max_time: opt.MaxTime = None,
    contact_tolerance: opt.ContactTolerance = None,
    out: opt.OutDir = None,
    overlay: Overlay = None,
    side_by_side: SideBySide = False,
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
    A scenario to compare with must have the same table, and balls of the same ids and sizes; words
    say what differs (render soft.toml --side-by-side hard.toml).
    """
    how = common.How(law, friction, max_time, contact_tolerance)
    scene = how.scene(scenario)
    setting, shots = how.setting(scene, solver, dt), read.shots(scene, shot)
    read.one_of("--format", form, FILM_FORMATS)
    settings = _settings(form, size, fps=fps, slow=slow, start=start, end=end)
    if not 10.0 <= dpi <= 2400.0:
        raise read.InputError(f"--dpi = {dpi:g}: must be between 10 and 2400")
    read.one_of("--picture-format", picture_format, opt.PICTURES)
    ghosts, beside = _compared(how, scene, scenario, overlay, other)
    if side_by_side and not ghosts and beside is None:
        raise read.InputError(f"--side-by-side: {NOTHING}")
    folder = common.place(out, scenario)
    rows = _rows(scene, beside, shots, [setting, *ghosts])
    shows = [lib.render.Show(each, side_by_side) for each in rows]
    suffix = "" if len(shows[0].runs) < 2 else "-side-by-side" if side_by_side else "-overlay"
    written = save_films(shows, folder, f"{suffix}.{form}", settings) if films else []
    if pictures:
        written += save_pictures(shows, folder, f"{suffix}.{picture_format}", dpi)
    common.say(map(str, written))
    return 0


def _compared(
    how: common.How, scene: lib.Scene, scenario: str, overlay: str | None, other: str | None
) -> tuple[list[lib.grid.Column], lib.Scene | None]:
    """Return what is compared with: a solver's setting, or a scene."""
    if other is not None and overlay is not None:
        raise read.InputError(f"--overlay = {overlay}: {other} is compared with already")
    text = overlay if other is None else other
    if text is None:
        return [], None
    if other is not None or common.is_scenario(text):
        key = "--overlay" if other is None else "OTHER"
        return [], common.other_scene(how, scene, scenario, text, key)
    return [common.read_setting(text)], None


def _rows(
    scene: lib.Scene, beside: lib.Scene | None,
    shots: Sequence[lib.Shot | None], settings: Sequence[lib.grid.Column],
) -> list[tuple[lib.Run, ...]]:  # fmt: skip
    """Play every shot, and that of the same number of a scene beside this one."""
    rows = common.simulate_and_warn(scene, shots, settings)
    if beside is None:
        return rows
    more = common.simulate_and_warn(beside, common.same_shots(scene, beside, shots), settings)
    return [both + its for both, its in zip(rows, more, strict=True)]


def _settings(form: str, size: str | None, **typed: float | None) -> lib.render.FilmSettings:
    """Return the settings of films as typed."""
    given: dict[str, Any] = {key: value for key, value in typed.items() if value is not None}
    if size is not None:
        given["size"] = read.size(size, "must be width and height in pixels, e.g. 1280x720")
    return lib.render.FilmSettings.of(f"film.{form}", **given)


def save_films(
    shows: Sequence[lib.render.Show], folder: Path, ending: str, settings: lib.render.FilmSettings
) -> list[Path]:
    """Film every shot; several shots become one more film together."""
    start, together = settings.start, folder / f"all{ending}"
    for show in shows:
        if 0.0 < start >= show.duration:
            ended = f"{show.runs[0].name} ends at {show.duration:.4g} s"
            raise read.InputError(f"--from = {start:g}: is beyond the end of the film: {ended}")
    paths = [folder / f"{common.stem(show.runs[0])}{ending}" for show in shows]
    again = len(shows) > 1 and ending.endswith(".gif")  # a gif of all shots has other colours
    total = sum(lib.render.frame_count(show, settings) for show in shows) * (2 if again else 1)
    with lib.terminal.Bar("filming", total) as bar:
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
    with lib.terminal.Bar("drawing", 2 * len(shows)) as bar:
        for show in shows:
            for when in ("start", "end"):
                paths.append(folder / f"{common.stem(show.runs[0])}-{when}{ending}")
                lib.render.picture(show, paths[-1], when=when, dpi=dpi)
                bar.step()
    return paths
