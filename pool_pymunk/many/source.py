"""This module reads many shots: positions, velocities, and what differs from shot to shot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.model import Point, Scene, Shot, State, inputs
from pool_pymunk.model.outline import NEVER_RESTS
from pool_pymunk.model.problems import setting_error
from pool_pymunk.model.state import NO_ROLLING
from pool_pymunk.results.run import Run
from pool_pymunk.solvers import find_shot
from pool_pymunk.solvers.request import Request

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

SIZES = ("mass", "radius")  # what balls have besides their states
NOTHING = -1  # stands for no ball


class Source(NamedTuple):
    """A source has all that is needed to play any of the shots: they are in arrays, in SI.

    ``position`` and ``velocity`` may be views that repeat one start for all shots (S, N, 2).
    ``vary`` has what differs from shot to shot besides: coefficients (S,), and masses and radii
    (S, N). ``roll`` (S, N, 2) is there where balls roll. ``struck`` is the number of a shot's ball.
    The ends are derived ``by`` inputs of these names. A source that ``has_figures`` asks how far
    they may have been moved.
    """

    scene: Scene
    asked: Request
    position: Floats
    velocity: Floats
    vary: Mapping[str, Floats]
    roll: Floats | None = None
    struck: int | None = None
    by: inputs.Names = ()
    has_figures: bool = False

    @property
    def watched(self) -> int:
        """The number of the struck ball, of the cue ball, or of the first ball that moves."""
        return _watched(self.scene, self.velocity) if self.struck is None else self.struck

    def scene_of(self, k: int) -> Scene:
        """Return the scene with the coefficients and masses of shot ``k``."""
        scene = without_shots(self.scene)
        if not self.vary:
            return scene
        values: dict[str, float] = {}
        for key, own in self.vary.items():
            names = [f"{key}.{id_}" for id_ in scene.index] if key in SIZES else [key]
            values |= zip(names, np.atleast_1d(own[k]).tolist(), strict=True)
        if "radius" in self.vary:  # Larger balls may fit only where this shot has them.
            there = np.isfinite(self.position[k]).all(axis=-1)
            for i in np.flatnonzero(there).tolist():
                places = zip("xy", self.position[k, i].tolist(), strict=True)
                values |= {f"{axis}.{scene.balls[i].id}": place for axis, place in places}
        return inputs.with_inputs(scene, values)

    def run(self, k: int, measures_policies: bool = True) -> Run:
        """Play shot ``k`` by the exact solver; raises SceneError if it cannot start."""
        scene, is_off = self.scene_of(k), is_gone(self.position[k])
        settings = self.asked.settings._replace(measures_policies=measures_policies)
        velocity, roll = (
            None if each is None else np.where(is_off[:, np.newaxis], 0.0, each[k]).tolist()
            for each in (self.velocity, self.roll)
        )
        off = {scene.balls[i].id for i in np.flatnonzero(is_off)}
        start = scene.state((self.places(k, is_off).tolist(), velocity, off, roll))
        run = self.asked._replace(scene=scene, settings=settings).play(None, start)
        return run if self.watched < 0 else replace(run, watched=self.scene.balls[self.watched].id)

    def places(self, part: int | slice, is_off: Any) -> Floats:
        """Return positions (..., N, 2) of shots; those of balls off the table are the scene's."""
        places, own = np.array(self.position[part]), [ball.position for ball in self.scene.balls]
        places[is_off] = np.array(own)[np.nonzero(is_off)[-1]]
        return places


def rows_of(points: Floats) -> Floats:
    """Return the rows of points (S, ...); one row stands for all where the shots share it."""
    return points[:1] if points.strides[0] == 0 else points


def without_shots(scene: Scene) -> Scene:
    """Return a scene without its shots, which the scene keeps."""
    known = scene.found.get(without_shots) if scene.shots else scene
    if known is None:
        known = scene.found[without_shots] = replace(scene, shots=())
    assert isinstance(known, Scene)
    return known


def is_gone(position: Floats) -> NDArray[np.bool_]:
    """Tell which balls (...) are off the table: NaN is in their positions (..., 2)."""
    is_nan = np.isnan(position)
    return np.asarray(is_nan[..., 0] | is_nan[..., 1])


def _watched(scene: Scene, velocity: Floats) -> int:
    """Return the number of the cue ball, or of the first ball that moves in the first shot."""
    found = next((i for i, ball in enumerate(scene.balls) if ball.cue), NOTHING)
    if found != NOTHING or not len(velocity):
        return found
    moves = np.flatnonzero(np.nan_to_num(velocity[0]).any(axis=-1))
    return int(moves[0]) if len(moves) else NOTHING


# -- how shots begin -------------------------------------------------------------------------------


class Begun(NamedTuple):
    """These are the positions, velocities (S, N, 2), other inputs and rolls of shots that begin."""

    position: Floats
    velocity: Floats
    vary: dict[str, Floats]
    roll: Floats | None


def opening(scene: Scene, given: Begun, ball: int | None = None, shot: Shot | None = None) -> Begun:
    """Return how shots begin for which this is given.

    Inputs have values (S,) in ``vary``, by their names. Positions and velocities (S, N, 2) that own
    their numbers are changed in place. ``ball`` is the number of the struck ball, by default that
    of the watched one. Without rolls (S, N, 2) each ball has its own share, and the ball of a
    ``shot`` that of the shot. A ``roll`` among the values is the share of the struck ball.
    """
    begun, struck = {"position": given.position, "velocity": given.velocity}, dict[str, Any]()
    vary, carried = dict[str, Floats](), given.roll
    for name, its in given.vary.items():
        kind, whose = inputs.parts(name)
        array, axis = inputs.TABLE[kind].column or ("", 0)
        if array in begun:
            begun[array] = np.require(begun[array], requirements=["O", "W"])  # a copy, once
            begun[array][:, scene.index[whose], axis] = its
        elif array == "struck":
            struck[kind] = its
        else:
            vary[name] = its
    position, velocity = begun.values()
    if struck and ball is None:
        ball = _struck_ball(scene, velocity, struck)
    if struck.keys() - {"roll"}:
        velocity = np.require(velocity, requirements=["O", "W"])
        velocity[:, ball] = inputs.struck(velocity[:, ball], struck)
    if carried is None and shot is not None:
        carried = inputs.rolled(scene, velocity, scene.index[shot.ball], shot.roll)
    share = struck.get("roll")
    roll = inputs.rolled(scene, velocity, None if share is None else ball, share, carried)
    return Begun(position, velocity, vary, roll)


def or_a_shot(scene: Scene) -> str:
    """Say that a scene has shots that could be played."""
    return f", or give shot={scene.shots[0].name!r}" if scene.shots else ""


def _struck_ball(scene: Scene, velocity: Floats, values: Mapping[str, Any]) -> int:
    """Return the number of the watched ball, whose speed, direction or roll is varied."""
    ball, first = _watched(scene, velocity), next(iter(values))
    if ball == NOTHING:
        message = "no ball is struck: there is no cue ball, and none moves"
        raise setting_error("vary", first, message)
    if "speed" not in values and not np.nan_to_num(velocity[:, ball]).any():
        message = f"ball {scene.balls[ball].id} rests: vary its speed, too{or_a_shot(scene)}"
        raise setting_error("vary", first, message)
    return ball


# -- what is asked for -----------------------------------------------------------------------------


def read_source(
    asked: Request, position: Any, velocity: Any, vary: Mapping[str, Any] | None, roll: Any = None
) -> Source:
    """Check the arguments of many shots, and bring them all to one number of shots.

    ``position`` may be a shot, its name or its number, from which all of them begin. Raises
    SettingError, in one line that names the argument.
    """
    scene, struck = asked.scene, None
    first = scene.shots[0] if scene.shots else None
    if isinstance(position, Shot | str | Integral):
        refuse_given("the shot has its own", velocity=velocity, roll=roll)
        first = find_shot(scene, position)  # type: ignore[arg-type]
        assert first is not None, "it raises for a shot that is not there"
        struck, state = scene.index[first.ball], asked.start(first)
        position, velocity, roll = arrays_of(scene, state)
        vary = {**({} if roll is None else {"roll": [first.roll]}), **(vary or {})}
    own = [ball.velocity for ball in scene.balls]
    given = {
        "position": _points("position", position, [ball.position for ball in scene.balls]),
        "velocity": _points("velocity", velocity, own),
    }
    if roll is not None:
        if not scene.surface.rolls:
            raise setting_error("roll", f"shape {np.shape(roll)}", NO_ROLLING)
        given["roll"] = _points("roll", roll, own)
    varied = {key: _values(key, values, scene) for key, values in (vary or {}).items()}
    counts = {key: len(values) for key, values in given.items()}
    counts |= {f"vary[{key!r}]": len(values) for key, values in varied.items()}
    count = max(counts.values()) if all(counts.values()) else 0
    for key, its in counts.items():
        if its not in (1, count):
            raise setting_error(key, f"{its} shots", f"must be for 1 shot or for {count}")
    _check_numbers(given)
    given, varied = (
        {key: np.broadcast_to(each, (count, *each.shape[1:])) for key, each in some.items()}
        for some in (given, varied)
    )
    begun = Begun(given["position"], given["velocity"], varied, given.get("roll"))
    places, velocities, others, rolls = opening(scene, begun, struck, first)
    source = Source(scene, asked, places, velocities, _of_balls(scene, others), rolls, struck)
    _check_that_it_ends(source)
    return source


def refuse_given(message: str, **arguments: Any) -> None:
    """Raise SettingError for the first of these arguments that is given."""
    for name, value in arguments.items():
        if value is not None:
            raise setting_error(name, f"shape {np.shape(value)}", f"leave it out: {message}")


def arrays_of(scene: Scene, state: State) -> tuple[Floats, Floats, Floats | None]:
    """Return the positions, velocities and rolls (N, 2) of a state; NaN for balls off the table."""
    position, velocity = np.array(state.position), np.array(state.velocity)
    position[[scene.index[id_] for id_ in state.off]] = np.nan
    return position, velocity, None if state.roll is None else np.array(state.roll)


def _of_balls(scene: Scene, vary: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return what differs; masses and radii are those of all balls (S, N)."""
    found: dict[str, Floats] = {}
    for name, values in vary.items():
        kind, whose = inputs.parts(name)
        if kind in SIZES:
            own = [getattr(ball, kind) for ball in scene.balls]
            of_balls = found.setdefault(kind, np.tile(np.array(own), (len(values), 1)))
            ball = scene.index[whose] if whose else slice(None)
            of_balls[:, ball] = values if values.ndim == 2 or whose else values[:, np.newaxis]
        else:
            found[name] = values
    return found


def _points(key: str, value: Any, own: Sequence[Point]) -> Floats:
    """Read points (S, N, 2), or (N, 2) for all shots; by default they are the scene's own."""
    wanted = f"(S, {len(own)}, 2), or ({len(own)}, 2) for all shots"
    return _array(key, own if value is None else value, [(len(own), 2)], wanted)


def _check_numbers(given: Mapping[str, Floats]) -> None:
    """Refuse points (S, N, 2) that are infinite, and NaN for a ball that is on the table."""
    wanted = "must be two finite numbers"
    for key, points in given.items():
        its = rows_of(points)
        if np.isfinite(its).all():
            continue
        _refuse(key, np.isinf(its), "inf", wanted)
        if key != "position":
            _refuse(key, is_gone(its) & ~is_gone(rows_of(given["position"])), "no number", wanted)


def _values(key: str, value: Any, scene: Scene) -> Floats:
    """Read what differs from shot to shot: (S,), or for the masses of all balls (S, N) as well."""
    name, balls = f"vary[{key!r}]", len(scene.balls)
    if key == "mass":
        row, shapes, wanted = inputs.TABLE[key], [(), (balls,)], f"(S,) or (S, {balls})"
    else:
        row, shapes, wanted = inputs.row_of("vary", key, scene, ["mass"])[0], [()], "(S,)"
    found = _array(name, value, shapes, wanted)
    bad = row.bad(found)
    _refuse(name, bad, next(iter(found[bad].tolist()), None), row.limits)
    return found


def _array(name: str, value: Any, shapes: Sequence[tuple[int, ...]], wanted: str) -> Floats:
    """Read numbers of one of these shapes for each shot, or of the first shape for all shots."""
    try:
        found = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise setting_error(name, type(value).__name__, "must be numbers in an array") from None
    if found.shape == shapes[0]:
        found = found[np.newaxis]
    if found.shape[1:] not in shapes:
        shape = f"({', '.join(map(str, found.shape))})"
        raise setting_error(name, f"shape {shape}", f"must have the shape {wanted}")
    return found


def _refuse(name: str, bad: Any, value: object, message: str) -> None:
    """Raise an error that names the first bad number, if there is one."""
    if np.any(bad):
        raise setting_error(f"{name}{np.argwhere(bad)[0, :2].tolist()}", value, message)


def _check_that_it_ends(source: Source) -> None:
    """Refuse shots that no friction brings to rest, and that have no latest time."""
    scene, kind = source.scene, "surface" if source.roll is None else "rolling"
    least = source.vary.get(f"friction.{kind}", np.array(getattr(scene.friction, kind)))
    its = [getattr(patch, kind) for patch in scene.patches]
    if (least * scene.physics.gravity > 0.0).all() and 0.0 not in its:
        return
    moves = source.velocity.any() or (source.roll is not None and source.roll.any())
    if source.asked.settings.max_time is None and (moves or scene.is_tilted):
        message = f"is missing: without {kind} friction the balls of these shots never come to rest"
        message = f"is missing: {NEVER_RESTS}" if scene.is_tilted else message
        raise setting_error("max_time", None, message)
