"""The bytes of arrays that the core writes are read here."""

from __future__ import annotations

import numpy as np
from librt.strings import BytesWriter
from numpy.typing import NDArray


def floats_in(writer: BytesWriter) -> NDArray[np.float64]:
    """Return the numbers that were written, in an array."""
    return np.frombuffer(writer.getvalue(), "<f8")


def ints_in(writer: BytesWriter) -> NDArray[np.int64]:
    """Return the whole numbers that were written, in an array."""
    return np.frombuffer(writer.getvalue(), "<i8")
