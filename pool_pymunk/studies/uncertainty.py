"""This module describes what is not known of a scene's inputs."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from pool_pymunk.model import Point, Scene, Units
from pool_pymunk.model.racks import SHAPES, rack_ids
from pool_pymunk.model.scenario import bundled
from pool_pymunk.physics.motion import Array
from pool_pymunk.solvers import SettingError


@dataclass(frozen=True)
class Uncertainty:
    """An uncertainty is half the width of the range in which an input may be.

    ``position`` is in m, ``speed`` in m/s, ``angle`` in rad. ``position`` is one number for all
    balls, or x and y for each ball by its id. Speed and angle are those of the ball that a shot
    strikes.

    >>> Uncertainty(position=-1.0)
    Traceback (most recent call last):
        ...
    pool_pymunk.SettingError: position = -1.0: must be 0 or more, and finite
    """

    position: float | Mapping[str, Point] = 0.0
    speed: float = 0.0
    angle: float = 0.0

    def __post_init__(self) -> None:
        given: dict[str, float] = {"speed": self.speed, "angle": self.angle}
        if isinstance(self.position, Mapping):
            for id_, (x, y) in self.position.items():
                given |= {
                    f"position of ball {id_} along x": x,
                    f"position of ball {id_} along y": y,
                }
        else:
            given["position"] = self.position
        for key, value in given.items():
            if not (value >= 0.0 and math.isfinite(value)):
                raise SettingError(f"{key} = {value}: must be 0 or more, and finite")

    def widths(self, scene: Scene) -> Array:
        """Return half the width (N, 2) of each ball's position, in m."""
        if not isinstance(self.position, Mapping):
            return np.full((len(scene.balls), 2), float(self.position))
        unknown = self.position.keys() - scene.index.keys()
        if unknown:
            raise SettingError(f"position of ball {min(unknown)}: there is no such ball")
        return np.array([self.position.get(ball.id, (0.0, 0.0)) for ball in scene.balls])

    def scaled(self, factor: float) -> Uncertainty:
        """Return the uncertainty so many times as wide.

        >>> Uncertainty(0.001, angle=0.01).scaled(2.0)
        Uncertainty(position=0.002, speed=0.0, angle=0.02)
        """
        place = self.position
        if isinstance(place, Mapping):
            wide: float | Mapping[str, Point] = {
                id_: (factor * x, factor * y) for id_, (x, y) in place.items()
            }
        else:
            wide = factor * place
        return Uncertainty(wide, factor * self.speed, factor * self.angle)

    def described(self, scene: Scene) -> str:
        """Return the uncertainty in words, in the scenario's units.

        >>> from pool_pymunk import load
        >>> Uncertainty(0.000127, speed=0.01, angle=0.001).described(load("report"))
        'starts within ±0.005 in, speed ±0.01 m/s, angle ±0.0573°'
        """
        units = scene.units
        widths = [units.from_si(float(h), "length") for h in np.unique(self.widths(scene))]
        low, high = (f"{h:.3g}" for h in (widths[0], widths[-1]))
        both = f"±{low}" if low == high else f"±{low} to ±{high}"
        parts = [f"starts within {both} {units.length}"] if widths[-1] > 0.0 else []
        if self.speed:
            parts.append(f"speed ±{units.from_si(self.speed, 'speed'):.3g} {units.speed}")
        if self.angle:
            parts.append(f"angle ±{math.degrees(self.angle):.3g}°")
        return ", ".join(parts) or "no uncertainty"


def written_uncertainty(scenario: str | Path) -> Uncertainty:
    """Return half of the last digit that a scenario file writes for each ball's position.

    For the balls of a rack it is that of the rack's apex.

    ``position = [66.00, 22.0]`` in inches is within 0.005 in along x and 0.05 in along y. The file
    must be one that :func:`~pool_pymunk.load` reads.

    >>> from pool_pymunk import load
    >>> widths = written_uncertainty("report").widths(load("report"))
    >>> widths.shape, set(widths.ravel().tolist()) == {0.005 * 0.0254}
    ((11, 2), True)
    """
    text = bundled().get(str(scenario), Path(scenario)).read_text(encoding="utf-8")
    return uncertainty_of(text)


def uncertainty_of(text: str) -> Uncertainty:
    """Do what :func:`written_uncertainty` does, for a scenario's text.

    >>> uncertainty_of('[[balls]]\\nid = "1"\\nposition = [0.50, 3]').position
    {'1': (0.005, 0.5)}
    """
    raw: dict[str, Any] = tomllib.loads(text.removeprefix("\ufeff"), parse_float=Decimal)
    units = Units(**raw.get("units", {}))
    places = {ball["id"]: ball["position"] for ball in raw.get("balls", ())}
    for one in raw.get("racks", ()):
        ids = rack_ids(one.get("rows"), one.get("shape", SHAPES[0]), one.get("ids"))
        places |= dict.fromkeys(ids, one["apex"])
    half = {
        id_: tuple(units.to_si(_half_digit(x), "length") for x in place)
        for id_, place in places.items()
    }
    return Uncertainty(position={id_: (x, y) for id_, (x, y) in half.items()})


def _half_digit(written: int | Decimal) -> float:
    """Return half of the last digit's place value: 0.005 for 66.00, 0.5 for 66."""
    exponent = written.as_tuple().exponent if isinstance(written, Decimal) else 0
    assert isinstance(exponent, int), "positions are finite"
    return float(Decimal(1).scaleb(exponent) / 2)
