"""This module has the units in which a scenario is written and reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from pool_pymunk.model.keys import Key, Part
from pool_pymunk.model.plain import choice

UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 0.001},
    "speed": {"m/s": 1.0, "in/s": 0.0254},
}


@dataclass(frozen=True, slots=True)
class Units(Part):
    """Units are those in which a scenario is written and reported; numbers inside are SI.

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
