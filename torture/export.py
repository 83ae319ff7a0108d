"""Make `scenes.json` of the row "known answers" of the stability study: `python -m torture.export`.

This module says what each scene is, and what counts as right. Numbers and answers are those of
`pool_pymunk/studies/stability/known.py`. Three scenes are written here alone: two have gravity in
the plane, which no table has, and one asks for a derivative.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from pool_pymunk import Scene
from pool_pymunk.studies.stability import Case
from pool_pymunk.studies.stability.claims import Stated
from pool_pymunk.studies.stability.known import G, M, known_answers
from torture.scenes import FILE

GITHUB = "https://github.com"
UNITS = {"velocities": "m/s", "energy": "of E", "gradient": ""}  # The others are lengths, in m.
CLAIMS = {"velocities": "leave_with", "ends": "end_at"}

UNFOLDED = "closed form: a straight path, folded at the walls"
MOMENTUM = "closed form: momentum, energy and symmetry leave one answer"
SYMMETRY = "symmetry: what is mirrored stays mirrored"
SEVENTHS = "closed form: 5/7 and 2/7 of the speed"
KEPT = {"energy": 0.02}  # 2 % of energy is 1 % of speed.

# Each row has a scene's name, what it is, how its answer is known, within which errors it is right
# (m, m/s, shares of E), and what else a runner is told. Its case has the same name, or a "case".
Row = tuple[str, str, str, dict[str, float], dict[str, Any]]
PLAYED: tuple[Row, ...] = (
    ("fast ball, thin walls", "at 100 m/s in a room of walls without thickness", UNFOLDED,
     {"inside": 0.03, **KEPT}, {"thin": True, "looks": 50}),
    ("fast ball, ball at rest", "a ball at 100 m/s hits another one head-on", MOMENTUM,
     {"velocities": 1.0}, {}),
    ("three balls at once", "a ball hits two that touch, both at one instant", MOMENTUM,
     {"velocities": 0.01}, {"together": True}),
    ("Newton's cradle", "a ball hits five that touch in a row",
     "experiment and textbook: one comes, one goes", {"velocities": 0.01}, {}),
    ("frozen rack", "a break along the axis of fifteen balls that touch", "energy is kept",
     {**KEPT, "overlap": 3e-3}, {"looks": 50}),
    ("frozen rack, mirrored", "the same: the upper half mirrors the lower one", SYMMETRY,
     {"mirror": 0.01}, {"case": "frozen rack", "together": True}),
    ("mirror", "two mirrored shots at mirrored balls, for three seconds", SYMMETRY,
     {"mirror": 0.01}, {}),
    ("reversal", "two seconds forwards, all velocities reversed, two seconds more",
     "reversibility: it comes back to where it began", {"ends": 0.01}, {"reverse": True}),
    ("thin cut", "a ball hits the outer thousandth of another's width", MOMENTUM,
     {"velocities": 2e-3}, {}),
    ("graze", "a ball hits the outer billionth of another's width", MOMENTUM,
     {"velocities": 2e-6}, {}),
    ("corner", "into a corner of a square: at one wall 1e-9 m before the other one", UNFOLDED,
     {"ends": 0.01}, {}),
    ("corner, both walls at once", "along the diagonal of a square table, to its corner", UNFOLDED,
     {"inside": 3e-3, "ends": 0.01}, {"thread": f"{GITHUB}/ekiefl/pooltool/issues/217"}),
    ("wedge", "a ball between walls that converge at 20 degrees", UNFOLDED, {"ends": 0.01}, {}),
    ("e = 1, a thousand bounces", "a lone ball in a box, without gravity", "energy is kept", KEPT,
     {"thread": f"{GITHUB}/liabru/matter-js/issues/256"}),
    ("e = 1, ten thousand contacts", "ten balls in a box", "energy is kept", KEPT,
     {"case": "ten balls in a box", "parts": 20}),
    ("six balls", "a shot at five balls on a table, for two seconds", "forty digits",
     {"ends": 0.01}, {"timed": True}),
    ("heavy on light", "1e6 to 1: the heavy ball hits the light one", MOMENTUM,
     {"velocities": 0.01}, {}),
    ("light on heavy", "1 to 1e6: the light ball hits the heavy one", MOMENTUM,
     {"velocities": 0.01}, {}),
    ("three digits of pi", "a light ball between a wall and one 1e6 times as heavy",
     "closed form: 3141 hits (Galperin 2003)", {"velocities": 0.01}, {}),
    ("inelastic collapse", "three balls in a row, e = 0.05: infinitely many hits",
     "closed form: e < 7 - 4 sqrt(3), so they go on together", {"velocities": 0.01}, {}),
    ("slide to rest", "discs on a surface with friction: one hits another head-on",
     "closed form: v^2 / (2 mu g)", {"ends": 0.01}, {}),
    ("follow", "a ball that rolls hits another head-on, and follows it", SEVENTHS,
     {"ends": 0.01}, {}),
    ("stop shot", "the same by a ball that slides at first", SEVENTHS, {"ends": 0.01},
     {"thread": f"{GITHUB}/ekiefl/pooltool/pull/354"}),
    ("balls pass through each other", "a break of balls that slide, then roll",
     "two balls are never in one place", {"overlap": 3e-3, "inside": 3e-3},
     {"looks": 600, "timed": True, "thread": f"{GITHUB}/ekiefl/pooltool/issues/154"}),
    ("e = 1, a million contacts", "ten balls in a box, a hundred times as long", "energy is kept",
     KEPT, {"case": "ten balls in a box", "parts": 2000, "limit": 900}),
)  # fmt: skip


def scenes() -> Iterator[dict[str, Any]]:
    """Yield all scenes as they stand in the file."""
    cases = {case.label: case for case in known_answers()}
    for name, about, known, right, more in PLAYED:
        case = cases[more.get("case", name)]
        checks = [
            [kind, answer(case, kind), within, UNITS.get(kind, "m")]
            for kind, within in right.items()
        ]
        told = {key: value for key, value in more.items() if key != "case"}
        head = {"name": name, "about": about, "known": known}
        yield head | plain(case.scene) | {"checks": checks} | told
        if name == "e = 1, ten thousand contacts":
            yield GRADIENT
        if name == "balls pass through each other":
            yield from (DROPPED, TWO_SIZES)


def plain(scene: Scene) -> dict[str, Any]:
    """Return the numbers of a scene; what is left out is as in a scene without it."""
    balls, rubs = scene.balls, scene.friction
    table = scene.table.outline if scene.table else ()
    numbers = {
        "balls": [[*ball.position, *ball.velocity, ball.radius, ball.mass] for ball in balls],
        "time": scene.physics.max_time,
        "walls": [list(corner) for corner in table],
        "restitution": scene.restitution.ball_ball,
        "wall_restitution": scene.restitution.cushion,
        "friction": rubs.surface,
        "rolling": rubs.rolling,
        "roll": balls[0].roll,
    }
    left_out = {"walls": [], "friction": 0.0, "rolling": None, "roll": 0.0}
    return {key: value for key, value in numbers.items() if left_out.get(key, ...) != value}


def answer(case: Case, kind: str) -> Any:
    """Return the known answer of a case: what its claim states, or what its start does."""
    claims = {one.measure.__name__: one for one in case.claims if isinstance(one, Stated)}
    stated = claims.get(CLAIMS.get(kind, ""))
    if stated is not None:
        return [list(vector) for vector in stated.about[0].values()]
    starts = [ball.position for ball in case.scene.balls]
    if kind == "ends":  # Nothing is stated: the scene is played there and back.
        return [list(start) for start in starts]
    if kind == "mirror":
        return [[i, starts.index((x, -y))] for i, (x, y) in enumerate(starts)]
    return None


# -- what the study cannot play --------------------------------------------------------------------

GRADIENT = {
    "name": "gradient",
    "about": "how the end of ball 2 depends on both places and speeds",
    "known": "closed form: x = x1 + v1 T + 2 r, so 1, 0, 1, 0",
    "balls": [[0.0, 0.0, 1.0, 0.0, 0.1, 1.0], [0.52, 0.0, 0.0, 0.0, 0.1, 1.0]],
    "time": 1.0,
    "checks": [["gradient", [1.0, 0.0, 1.0, 0.0], 0.05, ""]],
    "nudge": 1e-3,
    "thread": f"{GITHUB}/keenon/nimblephysics/issues/97",
}
DROPPED = {
    "name": "e = 1, dropped on a floor",
    "about": "a ball bounces for a minute under gravity",
    "known": "energy is kept",
    "balls": [[0.0, 2.0, 0.0, 0.0, 0.1, M]],
    "time": 60.0,
    "checks": [["energy", None, 0.02, "of E"]],
    "walls": [[-2.0, 0.0], [5.0, 0.0], [5.0, 9.0], [-2.0, 9.0]],
    "gravity": -G,
    "thread": f"{GITHUB}/dimforge/rapier/issues/97",
}
TWO_SIZES = DROPPED | {
    "name": "e = 1, two sizes dropped",
    "about": "a ball and one five times its size, under gravity",
    "known": "energy is kept, whatever the size",
    "balls": [[0.0, 2.0, 0.0, 0.0, 0.1, M], [3.0, 2.0, 0.0, 0.0, 0.5, M]],
    "time": 10.0,
    "thread": f"{GITHUB}/liabru/matter-js/issues/13",
}


def text() -> str:
    """Return the file as the code has it, with a line for each scene."""
    return "[\n" + ",\n".join(map(json.dumps, scenes())) + "\n]\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
