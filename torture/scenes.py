"""This module has the scenes of the torture suite, each with a known answer and its source.

A scene is data and needs no simulator: a runner gets `plain()` as JSON, and `judge()` says how far
an answer is from the known one. Lengths are in m, speeds in m/s, masses in kg.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

GITHUB = "https://github.com"
G = 9.81  # m/s^2

Pair = tuple[float, float]
State = Sequence[Sequence[float]]  # x, y, vx, vy of each ball


class Ball(NamedTuple):
    """A ball has a place, a velocity, a radius and a mass."""

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    r: float = 0.03
    m: float = 0.17


class Check(NamedTuple):
    """A check says what is compared, the known answer, what counts as right, and its unit."""

    kind: str
    answer: Any
    tolerance: float
    unit: str = "m"


@dataclass(frozen=True)
class Scene:
    """A scene has a known answer.

    ``walls`` are the corners of a closed outline, anticlockwise; ``thin`` ones have no thickness.
    ``together`` says that several balls meet at one instant, and the answer is that of this. The
    states are judged at ``looks`` equally spaced times, up to ``time`` (s). The scene is played in
    this number of ``parts``, each from the end of the last. ``reverse`` plays it, turns all
    velocities round, and plays it again. Balls that roll start with a ``roll``, a share of their
    velocity. ``nudge`` asks for the derivatives of the last ball's end along x by every ball's x
    and vx, by central differences of that size. ``limit`` is the processor time (s) for one play.
    """

    name: str
    about: str
    known: str
    balls: tuple[Ball, ...]
    time: float
    checks: tuple[Check, ...]
    walls: tuple[Pair, ...] = ()
    restitution: float = 1.0
    wall_restitution: float = 1.0
    friction: float = 0.0
    rolling: float | None = None
    roll: float = 0.0
    gravity: float = 0.0
    thin: bool = False
    together: bool = False
    looks: int = 1
    parts: int = 1
    reverse: bool = False
    nudge: float = 0.0
    thread: str = ""
    timed: bool = False
    limit: int = 60

    @property
    def needs(self) -> tuple[str, ...]:
        """What a simulator must offer to play this."""
        upright = all(
            0.0 in (a[0] - b[0], a[1] - b[1])
            for a, b in zip(self.walls, self.walls[1:] + self.walls[:1], strict=True)
        )
        asked = {
            "restitution below 1": min(self.restitution, self.wall_restitution) < 1.0,
            "friction of sliding discs": self.friction > 0.0 and self.rolling is None,
            "balls that roll": self.rolling is not None,
            "gravity in the plane": self.gravity != 0.0,
            "any outline": not upright,
            "unequal masses": len({ball.m for ball in self.balls}) > 1,
            "hits of one instant": self.together,
            "unequal radii": len({ball.r for ball in self.balls}) > 1,
        }
        return tuple(need for need, is_asked in asked.items() if is_asked)

    def plain(self) -> dict[str, Any]:
        """Return all that a runner learns: everything except the answer."""
        numbers = {k: v for k, v in vars(self).items() if k not in ("about", "known", "checks")}
        kinds = {"touching": self._touch(), "in line": self._in_line()}
        return numbers | kinds | {"needs": self.needs}

    def _touch(self) -> bool:
        """Tell whether two balls touch at the start."""
        pairs = ((a, b) for i, a in enumerate(self.balls) for b in self.balls[:i])
        return any(abs(math.dist(a[:2], b[:2]) - a.r - b.r) < 1e-9 for a, b in pairs)

    def _in_line(self) -> bool:
        """Tell whether all balls lie and move on one line."""
        return len(self.balls) > 1 and len({(ball.y, ball.vy) for ball in self.balls}) == 1


# -- how far an answer is from the known one ---------------------------------------------------


def judge(scene: Scene, answer: dict[str, Any]) -> list[tuple[Check, float]]:
    """Return each check with the error of an answer: its states at the looks, or its gradient."""
    return [(check, _error(scene, check, answer)) for check in scene.checks]


def _error(scene: Scene, check: Check, answer: dict[str, Any]) -> float:
    if check.kind == "gradient":
        known = zip(answer["gradient"], check.answer, strict=True)
        return float(max(abs(a - b) for a, b in known))
    states: list[State] = answer["states"]
    if any(not math.isfinite(number) for row in states[-1] for number in row):
        return math.inf
    if check.kind == "overlap":
        return max(_overlap(scene, state) for state in states)
    if check.kind == "inside":
        return max(_outside(scene, state) for state in states)
    if check.kind == "energy":
        return abs(energy(scene, states[-1]) / energy(scene, _starts(scene)) - 1.0)
    if check.kind == "mirror":
        pairs = [(states[-1][i], states[-1][j]) for i, j in check.answer]
        return max(math.dist((a[0], a[1]), (b[0], -b[1])) for a, b in pairs)
    columns = slice(0, 2) if check.kind == "ends" else slice(2, 4)
    ends = [row[columns] for row in states[-1]]
    known = zip(ends, check.answer, strict=True)
    return float(max(math.dist(end, right) for end, right in known if right is not None))


def _starts(scene: Scene) -> State:
    return [ball[:4] for ball in scene.balls]


def energy(scene: Scene, state: State) -> float:
    """Return the kinetic energy of discs, and that of their heights (J)."""
    return sum(
        ball.m * ((vx * vx + vy * vy) / 2 - scene.gravity * y)
        for ball, (_, y, vx, vy) in zip(scene.balls, state, strict=True)
    )


def _overlap(scene: Scene, state: State) -> float:
    """Return how deep two balls are in each other, at most."""
    rows = [(row[0], row[1], ball.r) for row, ball in zip(state, scene.balls, strict=True)]
    pairs = [(a, b) for i, a in enumerate(rows) for b in rows[:i]]
    return max(max(0.0, a[2] + b[2] - math.dist(a[:2], b[:2])) for a, b in pairs)


def _outside(scene: Scene, state: State) -> float:
    """Return how far a ball's edge is beyond a wall, at most; the outline is convex."""
    worst = 0.0
    for (ax, ay), (bx, by) in zip(scene.walls, scene.walls[1:] + scene.walls[:1], strict=True):
        length = math.hypot(bx - ax, by - ay)
        for (x, y, *_), ball in zip(state, scene.balls, strict=True):
            inwards = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length
            worst = max(worst, ball.r - inwards)
    return worst


# -- closed forms ------------------------------------------------------------------------------


def box(length: float, width: float, x: float = 0.0, y: float = 0.0) -> tuple[Pair, ...]:
    """Return the corners of a rectangle whose lower left one is (x, y)."""
    return ((x, y), (x + length, y), (x + length, y + width), (x, y + width))


def bounced(start: float, speed: float, low: float, high: float, time: float) -> float:
    """Return where a point between two mirrors is, by a straight path that is folded."""
    unfolded = (start - low + speed * time) % (2 * (high - low))
    return low + min(unfolded, 2 * (high - low) - unfolded)


def in_box(ball: Ball, length: float, width: float, time: float) -> Pair:
    """Return where a lone ball in a rectangle from the origin is, e = 1."""
    return (
        bounced(ball.x, ball.vx, ball.r, length - ball.r, time),
        bounced(ball.y, ball.vy, ball.r, width - ball.r, time),
    )


def in_wedge(ball: Ball, half_angle: float, time: float) -> Pair:
    """Return where a lone ball in a wedge with its tip at the origin is, by an unfolded path."""
    tip = ball.r / math.sin(half_angle)  # The tip of the wedge of centres.
    x, y = ball.x - tip + ball.vx * time, ball.y + ball.vy * time
    angle = bounced(math.atan2(y, x), 0.0, -half_angle, half_angle, 0.0)
    return tip + math.hypot(x, y) * math.cos(angle), math.hypot(x, y) * math.sin(angle)


def elastic(m: float, v: float, other_m: float, other_v: float) -> Pair:
    """Return both velocities after a head-on hit with e = 1."""
    common = (m * v + other_m * other_v) / (m + other_m)
    return 2 * common - v, 2 * common - other_v


def pi_velocities(light: float, heavy: float) -> tuple[float, float, int]:
    """Return both last velocities, and the number of hits, of Galperin's balls and a wall."""
    v, big, hits = 0.0, -1.0, 0
    while v > big or v < 0.0:
        if v > big:
            v, big = elastic(light, v, heavy, big)
        else:
            v = -v
        hits += 1
    return v, big, hits


def roll_on(speed: float, roll: float, mu: float, mu_roll: float) -> float:
    """Return how far a ball moves along its line: it slides, then rolls, then rests."""
    slip, rolls_at = speed - roll, speed - 2 / 7 * (speed - roll)
    slides = 2 / 7 * abs(slip) / (mu * G)
    return (speed + rolls_at) / 2 * slides + rolls_at**2 / (2 * mu_roll * G)


def rack(x: float, y: float, gap: float = 0.0, r: float = 0.03, along: Pair = (1, 0)) -> list[Ball]:
    """Return fifteen balls in a triangle whose tip is at (x, y) and which opens along ``along``."""
    step, (a, b) = (2 + gap) * r, along
    places = [
        (k * step * math.sqrt(0.75), (j - k / 2) * step) for k in range(5) for j in range(k + 1)
    ]
    return [Ball(x + a * u - b * w, y + b * u + a * w, r=r) for u, w in places]


def mirrored(balls: Sequence[Ball]) -> tuple[Pair, ...]:
    """Return the pairs of balls (by number) that mirror each other in the x axis."""
    return tuple(
        (i, j)
        for i, a in enumerate(balls)
        for j, b in enumerate(balls)
        if math.dist((a.x, a.y), (b.x, -b.y)) < 1e-9
    )


# -- the scenes --------------------------------------------------------------------------------

KEPT = Check("energy", None, 0.02, "of E")  # 2 % of energy is 1 % of speed.

FAST = Ball(0.4, 0.5, 100.0, 7.0)
TOUCHING = (  # The two on the right touch each other, and both touch the first one at once.
    Ball(-0.5, 0.0, 1.0),
    Ball(0.0, 0.03),
    Ball(0.0, -0.03),
)
RACK = (Ball(-0.6, 0.0, 3.0), *rack(0.3, 0.0))
CRADLE = (Ball(-0.5, 0.0, 1.0), *(Ball(0.06 * k, 0.0) for k in range(5)))
WEDGE = Ball(3.0, 0.1, -1.0, 0.02)
MIRROR = tuple(  # No ball is on the axis, so every hit is of two balls.
    Ball(x, side * y, vx, side * vy)
    for x, y, vx, vy in (
        (-1.0, 0.3, 2.0, -0.1),
        (0.0, 0.24, 0.0, 0.0),
        (0.3, 0.1, 0.0, 0.0),
        (0.6, 0.35, 0.0, 0.0),
    )
    for side in (1, -1)
)
SIX = (
    Ball(0.5, 0.6, 4.0, 0.15),
    Ball(1.5, 0.635),
    Ball(1.62, 0.7),
    Ball(1.64, 0.56),
    Ball(1.9, 0.65),
    Ball(2.1, 0.3),
)
# The places (m) of `SIX` after 2 s, in forty digits (tests/oracle/reference.py);
# tests/test_torture.py computes them anew.
SIX_ENDS = (
    (1.44122631104375061, 0.929414110556115874),
    (1.9412329216008767, 0.305649623903262667),
    (1.62, 0.7),
    (1.64, 0.56),
    (1.874297236299658, 0.0635624828980220188),
    (2.50816199634496953, 1.21520200375483121),
)
GAS = tuple(
    Ball(0.15 + 0.23 * (k % 4), 0.2 + 0.3 * (k // 4), math.cos(2.4 * k), math.sin(2.4 * k))
    for k in range(10)
)
CORNER = Ball(1.0, 1.0, math.sqrt(2.0), math.sqrt(2.0), 0.028575)
LIGHT, HEAVY = 1e-3, 1e3  # kg
THREE = (Ball(-0.5, 0.0, 1.0), Ball(0.0, 0.0), Ball(0.9, 0.0, -0.6))
BREAK = (  # The thread's direction, and the speed that its cue gives to the ball.
    Ball(0.4953, 0.4953, 5.0 * math.cos(1.428286), 5.0 * math.sin(1.428286), 0.028575),
    *rack(0.4953, 1.4859, 1e-3, 0.028575, (0.0, 1.0)),
)
RIGHT_ANGLE = "closed form: a straight path, folded at the walls"
MOMENTUM = "closed form: momentum, energy and symmetry leave one answer"
SYMMETRY = "symmetry: what is mirrored stays mirrored"


def graze(share: float) -> tuple[tuple[Ball, ...], tuple[Pair, Pair]]:
    """Return a hit whose overlap is this share of the diameter, and both velocities after it."""
    across = 0.06 * (1 - share)
    n = (math.sqrt(0.06**2 - across**2) / 0.06, across / 0.06)
    given = (n[0] * n[0], n[0] * n[1])
    return (Ball(-0.5, 0.0, 1.0), Ball(0.0, across)), ((1 - given[0], -given[1]), given)


def elastic_scenes() -> list[Scene]:
    """Return the scenes without friction, of equal balls, with e = 1."""
    around = box(2.54, 1.27, -1.27, -0.635)
    thin, skim = graze(1e-3), graze(1e-9)
    exit_speed = 2 * math.sqrt(3) / 5
    split = ((-0.2, 0.0), (exit_speed * math.cos(math.pi / 6), exit_speed / 2))
    pair = (split[0], split[1], (split[1][0], -split[1][1]))
    still = ((0.0, 0.0),) * 5
    return [
        Scene(
            "fast ball, thin walls", "at 100 m/s in a room of walls without thickness",
            RIGHT_ANGLE, (FAST,), 0.5, thin=True, walls=box(2.0, 1.0),
            checks=(Check("inside", None, 0.03), KEPT), looks=50,
        ),
        Scene(
            "fast ball, ball at rest", "a ball at 100 m/s hits another one head-on", MOMENTUM,
            (Ball(0.0, 0.0, 100.0), Ball(1.0, 0.0)), 0.05,
            (Check("velocities", ((0.0, 0.0), (100.0, 0.0)), 1.0, "m/s"),),
        ),
        Scene(
            "three balls at once", "a ball hits two that touch, both at one instant", MOMENTUM,
            TOUCHING, 1.0, (Check("velocities", pair, 0.01, "m/s"),), together=True,
        ),
        Scene(
            "Newton's cradle", "a ball hits five that touch in a row",
            "experiment and textbook: one comes, one goes", CRADLE, 1.0,
            (Check("velocities", (*still, (1.0, 0.0)), 0.01, "m/s"),),
        ),
        Scene(
            "frozen rack", "a break along the axis of fifteen balls that touch",
            "energy is kept", RACK, 0.5,
            (KEPT, Check("overlap", None, 3e-3)), walls=around,
            looks=50,
        ),
        Scene(
            "frozen rack, mirrored", "the same: the upper half mirrors the lower one", SYMMETRY,
            RACK, 0.5, (Check("mirror", mirrored(RACK), 0.01),), walls=around, together=True,
        ),
        Scene(
            "mirror", "two mirrored shots at mirrored balls, for three seconds", SYMMETRY,
            MIRROR, 3.0, (Check("mirror", mirrored(MIRROR), 0.01),), walls=around,
        ),
        Scene(
            "reversal", "two seconds forwards, all velocities reversed, two seconds more",
            "reversibility: it comes back to where it began", SIX[:4], 2.0,
            (Check("ends", tuple(ball[:2] for ball in SIX[:4]), 0.01),), walls=box(2.54, 1.27),
            reverse=True,
        ),
        Scene(
            "thin cut", "a ball hits the outer thousandth of another's width", MOMENTUM, thin[0],
            1.0, (Check("velocities", thin[1], 2e-3, "m/s"),),
        ),
        Scene(
            "graze", "a ball hits the outer billionth of another's width", MOMENTUM, skim[0], 1.0,
            (Check("velocities", skim[1], 2e-6, "m/s"),),
        ),
        Scene(
            "corner", "into a corner of a square: at one wall 1e-9 m before the other one",
            RIGHT_ANGLE, (CORNER._replace(y=1.0 + 1e-9),), 6.0,
            (Check("ends", (in_box(CORNER, 4.5, 4.5, 6.0),), 0.01),), walls=box(4.5, 4.5),
        ),
        Scene(
            "corner, both walls at once", "along the diagonal of a square table, to its corner",
            RIGHT_ANGLE, (CORNER,), 6.0, (
                Check("inside", None, 3e-3),
                Check("ends", (in_box(CORNER, 4.5, 4.5, 6.0),), 0.01),
            ), walls=box(4.5, 4.5), thread=f"{GITHUB}/ekiefl/pooltool/issues/217",
        ),
        Scene(
            "wedge", "a ball between walls that converge at 20 degrees", RIGHT_ANGLE, (WEDGE,),
            5.5, (Check("ends", (in_wedge(WEDGE, math.radians(10), 5.5),), 0.01),),
            walls=tuple((u, v * math.tan(math.radians(10))) for u, v in ((0, 0), (4, -4), (4, 4))),
        ),
        Scene(
            "e = 1, a thousand bounces", "a lone ball in a box, without gravity",
            "energy is kept", (Ball(0.5, 0.5, 1.9, 0.7),), 600.0,
            (KEPT,), walls=box(2.0, 1.0),
            thread=f"{GITHUB}/liabru/matter-js/issues/256",
        ),
        Scene(
            "e = 1, ten thousand contacts", "ten balls in a box", "energy is kept", GAS, 25.0,
            (KEPT,), walls=box(1.0, 1.0), parts=20,
        ),
        Scene(
            "gradient", "how the end of ball 2 depends on both places and speeds",
            "closed form: x = x1 + v1 T + 2 r, so 1, 0, 1, 0",
            (Ball(0.0, 0.0, 1.0, 0.0, 0.1, 1.0), Ball(0.52, 0.0, 0.0, 0.0, 0.1, 1.0)), 1.0,
            (Check("gradient", (1.0, 0.0, 1.0, 0.0), 0.05, ""),), nudge=1e-3,
            thread=f"{GITHUB}/keenon/nimblephysics/issues/97",
        ),
        Scene(
            "six balls", "a shot at five balls on a table, for two seconds", "forty digits", SIX,
            2.0, (Check("ends", SIX_ENDS, 0.01),), walls=box(2.54, 1.27), timed=True,
        ),
    ]  # fmt: skip


def special_scenes() -> list[Scene]:
    """Return the scenes that not every simulator can play."""
    light, heavy, _ = pi_velocities(LIGHT, HEAVY)
    hit = elastic(LIGHT, 0.0, HEAVY, 1.0)
    back = elastic(LIGHT, 1.0, HEAVY, 0.0)
    common = (sum(ball.vx for ball in THREE) / 3, 0.0)
    brake, meets = 0.2 * G, 0.5 - 0.06
    slid = (2.0**2 - 2 * brake * meets) / (2 * brake)
    roll = math.sqrt(1.5**2 - 2 * 0.01 * G * meets)
    follow = (meets + roll_on(0.0, roll, 0.2, 0.01), 0.5 + roll_on(roll, 0.0, 0.2, 0.01))
    stun = math.sqrt(2.0**2 - 2 * brake * meets)
    gained = 5 / 2 * (2.0 - stun)  # The roll that the cloth has given it by then.
    stop = (meets + roll_on(0.0, gained, 0.2, 0.01), 0.5 + roll_on(stun, 0.0, 0.2, 0.01))
    high = (Ball(0.0, 2.0, r=0.1), Ball(3.0, 2.0, r=0.1))
    floor = ((-2.0, 0.0), (5.0, 0.0), (5.0, 9.0), (-2.0, 9.0))
    return [
        Scene(
            "heavy on light", "1e6 to 1: the heavy ball hits the light one", MOMENTUM,
            (Ball(0.5, 0.0, m=LIGHT), Ball(0.0, 0.0, 1.0, m=HEAVY)), 1.0,
            (Check("velocities", ((hit[0], 0.0), (hit[1], 0.0)), 0.01, "m/s"),),
        ),
        Scene(
            "light on heavy", "1 to 1e6: the light ball hits the heavy one", MOMENTUM,
            (Ball(0.0, 0.0, 1.0, m=LIGHT), Ball(0.5, 0.0, m=HEAVY)), 1.0,
            (Check("velocities", ((back[0], 0.0), (back[1], 0.0)), 0.01, "m/s"),),
        ),
        Scene(
            "three digits of pi", "a light ball between a wall and one 1e6 times as heavy",
            "closed form: 3141 hits (Galperin 2003)",
            (Ball(0.5, 1.0, m=LIGHT), Ball(1.5, 1.0, -1.0, m=HEAVY)), 4.0,
            (Check("velocities", ((light, 0.0), (heavy, 0.0)), 0.01, "m/s"),),
            walls=box(10.0, 2.0),
        ),
        Scene(
            "inelastic collapse", "three balls in a row, e = 0.05: infinitely many hits",
            "closed form: e < 7 - 4 sqrt(3), so they go on together", THREE, 2.0,
            (Check("velocities", (common,) * 3, 0.01, "m/s"),), restitution=0.05,
        ),
        Scene(
            "slide to rest", "discs on a surface with friction: one hits another head-on",
            "closed form: v^2 / (2 mu g)", (Ball(0.0, 0.0, 2.0), Ball(0.5, 0.0)), 3.0,
            (Check("ends", ((meets, 0.0), (0.5 + slid, 0.0)), 0.01),), friction=0.2,
        ),
        Scene(
            "follow", "a ball that rolls hits another head-on, and follows it",
            "closed form: 5/7 and 2/7 of the speed", (Ball(0.0, 0.0, 1.5), Ball(0.5, 0.0)), 60.0,
            (Check("ends", tuple((x, 0.0) for x in follow), 0.01),), friction=0.2, rolling=0.01,
            roll=1.0,
        ),
        Scene(
            "stop shot", "the same by a ball that slides at first",
            "closed form: 5/7 and 2/7 of the speed", (Ball(0.0, 0.0, 2.0), Ball(0.5, 0.0)), 60.0,
            (Check("ends", tuple((x, 0.0) for x in stop), 0.01),), friction=0.2, rolling=0.01,
            thread=f"{GITHUB}/ekiefl/pooltool/pull/354",
        ),
        Scene(
            "balls pass through each other", "a break of balls that slide, then roll",
            "two balls are never in one place", BREAK, 6.0,
            (Check("overlap", None, 3e-3), Check("inside", None, 3e-3)),
            walls=box(0.9906, 1.9812), restitution=0.95, wall_restitution=0.85, friction=0.2,
            rolling=0.01, looks=600, timed=True, thread=f"{GITHUB}/ekiefl/pooltool/issues/154",
        ),
        Scene(
            "e = 1, dropped on a floor", "a ball bounces for a minute under gravity",
            "energy is kept", high[:1], 60.0, (KEPT,), walls=floor,
            gravity=-G, thread=f"{GITHUB}/dimforge/rapier/issues/97",
        ),
        Scene(
            "e = 1, two sizes dropped", "a ball and one five times its size, under gravity",
            "energy is kept, whatever the size", (high[0], Ball(3.0, 2.0, r=0.5)), 10.0,
            (KEPT,), walls=floor, gravity=-G,
            thread=f"{GITHUB}/liabru/matter-js/issues/13",
        ),
        Scene(
            "e = 1, a million contacts", "ten balls in a box, a hundred times as long",
            "energy is kept", GAS, 25.0, (KEPT,), walls=box(1.0, 1.0), parts=2000,
            limit=900,
        ),
    ]  # fmt: skip


SCENES = [*elastic_scenes(), *special_scenes()]
