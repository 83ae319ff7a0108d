"""This command draws films and pictures of every shot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from pool_pymunk.cli.beside import Setting, read_setting, simulate_beside
from pool_pymunk.cli.common import (
    FrictionBy,
    How,
    InputError,
    LawName,
    MaxTime,
    OutDir,
    Scenario,
    ShotName,
    SolverName,
    Step,
    input_errors,
    progress,
    read_scenario,
    read_shots,
    read_step,
)

if TYPE_CHECKING:
    from pool_pymunk.render import FilmSettings, Show
    from pool_pymunk.results.run import Run

FILM_FORMATS = ("mp4", "gif")


def render(
    scenario: Scenario,
    solver: SolverName = "pymunk",
    dt: Step = None,
    shot: ShotName = None,
    law: LawName = None,
    friction: FrictionBy = None,
    max_time: MaxTime = None,
    out: OutDir = None,
    overlay: Annotated[
        str | None,
        typer.Option(metavar="SOLVER[:DT][:LAW]", help="Compare with these runs, shown as ghosts."),
    ] = None,
    side_by_side: Annotated[
        bool, typer.Option("--side-by-side", help="Show the runs to compare on two tables.")
    ] = False,
    films: Annotated[bool, typer.Option(help="Film the shots, one by one and in one film.")] = True,
    form: Annotated[str, typer.Option("--format", metavar="mp4|gif", help="Of films.")] = "mp4",
    size: Annotated[
        str | None, typer.Option(metavar="WxH", help="Of films: 1600x900 (gif: 800x450).")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(help="Frames a second: 60 (gif: 25).", show_default=False)
    ] = None,
    slow: Annotated[float, typer.Option(help="So many times slower than life.")] = 1.0,
    start: Annotated[float, typer.Option("--from", help="Film from this time on (s).")] = 0.0,
    end: Annotated[
        float | None, typer.Option("--to", help="Film up to this time (s; default: to the end).")
    ] = None,
    pictures: Annotated[bool, typer.Option(help="Draw the start and end of each shot.")] = True,
    picture_format: Annotated[
        str, typer.Option(metavar="png|svg|pdf", help="Of pictures.")
    ] = "png",
    dpi: Annotated[float, typer.Option(help="Dots an inch of png pictures, 10 in wide.")] = 200.0,
) -> int:
    """Film every shot and draw its start and end.

    Files go to renders/<scenario>: for each shot a film and two pictures, and a film of all shots.
    """
    how = How(law, friction, max_time)
    scene = how.scene(read_scenario(scenario))
    how.check(scene, solver, dt)
    shots = read_shots(scene, shot)
    settings = film_settings(form, size, fps, FilmTimes(slow, start, end))
    if side_by_side and overlay is None:
        raise InputError("--side-by-side: say with --overlay what to show on the second table")
    check_pictures(picture_format, dpi)
    runs = [Setting(solver, read_step(dt), options=how.options)]
    runs += [read_setting(overlay)] if overlay else []
    shows = _shows(simulate_beside(scene, shots, runs), side_by_side)
    if films:
        check_start(shows, start)
    folder = out or Path("renders") / Path(scenario).stem
    suffix = "" if overlay is None else "-side-by-side" if side_by_side else "-overlay"
    written = save_films(shows, folder, f"{suffix}.{form}", settings) if films else []
    if pictures:
        written += save_pictures(shows, folder, f"{suffix}.{picture_format}", dpi)
    for path in written:
        typer.echo(path)
    return 0


# -- what is asked for -------------------------------------------------------------------------


class FilmTimes(NamedTuple):
    """The times of a film are how many times slower it is, and from when to when (s)."""

    slow: float
    start: float
    end: float | None


def film_settings(form: str, size: str | None, fps: float | None, times: FilmTimes) -> FilmSettings:
    """Return the films' settings as typed, or as the format has them by default."""
    from pool_pymunk.render import FilmSettings

    if form not in FILM_FORMATS:
        raise InputError(f"--format = {form}: must be one of {', '.join(FILM_FORMATS)}")
    typed = {"size": None if size is None else read_size(size), "fps": fps}
    given = {key: value for key, value in typed.items() if value is not None}
    return FilmSettings.of(f"film.{form}", **given, **times._asdict())


def check_pictures(form: str, dpi: float) -> None:
    """Raise InputError for pictures that cannot be drawn."""
    if not 10.0 <= dpi <= 2400.0:
        raise InputError(f"--dpi = {dpi:g}: must be between 10 and 2400")
    if form not in ("png", "svg", "pdf"):
        raise InputError(f"--picture-format = {form}: must be one of png, svg, pdf")


def check_start(shows: Sequence[Show], start: float) -> None:
    """Raise InputError where a film would begin after its shot has ended."""
    for show in shows:
        if start > 0.0 and start >= show.duration:
            ended = f"{show.runs[0].name} ends at {show.duration:.4g} s"
            raise InputError(f"--from = {start:g}: is beyond the end of the film: {ended}")


def read_size(text: str) -> tuple[int, int]:
    """Return a size in pixels as typed.

    >>> read_size("1280x720")
    (1280, 720)
    """
    try:
        width, height = map(int, text.lower().split("x"))
    except ValueError:
        message = "must be width and height in pixels, e.g. 1280x720"
        raise InputError(f"--size = {text}: {message}") from None
    return width, height


# -- what is done ------------------------------------------------------------------------------


def _shows(played: Sequence[tuple[Run, ...]], side_by_side: bool) -> list[Show]:
    from pool_pymunk.render import Show

    with input_errors():
        return [Show(runs, side_by_side) for runs in played]


def save_films(
    shows: Sequence[Show], folder: Path, ending: str, settings: FilmSettings
) -> list[Path]:
    """Film every shot, and where there are several put them into one film, too."""
    from pool_pymunk.render import film, frame_count, join

    paths = [folder / f"{_stem(show)}{ending}" for show in shows]
    together = folder / f"all{ending}"
    again = len(shows) > 1 and ending.endswith(".gif")  # a gif of all shots has colours of its own
    total = sum(frame_count(show, settings) for show in shows) * (2 if again else 1)
    with progress("filming", total) as bar:

        def drawn(frames: int) -> None:
            bar.update(bar.task_ids[0], advance=frames)

        for show, path in zip(shows, paths, strict=True):
            film(show, path, settings, drawn)
        if len(shows) == 1:
            return paths
        if again:
            film(shows, together, settings, drawn)
        else:
            join(paths, together)
    return [*paths, together]


def save_pictures(shows: Sequence[Show], folder: Path, ending: str, dpi: float) -> list[Path]:
    """Draw the start and the end of every shot."""
    from pool_pymunk.render import picture

    paths = []
    with progress("drawing", 2 * len(shows)) as bar:
        for show in shows:
            for when in ("start", "end"):
                paths.append(folder / f"{_stem(show)}-{when}{ending}")
                picture(show, paths[-1], when=when, dpi=dpi)
                bar.update(bar.task_ids[0], advance=1)
    return paths


def _stem(show: Show) -> str:
    """Return ``shot-3`` for the scene's third shot."""
    run = show.runs[0]
    return f"shot-{run.scene.shots.index(run.shot) + 1 if run.shot else 1}"
