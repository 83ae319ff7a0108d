"""This module has the figures of all pictures."""

from __future__ import annotations

import io

from matplotlib import figure


class Figure(figure.Figure):
    """A notebook shows this figure as a picture, with or without ``%matplotlib inline``.

    >>> Figure((2.0, 1.0))._repr_png_()[1:4]
    b'PNG'
    """

    def _repr_png_(self) -> bytes:
        """Return the picture as a PNG file."""
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()
