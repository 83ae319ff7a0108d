"""This module shows tables of results: as CSV, JSON, a pandas DataFrame, or on a terminal."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from rich.table import Table as Printed

# Headings break at spaces but this one, and after hyphens between letters.
NO_BREAK, BREAK = "\u00a0", re.compile(r" |(?<=[a-z]-)(?=[a-z])")
SMALL = -3  # Columns with numbers below 1e-3 are printed in powers of ten.


@dataclass(frozen=True)
class ResultTable:
    """A table of results has a row for each, and columns; a unit stands in brackets behind a name.

    >>> table = ResultTable(("t (s)", "ball"), [(0.5, "C"), (math.nan, "1")])
    >>> table.json()
    [{'t': 0.5, 'ball': 'C'}, {'t': None, 'ball': '1'}]
    """

    columns: Sequence[str]
    rows: Iterable[Sequence[Any]]

    @classmethod
    def of(cls, columns: Mapping[str, Iterable[Any]]) -> Self:
        """Return the table that has these columns."""
        return cls(tuple(columns), list(zip(*columns.values(), strict=True)))

    @property
    def names(self) -> list[str]:
        """Return the columns' names without units."""
        return [column.partition(" (")[0] for column in self.columns]

    def csv(self, path: str | Path) -> None:
        """Write all digits of every row; what is None stays empty."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(self.columns)
            writer.writerows(self.rows)

    def json(self) -> list[dict[str, Any]]:
        """Return a dictionary for each row; nan is None, as JSON has no such number."""
        rows = ([None if value != value else value for value in row] for row in self.rows)
        return [dict(zip(self.names, row, strict=True)) for row in rows]

    def to_frame(self) -> Any:
        """Return a pandas DataFrame; raise ImportError where pandas is not installed."""
        try:
            frame = import_module("pandas").DataFrame
        except ImportError:
            raise ImportError("to_frame needs pandas: pip install pandas") from None
        return frame(list(self.rows), columns=self.names)

    def rich(self, left: Collection[str] = ()) -> Printed:
        """Return what a terminal shows: texts, and the numbers of a column in one notation.

        Columns are aligned to the right, except those in ``left``, whose texts may be longer than a
        line. Headings break between words alone. An empty row draws a line.
        """
        from rich.box import SIMPLE_HEAD
        from rich.table import Table as Printed

        printed = Printed(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
        rows = list(self.rows)
        columns = [alike(column) for column in zip(*filter(None, rows), strict=True)]
        columns = columns or [[] for _ in self.columns]
        for name, cells in zip(self.columns, columns, strict=True):
            is_left, words = name in left, BREAK.split(name)
            width = max(1, *map(len, words if is_left else [*words, *cells]))
            heading = "\n".join(wrap(name, width)).replace(NO_BREAK, " ")
            printed.add_column(heading, justify="left" if is_left else "right", overflow="fold")
        texts = zip(*columns, strict=True)
        for row in rows:
            printed.add_row(*next(texts)) if row else printed.add_section()
        return printed


def alike(values: Sequence[object], figures: int = 2, sign: str = "") -> list[str]:
    """Return texts as they are, and numbers in one notation, the smallest with so many figures.

    >>> alike([0.147, 12.0, 0.0], 3), alike([3e-9, 12.0]), alike(["C", 1, None])
    (['0.147', '12.000', '0'], ['3.0e-09', '1.2e+01'], ['C', '1', ''])
    """
    numbers = [abs(v) for v in values if isinstance(v, float) and v and math.isfinite(v)]
    least = math.floor(math.log10(min(numbers, default=1.0)))
    form = f"{sign}.{max(figures - 1 - least, 0)}f" if least >= SMALL else f"{sign}.{figures - 1}e"
    return [
        "" if v is None or v != v else f"{v:{form}}" if isinstance(v, float) and v else f"{v:g}"
        if isinstance(v, float) else str(v)
        for v in values
    ]  # fmt: skip
