"""This module makes plain Python values of what users pass: numbers of NumPy, arrays, lists.

A reader takes one value and returns it as a plain one, or raises :class:`Unfit`. So nothing of
NumPy goes further than the door: not to the solvers, not to a law, not into a file. Readers of
numbers also take the size of the ``unit`` (SI) that a file has them in; bounds are in SI.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np

from pool_pymunk.model.problems import (
    LARGEST,
    SMALLEST,
    TOO_LARGE,
    TOO_SMALL,
    Location,
    Point,
    Problem,
    setting_error,
    shown,
    suggestion,
)

Value = TypeVar("Value")
Reader = Callable[..., Value]


class Unfit(ValueError):
    """The value does not fit; the message says what would, ``inside`` what is wrong in it."""

    def __init__(self, message: str, inside: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.inside = inside

    def problems(self, where: Location, value: object) -> Iterator[Problem]:
        """Return what is wrong with the value that stands there."""
        if not self.inside:
            yield Problem(where, value, str(self))
        for problem in self.inside:
            yield problem.under(*where)


def each(read: Reader[Value], values: Iterable[tuple[int | str, Any]], *unit: float) -> list[Value]:
    """Read values that stand under keys or numbers; raises Unfit with all that do not fit."""
    found: list[Value] = []
    problems: list[Problem] = []
    for step, value in values:
        try:
            found.append(read(value, *unit))
        except Unfit as unfit:
            problems += unfit.problems((step,), value)
    if problems:
        raise Unfit(problems[0].message, problems)
    return found


# -- numbers ---------------------------------------------------------------------------------------


def number(value: Any, unit: float = 1.0) -> float:
    """Read a number of Python or NumPy as a plain float."""
    if type(value) is float:  # as most are; what follows takes five times as long
        return value * unit
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        raise Unfit("must be a number")
    try:
        return float(value) * unit
    except OverflowError:
        raise Unfit(TOO_LARGE) from None


def between(low: float, high: float = LARGEST) -> Reader[float]:
    """Make a reader of numbers from ``low`` to ``high``."""

    def read(value: Any, unit: float = 1.0) -> float:
        found = number(value, unit)
        if not (math.isfinite(found) and low <= found <= high):
            raise Unfit(_bounds(found, low, high))
        return found

    return read


def _bounds(found: float, low: float, high: float) -> str:
    """Say what a number had to be that is none of those from ``low`` to ``high``."""
    if not math.isfinite(found):
        return "must be a finite number"
    if high < LARGEST:
        return f"must be between {low:g} and {high:g}"
    if found > high:
        return TOO_LARGE
    if low != SMALLEST:
        return f"must be {low:g} or more"
    return TOO_SMALL if found > 0.0 else "must be greater than 0"


finite, size = between(-math.inf, math.inf), between(SMALLEST)


def whole(low: int, high: float = LARGEST) -> Reader[int]:
    """Make a reader of whole numbers from ``low`` to ``high``."""
    bounded = between(low, high)

    def read(value: Any) -> int:
        found = bounded(value)
        if not found.is_integer():
            raise Unfit("must be a whole number")
        return int(value) if isinstance(value, Integral) else int(found)

    return (
        read if high == LARGEST else instead(f"must be a whole number from {low} to {high}", read)
    )


def instead(message: str, read: Reader[Value]) -> Reader[Value]:
    """Make a reader that has one ``message`` for whatever does not fit."""

    def reader(value: Any) -> Value:
        try:
            return read(value)
        except Unfit:
            raise Unfit(message) from None

    return reader


def pair(value: Any, unit: float = 1.0) -> tuple[float, float]:
    """Read two numbers in a tuple, a list or an array."""
    if not is_row(value) or len(value) != 2:
        raise Unfit("must be two numbers, [x, y]")
    x, y = each(number, enumerate(value), unit)
    return x, y


def point(value: Any, unit: float = 1.0) -> Point:
    """Read two numbers that are finite."""
    x, y = pair(value, unit)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise Unfit("must be two finite numbers")
    if max(abs(x), abs(y)) > LARGEST:
        raise Unfit(TOO_LARGE)
    return x, y


def corners(value: Any, unit: float = 1.0) -> tuple[Point, ...]:
    """Read points in a tuple, a list or an array (N, 2)."""
    if not is_row(value):
        raise Unfit("must be corners, [[x, y], ...]")
    return tuple(each(point, enumerate(value), unit))


def numbers(value: Any) -> tuple[float, ...]:
    """Read finite numbers in a tuple, a list or an array."""
    if not is_row(value):
        raise Unfit("must be numbers, [0.0, 1.0, ...]")
    return tuple(each(finite, enumerate(value)))


def ends(value: Any, unit: float = 1.0) -> dict[str, Point]:
    """Read points by the ids of their balls."""
    if not isinstance(value, Mapping):
        raise Unfit('must be points by ids, {"1" = [x, y]}')
    found = each(point, value.items(), unit)
    return dict(zip(map(text, value), found, strict=True))


# -- texts, flags, objects -------------------------------------------------------------------------


def flag(value: Any) -> bool:
    """Read True or False, of Python or NumPy."""
    if not isinstance(value, bool | np.bool_):
        raise Unfit("must be true or false")
    return bool(value)


def text(value: Any) -> str:
    """Read a text as a plain str that a file can hold."""
    if not isinstance(value, str):
        raise Unfit('must be text, in "quotes"')
    if any("\ud800" <= letter <= "\udfff" for letter in value):
        raise Unfit("must be text that UTF-8 can write")
    return str(value)


def name(value: Any) -> str:
    """Read a name that is to be printed in a line."""
    found = text(value)
    if not found.strip():
        raise Unfit("must not be empty")
    if any(unicodedata.category(c) in ("Cc", "Zl", "Zp") for c in found):
        raise Unfit("must be one line of text without control characters")
    return found


def color(value: Any) -> str:
    """Read a colour as "#rrggbb"."""
    if not re.fullmatch("#[0-9A-Fa-f]{6}", found := text(value)):
        raise Unfit('must be "#rrggbb", six hexadecimal digits')
    return found


def colors(value: Any) -> str | tuple[str, ...]:
    """Read a colour, or several in a tuple, a list or an array."""
    return tuple(each(color, enumerate(value))) if is_row(value) else color(value)


def ids(value: Any) -> tuple[str, ...]:
    """Read ids in a tuple, a list or an array."""
    if not is_row(value):
        raise Unfit('must be ids, ["1", "2", ...]')
    return tuple(each(text, enumerate(value)))


def choice(known: Collection[str]) -> Reader[str]:
    """Make a reader of one of some names; what is known may change."""

    def read(value: Any) -> str:
        found = text(value)
        if found not in known:
            raise Unfit(f"must be one of {', '.join(known)}{suggestion(found, known)}")
        return found

    return read


def one(kind: type[Value]) -> Reader[Value]:
    """Make a reader of objects of one class."""

    def read(value: Any) -> Value:
        if not isinstance(value, kind):
            raise Unfit(f"must be an object of the class {kind.__name__}")
        return value

    return read


def row(kind: type[Value]) -> Reader[tuple[Value, ...]]:
    """Make a reader of several objects of one class, in a tuple or a list."""

    def read(value: Any) -> tuple[Value, ...]:
        if not is_row(value) or not all(isinstance(each, kind) for each in value):
            raise Unfit(f"must be a tuple of objects of the class {kind.__name__}")
        return tuple(value)

    return read


def is_row(value: Any) -> bool:
    """Tell whether a value is a tuple, a list or an array of one dimension or more."""
    return isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim > 0)


# -- arguments -------------------------------------------------------------------------------------


def argument(key: str, value: Any, read: Reader[Value]) -> Value:
    """Read an argument; raises SettingError, in one line that names ``key``, if it does not fit."""
    try:
        return read(value)
    except Unfit as unfit:
        raise setting_error(key, shown(value), str(unfit)) from None


def problems_of(value: Any, read: Reader[object], *where: str) -> Iterator[Problem]:
    """Return what is wrong with the value that stands there, if anything is."""
    try:
        read(value)
    except Unfit as unfit:
        yield from unfit.problems(where, value)


def read_pair(key: str, value: Any) -> tuple[float, float]:
    """Read two numbers; raises SettingError, which names ``key``, for anything else."""
    return argument(key, value, instead("must be two numbers", pair))
