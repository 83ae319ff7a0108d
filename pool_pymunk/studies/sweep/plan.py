"""This module says which shots a sweep plays, and draws them by their numbers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pool_pymunk.laws import Law
from pool_pymunk.many import Batch
from pool_pymunk.many.source import Begun
from pool_pymunk.model import Scene, Shot, inputs
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.plain import argument, between, flag, whole
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.scenario_out import scenario_text
from pool_pymunk.solvers import find_shot, request
from pool_pymunk.studies.uncertainty import StartSampler
from pool_pymunk.studies.variation import (
    OF_SHOT,
    Between,
    Distribution,
    Grid,
    Normal,
    Numbers,
    Uniform,
    Variation,
    numbers,
    offsets,
    points,
    read_range,
)

# Each of these takes one width.
SPREADS: dict[str, type[Uniform | Normal]] = {
    "start": Uniform,
    "noise.speed": Normal,
    "noise.angle": Normal,
}
UNITS = {row.name: inputs.SI[row.quantity] for row in inputs.TABLE.values()} | {
    "start": "m", "noise_speed": "m/s", "noise_angle": "deg", "angle": "deg", "turn": "deg",
    "duration": "s",
}  # fmt: skip


class Drawn(NamedTuple):
    """These are the inputs of some shots: what was varied, by its column, and how they begin."""

    columns: dict[str, Array]
    position: Array
    velocity: Array
    vary: dict[str, Array]
    roll: Array | None


@dataclass(frozen=True)
class Plan:
    """A plan says which shots are played.

    ``begun`` is the shot as it begins in the scene, in which nothing varies yet. ``vary`` has a
    range (low, high) for each key that is drawn, or one width: ``start`` moves every ball's start
    by up to this (m) along x and along y; ``noise.speed`` (m/s) and ``noise.angle`` (degrees) are
    the standard deviations of the player's errors. ``grid`` has (low, high, count) for each key
    that takes values at equal distances, ends included; all are combined, and those of the last key
    change fastest. Keys are names of inputs (:mod:`pool_pymunk.model.inputs`); ``angle`` (degrees)
    is relative to the shot's, and ``mass`` (kg) that of the struck ball. The manifest has only the
    name of the law of every contact.
    """

    begun: Variation
    vary: Mapping[str, Distribution]
    grid: Mapping[str, Distribution]
    samples: int
    seed: int
    chunk: int

    @property
    def scene(self) -> Scene:
        """The scene that is played."""
        return self.begun.scene

    @property
    def parts(self) -> int:
        """The number of parts, each of ``chunk`` shots or, the last one, fewer."""
        return -(-self.samples // self.chunk)

    def shots_of(self, part: int) -> range:
        """Return the numbers of the shots of a part."""
        return range(part * self.chunk, min((part + 1) * self.chunk, self.samples))

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """The manifest has all that determines the dataset.

        ``hash`` is a hash of all the rest but ``samples``: a shot is the same among more of them.
        """
        from pool_pymunk import __version__

        begun, its = self.begun, None
        shot, law = begun.struck, begun.law
        assert isinstance(law, Law), "whoever plans knows the law"
        if shot is not None:
            aim = shot.aim if begun.aims_anew else None
            struck = begun.start.velocity[begun.ball]
            its = [shot.name, shot.ball, *struck, aim]
            its += [shot.roll] * self.scene.surface.rolls + list(shot.place or ())
        said = {
            "format": 3,
            "version": __version__,
            "scene": scenario_text(replace(self.scene, title="", shots=())),
            "shot": its,
            "law": law.name,
            "vary": {key: list(vars(its).values()) for key, its in sorted(self.vary.items())},
            "grid": {key: list(vars(its).values()) for key, its in self.grid.items()},
            **{key: getattr(self, key) for key in ("seed", "chunk")},
        }
        digest = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()
        return said | {"samples": self.samples, "hash": digest}

    def draw(self, shots: Numbers) -> Drawn:
        """Return the inputs of these shots."""
        state, position = self.begun.start, self.begun.places(len(shots))
        varied = {key: its for key, its in {**self.grid, **self.vary}.items() if key != "start"}
        named = {self.meaning(key): its for key, its in varied.items()}
        values = numbers(named, shots, self.seed)
        if isinstance(start := self.vary.get("start"), Uniform):
            places = inputs.names_in(self.scene)["position"]
            errors = numbers(dict.fromkeys(places, start), shots, self.seed)
            position += offsets(self.scene, errors)
            if not state.off:  # Overlapping balls are moved apart.
                widths = np.full(position.shape[1:], start.half_width)
                position = StartSampler(self.scene, widths, state.position).apart(position)
        begun = self.begun.begin(position, values)
        columns = dict(zip(varied, values.values(), strict=True))
        return Drawn(self._named(columns, begun.position), *begun)

    def play(self, drawn: Drawn, **how: Any) -> Batch:
        """Play the shots that were drawn; ``how`` has other arguments of ``simulate_many``."""
        return self.begun.play(Begun(*drawn[1:]), **how)

    def meaning(self, key: str) -> str:
        """Return the name of the input that a key of a sweep stands for."""
        if key == "mass":
            return f"mass.{self.scene.balls[self.begun.ball].id}"
        return "turn" if key == "angle" else key

    def own(self, key: str) -> float:
        """Return the value of a key that was not varied."""
        return self.begun.own(self.meaning(key))

    def _named(self, columns: Mapping[str, Array], position: Array) -> dict[str, Array]:
        """Return what was varied by the names of its columns; places are ``start_x_1``."""
        names, count = inputs.names_in(self.scene)["position"], len(position)
        places = dict(zip(names, position.reshape(count, -1).T, strict=True))
        named = {key.replace(".", "_"): columns[key] for key in columns if key not in places}
        moved = places if "start" in self.vary else [key for key in places if key in columns]
        return named | {f"start_{key.replace('.', '_', 1)}": places[key] for key in moved}


def as_begun(
    scene: Scene, shot: Shot | str | int | None, law: str | Law | None,
    max_time: float | None = None, aims_anew: bool = False,
) -> Variation:  # fmt: skip
    """Return a shot as it begins, in a scene that has the latest time; nothing varies yet."""
    asked = request(scene, law=law, max_time=max_time)
    latest = asked.settings.max_time
    scene = replace(asked.scene, physics=replace(asked.scene.physics, max_time=latest))
    chosen, anew = find_shot(scene, shot), argument("aims_anew", aims_anew, flag)
    return Variation(scene, {}, chosen, asked.settings.law_of(scene), anew)


def make_plan(
    begun: Variation,
    vary: Mapping[str, Any] | None,
    grid: Mapping[str, Any] | None,
    samples: int | None,
    seed: int,
    chunk: int,
) -> Plan:
    """Return the plan of a sweep; raise SettingError, in one line that names the argument."""
    scene = begun.scene
    varied = {key: _read(scene, "vary", key, value) for key, value in (vary or {}).items()}
    steps = {key: _read(scene, "grid", key, value) for key, value in (grid or {}).items()}
    if both := varied.keys() & steps.keys():
        raise setting_error("grid", min(both), "is varied already")
    if samples is None and not steps:
        raise setting_error("samples", None, "is missing where there is no grid")
    total = points(steps.values()) if samples is None else argument("samples", samples, whole(1))
    if steps and total != points(steps.values()):
        raise setting_error("samples", total, f"the grid has {points(steps.values()):,} points")
    seed, chunk = argument("seed", seed, whole(0)), argument("chunk", chunk, whole(1))
    plan = Plan(begun, varied, steps, total, seed, chunk)
    seen: dict[str, str] = {}
    for key in (*plan.vary, *plan.grid):
        other = seen.setdefault(plan.meaning(key), key)
        if other != key:
            raise setting_error("vary", key, f"means the same as {other}")
    moving = OF_SHOT & {*seen, *seen.values()}
    if moving and plan.own("speed") == 0.0:
        raise setting_error("shot", None, f"there is no shot whose {min(moving)} could be varied")
    return plan


def _read(scene: Scene, of: str, key: str, value: Any) -> Distribution:
    """Read a range (low, high) or one width of ``vary``, or (low, high, count) of ``grid``."""
    where, is_grid, spread = f"{of}[{key!r}]", of == "grid", SPREADS.get(key)
    if is_grid and (spread or np.ndim(value) != 1 or len(value) != 3):
        message = "must be (low, high, count), of a key that takes a range"
        raise setting_error(where, str(value), message)
    if spread is not None:
        if np.size(value) != 1:
            raise setting_error(where, str(value), "must be one width")
        return spread(argument(where, np.ravel(value)[0], between(0.0)))
    also = (*SPREADS, "mass")
    row = inputs.TABLE[key] if key == "mass" else inputs.row_of(of, key, scene, also)[0]
    ends = read_range(where, value[:2] if is_grid else value, row)
    return Grid(*ends, argument(where, value[2], whole(1))) if is_grid else Between(*ends)
