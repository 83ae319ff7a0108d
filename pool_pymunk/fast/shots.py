"""This module reads many shots: positions, velocities, and what differs from shot to shot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.fast.records import NOTHING, Shots
from pool_pymunk.fast.tables import coefficients_of, cue_of
from pool_pymunk.model import Scene, State
from pool_pymunk.model.inputs import TABLE, column_of, parts, row_of, struck, with_inputs
from pool_pymunk.model.problems import setting_error
from pool_pymunk.physics.laws import Law
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import request
from pool_pymunk.solvers.registry import yardstick
from pool_pymunk.solvers.request import Request

Floats = NDArray[np.float64]

SIZES = ("mass", "radius")  # what balls have besides their states
COLUMNS = column_of("coefficients")  # of the coefficients of the compiled shots


class Source(NamedTuple):
    """A source has all that is needed to play any of the shots: they are in arrays, in SI.

    ``position`` and ``velocity`` may be views that repeat one start for all shots (S, N, 2).
    ``vary`` has what differs from shot to shot besides: coefficients (S,), and masses and radii
    (S, N).
    """

    scene: Scene
    asked: Request
    position: Floats
    velocity: Floats
    vary: Mapping[str, Floats]

    @property
    def watched(self) -> int:
        """The number of the cue ball, or of the first ball that moves in the first shot."""
        return _watched(self.scene, self.velocity)

    @property
    def law(self) -> Law:
        """The law of every contact."""
        return self.asked.settings.law_of(self.scene)

    def scene_of(self, k: int) -> Scene:
        """Return the scene with the coefficients and masses of shot ``k``."""
        scene = replace(self.scene, shots=())
        sizes = {key: self.vary[key][k].tolist() for key in SIZES if key in self.vary}
        values = {key: float(self.vary[key][k]) for key in self.vary.keys() - sizes.keys()}
        if "radius" in sizes:  # Larger balls may fit at their places of this shot alone.
            there = np.isfinite(self.position[k]).all(axis=-1)
            for i in np.flatnonzero(there).tolist():
                places = zip("xy", self.position[k, i].tolist(), strict=True)
                values |= {f"{axis}.{scene.balls[i].id}": place for axis, place in places}
        for key, of_balls in sizes.items():
            values |= {f"{key}.{id_}": v for id_, v in zip(scene.index, of_balls, strict=True)}
        return with_inputs(scene, values)

    def state_of(self, k: int) -> State:
        """Return the state that shot ``k`` starts from; NaN means off the table."""
        is_off = is_gone(self.position[k])
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
        position, velocity = _own(self.position[part]), _own(self.velocity[part])
        is_off = is_gone(position)
        position[is_off] = np.array([ball.position for ball in self.scene.balls])[
            np.nonzero(is_off)[1]
        ]
        count = len(position)
        mass = _own(np.broadcast_to([ball.mass for ball in self.scene.balls], is_off.shape))
        coefficients = _own(np.broadcast_to(coefficients_of(self.scene), (count, 6)))
        for key, values in self.vary.items():
            some = values[part]
            if key == "mass":
                mass[:] = some
            elif key == "friction.surface":
                coefficients[:, COLUMNS[key]] = some * self.scene.physics.gravity
            else:
                coefficients[:, COLUMNS[key]] = some
        if "restitution.cue_ball" not in self.vary and self.scene.restitution.cue_ball is None:
            coefficients[:, 1] = coefficients[:, 0]  # The cue ball is as any other.
        radius = np.array([ball.radius for ball in self.scene.balls])
        return Shots(position, velocity, is_off.astype(np.int64), mass, radius, coefficients)


def is_gone(position: Floats) -> NDArray[np.bool_]:
    """Tell which balls (...) are off the table: NaN is in their positions (..., 2)."""
    return np.asarray(np.isnan(position[..., 0]) | np.isnan(position[..., 1]))


def _own(array: NDArray[Any]) -> Floats:
    """Return a copy that lies in rows: numba compiles anew for another layout."""
    return np.array(array, order="C")


def _watched(scene: Scene, velocity: Floats) -> int:
    """Return the number of the cue ball, or of the first ball that moves in the first shot."""
    found = cue_of(scene)
    if found != NOTHING or not len(velocity):
        return found
    moves = np.flatnonzero(np.nan_to_num(velocity[0]).any(axis=-1))
    return int(moves[0]) if len(moves) else NOTHING


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
    varied = {key: _values(key, values, scene) for key, values in (vary or {}).items()}
    counts = {"position": len(places), "velocity": len(speeds)} | {
        f"vary[{key!r}]": len(values) for key, values in varied.items()
    }
    count = max(counts.values()) if all(counts.values()) else 0
    for key, own in counts.items():
        if own not in (1, count):
            raise setting_error(key, f"{own} shots", f"must be for 1 shot or for {count}")
    lost = is_gone(speeds) & ~is_gone(places)
    if lost.any():
        where = tuple(np.argwhere(lost)[0].tolist())
        raise setting_error(_at("velocity", where), "no number", "must be two finite numbers")
    places = np.broadcast_to(places, (count, *places.shape[1:]))
    speeds = np.broadcast_to(speeds, (count, *speeds.shape[1:]))
    varied = {key: np.broadcast_to(v, (count, *v.shape[1:])) for key, v in varied.items()}
    source = Source(asked.scene, asked, *_begun(asked.scene, places, speeds, varied))
    _check_that_it_ends(source)
    return source


def _begun(
    scene: Scene, places: Floats, speeds: Floats, varied: Mapping[str, Floats]
) -> tuple[Floats, Floats, dict[str, Floats]]:
    """Return positions, velocities, and what else differs, all as the shots begin."""
    begun = {"position": places, "velocity": speeds}
    rest, shot = dict[str, Floats](), dict[str, Floats]()
    for key, values in varied.items():
        kind, whose = parts(key)
        array, place = TABLE[kind].column or (kind, 0)
        if array in begun:
            if begun[array].base is not None or not begun[array].flags.writeable:
                begun[array] = begun[array].copy()
            begun[array][:, scene.index[whose], place] = values
        elif array == "struck":
            shot[kind] = values
        elif kind in SIZES:
            own = np.array([getattr(ball, kind) for ball in scene.balls])
            of_balls = rest.setdefault(kind, np.tile(own, (len(places), 1)))
            ball = scene.index[whose] if whose else slice(None)
            of_balls[:, ball] = values if values.ndim == 2 or whose else values[:, np.newaxis]
        else:
            rest[key] = values
    if shot:
        begun["velocity"] = _struck(scene, begun["velocity"], shot)
    return begun["position"], begun["velocity"], rest


def _struck(scene: Scene, velocity: Floats, shot: Mapping[str, Floats]) -> Floats:
    """Return velocities (S, N, 2) with another speed or direction of the cue ball.

    Where the scene has no cue ball, it is that of the first ball that moves in the first shot.
    """
    ball, first = _watched(scene, velocity), next(iter(shot))
    if ball == NOTHING:
        raise setting_error(
            "vary", first, "no ball is struck: there is no cue ball, and none moves"
        )
    if "speed" not in shot and not np.nan_to_num(velocity[:, ball]).any():
        raise setting_error(
            "vary", first, f"ball {scene.balls[ball].id} rests: vary its speed, too"
        )
    velocity = velocity.copy()
    velocity[:, ball] = struck(velocity[:, ball], shot)
    return velocity


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


def _values(key: str, value: Any, scene: Scene) -> Floats:
    """Read what differs from shot to shot: (S,), or for the masses of all balls (S, N) as well."""
    name, balls = f"vary[{key!r}]", len(scene.balls)
    row = TABLE["mass"] if key == "mass" else row_of("vary", key, scene, ["mass"])[0]
    try:
        found = np.atleast_1d(np.asarray(value, dtype=float))
    except (TypeError, ValueError):
        raise setting_error(name, type(value).__name__, "must be numbers in an array") from None
    if found.ndim > 1 and not (key == "mass" and found.shape[1:] == (balls,)):
        shape = f"({', '.join(map(str, found.shape))})"
        wanted = f"(S,) or (S, {balls})" if key == "mass" else "(S,)"
        raise setting_error(name, f"shape {shape}", f"must have the shape {wanted}")
    bad = row.bad(found)
    if bad.any():
        where = tuple(np.argwhere(bad)[0].tolist())
        raise setting_error(_at(name, where), float(found[where]), row.limits)
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
    message = "is missing: without surface friction the balls of these shots never come to rest"
    raise setting_error("max_time", None, message)
