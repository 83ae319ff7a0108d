"""The core is what mypyc compiles: short functions with types, which need nothing from outside."""

from __future__ import annotations

import ast
import re
import sys
from functools import cache
from graphlib import TopologicalSorter

from tests.shared.sources import HOME, trees

MOST_LINES, MOST_ARGUMENTS = 60, 6


@cache
def files() -> dict[str, ast.Module]:
    """Return the syntax trees of the core's files, by the names of their modules."""
    return {
        "pool_pymunk." + path.removesuffix(".py").replace("/", "."): tree
        for path, tree in trees().items()
        if path.startswith("core/") and not path.endswith("__init__.py")
    }


def for_types(tree: ast.Module) -> set[ast.AST]:
    """Return what stands under ``if TYPE_CHECKING``."""
    blocks = [node for node in tree.body if isinstance(node, ast.If)]
    assert all(ast.unparse(block.test) == "TYPE_CHECKING" for block in blocks)
    return {node for block in blocks for node in ast.walk(block)}


def imported(tree: ast.Module) -> set[str]:
    """Return the modules that a file imports when it runs."""
    found, aside = set[str](), for_types(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node not in aside:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= names & files().keys() or {str(node.module)}
    return found


def test_functions_are_short() -> None:
    for file, tree in files().items():
        for each in ast.walk(tree):
            if isinstance(each, ast.FunctionDef):
                assert each.end_lineno is not None
                assert each.end_lineno - each.lineno < MOST_LINES, (file, each.name)
                own = [arg.arg for arg in each.args.args if arg.arg != "self"]
                assert len(own) <= MOST_ARGUMENTS or each.name == "__init__", (file, each.name)


def test_all_has_types() -> None:
    for path in (HOME / "core").rglob("*.py"):
        untyped = r"\bAny\b|type: ignore|\bcast\b"
        assert not re.search(untyped, path.read_text(encoding="utf-8")), path


def test_it_needs_the_standard_library_and_itself() -> None:
    for file, tree in files().items():
        for module in imported(tree):
            first = module.partition(".")[0]
            is_own = module.startswith("pool_pymunk.core")
            known = first in sys.stdlib_module_names or first in ("mypy_extensions", "librt")
            assert is_own or known, (file, module)


def test_no_file_imports_itself_by_others() -> None:
    graph = {file: imported(tree) for file, tree in files().items()}
    assert len([*TopologicalSorter(graph).static_order()]) > len(graph)
