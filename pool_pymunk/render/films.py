"""This module films shots: one by one, all in one, or two runs of a shot compared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import repeat
from pathlib import Path

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.encode import timed, write_gif, write_mp4, written
from pool_pymunk.render.stage import FilmSettings, Stage
from pool_pymunk.render.view import Show
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import RenderError

Progress = Callable[[int], None]
FORMATS = (".mp4", ".gif")
FASTEST_GIF = 50.0  # frames a second; players take the next pace, 1/100 s a frame, for a mistake


def film(
    what: Run | Show | Sequence[Run | Show],
    path: Path | str,
    settings: FilmSettings | None = None,
    progress: Progress | None = None,
) -> None:
    """Film one shot, or several one after another; the suffix gives the format, mp4 or gif.

    ``progress`` is called with the number of frames drawn since its last call. Raises RenderError
    for what cannot be filmed, and OSError if the file cannot be written, and leaves no file then.
    """
    path, settings = Path(path), settings or FilmSettings()
    form = path.suffix.lower()
    if form not in FORMATS:
        raise RenderError(f"{path}: a film's name must end in one of {', '.join(FORMATS)}")
    if form == ".gif" and settings.fps > FASTEST_GIF:
        raise RenderError(f"fps = {settings.fps:g}: a gif can have {FASTEST_GIF:g} at most")
    shows = [_show(one) for one in (what if isinstance(what, Sequence) else [what])]
    if not shows:
        raise RenderError(f"{path}: there is no shot to film")
    frames = (frame for show in shows for frame in _frames(show, settings, progress))
    with written(path) as part:
        if form == ".gif":
            samples = (frame for show in shows for frame in Stage(show, settings).samples())
            write_gif(part, timed(frames, settings.fps), samples)
        else:
            write_mp4(part, frames, settings.fps)


def frame_count(what: Run | Show, settings: FilmSettings) -> int:
    """Return how many frames a film of one shot has, without the pause at its end."""
    return len(settings.times(_show(what)))


def _frames(show: Show, settings: FilmSettings, progress: Progress | None) -> Iterator[Pixels]:
    """Draw the frames of one shot; the last one stays."""
    for frame in Stage(show, settings).frames():
        if progress is not None:
            progress(1)
        yield frame
    yield from repeat(frame, settings.held)


def _show(what: Run | Show) -> Show:
    return what if isinstance(what, Show) else Show((what,))
