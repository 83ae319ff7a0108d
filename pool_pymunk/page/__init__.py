"""This package makes a page of runs: one HTML file that plays them exactly, in any browser.

``static/`` has the page's own files: ``page.html``, ``page.css``, and the scripts ``motion.js``
(where balls are at any time), ``table.js`` and ``plot.js`` (what is drawn), ``player.js`` (the
controls) and ``main.js`` (what it offers to other code). They are put into the file as they are.
"""

from pool_pymunk.page.document import (
    batch_in_notebook,
    page,
    run_in_notebook,
    scene_in_notebook,
    write_page,
)

__all__ = ["batch_in_notebook", "page", "run_in_notebook", "scene_in_notebook", "write_page"]
