"""This package makes a page of runs: one HTML file that plays them exactly, in any browser.

The page's own files in ``static/`` are put into it as they are.
"""

from pool_pymunk.page.content import other_part
from pool_pymunk.page.document import (
    batch_in_notebook,
    page,
    run_in_notebook,
    scene_in_notebook,
    write_page,
)

__all__ = [
    "batch_in_notebook",
    "other_part",
    "page",
    "run_in_notebook",
    "scene_in_notebook",
    "write_page",
]
