"""This module turns frames into a film, with PyAV, which has the codecs of ffmpeg."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import av
import numpy as np
from av.codec.codec import UnknownCodecError
from av.container import InputContainer, OutputContainer
from av.filter import Graph
from av.filter.context import FilterContext
from av.video.format import VideoFormat
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange, Colorspace, Interpolation, VideoReformatter

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.output import RenderError, written
from pool_pymunk.safety.files import DEVICE_ERRORS

SLOWEST, FASTEST = 1e-3, 1e6  # frames a second
TICK = Fraction(1, 100)  # s, as gifs count; filters want frames to have a unit of time


class Write(Protocol):
    """Put a picture (height, width, 3) into a film, so many times, each as long as many frames."""

    def __call__(self, pixels: Pixels, times: int = 1, length: int = 1) -> None: ...


class Recipe(NamedTuple):
    """A recipe names a codec, its format of pixels and its options, and converts frames to it."""

    codec: Literal["libx264", "gif"]
    form: str
    options: dict[str, str]
    convert: Callable[[VideoFrame], VideoFrame]


def mp4() -> Recipe:
    """Encode in H.264, which browsers and slides play."""
    names = dict.fromkeys(("colorspace", "color_primaries", "color_trc"), "bt709")
    names |= {"color_range": "tv"}
    effort = {"preset": "superfast", "crf": "18", "thread_type": "frame"}
    reformatter = VideoReformatter()

    def convert(frame: VideoFrame) -> VideoFrame:
        return reformatter.reformat(
            frame,
            format="yuv420p",
            dst_colorspace=Colorspace.ITU709,
            dst_color_range=ColorRange.MPEG,
            interpolation=Interpolation.BICUBIC,
            threads=1,
        )

    return Recipe("libx264", "yuv420p", {**effort, **names}, convert)


def gif(samples: Iterable[Pixels], size: tuple[int, int]) -> Recipe:
    """Encode a gif that loops, in the colours that the samples (height, width, 3) have."""
    graph = _graph()
    frames, colors = _source(graph, "rgb24", size), _source(graph, "bgra", (16, 16))
    painter = graph.add("paletteuse", "dither=none:diff_mode=rectangle")
    frames.link_to(painter)
    colors.link_to(painter, input_idx=1)
    graph.link_nodes(painter, graph.add("buffersink")).configure()
    colors.push(_palette(samples, size))
    colors.push(None)

    def convert(frame: VideoFrame) -> VideoFrame:
        frames.push(frame)
        return graph.vpull()

    return Recipe("gif", "pal8", {"flags": "+frame_duration"}, convert)


@contextmanager
def encoder(path: Path, size: tuple[int, int], fps: float, how: Recipe) -> Iterator[Write]:
    """Take frames of ``size`` (width, height) and write them to ``path``.

    Raises RenderError in one line if they cannot be encoded, and OSError if the disk fails.
    """
    if not SLOWEST <= fps <= FASTEST:
        raise RenderError(f"fps = {fps:g}: must be from {SLOWEST:g} to {FASTEST:g}")
    pace = Fraction(fps).limit_denominator(1001)  # Films for television have 30000/1001.
    now = 0
    with _said_in_one_line(), _film(path) as film:
        stream = film.add_stream(how.codec, pace, how.options, pix_fmt=how.form)
        stream.width, stream.height = size

        def write(pixels: Pixels, times: int = 1, length: int = 1) -> None:
            nonlocal now
            frame = how.convert(VideoFrame.from_numpy_buffer(pixels))
            for _ in range(times):
                frame.pts, frame.duration, frame.time_base = now, length, 1 / pace
                film.mux(stream.encode(frame))
                now += length

        with _beside(write) as write_later:
            yield write_later
        film.mux(stream.encode())


@contextmanager
def _beside(write: Write) -> Iterator[Write]:
    """Write each frame in a thread, while the next one is drawn; errors come with the next one."""
    with ThreadPoolExecutor(1) as thread:
        done: Future[object] = thread.submit(int)  # There is nothing to wait for yet.

        def write_later(pixels: Pixels, times: int = 1, length: int = 1) -> None:
            nonlocal done
            done.result()
            done = thread.submit(write, pixels, times, length)

        yield write_later
        done.result()


def join(films: Sequence[Path], path: Path) -> None:
    """Write films one after another to ``path``; mp4 films as they are, nothing is encoded again.

    They must be of one size and pace (see :func:`film`, which takes several shots). Raises
    RenderError if they cannot be joined, and OSError if the disk fails.
    """
    if not films:
        raise RenderError(f"{path}: there is no film to join")
    with written(path) as part, _said_in_one_line():
        if path.suffix.lower() == ".gif":
            _join_gifs(films, part)
        else:
            _join_mp4s(films, part)


def _join_mp4s(films: Sequence[Path], path: Path) -> None:
    start, stream = 0, None
    with _film(path) as whole:
        for film in films:
            with _opened(film) as part:
                source = part.streams.video[0]
                stream = stream or whole.add_stream_from_template(source)
                for packet in part.demux(source):
                    if packet.pts is not None and packet.dts is not None:  # The last one is empty.
                        packet.pts, packet.dts = packet.pts + start, packet.dts + start
                        packet.stream = stream
                        whole.mux(packet)
                start += source.duration or 0


def _join_gifs(films: Sequence[Path], path: Path) -> None:
    """Encode the frames of all gifs again, in the colours that all of them have."""
    with _opened(films[0]) as first:
        size = first.streams.video[0].width, first.streams.video[0].height
    recipe = gif((pixels for pixels, _ in _frames(films)), size)
    with encoder(path, size, float(1 / TICK), recipe) as write:
        for pixels, ticks in _frames(films):
            write(pixels, length=ticks)


def _frames(gifs: Sequence[Path]) -> Iterator[tuple[Pixels, int]]:
    """Yield the pictures of gifs, one after another, and for how many ticks each is shown."""
    for path in gifs:
        with _opened(path) as film:
            for frame in film.decode(video=0):
                pixels = frame.reformat(format="rgb24", threads=1).to_ndarray()
                yield pixels.astype(np.uint8, copy=False), frame.duration


def _opened(film: Path) -> InputContainer:
    """Open a film to read; raises RenderError if it is none."""
    try:
        return av.open(str(film))
    except av.FFmpegError as error:
        raise RenderError(f"{film}: {error.strerror}") from error


def _film(path: Path) -> OutputContainer:
    """Open a film to write; an mp4 will start to play before all of it is there."""
    return av.open(str(path), "w", container_options={"movflags": "+faststart"})


def _palette(samples: Iterable[Pixels], size: tuple[int, int]) -> VideoFrame:
    """Return 16 x 16 pixels, of the colours that show the samples best."""
    graph = _graph()
    chooser = graph.add("palettegen", "reserve_transparent=1")
    graph.link_nodes(_source(graph, "rgb24", size), chooser, graph.add("buffersink")).configure()
    for pixels in samples:
        graph.push(VideoFrame.from_numpy_buffer(pixels))
    graph.push(None)
    return graph.vpull()


def _graph() -> Graph:
    """Return filters without threads of their own, which a fork of this process would not have."""
    graph = Graph()
    graph.threads = 1
    return graph


def _source(graph: Graph, form: str, size: tuple[int, int]) -> FilterContext:
    """Give the graph an entry for frames."""
    return graph.add_buffer(None, *size, VideoFormat(form), time_base=TICK)


@contextmanager
def _said_in_one_line() -> Iterator[None]:
    """Raise OSError if the disk failed ffmpeg, otherwise RenderError with its words."""
    try:
        yield
    except UnknownCodecError as error:
        raise RenderError(f"ffmpeg: there is no codec {error}") from error
    except av.FFmpegError as error:
        if error.errno in DEVICE_ERRORS:
            raise OSError(error.errno, os.strerror(error.errno)) from error
        raise RenderError(f"ffmpeg: {error.strerror}") from error
