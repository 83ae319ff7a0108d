"""Random scenes of hard contacts, and the data file with their answers in many digits.

``python -m tests.shared.hard_kinds`` makes ``tests/data/hard_runs.json`` anew from its seeds.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from mpmath import mp, mpc

from pool_pymunk import Scene, SceneError, Table
from tests import DATA
from tests.oracle.hard_reference import COARSE, HardRun, hard_run, off
from tests.oracle.reference import OUTLINES, Refused, scene_from_dict, scene_to_dict

KINDS = ("squeeze", "corner", "row", "slow", "packed", "moving", "persistent", "struck")
RECTANGLE, HEXAGON, L_SHAPE = (OUTLINES[name] or () for name in ("rectangle", "hexagon", "l-shape"))
WEDGE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.5))  # its corner at the origin has 27 degrees
LONG = ((-3.0, 0.0), (5.0, 0.0), (5.0, 3.0), (-3.0, 3.0))
FINISH = 20.0  # s

Outline = tuple[tuple[float, float], ...]
Row = tuple[float, float, float, float, float, float]  # x, y, vx, vy, radius, mass of a ball


def random_hard_scene(kind: str, rng: random.Random) -> Scene:
    """Return a scene of that kind; what it is like otherwise, chance decides."""
    makers: dict[str, Callable[[random.Random], Scene]] = {
        "squeeze": _squeeze,
        "corner": _corner,
        "row": _row,
        "slow": lambda r: _crowd(r, slow=True),
        "packed": _packed,
        "moving": lambda r: _crowd(r, slow=False),
        "persistent": _persistent,
        "struck": _struck_pair,
    }
    while True:
        try:
            return makers[kind](rng)
        except (SceneError, Refused):
            continue


def _scene(
    balls: Sequence[Row],
    outline: Outline | None,
    e: tuple[float, float | None, float],
    friction: tuple[float, float, float],
) -> Scene:
    """Return the scene of balls (x, y, vx, vy, radius, mass); ball 0 is the cue ball."""
    given = {"restitution": e, "friction": friction, "balls": balls, "outline": outline}
    return scene_from_dict({"law": "coulomb", "max_time": FINISH, **given})


def _random_e(rng: random.Random) -> tuple[float, float | None, float]:
    one, other, cushion = (rng.choice([0.0, round(rng.uniform(0, 0.9), 2)]) for _ in "abc")
    return one, rng.choice([None, other]), rng.choice([one, cushion])


def _random_friction(rng: random.Random) -> tuple[float, float, float]:
    return (
        round(rng.uniform(0.01, 0.3), 3),
        rng.choice([0.0, round(rng.uniform(0, 0.4), 2)]),
        rng.choice([0.0, round(rng.uniform(0, 0.4), 2)]),
    )


def _random_gap(rng: random.Random) -> float:
    return rng.choice([0.0, 0.0, 1e-9, 1e-6, 1e-4, 1e-2, 0.1]) * round(rng.uniform(0.3, 1), 3)


def _turned(balls: Iterable[Row], side: int) -> list[Row]:
    """Move balls from cushion 0 of a square, whose side is 2 m, to another of its cushions."""
    out = list(balls)
    for _ in range(side):
        out = [(2 - y, x, -vy, vx, r, m) for x, y, vx, vy, r, m in out]
    return out


SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))


def _squeeze(rng: random.Random) -> Scene:
    """Return a heavy ball that drives a light one to a cushion, head on or nearly so."""
    r, big = 0.0625, rng.choice([0.0625, 0.125])
    ratio = round(10 ** rng.uniform(1, 6), 1)
    below, between = _random_gap(rng), _random_gap(rng)
    aside = rng.choice([0.0, rng.uniform(-1, 1)]) * min(r, 2 * math.sqrt(r * (below + between)))
    up = math.sqrt((r + big) ** 2 - aside**2) + between if aside else r + big + between
    speed = round(10 ** rng.uniform(-1, 0.7), 3)
    drift = rng.choice([0.0, round(rng.uniform(-0.3, 0.3), 3)]) * speed
    balls = [(1 + aside, r + below + up, drift, -speed, big, 0.125 * ratio)]
    balls.append((1.0, r + below, 0.0, 0.0, r, 0.125))
    return _scene(_turned(balls, rng.randrange(4)), SQUARE, _random_e(rng), _random_friction(rng))


def _corner(rng: random.Random) -> Scene:
    """Return one ball that drives another into a corner: square, acute, or one that sticks out."""
    outline, corner, inwards = rng.choice(
        [
            (RECTANGLE, (0.0, 0.0), math.pi / 4),
            (WEDGE, (0.0, 0.0), math.atan2(1.5, 3) / 2),
            (HEXAGON, (1.1, 0.0), math.pi),
            (L_SHAPE, (0.9, 0.8), math.radians(-135)),
        ]
    )
    r, big = round(rng.uniform(0.02, 0.05), 3), round(rng.uniform(0.03, 0.07), 3)
    angle = inwards + rng.uniform(-0.3, 0.3)
    far = r * rng.uniform(1.1, 6)
    x, y = (c + far * d for c, d in zip(corner, (math.cos(angle), math.sin(angle)), strict=True))
    toward = angle + rng.uniform(-0.3, 0.3)
    gap = rng.choice([1e-6, 1e-3, 0.05, 0.2]) * rng.uniform(0.3, 1)
    bx, by = x + (r + big + gap) * math.cos(toward), y + (r + big + gap) * math.sin(toward)
    speed, course = 10 ** rng.uniform(-1, 0.5), toward + math.pi + rng.uniform(-0.1, 0.1)
    mass = round(0.1 * 10 ** rng.uniform(0, 3), 3)
    return _scene(
        [
            (bx, by, speed * math.cos(course), speed * math.sin(course), big, mass),
            (x, y, 0.0, 0.0, r, 0.1),
        ],
        outline,
        _random_e(rng),
        _random_friction(rng),
    )


def _row(rng: random.Random) -> Scene:
    """Return a row of two or three light balls between a heavy one and a cushion or a heavy one."""
    r, ratio = 0.0625, round(10 ** rng.uniform(0.5, 2.5), 1)
    gaps = [_random_gap(rng) for _ in range(rng.choice([2, 3]))]
    bend = rng.choice([0.0, 1e-3, 0.02])
    at = r + _random_gap(rng)
    balls = [(1.0, at, 0.0, 0.0, r, 0.125)]
    for gap in gaps:
        at += 2 * r + gap
        balls.append((1 + bend * rng.uniform(-1, 1), at, 0.0, 0.0, r, 0.125))
    if rng.random() < 0.3:
        balls[0] = (*balls[0][:5], 0.125 * ratio)
    x, y, *_ = balls.pop()
    balls.insert(0, (x, y, 0.0, -round(rng.uniform(0.1, 3), 3), r, 0.125 * ratio))
    return _scene(_turned(balls, rng.randrange(4)), SQUARE, _random_e(rng), _random_friction(rng))


def _crowd(rng: random.Random, slow: bool) -> Scene:
    """Return 3 to 9 balls of very different masses, most of them moving, slowly or not."""
    outline = rng.choice([RECTANGLE, HEXAGON, L_SHAPE])
    scale = 10 ** rng.uniform(-5, -1.5) if slow else 1.0
    friction = _random_friction(rng)
    wanted = rng.randint(3, 9)
    balls: list[Row] = []
    spread = rng.choice([0.2, 0.6, 1.0])
    table = Table(tuple(outline))
    while len(balls) < wanted:
        r = round(rng.uniform(0.02, 0.07), 4)
        x, y = (round(0.45 + spread * rng.uniform(-0.8, 1.2), 4) for _ in "xy")
        near = scale**2 / (20 * friction[0]) if slow else 0.0
        if balls and slow:
            ox, oy, _, _, other, _ = rng.choice(balls)
            turn, far = rng.uniform(-math.pi, math.pi), r + other + near * rng.uniform(0.1, 3)
            x, y = ox + far * math.cos(turn), oy + far * math.sin(turn)
        if any(math.dist((x, y), b[:2]) < r + b[4] + near / 20 for b in balls):
            continue
        if not table.contains(x, y) or any(edge.distance(x, y) <= r for edge in table.edges):
            if len(balls) < 2:
                balls = []
            continue
        speed, turn = scale * rng.uniform(0.1, 2), rng.uniform(-math.pi, math.pi)
        speed *= rng.random() < 0.8
        mass = round(0.05 * 10 ** rng.uniform(0, 3), 4)
        balls.append((x, y, speed * math.cos(turn), speed * math.sin(turn), r, mass))
    return _scene(balls, outline, _random_e(rng), friction)


def _packed(rng: random.Random) -> Scene:
    """Return a triangle of balls 2.02 to 2.3 radii apart, and a ball shot at it."""
    r = 0.03
    balls = [(0.5, 0.5 + rng.uniform(-0.02, 0.02), rng.uniform(0.5, 4), 0.0, r, 0.17)]
    for row in range(rng.choice([2, 3])):
        for k in range(row + 1):
            pitch = rng.uniform(2.02, 2.3) * r
            x = 0.9 + 2.3 * r * row * 0.9 + rng.uniform(-0.02, 0.02) * r
            balls.append((x, 0.5 + pitch * (k - row / 2), 0.0, 0.0, r, rng.choice([0.17, 1.7])))
    return _scene(balls, RECTANGLE, _random_e(rng), _random_friction(rng))


def _pair(
    rng: random.Random,
) -> tuple[list[Row], float]:
    """Return two balls, of which one catches up with the other at an angle, and surface friction.

    They go so slowly that friction can press them together against the turning of their normal.
    """
    surface = round(rng.uniform(0.05, 0.4), 3)
    r, other = round(rng.uniform(0.03, 0.07), 3), round(rng.uniform(0.03, 0.07), 3)
    along = rng.uniform(0.15, 0.8) * math.sqrt(surface * 9.8 * (r + other) / 2)
    aside, rest = along * rng.uniform(-1.2, 1.2), along * rng.uniform(-0.2, 0.2)
    extra = rng.choice([0.0, rng.uniform(0.01, 0.4)]) * along
    gap = rng.choice([0.0, 1e-6, 1e-4, 1e-3]) * rng.uniform(0.3, 1)
    turn = rng.choice([0.0, rng.uniform(-math.pi, math.pi)])
    c, s = math.cos(turn), math.sin(turn)

    def turned(x: float, y: float) -> tuple[float, float]:
        return c * x - s * y, s * x + c * y

    mass, mass_other = (round(0.1 * 10 ** rng.uniform(0, 1.5), 3) for _ in "ab")
    return [
        (0.0, 0.0, *turned(along + extra, aside), r, mass),
        (*turned(r + other + gap, 0.0), *turned(along, rest), other, mass_other),
    ], surface


def _persistent(rng: random.Random) -> Scene:
    """Return two balls that surface friction may press together, perhaps along a cushion."""
    balls, surface = _pair(rng)
    e, (_, cushion, mu) = _random_e(rng), _random_friction(rng)
    if rng.random() < 0.25:
        (x, y, vx, vy, r, m), (x2, y2, vx2, vy2, r2, m2) = balls
        low = min(y - r, y2 - r2)
        balls = [(1 + x, y - low, vx, vy, r, m), (1 + x2, y2 - low, vx2, vy2, r2, m2)]
        return _scene(balls, LONG, e, (surface, cushion, mu))
    return _scene(balls, None, e, (surface, cushion, mu))


def _struck_pair(rng: random.Random) -> Scene:
    """Return a pair that friction presses together, and a third ball that hits it meanwhile."""
    while True:
        balls, surface = _pair(rng)
        e, (_, cushion, mu) = _random_e(rng), _random_friction(rng)
        alone = hard_run(_scene(balls, None, e, (surface, cushion, mu)))
        if alone.persistent > 0.02:
            break
    until = float(alone.duration)
    r = round(rng.uniform(0.03, 0.07), 3)
    for _ in range(200):
        turn, speed = rng.uniform(-math.pi, math.pi), rng.uniform(0.2, 2)
        target = rng.choice(balls)
        t = rng.uniform(0.1, 0.8) * until
        far = target[4] + r + speed * t
        x, y = target[0] + 0.7 * t * target[2], target[1] + 0.7 * t * target[3]
        third = (
            x + far * math.cos(turn), y + far * math.sin(turn),
            -speed * math.cos(turn), -speed * math.sin(turn), r, 0.2,
        )  # fmt: skip
        scene = _scene([*balls, third], None, e, (surface, cushion, mu))
        run = hard_run(scene)
        if run.struck_while_persistent:
            return scene
    raise Refused("no third ball hits the pair while friction presses it together")


# -- the data file ---------------------------------------------------------------------------------

NUDGE = 1e-15  # m
MOST_AMPLIFIED = 1e5  # Scenes that amplify nudges more than so say little of a solver.
FOUND = (
    ("squeeze", 33),
    ("corner", 16),
    ("corner", 113),
    ("corner", 141),
    ("row", 7),
    ("row", 23),
)
CLEAR = 1e-15  # m; a coarser run that differs by more leaves the answer open
RECORDS = {
    "squeeze": 16,
    "corner": 6,
    "row": 6,
    "slow": 4,
    "packed": 4,
    "moving": 4,
    "persistent": 10,
    "struck": 5,
}


def amplification(scene: Scene, run: HardRun) -> float:
    """Return how much farther ends move than starts, from two nudges of every start."""
    rng = random.Random(0)
    worst = 1.0
    for _ in range(2):
        nudges = [NUDGE * mpc(rng.choice((-1, 1)), rng.choice((-1, 1))) for _ in run.final]
        worst = max(worst, off(hard_run(scene, nudges=nudges), run) / NUDGE)
    return worst


def is_hard(kind: str, run: HardRun) -> bool:
    """Tell whether the run has what its kind is about."""
    if kind == "persistent":
        return bool(run.persistent > 0.01)
    if kind == "struck":
        return run.struck_while_persistent > 0
    if kind in ("slow", "packed", "moving"):
        return run.hits >= 4
    return run.most_at_once >= 10 or run.hits >= 20


def answered(kind: str, scene: Scene) -> dict[str, Any] | None:
    """Return the scene's answer as it stands in the data file; None if it is not hard, or unclear.

    The answer is trusted as far as a run with coarser bounds agrees with it, times ten.
    """
    try:
        run = hard_run(scene)
        if not is_hard(kind, run):
            return None
        coarse = off(hard_run(scene, COARSE), run)
        amplified = amplification(scene, run)
    except Refused:
        return None
    if coarse > CLEAR:
        print(f"unclear by {coarse:.1e} m: {scene_to_dict(scene)}")
    if amplified > MOST_AMPLIFIED or coarse > CLEAR:
        return None
    return {
        "kind": kind,
        "scene": scene_to_dict(scene),
        "final": [[mp.nstr(x, 20) for x in (place.real, place.imag)] for place in run.final],
        "duration": mp.nstr(run.duration, 20),
        "hits": run.hits,
        "most_at_once": run.most_at_once,
        "pressed": float(run.persistent),
        "trusted": max(1e-19, 10 * coarse),
        "amplification": amplified,
    }


def made(kind: str, k: int) -> dict[str, Any]:
    """Make record ``k`` of that kind: the first hard scene from its seed that has an answer."""
    rng = random.Random(f"hard {kind} {k}")
    while True:
        answer = answered(kind, random_hard_scene(kind, rng))
        if answer is not None:
            return {"name": f"{kind} {k}", **answer}


def found(kind: str, k: int) -> dict[str, Any]:
    """Return one more record, by a search for scenes that a solver has wrong."""
    answer = answered(kind, random_hard_scene(kind, random.Random(f"found {kind} {k}")))
    if answer is None:
        raise Refused(f"found {kind} {k}")
    return {"name": f"found {kind} {k}", **answer}


def main() -> None:
    """Write the data file anew; it takes many minutes."""
    records = [made(kind, k) for kind, count in RECORDS.items() for k in range(count)]
    lines = [json.dumps(record) for record in records + [found(*one) for one in FOUND]]
    text = "[\n" + ",\n".join(lines) + "\n]\n"
    (DATA / "hard_runs.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
