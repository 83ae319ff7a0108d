"""The core is what mypyc compiles: short functions with types, which need nothing from outside."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from pool_pymunk import core

HOME = Path(core.__file__).parent
FILES = sorted(path for path in HOME.rglob("*.py") if path.name != "__init__.py")
MOST_LINES, MOST_ARGUMENTS = 60, 6


def name_of(path: Path) -> str:
    return ".".join(("pool_pymunk", "core", *path.relative_to(HOME).with_suffix("").parts))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def functions(path: Path) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree(path)) if isinstance(node, ast.FunctionDef))


def for_types(path: Path) -> set[ast.AST]:
    """Return what stands under ``if TYPE_CHECKING``."""
    blocks = [node for node in tree(path).body if isinstance(node, ast.If)]
    assert all(ast.unparse(block.test) == "TYPE_CHECKING" for block in blocks), path
    return {node for block in blocks for node in ast.walk(block)}


def imported(path: Path) -> set[str]:
    """Return the modules that a file imports when it runs."""
    found, aside = set[str](), for_types(path)
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node not in aside:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            known = {name_of(each) for each in FILES}
            found |= names & known or {str(node.module)}
    return found


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_functions_are_short(path: Path) -> None:
    for each in functions(path):
        assert each.end_lineno is not None
        assert each.end_lineno - each.lineno < MOST_LINES, each.name
        own = [arg.arg for arg in each.args.args if arg.arg != "self"]
        assert len(own) <= MOST_ARGUMENTS or each.name == "__init__", each.name


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_all_has_types(path: Path) -> None:
    assert not re.search(r"\bAny\b|type: ignore|\bcast\b", path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_it_needs_the_standard_library_and_itself(path: Path) -> None:
    for module in imported(path):
        first = module.partition(".")[0]
        is_own = module.startswith("pool_pymunk.core")
        assert is_own or first in sys.stdlib_module_names or first == "mypy_extensions", module


def test_no_file_imports_itself_by_others() -> None:
    graph = {name_of(path): imported(path) for path in FILES}
    assert len([*TopologicalSorter(graph).static_order()]) > len(FILES)
