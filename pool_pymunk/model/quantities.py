"""This module has the units of scenarios and reports, and reads quantities as typed: ``0.01in``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

from pool_pymunk.model.plain import Part, between, finite, one_of, problems_of
from pool_pymunk.model.problems import SMALLEST, Point, Problem, SceneError, raise_any

UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 0.001},
    "speed": {"m/s": 1.0, "in/s": 0.0254},
}

# Angles and times have no units of their own in scenarios: they are in the first of these.
QUANTITIES = {
    **UNITS,
    "angle": {"deg": 1.0, "°": 1.0, "mrad": math.degrees(1e-3), "rad": math.degrees(1.0)},
    "time": {"s": 1.0, "ms": 0.001},
}
EXAMPLES = {"angle": "an angle, such as 5 deg", "time": "a time, such as 1/240 s"}


@dataclass(frozen=True, slots=True)
class Units(Part):
    """Scenario files and reports have numbers in these units; Python objects have them in SI.

    >>> Units(length="in").from_si(0.0254, "length")
    1.0
    """

    length: Annotated[str, one_of(UNITS["length"]), "Default: m."] = "m"
    mass: Annotated[str, one_of(UNITS["mass"]), "Default: kg."] = "kg"
    speed: Annotated[str, one_of(UNITS["speed"]), "Default: m/s."] = "m/s"

    def to_si(self, value: float, kind: str) -> float:
        """Convert a ``value`` of a ``kind`` to SI; an angle stays in degrees.

        A kind is a length, mass or speed, or an angle or time, whose units are always the same.
        """
        return value * self._factor(kind)

    def from_si(self, value: float, kind: str) -> float:
        """Return an SI ``value`` in the unit of ``kind``."""
        return value / self._factor(kind)

    def text(self, value: float, form: str = ".2g", kind: str = "length") -> str:
        """Return an SI ``value`` in this form with its unit.

        >>> Units(length="in").text(0.0127)
        '0.5 in'
        """
        return f"{self.from_si(value, kind):{form}} {getattr(self, kind)}"

    def _factor(self, kind: str) -> float:
        return UNITS[kind][getattr(self, kind)] if kind in UNITS else 1.0


def quantity(key: str, text: str, kind: str, units: Units, low: float = -math.inf) -> float:
    """Return a length, mass, speed, angle or time (``kind``) as typed, in SI, angles in degrees.

    It is a number or a fraction; without a unit it is in ``units``. Raises
    :class:`~pool_pymunk.SceneError`, which names ``key``, for anything else, and below ``low``.

    >>> quantity("--tolerance", "0.01in", "length", Units()), quantity("m", "160", "mass", Units())
    (0.000254, 160.0)
    >>> quantity("--dt", "1/8", "time", Units()), quantity("--angle", "0.1 deg", "angle", Units())
    (0.125, 0.1)
    >>> quantity("radius", "big", "length", Units())
    Traceback (most recent call last):
        ...
    pool_pymunk.SceneError: radius = "big": must be a length, such as 1 cm (m, cm, mm, in)
    """
    from fractions import Fraction  # Nobody but this function needs it.

    known, typed = QUANTITIES[kind], text.strip()
    longest_first = sorted(known, key=len, reverse=True)
    unit = next((one for one in longest_first if typed.endswith(one)), "")
    number = typed.removesuffix(unit)
    try:
        found = finite(float(Fraction(number.replace(" ", "")) if "/" in number else number))
    except (ValueError, ArithmeticError):
        what = EXAMPLES.get(kind, f"a {kind}, such as 1 {longest_first[0]}")
        message = f"must be {what} ({', '.join(known)})"
        raise SceneError([Problem(key, text, message)]) from None
    value = found * known[unit] if unit else units.to_si(found, kind)
    raise_any(replace(one, value=text) for one in problems_of(value, between(low), key))
    return value


def positive(key: str, text: str, kind: str, units: Units) -> float:
    """Return a :func:`quantity` that must be greater than 0."""
    return quantity(key, text, kind, units, SMALLEST)


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
