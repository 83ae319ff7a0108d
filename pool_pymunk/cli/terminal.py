"""This module draws on the terminal: lines, tables, and bars that show how far a command is."""

from __future__ import annotations

import io
import os
import re
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import rich.progress as bars
from rich.console import Console
from rich.table import Table as Printed
from rich.terminal_theme import TerminalTheme
from rich.text import Text

from pool_pymunk.results.table import ResultTable

Part = str | Text | Printed | ResultTable  # what can be printed

WIDTH = 160  # characters of a line in a pipe, which has no width of its own, unless COLUMNS says it
DRAWN = 100  # characters of a line in a drawing, which can then be read at the width of a page
# On white, each colour of a drawing can be read: black, red, green, yellow and so on, as terminals
# number them. Their yellow is hard to read there, so it is brown.
BLACK, WHITE, BROWN = (0, 0, 0), (255, 255, 255), (138, 75, 0)
COLORS = [BLACK, (170, 0, 0), (0, 110, 0), BROWN, (0, 0, 170), (128, 0, 128), (0, 100, 110), BLACK]
PAPER = TerminalTheme(WHITE, BLACK, COLORS)
PACE = 0.1  # s between two times that a bar shows of a shot


def heading(text: str) -> Text:
    """Return a heading for what is shown below."""
    return Text(f"\n{text}", style="bold")


def show(*parts: Part) -> None:
    """Print lines, and tables with a line below, above a bar if there is one.

    What is too wide for a line is printed as several tables.
    """
    is_known = Console().is_terminal or "COLUMNS" in os.environ
    console = Console(width=None if is_known else WIDTH, highlight=False)
    with console.capture() as printed:
        for part in parts:
            if isinstance(part, str | Text):
                console.print(part, soft_wrap=True, markup=False)
                continue
            for one in part.within(console.width) if isinstance(part, ResultTable) else [part]:
                console.print(one.rich() if isinstance(one, ResultTable) else one)
                console.print()
    print(printed.get(), end="")


def draw(title: str, parts: Iterable[str | Printed], path: Path) -> None:
    """Draw lines and tables as they look on a terminal, with black on white, into an SVG file."""
    console = Console(file=io.StringIO(), record=True, width=DRAWN)
    console.print(*(Text(part) if isinstance(part, str) else part for part in parts), sep="\n")
    drawn = console.export_svg(title=title, theme=PAPER)
    path.write_text(re.sub(r"@font-face {.*?}", "", drawn, flags=re.DOTALL), encoding="utf-8")


class Bar(bars.Progress):
    """A bar shows on a terminal how far a job has come, and how long it will still take."""

    def __init__(self, label: str, total: float | None = None) -> None:
        super().__init__(
            bars.TextColumn("{task.description}"), bars.BarColumn(), bars.MofNCompleteColumn(),
            bars.TimeRemainingColumn(), console=Console(stderr=True), transient=True,
            disable=not sys.stderr.isatty(), redirect_stdout=sys.stdout.isatty(),
        )  # fmt: skip
        self.task, self.label, self.said = self.add_task(label, total=total), label, 0.0

    def step(self, count: float = 1) -> None:
        """Show that so many parts more are done."""
        self.advance(self.task, count)

    def come_to(self, done: float, total: float | None = None) -> None:
        """Show that so much is done, of so much in all."""
        self.update(self.task, completed=done, total=total)

    def name(self, what: str) -> None:
        """Show what is being done."""
        self.update(self.task, description=f"{self.label} {what}")

    def at(self, t: float) -> None:
        """Show the time (s) of the shot that is being played."""
        if time.monotonic() - self.said >= PACE:
            self.said = time.monotonic()
            self.name(f"(at {t:.3f} s)")
