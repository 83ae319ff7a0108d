"""This module draws on the terminal: tables, and bars that show how far a command has come."""

from __future__ import annotations

import io
import os
import re
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import rich.progress as bars
from rich.console import Console
from rich.terminal_theme import TerminalTheme
from rich.text import Text

from pool_pymunk.results.table import ResultTable
from pool_pymunk.safety.files import whole

if TYPE_CHECKING:
    from rich.table import Table as Printed

    from pool_pymunk.studies.grid import Estimate
    from pool_pymunk.studies.sweep.job import Done

WIDTH = 160  # characters of a line in a pipe, which has no width of its own, unless COLUMNS says it
DRAWN = 100  # characters of a line in a drawing, which can then be read at the width of a page
# On white, each colour of a drawing can be read: black, red, green, yellow and so on, as terminals
# number them. Their yellow is hard to read there, so it is brown.
BLACK, WHITE, BROWN = (0, 0, 0), (255, 255, 255), (138, 75, 0)
COLORS = [BLACK, (170, 0, 0), (0, 110, 0), BROWN, (0, 0, 170), (128, 0, 128), (0, 100, 110), BLACK]
PAPER = TerminalTheme(WHITE, BLACK, COLORS)
PACE = 0.1  # s between two moves of the progress bar
FIRST, SECOND = 0.7, 1.2  # s until a pipe has a line; the second if no estimate is known
RARER = 8.0  # The next line comes after this many times as long.
SHORT = 5.0  # s; a pipe has no line for shorter ones
TRUST = 0.1  # of a job; a guess before counts as much as what is known after this share
QUICK = 1e-3  # s; what a run takes at least


def show(*parts: str | Printed | ResultTable) -> None:
    """Print lines, and tables with a line below, above a bar if there is one.

    What is too wide for a line is printed as several tables.
    """
    is_known = Console().is_terminal or "COLUMNS" in os.environ
    console = Console(width=None if is_known else WIDTH, highlight=False)
    with console.capture() as printed:
        for part in parts:
            tables = part.within(console.width) if isinstance(part, ResultTable) else [part]
            for one in tables:
                shown = one.rich() if isinstance(one, ResultTable) else one
                console.print(shown, soft_wrap=isinstance(shown, str))
                if not isinstance(shown, str):
                    console.print()
    print(printed.get(), end="")


def draw(path: Path, title: str, *parts: str | Printed) -> None:
    """Draw lines and tables as they look on a terminal, with black on white, into an SVG file."""
    console = Console(file=io.StringIO(), record=True, width=DRAWN)
    console.print(*(Text(part) if isinstance(part, str) else part for part in parts), sep="\n")
    drawn = console.export_svg(title=title, theme=PAPER)
    without_hosts = re.sub(r"@font-face {.*?}", "", drawn, flags=re.DOTALL)
    with whole(path) as part:
        part.write_text(without_hosts, encoding="utf-8")


class Left(bars.ProgressColumn):
    """This column says how long a job will still take, or how long it has taken without a guess."""

    def __init__(self, bar: Bar) -> None:
        super().__init__()
        self.bar = bar

    def render(self, task: bars.Task) -> Text:
        """Return the words; rich calls this several times a second."""
        return Text(self.bar.outlook())


class Bar(bars.Progress):
    """A bar shows how far a job has come and how long it will still take.

    In a pipe it says so in a line of its own on stderr, at FIRST and then ever more rarely.
    ``guess`` (s) is what the whole job may take, if that is known before.
    """

    guess: float | None = None

    def __init__(self, label: str, total: float | None, *columns: bars.ProgressColumn) -> None:
        self.quiet = not sys.stderr.isatty()
        columns = columns or (bars.TextColumn("{task.description}"), bars.BarColumn())
        super().__init__(
            *columns, Left(self), console=Console(stderr=True), transient=True,
            disable=self.quiet, redirect_stdout=sys.stdout.isatty(),
        )  # fmt: skip
        self.task = self.add_task(label, total=total)
        self.label, self.began, self.over = label, time.monotonic(), threading.Event()

    def __enter__(self) -> Self:
        super().__enter__()
        self.began = time.monotonic()
        if self.quiet:
            threading.Thread(target=self._tell, daemon=True).start()
        return self

    def __exit__(self, *error: Any) -> None:
        self.over.set()
        super().__exit__(*error)

    def step(self, count: float = 1) -> None:
        """Show that this number of parts more is done; the first ones begin when it is 0."""
        self.come_to(self.tasks[0].completed + count)

    def name(self, label: str) -> None:
        """Show what is being done."""
        self.label = label
        self.update(self.task, description=label)

    def plan(self, seconds: float) -> None:
        """Show that the whole job, which is counted in seconds, may take this long."""
        self.guess = seconds
        self.update(self.task, total=seconds)

    def come_to(self, done: float, total: float | None = None) -> None:
        """Show that this much is done, of so much in all; the job begins where it is 0."""
        if done == 0:
            self.began = time.monotonic()
        self.update(self.task, completed=done, total=total)

    def left(self) -> float | None:
        """Return how long (s) the job will still take; None if that is not known."""
        task, spent = self.tasks[0], time.monotonic() - self.began
        share = min(task.completed / task.total, 1.0) if task.total else 0.0
        if not share:
            return self.guess
        if self.guess is None:
            return spent * (1.0 - share) / share
        # What is done so far corrects the guess, which counts as a tenth of the job before.
        pace = (spent + TRUST * self.guess) / ((share + TRUST) * self.guess)
        return (1.0 - share) * self.guess * pace

    def outlook(self) -> str:
        """Return in words how long the job will still take."""
        left, spent = self.left(), time.monotonic() - self.began
        if left is None:
            return f"no estimate yet, {spent:.0f} s so far"
        return f"about {in_words(left)} left"

    def _tell(self) -> None:
        """Say in a pipe how long the job will still take, if that is long or not known."""
        opened, due = time.monotonic(), {"known": FIRST, "unknown": SECOND}
        while not self.over.wait(PACE):
            spent, left = time.monotonic() - opened, self.left()
            what = "unknown" if left is None else "known"
            if spent >= due[what]:
                due[what] = RARER * spent
                if left is None or left >= SHORT:
                    print(f"{self.label}: {self.outlook()}", file=sys.stderr, flush=True)


def in_words(seconds: float) -> str:
    """Return a time that is about this long.

    >>> [in_words(each) for each in (0.2, 47.4, 75.0, 1000.0, 5400.0, 1e6)]
    ['1 s', '47 s', '75 s', '17 min', '90 min', '278 h']
    """
    if seconds < 2.0 * 60.0:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 2 * 3600.0 else f"{seconds / 3600.0:,.0f} h"


class Share:
    """This class moves the bar within a run, by the share of its estimated duration.

    A run counts by the time that it will take; the runs count as many as they are.
    """

    def __init__(self, bar: Bar, estimates: Sequence[Estimate]) -> None:
        self.bar, self.done, self.moved = bar, 0, time.monotonic()
        self.durations = [one.duration for one in estimates]
        costs = [one.cost + QUICK for one in estimates]
        self.weights = [len(costs) * cost / sum(costs) for cost in costs]
        bar.step(0)
        if any(one.cost for one in estimates):
            bar.guess = sum(costs)

    def move(self, t: float) -> None:
        """Show that the run has come to ``t`` (s)."""
        now = time.monotonic()
        if now - self.moved >= PACE:
            self.moved = now
            self._show(min(t / self.durations[self.done], 1.0) * self.weights[self.done])

    def finish(self) -> None:
        """Show that a run is finished."""
        self.done += 1
        self._show(0.0)

    def _show(self, part: float) -> None:
        self.bar.come_to(sum(self.weights[: self.done]) + part)


class Counter(Bar):
    """A counter shows how many shots are done, how fast, and how long the others will take.

    Some ``workers`` play parts at once; shots of a part that is played here count one by one.
    """

    def __init__(self, workers: int = 1) -> None:
        text = bars.TextColumn("{task.description}")
        super().__init__("playing", None, bars.BarColumn(), text)
        self.there: int | None = None
        self.workers, self.played, self.by_reference, self.of_part = workers, 0, 0, 0

    def take(self, done: Done) -> None:
        """Count the shots that were there at first, then those of each part."""
        if self.there is None:
            self.there = done.shots
            self.guess = done.seconds / self.workers if done.seconds else None
            self.update(self.task, total=done.total - done.shots)
        else:
            self.played += done.shots
            self.by_reference += done.by_reference
            self.of_part = max(self.of_part - done.shots, 0)
        self.take_shots(0)

    def take_shots(self, count: int) -> None:
        """Count shots of a part that is not finished."""
        self.of_part += count
        played, there = self.played + self.of_part, self.there or 0
        rate = played / max(time.monotonic() - self.began, PACE)
        said = f"{there + played:,} shots, {rate:,.0f} a second"
        if self.played:
            said += f", {100.0 * self.by_reference / self.played:.2g} % in Python"
        self.name(said)
        self.come_to(played)
