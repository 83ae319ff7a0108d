"""This module names the numbers of a scene, reads them, and makes scenes with other numbers.

The names are those of :class:`~pool_pymunk.Derivatives`, but that speeds and angles are those of
one of several shots: ``"speed.2"`` is the speed of the second.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from pool_pymunk.model import Ball, Scene, Shot
from pool_pymunk.model.problems import listed, setting_error, suggestion
from pool_pymunk.model.units import Units

COEFFICIENTS = ("restitution", "friction")
OF_BALLS = ("x", "y", "vx", "vy", "mass", "radius")
OF_SHOTS = ("speed", "angle")
GROUPS = ("restitution", "friction", "position", "mass", "radius", *OF_SHOTS)
KINDS = {"mass": "mass", "speed": "speed", "vx": "speed", "vy": "speed"} | dict.fromkeys(
    ("x", "y", "radius"), "length"
)
Names = tuple[str, ...]


def parts(name: str) -> tuple[str, str]:
    """Return what a name means, and of what: ``("mass", "C")`` for ``"mass.C"``."""
    kind, _, whose = name.partition(".")
    return kind, whose


def input_names(scene: Scene, asked: str | Iterable[str], shots: Collection[int] = ()) -> Names:
    """Return the names of the inputs that are asked for, each once.

    A group stands for all of its names; "speed" and "angle" for those of the ``shots`` (from 1).
    Raises SettingError for a name that the scene does not have.

    >>> from pool_pymunk import load
    >>> input_names(load("two-balls"), ["restitution", "mass.A"])
    ('restitution.ball_ball', 'mass.A')
    """
    groups = _groups(scene, shots)
    known = [name for names in _groups(scene, range(1, len(scene.shots) + 1)).values()
             for name in names]  # fmt: skip
    if not isinstance(asked, Iterable):
        raise setting_error("free", asked, f"must be names, such as {', '.join(GROUPS)}")
    found: dict[str, None] = {}
    for name in [asked] if isinstance(asked, str) else asked:
        if name not in known and name not in groups:
            meant = suggestion(name, [*groups, *known])
            every = listed(known)
            raise setting_error("free", name, f"there is no such input (there are: {every}){meant}")
        found |= dict.fromkeys(groups.get(name, [name]))
    return tuple(found)


def _groups(scene: Scene, shots: Iterable[int]) -> dict[str, list[str]]:
    """Return the names that a scene has, group by group."""
    ids = [ball.id for ball in scene.balls]
    groups = {
        group: [
            f"{group}.{key}"
            for key in getattr(scene, group).__slots__
            if getattr(getattr(scene, group), key) is not None
        ]
        for group in COEFFICIENTS
    }
    groups["position"] = [f"{axis}.{id_}" for id_ in ids for axis in ("x", "y")]
    groups |= {kind: [f"{kind}.{id_}" for id_ in ids] for kind in ("mass", "radius")}
    if not scene.shots:
        return groups | {"velocity": [f"{axis}.{id_}" for id_ in ids for axis in ("vx", "vy")]}
    turned = [k for k in shots if scene.shots[k - 1].aim is None]
    return groups | {
        "speed": [f"speed.{k}" for k in shots],
        "angle": [f"angle.{k}" for k in turned],
    }


def input_value(scene: Scene, name: str) -> float:
    """Return an input's value, in SI, of an angle in degrees.

    >>> from pool_pymunk import load
    >>> input_value(load("report"), "restitution.cue_ball"), input_value(load("report"), "angle.2")
    (0.7, 165.0)
    """
    kind, whose = parts(name)
    if kind in COEFFICIENTS:
        return float(getattr(getattr(scene, kind), whose))
    if kind in OF_SHOTS:
        return _polar(scene.shots[int(whose) - 1])[kind]
    ball = scene.balls[scene.index[whose]]
    x, y = ball.position
    vx, vy = ball.velocity
    return {"x": x, "y": y, "vx": vx, "vy": vy, "mass": ball.mass, "radius": ball.radius}[kind]


def _polar(shot: Shot) -> dict[str, float]:
    """Return the speed (m/s) and the angle (degrees) of a shot; one that aims has no angle."""
    vx, vy = shot.velocity or (0.0, 0.0)
    return {
        "speed": math.hypot(vx, vy) if shot.speed is None else shot.speed,
        "angle": math.degrees(math.atan2(vy, vx)) if shot.angle is None else shot.angle,
    }


def with_inputs(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with these numbers instead of its own.

    Raises SceneError where they make no scene.

    >>> from pool_pymunk import load
    >>> with_inputs(load("report"), {"speed.1": 3.0}).shots[0].velocity
    (-3.0, 0.0)
    """
    by_kind: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        kind, whose = parts(name)
        by_kind.setdefault(kind, {})[whose] = value
    return replace(
        scene,
        restitution=replace(scene.restitution, **by_kind.get("restitution", {})),
        friction=replace(scene.friction, **by_kind.get("friction", {})),
        balls=tuple(_ball(ball, by_kind) for ball in scene.balls),
        shots=tuple(_shot(shot, str(k), by_kind) for k, shot in enumerate(scene.shots, start=1)),
    )


def _ball(ball: Ball, values: Mapping[str, Mapping[str, float]]) -> Ball:
    new = {kind: values[kind][ball.id] for kind in OF_BALLS if ball.id in values.get(kind, {})}
    if not new:
        return ball
    (x, y), (vx, vy) = ball.position, ball.velocity
    return replace(
        ball,
        position=(new.get("x", x), new.get("y", y)),
        velocity=(new.get("vx", vx), new.get("vy", vy)),
        mass=new.get("mass", ball.mass),
        radius=new.get("radius", ball.radius),
    )


def _shot(shot: Shot, number: str, values: Mapping[str, Mapping[str, float]]) -> Shot:
    new = {kind: values[kind][number] for kind in OF_SHOTS if number in values.get(kind, {})}
    if not new:
        return shot
    if shot.velocity is None:
        return replace(shot, speed=new.get("speed", shot.speed), angle=new.get("angle", shot.angle))
    if "angle" not in new:
        (vx, vy), scale = shot.velocity, new["speed"] / _polar(shot)["speed"]
        return replace(shot, velocity=(scale * vx, scale * vy))
    now = _polar(shot) | new
    angle = math.radians(now["angle"])
    return replace(shot, velocity=(math.cos(angle) * now["speed"], math.sin(angle) * now["speed"]))


def bounds(name: str) -> tuple[float, float]:
    """Return between which values an input makes sense.

    >>> bounds("restitution.cushion"), bounds("friction.surface"), bounds("x.C")
    ((0.0, 1.0), (0.0, inf), (-inf, inf))
    """
    kind, _ = parts(name)
    low = 0.0 if kind in (*COEFFICIENTS, "mass", "radius", "speed") else -math.inf
    return low, 1.0 if kind == "restitution" else math.inf


def size(scene: Scene, name: str) -> float:
    """Return the size of a change of an input that matters: its scale in a search."""
    kind, whose = parts(name)
    if kind in COEFFICIENTS:
        return 0.1
    if kind in ("x", "y"):
        return 0.1 * scene.balls[scene.index[whose]].radius
    return 1.0 if kind == "angle" else max(0.1 * abs(input_value(scene, name)), 1e-3)


def span(scene: Scene, name: str) -> tuple[float, float]:
    """Return the range in which a search looks for an input, around the scene's own number."""
    kind, whose = parts(name)
    own = input_value(scene, name)
    if kind == "restitution":
        return 0.2, 1.0
    if kind == "friction":
        return (own / 3.0, 3.0 * own) if whose == "surface" and own else (0.0, 0.4)
    if kind in ("mass", "radius", "speed"):
        return 0.8 * own, 1.25 * own
    wide = {"angle": 3.0, "vx": 0.2 * abs(own), "vy": 0.2 * abs(own)}
    reach = wide[kind] if kind in wide else 0.2 * scene.balls[scene.index[whose]].radius
    return own - reach, own + reach


def in_units(units: Units, name: str, value: float) -> float:
    """Return an input's value (SI) in these units."""
    kind = KINDS.get(parts(name)[0])
    return value if kind is None else units.from_si(value, kind)


def unit_of(units: Units, name: str) -> str:
    """Return the unit of an input: "" for a coefficient.

    >>> unit_of(Units(length="in"), "x.C"), unit_of(Units(), "angle.1")
    ('in', 'degrees')
    """
    kind = parts(name)[0]
    if kind == "angle":
        return "degrees"
    return str(getattr(units, KINDS[kind])) if kind in KINDS else ""
