"""This module turns what users pass (numbers of NumPy, arrays, lists) into plain Python values.

A reader takes one value and returns it as a plain one, or raises :class:`Unfit`. So solvers, laws
and files never see a number of NumPy. Readers of numbers also take the ``unit`` of the file, as a
number in SI; bounds are in SI.

The annotation of a part's field has a key, which says how the value is read and checked, in which
unit a file has it, and what an editor may say about it. Parts use these keys to check themselves,
files to read and write, and the JSON schema of files to describe them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from numbers import Integral, Real
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np

from pool_pymunk.laws import LAWS, Law, find_law
from pool_pymunk.model.problems import (
    LARGEST,
    LEFT_OUT,
    SMALLEST,
    TOO_LARGE,
    TOO_SMALL,
    Location,
    Point,
    Problem,
    most_like,
    raise_any,
    setting_error,
    shown,
    suggestion,
)

Value = TypeVar("Value")
Reader = Callable[..., Value]


class Unfit(ValueError):
    """A value does not fit: the message says what would fit, ``inside`` lists problems in it."""

    def __init__(self, message: str, inside: Sequence[Problem] = ()) -> None:
        super().__init__(message)
        self.inside = inside

    def problems(self, where: Location, value: object) -> Iterator[Problem]:
        """Return the problems of the ``value`` that stands at ``where``."""
        found = self.inside or [Problem((), value, str(self))]
        return (problem.under(*where) for problem in found)


def each(read: Reader[Value], values: Iterable[tuple[int | str, Any]], *unit: float) -> list[Value]:
    """Read values that stand under keys or numbers; raises Unfit with all that do not fit."""
    pairs = [*values]
    try:
        return [read(value, *unit) for _, value in pairs]
    except Unfit:
        problems = [p for k, v in pairs for p in problems_of(v, lambda v: read(v, *unit), k)]
        raise Unfit(problems[0].message, problems) from None


def is_row(value: Any) -> bool:
    """Tell whether a value is a tuple, a list or an array of one dimension or more."""
    return isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim > 0)


def many(read: Reader[Value], example: str) -> Reader[tuple[Value, ...]]:
    """Make a reader of values in a row, such as those of the ``example``."""

    def reader(value: Any, *unit: float) -> tuple[Value, ...]:
        if not is_row(value):
            raise Unfit(f"must be {example}")
        return tuple(each(read, enumerate(value), *unit))

    return reader


# -- numbers ---------------------------------------------------------------------------------------


def number(value: Any, unit: float = 1.0) -> float:
    """Read a number of Python or NumPy as a plain float."""
    if type(value) is float:  # Most are; what follows takes five times as long.
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
        if not math.isfinite(found):
            raise Unfit("must be a finite number")
        if low <= found <= high:
            return found
        if high < LARGEST:
            raise Unfit(f"must be between {low:g} and {high:g}")
        if found > high or (found > 0.0 and low == SMALLEST):
            raise Unfit(TOO_LARGE if found > high else TOO_SMALL)
        raise Unfit("must be greater than 0" if low == SMALLEST else f"must be {low:g} or more")

    return read


finite, size = between(-math.inf, math.inf), between(SMALLEST)


def whole(low: int, high: float = LARGEST) -> Reader[int]:
    """Make a reader of whole numbers from ``low`` to ``high``."""
    bounded = between(low, high)

    def read(value: Any) -> int:
        try:
            found = bounded(value)
            if found.is_integer():
                return int(value) if isinstance(value, Integral) else int(found)
            raise Unfit("must be a whole number")
        except Unfit:
            if high < LARGEST:
                raise Unfit(f"must be a whole number from {low} to {high}") from None
            raise

    return read


def point(value: Any, unit: float = 1.0) -> Point:
    """Read two finite numbers in a tuple, a list or an array."""
    if not is_row(value) or len(value) != 2:
        raise Unfit("must be two numbers, [x, y]")
    x, y = each(number, enumerate(value), unit)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise Unfit("must be two finite numbers")
    if max(abs(x), abs(y)) > LARGEST:
        raise Unfit(TOO_LARGE)
    return x, y


def ends(value: Any, unit: float = 1.0) -> dict[str, Point]:
    """Read points by the ids of their balls."""
    if not isinstance(value, Mapping):
        raise Unfit('must be points by ids, {"1" = [x, y]}')
    return dict(zip(map(text, value), each(point, value.items(), unit), strict=True))


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
    try:
        value.encode()
    except UnicodeEncodeError:
        raise Unfit("must be text that UTF-8 can write") from None
    return str(value)


def name(value: Any) -> str:
    """Read a name that is to be printed in a line."""
    found = text(value)
    if not found.strip():
        raise Unfit("must not be empty")
    if not found.isprintable() and not _is_line(found):
        raise Unfit("must be one line of text without control characters")
    return found


def _is_line(text: str) -> bool:
    """Tell whether a text has neither line breaks nor control characters."""
    from unicodedata import category  # Most names are printable, and need not wait for it.

    return all(category(letter) not in ("Cc", "Zl", "Zp") for letter in text)


def color(value: Any) -> str:
    """Read a colour as "#rrggbb"."""
    if not re.fullmatch("#[0-9A-Fa-f]{6}", found := text(value)):
        raise Unfit('must be "#rrggbb", six hexadecimal digits')
    return found


def colors(value: Any) -> str | tuple[str, ...]:
    """Read a colour, or several in a row."""
    return tuple(each(color, enumerate(value))) if is_row(value) else color(value)


def choice(known: Collection[str]) -> Reader[str]:
    """Make a reader of one of the names that are ``known`` when it reads."""

    def read(value: Any) -> str:
        found = text(value)
        if found not in known:
            raise Unfit(f"must be one of {', '.join(known)}{suggestion(found, known)}")
        return found

    return read


def made(kind: type[Any], in_row: bool = False) -> Reader[Any]:
    """Make a reader of an object of a class, or of several in a row."""

    def read(value: Any) -> Any:
        found = value if in_row else (value,)
        if is_row(found) and all(isinstance(each, kind) for each in found):
            return tuple(value) if in_row else value
        what = "a tuple of objects" if in_row else "an object"
        raise Unfit(f"must be {what} of the class {kind.__name__}")

    return read


# -- keys ------------------------------------------------------------------------------------------


class Key(NamedTuple):
    """A key says how a value is read, of which kind its unit is, and what editors show of it.

    JSON schema has the ``limits`` of the value beside its ``type``, and words ``about`` it.
    """

    read: Reader[Any]
    unit: str = ""
    limits: tuple[tuple[str, Any], ...] = ()
    about: str = ""
    type: Any = str
    may_be_none: bool = False

    def __repr__(self) -> str:
        return "Key()"


def one_of(known: Collection[str], about: str = "") -> Key:
    """Return the key of one of the names that are ``known``."""
    return Key(choice(known), limits=(("enum", (*known,)),), about=about)


FROM_0, ABOVE_0 = (("minimum", 0),), (("minimum", SMALLEST),)

Flag = Annotated[bool, Key(flag)]
Text = Annotated[str, Key(text)]
Ids = Annotated[Sequence[str], Key(many(text, 'ids, ["1", "2", ...]'))]
Name = Annotated[str, Key(name)]
Color = Annotated[str, Key(color, limits=(("pattern", "^#[0-9A-Fa-f]{6}$"),))]  # "#rrggbb"
Colors = Annotated[str | Sequence[str], Key(colors)]  # one for all balls, or one for each
Length = Annotated[float, Key(size, "length", ABOVE_0)]  # m, greater than 0
Gap = Annotated[float, Key(between(0.0), "length", FROM_0)]  # m
Mass = Annotated[float, Key(size, "mass", ABOVE_0)]  # kg
Time = Annotated[float, Key(size, "time", ABOVE_0)]  # s
Speed = Annotated[float, Key(between(0.0), "speed", FROM_0)]  # m/s
Angle = Annotated[float, Key(finite, "angle")]  # degrees
Factor = Annotated[float, Key(finite)]  # any finite number
Share = Annotated[float, Key(between(0.0, 1.0), limits=(*FROM_0, ("maximum", 1)))]
Number = Annotated[float, Key(between(0.0), limits=FROM_0)]  # from 0 on
Place = Annotated[Point, Key(point, "length")]  # m
Velocity = Annotated[Point, Key(point, "speed")]  # m/s
Acceleration = Annotated[Point, Key(point)]  # m/s^2, in every file
Corners = Annotated[tuple[Point, ...], Key(many(point, "corners, [[x, y], ...]"), "length")]  # m
Bulges = Annotated[tuple[float, ...], Key(many(finite, "numbers, [0.0, 1.0, ...]"))]
Ends = Annotated[Mapping[str, Point], Key(ends, "length")]  # m


Keys = dict[str, Key]


def keys_of(whose: Any) -> Keys:
    """Return the keys of a class by its fields, of a function by its arguments."""
    hints = get_type_hints(whose, include_extras=True)
    return {name: _key(hints[name]) for name in whose.__annotations__ if name != "return"}


def _key(hint: Any) -> Key:
    """Return the key of an annotation: its own, or one for a class, a tuple of it, or None."""
    if isinstance(hint, type):
        return Key(made(hint))
    if hasattr(hint, "__metadata__"):
        key, *about = hint.__metadata__
        own: Key = key._replace(type=hint.__origin__, about="".join(about) or key.about)
        return own
    first, second = get_args(hint)
    if second is ...:
        return Key(made(first, in_row=True))
    return _key(first)._replace(may_be_none=True)


def read_all(
    keys: Keys,
    values: Mapping[str, Any],
    units: Mapping[str, float] | None = None,
    needed: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Read values by their keys; raises SceneError with every one that does not fit.

    The values of a file are in ``units``, by their kinds, as numbers in SI. It also has problems of
    unknown keys, and of ``needed`` keys that are missing, with what is said of them.
    """
    found: dict[str, Any] = {}
    problems: list[Problem] = []
    for name, value in values.items():
        try:
            if name not in keys:
                raise Unfit(f"unknown key (there are: {', '.join(keys)}){suggestion(name, keys)}")
            key = keys[name]
            unit = (units[key.unit],) if units and key.unit in units else ()
            found[name] = None if value is None and key.may_be_none else key.read(value, *unit)
        except Unfit as unfit:
            problems += unfit.problems((name,), value)
    missing = {name: said for name, said in (needed or {}).items() if name not in values}
    if missing:
        misspelt = [most_like(name, keys) for name in values if name not in keys]
        problems += [Problem(k, LEFT_OUT, missing[k]) for k in missing if k not in misspelt]
    raise_any(problems)
    return found


class Part:
    """A part of a scene is a dataclass that reads its fields by their keys when it is made.

    Raises :class:`~pool_pymunk.SceneError` with all fields that do not fit; if all fit, with all
    that is wrong between them.
    """

    __slots__ = ()
    KEYS: ClassVar[Keys]

    def __getstate__(self) -> Any:
        """Return what a copy has: not what is worked out once, for the core has no copies."""
        own = type(self)
        is_found = {k: isinstance(getattr(own, k, None), cached_property) for k in vars(self)}
        return {key: value for key, value in vars(self).items() if not is_found[key]}

    def __init_subclass__(cls) -> None:
        if "KEYS" not in cls.__dict__:  # A dataclass with slots is made twice, with the same keys.
            cls.KEYS = getattr(cls, "KEYS", {}) | keys_of(cls)

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in self.KEYS}
        for name, value in read_all(self.KEYS, given).items():
            object.__setattr__(self, name, value)
        raise_any(self._problems())

    def _problems(self) -> Iterable[Problem]:
        """Return what is wrong between the fields."""
        return ()


# -- arguments -------------------------------------------------------------------------------------


def argument(key: str, value: Any, read: Reader[Value]) -> Value:
    """Read an argument; raises SettingError, in one line that names ``key``, if it does not fit."""
    try:
        return read(value)
    except Unfit as unfit:
        raise setting_error(key, shown(value), str(unfit)) from None


def problems_of(value: Any, read: Reader[object], *where: int | str) -> Iterator[Problem]:
    """Return the problems of the value that stands at ``where``, if it has any."""
    try:
        read(value)
    except Unfit as unfit:
        yield from unfit.problems(where, value)


def read_pair(key: str, value: Any) -> tuple[float, float]:
    """Read two numbers; raises SettingError, which names ``key``, for anything else."""
    try:
        x, y = each(number, enumerate(value if is_row(value) else ()))
        return x, y
    except ValueError:  # Unfit, or not two
        raise setting_error(key, shown(value), "must be two numbers") from None


def check_choice(key: str, value: Any, choices: Sequence[str]) -> None:
    """Refuse what is none of the choices."""
    if value not in choices:
        which = "one of " * (len(choices) > 1) + ", ".join(choices)
        raise setting_error(key, value, f"must be {which}{suggestion(value, choices)}")


def read_law(law: Any) -> Law:
    """Return the law of that name, or the law itself."""
    if isinstance(law, type) and issubclass(law, Law):
        raise setting_error("law", law.__name__, f"is a class; an object is {law.__name__}()")
    if not isinstance(law, Law) and not (isinstance(law, str) and law in LAWS):
        message = f"must be one of {', '.join(LAWS)}, or an object of the class Law"
        raise setting_error("law", law, message + suggestion(law, LAWS))
    return find_law(law)
