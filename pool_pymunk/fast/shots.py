"""This module reads many shots: positions, velocities, and what differs from shot to shot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.loop import NOTHING, Shots
from pool_pymunk.fast.tables import coefficients_of, cue_of
from pool_pymunk.model import Scene, State
from pool_pymunk.model.problems import setting_error, suggestion
from pool_pymunk.physics.laws import Law
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import request
from pool_pymunk.solvers.registry import yardstick
from pool_pymunk.solvers.request import Request

Floats = NDArray[np.float64]

# What may differ from shot to shot, with its column in the coefficients of the compiled shots.
COLUMNS = {
    "restitution.ball_ball": 0,
    "restitution.cue_ball": 1,
    "restitution.cushion": 2,
    "friction.surface": 3,
    "friction.cushion": 4,
    "friction.ball_ball": 5,
}
KEYS = (*COLUMNS, "mass")


class Source(NamedTuple):
    """A source has all that is needed to play any of the shots: they are in arrays, in SI.

    ``position`` and ``velocity`` may be views that repeat one start for all shots (S, N, 2).
    """

    scene: Scene
    asked: Request
    position: Floats
    velocity: Floats
    vary: Mapping[str, Floats]

    @property
    def watched(self) -> int:
        """The number of the cue ball, or of the first ball that moves in the first shot."""
        found = cue_of(self.scene)
        if found != NOTHING or not len(self.velocity):
            return found
        moves = np.flatnonzero(np.nan_to_num(self.velocity[0]).any(axis=-1))
        return int(moves[0]) if len(moves) else NOTHING

    @property
    def law(self) -> Law:
        """The law of every contact."""
        return self.asked.settings.law_of(self.scene)

    def scene_of(self, k: int) -> Scene:
        """Return the scene with the coefficients and masses of shot ``k``."""
        scene = replace(self.scene, shots=())
        for key, values in self.vary.items():
            part, _, name = key.partition(".")
            if key == "mass":
                masses = np.broadcast_to(values[k], len(scene.balls)).tolist()
                pairs = zip(scene.balls, masses, strict=True)
                scene = replace(scene, balls=tuple(replace(b, mass=m) for b, m in pairs))
            else:
                changed = replace(getattr(scene, part), **{name: float(values[k])})
                scene = replace(scene, **{part: changed})
        return scene

    def state_of(self, k: int) -> State:
        """Return the state that shot ``k`` starts from; NaN means off the table."""
        is_off = np.isnan(self.position[k]).any(axis=-1)
        places, speeds = self.position[k].tolist(), self.velocity[k].tolist()
        balls = list(zip(self.scene.balls, places, speeds, is_off.tolist(), strict=True))
        return State(
            tuple(ball.position if off else (x, y) for ball, (x, y), _, off in balls),
            tuple((0.0, 0.0) if off else (x, y) for _, _, (x, y), off in balls),
            frozenset(ball.id for ball, _, _, off in balls if off),
        )

    def run(self, k: int, measures_policies: bool = True) -> Run:
        """Play shot ``k`` by the exact solver; raises SceneError if it cannot start."""
        scene = self.scene_of(k)
        settings = self.asked.settings._replace(measures_policies=measures_policies)
        asked = self.asked._replace(scene=scene, settings=settings)
        return asked.play(None, scene.state(self.state_of(k)))

    def shots(self, part: slice) -> Shots:
        """Return some of the shots as the compiled loop takes them, in arrays of their own."""
        position, velocity = np.array(self.position[part]), np.array(self.velocity[part])
        is_off = np.isnan(position).any(axis=-1)
        position[is_off] = np.array([ball.position for ball in self.scene.balls])[
            np.nonzero(is_off)[1]
        ]
        count = len(position)
        mass = np.array(np.broadcast_to([ball.mass for ball in self.scene.balls], is_off.shape))
        coefficients = np.array(np.broadcast_to(coefficients_of(self.scene), (count, 6)))
        for key, values in self.vary.items():
            some = values[part]
            if key == "mass":
                mass[:] = some if some.ndim == 2 else some[:, np.newaxis]
            elif key == "friction.surface":
                coefficients[:, COLUMNS[key]] = some * self.scene.physics.gravity
            else:
                coefficients[:, COLUMNS[key]] = some
        if "restitution.cue_ball" not in self.vary and self.scene.restitution.cue_ball is None:
            coefficients[:, 1] = coefficients[:, 0]  # The cue ball is as any other.
        return Shots(position, velocity, is_off.astype(np.int64), mass, coefficients)


@dataclass(frozen=True)
class Range:
    """A range says which numbers are allowed."""

    words: str
    low: float
    high: float = np.inf
    has_low: bool = True

    def bad(self, values: Floats) -> NDArray[np.bool_]:
        """Tell which values are not allowed."""
        above = values >= self.low if self.has_low else values > self.low
        return ~(above & (values <= self.high) & np.isfinite(values))


SHARE = Range("must be between 0 and 1", 0.0, 1.0)
FROM_ZERO = Range("must be 0 or more, and finite", 0.0)
SIZE = Range("must be greater than 0, and finite", 0.0, has_low=False)
RANGES = {key: SHARE if key.startswith("restitution") else FROM_ZERO for key in COLUMNS} | {
    "mass": SIZE
}


def read_source(
    scene: Scene,
    position: Any,
    velocity: Any,
    vary: Mapping[str, Any] | None,
    law: str | Law | None,
    max_time: float | None,
) -> Source:
    """Check what the shots are asked for, and bring all of it to one number of shots.

    Raises SettingError, in one line that names the argument.
    """
    asked = request(scene, yardstick().name, law=law, max_time=max_time)
    base = np.array([ball.position for ball in scene.balls])
    resting = np.array([ball.velocity for ball in scene.balls])
    places = _points("position", base if position is None else position, len(base), nan=True)
    speeds = _points("velocity", resting if velocity is None else velocity, len(base), nan=True)
    varied = {key: _values(key, values, len(base)) for key, values in (vary or {}).items()}
    counts = {"position": len(places), "velocity": len(speeds)} | {
        f"vary[{key!r}]": len(values) for key, values in varied.items()
    }
    count = max(counts.values()) if all(counts.values()) else 0
    for key, own in counts.items():
        if own not in (1, count):
            raise setting_error(key, f"{own} shots", f"must be for 1 shot or for {count}")
    lost = ~np.isfinite(speeds).all(axis=-1) & ~np.isnan(places).any(axis=-1)
    if lost.any():
        where = tuple(np.argwhere(lost)[0].tolist())
        raise setting_error(_at("velocity", where), "no number", "must be two finite numbers")
    source = Source(
        asked.scene,
        asked,
        np.broadcast_to(places, (count, *places.shape[1:])),
        np.broadcast_to(speeds, (count, *speeds.shape[1:])),
        {key: np.broadcast_to(v, (count, *v.shape[1:])) for key, v in varied.items()},
    )
    _check_that_it_ends(source)
    return source


def _points(key: str, value: Any, balls: int, nan: bool) -> Floats:
    """Read points (S, N, 2), or (N, 2) for all shots."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise setting_error(key, type(value).__name__, "must be numbers in an array") from None
    if found.ndim not in (2, 3) or found.shape[-2:] != (balls, 2):
        shape = f"({', '.join(map(str, found.shape))})"
        message = f"must have the shape (S, {balls}, 2), or ({balls}, 2) for all shots"
        raise setting_error(key, f"shape {shape}", message)
    if found.ndim == 2:
        found = found[np.newaxis]
    if np.isinf(found).any():
        where = tuple(np.argwhere(np.isinf(found).any(axis=-1))[0].tolist())
        raise setting_error(_at(key, where), "inf", "must be two finite numbers")
    return found


def _values(key: str, value: Any, balls: int) -> Floats:
    """Read what differs from shot to shot: (S,), or for masses (S, N) as well."""
    name = f"vary[{key!r}]"
    if key not in KEYS:
        message = f"there is no such key (there are: {', '.join(KEYS)}){suggestion(key, KEYS)}"
        raise setting_error("vary", key, message)
    try:
        found = np.atleast_1d(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise setting_error(name, type(value).__name__, "must be numbers in an array") from None
    if found.ndim > 1 and not (key == "mass" and found.shape[1:] == (balls,)):
        shape = f"({', '.join(map(str, found.shape))})"
        wanted = f"(S,) or (S, {balls})" if key == "mass" else "(S,)"
        raise setting_error(name, f"shape {shape}", f"must have the shape {wanted}")
    bad = RANGES[key].bad(found)
    if bad.any():
        where = tuple(np.argwhere(bad)[0].tolist())
        raise setting_error(_at(name, where), float(found[where]), RANGES[key].words)
    return found


def _at(name: str, where: Sequence[int]) -> str:
    return f"{name}[{', '.join(map(str, where))}]"


def _check_that_it_ends(source: Source) -> None:
    """Refuse shots without surface friction and without a latest time."""
    surface = source.vary.get("friction.surface")
    gravity = source.scene.physics.gravity
    slows = source.scene.deceleration > 0.0 if surface is None else (surface * gravity > 0).all()
    if slows or source.asked.settings.max_time is not None or not source.velocity.any():
        return
    message = "is wanted: without surface friction the balls of these shots never come to rest"
    raise setting_error("max_time", None, message)
