"""Keys define once what a part of a scene may say, in Python and in scenario files.

The type of a part's field has its key: it says how the value is read and checked, and in which unit
a file has it. By these keys parts check themselves, and files are read and written.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, NamedTuple, get_args, get_type_hints

from pool_pymunk.model import plain
from pool_pymunk.model.plain import Reader, Unfit
from pool_pymunk.model.problems import Point, Problem, raise_any


class Key(NamedTuple):
    """A key says how a value is read, and of which kind its unit is (length, mass, speed)."""

    read: Reader[Any]
    unit: str = ""
    may_be_none: bool = False

    def __repr__(self) -> str:
        return "Key()"


Flag = Annotated[bool, Key(plain.flag)]
Text = Annotated[str, Key(plain.text)]
Ids = Annotated[Sequence[str], Key(plain.many(plain.text, 'ids, ["1", "2", ...]'))]
Name = Annotated[str, Key(plain.name)]
Color = Annotated[str, Key(plain.color)]  # "#rrggbb"
Colors = Annotated[str | Sequence[str], Key(plain.colors)]  # one of all, or one each
Length = Annotated[float, Key(plain.size, "length")]  # m, greater than 0
Gap = Annotated[float, Key(plain.between(0.0), "length")]  # m
Mass = Annotated[float, Key(plain.size, "mass")]  # kg
Time = Annotated[float, Key(plain.size)]  # s
Speed = Annotated[float, Key(plain.between(0.0), "speed")]  # m/s
Angle = Annotated[float, Key(plain.finite)]  # degrees
Factor = Annotated[float, Key(plain.finite)]  # any finite number
Share = Annotated[float, Key(plain.between(0.0, 1.0))]
Number = Annotated[float, Key(plain.between(0.0))]  # from 0 on
Place = Annotated[Point, Key(plain.point, "length")]  # m
Velocity = Annotated[Point, Key(plain.point, "speed")]  # m/s
Corners = Annotated[
    tuple[Point, ...], Key(plain.many(plain.point, "corners, [[x, y], ...]"), "length")
]  # m
Bulges = Annotated[tuple[float, ...], Key(plain.many(plain.finite, "numbers, [0.0, 1.0, ...]"))]
Ends = Annotated[Mapping[str, Point], Key(plain.ends, "length")]  # m


Keys = dict[str, Key]


def keys_of(made: Any) -> Keys:
    """Return the keys of a class by its fields, of a function by its arguments."""
    hints = get_type_hints(made, include_extras=True)
    return {name: _key(hints[name]) for name in made.__annotations__ if name != "return"}


def _key(hint: Any) -> Key:
    """Return the key in an annotation, which may be None, a class, or a tuple of objects of one."""
    if isinstance(hint, type):
        return Key(plain.made(hint))
    if hasattr(hint, "__metadata__"):
        key: Key = hint.__metadata__[0]
        return key
    first, second = get_args(hint)
    if second is ...:
        return Key(plain.made(first, in_row=True))
    return _key(first)._replace(may_be_none=True)


def read_all(keys: Keys, values: Mapping[str, Any]) -> dict[str, Any]:
    """Read values by their keys; raises SceneError with every one that does not fit."""
    found: dict[str, Any] = {}
    problems: list[Problem] = []
    for name, key in keys.items():
        value = values[name]
        try:
            found[name] = None if value is None and key.may_be_none else key.read(value)
        except Unfit as unfit:
            problems += unfit.problems((name,), value)
    raise_any(problems)
    return found


class Part:
    """A part of a scene is a dataclass that reads its fields by their keys when it is made.

    Raises :class:`~pool_pymunk.SceneError` with all fields that do not fit, or else with all that
    is wrong between them.
    """

    __slots__ = ()
    KEYS: ClassVar[Keys]

    def __init_subclass__(cls) -> None:
        cls.KEYS = getattr(cls, "KEYS", {}) | keys_of(cls)

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in self.KEYS}
        for name, value in read_all(self.KEYS, given).items():
            object.__setattr__(self, name, value)
        raise_any(self._problems())

    def _problems(self) -> Iterable[Problem]:
        """Return what is wrong between the fields."""
        return ()
