"""This module describes the uncertainty of a scene's inputs, and draws starts within it.

Balls of a start that overlap each other or a cushion are moved apart as little as possible: the sum
of the squares of all moves is least. So a rack whose balls touch can be studied, too.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from pool_pymunk.many.places import may_lie
from pool_pymunk.model import Point, Scene, Units
from pool_pymunk.model import inputs as table
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import TABLE, names_in, parts
from pool_pymunk.model.plain import argument, number, read_pair
from pool_pymunk.model.problems import setting_error, shown
from pool_pymunk.model.racks import SHAPES, rack_ids
from pool_pymunk.model.scenario import bundled
from pool_pymunk.results.run import points
from pool_pymunk.solvers import SettingError
from pool_pymunk.studies.variation import Uniform, check, numbers, offsets

# Both were chosen: a start is drawn ATTEMPTS times at most, and moved apart in SWEEPS at most.
ATTEMPTS, SWEEPS = 20, 2000
APART = 2.5e-10  # of a radius; smaller pushes end the search, because scenes may overlap by 1e-6
NEIGHBORS = 8.0  # widths; balls that overlap push others, so this is more than 2
ANEW = 1 << 40  # A start that is drawn anew has the numbers of a shot so far behind.


@dataclass(frozen=True)
class Uncertainty:
    """An uncertainty is half the width of the range in which an input may be.

    ``position`` (m) is one number for all balls, or x and y for each ball by its id. ``speed``
    (m/s) and ``angle`` (rad) are those of the ball that a shot strikes. ``inputs`` has those of
    further inputs (:mod:`pool_pymunk.model.inputs`), such as ``"mass.8"``, each in its unit there.

    >>> Uncertainty(position=-1.0)
    Traceback (most recent call last):
        ...
    pool_pymunk.SettingError: position = -1.0: must be 0 or more, and finite
    """

    position: float | Mapping[str, Point] = 0.0
    speed: float = 0.0
    angle: float = 0.0
    inputs: Mapping[str, float] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        if not isinstance(self.inputs, Mapping):
            message = "must be numbers by the names of inputs"
            raise setting_error("inputs", shown(self.inputs), message)
        given: dict[str, object] = {"speed": self.speed, "angle": self.angle}
        given |= {f"inputs[{name!r}]": width for name, width in self.inputs.items()}
        if isinstance(self.position, Mapping):
            for id_, both in self.position.items():
                x, y = read_pair(f"position of ball {id_}", both)
                where = f"position of ball {id_} along"
                given |= {f"{where} x": x, f"{where} y": y}
        else:
            given["position"] = self.position
        for key, value in given.items():
            width = argument(key, value, number)
            if not (width >= 0.0 and math.isfinite(width)):
                raise SettingError(f"{key} = {value}: must be 0 or more, and finite")

    def widths(self, scene: Scene) -> Array:
        """Return half the width (N, 2) of each ball's position, in m."""
        own = self.by_name(scene)
        return np.array([[own.get(f"{axis}.{id_}", 0.0) for axis in "xy"] for id_ in scene.index])

    def scaled(self, factor: float) -> Uncertainty:
        """Return the uncertainty, ``factor`` times as wide.

        >>> Uncertainty(0.001, angle=0.01).scaled(2.0)
        Uncertainty(position=0.002, speed=0.0, angle=0.02, inputs={})
        """
        place, inputs = self.position, {name: factor * w for name, w in self.inputs.items()}
        if isinstance(place, Mapping):
            place = {id_: (factor * x, factor * y) for id_, (x, y) in place.items()}
        else:
            place = factor * place
        return Uncertainty(place, factor * self.speed, factor * self.angle, inputs)

    def by_name(self, scene: Scene) -> dict[str, float]:
        """Return all half widths that are not 0 by the inputs' names, in SI, angles in degrees.

        Raises SettingError for an input that is not there, is given twice, or goes too far.
        """
        place = self.position
        if not isinstance(place, Mapping):
            place = dict.fromkeys(scene.index, (place, place))
        if unknown := place.keys() - scene.index.keys():
            raise SettingError(f"position of ball {min(unknown)}: there is no such ball")
        found = {f"{axis}.{id_}": width for id_, both in place.items()
                 for axis, width in zip("xy", both, strict=True)}  # fmt: skip
        found |= {"speed": self.speed, "turn": math.degrees(self.angle)}
        for name, width in self.inputs.items():
            check(scene, "inputs", name, Uniform(width))
            key = "turn" if name == "angle" else name
            if key in ("speed", "turn") and found[key]:
                raise setting_error("inputs", name, "is uncertain already")
            found[key] = width
        return {name: width for name, width in found.items() if width}

    def causes(self, scene: Scene) -> dict[str, Uncertainty]:
        """Return what is uncertain, each on its own: "starts", "speed", "angle", and inputs.

        >>> from pool_pymunk import load
        >>> list(Uncertainty(1e-4, angle=0.01, inputs={"mass.8": 1e-3}).causes(load("report")))
        ['starts', 'angle', 'mass.8']
        """
        own = self.by_name(scene)
        places = dict(zip(scene.index, points(self.widths(scene)), strict=True))
        turn = math.radians(own.get("turn", 0.0))
        alone = {"starts": Uncertainty(places), "angle": Uncertainty(angle=turn)}
        alone["speed"] = Uncertainty(speed=own.get("speed", 0.0))
        causes = dict.fromkeys(cause_of(name) for name in own)
        return {one: alone.get(one) or Uncertainty(inputs={one: own[one]}) for one in causes}

    def described(self, scene: Scene) -> str:
        """Return the uncertainty in words, in the scenario's units.

        >>> from pool_pymunk import load
        >>> Uncertainty(0.000127, speed=0.01, angle=0.001).described(load("report"))
        'starts within ±0.005 in, speed ±0.01 m/s, angle ±0.0573°'
        """
        units, said, widths = scene.units, list[str](), self.widths(scene)
        if widths.any():
            ends = (units.from_si(float(h), "length") for h in (widths.min(), widths.max()))
            both = " to ".join(dict.fromkeys(f"±{h:.3g}" for h in ends))
            said.append(f"starts within {both} {units.length}")
        if self.speed:
            said.append(f"speed ±{units.text(self.speed, '.3g', 'speed')}")
        if self.angle:
            said.append(f"angle ±{math.degrees(self.angle):.3g}°")
        for name, width in self.inputs.items():
            value = f"{name} ±{table.in_units(units, name, width):.3g}"
            said.append(f"{value} {table.unit_of(units, name)}".strip())
        return ", ".join(said) or "no uncertainty"


def cause_of(name: str) -> str:
    """Return the cause of an error: "starts" for "x.C", "angle" for "turn.1"."""
    causes = {"position": "starts", "speed": "speed", "turn": "angle", "roll": "roll"}
    return causes.get(TABLE[parts(name)[0]].group, name)


def written_uncertainty(scenario: str | Path) -> Uncertainty:
    """Return half a unit of the last digit that a scenario file writes for each ball's position.

    ``position = [66.00, 22.0]`` in inches is within 0.005 in along x and 0.05 in along y. For the
    balls of a rack it is that of the apex or center. :func:`~pool_pymunk.load` must be able to read
    the file.

    >>> from pool_pymunk import load
    >>> widths = written_uncertainty("report").widths(load("report"))
    >>> widths.shape, set(widths.ravel().tolist()) == {0.005 * 0.0254}
    ((11, 2), True)
    """
    units, places = _written(scenario)

    def known_to(written: int | Decimal) -> float:
        return units.to_si(half_digit(written), "length")

    return Uncertainty({id_: (known_to(x), known_to(y)) for id_, (x, y) in places.items()})


def digits_sentence(scenario: str | Path) -> str:
    """Say from which digits :func:`written_uncertainty` has the uncertainty, the coarsest first.

    >>> print(digits_sentence("report").partition(",")[0])
    Positions given as 66.00 (x of ball C) are taken to be known to 0.005 in
    """
    units, places = _written(scenario)
    coarse = max(
        ((half_digit(value), value, axis, id_) for id_, place in places.items()
         for value, axis in zip(place, "xy", strict=True)), key=lambda one: one[0],
    )  # fmt: skip
    half, value, axis, id_ = coarse
    return (
        f"Positions given as {value} ({axis} of ball {id_}) are taken to be known to {half:g} "
        f"{units.length}, half of their last digit; more digits in the scenario, or "
        "--position-error, say otherwise."
    )


def half_digit(written: int | Decimal) -> float:
    """Return half of the last digit's place value.

    >>> half_digit(Decimal("66.00")), half_digit(3)
    (0.005, 0.5)
    """
    digit = Decimal(written).as_tuple().exponent
    assert isinstance(digit, int), "positions are finite"
    return float(Decimal(1).scaleb(digit) / 2)


def _written(
    scenario: str | Path,
) -> tuple[Units, dict[str, tuple[int | Decimal, int | Decimal]]]:
    """Return the units of a scenario, and the balls' positions as they are written."""
    text = bundled().get(str(scenario), Path(scenario)).read_text(encoding="utf-8")
    raw: dict[str, Any] = tomllib.loads(text.removeprefix("\ufeff"), parse_float=Decimal)
    places = {ball["id"]: ball["position"] for ball in raw.get("balls", ())}
    for one in raw.get("racks", ()):
        shape, middle = one.get("shape", SHAPES[0]), one.get("apex") or one["center"]
        ids = rack_ids(one.get("rows"), shape, one.get("ids"), one.get("rings"))
        places |= dict.fromkeys(ids, middle)
    return Units(**raw.get("units", {})), places


class StartSampler:
    """A start sampler draws starts around ``places`` (m), by default those of the scene's balls.

    ``overlapping`` counts balls that it had to move apart.
    """

    def __init__(self, scene: Scene, widths: Array, places: Any = None) -> None:
        self.scene, self.overlapping = scene, 0
        names = zip(names_in(scene)["position"], widths.ravel().tolist(), strict=True)
        self.spread = {name: Uniform(width) for name, width in names}
        own = [ball.position for ball in scene.balls]
        self.base = np.array(own if places is None else places)
        self.radius = np.array([ball.radius for ball in scene.balls])
        far = NEIGHBORS * np.hypot(*widths.max(axis=0))
        apart = np.hypot(*(self.base[:, None] - self.base[None]).transpose(2, 0, 1))
        gaps = apart - self.radius[:, None] - self.radius[None]
        self.pairs = np.argwhere(np.triu(gaps < far, 1)).tolist()
        self.cushions = [
            (i, edge)
            for i, (x, y) in enumerate(self.base.tolist())
            for edge in (scene.table.edges if scene.table else ())
            if edge.distance(x, y) < self.radius[i] + far
        ]

    def starts(self, samples: int, seed: int) -> Array:
        """Draw positions (S, N, 2), in m."""
        starts = np.empty((samples, *self.base.shape))
        missing = np.ones(samples, dtype=bool)
        for k in range(ATTEMPTS):
            errors = numbers(self.spread, range(k * ANEW, k * ANEW + samples), seed)
            drawn = self.base + offsets(self.scene, errors)[missing]
            self.overlapping += int((~may_lie(self.scene, drawn)).sum())
            starts[missing] = self.apart(drawn)
            missing[missing] = ~may_lie(self.scene, starts[missing]).all(axis=1)
            if not missing.any():
                return starts
        message = "the balls lie so close that no start without overlaps was found"
        raise SettingError(f"position: {message} within the uncertainty")

    def apart(self, starts: Array) -> Array:
        """Return the nearest starts (S, N, 2) in which nothing overlaps; each is found on its own.

        A sweep removes each overlap in turn, by a push along its line of centres. Later sweeps may
        lessen a push, but never make it a pull (Hildreth, Naval Research Logistics 4, 1957, 79).
        """
        starts, radius = starts.copy(), self.radius
        offsets = [starts[:, j] - starts[:, i] for i, j in self.pairs]
        lines = [offset / np.hypot(*offset.T)[:, None] for offset in offsets]
        pushes = np.zeros((len(self.pairs) + len(self.cushions), len(starts)))
        moves, worst = np.ones(len(starts), dtype=bool), np.empty(len(starts))

        def push(k: int, i: int, gap: Array) -> Array:
            more = moves * (np.maximum(pushes[k] - gap, 0.0) - pushes[k])
            pushes[k] += more
            np.maximum(worst, np.abs(more) / radius[i], out=worst)
            return np.asarray(more[:, None])

        for _ in range(SWEEPS):
            worst[:] = 0.0
            for k, (i, j) in enumerate(self.pairs):
                gap = np.hypot(*(starts[:, j] - starts[:, i]).T) - radius[i] - radius[j]
                moved = push(k, i, gap / 2.0) * lines[k]
                starts[:, i] -= moved
                starts[:, j] += moved
            for k, (i, edge) in enumerate(self.cushions, start=len(self.pairs)):
                gap = edge.height(*starts[:, i].T) - radius[i]
                starts[:, i] += push(k, i, gap) * np.array(edge.normal)
            moves &= worst >= APART
            if not moves.any():
                break
        return starts
