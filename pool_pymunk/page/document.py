"""This module puts content, styles and scripts into one HTML file that needs nothing else.

Nothing of a scenario can become markup or script: the content is JSON without a "<", the page's
scripts show it as text, and the file's content security policy allows the page's own scripts
alone, by their hashes, and no requests. The page of a live table may ask its own server.
"""

from __future__ import annotations

import base64
import hashlib
import html
import io
import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from pool_pymunk.many import Batch
from pool_pymunk.model import Scene
from pool_pymunk.page.content import content
from pool_pymunk.render import Figure, figure_of
from pool_pymunk.render.clouds import batch_figure
from pool_pymunk.results.run import Run
from pool_pymunk.safety.files import whole

SCRIPTS = ("motion.js", "table.js", "plot.js", "player.js")
HEIGHT, DPI = 640, 100  # pixels, and pixels an inch, in notebooks


def page(shots: Sequence[Sequence[Run]], predict: bool = False) -> str:
    """Return a page that plays shots, as HTML.

    ``shots`` has a row of runs for each shot. The first run of a row is played; any other can be
    its ghost. To ``predict`` is for a class: each shot stops before its first contact, and the page
    asks where its balls will go. Raises SettingError for runs of different tables or balls.

    >>> from pool_pymunk import load, simulate
    >>> from pool_pymunk.page import page
    >>> text = page([[simulate(load("two-balls"), 1)]])
    >>> text.startswith("<!doctype html>"), "http://" in text, len(text) < 100_000
    (True, False, True)
    """
    return document(content(shots) | {"asks": predict})


def write_page(shots: Sequence[Sequence[Run]], path: str | Path, predict: bool = False) -> None:
    """Write what :func:`page` returns to a file, whole or not at all."""
    text = page(shots, predict)
    with whole(Path(path)) as part:
        part.write_text(text, encoding="utf-8")


def document(shown: Mapping[str, Any], live: bool = False) -> str:
    """Return the page that shows a content; a live page has the controls of a shot, too."""
    asking = ["predict.js"] * bool(shown.get("asks"))
    codes = [source(name) for name in (*SCRIPTS, *asking, "main.js", *["live.js"] * live)]
    data = json.dumps(shown, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    css = source("page.css") + source("live.css") * live
    policy = (
        f"default-src 'none'; script-src {' '.join(map(_hash, codes))}; style-src {_hash(css)}; "
        + "connect-src 'self'; " * live
        + "base-uri 'none'; form-action 'none'"
    )
    return Template(source("page.html")).substitute(
        policy=policy,
        title=html.escape(shown["title"]),
        css=css,
        controls=source("live.html") * live,
        content=data.replace("<", "\\u003c"),  # It stays JSON within HTML.
        scripts="\n".join(f"<script>{code}</script>" for code in codes),
    )


@cache
def source(name: str) -> str:
    """Return one of the page's own files."""
    return (files("pool_pymunk.page") / "static" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """Return the name by which a policy knows a script or a style."""
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def run_in_notebook(run: Run) -> str:
    """Return a run's page in a frame, which may run its own scripts and nothing else."""
    document = html.escape(page([[run]]))
    look = f"width: 100%; height: {HEIGHT}px; border: 0"
    return f'<iframe srcdoc="{document}" sandbox="allow-scripts" style="{look}"></iframe>'


def scene_in_notebook(scene: Scene) -> str:
    """Return a picture of the table as it is set up, and the scene in words."""
    return _picture(figure_of(scene), repr(scene))


def batch_in_notebook(batch: Batch) -> str:
    """Return the clouds of ends, and the batch in words."""
    return _picture(batch_figure(batch), repr(batch))


def _picture(figure: Figure, words: str) -> str:
    """Return a figure as an image of its own in HTML, with words below it."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=DPI)
    image = base64.b64encode(file.getvalue()).decode()
    shown = f'<img src="data:image/png;base64,{image}" style="max-width: 100%">'
    return f"{shown}<p>{html.escape(words)}</p>"
