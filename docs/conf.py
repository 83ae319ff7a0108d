"""Sphinx builds the documentation with this: ``make docs``."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

import pool_pymunk

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE / "figures")]

import gallery  # noqa: E402

project = "pool_pymunk"
author = "the authors of pool_pymunk"
release = version = pool_pymunk.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "commands",
    "formulas",
    "gallery",
]
exclude_patterns = ["_build", "figures", "extensions", "static"]
sphinx_gallery_conf = gallery.SETTINGS
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
smartquotes = False
highlight_language = "none"  # Blocks without a language are commands and what they print.
add_module_names = False
toc_object_entries_show_parents = "hide"

# A ball of a scene and a ball of a space are both called Ball; the first of them is linked to.
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"pool_pymunk {release}"
html_copy_source = False
html_static_path = ["static"]
html_css_files = ["wide.css"]

PLAYED = HERE / "figures" / "made" / "played"  # The page that docs/page.md shows is drawn there.
PLAYED.mkdir(parents=True, exist_ok=True)
html_extra_path = [str(PLAYED)]
html_show_copyright = False

# Only links within the documentation are looked at: other hosts may be out of reach.
linkcheck_ignore = [r"https?://.*"]


def draw_figures(app: Sphinx) -> None:
    """Draw the pictures that are made with the documentation."""
    import draw

    draw.draw_all()


# This is how a type of array is written in full, with any type of its elements.
ARRAY = re.compile(r"ndarray\[tuple\[~?typing\.Any, \.\.\.\], ~?numpy\.dtype\[~?numpy\.\w+\]\]")

# This is how the type of a part's field is written, with its key and what is said about it.
KEYED = re.compile(r"~?[\w.]*\bAnnotated\[(.*?), Key\(\)(?:, (?:'[^']*'|\"[^\"]*\"))?\]")


def plain_signature(_app: Sphinx, *about: Any) -> tuple[str | None, str | None]:
    """Return arguments and answer of a function, with short names of types.

    A default that a class makes anew each time is shown as three dots.
    """
    short = (text and KEYED.sub(r"\1", text) for text in about[-2:])
    arguments, answer = (text and ARRAY.sub("ndarray", text) for text in short)
    return arguments and arguments.replace("<factory>", "..."), answer


def setup(app: Sphinx) -> None:
    """Have the pictures drawn before the pages are read, and signatures kept short."""
    app.connect("autodoc-process-signature", plain_signature)
    app.connect("builder-inited", draw_figures)
