"""The house: every room imports only from floors below it, and only render draws."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import pytest

from tests import DATA, ROOT
from tests.shared.sources import HOME, definitions, trees

# The floors stand from the ground up. A room may import from every floor below its own.
FLOORS = (
    ("safety", "core"),
    ("laws",),
    ("model",),
    ("results",),
    ("world",),
    ("solvers", "report"),
    ("many",),
    ("studies",),
    ("render",),
    ("page", "env"),
    ("cli",),
)
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}

# These are methods that import late from a floor above: each is listed, and each listed is there.
LATE: set[tuple[str, str]] = {
    ("many/batch.py", "page"),
    ("model/scene.py", "page"),
    ("results/run.py", "page"),
    ("results/run.py", "render"),
    ("results/run.py", "studies"),
}

# Only these rooms may import each of these libraries.
ONLY_IN = {
    "matplotlib": "render",
    "typer": "cli",
    "pydantic": "model page",
    "gymnasium": "env",
    "starlette": "page",
    "uvicorn": "page",
}


class Import(NamedTuple):
    """An import tells what a module imports, and whether it does so when it is itself imported."""

    module: str  # its path in the package
    target: str  # dotted
    late: bool

    @property
    def room(self) -> str:
        return self.module.split("/")[0]


@cache
def imports() -> tuple[Import, ...]:
    """Return every import of the package's modules, except the door's and those for types."""
    return tuple(
        found
        for module, tree in trees().items()
        if "/" in module
        for found in _of(module, tree, late=False)
    )


def _of(module: str, node: ast.AST, late: bool) -> Iterator[Import]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and getattr(child.test, "id", "") == "TYPE_CHECKING":
            continue
        if isinstance(child, ast.Import):
            yield from (Import(module, name.name, late) for name in child.names)
        elif isinstance(child, ast.ImportFrom) and child.module:
            if child.module == "pool_pymunk":
                names = (f"pool_pymunk.{name.name}" for name in child.names)
                yield from (Import(module, name, late) for name in names)
            else:
                yield Import(module, child.module, late)
        elif not isinstance(child, ast.expr):
            yield from _of(module, child, late or isinstance(child, ast.FunctionDef))


def room_of(target: str) -> str | None:
    """Return the room that a dotted name leads to; None for the door and for other packages."""
    parts = target.split(".")
    return parts[1] if parts[0] == "pool_pymunk" and len(parts) > 1 and parts[1] in FLOOR else None


def test_every_folder_is_a_room() -> None:
    folders = {path.parent.name for path in HOME.glob("*/__init__.py")}
    assert folders == FLOOR.keys()


def test_arrows_run_down() -> None:
    """A room imports only from rooms below it."""
    for found in imports():
        target = room_of(found.target)
        if target not in (None, found.room) and not found.late:
            assert FLOOR[target or ""] < FLOOR[found.room], found


def test_late_imports_that_run_up_are_listed() -> None:
    up = {
        (found.module, target)
        for found in imports()
        if found.late and (target := room_of(found.target)) and target != found.room
        if FLOOR[target] >= FLOOR[found.room]
    }
    assert up == LATE


# Millions of paths are made, so their numbers come one by one.
MANY_ARGUMENTS = {("core/motion/path.py", "__init__")}
MOST_ARGUMENTS, MOST_LINES = 6, 60


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield every function of the package, with its module."""
    for module, one in definitions():
        if isinstance(one, ast.FunctionDef):
            yield module, one


def test_functions_take_few_arguments() -> None:
    """What a public function takes by keyword alone is read by its name, however much it is."""
    many = set()
    for module, one in functions():
        taken = [*one.args.posonlyargs, *one.args.args]
        is_public = one.name == "__init__" or not one.name.startswith("_")
        taken += [] if is_public else one.args.kwonlyargs
        if len([each for each in taken if each.arg not in ("self", "cls")]) > MOST_ARGUMENTS:
            many.add((module, one.name))
    assert many == MANY_ARGUMENTS


def test_functions_are_short() -> None:
    """Docstrings are no lines."""
    for module, one in functions():
        has_docstring = ast.get_docstring(one, clean=False) is not None
        first = one.body[min(int(has_docstring), len(one.body) - 1)]
        assert (one.end_lineno or 0) - first.lineno < MOST_LINES, (module, one.name)


@pytest.mark.parametrize(("library", "rooms"), ONLY_IN.items())
def test_a_library_has_its_rooms(library: str, rooms: str) -> None:
    users = {found.room for found in imports() if found.target.split(".")[0] == library}
    assert users == set(rooms.split())


def test_solvers_do_not_know_each_other() -> None:
    """A solver is its file and its record."""
    files = {"event_driven", "pymunk_space", "pymunk_discrete", "pymunk_builtin", "time_slice"}
    for found in imports():
        if found.module.removeprefix("solvers/").removesuffix(".py") in files:
            assert found.target.removeprefix("pool_pymunk.solvers.") not in files, found


# Windows has none of these, nor other signals and functions of processes than those in ANYWHERE.
UNIX_MODULES = {"crypt", "curses", "fcntl", "grp", "nis", "ossaudiodev", "posix", "pty", "pwd",
                "readline", "resource", "spwd", "syslog", "termios", "tty", "uvloop"}  # fmt: skip
UNIX_ONLY = re.compile(
    r"signal\.(SIG\w+|ITIMER_\w+|setitimer|getitimer|alarm|pause|siginterrupt|sig\w+|pthread_\w+)"
    r"|os\.(fork\w*|killpg|set[ug]id|get[e]?[ug]id|getpg\w+|setpg\w+|setsid|mkfifo|openpty|wait\w*"
    r"|W[A-Z]+|sched_\w+|uname|getloadavg|nice|ch(own|root)|O_NONBLOCK|O_CLOEXEC|register_at_fork)"
)
ANYWHERE = {"SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM", "SIG_DFL", "SIG_IGN",
            "waitpid"}  # fmt: skip


def unix_only(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield what runs when a module is imported, and needs Unix, with its line.

    That is all but the bodies of functions. A module may try whether there is such a thing: then
    it stands in a ``try`` or ``if``.
    """
    if isinstance(node, ast.Import | ast.ImportFrom):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        for name in names:
            if name.split(".")[0] in UNIX_MODULES:
                yield node.lineno, name
    if isinstance(node, ast.Attribute):
        text = ast.unparse(node)
        if UNIX_ONLY.fullmatch(text) and node.attr not in ANYWHERE:
            yield node.lineno, text
    parts: list[ast.AST] = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        parts = [*node.decorator_list, node.args]
    elif isinstance(node, ast.Lambda):
        parts = [node.args]
    elif isinstance(node, ast.Try | ast.If):
        parts = []
    for part in parts:
        yield from unix_only(part)


@pytest.mark.parametrize("folder", ["pool_pymunk", "tests", "torture", "docs", "examples"])
def test_every_module_can_be_imported_on_windows(folder: str) -> None:
    """There ``import resource`` at the top of one module ended the search for tests."""
    paths = sorted((ROOT / folder).rglob("*.py"))
    assert paths
    for path in paths:
        found = list(unix_only(ast.parse(path.read_text(encoding="utf-8"))))
        assert not found, (path, found)


@pytest.mark.parametrize(
    ("code", "count"),
    [
        ("import resource", 1),
        ("from fcntl import flock", 1),
        ("import os\nasked = os.geteuid()", 1),
        ("import signal\nclass A:\n    heard = (signal.SIGALRM, signal.SIGINT)", 1),
        ("import signal\n@wraps(signal.SIGKILL)\ndef f(): pass", 1),
        ("import signal\ndef f(number=signal.SIGUSR1): pass", 1),
        ("def f():\n    import resource", 0),
        ("try:\n    import fcntl\nexcept ImportError:\n    fcntl = None", 0),
    ],
)
def test_what_needs_unix_is_found(code: str, count: int) -> None:
    assert len(list(unix_only(ast.parse(code)))) == count


def test_the_method_in_one_file_is_one_file() -> None:
    """It is read in one sitting, and checks the contact engine because it does without it."""
    module = "solvers/pymunk_discrete.py"
    own = {room_of(found.target) for found in imports() if found.module == module}
    assert own - {None} == {"laws", "model", "results", "solvers"}
    assert len((HOME / module).read_text(encoding="utf-8").splitlines()) <= 200


def test_tests_mirror_the_rooms() -> None:
    """Who looks for the tests of a room finds them in the folder of its name."""
    folders = [path.parent for path in (ROOT / "tests").rglob("*.py")]
    assert {path.parent.name for path in HOME.glob("*/__init__.py")} <= {f.name for f in folders}
    assert max(Counter(folders).values()) <= 30


def test_no_test_file_imports_another() -> None:
    for path in (ROOT / "tests").rglob("*.py"):
        assert not re.findall(r"^(?:from|import) .*\btest_\w+", path.read_text("utf-8"), re.M), path


def test_what_takes_long_is_there() -> None:
    """A name that has gone would let its test play in `make test` under its new name."""
    files = {path.name: path.read_text("utf-8") for path in (ROOT / "tests").rglob("test_*.py")}
    for name in (DATA / "takes_long.txt").read_text("utf-8").splitlines():
        file, _, test = name.partition("::")
        if test:  # Otherwise it is an example in a docstring.
            assert f"def {test.partition('[')[0]}(" in files[file], name
