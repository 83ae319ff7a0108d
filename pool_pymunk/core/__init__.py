"""The core plays balls on a table exactly, one event after another: motion, walls, contacts.

mypyc compiles all modules of this folder when the package is built, but no ``__init__``. The same
modules also run as plain Python, with the same bits: where they are not compiled, where librt is
missing, by which compiled modules read and write numbers, and where POOL_PYMUNK_PURE=1 is set,
which a debugger, doctests and a measure of coverage need.

``compiled`` tells which of both this program has.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import SOURCE_SUFFIXES, FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import find_spec
from types import ModuleType


class Sources:
    """This finder prefers the sources of the core to what is compiled beside them."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find a module of the core by its source; Python asks."""
        if path is None or not name.startswith(f"{__name__}."):
            return None
        places = (FileFinder(place, (SourceFileLoader, SOURCE_SUFFIXES)) for place in path)
        return next(filter(None, (place.find_spec(name) for place in places)), None)


has_librt = find_spec("librt") is not None
if os.environ.get("POOL_PYMUNK_PURE") == "1" or not has_librt:
    sys.meta_path.insert(0, Sources)
if not has_librt:
    sys.modules["librt.strings"] = import_module(f"{__name__}.plain")

_engine = find_spec(f"{__name__}.engine")
compiled = _engine is not None and not (_engine.origin or "").endswith(tuple(SOURCE_SUFFIXES))
