"""These are scenario files, of which tests change a text."""

from __future__ import annotations

from tests import DATA


def text_of(name: str) -> str:
    """Return the text of one of the scenario files of tests."""
    return (DATA / "scenarios" / f"{name}.toml").read_text("utf-8")


GOOD, RACK, POCKETS, PLACE, ROUND = map(text_of, ("good", "rack", "pockets", "place", "round"))
SIZE = "length = 88\nwidth = 44"
LAUNCH = "velocity = [-4, 0]"
HEXAGON = RACK.replace("rows = 3\napex", 'shape = "hexagon"\nrings = 2\ncenter')


def changed(*changes: tuple[str, str], text: str = GOOD) -> str:
    """Return the good scenario, or another text, with each first text replaced by the second."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text
