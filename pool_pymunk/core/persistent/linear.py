"""Linear systems of forces, most of which act on different balls, are solved by elimination.

The factors of a system serve for many right sides, and for systems that are nearly the same.
"""

from __future__ import annotations

from typing import final

from mypy_extensions import mypyc_attr


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Entry:
    """An entry is a number of a row in its column; others are 0."""

    __slots__ = ("column", "value")

    def __init__(self, column: int, value: float) -> None:
        self.column = column
        self.value = value


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Row:
    """A row has the entries of an equation, by their columns, and its right side.

    Once the system has its factors, ``entries`` are those behind the ``pivot``, and ``lower`` ones
    tell how often each row before was subtracted.
    """

    __slots__ = ("entries", "lower", "pivot", "right")

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.lower: list[Entry] = []
        self.pivot = 0.0
        self.right = 0.0

    def put(self, column: int, value: float) -> None:
        """Put a number into a column, which comes after those of all entries."""
        self.entries.append(Entry(column, value))

    def begins_in(self, column: int) -> bool:
        return len(self.entries) > 0 and self.entries[0].column == column

    def size_in(self, column: int) -> float:
        """Return the size of the first entry, if it is in this column, or 0."""
        return abs(self.entries[0].value) if self.begins_in(column) else 0.0

    def subtract(self, row: Row, q: int) -> None:
        """Subtract the row q so often that the first entry is gone."""
        own, k = self.entries, 1
        times = own[0].value / row.pivot if row.pivot != 0.0 else 0.0
        self.lower.append(Entry(q, times))
        found = list[Entry]()
        for other in row.entries:
            while k < len(own) and own[k].column < other.column:
                found.append(own[k])
                k += 1
            if k < len(own) and own[k].column == other.column:
                own[k].value -= times * other.value
                found.append(own[k])
                k += 1
            else:
                found.append(Entry(other.column, -times * other.value))
        while k < len(own):
            found.append(own[k])
            k += 1
        self.entries = found


@final
class System:
    """A system has an equation for each of ``rows``, and as many unknowns.

    With x + z = 4, x + y = 3 and y + z = 5:

    >>> system = System(3)
    >>> for row, columns in zip(system.rows, [(0, 2), (0, 1), (1, 2)]):
    ...     for column in columns:
    ...         row.put(column, 1.0)
    >>> system.decompose()
    >>> for row, right in zip(system.rows, [4.0, 3.0, 5.0]):
    ...     row.right = right
    >>> system.solve()
    >>> [system.solution(k) for k in range(3)]
    [1.0, 2.0, 3.0]
    """

    def __init__(self, count: int) -> None:
        self.rows = [Row() for _ in range(count)]
        self.order = list(self.rows)  # in which they have the pivots of the columns

    def decompose(self) -> None:
        """Find the factors (Gauss; the pivot is the largest number of its column)."""
        order, count = self.order, len(self.order)
        for q in range(count):
            best, size = q, order[q].size_in(q)
            for p in range(q + 1, count):
                much = order[p].size_in(q)
                if much > size:
                    best, size = p, much
            order[q], order[best] = order[best], order[q]
            row = order[q]
            if row.begins_in(q):
                row.pivot = row.entries.pop(0).value
            for p in range(q + 1, count):
                if order[p].begins_in(q):
                    order[p].subtract(row, q)

    def solve(self) -> None:
        """Find the unknowns for the present right sides, which are lost."""
        order = self.order
        for row in order:
            found = row.right
            for entry in row.lower:
                found -= entry.value * order[entry.column].right
            row.right = found
        for k in range(len(order) - 1, -1, -1):
            row = order[k]
            found = row.right
            for entry in row.entries:
                found -= entry.value * order[entry.column].right
            row.right = found / row.pivot if row.pivot != 0.0 else 0.0

    def solution(self, k: int) -> float:
        """Return the unknown of a column."""
        return self.order[k].right
