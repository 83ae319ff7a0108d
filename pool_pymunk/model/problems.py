"""A scene may have problems; :class:`SceneError` lists them all, one line each."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

Point = tuple[float, float]
Location = tuple[int | str, ...]  # where something stands in a file: ("balls", 2, "mass")

LEFT_OUT = "(left out)"

# Far from the origin coordinates are known to this share of themselves: four rounding errors.
COORDINATE_ROUNDING = 4 * 2.0**-52

# Sizes (SI) stay between these bounds, and all numbers below the larger one. Then squares and
# products of a few of them stay in the range of floating point.
SMALLEST, LARGEST = 1e-100, 1e100
TOO_SMALL = f"is too small (less than {SMALLEST:g} in SI units)"
TOO_LARGE = f"is too large (more than {LARGEST:g} in SI units)"

# Messages show at most this many characters of a value, or names, to fit two lines of a terminal.
MOST_SHOWN, MOST_LISTED = 60, 12


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem of a scene says where it is, which value is wrong, and what would be right.

    ``where`` is a key, or the steps that lead to it from the top of the file.

    >>> str(Problem(("balls", 2, "mass"), 0, "must be greater than 0"))
    'balls[2].mass = 0: must be greater than 0'
    """

    where: str | Location
    value: object
    message: str

    @property
    def key(self) -> str:
        """Return the key as people write it."""
        return self.where if isinstance(self.where, str) else written(self.where)

    @property
    def steps(self) -> Location:
        """Return the steps that lead to the key."""
        return (self.where,) if isinstance(self.where, str) else self.where

    def under(self, *where: int | str) -> Problem:
        """Return this problem of a part as one of the scene that has the part at ``where``."""
        return replace(self, where=(*where, *self.steps))

    def __str__(self) -> str:
        value = "" if self.value is LEFT_OUT else f" = {shown(self.value)}"
        return _one_line(f"{self.key}{value}: {self.message}")


def written(where: Location) -> str:
    """Write a location as a key: ``balls[2].mass``."""
    steps = (f"[{one}]" if isinstance(one, int) else f".{key_of(one)}" for one in where)
    return "".join(steps).removeprefix(".")


class SceneError(ValueError):
    """This scene cannot be simulated; ``problems`` lists everything that is wrong with it.

    >>> from pool_pymunk import Ball
    >>> Ball("1", (0.0, 0.0), radius=-1.0, mass=float("nan"))
    Traceback (most recent call last):
        ...
    pool_pymunk.SceneError: radius = -1.0: must be greater than 0
    mass = nan: must be a finite number
    """

    __module__ = "pool_pymunk"

    def __init__(self, problems: Sequence[Problem], source: str = "") -> None:
        self.problems = tuple(problems)
        self.source = source
        prefix = _one_line(f"{source}: ") if source else ""
        super().__init__("\n".join(f"{prefix}{problem}" for problem in self.problems))


class SettingError(ValueError):
    """An argument, such as a time step or a shot's name, does not exist or makes no sense."""

    __module__ = "pool_pymunk"


def shown(value: object) -> str:
    """Return a value as a scenario file writes it, shortened.

    >>> shown([True, "a", {"b": math.inf}])
    '[true, "a", {b = inf}]'
    """
    plain = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    return _clipped(_toml(plain, depth=3), MOST_SHOWN)


def _toml(value: object, depth: int) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > 4 * MOST_SHOWN:
        return f"(a number of about {int(value.bit_length() * math.log10(2)) + 1} digits)"
    if isinstance(value, str):
        return f'"{_clipped(value)}"'
    if not isinstance(value, list | tuple | Mapping):
        return str(value)
    if depth == 0:
        return "..."
    if isinstance(value, Mapping):
        items = islice(value.items(), MOST_SHOWN)
        return "{" + ", ".join(f"{key_of(k)} = {_toml(v, depth - 1)}" for k, v in items) + "}"
    return "[" + ", ".join(_toml(v, depth - 1) for v in value[:MOST_SHOWN]) + "]"


def _clipped(text: str, most: int = MOST_SHOWN - 2) -> str:
    return text if len(text) <= most else text[: most - 3] + "..."


def key_of(name: str) -> str:
    """Return a key as a scenario file writes it: bare where it can be, else in quotes.

    >>> key_of("8"), key_of("ball 8")
    ('8', '"ball 8"')
    """
    if re.fullmatch("[A-Za-z0-9_-]+", name):
        return name
    import json

    return json.dumps(name, ensure_ascii=False)


def listed(names: Collection[str]) -> str:
    """Return names in a row, or only the first of many."""
    first = ", ".join(_clipped(name) for name in islice(names, MOST_LISTED))
    more = len(names) - MOST_LISTED
    return first if more <= 0 else f"{first} and {more} more"


def no_such_ball(ids: Collection[str]) -> str:
    """Return the message about a ball that is none of these."""
    return f"there is no such ball (there are: {listed(ids)})"


def suggestion(name: object, known: Iterable[str]) -> str:
    """Return "did you mean ...?" with the known name most like this one, or an empty text.

    >>> suggestion("rpeort", ["report", "hexagon"]), suggestion("x", ["report"])
    ('; did you mean "report"?', '')
    """
    alike = most_like(name, known)
    return f'; did you mean "{_clipped(alike)}"?' if alike else ""


def most_like(name: object, known: Iterable[str]) -> str:
    """Return the known name that is most like this one, or an empty text."""
    from difflib import get_close_matches

    alike = get_close_matches(str(name)[:MOST_SHOWN], list(known), n=1)
    return alike[0] if alike else ""


def _one_line(text: str) -> str:
    """Return a text with escapes for line breaks, tabs and all that does not print."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def setting_error(key: str, value: object, message: str) -> SettingError:
    """Make the error of an argument, in one line that names it and shows its value."""
    text = _clipped(value) if isinstance(value, str) else shown(value)
    return SettingError(_one_line(f"{key} = {text}: {message}"))


def raise_any(problems: Iterable[Problem]) -> None:
    """Raise SceneError with these problems, if there are any."""
    if found := list(problems):
        raise SceneError(found)
