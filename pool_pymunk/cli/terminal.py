"""This module draws on the terminal: tables, and bars that show how far a command has come."""

from __future__ import annotations

import sys
import time
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import rich.progress as bars
import rich.table
from rich.console import Console

if TYPE_CHECKING:
    from pool_pymunk.studies.sweep.job import Done
    from pool_pymunk.studies.tradeoff import Estimate

WIDTH = 160  # characters of a line in a pipe, which has no width of its own
PACE = 0.1  # s between two moves of the progress bar


def show(*parts: str | rich.table.Table) -> None:
    """Print lines and tables."""
    console = Console(width=None if Console().is_terminal else WIDTH, highlight=False)
    for part in parts:
        console.print(part, soft_wrap=isinstance(part, str))


class TextTable(rich.table.Table):
    """A table has right-aligned columns, except those in ``left``; an empty row draws a line."""

    def __init__(
        self,
        headings: Sequence[str],
        rows: Iterable[Sequence[str]],
        left: Collection[str] = (),
        title: str | None = None,
    ) -> None:
        super().__init__(title=title)
        for k, heading in enumerate(headings):  # Names in the first column never break.
            looks: dict[str, Any] = {"justify": "left" if heading in left else "right"}
            self.add_column(heading, overflow="fold", no_wrap=not k and heading in left, **looks)
        for row in rows:
            if row:
                self.add_row(*row)
            else:
                self.add_section()


class Bar(bars.Progress):
    """A bar shows progress on a terminal, and nothing in a pipe."""

    def __init__(self, label: str, total: float | None, *columns: bars.ProgressColumn) -> None:
        quiet = not sys.stderr.isatty()
        super().__init__(*columns, console=Console(stderr=True), transient=True, disable=quiet)
        self.task = self.add_task(label, total=total)

    def step(self, count: float = 1) -> None:
        """Show that this number of parts more is done."""
        self.advance(self.task, count)


def progress(label: str, total: float) -> Bar:
    """Return a bar with the time that has passed."""
    text = bars.TextColumn("{task.description}")
    return Bar(label, total, text, bars.BarColumn(), bars.TimeElapsedColumn())


class Share:
    """This class moves the progress bar within a shot, by the share of its estimated duration."""

    def __init__(self, bar: Bar, estimates: Sequence[Estimate]) -> None:
        self.bar, self.done, self.moved = bar, 0, time.monotonic()
        self.durations = [one.duration for one in estimates]

    def move(self, t: float) -> None:
        """Show that the shot has come to ``t`` (s)."""
        now = time.monotonic()
        if now - self.moved >= PACE:
            self.moved = now
            part = min(t / self.durations[self.done], 1.0)
            self.bar.update(self.bar.task, completed=self.done + part)

    def finish(self) -> None:
        """Show that a shot is finished."""
        self.done += 1
        self.bar.update(self.bar.task, completed=self.done)


class Counter(Bar):
    """A counter shows how many shots are done, how fast, and how long the others will take."""

    def __init__(self) -> None:
        text = bars.TextColumn("{task.description}")
        super().__init__("", None, bars.BarColumn(), text, bars.TimeRemainingColumn())
        self.began = time.perf_counter()
        self.there: int | None = None
        self.played = self.by_reference = 0

    def take(self, done: Done) -> None:
        """Count the shots that were there at first, then those of each part."""
        if self.there is None:
            self.there = done.shots
        else:
            self.played += done.shots
            self.by_reference += done.by_reference
        rate = self.played / (time.perf_counter() - self.began)
        share = 100.0 * self.by_reference / max(self.played, 1)
        shots = self.there + self.played
        said = f"{shots:,} shots, {rate:,.0f} a second, {share:.2g} % in Python"
        self.update(self.task, description=said, completed=shots, total=done.total)
