"""This films a game on the live table, for the gallery: ``make screenshots`` runs it."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.image import imread

from pool_pymunk import load
from pool_pymunk.page.live.server import LiveServer
from pool_pymunk.render.canvas import Pixels
from pool_pymunk.render.films import write_gif

WINDOW, SCALE = (1000, 650), 0.8  # the page's size, and pixels of the film for one of it
FPS = 10
AIM = (1.05, 0.62)  # m; where the drag ends
LONG = 18  # frames; text is shown for this long
TIMEOUT = 60_000  # ms

Frame = tuple[Pixels, int]  # a picture, and for how many frames it is shown


def film(browser: Any, path: Path) -> None:
    """Film a shot on the report's table: aimed, played, played by stock pymunk, and with errors."""
    server = LiveServer(load("report"))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        page = browser.new_page(
            viewport=dict(zip(("width", "height"), WINDOW, strict=True)),
            color_scheme="dark",
            device_scale_factor=SCALE,
        )
        page.goto(server.address)
        frames = list(_frames(page))
    finally:
        server.stop()
        thread.join()
    samples = [pixels for pixels, _ in frames[:: len(frames) // 8]]
    write_gif(path, ((pixels, length * 100 // FPS) for pixels, length in frames), samples)


def _frames(page: Any) -> Iterator[Frame]:
    ball = page.evaluate("live.aim.ball")
    from_, to = (
        _pixel(page, *point) for point in (page.evaluate("live.start.position")[ball], AIM)
    )
    yield _shown(page), 8
    page.mouse.move(*from_)
    page.mouse.down()
    for k in range(1, 13):
        page.mouse.move(*(a + (b - a) * k / 12 for a, b in zip(from_, to, strict=True)))
        _wait(page, "(live.track || !live.drag.aim) && !live.aims.busy")
        yield _shown(page), 1
    yield _shown(page), 8
    page.mouse.up()
    yield from _played(page, "live.last")
    page.select_option("#solver", "pymunk-builtin")
    yield from _played(page, "live.last.solver === 'pymunk-builtin'")
    page.select_option("#solver", "pymunk")
    _wait(page, "live.last.solver === 'pymunk' && !live.shooting")
    for error in ("0.1", "0.4"):
        page.fill("#angle-error", error)
        _wait(page, "live.cloud && !live.clouds.busy")
        page.evaluate("player.jump(player.duration)")
        yield _shown(page), LONG // 2
    yield _shown(page), LONG


def _played(page: Any, ready: str) -> Iterator[Frame]:
    """Show a shot from its start to its end."""
    _wait(page, f"{ready} && !live.shooting")
    duration = page.evaluate("player.duration")
    for t in np.arange(0.0, duration, 1.0 / FPS).tolist():
        page.evaluate("(t) => player.jump(t)", t)
        yield _shown(page), 1
    page.evaluate("player.jump(player.duration)")
    yield _shown(page), LONG


def _shown(page: Any) -> Pixels:
    picture = imread(io.BytesIO(page.screenshot()), format="png")[..., :3]
    return np.ascontiguousarray((255.0 * picture).round().astype(np.uint8))


def _pixel(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the table (m) is in the window."""
    box = page.locator("#table").bounding_box()
    script = "([x, y]) => live.table.place(x, y).map((p) => p / live.table.ratio)"
    px, py = page.evaluate(script, [x, y])
    return box["x"] + px, box["y"] + py


def _wait(page: Any, script: str) -> None:
    for _ in range(TIMEOUT // 20):
        if page.evaluate(f"Boolean({script})"):
            return
        page.wait_for_timeout(20)
    raise RuntimeError(f"{script} did not come true")
