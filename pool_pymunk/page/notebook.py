"""This module shows runs, scenes and batches in notebooks."""

from __future__ import annotations

import base64
import html
import io

from pool_pymunk.fast import Batch
from pool_pymunk.model import Scene
from pool_pymunk.page.document import page
from pool_pymunk.render import Figure, figure_of
from pool_pymunk.render.clouds import batch_figure
from pool_pymunk.results.run import Run

HEIGHT = 640  # pixels
DPI = 100


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
    look = "max-width: 100%"
    return f'<img src="data:image/png;base64,{image}" style="{look}"><p>{html.escape(words)}</p>'
