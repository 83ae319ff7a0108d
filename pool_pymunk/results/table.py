"""This module shows tables of results: as CSV, JSON, a pandas DataFrame, or on a terminal."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rich.table import Table as Printed

Columns = Sequence["TableColumn | str"]  # A text is the key of a column that has no more.
# Headings break at spaces but this one, and after hyphens between letters.
NO_BREAK, BREAK = "\u00a0", re.compile(r" |(?<=[a-z]-)(?=[a-z])")
GAP = 2  # characters between two columns
SMALL = -3  # Columns with numbers below 1e-3 are printed in powers of ten.


class TableColumn(NamedTuple):
    """A column has a ``key`` in files and data frames, and on a terminal a ``heading``.

    The heading is the key if none is given. A ``unit`` stands in brackets behind it, and in CSV
    behind the key. So many ``digits`` of the column's largest number are printed, or two of its
    smallest. Columns are aligned to the right, or to the ``left`` if texts may be longer than a
    line. In arrays ``missing`` stands for None, and its type is that of the array; by default it is
    an empty text in a column with texts, and nan in others.
    """

    key: str
    heading: str = ""
    unit: str = ""
    digits: int | None = None
    left: bool = False
    missing: float | str | None = None

    @property
    def in_files(self) -> str:
        """Return what stands in the first line of CSV."""
        return f"{self.key} ({self.unit})" if self.unit else self.key

    @property
    def title(self) -> str:
        """Return what stands above the column on a terminal."""
        unit = self.unit.replace(" ", NO_BREAK)
        return self._replace(key=self.heading or self.key, unit=unit).in_files

    def texts(self, values: Sequence[Any]) -> list[str]:
        """Return the cells as a terminal shows them."""
        return alike(values, largest=self.digits)

    def array(self, values: Sequence[Any]) -> NDArray[Any]:
        """Return the cells as an array."""
        missing = self.missing
        if missing is None:
            missing = "" if any(isinstance(value, str) for value in values) else math.nan
        return np.array([missing if each is None else each for each in values], type(missing))

    def words(self, values: Sequence[Any]) -> list[str]:
        """Return what may not be broken: words of the title, and cells, or their words."""
        cells = self.texts(values)
        texts = (" ".join(cells) if self.left else "").split()
        return [*BREAK.split(self.title), *(texts if self.left else cells)]


def numbers(unit: str, *keys: str, digits: int | None = None) -> list[TableColumn]:
    """Return columns of numbers that have one unit."""
    return [TableColumn(key, unit=unit, digits=digits) for key in keys]


@dataclass(frozen=True)
class ResultTable:
    """A table of results has columns and rows; a column without more than a key may be a text.

    >>> table = ResultTable((TableColumn("t", unit="s"), "ball"), [(0.5, "C"), (math.nan, "1")])
    >>> table
    <ResultTable of 2 rows: t (s), ball>
    >>> table.json()
    [{'t': 0.5, 'ball': 'C'}, {'t': None, 'ball': '1'}]
    """

    columns: Columns
    rows: Iterable[Sequence[Any]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", list(self.rows))  # They may be read again.

    def __repr__(self) -> str:
        names = ", ".join(column.in_files for column in self.fields)
        return f"<ResultTable of {len(list(self.rows)):,} rows: {names}>"

    @classmethod
    def of(cls, columns: Mapping[Any, Iterable[Any]]) -> Self:
        """Return the table that has these columns."""
        return cls(tuple(columns), zip(*columns.values(), strict=True))

    @property
    def fields(self) -> list[TableColumn]:
        """Return all columns as such."""
        return [TableColumn(each) if isinstance(each, str) else each for each in self.columns]

    def csv(self, path: str | Path) -> None:
        """Write all digits of every row; what is None stays empty."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(column.in_files for column in self.fields)
            writer.writerows(self.rows)

    def json(self) -> list[dict[str, Any]]:
        """Return a dictionary for each row; nan is None, as JSON has no such number."""
        keys = [column.key for column in self.fields]
        rows = ([None if value != value else value for value in row] for row in self.rows)
        return [dict(zip(keys, row, strict=True)) for row in rows]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return an array for each column, with what is missing there in place of None.

        >>> ResultTable(("t", "ball"), [(0.5, "C"), (None, None)]).arrays()
        {'t': array([0.5, nan]), 'ball': array(['C', ''], dtype='<U1')}
        """
        return {
            one.key: one.array(its) for one, its in zip(self.fields, self._cells(), strict=True)
        }

    def _cells(self) -> list[Sequence[Any]]:
        """Return the cells of each column, without those of empty rows."""
        return list(zip(*filter(None, self.rows), strict=True)) or [()] * len(self.columns)

    def to_frame(self) -> Any:
        """Return a pandas DataFrame; raise ImportError where pandas is not installed."""
        try:
            frame = import_module("pandas").DataFrame
        except ImportError:
            raise ImportError("to_frame needs pandas: pip install pandas") from None
        return frame(list(self.rows), columns=[column.key for column in self.fields])

    def within(self, width: int) -> Iterator[ResultTable]:
        """Yield tables for lines of so many characters; each of them has the first column."""
        parts, room = [[0]], 0
        for k, (column, its) in enumerate(zip(self.fields, self._cells(), strict=True)):
            needed = max(map(len, column.words(its))) + GAP
            if k == 0:
                first = room = needed
                continue
            if room + needed > width + GAP and len(parts[-1]) > 1:
                parts.append([0])
                room = first
            parts[-1].append(k)
            room += needed
        for part in parts:
            chosen = [[row[k] for k in part if row] for row in self.rows]
            yield ResultTable([self.fields[k] for k in part], chosen)

    def rich(self) -> Printed:
        """Return what a terminal shows: texts, and the numbers of a column in one notation.

        Headings break between words alone. An empty row draws a line.
        """
        from rich.box import SIMPLE_HEAD
        from rich.table import Table as Printed

        printed = Printed(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
        values = self._cells()
        for column, its in zip(self.fields, values, strict=True):
            aligned: Literal["left", "right"] = "left" if column.left else "right"
            words = BREAK.split(column.title) if column.left else column.words(its)
            heading = "\n".join(wrap(column.title, max(1, *map(len, words))))
            printed.add_column(heading.replace(NO_BREAK, " "), justify=aligned, overflow="fold")
        texts = zip(*map(TableColumn.texts, self.fields, values), strict=True)
        for row in self.rows:
            printed.add_row(*next(texts)) if row else printed.add_section()
        return printed


def alike(
    values: Sequence[object], figures: int = 2, sign: str = "", largest: int | None = None
) -> list[str]:
    """Return texts as they are, and numbers in one notation, the smallest with so many figures.

    If figures of the ``largest`` number are given, they say how many decimals all numbers have.

    >>> alike([0.147, 12.0, 0.0], 3), alike([3e-9, 12.0]), alike(["C", 1, None])
    (['0.147', '12.000', '0'], ['3.0e-09', '1.2e+01'], ['C', '1', ''])
    >>> alike([1.23456, -3e-9, 0.0], largest=4)
    ['1.235', '0.000', '0']
    """
    numbers = [abs(v) for v in values if isinstance(v, float) and v and math.isfinite(v)]
    if largest is None:
        size, shown = min(numbers, default=1.0), figures
    else:
        size, shown = max(numbers, default=1.0), largest
    power = math.floor(math.log10(size))
    is_plain = power >= SMALL and (largest is None or power < largest)
    form = f"{sign}z.{max(shown - 1 - power, 0)}f" if is_plain else f"{sign}.{shown - 1}e"
    return [
        "" if v is None or v != v else f"{v:{form}}" if isinstance(v, float) and v else f"{v:zg}"
        if isinstance(v, float) else str(v)
        for v in values
    ]  # fmt: skip
