"""This module describes what is not known of a scene's inputs, and plays samples within it.

The exact solver plays every sample, as :func:`~pool_pymunk.simulate_many` does. A shot that aims at
a ball aims at where that ball is in each sample. A shot that goes on from the one before starts
where that one ends, played from the same sample.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.batch import STATUSES
from pool_pymunk.fast.many import empty, play_all
from pool_pymunk.fast.records import Out
from pool_pymunk.fast.shots import Source, read_source
from pool_pymunk.model import Point, Scene, Shot, Units
from pool_pymunk.model.inputs import (
    SHOT,
    TABLE,
    in_units,
    input_value,
    names_in,
    parts,
    row_of,
    struck,
    unit_of,
)
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.racks import SHAPES, rack_ids
from pool_pymunk.model.scenario import bundled
from pool_pymunk.physics.laws import Law, find_law
from pool_pymunk.physics.motion import Array
from pool_pymunk.results.run import STATUSES as ENDS
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import SettingError, simulate, simulate_all, yardstick
from pool_pymunk.studies.beside import Beside, Reference, reference_of
from pool_pymunk.studies.starts import StartSampler, launched

Mask = NDArray[np.bool_]

UNFINISHED = ("max_events", "non_finite")
MAX_TIME = STATUSES.index("max_time")
PRINTED_DECIMALS = 2  # the decimals of a printed end, in the scenario's unit of length


@dataclass(frozen=True)
class Uncertainty:
    """An uncertainty is half the width of the range in which an input may be.

    ``position`` is in m, ``speed`` in m/s, ``angle`` in rad. ``position`` is one number for all
    balls, or x and y for each ball by its id. Speed and angle are those of the ball that a shot
    strikes. ``inputs`` has those of further inputs by their names in the table of inputs
    (:mod:`pool_pymunk.model.inputs`), such as ``"mass.8"``, each in its unit there.

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
        given: dict[str, float] = {"speed": self.speed, "angle": self.angle}
        given |= {f"inputs[{name!r}]": width for name, width in self.inputs.items()}
        if isinstance(self.position, Mapping):
            for id_, xy in self.position.items():
                along = zip("xy", xy, strict=True)
                given |= {f"position of ball {id_} along {axis}": half for axis, half in along}
        else:
            given["position"] = self.position
        for key, value in given.items():
            if not (value >= 0.0 and math.isfinite(value)):
                raise SettingError(f"{key} = {value}: must be 0 or more, and finite")

    def widths(self, scene: Scene) -> Array:
        """Return half the width (N, 2) of each ball's position, in m."""
        place = self.position
        if isinstance(place, Mapping):
            unknown = place.keys() - scene.index.keys()
            if unknown:
                raise SettingError(f"position of ball {min(unknown)}: there is no such ball")
            found = np.array([place.get(ball.id, (0.0, 0.0)) for ball in scene.balls])
        else:
            found = np.full((len(scene.balls), 2), float(place))
        for name, width in self.inputs.items():
            row, whose = row_of("inputs", name, scene)
            if row.group == "position":
                found[scene.index[whose], "xy".index(row.name)] = width
        return found

    def scaled(self, factor: float) -> Uncertainty:
        """Return the uncertainty this many times as wide.

        >>> Uncertainty(0.001, angle=0.01).scaled(2.0)
        Uncertainty(position=0.002, speed=0.0, angle=0.02, inputs={})
        """
        place = self.position
        if isinstance(place, Mapping):
            place = {id_: (factor * x, factor * y) for id_, (x, y) in place.items()}
        else:
            place = factor * place
        inputs = {name: factor * width for name, width in self.inputs.items()}
        return Uncertainty(place, factor * self.speed, factor * self.angle, inputs)

    def everywhere(self, scene: Scene) -> Uncertainty:
        """Return the same uncertainty with its places, speed and angle apart from other inputs.

        Raises SettingError for an input that the scene does not have, that is uncertain twice, or
        whose range goes beyond its limits.
        """
        shot, rest = {"speed": self.speed, "angle": self.angle}, dict[str, float]()
        for name, width in self.inputs.items():
            row, _ = row_of("inputs", name, scene)
            if row.of == SHOT:
                kind = row.quantity
                if shot[kind]:
                    raise setting_error("inputs", name, "is uncertain already")
                shot[kind] = math.radians(width) if kind == "angle" else width
            elif row.group != "position":
                _check_range(scene, name, width)
                rest[name] = width
        widths = zip(scene.index, self.widths(scene).tolist(), strict=True)
        return Uncertainty({id_: (x, y) for id_, (x, y) in widths}, inputs=rest, **shot)

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
        for name, width in self.inputs.items():
            said = f"{in_units(units, name, width):.3g} {unit_of(units, name)}".strip()
            parts.append(f"{name} ±{said}")
        return ", ".join(parts) or "no uncertainty"


def _check_range(scene: Scene, name: str, width: float) -> None:
    """Refuse a range that goes beyond the limits of an input."""
    if not any(name in names for names in names_in(scene).values()):
        raise setting_error("inputs", name, "the scene leaves it out")
    own, row = input_value(scene, name), TABLE[parts(name)[0]]
    if row.bad(np.array([own - width, own + width])).any():
        message = f"the range {own - width:g} to {own + width:g} goes too far: it {row.limits}"
        raise setting_error("inputs", name, message)


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
    half = {id_: [units.to_si(_half_digit(x), "length") for x in xy] for id_, xy in places.items()}
    return Uncertainty(position={id_: (x, y) for id_, (x, y) in half.items()})


def _half_digit(written: int | Decimal) -> float:
    """Return half of the last digit's place value: 0.005 for 66.00, 0.5 for 66."""
    exponent = written.as_tuple().exponent if isinstance(written, Decimal) else 0
    assert isinstance(exponent, int), "positions are finite"
    return float(Decimal(1).scaleb(exponent) / 2)


# -- samples ---------------------------------------------------------------------------------------


class Draws(NamedTuple):
    """Draws have starts (S, N, 2) in m, and errors of K shots (S, K, 2) and of P other inputs.

    The errors of the shots are those of speed and angle, in m/s and rad. ``rejected`` counts the
    balls that overlapped something as they were drawn.
    """

    starts: Array
    shots: Array
    others: dict[str, Array]
    rejected: int

    def columns(self, base: Array) -> Array:
        """Return the errors of all inputs (S, K), in the order of :meth:`Study.errors`."""
        shots = self.shots * (1.0, math.degrees(1.0))
        parts = [self.starts - base, shots, *self.others.values()]
        return np.concatenate([each.reshape(len(self.starts), -1) for each in parts], axis=1)


class Samples(NamedTuple):
    """Samples are what came of draws, in arrays as in :class:`~pool_pymunk.Sensitivity`."""

    ends: Array
    left: Array
    same_contacts: Mask
    pocketed: NDArray[np.int_]
    finished: Mask


@dataclass(frozen=True)
class Study:
    """A study has all that samples of one shot need; ``chain`` are the shots up to it.

    ``reference`` is the unperturbed run; samples are compared with it to ``agree`` (m).
    """

    chain: tuple[Shot | None, ...]
    reference: Run
    agree: float
    law: Law
    uncertainty: Uncertainty

    def runs(self) -> dict[int, Run]:
        """Play the unperturbed shots up to this one, each from where the one before ends."""
        scene, exact = self.reference.scene, yardstick().name
        runs = simulate_all(scene, self.chain, solver=exact, law=self.law)
        return dict(enumerate(runs, start=1))

    def errors(self) -> dict[str, float]:
        """Return half the width of the range of every input, by its name, angles in degrees."""
        scene, own = self.reference.scene, self.uncertainty
        axes = (f"{axis}.{ball.id}" for ball in scene.balls for axis in "xy")
        found = dict(zip(axes, own.widths(scene).ravel().tolist(), strict=True))
        for k, _ in enumerate(self.chain, start=1):
            found |= {f"speed.{k}": own.speed, f"turn.{k}": math.degrees(own.angle)}
        return found | dict(own.inputs)

    def draw(self, samples: int, seed: int, scale: float = 1.0) -> Draws:
        """Draw samples within this many times the uncertainty."""
        scene, own = self.reference.scene, self.uncertainty.scaled(scale)
        rng = np.random.default_rng(seed)
        shots = rng.uniform(-1.0, 1.0, (samples, len(self.chain), 2)) * (own.speed, own.angle)
        sampler = StartSampler(scene, own.widths(scene))
        starts = sampler.starts(samples, rng)
        others = {}
        for name, width in own.inputs.items():
            value, row = input_value(scene, name), TABLE[parts(name)[0]]
            drawn = value + width * rng.uniform(-1.0, 1.0, samples)
            others[name] = row.clipped(drawn) - value
        return Draws(starts, shots, others, sampler.overlapping)

    def play(
        self, draws: Draws, threads: int | None = None, done: Callable[[int], object] | None = None
    ) -> Samples:
        """Play samples through every shot of the chain, each from where the one before ends."""
        scene, count = self.reference.scene, len(draws.starts)
        own = np.array([ball.velocity for ball in scene.balls])
        position, velocity = draws.starts, np.tile(own, (count, 1, 1))
        pocketed, finished = np.full(position.shape[:2], -1), np.ones(count, dtype=bool)
        others = {name: input_value(scene, name) + off for name, off in draws.others.items()}
        for k, shot in enumerate(self.chain):
            there = np.where(pocketed[..., np.newaxis] < 0, position, np.nan)
            if shot is not None:
                velocity, is_struck = _struck(scene, shot, there, velocity, draws.shots[:, k])
                finished &= is_struck
            source = read_source(scene, there, velocity, others, self.law, None)
            out = empty(*there.shape[:2])
            if shot is self.chain[-1]:
                found = Beside(self.reference, self.beside, out)
                play_all(source, out, threads, done or _nothing, found)
                for s, i in np.argwhere(pocketed >= 0).tolist():  # They lie in their pockets.
                    off = self.beside.path[:, i : i + 1] - position[s, i]
                    found.left[s, i] = found.first_off(off)[0]
            else:
                play_all(source, out, threads, _nothing)
                velocity = _go_on(source, out)
                others = {name: each for name, each in others.items() if name[0] != "v"}
            finished &= out.status <= MAX_TIME
            pocketed = np.where(pocketed < 0, out.pocketed, pocketed)
            position = np.where(np.isnan(out.final), position, out.final)
        return Samples(position, found.left, found.same, pocketed, finished)

    @cached_property
    def beside(self) -> Reference:
        """Return the unperturbed run as samples are compared with it."""
        return reference_of(self.reference, self.agree)


def read_study(
    scene: Scene, shot: Shot | None, uncertainty: Uncertainty, law: str | Law | None = None
) -> Study:
    """Play the unperturbed shot; raise SettingError where it cannot be studied."""
    uncertainty = uncertainty.everywhere(scene)
    chain: list[Shot | None] = [shot]
    while (first := chain[0]) is not None and first.from_previous:
        chain.insert(0, scene.shots[scene.shots.index(first) - 1])
    if shot is None and (uncertainty.speed or uncertainty.angle):
        raise SettingError("shot = none: there is no shot whose speed or angle could be uncertain")
    for name in uncertainty.inputs:
        row_of("inputs", name, scene, (), chain[0])
    reference = simulate(scene, shot, solver=yardstick().name, law=law)
    if reference.status in UNFINISHED:
        raise SettingError(f"shot = {reference.name}: {ENDS[reference.status]}")
    digit = 2.0 * float(uncertainty.widths(scene).max())
    agree = digit or scene.units.to_si(10.0**-PRINTED_DECIMALS, "length")
    law = find_law(law or reference.scene.physics.law)
    return Study(tuple(chain), reference, agree, law, uncertainty)


def _struck(
    scene: Scene, shot: Shot, there: Array, velocity: Array, errors: Array
) -> tuple[Array, Mask]:
    """Return the velocities (S, N, 2) as a shot begins, with errors (S, 2) of speed and angle.

    Also tell in which samples it can begin: the ball that it aims at may be gone.
    """
    ball, own = scene.index[shot.ball], launched(scene, shot, there)
    if errors.any():
        speed = np.maximum(np.hypot(*own.T) + errors[:, 0], 0.0)
        own = struck(own, {"speed": speed, "turn": np.degrees(errors[:, 1])})
    is_there = np.isfinite(there[:, ball]).all(axis=-1)
    is_struck = np.isfinite(own).all(axis=-1)
    velocity = velocity.copy()
    velocity[is_there & is_struck, ball] = own[is_there & is_struck]
    return velocity, np.asarray(is_struck | ~is_there)


def _go_on(source: Source, out: Out) -> Array:
    """Return the velocities (S, N, 2) at the ends of shots: balls move where time was up."""
    velocity = np.zeros(out.final.shape)
    for k in np.flatnonzero(out.status == MAX_TIME).tolist():
        velocity[k] = source.run(k, measures_policies=False).end.velocity
    return velocity


def _nothing(count: int) -> None:
    """Take no note that samples are done."""
