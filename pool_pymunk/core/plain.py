"""This stands for librt.strings where librt is not installed, as in a browser: numbers as bytes."""

from __future__ import annotations

from struct import Struct
from typing import Final, final

FLOAT: Final = Struct("<d")
INT: Final = Struct("<q")


@final
class BytesWriter:
    """A writer collects the bytes of numbers that the core writes."""

    def __init__(self) -> None:
        self.found = bytearray()

    def getvalue(self) -> bytes:
        """Return all bytes so far."""
        return bytes(self.found)


def write_f64_le(writer: BytesWriter, number: float) -> None:
    """Write eight bytes of a number."""
    writer.found += FLOAT.pack(number)


def write_i64_le(writer: BytesWriter, number: int) -> None:
    """Write eight bytes of a whole number."""
    writer.found += INT.pack(number)


def read_f64_le(numbers: bytes, at: int) -> float:
    """Return the number whose eight bytes begin at a place."""
    found: float = FLOAT.unpack_from(numbers, at)[0]
    return found
