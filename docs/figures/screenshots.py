"""This takes pictures of the page, and films the live table, in a browser.

``make screenshots`` puts them into the gallery.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from live_film import film
from playwright.sync_api import sync_playwright

from pool_pymunk import load, simulate, simulate_all
from pool_pymunk.page import write_page

GALLERY = Path(__file__).parents[2] / "renders" / "gallery"


def main() -> None:
    """Take a picture of the report's shots in light, and of the same with a ghost in dark."""
    folder = Path(tempfile.mkdtemp())
    scene = load("report")
    runs = list(simulate_all(scene, solver="pymunk"))
    ghosts = [simulate(scene, 1, solver="pymunk-builtin")]
    write_page([[run] for run in runs], folder / "page.html")
    runs[0].to_html(folder / "page-ghost.html", overlay=ghosts)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        for name, scheme, size in (
            ("page", "light", (1280, 800)),
            ("page-ghost", "dark", (1280, 800)),
        ):
            looks = {"width": size[0], "height": size[1]}
            page = browser.new_page(viewport=looks, color_scheme=scheme)
            page.goto((folder / f"{name}.html").as_uri())
            page.evaluate("pool.seek(0.6)")
            page.screenshot(path=GALLERY / f"{name}.png")
        film(browser, GALLERY / "live-table.gif")
        browser.close()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
