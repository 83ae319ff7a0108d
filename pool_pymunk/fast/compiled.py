"""This module compiles the shots: the loop, and the project's own functions that it calls.

numba compiles them once on each machine, into a folder of the user's cache. The folder's name is a
hash of Python's version and of all sources, because numba itself looks at one source file only.
numba does not check what it reads back, and one wrong byte of machine code may do anything. So a
seal, the hash of a function's files, lies beside them; if they do not match, numba compiles anew.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import platform
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any, cast

from pool_pymunk.engine import groups, instants, persisting
from pool_pymunk.fast import loop
from pool_pymunk.fast.due import not_taken
from pool_pymunk.physics.path import time_in, time_out
from pool_pymunk.physics.sides import bent_to_arc, bent_to_arc_since

try:
    import fcntl
except ImportError:  # Windows has no such locks; there each process compiles.
    fcntl = None  # type: ignore[assignment]

PACKAGE = "pool_pymunk."
WRITING = 0.3  # s; to seal six loops takes 0.08 s.
CACHE = "POOL_PYMUNK_CACHE"  # This environment variable names another folder.

# The loop allocates nothing and needs no reference counts: without them it is 1.2 times as fast.
UNCOUNTED = {"_nrt": False}
# numba documents these options, and not the next ones nor UNCOUNTED. The root and all that it calls
# are compiled with the same ones: numba compiles a function again for each caller with others.
PLAIN = {"nogil": True, "error_model": "numpy"}
QUICK = PLAIN | {"no_cfunc_wrapper": True, "no_rewrites": True}
LINKED = "pool_pymunk.fast.linked"  # This module uses private parts of numba.
# Inlined calls made shots 1.3 times as fast, and took no longer to compile. Calls for rare contacts
# and for bent paths to arcs are not inlined: with them compilation took minutes.
APART = (
    "pool_pymunk.engine.answers",
    "pool_pymunk.engine.borders",
    "pool_pymunk.engine.groups",
    "pool_pymunk.engine.modes",
    "pool_pymunk.engine.persisting",
    "pool_pymunk.fast.asked",
    "pool_pymunk.fast.instant",
    "pool_pymunk.fast.shared",
    "pool_pymunk.physics.collapse",
    "pool_pymunk.physics.complementarity",
    "pool_pymunk.physics.forces",
    "pool_pymunk.physics.moving",
    "pool_pymunk.physics.patches",
    "pool_pymunk.physics.persistent",
    "pool_pymunk.physics.pieces",
    "pool_pymunk.physics.pressed",
    "pool_pymunk.physics.together",
)
OFTEN = (persisting.note_hit, groups.forget_all, groups.forget_ball, persisting.is_slow)
RARE = (
    instants.answer_round, instants.answer_several, instants.answer_cluster,
    instants.absorb, instants.take_apart, instants.take_all_in,
    not_taken, bent_to_arc, bent_to_arc_since, time_in, time_out,
)  # fmt: skip


def is_there() -> bool:
    """Tell whether numba is installed."""
    return find_spec("numba") is not None


@cache
def play_shots(*form: bool) -> Any:
    """Return the compiled loop for scenes of a form (fast/tables.py).

    At its first call numba compiles it, if this machine has not compiled it yet.
    """
    return _compiled(loop.play_shots, _say_that_it_compiles, **UNCOUNTED)


@cache
def _say_that_it_compiles() -> None:
    needs = "a minute or two" if can_link() else "some minutes"
    print(f"Compiling such shots for this machine: this takes {needs}, once.", file=sys.stderr)


@cache
def _say_that_it_waits() -> None:
    print("Waiting for another process, which compiles the same shots.", file=sys.stderr)


def note_form(function: Callable[..., int], form: tuple[bool, ...]) -> None:
    """Note that this machine has compiled a function for scenes of a form (fast/tables.py)."""
    if not _forms.get((function, form)):
        _forms[function, form] = True
        with suppress(OSError):
            _note(function, form).touch()


def has_form(function: Callable[..., int], form: tuple[bool, ...]) -> bool:
    """Tell whether this machine has compiled a function for scenes of a form.

    numba is not imported for it. What was being written when a process was killed is not there.
    """
    if (function, form) not in _forms:
        is_noted = is_there() and _note(function, form).exists()
        _forms[function, form] = is_noted and _is_sealed(function)
    return _forms[function, form]


_forms: dict[tuple[Callable[..., int], tuple[bool, ...]], bool] = {}  # what is known of them


def _is_sealed(function: Callable[..., int]) -> bool:
    """Tell whether the files of a function, if they have a seal, are those that were sealed."""
    name = function.__name__
    return all(
        is_whole(seal.parent, name) for seal in cache_folder(function).glob(f"*/{name}.sha256")
    )


def is_whole(folder: Path, name: str) -> bool:
    """Tell whether the files of a function in a folder are those that were sealed."""
    try:
        return (folder / f"{name}.sha256").read_bytes() == hash_of(folder, name).encode()
    except OSError:
        return False


def hash_of(folder: Path, name: str) -> str:
    """Return the hash of the names and contents of a function's files."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob(f"*{name}-*.nb[ic]")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


def _note(function: Callable[..., int], form: tuple[bool, ...]) -> Path:
    """Return the file of a note: other machines, folders and versions of numba compile anew."""
    flags = "".join(f"{flag:d}" for flag in form)
    folder = zlib.crc32(function.__code__.co_filename.encode())
    where = f"{flags}-{metadata.version('numba')}-{platform.node()}-{folder:08x}"
    return cache_folder(function) / f"{function.__name__}-{where}.ready"


@cache
def alone(function: Callable[..., int]) -> Callable[..., int]:
    """Return a function; if numba is installed, it is compiled with those that it calls."""
    return _compiled(function) if is_there() else function


@cache
def can_link() -> bool:
    """Tell whether this numba has the private parts that make compilation quick.

    They are tried on a small function, which is kept in the cache like others. Where they fail,
    shots are compiled by what numba documents. The bits are the same, and compilation takes longer.
    """
    try:
        trial = import_module(LINKED).trial
        linked: Any = _compiled(trial, lambda: None, True, **UNCOUNTED)
        with linked._cache.turn():
            return bool(linked(2.0) == trial(2.0))
    except Exception:  # Another numba may raise anything.
        return False


def _compiled(
    function: Any,
    compiles: Callable[[], object] = lambda: None,
    links: bool | None = None,
    /,
    **options: bool,
) -> Callable[..., int]:
    """Return a function that numba compiles, or takes from its cache, when it is called.

    It ``links`` by private parts of numba where they are there, or uses the documented ones alone.
    """
    links = can_link() if links is None else links
    numba: Any = import_module("numba")
    for called in functions(function):
        if called is not function:
            _register(called, links)
    config, folder = numba.config, cache_folder(function)
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        compiled = numba.njit(cache=True, **(QUICK | options if links else PLAIN))(function)
    finally:
        config.CACHE_DIR = before
    if links:
        compiled._cache = SealedCache(compiled._cache, function.__name__, compiles)
    elif not any(folder.rglob(f"*.{function.__name__}-*.nbi")):
        compiles()
    return cast("Callable[..., int]", compiled)


def turn(compiled: Any) -> AbstractContextManager[object]:
    """Wait until no other process compiles a function; then it is found in the cache."""
    return compiled._cache.turn() if can_link() else nullcontext()


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
            twin = getattr(value, "compiled", None)
            waiting += _named(value) if twin is None else [twin]
    return frozenset(found)


def _named(function: FunctionType) -> Iterator[object]:
    """Yield the objects that a function names, also as attributes of a module."""
    scope = inspect.getclosurevars(function)
    for value in (*scope.globals.values(), *scope.nonlocals.values()):
        yield value
        if inspect.ismodule(value):
            yield from (getattr(value, name, None) for name in function.__code__.co_names)


@cache
def _register(function: FunctionType, links: bool) -> None:
    """Tell numba that compiled functions may call this one."""

    def implementation(*args: Any, **_: Any) -> FunctionType:
        twin = getattr(function, "compiled", function)
        while hasattr(twin, "choice"):
            has, one, other = twin.choice
            twin = one if args[0].typeof(has).shape[0] > 0 else other
        return cast("FunctionType", twin)

    options: dict[str, Any] = PLAIN
    if links:
        linked = import_module(LINKED).LinkedCompiler
        options = {**QUICK, "pipeline_class": linked, "no_cpython_wrapper": False}
    import_module("numba.extending").overload(function, options, strict=False)(implementation)


def is_inlined(function: FunctionType) -> bool:
    """Tell whether calls of a function are inlined."""
    return function in OFTEN or (function.__module__ not in APART and function not in RARE)


def sources(root: Callable[..., int] = loop.play_shots) -> list[str]:
    """Return the names of the modules from which a function is compiled."""
    return sorted({function.__module__ for function in functions(root)})


def cache_folder(root: Callable[..., int] = loop.play_shots) -> Path:
    """Return the folder for what is compiled from the present sources of a function."""
    digest = hashlib.sha256(sys.version.encode())
    for name in sources(root):
        digest.update(source_of(name).encode())
    try:
        of_user = os.environ.get(CACHE)
        if not of_user:  # platformdirs comes with the extra of numba.
            of_user = import_module("platformdirs").user_cache_path("pool_pymunk") / "compiled"
        folder = Path(of_user) / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="pool_pymunk-"))
    return folder


def source_of(name: str) -> str:
    """Return the source of a module, which may not be imported yet."""
    loader: Any = getattr(find_spec(name), "loader", None)
    return str(loader.get_source(name))


class SealedCache:
    """A sealed cache is numba's cache of one function; it reads files only if they are whole."""

    def __init__(self, cache: Any, name: str, compiles: Callable[[], object]) -> None:
        self._cache, self._folder, self._name = cache, Path(cache.cache_path), name
        self._compiles = compiles  # This is called before something is compiled.

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return what is compiled for a signature, or None."""
        is_sound = is_whole(self._folder, self._name) or self._is_whole_soon()
        found = self._cache.load_overload(signature, context) if is_sound else None
        if found is None:
            self._compiles()
        return found

    def _is_whole_soon(self) -> bool:
        """Tell whether the files are whole again in a moment, which it takes to write them."""
        if (self._folder / f"{self._name}.sha256").exists():
            time.sleep(WRITING)
        return is_whole(self._folder, self._name)

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled; if it cannot be written, it is compiled again next time."""
        with suppress(OSError):
            if not is_whole(self._folder, self._name):
                self._cache.flush()
                for note in self._folder.parent.glob(f"{self._name}-*.ready"):
                    note.unlink()
            self._cache.save_overload(signature, compiled)
            seal = self._folder / f"{self._name}.sha256"
            seal.write_text(hash_of(self._folder, self._name))

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Wait until no other process compiles the function; then it is found in the cache."""
        with ExitStack() as stack:
            with suppress(OSError):
                self._folder.mkdir(parents=True, exist_ok=True)
                file = stack.enter_context((self._folder / f"{self._name}.lock").open("a"))
                if fcntl is not None:
                    try:
                        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    except BlockingIOError:
                        _say_that_it_waits()
                        fcntl.flock(file, fcntl.LOCK_EX)
            yield
