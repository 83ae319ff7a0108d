"""The units that a scenario is written and reported in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pool_pymunk.model.plain import make_plain, text
from pool_pymunk.model.problems import Problem, raise_any

UNITS: Mapping[str, Mapping[str, float]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 0.001},
    "speed": {"m/s": 1.0, "in/s": 0.0254},
}


@dataclass(frozen=True, slots=True)
class Units:
    """The units a scenario is written and reported in; numbers inside are SI.

    >>> Units(length="in").from_si(0.0254, "length")
    1.0
    """

    length: str = "m"
    mass: str = "kg"
    speed: str = "m/s"

    def __post_init__(self) -> None:
        make_plain(self, **dict.fromkeys(self.__slots__, text))
        raise_any(
            Problem(kind, getattr(self, kind), f"must be one of {', '.join(known)}")
            for kind, known in UNITS.items()
            if getattr(self, kind) not in known
        )

    def to_si(self, value: float, kind: str) -> float:
        """``value`` in this file's unit of ``kind`` (length, mass or speed), in SI."""
        return value * UNITS[kind][getattr(self, kind)]

    def from_si(self, value: float, kind: str) -> float:
        """The SI ``value`` in this file's unit of ``kind``."""
        return value / UNITS[kind][getattr(self, kind)]
