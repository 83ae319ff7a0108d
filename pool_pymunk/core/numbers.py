"""Many numbers come to the core, and leave it, as the bytes of arrays.

So no object of Python is made for a number. librt is the library of mypyc for that.
"""

from __future__ import annotations

__all__ = ["BytesWriter", "read_f64_le", "read_i64_le", "write_f64_le", "write_i64_le"]

try:
    from librt.strings import BytesWriter, read_f64_le, read_i64_le, write_f64_le, write_i64_le
except ImportError:
    from pool_pymunk.core.plain import (  # type: ignore[assignment]
        BytesWriter,
        read_f64_le,
        read_i64_le,
        write_f64_le,
        write_i64_le,
    )
