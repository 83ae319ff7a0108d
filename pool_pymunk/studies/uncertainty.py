"""This module describes what is not known of a scene's inputs, and draws starts within it.

Every number is drawn uniformly within its uncertainty. A start that overlaps a neighbour or a
cushion is drawn again, ball by ball in the scene's order. So each ball may be anywhere that the
balls listed before it leave free.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model import TOUCHING, Edge, Point, Scene, Table, Units
from pool_pymunk.model.scenario import bundled
from pool_pymunk.physics.motion import Array
from pool_pymunk.solvers import SettingError

Mask = NDArray[np.bool_]

ROUNDS, ATTEMPTS = 64, 100  # draws of a ball that overlaps; draws of a start that leaves it no room


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
    half = {
        ball["id"]: tuple(units.to_si(_half_digit(x), "length") for x in ball["position"])
        for ball in raw.get("balls", ())
    }
    return Uncertainty(position={id_: (x, y) for id_, (x, y) in half.items()})


def _half_digit(written: int | Decimal) -> float:
    """Return half of the last digit's place value: 0.005 for 66.00, 0.5 for 66."""
    exponent = written.as_tuple().exponent if isinstance(written, Decimal) else 0
    assert isinstance(exponent, int), "positions are finite"
    return float(Decimal(1).scaleb(exponent) / 2)


# -- drawing starts --------------------------------------------------------------------------------


class StartSampler:
    """A start sampler draws starts in which no ball overlaps another or a cushion."""

    def __init__(self, scene: Scene, widths: Array) -> None:
        self.scene = scene
        self.table = scene.table
        self.widths = widths
        self.base = np.array([ball.position for ball in scene.balls])
        self.radius = np.array([ball.radius for ball in scene.balls])
        self.rejected = 0
        self.near = [self._near(i) for i in range(len(scene.balls))]

    def _near(self, i: int) -> list[int]:
        """Return the balls listed before ball ``i`` that it could overlap."""
        gap = np.hypot(*(self.base[:i] - self.base[i]).T) - self.radius[:i] - self.radius[i]
        return np.flatnonzero(gap < np.hypot(*(self.widths[:i] + self.widths[i]).T)).tolist()

    def starts(self, samples: int, rng: np.random.Generator) -> Array:
        """Draw positions (S, N, 2), in m."""
        starts = np.empty((samples, *self.base.shape))
        missing = np.ones(samples, dtype=bool)
        for _ in range(ATTEMPTS):
            starts[missing], fits = self._attempt(int(missing.sum()), rng)
            missing[missing] = ~fits
            if not missing.any():
                return starts
        raise SettingError(
            "position: the balls lie so close that no starts within the uncertainty were found in "
            "which none overlap"
        )

    def _attempt(self, samples: int, rng: np.random.Generator) -> tuple[Array, Mask]:
        """Draw starts, and tell which of them are free of overlaps."""
        starts = self.base + self.widths * rng.uniform(-1.0, 1.0, (samples, *self.base.shape))
        fits = np.ones(samples, dtype=bool)
        for i in range(len(self.base)):
            again = np.flatnonzero(self._overlaps(starts, i))
            for _ in range(ROUNDS):
                if not len(again):
                    break
                self.rejected += len(again)
                drawn = rng.uniform(-1.0, 1.0, (len(again), 2))
                starts[again, i] = self.base[i] + self.widths[i] * drawn
                again = again[self._overlaps(starts[again], i)]
            fits[again] = False
        return starts, fits

    def _overlaps(self, starts: Array, i: int) -> Mask:
        """Tell in which starts (S, N, 2) ball ``i`` overlaps a ball before it, or a cushion."""
        at, found = starts[:, i], np.zeros(len(starts), dtype=bool)
        for j in self.near[i]:
            reach = (1.0 - TOUCHING) * (self.radius[i] + self.radius[j])
            found |= np.hypot(*(starts[:, j] - at).T) < reach
        if self.table is not None:
            found |= _off(self.table, at, (1.0 - TOUCHING) * self.radius[i])
        return found


def _off(table: Table, at: Array, radius: float) -> Mask:
    """Tell which points (S, 2) are off the table, or nearer than ``radius`` (m) to a cushion."""
    inside, near = np.zeros(len(at), dtype=bool), np.zeros(len(at), dtype=bool)
    x, y = at.T
    for edge in table.edges:
        (ax, ay), (bx, by) = edge.start, edge.end
        crossed = (ay > y) != (by > y)
        if crossed.any():
            inside ^= crossed & (x < ax + (y - ay) / (by - ay) * (bx - ax))
        near |= _distance(edge, x, y) < radius
    return near | ~inside


def _distance(edge: Edge, x: Array, y: Array) -> Array:
    """Return the distances (S,) of points from a cushion, ends included (m)."""
    along = np.clip(edge.along(x, y), 0.0, edge.length)  # type: ignore[arg-type]
    (ax, ay), (tx, ty) = edge.start, edge.tangent
    return np.asarray(np.hypot(x - ax - along * tx, y - ay - along * ty))
