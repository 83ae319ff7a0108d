"""This module varies the inputs of a scene, at random or on a grid, and plays the shots.

An input has one random number from 0 to 1 for each shot, and its distribution says which error or
value that number stands for. The number depends on the seed, the input's name and the shot's number
alone: each seed and input have a stream of their own (Philox, a counter-based generator: Salmon et
al., SC 2011). So it is the same in every study, whatever else is varied, and on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.laws import Law
from pool_pymunk.many import Batch, simulate_many
from pool_pymunk.many.source import Begun, arrays_of, opening
from pool_pymunk.model import NEAREST, Scene, Shot, State
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.inputs import ROWS, SHOT, TABLE, Input, input_value, names_in, parts, row_of
from pool_pymunk.model.plain import argument, between, whole
from pool_pymunk.model.problems import setting_error
from pool_pymunk.solvers import find_shot, request

A_BLOCK = 4  # numbers that a step of Philox makes
LEAST = 2.0**-54  # half of the smallest random number above 0
# The number of the first shot may be left out.
FIRST = {f"{row.name}.1": row.name for row in ROWS if row.of == SHOT}
# These are a player's errors, which add to the speed and to the angle or turn of the struck ball.
NOISE = ("noise.speed", "noise.angle")
OF_SHOT = {*FIRST.values(), *NOISE}


@dataclass(frozen=True)
class Normal:
    """These are normal errors of the scene's own number, with a standard deviation."""

    deviation: float

    def at(self, shares: Array) -> Array:
        """Return the errors below which these shares of all lie.

        >>> Normal(2.0).at(np.array([0.5, 0.975])).round(2).tolist()
        [0.0, 3.92]
        """
        shares = np.maximum(shares, LEAST)
        found = map(NormalDist().inv_cdf, shares.tolist())
        return self.deviation * np.fromiter(found, float, len(shares))


@dataclass(frozen=True)
class Uniform:
    """These are errors of the scene's own number within a half-width, all equally likely."""

    half_width: float

    def at(self, shares: Array) -> Array:
        """Return the errors below which these shares of all lie."""
        return self.half_width * (2.0 * shares - 1.0)


@dataclass(frozen=True)
class Between:
    """These are values from ``low`` to ``high``, all equally likely."""

    low: float
    high: float

    def at(self, shares: Array) -> Array:
        """Return the values below which these shares of all lie."""
        return self.low + (self.high - self.low) * shares


@dataclass(frozen=True)
class Grid:
    """These are ``count`` values at equal distances, from ``low`` to ``high``."""

    low: float
    high: float
    count: int


Distribution = Normal | Uniform | Between | Grid
Numbers = range | NDArray[np.int_]  # of shots


def uniforms(seed: int, name: str, shots: range) -> Array:
    """Return the numbers (S,) in [0, 1) that an input has in these shots.

    >>> bool((uniforms(7, "x.8", range(9))[5:] == uniforms(7, "x.8", range(5, 9))).all())
    True
    """
    own = np.random.SeedSequence(seed, spawn_key=tuple(FIRST.get(name, name).encode()))
    source, (blocks, rest) = np.random.Philox(own), divmod(shots.start, A_BLOCK)
    source.advance(blocks)
    return np.random.Generator(source).random(rest + len(shots))[rest:]


def numbers(
    inputs: Mapping[str, Distribution], shots: Numbers | int, seed: int = 0
) -> dict[str, Array]:
    """Return the errors or values (S,) of inputs in these shots, by their names.

    Shots of a grid alone may have any numbers (S,).

    All points of several grids follow each other; the values of the last one change fastest.

    >>> both = numbers({"speed": Grid(1.0, 2.0, 2), "turn": Grid(0.0, 9.0, 2)}, 4)
    >>> [values.tolist() for values in both.values()]
    [[1.0, 1.0, 2.0, 2.0], [0.0, 9.0, 0.0, 9.0]]
    """
    if not isinstance(shots, range | np.ndarray):
        shots = range(argument("shots", shots, whole(0)))
    seed = argument("seed", seed, whole(0))
    found, inner = dict[str, Array](), points(inputs.values())
    for name, its in inputs.items():
        if isinstance(its, Grid):
            inner //= its.count
            point = np.asarray(shots) // inner % its.count
            found[name] = np.linspace(its.low, its.high, its.count)[point]
        else:
            assert isinstance(shots, range), "what is drawn is drawn for shots in a row"
            found[name] = its.at(uniforms(seed, name, shots))
    return found


def points(its: Iterable[Distribution]) -> int:
    """Return the number of points of all grids."""
    return math.prod(each.count for each in its if isinstance(each, Grid))


@dataclass(frozen=True)
class Variation:
    """A variation has a distribution for each input of a scene that varies, by its name.

    The names are those of the table of inputs (:mod:`pool_pymunk.model.inputs`). A ``Normal`` or
    ``Uniform`` has errors of the scene's own number, a ``Between`` or ``Grid`` has values; all are
    in SI, angles in degrees. ``shot`` is chosen as in :func:`~pool_pymunk.simulate`; its speed,
    direction and roll are those that ``speed``, ``angle``, ``turn`` and ``roll`` vary. ``law`` is
    that of every contact, also of a shot from which it goes on. A shot that aims at a ball is aimed
    once, in the scene as it is, unless it ``aims_anew`` wherever the balls are. A ``state`` at the
    moment of the shot may be given; then the shot may be another than the scene's. Raises
    SettingError, in one line that names the input.

    >>> from pool_pymunk import load, simulate_many
    >>> scene = load("report")
    >>> errors = Variation(scene, {"speed": Normal(0.05), "x.8": Uniform(0.001)}, 1)
    >>> simulate_many(scene, shot=1, vary=errors.draw(100, seed=3)).final.shape
    (100, 11, 2)
    """

    scene: Scene
    inputs: Mapping[str, Distribution]
    shot: Shot | str | int | None = None
    law: str | Law | None = None
    aims_anew: bool = False
    state: State | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.inputs, Mapping):
            raise setting_error("inputs", self.inputs, "must be distributions by names of inputs")
        for name, each in self.inputs.items():
            check(self.scene, "inputs", name, each)

    def draw(self, shots: range | int, seed: int = 0) -> dict[str, Array]:
        """Return the values (S,) of all inputs, by their names, as ``simulate_many`` takes them.

        ``shots`` are their number or, to go on with others, a range. A value that an input may not
        have becomes the nearest one that it may have.

        >>> from pool_pymunk import load
        >>> both = Variation(load("report"), {"angle": Grid(0.0, 90.0, 2), "mass.C": Uniform(0.01)})
        >>> [values.round(3).tolist() for values in both.draw(2).values()]
        [[0.0, 90.0], [0.21, 0.205]]
        """
        found = numbers(self.inputs, shots, seed)
        width = (name for name, its in self.inputs.items() if isinstance(its, Normal | Uniform))
        return found | {name: self.erring(name, found[name]) for name in width}

    def erring(self, name: str, errors: Array, around: Any = None) -> Array:
        """Return the values (S,) of an input that has these errors, none beyond its limits.

        They are ``around`` the scene's own number, or around others.
        """
        own = self.own(name) if around is None else around
        return TABLE[parts(name)[0]].clipped(own + errors)

    def places(self, shots: int) -> Array:
        """Return where the balls are as so many shots begin (S, N, 2); NaN is off the table."""
        return np.tile(arrays_of(self.scene, self.start)[0], (shots, 1, 1))

    def begin(
        self, position: Array, values: Mapping[str, Any], velocity: Any = None, carried: Any = None
    ) -> Begun:
        """Return how shots begin whose balls are at these places (S, N, 2), which it may change.

        Inputs have ``values`` (S,) by their names, and a player has errors, by ``NOISE``. The balls
        have the ``velocity`` and the rolls ``carried`` (S, N, 2) of the state, or others.
        """
        scene, ball, shot = self.scene, self.ball, self.struck
        if velocity is None:
            velocity = np.tile(np.array(self.start.velocity), (len(position), 1, 1))
        if carried is None and shot is not None and shot.from_previous:
            carried = self.start.roll
        its: dict[str, Any] = {"roll": self.roll}
        its |= {name: each for name, each in values.items() if name in OF_SHOT}
        others = {name: each for name, each in values.items() if name not in OF_SHOT}
        position, velocity, vary, _ = opening(scene, Begun(position, velocity, others, None))
        if self.aims_anew and shot is not None and shot.aim is not None:
            velocity[:, ball] = launched(scene, shot, position)
        if its.keys() - {"roll"}:
            faster, turned = (its.pop(key, 0.0) for key in NOISE)
            speed = its["speed"] if "speed" in its else np.hypot(*velocity[:, ball].T)
            direction = "angle" if "angle" in its else "turn"
            its |= {"speed": np.maximum(speed + faster, 0.0)}
            its[direction] = its.get(direction, 0.0) + turned
        return opening(scene, Begun(position, velocity, vary | its, carried), ball)

    def play(self, begun: Begun, **how: Any) -> Batch:
        """Play shots; ``how`` has other arguments of ``simulate_many``."""
        position, velocity, vary, roll = begun
        how = {"law": self.law, **how}
        return simulate_many(self.scene, position, velocity, vary=vary, roll=roll, **how)

    @cached_property
    def struck(self) -> Shot | None:
        """The shot that is played."""
        if self.state is not None and isinstance(self.shot, Shot):
            return self.shot
        return find_shot(self.scene, self.shot)

    @cached_property
    def start(self) -> State:
        """The state at the moment of the shot, which may be the end of another shot."""
        return self.state or request(self.scene, law=self.law).start(self.struck)

    @cached_property
    def ball(self) -> int:
        """The number of the struck ball; without a shot that of the first ball that moves."""
        if self.struck is not None:
            return self.scene.index[self.struck.ball]
        return next((i for i, v in enumerate(self.start.velocity) if v != (0.0, 0.0)), 0)

    @property
    def roll(self) -> float:
        """The roll of the struck ball, as a share of its velocity."""
        return (self.struck or self.scene.balls[self.ball]).roll

    def own(self, name: str) -> float:
        """Return the scene's own number of an input, as the shot begins."""
        kind, whose = parts(name)
        array, axis = TABLE[kind].column or ("", 0)
        if array in ("position", "velocity"):
            return float(getattr(self.start, array)[self.scene.index[whose]][axis])
        if array == "struck":
            vx, vy = self.start.velocity[self.ball]
            angle = math.degrees(math.atan2(vy, vx))
            return {"speed": math.hypot(vx, vy), "angle": angle, "roll": self.roll}.get(kind, 0.0)
        return input_value(self.scene, name)


def check(scene: Scene, key: str, name: str, its: object) -> None:
    """Raise SettingError, which names the argument ``key``, for an input that cannot be varied."""
    (row, _), where = row_of(key, name, scene), f"{key}[{name!r}]"
    if isinstance(its, Normal | Uniform):
        (width,) = vars(its).values()
        argument(where, width, between(0.0))
        if row.of == SHOT:
            return
        if name not in names_in(scene).get(row.group, []):
            raise setting_error(key, name, "the scene leaves it out")
        low, high = ends = input_value(scene, name) + width * np.array([-1.0, 1.0])
        if isinstance(its, Uniform) and row.bad(ends).any():
            said = f"the range {low:g} to {high:g} goes too far: it {row.limits}"
            raise setting_error(key, name, said)
    elif isinstance(its, Between | Grid):
        read_range(where, (its.low, its.high), row)
        argument(where, getattr(its, "count", 1), whole(1))
    else:
        raise setting_error(where, its, "must be a Normal, Uniform, Between or Grid")


def read_range(where: str, value: Any, row: Input) -> tuple[float, float]:
    """Read the lowest and the highest value of an input; SettingError names ``where``."""
    if len(ends := np.ravel(value)) != 2:
        raise setting_error(where, str(value), "must be a range (low, high)")
    low, high = (argument(where, each, between(row.low)) for each in ends)
    if not low <= high <= row.high or (row.size and low == 0.0):
        limit = " <= 1" if row.high == 1.0 else ""
        raise setting_error(where, str(value), f"must be {row.low:g} <= low <= high{limit}")
    return low, high


def offsets(scene: Scene, errors: Mapping[str, Array]) -> Array:
    """Return how far (S, N, 2) the balls are moved, in m, by the errors (S,) of their places."""
    moves = [errors[name] for name in names_in(scene)["position"]]
    return np.stack(moves, axis=-1).reshape(-1, len(scene.balls), 2)


def launched(scene: Scene, shot: Shot, position: Array) -> Array:
    """Return the velocity (S, 2) of a shot that aims at a ball at starts (S, N, 2), NaN if off."""
    assert shot.aim is not None and shot.speed is not None
    ball = scene.index[shot.ball]
    offset = position - position[:, ball : ball + 1]
    if shot.aim == NEAREST:
        away = np.nan_to_num(np.hypot(offset[..., 0], offset[..., 1]), nan=np.inf)
        away[:, ball] = np.inf
        dx, dy = offset[np.arange(len(position)), away.argmin(axis=1)].T
    else:
        dx, dy = offset[:, scene.index[shot.aim]].T
    angles = list(map(math.atan2, dy.tolist(), dx.tolist()))  # the same bits as in Scene.start
    return np.array([(math.cos(a) * shot.speed, math.sin(a) * shot.speed) for a in angles])
