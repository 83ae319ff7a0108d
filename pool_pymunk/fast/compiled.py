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
from collections.abc import Callable, Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, cast

from pool_pymunk.engine import decisions, near
from pool_pymunk.fast import loop
from pool_pymunk.fast.cache import SealedCache
from pool_pymunk.model import outline
from pool_pymunk.physics import contact, laws, motion, path, sides

SOURCES: tuple[ModuleType, ...] = (
    contact, motion, path, sides, laws, decisions, near, outline, loop,
)  # fmt: skip
CACHE = "POOL_PYMUNK_CACHE"  # This environment variable names another folder.

# These are the functions of other modules that the loop calls, and those that they call.
SHARED: tuple[Any, ...] = (
    contact.split, contact.changed, contact.approach, contact.wall_approach,
    motion.stopping_time, motion.slid, motion.slide, motion.time_to_slide, motion.path_to_disc,
    motion.time_of_impact, motion.pressing,
    path.set_off, path.motion_at, path.arrival, path._braking_distance, path._one_moves,
    path._relative, path._allowed_penetration, path._both_move, path.pair_time, path.least_bounce,
    path.Path.is_lost,
    sides.unit, sides.Face.gap, sides.Face.normal, sides.Face.length_along, sides.Post.gap,
    sides.Post.normal, sides.Post.length_along, sides.Rim.gap, sides.Rim.normal,
    sides.Rim.length_along,
    laws._sign, laws._not_reversed, laws.clamped, laws.coulomb, laws.published, laws.cushion,
    laws.slips_by_rounding, laws.published_jumps,
    decisions.nearly_now, decisions.is_closed, decisions.is_hit, decisions.contact_time,
    decisions.sinks, decisions.least_parting, decisions.noise_after, decisions.lasts,
    decisions.is_micro,    decisions.instant,
    near.box, near.piece, near.horizon,
    outline.crosses,
)  # fmt: skip


def is_there() -> bool:
    """Tell whether numba is installed."""
    return find_spec("numba") is not None


@cache
def play_shots() -> Callable[..., int]:
    """Return the compiled loop; compile it if this machine has not done so yet."""
    register_jitable = import_module("numba.extending").register_jitable
    for function in (*SHARED, *_helpers()):
        register_jitable(function)
    return _compiled(loop.play_shots, _say_that_it_compiles)


@cache
def _say_that_it_compiles() -> None:
    print("Compiling the shots for this machine: this takes some seconds, once.", file=sys.stderr)


@cache
def alone(function: Callable[..., int]) -> Callable[..., int]:
    """Return a function compiled that calls no other; without numba return it as it is."""
    return _compiled(function) if is_there() else function


def _compiled(
    function: Callable[..., int], compiles: Callable[[], object] = lambda: None
) -> Callable[..., int]:
    """Return a function that numba compiles, or takes from its cache, when it is called."""
    numba: Any = import_module("numba")
    config = numba.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(cache_folder())
    try:
        compiled = numba.njit(nogil=True, cache=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = before
    compiled._cache = SealedCache(compiled._cache, function.__name__, compiles)
    return cast("Callable[..., int]", compiled)


def _helpers() -> Iterator[FunctionType]:
    """Yield the loop's own functions, but the one that is compiled itself."""
    for function in vars(loop).values():
        is_own = inspect.isfunction(function) and function.__module__ == loop.__name__
        if is_own and function is not loop.play_shots:
            yield function


def cache_folder() -> Path:
    """Return the folder for what is compiled from the present sources."""
    digest = hashlib.sha256(sys.version.encode())
    for module in SOURCES:
        digest.update(inspect.getsource(module).encode())
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
