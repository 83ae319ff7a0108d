"""This module films shots: one by one, all in one, or two runs of a shot compared."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import Any

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.encode import timed, write_gif, write_mp4, written
from pool_pymunk.render.stage import Stage, Timing
from pool_pymunk.render.style import LOOK, SCREEN, Style
from pool_pymunk.render.view import Show
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import RenderError

Progress = Callable[[int], None]
FORMATS = (".mp4", ".gif")
USUAL: Mapping[str, Mapping[str, Any]] = {".gif": {"size": (800, 450), "fps": 25.0}}  # else mp4's
FASTEST_GIF = 50.0  # frames a second; players take the next pace, 1/100 s a frame, for a mistake


@dataclass(frozen=True)
class FilmSettings:
    """The settings say how a film is made; RenderError says what no film can have.

    ``size`` (width, height) is in pixels, ``fps`` in frames a second. ``slow`` is how many times
    slower than life it is. ``start`` and ``end`` are the times shown (s; by default it ends when
    the last ball stops), and ``pause`` (s) is how long the last frame stays.
    """

    size: tuple[int, int] = (1600, 900)
    fps: float = 60.0
    slow: float = 1.0
    start: float = 0.0
    end: float | None = None
    pause: float = 1.0
    style: Style = SCREEN

    def __post_init__(self) -> None:
        for key in ("fps", "slow"):
            if not 0.0 < getattr(self, key) < math.inf:
                raise RenderError(f"{key} = {getattr(self, key):g}: must be greater than 0")
        if any(side not in range(64, 8193, 2) for side in self.size):
            size = "x".join(map(str, self.size))
            raise RenderError(f"size = {size}: must be two even numbers from 64 to 8192")
        if not 0.0 <= self.pause < math.inf:
            raise RenderError(f"pause = {self.pause:g}: must be 0 or more")
        if not 0.0 <= self.start < (math.inf if self.end is None else self.end):
            raise RenderError(f"start = {self.start:g}: must be 0 or more, and before the end")

    @classmethod
    def of(cls, path: Path | str, **settings: Any) -> FilmSettings:
        """Make settings; what is left out is as usual for the format of the file ``path``."""
        return cls(**{**USUAL.get(Path(path).suffix.lower(), {}), **settings})

    def timing(self, show: Show) -> Timing:
        """Return the times of a show's frames; the last ball may still have to fall."""
        last = max((e.t for run in show.runs for e in run.events if e.pocket), default=-math.inf)
        whole = max(show.duration, last + LOOK.drop / self.slow)
        end = whole if self.end is None else min(self.end, whole)
        return Timing(min(self.start, end), end, self.fps, self.slow)

    def stage(self, show: Show) -> Stage:
        """Return the stage from which the frames of a show are drawn."""
        return Stage(show, self.size, self.timing(show), self.style)

    @property
    def held(self) -> int:
        """Return how many times more the last frame is shown."""
        return round(self.pause * self.fps)


def film(
    what: Run | Show | Sequence[Run | Show],
    path: Path | str,
    settings: FilmSettings = FilmSettings(),
    progress: Progress | None = None,
) -> None:
    """Film one shot, or several one after another; the suffix gives the format, mp4 or gif.

    ``progress`` is called with the number of frames drawn since its last call. Raises RenderError
    for what cannot be filmed, and OSError if the file cannot be written, and leaves no file then.
    """
    path = Path(path)
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
            samples = (frame for show in shows for frame in settings.stage(show).samples())
            write_gif(part, timed(frames, settings.fps), samples)
        else:
            write_mp4(part, frames, settings.fps)


def frame_count(what: Run | Show, settings: FilmSettings) -> int:
    """Return how many frames a film of one shot has, without the pause at its end."""
    return settings.timing(_show(what)).frames


def _frames(show: Show, settings: FilmSettings, progress: Progress | None) -> Iterator[Pixels]:
    """Draw the frames of one shot; the last one stays."""
    for frame in settings.stage(show).frames():
        if progress is not None:
            progress(1)
        yield frame
    yield from repeat(frame, settings.held)


def _show(what: Run | Show) -> Show:
    return what if isinstance(what, Show) else Show((what,))
