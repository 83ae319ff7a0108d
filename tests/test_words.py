"""Docstrings begin with a sentence, and the glossary names modules that exist."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import pool_pymunk

HOME = Path(pool_pymunk.__file__).parent
DOCS = Path(__file__).parent.parent / "docs"
GLOSSARY = (DOCS / "glossary.md").read_text(encoding="utf-8")

# These words begin a clause without a verb of its own: "What a solver returns."
DANGLING = ("What", "That", "Those", "Which", "Who", "Whose", "Whether", "How")

# These turns of phrase were given up, because a reader from elsewhere reads them twice.
GIVEN_UP = (
    "but for",
    "hang on",
    "hangs on",
    "by so much",
    "forth and back",
    "on demand",
    "is wanted",
)


def modules() -> Iterator[tuple[str, ast.Module]]:
    """Yield the path of every module in the package, and its syntax tree."""
    for path in sorted(HOME.rglob("*.py")):
        yield path.relative_to(HOME).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of every docstring in a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text is not None:
                yield node.body[0].lineno, text


def dangles(text: str) -> bool:
    """Tell whether a docstring begins with a clause instead of a sentence."""
    return text.split(maxsplit=1)[0].rstrip(",.:;") in DANGLING


@pytest.mark.parametrize("module", [name for name, _ in modules()])
def test_no_docstring_dangles(module: str) -> None:
    tree = ast.parse((HOME / module).read_text(encoding="utf-8"))
    assert [found for found in docstrings(tree) if dangles(found[1])] == []


def test_what_was_given_up_does_not_come_back() -> None:
    files = [*HOME.rglob("*.py"), *HOME.rglob("*.js"), *DOCS.glob("*.md")]
    for path in files:
        text = path.read_text(encoding="utf-8").lower()
        assert not [turn for turn in GIVEN_UP if re.search(rf"\b{turn}\b", text)], path


def test_what_dangles() -> None:
    tree = ast.parse('"""What a ball does."""\ndef f():\n    """Whether, or not."""\n')
    assert [line for line, text in docstrings(tree) if dangles(text)] == [1, 3]
    assert not dangles("Return what a ball does.")
    assert not dangles("However it is, this is a sentence.")


def entries() -> list[tuple[str, str]]:
    """Return the words of the glossary, each with the modules that it names."""
    return re.findall(r"^\*\*(.+?)\*\* \((.+?)\):", GLOSSARY, flags=re.MULTILINE | re.DOTALL)


def test_the_glossary_is_alphabetical() -> None:
    words = [word.lower() for word, _ in entries()]
    assert len(words) == len(re.findall(r"^\*\*", GLOSSARY, flags=re.MULTILINE)) > 40
    assert words == sorted(words)


def test_every_module_of_the_glossary_exists() -> None:
    for word, named in entries():
        found = re.findall(r"`([a-z_/]+\.py)`", named)
        assert found, f"{word} names no module"
        for module in found:
            assert (HOME / module).is_file(), f"{word}: there is no {module}"
