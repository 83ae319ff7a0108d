"""The sources of the package, which tests of the house read."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pool_pymunk

HOME = Path(pool_pymunk.__file__).parent


@cache
def trees() -> dict[str, ast.Module]:
    """Return the syntax tree of every module of the package, by its path there."""
    return {
        path.relative_to(HOME).as_posix(): ast.parse(path.read_text(encoding="utf-8"))
        for path in sorted(HOME.rglob("*.py"))
    }
