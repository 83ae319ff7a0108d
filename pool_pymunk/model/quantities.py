"""This module has the units of scenarios and reports, and reads quantities as typed: ``0.01in``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from pool_pymunk.model.plain import Key, Part, choice, finite
from pool_pymunk.model.problems import Point, Problem, SceneError

UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 0.001},
    "speed": {"m/s": 1.0, "in/s": 0.0254},
}


@dataclass(frozen=True, slots=True)
class Units(Part):
    """Scenario files and reports have numbers in these units; Python objects have them in SI.

    >>> Units(length="in").from_si(0.0254, "length")
    1.0
    """

    length: Annotated[str, Key(choice(UNITS["length"]))] = "m"
    mass: Annotated[str, Key(choice(UNITS["mass"]))] = "kg"
    speed: Annotated[str, Key(choice(UNITS["speed"]))] = "m/s"

    def to_si(self, value: float, kind: str) -> float:
        """Return a ``value`` in the unit of ``kind`` (length, mass or speed), in SI."""
        return value * UNITS[kind][getattr(self, kind)]

    def from_si(self, value: float, kind: str) -> float:
        """Return an SI ``value`` in the unit of ``kind``."""
        return value / UNITS[kind][getattr(self, kind)]


def quantity(key: str, text: str, kind: str, units: Units) -> float:
    """Return a length, mass or speed (``kind``) as typed, in SI; a bare number is in ``units``.

    Raises :class:`~pool_pymunk.SceneError`, which names ``key``, for anything else.

    >>> quantity("--tolerance", "0.01in", "length", Units()), quantity("m", "160", "mass", Units())
    (0.000254, 160.0)
    >>> quantity("radius", "big", "length", Units())
    Traceback (most recent call last):
        ...
    pool_pymunk.SceneError: radius = "big": must be a length, such as 1 cm (m, cm, mm, in)
    """
    known = UNITS[kind]
    longest_first = sorted(known, key=len, reverse=True)
    unit = next((one for one in longest_first if text.strip().endswith(one)), "")
    try:
        number = finite(float(text.strip().removesuffix(unit)))
    except ValueError:
        message = f"must be a {kind}, such as 1 {longest_first[0]} ({', '.join(known)})"
        raise SceneError([Problem(key, text, message)]) from None
    return number * known[unit] if unit else units.to_si(number, kind)


def positive(key: str, text: str, kind: str, units: Units) -> float:
    """Return a :func:`quantity` that must be greater than 0."""
    value = quantity(key, text, kind, units)
    if value <= 0.0:
        raise SceneError([Problem(key, text, "must be greater than 0")])
    return value


def vector(key: str, texts: Sequence[str], kind: str, units: Units) -> Point:
    """Return two quantities, along x and y, in SI."""
    x, y = (quantity(key, text, kind, units) for text in texts)
    return (x, y)


def read_units(key: str, text: str) -> Units:
    """Return units by their names, in any order; those that are left out are SI.

    >>> read_units("--units", "in, g")
    Units(length='in', mass='g', speed='m/s')
    """
    kinds = {name: kind for kind, known in UNITS.items() for name in known}
    names = text.replace(",", " ").split()
    chosen: dict[str, str] = {}
    for name in names:
        if name not in kinds:
            raise SceneError([Problem(key, name, f"there is no such unit ({', '.join(kinds)})")])
        if chosen.setdefault(kinds[name], name) != name:
            message = f"give only one unit of {kinds[name]}, {chosen[kinds[name]]} or {name}"
            raise SceneError([Problem(key, name, message)])
    return Units(**chosen)
