"""This module compiles the shots: the loop, and the project's own functions that it calls.

numba compiles them once a machine. The compiled code is kept in a folder of the user's cache, which
is named by a hash of Python's version and of all sources from which it is made, because numba
itself looks at one of them.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, MappingProxyType
from typing import Any, cast

from pool_pymunk.fast import loop
from pool_pymunk.fast.cache import SealedCache

PACKAGE = "pool_pymunk."
CACHE = "POOL_PYMUNK_CACHE"  # This environment variable names another folder.

# The loop allocates nothing. Counting no references to arrays made it 1.2 times as fast.
UNCOUNTED = {"_nrt": False}
# All calls are inlined, which made shots 1.3 times as fast and took no longer to compile.
CALLED: dict[str, Any] = {"forceinline": True, "no_cfunc_wrapper": True, "no_rewrites": True}


def is_there() -> bool:
    """Tell whether numba is installed."""
    return find_spec("numba") is not None


@cache
def play_shots() -> Callable[..., int]:
    """Return the compiled loop; compile it if this machine has not done so yet."""
    return _compiled(loop.play_shots, _say_that_it_compiles, UNCOUNTED)


@cache
def _say_that_it_compiles() -> None:
    print("Compiling the shots for this machine: this takes some seconds, once.", file=sys.stderr)


@cache
def alone(function: Callable[..., int]) -> Callable[..., int]:
    """Return a function compiled, with those of this project that it calls.

    Without numba return it as it is.
    """
    return _compiled(function) if is_there() else function


def _compiled(
    function: Callable[..., int],
    compiles: Callable[[], object] = lambda: None,
    options: Mapping[str, bool] = MappingProxyType({}),
) -> Callable[..., int]:
    """Return a function that numba compiles, or takes from its cache, when it is called."""
    numba: Any = import_module("numba")
    for called in functions(function):
        if called is not function:
            _register(called)
    config = numba.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(cache_folder())
    try:
        compiled = numba.njit(nogil=True, cache=True, error_model="numpy", **options)(function)
    finally:
        config.CACHE_DIR = before
    compiled._cache = SealedCache(compiled._cache, function.__name__, compiles)
    return cast("Callable[..., int]", compiled)


def in_turn(function: Any) -> AbstractContextManager[None]:
    """Keep processes from compiling the same at the same time; what is there already is no wait."""
    return nullcontext() if function.signatures else function._cache.turn()


@cache
def functions(root: Callable[..., int] = loop.play_shots) -> frozenset[FunctionType]:
    """Return a function, and all functions of this project that it calls, directly or not."""
    found: set[FunctionType] = set()
    waiting: list[Any] = [root]
    while waiting:
        value = waiting.pop()
        is_own = inspect.isfunction(value) and value.__module__.startswith(PACKAGE)
        if is_own and value not in found:
            found.add(value)
            waiting += _named(value)
    return frozenset(found)


def _named(function: FunctionType) -> Iterator[object]:
    """Yield what the names in a function stand for, those behind a module's name among it."""
    scope = inspect.getclosurevars(function)
    for value in (*scope.globals.values(), *scope.nonlocals.values()):
        yield value
        if inspect.ismodule(value):
            yield from (getattr(value, name, None) for name in function.__code__.co_names)


@cache
def _register(function: FunctionType) -> None:
    """Tell numba that compiled functions may call this one."""
    import_module("numba.extending").register_jitable(**CALLED)(function)


def sources() -> list[str]:
    """Return the names of the modules from which the loop is compiled."""
    return sorted({function.__module__ for function in functions()})


def cache_folder() -> Path:
    """Return the folder for what is compiled from the present sources."""
    digest = hashlib.sha256(sys.version.encode())
    for name in sources():
        digest.update(inspect.getsource(sys.modules[name]).encode())
    asked = os.environ.get(CACHE)
    try:
        folder = (Path(asked) if asked else _user_cache()) / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="pool_pymunk-"))
    return folder


def _user_cache() -> Path:
    user_cache_path = import_module("platformdirs").user_cache_path
    return Path(user_cache_path("pool_pymunk")) / "compiled"
