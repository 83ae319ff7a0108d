"""Linear systems of forces, most of which act on different balls, are solved by elimination."""

from __future__ import annotations

from typing import final

from mypy_extensions import mypyc_attr


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Entry:
    """An entry is a number of a row in its column, before the ``next`` one; others are 0."""

    __slots__ = ("column", "next", "value")

    def __init__(self, column: int, value: float, after: Entry | None) -> None:
        self.column = column
        self.value = value
        self.next = after


@final
@mypyc_attr(acyclic=True, free_list_len=1)
class Row:
    """A row has the entries of an equation, by their columns, and its right side.

    Once the system is solved, that of row k is the solution of column k.
    """

    __slots__ = ("first", "last", "right")

    def __init__(self, right: float) -> None:
        self.right = right
        self.first: Entry | None = None
        self.last: Entry | None = None

    def put(self, column: int, value: float) -> None:
        """Put a number into a column, which comes after those of all entries."""
        new, last = Entry(column, value, None), self.last
        if last is None:
            self.first = new
        else:
            last.next = new
        self.last = new

    def pivot(self, column: int) -> float:
        """Return the first entry, if it is in this column, or 0."""
        first = self.first
        return 0.0 if first is None or first.column != column else first.value

    def subtract(self, times: float, row: Row) -> None:
        """Subtract another row so many times, after which the first entry is 0."""
        before, other = self.first, row.first
        assert before is not None and other is not None, "both rows begin in the same column"
        other = other.next
        while other is not None:
            column, after = other.column, before.next
            while after is not None and after.column < column:
                before, after = after, after.next
            if after is not None and after.column == column:
                after.value -= times * other.value
            else:
                after = before.next = Entry(column, -times * other.value, after)
            before, other = after, other.next
        self.right -= times * row.right
        self.drop()

    def drop(self) -> None:
        """Drop the first entry."""
        first = self.first
        self.first = None if first is None else first.next

    def clear(self) -> None:
        """Drop all entries, one by one: compiled code cannot free long chains that are acyclic."""
        while self.first is not None:
            self.drop()


def solve(rows: list[Row]) -> None:
    """Solve a linear system: the right sides become the solution (Gauss; pivots of a column).

    With x + z = 4, x + y = 3 and y + z = 5:

    >>> rows = [Row(4.0), Row(3.0), Row(5.0)]
    >>> for row, columns in zip(rows, [(0, 2), (0, 1), (1, 2)]):
    ...     for column in columns:
    ...         row.put(column, 1.0)
    >>> solve(rows)
    >>> [row.right for row in rows]
    [1.0, 2.0, 3.0]
    """
    count = len(rows)
    for row in rows:  # It would keep entries that are dropped.
        row.last = None
    for q in range(count):
        best, size = q, abs(rows[q].pivot(q))
        for p in range(q + 1, count):
            much = abs(rows[p].pivot(q))
            if much > size:
                best, size = p, much
        if best != q:
            rows[q], rows[best] = rows[best], rows[q]
        row = rows[q]
        for p in range(q + 1, count):
            other = rows[p]
            much = other.pivot(q)
            if much != 0.0:
                other.subtract(much / row.pivot(q), row)
            elif other.first is not None and other.first.column == q:
                other.drop()
    for q in range(count - 1, -1, -1):
        row = rows[q]
        found, first, pivot = row.right, row.first, row.pivot(q)
        entry = None if first is None or first.column != q else first.next
        while entry is not None:
            found -= entry.value * rows[entry.column].right
            entry = entry.next
        row.right = found / pivot if pivot != 0.0 else 0.0
    for row in rows:
        row.clear()
