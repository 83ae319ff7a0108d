"""Keys: what a part of a scene may be told, said once for Python and for scenario files.

The fields of a part are annotated with a type that has its key: how the value is read and checked,
and in which unit a file has it. From these keys parts check themselves when they are made, and
files are read and written.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, get_args, get_type_hints

from pool_pymunk.model.plain import (
    Reader,
    Unfit,
    between,
    corners,
    ends,
    finite,
    flag,
    ids,
    name,
    one,
    point,
    row,
    size,
    text,
)
from pool_pymunk.model.problems import Point, Problem, raise_any


class Key(NamedTuple):
    """How a value is read; the kind of its unit (length, mass, speed), where it has one."""

    read: Reader[Any]
    unit: str = ""
    may_be_none: bool = False

    def __repr__(self) -> str:
        return "Key()"


Flag = Annotated[bool, Key(flag)]
Text = Annotated[str, Key(text)]
Ids = Annotated[Sequence[str], Key(ids)]
Name = Annotated[str, Key(name)]
Length = Annotated[float, Key(size, "length")]  # m, greater than 0
Gap = Annotated[float, Key(between(0.0), "length")]  # m
Mass = Annotated[float, Key(size, "mass")]  # kg
Time = Annotated[float, Key(size)]  # s
Speed = Annotated[float, Key(between(0.0), "speed")]  # m/s
Angle = Annotated[float, Key(finite)]  # degrees
Share = Annotated[float, Key(between(0.0, 1.0))]
Number = Annotated[float, Key(between(0.0))]  # from 0 on
Place = Annotated[Point, Key(point, "length")]  # m
Velocity = Annotated[Point, Key(point, "speed")]  # m/s
Corners = Annotated[tuple[Point, ...], Key(corners, "length")]  # m
Ends = Annotated[Mapping[str, Point], Key(ends, "length")]  # m


def _key(hint: Any) -> Key:
    """Return the key in an annotation, which may be None, a class, or a tuple of objects of one."""
    if isinstance(hint, type):
        return Key(one(hint))
    if hasattr(hint, "__metadata__"):
        key: Key = hint.__metadata__[0]
        return key
    first, second = get_args(hint)
    return Key(row(first)) if second is ... else _key(first)._replace(may_be_none=True)


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a scene: it reads its fields by their keys when it is made.

    Raises :class:`~pool_pymunk.SceneError` with every field that does not fit, or else with what
    is wrong between the fields.
    """

    KEYS: ClassVar[dict[str, Key]]  # by the names of the fields

    def __init_subclass__(cls) -> None:
        hints = get_type_hints(cls, include_extras=True)
        cls.KEYS = {field: _key(hints[field]) for field in cls.__annotations__}

    def __post_init__(self) -> None:
        problems: list[Problem] = []
        for field, key in self.KEYS.items():
            value = getattr(self, field)
            try:
                plain = None if value is None and key.may_be_none else key.read(value)
                object.__setattr__(self, field, plain)
            except Unfit as unfit:
                problems += unfit.problems((field,), value)
        raise_any(problems)
        raise_any(self._problems())

    def _problems(self) -> Iterable[Problem]:
        """Return what is wrong between the fields."""
        return ()
