"""This module turns frames into a film, by a pipe to the ffmpeg that imageio brings along."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.output import RenderError, written
from pool_pymunk.safety.files import DEVICE_ERRORS
from pool_pymunk.safety.interrupts import block_sigint, uninterrupted

Write = Callable[[Pixels], object]
Recipe = tuple[str, ...]
PIPE_SIZE = 1 << 20  # bytes; a frame of 1600 x 900 has four million
GIF_SCREEN, GIF_LOOP = 13, 19  # bytes before a gif's colours, and in the block that makes it loop


def mp4(held: int) -> Recipe:
    """Encode in H.264, which browsers and slides play; show the last frame ``held`` times more."""
    pixels = "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"
    named = "setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709:range=tv"
    return (
        *("-vf", f"{pixels},{named},tpad=stop_mode=clone:stop={held}"),
        *("-c:v", "libx264", "-preset", "superfast", "-crf", "18"),
        *("-movflags", "+faststart"),  # The film starts to play before all of it is there.
    )


def gif(held: int, palette: Path) -> Recipe:
    """Encode a gif that loops, in the colours of a palette made by PALETTE."""
    pause = f"[0:v]tpad=stop_mode=clone:stop={held}[film]"
    colors = "[film][1:v]paletteuse=dither=none:diff_mode=rectangle"
    return ("-i", str(palette), "-lavfi", f"{pause};{colors}", "-loop", "0")


PALETTE: Recipe = ("-vf", "palettegen=reserve_transparent=1", "-frames:v", "1", "-update", "1")


@contextmanager
def encoder(path: Path, size: tuple[int, int], fps: float, how: Recipe) -> Iterator[Write]:
    """Take frames (height, width, 3) of ``size`` (width, height) and write them to ``path``.

    Raises RenderError with ffmpeg's own last words if ffmpeg fails, and OSError if the disk does.
    If anything ends the block early, ffmpeg ends, too.
    """
    form = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", repr(fps))
    with tempfile.TemporaryFile() as words:
        arguments = [*form, "-i", "-", *how, str(path)]
        with suppress(BrokenPipeError), _running(arguments, words) as process:
            pipe = process.stdin
            assert pipe is not None
            yield lambda frame: pipe.write(frame.data)
            pipe.close()
        _check(process, words)


def join(films: Sequence[Path], path: Path) -> None:
    """Write films one after another to ``path`` as they are: nothing is encoded again.

    They must be of one size and pace, and gifs also of one palette (see :func:`film`, which takes
    several shots). Raises RenderError if they cannot be joined, and OSError if the disk fails.
    """
    with written(path) as part:
        if path.suffix.lower() == ".gif":
            _join_gifs(films, part)
        else:
            _join_mp4s(films, part)


def _join_mp4s(films: Sequence[Path], path: Path) -> None:
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as words:
        listing = Path(folder) / "films.txt"
        names = [str(film.resolve()).replace("'", r"'\''") for film in films]
        listing.write_text("".join(f"file '{name}'\n" for name in names), encoding="utf-8")
        source = ("-f", "concat", "-safe", "0", "-i", str(listing))
        copied = [*source, "-c", "copy", "-movflags", "+faststart", str(path)]
        with _running(copied, words) as process:
            pass
        _check(process, words)


def _join_gifs(films: Sequence[Path], path: Path) -> None:
    """Join the first gif's head (size, colours, loop), the frames of all, and the closing byte."""
    with path.open("wb") as whole:
        for k, film in enumerate(films):
            data = film.read_bytes()
            head = GIF_SCREEN + 3 * 2 ** ((data[10] & 7) + 1) + GIF_LOOP
            whole.write(data[:-1] if k == 0 else data[head:-1])
        whole.write(b";")


def _ffmpeg() -> str:
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError:
        raise RenderError("there is no ffmpeg (pip install 'imageio[ffmpeg]' brings one)") from None


def _start(arguments: list[str], words: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start ffmpeg in a session of its own, which Ctrl-C does not reach: we end it in order."""
    return subprocess.Popen(
        [_ffmpeg(), "-hide_banner", "-loglevel", "error", "-y", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=words,
        pipesize=PIPE_SIZE,
        start_new_session=True,
    )


@contextmanager
def _running(arguments: list[str], words: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """Run ffmpeg: wait for it after the block, and kill it if the block fails."""
    process = None
    try:
        with uninterrupted(), block_sigint():
            process = _start(arguments, words)
        yield process
        process.wait()
    except BaseException:
        if process is not None:
            process.kill()
        raise
    finally:
        if process is not None:
            process.wait()
            with suppress(OSError):  # The rest in the pipe has nowhere to go.
                if process.stdin is not None:
                    process.stdin.close()


def _check(process: subprocess.Popen[bytes], words: IO[bytes]) -> None:
    """Raise OSError if the disk failed ffmpeg, otherwise RenderError with its last words."""
    if process.returncode == 0:
        return
    words.seek(0)
    said = words.read().decode(errors="replace").strip()
    for code in DEVICE_ERRORS:
        if os.strerror(code) in said:
            raise OSError(code, os.strerror(code))
    raise RenderError(f"ffmpeg: {said.splitlines()[-1].strip() if said else 'failed'}")
