"""This extension tells sphinx-gallery how the examples run, and where their pictures are.

An example writes its pictures into the folder that ``--out`` names. One that opens a window of
pygame instead has a player who pulls back for a shot and then closes the window, without a screen.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
FOLDER = Path(tempfile.gettempdir()) / f"pool-pymunk-examples-{os.getpid()}"
AIM, PULLED = (844, 310), (674, 310)  # pixels of the window

SETTINGS: dict[str, Any] = {
    "examples_dirs": "../examples",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",
    "run_stale_examples": True,  # What they show depends on the package, too.
    "within_subsection_order": "FileNameSortKey",
    "reset_modules": ("gallery.prepare",),
    "reset_argv": "gallery.arguments",
    "image_scrapers": ("gallery.pictures",),
    "capture_repr": (),
    "notebook_extensions": set(),
    "download_all_examples": False,
    "write_computation_times": False,
    "show_signature": False,
}


def prepare(_settings: dict[str, Any], example: str) -> None:
    """Empty the folder for pictures, and make a player ready for a game."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir()
    if "import pygame" in (EXAMPLES / Path(example).name).read_text(encoding="utf-8"):
        play()


def play() -> None:
    """Let a player without a screen aim, press, pull back and close the window."""
    os.environ["SDL_VIDEODRIVER"] = "dummy"
    os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"
    with warnings.catch_warnings():  # pygame asks for pkg_resources, which setuptools warns of.
        warnings.simplefilter("ignore")
        import pygame
    pygame.display.init()
    held = {"pos": PULLED, "buttons": (1, 0, 0)}
    for kind, about in (
        (pygame.MOUSEMOTION, {"pos": AIM, "buttons": (0, 0, 0)}),
        (pygame.MOUSEBUTTONDOWN, {"pos": AIM, "button": 1}),
        (pygame.MOUSEMOTION, held),
        (pygame.QUIT, {}),
    ):
        pygame.event.post(pygame.event.Event(kind, about))


def arguments(_settings: dict[str, Any], _about: dict[str, Any]) -> list[str]:
    """Return the arguments with which an example runs."""
    return ["--out", str(FOLDER)]


def pictures(_block: Any, about: dict[str, Any], settings: dict[str, Any]) -> str:
    """Take what an example has drawn to its page; return the lines there that show it."""
    drawn = [*sorted(FOLDER.glob("*.png")), *window()]
    kept = [Path(next(about["image_path_iterator"])) for _ in drawn]
    for picture, place in zip(drawn, kept, strict=True):
        shutil.move(picture, place)
    return figure_rst([str(place) for place in kept], settings["src_dir"])


def window() -> list[Path]:
    """Return a picture of the window of pygame, if there is one, and close it."""
    pygame: Any = sys.modules.get("pygame")
    surface = pygame and pygame.display.get_init() and pygame.display.get_surface()
    if not surface:
        return []
    picture = FOLDER / "window.png"
    pygame.image.save(surface, picture)
    pygame.quit()
    return [picture]


def remove_folder(_app: Sphinx, _error: Exception | None) -> None:
    """Remove the folder for pictures."""
    shutil.rmtree(FOLDER, ignore_errors=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Remove what remains when the pages are made."""
    app.connect("build-finished", remove_folder)
    return {"parallel_read_safe": True}
