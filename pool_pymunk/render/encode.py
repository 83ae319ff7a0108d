"""This module turns frames into films: mp4 by imageio's plugin for PyAV, gif by Pillow."""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import imageio.v3 as iio
import numpy as np
from PIL import Image, ImageChops
from PIL.GifImagePlugin import getdata, getheader

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.output import RenderError

SLOWEST, FASTEST = 2e-3, 65535.0  # frames a second: a gif's longest delay, imageio's finest time
CODEC = "libx264"  # H.264, which browsers and slides play
OPTIONS = {"preset": "superfast", "crf": "18", "bf": "0"}  # without B frames: 10 % faster
# Colours are converted by one thread, since more would cost more time than they save.
OPTIONS |= {"threads": "1", "x264-params": "threads=auto", "thread_type": "frame"}
# PyAV converts colours by the matrix of BT.601; the film has to say so.
OPTIONS |= {"colorspace": "smpte170m", "color_range": "tv"}
OPTIONS |= {"color_primaries": "bt709", "color_trc": "bt709"}
FASTSTART = {"movflags": "+faststart"}  # An mp4 starts to play before all of it is there.
CLEAR = 255  # a gif's index for pixels that stay as they are; those below it are colours
SAME = [255] + 255 * [0]  # a mask of the pixels whose index has changed by 0

Shown = tuple[Pixels, int]  # a picture (height, width, 3), and for how many 1/100 s it is shown


def write_mp4(path: Path, frames: Iterable[Pixels], fps: float) -> None:
    """Write frames, (height, width, 3) each; one is encoded while the next one is drawn."""
    pace = float(_pace(fps))
    gc.freeze()  # imageio collects garbage twice where it closes a film, a tenth of a short film.
    try:
        _write_mp4(path, frames, pace)
    finally:
        gc.unfreeze()


def _write_mp4(path: Path, frames: Iterable[Pixels], pace: float) -> None:
    with path.open("wb") as file:
        film = iio.imopen(file, "w", plugin="pyav", extension=".mp4", container_options=FASTSTART)  # type: ignore[call-overload]
        try:
            film.init_video_stream(CODEC, fps=pace)
            film._video_stream.options = OPTIONS  # imageio has no public way to set them.
            with ThreadPoolExecutor(1) as thread:
                done: Future[object] = thread.submit(int)  # There is nothing to wait for yet.
                for frame in frames:
                    done.result()
                    done = thread.submit(film.write_frame, frame)
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
    """Write a gif that loops, in the colours that the samples have.

    Pillow's ``save`` keeps all pictures in memory, so they are written one by one.
    """
    some = np.concatenate([pixels[::2, ::2].copy() for pixels in samples])
    palette = Image.fromarray(some).quantize(CLEAR, Image.Quantize.FASTOCTREE)
    before = None
    with path.open("wb") as file:
        for pixels, ticks in pictures:
            now = Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE)
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
    """Return frames a second as films count them; those for television have 30000/1001."""
    if not SLOWEST <= fps <= FASTEST:
        raise RenderError(f"fps = {fps:g}: must be from {SLOWEST:g} to {FASTEST:g}")
    return Fraction(fps).limit_denominator(1001)
