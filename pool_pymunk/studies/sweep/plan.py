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

from pool_pymunk.model import Scene, Shot, State
from pool_pymunk.model.inputs import ROWS, SI, TABLE, column_of, input_value, parts, row_of, struck
from pool_pymunk.model.plain import argument, between, whole
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.scenario_out import scenario_text
from pool_pymunk.physics.laws import Law
from pool_pymunk.solvers import find_shot, request, simulate, yardstick
from pool_pymunk.studies.starts import Floats, StartSampler, launched, normal, uniforms

SPREADS = ("start", "noise.speed", "noise.angle")  # each of these takes one width
UNITS = {"start": "m", "noise_speed": "m/s", "noise_angle": "deg", "angle": "deg", "turn": "deg"}
UNITS = {row.name: SI[row.quantity] for row in ROWS} | UNITS
# These inputs have fixed random numbers of a shot; every other input has those of its name.
SLOT = {"speed": 0, "angle": 1, "turn": 1, "mass": 2} | {
    key: 3 + column for key, column in column_of("coefficients").items()
}
NOISE_SLOT = {"noise.speed": 10, "noise.angle": 12}  # A normal number takes two uniform ones.
START_SLOT = 16


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
            before = simulate(self.scene, first, solver=yardstick().name, law=self.law).end
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
        for key, said in self.vary.items():
            if key in NOISE_SLOT:
                columns[key] = said[0] * normal(numbers[:, NOISE_SLOT[key] :])
            elif key != "start":
                low, high = said
                columns[key] = low + (high - low) * self._drawn(key, shots, numbers)
        position = np.tile(np.array(self._state.position), (count, 1, 1))
        velocity = np.tile(np.array(self._state.velocity), (count, 1, 1))
        for id_ in self._state.off:
            position[:, self.scene.index[id_]] = np.nan
        if "start" in self.vary:
            position = self._moved(position, numbers[:, START_SLOT:], self.vary["start"][0])
        arrays, vary = {"position": position, "velocity": velocity}, dict[str, Floats]()
        for key, values in columns.items():
            kind, whose = parts(self.meaning(key))
            array, axis = (TABLE[kind].column if kind in TABLE else None) or ("", 0)
            if array in arrays:
                arrays[array][:, self.scene.index[whose], axis] = values
            elif kind in TABLE and array != "struck":
                vary[self.meaning(key)] = values
        velocity[:, self.ball] = self._struck(columns, position, velocity[:, self.ball])
        return Inputs(self._named(columns, position), position, velocity, vary)

    def meaning(self, key: str) -> str:
        """Return the input of the table that a key of a sweep means."""
        if key == "mass":
            return f"mass.{self.scene.balls[self.ball].id}"
        return "turn" if key == "angle" else key

    def own(self, key: str) -> float:
        """Return the value of a key that was not varied."""
        kind, whose = parts(self.meaning(key))
        array, axis = TABLE[kind].column or ("", 0)
        state = self._state._asdict()
        if array in state:
            return float(state[array][self.scene.index[whose]][axis])
        if array == "struck":
            vx, vy = self._struck_velocity
            return math.hypot(vx, vy) if kind == "speed" else 0.0
        return input_value(self.scene, self.meaning(key))

    def _drawn(self, key: str, shots: range, numbers: Floats) -> Floats:
        """Return the random numbers of an input, which others have no part in."""
        if key in SLOT:
            return numbers[:, SLOT[key]]
        own = int.from_bytes(hashlib.sha256(key.encode()).digest()[:8]) << 64
        return uniforms(self.seed + own, shots, 1)[:, 0]

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

    def _struck(
        self, columns: Mapping[str, Floats], position: Floats, velocity: Floats
    ) -> Floats:  # fmt: skip
        """Return the velocities (S, 2) of the struck ball as it was varied."""
        moves = self.vary.keys() | self.grid.keys()
        if self.shot is not None and self.shot.aim is not None and any(
            key == "start" or key[:2] in ("x.", "y.") for key in moves
        ):  # fmt: skip
            velocity = launched(self.scene, self.shot, position)
        said = {"speed", "angle", "turn", *NOISE_SLOT} & columns.keys()
        if not said:
            return velocity
        speed = columns.get("speed", np.hypot(*velocity.T)) + columns.get("noise.speed", 0.0)
        turn = sum(columns.get(key, 0.0) for key in ("angle", "turn", "noise.angle"))
        return struck(velocity, {"speed": np.maximum(speed, 0.0), "turn": turn})

    def _named(self, columns: Mapping[str, Floats], position: Floats) -> dict[str, Floats]:
        """Return what was varied by the names of its columns; places are ``start_x_1``."""
        named = {
            key.replace(".", "_"): values
            for key, values in columns.items()
            if key[:2] not in ("x.", "y.")
        }
        return named | {
            f"start_{axis}_{ball.id}": position[:, i, k]
            for i, ball in enumerate(self.scene.balls)
            for k, axis in enumerate("xy")
            if "start" in self.vary or f"{axis}.{ball.id}" in columns
        }


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
    varied = {key: _range(scene, key, value, "vary") for key, value in (vary or {}).items()}
    steps = {key: _grid(scene, key, value) for key, value in (grid or {}).items()}
    both = sorted(varied.keys() & steps.keys())
    if both:
        raise setting_error("grid", both[0], "is varied already")
    points = math.prod(count for _, _, count in steps.values())
    if samples is None and not steps:
        raise setting_error("samples", None, "is missing where there is no grid")
    total = points if samples is None else argument("samples", samples, whole(1))
    if steps and total != points:
        raise setting_error("samples", total, f"the grid has {points:,} points")
    plan = Plan(
        scene, find_shot(scene, shot), varied, steps, total, argument("seed", seed, whole(0)),
        argument("chunk", chunk, whole(1)), asked.settings.law_of(scene),
    )  # fmt: skip
    _check_shot(plan)
    return plan


def _check_shot(plan: Plan) -> None:
    """Refuse two names of one input, and to vary a shot where there is none."""
    seen: dict[str, str] = {}
    for key in (*plan.vary, *plan.grid):
        other = seen.setdefault(plan.meaning(key), key)
        if other != key:
            raise setting_error("vary", key, f"means the same as {other}")
    moving = {"speed", "angle", "turn", *NOISE_SLOT} & seen.keys() | {"angle"} & set(seen.values())
    if moving and plan._struck_velocity == (0.0, 0.0):
        raise setting_error("shot", None, f"there is no shot whose {min(moving)} could be varied")


def _range(scene: Scene, key: str, value: Any, name: str) -> tuple[float, ...]:
    """Read a range (low, high), or one width."""
    where, spreads = f"{name}[{key!r}]", key in SPREADS
    row = None
    if not spreads:
        row = TABLE["mass"] if key == "mass" else row_of(name, key, scene, (*SPREADS, "mass"))[0]
    low_bound, high_bound = (0.0, math.inf) if row is None else (row.low, row.high)
    values = [value] if spreads and np.ndim(value) == 0 else list(np.ravel(value))
    if len(values) != (1 if spreads else 2):
        form = "one width" if spreads else "a range (low, high)"
        raise setting_error(where, str(value), f"must be {form}")
    found = [_number(where, each, low_bound) for each in values]
    is_zero = row is not None and row.size and found[0] == 0.0
    if found[-1] > high_bound or found[0] > found[-1] or is_zero:
        limit = " <= 1" if high_bound == 1.0 else ""
        raise setting_error(where, str(value), f"must be {low_bound:g} <= low <= high{limit}")
    return tuple(found)


def _grid(scene: Scene, key: str, value: Any) -> tuple[float, float, int]:
    """Read (low, high, count)."""
    if key in SPREADS or np.ndim(value) != 1 or len(value) != 3:
        message = "must be (low, high, count), of a key that takes a range"
        raise setting_error(f"grid[{key!r}]", str(value), message)
    low, high = _range(scene, key, value[:2], "grid")
    return low, high, argument(f"grid[{key!r}]", value[2], whole(1))


def _number(key: str, value: Any, low: float) -> float:
    return argument(key, value, between(low))
