"""Numbers have the same bytes with librt and without it."""

from __future__ import annotations

import math
import struct
import subprocess
import sys

from librt import strings

from pool_pymunk.core import plain

FLOATS = (0.0, -0.0, 1.0 / 3.0, -5e-324, math.inf, 1.7976931348623157e308)
INTS = (0, -1, 2**62, -(2**63))
# The core is imported where librt is not, as in a browser.
WITHOUT = """
import sys
sys.modules["librt"] = None
from pool_pymunk.core import batch, compiled
print(compiled, batch.BytesWriter.__module__)
"""


def test_plain_python_writes_and_reads_the_same_bytes() -> None:
    own, other = plain.BytesWriter(), strings.BytesWriter()
    for x in FLOATS:
        plain.write_f64_le(own, x)
        strings.write_f64_le(other, x)
    for n in INTS:
        plain.write_i64_le(own, n)
        strings.write_i64_le(other, n)
    written = own.getvalue()
    assert written == other.getvalue() == struct.pack("<6d4q", *FLOATS, *INTS)
    for module in (plain, strings):
        assert [repr(module.read_f64_le(written, 8 * k)) for k in range(6)] == [*map(repr, FLOATS)]


def test_without_librt_the_core_is_plain_python() -> None:
    done = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True)
    assert done.stdout.split() == ["False", "pool_pymunk.core.plain"], done.stderr
