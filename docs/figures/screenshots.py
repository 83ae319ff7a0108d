"""This takes pictures of the page, and films the live table, in a browser.

``make screenshots`` puts them into the gallery.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from live_film import film
from playwright.sync_api import sync_playwright

from pool_pymunk import load, simulate

GALLERY = Path(__file__).parents[2] / "renders" / "gallery"


def main() -> None:
    """Take a picture of the report's first shot with a ghost, in the dark, and film the table."""
    folder = Path(tempfile.mkdtemp())
    scene = load("report")
    ghosts = [simulate(scene, 1, solver="pymunk-builtin")]
    simulate(scene, 1).to_html(folder / "page-ghost.html", overlay=ghosts)
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        looks = {"width": 1280, "height": 800}
        page = browser.new_page(viewport=looks, color_scheme="dark")
        page.goto((folder / "page-ghost.html").as_uri())
        page.evaluate("pool.seek(0.6)")
        page.screenshot(path=GALLERY / "page-ghost.png")
        film(browser, GALLERY / "live-table.gif")
        browser.close()
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
