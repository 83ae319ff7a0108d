"""The sources of the package, which tests of the house read."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pool_pymunk

HOME = Path(pool_pymunk.__file__).parent


@cache
def trees() -> dict[str, ast.Module]:
    """Return the syntax tree of every module of the package, by its path there.

    The collector of garbage does not look at all the nodes, which stay.
    """
    gc.disable()
    found = {
        path.relative_to(HOME).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(HOME.rglob("*.py"))
    }
    gc.freeze()
    gc.enable()
    return found


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and all statements in it, which are far fewer than nodes."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.expr):
            yield from statements(child)


@cache
def definitions() -> tuple[tuple[str, ast.Module | ast.ClassDef | ast.FunctionDef], ...]:
    """Return every module, class and function of the package, each with the path of its module."""
    return tuple(
        (path, node)
        for path, tree in trees().items()
        for node in statements(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
    )
