"""This module makes plain Python values of what users pass: numbers of NumPy, arrays, lists.

A reader takes one value and returns it as a plain one, or raises :class:`Unfit`. So nothing of
NumPy goes further than the door: not to the solvers, not to a law, not into a file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from typing import Any, TypeVar

import numpy as np

from pool_pymunk.model.problems import (
    TOO_LARGE,
    Point,
    Problem,
    SceneError,
    number_problems,
    raise_any,
    setting_error,
    shown,
)

Value = TypeVar("Value")
Reader = Callable[[Any], Value]


class Unfit(ValueError):
    """The value is of the wrong kind; the message says which kind is right."""


def number(value: Any) -> float:
    """Read a number of Python or NumPy as a plain float."""
    if type(value) is float:
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        raise Unfit("must be a number")
    try:
        return float(value)
    except OverflowError:
        raise Unfit(TOO_LARGE) from None


def flag(value: Any) -> bool:
    """Read True or False, of Python or NumPy."""
    if not isinstance(value, bool | np.bool_):
        raise Unfit("must be True or False")
    return bool(value)


def text(value: Any) -> str:
    """Read a text as a plain str that a file can hold."""
    if not isinstance(value, str):
        raise Unfit('must be text, in "quotes"')
    if any("\ud800" <= letter <= "\udfff" for letter in value):
        raise Unfit("must be text that UTF-8 can write")
    return str(value)


def texts(value: Any) -> tuple[str, ...]:
    """Read texts in a tuple, a list or an array."""
    if not is_row(value):
        raise Unfit("must be a row of texts")
    return tuple(text(one) for one in value)


def point(value: Any) -> Point:
    """Read two numbers in a tuple, a list or an array."""
    if not is_row(value) or len(value) != 2:
        raise Unfit("must be two numbers, (x, y)")
    return number(value[0]), number(value[1])


def points(value: Any) -> tuple[Point, ...]:
    """Read points in a tuple, a list or an array (N, 2)."""
    if not is_row(value):
        raise Unfit("must be points, ((x, y), ...)")
    return tuple(point(one) for one in value)


def ends(value: Any) -> dict[str, Point]:
    """Read points by the ids of their balls."""
    if not isinstance(value, Mapping):
        raise Unfit('must be points by ids, {"1": (x, y)}')
    return {text(key): point(one) for key, one in value.items()}


def optional(read: Reader[Value]) -> Reader[Value | None]:
    """Make a reader that lets None be."""
    return lambda value: None if value is None else read(value)


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


def make_plain(part: object, **readers: Reader[Any]) -> None:
    """Turn the fields of a frozen object into plain values, each by its reader.

    Raises :class:`~pool_pymunk.SceneError` with every field that does not fit.
    """
    problems = []
    for key, read in readers.items():
        value = getattr(part, key)
        try:
            object.__setattr__(part, key, read(value))
        except Unfit as unfit:
            problems.append(Problem(key, value, str(unfit)))
    raise_any(problems)


def read(key: str, value: Any, reader: Reader[Value]) -> Value:
    """Read one value; the :class:`~pool_pymunk.SceneError` that may come of it names ``key``."""
    try:
        return reader(value)
    except Unfit as unfit:
        raise SceneError([Problem(key, value, str(unfit))]) from None


def read_pair(key: str, value: Any) -> tuple[float, float]:
    """Read two numbers; raises SettingError, which names ``key``, for anything else."""
    try:
        return point(value)
    except Unfit:
        raise setting_error(key, shown(value), "must be two numbers") from None


def read_number(
    key: str, value: Any, problems: Callable[[str, float], Iterable[Problem]]
) -> float:  # fmt: skip
    """Read an argument that is a number of which nothing is wrong.

    Raises :class:`~pool_pymunk.SettingError` with the first of its ``problems``.
    """
    try:
        found = number(value)
    except Unfit as unfit:
        raise setting_error(key, shown(value), str(unfit)) from None
    for problem in problems(key, found):
        raise setting_error(key, value, problem.message)
    return found


def read_count(key: str, value: Any, least: int = 1) -> int:
    """Read a whole number that is not below ``least``; raises SettingError for anything else."""
    found = read_number(key, value, lambda key, value: number_problems(key, value, float(least)))
    if not found.is_integer():
        raise setting_error(key, value, "must be a whole number")
    return int(found)
