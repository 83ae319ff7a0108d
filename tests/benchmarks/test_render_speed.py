"""The command ``render report`` takes less time than its films last: ``make bench``.

``extra_info`` has the wall time over the length of the combined film alone, and of all five films.
It also has the processor time of drawing and of encoding together.
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from pool_pymunk import load, simulate
from pool_pymunk.render import FilmSettings, Show, frame_count, picture
from pool_pymunk.render.stage import Stage

REPORT = load("report")
RUNS = [simulate(REPORT, shot) for shot in REPORT.shots]


def film_length() -> float:
    """Return how long (s) the four films last together, as the combined one does."""
    settings = FilmSettings()
    return sum(frame_count(run, settings) + settings.held for run in RUNS) / settings.fps


def test_render_report_is_faster_than_its_films(benchmark: Any, tmp_path: Path) -> None:
    if not benchmark.enabled:
        pytest.skip("a question of speed")
    command = [sys.executable, "-m", "pool_pymunk", "render", "report", "--out", str(tmp_path)]

    def render() -> float:
        began = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        return time.perf_counter() - began

    wall = benchmark.pedantic(render, rounds=3)
    resource = pytest.importorskip("resource", reason="Windows does not count this time")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    benchmark.extra_info["wall over the combined film"] = wall / film_length()
    benchmark.extra_info["wall over all films"] = wall / (2 * film_length())
    benchmark.extra_info["processor time (s)"] = (used.ru_utime + used.ru_stime) / 3
    assert len(list(tmp_path.iterdir())) == 13
    assert wall < 2 * film_length()


def test_frames_are_drawn_faster_than_shown(benchmark: Any) -> None:
    """Drawing alone is measured, without the encoder: seconds a frame, by one process."""
    show, settings = Show((RUNS[0],)), FilmSettings()

    def draw() -> int:
        stage = Stage(show, settings)
        return sum(1 for _ in stage.frames())

    frames = benchmark(draw)
    assert frames == frame_count(RUNS[0], settings)
    if benchmark.enabled:
        benchmark.extra_info["ms a frame"] = 1000 * benchmark.stats["min"] / frames
        assert benchmark.stats["min"] / frames < 1 / settings.fps


def test_picture_takes_a_moment(benchmark: Any, tmp_path: Path) -> None:
    benchmark(picture, RUNS[0], tmp_path / "a.png", when="end")
    if benchmark.enabled:
        assert benchmark.stats["min"] < 0.5
