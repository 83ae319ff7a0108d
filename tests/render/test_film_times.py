"""Frames of films come at their times: rounded, joined, and in a row of several."""

from __future__ import annotations

from itertools import accumulate, repeat
from pathlib import Path

import av
import numpy as np
import pytest

from pool_pymunk.render import join
from pool_pymunk.render.films import timed, write_mp4

FRAME = np.zeros((90, 160, 4), np.uint8)


@pytest.mark.parametrize("fps", [24.0, 30.0, 29.97, 45.0, 50.0])
def test_a_gif_is_never_half_a_hundredth_of_a_second_late(fps: float) -> None:
    ticks = [shown for _, shown in timed(repeat(FRAME, 1_000), fps)]
    for k, at in enumerate(accumulate(ticks), start=1):
        assert abs(at - 100.0 * k / fps) < 0.51


def test_films_that_are_joined_follow_each_other(tmp_path: Path) -> None:
    films = [tmp_path / f"{k}.mp4" for k in range(3)]
    for path in films:
        write_mp4(path, repeat(FRAME, 4), 25.0)
    join(films, tmp_path / "all.mp4")
    with av.open(str(tmp_path / "all.mp4")) as film:
        times = [frame.time for frame in film.decode(video=0)]
    np.testing.assert_allclose(times, np.arange(12) / 25.0, atol=1e-6)
