"""This module says which shots a sweep plays, and draws them by their numbers.

The random numbers of a shot depend on the seed and on the shot's number alone (Philox, a
counter-based generator: Salmon et al., SC 2011). So shot 123,456 has the same input whatever chunk,
worker or machine plays it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.shots import COLUMNS
from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.model.parts import NEAREST
from pool_pymunk.model.plain import read_number
from pool_pymunk.model.problems import number_problems, setting_error, suggestion
from pool_pymunk.model.scenario_out import scenario_text
from pool_pymunk.physics.laws import Law
from pool_pymunk.solvers import find_shot, request, simulate, yardstick
from pool_pymunk.studies.uncertainty import StartSampler

Floats = NDArray[np.float64]

OWN = ("speed", "angle", "mass", *COLUMNS)  # each of these takes a range
SPREADS = ("start", "noise.speed", "noise.angle")  # each of these takes one width
KEYS = (*OWN, *SPREADS)
UNITS = {"speed": "m/s", "angle": "deg", "mass": "kg", "noise_speed": "m/s", "noise_angle": "deg"}
# Each input has random numbers of its own, so that it does not change if others are varied, too.
SLOT = {key: k for k, key in enumerate(("speed", "angle", "mass", *COLUMNS))}
NOISE_SLOT = {"noise.speed": 10, "noise.angle": 12}  # A normal number takes two uniform ones.
START_SLOT = 16
A_BLOCK = 4  # numbers a step of the generator


class Inputs(NamedTuple):
    """These are the inputs of some shots: what was varied, by its column, and what is played."""

    columns: dict[str, Floats]
    position: Floats
    velocity: Floats
    vary: dict[str, Floats]


@dataclass(frozen=True)
class Plan:
    """A plan says which shots are played.

    ``vary`` has a range (low, high) for each key that is drawn, or one width: ``start`` moves every
    ball's start by up to so much (m) along x and along y; ``noise.speed`` (m/s) and ``noise.angle``
    (degrees) are the standard deviations of the player's errors. ``grid`` has (low, high, count)
    for each key that takes values at equal distances, ends included; all are combined, the last
    key's values come first. The keys are ``speed`` (m/s), ``angle`` (degrees, relative to the
    shot's), ``mass`` (kg, of the struck ball), ``restitution.*`` and ``friction.*``. The manifest
    knows the ``law`` of every contact by its name alone.
    """

    scene: Scene
    shot: Shot | None
    vary: Mapping[str, tuple[float, ...]]
    grid: Mapping[str, tuple[float, float, int]]
    samples: int
    seed: int
    chunk: int
    law: Law

    @property
    def parts(self) -> int:
        """The number of parts, each of ``chunk`` shots or, the last one, fewer."""
        return -(-self.samples // self.chunk)

    def shots_of(self, part: int) -> range:
        """Return the numbers of the shots of a part."""
        return range(part * self.chunk, min((part + 1) * self.chunk, self.samples))

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """The manifest says what makes the dataset what it is; ``hash`` is that of all the rest."""
        from pool_pymunk import __version__

        said = {
            "format": 1,
            "version": __version__,
            "scene": scenario_text(replace(self.scene, title="", shots=())),
            "shot": None if self.shot is None else self._said_shot(),
            "law": self.law.name,
            "vary": {key: list(values) for key, values in sorted(self.vary.items())},
            "grid": {key: list(values) for key, values in self.grid.items()},
            "samples": self.samples,
            "seed": self.seed,
            "chunk": self.chunk,
        }
        digest = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()
        return said | {"hash": digest}

    def _said_shot(self) -> list[object]:
        assert self.shot is not None
        return [self.shot.name, self.shot.ball, *self._struck_velocity, self.shot.aim]

    # -- the start of the shot ---------------------------------------------------------------------

    @cached_property
    def _state(self) -> State:
        """The state at the moment of the shot; one that goes on from another shot is its end."""
        shot, before = self.shot, None
        if shot is not None and shot.from_previous:
            first = self.scene.shots[self.scene.shots.index(shot) - 1]
            before = simulate(self.scene, first, solver=yardstick().name).end
        return self.scene.start(shot, before)

    @cached_property
    def ball(self) -> int:
        """The number of the struck ball; without a shot that of the first ball that moves."""
        if self.shot is not None:
            return self.scene.index[self.shot.ball]
        moves = [i for i, v in enumerate(self._state.velocity) if v != (0.0, 0.0)]
        return moves[0] if moves else 0

    @property
    def _struck_velocity(self) -> tuple[float, float]:
        return self._state.velocity[self.ball]

    # -- drawing -----------------------------------------------------------------------------------

    def draw(self, shots: range) -> Inputs:
        """Return the inputs of these shots."""
        count, balls = len(shots), len(self.scene.balls)
        numbers = uniforms(self.seed, shots, START_SLOT + 2 * balls)
        columns: dict[str, Floats] = {}
        for key, (low, high, steps) in self.grid.items():
            columns[key] = np.linspace(low, high, steps)[self._steps(key, shots)]
        for key, values in self.vary.items():
            if key in OWN:
                low, high = values
                columns[key] = low + (high - low) * numbers[:, SLOT[key]]
            elif key in NOISE_SLOT:
                columns[key] = values[0] * normal(numbers[:, NOISE_SLOT[key] :])
        position = np.tile(np.array(self._state.position), (count, 1, 1))
        for id_ in self._state.off:
            position[:, self.scene.index[id_]] = np.nan
        if "start" in self.vary:
            position = self._moved(position, numbers[:, START_SLOT:], self.vary["start"][0])
        velocity = self._velocity(columns, position)
        vary = {key: columns[key] for key in COLUMNS if key in columns}
        if "mass" in columns:
            vary["mass"] = np.tile([ball.mass for ball in self.scene.balls], (count, 1))
            vary["mass"][:, self.ball] = columns["mass"]
        named = {key.replace(".", "_"): values for key, values in columns.items()}
        return Inputs(named | self._start_columns(position), position, velocity, vary)

    def _steps(self, key: str, shots: range) -> NDArray[np.int_]:
        """Return which of a key's values each shot has; the last key's change fastest."""
        counts = {name: count for name, (_, _, count) in self.grid.items()}
        inner = math.prod(list(counts.values())[list(counts).index(key) + 1 :])
        return np.arange(shots.start, shots.stop) // inner % counts[key]

    def _moved(self, position: Floats, numbers: Floats, width: float) -> Floats:
        """Move every start by up to ``width`` (m), and overlapping balls apart."""
        moved = position + width * (2.0 * numbers.reshape(position.shape) - 1.0)
        sampler = StartSampler(self.scene, np.full((len(self.scene.balls), 2), width))
        return moved if self._state.off else sampler.apart(moved)

    def _velocity(self, columns: Mapping[str, Floats], position: Floats) -> Floats:
        """Return the velocities (S, N, 2): that of the struck ball as it was varied."""
        velocity = np.tile(np.array(self._state.velocity), (len(position), 1, 1))
        vx, vy = self._struck_velocity
        aims = self.shot is not None and self.shot.aim is not None and "start" in self.vary
        said = {"speed", "angle", "noise.speed", "noise.angle"} & columns.keys()
        if not said and not aims:
            return velocity
        speed = columns.get("speed", math.hypot(vx, vy)) + columns.get("noise.speed", 0.0)
        turn = columns.get("angle", 0.0) + columns.get("noise.angle", 0.0)
        angle = (self._aim(position) if aims else math.atan2(vy, vx)) + np.radians(turn)
        speed = np.maximum(speed, 0.0)
        velocity[:, self.ball, 0] = speed * np.cos(angle)
        velocity[:, self.ball, 1] = speed * np.sin(angle)
        return velocity

    def _aim(self, position: Floats) -> Floats:
        """Return the direction (rad) from the struck ball to the ball that it is aimed at."""
        assert self.shot is not None and self.shot.aim is not None
        offset = position - position[:, self.ball : self.ball + 1]
        if self.shot.aim == NEAREST:
            away = np.nan_to_num(np.hypot(offset[..., 0], offset[..., 1]), nan=np.inf)
            away[:, self.ball] = np.inf
            target = away.argmin(axis=1)
        else:
            target = np.full(len(position), self.scene.index[self.shot.aim])
        dx, dy = offset[np.arange(len(position)), target].T
        return np.asarray(np.arctan2(dy, dx))

    def _start_columns(self, position: Floats) -> dict[str, Floats]:
        if "start" not in self.vary:
            return {}
        return {
            f"start_{axis}_{ball.id}": position[:, i, k]
            for i, ball in enumerate(self.scene.balls)
            for k, axis in enumerate("xy")
        }


def uniforms(seed: int, shots: range, count: int) -> Floats:
    """Return ``count`` numbers in [0, 1) for each of the shots (S, count), by their numbers.

    >>> bool((uniforms(7, range(5, 9), 6)[1] == uniforms(7, range(6, 7), 6)[0]).all())
    True
    """
    blocks = -(-count // A_BLOCK)
    source = np.random.Philox(key=seed)
    source.advance(shots.start * blocks)
    raw = source.random_raw(len(shots) * blocks * A_BLOCK).reshape(len(shots), -1)
    return np.asarray((raw[:, :count] >> np.uint64(11)) * 2.0**-53)


def normal(numbers: Floats) -> Floats:
    """Return normal numbers (S,) of two uniform ones each (Box and Muller)."""
    return np.asarray(
        np.sqrt(-2.0 * np.log1p(-numbers[:, 0])) * np.cos(2.0 * np.pi * numbers[:, 1])
    )


def make_plan(
    scene: Scene,
    shot: Shot | str | int | None,
    vary: Mapping[str, Any] | None,
    grid: Mapping[str, Any] | None,
    samples: int | None,
    seed: int,
    chunk: int,
    law: str | Law | None,
    max_time: float | None,
) -> Plan:
    """Check what a sweep is asked for; raises SettingError, in one line that names the argument."""
    asked = request(scene, yardstick().name, law=law, max_time=max_time)
    latest = asked.settings.max_time
    scene = replace(asked.scene, physics=replace(asked.scene.physics, max_time=latest))
    varied = {key: _range(key, value, "vary") for key, value in (vary or {}).items()}
    steps = {key: _grid(key, value) for key, value in (grid or {}).items()}
    both = sorted(varied.keys() & steps.keys())
    if both:
        raise setting_error("grid", both[0], "is varied already")
    points = math.prod(count for _, _, count in steps.values())
    if samples is None and not steps:
        raise setting_error("samples", None, "is wanted where there is no grid")
    total = points if samples is None else _count("samples", samples)
    if steps and total != points:
        raise setting_error("samples", total, f"the grid has {points:,} points")
    plan = Plan(
        scene, find_shot(scene, shot), varied, steps, total, _count("seed", seed, 0),
        _count("chunk", chunk), asked.settings.law_of(scene),
    )  # fmt: skip
    moving = {"speed", "angle", "noise.speed", "noise.angle"} & (varied.keys() | steps.keys())
    if moving and plan._struck_velocity == (0.0, 0.0):
        raise setting_error("shot", None, f"there is no shot whose {min(moving)} could be varied")
    return plan


def _range(key: str, value: Any, name: str) -> tuple[float, ...]:
    """Read a range (low, high), or one width."""
    where = f"{name}[{key!r}]"
    if key not in KEYS:
        message = f"there is no such key (there are: {', '.join(KEYS)}){suggestion(key, KEYS)}"
        raise setting_error(name, key, message)
    low_bound = -math.inf if key == "angle" else 0.0
    values = [value] if key in SPREADS and np.ndim(value) == 0 else list(np.ravel(value))
    wanted = 1 if key in SPREADS else 2
    if len(values) != wanted:
        form = "one width" if wanted == 1 else "a range (low, high)"
        raise setting_error(where, str(value), f"must be {form}")
    found = [_number(where, each, low_bound) for each in values]
    high_bound = 1.0 if key.startswith("restitution") else math.inf
    if found[-1] > high_bound or found[0] > found[-1] or (key == "mass" and found[0] == 0.0):
        bounds = f"{'-inf' if key == 'angle' else 0} <= low <= high"
        limit = " <= 1" if high_bound == 1.0 else ""
        raise setting_error(where, str(value), f"must be {bounds}{limit}")
    return tuple(found)


def _grid(key: str, value: Any) -> tuple[float, float, int]:
    """Read (low, high, count)."""
    if key in SPREADS or np.ndim(value) != 1 or len(value) != 3:
        message = "must be (low, high, count), of a key that takes a range"
        raise setting_error(f"grid[{key!r}]", str(value), message)
    low, high = _range(key, value[:2], "grid")
    return low, high, _count(f"grid[{key!r}]", value[2])


def _number(key: str, value: Any, low: float) -> float:
    return read_number(key, value, lambda key, value: number_problems(key, value, low))


def _count(key: str, value: Any, low: int = 1) -> int:
    found = read_number(key, value, lambda key, value: number_problems(key, value, float(low)))
    if not found.is_integer():
        raise setting_error(key, value, "must be a whole number")
    return int(found)
