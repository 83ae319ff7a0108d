"""This module describes what is not known of a scene's inputs, and draws starts within it.

Every number is drawn uniformly within its uncertainty. Balls of a start that overlap each other or
a cushion are moved apart as little as possible: the sum of the squares of all moves is least. So a
rack whose balls touch can be studied, too.
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

from pool_pymunk.fast.places import may_lie
from pool_pymunk.model import Edge, Point, Scene, Units
from pool_pymunk.model.racks import SHAPES, rack_ids
from pool_pymunk.model.scenario import bundled
from pool_pymunk.physics.motion import Array
from pool_pymunk.solvers import SettingError

Mask = NDArray[np.bool_]

ATTEMPTS = 20  # So often a start is drawn whose balls cannot be moved apart.
SWEEPS = 2000  # So often all overlaps of a start are looked at.
APART = 2.5e-10  # of a radius; pushes that are smaller end the search
NEIGHBORS = 8.0  # widths; balls that are farther apart than this do not come to overlap


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


# -- drawing starts --------------------------------------------------------------------------------


class StartSampler:
    """A start sampler draws starts in which no ball overlaps another or a cushion.

    ``overlapping`` counts the balls that overlapped something as they were drawn.
    """

    def __init__(self, scene: Scene, widths: Array) -> None:
        self.scene = scene
        self.widths = widths
        self.base = np.array([ball.position for ball in scene.balls])
        self.radius = np.array([ball.radius for ball in scene.balls])
        self.overlapping = 0
        reach = NEIGHBORS * np.hypot(*widths.max(axis=0))
        self.pairs = self._pairs(reach)
        self.cushions = self._cushions(reach)

    def _pairs(self, reach: float) -> list[tuple[int, int]]:
        """Return the pairs of balls whose surfaces are nearer than ``reach`` (m)."""
        apart = np.hypot(*(self.base[:, None] - self.base[None]).transpose(2, 0, 1))
        gaps = apart - self.radius[:, None] - self.radius[None]
        first, second = np.nonzero(np.triu(gaps < reach, 1))
        return list(zip(first.tolist(), second.tolist(), strict=True))

    def _cushions(self, reach: float) -> list[tuple[int, Edge]]:
        """Return the balls that are nearer than ``reach`` (m) to a cushion, each with it."""
        edges = self.scene.table.edges if self.scene.table else ()
        return [
            (i, edge)
            for i, (x, y) in enumerate(self.base.tolist())
            for edge in edges
            if edge.distance(x, y) < self.radius[i] + reach
        ]

    def starts(self, samples: int, rng: np.random.Generator) -> Array:
        """Draw positions (S, N, 2), in m."""
        starts = np.empty((samples, *self.base.shape))
        missing = np.ones(samples, dtype=bool)
        for _ in range(ATTEMPTS):
            count = int(missing.sum())
            drawn = self.base + self.widths * rng.uniform(-1.0, 1.0, (count, *self.base.shape))
            self.overlapping += int((~may_lie(self.scene, drawn)).sum())
            starts[missing] = self.apart(drawn)
            missing[missing] = ~may_lie(self.scene, starts[missing]).all(axis=1)
            if not missing.any():
                return starts
        raise SettingError(
            "position: the balls lie so close that no starts within the uncertainty were found in "
            "which none overlap"
        )

    def apart(self, starts: Array) -> Array:
        """Return the nearest starts (S, N, 2) in which nothing overlaps; each is found on its own.

        Each overlap is taken back along its line of centres, in turn, by a push that later turns
        may lessen but never make a pull (Hildreth, Naval Research Logistics 4, 1957, 79).
        """
        starts = starts.copy()
        radius = self.radius
        lines = [_unit(starts[:, j] - starts[:, i]) for i, j in self.pairs]
        pushes = np.zeros((len(self.pairs) + len(self.cushions), len(starts)))
        moves = np.ones(len(starts), dtype=bool)
        for _ in range(SWEEPS):
            worst = np.zeros(len(starts))
            for k, (i, j) in enumerate(self.pairs):
                gap = np.hypot(*(starts[:, j] - starts[:, i]).T) - radius[i] - radius[j]
                push = moves * (np.maximum(pushes[k] - gap / 2.0, 0.0) - pushes[k])
                pushes[k] += push
                starts[:, i] -= push[:, None] * lines[k]
                starts[:, j] += push[:, None] * lines[k]
                worst = np.maximum(worst, np.abs(push) / radius[i])
            for k, (i, edge) in enumerate(self.cushions, start=len(self.pairs)):
                gap = edge.height(*starts[:, i].T) - radius[i]
                push = moves * (np.maximum(pushes[k] - gap, 0.0) - pushes[k])
                pushes[k] += push
                starts[:, i] += push[:, None] * np.array(edge.normal)
                worst = np.maximum(worst, np.abs(push) / radius[i])
            moves &= worst >= APART
            if not moves.any():
                break
        return starts


def _unit(offsets: Array) -> Array:
    """Return unit vectors (S, 2) along offsets (S, 2)."""
    return np.asarray(offsets / np.hypot(*offsets.T)[:, None])
