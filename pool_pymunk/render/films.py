"""This module films shots: one by one, all in one, or two runs of a shot compared.

Frames become mp4 by imageio's plugin for PyAV, and gif by Pillow.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from itertools import chain, islice, repeat
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageChops
from PIL.GifImagePlugin import getdata, getheader

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.stage import FilmSettings, Stage
from pool_pymunk.render.view import Show
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import DEVICE_ERRORS, RenderError, whole

Progress = Callable[[int], None]
FORMATS = (".mp4", ".gif")
FASTEST_GIF = 50.0  # frames a second; players take the next pace, 1/100 s a frame, for a mistake
SLOWEST, FASTEST = 2e-3, 65535.0  # frames a second: a gif's longest delay, a film's finest time
CODEC: Literal["libx264"] = "libx264"  # H.264, which browsers and slides play
OPTIONS = {"preset": "superfast", "crf": "18", "bf": "0"}  # without B frames: 10 % faster
# Colours are converted by one thread, since more would cost more time than they save.
OPTIONS |= {"threads": "1", "x264-params": "threads=auto", "thread_type": "frame"}
# PyAV converts colours by the matrix of BT.601; the film has to say so.
OPTIONS |= {"colorspace": "smpte170m", "color_range": "tv"}
OPTIONS |= {"color_primaries": "bt709", "color_trc": "bt709"}
FASTSTART = {"movflags": "+faststart"}  # An mp4 starts to play before all of it is there.
CLEAR = 255  # a gif's index for pixels that stay as they are; those below it are colours
SAME = [255] + 255 * [0]  # a mask of the pixels whose index has changed by 0

# a picture (height, width, 3 or 4), and for how many 1/100 s it is shown
Shown = tuple[Pixels, int]


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
    count = progress or (lambda _: None)
    frames = (frame for show in shows for frame in _frames(show, settings, count))
    with written(path) as part:
        if form == ".gif":
            samples = (frame for show in shows for frame in Stage(show, settings).samples())
            write_gif(part, timed(frames, settings.fps), samples)
        else:
            write_mp4(part, frames, settings.fps)


def frame_count(what: Run | Show, settings: FilmSettings) -> int:
    """Return how many frames a film of one shot has, without the pause at its end."""
    return len(settings.times(_show(what)))


def _frames(show: Show, settings: FilmSettings, progress: Progress) -> Iterator[Pixels]:
    """Draw the frames of one shot; the last one stays."""
    stage = Stage(show, settings)
    progress(0)  # Frames are counted from here on: the stage takes as long as hundreds of them.
    for frame in stage.frames():
        progress(1)
        yield frame
    yield from repeat(frame, settings.held)


def _show(what: Run | Show) -> Show:
    return what if isinstance(what, Show) else Show((what,))


# -- from frames to files --------------------------------------------------------------------------


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """Give a temporary name for a film, which becomes ``path`` when the block succeeds."""
    try:
        import av
        from av.codec.codec import UnknownCodecError
    except ImportError:  # There is none for browsers.
        raise RenderError(f"{path}: films need PyAV, which is not installed here") from None
    try:
        with whole(path) as part:
            try:
                yield part
            except UnknownCodecError as error:
                raise RenderError(f"ffmpeg: there is no codec {error}") from error
            except av.FFmpegError as error:
                if error.errno in DEVICE_ERRORS:
                    raise OSError(error.errno, os.strerror(error.errno)) from error
                raise RenderError(f"{error.filename or 'ffmpeg'}: {error.strerror}") from error
    except RenderError as error:
        raise RenderError(f"{path}: {error}") from error


def write_mp4(path: Path, frames: Iterable[Pixels], fps: float) -> None:
    """Write frames, (height, width, 4) each; one is encoded while the next one is drawn."""
    import imageio.v3 as iio
    from imageio.plugins.pyav import PyAVPlugin

    with path.open("wb") as file, ThreadPoolExecutor(1) as thread:
        film = iio.imopen(
            file, "w", plugin=PyAVPlugin, extension=".mp4", container_options=FASTSTART
        )
        try:
            film.init_video_stream(CODEC, fps=float(_pace(fps)))
            # imageio has no public call that sets them.
            film._video_stream.options = OPTIONS  # type: ignore[union-attr]
            done: Future[object] = thread.submit(int)  # There is nothing to wait for yet.
            for frame in frames:
                done.result()
                done = thread.submit(film.write_frame, frame, pixel_format="rgba")
            done.result()
            film.close()
        except BaseException:
            film._video_stream = None  # Otherwise imageio would still encode when it is deleted.
            raise


def timed(frames: Iterable[Pixels], fps: float) -> Iterator[Shown]:
    """Yield frames with their times as gifs count them, without a sum of rounding errors."""
    pace = _pace(fps)
    for k, frame in enumerate(frames):
        yield frame, round(100 * (k + 1) / pace) - round(100 * k / pace)


def write_gif(path: Path, pictures: Iterable[Shown], samples: Iterable[Pixels]) -> None:
    """Write a looping gif in the samples' colours, one by one; Pillow would keep all pictures."""
    some = np.concatenate([pixels[::2, ::2].copy() for pixels in samples])
    palette = Image.fromarray(some).convert("RGB").quantize(CLEAR, Image.Quantize.FASTOCTREE)
    before = None
    with path.open("wb") as file:
        for pixels, ticks in pictures:
            now = Image.fromarray(pixels).convert("RGB")
            now = now.quantize(palette=palette, dither=Image.Dither.NONE)
            patch, box = now.copy(), (0, 0, *now.size)
            if before is None:
                file.writelines(getheader(now, info={"loop": 0})[0])
            else:
                change = ImageChops.subtract_modulo(now, before)
                patch.paste(CLEAR, mask=change.point(SAME, "1"))
                box = change.getbbox() or (0, 0, 1, 1)
            times = {"duration": 10 * ticks, "transparency": CLEAR, "disposal": 1}
            file.writelines(getdata(patch.crop(box), box[:2], **times))
            before = now
        file.write(b";")


def _pace(fps: float) -> Fraction:
    """Return frames a second as a fraction, as films have it: 30000/1001 for television."""
    if not SLOWEST <= fps <= FASTEST:
        raise RenderError(f"fps = {fps:g}: must be from {SLOWEST:g} to {FASTEST:g}")
    return Fraction(fps).limit_denominator(1001)


def join(films: Sequence[Path], path: Path) -> None:
    """Write films of one size and pace one after another to ``path``; mp4 films as they are.

    Raises RenderError if they cannot be joined, and OSError if the disk fails.
    """
    if not films:
        raise RenderError(f"{path}: there is no film to join")
    with written(path) as part:
        if path.suffix.lower() == ".gif":
            samples = chain.from_iterable(islice(_pictures(film), 0, None, 50) for film in films)
            pictures = chain.from_iterable(map(_pictures, films))
            write_gif(part, pictures, (pixels for pixels, _ in samples))
        else:
            _join_mp4s(films, part)


def _join_mp4s(films: Sequence[Path], path: Path) -> None:
    import av

    start, stream = 0, None
    with av.open(str(path), "w", container_options=FASTSTART) as whole:
        for film in films:
            with av.open(str(film)) as part:
                source = part.streams.video[0]
                stream = stream or whole.add_stream_from_template(source)
                for packet in part.demux(source):
                    if packet.pts is not None and packet.dts is not None:  # The last one is empty.
                        packet.pts, packet.dts = packet.pts + start, packet.dts + start
                        packet.stream = stream
                        whole.mux(packet)
                start += source.duration or 0


def _pictures(gif: Path) -> Iterator[Shown]:
    import av

    with av.open(str(gif)) as film:
        for frame in film.decode(video=0):
            yield frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False), frame.duration
