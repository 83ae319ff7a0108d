"""Docstrings begin with a sentence, a word means one thing, and the glossary names no module."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests import ROOT
from tests.shared.sources import HOME, definitions

DOCS = ROOT / "docs"
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

# These words meant several things, or one thing had several of them. The pattern of a word leaves
# out the uses that stay: public names, JSON keys, verbs, and `left` as a side.
MEANT_SEVERAL = {
    "way": r"(?<![.`\w])ways?\b(?![=:])",  # `Prediction.way` stays.
    "reach": r"(?<![.\w])reach(?=[,)\]:]| [-+*/<=>])|\bthe reach\b",
    "left": r"\b(?:is|are|be|nothing|time) left\b(?! out| over| empty| to | halfway)",
    "old": r"(?<!\w)[Tt]old\b",
    "yardstick": r"(?<![\w\"])yardstick(?! is now)",
    "asting": r"(?<!\w)[Ll]asting\b",
    **dict.fromkeys(("is_pressed", "PRESSED", "unperturbed", "_Search", "Meeting", "PATIENCE"),
                    r"(?<!\w)(?:is_pressed|PRESSED|unperturbed|_Search|Meeting|PATIENCE)\b"),
    "pressed": r"(?<![-./\w\"])pressed\b(?! (?:together|on|=|&&))",  # `physics/pressed.py` stays.
    "not": r"(?<![.\w`\"'])[Kk]not\b|(?<![.\w`\"'])knots\b(?![\"':]|=[^=])",
    "without end": r"\b[Hh]its without end\b",
    "exact run": r"\bthe exact run\b",
}  # fmt: skip


def files() -> Iterator[Path]:
    """Yield the files that people read, except this one and the changelog."""
    found = [path for path in ROOT.glob("*.md") if path.name != "CHANGELOG.md"]
    for room in ("pool_pymunk", "docs", "tests", "examples", "scenarios"):
        found += (ROOT / room).rglob("*.*")
    for path in found:
        is_text = path.suffix in {".py", ".js", ".html", ".md", ".rst", ".toml"}
        if is_text and path != Path(__file__) and "_build" not in path.parts:
            yield path


def dangles(text: str) -> bool:
    """Tell whether a docstring begins with a clause instead of a sentence."""
    return text.split(maxsplit=1)[0].rstrip(",.:;") in DANGLING


def test_no_docstring_dangles() -> None:
    for path, node in definitions():
        assert not dangles(ast.get_docstring(node, clean=False) or "None"), (path, node.body[0])


def test_what_was_given_up_does_not_come_back() -> None:
    for path in files():
        text = path.read_text(encoding="utf-8").lower()
        found = [turn for turn in GIVEN_UP if turn in text and re.search(rf"\b{turn}\b", text)]
        assert not found, path


def test_each_word_means_one_thing() -> None:
    for path in files():
        for line in path.read_text(encoding="utf-8").splitlines():
            said = [each for word, each in MEANT_SEVERAL.items() if word in line]
            assert not [each for each in said if re.search(each, line)], (path, line)


def test_each_class_has_a_name_of_its_own() -> None:
    """The core has its own Path, Wall and Law until the old engine is gone."""
    for is_core in (True, False):
        names = Counter(
            name
            for path in HOME.rglob("*.py")
            if path.is_relative_to(HOME / "core") == is_core
            for name in re.findall(r"^ *class (\w+)[(:]", path.read_text(encoding="utf-8"), re.M)
        )
        assert len(names) > 50
        assert [name for name, count in names.items() if count > 1] == []


def test_what_dangles() -> None:
    assert dangles("What a ball does.") and dangles("Whether, or not.")
    assert not dangles("Return what a ball does.")
    assert not dangles("However it is, this is a sentence.")


def entries() -> list[str]:
    """Return the words of the glossary."""
    return re.findall(r"^\*\*(.+?)\*\*: ", GLOSSARY, flags=re.MULTILINE)


def test_the_glossary_is_alphabetical() -> None:
    words = [word.lower() for word in entries()]
    assert len(words) == len(re.findall(r"^\*\*", GLOSSARY, flags=re.MULTILINE)) > 40
    assert words == sorted(words)


def test_the_glossary_names_no_module() -> None:
    """CONTRIBUTING.md says where things are; the glossary says what they are."""
    assert not re.findall(r"\w+/\w+|\w+\.py\b", GLOSSARY.replace("m/s", ""))
