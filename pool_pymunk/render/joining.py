"""This module joins films: mp4 films as they are, gifs in colours that serve all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, islice
from pathlib import Path

import av
import numpy as np

from pool_pymunk.render.encode import FASTSTART, Shown, write_gif
from pool_pymunk.render.output import RenderError, written


def join(films: Sequence[Path], path: Path) -> None:
    """Write films one after another to ``path``; mp4 films as they are, nothing is encoded again.

    They must be of one size and pace (see :func:`film`, which takes several shots). Raises
    RenderError if they cannot be joined, and OSError if the disk fails.
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
    with av.open(str(gif)) as film:
        for frame in film.decode(video=0):
            pixels = frame.reformat(format="rgb24", threads=1).to_ndarray()
            yield pixels.astype(np.uint8, copy=False), frame.duration
