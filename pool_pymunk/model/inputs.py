"""This module has the table of inputs: all numbers of a scene that a study may vary.

An input's name is that of its row in ``TABLE``, followed by the id of its ball (``"mass.C"``), or
by the number of its shot where several are played (``"speed.2"``). All studies read this table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pool_pymunk.core.motion.path import NOISE
from pool_pymunk.model.arrays import Array
from pool_pymunk.model.outline import NO_FRICTION
from pool_pymunk.model.parts import Ball, Shot
from pool_pymunk.model.problems import Point, listed, no_such_ball, setting_error, suggestion
from pool_pymunk.model.quantities import Units
from pool_pymunk.model.scene import Scene
from pool_pymunk.model.state import NO_ROLLING

Names = tuple[str, ...]

BALL, SHOT, SCENE = "ball", "shot", "scene"
SI = {"length": "m", "mass": "kg", "speed": "m/s", "angle": "degrees", "": ""}


@dataclass(frozen=True)
class Input:
    """A row of the table is one kind of input of a ball, a shot or the whole scene.

    ``name`` is the name, or its first part. ``quantity`` is what it measures: a length, mass,
    speed or angle (degrees), or nothing. ``read`` takes it from a Ball or Shot, or from the
    restitution or friction of a scene; ``put`` returns that object with another value. Values lie
    between ``low`` and ``high``, and above ``low`` if it is a ``size``. ``start`` takes the ball's
    velocity (vx, vy) at the start, numbers or arrays, and returns the derivatives (4,) of position
    and velocity there with respect to the input; it is None if these do not depend on the input.
    ``column`` is the array of a batch that has the input, and the place in it.
    """

    name: str
    group: str
    of: str
    quantity: str
    about: str
    read: Callable[[Any], float]
    put: Callable[[Any, float], Any]
    low: float = -math.inf
    high: float = math.inf
    size: bool = False
    start: Callable[[Any, Any], tuple[Any, ...]] | None = None
    column: tuple[str, int] | None = None

    @property
    def limits(self) -> str:
        """Say which values are allowed."""
        if self.high < math.inf:
            return f"must be between {self.low:g} and {self.high:g}"
        if self.low == -math.inf:
            return "must be a finite number"
        return f"must be {'greater than 0' if self.size else '0 or more'}, and finite"

    def bad(self, values: Array) -> NDArray[np.bool_]:
        """Tell which values are not allowed."""
        above = values > self.low if self.size else values >= self.low
        return ~(above & (values <= self.high) & np.isfinite(values))

    def clipped(self, values: Array) -> Array:
        """Return values with those that are not allowed moved to the limits."""
        low = np.nextafter(self.low, math.inf) if self.size else self.low
        return np.clip(values, low, self.high)


def _along(row: int, name: str, field: str, quantity: str, about: str) -> Input:
    axis, start = row % 2, tuple(np.eye(4)[row].tolist())

    def put(ball: Ball, value: float) -> Ball:
        x, y = getattr(ball, field)
        changed: dict[str, Any] = {field: (x, value) if axis else (value, y)}
        return replace(ball, **changed)

    return Input(
        name, field, BALL, quantity, about, lambda ball: float(getattr(ball, field)[axis]), put,
        start=lambda vx, vy: start, column=(field, axis),
    )  # fmt: skip


def _number(
    name: str, about: str, column: tuple[str, int] | None = None, *,
    of: str = SCENE, quantity: str = "", low: float = 0.0, **more: Any,
) -> Input:  # fmt: skip
    *group, key = name.split(".")
    return Input(
        name, (group or [key])[0], of, quantity, about, lambda part: float(getattr(part, key)),
        lambda part, value: replace(part, **{key: value}), low, column=column, **more,
    )  # fmt: skip


def _polar(shot: Shot) -> Point:
    """Return the speed (m/s) and the angle (degrees) of a shot."""
    vx, vy = shot.velocity or (0.0, 0.0)
    speed = math.hypot(vx, vy) if shot.speed is None else shot.speed
    return speed, math.degrees(math.atan2(vy, vx)) if shot.angle is None else shot.angle


def _with_speed(shot: Shot, value: float) -> Shot:
    if shot.velocity is None:
        return replace(shot, speed=value)
    (vx, vy), speed = shot.velocity, _polar(shot)[0]
    velocity = (value / speed * vx, value / speed * vy) if speed else (value, 0.0)
    return replace(shot, velocity=velocity)


def _with_angle(shot: Shot, value: float) -> Shot:
    if shot.velocity is None:
        return replace(shot, angle=value)
    angle, speed = math.radians(value), _polar(shot)[0]
    return replace(shot, velocity=(math.cos(angle) * speed, math.sin(angle) * speed))


def _faster(vx: Any, vy: Any) -> tuple[Any, ...]:
    speed = np.hypot(vx, vy)
    unit = np.where(speed > 0.0, speed, 1.0)  # For a ball at rest both are 0.
    return 0.0, 0.0, vx / unit, vy / unit


def _turned(vx: Any, vy: Any) -> tuple[Any, ...]:
    return 0.0, 0.0, np.radians(-vy), np.radians(vx)


ROWS = (
    _along(0, "x", "position", "length", "x of a ball's start"),
    _along(1, "y", "position", "length", "y of a ball's start"),
    _along(2, "vx", "velocity", "speed", "its velocity along x"),
    _along(3, "vy", "velocity", "speed", "its velocity along y"),
    _number("mass", "a ball's mass", ("mass", 0), of=BALL, quantity="mass", size=True),
    _number("radius", "a ball's radius", of=BALL, quantity="length", size=True),
    _number("restitution.ball_ball", "of hits of two balls", ("coefficients", 0), high=1.0),
    _number("restitution.cue_ball", "of hits of the cue ball", ("coefficients", 1), high=1.0),
    _number("restitution.cushion", "of hits on cushions", ("coefficients", 2), high=1.0),
    _number("friction.surface", "of balls on the table", ("coefficients", 3)),
    _number("friction.rolling", "of balls that roll", ("coefficients", 6)),
    _number("friction.ball_ball", "of hits of two balls", ("coefficients", 5)),
    _number("friction.cushion", "of hits on cushions", ("coefficients", 4)),
    Input("speed", "speed", SHOT, "speed", "the shot's speed", lambda shot: _polar(shot)[0],
          _with_speed, 0.0, start=_faster, column=("struck", 0)),
    Input("angle", "angle", SHOT, "angle", "its direction, from +x to +y",
          lambda shot: _polar(shot)[1], _with_angle, start=_turned, column=("struck", 1)),
    Input("turn", "turn", SHOT, "angle", "its direction, relative to the shot's",
          lambda shot: 0.0, lambda shot, value: _with_angle(shot, _polar(shot)[1] + value),
          start=_turned, column=("struck", 2)),
    _number("roll", "its roll, as a share of its velocity", ("struck", 3), of=SHOT, low=-math.inf,
            start=lambda vx, vy: (0.0,) * 4),
)  # fmt: skip
TABLE = {row.name: row for row in ROWS}


def column_of(array: str) -> dict[str, int]:
    """Return the inputs of one array of a batch, each with its place there.

    >>> column_of("position")
    {'x': 0, 'y': 1}
    """
    found = {row.name: row.column[1] for row in ROWS if row.column and row.column[0] == array}
    return dict(sorted(found.items(), key=lambda one: one[1]))


def parts(name: str) -> tuple[str, str]:
    """Return the row of a name, and the ball or shot behind it.

    >>> parts("mass.C"), parts("friction.surface"), parts("speed")
    (('mass', 'C'), ('friction.surface', ''), ('speed', ''))
    """
    if name in TABLE:
        return name, ""
    kind, _, whose = name.partition(".")
    return kind, whose


# -- which inputs there are ------------------------------------------------------------------------


def names_in(scene: Scene, shots: Iterable[str] = ("",)) -> dict[str, list[str]]:
    """Return the inputs of a scene, group by group.

    ``shots`` are the numbers that follow the names of a shot's inputs; ("",) if there is one shot.

    >>> from pool_pymunk import load
    >>> names_in(load("two-balls"), ["1"])["position"]
    ['x.A', 'y.A', 'x.B', 'y.B']
    """
    found: dict[str, list[str]] = {}
    owners = {BALL: [ball.id for ball in scene.balls], SHOT: list(shots), SCENE: [""]}
    for group in dict.fromkeys(row.group for row in ROWS):
        rows = [row for row in ROWS if row.group == group and _has(scene, row)]
        names = [_name(row, whose) for whose in owners[rows[0].of] for row in rows] if rows else []
        found |= {group: names} if names else {}
    return found


def derivable(scene: Scene, is_struck: bool) -> dict[str, list[str]]:
    """Return derivatives' inputs by group, and all as "all"; a shot's only if ``is_struck``."""
    groups = names_in(scene, [""] if is_struck else [])
    groups["all"] = [name for names in groups.values() for name in names if name != "turn"]
    return groups


def _name(row: Input, whose: str) -> str:
    return f"{row.name}.{whose}" if whose else row.name


def _has(scene: Scene, row: Input) -> bool:
    """Tell whether a scene has this number: it may leave out restitutions and friction.rolling."""
    if row.name == "roll":
        return scene.friction.rolling is not None
    return row.of != SCENE or getattr(getattr(scene, row.group), row.name.split(".")[1]) is not None


def chosen(key: str, asked: object, groups: Mapping[str, list[str]], also: Iterable[str] = ()
           ) -> Names:  # fmt: skip
    """Return the names that an argument asks for, each once; a group stands for its names.

    It may ask for names in ``also``, too. Raises SettingError for other names.

    >>> chosen("wrt", "speed", {"speed": ["speed.1", "speed.2"]})
    ('speed.1', 'speed.2')
    """
    known = list(dict.fromkeys([*(name for names in groups.values() for name in names), *also]))
    if not isinstance(asked, str | bytes) and not isinstance(asked, Iterable):
        raise setting_error(key, asked, f"must be names, such as {', '.join(groups)}")
    found: dict[str, None] = {}
    for name in [asked] if isinstance(asked, str | bytes) else asked:
        if not isinstance(name, str) or not (name in known or name in groups):
            meant = suggestion(name, [*groups, *known]) if isinstance(name, str) else ""
            message = f"there is no such input (there are: {listed(known)}){meant}"
            raise setting_error(key, name, message)
        found |= dict.fromkeys(groups.get(name, [name]))
    return tuple(found)


def row_of(
    key: str, name: object, scene: Scene, also: Iterable[str] = (), shot: Shot | None = None
) -> tuple[Input, str]:
    """Return the row and the ball ("": none) of an input of one shot.

    Raises SettingError for another name, and lists the names in ``also``, too. Raises it also for
    the velocity of the ball of a ``shot``, because the shot gives that velocity.
    """
    kind, whose = parts(name) if isinstance(name, str) else ("", "")
    row = TABLE.get(kind)
    if row is None or (row.of == BALL) != bool(whose):
        known = [*also, *(name for names in names_in(scene).values() for name in names)]
        every = [*also, *(_name(each, "ID" * (each.of == BALL)) for each in ROWS)]
        message = f"there is no such key (there are: {', '.join(every)}){suggestion(name, known)}"
        raise setting_error(key, name, message)
    if whose and whose not in scene.index:
        raise setting_error(key, name, no_such_ball(scene.index))
    if kind in ("roll", "friction.rolling") and not scene.surface.rolls:
        raise setting_error(key, name, NO_ROLLING)
    if kind == "friction.surface" and scene.is_tilted:
        raise setting_error(key, name, NO_FRICTION)
    if shot is not None and row.group == "velocity" and whose == shot.ball:
        message = "the shot gives the velocity of its ball: write speed or angle instead"
        raise setting_error(key, name, message)
    return row, whose


# -- values ----------------------------------------------------------------------------------------


def _part(scene: Scene, row: Input, whose: str) -> Any:
    if row.of == BALL:
        return scene.balls[scene.index[whose]]
    return scene.shots[int(whose) - 1] if row.of == SHOT else getattr(scene, row.group)


def input_value(scene: Scene, name: str) -> float:
    """Return an input's value in SI; an angle is in degrees.

    >>> from pool_pymunk import load
    >>> input_value(load("report"), "restitution.cue_ball"), input_value(load("report"), "angle.2")
    (0.7, 165.0)
    """
    kind, whose = parts(name)
    return float(TABLE[kind].read(_part(scene, TABLE[kind], whose)))


def with_inputs(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with these numbers instead of its own.

    If a ball is moved, the place to which a shot puts that ball moves by the same vector.
    Raises SceneError if the numbers make no valid scene.

    >>> from pool_pymunk import load
    >>> with_inputs(load("report"), {"speed.1": 3.0}).shots[0].velocity
    (-3.0, 0.0)
    """
    new: dict[tuple[str, str], Any] = {}
    coefficients: dict[str, dict[str, float]] = {"restitution": {}, "friction": {}}
    for name in sorted(values, key=lambda name: list(TABLE).index(parts(name)[0])):
        kind, whose = parts(name)
        row = TABLE[kind]
        if row.of == SCENE:  # All change at once: one may be a bound of another.
            coefficients[row.group][kind.split(".")[1]] = values[name]
        else:
            part = new.get((row.of, whose)) or _part(scene, row, whose)
            new[row.of, whose] = row.put(part, values[name])
    for k, shot in enumerate(scene.shots, start=1):
        ball = new.get((BALL, shot.ball))
        if shot.place is not None and ball is not None:
            was = _part(scene, TABLE["x"], shot.ball).position
            coordinates = zip(shot.place, ball.position, was, strict=True)
            moved = tuple(place + now - then for place, now, then in coordinates)
            new[SHOT, str(k)] = replace(new.get((SHOT, str(k)), shot), place=moved)
    return replace(
        scene,
        restitution=replace(scene.restitution, **coefficients["restitution"]),
        friction=replace(scene.friction, **coefficients["friction"]),
        balls=tuple(new.get((BALL, ball.id), ball) for ball in scene.balls),
        shots=tuple(new.get((SHOT, str(k)), s) for k, s in enumerate(scene.shots, start=1)),
    )


def starts_of(
    scene: Scene, names: Iterable[str], struck: int | None, velocity: Array,
    roll: Array | None = None, share: float | None = None,
) -> Array:  # fmt: skip
    """Return the derivatives (S, N, K, P) of the balls' states at the start, by these inputs.

    A state has place and velocity (K = 4), and the roll if balls roll (K = 6). ``velocity`` and
    ``roll`` (S, N, 2) are those of many shots at the start. The roll of the ``struck`` ball is this
    ``share`` of its velocity; if ``share`` is None, it follows from ``roll`` and ``velocity``.

    >>> from pool_pymunk import load
    >>> starts_of(load("two-balls"), ["vy.B"], None, np.zeros((1, 2, 2)))[0, 1, :, 0].tolist()
    [0.0, 0.0, 0.0, 1.0]
    """
    names, size = list(names), 4 if roll is None else 6
    found = np.zeros((*velocity.shape[:2], size, len(names)))
    if roll is not None:
        shares = share_of(velocity, roll, np.array([ball.roll for ball in scene.balls], float))
        if struck is not None:
            own = share_of(velocity[:, struck], roll[:, struck]) if share is None else share
            shares[:, struck] = own
    for p, name in enumerate(names):
        kind, whose = parts(name)
        row = TABLE[kind]
        i = scene.index[whose] if row.of == BALL else struck
        if row.start is None or i is None:
            continue
        for k, part in enumerate(row.start(*velocity[:, i].T)):
            if isinstance(part, np.ndarray) or part != 0.0:
                found[:, i, k, p] = part
        if roll is not None:
            turns = velocity[:, i] if kind == "roll" else shares[:, i, None] * found[:, i, 2:4, p]
            found[:, i, 4:, p] = turns
    return found


def changed_numbers(scene: Scene, names: Iterable[str], cue_ball: bool = False) -> list[Array]:
    """Return the derivatives of a scene's numbers by these inputs.

    They are those of the coefficients (7, P), of the masses (N, P) and of the radii (N, P). With
    ``cue_ball`` the cue ball has a restitution of its own, also where the scene gives it none.

    >>> from pool_pymunk import load
    >>> numbers, mass, _ = changed_numbers(load("two-balls"), ["mass.B", "friction.cushion"])
    >>> numbers[:, 1].tolist(), mass[:, 0].tolist()
    ([0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 1.0])
    """
    names, columns, count = list(names), column_of("coefficients"), len(scene.balls)
    numbers = np.zeros((len(columns), len(names)))
    sizes = {key: np.zeros((count, len(names))) for key in ("mass", "radius")}
    for p, name in enumerate(names):
        kind, whose = parts(name)
        if kind in sizes:
            sizes[kind][scene.index[whose], p] = 1.0
        elif kind in columns:
            is_of_surface = kind in ("friction.surface", "friction.rolling")
            numbers[columns[kind], p] = scene.physics.gravity if is_of_surface else 1.0
    if scene.restitution.cue_ball is None and not cue_ball:
        numbers[1] = numbers[0]  # The cue ball is as any other.
    return [numbers, *sizes.values()]


def share_of(velocity: Array, roll: Array, own: Any = None) -> Array:
    """Return rolls (..., 2) as shares (...) of velocities (..., 2); 0 for a roll that is no share.

    A roll is compared with its ball's ``own`` share, or else with its part along the velocity.

    >>> share_of(np.array([[2.0, 0.0], [2.0, 0.0]]), np.array([[-1.0, 0.0], [0.0, 1.0]])).tolist()
    [-0.5, 0.0]
    """
    if own is None:
        square = np.square(velocity).sum(axis=-1)
        own = (roll * velocity).sum(axis=-1) / np.where(square > 0.0, square, 1.0)
    usual = np.expand_dims(own, -1) * velocity
    most = NOISE * np.abs(usual).sum(axis=-1, keepdims=True)
    return np.where((np.abs(roll - usual) <= most).all(axis=-1), own, 0.0)


def in_units(units: Units, name: str, value: float) -> float:
    """Return an input's value (SI) in these units."""
    quantity = TABLE[parts(name)[0]].quantity
    return units.from_si(value, quantity)


def unit_of(units: Units, name: str) -> str:
    """Return the unit of an input: "" for a coefficient.

    >>> unit_of(Units(length="in"), "x.C"), unit_of(Units(), "angle.1")
    ('in', 'degrees')
    """
    quantity = TABLE[parts(name)[0]].quantity
    return str(getattr(units, quantity, SI[quantity]))


def in_words(units: Units, name: str, value: float) -> str:
    """Say in words that an input has a value (SI).

    >>> in_words(Units(), "restitution.cushion", 0.7), in_words(Units(mass="g"), "mass.8", 0.16)
    ('cushion restitution 0.7', 'mass of ball 8: 160 g')
    >>> in_words(Units(), "friction.ball_ball", 0.05), in_words(Units(), "speed.1", 2.0)
    ('ball-ball friction 0.05', 'speed 2 m/s')
    """
    kind, whose = parts(name)
    row, unit = TABLE[kind], unit_of(units, name)
    number = f"{in_units(units, name, value):g}{unit and f' {unit}'}"
    if row.of == BALL:
        return f"{kind} of ball {whose}: {number}"
    group, _, of = kind.partition(".")
    return f"{of.replace('_', '-')} {group} {number}" if of else f"{kind} {number}"


def differing(scene: Scene, other: Scene, shot: int = 1) -> tuple[list[str], list[str]]:
    """Say in words which inputs two scenes of the same balls have with different values.

    The inputs of a shot are those of this number. What one scene leaves out is not compared.
    """
    shots = [str(shot)] if min(len(scene.shots), len(other.shots)) >= shot else []
    mine, its = ([*chain(*names_in(each, shots).values())] for each in (scene, other))
    values = [(n, input_value(scene, n), input_value(other, n)) for n in mine if n in its]
    differ = [each for each in values if each[1] != each[2]]
    one = [in_words(scene.units, name, value) for name, value, _ in differ]
    return one, [in_words(scene.units, name, value) for name, _, value in differ]


# -- many shots ------------------------------------------------------------------------------------


def struck(velocity: Array, values: Mapping[str, Any]) -> Array:
    """Return velocities (S, 2) of the struck ball with another ``speed``, ``angle`` or ``turn``.

    A ball at rest has the angle 0, to which ``turn`` is added.

    >>> struck(np.array([[2.0, 0.0]]), {"speed": 3.0, "turn": np.array([90.0])}).round(9).tolist()
    [[0.0, 3.0]]
    """
    vx, vy = np.moveaxis(velocity, -1, 0)
    speed = values.get("speed", np.hypot(vx, vy))
    angle = np.radians(values["angle"]) if "angle" in values else np.arctan2(vy, vx)
    angle = angle + np.radians(values.get("turn", 0.0))
    return np.stack(np.broadcast_arrays(speed * np.cos(angle), speed * np.sin(angle)), axis=-1)


def rolled(
    scene: Scene, velocity: Array, ball: int | None, share: Any, carried: Any = None
) -> Array | None:
    """Return the rolls (S, N, 2) of balls with these velocities; None where balls do not roll.

    The struck ``ball`` has this ``share`` (S,). Others have their own, or the rolls ``carried``.
    """
    if not scene.surface.rolls:
        return None
    own = np.array([[each.roll] for each in scene.balls]) * velocity
    roll = own if carried is None else np.broadcast_to(carried, velocity.shape).copy()
    if ball is not None:
        roll[:, ball] = np.reshape(share, (-1, 1)) * velocity[:, ball]
    return roll
