"""This module keeps numba from what is damaged in its cache.

numba reads back what it has compiled without a check. A file that was cut short raises an error,
and machine code with a wrong byte does whatever it likes. So a seal, the hash of a function's
files, lies beside them, and files that differ from it are compiled anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # Windows has no such locks; there each process compiles.
    fcntl = None  # type: ignore[assignment]


class SealedCache:
    """A sealed cache is numba's cache of one function, of which only whole files are read.

    ``compiles`` is called before something is compiled.
    """

    def __init__(self, cache: Any, name: str, compiles: Callable[[], object]) -> None:
        self._cache = cache
        self._folder = Path(cache.cache_path)
        self._name = name
        self._compiles = compiles

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return what is compiled for a signature, or None."""
        found = self._cache.load_overload(signature, context) if self._is_whole() else None
        if found is None:
            self._compiles()
        return found

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled; where that cannot be written it is compiled again next time."""
        with suppress(OSError):
            if not self._is_whole():
                self._cache.flush()
            self._cache.save_overload(signature, compiled)
            self._seal.write_text(self._hash())

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait until no other process compiles the function; then it is found in the cache."""
        with ExitStack() as stack:
            with suppress(OSError):
                self._folder.mkdir(parents=True, exist_ok=True)
                file = stack.enter_context((self._folder / f"{self._name}.lock").open("a"))
                if fcntl is not None:
                    fcntl.flock(file, fcntl.LOCK_EX)
            yield

    @property
    def _seal(self) -> Path:
        return self._folder / f"{self._name}.sha256"

    def _is_whole(self) -> bool:
        """Tell whether the files are those that were sealed."""
        try:
            return self._seal.read_bytes() == self._hash().encode()
        except OSError:
            return False

    def _hash(self) -> str:
        """Return the hash of the function's files, by their names."""
        digest = hashlib.sha256()
        for path in sorted(self._folder.glob(f"*{self._name}-*.nb[ic]")):
            digest.update(path.name.encode() + path.read_bytes())
        return digest.hexdigest()
